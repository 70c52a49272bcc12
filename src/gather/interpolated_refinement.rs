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
//! | in a gap, or at its mouth | a quarter of its radiosity, at least |

use std::collections::{HashMap, HashSet};

use super::RadiosityField;
use super::refinement_indicator::{ErrorScale, counted_area, source_nonlinearity};
use super::refinement_settings::RefinementSettings;
use super::sampled_mesh::SampledMesh;
use super::surplus::HierarchicalSurplus;
use crate::error::Error;
use crate::scene::Rgb;
use crate::vertex::keys::{VertexKey, midside_keys};

/// Errors of elements at a boundary of their surface, over what the surplus says: next to a wall
/// light goes as d ln d with the distance d, for which halving h does not quarter the surplus, and
/// which is no quadratic. Chosen by hand; no measurement kept.
const BOUNDARY_FACTOR: f64 = 2.5;

/// Share of an element's error that remains when its midsides are put on the quadratic
/// interpolant. Chosen by hand; no measurement kept.
const FOLLOWED_SHARE: f64 = 0.5;

/// Error of an element whose corners see surfaces nearer than the element is large, over its
/// radiosity, at least: light changes there between the corners, which say nothing of it. Chosen by
/// hand: half of it is lost on average across the mouth of a gap, at half of the element's places.
const GAP_ERROR: f64 = 0.25;

/// The refined mesh, and an estimate of the error that remains in each of its elements, W/m²: a
/// length over the channels.
pub(super) struct InterpolatedRefinement {
    pub samples: SampledMesh,
    pub residual_error: Vec<f64>,
}

/// An element to be split, and the interpolant over its parent.
struct Candidate {
    element: usize,
    relative_surplus: f64,
    interpolant: HierarchicalSurplus,
}

/// Splits elements that differ from the quadratic interpolant over their parent by more than
/// `settings` allow: new vertices lie on it, or on the mean of two, and do not gather.
pub(super) fn interpolated_refinement(
    samples: &SampledMesh,
    source: &RadiosityField,
    scale: &ErrorScale,
    settings: &RefinementSettings,
) -> Result<InterpolatedRefinement, Error> {
    let candidates = candidates(samples, scale, settings);
    let midsides = midside_values(samples, &candidates);
    let split: Vec<usize> = candidates.iter().map(|c| c.element).collect();
    let (mut refined, new) = samples.with_split(&split)?;
    for v in new {
        let v = v as usize;
        if let Some((sum, count)) = midsides.get(&refined.vertices.keys[v]) {
            refined.reflected[v] = *sum / *count;
        }
    }
    let residual_error = residual_errors(samples, source, scale, &split);
    Ok(InterpolatedRefinement { samples: refined, residual_error })
}

/// Elements whose own sides would have a surplus above the tolerance, which is less the larger they
/// are, ascending; as many as there is room for, the worst of them.
fn candidates(
    samples: &SampledMesh,
    scale: &ErrorScale,
    settings: &RefinementSettings,
) -> Vec<Candidate> {
    let counted = |e| counted_area(samples, scale, settings, e);
    let count = samples.mesh.element_count();
    let mean_area = (0..count).map(counted).sum::<f64>() / count as f64;
    let candidate =
        |element: usize| {
            let node = samples.mesh.element(element);
            if !samples.is_splittable(element) {
                return None;
            }
            let interpolant = HierarchicalSurplus::of_parent(samples, element)
                .filter(HierarchicalSurplus::is_smooth)?;
            let emitted = samples.mesh.material(node).exitance;
            let mean = interpolant.corner_mean();
            let radiosity = (mean + emitted).length().max(scale.radiosity_floor);
            let size = (counted(element) / mean_area).sqrt();
            let surplus = interpolant.predicted_child_surplus() * size;
            let group_factor = settings.group_factor(samples.mesh.group(node));
            (surplus > settings.interpolation_tolerance * group_factor * radiosity)
                .then(|| Candidate { element, relative_surplus: surplus / radiosity, interpolant })
        };
    let mut candidates: Vec<Candidate> = (0..count).filter_map(candidate).collect();
    candidates.sort_by(|a, b| {
        b.relative_surplus.total_cmp(&a.relative_surplus).then(a.element.cmp(&b.element))
    });
    candidates.truncate(settings.max_elements.saturating_sub(count) / 3);
    candidates.sort_by_key(|c| c.element);
    candidates
}

