//! Gathering with rays on the CPU: a second opinion, and what runs without a GPU.

use std::f64::consts::PI;

use glam::DVec3;
use rayon::prelude::*;

use super::light_view::LightView;
use super::lights::{Lights, NO_LIGHT};
use super::{Gather, Gathered, Place, Sources};
use crate::error::Error;
use crate::fan::{Fan, radical_inverse};
use crate::mesh::Mesh;
use crate::rays::{Hit, Rays};

/// Gathers by casting cosine-distributed rays, and rays to points on each light.
///
/// Every ray carries the same share of the hemisphere, so what reflected light it finds has the
/// error of an average over n stratified samples. A light's irradiance is its closed form times the
/// share of it that a quarter of √n × √n rays find visible, weighted by their form factors.
#[derive(Debug)]
pub struct RayGather {
    rays: Rays,
    lights: Lights,
    fan: Fan,
    count: u32,
}

impl RayGather {
    /// `count` rays a place over the triangles of `mesh`'s scene.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Setting`] when `count` is 0 or above 2²⁰.
    pub fn new(mesh: &Mesh, count: u32) -> Result<RayGather, Error> {
        let (fan, rays) = (Fan::new(count)?, Rays::of_scene(mesh.scene()));
        Ok(RayGather { rays, lights: Lights::new(mesh.shared_scene()), fan, count })
    }

    fn at(&self, sources: &Sources, place: &Place) -> Gathered {
        let mut apart = self.lights.apart(place);
        // Without a closed form, what reaches far around is seen better by the rays over the hemisphere
        // than by points spread over its area.
        apart.retain(|&(light, _)| {
            let light = &self.lights.lights[light as usize];
            let corner = |&t: &u32| sources.mesh.scene().corners(t as usize);
            light.convex || LightView::new(place, light.triangles.iter().map(corner)).is_some()
        });
        let is_apart = |light: u32| apart.iter().any(|&(k, _)| k == light);
        let share = 1.0 / f64::from(self.count);
        let turn = turn(place.position);
        let mut out = Gathered::default();
        for direction in self.fan.above(place.normal, turn) {
            let Some(hit) = self.rays.nearest(place.position, direction, place.near, None) else {
                out.open += share;
                continue;
            };
            out.nearness += share / hit.distance;
            if !hit.front {
                out.back += share;
                continue;
            }
            out.irradiance += sources.reflected_at(hit.triangle, hit.u, hit.v) * share;
            let light = self.lights.of_triangle[hit.triangle];
            if light != NO_LIGHT && !is_apart(light) {
                out.irradiance += self.lights.lights[light as usize].exitance * share;
            }
        }
        for (light, factor) in apart {
            let (seen, whole) = self.visible(sources.mesh, place, light, turn);
            let Some(light) = self.lights.lights.get(light as usize) else { continue };
            let factor = if !light.convex { seen } else { factor * seen / whole.max(1e-300) };
            out.direct += light.exitance * factor;
        }
        out.irradiance += out.direct;
        out
    }

    /// The form factor from `place` to what is visible of a light, and to all of it as if nothing
    /// were in between, both by the same points on it.
    fn visible(&self, mesh: &Mesh, place: &Place, light: u32, turn: f64) -> (f64, f64) {
        let triangles = &self.lights.lights[light as usize].triangles;
        let areas: Vec<f64> = triangles.iter().map(|&t| mesh.scene().area(t as usize)).collect();
        let whole: f64 = areas.iter().sum();
        let count = (self.count / 4).max(16);
        let (mut k, mut below) = (0, 0.0);
        let (mut seen, mut all) = (0.0, 0.0);
        for i in 0..count {
            let at = (f64::from(i) + 0.5) / f64::from(count) * whole;
            while at > below + areas[k] && k + 1 < areas.len() {
                below += areas[k];
                k += 1;
            }
            let triangle = triangles[k] as usize;
            let [a, b, c] = mesh.scene().corners(triangle);
            let across = ((at - below) / areas[k]).clamp(0.0, 1.0);
            // Uniform over a triangle (Pharr, Jakob, Humphreys 2016, 13.6.5).
            let (root, v) = (across.sqrt(), (radical_inverse(i) + turn).fract());
            let point = a * (1.0 - root) + (b * (1.0 - v) + c * v) * root;
            let to = point - place.position;
            let facing = -mesh.scene().normal(triangle).dot(to);
            let above = place.normal.dot(to);
            if facing <= 0.0 || above <= 0.0 {
                continue;
            }
            let r2 = to.length_squared();
            let factor = whole / f64::from(count) * facing * above / (PI * r2 * r2);
            all += factor;
            // What is met first may be another part of the light, which is as good.
            let near = place.near / r2.sqrt();
            let other = |h: &Hit| !(self.lights.of_triangle[h.triangle] == light && h.front);
            let blocked = self.rays.blocked(place.position, to, near..1.0 - 1e-9, other);
            seen += if blocked { 0.0 } else { factor };
        }
        (seen, all)
    }
}

impl Gather for RayGather {
    fn gather(&mut self, sources: &Sources, places: &[Place]) -> Result<Vec<Gathered>, Error> {
        Ok(places.par_iter().map(|p| self.at(sources, p)).collect())
    }
}

/// A turn in [0, 1) that differs from place to place: a hash of where it is.
pub(crate) fn turn(p: DVec3) -> f64 {
    let mix = |h: u64, x: f64| {
        // The finaliser of SplitMix64 (Steele, Lea, Flood 2014).
        let mut z = (h ^ x.to_bits()).wrapping_add(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    };
    let bits = p.to_array().into_iter().fold(0, mix);
    (bits >> 11) as f64 / (1u64 << 53) as f64
}
