//! From the device back to memory, with the time that each stage took.

use std::time::Instant;

use super::device::Gpu;
use super::memory::Memory;
use crate::error::{Error, ErrorKind};

/// Time spent in the stages of drawing hemicubes, in seconds.
///
/// Draw and reduce are the device's own timestamps where it has them; else all is in `readback`,
/// which is the rest of the time from the call to finished results.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StageSeconds {
    /// Rendering hemicubes.
    pub draw: f64,
    /// Adding up pixel weights, the copy of the pixels to plain memory included.
    pub reduce: f64,
    /// Recording, waiting, copying and making results of what came back.
    pub readback: f64,
}

/// Memory that the device copies results to, and the clock of the stages before.
#[derive(Debug)]
pub struct Readback {
    staging: wgpu::Buffer,
    clock: Option<Clock>,
}

/// Timestamps: before drawing (query 0), after it (1) and after the reduction (2).
#[derive(Debug)]
struct Clock {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    seconds_per_tick: f64,
}

/// Room for the three ticks.
const TICKS: u64 = 24;

impl Readback {
    /// For results of up to `bytes`.
    pub fn new(memory: &Memory, bytes: u64) -> Result<Readback, Error> {
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        let staging = memory.buffer("staging", bytes.next_multiple_of(8) + TICKS, usage)?;
        let clock = memory.gpu.timestamps().then(|| Clock::new(memory)).transpose()?;
        Ok(Readback { staging, clock })
    }

    /// Where the stages write their timestamps, if the device has any.
    pub fn queries(&self) -> Option<&wgpu::QuerySet> {
        self.clock.as_ref().map(|c| &c.queries)
    }

    /// Runs what `encoder` recorded and gives the first `bytes` of `source` to `read`. Time is
    /// added to `seconds`; all since `start` that is neither drawing nor reduction is `readback`.
    pub fn finish<T>(
        &self,
        gpu: &Gpu,
        mut encoder: wgpu::CommandEncoder,
        (source, bytes): (&wgpu::Buffer, u64),
        (start, seconds): (Instant, &mut StageSeconds),
        read: impl FnOnce(&[u8]) -> T,
    ) -> Result<T, Error> {
        encoder.copy_buffer_to_buffer(source, 0, &self.staging, 0, bytes);
        let ticks = bytes.next_multiple_of(8);
        if let Some(clock) = &self.clock {
            encoder.resolve_query_set(&clock.queries, 0..3, &clock.resolved, 0);
            encoder.copy_buffer_to_buffer(&clock.resolved, 0, &self.staging, ticks, TICKS);
        }
        gpu.queue.submit([encoder.finish()]);

        let slice = self.staging.slice(..ticks + TICKS);
        let (sender, receiver) = std::sync::mpsc::channel();
        slice.map_async(wgpu::MapMode::Read, move |result| _ = sender.send(result));
        gpu.wait()?;
        let failed = |found: String| gpu.failed(ErrorKind::Device, found);
        if !matches!(receiver.try_recv(), Ok(Ok(()))) {
            return Err(failed("results could not be read back".into()));
        }
        let view = slice.get_mapped_range().map_err(|e| failed(e.to_string()))?;
        let result = read(&view[..bytes as usize]);
        let (draw, reduce) =
            self.clock.as_ref().map_or((0.0, 0.0), |c| c.read(&view[ticks as usize..]));
        drop(view);
        self.staging.unmap();
        seconds.draw += draw;
        seconds.reduce += reduce;
        seconds.readback += (start.elapsed().as_secs_f64() - draw - reduce).max(0.0);
        Ok(result)
    }
}

impl Clock {
    fn new(memory: &Memory) -> Result<Clock, Error> {
        let gpu = &memory.gpu;
        let queries = gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
            label: Some("clock"),
            ty: wgpu::QueryType::Timestamp,
            count: 3,
        });
        let usage = wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC;
        let resolved = memory.buffer("clock", TICKS, usage)?;
        let seconds_per_tick = f64::from(gpu.queue.get_timestamp_period()) * 1e-9;
        Ok(Clock { queries, resolved, seconds_per_tick })
    }

    /// Seconds of draw, and from there to the end of reduce.
    fn read(&self, bytes: &[u8]) -> (f64, f64) {
        let ticks: Vec<u64> = bytemuck::pod_collect_to_vec(&bytes[..TICKS as usize]);
        let span = |a: usize| ticks[a + 1].saturating_sub(ticks[a]) as f64 * self.seconds_per_tick;
        (span(0), span(1))
    }
}
