//! Device memory: creates every buffer and texture, and counts them against one budget.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use bytemuck::Pod;

use super::error::device_error;
use super::layout::TEXELS_PER_LINE;
use crate::error::{Error, ErrorKind};

/// Total byte limit for all users of a device, and bytes allocated.
#[derive(Debug)]
pub struct MemoryBudget {
    limit: u64,
    taken: AtomicU64,
}

impl MemoryBudget {
    /// A budget of `limit` bytes, none allocated.
    pub fn new(limit: u64) -> MemoryBudget {
        MemoryBudget { limit, taken: AtomicU64::new(0) }
    }

    /// Allocates `bytes`; the error is the number allocated where that exceeds the limit.
    fn take(&self, bytes: u64) -> Result<(), u64> {
        let add = |taken: u64| taken.checked_add(bytes).filter(|sum| *sum <= self.limit);
        self.taken.fetch_update(Ordering::Relaxed, Ordering::Relaxed, add).map(|_| ())
    }

    fn give_back(&self, bytes: u64) {
        self.taken.fetch_sub(bytes, Ordering::Relaxed);
    }
}

/// The buffers and textures of one user of a device; their bytes go back to the budget when it is
/// dropped.
#[derive(Debug)]
pub struct Memory {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    /// Name of the adapter, for errors.
    pub adapter: String,
    budget: Arc<MemoryBudget>,
    held: AtomicU64,
}

impl Memory {
    /// Without buffers or textures.
    pub fn new(
        device: wgpu::Device,
        queue: wgpu::Queue,
        adapter: String,
        budget: Arc<MemoryBudget>,
    ) -> Memory {
        Memory { device, queue, adapter, budget, held: AtomicU64::new(0) }
    }

    /// A buffer of `bytes`.
    ///
    /// # Errors
    /// [`ErrorKind::Memory`] when that exceeds the remaining budget.
    pub fn buffer(
        &self,
        label: &str,
        bytes: u64,
        usage: wgpu::BufferUsages,
    ) -> Result<wgpu::Buffer, Error> {
        self.take(label, bytes)?;
        Ok(self.device.create_buffer(&wgpu::BufferDescriptor {
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
        // Not `create_buffer_init`, which panics without memory.
        let bytes = contents.len() as u64;
        let buffer = self.buffer(label, bytes, usage | wgpu::BufferUsages::COPY_DST)?;
        self.queue.write_buffer(&buffer, 0, contents);
        Ok(buffer)
    }

    /// A texture of one mip level: width, height and layers.
    ///
    /// # Errors
    /// [`ErrorKind::Memory`] when that exceeds the remaining budget.
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
        Ok(self.device.create_texture(&wgpu::TextureDescriptor {
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

    /// A texture that shaders read as an array of any length, [`TEXELS_PER_LINE`] per line.
    pub fn lines(&self, label: &str, texels: &[[f32; 4]]) -> Result<wgpu::TextureView, Error> {
        let (padded, size) = padded_to_lines(texels);
        self.texels(label, &padded, size)
    }

    /// The same for words.
    pub fn words(&self, label: &str, words: &[u32]) -> Result<wgpu::TextureView, Error> {
        let (padded, size) = padded_to_lines(words);
        self.texels_of(label, &padded, size, wgpu::TextureFormat::R32Uint)
    }

    /// A texture of these texels, line by line, for shaders to read: width and height.
    ///
    /// # Errors
    /// [`ErrorKind::Memory`] when that exceeds the remaining budget.
    pub fn texels(
        &self,
        label: &str,
        texels: &[[f32; 4]],
        size: [u32; 2],
    ) -> Result<wgpu::TextureView, Error> {
        self.texels_of(label, texels, size, wgpu::TextureFormat::Rgba32Float)
    }

    fn texels_of<T: Pod>(
        &self,
        label: &str,
        texels: &[T],
        [width, height]: [u32; 2],
        format: wgpu::TextureFormat,
    ) -> Result<wgpu::TextureView, Error> {
        let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
        let texture = self.texture(label, [width, height, 1], format, usage)?;
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(size_of::<T>() as u32 * width),
            rows_per_image: None,
        };
        let bytes = bytemuck::cast_slice(texels);
        self.queue.write_texture(texture.as_image_copy(), bytes, layout, texture.size());
        Ok(texture.create_view(&Default::default()))
    }

    fn take(&self, label: &str, bytes: u64) -> Result<(), Error> {
        if let Err(taken) = self.budget.take(bytes) {
            let limit = self.budget.limit;
            let found = format!("{bytes} bytes for {label} when {taken} of {limit} are taken");
            return Err(device_error(&self.adapter, ErrorKind::Memory, found));
        }
        self.held.fetch_add(bytes, Ordering::Relaxed);
        Ok(())
    }
}

/// Texels padded to whole lines, at least one, and the number of columns and lines.
fn padded_to_lines<T: Pod>(texels: &[T]) -> (Vec<T>, [u32; 2]) {
    let line = TEXELS_PER_LINE as usize;
    let width = texels.len().clamp(1, line);
    let height = texels.len().div_ceil(line).max(1);
    let mut padded = texels.to_vec();
    padded.resize(width * height, T::zeroed());
    (padded, [width as u32, height as u32])
}

impl Drop for Memory {
    fn drop(&mut self) {
        self.budget.give_back(self.held.load(Ordering::Relaxed));
    }
}
