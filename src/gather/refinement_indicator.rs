//! Which elements to split: those with the largest share of the squared error.
//!
//! An element that is not split is predicted to be off by e, root mean square over its area and
//! relative to the radiosity of its darkest corner, or to the floor where that is more: what is
//! between a bright corner and a dark one may be as dark as the latter. Its share of the squared
//! error of the whole is e² times its area, and the number of elements is minimal if all that are
//! not split have about the same share (Dörfler 1996 marks by that sum).
//!
//! | element | e |
//! |---|---|
//! | a parent of smooth light | that of the quadratic interpolant from the linear one |
//! | a parent with a jump | 0.2 of the largest difference of corners |
//! | no parent | 1/8 of that difference, or how far the light before is from linear |
//!
//! Differences count as far as they are more than the noise of what they are between.
//! Elements far from the region of the light count as if they were smaller, by the factor that
//! elements grow by there. Elements with buried corners only, such as those under houses that stand
//! on a ground, are split if there was light before.

use arrayvec::ArrayVec;
use glam::DVec2;

use super::RadiosityField;
use super::refinement_settings::RefinementSettings;
use super::sampled_mesh::SampledMesh;
use super::surplus::{HierarchicalSurplus, NodeValue, beyond_noise};
use crate::accuracy::Measure;
use crate::accuracy::hidden::{self, LitRegion};
use crate::mesh::sizing::size_growth;
use crate::mesh::{Mesh, NodeId};
use crate::scene::{Aabb, Rgb};

/// Steps along an element's side of the lattice at which the source light is compared with its
/// linear interpolant.
const SOURCE_SAMPLES: u32 = 4;

/// Points of that lattice.
const LATTICE_POINTS: usize = ((SOURCE_SAMPLES + 1) * (SOURCE_SAMPLES + 2) / 2) as usize;

/// Where the light jumps by 1 across an element, from one corner to the two others, the linear
/// interpolant is off by this, root mean square over the dark side: a quarter of the element and
/// the half that is left were off by 0.25 and 0.24 for jumps half-way.
pub(crate) const RMS_OVER_JUMP: f64 = 0.2;

/// Root mean square error of an element over the largest difference of its corners, where nothing
/// was gathered between them: a surplus of a quarter of that, half of the maximum of a monotone
/// function, and half of the surplus over the element (0.42 for one curved side, 0.73 for two).
const RMS_OVER_DIFFERENCE: f64 = 0.125;

/// Relative error up to which values differ by rounding alone. Where nothing counts, as on a sheet
/// in the open, no error is allowed.
const ROUNDING: f64 = 1e-9;

/// Squared error of an element that has to be split because its vertices do not predict it.
pub(super) const UNKNOWN: f64 = f64::INFINITY;

/// Scales of errors and lengths in a gather.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ErrorScale {
    /// Radiosity below which errors are relative to this, W/m²: a length over the channels.
    pub radiosity_floor: f64,
    /// Where the light is: elements grow with the distance from its bounds.
    pub region: LitRegion,
    /// Share of the area, where errors are largest, that is not refined.
    pub tail: f64,
}

impl ErrorScale {
    /// For a gather of `field` on `mesh`, whose light is mostly in `region`, with the floor of
    /// `measure`.
    pub fn new(
        mesh: &Mesh,
        field: &RadiosityField,
        region: Option<Aabb>,
        measure: Measure,
    ) -> ErrorScale {
        ErrorScale {
            region: LitRegion::new(region, || mesh.scene().reflecting_bounds()),
            radiosity_floor: field.radiosity_floor(measure.floor),
            tail: measure.tail,
        }
    }

    /// Distance up to which surfaces touch, scene unit.
    pub fn touching(&self) -> f64 {
        hidden::NEAR * self.region.diagonal
    }

    /// Whether `node` of `mesh` is further from the light than its diagonal.
    pub fn is_far(&self, mesh: &Mesh, node: NodeId) -> bool {
        self.growth(mesh, node) > 2.0
    }

    /// By how much larger elements are where `node` of `mesh` is.
    pub fn growth(&self, mesh: &Mesh, node: NodeId) -> f64 {
        size_growth(self.region.bounds.as_ref(), &mesh.corners(node))
    }
}

/// Area that element `e` counts with in the error of the whole, scene unit squared: 0 where nothing
/// is reflected.
pub(super) fn counted_area(
    samples: &SampledMesh,
    scale: &ErrorScale,
    settings: &RefinementSettings,
    e: usize,
) -> f64 {
    let mesh = &samples.mesh;
    let node = mesh.element(e);
    if !mesh.scatters(node) {
        return 0.0;
    }
    let lengths = scale.growth(mesh, node) * settings.group_scale(mesh.group(node));
    mesh.solid_area(node) / (lengths * lengths)
}

