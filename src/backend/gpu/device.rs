//! Choosing a device, and turning its failures into the crate's error.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use super::limits::GpuLimits;
use super::memory::Memory;
use crate::error::{Error, ErrorKind};

/// What is known of a graphics adapter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AdapterInfo {
    /// Name as the driver gives it.
    pub name: String,
    /// `discrete GPU`, `integrated GPU`, `virtual GPU`, `CPU` or `other`.
    pub kind: String,
    /// Driver name and version, and the interface (Vulkan, Metal, Dx12).
    pub driver: String,
}

/// An open graphics device. Clones are the same device.
#[derive(Clone, Debug)]
pub struct Gpu {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    adapter: AdapterInfo,
    /// Why the device is no more, or what went wrong where nobody was looking.
    lost: Arc<Mutex<Option<String>>>,
    /// Bytes of device memory that may be taken, and that are.
    pub(super) memory: u64,
    pub(super) taken: Arc<AtomicU64>,
}

/// A device that is this long over a batch does not answer. A batch takes a fraction of a second, on
/// slow devices seconds; drivers that watch over this give up earlier.
const PATIENCE: Duration = Duration::from_secs(120);

const PACKAGES: &str = "install a Vulkan driver (Debian, Ubuntu: mesa-vulkan-drivers libvulkan1; \
     Fedora: mesa-vulkan-drivers vulkan-loader; software rendering included), \
     or make rows on the CPU (RayRows; --cpu in the examples)";

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
        Gpu::within(name, &GpuLimits::MOST)
    }

    /// As [`Gpu::new`], but as if the device could do no more than `limits`: to leave room for others,
    /// or to see what becomes of a scene on a lesser device.
    ///
    /// # Errors
    /// Those of [`Gpu::new`].
    pub fn within(name: Option<&str>, limits: &GpuLimits) -> Result<Gpu, Error> {
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
        Gpu::open(&found[index], limits)
    }

    fn open(adapter: &wgpu::Adapter, limits: &GpuLimits) -> Result<Gpu, Error> {
        let info = adapter.get_info();
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("radiosity"),
            required_features: adapter.features() & wgpu::Features::TIMESTAMP_QUERY,
            required_limits: limits.of(&adapter.limits()),
            ..Default::default()
        };
        let (device, queue) =
            pollster::block_on(adapter.request_device(&descriptor)).map_err(|e| {
                let place = format!("graphics adapter '{}'", info.name);
                let remedy = "choose another adapter, or update its driver";
                Error::new(ErrorKind::Device, place, e.to_string(), remedy).with_source(e)
            })?;
        let lost = Arc::new(Mutex::new(None));
        let first = lost.clone();
        device.on_uncaptured_error(Arc::new(move |e: wgpu::Error| note(&first, described(&e))));
        let first = lost.clone();
        device.set_device_lost_callback(move |reason, message| {
            let why = match reason {
                wgpu::DeviceLostReason::Destroyed => "closed",
                _ => message.trim(),
            };
            note(&first, format!("the device was lost: {why}"));
        });
        let kind = match info.device_type {
            wgpu::DeviceType::DiscreteGpu => "discrete GPU",
            wgpu::DeviceType::IntegratedGpu => "integrated GPU",
            wgpu::DeviceType::VirtualGpu => "virtual GPU",
            wgpu::DeviceType::Cpu => "CPU",
            wgpu::DeviceType::Other => "other",
        };
        let driver = format!("{} {} ({:?})", info.driver, info.driver_info, info.backend);
        let adapter = AdapterInfo { name: info.name, kind: kind.into(), driver };
        let taken = Arc::new(AtomicU64::new(0));
        Ok(Gpu { device, queue, adapter, lost, memory: limits.memory, taken })
    }

    /// What the device runs on.
    pub fn adapter(&self) -> &AdapterInfo {
        &self.adapter
    }

    /// Gives the device back, whoever still uses it: they get [`ErrorKind::Device`] from now on.
    pub fn close(&self) {
        self.device.destroy();
    }

    /// Runs `work`, and gives what goes wrong on the device meanwhile as an error: that it was lost,
    /// before that it is out of memory, before that a use of it that is not valid, each of which is
    /// likely to bring about the next. The device stays usable unless it was lost.
    pub(super) fn attempt<T>(&self, work: impl FnOnce() -> Result<T, Error>) -> Result<T, Error> {
        use wgpu::ErrorFilter::{Internal, OutOfMemory, Validation};
        self.check()?;
        let scopes = [Internal, Validation, OutOfMemory].map(|f| self.device.push_error_scope(f));
        let result = work();
        // The last one first.
        let errors = scopes.into_iter().rev().filter_map(|scope| pollster::block_on(scope.pop()));
        let errors: Vec<wgpu::Error> = errors.collect();
        self.check()?;
        let Some(error) = errors.into_iter().next() else { return result };
        let kind = match error {
            wgpu::Error::OutOfMemory { .. } => ErrorKind::Memory,
            _ => ErrorKind::Device,
        };
        Err(self.failed(kind, described(&error)).with_source(error))
    }

    /// What `make` makes for as many of `batch` at once as there is memory for: half of them, and half
    /// again, where it is refused.
    pub(super) fn fit<T>(
        &self,
        mut batch: u32,
        make: impl Fn(Memory, u32) -> Result<T, Error>,
    ) -> Result<T, Error> {
        loop {
            match self.attempt(|| make(Memory::new(self), batch)) {
                Err(e) if e.kind() == ErrorKind::Memory && batch > 1 => {
                    batch /= 2;
                    // What was made in vain goes once what was to be written to it is through.
                    self.attempt(|| {
                        self.queue.submit([]);
                        self.wait()
                    })?;
                }
                made => return made,
            }
        }
    }

    /// Waits until all that was submitted is done.
    pub(super) fn wait(&self) -> Result<(), Error> {
        let poll = || {
            let timeout = Some(PATIENCE);
            self.device.poll(wgpu::PollType::Wait { submission_index: None, timeout })
        };
        self.check()?;
        // wgpu 30 panics when the device is lost while it is waited for.
        let waited = catch_unwind(AssertUnwindSafe(poll));
        self.check()?;
        let found = match waited {
            Ok(Ok(_)) => return Ok(()),
            Ok(Err(e)) => format!("no answer for {} s: {e}", PATIENCE.as_secs()),
            Err(_) => "the device was lost".into(),
        };
        note(&self.lost, found);
        self.check()
    }

    /// Whether the device is still there.
    fn check(&self) -> Result<(), Error> {
        let lost = self.lost.lock().unwrap_or_else(|e| e.into_inner()).clone();
        lost.map_or(Ok(()), |found| Err(self.failed(ErrorKind::Device, found)))
    }

    /// What went wrong on this device, and what may help.
    pub(super) fn failed(&self, kind: ErrorKind, found: String) -> Error {
        let place = format!("graphics adapter '{}'", self.adapter.name);
        let remedy = match kind {
            ErrorKind::Memory => "use a smaller hemicube, fewer elements, or the CPU",
            _ => "open it again, choose another adapter, or use the CPU",
        };
        Error::new(kind, place, found, remedy)
    }

    /// What this device answered, which no working one does.
    pub(super) fn wrong(&self, found: String) -> Error {
        let place = format!("graphics adapter '{}'", self.adapter.name);
        let remedy = "update its driver, choose another adapter, or use the CPU";
        Error::new(ErrorKind::Device, place, format!("it answered {found}"), remedy)
    }

    pub(super) fn timestamps(&self) -> bool {
        self.device.features().contains(wgpu::Features::TIMESTAMP_QUERY)
    }
}

