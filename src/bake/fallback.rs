//! A device with the CPU behind it: what a bake has solved stays, whatever the device does.
//!
//! Rows and gathers come from the device until it fails; from the next batch on rays on the CPU
//! make them. The failure is kept here until the bake asks for it, which is at its next report.

use std::cell::{Cell, OnceCell};

use crate::backend::{Backend, BackendRows, Fallback, GatherRays, RowMaker};
use crate::bake::settings::SolveSettings;
use crate::error::{Error, ErrorKind};
use crate::gather::Gather;
use crate::mesh::Mesh;

/// Rows of a device, and then of the CPU.
pub(super) type ResilientRows<'a> = Fallback<'a, BackendRows>;

/// A device in use, which rays on the CPU replace when it fails.
pub(super) struct ResilientBackend<'a> {
    backend: &'a Backend,
    /// The first failure.
    failure: OnceCell<Error>,
    /// Whether [`ResilientBackend::new_failure`] has given it.
    reported: Cell<bool>,
}

impl<'a> ResilientBackend<'a> {
    /// `backend`, which has not failed yet.
    pub fn new(backend: &'a Backend) -> ResilientBackend<'a> {
        ResilientBackend { backend, failure: OnceCell::new(), reported: Cell::new(false) }
    }

    /// Why the device failed, if it did.
    pub fn failure(&self) -> Option<Error> {
        self.failure.get().cloned()
    }

    /// The failure of the device, once: at the first call after it.
    pub fn new_failure(&self) -> Option<Error> {
        let failure = self.failure.get().filter(|_| !self.reported.get())?;
        self.reported.set(true);
        Some(failure.clone())
    }

    /// Keeps the first failure; what fails after that is a consequence.
    fn record(&self, error: Error) {
        let _ = self.failure.set(error);
    }

    /// A source of rows as `settings` ask for: by what is fastest ([`Backend::row_maker`]), or by
    /// rays on the CPU if `mesh` is too large for the device.
    /// What else keeps the device from starting is an error, since nothing is lost then.
    pub fn rows<'m>(
        &'m self,
        mesh: &'m Mesh,
        settings: &'m SolveSettings,
    ) -> Result<ResilientRows<'m>, Error> {
        let resolution = settings.hemicube_resolution;
        let rows = move |maker: RowMaker| -> Result<BackendRows, Error> {
            let rows = self.backend.rows_by(maker, mesh, resolution)?;
            Ok(match settings.full_resolution_share {
                Some(share) => rows.with_full_share(share),
                None => rows,
            })
        };
        if let Some(e) = self.backend.blind_to(mesh.scene()) {
            self.record(e);
        }
        // All rows alike: most are at full resolution.
        let first = match rows(self.backend.row_maker(mesh.scene(), resolution)) {
            Err(e) if e.kind() == ErrorKind::Memory => {
                self.record(e);
                rows(RowMaker::Rays)?
            }
            result => result?,
        };
        Ok(Fallback::new(first, move |error| {
            self.record(error);
            rows(RowMaker::Rays)
        }))
    }

    /// A gatherer of a solution of the scene: see [`Backend::gather_with_fallback`]. A device that
    /// cannot start one has failed too: light was shot by now.
    pub fn gather(
        &self,
        mesh: &Mesh,
        rays: u32,
        noise: f64,
        dim: f64,
    ) -> Result<Box<dyn Gather + '_>, Error> {
        self.gather_by(mesh, GatherRays::of_many(rays, noise, dim))
    }

    /// A gatherer of any light, with as many rays for each point.
    pub fn gather_evenly(&self, mesh: &Mesh, rays: u32) -> Result<Box<dyn Gather + '_>, Error> {
        self.gather_by(mesh, GatherRays::evenly(rays))
    }

    fn gather_by(&self, mesh: &Mesh, rays: GatherRays) -> Result<Box<dyn Gather + '_>, Error> {
        self.backend.gather_with_fallback(mesh, rays, |error| self.record(error))
    }
}
