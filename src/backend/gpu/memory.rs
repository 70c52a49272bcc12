//! Backend memory: every buffer and texture is taken here, and counted.

use std::sync::atomic::{AtomicU64, Ordering};

use super::device::Gpu;
use crate::error::{Error, ErrorKind};

/// What one maker holds of a device's memory; given back when it goes.
#[derive(Debug)]
pub struct Memory {
    pub gpu: Gpu,
    held: AtomicU64,
}

impl Memory {
    /// Nothing yet.
    pub fn new(gpu: &Gpu) -> Memory {
        Memory { gpu: gpu.clone(), held: AtomicU64::new(0) }
    }

    /// A buffer of `bytes`.
    ///
    /// # Errors
    /// [`ErrorKind::Memory`] when that is more than is left.
    pub fn buffer(
        &self,
        label: &str,
        bytes: u64,
        usage: wgpu::BufferUsages,
    ) -> Result<wgpu::Buffer, Error> {
        self.take(label, bytes)?;
        Ok(self.gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: bytes,
            usage,
            mapped_at_creation: false,
        }))
    }

    /// A buffer that shaders read as an array.
    pub fn storage(&self, label: &str, contents: &[u8]) -> Result<wgpu::Buffer, Error> {
        self.filled(label, contents, wgpu::BufferUsages::STORAGE)
    }

    /// A buffer that shaders read as one value.
    pub fn uniform(&self, label: &str, contents: &[u8]) -> Result<wgpu::Buffer, Error> {
        self.filled(label, contents, wgpu::BufferUsages::UNIFORM)
    }

    fn filled(
        &self,
        label: &str,
        contents: &[u8],
        usage: wgpu::BufferUsages,
    ) -> Result<wgpu::Buffer, Error> {
        // Not `create_buffer_init`, which panics where there is no memory.
        let bytes = contents.len() as u64;
        let buffer = self.buffer(label, bytes, usage | wgpu::BufferUsages::COPY_DST)?;
        self.gpu.queue.write_buffer(&buffer, 0, contents);
        Ok(buffer)
    }

    /// A texture of one mip level.
    ///
    /// # Errors
    /// [`ErrorKind::Memory`] when that is more than is left.
    pub fn texture(
        &self,
        label: &str,
        size: [u32; 3],
        format: wgpu::TextureFormat,
        usage: wgpu::TextureUsages,
    ) -> Result<wgpu::Texture, Error> {
        let [width, height, depth_or_array_layers] = size;
        let texel = format.block_copy_size(None).unwrap_or(4);
        self.take(label, size.into_iter().chain([texel]).map(u64::from).product())?;
        Ok(self.gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size: wgpu::Extent3d { width, height, depth_or_array_layers },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage,
            view_formats: &[],
        }))
    }

    fn take(&self, what: &str, bytes: u64) -> Result<(), Error> {
        let Err(taken) = self.gpu.taken.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |t| {
            t.checked_add(bytes).filter(|sum| *sum <= self.gpu.memory)
        }) else {
            self.held.fetch_add(bytes, Ordering::Relaxed);
            return Ok(());
        };
        let most = self.gpu.memory;
        let found = format!("{bytes} bytes for {what} when {taken} of {most} are taken");
        Err(self.gpu.failed(ErrorKind::Memory, found))
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        self.gpu.taken.fetch_sub(self.held.load(Ordering::Relaxed), Ordering::Relaxed);
    }
}
