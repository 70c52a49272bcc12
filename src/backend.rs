//! The two backends: hemicubes on a graphics device, or rays on the CPU.
//!
//! ```text
//!                 FormFactors (rows)        Gather (light at points)
//! Backend::Gpu    gpu::HemicubeRows         gpu::HemicubeGather
//! Backend::Cpu    cpu::RayRows              cpu::RayGather
//! ```
//!
//! Both columns hold to one contract each ([`crate::FormFactors`], [`crate::Gather`]), so that a
//! solver does not know which backend it uses, and [`Fallback`] can go from one to the other in the
//! middle of a solve. Without the feature `gpu` only the CPU is there.
//!
//! A bake takes rays on a device too where [hemicubes cost more](cost): [`Backend::row_maker`].

mod adapter;
pub mod cost;
pub mod cpu;
mod fallback;
#[cfg(feature = "gpu")]
pub mod gpu;
mod row_maker;
mod rows;

use std::num::NonZeroU32;

pub use adapter::{AdapterInfo, AdapterKind};
pub use fallback::Fallback;
pub use row_maker::RowMaker;
pub use rows::BackendRows;

use crate::error::{Error, ErrorKind};
use crate::gather::point_irradiance::rays_for_noise;
use crate::gather::{Gather, GatheredMesh};
use crate::mesh::Mesh;
use crate::scene::Scene;
#[cfg(feature = "gpu")]
use cost::RowCost;
use cpu::{RayGather, RayRows};
#[cfg(feature = "gpu")]
use gpu::{Gpu, HemicubeGather, HemicubeRows};

/// What makes rows and gathers light.
#[derive(Clone, Debug)]
pub enum Backend {
    /// Hemicubes on a graphics device.
    #[cfg(feature = "gpu")]
    Gpu(Gpu),
    /// Rays on the CPU, as many a row as the hemicube's top face would have pixels.
    Cpu,
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

    /// Rows over `mesh`, each from `rotations` hemicubes with `resolution` pixels along an edge of
    /// the top face, or from `rotations`·`resolution`² rays. Rays on the CPU in a scene with clear
    /// panes or cut-outs, which hemicubes do not see.
    ///
    /// A device draws hemicubes here even where rays would take less time, as they do where many
    /// triangles meet few pixels: bakes ask [`Backend::row_maker`] first.
    ///
    /// # Errors
    /// Those of [`HemicubeRows::new`](crate::HemicubeRows::new) and [`RayRows::new`].
    pub fn rows(
        &self,
        mesh: &Mesh,
        resolution: u32,
        rotations: NonZeroU32,
    ) -> Result<BackendRows, Error> {
        match self {
            #[cfg(feature = "gpu")]
            Backend::Gpu(gpu) if mesh.scene().hidden_from_hemicubes().is_none() => {
                let hemicubes = HemicubeRows::new(gpu, mesh, resolution)?;
                Ok(hemicubes.with_rotations(rotations).into())
            }
            _ => {
                crate::hemicube::check_resolution(resolution)?;
                let rays = (resolution * resolution).saturating_mul(rotations.get());
                Ok(RayRows::new(mesh, rays)?.into())
            }
        }
    }

    /// What a bake of `scene` makes rows with, each of a hemicube with `resolution` pixels along an
    /// edge of the top face or of `resolution`² rays: what [takes less time](cost) on an adapter
    /// of this kind, to the same error. Where that is rays, they are those of [`Backend::Cpu`].
    ///
    /// It depends on the kind of the adapter, the number of triangles, clear panes, cut-outs and
    /// `resolution` alone, so that every run chooses alike.
    pub fn row_maker(&self, scene: &Scene, resolution: u32) -> RowMaker {
        #[cfg(not(feature = "gpu"))]
        let _ = (scene, resolution);
        match self {
            #[cfg(feature = "gpu")]
            Backend::Gpu(gpu) if scene.hidden_from_hemicubes().is_none() => {
                RowCost::of(gpu.adapter().kind).cheaper(scene.triangles().len(), resolution)
            }
            _ => RowMaker::Rays,
        }
    }

