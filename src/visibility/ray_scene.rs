//! Rays against triangles on the CPU: the closest hit, and whether a segment is occluded.
//!
//! ```text
//!  ray ──► hierarchy of 32-bit boxes ──► candidate triangles ──► exact test in 64 bits ──► hit
//!          (scaled to a fixed size,       in any order            ties: lower index
//!           boxes grown by a margin)
//! ```
//!
//! Backs that fronts in the same place cover ([`Scene::is_back_covered`]) are not met. Nor are
//! clear panes ([`Scene::is_clear`]): [`Panes`](super::panes::Panes) tell what they let through;
//! nor holes, [`CutOuts`], which are looked up where a triangle is hit. Whether there are any is
//! asked once a ray.
//!
//! The hierarchy only prunes: its boxes are grown by more than 32-bit rounding, so that no hit is
//! lost between it and the exact test. Of hits at equal distances the lowest triangle index wins,
//! whatever the order of traversal, so that results do not depend on the hierarchy.

use std::ops::Range;

use glam::{DVec3, Vec3, Vec3A};
use obvhs::aabb::Aabb as Aabb32;
use obvhs::cwbvh::CwBvh;
use obvhs::ray::{Ray, RayHit};

use crate::geometry::aabb::Aabb;
use crate::scene::Scene;

use super::cut_outs::CutOuts;
use super::wide_bvh::hierarchy;

/// Triangles that rays can be cast at. The hierarchy is in 32 bits and conservative; the
/// intersections are in 64.
#[derive(Debug)]
pub(crate) struct RayScene {
    bvh: CwBvh,
    triangles: Vec<TrianglePlane>,
    /// Middle of the scene: the hierarchy's origin.
    origin: DVec3,
    /// From the scene's unit to the hierarchy's.
    scale: f64,
    /// None where nothing has holes.
    cut_outs: Option<CutOuts>,
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

/// Longest side of the scene in the hierarchy's own unit. The traversal of `obvhs` skips boxes that
/// end nearer than 1e-4 units: 1e-9 of the scene at this size.
const HIERARCHY_SCENE_SIZE: f64 = 1e5;

/// Boxes grow by this much on every side, in the hierarchy's unit: 1e-6 of the scene, several
/// roundings of a 32-bit coordinate (6e-8 each).
const BOX_MARGIN: f32 = 1e-6 * HIERARCHY_SCENE_SIZE as f32;

/// Barycentric weights down to minus this count as inside, which closes the seam between
/// neighbours: far above the rounding of the test (some 1e-15), far below anything visible.
pub(super) const BARYCENTRIC_TOLERANCE: f64 = 1e-12;

impl RayScene {
    /// For triangles by their corners.
    pub fn new(corners: impl Iterator<Item = [DVec3; 3]>) -> RayScene {
        let corners: Vec<[DVec3; 3]> = corners.collect();
        let all = (0..corners.len() as u32).collect();
        RayScene::of_some(corners, all)
    }

    /// For those of the triangles whose numbers are `met`; nothing meets the others.
    fn of_some(mut corners: Vec<[DVec3; 3]>, mut met: Vec<u32>) -> RayScene {
        let bounds = Aabb::from_points(corners.iter().flatten().copied());
        let origin = bounds.centre();
        let scale = HIERARCHY_SCENE_SIZE / bounds.longest_side().max(f64::MIN_POSITIVE);
        let local = |p: DVec3| Vec3A::from(((p - origin) * scale).as_vec3());
        if met.is_empty() {
            // A hierarchy has something in it; this has no area, and nothing meets it.
            met.push(corners.len() as u32);
            corners.push([origin; 3]);
        }
        let boxes: Vec<Aabb32> = met
            .iter()
            .map(|&t| {
                let [a, b, c] = corners[t as usize].map(local);
                let margin = Vec3A::splat(BOX_MARGIN);
                Aabb32 { min: a.min(b).min(c) - margin, max: a.max(b).max(c) + margin }
            })
            .collect();
        let mut bvh = hierarchy(&boxes);
        bvh.primitive_indices.iter_mut().for_each(|k| *k = met[*k as usize]);
        let triangles = corners.into_iter().map(TrianglePlane::new).collect();
        RayScene { bvh, triangles, origin, scale, cut_outs: None }
    }

    /// The same, where nothing meets the backs of triangles that are `covered`.
    pub fn with_covered_backs(mut self, covered: impl Fn(usize) -> bool) -> RayScene {
        for (t, plane) in self.triangles.iter_mut().enumerate() {
            plane.back_is_covered = covered(t);
        }
        self
    }

    /// The same, where rays go through these holes.
    pub fn with_cut_outs(self, cut_outs: Option<CutOuts>) -> RayScene {
        RayScene { cut_outs, ..self }
    }

