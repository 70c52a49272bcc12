//! Which elements to split: the surplus of their midsides in units of what is allowed.
//!
//! An element of size h may have a surplus of
//!
//! ```text
//!   surplus_tolerance · (h_max / h)^¾ · max(B, floor)
//! ```
//!
//! with h_max the longest edge of the mesh that refinement started on. An element is judged by its
//! parent's midsides, which have gathered. An element of the first mesh has no parent; it is judged
//! by the differences of its corners, and by the light before the gather, if that is known more
//! finely there.

use glam::DVec2;

use super::RadiosityField;
use super::refinement_settings::RefinementSettings;
use super::sampled_mesh::SampledMesh;
use super::surplus::{HierarchicalSurplus, NodeValue};
use crate::mesh::Mesh;
use crate::scene::Rgb;

/// The tolerance of an element grows as its size to minus this power. 0 would make the errors of
/// all elements equal and split contacts without end; 1 would make errors times edge length equal.
/// Chosen by hand in between; no measurement kept.
const ERROR_SIZE_EXPONENT: f64 = 0.75;

/// Steps along an element's side of the lattice at which the source light is compared with its
/// linear interpolant. Chosen by hand; no measurement kept.
const SOURCE_SAMPLES: u32 = 4;

/// Ratio of a midside surplus to the root mean square of a quadratic's distance from its linear
/// interpolant. For 4 λ_i λ_j alone it is 2.4 (one curved side), for two equal surpluses 1.4.
/// Chosen by hand; no measurement kept.
const PEAK_OVER_RMS: f64 = 2.0;

/// Where nothing was gathered between the ends of a side, its surplus is taken for this share of
/// their difference: half of the largest that a monotone function can have. Chosen by hand; no
/// measurement kept.
const END_DIFFERENCE_SHARE: f64 = 0.25;

/// Reflected radiosity below this share of the scene's mean counts as that much when errors are
/// made relative, so that the insides of gaps do not take most of the elements. Chosen by hand.
const RADIOSITY_FLOOR_SHARE: f64 = 0.05;

/// What errors are relative to, found once at the start of a gather.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ErrorScale {
    /// Radiosity below which errors are relative to this, W/m²: a length over the channels.
    pub radiosity_floor: f64,
    /// Longest edge of the mesh that refinement starts on, scene unit.
    pub max_edge: f64,
}

impl ErrorScale {
    /// For a gather of `field` on `mesh`.
    pub fn new(mesh: &Mesh, field: &RadiosityField) -> ErrorScale {
        let mut flux = 0.0;
        let mut area = 0.0;
        for (e, corners) in field.corners.iter().enumerate() {
            let element_area = field.mesh.area(field.mesh.element(e));
            let mean = corners.iter().map(|&v| field.reflected[v as usize]).sum::<Rgb>() / 3.0;
            flux += mean.length() * element_area;
            area += element_area;
        }
        let edge = |e| mesh.longest_edge(mesh.element(e));
        ErrorScale {
            radiosity_floor: RADIOSITY_FLOOR_SHARE * flux / area,
            max_edge: (0..mesh.element_count()).map(edge).fold(0.0, f64::max),
        }
    }
}

/// Surplus of element `e` in units of its tolerance: above 1 it is to be split; 0 where it may not
/// be. `source` is the light that the vertices gathered.
pub(super) fn refinement_indicator(
    samples: &SampledMesh,
    source: &RadiosityField,
    scale: &ErrorScale,
    settings: &RefinementSettings,
    e: usize,
) -> f64 {
    let node = samples.mesh.element(e);
    let size = samples.mesh.longest_edge(node);
    if !samples.is_splittable(e) || size <= settings.min_edge {
        return 0.0;
    }
    let emitted = samples.mesh.material(node).exitance;
    let size_factor = (scale.max_edge / size).powf(ERROR_SIZE_EXPONENT);
    let tolerance = settings.surplus_tolerance * size_factor;
    // Difference of two values of reflected radiosity, relative to the first, over the tolerance.
    let error = |value: Rgb, other: Rgb| {
        let radiosity = (value + emitted).length().max(scale.radiosity_floor);
        if radiosity > 0.0 { (value - other).length() / radiosity / tolerance } else { 0.0 }
    };
    let end_error = |[a, b]: [NodeValue; 2]| error(a.value, b.value) * END_DIFFERENCE_SHARE;
    let corners = samples.vertices.corners[e].map(|v| NodeValue {
        value: samples.reflected[v as usize],
        buried: samples.buried[v as usize],
    });
    let sides = [0, 1, 2].map(|k| [corners[k], corners[(k + 1) % 3]]);
    match HierarchicalSurplus::of_parent(samples, e) {
        Some(surplus) => {
            let midsides = surplus.sampled_midsides();
            let indicator =
                midsides.map(|m| error(m.value, m.value - m.surplus)).fold(0.0, f64::max);
            // A buried corner has an extrapolated value, which should be about that of its element.
            let extrapolated = sides.into_iter().filter(|[a, b]| a.buried != b.buried);
            extrapolated.map(end_error).fold(indicator, f64::max)
        }
        None => {
            let mean = corners.iter().map(|c| c.value).sum::<Rgb>() / 3.0;
            // A vector over the channels as long as the root mean square.
            let rms = Rgb::splat(source_nonlinearity(&samples.mesh, source, e) / 3f64.sqrt());
            let gathered = sides.into_iter().filter(|[a, b]| !(a.buried && b.buried));
            gathered.map(end_error).fold(PEAK_OVER_RMS * error(mean, mean + rms), f64::max)
        }
    }
}

/// How far `source` is from linear over element `e` of `mesh`: root mean square over a lattice,
/// W/m², a length over the channels.
pub(super) fn source_nonlinearity(mesh: &Mesh, source: &RadiosityField, e: usize) -> f64 {
    let node = mesh.element(e);
    let t = mesh.triangle(node);
    let [a, b, c] = mesh.cell(node).corners().map(DVec2::from_array);
    let value_at = |p: DVec2| source.reflected_at(t, p.x, p.y);
    let ends = [a, b, c].map(value_at);
    let mut squares = 0.0;
    for i in 0..=SOURCE_SAMPLES {
        for j in 0..=SOURCE_SAMPLES - i {
            let [u, v] = [i, j].map(|k| f64::from(k) / f64::from(SOURCE_SAMPLES));
            let linear = ends[0] * (1.0 - u - v) + ends[1] * u + ends[2] * v;
            squares += value_at(a * (1.0 - u - v) + b * u + c * v).distance_squared(linear);
        }
    }
    (squares / f64::from((SOURCE_SAMPLES + 1) * (SOURCE_SAMPLES + 2) / 2)).sqrt()
}
