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

use super::directional_light::{Direct, DirectionalLight};
use super::gather_points::VertexGatherPoints;
use super::refinement_indicator::{ErrorScale, RMS_OVER_JUMP, counted_area, is_finest};
use super::refinement_settings::RefinementSettings;
use super::sampled_mesh::{SampledMesh, new_vertices};
use crate::error::Error;
use crate::scene::Rgb;

/// Splits the elements of `samples` that an edge of a shadow of `light` crosses, down to the
/// shortest edge of `settings`; with `residual_error` of each element (W/m²), which its parts keep.
pub(super) fn resolve_shadow_edges(
    mut samples: SampledMesh,
    mut residual_error: Vec<f64>,
    light: &DirectionalLight,
    scale: &ErrorScale,
    settings: &RefinementSettings,
) -> Result<(SampledMesh, Vec<f64>), Error> {
    for (reflected, direct) in samples.reflected.iter_mut().zip(&samples.direct) {
        *reflected -= direct.arriving;
    }
    loop {
        let mut crossed = crossed_elements(&samples, scale, settings);
        let room = settings.max_elements.saturating_sub(samples.mesh.element_count()) / 3;
        crossed.truncate(room);
        if crossed.is_empty() {
            break;
        }
        crossed.sort_unstable();
        let (mut finer, old_numbers) = samples.with_split(&crossed)?;
        let points = VertexGatherPoints::new(&finer.mesh, &finer.vertices, scale.touching());
        let new = new_vertices(&old_numbers);
        let direct: Vec<Direct> = new
            .par_iter()
            .map(|&v| light.reflected(points.albedo(v), &points.point(v, 0)))
            .collect();
        for (v, direct) in new.into_iter().zip(direct) {
            finer.direct[v as usize] = direct;
        }
        residual_error = inherited(&residual_error, &crossed);
        samples = finer;
    }
    for (reflected, direct) in samples.reflected.iter_mut().zip(&samples.direct) {
        *reflected = (*reflected + direct.arriving).max(Rgb::ZERO);
    }
    Ok((samples, residual_error))
}

/// The elements that an edge crosses and that may be off by more than `settings` allow, those with
/// the largest squared error times area first. `samples` reflect all
/// light but that.
fn crossed_elements(
    samples: &SampledMesh,
    scale: &ErrorScale,
    settings: &RefinementSettings,
) -> Vec<usize> {
    let error = |(e, outline): (usize, &[u32])| {
        let is_buried = outline.iter().any(|&v| samples.buried[v as usize]);
        if is_buried || !samples.is_splittable(e) || is_finest(samples, scale, settings, e) {
            return None;
        }
        let emitted = samples.mesh.material(samples.mesh.element(e)).exitance;
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
        let allowed = settings.mesh_error * settings.group_factor(group(samples, e));
        (error > allowed).then(|| (error * error * counted_area(samples, scale, settings, e), e))
    };
    let outlines: Vec<(usize, &[u32])> = samples.vertices.outlines.iter().collect();
    let mut crossed: Vec<(f64, usize)> = outlines.into_par_iter().filter_map(error).collect();
    crossed.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    crossed.into_iter().map(|(_, e)| e).collect()
}

fn group(samples: &SampledMesh, e: usize) -> u32 {
    samples.mesh.group(samples.mesh.element(e))
}

/// `values` of elements where each of `split` (ascending) has become four with the same value.
fn inherited(values: &[f64], split: &[usize]) -> Vec<f64> {
    let mut split = split.iter().peekable();
    let parts = |(e, &value): (usize, &f64)| {
        let count = if split.next_if_eq(&&e).is_some() { 4 } else { 1 };
        std::iter::repeat_n(value, count)
    };
    values.iter().enumerate().flat_map(parts).collect()
}