/// Sums and numbers of the values that the interpolants of `candidates` have at their midsides.
fn midside_values(
    samples: &SampledMesh,
    candidates: &[Candidate],
) -> HashMap<VertexKey, (Rgb, f64)> {
    let mut sums: HashMap<VertexKey, (Rgb, f64)> = HashMap::new();
    for Candidate { element, interpolant, .. } in candidates {
        let node = samples.mesh.element(*element);
        let (t, cell) = (samples.mesh.triangle(node), samples.mesh.cell(node));
        let siblings = cell.ancestor(cell.level - 1).children();
        let child = siblings.iter().position(|c| *c == cell).expect("a child of its parent");
        let keys = midside_keys(&samples.topology, t, cell).expect("an element that can be split");
        for (key, value) in keys.into_iter().zip(interpolant.child_midsides(child)) {
            let (sum, count) = sums.entry(key).or_default();
            *sum += value.max(Rgb::ZERO);
            *count += 1.0;
        }
    }
    sums
}

/// Error that remains in each element after `split` (ascending) were split, W/m².
fn residual_errors(
    samples: &SampledMesh,
    source: &RadiosityField,
    scale: &ErrorScale,
    split: &[usize],
) -> Vec<f64> {
    let at_boundary = boundary_vertices(samples);
    let mut split = split.iter().peekable();
    let mut errors = Vec::with_capacity(samples.mesh.element_count() + 3 * split.len());
    for (e, corners) in samples.corners().iter().enumerate() {
        let is_split = split.next_if_eq(&&e).is_some();
        let error = match HierarchicalSurplus::of_parent(samples, e) {
            Some(surplus) => surplus.predicted_sampled_child_surplus(),
            None => source_nonlinearity(&samples.mesh, source, e),
        };
        let factor = if corners.iter().any(|&v| at_boundary[v as usize]) {
            BOUNDARY_FACTOR
        } else if is_split {
            FOLLOWED_SHARE
        } else {
            1.0
        };
        let children = if is_split { 4 } else { 1 };
        errors.resize(errors.len() + children, (factor * error).max(gap_error(samples, scale, e)));
    }
    errors
}

/// Least error of element `e` if it is in a gap that can be looked into, W/m²; 0 elsewhere.
fn gap_error(samples: &SampledMesh, scale: &ErrorScale, e: usize) -> f64 {
    let corners = samples.corners()[e].map(|v| v as usize);
    let largest = |values: [f64; 3]| values.into_iter().fold(0.0, f64::max);
    let nearest = largest(corners.map(|v| samples.inverse_distance[v]));
    let is_hidden = nearest * scale.crack > 1.0 || corners.iter().any(|&v| samples.buried[v]);
    if !is_hidden && nearest * samples.mesh.area(samples.mesh.element(e)).sqrt() > 1.0 {
        GAP_ERROR * largest(corners.map(|v| samples.reflected[v].length()))
    } else {
        0.0
    }
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
    let shared: HashSet<u32> =
        topology.shared_edges().map(|[(t, k), _]| topology.sides[t][k].id).collect();
    // Where neighbours differ in size, inner sides occur once too: those are on no triangle's side.
    let may_be_outer = |v: u32| match samples.vertices.keys[v as usize] {
        VertexKey::Inside { .. } => false,
        VertexKey::Side { id, .. } => !shared.contains(&id),
        VertexKey::Corner(_) => true,
    };
    let mut occurrences: HashMap<(u32, u32), u32> = HashMap::new();
    for corners in samples.corners() {
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            *occurrences.entry((a.min(b), a.max(b))).or_default() += 1;
        }
    }
    for ((a, b), count) in occurrences {
        if count == 1 && may_be_outer(a) && may_be_outer(b) {
            at_boundary[a as usize] = true;
            at_boundary[b as usize] = true;
        }
    }
    at_boundary
}
