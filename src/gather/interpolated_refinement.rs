//! The last refinement: elements are split once more onto the quadratic interpolant, and each gets
//! an estimate of the error that remains. Nothing gathers.
//!
//! After the last pass, the six nodes of each parent are known, and where the light is smooth its
//! quadratic interpolant is far better than linear elements. Elements that differ from it by more
//! than `interpolation_tolerance` are split, and the new vertices are put on it.
//!
//! The error that remains in an element (W/m²) is estimated from its parent's surplus s:
//!
//! | element | estimate |
//! |---|---|
//! | as gathered | s/4: the surplus that its own midsides would have |
//! | split onto the interpolant | s/8 |
//! | at a boundary of its surface or next to buried vertices | 2.5 · s/4 |
//! | without a parent | how far the source light is from linear |

use rayon::prelude::*;
use rustc_hash::FxHashSet;

use super::RadiosityField;
use super::refinement_indicator::{ErrorScale, counted_area, source_nonlinearity};
use super::refinement_settings::RefinementSettings;
use super::sampled_mesh::{SampledMesh, new_vertices};
use super::surplus::HierarchicalSurplus;
use crate::error::Error;
use crate::scene::Rgb;
use crate::vertex::keys::VertexKey;
use crate::work;

/// The refined mesh, and an estimate of the error that remains in each of its elements, W/m²: a
/// length over the channels.
pub(super) struct InterpolatedRefinement {
    pub samples: SampledMesh,
    pub residual_error: Vec<f64>,
}

/// Splits elements that differ from the quadratic interpolant over their parent by more than
/// `settings` allow: new vertices lie on it, or on the mean of two, and do not gather.
pub(super) fn interpolated_refinement(
    samples: &SampledMesh,
    source: &RadiosityField,
    scale: &ErrorScale,
    settings: &RefinementSettings,
) -> Result<InterpolatedRefinement, Error> {
    let split = to_be_split(samples, scale, settings);
    let (mut refined, old_numbers) = samples.with_split(&split)?;
    put_on_interpolants(&mut refined, &new_vertices(&old_numbers), samples, &split);
    let residual_error = residual_errors(samples, source, &split);
    Ok(InterpolatedRefinement { samples: refined, residual_error })
}

/// The quadratic interpolant over the parent of element `e`, where it describes the light.
fn interpolant(samples: &SampledMesh, e: usize) -> Option<HierarchicalSurplus> {
    HierarchicalSurplus::of_parent(samples, e).filter(HierarchicalSurplus::is_smooth)
}

/// Elements whose own sides would have a surplus above the tolerance, which is less the larger they
/// are, ascending; as many as there is room for, the worst of them.
fn to_be_split(
    samples: &SampledMesh,
    scale: &ErrorScale,
    settings: &RefinementSettings,
) -> Vec<usize> {
    let counted = |e| counted_area(samples, scale, settings, e);
    let count = samples.mesh.element_count();
    let mean_area = (0..count).map(counted).sum::<f64>() / count as f64;
    // Over the radiosity.
    let surplus = |e: usize| {
        let node = samples.mesh.element(e);
        if !samples.is_splittable(e) {
            return None;
        }
        let interpolant = interpolant(samples, e)?;
        let emitted = samples.mesh.material(node).exitance;
        let radiosity = (interpolant.corner_mean() + emitted).length().max(scale.radiosity_floor);
        let size = (counted(e) / mean_area).sqrt();
        let surplus = interpolant.predicted_child_surplus() * size;
        let group_factor = settings.group_factor(samples.mesh.group(node));
        (surplus > settings.interpolation_tolerance * group_factor * radiosity)
            .then_some((surplus / radiosity, e))
    };
    let mut found: Vec<(f64, usize)> = work::map(count, surplus).into_iter().flatten().collect();
    found.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    found.truncate(settings.max_elements.saturating_sub(count) / 3);
    let mut elements: Vec<usize> = found.into_iter().map(|(_, e)| e).collect();
    elements.sort_unstable();
    elements
}

