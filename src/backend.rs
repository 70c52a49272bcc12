//! The two backends: hemicubes and rays on a graphics device, or rays on the CPU.
//!
//! ```text
//!                 FormFactors (rows)        Gather (light at points)
//! Backend::Gpu    gpu::HemicubeRows
//!                 gpu::TracedRows           gpu::TracedGather
//! Backend::Cpu    cpu::RayRows              cpu::RayGather
//! ```
//!
//! Both columns implement one contract each ([`crate::FormFactors`], [`crate::Gather`]), so that a
//! solver does not depend on the backend, and [`Fallback`] can switch from one to the other in the
//! middle of a solve. Without the feature `gpu` only the CPU is available.
//!
//! A bake makes rows with the [cheapest](cost) method: [`Backend::row_maker`]. Light is gathered on
//! graphics hardware; a software device is slower than rays on the CPU.

mod adapter;
pub mod cost;
pub mod cpu;
mod fallback;
#[cfg(feature = "gpu")]
pub mod gpu;
mod row_maker;
mod rows;

pub use adapter::{AdapterInfo, AdapterKind};
pub use fallback::Fallback;
pub use row_maker::RowMaker;
pub use rows::BackendRows;

use crate::accuracy::Measure;
use crate::error::{Error, ErrorKind};
use crate::gather::point_irradiance::rays_for_noise;
use crate::gather::{Gather, GatheredMesh};
use crate::mesh::Mesh;
use crate::scene::Scene;
use cost::RowCost;
use cpu::gather::{MOST_RAYS, MOST_RAYS_OF_MANY};
use cpu::{RayGather, RayRows};
#[cfg(feature = "gpu")]
use gpu::{Gpu, HemicubeRows, TracedGather, TracedRows};

/// Computes rows and gathers light.
#[derive(Clone, Debug)]
pub enum Backend {
    /// Hemicubes on a graphics device.
    #[cfg(feature = "gpu")]
    Gpu(Gpu),
    /// Rays on the CPU; their number per row is that of the pixels of the hemicube's top face.
    Cpu,
}

/// How points gather.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GatherRays {
    /// Minimum number of rays of a point.
    pub rays: u32,
    /// See [`RayGather::with_noise`].
    pub noise: f64,
    pub dim: f64,
    /// See [`RayGather::with_most_rays`].
    pub most: u32,
    /// Whether the light that is gathered is a solution of its scene, known on elements that may be
    /// too large for it near a point: see [`RayGather::with_near_field`].
    pub near_field: bool,
}

impl GatherRays {
    /// The same number of rays for each point, of any light.
    pub fn evenly(rays: u32) -> GatherRays {
        GatherRays { rays, noise: f64::INFINITY, dim: 0.0, most: 1, near_field: false }
    }

    /// For points whose errors count in a mean square over many: of a solution.
    pub fn of_many(rays: u32, noise: f64, dim: f64) -> GatherRays {
        GatherRays { rays, noise, dim, most: MOST_RAYS_OF_MANY, near_field: true }
    }
}

impl Backend {
    /// The graphics adapter with `name` in its name, or the best.
    ///
    /// # Errors
    /// Those of [`Gpu::new`].
    #[cfg(feature = "gpu")]
    pub fn gpu(name: Option<&str>) -> Result<Backend, Error> {
        Ok(Backend::Gpu(Gpu::new(name)?))
    }

    /// The adapter that this backend runs on.
    pub fn adapter(&self) -> AdapterInfo {
        match self {
            #[cfg(feature = "gpu")]
            Backend::Gpu(gpu) => gpu.adapter().clone(),
            Backend::Cpu => {
                AdapterInfo { name: "rays".into(), kind: AdapterKind::Cpu, driver: "none".into() }
            }
        }
    }