/// What the squared relative error of element `e` counts: its area over the square of the error
/// that its group may have, scene unit squared.
pub(super) fn error_weight(
    samples: &SampledMesh,
    scale: &ErrorScale,
    settings: &RefinementSettings,
    e: usize,
) -> f64 {
    let factor = settings.group_factor(samples.mesh.group(samples.mesh.element(e)));
    counted_area(samples, scale, settings, e) / (factor * factor)
}

/// Longest edge of element `e` over the scales of lengths where it is, scene unit.
fn relative_size(
    samples: &SampledMesh,
    scale: &ErrorScale,
    settings: &RefinementSettings,
    e: usize,
) -> f64 {
    let mesh = &samples.mesh;
    let node = mesh.element(e);
    mesh.longest_edge(node) / scale.growth(mesh, node) / settings.group_scale(mesh.group(node))
}

/// Whether element `e` is too small to be split whatever its error: an eighth of the shortest edge,
/// whose error is far below that of others. Far from the light, where shadows are not sharp, the
/// shortest edge.
pub(super) fn is_finest(
    samples: &SampledMesh,
    scale: &ErrorScale,
    settings: &RefinementSettings,
    e: usize,
) -> bool {
    let node = samples.mesh.element(e);
    let finest = if scale.is_far(&samples.mesh, node) { 1.0 } else { 0.125 };
    let min_edge = settings.min_edge * settings.group_factor(samples.mesh.group(node));
    relative_size(samples, scale, settings, e) <= finest * min_edge
}

/// Squared relative error that element `e` is predicted to have, or that of the probe at its
/// centroid if that is larger, times the area that it counts with; 0 where it may not be split.
/// `source` is the light that the vertices gathered.
pub(super) fn squared_error(
    samples: &SampledMesh,
    source: &RadiosityField,
    scale: &ErrorScale,
    settings: &RefinementSettings,
    e: usize,
    probed: f64,
) -> f64 {
    if !samples.is_splittable(e) || is_finest(samples, scale, settings, e) {
        return 0.0;
    }
    let group_factor = settings.group_factor(samples.mesh.group(samples.mesh.element(e)));
    let weight = error_weight(samples, scale, settings, e);
    // A beam of light may fall between the corners of larger elements.
    let is_small =
        relative_size(samples, scale, settings, e) <= 4.0 * settings.min_edge * group_factor;
    let rms = predicted_rms(samples, source, scale.radiosity_floor, e, is_small);
    rms.map_or(UNKNOWN, |rms| match rms.max(probed) {
        rms if rms > ROUNDING => weight * rms.powi(2),
        _ => 0.0,
    })
}

/// Relative error that element `e` is predicted to have, root mean square; none where its vertices
/// do not say, if it is not `is_small`. Radiosities below `floor` (W/m²) count as that.
fn predicted_rms(
    samples: &SampledMesh,
    source: &RadiosityField,
    floor: f64,
    e: usize,
    is_small: bool,
) -> Option<f64> {
    let mesh = &samples.mesh;
    let corners = samples.corners()[e].map(|v| NodeValue::of(samples, v));
    let sides = [0, 1, 2].map(|k| [corners[k], corners[(k + 1) % 3]]);
    // The middle may be in the open where the corners are covered.
    if !is_small && corners.iter().all(|c| c.buried) && brightest(mesh, source, e) > floor {
        return None;
    }
    let relative = RelativeError::new(&corners, mesh.material(mesh.element(e)).exitance, floor);
    let Some(parent) = HierarchicalSurplus::of_parent(samples, e) else {
        if !is_small {
            return None;
        }
        let mean = corners.iter().map(|c| c.value).sum::<Rgb>() / 3.0;
        // A vector over the channels as long as the root mean square.
        let rms = Rgb::splat(source_nonlinearity(mesh, source, e) / 3f64.sqrt());
        let gathered = sides.into_iter().filter(|[a, b]| !(a.buried && b.buried));
        let ends = RMS_OVER_DIFFERENCE * relative.largest(gathered);
        return Some(ends.max(relative.error(mean, mean + rms, 0.0)));
    };
    let own = if parent.may_jump(floor) {
        let gathered = sides.into_iter().filter(|[a, b]| !a.buried && !b.buried);
        RMS_OVER_JUMP * relative.largest(gathered)
    } else {
        relative.share(parent.child_rms())
    };
    // A buried corner has an extrapolated value, which should be about that of its element.
    let extrapolated = sides.into_iter().filter(|[a, b]| a.buried != b.buried);
    Some(own.max(RMS_OVER_DIFFERENCE * relative.largest(extrapolated)))
}

/// Differences of reflected radiosity in an element, relative to its radiosity.
struct RelativeError {
    /// Exitance of the element, W/m².
    emitted: Rgb,
    /// Radiosity of its darkest corner that is not buried, W/m²; infinite without any.
    darkest: f64,
    /// W/m².
    floor: f64,
}

