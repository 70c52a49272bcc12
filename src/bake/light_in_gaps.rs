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
//! Elements that see what is nearer than light is resolved on them gather, at their viewpoints,
//! and [exchange](crate::gather::exchange) light by what they see of each other.

use std::ops::ControlFlow;

use rayon::prelude::*;

use crate::accuracy::Measure;
use crate::backend::cpu::RayGather;
use crate::bake::model;
use crate::error::Error;
use crate::gather::exchange::{Place, SeenPlace, is_in_gap, settle};
use crate::gather::gather_points::SurfaceOffset;
use crate::gather::point_row::{PointRows, SurfaceHit};
use crate::gather::two_sided::{TwoSidedPoint, gather_two_sided};
use crate::gather::{IrradianceSample, Progress, RadiosityField};
use crate::mesh::Mesh;
use crate::progress::BatchSizer;
use crate::scene::Rgb;
use crate::vertex::irradiance;

/// Elements in the first batch; later ones follow the clock. Chosen by hand: results do not depend
/// on it.
const FIRST_BATCH: usize = 1024;

/// Share of the light that an element gathers, below which what is left of it without that of
/// others is rounding: of shares in 32 bits.
const ROUNDING: f64 = 1e-6;

/// In the place of an element's number among those in gaps: it is in none.
const IN_NO_GAP: u32 = u32::MAX;

/// The `radiosity` of the elements of `mesh`, W/m², where light is resolved down to `footprint`
/// (scene unit): gathered instead, by rays on every backend, by those for which the mean of
/// 1/distance to what they see, times the larger of their size and the footprint, is above 1.
///
/// None where `progress` broke.
pub(super) fn light_in_gaps(
    mesh: &Mesh,
    radiosity: &[Rgb],
    footprint: f64,
    progress: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Option<Vec<Rgb>>, Error> {
    let shot: Vec<Rgb> = (0..mesh.element_count())
        .map(|e| albedo(mesh, e) * irradiance(radiosity[e] - mesh.exitance(e), mesh.albedo(e)))
        .collect();
    let corners: Vec<[u32; 3]> = (0..mesh.element_count() as u32).map(|e| [e; 3]).collect();
    let field = RadiosityField { mesh, corners: &corners, reflected: &shot };
    let floor = field.radiosity_floor(Measure::default().floor);
    let mut elements =
        GatheringElements { mesh, above: SurfaceOffset::new(mesh.scene()), progress };
    let mut rays = RayGather::new(mesh, model::GAP_RAYS)?;
    let Some(gaps) = elements.in_gaps(&mut rays, &field, footprint)? else { return Ok(None) };
    let Some(places) = elements.exchange(&rays, &gaps, &shot)? else { return Ok(None) };
    let mut radiosity = radiosity.to_vec();
    for (&(e, _), reflected) in gaps.iter().zip(settle(&places, floor)) {
        let irradiance = irradiance(reflected, albedo(mesh, e));
        radiosity[e] = mesh.exitance(e) + mesh.albedo(e) * irradiance;
    }
    Ok(Some(radiosity))
}

/// Albedo of the material of element `e`, whatever its texture.
fn albedo(mesh: &Mesh, e: usize) -> Rgb {
    mesh.material(mesh.element(e)).albedo()
}

/// Elements that gather at their viewpoints.
struct GatheringElements<'a> {
    mesh: &'a Mesh,
    above: SurfaceOffset,
    progress: &'a mut dyn FnMut(&Progress) -> ControlFlow<()>,
}

