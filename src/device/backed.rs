//! A device with the CPU behind it: what a bake has solved stays, whatever the device does.

use std::cell::RefCell;
use std::rc::Rc;

use super::{Device, DeviceRows};
use crate::bake::{Stage, Tell};
use crate::effort::Effort;
use crate::error::{Error, ErrorKind};
use crate::gather::Gather;
use crate::mesh::Mesh;
use crate::relay::Relay;
use crate::solve::Go;

/// A device in use. When it fails rays on the CPU go on.
pub(crate) struct Backed<'d> {
    device: &'d Device,
    failure: Rc<RefCell<Failure>>,
}

#[derive(Default)]
struct Failure {
    first: Option<Error>,
    untold: Option<Error>,
}

impl<'d> Backed<'d> {
    /// Nothing has failed yet.
    pub fn new(device: &'d Device) -> Backed<'d> {
        Backed { device, failure: Rc::default() }
    }

    /// What the device failed of, if it did.
    pub fn failure(&self) -> Option<Error> {
        self.failure.borrow().first.clone()
    }

    /// Tells of a failure once, then of `stage`.
    pub fn tell(&self, stage: &Stage, progress: Tell) -> Go {
        let untold = self.failure.borrow_mut().untold.take();
        if let Some(error) = untold {
            progress(&Stage::Failed(error))?;
        }
        progress(stage)
    }

    /// Whoever makes rows as `effort` says. What keeps the device from starting is an error, since
    /// nothing is lost then.
    pub fn rows<'m>(&self, mesh: &'m Mesh, effort: &'m Effort) -> Result<DeviceRelay<'m>, Error> {
        let rows = |device: &Device| {
            let rows = device.rows(mesh, effort.hemicube, effort.rotations)?;
            Ok(match effort.full_share {
                Some(share) => rows.with_full_share(share),
                None => rows,
            })
        };
        let failure = self.failure.clone();
        Ok(Relay::new(rows(self.device)?, move |error| {
            note(&failure, error);
            rows(&Device::Cpu)
        }))
    }

    /// Whoever gathers: see [`Device::gather_evenly`]. A device that cannot has failed too: light was
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
                Ok(Box::new(Relay::new(first, move |error| {
                    note(&failure, error);
                    Device::Cpu.gather_evenly(&mesh, rays, noise, dim)
                })))
            }
            Err(e) if e.is_of_device() || e.kind() == ErrorKind::Setting => {
                let gather = Device::Cpu.gather_evenly(mesh, rays, noise, dim)?;
                note(&failure, e);
                Ok(gather)
            }
            done => done,
        }
    }
}

/// Rows of a device, and then of the CPU.
pub(crate) type DeviceRelay<'m> = Relay<'m, DeviceRows>;

fn note(failure: &RefCell<Failure>, error: Error) {
    let mut failure = failure.borrow_mut();
    if failure.first.is_none() {
        *failure = Failure { first: Some(error.clone()), untold: Some(error) };
    }
}