    /// Whether light is gathered with hemicubes: on graphics hardware. A software device draws them
    /// more slowly than rays are cast.
    pub(crate) fn gathers_by_hemicubes(&self) -> bool {
        match self {
            #[cfg(feature = "gpu")]
            Backend::Gpu(gpu) => gpu.adapter().kind != AdapterKind::Cpu,
            Backend::Cpu => false,
        }
    }

    /// Why rays on the CPU take the place of a device in `scene`, if they do: hemicubes do not see
    /// clear panes and cut-outs.
    pub(crate) fn blind_to(&self, scene: &Scene) -> Option<Error> {
        #[cfg(not(feature = "gpu"))]
        let _ = scene;
        match self {
            #[cfg(feature = "gpu")]
            Backend::Gpu(_) => gpu::check_hemicubes_see(scene).err(),
            Backend::Cpu => None,
        }
    }

    /// A gatherer over the scene of `mesh` with about `rays` samples a point: hemicubes on graphics
    /// hardware, rays on the CPU otherwise and in scenes with clear panes or cut-outs.
    ///
    /// # Errors
    /// Those of [`HemicubeGather::new`](crate::backend::gpu::HemicubeGather::new) and
    /// [`RayGather::new`].
    pub fn gather(&self, mesh: &Mesh, rays: u32) -> Result<Box<dyn Gather>, Error> {
        self.gather_evenly(mesh, rays, f64::INFINITY, 0.0)
    }

    /// A gatherer of `light` for [`irradiance_at`](crate::gather::irradiance_at): with so many
    /// samples that the standard error of a point is about `noise` of its irradiance. Rays are
    /// doubled where they disagree, up to 16 times; hemicubes are the same everywhere. What is
    /// darker than a twentieth of the mean reflected radiosity has that share of this instead.
    /// Where the device fails, rays on the CPU go on.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] for a noise that is not above 0 and at most 1; those of
    /// [`Backend::gather`].
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
        let dim = light.radiosity_field().radiosity_floor();
        self.gather_or_cast_rays(&light.mesh, (rays, noise, dim), |_| ())
    }

    /// As [`Backend::gather_evenly`], with rays on the CPU from when the device fails, or cannot
    /// start: `failed` gets the reason.
    pub(crate) fn gather_or_cast_rays<'a>(
        &self,
        mesh: &Mesh,
        (rays, noise, dim): (u32, f64, f64),
        mut failed: impl FnMut(Error) + 'a,
    ) -> Result<Box<dyn Gather + 'a>, Error> {
        match self.gather_evenly(mesh, rays, noise, dim) {
            Ok(first) if self.gathers_by_hemicubes() => {
                let mesh = mesh.clone();
                Ok(Box::new(Fallback::new(first, move |error| {
                    failed(error);
                    Backend::Cpu.gather_evenly(&mesh, rays, noise, dim)
                })))
            }
            Err(e) if e.is_device_error() || e.kind() == ErrorKind::Setting => {
                let gather = Backend::Cpu.gather_evenly(mesh, rays, noise, dim)?;
                failed(e);
                Ok(gather)
            }
            result => result.map(|gather| gather as Box<dyn Gather>),
        }
    }

    /// As [`Backend::gather`], with more rays where they disagree: see [`RayGather::with_noise`].
    /// Hemicubes are as they are.
    pub(crate) fn gather_evenly(
        &self,
        mesh: &Mesh,
        rays: u32,
        noise: f64,
        dim: f64,
    ) -> Result<Box<dyn Gather>, Error> {
        match self {
            #[cfg(feature = "gpu")]
            Backend::Gpu(gpu)
                if self.gathers_by_hemicubes()
                    && mesh.scene().hidden_from_hemicubes().is_none() =>
            {
                // A pixel of the top face is worth half a ray, or a little less.
                let resolution = 2 * (f64::from(rays) / 2.0).sqrt().ceil() as u32;
                Ok(Box::new(HemicubeGather::new(gpu, mesh, resolution.max(16))?))
            }
            _ => Ok(Box::new(RayGather::new(mesh, rays)?.with_noise(noise, dim))),
        }
    }
}
