//! Triangles under a hierarchy of boxes, in one frame of coordinates.
//!
//! ```text
//! ray ──► hierarchy of boxes ──► packs of four triangles ──► exact test
//!         in 32 bits, wider      in 32 bits, within a margin  in 64 bits
//! ```

use std::ops::Range;

use fearless_simd::Simd;
use glam::DVec3;
use rayon::prelude::*;

use super::ray_stream::OpenChildren;
use super::ray32::{LocalUnit, Ray32, rounded_up};
use super::triangle_pack::TrianglePack;
use super::triangle_plane::TrianglePlane;
use super::triangle_tree::TriangleTree;
use super::wide_bvh::{Child, Visit, WideBvh};

/// Triangles under a hierarchy of boxes.
#[derive(Debug)]
pub(super) struct TriangleBvh {
    bvh: WideBvh,
    /// Its leaves.
    packs: Vec<TrianglePack>,
    /// In the order of the hierarchy.
    pub triangles: Vec<TrianglePlane>,
    pub unit: LocalUnit,
}

/// A stream of rays from one origin.
pub(super) struct Stream<'s> {
    /// In the unit of the hierarchy.
    pub rays: &'s mut [Ray32],
    /// Of the directions, in units of the rays' own.
    pub lengths: &'s [f64],
    pub open: &'s mut OpenChildren,
}

impl TriangleBvh {
    /// The triangles of a tree, which have these `corners`.
    pub fn new(tree: TriangleTree, corners: impl Fn(usize) -> [DVec3; 3] + Sync) -> TriangleBvh {
        let TriangleTree { tree, triangles, unit } = tree;
        let local = |k: usize| corners(triangles[k] as usize).map(|corner| unit.to_local(corner));
        let mut packs = vec![];
        let bvh = WideBvh::new(&tree, |items| {
            packs.push(TrianglePack::new(items.start, items.map(local)));
        });
        packs.shrink_to_fit();
        drop(tree);
        let plane = |&t: &u32| TrianglePlane::new(t, corners(t as usize));
        let triangles = triangles.par_iter().map(plane).collect();
        TriangleBvh { bvh, packs, triangles, unit }
    }

    /// Calls `meet` with each triangle that the ray along `direction` (any length) from `from` may
    /// hit within `reach`, in units of `direction`, approximately front to back. It may return a
    /// new end of the ray.
    #[inline(always)]
    pub fn trace<S: Simd>(
        &self,
        simd: S,
        (from, direction): (DVec3, DVec3),
        reach: Range<f64>,
        mut meet: impl FnMut(&TrianglePlane) -> Option<f64>,
    ) {
        let (mut ray, length) = self.unit.ray(from, direction, reach);
        let meet = |_, k: usize| Some(end_of(meet(&self.triangles[k])?, length));
        let visitor = &mut AtPacks { packs: &self.packs, meet };
        self.bvh.trace(simd, Child::ROOT, (0, &mut ray), visitor);
    }

    /// As [`TriangleBvh::trace`]; the ray may begin far away, where 32 bits do not resolve the
    /// triangles.
    #[inline(always)]
    pub fn trace_from_afar<S: Simd>(
        &self,
        simd: S,
        (from, direction): (DVec3, DVec3),
        Range { start, end }: Range<f64>,
        mut meet: impl FnMut(&TrianglePlane) -> Option<f64>,
    ) {
        let skipped = match self.unit.is_near(from) {
            true => 0.0,
            false => self.unit.nearest_to_centre(from, direction),
        };
        let ray = (from + skipped * direction, direction);
        let reach = start - skipped..end - skipped;
        self.trace(simd, ray, reach, |plane| Some(meet(plane)? - skipped));
    }

    /// The backs of the triangles for which `covered` is true are not hit.
    pub fn cover_backs(&mut self, covered: impl Fn(usize) -> bool) {
        for plane in &mut self.triangles {
            plane.back_is_covered = covered(plane.triangle as usize);
        }
    }

    /// The same for all rays of a `stream`, for which `meet` has their indices.
    #[inline(always)]
    pub fn trace_stream<S: Simd>(
        &self,
        simd: S,
        stream: Stream,
        mut meet: impl FnMut(usize, &TrianglePlane) -> Option<f64>,
    ) {
        let Stream { rays, lengths, open } = stream;
        let meet =
            |ray: usize, k: usize| Some(end_of(meet(ray, &self.triangles[k])?, lengths[ray]));
        let visitor = &mut AtPacks { packs: &self.packs, meet };
        self.bvh.trace_stream(simd, (rays, open), visitor);
    }
}

/// The end of a ray at a `distance` in units of its direction, of which one has this `length` in
/// 32 bits; before the ray's start if nothing further counts.
#[inline(always)]
pub(super) fn end_of(distance: f64, length: f64) -> f32 {
    match distance == f64::NEG_INFINITY {
        true => f32::NEG_INFINITY,
        false => rounded_up(distance * length),
    }
}

/// Rays at packs: `meet` has the index of the ray, and that of a triangle in the order of the tree.
struct AtPacks<'a, F> {
    packs: &'a [TrianglePack],
    meet: F,
}

impl<S: Simd, F: FnMut(usize, usize) -> Option<f32>> Visit<S> for AtPacks<'_, F> {
    #[inline(always)]
    fn ray(&mut self, simd: S, leaf: usize, index: usize, ray: &mut Ray32) {
        let pack = &self.packs[leaf];
        pack.seen_from(simd, ray.origin).trace(simd, pack.first, ray, |k| (self.meet)(index, k));
    }

    #[inline(always)]
    fn stream(&mut self, simd: S, leaf: usize, active: &[u8], rays: &mut [Ray32]) {
        let pack = &self.packs[leaf];
        // At least two are active.
        let seen = pack.seen_from(simd, rays[0].origin);
        for ray in active.iter().map(|&ray| usize::from(ray)) {
            seen.trace(simd, pack.first, &mut rays[ray], |k| (self.meet)(ray, k));
        }
    }
}