    /// Rows over `mesh`, each from a hemicube with `resolution` pixels along an edge of the top
    /// face, or from `resolution`² rays in a scene with clear panes or cut-outs, which hemicubes do
    /// not support, and without a device.
    ///
    /// A device draws hemicubes here even where rays would take less time, which is the case with
    /// many triangles and few pixels: bakes use [`Backend::row_maker`].
    ///
    /// # Errors
    /// Those of [`Backend::rows_by`].
    pub fn rows(&self, mesh: &Mesh, resolution: u32) -> Result<BackendRows, Error> {
        let maker = match self.row_makers(mesh.scene()) {
            [RowMaker::Hemicubes, ..] => RowMaker::Hemicubes,
            _ => self.row_maker(mesh.scene(), resolution),
        };
        self.rows_by(maker, mesh, resolution)
    }

    /// The same with this row maker, if the backend has it; else with rays on the CPU.
    ///
    /// # Errors
    /// Those of [`HemicubeRows::new`](crate::backend::gpu::HemicubeRows::new),
    /// [`TracedRows::new`](crate::backend::gpu::TracedRows::new) and [`RayRows::new`].
    pub fn rows_by(
        &self,
        maker: RowMaker,
        mesh: &Mesh,
        resolution: u32,
    ) -> Result<BackendRows, Error> {
        crate::hemicube::check_resolution(resolution)?;
        let rays = resolution * resolution;
        match (self, maker) {
            #[cfg(feature = "gpu")]
            (Backend::Gpu(gpu), RowMaker::Hemicubes) => {
                Ok(HemicubeRows::new(gpu, mesh, resolution)?.into())
            }
            #[cfg(feature = "gpu")]
            (Backend::Gpu(gpu), RowMaker::DeviceRays) => {
                Ok(TracedRows::new(gpu, mesh, rays)?.into())
            }
            _ => Ok(RayRows::new(mesh, rays)?.into()),
        }
    }

