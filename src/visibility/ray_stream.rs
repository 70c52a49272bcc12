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
use fearless_simd::{Simd, SimdBase, f32x8};

use super::collapse::WIDTH;
use super::min_max::MinMax;
use super::ray32::{LoadedPlanes, Ray32, planes_from, splat};
use super::wide_bvh::{Child, ChildKind, Visit, WideBvh};

/// Maximum number of rays traced together. Their indices are bytes; twice as many are no faster per
/// ray.
pub(super) const MAX_STREAM: usize = 64;

/// Lists of indices of rays.
type Rays = ArrayVec<u8, MAX_STREAM>;

impl WideBvh {
    /// As [`WideBvh::trace`] for each of `rays`, at most [`MAX_STREAM`] from one origin.
    #[inline(always)]
    pub fn trace_stream<S: Simd>(
        &self,
        simd: S,
        (rays, open): (&mut [Ray32], &mut OpenChildren),
        visitor: &mut impl Visit<S>,
    ) {
        let Some(&Ray32 { origin, .. }) = rays.first() else { return };
        let origins = splat(simd, origin);
        open.begin_with(rays.len());
        while let Some((child, active)) = open.pop() {
            if let &[ray] = active.as_slice() {
                let ray = usize::from(ray);
                self.trace(simd, child, (ray, &mut rays[ray]), visitor);
                continue;
            }
            match child.kind() {
                ChildKind::Node(node) => {
                    let node = &self.nodes[node];
                    let planes = planes_from(simd, &node.planes, &origins);
                    let mut masks = [0_u8; MAX_STREAM];
                    let mut any = 0;
                    for (mask, &ray) in masks.iter_mut().zip(&active) {
                        let (hits, _) = rays[usize::from(ray)].meets(simd, &planes);
                        *mask = hits as u8;
                        any |= hits;
                    }
                    let distances = squared_distances(simd, &planes).to_array();
                    let mut order: ArrayVec<(u32, usize), WIDTH> = (0..WIDTH)
                        .filter(|&k| any >> k & 1 == 1)
                        .map(|k| (distances[k].to_bits(), k))
                        .collect();
                    order.sort_unstable();
                    for &(_, k) in order.iter().rev() {
                        open.push(node.children[k], &active, |ray| masks[ray] >> k & 1);
                    }
                }
                ChildKind::Leaf(leaf) => visitor.stream(simd, leaf, &active, rays),
            }
        }
    }
}

/// Children to be entered, the next at the end.
#[derive(Default)]
pub(super) struct OpenChildren {
    /// Rays that reach each child, one list after the other.
    waiting: Vec<u8>,
    /// Each with the beginning of its list.
    begins: Vec<(Child, usize)>,
}

impl OpenChildren {
    /// The root alone, which this number of `rays` reach.
    fn begin_with(&mut self, rays: usize) {
        self.waiting.clear();
        self.waiting.extend(0..rays as u8);
        self.begins.clear();
        self.begins.push((Child::ROOT, 0));
    }

    /// The next child, and the rays that reach it.
    #[inline(always)]
    fn pop(&mut self) -> Option<(Child, Rays)> {
        let (child, begin) = self.begins.pop()?;
        let mut rays = Rays::new();
        let _ = rays.try_extend_from_slice(&self.waiting[begin..]);
        self.waiting.truncate(begin);
        Some((child, rays))
    }

    /// Adds a child with those of `rays` whose `bit`, by their position among these, is 1.
    #[inline(always)]
    fn push(&mut self, child: Child, rays: &Rays, bit: impl Fn(usize) -> u8) {
        let begin = self.waiting.len();
        self.begins.push((child, begin));
        // Without a branch: hits are unpredictable.
        self.waiting.resize(begin + rays.len(), 0);
        let mut end = begin;
        for (k, &ray) in rays.iter().enumerate() {
            self.waiting[end] = ray;
            end += bit(k) as usize;
        }
        self.waiting.truncate(end);
    }
}

/// Squared distances from the origin to the boxes, whose planes are relative to it.
#[inline(always)]
fn squared_distances<S: Simd>(simd: S, [low, high]: &LoadedPlanes<S>) -> f32x8<S> {
    let none = f32x8::splat(simd, 0.0);
    let mut squares = none;
    for axis in 0..3 {
        let outside = low[axis].larger(-high[axis]).larger(none);
        squares = outside * outside + squares;
    }
    squares
}
