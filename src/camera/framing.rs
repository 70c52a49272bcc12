//! Automatic choice of a camera for a scene that has none.
//!
//! ```text
//!   box of what is lit ──► outside: obliquely, so far away that the box fits the picture
//!                      └─► inside:  where its middle sees fronts all around; from outside too
//!                                   where a wall is missing
//! ```
//!
//! All numbers here are plain choices: nothing but the picture depends on them.

use std::f64::consts::TAU;

use glam::DVec3;

use super::Camera;
use crate::gather::GatheredMesh;
use crate::geometry::aabb::Aabb;
use crate::sampling::low_discrepancy::{r2_point, radical_inverse};
use crate::visibility::ray_scene::{Hit, RayScene};

impl Camera {
    /// Chooses a view of what is lit in `light`, for a picture of this width over height: from
    /// inside where that is a room, from outside where it is an object or a room that lacks a wall.
    ///
    /// Of four sides it is the one that most of the reflected light leaves to.
    /// [`Scene::up`](crate::Scene::up) is up. The same light gives the same view.
    pub fn framing(light: &GatheredMesh, aspect: f64) -> Camera {
        let scene = light.mesh.scene();
        let (bounds, flux) = lit_box(light);
        let framing = Framing { rays: &RayScene::of_scene(scene), bounds, up: scene.up() };
        let from = |elevation: f64, first: f64| {
            let view = |k: u32| framing.forward(elevation, first + f64::from(k) / 4.0);
            (1..4).map(view).fold(view(0), |a, b| if b.dot(flux) < a.dot(flux) { b } else { a })
        };
        let level = from(0.0, 0.0);
        let camera = match framing.middle_of_room() {
            None => framing.fitted(from(25.0, 1.0 / 12.0), aspect),
            Some((middle, open)) if open > 0.1 && framing.hit(middle, -level).is_none() => {
                framing.fitted(level, aspect)
            }
            Some((middle, _)) => framing.inside(middle),
        };
        framing.rounded(camera)
    }
}

struct Framing<'a> {
    rays: &'a RayScene,
    /// What is to be seen.
    bounds: Aabb,
    up: DVec3,
}

