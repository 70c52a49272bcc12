//! Rows of either backend behind one type, with the time spent on them.

use super::cpu::RayRows;
#[cfg(feature = "gpu")]
use super::gpu::{HemicubeRows, TracedRows};
use super::row_maker::RowMaker;
use crate::error::Error;
use crate::form_factor::{FormFactors, Row};
use crate::mesh::{Mesh, NodeId};
use crate::progress::{Instant, Timings};

/// Form-factor rows of a [`crate::Backend`], made by [`crate::Backend::rows`].
#[derive(Debug)]
pub struct BackendRows {
    source: Box<dyn RowSource>,
    maker: RowMaker,
    seconds: f64,
}

/// Functions of the row makers of all backends beside making rows.
trait RowSource: FormFactors + std::fmt::Debug + Send + Sync {
    /// See [`BackendRows::with_full_share`].
    fn set_full_share(&mut self, full_share: f64);

    /// See [`BackendRows::drawn_by_resolution`].
    fn drawn_by_resolution(&self) -> Vec<(u32, u64)> {
        vec![]
    }

    /// Time of the passes, if they are timed separately.
    fn pass_timings(&self) -> Option<Timings> {
        None
    }
}

impl RowSource for RayRows {
    fn set_full_share(&mut self, full_share: f64) {
        self.full_share = full_share;
    }
}

#[cfg(feature = "gpu")]
impl RowSource for HemicubeRows {
    fn set_full_share(&mut self, full_share: f64) {
        self.full_share = full_share;
    }

    fn drawn_by_resolution(&self) -> Vec<(u32, u64)> {
        HemicubeRows::drawn_by_resolution(self)
    }

    fn pass_timings(&self) -> Option<Timings> {
        Some(self.timings())
    }
}

#[cfg(feature = "gpu")]
impl RowSource for TracedRows {
    fn set_full_share(&mut self, full_share: f64) {
        self.full_share = full_share;
    }
}

impl From<RayRows> for BackendRows {
    fn from(rows: RayRows) -> BackendRows {
        BackendRows { source: Box::new(rows), maker: RowMaker::Rays, seconds: 0.0 }
    }
}

#[cfg(feature = "gpu")]
impl From<HemicubeRows> for BackendRows {
    fn from(rows: HemicubeRows) -> BackendRows {
        BackendRows { source: Box::new(rows), maker: RowMaker::Hemicubes, seconds: 0.0 }
    }
}

#[cfg(feature = "gpu")]
impl From<TracedRows> for BackendRows {
    fn from(rows: TracedRows) -> BackendRows {
        BackendRows { source: Box::new(rows), maker: RowMaker::DeviceRays, seconds: 0.0 }
    }
}

impl BackendRows {
    /// Full resolution, or all rays, for patches that shoot at least this share of the emitted
    /// flux, in [0, 1]; for all patches if 0.
    pub fn with_full_share(mut self, full_share: f64) -> BackendRows {
        self.source.set_full_share(full_share);
        self
    }

    /// The method of making these rows.
    pub fn maker(&self) -> RowMaker {
        self.maker
    }

    /// Hemicubes drawn so far at each resolution (pixels along an edge of the top face, count);
    /// empty for rays.
    pub fn drawn_by_resolution(&self) -> Vec<(u32, u64)> {
        self.source.drawn_by_resolution()
    }

    /// Time of the passes so far: draw, reduce and readback. Casting rays counts as draw.
    pub fn timings(&self) -> Timings {
        let rays = Timings { draw: self.seconds, ..Default::default() };
        self.source.pass_timings().unwrap_or(rays)
    }

    /// Total seconds spent on rows so far.
    pub fn seconds(&self) -> f64 {
        self.seconds
    }
}

impl FormFactors for BackendRows {
    fn rows(&mut self, mesh: &Mesh, patches: &[NodeId], weight: f64) -> Result<Vec<Row>, Error> {
        let start = Instant::now();
        let rows = self.source.rows(mesh, patches, weight);
        self.seconds += start.elapsed().as_secs_f64();
        rows
    }

    fn preferred_batch_len(&self) -> usize {
        self.source.preferred_batch_len()
    }

    fn fingerprint(&self) -> String {
        self.source.fingerprint()
    }
}
