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
        TwoSidedPoint::new(self.above.above_element(self.mesh, node), self.mesh.material(node))
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
        let flow = self.in_batches(elements, |gaps, batch, points| {
            let samples = gather_two_sided(&mut *gaps.gatherer, field, points)?;
            for (&e, sample) in batch.iter().zip(samples) {
                if sample.inverse_distance * gaps.size(e).max(footprint) > 1.0 {
                    narrow.push((e, gaps.albedo(e) * sample.irradiance));
                }
            }
            Ok(())
        })?;
        Ok(flow.is_continue().then_some(narrow))
    }

    /// Adds to what `elements` reflect, W/m², what they gather more of the first field than of the
    /// second.
    fn add_change(
        &mut self,
        elements: &mut [(usize, Rgb)],
        fields: [&RadiosityField; 2],
    ) -> Result<ControlFlow<()>, Error> {
        let numbers: Vec<usize> = elements.iter().map(|&(e, _)| e).collect();
        let mut remaining = elements.iter_mut();
        self.in_batches(&numbers, |gaps, _, points| {
            let [now, before] = gather_both_two_sided(&mut *gaps.gatherer, fields, points)?;
            let changes = now.iter().zip(before);
            for ((now, before), (e, value)) in changes.zip(remaining.by_ref()) {
                let change = gaps.albedo(*e) * (now.irradiance - before.irradiance);
                *value = (*value + change).max(Rgb::ZERO);
            }
            Ok(())
        })
    }

    /// Has `work` done on batches of `elements` and their points, until it is done or cancelled.
    fn in_batches(
        &mut self,
        elements: &[usize],
        mut work: impl FnMut(&mut Self, &[usize], &[TwoSidedPoint]) -> Result<(), Error>,
    ) -> Result<ControlFlow<()>, Error> {
        let total = elements.len();
        let mut remaining = elements;
        let mut batches = BatchSizer::new(FIRST_BATCH);
        while !remaining.is_empty() {
            batches.next(&mut remaining, |batch| {
                let points: Vec<TwoSidedPoint> = batch.iter().map(|&e| self.point(e)).collect();
                work(self, batch, &points)
            })?;
            let (elements, gathered) = (self.mesh.element_count(), total - remaining.len());
            let report = Progress { pass: 0, refinements: 0, elements, gathered, total };
            if (self.progress)(&report).is_break() {
                return Ok(ControlFlow::Break(()));
            }
        }
        Ok(ControlFlow::Continue(()))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DVec3;

    use super::*;
    use crate::backend::Backend;
    use crate::scene::{Material, Scene, Triangle};

    /// A floor of 8 × 8 under a white sky, and on it, 0.01 above, a lid of 2 × 2 that is 0.1 high,
    /// seen from within; all reflect a half.
    fn lid() -> Mesh {
        let quads = [
            [[-4.0, -4.0, 0.0], [4.0, -4.0, 0.0], [4.0, 4.0, 0.0], [-4.0, 4.0, 0.0]],
            [[-1.0, -1.0, 0.11], [-1.0, 1.0, 0.11], [1.0, 1.0, 0.11], [1.0, -1.0, 0.11]],
            [[-1.0, -1.0, 0.01], [-1.0, 1.0, 0.01], [-1.0, 1.0, 0.11], [-1.0, -1.0, 0.11]],
            [[1.0, -1.0, 0.01], [1.0, -1.0, 0.11], [1.0, 1.0, 0.11], [1.0, 1.0, 0.01]],
            [[-1.0, -1.0, 0.01], [-1.0, -1.0, 0.11], [1.0, -1.0, 0.11], [1.0, -1.0, 0.01]],
            [[-1.0, 1.0, 0.01], [1.0, 1.0, 0.01], [1.0, 1.0, 0.11], [-1.0, 1.0, 0.11]],
        ];
        let positions: Vec<DVec3> = quads.iter().flatten().copied().map(DVec3::from).collect();
        let triangles = (0..quads.len() as u32)
            .flat_map(|k| [[4 * k, 4 * k + 1, 4 * k + 2], [4 * k, 4 * k + 2, 4 * k + 3]])
            .map(|corners| Triangle { corners, ..Default::default() })
            .collect();
        let materials = vec![Material::grey("grey", 0.5)];
        let scene = Scene::new(positions, triangles, vec!["all".into()], materials).unwrap();
        Mesh::new(Arc::new(scene.with_sky(Rgb::ONE / std::f64::consts::PI).unwrap()), 0.5).unwrap()
    }

    fn progress(_: &Progress) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    #[test]
    fn a_gap_is_as_dark_as_what_it_sees() {
        let mesh = lid();
        // As if all had got the light of the open floor.
        let before = vec![Rgb::splat(0.5); mesh.element_count()];
        let backend = ResilientBackend::new(&Backend::Cpu);
        let after = light_in_gaps(&mesh, &before, 0.0, &backend, &mut progress).unwrap().unwrap();
        let (mut open, mut inside) = (0, vec![]);
        for e in 0..mesh.element_count() {
            let centre = mesh.centroid(mesh.element(e));
            let from_middle = centre.x.abs().max(centre.y.abs());
            if from_middle > 2.0 {
                assert_eq!(before[e], after[e], "at {centre}");
                open += 1;
            } else if from_middle < 0.8 {
                inside.push(after[e].x);
            }
        }
        let mean = inside.iter().sum::<f64>() / inside.len() as f64;
        let most = inside.iter().copied().fold(0.0, f64::max);
        println!("{open} open, {} inside: {mean:.5}, at most {most:.5}", inside.len());
        // The slit of 0.01 is seen from 0.2 off under 0.05, at most: a share of sin² 0.05 = 0.0025
        // of the floor's hemisphere, and of the lid's sin² 0.5 − sin² 0.46 = 0.03, by the side that
        // it is nearest to. Where one of 32 rays goes through, an element has 0.5/32 = 0.016; two
        // or three may.
        assert!(open > 100 && inside.len() > 50);
        assert!(mean < 0.016 && most < 0.05, "{mean} {most}");
    }

    #[test]
    fn a_break_ends_it() {
        let mesh = lid();
        let before = vec![Rgb::splat(0.5); mesh.element_count()];
        let backend = ResilientBackend::new(&Backend::Cpu);
        let mut calls = 0;
        let stop_at = |last: u32, calls: &mut u32| {
            *calls = 0;
            light_in_gaps(&mesh, &before, 0.0, &backend, &mut |p: &Progress| {
                assert!(p.gathered <= p.total && p.elements == mesh.element_count());
                *calls += 1;
                if *calls == last { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            })
            .unwrap()
        };
        assert!(stop_at(u32::MAX, &mut calls).is_some());
        let all = calls;
        assert!(all > 2, "several rounds");
        for last in [1, 2] {
            assert!(stop_at(last, &mut calls).is_none());
            assert_eq!(calls, last);
        }
    }
}