/// Gives the `new` vertices of `refined`, which is `samples` with the elements `split`, the mean of
/// what the interpolants of these elements have at their midsides.
fn put_on_interpolants(
    refined: &mut SampledMesh,
    new: &[u32],
    samples: &SampledMesh,
    split: &[usize],
) {
    let mesh = &samples.mesh;
    let values = |&e: &usize| {
        let place = mesh.place_in_parent(mesh.element(e)).expect("a child of its parent");
        interpolant(samples, e).expect("all that are to be split have one").child_midsides(place)
    };
    let values: Vec<[Rgb; 3]> = split.par_iter().map(values).collect();
    let mut sums = vec![(Rgb::ZERO, 0.0); refined.reflected.len()];
    for (k, (&e, values)) in split.iter().zip(values).enumerate() {
        // Each split before this one has put four elements in the place of one. The corners of the
        // last part are the middles of the sides opposite.
        let middle = refined.corners()[e + 3 * k + 3];
        for (value, corner) in values.into_iter().zip([2, 0, 1]) {
            let (sum, count) = &mut sums[middle[corner] as usize];
            *sum += value;
            *count += 1.0;
        }
    }
    for v in new.iter().map(|&v| v as usize) {
        let (sum, count) = sums[v];
        refined.reflected[v] = sum / count;
    }
}

/// Error that remains in each element after `split` (ascending) were split, W/m².
fn residual_errors(samples: &SampledMesh, source: &RadiosityField, split: &[usize]) -> Vec<f64> {
    let at_boundary = boundary_vertices(samples);
    let is_split = |e: usize| split.binary_search(&e).is_ok();
    let error = |e: usize| {
        let error = match HierarchicalSurplus::of_parent(samples, e) {
            Some(surplus) => surplus.predicted_sampled_child_surplus(),
            None => source_nonlinearity(&samples.mesh, source, e),
        };
        let factor = if samples.corners()[e].iter().any(|&v| at_boundary[v as usize]) {
            // Next to a wall light goes as d ln d with the distance d, which is no quadratic, and
            // half of whose side h has more than a quarter of the surplus.
            2.5
        } else if is_split(e) {
            0.5
        } else {
            1.0
        };
        factor * error
    };
    let own = work::map(samples.mesh.element_count(), error);
    let mut errors = Vec::with_capacity(own.len() + 3 * split.len());
    for (e, error) in own.into_iter().enumerate() {
        let children = if is_split(e) { 4 } else { 1 };
        errors.resize(errors.len() + children, error);
    }
    errors
}

/// Whether each vertex lies on the boundary of a smooth surface, or on an element with a buried
/// corner.
fn boundary_vertices(samples: &SampledMesh) -> Vec<bool> {
    let mut at_boundary = samples.buried.clone();
    for corners in samples.corners() {
        if corners.iter().any(|&v| samples.buried[v as usize]) {
            for &v in corners {
                at_boundary[v as usize] = true;
            }
        }
    }
    // Identities of the sides across which a smooth surface continues.
    let topology = &samples.topology;
    let shared: FxHashSet<u32> =
        topology.shared_edges().map(|[(t, k), _]| topology.sides[t][k].id).collect();
    // Where neighbours differ in size, inner sides occur once too: those are on no triangle's side.
    let may_be_outer = |v: u32| match samples.vertices.keys[v as usize] {
        VertexKey::Inside { .. } => false,
        VertexKey::Side { id, .. } => !shared.contains(&id),
        VertexKey::Corner(_) => true,
    };
    let sides = |&[a, b, c]: &[u32; 3]| [[a, b], [b, c], [c, a]].map(|[v, w]| [v.min(w), v.max(w)]);
    let mut sides: Vec<[u32; 2]> = samples.corners().iter().flat_map(sides).collect();
    sides.par_sort_unstable();
    for alike in sides.chunk_by(|side, next| side == next) {
        let [a, b] = alike[0];
        if alike.len() == 1 && may_be_outer(a) && may_be_outer(b) {
            at_boundary[a as usize] = true;
            at_boundary[b as usize] = true;
        }
    }
    at_boundary
}