impl Framing<'_> {
    /// The unit direction of a view from this elevation in degrees, at an azimuth in turns.
    fn forward(&self, elevation: f64, turns: f64) -> DVec3 {
        // The first direction is −z where +y is up, and +y where +z is up.
        let across = |axis: &DVec3| axis.dot(self.up).abs() < 0.8;
        let first = [DVec3::NEG_Z, DVec3::Y].into_iter().find(across).unwrap_or(DVec3::X);
        let first = first.reject_from_normalized(self.up).normalize();
        let (sine, cosine) = libm::sincos(turns * TAU);
        let (down, level) = libm::sincos(elevation.to_radians());
        (first * cosine + first.cross(self.up) * sine) * level - self.up * down
    }

    fn hit(&self, point: DVec3, direction: DVec3) -> Option<Hit> {
        self.rays.closest_hit(point, direction, 0.0, None)
    }

    /// The view along unit `forward` from the least distance at which the box is in the picture.
    fn fitted(&self, forward: DVec3, aspect: f64) -> Camera {
        let (target, up, vertical_fov) = (self.bounds.centre(), self.up, 40.0_f64);
        let camera = Camera { eye: -forward, target: DVec3::ZERO, up, vertical_fov };
        let [right, up, _] = camera.frame();
        let half = libm::tan(vertical_fov.to_radians() / 2.0) * (1.0 - 2.0 * 0.04);
        let back = self.bounds.corners().map(|corner| {
            let [x, y, z] = [right, up, forward].map(|axis| (corner - target).dot(axis));
            (x / aspect).abs().max(y.abs()) / half - z
        });
        let eye = target - forward * back.into_iter().fold(0.0, f64::max);
        Camera { eye, target, ..camera }
    }

    /// The middle of the box, or a point beside it where that is within a solid, if it sees fronts
    /// all around; and the fraction of directions in which it sees nothing.
    fn middle_of_room(&self) -> Option<(DVec3, f64)> {
        let point = |k: usize| {
            let [x, y] = r2_point(k, 0.5);
            self.bounds.low + self.bounds.size() * DVec3::new(x, y, radical_inverse(k as u32 + 1))
        };
        // Fractions of directions with fronts and with backs.
        let seen = |point: DVec3| {
            let (count, mut fronts, mut backs) = (64, 0.0, 0.0);
            for [x, y] in (0..count).map(|k| r2_point(k, 0.5)) {
                let direction = self.forward(libm::asin(2.0 * x - 1.0).to_degrees(), y);
                if let Some(hit) = self.hit(point, direction) {
                    *(if hit.front { &mut fronts } else { &mut backs }) += 1.0 / count as f64;
                }
            }
            [fronts, backs]
        };
        let mut points = (0..16).map(|k| (point(k), seen(point(k))));
        let (middle, [fronts, backs]) = points.find(|(_, [_, backs])| *backs < 0.5)?;
        (fronts >= 0.75).then_some((middle, 1.0 - fronts - backs))
    }

    /// The view of the middle of the box from the farthest point behind `middle`.
    fn inside(&self, middle: DVec3) -> Camera {
        let eye = |k: u32| {
            let forward = self.forward(10.0, f64::from(k) / 16.0);
            // Not far out of a window.
            let [open, most] = [0.1, 0.5].map(|share| share * self.bounds.diagonal());
            let free = self.hit(middle, -forward).map_or(open, |hit| hit.distance.min(most));
            middle - forward * (0.85 * free)
        };
        let farther = |a: &DVec3, b: &DVec3| a.distance(middle).total_cmp(&b.distance(middle));
        let eye = (0..16).map(eye).max_by(farther).expect("some azimuths");
        Camera { eye, target: self.bounds.centre(), up: self.up, vertical_fov: 70.0 }
    }

    /// The same view with rounded coordinates: steps below 1e-4 of the size of the box.
    fn rounded(&self, camera: Camera) -> Camera {
        let digits = 4 - libm::log10(self.bounds.diagonal()).floor() as i32;
        let round = |x: f64| {
            let scale = 10f64.powi(digits.abs());
            if digits >= 0 { (x * scale).round() / scale } else { (x / scale).round() * scale }
        };
        let [eye, target] = [camera.eye, camera.target].map(|p| p.map(round) + DVec3::ZERO);
        let rounded = Camera { eye, target, ..camera };
        if rounded.check(1, 1, 1).is_ok() { rounded } else { camera }
    }
}

/// The box around the reflected light but for 5 % at either end of each axis, each triangle weighed
/// by its mean, or around all that reflects unless it is much smaller; and the sum of flux times
/// normal.
fn lit_box(light: &GatheredMesh) -> (Aabb, DVec3) {
    let (surface, scene) = (&light.surface, light.mesh.scene());
    let (mut weights, mut flux) = (vec![0.0; surface.positions.len()], DVec3::ZERO);
    for (face, &element) in surface.faces.iter().zip(&surface.elements) {
        let t = light.mesh.triangle(light.mesh.element(element as usize));
        let [a, b, c] = face.map(|v| surface.positions[v as usize]);
        let area = (b - a).cross(c - a).length();
        for &v in face {
            let reflected = surface.radiosity[v as usize] - scene.material(t).exitance;
            let reflected = area * reflected.element_sum().max(0.0);
            weights[v as usize] += reflected / scene.area(t);
            flux += reflected * scene.normal(t);
        }
    }
    let places: Vec<(DVec3, f64)> = surface.positions.iter().copied().zip(weights).collect();
    let whole = scene.reflecting_bounds();
    let lit = Aabb::around_most(&places, 0.05);
    let lit = lit.filter(|lit| lit.diagonal() < 0.6 * whole.diagonal());
    (lit.unwrap_or(whole), flux)
}

#[cfg(test)]
mod tests;
