//! A binary tree of boxes by the surface area heuristic, with a depth limit for any input.
//!
//! ```text
//! boxes ──► splits with the least expected number of hits ──► leaves of at most four
//!           at most 31 levels; halves where the heuristic
//!           does not discriminate or levels run out
//! ```
//!
//! Bottom-up merging takes quadratic time, and yields a chain deeper than the stack where thousands
//! of boxes coincide or are nested; so the tree is built top-down.

use std::ops::Range;

use glam::Vec3A;

/// Maximum number of levels below the root: enough to halve any number of boxes that fits in 32
/// bits.
pub(crate) const MAX_LEVELS: u32 = 31;

/// Maximum number of boxes in a leaf: the triangles of one pack, four 32-bit lanes.
pub(super) const MAX_LEAF_SIZE: usize = 4;

/// Maximum number of bins along an axis, between which splits are tried: one per box. Plain choice;
/// no recorded measurement.
const SAH_BINS: usize = 32;

/// An axis-aligned box in 32 bits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Aabb32 {
    pub low: Vec3A,
    pub high: Vec3A,
}

impl Aabb32 {
    const EMPTY: Aabb32 = Aabb32 { low: Vec3A::INFINITY, high: Vec3A::NEG_INFINITY };

    fn union(&self, other: &Aabb32) -> Aabb32 {
        Aabb32 { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    fn size(&self) -> Vec3A {
        self.high - self.low
    }

    fn centre(&self) -> Vec3A {
        0.5 * (self.low + self.high)
    }

    pub fn half_area(&self) -> f32 {
        let size = self.size();
        size.x * size.y + size.y * size.z + size.z * size.x
    }
}

/// A binary tree over indices of boxes.
#[derive(Debug)]
pub(crate) struct SahTree {
    /// All boxes; those of a node are contiguous.
    pub order: Vec<u32>,
    /// The root first; parents before their children. One empty leaf if there are no boxes.
    pub nodes: Vec<SahNode>,
}

#[derive(Clone, Debug)]
pub(crate) struct SahNode {
    /// Bounds of all boxes below.
    pub bounds: Aabb32,
    /// Range of the boxes below in the order.
    pub items: Range<usize>,
    /// The first of two adjacent children; `None` for a leaf.
    pub children: Option<usize>,
}

impl SahTree {
    /// Splits `boxes` by the surface area heuristic (Wald 2007, "On fast Construction of SAH-based
    /// Bounding Volume Hierarchies", sections 3.1 to 3.3), and into halves where it does not
    /// discriminate, or levels run out. That takes n log n time even if all boxes coincide or are
    /// nested.
    pub fn new(boxes: &[Aabb32]) -> SahTree {
        SahTree::with_leaves(boxes, MAX_LEAF_SIZE)
    }

    /// The same with at most so many boxes in a leaf, where levels do not run out.
    pub fn with_leaves(boxes: &[Aabb32], leaf_size: usize) -> SahTree {
        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        let nodes = nodes_over(boxes, &mut order, MAX_LEVELS, leaf_size);
        SahTree { order, nodes }
    }
}

/// The nodes over boxes in this `order`, which is changed; at most `levels` below the root.
fn nodes_over(boxes: &[Aabb32], order: &mut [u32], levels: u32, leaf_size: usize) -> Vec<SahNode> {
    let mut nodes = vec![SahNode::over(boxes, order, 0..order.len())];
    // Parallel tasks; results do not depend on their size.
    if order.len() > 4096 {
        let (half, _) = split(boxes, order, levels - 1);
        let (first, second) = order.split_at_mut(half);
        let below = |part| nodes_over(boxes, part, levels - 1, leaf_size);
        let (mut first, mut second) = rayon::join(|| below(first), || below(second));
        // Both roots are adjacent, followed by the nodes below each.
        first.iter_mut().for_each(|node| node.shift(0, 2));
        second.iter_mut().for_each(|node| node.shift(half, first.len() + 1));
        nodes[0].children = Some(1);
        nodes.extend(first.drain(..1).chain(second.drain(..1)));
        nodes.append(&mut first);
        nodes.append(&mut second);
        return nodes;
    }
    let mut open = vec![(0, levels)];
    while let Some((node, levels)) = open.pop() {
        let SahNode { bounds, items, .. } = nodes[node].clone();
        if items.len() < 2 {
            continue;
        }
        let (half, cost) = split(boxes, &mut order[items.clone()], levels - 1);
        let saved = items.len() as f32 * bounds.half_area() - cost;
        // A step down costs two tests of a triangle: a few boxes stay together in a leaf where a
        // split saves less. Of 0, 1, 2, 3, 4, 8 and 100 the best in rooms of 32 to 128 000
        // triangles, or within 3 % of it.
        if items.len() <= leaf_size && saved <= 2.0 * bounds.half_area() {
            continue;
        }
        let (first, middle) = (nodes.len(), items.start + half);
        nodes[node].children = Some(first);
        nodes.push(SahNode::over(boxes, order, items.start..middle));
        nodes.push(SahNode::over(boxes, order, middle..items.end));
        open.extend([(first, levels - 1), (first + 1, levels - 1)]);
    }
    nodes
}

impl SahNode {
    fn over(boxes: &[Aabb32], order: &[u32], items: Range<usize>) -> SahNode {
        let part = order[items.clone()].iter().map(|&k| &boxes[k as usize]);
        let bounds = part.fold(Aabb32::EMPTY, |all, item| all.union(item));
        SahNode { bounds, items, children: None }
    }

    /// Shifts the ranges by this number of items and nodes that precede those of its tree.
    fn shift(&mut self, items: usize, nodes: usize) {
        self.items = self.items.start + items..self.items.end + items;
        self.children = self.children.map(|first| first + nodes);
    }
}

/// Reorders `part` of the boxes into two parts, neither of which needs more than `levels`. Returns
/// the end of the first and the expected cost, see [`SahBin::cost`]; the split is a halving if the
/// heuristic does not discriminate.
fn split(boxes: &[Aabb32], part: &mut [u32], levels: u32) -> (usize, f32) {
    let half = part.len() / 2;
    if let &mut [a, b] = part {
        return (half, boxes[a as usize].half_area() + boxes[b as usize].half_area());
    }
    let centre = |k: u32| boxes[k as usize].centre();
    let around = |all: Aabb32, &k: &u32| all.union(&Aabb32 { low: centre(k), high: centre(k) });
    let centres = part.iter().fold(Aabb32::EMPTY, around);
    let bins = part.len().min(SAH_BINS);
    let scale = bins as f32 / centres.size();
    // If all centres coincide along an axis, NaN makes that bin 0.
    let bin = |k: u32| {
        let position = ((centre(k) - centres.low) * scale).to_array();
        position.map(|x| (x as usize).min(bins - 1))
    };
    match best_sah_split(boxes, part, (bins, &bin), levels) {
        (cost, Some((axis, end))) => {
            let mut middle = 0;
            for i in 0..part.len() {
                if bin(part[i])[axis] < end {
                    part.swap(i, middle);
                    middle += 1;
                }
            }
            (middle, cost)
        }
        (_, None) => {
            let axis = centres.size().max_position();
            let along = |&k: &u32| centre(k)[axis];
            part.select_nth_unstable_by(half, |a, b| along(a).total_cmp(&along(b)));
            (half, f32::INFINITY)
        }
    }
}

/// The axis and the first bin of the second part with the minimum expected cost, and that cost, see
/// [`SahBin::cost`]. `bin` gives the bin of a box along each axis, of their number `count`.
fn best_sah_split(
    boxes: &[Aabb32],
    part: &[u32],
    (count, bin): (usize, &impl Fn(u32) -> [usize; 3]),
    levels: u32,
) -> (f32, Option<(usize, usize)>) {
    let mut bins = [[SahBin::EMPTY; SAH_BINS]; 3];
    for &k in part {
        for (bins, bin) in bins.iter_mut().zip(bin(k)) {
            bins[bin].add(1, &boxes[k as usize]);
        }
    }
    let mut best = (f32::INFINITY, None);
    for (axis, bins) in bins.iter().enumerate() {
        let bins = &bins[..count];
        let mut behind = [SahBin::EMPTY; SAH_BINS];
        behind[..count].copy_from_slice(bins);
        for k in (1..count).rev() {
            let SahBin { count, bounds } = behind[k];
            behind[k - 1].add(count, &bounds);
        }
        let mut before = SahBin::EMPTY;
        for end in 1..count {
            before.add(bins[end - 1].count, &bins[end - 1].bounds);
            let cost = before.cost() + behind[end].cost();
            let within = |part: &SahBin| part.count > 0 && part.levels() <= levels;
            if within(&before) && within(&behind[end]) && cost < best.0 {
                best = (cost, Some((axis, end)));
            }
        }
    }
    best
}

/// A number of boxes and their bounds.
#[derive(Clone, Copy)]
struct SahBin {
    count: usize,
    bounds: Aabb32,
}

impl SahBin {
    const EMPTY: SahBin = SahBin { count: 0, bounds: Aabb32::EMPTY };

    fn add(&mut self, count: usize, bounds: &Aabb32) {
        self.count += count;
        self.bounds = self.bounds.union(bounds);
    }

    /// Expected number of boxes that a ray hits, times half the area of the bounds of the whole.
    fn cost(&self) -> f32 {
        self.count as f32 * self.bounds.half_area()
    }

    /// Number of levels of repeated halving.
    fn levels(&self) -> u32 {
        self.count.next_power_of_two().ilog2()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3a;

    /// Levels below the root. Parents come before their children.
    fn depth(tree: &SahTree) -> u32 {
        let mut depths = vec![0; tree.nodes.len()];
        for (k, node) in tree.nodes.iter().enumerate() {
            if let Some(first) = node.children {
                let below = depths[k] + 1;
                depths[first..][..2].fill(below);
            }
        }
        depths.into_iter().max().unwrap_or(0)
    }

    #[test]
    fn crowds_give_shallow_trees() {
        let n = 100_000;
        let at = |low: Vec3A, size: f32| Aabb32 { low, high: low + size };
        let turned = |k: usize| vec3a((k as f32).cos(), (k as f32).sin(), 0.0);
        let fan = |k| Aabb32 { low: Vec3A::ZERO.min(turned(k)), high: Vec3A::ZERO.max(turned(k)) };
        let crowds: [(&str, &dyn Fn(usize) -> Aabb32); 5] = [
            ("the same", &|_| at(Vec3A::ZERO, 1.0)),
            ("one in the other", &|k| at(Vec3A::ZERO, 1.0 - k as f32 / n as f32)),
            ("halved again and again", &|k| at(Vec3A::ZERO, 0.5f32.powi(k as i32 % 100))),
            ("a fan", &fan),
            ("a row", &|k| at(Vec3A::X * k as f32, 1.0)),
        ];
        for (what, crowd) in crowds {
            let boxes: Vec<Aabb32> = (0..n).map(crowd).collect();
            let tree = SahTree::new(&boxes);
            let mut there = tree.order.clone();
            there.sort_unstable();
            assert!(there.iter().copied().eq(0..n as u32), "{what}");
            let leaves = tree.nodes.iter().filter(|node| node.children.is_none());
            assert!(leaves.clone().all(|leaf| leaf.items.len() <= MAX_LEAF_SIZE), "{what}");
            assert_eq!(leaves.map(|leaf| leaf.items.len()).sum::<usize>(), n, "{what}");
            let depth = depth(&tree);
            println!("{what}: {depth}");
            assert!(depth <= MAX_LEVELS, "{what}: {depth} levels");
        }
    }
}
