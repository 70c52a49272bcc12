//! Shot light in gaps, where elements gather instead.
//!
//! An element that shot light falls on is lit as a whole, and what is below the footprint of a
//! hemicube's pixel shares its light. So there is light in gaps that are narrower than that, and in
//! what lies behind them, which never got in; and their walls keep it up, bounce by bounce:
//!
//! ```text
//!   ▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔      one element, lit at its right end: all of it counts as lit
//!    ▏              ▕
//!    ▏     gap      ▕    light
//!    ▏              ▕
//! ```
//!
//! Elements that see what is nearer than light is resolved on them gather, at their viewpoints:
//! first all; then, by what has changed, those that changed themselves, until none does by much.

use std::ops::ControlFlow;

use crate::bake::fallback::ResilientBackend;
use crate::bake::model;
use crate::error::Error;
use crate::gather::gather_points::SurfaceOffset;
use crate::gather::two_sided::{TwoSidedPoint, gather_both_two_sided, gather_two_sided};
use crate::gather::{Gather, Progress, RadiosityField};
use crate::mesh::Mesh;
use crate::progress::BatchSizer;
use crate::scene::Rgb;
use crate::vertex::irradiance;

/// Elements in the first batch; later ones follow the clock. Chosen by hand: results do not depend
/// on it.
const FIRST_BATCH: usize = 1024;

/// The `radiosity` of the elements of `mesh`, W/m², where light is resolved down to `footprint`
/// (scene unit): gathered instead by those for which the mean of 1/distance to what they see, times
/// the larger of their size and the footprint, is above 1.
///
/// None where `progress` broke.
pub(super) fn light_in_gaps(
    mesh: &Mesh,
    radiosity: &[Rgb],
    footprint: f64,
    backend: &ResilientBackend,
    progress: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Option<Vec<Rgb>>, Error> {
    let mut gaps = GapGather {
        mesh,
        above: SurfaceOffset::new(mesh.scene()),
        gatherer: backend.gather(mesh, model::GAP_RAYS, f64::INFINITY, 0.0)?,
        progress,
    };
    let corners: Vec<[u32; 3]> = (0..mesh.element_count() as u32).map(|e| [e; 3]).collect();
    let shot: Vec<Rgb> = (0..mesh.element_count())
        .map(|e| {
            let irradiance = irradiance(radiosity[e] - mesh.exitance(e), mesh.albedo(e));
            gaps.albedo(e) * irradiance
        })
        .collect();
    let floor = field(mesh, &corners, &shot).radiosity_floor();
    let scatters = |e: &usize| mesh.scatters(mesh.element(*e));
    let all: Vec<usize> = (0..mesh.element_count()).filter(scatters).collect();
    let Some(mut changed) = gaps.gather_narrow(&all, &field(mesh, &corners, &shot), footprint)?
    else {
        return Ok(None);
    };
    let mut reflected = shot.clone();
    for _ in 0..model::MAX_GAP_BOUNCES {
        let before = reflected.clone();
        for &(e, value) in &changed {
            reflected[e] = value;
        }
        changed.retain(|&(e, value)| {
            before[e].distance(value) > model::GAP_CHANGE * value.length().max(floor)
        });
        if changed.is_empty() {
            break;
        }
        let fields = [&reflected, &before].map(|light| field(mesh, &corners, light));
        if gaps.add_change(&mut changed, [&fields[0], &fields[1]])?.is_break() {
            return Ok(None);
        }
    }
    let gathered = |e: usize| {
        let irradiance = irradiance(reflected[e], gaps.albedo(e));
        mesh.exitance(e) + mesh.albedo(e) * irradiance
    };
    let elements = (0..radiosity.len()).zip(radiosity);
    let radiosity =
        elements.map(|(e, &b)| if reflected[e] == shot[e] { b } else { gathered(e) }).collect();
    Ok(Some(radiosity))
}

fn field<'a>(mesh: &'a Mesh, corners: &'a [[u32; 3]], reflected: &'a [Rgb]) -> RadiosityField<'a> {
    RadiosityField { mesh, corners, reflected }
}

/// Elements that gather at their viewpoints.
struct GapGather<'a> {
    mesh: &'a Mesh,
    above: SurfaceOffset,
    gatherer: Box<dyn Gather + 'a>,
    progress: &'a mut dyn FnMut(&Progress) -> ControlFlow<()>,
}

impl GapGather<'_> {
    fn albedo(&self, e: usize) -> Rgb {
        self.mesh.material(self.mesh.element(e)).albedo()
    }

    fn size(&self, e: usize) -> f64 {
        self.mesh.area(self.mesh.element(e)).sqrt()
    }

    fn point(&self, e: usize) -> TwoSidedPoint {
        let node = self.mesh.element(e);
        let (viewpoint, normal) = (self.mesh.viewpoint(node), self.mesh.normal(node));
        let point = self.above.gather_point(viewpoint, normal, self.size(e));
        TwoSidedPoint::new(point, self.mesh.material(node))
    }

    /// Those of `elements` that are in gaps, and what they reflect of the light of `field`, W/m²;
    /// none if cancelled.
    fn gather_narrow(
        &mut self,
        elements: &[usize],
        field: &RadiosityField,
        footprint: f64,
    ) -> Result<Option<Vec<(usize, Rgb)>>, Error> {
        let mut narrow = vec![];
        let mut remaining = elements;
        let mut batches = BatchSizer::new(FIRST_BATCH);
        while !remaining.is_empty() {
            batches.next(&mut remaining, |batch| {
                let points: Vec<TwoSidedPoint> = batch.iter().map(|&e| self.point(e)).collect();
                let samples = gather_two_sided(&mut *self.gatherer, field, &points)?;
                for (&e, sample) in batch.iter().zip(samples) {
                    if sample.inverse_distance * self.size(e).max(footprint) > 1.0 {
                        narrow.push((e, self.albedo(e) * sample.irradiance));
                    }
                }
                Ok::<_, Error>(())
            })?;
            if self.report(elements.len(), remaining.len()).is_break() {
                return Ok(None);
            }
        }
        Ok(Some(narrow))
    }

    /// Adds to what `elements` reflect, W/m², what they gather more of the first field than of the
    /// second.
    fn add_change(
        &mut self,
        elements: &mut [(usize, Rgb)],
        fields: [&RadiosityField; 2],
    ) -> Result<ControlFlow<()>, Error> {
        let count = elements.len();
        let points: Vec<TwoSidedPoint> = elements.iter().map(|&(e, _)| self.point(e)).collect();
        let mut remaining = &points[..];
        let mut done = 0;
        let mut batches = BatchSizer::new(FIRST_BATCH);
        while !remaining.is_empty() {
            batches.next(&mut remaining, |batch| {
                let [now, before] = gather_both_two_sided(&mut *self.gatherer, fields, batch)?;
                for (now, before) in now.iter().zip(before) {
                    let (e, value) = elements[done];
                    let change = self.albedo(e) * (now.irradiance - before.irradiance);
                    elements[done].1 = (value + change).max(Rgb::ZERO);
                    done += 1;
                }
                Ok::<_, Error>(())
            })?;
            if self.report(count, remaining.len()).is_break() {
                return Ok(ControlFlow::Break(()));
            }
        }
        Ok(ControlFlow::Continue(()))
    }

    fn report(&mut self, total: usize, remaining: usize) -> ControlFlow<()> {
        let elements = self.mesh.element_count();
        let gathered = total - remaining;
        (self.progress)(&Progress { pass: 0, refinements: 0, elements, gathered, total })
    }
}