    /// For the triangles of `scene` that block light, by their numbers.
    pub fn of_scene(scene: &Scene) -> RayScene {
        let count = scene.triangles().len();
        let met = (0..count as u32).filter(|&t| !scene.is_clear(t as usize)).collect();
        RayScene::of_some((0..count).map(|t| scene.corners(t)).collect(), met)
            .with_covered_backs(|t| scene.is_back_covered(t))
            .with_cut_outs(CutOuts::new(scene, (0..count).map(|t| (t, Scene::WHOLE))))
    }

    /// The nearest triangle along `direction` (any length) from `from`, further than `start` and
    /// not triangle `ignored`. Distances are in units of `direction`.
    pub fn closest_hit(
        &self,
        from: DVec3,
        direction: DVec3,
        start: f64,
        ignored: Option<usize>,
    ) -> Option<Hit> {
        self.closest_hit_of(from, direction, start, ignored, |_| true)
    }

    /// The same of those hits that `counts`.
    pub fn closest_hit_of(
        &self,
        from: DVec3,
        direction: DVec3,
        start: f64,
        ignored: Option<usize>,
        counts: impl Fn(&Hit) -> bool,
    ) -> Option<Hit> {
        match &self.cut_outs {
            None => self.nearest(from, direction, start, ignored, counts),
            Some(holes) => self.nearest(from, direction, start, ignored, solid_hits(holes, counts)),
        }
    }

    fn nearest(
        &self,
        from: DVec3,
        direction: DVec3,
        start: f64,
        ignored: Option<usize>,
        counts: impl Fn(&Hit) -> bool,
    ) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        let (ray, reach) = self.ray(from, direction);
        self.bvh.ray_traverse(ray, &mut RayHit::none(), |_, id| {
            let triangle = self.bvh.primitive_indices[id] as usize;
            if Some(triangle) == ignored {
                return f32::INFINITY;
            }
            // Rounded up, so that an equal is still looked at.
            let end = best.map_or(f64::INFINITY, |b| b.distance * (1.0 + 4.0 * f64::EPSILON));
            let hit = self.intersect(triangle, from, direction, start..end);
            let Some(hit) = hit.filter(|hit| counts(hit)) else {
                return f32::INFINITY;
            };
            // Between equals the lower index wins, whatever the order of the visit.
            if best.is_some_and(|b| (b.distance, b.triangle) < (hit.distance, triangle)) {
                return f32::INFINITY;
            }
            best = Some(hit);
            // Only prunes: rounded up, so that an equal in 32 bits is still looked at.
            (hit.distance * reach) as f32 * (1.0 + 4.0 * f32::EPSILON) + BOX_MARGIN
        });
        best
    }

    /// Whether any hit that `counts` lies along `direction` (any length) from `from`, within
    /// `reach` in units of it.
    pub fn occluded(
        &self,
        from: DVec3,
        direction: DVec3,
        reach: Range<f64>,
        counts: impl Fn(&Hit) -> bool,
    ) -> bool {
        match &self.cut_outs {
            None => self.any(from, direction, reach, counts),
            Some(holes) => self.any(from, direction, reach, solid_hits(holes, counts)),
        }
    }

    fn any(
        &self,
        from: DVec3,
        direction: DVec3,
        reach: Range<f64>,
        counts: impl Fn(&Hit) -> bool,
    ) -> bool {
        let (mut ray, length) = self.ray(from, direction);
        ray.tmax = (reach.end * length) as f32 * (1.0 + 4.0 * f32::EPSILON) + BOX_MARGIN;
        let mut blocked = false;
        self.bvh.ray_traverse(ray, &mut RayHit::none(), |_, id| {
            let triangle = self.bvh.primitive_indices[id] as usize;
            let hit = self.intersect(triangle, from, direction, reach.clone());
            blocked |= hit.is_some_and(|h| counts(&h));
            // Nothing is nearer than that: the rest is left out.
            if blocked { f32::NEG_INFINITY } else { f32::INFINITY }
        });
        blocked
    }

    /// A ray in the hierarchy's own unit, and the length of `direction` in it.
    fn ray(&self, from: DVec3, direction: DVec3) -> (Ray, f64) {
        let local = ((from - self.origin) * self.scale).as_vec3();
        let (unit, length) = direction.normalize_and_length();
        // Adding zero turns -0 into 0: the traversal takes its octant and its inverse from the
        // sign.
        let ray = Ray::new_inf(local.into(), (unit.as_vec3() + Vec3::ZERO).into());
        (ray, length * self.scale)
    }

