//! Lights as the device samples them: connected emitters.
//!
//! Emitting triangles of one material and exitance that share corners are one light. From a gather
//! point, the few lights that could contribute most are sampled one by one (rays to points on
//! them), each scaled by its closed-form unoccluded form factor:
//!
//! ```text
//!   direct irradiance = Σ_lights E · F(point → light) · visible share
//! ```
//!
//! All others are left to the samples over the hemisphere, like any other surface. On the CPU a
//! [`LightTree`](super::light_tree) takes all of them.

use std::sync::Arc;

use rustc_hash::FxHashMap;

use crate::geometry::union_find::UnionFind;
use crate::geometry::weld::position_key;
use crate::sampling::surface::AreaSampler;
use crate::scene::{Rgb, Scene};

/// Emitting triangles of one material and exitance that are connected by shared corners.
#[derive(Clone, Debug)]
pub(crate) struct Light {
    /// Its triangles, ascending.
    pub triangles: Vec<u32>,
    /// Chooses among them in proportion to area.
    pub surface: AreaSampler,
    /// Exitance of all of them, W/m² per channel.
    pub exitance: Rgb,
    /// Whether no part of it can hide another: all of it lies behind each of its triangles' planes.
    /// Then the closed forms of the triangles that face a point add up to the light's.
    pub convex: bool,
}

/// The lights of a scene.
#[derive(Clone, Debug)]
pub(crate) struct Lights {
    scene: Arc<Scene>,
    /// Every light, by its lowest triangle.
    pub lights: Vec<Light>,
    /// Light of each triangle, or [`NO_LIGHT`].
    pub of_triangle: Vec<u32>,
}

/// In place of a light's index, for triangles that do not emit. Shaders know the value.
pub(crate) const NO_LIGHT: u32 = u32::MAX;

/// Maximum number of lights that are sampled explicitly from one point; cost is linear in it.
/// Shaders know the value.
pub(crate) const MAX_EXPLICIT_LIGHTS: usize = 8;

impl Lights {
    /// Finds the lights of `scene`.
    pub fn new(scene: Arc<Scene>) -> Lights {
        let count = scene.triangles().len();
        let emitters: Vec<usize> = (0..count).filter(|&t| scene.exitance(t) != Rgb::ZERO).collect();
        let connected = connected_emitters(&scene, &emitters);
        let mut lights: Vec<Vec<u32>> = vec![];
        let mut of_triangle = vec![NO_LIGHT; count];
        for (&t, &first) in emitters.iter().zip(&connected) {
            if first == t {
                of_triangle[t] = lights.len() as u32;
                lights.push(vec![]);
            }
            of_triangle[t] = of_triangle[first];
            lights[of_triangle[t] as usize].push(t as u32);
        }
        let lights = lights.into_iter().map(|triangles| Light::new(&scene, triangles)).collect();
        Lights { scene, lights, of_triangle }
    }

    /// The scene whose lights they are.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }
}

impl Light {
    /// The light with these `triangles`, ascending, of one material.
    fn new(scene: &Scene, triangles: Vec<u32>) -> Light {
        Light {
            surface: AreaSampler::new(triangles.iter().map(|&t| scene.area(t as usize))),
            exitance: scene.exitance(triangles[0] as usize),
            convex: is_convex(scene, &triangles),
            triangles,
        }
    }
}

/// For each of `emitters` (ascending), the lowest one of its material and exitance that it is
/// connected to by shared corners: itself, if there is no lower one. Triangles of a texture have
/// their own exitance each.
pub(super) fn connected_emitters(scene: &Scene, emitters: &[usize]) -> Vec<usize> {
    let mut sets = UnionFind::new(emitters.len());
    let mut first_at_corner: FxHashMap<([u64; 3], u32, [u64; 3]), usize> = FxHashMap::default();
    for (k, &t) in emitters.iter().enumerate() {
        let material = scene.triangles()[t].material;
        let exitance = scene.exitance(t).to_array().map(f64::to_bits);
        for corner in scene.corners(t) {
            let key = (position_key(corner), material, exitance);
            let first = *first_at_corner.entry(key).or_insert(k);
            sets.join(first, k);
        }
    }
    (0..emitters.len()).map(|k| emitters[sets.find(k)]).collect()
}

/// Whether no corner lies in front of a triangle's plane by more than rounding, 1e-9 of the extent.
/// Lights of more than 1024 triangles count as not convex, since the test takes quadratic time.
fn is_convex(scene: &Scene, triangles: &[u32]) -> bool {
    let corners: Vec<_> = triangles.iter().flat_map(|&t| scene.corners(t as usize)).collect();
    let extent = corners.iter().map(|p| p.distance(corners[0])).fold(0.0, f64::max);
    triangles.len() <= 1024
        && triangles.iter().all(|&t| {
            let (normal, on) = (scene.normal(t as usize), scene.corners(t as usize)[0]);
            corners.iter().all(|p| normal.dot(p - on) <= 1e-9 * extent)
        })
}
