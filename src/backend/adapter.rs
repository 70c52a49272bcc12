//! Description of the device that a backend runs on.

use std::fmt;

/// Name, kind and driver of a graphics adapter, or of the CPU.
///
/// Shown as `name, kind, driver`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AdapterInfo {
    /// Name as the driver gives it; `rays` for [`crate::Backend::Cpu`].
    pub name: String,
    /// Kind of processor.
    pub kind: AdapterKind,
    /// Driver name and version, and the interface (Vulkan, Metal, Dx12); `none` for rays.
    pub driver: String,
}

/// Kinds of processors, the fastest first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum AdapterKind {
    /// A graphics card with memory of its own.
    DiscreteGpu,
    /// A graphics processor that shares the memory of the CPU.
    IntegratedGpu,
    /// A graphics processor accessed through a virtual machine.
    VirtualGpu,
    /// The driver does not say.
    #[default]
    Other,
    /// A software rasterizer, such as lavapipe or WARP; or ray casting.
    Cpu,
}

impl fmt::Display for AdapterKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            AdapterKind::DiscreteGpu => "discrete GPU",
            AdapterKind::IntegratedGpu => "integrated GPU",
            AdapterKind::VirtualGpu => "virtual GPU",
            AdapterKind::Other => "other",
            AdapterKind::Cpu => "CPU",
        })
    }
}

impl fmt::Display for AdapterInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, {}, {}", self.name, self.kind, self.driver)
    }
}
