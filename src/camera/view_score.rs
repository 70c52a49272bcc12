//! Score of a view of a scene: rays through a grid over the picture, and their hits.
//!
//! ```text
//!   surface ── parts by group, cell of a box and direction; weights by √area and by group
//!   view ── grid of rays ── parts seen × picture filled × no backs × nothing too near × lit
//! ```
//!
//! Parts are the visible content of a scene, independent of its triangulation. Vázquez, Feixas,
//! Sbert and Heidrich (2001) score views similarly, by the entropy of the faces seen.

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::DVec3;
use rustc_hash::FxHashMap;

use super::Camera;
use crate::gather::GatheredMesh;
use crate::geometry::aabb::Aabb;
use crate::sampling::low_discrepancy::r2_point;
use crate::scene::{Rgb, Scene};
use crate::visibility::ray_scene::RayScene;

/// Cells along the longest side of the focus that separate parts. Plain choice.
const CELLS: f64 = 5.0;

/// Fraction of the picture that is filled above which it counts as full: an object on an empty
/// background. Plain choice.
const FULL_SHARE: f64 = 0.5;

/// Exponents of the fractions of the picture that are free of backs and of surfaces too near. Plain
/// choice.
const BACK_POWER: i32 = 6;
const NEAR_POWER: i32 = 3;

/// Distance below which a surface is too near, as a fraction of the scene's diagonal. Plain choice.
const NEAR_SHARE: f64 = 0.05;

/// Radiosity above which a part is lit, as a fraction of the radiosity above which half of the
/// reflected light lies; score of a view without lit parts. Plain choice.
const LIT_SHARE: f64 = 0.05;
const UNLIT_SCORE: f64 = 0.02;

/// A part seen by n rays counts n / (n + this): few rays do not show it well. Plain choice.
const HALF_SEEN: f64 = 1.0;

/// Loss of weight of a ray at the picture's edge against one in its middle. Plain choice.
const EDGE_LOSS: f64 = 0.5;

/// A scene with its light, for scoring views.
pub(super) struct ViewScorer<'a> {
    pub rays: Arc<RayScene>,
    /// Box around the content of interest; reflecting surfaces outside it count as on its boundary.
    pub focus: Aabb,
    scene: &'a Scene,
    parts: FxHashMap<PartKey, Part>,
}

/// Group; cell of the focus along x, y and z, and which of the six axes it faces.
type PartKey = (u32, [u8; 4]);

/// The surfaces of one group, in one cell, facing one way.
#[derive(Clone, Copy, Default)]
struct Part {
    index: usize,
    /// Scene unit squared.
    area: f64,
    /// Mean of the channels of its reflected radiosity, times area.
    flux: f64,
    /// Fraction of the sum over all parts.
    weight: f64,
    lit: bool,
}

/// A face of a surface, and its light.
pub(super) struct Face {
    /// Index of the element that it is a part of.
    pub element: usize,
    pub centre: DVec3,
    /// Holes included, scene unit squared.
    pub area: f64,
    /// Mean of the reflected radiosity at its corners, W/m².
    pub reflected: Rgb,
}

/// The faces of `light`.
pub(super) fn faces(light: &GatheredMesh) -> impl Iterator<Item = Face> {
    let surface = &light.surface;
    surface.faces.iter().zip(&surface.elements).map(|(face, &element)| {
        let [a, b, c] = face.map(|v| surface.positions[v as usize]);
        let emitted = light.mesh.material(light.mesh.element(element as usize)).exitance;
        let radiosity = face.map(|v| surface.radiosity[v as usize]).into_iter().sum::<Rgb>();
        Face {
            element: element as usize,
            centre: (a + b + c) / 3.0,
            area: (b - a).cross(c - a).length() / 2.0,
            reflected: (radiosity / 3.0 - emitted).max(Rgb::ZERO),
        }
    })
}