impl GatheringElements<'_> {
    fn point(&self, e: usize) -> TwoSidedPoint {
        let node = self.mesh.element(e);
        TwoSidedPoint::new(self.above.above_element(self.mesh, node), self.mesh.material(node))
    }

    /// The elements in gaps, each with what it reflects of `field`, W/m²; none if cancelled.
    fn in_gaps(
        &mut self,
        rays: &mut RayGather,
        field: &RadiosityField,
        footprint: f64,
    ) -> Result<Option<Vec<(usize, Rgb)>>, Error> {
        let mesh = self.mesh;
        let scatters = |e: &usize| mesh.scatters(mesh.element(*e));
        let elements: Vec<usize> = (0..mesh.element_count()).filter(scatters).collect();
        let mut gaps = vec![];
        let flow = self.in_batches(&elements, |batch, points| {
            let narrow = |(&e, p): (&usize, &TwoSidedPoint)| {
                let size = mesh.area(mesh.element(e)).sqrt().max(footprint);
                is_in_gap(rays.inverse_distance(&p.point), size).then_some((e, *p))
            };
            let found = batch.par_iter().zip(points).filter_map(narrow);
            let (found, points): (Vec<usize>, Vec<TwoSidedPoint>) = found.unzip();
            let samples = gather_two_sided(rays, field, &points)?;
            let light = |(e, s): (usize, IrradianceSample)| (e, albedo(mesh, e) * s.irradiance);
            gaps.extend(found.into_iter().zip(samples).map(light));
            Ok(())
        })?;
        Ok(flow.is_continue().then_some(gaps))
    }

    /// The elements of `gaps` as places that exchange light, where all elements reflect `shot`
    /// (W/m²) and by that these reflect what stands beside them, as `rays` found; none if
    /// cancelled.
    fn exchange(
        &mut self,
        rays: &RayGather,
        gaps: &[(usize, Rgb)],
        shot: &[Rgb],
    ) -> Result<Option<Vec<Place>>, Error> {
        let mesh = self.mesh;
        let mut number = vec![IN_NO_GAP; mesh.element_count()];
        (0..).zip(gaps).for_each(|(k, &(e, _))| number[e] = k);
        // By the rays that gathered, what they found of each other's light is taken off exactly.
        let seen_from = |point: &TwoSidedPoint| {
            let mut seen = vec![];
            for (point, share) in point.sides() {
                let row = rays.surface_row(mesh, mesh, &point);
                let in_gap = |hit: &&SurfaceHit| number[hit.element as usize] != IN_NO_GAP;
                seen.extend(row.hits.iter().filter(in_gap).map(|hit| {
                    let e = hit.element as usize;
                    let factor = row.share * hit.passed.x * mesh.relative_reflectance(e);
                    (number[e], share * factor)
                }));
            }
            SeenPlace::merged(seen)
        };
        let elements: Vec<usize> = gaps.iter().map(|&(e, _)| e).collect();
        let mut seen: Vec<Vec<SeenPlace>> = vec![];
        let flow = self.in_batches(&elements, |_, points| {
            seen.par_extend(points.par_iter().map(seen_from));
            Ok(())
        })?;
        if flow.is_break() {
            return Ok(None);
        }
        let place = |(&(e, reflected), seen): (&(usize, Rgb), Vec<SeenPlace>)| {
            let light = |seen: &SeenPlace| seen.share() * shot[gaps[seen.place as usize].0];
            let albedo = albedo(mesh, e);
            let constant = reflected - albedo * seen.iter().map(light).sum::<Rgb>();
            // Where they see nothing else, rounding would be left.
            let constant = Rgb::select(constant.cmpgt(reflected * ROUNDING), constant, Rgb::ZERO);
            Place { albedo, constant, seen }
        };
        Ok(Some(gaps.iter().zip(seen).map(place).collect()))
    }

    /// Has `work` done on batches of `elements` and their points, until it is done or cancelled.
    fn in_batches(
        &mut self,
        elements: &[usize],
        mut work: impl FnMut(&[usize], &[TwoSidedPoint]) -> Result<(), Error>,
    ) -> Result<ControlFlow<()>, Error> {
        let total = elements.len();
        let mut remaining = elements;
        let mut batches = BatchSizer::new(FIRST_BATCH);
        while !remaining.is_empty() {
            batches.next(&mut remaining, |batch| {
                let points: Vec<TwoSidedPoint> = batch.iter().map(|&e| self.point(e)).collect();
                work(batch, &points)
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
        let after = light_in_gaps(&mesh, &before, 0.0, &mut progress).unwrap().unwrap();
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
        let mut calls = 0;
        let stop_at = |last: u32, calls: &mut u32| {
            *calls = 0;
            light_in_gaps(&mesh, &before, 0.0, &mut |p: &Progress| {
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