impl RelativeError {
    fn new(corners: &[NodeValue; 3], emitted: Rgb, floor: f64) -> RelativeError {
        let open = corners.iter().filter(|corner| !corner.buried);
        let darkest = open.map(|c| (c.value + emitted).length()).fold(f64::INFINITY, f64::min);
        RelativeError { emitted, darkest, floor }
    }

    /// Of `other` from `value`, beyond their `noise`: relative to the darker of `value` and the
    /// darkest corner.
    fn error(&self, value: Rgb, other: Rgb, noise: f64) -> f64 {
        let radiosity = (value + self.emitted).length().min(self.darkest).max(self.floor);
        let difference = beyond_noise((value - other).length(), noise);
        if radiosity > 0.0 { difference / radiosity } else { 0.0 }
    }

    /// `rms`, W/m², relative to the darkest corner.
    fn share(&self, rms: f64) -> f64 {
        let radiosity = self.darkest.max(self.floor);
        if radiosity > 0.0 { rms / radiosity } else { 0.0 }
    }

    /// The largest between the ends of `sides`; 0 without any.
    fn largest(&self, sides: impl Iterator<Item = [NodeValue; 2]>) -> f64 {
        let either = |[a, b]: [NodeValue; 2]| {
            let noise = libm::hypot(a.noise, b.noise);
            self.error(a.value, b.value, noise).max(self.error(b.value, a.value, noise))
        };
        sides.map(either).fold(0.0, f64::max)
    }
}

/// Whether any of the values that the error of element `e` is predicted by is that of a buried
/// vertex.
pub(super) fn has_buried_node(samples: &SampledMesh, e: usize) -> bool {
    let parent = HierarchicalSurplus::of_parent(samples, e);
    samples.corners()[e].iter().any(|&v| samples.buried[v as usize])
        || parent.is_some_and(|parent| !parent.is_sampled())
}

/// How far `source` is from linear over element `e` of `mesh`: root mean square over a lattice,
/// W/m², a length over the channels.
pub(super) fn source_nonlinearity(mesh: &Mesh, source: &RadiosityField, e: usize) -> f64 {
    let values: ArrayVec<([f64; 3], Rgb), LATTICE_POINTS> =
        source_lattice(mesh, source, e).collect();
    let end = |k: usize| values.iter().find(|(at, _)| at[k] == 1.0).map_or(Rgb::ZERO, |(_, b)| *b);
    let ends = [0, 1, 2].map(end);
    let square = |([u, v, w], value): &([f64; 3], Rgb)| {
        value.distance_squared(ends[0] * *u + ends[1] * *v + ends[2] * *w)
    };
    (values.iter().map(square).sum::<f64>() / values.len() as f64).sqrt()
}

/// Maximum of `source` over a lattice on element `e` of `mesh`, W/m²: a length over the
/// channels.
fn brightest(mesh: &Mesh, source: &RadiosityField, e: usize) -> f64 {
    source_lattice(mesh, source, e).map(|(_, value)| value.length()).fold(0.0, f64::max)
}