impl ViewScorer<'_> {
    /// Scores views of `light`; parts within `focus` matter most.
    pub fn new(light: &GatheredMesh, focus: Aabb) -> ViewScorer<'_> {
        let scene = light.mesh.scene();
        let rays = RayScene::of_scene(scene);
        let mut scorer = ViewScorer { rays, focus, scene, parts: FxHashMap::default() };
        scorer.add_parts(light);
        scorer.weigh_parts();
        scorer
    }

    /// Sums area and light of each part of the reflecting surfaces, or of all if none reflects.
    fn add_parts(&mut self, light: &GatheredMesh) {
        let any_reflects =
            (0..self.scene.triangles().len()).any(|t| self.scene.material(t).scatters());
        for Face { element, centre, area, reflected } in faces(light) {
            let node = light.mesh.element(element);
            let t = light.mesh.triangle(node);
            if any_reflects && !self.scene.material(t).scatters() {
                continue;
            }
            let area = light.mesh.solid_share(node) * area;
            let next = Part { index: self.parts.len(), ..Default::default() };
            let part = self.parts.entry(self.key(t, centre)).or_insert(next);
            part.area += area;
            part.flux += area * reflected.element_sum() / 3.0;
        }
    }

    /// Half of all weight goes to the parts in proportion to the square root of their areas; the
    /// other half is split equally among groups.
    fn weigh_parts(&mut self) {
        let cell_size = self.cell_size();
        let mut parts: Vec<(PartKey, Part)> = self.parts.drain().collect();
        parts.sort_unstable_by_key(|(_, part)| part.index);
        // A part outside the focus counts as no larger than a cell.
        let size = |part: &Part| part.area.sqrt().min(cell_size);
        let mut of_groups = vec![0.0; self.scene.groups().len()];
        for (key, part) in &parts {
            of_groups[key.0 as usize] += size(part);
        }
        let (sum, groups): (f64, _) =
            (of_groups.iter().sum(), of_groups.iter().filter(|&&s| s > 0.0).count() as f64);
        let bright = bright_radiosity(&parts);
        for (key, part) in &mut parts {
            let of_group = of_groups[key.0 as usize].max(f64::MIN_POSITIVE);
            let by_group = size(part) / of_group / groups;
            part.weight = (size(part) / f64::max(sum, f64::MIN_POSITIVE) + by_group) / 2.0;
            part.lit = part.flux > LIT_SHARE * bright * part.area;
        }
        self.parts = parts.into_iter().collect();
    }

    /// Side of a cell, scene unit.
    fn cell_size(&self) -> f64 {
        self.focus.longest_side().max(f64::MIN_POSITIVE) / CELLS
    }

    /// The part of a point of triangle `t`.
    fn key(&self, t: usize, point: DVec3) -> PartKey {
        let cell = (point - self.focus.low) / self.cell_size();
        let cell = cell.clamp(DVec3::ZERO, DVec3::splat(CELLS - 1.0));
        let normal = self.scene.normal(t);
        let axis = (0..3).fold(0, |a, b| if normal[b].abs() > normal[a].abs() { b } else { a });
        let facing = (2 * axis + usize::from(normal[axis] < 0.0)) as u8;
        (self.scene.triangles()[t].group, [cell.x as u8, cell.y as u8, cell.z as u8, facing])
    }

    /// Score of `camera` in [0, 1] by a grid of `side` × `side` rays over a picture of this width
    /// over height.
    pub fn score(&self, camera: &Camera, aspect: f64, side: usize) -> f64 {
        let [right, up, forward] = camera.frame();
        let height = (camera.vertical_fov.to_radians() / 2.0).tan();
        let too_near = NEAR_SHARE * self.focus.diagonal();
        let (mut fronts, mut backs, mut near, mut lit) = (0, 0, 0, 0);
        let mut seen = vec![0.0; self.parts.len()];
        let mut covered = 0.0;
        // From −1 to 1 over the picture, at the middles of the grid's cells.
        let at = |k: usize| (2.0 * k as f64 + 1.0) / side as f64 - 1.0;
        for k in 0..side * side {
            let (x, y) = (at(k % side) * height * aspect, at(k / side) * height);
            let direction = (forward + right * x + up * y).normalize();
            let Some(hit) = self.rays.closest_hit(camera.eye, direction, 0.0, None) else {
                continue;
            };
            near += usize::from(hit.distance < too_near);
            backs += usize::from(!hit.front);
            let place = camera.eye + direction * hit.distance;
            let part = self.parts.get(&self.key(hit.triangle, place)).filter(|_| hit.front);
            if let Some(part) = part {
                fronts += 1;
                lit += usize::from(part.lit);
                let before = seen[part.index];
                let now =
                    before + 1.0 - EDGE_LOSS * at(k % side).abs().max(at(k / side).abs()).powi(2);
                seen[part.index] = now;
                let counts = |rays: f64| rays / (rays + HALF_SEEN);
                covered += part.weight * (counts(now) - counts(before));
            }
        }
        if fronts == 0 {
            return 0.0;
        }
        let share = |count: usize| count as f64 / (side * side) as f64;
        let lit = lit as f64 / fronts as f64;
        covered
            * (share(fronts) / FULL_SHARE).min(1.0)
            * (1.0 - share(backs)).powi(BACK_POWER)
            * (1.0 - share(near)).powi(NEAR_POWER)
            * (UNLIT_SCORE + (1.0 - UNLIT_SCORE) * lit)
    }

    /// Fraction of directions, `count` evenly over the sphere, in which `point` sees fronts.
    pub fn enclosure(&self, point: DVec3, count: usize) -> f64 {
        let fronts = (0..count).filter(|&k| {
            let [x, y] = r2_point(k, 0.5);
            let height = 2.0 * x - 1.0;
            let (sine, cosine) = (TAU * y).sin_cos();
            let level = (1.0 - height * height).sqrt();
            let direction = DVec3::new(level * cosine, level * sine, height);
            self.rays.closest_hit(point, direction, 0.0, None).is_some_and(|hit| hit.front)
        });
        fronts.count() as f64 / count as f64
    }
}

/// Radiosity above which half of all light is reflected, taken over parts: in a mostly dark tunnel
/// it is that of the lit part.
fn bright_radiosity(parts: &[(PartKey, Part)]) -> f64 {
    let radiosity = |part: &Part| part.flux / part.area;
    let mut order: Vec<&Part> = parts.iter().map(|(_, part)| part).collect();
    order.sort_by(|a, b| radiosity(b).total_cmp(&radiosity(a)));
    let total: f64 = order.iter().map(|part| part.flux).sum();
    let mut above = 0.0;
    let bright = order.into_iter().find(|part| {
        above += part.flux;
        above >= total / 2.0
    });
    bright.map_or(0.0, radiosity)
}
