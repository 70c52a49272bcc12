//! Choosing a device, and turning its failures into the crate's error.

use std::sync::{Arc, Mutex};

use wgpu::util::DeviceExt;

use crate::error::{Error, ErrorKind};

/// What is known of a graphics adapter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Adapter {
    /// Name as the driver gives it.
    pub name: String,
    /// `discrete GPU`, `integrated GPU`, `virtual GPU`, `CPU` or `other`.
    pub kind: String,
    /// Driver name and version, and the interface (Vulkan, Metal, Dx12).
    pub driver: String,
}

/// An open graphics device.
#[derive(Clone, Debug)]
pub struct Gpu {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    adapter: Adapter,
    failure: Arc<Mutex<Option<String>>>,
}

const PACKAGES: &str = "install a Vulkan driver (Debian, Ubuntu: mesa-vulkan-drivers libvulkan1; \
     Fedora: mesa-vulkan-drivers vulkan-loader; software rendering included), \
     or make rows on the CPU (RayCast; --cpu in the examples)";

impl Gpu {
    /// Opens an adapter whose name contains `name` in any case, or the best there is: discrete
    /// before integrated before virtual before software.
    ///
    /// Without a `name`, wgpu's environment variables choose: `WGPU_ADAPTER_NAME` and
    /// `WGPU_BACKEND` (`vulkan`, `metal`, `dx12`).
    ///
    /// # Errors
    /// [`ErrorKind::Device`] when there is no such adapter; the message lists what there is, or
    /// names the packages that bring one.
    pub fn new(name: Option<&str>) -> Result<Gpu, Error> {
        let from_env = std::env::var("WGPU_ADAPTER_NAME").ok();
        let wanted = name.map(str::to_string).or(from_env).unwrap_or_default();
        let descriptor = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
        let backends = descriptor.backends;
        let instance = wgpu::Instance::new(descriptor);
        let mut found = pollster::block_on(instance.enumerate_adapters(backends));
        // A stable sort: among equals, the order of the driver loader.
        found.sort_by_key(|a| match a.get_info().device_type {
            wgpu::DeviceType::DiscreteGpu => 0,
            wgpu::DeviceType::IntegratedGpu => 1,
            wgpu::DeviceType::VirtualGpu => 2,
            wgpu::DeviceType::Other => 3,
            wgpu::DeviceType::Cpu => 4,
        });
        let names: Vec<String> = found.iter().map(|a| a.get_info().name).collect();
        let matches = |a: &String| a.to_lowercase().contains(&wanted.to_lowercase());
        let Some(index) = names.iter().position(matches) else {
            let (found, remedy) = match names.len() {
                0 => ("no graphics adapter".to_string(), PACKAGES.to_string()),
                _ => (
                    format!("no adapter with '{wanted}' in its name"),
                    format!("there are: {}", names.join(", ")),
                ),
            };
            return Err(Error::new(ErrorKind::Device, "graphics adapter", found, remedy));
        };
        Gpu::open(&found[index])
    }

    fn open(adapter: &wgpu::Adapter) -> Result<Gpu, Error> {
        let info = adapter.get_info();
        let has = adapter.limits();
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("radiosity"),
            required_features: adapter.features() & wgpu::Features::TIMESTAMP_QUERY,
            required_limits: wgpu::Limits {
                max_texture_dimension_2d: has.max_texture_dimension_2d,
                max_buffer_size: has.max_buffer_size,
                max_storage_buffer_binding_size: has.max_storage_buffer_binding_size,
                ..wgpu::Limits::downlevel_defaults()
            },
            ..Default::default()
        };
        let (device, queue) =
            pollster::block_on(adapter.request_device(&descriptor)).map_err(|e| {
                let place = format!("graphics adapter '{}'", info.name);
                let remedy = "choose another adapter, or update its driver";
                Error::new(ErrorKind::Device, place, e.to_string(), remedy).with_source(e)
            })?;
        let failure = Arc::new(Mutex::new(None));
        let first = failure.clone();
        device.on_uncaptured_error(Arc::new(move |e: wgpu::Error| note(&first, e.to_string())));
        let first = failure.clone();
        device.set_device_lost_callback(move |reason, message| {
            if reason != wgpu::DeviceLostReason::Destroyed {
                note(&first, format!("device lost: {message}"));
            }
        });
        let kind = match info.device_type {
            wgpu::DeviceType::DiscreteGpu => "discrete GPU",
            wgpu::DeviceType::IntegratedGpu => "integrated GPU",
            wgpu::DeviceType::VirtualGpu => "virtual GPU",
            wgpu::DeviceType::Cpu => "CPU",
            wgpu::DeviceType::Other => "other",
        };
        let driver = format!("{} {} ({:?})", info.driver, info.driver_info, info.backend);
        let adapter = Adapter { name: info.name, kind: kind.into(), driver };
        Ok(Gpu { device, queue, adapter, failure })
    }

    /// What the device runs on.
    pub fn adapter(&self) -> &Adapter {
        &self.adapter
    }

    /// The first thing that went wrong on the device since it was opened, if anything did.
    pub(super) fn check(&self) -> Result<(), Error> {
        let failure = self.failure.lock().unwrap_or_else(|e| e.into_inner());
        failure.as_ref().map_or(Ok(()), |found| Err(self.failed(found.clone())))
    }

    pub(super) fn failed(&self, found: String) -> Error {
        let place = format!("graphics adapter '{}'", self.adapter.name);
        let remedy = "try a smaller hemicube or fewer elements, another adapter, or the CPU";
        Error::new(ErrorKind::Device, place, found, remedy)
    }

    /// A buffer that shaders read as an array.
    pub(super) fn storage(&self, label: &str, contents: &[u8]) -> wgpu::Buffer {
        self.buffer(label, contents, wgpu::BufferUsages::STORAGE)
    }

    /// A buffer that shaders read as one value.
    pub(super) fn uniform(&self, label: &str, contents: &[u8]) -> wgpu::Buffer {
        self.buffer(label, contents, wgpu::BufferUsages::UNIFORM)
    }

    fn buffer(&self, label: &str, contents: &[u8], usage: wgpu::BufferUsages) -> wgpu::Buffer {
        let label = Some(label);
        self.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label, contents, usage })
    }

    pub(super) fn timestamps(&self) -> bool {
        self.device.features().contains(wgpu::Features::TIMESTAMP_QUERY)
    }
}

fn note(slot: &Mutex<Option<String>>, message: String) {
    slot.lock().unwrap_or_else(|e| e.into_inner()).get_or_insert(message);
}
