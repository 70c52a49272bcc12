//! Rays against triangles: the nearest hit, on the CPU.

use std::time::Duration;

use glam::{DVec3, Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh;
use obvhs::ray::{Ray, RayHit};

use crate::scene::Scene;

/// Triangles that rays can be cast at. The hierarchy is in 32 bits and conservative; the
/// intersections are in 64.
#[derive(Debug)]
pub(crate) struct Rays {
    bvh: CwBvh,
    /// First corner and two edges of each triangle, in the scene's unit.
    triangles: Vec<[DVec3; 3]>,
    origin: DVec3,
    scale: f64,
}

/// Where a ray first met a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hit {
    pub triangle: usize,
    /// Distance in units of the ray's direction.
    pub distance: f64,
    /// Barycentric weights of the second and third corner.
    pub u: f64,
    pub v: f64,
    /// Whether the triangle's front was met.
    pub front: bool,
}

/// Size of the scene in the hierarchy's own unit. The traversal skips boxes that end nearer than
/// 1e-4 units: 1e-9 of the scene at this size.
const SPAN: f64 = 1e5;

/// Boxes grow by this much, 1e-6 of the scene: several roundings of a 32-bit coordinate, so that
/// no hit is lost between the hierarchy and the exact test.
const MARGIN: f32 = 1e-6 * SPAN as f32;

/// Barycentric slack that closes the seam between neighbours: far above the rounding of the
/// test (some 1e-15), far below anything visible.
const SEAM: f64 = 1e-12;

impl Rays {
    /// For triangles by their corners.
    pub fn new(corners: impl Iterator<Item = [DVec3; 3]>) -> Rays {
        let corners: Vec<[DVec3; 3]> = corners.collect();
        let nothing = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let all = corners.iter().flatten();
        let (low, high) = all.fold(nothing, |(l, h), &p| (l.min(p), h.max(p)));
        let origin = low + (high - low) / 2.0;
        let scale = SPAN / (high - low).max_element().max(f64::MIN_POSITIVE);
        let local = |p: DVec3| Vec3A::from(((p - origin) * scale).as_vec3());
        let boxes: Vec<Aabb> = corners
            .iter()
            .map(|c| {
                let [a, b, c] = c.map(local);
                let margin = Vec3A::splat(MARGIN);
                Aabb { min: a.min(b).min(c) - margin, max: a.max(b).max(c) + margin }
            })
            .collect();
        let bvh = build_cwbvh(&boxes, BvhBuildParams::medium_build(), &mut Duration::default());
        let triangles = corners.into_iter().map(|[a, b, c]| [a, b - a, c - a]).collect();
        Rays { bvh, triangles, origin, scale }
    }

    /// For the triangles of `scene`, by their numbers.
    pub fn of_scene(scene: &Scene) -> Rays {
        Rays::new((0..scene.triangles().len()).map(|t| scene.corners(t)))
    }

    /// The nearest triangle along `direction` (any length) from `from`, further than `start` and
    /// not triangle `ignored`. Distances are in units of `direction`.
    pub fn nearest(
        &self,
        from: DVec3,
        direction: DVec3,
        start: f64,
        ignored: Option<usize>,
    ) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        let local = ((from - self.origin) * self.scale).as_vec3();
        let (unit, length) = direction.normalize_and_length();
        let reach = length * self.scale;
        // Adding zero turns -0 into 0: the traversal takes its octant and its inverse from the sign.
        let ray = Ray::new_inf(local.into(), (unit.as_vec3() + Vec3::ZERO).into());
        self.bvh.ray_traverse(ray, &mut RayHit::none(), |_, id| {
            let triangle = self.bvh.primitive_indices[id] as usize;
            if Some(triangle) == ignored {
                return f32::INFINITY;
            }
            let Some(hit) = self.intersect(triangle, from, direction) else {
                return f32::INFINITY;
            };
            // Between equals the lower index wins, whatever the order of the visit.
            let nearer = best.is_none_or(|b| (hit.distance, triangle) < (b.distance, b.triangle));
            if hit.distance <= start || !nearer {
                return f32::INFINITY;
            }
            best = Some(hit);
            // Only prunes: rounded up, so that an equal in 32 bits is still looked at.
            (hit.distance * reach) as f32 * (1.0 + 4.0 * f32::EPSILON) + MARGIN
        });
        best
    }

    /// Möller and Trumbore (1997), in 64 bits.
    fn intersect(&self, triangle: usize, from: DVec3, direction: DVec3) -> Option<Hit> {
        let [a, e1, e2] = self.triangles[triangle];
        let p = direction.cross(e2);
        let det = e1.dot(p);
        if det == 0.0 {
            return None;
        }
        let (inverse, t) = (1.0 / det, from - a);
        let u = t.dot(p) * inverse;
        let q = t.cross(e1);
        let v = direction.dot(q) * inverse;
        if u < -SEAM || v < -SEAM || u + v > 1.0 + SEAM {
            return None;
        }
        Some(Hit { triangle, distance: e2.dot(q) * inverse, u, v, front: det > 0.0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_front_or_back_is_found_and_the_ignored_is_not() {
        let at = |z: f64| [DVec3::new(0., 0., z), DVec3::new(1., 0., z), DVec3::new(0., 1., z)];
        let rays = Rays::new([at(2.0), at(1.0), at(1.0)].into_iter());
        let from = DVec3::new(0.2, 0.3, 0.0);
        let hit = rays.nearest(from, DVec3::Z, 0.0, None).unwrap();
        assert_eq!((hit.triangle, hit.distance, hit.front), (1, 1.0, false));
        assert!((hit.u - 0.2).abs() < 1e-15 && (hit.v - 0.3).abs() < 1e-15);
        assert_eq!(rays.nearest(from, DVec3::Z, 0.0, Some(1)).unwrap().triangle, 2);
        assert_eq!(rays.nearest(from, DVec3::Z, 1.5, None).unwrap().triangle, 0);
        assert_eq!(rays.nearest(from, -DVec3::Z, 0.0, None), None);
        let above = rays.nearest(from + 3.0 * DVec3::Z, -2.0 * DVec3::Z, 0.0, None).unwrap();
        assert_eq!((above.triangle, above.distance, above.front), (0, 0.5, true));
    }

    #[test]
    fn no_ray_slips_through_a_seam() {
        // A fan of thin triangles tiles the square; every ray through it hits, also along seams.
        let rim = |k: usize| {
            let a = k as f64 / 100.0 * std::f64::consts::TAU;
            DVec3::new(a.cos(), a.sin(), 0.1 * a.sin())
        };
        let fan = (0..100).map(|k| [DVec3::ZERO, rim(k), rim(k + 1)]);
        let rays = Rays::new(fan);
        let eye = DVec3::new(0.01, -0.02, 5.0);
        for k in 0..100 {
            for r in [0.0, 1e-9, 0.1, 0.5, 0.9] {
                assert!(rays.nearest(eye, rim(k) * r - eye, 0.0, None).is_some(), "{k} {r}");
            }
        }
    }
}
