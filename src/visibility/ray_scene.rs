//! Rays against triangles on the CPU: the closest hit, and whether a segment is occluded.
//!
//! ```text
//!  ray ──► hierarchy of boxes ──► four triangles ──► exact test ──► hit
//!          in 32 bits, wider      in 32 bits,         in 64 bits    ties: lower index
//!          by a margin            within a margin
//! ```
//!
//! Rays do not hit backs covered by coinciding fronts ([`Scene::is_back_covered`]), clear panes
//! ([`Scene::is_clear`]; for their transmittance see [`Panes`](super::panes::Panes)), or holes
//! ([`CutOuts`], looked up at hits).
//!
//! The hierarchy only prunes: its margins are above 32-bit rounding, so that no hit is lost between
//! it and the exact test. Of hits at equal distances the lowest triangle index wins, whatever the
//! order of traversal, so that results do not depend on the hierarchy.

use std::ops::Range;
use std::sync::Arc;

use arrayvec::ArrayVec;
use fearless_simd::{Level, Simd, dispatch};
use glam::DVec3;

use crate::geometry::aabb::Aabb;
use crate::scene::Scene;

use super::cut_outs::CutOuts;
use super::instances::{Instances, StreamBuffers};
use super::ray_stream::{MAX_STREAM, OpenChildren};
use super::ray32::Ray32;
use super::repeated_groups::RepeatedGroups;
use super::triangle_bvh::{self, TriangleBvh};
use super::triangle_plane::{LocalRay, TrianglePlane};
use super::triangle_tree::TriangleTree;

pub(crate) use super::triangle_plane::Hit;

/// Triangles that instances must save: a triangle takes 200 bytes here, and rays through instances
/// 10 % more time in a city of houses of 82 triangles.
const MIN_SAVED: usize = 1 << 18;

/// Triangles for ray casting. The hierarchy is in 32 bits and conservative; the intersections are
/// in 64.
#[derive(Debug)]
pub(crate) struct RayScene {
    triangles: TriangleBvh,
    /// Further triangles, in groups that are images of one another; `None` unless that saves at
    /// least half of all, and [`MIN_SAVED`].
    instances: Option<Instances>,
    /// `None` if no triangle has holes.
    cut_outs: Option<CutOuts>,
    /// Vector instructions of this machine.
    level: Level,
}

/// Rays from one point and their nearest hits; used again and again, so that nothing is allocated.
#[derive(Default)]
struct Stream {
    directions: ArrayVec<DVec3, MAX_STREAM>,
    hits: ArrayVec<Option<Hit>, MAX_STREAM>,
    /// In the hierarchy's unit.
    rays: ArrayVec<Ray32, MAX_STREAM>,
    /// Of the directions, in units of the rays' own.
    lengths: ArrayVec<f64, MAX_STREAM>,
    open: OpenChildren,
    at_instances: StreamBuffers,
}

impl RayScene {
    /// The scene of triangles given by their corners.
    pub fn new(corners: impl Iterator<Item = [DVec3; 3]>) -> RayScene {
        let corners: Vec<[DVec3; 3]> = corners.collect();
        let bounds = Aabb::from_points(corners.iter().flatten().copied());
        let (all, corners) = ((0..corners.len() as u32).collect(), |t: usize| corners[t]);
        RayScene::over(TriangleTree::new(all, corners, &bounds), corners)
    }

    /// The scene of the triangles in a tree, which have these `corners`.
    fn over(tree: TriangleTree, corners: impl Fn(usize) -> [DVec3; 3] + Sync) -> RayScene {
        let triangles = TriangleBvh::new(tree, corners);
        RayScene { triangles, instances: None, cut_outs: None, level: Level::new() }
    }

    /// The same scene, in which rays do not hit the backs of `covered` triangles.
    pub fn with_covered_backs(mut self, covered: impl Fn(usize) -> bool) -> RayScene {
        self.triangles.cover_backs(covered);
        self
    }

    /// The same scene with these holes.
    pub fn with_cut_outs(self, cut_outs: Option<CutOuts>) -> RayScene {
        RayScene { cut_outs, ..self }
    }

    /// The triangles of `scene` that block light, by their indices: built once per scene.
    pub fn of_scene(scene: &Scene) -> Arc<RayScene> {
        scene.derived_from_shape(RayScene::made_of)
    }

    /// The same with clear triangles, which do not affect light but are visible.
    pub fn with_clear(scene: &Scene) -> Arc<RayScene> {
        let has_clear = (0..scene.triangles().len()).any(|t| scene.is_clear(t));
        match has_clear {
            true => Arc::new(RayScene::of_triangles(scene, |_| true)),
            false => RayScene::of_scene(scene),
        }
    }

    fn made_of(scene: &Scene) -> RayScene {
        RayScene::of_triangles(scene, |t| !scene.is_clear(t))
    }