    /// The row makers that support `scene`.
    fn row_makers(&self, scene: &Scene) -> &'static [RowMaker] {
        #[cfg(not(feature = "gpu"))]
        let _ = scene;
        match self {
            #[cfg(feature = "gpu")]
            Backend::Gpu(_) if scene.hidden_from_hemicubes().is_none() => {
                &[RowMaker::Hemicubes, RowMaker::DeviceRays, RowMaker::Rays]
            }
            #[cfg(feature = "gpu")]
            Backend::Gpu(_) => &[RowMaker::DeviceRays, RowMaker::Rays],
            Backend::Cpu => &[RowMaker::Rays],
        }
    }

    /// Row maker for a bake of `scene` with hemicubes of `resolution` pixels along an edge of the
    /// top face, or `resolution`² rays: the [faster one](cost) on an adapter of this kind, for the
    /// same error.
    ///
    /// It depends only on the kind of the adapter, the number of triangles, clear panes, cut-outs
    /// and `resolution`, so that every run chooses alike.
    pub fn row_maker(&self, scene: &Scene, resolution: u32) -> RowMaker {
        let (makers, count) = (self.row_makers(scene), scene.triangles().len());
        let cost = RowCost::of(self.assumed_kind());
        cost.cheapest(makers.iter().copied(), count, resolution).unwrap_or(RowMaker::Rays)
    }

    /// Whether light is gathered on the device: on graphics hardware. A software device casts rays
    /// more slowly than the CPU alone.
    pub(crate) fn gathers_on_device(&self) -> bool {
        self.assumed_kind() != AdapterKind::Cpu
    }

    /// The kind of adapter that choices are based on.
    fn assumed_kind(&self) -> AdapterKind {
        match self {
            #[cfg(feature = "gpu")]
            Backend::Gpu(gpu) => gpu.assumed_kind(),
            Backend::Cpu => AdapterKind::Cpu,
        }
    }

    /// Why rays on the CPU replace a software device's hemicubes in `scene`, if they do: hemicubes
    /// do not support clear panes and cut-outs.
    pub(crate) fn blind_to(&self, scene: &Scene) -> Option<Error> {
        #[cfg(not(feature = "gpu"))]
        let _ = scene;
        match self {
            #[cfg(feature = "gpu")]
            Backend::Gpu(_) if !self.gathers_on_device() => gpu::check_hemicubes_see(scene).err(),
            _ => None,
        }
    }

    /// A gatherer over the scene of `mesh` with about `rays` rays per point: on graphics hardware,
    /// or on the CPU.
    ///
    /// # Errors
    /// Those of [`TracedGather::new`](crate::backend::gpu::TracedGather::new) and
    /// [`RayGather::new`].
    pub fn gather(&self, mesh: &Mesh, rays: u32) -> Result<Box<dyn Gather>, Error> {
        self.gather_with(mesh, GatherRays::evenly(rays))
    }

    /// A gatherer of `light` for [`irradiance_at`](crate::gather::irradiance_at): the number of
    /// samples is such that the standard error of a point is about `noise` of its irradiance. Rays
    /// are doubled where they disagree, up to 16 times. Where the light is darker than a twentieth
    /// of the mean reflected radiosity the error is that share of this instead. If the device
    /// fails, rays on the CPU replace it.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] for a noise not in (0, 1]; those of [`Backend::gather`].
    pub fn gather_to_noise(
        &self,
        light: &GatheredMesh,
        noise: f64,
    ) -> Result<Box<dyn Gather>, Error> {
        if !(noise > 0.0 && noise <= 1.0) {
            let remedy = "give a share above 0 and at most 1";
            return Err(Error::new(ErrorKind::Setting, "noise", noise.to_string(), remedy));
        }
        let (rays, noise) = rays_for_noise(noise);
        let dim = light.radiosity_field().radiosity_floor(Measure::default().floor);
        let rays = GatherRays { rays, noise, dim, most: MOST_RAYS, near_field: false };
        self.gather_with_fallback(&light.mesh, rays, |_| ())
    }

    /// As [`Backend::gather_with`], with rays on the CPU from the time when the device fails, or
    /// if it cannot start: `failed` receives the reason.
    pub(crate) fn gather_with_fallback<'a>(
        &self,
        mesh: &Mesh,
        rays: GatherRays,
        mut failed: impl FnMut(Error) + 'a,
    ) -> Result<Box<dyn Gather + 'a>, Error> {
        match self.gather_with(mesh, rays) {
            Ok(first) if self.gathers_on_device() => {
                let mesh = mesh.clone();
                Ok(Box::new(Fallback::new(first, move |error| {
                    failed(error);
                    Backend::Cpu.gather_with(&mesh, rays)
                })))
            }
            Err(e) if e.is_device_error() || e.kind() == ErrorKind::Setting => {
                let gather = Backend::Cpu.gather_with(mesh, rays)?;
                failed(e);
                Ok(gather)
            }
            result => result.map(|gather| gather as Box<dyn Gather>),
        }
    }

    /// As [`Backend::gather`], with more rays where they disagree: see [`RayGather::with_noise`].
    pub(crate) fn gather_with(
        &self,
        mesh: &Mesh,
        GatherRays { rays, noise, dim, most, near_field }: GatherRays,
    ) -> Result<Box<dyn Gather>, Error> {
        match self {
            #[cfg(feature = "gpu")]
            Backend::Gpu(gpu) if self.gathers_on_device() => {
                let gather = TracedGather::with_noise(gpu, mesh, rays, noise, dim)?;
                let gather = gather.with_most_rays(most);
                Ok(Box::new(if near_field { gather.with_near_field() } else { gather }))
            }
            _ => {
                let gather = RayGather::new(mesh, rays)?.with_noise(noise, dim);
                let gather = gather.with_most_rays(most);
                Ok(Box::new(if near_field { gather.with_near_field() } else { gather }))
            }
        }
    }
}
