//! Many rays from one point, traced through the hierarchy together.
//!
//! ```text
//! node ── its boxes relative to the point, for all rays
//!   │       ray 0 ─► boxes 1 4 ─┐       children, the nearest      rays
//!   │       ray 1 ─► boxes 4    ├──►    4                          0 1 3
//!   │       ray 3 ─► boxes 2 4 ─┘       2                          3
//!   ▼                                   1                          0
//! next: the nearest child with its rays
//! ```
//!
//! Each box is tested against all rays that reach it, one after the other (Tsakok 2009, "Faster
//! incoherent rays: Multi-BVH ray stream tracing"): no ray waits for its own last step, and terms
//! that depend on the origin alone are computed once. Nearer boxes come first for all rays; a
//! single remaining ray is traced on its own.

use arrayvec::ArrayVec;
use glam::Vec4;

use super::collapse::WIDTH;
use super::ray32::{BoxPlanes, Ray32, splat};
use super::wide_bvh::{Child, ChildKind, WideBvh};

/// Maximum number of rays traced together. Their indices are bytes; twice as many are no faster per
/// ray.
pub(super) const MAX_STREAM: usize = 64;

/// Lists of indices of rays.
type Rays = ArrayVec<u8, MAX_STREAM>;

impl WideBvh {
    /// As [`WideBvh::trace`] for each of `rays`, at most [`MAX_STREAM`] from one origin: the first
    /// argument of `may_meet` is the index of the ray.
    #[inline(always)]
    pub fn trace_stream(
        &self,
        rays: &mut [Ray32],
        mut may_meet: impl FnMut(usize, usize) -> Option<f32>,
    ) {
        let Some(&Ray32 { origin, .. }) = rays.first() else { return };
        // Rays that reach each open child, one list after the other, and where the last ones begin.
        let mut waiting: Vec<u8> = (0..rays.len() as u8).collect();
        let mut open = vec![(Child::ROOT, 0)];
        while let Some((child, begin)) = open.pop() {
            let mut active = Rays::new();
            let _ = active.try_extend_from_slice(&waiting[begin..]);
            waiting.truncate(begin);
            if let &[ray] = active.as_slice() {
                let ray = usize::from(ray);
                self.trace(child, &mut rays[ray], |triangle| may_meet(ray, triangle));
                continue;
            }
            match child.kind() {
                ChildKind::Node(node) => {
                    let node = &self.nodes[node];
                    let (seen, distances) = seen_from(&node.planes, splat(origin));
                    let plane = |side: usize, axis: usize, half: usize| seen[side][axis][half];
                    let hit_boxes = |&ray: &u8| rays[usize::from(ray)].meets(plane).0;
                    let masks: ArrayVec<u32, MAX_STREAM> = active.iter().map(hit_boxes).collect();
                    let any = masks.iter().fold(0, |any, mask| any | mask);
                    let mut order: ArrayVec<(u32, usize), WIDTH> = (0..WIDTH)
                        .filter(|&k| any >> k & 1 == 1)
                        .map(|k| (distances.as_flattened()[k].to_bits(), k))
                        .collect();
                    order.sort_unstable();
                    for &(_, k) in order.iter().rev() {
                        let begin = waiting.len();
                        open.push((node.children[k], begin));
                        // Without a branch: hits are unpredictable.
                        waiting.resize(begin + active.len(), 0);
                        let mut end = begin;
                        for (&ray, mask) in active.iter().zip(&masks) {
                            waiting[end] = ray;
                            end += (mask >> k & 1) as usize;
                        }
                        waiting.truncate(end);
                    }
                }
                ChildKind::Pack(pack) => {
                    let pack = &self.packs[pack];
                    let seen = pack.seen_from(origin);
                    for &ray in &active {
                        let number = usize::from(ray);
                        let ray = &mut rays[number];
                        let mut lanes = seen.may_meet(ray);
                        while lanes != 0 {
                            let lane = lanes.trailing_zeros() as usize;
                            if let Some(end) = may_meet(number, pack.first as usize + lane) {
                                ray.end = end;
                            }
                            lanes &= lanes - 1;
                        }
                    }
                }
            }
        }
    }
}

/// The planes relative to `origin`, and the squared distances to their boxes.
#[inline(always)]
fn seen_from(planes: &BoxPlanes, origin: [Vec4; 3]) -> (BoxPlanes, [[f32; 4]; 2]) {
    let mut seen = *planes;
    let mut squares = [Vec4::ZERO; 2];
    for axis in 0..3 {
        for half in 0..2 {
            let [low, high] = [0, 1].map(|side| planes[side][axis][half] - origin[axis]);
            (seen[0][axis][half], seen[1][axis][half]) = (low, high);
            let outside = low.max(-high).max(Vec4::ZERO);
            squares[half] += outside * outside;
        }
    }
    (seen, squares.map(Vec4::into))
}
