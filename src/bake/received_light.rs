//! What elements receive before any light is shot: from the sky and lights that are gathered, at
//! their centroids, and from luminaires.
//!
//! ```text
//!      ●             luminaire        A part of an element has one point where no luminaire is
//!   ┌───────────┬─────┬──┬──┐         nearer than twice its width; else it is cut in four.
//!   │           │     ├──┼──┤
//! ```

use std::ops::ControlFlow;

use glam::DVec3;
use rayon::prelude::*;

use crate::bake::fallback::ResilientBackend;
use crate::bake::light_survey;
use crate::bake::model;
use crate::error::Error;
use crate::gather::GatherPoint;
use crate::gather::directional_light::DirectionalLight;
use crate::gather::gather_points::SurfaceOffset;
use crate::mesh::{Mesh, NodeId};
use crate::scene::{Luminaire, Rgb, longest_edge};
use crate::solver::ReceivedLight;
use crate::work::Batches;

/// Maximum number of times that an element is cut in four.
const MAX_CUTS: u32 = 5;

/// Called between batches; a break stops the work.
type Proceed<'a> = &'a mut dyn FnMut() -> ControlFlow<()>;

/// What the elements of `mesh` receive of lights of these `materials`, which are gathered, and of
/// sky and luminaires. After a break of `proceed` the light is that of some of the elements.
pub(super) fn received(
    mesh: &Mesh,
    materials: &[u32],
    backend: &ResilientBackend,
    proceed: Proceed,
) -> Result<ReceivedLight, Error> {
    let scene = mesh.scene();
    if materials.is_empty() && !scene.has_light_of_no_surface() {
        return Ok(ReceivedLight::default());
    }
    let scatters = |&e: &usize| mesh.scatters(mesh.element(e));
    let elements: Vec<usize> = (0..mesh.element_count()).filter(scatters).collect();
    let mut irradiance = vec![Rgb::ZERO; mesh.element_count()];
    if !materials.is_empty() || !scene.sky().is_black() {
        add_gathered(mesh, materials, backend, &elements, &mut irradiance, proceed)?;
    }
    if !scene.luminaires().is_empty() {
        add_luminaires(mesh, &elements, &mut irradiance, proceed);
    }
    Ok(ReceivedLight { irradiance, materials: materials.to_vec() })
}

/// Adds the light of the sky and of these `materials`.
fn add_gathered(
    mesh: &Mesh,
    materials: &[u32],
    backend: &ResilientBackend,
    elements: &[usize],
    irradiance: &mut [Rgb],
    proceed: Proceed,
) -> Result<(), Error> {
    let mut lit = mesh.scene().materials().to_vec();
    for (_, material) in (0..).zip(&mut lit).filter(|(m, _)| !materials.contains(m)) {
        material.exitance = Rgb::ZERO;
    }
    let scene = mesh.scene().with_materials(lit)?.with_luminaires(vec![])?;
    let mesh = &mesh.with_scene(scene)?;
    let above = SurfaceOffset::new(mesh.scene());
    let corners = vec![[0; 3]; mesh.element_count()];
    let mut gatherer = backend.gather_evenly(mesh, model::received_rays(elements.len()))?;
    let field = light_survey::dark(mesh, &corners);
    let (mut remaining, mut batches) = (elements, Batches::new(256));
    while !remaining.is_empty() && proceed().is_continue() {
        let (batch, samples) = batches.try_next(&mut remaining, |batch| {
            let point = |&e: &usize| above.above_element(mesh, mesh.element(e));
            let points: Vec<GatherPoint> = batch.iter().map(point).collect();
            gatherer.gather(&field, &points)
        })?;
        for (&e, sample) in batch.iter().zip(samples) {
            irradiance[e] += sample.irradiance;
        }
    }
    Ok(())
}

/// Adds the light of luminaires.
fn add_luminaires(mesh: &Mesh, elements: &[usize], irradiance: &mut [Rgb], proceed: Proceed) {
    let Some(light) = DirectionalLight::of_scene(mesh.shared_scene()) else { return };
    let above = SurfaceOffset::new(mesh.scene());
    let luminaires: Vec<&Luminaire> = mesh.scene().luminaires().iter().collect();
    let (mut remaining, mut batches) = (elements, Batches::new(64));
    while !remaining.is_empty() && proceed().is_continue() {
        let of_element = |&e: &usize| -> Rgb {
            let parts = parts(&above, mesh, mesh.element(e), &luminaires);
            parts.into_iter().map(|p| p.share * light.of_luminaires(&p.point)).sum()
        };
        let (batch, received) = batches
            .next(&mut remaining, |batch| batch.par_iter().map(of_element).collect::<Vec<_>>());
        batch.iter().zip(received).for_each(|(&e, sum)| irradiance[e] += sum);
    }
}

/// A point that stands for a part of an element.
#[derive(Clone, Copy, Debug)]
struct Part {
    point: GatherPoint,
    /// Share of the element's area.
    share: f64,
}

/// The parts of `node` of `mesh`, lit by `luminaires`.
fn parts(above: &SurfaceOffset, mesh: &Mesh, node: NodeId, luminaires: &[&Luminaire]) -> Vec<Part> {
    let (corners, normal) = (mesh.corners(node), mesh.normal(node));
    let mut middles = vec![];
    cut(corners, normal, 0, luminaires, &mut middles);
    if let [_] = middles[..] {
        return vec![Part { point: above.above_element(mesh, node), share: 1.0 }];
    }
    let size = mesh.area(node).sqrt();
    let of_part = |(middle, cuts): (DVec3, u32)| {
        let size = size / libm::exp2(f64::from(cuts));
        Part { point: above.gather_point(middle, normal, size), share: 0.25f64.powi(cuts as i32) }
    };
    middles.into_iter().map(of_part).collect()
}

/// Adds the middles of the parts of a triangle with this unit `normal`, each with the number of
/// times that it was cut in four, for the `luminaires` that may be near it.
fn cut(
    corners: [DVec3; 3],
    normal: DVec3,
    cuts: u32,
    luminaires: &[&Luminaire],
    middles: &mut Vec<(DVec3, u32)>,
) {
    let [a, b, c] = corners;
    let (middle, width) = ((a + b + c) / 3.0, longest_edge(corners));
    let lights = |l: &Luminaire| {
        [middle, a, b, c].into_iter().any(|at| l.irradiance(l.position, at, normal) > 0.0)
    };
    // Parts of width w at most half of their distance h: at the foot of a point light, the middle
    // of one is 3 w²/24 h² = 3 % brighter than its mean.
    let is_near =
        |l: &&&Luminaire| l.distance_to_box(middle) - width / 2.0 < 2.0 * width && lights(l);
    let near: Vec<&Luminaire> = luminaires.iter().filter(is_near).copied().collect();
    if cuts == MAX_CUTS || near.is_empty() {
        middles.push((middle, cuts));
        return;
    }
    let [ab, bc, ca] = [a.midpoint(b), b.midpoint(c), c.midpoint(a)];
    for part in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
        cut(part, normal, cuts + 1, &near, middles);
    }
}