    /// Where the line meets a triangle, within `reach` in units of `direction`, in 64 bits: its
    /// plane first (Badouel 1990), because most are met too far off or not at all.
    #[inline(always)]
    fn intersect(
        &self,
        triangle: usize,
        from: DVec3,
        direction: DVec3,
        reach: Range<f64>,
    ) -> Option<Hit> {
        let TrianglePlane { corner, normal, gradients, back_is_covered } = self.triangles[triangle];
        let (facing, to) = (normal.dot(direction), corner - from);
        // Most are too far off or behind, which is told without a division. Written so that NaN is
        // no hit, as of a line in the plane.
        let (rise, steep) = (normal.dot(to) * facing.signum(), facing.abs());
        if !(rise > reach.start * steep && rise <= reach.end * steep) || steep == 0.0 {
            return None;
        }
        if back_is_covered && facing > 0.0 {
            return None;
        }
        let distance = rise / steep;
        let at = direction * distance - to;
        let (u, v) = (at.dot(gradients[0]), at.dot(gradients[1]));
        let inside = u >= -BARYCENTRIC_TOLERANCE
            && v >= -BARYCENTRIC_TOLERANCE
            && u + v <= 1.0 + BARYCENTRIC_TOLERANCE;
        inside.then_some(Hit { triangle, distance, u, v, front: facing < 0.0 })
    }
}

/// Of the hits that `counts`, those that are in none of the `holes`.
fn solid_hits(holes: &CutOuts, counts: impl Fn(&Hit) -> bool) -> impl Fn(&Hit) -> bool {
    move |hit| holes.is_solid(hit.triangle, [hit.u, hit.v]) && counts(hit)
}

/// A triangle, prepared for intersection.
#[derive(Clone, Copy, Debug)]
struct TrianglePlane {
    corner: DVec3,
    /// On the front; of any length.
    normal: DVec3,
    /// Gradients of the barycentric weights of the second and third corner.
    gradients: [DVec3; 2],
    /// Whether nothing meets its back.
    back_is_covered: bool,
}

impl TrianglePlane {
    fn new([a, b, c]: [DVec3; 3]) -> TrianglePlane {
        let (u, v) = (b - a, c - a);
        // A length of the order of one keeps squares of tiny and of huge triangles within range.
        let size = u.length().max(v.length()).max(f64::MIN_POSITIVE);
        let (u, v) = (u / size, v / size);
        let normal = u.cross(v);
        let square = normal.length_squared();
        let gradient =
            |edge: DVec3| if square > 0.0 { edge / (square * size) } else { DVec3::ZERO };
        let gradients = [gradient(v.cross(normal)), gradient(normal.cross(u))];
        TrianglePlane { corner: a, normal, gradients, back_is_covered: false }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closest_hit_skips_ignored_triangle() {
        let at = |z: f64| [DVec3::new(0., 0., z), DVec3::new(1., 0., z), DVec3::new(0., 1., z)];
        let rays = RayScene::new([at(2.0), at(1.0), at(1.0)].into_iter());
        let from = DVec3::new(0.2, 0.3, 0.0);
        let hit = rays.closest_hit(from, DVec3::Z, 0.0, None).unwrap();
        assert_eq!((hit.triangle, hit.distance, hit.front), (1, 1.0, false));
        assert!((hit.u - 0.2).abs() < 1e-15 && (hit.v - 0.3).abs() < 1e-15);
        assert_eq!(rays.closest_hit(from, DVec3::Z, 0.0, Some(1)).unwrap().triangle, 2);
        assert_eq!(rays.closest_hit(from, DVec3::Z, 1.5, None).unwrap().triangle, 0);
        assert_eq!(rays.closest_hit(from, -DVec3::Z, 0.0, None), None);
        let above = rays.closest_hit(from + 3.0 * DVec3::Z, -2.0 * DVec3::Z, 0.0, None).unwrap();
        assert_eq!((above.triangle, above.distance, above.front), (0, 0.5, true));
    }

    #[test]
    fn rays_hit_along_seams() {
        // A fan of thin triangles tiles the square; every ray through it hits, also along seams.
        let rim = |k: usize| {
            let a = k as f64 / 100.0 * std::f64::consts::TAU;
            DVec3::new(a.cos(), a.sin(), 0.1 * a.sin())
        };
        let fan = (0..100).map(|k| [DVec3::ZERO, rim(k), rim(k + 1)]);
        let rays = RayScene::new(fan);
        let eye = DVec3::new(0.01, -0.02, 5.0);
        for k in 0..100 {
            for r in [0.0, 1e-9, 0.1, 0.5, 0.9] {
                assert!(rays.closest_hit(eye, rim(k) * r - eye, 0.0, None).is_some(), "{k} {r}");
            }
        }
    }
}