    fn of_triangles(scene: &Scene, is_included: impl Fn(usize) -> bool) -> RayScene {
        RayScene::with_instances(scene, is_included, MIN_SAVED)
    }

    /// The `is_included` triangles of `scene`, as instances where these save so many.
    fn with_instances(
        scene: &Scene,
        is_included: impl Fn(usize) -> bool,
        min_saved: usize,
    ) -> RayScene {
        let count = scene.triangles().len();
        let groups = match count >= min_saved {
            true => RepeatedGroups::of_scene(scene, &is_included),
            false => RepeatedGroups::default(),
        };
        let has_repeats = groups.saved() >= min_saved.max(count / 2);
        let instances = has_repeats.then(|| Instances::new(scene, &groups));
        let tree = match &instances {
            Some(_) => TriangleTree::new(groups.others, |t| scene.corners(t), &scene.bounds()),
            None => TriangleTree::of_scene(scene, is_included),
        };
        RayScene { instances, ..RayScene::over(tree, |t| scene.corners(t)) }
            .with_covered_backs(|t| scene.is_back_covered(t))
            .with_cut_outs(CutOuts::new(scene, 0..count))
    }

    /// The nearest hit along `direction` (any length) from `from`, further than `start` and not on
    /// triangle `ignored`. Distances are in units of `direction`.
    pub fn closest_hit(
        &self,
        from: DVec3,
        direction: DVec3,
        start: f64,
        ignored: Option<usize>,
    ) -> Option<Hit> {
        self.closest_hit_of(from, direction, start, ignored, |_| true)
    }

    /// The same among hits for which `counts` is true.
    pub fn closest_hit_of(
        &self,
        from: DVec3,
        direction: DVec3,
        start: f64,
        ignored: Option<usize>,
        counts: impl Fn(&Hit) -> bool,
    ) -> Option<Hit> {
        dispatch!(self.level, simd => {
            self.closest_hit_with(simd, (from, direction), start, ignored, counts)
        })
    }

