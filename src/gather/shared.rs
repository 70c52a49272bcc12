//! Gather points shared out between processes: one drives the gather, the others serve it.
//!
//! Samples are those that one process makes, and come back in the order of their points: the light
//! has the same bits with any number of processes whose gatherers make the same samples.

use super::{Gather, GatherPoint, GatheredMesh, IrradianceSample, RadiosityField};
use crate::error::{Error, ErrorKind};
use crate::ranks::{Ranks, Share, ask, dismiss, serve};

/// The gatherers of several processes as one: process 0 has it, the others call
/// [`SharedGather::serve`].
///
/// All gather the light that every process was given: one pass of
/// [`gather_at_vertices`](super::gather_at_vertices), or any other points.
#[derive(Debug)]
pub struct SharedGather<'a, G> {
    gatherer: G,
    light: &'a GatheredMesh,
    ranks: &'a mut dyn Ranks,
}

impl<'a, G: Gather> SharedGather<'a, G> {
    /// Shares points out to `ranks`, of which this process is number 0, with `gatherer` for its
    /// own. The others serve until this is dropped.
    pub fn new(
        gatherer: G,
        light: &'a GatheredMesh,
        ranks: &'a mut dyn Ranks,
    ) -> SharedGather<'a, G> {
        SharedGather { gatherer, light, ranks }
    }

    /// Gathers `light` for process 0 until it has no more to ask for. Light and settings of
    /// gatherers must be the same in all processes.
    ///
    /// An error of `gatherer` is told to process 0, which then fails.
    ///
    /// # Panics
    /// When process 0 does not share points out.
    pub fn serve(gatherer: &mut G, light: &GatheredMesh, ranks: &mut dyn Ranks) {
        serve(ranks, |points: &Vec<GatherPoint>, share| {
            own_samples(gatherer, light, points, share)
        });
    }
}

impl<G: Gather> Gather for SharedGather<'_, G> {
    /// # Errors
    /// [`ErrorKind::Setting`] for another light than that of all processes; those of the gatherers.
    fn gather(
        &mut self,
        field: &RadiosityField,
        points: &[GatherPoint],
    ) -> Result<Vec<IrradianceSample>, Error> {
        let light = self.light.radiosity_field();
        if !std::ptr::eq(field.reflected, light.reflected) && field.reflected != light.reflected {
            let found = "another one than that of all processes";
            let remedy = "gather once, or share each pass out anew";
            return Err(Error::new(ErrorKind::Setting, "light to gather", found, remedy));
        }
        let own = |points: &Vec<GatherPoint>, share| {
            own_samples(&mut self.gatherer, self.light, points, share)
        };
        ask(self.ranks, &points.to_vec(), points.len(), own)
    }
}

impl<G> Drop for SharedGather<'_, G> {
    fn drop(&mut self) {
        dismiss(self.ranks);
    }
}

/// The samples of those of `points` that fall to this process.
fn own_samples(
    gatherer: &mut impl Gather,
    light: &GatheredMesh,
    points: &[GatherPoint],
    share: Share,
) -> Result<Vec<IrradianceSample>, Error> {
    let own: Vec<GatherPoint> = share.from(points).copied().collect();
    gatherer.gather(&light.radiosity_field(), &own)
}
