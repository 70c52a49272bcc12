//! Edges of the shadows that the sun and luminaires cast.
//!
//! Their light comes from known directions, so a few rays give it at any point, and all other light
//! is smooth across the edges of its shadows. After the last pass elements that such an edge
//! crosses are split; new vertices cast rays for that light D and interpolate all other light:
//!
//! ```text
//!   a ●───────┼──● b     B_m = (B_a − D_a + B_b − D_b) / 2 + D_m      m: middle of a side
//!     lit     │ hidden
//! ```
//!
//! No vertex gathers: an edge costs as many rays as it has vertices. It may lie anywhere between
//! two vertices that differ; one that passes between all vertices of an element is not detected.

use rayon::prelude::*;

use super::directional_light::DirectionalLight;
use super::gather_points::VertexGatherPoints;
use super::refinement_indicator::{ErrorScale, RMS_OVER_JUMP, counted_area, is_finest};
use super::refinement_settings::RefinementSettings;
use super::sampled_mesh::{SampledMesh, new_vertices};
use crate::error::Error;
use crate::scene::Rgb;
use crate::work;

/// Squared error that elements at edges may have together without being split, over what the mesh
/// may have: those are slivers, as the shortest edge bounds all others.
const NEGLIGIBLE_SHARE: f64 = 0.01;

/// `samples` with the elements split that an edge of a shadow of `light` crosses, down to the
/// shortest edge of `settings`.
pub(super) fn resolve_shadow_edges(
    samples: &SampledMesh,
    light: &DirectionalLight,
    scale: &ErrorScale,
    settings: &RefinementSettings,
) -> Result<SampledMesh, Error> {
    let mut samples = samples.clone();
    for (reflected, direct) in samples.reflected.iter_mut().zip(&samples.direct) {
        *reflected -= direct.arriving;
    }
    let counted = |e| counted_area(&samples, scale, settings, e);
    let area: f64 = (0..samples.mesh.element_count()).map(counted).sum();
    let negligible = NEGLIGIBLE_SHARE * settings.mesh_error.powi(2) * area;
    loop {
        let mut crossed = crossed_elements(&samples, scale, settings, negligible);
        let room = settings.max_elements.saturating_sub(samples.mesh.element_count()) / 3;
        crossed.truncate(room);
        if crossed.is_empty() {
            break;
        }
        crossed.sort_unstable();
        let (mut finer, old_numbers) = samples.with_split(&crossed)?;
        let points = VertexGatherPoints::new(&finer.mesh, &finer.vertices, scale.touching());
        let new = new_vertices(&old_numbers);
        let at = |v: u32| light.reflected(points.albedo(v), &points.point(v, 0), None);
        let direct = work::map(new.len(), |k| at(new[k]));
        for (v, direct) in new.into_iter().zip(direct) {
            finer.direct[v as usize] = direct;
        }
        samples = finer;
    }
    for (reflected, direct) in samples.reflected.iter_mut().zip(&samples.direct) {
        *reflected = (*reflected + direct.arriving).max(Rgb::ZERO);
    }
    Ok(samples)
}

/// The elements that an edge crosses and that may be off by more than `settings` allow, those with
/// the largest squared error times area first; without the smallest, as many as have `negligible`
/// together. `samples` reflect all light but that of the shadows.
fn crossed_elements(
    samples: &SampledMesh,
    scale: &ErrorScale,
    settings: &RefinementSettings,
    mut negligible: f64,
) -> Vec<usize> {
    let error = |(e, outline): (usize, &[u32])| {
        let is_buried = outline.iter().any(|&v| samples.buried[v as usize]);
        if is_buried || !samples.is_splittable(e) || is_finest(samples, scale, settings, e) {
            return None;
        }
        let node = samples.mesh.element(e);
        let emitted = samples.mesh.material(node).exitance;
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        let (mut darkest, mut brightest) = (f64::INFINITY, 0f64);
        for v in outline.iter().map(|&v| v as usize) {
            let radiosity = samples.reflected[v] + samples.direct[v].arriving + emitted;
            darkest = darkest.min(radiosity.length());
            if let Some(share) = samples.direct[v].share() {
                (low, high) = (low.min(share), high.max(share));
                brightest = brightest.max(samples.direct[v].unoccluded.length());
            }
        }
        let jump = (high - low).max(0.0) * brightest;
        let error = RMS_OVER_JUMP * jump / darkest.max(scale.radiosity_floor);
        let allowed = settings.mesh_error * settings.group_factor(samples.mesh.group(node));
        (error > allowed).then(|| (error * error * counted_area(samples, scale, settings, e), e))
    };
    let all: Vec<(usize, &[u32])> = samples.vertices.outlines.iter().collect();
    let mut crossed: Vec<(f64, usize)> = all.par_iter().copied().filter_map(error).collect();
    crossed.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    while let Some(&(square, _)) = crossed.last()
        && square <= negligible
    {
        negligible -= square;
        crossed.pop();
    }
    crossed.into_iter().map(|(_, e)| e).collect()
}
