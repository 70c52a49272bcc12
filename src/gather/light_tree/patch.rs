//! Patches: few emitting triangles that lie together, none of which hides another.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DMat3, DVec3};
use rustc_hash::FxHashMap;

use super::cone::Cone;
use super::profile::Profile;
use super::{Leaf, LightTree, outer};
use crate::form_factor::closed_form::point_to_polygon;
use crate::gather::GatherPoint;
use crate::gather::light_samples::{LightSample, SampledLeaf};
use crate::gather::lights::connected_emitters;
use crate::geometry::aabb::Aabb;
use crate::sampling::surface::AreaSampler;
use crate::scene::{Rgb, Scene};

/// Maximum number of triangles of a patch. The closed forms of all take about as long as opening
/// ten nodes of the tree.
const MAX_TRIANGLES: usize = 8;

/// Triangles of one material and exitance, connected in the scene, all of which lie behind each of
/// their planes. So the closed forms of those that face a point add up.
#[derive(Debug)]
pub(crate) struct Patch {
    pub triangles: Vec<PatchTriangle>,
    /// Chooses among them in proportion to area.
    surface: AreaSampler,
    /// W/m² per channel.
    pub exitance: Rgb,
    pub material: u32,
}

/// A triangle of a [`Patch`].
#[derive(Debug)]
pub(crate) struct PatchTriangle {
    /// Its number in the scene.
    pub number: u32,
    pub corners: [DVec3; 3],
    /// Unit length.
    pub normal: DVec3,
    pub area: f64,
}

/// A point of a patch.
pub(crate) struct PatchPoint<'a> {
    pub triangle: &'a PatchTriangle,
    pub position: DVec3,
    /// Weights of the second and third corner.
    pub barycentric: [f64; 2],
}

impl LightTree<Patch> {
    /// The emitting triangles of `scene`, made once a scene.
    pub fn of_emitters(scene: &Scene) -> Arc<LightTree<Patch>> {
        scene.derived(|scene| {
            let power = |t: usize| scene.exitance(t).element_sum() * scene.area(t);
            let all: f64 = (0..scene.triangles().len()).map(power).sum();
            LightTree::new(patches(scene), all / scene.total_area())
        })
    }
}

/// The emitting triangles of `scene` in patches.
pub(super) fn patches(scene: &Scene) -> Vec<Patch> {
    let is_emitter = |&t: &usize| scene.exitance(t) != Rgb::ZERO;
    let emitters: Vec<usize> = (0..scene.triangles().len()).filter(is_emitter).collect();
    let connected = connected_emitters(scene, &emitters);
    let mut numbers: FxHashMap<usize, usize> = FxHashMap::default();
    let mut lights: Vec<Vec<PatchTriangle>> = vec![];
    for (&t, first) in emitters.iter().zip(connected) {
        let light = *numbers.entry(first).or_insert(lights.len());
        if light == lights.len() {
            lights.push(vec![]);
        }
        let (corners, normal, area) = (scene.corners(t), scene.normal(t), scene.area(t));
        lights[light].push(PatchTriangle { number: t as u32, corners, normal, area });
    }
    let mut patches = vec![];
    for light in lights {
        split(scene, light, &mut patches);
    }
    patches
}

/// Halves `triangles` by their middles along the longest side of their box until they are patches.
fn split(scene: &Scene, mut triangles: Vec<PatchTriangle>, patches: &mut Vec<Patch>) {
    if triangles.len() <= MAX_TRIANGLES && is_convex(&triangles) {
        let number = triangles[0].number as usize;
        patches.push(Patch {
            surface: AreaSampler::new(triangles.iter().map(|t| t.area)),
            exitance: scene.exitance(number),
            material: scene.triangles()[number].material,
            triangles,
        });
        return;
    }
    let middle = |t: &PatchTriangle| t.corners.into_iter().sum::<DVec3>() / 3.0;
    let axis = Aabb::from_points(triangles.iter().map(middle)).longest_axis();
    let along = |t: &PatchTriangle| middle(t)[axis];
    triangles.sort_unstable_by(|a, b| along(a).total_cmp(&along(b)).then(a.number.cmp(&b.number)));
    let mut high = triangles.split_off(triangles.len() / 2);
    // In the order of the scene, whose points are drawn in it.
    triangles.sort_unstable_by_key(|t| t.number);
    high.sort_unstable_by_key(|t| t.number);
    split(scene, triangles, patches);
    split(scene, high, patches);
}