/// Barycentric weights of the points of a lattice on element `e` of `mesh`, each with what `source`
/// reflects there, W/m².
fn source_lattice(
    mesh: &Mesh,
    source: &RadiosityField,
    e: usize,
) -> impl Iterator<Item = ([f64; 3], Rgb)> {
    let node = mesh.element(e);
    let t = mesh.triangle(node);
    let [a, b, c] = mesh.cell(node).corners().map(DVec2::from_array);
    let steps = |i: u32| (0..=SOURCE_SAMPLES - i).map(move |j| [i, j, SOURCE_SAMPLES - i - j]);
    (0..=SOURCE_SAMPLES).flat_map(steps).map(move |steps| {
        let [u, v, w] = steps.map(|k| f64::from(k) / f64::from(SOURCE_SAMPLES));
        let at = a * u + b * v + c * w;
        ([u, v, w], source.untextured_at(t, at.x, at.y))
    })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DVec3;

    use super::*;
    use crate::gather::GatheredMesh;
    use crate::scene::{Material, Scene, Triangle};

    /// A ground of 64 × 64, in two triangles.
    fn ground() -> Mesh {
        let positions = [[0.0, 0.0], [64.0, 0.0], [64.0, 64.0], [0.0, 64.0]];
        let triangle = |corners| Triangle { corners, ..Default::default() };
        let scene = Scene::new(
            positions.map(|[x, y]| DVec3::new(x, y, 0.0)).to_vec(),
            vec![triangle([0, 1, 2]), triangle([0, 2, 3])],
            vec!["ground".into()],
            vec![Material::grey("grey", 0.5)],
        );
        Mesh::new(Arc::new(scene.unwrap()), 100.0).unwrap()
    }

    #[test]
    fn noise_is_no_error_of_the_mesh() {
        let mesh = ground();
        let even = GatheredMesh::from_elements(&mesh, &[Rgb::ONE; 2]).unwrap();
        let field = even.radiosity_field();
        let scale = ErrorScale::new(&mesh, &field, None, Measure::default());
        let mut samples = SampledMesh::new(mesh, &field);
        // The longest edge is 90.5: less than four of these, so that corners tell.
        let settings = RefinementSettings::new(32.0);
        let worst = |samples: &SampledMesh| {
            let of = |e| squared_error(samples, &field, &scale, &settings, e, 0.0);
            (0..samples.mesh.element_count()).map(of).fold(0.0, f64::max)
        };
        // Every other vertex is a tenth darker, or so dark that light may jump; of elements without
        // a parent first, and then of their children.
        for (dark, may_jump) in [(0.9, false), (0.2, true)] {
            let lay = |samples: &mut SampledMesh| {
                for (v, value) in samples.reflected.iter_mut().enumerate() {
                    *value = Rgb::splat(if v % 2 == 0 { 1.0 } else { dark });
                }
                samples.noise.fill(0.0);
            };
            for _ in 0..2 {
                lay(&mut samples);
                let certain = worst(&samples);
                samples.noise.fill(0.1 * (1.0 - dark));
                assert!(certain > 0.0 && worst(&samples) > 0.8 * certain);
                // As much as they differ by, a length over the channels.
                samples.noise.fill((1.0 - dark) * 3f64.sqrt());
                assert_eq!(worst(&samples), 0.0);
                let all: Vec<usize> = (0..samples.mesh.element_count()).collect();
                samples.split(&all).unwrap();
            }
            lay(&mut samples);
            let jumps = |samples: &SampledMesh| {
                let parent = |e| HierarchicalSurplus::of_parent(samples, e).unwrap();
                (0..samples.mesh.element_count()).any(|e| parent(e).may_jump(0.0))
            };
            assert_eq!(jumps(&samples), may_jump);
            samples.noise.fill(2.0);
            assert!(!jumps(&samples));
        }
    }

    /// Elements of two triangles, split once, with light that is linear but for the vertex in the
    /// middle of the common side, which is a tenth brighter.
    #[test]
    fn squared_error_is_that_of_a_parabola_times_the_area() {
        let mesh = ground();
        let even = GatheredMesh::from_elements(&mesh, &[Rgb::ONE; 2]).unwrap();
        let field = even.radiosity_field();
        let scale = ErrorScale::new(&mesh, &field, None, Measure::default());
        let mut samples = SampledMesh::new(mesh, &field);
        samples.split(&[0, 1]).unwrap();
        let middle = DVec3::new(32.0, 32.0, 0.0);
        let positions = samples.vertices.positions.clone();
        for (value, position) in samples.reflected.iter_mut().zip(&positions) {
            *value = Rgb::splat(if position.distance(middle) < 1e-9 { 1.1 } else { 1.0 });
        }
        samples.noise.fill(0.0);
        // The surplus s of a parent is 0.1 of the darkest corner, that of a child s/4, over an area
        // of 512: e is s/4 times the root mean square of 4 λ_i λ_j, √(8/45).
        let settings = RefinementSettings::new(1.0);
        for e in 0..8 {
            let square = squared_error(&samples, &field, &scale, &settings, e, 0.0);
            let expected = 512.0 * (0.1_f64 / 4.0).powi(2) * 8.0 / 45.0;
            assert!((square / expected - 1.0).abs() < 1e-12, "{e}: {square}, not {expected}");
        }
    }

    /// Elements, children of two triangles, have buried corners only.
    #[test]
    fn elements_on_buried_corners_are_split_where_there_was_light() {
        let mesh = ground();
        let [lit, dark] =
            [1.0, 0.0].map(|b| GatheredMesh::from_elements(&mesh, &[Rgb::splat(b); 2]).unwrap());
        let scale = ErrorScale::new(&mesh, &lit.radiosity_field(), None, Measure::default());
        let mut samples = SampledMesh::new(mesh, &dark.radiosity_field());
        samples.split(&[0, 1]).unwrap();
        samples.buried.fill(true);
        let indicator = |source: &GatheredMesh, min_edge: f64| {
            let settings = RefinementSettings::new(min_edge);
            let field = source.radiosity_field();
            let of = |e| squared_error(&samples, &field, &scale, &settings, e, 0.0);
            (0..samples.mesh.element_count()).map(of).fold(0.0, f64::max)
        };
        // Their longest edge is 45.3.
        assert_eq!(indicator(&lit, 1.0), UNKNOWN);
        assert_eq!(indicator(&dark, 1.0), 0.0);
        assert_eq!(indicator(&lit, 11.4), 0.0, "no longer than four of the shortest");
    }
}
