//! Usable limits of a device, and the requirements of the passes.

use super::error::place;
use crate::error::{Error, ErrorKind};

/// Maximum number of points of a batch: an H200 gets no faster beyond that.
pub const MAX_POINTS: u32 = 32_768;

/// Maximum limits requested of a device, where it has them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GpuLimits {
    /// Total bytes of device memory for buffers and textures. Batches are made smaller to stay
    /// within.
    pub memory: u64,
    /// Bytes of one buffer. It bounds elements and triangles: a row takes 4 bytes per element.
    pub buffer: u64,
    /// Pixels along an edge of a texture. It bounds resolutions: the item buffer of a hemicube is
    /// three times as high as its top face.
    pub texture: u32,
    /// Layers of a texture, one for each hemicube of a batch.
    pub layers: u32,
}

impl GpuLimits {
    /// No limits.
    pub const NONE: GpuLimits =
        GpuLimits { memory: u64::MAX, buffer: u64::MAX, texture: u32::MAX, layers: u32::MAX };

    /// The limits to request of an adapter with these `available` ones.
    pub(super) fn requested(&self, available: &wgpu::Limits) -> wgpu::Limits {
        // Those of WebGPU, except for textures, of which adapters without it support less.
        let min = wgpu::Limits {
            max_storage_buffers_per_shader_stage: 8,
            ..wgpu::Limits::downlevel_defaults()
        };
        let binding = available.max_storage_buffer_binding_size;
        wgpu::Limits {
            max_texture_dimension_2d: available.max_texture_dimension_2d.min(self.texture),
            max_texture_array_layers: min.max_texture_array_layers.min(self.layers),
            max_buffer_size: available.max_buffer_size.min(self.buffer),
            max_storage_buffer_binding_size: binding.min(self.buffer),
            ..min
        }
    }

    /// These limits, or those of a device where they are lower.
    pub(super) fn within(&self, device: &wgpu::Limits) -> GpuLimits {
        let buffer = device.max_storage_buffer_binding_size.min(device.max_buffer_size);
        GpuLimits {
            memory: self.memory,
            buffer: self.buffer.min(buffer),
            texture: self.texture.min(device.max_texture_dimension_2d),
            layers: self.layers.min(device.max_texture_array_layers),
        }
    }
}

/// Checks that a device on the named adapter was opened with sufficient limits for every pass.
///
/// # Errors
/// [`ErrorKind::Setting`] with the first limit that is too low.
pub fn check_device(adapter: &str, device: &wgpu::Limits) -> Result<(), Error> {
    let needs = [
        // `hemisphere_rays.wgsl`.
        ("max_storage_buffers_per_shader_stage", device.max_storage_buffers_per_shader_stage, 8),
        ("max_bindings_per_bind_group", device.max_bindings_per_bind_group, 8),
        ("max_bind_groups", device.max_bind_groups, 3),
        ("max_compute_workgroup_size_x", device.max_compute_workgroup_size_x, 64),
        ("max_compute_invocations_per_workgroup", device.max_compute_invocations_per_workgroup, 64),
        // Points of a batch.
        (
            "max_compute_workgroups_per_dimension",
            device.max_compute_workgroups_per_dimension,
            MAX_POINTS,
        ),
    ];
    for (limit, found, needed) in needs {
        if found < needed {
            let found = format!("a device opened with {limit} = {found}");
            let remedy = format!("open it with at least {needed}, as wgpu::Limits::default() does");
            return Err(Error::new(ErrorKind::Setting, place(adapter), found, remedy));
        }
    }
    Ok(())
}
