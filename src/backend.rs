//! Who sees: hemicubes on a graphics device, or rays on the CPU.

pub(crate) mod cpu;
pub(crate) mod fallback;
pub(crate) mod gpu;

use std::num::NonZeroU32;
use std::time::Instant;

use crate::backend::cpu::gather::RayGather;
use crate::backend::cpu::rows::RayRows;
use crate::backend::gpu::{Gpu, HemicubeGather, HemicubeRows, StageSeconds};
use crate::error::Error;
use crate::form_factor::{FormFactors, Row};
use crate::gather::Gather;
use crate::mesh::{Mesh, NodeId};
use crate::progress::Timings;

/// What makes rows and gathers light.
#[derive(Clone, Debug)]
pub enum Backend {
    /// HemicubeRows on a graphics device.
    Gpu(Gpu),
    /// RayScene on the CPU, as many a row as the hemicube's top face would have pixels.
    Cpu,
}

impl Backend {
    /// The graphics adapter with `name` in its name, or the best.
    ///
    /// # Errors
    /// Those of [`Gpu::new`].
    pub fn gpu(name: Option<&str>) -> Result<Backend, Error> {
        Ok(Backend::Gpu(Gpu::new(name)?))
    }

    /// Name, type and driver.
    pub fn adapter(&self) -> [String; 3] {
        match self {
            Backend::Gpu(gpu) => {
                let adapter = gpu.adapter().clone();
                [adapter.name, adapter.kind, adapter.driver]
            }
            Backend::Cpu => ["rays".into(), "CPU".into(), "none".into()],
        }
    }

    /// Whoever makes rows over `mesh`, each from `rotations` hemicubes of `resolution`.
    ///
    /// # Errors
    /// Those of [`HemicubeRows::new`] and [`RayRows::new`].
    pub fn rows(
        &self,
        mesh: &Mesh,
        resolution: u32,
        rotations: NonZeroU32,
    ) -> Result<BackendRows, Error> {
        let rows = match self {
            Backend::Gpu(gpu) => {
                let hemicubes = HemicubeRows::new(gpu, mesh, resolution)?.with_rotations(rotations);
                Rows::Gpu(Box::new(hemicubes))
            }
            Backend::Cpu => {
                crate::hemicube::check_resolution(resolution)?;
                let rays = (resolution * resolution).saturating_mul(rotations.get());
                Rows::Cpu(RayRows::new(mesh, rays)?)
            }
        };
        Ok(BackendRows { rows, seconds: 0.0 })
    }

    pub(crate) fn gathers_by_hemicubes(&self) -> bool {
        matches!(self, Backend::Gpu(gpu) if gpu.adapter().kind != "CPU")
    }

    /// Whoever gathers over the scene of `mesh` with about `rays` looks a place: hemicubes on the
    /// device, or rays where that is the CPU, which takes less time there than drawing.
    ///
    /// # Errors
    /// Those of [`HemicubeGather::new`] and [`RayGather::new`].
    pub fn gather(&self, mesh: &Mesh, rays: u32) -> Result<Box<dyn Gather>, Error> {
        self.gather_evenly(mesh, rays, f64::INFINITY, 0.0)
    }

    /// The same, with more rays where they disagree: see [`RayGather::with_noise`]. HemicubeRows are what
    /// they are.
    pub(crate) fn gather_evenly(
        &self,
        mesh: &Mesh,
        rays: u32,
        noise: f64,
        dim: f64,
    ) -> Result<Box<dyn Gather>, Error> {
        Ok(match self {
            Backend::Gpu(gpu) if self.gathers_by_hemicubes() => {
                // A pixel of the top face is worth half a ray, or a little less.
                let resolution = 2 * (f64::from(rays) / 2.0).sqrt().ceil() as u32;
                Box::new(HemicubeGather::new(gpu, mesh, resolution.max(16))?)
            }
            _ => Box::new(RayGather::new(mesh, rays)?.with_noise(noise, dim)),
        })
    }
}

/// Makes the rows of a [`Backend`], and counts the time.
#[derive(Debug)]
pub struct BackendRows {
    rows: Rows,
    seconds: f64,
}

#[derive(Debug)]
enum Rows {
    Gpu(Box<HemicubeRows>),
    Cpu(RayRows),
}

impl BackendRows {
    /// Full resolution, or all rays, for patches that shoot at least this share of the light; 0 for all.
    pub fn with_full_share(self, full_share: f64) -> BackendRows {
        let rows = match self.rows {
            Rows::Gpu(hemicubes) => Rows::Gpu(Box::new(hemicubes.with_full_share(full_share))),
            Rows::Cpu(rays) => Rows::Cpu(rays.with_full_share(full_share)),
        };
        BackendRows { rows, ..self }
    }

    /// HemicubeRows drawn at each resolution; none where there are rays.
    pub fn drawn_by_resolution(&self) -> Vec<(u32, u64)> {
        match &self.rows {
            Rows::Gpu(hemicubes) => hemicubes.drawn_by_resolution(),
            Rows::Cpu(_) => vec![],
        }
    }

    /// Seconds of drawing, reducing and reading back; rays are all drawing.
    pub fn timings(&self) -> Timings {
        match &self.rows {
            Rows::Gpu(hemicubes) => {
                let StageSeconds { draw, reduce, readback } = hemicubes.seconds();
                Timings { draw, reduce, readback, ..Timings::default() }
            }
            Rows::Cpu(_) => Timings { draw: self.seconds, ..Timings::default() },
        }
    }

    /// Seconds spent on rows, all in all.
    pub fn seconds(&self) -> f64 {
        self.seconds
    }
}

impl FormFactors for BackendRows {
    fn rows(
        &mut self,
        mesh: &Mesh,
        patches: &[NodeId],
        unshot_share: f64,
    ) -> Result<Vec<Row>, Error> {
        let start = Instant::now();
        let rows = match &mut self.rows {
            Rows::Gpu(hemicubes) => hemicubes.rows(mesh, patches, unshot_share),
            Rows::Cpu(rays) => rays.rows(mesh, patches, unshot_share),
        };
        self.seconds += start.elapsed().as_secs_f64();
        rows
    }

    fn preferred_batch_len(&self) -> usize {
        match &self.rows {
            Rows::Gpu(hemicubes) => hemicubes.preferred_batch_len(),
            Rows::Cpu(rays) => rays.preferred_batch_len(),
        }
    }

    fn fingerprint(&self) -> String {
        match &self.rows {
            Rows::Gpu(hemicubes) => hemicubes.fingerprint(),
            Rows::Cpu(rays) => rays.fingerprint(),
        }
    }
}
