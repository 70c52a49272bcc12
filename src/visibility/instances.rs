//! Shapes that are in a scene many times: triangles and their hierarchy are stored once.
//!
//! ```text
//! ray ──► hierarchy of the boxes of all images ──► ray in the frame of the shape ──► its triangles
//! ```
//!
//! A map of the ray changes neither the distance to a hit, in units of the ray's direction, nor
//! where on the triangle it is.

use std::ops::Range;

use arrayvec::ArrayVec;
use fearless_simd::Simd;
use glam::{DAffine3, DVec3};

use super::ray_stream::{MAX_STREAM, OpenChildren};
use super::ray32::{LocalUnit, Ray32};
use super::repeated_groups::RepeatedGroups;
use super::sah_tree::{Aabb32, SahTree};
use super::triangle_bvh::{Stream, TriangleBvh, end_of};
use super::triangle_plane::{LocalRay, TrianglePlane};
use super::triangle_tree::TriangleTree;
use super::wide_bvh::{Child, Visit, WideBvh};
use crate::geometry::aabb::Aabb;
use crate::scene::Scene;

/// The images of shapes under a hierarchy of their boxes.
#[derive(Debug)]
pub(super) struct Instances {
    /// Triangles are numbered from the first of the shape.
    shapes: Vec<TriangleBvh>,
    /// In the order of the hierarchy.
    instances: Vec<Instance>,
    bvh: WideBvh,
    /// The instances of each of its leaves.
    leaves: Vec<Range<usize>>,
    unit: LocalUnit,
}

/// An image of a shape.
#[derive(Debug)]
struct Instance {
    shape: usize,
    /// Index of its first triangle.
    first: u32,
    /// From the scene to the shape.
    to_shape: DAffine3,
}

impl Instance {
    #[inline(always)]
    fn ray(&self, from: DVec3, direction: DVec3) -> LocalRay {
        LocalRay {
            from: self.to_shape.transform_point3(from),
            direction: self.to_shape.transform_vector3(direction),
            first: self.first,
        }
    }
}

impl Instances {
    /// The images of groups of `scene`.
    pub fn new(scene: &Scene, groups: &RepeatedGroups) -> Instances {
        let shape = |triangles: &Range<usize>| {
            let corners = |t: usize| scene.corners(triangles.start + t);
            let bounds = Aabb::from_points((0..triangles.len()).flat_map(corners));
            let all = (0..triangles.len() as u32).collect();
            let mut shape = TriangleBvh::new(TriangleTree::new(all, corners, &bounds), corners);
            shape.cover_backs(|t| scene.is_back_covered(triangles.start + t));
            shape
        };
        let unit = LocalUnit::new(&scene.bounds());
        let bounds = |triangles: &Range<usize>| {
            let Aabb { low, high } =
                Aabb::from_points(triangles.clone().flat_map(|t| scene.corners(t)));
            unit.bounds([low, high, high])
        };
        let boxes: Vec<Aabb32> = groups.images.iter().map(|i| bounds(&i.triangles)).collect();
        // A ray's way to another frame costs more than a box.
        let tree = SahTree::with_leaves(&boxes, 1);
        let mut leaves = vec![];
        let bvh = WideBvh::new(&tree, |items| leaves.push(items));
        let in_order = tree.order.iter().map(|&k| &groups.images[k as usize]);
        let instances = in_order.map(|image| Instance {
            shape: image.shape,
            first: image.triangles.start as u32,
            to_shape: image.to_shape,
        });
        Instances {
            shapes: groups.shapes.iter().map(shape).collect(),
            instances: instances.collect(),
            bvh,
            leaves,
            unit,
        }
    }

    /// Calls `meet` with each triangle that the ray along `direction` (any length) from `from` may
    /// hit within `reach`, in units of `direction`, and the ray in the frame of the triangle. It
    /// may return a new end of the ray.
    #[inline(always)]
    pub fn trace<S: Simd>(
        &self,
        simd: S,
        (from, direction): (DVec3, DVec3),
        reach: Range<f64>,
        mut meet: impl FnMut(&TrianglePlane, LocalRay) -> Option<f64>,
    ) {
        let (mut ray, length) = self.unit.ray(from, direction, reach.clone());
        let visitor = &mut AtInstances {
            all: self,
            from,
            directions: &[direction],
            lengths: &[length],
            start: reach.start,
            ends: &mut [reach.end],
            buffers: None,
            meet: |_: usize, plane: &TrianglePlane, ray: LocalRay| meet(plane, ray),
        };
        self.bvh.trace(simd, Child::ROOT, (0, &mut ray), visitor);
    }