    #[inline(always)]
    fn closest_hit_with<S: Simd>(
        &self,
        simd: S,
        (from, direction): (DVec3, DVec3),
        start: f64,
        ignored: Option<usize>,
        counts: impl Fn(&Hit) -> bool,
    ) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        let ray = LocalRay { from, direction, first: 0 };
        self.triangles.trace(simd, (from, direction), start..f64::INFINITY, |plane| {
            self.meet(plane, ray, start, ignored, &counts, &mut best)
        });
        let Some(instances) = &self.instances else { return best };
        let end = end_at(best);
        instances.trace(simd, (from, direction), start..end, |plane, ray| {
            self.meet(plane, ray, start, ignored, &counts, &mut best)
        });
        best
    }

    /// Puts the hit of a triangle in the place of the `best` so far if it is nearer and counts; its
    /// distance then.
    #[inline(always)]
    fn meet(
        &self,
        plane: &TrianglePlane,
        ray: LocalRay,
        start: f64,
        ignored: Option<usize>,
        counts: impl Fn(&Hit) -> bool,
        best: &mut Option<Hit>,
    ) -> Option<f64> {
        let hit = plane.nearer(ray, start, ignored, *best)?;
        if !self.is_solid(&hit) || !counts(&hit) {
            return None;
        }
        *best = Some(hit);
        Some(hit.distance)
    }

    /// The same for many `directions` from one point, which is faster: calls `visit` with each
    /// direction and its hit, in their order.
    pub fn closest_hits(
        &self,
        from: DVec3,
        directions: impl Iterator<Item = DVec3>,
        start: f64,
        ignored: Option<usize>,
        mut visit: impl FnMut(DVec3, Option<Hit>),
    ) {
        let mut directions = directions.peekable();
        let mut stream = Stream::default();
        while directions.peek().is_some() {
            stream.directions = directions.by_ref().take(MAX_STREAM).collect();
            dispatch!(self.level, simd => {
                self.trace_stream(simd, from, &mut stream, start, ignored);
            });
            let Stream { directions, hits, .. } = &stream;
            directions.iter().zip(hits).for_each(|(&direction, &hit)| visit(direction, hit));
        }
    }

    /// Finds the nearest hits of a `stream` from one point.
    #[inline(always)]
    fn trace_stream<S: Simd>(
        &self,
        simd: S,
        from: DVec3,
        stream: &mut Stream,
        start: f64,
        ignored: Option<usize>,
    ) {
        let Stream { directions, hits, rays, lengths, open, at_instances } = stream;
        hits.clear();
        rays.clear();
        lengths.clear();
        for &direction in &*directions {
            let (ray, length) = self.triangles.unit.ray(from, direction, start..f64::INFINITY);
            hits.push(None);
            rays.push(ray);
            lengths.push(length);
        }
        self.triangles.trace_stream(
            simd,
            triangle_bvh::Stream { rays, lengths, open },
            #[inline(always)]
            |ray, plane| {
                let there = LocalRay { from, direction: directions[ray], first: 0 };
                self.meet(plane, there, start, ignored, |_| true, &mut hits[ray])
            },
        );
        let Some(instances) = &self.instances else { return };
        at_instances.ends = hits.iter().map(|&hit| end_at(hit)).collect();
        instances.trace_stream(
            simd,
            (from, directions),
            start,
            at_instances,
            #[inline(always)]
            |ray, plane, there| self.meet(plane, there, start, ignored, |_| true, &mut hits[ray]),
        );
    }

    /// Whether any hit for which `counts` is true lies along `direction` (any length) from `from`,
    /// within `reach` in units of it.
    pub fn occluded(
        &self,
        from: DVec3,
        direction: DVec3,
        reach: Range<f64>,
        counts: impl FnMut(&Hit) -> bool,
    ) -> bool {
        dispatch!(self.level, simd => self.occluded_with(simd, (from, direction), reach, counts))
    }

    #[inline(always)]
    fn occluded_with<S: Simd>(
        &self,
        simd: S,
        (from, direction): (DVec3, DVec3),
        reach: Range<f64>,
        mut counts: impl FnMut(&Hit) -> bool,
    ) -> bool {
        let mut blocked = false;
        self.triangles.trace(simd, (from, direction), reach.clone(), |plane| {
            let hit = plane.intersect(from, direction, reach.clone());
            blocked |= hit.is_some_and(|hit| self.is_solid(&hit) && counts(&hit));
            // Ends the traversal.
            blocked.then_some(f64::NEG_INFINITY)
        });
        let Some(instances) = self.instances.as_ref().filter(|_| !blocked) else { return blocked };
        instances.trace(simd, (from, direction), reach.clone(), |plane, ray| {
            let hit = plane.intersect(ray.from, ray.direction, reach.clone());
            blocked |= hit.is_some_and(|mut hit| {
                hit.triangle += ray.first as usize;
                self.is_solid(&hit) && counts(&hit)
            });
            blocked.then_some(f64::NEG_INFINITY)
        });
        blocked
    }

    /// The triangles of `scene`, stored once for groups that are images of one another; `None`
    /// where there are few of these.
    #[cfg(test)]
    pub fn of_instances(scene: &Scene) -> Option<RayScene> {
        let rays = RayScene::with_instances(scene, |_| true, 1);
        rays.instances.is_some().then_some(rays)
    }

    /// Whether a hit is in no hole.
    #[inline(always)]
    fn is_solid(&self, hit: &Hit) -> bool {
        let is_solid = |holes: &CutOuts| holes.is_solid(hit.triangle, [hit.u, hit.v]);
        self.cut_outs.as_ref().is_none_or(is_solid)
    }
}