/// An error of wgpu with its causes, in one line.
fn described(error: &wgpu::Error) -> String {
    let mut text = String::new();
    let mut next: Option<&dyn std::error::Error> = Some(error);
    while let Some(e) = next {
        let line = e.to_string();
        let line = line.split_whitespace().collect::<Vec<_>>().join(" ");
        if !text.contains(&line) {
            text += &if text.is_empty() { line } else { format!(": {line}") };
        }
        next = e.source();
    }
    text
}

fn note(slot: &Mutex<Option<String>>, message: String) {
    slot.lock().unwrap_or_else(|e| e.into_inner()).get_or_insert(message);
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use super::*;

    fn gpu() -> Option<Gpu> {
        let without = std::env::var_os("RADIOSITY_NO_GPU").is_some();
        (!without).then(|| Gpu::new(None).expect("a graphics adapter, or RADIOSITY_NO_GPU set"))
    }

    /// Memory that the host maps and shaders write does not exist.
    fn not_valid(gpu: &Gpu) -> Result<wgpu::Buffer, Error> {
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::STORAGE;
        Memory::new(gpu).buffer("odd", 16, usage)
    }

    #[test]
    fn what_is_not_valid_is_an_error_and_the_device_stays() {
        let Some(gpu) = gpu() else { return };
        let e = gpu.attempt(|| not_valid(&gpu)).unwrap_err();
        assert_eq!(e.kind(), ErrorKind::Device);
        assert!(e.to_string().contains("odd"), "names what it is about: {e}");
        assert!(std::error::Error::source(&e).is_some());
        assert_eq!(gpu.attempt(|| Ok(7)).unwrap(), 7);
    }

    #[test]
    fn what_goes_wrong_unseen_is_an_error_afterwards() {
        let Some(gpu) = gpu() else { return };
        not_valid(&gpu).unwrap();
        let e = gpu.wait().unwrap_err();
        assert!(e.kind() == ErrorKind::Device && e.to_string().contains("odd"), "{e}");
        assert!(gpu.attempt(|| Ok(())).is_err());
    }

    #[test]
    fn a_device_lost_under_way_is_an_error() {
        let Some(gpu) = gpu() else { return };
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        let result = gpu.attempt(|| {
            let buffer = Memory::new(&gpu).buffer("staging", 16, usage)?;
            buffer.slice(..).map_async(wgpu::MapMode::Read, |_| ());
            gpu.close();
            gpu.wait()
        });
        let e = result.unwrap_err();
        assert!(e.kind() == ErrorKind::Device && e.to_string().contains("lost: closed"), "{e}");
        let e = Memory::new(&gpu).uniform("late", &[0; 16]).and_then(|_| gpu.wait()).unwrap_err();
        assert!(e.to_string().contains("lost: closed"), "{e}");
    }

    #[test]
    fn batches_are_halved_until_there_is_memory() {
        let Some(gpu) = gpu() else { return };
        let tried = RefCell::new(vec![]);
        let most = |most: u32, kind: ErrorKind| {
            tried.borrow_mut().clear();
            gpu.fit(16, |_, batch| {
                tried.borrow_mut().push(batch);
                if batch > most { Err(gpu.failed(kind, "refused".into())) } else { Ok(batch) }
            })
        };
        assert_eq!(
            (most(3, ErrorKind::Memory).unwrap(), &tried.borrow()[..]),
            (2, &[16, 8, 4, 2][..])
        );
        assert_eq!(most(0, ErrorKind::Memory).unwrap_err().kind(), ErrorKind::Memory);
        assert_eq!(tried.borrow()[..], [16, 8, 4, 2, 1]);
        // Less of what fails for other reasons is no better.
        assert!(most(3, ErrorKind::Device).is_err() && tried.borrow()[..] == [16]);
    }

    #[test]
    fn memory_is_counted_and_given_back() {
        let Some(gpu) = gpu() else { return };
        let gpu = Gpu { memory: 1000, ..gpu };
        let usage = wgpu::BufferUsages::STORAGE;
        let memory = Memory::new(&gpu);
        memory.buffer("first", 600, usage).unwrap();
        let e = Memory::new(&gpu).buffer("second", 600, usage).unwrap_err();
        assert_eq!(e.kind(), ErrorKind::Memory);
        let text = e.to_string();
        assert!(text.contains("600 bytes for second when 600 of 1000 are taken"), "{text}");
        drop(memory);
        Memory::new(&gpu).buffer("second", 600, usage).unwrap();
    }
}