    /// The same for many `directions` from one point, further than `start` and no further than the
    /// ends in the buffers; `meet` has the index of the direction.
    #[inline(always)]
    pub fn trace_stream<S: Simd>(
        &self,
        simd: S,
        (from, directions): (DVec3, &[DVec3]),
        start: f64,
        StreamBuffers { rays, open, lengths, ends, local }: &mut StreamBuffers,
        meet: impl FnMut(usize, &TrianglePlane, LocalRay) -> Option<f64>,
    ) {
        rays.clear();
        lengths.clear();
        for (&direction, &end) in directions.iter().zip(&*ends) {
            let (ray, length) = self.unit.ray(from, direction, start..end);
            rays.push(ray);
            lengths.push(length);
        }
        let buffers = Some(local);
        let visitor =
            &mut AtInstances { all: self, from, directions, lengths, start, ends, buffers, meet };
        self.bvh.trace_stream(simd, (rays, open), visitor);
    }
}

/// Buffers of streams, used again and again.
#[derive(Default)]
pub(super) struct StreamBuffers {
    rays: ArrayVec<Ray32, MAX_STREAM>,
    open: OpenChildren,
    lengths: ArrayVec<f64, MAX_STREAM>,
    /// Where the rays end, in units of their directions.
    pub ends: ArrayVec<f64, MAX_STREAM>,
    local: LocalStream,
}

/// A stream in the frame of an instance.
#[derive(Default)]
struct LocalStream {
    rays: ArrayVec<Ray32, MAX_STREAM>,
    open: OpenChildren,
    lengths: ArrayVec<f64, MAX_STREAM>,
    directions: ArrayVec<DVec3, MAX_STREAM>,
}

/// Rays from one point at instances.
struct AtInstances<'a, F> {
    all: &'a Instances,
    from: DVec3,
    directions: &'a [DVec3],
    /// Of the directions, in units of the rays of the hierarchy.
    lengths: &'a [f64],
    start: f64,
    /// Where the rays end so far, in units of their directions.
    ends: &'a mut [f64],
    /// None of a single ray.
    buffers: Option<&'a mut LocalStream>,
    meet: F,
}

impl<F: FnMut(usize, &TrianglePlane, LocalRay) -> Option<f64>> AtInstances<'_, F> {
    /// A ray by its index at an instance.
    #[inline(always)]
    fn one<S: Simd>(&mut self, simd: S, instance: &Instance, index: usize) {
        let AtInstances { all, from, directions, start, ends, meet, .. } = self;
        let local = instance.ray(*from, directions[index]);
        let end = &mut ends[index];
        let reach = *start..*end;
        if reach.is_empty() {
            return;
        }
        let shape = &all.shapes[instance.shape];
        shape.trace_from_afar(simd, (local.from, local.direction), reach, |plane| {
            *end = meet(index, plane, local)?;
            Some(*end)
        });
    }

    /// Several rays at an instance that they begin near.
    #[inline(always)]
    fn many<S: Simd>(&mut self, simd: S, instance: &Instance, from: DVec3, active: &[u8]) {
        let AtInstances { all, directions, start, ends, buffers, meet, .. } = self;
        let Some(LocalStream { rays, open, lengths, directions: local }) = buffers else { return };
        let shape = &all.shapes[instance.shape];
        local.clear();
        rays.clear();
        lengths.clear();
        for k in active.iter().map(|&ray| usize::from(ray)) {
            let direction = instance.to_shape.transform_vector3(directions[k]);
            let (ray, length) = shape.unit.ray(from, direction, *start..ends[k]);
            local.push(direction);
            rays.push(ray);
            lengths.push(length);
        }
        shape.trace_stream(
            simd,
            Stream { rays, lengths, open },
            #[inline(always)]
            |ray, plane| {
                let index = usize::from(active[ray]);
                let local = LocalRay { from, direction: local[ray], first: instance.first };
                ends[index] = meet(index, plane, local)?;
                Some(ends[index])
            },
        );
    }
}