/// Where a ray ends that has this nearest hit, in units of its direction.
#[inline(always)]
fn end_at(hit: Option<Hit>) -> f64 {
    hit.map_or(f64::INFINITY, |hit| hit.distance)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, Rgb, Specular, Triangle};

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

    /// Difficult triangles for a hierarchy: edges 1e-6 to 1 of the scene, slivers, a grid with
    /// shared sides, nested ones down to 1e-30, coinciding ones.
    fn hard_triangles() -> Vec<[DVec3; 3]> {
        let mut random = fastrand::Rng::with_seed(1);
        let mut random_point = || DVec3::from_array([(); 3].map(|_| random.f64()));
        let mut triangles = vec![];
        for k in 0..60 {
            let (corner, size) = (random_point(), 0.1f64.powi(k % 7));
            let [a, b] = [random_point(), random_point()].map(|p| corner + size * (p - 0.5));
            triangles.extend([[corner, a, b], [corner, a, a.lerp(b, 1e-7)]]);
        }
        let grid = |x: usize, y: usize| DVec3::new(x as f64 / 6.0, y as f64 / 6.0, 0.5);
        for (x, y) in (0..36).map(|k| (k % 6, k / 6)) {
            let [a, b, c, d] = [grid(x, y), grid(x + 1, y), grid(x + 1, y + 1), grid(x, y + 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
        let corners = [DVec3::ZERO, DVec3::X, DVec3::new(0.0, 1.0, 0.3)];
        triangles.extend((0..100).map(|k| corners.map(|corner| corner * 0.5f64.powi(k))));
        triangles.extend([corners; 20]);
        triangles
    }

    /// Sets of vector instructions that this machine has.
    fn levels() -> Vec<Level> {
        let best = Level::new();
        let mut levels = vec![best, Level::baseline()];
        #[cfg(target_arch = "x86_64")]
        {
            levels.extend(best.as_sse4_2().map(Simd::level));
            levels.extend(best.as_avx2().map(Simd::level));
        }
        levels
    }

    #[test]
    fn the_hierarchy_changes_no_hit_by_any_instructions() {
        for level in levels() {
            the_hierarchy_changes_no_hit(level);
        }
    }

    fn the_hierarchy_changes_no_hit(level: Level) {
        let hard = hard_triangles();
        for (scale, offset) in [(1.0, DVec3::ZERO), (1e-30, DVec3::ZERO), (1e3, DVec3::splat(1e7))]
        {
            let at = |p: DVec3| scale * p + offset;
            let rays = RayScene::new(hard.iter().map(|corners| corners.map(at)));
            let rays = RayScene { level, ..rays };
            let mut random = fastrand::Rng::with_seed(2);
            let mut hits = 0;
            for k in 0..200 {
                let mut on_triangle = |k: usize| {
                    // Corners, points on sides, and points anywhere.
                    let [a, b, c] = hard[random.usize(..hard.len())];
                    let (u, v) = (random.f64(), random.f64());
                    [a, a.lerp(b, u), a + (b - a) * u + (c - a) * v * (1.0 - u)][k % 3]
                };
                let from = at(on_triangle(k) + DVec3::Z * [0.0, 0.25, 2.0][k / 3 % 3]);
                let mut directions: Vec<DVec3> =
                    (0..70).map(|k| at(on_triangle(k)) - from).collect();
                directions.extend(DVec3::AXES.map(|axis| -axis));
                let start = [0.0, 1e-9, -1e-3][k % 3];
                let brute = |&direction: &DVec3| {
                    let nearer = |best, plane: &TrianglePlane| {
                        let ray = LocalRay { from, direction, first: 0 };
                        plane.nearer(ray, start, None, best).or(best)
                    };
                    rays.triangles.triangles.iter().fold(None, nearer)
                };
                let mut each = directions.iter();
                rays.closest_hits(from, directions.iter().copied(), start, None, |d, hit| {
                    let wanted = brute(&d);
                    assert_eq!((Some(&d), hit), (each.next(), wanted), "{from} {d} {start}");
                    assert_eq!(rays.closest_hit(from, d, start, None), wanted, "{from} {d}");
                    hits += usize::from(hit.is_some());
                    let end = wanted.map_or(0.5, |hit| hit.distance);
                    for reach in [start..end, start..0.999 * end, end..1.0] {
                        let blocks =
                            |plane: &TrianglePlane| plane.intersect(from, d, reach.clone());
                        let blocked =
                            rays.triangles.triangles.iter().any(|plane| blocks(plane).is_some());
                        assert_eq!(rays.occluded(from, d, reach, |_| true), blocked, "{from} {d}");
                    }
                });
                assert!(each.next().is_none());
            }
            println!("{level:?}: {hits} hits");
            assert!(hits > 10_000);
        }
    }

    #[test]
    fn nothing_is_met_where_nothing_is() {
        let rays = RayScene::new(std::iter::empty());
        assert_eq!(rays.closest_hit(DVec3::ZERO, DVec3::X, 0.0, None), None);
        rays.closest_hits(DVec3::ZERO, [DVec3::X, DVec3::Y].into_iter(), 0.0, None, |_, hit| {
            assert_eq!(hit, None);
        });
    }

    #[test]
    fn a_scene_has_one_hierarchy() {
        let at = |z: f64| [DVec3::new(0., 0., z), DVec3::new(1., 0., z), DVec3::new(0., 1., z)];
        let triangle = Triangle { corners: [0, 1, 2], ..Default::default() };
        let grey = vec![Material::grey("grey", 0.5)];
        let scene = Scene::new(at(1.0).to_vec(), vec![triangle], vec!["all".into()], grey).unwrap();
        let rays = RayScene::of_scene(&scene);
        assert!(Arc::ptr_eq(&rays, &RayScene::of_scene(&scene)));
        // As have all scenes of this shape.
        let black = scene.with_materials(vec![Material::grey("black", 0.0)]).unwrap();
        for alike in [scene.with_crease_degrees(1.0), black, scene.resolve_sides()] {
            assert!(Arc::ptr_eq(&rays, &RayScene::of_scene(&alike)));
        }
        let glass = Specular::Glass { refractive_index: 1.5, transmittance: Rgb::ONE };
        let clear = Material { specular: Some(glass), ..Material::grey("clear", 0.0) };
        let changed = scene.with_materials(vec![clear]).unwrap();
        let meets = |rays: &RayScene| {
            rays.closest_hit(DVec3::new(0.2, 0.3, 0.0), DVec3::Z, 0.0, None).is_some()
        };
        assert!(meets(&rays) && !meets(&RayScene::of_scene(&changed)));
    }
}
