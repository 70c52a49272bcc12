//! Choice among the adapters of a machine.

use super::error::place;
use super::limits::GpuLimits;
use super::wait;
use crate::backend::adapter::{AdapterInfo, AdapterKind};
use crate::error::{Error, ErrorKind};

/// The adapter whose name contains `name` in any case, or the best: [`crate::Gpu::new`].
pub fn choose(name: Option<&str>) -> Result<wgpu::Adapter, Error> {
    wait::check()?;
    let from_env = std::env::var("WGPU_ADAPTER_NAME").ok();
    let wanted = name.map(str::to_string).or(from_env).unwrap_or_default();
    let descriptor = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
    let backends = descriptor.backends;
    let instance = wgpu::Instance::new(descriptor);
    let mut found = wait::block_on(instance.enumerate_adapters(backends));
    // A stable sort: ties keep the order of the driver loader.
    found.sort_by_key(|a| kind(a.get_info().device_type));
    let names: Vec<String> = found.iter().map(|a| a.get_info().name).collect();
    let matches = |a: &String| a.to_lowercase().contains(&wanted.to_lowercase());
    if let Some(index) = names.iter().position(matches) {
        return Ok(found.swap_remove(index));
    }
    let (found, remedy) = if names.is_empty() {
        let remedy = match cfg!(target_family = "wasm") {
            true => "take a browser with WebGPU, or use the CPU",
            false => {
                "install a Vulkan driver (Debian, Ubuntu: mesa-vulkan-drivers libvulkan1; \
                 Fedora: mesa-vulkan-drivers vulkan-loader; software rendering included), \
                 or make rows on the CPU (RayRows; --cpu in the examples)"
            }
        };
        ("no graphics adapter".to_string(), remedy.to_string())
    } else {
        let found = format!("no adapter with '{wanted}' in its name");
        (found, format!("there are: {}", names.join(", ")))
    };
    Err(Error::new(ErrorKind::Device, "graphics adapter", found, remedy))
}

/// Opens a device with `limits` as far as the adapter has them, and timestamps if available.
pub fn open(
    adapter: &wgpu::Adapter,
    limits: &GpuLimits,
) -> Result<(wgpu::Device, wgpu::Queue), Error> {
    let descriptor = wgpu::DeviceDescriptor {
        label: Some("radiosity"),
        required_features: adapter.features() & wgpu::Features::TIMESTAMP_QUERY,
        required_limits: limits.requested(&adapter.limits()),
        ..Default::default()
    };
    wait::block_on(adapter.request_device(&descriptor)).map_err(|e| {
        let remedy = "choose another adapter, or update its driver";
        let place = place(&adapter.get_info().name);
        Error::new(ErrorKind::Device, place, e.to_string(), remedy).with_source(e)
    })
}

/// Description of an adapter from wgpu.
pub fn describe(info: wgpu::AdapterInfo) -> AdapterInfo {
    let driver = format!("{} {} ({:?})", info.driver, info.driver_info, info.backend);
    // Some browsers keep names to themselves.
    let name = if info.name.is_empty() { "unnamed".into() } else { info.name };
    AdapterInfo { name, kind: kind(info.device_type), driver: driver.trim().into() }
}

fn kind(device: wgpu::DeviceType) -> AdapterKind {
    match device {
        wgpu::DeviceType::DiscreteGpu => AdapterKind::DiscreteGpu,
        wgpu::DeviceType::IntegratedGpu => AdapterKind::IntegratedGpu,
        wgpu::DeviceType::VirtualGpu => AdapterKind::VirtualGpu,
        wgpu::DeviceType::Other => AdapterKind::Other,
        wgpu::DeviceType::Cpu => AdapterKind::Cpu,
    }
}