impl<S: Simd, F> Visit<S> for AtInstances<'_, F>
where
    F: FnMut(usize, &TrianglePlane, LocalRay) -> Option<f64>,
{
    #[inline(always)]
    fn ray(&mut self, simd: S, leaf: usize, index: usize, ray: &mut Ray32) {
        let all = self.all;
        for instance in &all.instances[all.leaves[leaf].clone()] {
            self.one(simd, instance, index);
        }
        ray.end = end_of(self.ends[index], self.lengths[index]);
    }

    #[inline(always)]
    fn stream(&mut self, simd: S, leaf: usize, active: &[u8], rays: &mut [Ray32]) {
        let all = self.all;
        for instance in &all.instances[all.leaves[leaf].clone()] {
            let from = instance.to_shape.transform_point3(self.from);
            if all.shapes[instance.shape].unit.is_near(from) {
                self.many(simd, instance, from, active);
            } else {
                active.iter().for_each(|&ray| self.one(simd, instance, usize::from(ray)));
            }
        }
        for index in active.iter().map(|&ray| usize::from(ray)) {
            rays[index].end = end_of(self.ends[index], self.lengths[index]);
        }
    }
}

#[cfg(test)]
mod tests {
    use fastrand::Rng;
    use glam::{DMat3, DQuat};

    use super::*;
    use crate::scene::{Material, Triangle};
    use crate::visibility::ray_scene::{Hit, RayScene};

    /// Triangles of an object, and of the same object placed by these maps, each a group.
    fn placed(object: &[DVec3], maps: &[DAffine3]) -> Scene {
        let all = maps.iter().flat_map(|map| object.iter().map(|&p| map.transform_point3(p)));
        let positions: Vec<DVec3> = all.collect();
        let corners = |t: u32| [3 * t, 3 * t + 1, 3 * t + 2];
        let of_group = object.len() as u32 / 3;
        let triangle =
            |t: u32| Triangle { corners: corners(t), group: t / of_group, ..Default::default() };
        let triangles = (0..positions.len() as u32 / 3).map(triangle).collect();
        let names = (0..maps.len()).map(|k| k.to_string()).collect();
        Scene::new(positions, triangles, names, vec![Material::grey("grey", 0.5)]).unwrap()
    }

    fn random_point(random: &mut Rng) -> DVec3 {
        DVec3::from_array([(); 3].map(|()| random.f64() - 0.5))
    }

    /// Rotated, shifted within `reach` and scaled by 0.5 to 2 along three axes; every fourth is a
    /// mirror image.
    fn maps(count: usize, reach: f64, random: &mut Rng) -> Vec<DAffine3> {
        let map = |k: usize| {
            let axis = random_point(random).normalize();
            let turn = DMat3::from_quat(DQuat::from_axis_angle(axis, 7.0 * random.f64()));
            let mirror = if k % 4 == 3 { -1.0 } else { 1.0 };
            let scale = 1.25 + 1.5 * random_point(random);
            let matrix = turn * DMat3::from_diagonal(scale * DVec3::new(mirror, 1.0, 1.0));
            DAffine3::from_mat3_translation(matrix, reach * random_point(random))
        };
        (0..count).map(map).collect()
    }