/// Whether no corner lies in front of a triangle's plane by more than rounding, 1e-9 of the extent.
fn is_convex(triangles: &[PatchTriangle]) -> bool {
    let corners = || triangles.iter().flat_map(|t| t.corners);
    let extent = corners().map(|p| p.distance(triangles[0].corners[0])).fold(0.0, f64::max);
    let lies_behind = |t: &PatchTriangle, p: DVec3| t.normal.dot(p - t.corners[0]) <= 1e-9 * extent;
    triangles.iter().all(|t| corners().all(|p| lies_behind(t, p)))
}

impl Patch {
    /// The point for one in the unit square: uniform over the area.
    pub fn point(&self, [x, y]: [f64; 2]) -> PatchPoint<'_> {
        let (k, across) = self.surface.locate(x);
        let triangle = &self.triangles[k];
        let [a, b, c] = triangle.corners;
        // Uniform over a triangle (Pharr, Jakob, Humphreys 2016, 13.6.5).
        let (root, v) = (across.sqrt(), y);
        let position = a * (1.0 - root) + (b * (1.0 - v) + c * v) * root;
        PatchPoint { triangle, position, barycentric: [root * (1.0 - v), root * v] }
    }

    /// The form factor from `point` to all of the patch, estimated from one point of it; 0 behind
    /// it or below the horizon.
    pub fn factor(&self, at: &PatchPoint, point: &GatherPoint) -> f64 {
        let to = at.position - point.position;
        let facing = (-at.triangle.normal.dot(to)).max(0.0);
        let above = point.normal.dot(to).max(0.0);
        let r2 = to.length_squared();
        let is_lit = facing > 0.0 && above > 0.0;
        if is_lit { self.surface.total_area() * facing * above / (PI * r2 * r2) } else { 0.0 }
    }
}

impl Leaf for Patch {
    fn bounds(&self) -> Aabb {
        Aabb::from_points(self.triangles.iter().flat_map(|t| t.corners))
    }

    fn middle(&self) -> (DVec3, DMat3) {
        let all = self.surface.total_area();
        let weighted = |t: &PatchTriangle| t.area * t.corners.into_iter().sum::<DVec3>() / 3.0;
        let middle = self.triangles.iter().map(weighted).sum::<DVec3>() / all;
        // Of a triangle Σ outer(corner) / 12 + 9 outer(mean) / 12.
        let squares = |t: &PatchTriangle| {
            let corners = t.corners.map(|corner| corner - middle);
            let mean = corners.into_iter().sum::<DVec3>() / 3.0;
            let of_corners: DMat3 =
                corners.into_iter().map(outer).fold(DMat3::ZERO, |sum, m| sum + m);
            (of_corners + outer(mean) * 9.0) * (t.area / 12.0)
        };
        let sum = self.triangles.iter().map(squares).fold(DMat3::ZERO, |sum, m| sum + m);
        (middle, sum * (1.0 / all))
    }

    fn cone(&self) -> Option<Cone> {
        Cone::around(self.triangles.iter().map(|t| t.normal))
    }

    fn facing(&self) -> Option<DMat3> {
        let vector: DVec3 = self.triangles.iter().map(|t| t.area * t.normal).sum();
        let [r, g, b] = (self.exitance / PI).to_array().map(|e| e * vector);
        Some(DMat3::from_cols(r, g, b).transpose())
    }

    fn is_resolved(&self, _: f64) -> bool {
        true
    }

    fn intensity(&self, direction: DVec3) -> Rgb {
        let seen = |t: &PatchTriangle| t.area * t.normal.dot(direction).max(0.0);
        self.exitance / PI * self.triangles.iter().map(seen).sum::<f64>()
    }

    fn peak(&self) -> f64 {
        self.exitance.element_sum() / PI * self.surface.total_area()
    }

    fn profile(&self) -> Option<Profile> {
        None
    }

    fn irradiance(&self, point: &GatherPoint) -> Rgb {
        let factor = |t: &PatchTriangle| point_to_polygon(point.position, point.normal, &t.corners);
        self.exitance * self.triangles.iter().map(factor).sum::<f64>()
    }
}

impl SampledLeaf for Patch {
    fn sample(&self, [x, y, _]: [f64; 3], point: &GatherPoint) -> LightSample {
        let at = self.point([x, y]);
        LightSample {
            position: at.position,
            irradiance: self.exitance * self.factor(&at, point),
            surface: Some((at.triangle.number, at.barycentric)),
        }
    }

    fn is_point(&self, _: &GatherPoint) -> bool {
        false
    }
}
