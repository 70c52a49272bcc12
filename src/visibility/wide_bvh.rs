//! The bounding volume hierarchy for rays: eight-wide, with four triangles per leaf.
//!
//! ```text
//! triangles ──► binary tree of boxes ──► nodes of eight boxes ──► leaves of four triangles
//!               (sah_tree)               tested at once (ray32)   tested at once (triangle_pack)
//! ```
//!
//! A step down costs the latency of the one before and an unpredictable branch, far more than its
//! arithmetic; so nodes are wide and few (Dammertz, Hanika, Keller 2008; Wald, Benthin, Boulos
//! 2008). Both tests are in 32 bits and conservative: candidates go to the exact test.

use arrayvec::ArrayVec;
use fearless_simd::{Simd, SimdBase};
use glam::DVec3;

use super::collapse::{Collapse, WIDTH};
use super::ray32::{BoxPlanes, Lanes, Ray32, planes_from, splat};
use super::sah_tree::{MAX_LEVELS, SahTree};
use super::triangle_pack::TrianglePack;

#[derive(Debug)]
pub(super) struct WideBvh {
    /// The root first.
    pub nodes: Vec<WideNode>,
    pub packs: Vec<TrianglePack>,
}

#[derive(Debug)]
pub(super) struct WideNode {
    pub planes: BoxPlanes,
    /// Unused ones of the eight are packs without triangles in boxes that no ray hits.
    pub children: [Child; WIDTH],
}

/// The index of a node, or of a pack with the highest bit set.
#[derive(Clone, Copy, Debug)]
pub(super) struct Child(u32);

pub(super) enum ChildKind {
    Node(usize),
    Pack(usize),
}

impl Child {
    const PACK: u32 = 1 << 31;

    pub const ROOT: Child = Child(0);

    const NOTHING: Child = Child(Child::PACK);

    #[inline(always)]
    pub fn kind(self) -> ChildKind {
        match self.0 & Child::PACK {
            0 => ChildKind::Node(self.0 as usize),
            _ => ChildKind::Pack((self.0 & !Child::PACK) as usize),
        }
    }
}

impl WideBvh {
    /// Built from the boxes of `tree`, which are those of triangles given by their corners in the
    /// hierarchy's unit.
    pub fn new(tree: &SahTree, corners: impl Fn(u32) -> [DVec3; 3]) -> WideBvh {
        let nothing = TrianglePack::new(0, std::iter::empty());
        let mut bvh = WideBvh { nodes: vec![], packs: vec![nothing] };
        bvh.add(tree, &Collapse::new(tree), 0, &corners);
        bvh
    }

    /// Adds the node at the tree's `root` and all below; returns its index. At most as deep as the
    /// tree.
    fn add(
        &mut self,
        tree: &SahTree,
        collapse: &Collapse,
        root: usize,
        corners: &impl Fn(u32) -> [DVec3; 3],
    ) -> Child {
        let number = self.nodes.len();
        let nothing = [f32::INFINITY, f32::NEG_INFINITY].map(|side| [Lanes([side; WIDTH]); 3]);
        self.nodes.push(WideNode { planes: nothing, children: [Child::NOTHING; WIDTH] });
        for (k, child) in collapse.children(tree, root).into_iter().enumerate() {
            let node = &tree.nodes[child];
            for axis in 0..3 {
                let planes = &mut self.nodes[number].planes;
                planes[0][axis].0[k] = node.bounds.low[axis];
                planes[1][axis].0[k] = node.bounds.high[axis];
            }
            self.nodes[number].children[k] = if node.children.is_some() {
                self.add(tree, collapse, child, corners)
            } else {
                let triangles = tree.order[node.items.clone()].iter().map(|&k| corners(k));
                self.packs.push(TrianglePack::new(node.items.start, triangles));
                Child(Child::PACK | (self.packs.len() - 1) as u32)
            };
        }
        Child(number as u32)
    }

    /// Calls `may_meet` with each triangle below `root` that `ray` may hit before its end, by their
    /// indices in the order of the tree, approximately front to back. It may return a new end.
    #[inline(always)]
    pub fn trace<S: Simd>(
        &self,
        simd: S,
        root: Child,
        ray: &mut Ray32,
        mut may_meet: impl FnMut(usize) -> Option<f32>,
    ) {
        let origin = splat(simd, ray.origin);
        // At most all boxes of a node per level, except the one entered.
        let mut open: ArrayVec<OpenBox, { (WIDTH - 1) * MAX_LEVELS as usize + WIDTH }> =
            ArrayVec::new();
        let mut child = root;
        loop {
            match child.kind() {
                ChildKind::Node(node) => {
                    let node = &self.nodes[node];
                    let planes = planes_from(simd, &node.planes, &origin);
                    let (mut hits, entries) = ray.meets(simd, &planes);
                    let entries = entries.to_array();
                    let mut next = || {
                        let k = hits.trailing_zeros() as usize;
                        hits &= hits.wrapping_sub(1);
                        let entry = entries.get(k)?;
                        Some(OpenBox::new(*entry, node.children[k]))
                    };
                    if let Some(mut nearest) = next() {
                        while let Some(other) = next() {
                            open.push(nearest.max(other));
                            nearest = nearest.min(other);
                        }
                        child = nearest.child();
                        continue;
                    }
                }
                ChildKind::Pack(pack) => {
                    let pack = &self.packs[pack];
                    pack.seen_from(simd, ray.origin).trace(simd, pack.first, ray, &mut may_meet);
                }
            }
            // Boxes that begin beyond the end of the ray are skipped.
            child = loop {
                match open.pop() {
                    None => return,
                    Some(nearest) if nearest.entry() <= ray.end => break nearest.child(),
                    Some(_) => {}
                }
            }
        }
    }
}

/// A box that is hit and not entered yet, ordered by entry.
#[derive(Clone, Copy, Debug, Eq, Ord, PartialEq, PartialOrd)]
struct OpenBox(u64);

impl OpenBox {
    /// The bits of non-negative floats have the order of the floats. (Negative entries come last;
    /// the order only affects speed.)
    #[inline(always)]
    fn new(entry: f32, child: Child) -> OpenBox {
        OpenBox(u64::from(entry.to_bits()) << 32 | u64::from(child.0))
    }

    #[inline(always)]
    fn entry(self) -> f32 {
        f32::from_bits((self.0 >> 32) as u32)
    }

    #[inline(always)]
    fn child(self) -> Child {
        Child(self.0 as u32)
    }
}
