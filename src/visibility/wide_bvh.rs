//! The bounding volume hierarchy for rays: eight-wide, with leaves of any kind.
//!
//! ```text
//! boxes ──► binary tree of boxes ──► nodes of eight boxes ──► leaves: triangles (triangle_bvh)
//!           (sah_tree)               tested at once (ray32)           or repeated groups (places)
//! ```
//!
//! A step down costs the latency of the one before and an unpredictable branch, far more than its
//! arithmetic; so nodes are wide and few (Dammertz, Hanika, Keller 2008; Wald, Benthin, Boulos
//! 2008). Both tests are in 32 bits and conservative: candidates go to the exact test.

use std::ops::Range;

use arrayvec::ArrayVec;
use fearless_simd::{Simd, SimdBase};

use super::collapse::{Collapse, WIDTH};
use super::ray32::{BoxPlanes, Lanes, Ray32, planes_from, splat};
use super::sah_tree::{MAX_LEVELS, SahTree};

#[derive(Debug)]
pub(super) struct WideBvh {
    /// The root first.
    pub nodes: Vec<WideNode>,
}

/// What rays do where they reach a leaf.
pub(super) trait Visit<S: Simd> {
    /// One ray, which may be given a nearer end.
    fn ray(&mut self, simd: S, leaf: usize, index: usize, ray: &mut Ray32);

    /// Those of a stream of `rays` that are `active`, by their indices.
    fn stream(&mut self, simd: S, leaf: usize, active: &[u8], rays: &mut [Ray32]);
}

#[derive(Debug)]
pub(super) struct WideNode {
    pub planes: BoxPlanes,
    /// Unused ones of the eight are leaf 0 in boxes that no ray hits.
    pub children: [Child; WIDTH],
}

/// The index of a node, or of a leaf with the highest bit set.
#[derive(Clone, Copy, Debug)]
pub(super) struct Child(u32);

pub(super) enum ChildKind {
    Node(usize),
    Leaf(usize),
}

impl Child {
    const LEAF: u32 = 1 << 31;

    pub const ROOT: Child = Child(0);

    const NOTHING: Child = Child(Child::LEAF);

    #[inline(always)]
    pub fn kind(self) -> ChildKind {
        match self.0 & Child::LEAF {
            0 => ChildKind::Node(self.0 as usize),
            _ => ChildKind::Leaf((self.0 & !Child::LEAF) as usize),
        }
    }
}

impl WideBvh {
    /// Built from the boxes of `tree`. `leaf` makes each of its leaves, of a range of the boxes in
    /// the order of the tree: the first, number 0, of none, and the others in the order of their
    /// numbers.
    pub fn new(tree: &SahTree, mut leaf: impl FnMut(Range<usize>)) -> WideBvh {
        let mut bvh = WideBvh { nodes: vec![] };
        leaf(0..0);
        let mut leaves = 1;
        let mut add_leaf = |items| {
            leaf(items);
            leaves += 1;
            Child(Child::LEAF | (leaves - 1))
        };
        bvh.add(tree, &Collapse::new(tree), 0, &mut add_leaf);
        bvh.nodes.shrink_to_fit();
        bvh
    }

    /// Adds the node at the tree's `root` and all below; returns its index. At most as deep as the
    /// tree.
    fn add(
        &mut self,
        tree: &SahTree,
        collapse: &Collapse,
        root: usize,
        leaf: &mut impl FnMut(Range<usize>) -> Child,
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
                self.add(tree, collapse, child, leaf)
            } else {
                leaf(node.items.clone())
            };
        }
        Child(number as u32)
    }

    /// Visits each leaf below `root` that `ray`, of this `index` for the visitor, may reach before
    /// its end, approximately front to back.
    #[inline(always)]
    pub fn trace<S: Simd>(
        &self,
        simd: S,
        root: Child,
        (index, ray): (usize, &mut Ray32),
        visitor: &mut impl Visit<S>,
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
                ChildKind::Leaf(leaf) => visitor.ray(simd, leaf, index, ray),
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
