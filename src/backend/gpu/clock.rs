//! Time of passes on the device.

use super::device::Gpu;
use super::memory::Memory;
use crate::error::Error;

/// Timestamps: before drawing (query 0), after it (1) and after the reduction (2).
#[derive(Debug)]
pub struct Clock {
    pub queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    staging: wgpu::Buffer,
    seconds_per_tick: f64,
}

impl Clock {
    /// None for a device without [`wgpu::Features::TIMESTAMP_QUERY`].
    pub fn new(memory: &Memory) -> Result<Option<Clock>, Error> {
        use wgpu::BufferUsages as Usage;
        let device = &memory.device;
        if !device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            return Ok(None);
        }
        let queries = device.create_query_set(&wgpu::QuerySetDescriptor {
            label: Some("clock"),
            ty: wgpu::QueryType::Timestamp,
            count: 3,
        });
        let bytes = 3 * size_of::<u64>() as u64;
        let resolved = memory.buffer("clock", bytes, Usage::QUERY_RESOLVE | Usage::COPY_SRC)?;
        let staging = memory.buffer("ticks", bytes, Usage::MAP_READ | Usage::COPY_DST)?;
        let seconds_per_tick = f64::from(memory.queue.get_timestamp_period()) * 1e-9;
        Ok(Some(Clock { queries, resolved, staging, seconds_per_tick }))
    }

    /// Records the copy of the timestamps to where [`Clock::seconds`] reads them, after all passes
    /// that write them.
    pub fn resolve(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.resolve_query_set(&self.queries, 0..3, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.staging, 0, None);
    }

    /// Seconds of drawing, and from there to the end of the reduction, in this submission: of an
    /// encoder that was passed to [`Clock::resolve`].
    pub fn seconds(
        &self,
        gpu: &Gpu,
        submission: wgpu::SubmissionIndex,
    ) -> Result<(f64, f64), Error> {
        let seconds = gpu.read_mapped(self.staging.slice(..), submission, |bytes| {
            let ticks: Vec<u64> = bytemuck::pod_collect_to_vec(bytes);
            let span =
                |a: usize| ticks[a + 1].saturating_sub(ticks[a]) as f64 * self.seconds_per_tick;
            (span(0), span(1))
        });
        self.staging.unmap();
        seconds
    }
}
