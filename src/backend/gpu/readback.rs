//! From the device back to memory, with the time that each pass took.
//!
//! ```text
//! tick 0 ─ draw ─ tick 1 ─ reduce ─ tick 2 ─ copy to staging ─ map ─ read
//! staging: results, padded to 8 bytes, then the three ticks
//! ```

use std::time::Instant;

use super::device::Gpu;
use super::memory::Memory;
use crate::error::{Error, ErrorKind};
use crate::progress::Timings;

/// Memory that the device copies results to, and the clock of the passes before.
#[derive(Debug)]
pub struct Readback {
    staging: wgpu::Buffer,
    clock: Option<Clock>,
}

/// The first bytes of a buffer that a pass has written.
#[derive(Clone, Copy, Debug)]
pub struct Results<'a> {
    pub buffer: &'a wgpu::Buffer,
    pub bytes: u64,
}

/// When work on a batch began, and the timings that it is added to.
#[derive(Debug)]
pub struct Timer<'a> {
    pub start: Instant,
    pub timings: &'a mut Timings,
}

/// Timestamps: before drawing (query 0), after it (1) and after the reduction (2).
#[derive(Debug)]
struct Clock {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    seconds_per_tick: f64,
}

/// Bytes of the three ticks.
const TICK_BYTES: u64 = 24;

impl Readback {
    /// For results of up to `bytes`.
    pub fn new(memory: &Memory, bytes: u64) -> Result<Readback, Error> {
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        let staging = memory.buffer("staging", bytes.next_multiple_of(8) + TICK_BYTES, usage)?;
        let clock = Clock::new(memory)?;
        Ok(Readback { staging, clock })
    }

    /// Where the passes write their timestamps, if the device has any.
    pub fn queries(&self) -> Option<&wgpu::QuerySet> {
        self.clock.as_ref().map(|c| &c.queries)
    }

    /// Runs what `encoder` recorded, gives the results' bytes to `read`, and stops the timer: what
    /// is neither drawing nor reduction is `readback`.
    pub fn finish<T>(
        &self,
        gpu: &Gpu,
        mut encoder: wgpu::CommandEncoder,
        source: Results,
        timer: Timer,
        read: impl FnOnce(&[u8]) -> T,
    ) -> Result<T, Error> {
        let Results { buffer, bytes } = source;
        encoder.copy_buffer_to_buffer(buffer, 0, &self.staging, 0, bytes);
        let ticks = bytes.next_multiple_of(8);
        if let Some(clock) = &self.clock {
            encoder.resolve_query_set(&clock.queries, 0..3, &clock.resolved, 0);
            encoder.copy_buffer_to_buffer(&clock.resolved, 0, &self.staging, ticks, TICK_BYTES);
        }
        gpu.queue.submit([encoder.finish()]);

        let slice = self.staging.slice(..ticks + TICK_BYTES);
        let (sender, receiver) = std::sync::mpsc::channel();
        slice.map_async(wgpu::MapMode::Read, move |result| _ = sender.send(result));
        gpu.wait()?;
        let failed = |found: String| gpu.device_error(ErrorKind::Device, found);
        if !matches!(receiver.try_recv(), Ok(Ok(()))) {
            return Err(failed("results could not be read back".into()));
        }
        let view = slice.get_mapped_range().map_err(|e| failed(e.to_string()))?;
        let result = read(&view[..bytes as usize]);
        let (draw, reduce) =
            self.clock.as_ref().map_or((0.0, 0.0), |c| c.read(&view[ticks as usize..]));
        drop(view);
        self.staging.unmap();
        let Timer { start, timings } = timer;
        timings.draw += draw;
        timings.reduce += reduce;
        timings.readback += (start.elapsed().as_secs_f64() - draw - reduce).max(0.0);
        Ok(result)
    }
}

impl Clock {
    /// The clock of a device that has one.
    fn new(memory: &Memory) -> Result<Option<Clock>, Error> {
        let device = &memory.device;
        if !device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            return Ok(None);
        }
        let queries = device.create_query_set(&wgpu::QuerySetDescriptor {
            label: Some("clock"),
            ty: wgpu::QueryType::Timestamp,
            count: 3,
        });
        let usage = wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC;
        let resolved = memory.buffer("clock", TICK_BYTES, usage)?;
        let seconds_per_tick = f64::from(memory.queue.get_timestamp_period()) * 1e-9;
        Ok(Some(Clock { queries, resolved, seconds_per_tick }))
    }

    /// Seconds of draw, and from there to the end of reduce.
    fn read(&self, bytes: &[u8]) -> (f64, f64) {
        let ticks: Vec<u64> = bytemuck::pod_collect_to_vec(&bytes[..TICK_BYTES as usize]);
        let span = |a: usize| ticks[a + 1].saturating_sub(ticks[a]) as f64 * self.seconds_per_tick;
        (span(0), span(1))
    }
}
