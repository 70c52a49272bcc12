//! Data of drawing and reducing specific to a resolution; all else is shared between resolutions.

use super::item_buffer::ItemBuffer;
use super::memory::Memory;
use super::reduce::Reduce;
use super::render_targets::RenderTargets;
use crate::error::Error;
use crate::form_factor::resolution_policy;

/// Halvings of the resolution: each has item buffers of its own, and fewer pixels than with two
/// save no significant time.
const HALVINGS: u32 = 2;

/// Item buffers of a batch of hemicubes of one resolution, and the weights of their pixels.
#[derive(Debug)]
pub struct Resolution {
    /// Pixels along an edge of the top face.
    pub pixels: u32,
    pub targets: RenderTargets,
    /// Bindings of `reduce`.
    pub bindings: wgpu::BindGroup,
    /// Hemicubes drawn so far.
    pub drawn: u64,
}

impl Resolution {
    /// For `batch` hemicubes each: first `resolution`, then its halvings for patches with little
    /// light.
    pub fn halved(
        memory: &Memory,
        reduce: &Reduce,
        resolution: u32,
        batch: u32,
    ) -> Result<Vec<Resolution>, Error> {
        let halvings = 0..=HALVINGS;
        let mut pixels: Vec<u32> =
            halvings.map(|k| resolution_policy::halved(resolution, k)).collect();
        pixels.dedup();
        pixels.into_iter().map(|n| Resolution::new(memory, reduce, n, batch)).collect()
    }

    fn new(memory: &Memory, reduce: &Reduce, pixels: u32, batch: u32) -> Result<Resolution, Error> {
        let targets = RenderTargets::new(memory, ItemBuffer::FORMAT, [pixels, 3 * pixels], batch)?;
        Ok(Resolution { pixels, targets, bindings: reduce.bindings(memory, pixels)?, drawn: 0 })
    }
}
