//! What of a device may be used.

/// The most that may be asked of a device; what it cannot do anyway is not asked either.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GpuLimits {
    /// Bytes of device memory that buffers and textures may take, all together. Batches are made
    /// smaller to stay within.
    pub memory: u64,
    /// Bytes of one buffer. It bounds elements and triangles: a row takes 4 bytes an element.
    pub buffer: u64,
    /// Pixels along an edge of a texture. It bounds resolutions: a hemicube is three times as high as
    /// its top face.
    pub texture: u32,
    /// RenderTargets of a texture, one for each hemicube of a batch.
    pub layers: u32,
}

impl GpuLimits {
    /// All that there is.
    pub const MOST: GpuLimits =
        GpuLimits { memory: u64::MAX, buffer: u64::MAX, texture: u32::MAX, layers: u32::MAX };

    /// What to ask of an adapter that has so much.
    pub(super) fn of(&self, has: &wgpu::Limits) -> wgpu::Limits {
        let least = wgpu::Limits::downlevel_defaults();
        wgpu::Limits {
            max_texture_dimension_2d: has.max_texture_dimension_2d.min(self.texture),
            max_texture_array_layers: least.max_texture_array_layers.min(self.layers),
            max_buffer_size: has.max_buffer_size.min(self.buffer),
            max_storage_buffer_binding_size: has.max_storage_buffer_binding_size.min(self.buffer),
            ..least
        }
    }
}