    #[test]
    fn hits_are_those_without_instances() {
        let mut random = Rng::with_seed(3);
        let object: Vec<DVec3> = (0..60).map(|_| random_point(&mut random)).collect();
        // Overlapping ones, and ones that are a million sizes apart.
        for (count, reach) in [(40, 3.0), (12, 1e6)] {
            let scene = placed(&object, &maps(count, reach, &mut random));
            let groups = RepeatedGroups::of_scene(&scene, |_| true);
            // The mirror images are images of one another.
            assert_eq!((groups.shapes.len(), groups.images.len()), (2, count));
            assert_eq!(groups.saved(), 20 * (count - 2));
            let rays = RayScene::of_instances(&scene).unwrap();
            let flat = RayScene::new((0..20 * count).map(|t| scene.corners(t)));
            let mut hits = 0;
            for k in 0..300 {
                let from = match k % 3 {
                    0 => reach * random_point(&mut random),
                    // Off its plane, in which hits are rounding.
                    1 => scene.corners(k % (20 * count))[0] + 0.01 * random_point(&mut random),
                    _ => 4.0 * reach * random_point(&mut random),
                };
                let target = |random: &mut Rng| {
                    let [a, b, c] = scene.corners(random.usize(..20 * count));
                    a.lerp(b, random.f64()).lerp(c, random.f64()) - from
                };
                let directions: Vec<DVec3> = (0..64).map(|_| target(&mut random)).collect();
                let ignored = (k % 2 == 0).then(|| random.usize(..20 * count));
                let mut each = directions.iter();
                rays.closest_hits(from, directions.iter().copied(), 1e-6, ignored, |d, hit| {
                    assert_eq!(Some(&d), each.next());
                    assert_eq!(hit, rays.closest_hit(from, d, 1e-6, ignored), "{k} {d}");
                    let wanted = flat.closest_hit(from, d, 1e-6, ignored);
                    let (Some(hit), Some(wanted)) = (hit, wanted) else {
                        assert_eq!(hit, wanted);
                        return;
                    };
                    assert_eq!(
                        (hit.triangle, hit.front),
                        (wanted.triangle, wanted.front),
                        "{k} {d}"
                    );
                    // Both are off their planes by some 16 roundings of coordinates, which are up
                    // to four times those of the scene, and count for more the more slanted the
                    // ray.
                    let cosine = (scene.normal(hit.triangle).dot(d) / d.length()).abs();
                    let [a, b, c] = scene.corners(hit.triangle);
                    let at = |hit: Hit| hit.u * (b - a) + hit.v * (c - a);
                    let along = (hit.distance - wanted.distance).abs() * d.length();
                    let off = along.max(at(hit).distance(at(wanted))) * cosine;
                    assert!(off < 64.0 * scene.coordinate_ulp(), "{off:e}");
                    for end in [0.999, 1.001].map(|k| k * wanted.distance) {
                        let seen = |rays: &RayScene| {
                            let counts = |hit: &Hit| Some(hit.triangle) != ignored;
                            rays.occluded(from, d, 1e-6..end, counts)
                        };
                        assert_eq!(seen(&rays), seen(&flat), "{k} {d} {end}");
                    }
                    hits += 1;
                });
            }
            assert!(hits > 10_000, "{hits}");
        }
    }

    #[test]
    fn what_differs_is_no_image() {
        let mut random = Rng::with_seed(5);
        let object: Vec<DVec3> = (0..60).map(|_| random_point(&mut random)).collect();
        let scene = placed(&object, &maps(4, 10.0, &mut random));
        let with = |change: &dyn Fn(&mut Vec<DVec3>, &mut Vec<Triangle>)| {
            let (mut positions, mut triangles) =
                (scene.positions().to_vec(), scene.triangles().to_vec());
            change(&mut positions, &mut triangles);
            let (groups, materials) = (scene.groups().to_vec(), scene.materials().to_vec());
            let scene = Scene::new(positions, triangles, groups, materials).unwrap();
            RepeatedGroups::of_scene(&scene, |_| true).images.len()
        };
        assert_eq!(with(&|_, _| ()), 3);
        // A corner by 1e-12 of the scene; a triangle less; two triangles in the other order.
        assert_eq!(with(&|positions, _| positions[70].x += 1e-11), 2);
        assert_eq!(with(&|_, triangles| triangles.retain(|t| t.corners[0] != 75)), 2);
        assert_eq!(with(&|_, triangles| triangles.swap(22, 31)), 2);
        // A flat one fits many maps.
        let flat: Vec<DVec3> = object.iter().map(|p| p.with_z(0.0)).collect();
        let scene = placed(&flat, &maps(4, 10.0, &mut random));
        assert_eq!(RepeatedGroups::of_scene(&scene, |_| true).images.len(), 0);
    }
}
