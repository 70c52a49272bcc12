//! A device with the CPU behind it: what a bake has solved stays, whatever the device does.

use std::cell::RefCell;
use std::ops::ControlFlow;
use std::rc::Rc;

use super::{BakeProgress, ProgressCallback};
use crate::backend::fallback::Fallback;
use crate::backend::{Backend, BackendRows};
use crate::bake::settings::BakeSettings;
use crate::error::{Error, ErrorKind};
use crate::gather::Gather;
use crate::mesh::Mesh;

/// A device in use. When it fails rays on the CPU go on.
pub(crate) struct ResilientBackend<'d> {
    device: &'d Backend,
    failure: Rc<RefCell<Failure>>,
}

#[derive(Default)]
struct Failure {
    first: Option<Error>,
    untold: Option<Error>,
}

impl<'d> ResilientBackend<'d> {
    /// Nothing has failed yet.
    pub fn new(device: &'d Backend) -> ResilientBackend<'d> {
        ResilientBackend { device, failure: Rc::default() }
    }

    /// What the device failed of, if it did.
    pub fn failure(&self) -> Option<Error> {
        self.failure.borrow().first.clone()
    }

    /// Tells of a failure once, then of `stage`.
    pub fn tell(&self, stage: &BakeProgress, progress: ProgressCallback) -> ControlFlow<()> {
        let untold = self.failure.borrow_mut().untold.take();
        if let Some(error) = untold {
            progress(&BakeProgress::Failed(error))?;
        }
        progress(stage)
    }

    /// Whoever makes rows as `effort` says. What keeps the device from starting is an error, since
    /// nothing is lost then.
    pub fn rows<'m>(
        &self,
        mesh: &'m Mesh,
        effort: &'m BakeSettings,
    ) -> Result<BackendFallback<'m>, Error> {
        let rows = |device: &Backend| {
            let rows = device.rows(mesh, effort.hemicube, effort.rotations)?;
            Ok(match effort.full_share {
                Some(share) => rows.with_full_share(share),
                None => rows,
            })
        };
        let failure = self.failure.clone();
        Ok(Fallback::new(rows(self.device)?, move |error| {
            note(&failure, error);
            rows(&Backend::Cpu)
        }))
    }

    /// Whoever gathers: see [`Backend::gather_evenly`]. A device that cannot has failed too: light was
    /// shot by now.
    pub fn gather(
        &self,
        mesh: &Mesh,
        rays: u32,
        noise: f64,
        dim: f64,
    ) -> Result<Box<dyn Gather>, Error> {
        let failure = self.failure.clone();
        match self.device.gather_evenly(mesh, rays, noise, dim) {
            Ok(first) if self.device.gathers_by_hemicubes() => {
                let mesh = mesh.clone();
                Ok(Box::new(Fallback::new(first, move |error| {
                    note(&failure, error);
                    Backend::Cpu.gather_evenly(&mesh, rays, noise, dim)
                })))
            }
            Err(e) if e.is_device_error() || e.kind() == ErrorKind::Setting => {
                let gather = Backend::Cpu.gather_evenly(mesh, rays, noise, dim)?;
                note(&failure, e);
                Ok(gather)
            }
            done => done,
        }
    }
}

/// Rows of a device, and then of the CPU.
pub(crate) type BackendFallback<'m> = Fallback<'m, BackendRows>;

fn note(failure: &RefCell<Failure>, error: Error) {
    let mut failure = failure.borrow_mut();
    if failure.first.is_none() {
        *failure = Failure { first: Some(error.clone()), untold: Some(error) };
    }
}
