//! How well a view shows a scene: rays through a grid over the picture, and what they meet.
//!
//! ```text
//!   surface ── parts by group, cell of a box and direction; weights by √area and by group
//!   view ── grid of rays ── parts seen × picture filled × no backs × nothing too near × lit
//! ```
//!
//! Parts are what there is to see of a scene, however finely it is cut into triangles. Vázquez,
//! Feixas, Sbert and Heidrich (2001) score views alike, by the entropy of the faces seen.

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

/// Cells along the longest side of the focus that tell places apart. Chosen by hand.
const CELLS: f64 = 5.0;

/// Share of the picture from which on it counts as full: an object before nothing. Chosen by hand.
const FULL_SHARE: f64 = 0.5;

/// A back counts as that much of the picture lost, and something too near likewise: powers of the
/// share of the picture that is free of them. Chosen by hand.
const BACK_POWER: i32 = 6;
const NEAR_POWER: i32 = 3;

/// What is nearer than this share of the scene's diagonal is too near. Chosen by hand.
const NEAR_SHARE: f64 = 0.05;

/// Of the radiosity from which on half of the reflected light is, the share from which on something
/// is lit, and the score of a view of nothing that is lit. Chosen by hand.
const LIT_SHARE: f64 = 0.05;
const UNLIT_SCORE: f64 = 0.02;

/// A part is as good as unseen at a few rays: n of them count n / (n + this). Chosen by hand.
const HALF_SEEN: f64 = 1.0;

/// By how much a ray at the picture's edge counts less than one in its middle. Chosen by hand.
const EDGE_LOSS: f64 = 0.5;

/// A scene with its light, as views of it are scored.
pub(super) struct ViewScorer<'a> {
    pub rays: Arc<RayScene>,
    /// Box around what is to be seen; what reflects outside it counts as if on its boundary.
    pub focus: Aabb,
    scene: &'a Scene,
    parts: FxHashMap<PartKey, Part>,
}

/// Group; cell of the focus along x, y and z, and which of the six axes it looks along.
type PartKey = (u32, [u8; 4]);

/// What is of one group, in one cell, and faces one way.
#[derive(Clone, Copy, Default)]
struct Part {
    index: usize,
    /// Scene unit squared.
    area: f64,
    /// Mean of the channels of its reflected radiosity, times area.
    flux: f64,
    /// Share of what there is to see.
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
    /// For views of `light` in which the parts within `focus` matter most.
    pub fn new(light: &GatheredMesh, focus: Aabb) -> ViewScorer<'_> {
        let scene = light.mesh.scene();
        let rays = RayScene::of_scene(scene);
        let mut scorer = ViewScorer { rays, focus, scene, parts: FxHashMap::default() };
        scorer.add_parts(light);
        scorer.weigh_parts();
        scorer
    }

    /// Adds up area and light of each part of what reflects, or of all where nothing does.
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

    /// Half of all weight goes to the parts by the square root of their areas, half is shared
    /// equally by groups.
    fn weigh_parts(&mut self) {
        let cell_size = self.cell_size();
        let mut parts: Vec<(PartKey, Part)> = self.parts.drain().collect();
        parts.sort_unstable_by_key(|(_, part)| part.index);
        // What lies outside the focus is no larger than a cell.
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

    /// The part that a point of triangle `t` is in.
    fn key(&self, t: usize, point: DVec3) -> PartKey {
        let cell = (point - self.focus.low) / self.cell_size();
        let cell = cell.clamp(DVec3::ZERO, DVec3::splat(CELLS - 1.0));
        let normal = self.scene.normal(t);
        let axis = (0..3).fold(0, |a, b| if normal[b].abs() > normal[a].abs() { b } else { a });
        let facing = (2 * axis + usize::from(normal[axis] < 0.0)) as u8;
        (self.scene.triangles()[t].group, [cell.x as u8, cell.y as u8, cell.z as u8, facing])
    }

    /// From 0, worthless, to 1: what `camera` shows by a grid of `side` × `side` rays over a
    /// picture of this width over height.
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

    /// The share of directions, `count` evenly over the sphere, in which `point` sees fronts.
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

/// The mean radiosity of the parts from which on half of all light is reflected: where most of a
/// tunnel is dark, what is lit is still the place with the lamp.
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
