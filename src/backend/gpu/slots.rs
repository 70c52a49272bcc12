//! Buffers of a gather: those of the batches in flight.

use super::layout::{GatherSettings, PointState, Sample, TracedPoint, WORK_HEADER_BYTES};
use super::memory::Memory;
use crate::error::Error;

/// Number of batches in flight: one is read while one runs and one is ready. With two the device
/// waits for the host between batches.
pub const IN_FLIGHT: usize = 3;

/// Buffers of the batches in flight: stored with the device, for all gatherers in turn.
#[derive(Debug)]
pub struct Slots {
    /// Initial contents of the first half of `Work`, with empty lists.
    pub no_work: wgpu::Buffer,
    pub slots: Vec<Slot>,
    /// Maximum number of points of a batch.
    pub points: u32,
    /// Maximum number of passes that cast rays of one half, and of those that follow paths.
    pub passes: [u32; 2],
    _memory: Memory,
}

/// Buffers of a batch, reused once its samples are read.
#[derive(Debug)]
pub struct Slot {
    pub points: wgpu::Buffer,
    pub states: wgpu::Buffer,
    pub samples: wgpu::Buffer,
    pub work: wgpu::Buffer,
    pub staging: wgpu::Buffer,
    /// One per preceding pass that cast rays of the same half.
    pub settings: Vec<wgpu::Buffer>,
    /// The same of passes that follow paths.
    pub path_settings: Vec<wgpu::Buffer>,
}

impl Slots {
    /// Slots for batches of up to this number of `points`, and `passes` as in [`Slots::passes`].
    pub fn new(memory: Memory, points: u32, passes: [u32; 2]) -> Result<Slots, Error> {
        use wgpu::BufferUsages as Usage;
        let header = [0u32, 1, 1, 0, 1, 1, 0, 0];
        let no_work =
            memory.buffer("no work", WORK_HEADER_BYTES, Usage::COPY_SRC | Usage::COPY_DST)?;
        memory.queue.write_buffer(&no_work, 0, bytemuck::cast_slice(&header));
        let room = u64::from(points);
        let storage = Usage::STORAGE | Usage::COPY_DST;
        let sample_bytes = room * size_of::<Sample>() as u64;
        let settings = |count: u32| {
            let settings = |_| memory.uniform("settings", &[0; size_of::<GatherSettings>()]);
            (0..count).map(settings).collect::<Result<_, Error>>()
        };
        let slot = |_| {
            Ok(Slot {
                points: memory.buffer("points", room * size_of::<TracedPoint>() as u64, storage)?,
                states: memory.buffer(
                    "states",
                    room * size_of::<PointState>() as u64,
                    Usage::STORAGE,
                )?,
                samples: memory.buffer(
                    "samples",
                    sample_bytes,
                    Usage::STORAGE | Usage::COPY_SRC,
                )?,
                work: memory.buffer(
                    "work",
                    WORK_HEADER_BYTES + 2 * room * 4,
                    storage | Usage::INDIRECT,
                )?,
                staging: memory.buffer(
                    "staging",
                    sample_bytes,
                    Usage::MAP_READ | Usage::COPY_DST,
                )?,
                settings: settings(passes[0])?,
                path_settings: settings(passes[1])?,
            })
        };
        let slots = (0..IN_FLIGHT).map(slot).collect::<Result<_, Error>>()?;
        Ok(Slots { no_work, slots, points, passes, _memory: memory })
    }
}
