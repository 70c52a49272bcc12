//! The hierarchy of boxes for rays: eight-wide, and shallow whatever the boxes are.
//!
//! ```text
//! boxes ──► binary tree by the surface area heuristic ──► eight-wide, compressed (obvhs' CwBvh)
//!           at most 31 levels; halves where the heuristic
//!           tells nothing apart or levels run out
//! ```
//!
//! Merging neighbours from below takes quadratic time, and ends in a chain deeper than the stack,
//! where thousands of boxes are the same or lie one in the other; so the binary tree is built here.

use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, node::Bvh2Node};
use obvhs::cwbvh::{CwBvh, bvh2_to_cwbvh::bvh2_to_cwbvh};

/// Levels below the root, at most. The traversal's stack has 32 entries, one a level, and drops
/// further ones silently.
const MAX_LEVELS: u32 = 31;

/// Bins along an axis, between which a split may lie. Chosen by hand; no measurement was kept.
const SAH_BINS: usize = 32;

/// Boxes in a wide leaf, at most: what the format of `CwBvh` holds.
const MAX_LEAF_SIZE: u32 = 3;

/// A hierarchy of `boxes`.
pub(super) fn hierarchy(boxes: &[Aabb]) -> CwBvh {
    bvh2_to_cwbvh(&binary(boxes), MAX_LEAF_SIZE, true, false)
}

/// Parts boxes where rays are expected to meet the fewest of them (Wald 2007, "On fast Construction
/// of SAH-based Bounding Volume Hierarchies", sections 3.1 to 3.3), and into halves where nothing
/// tells them apart, or levels run out. That takes n log n time even if all boxes are the same, or
/// lie one in the other; merging neighbours from below takes n² then, and ends in a chain.
fn binary(boxes: &[Aabb]) -> Bvh2 {
    let mut tree = Bvh2::zeroed(boxes.len());
    let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
    let mut open = vec![(0, 0..boxes.len(), MAX_LEVELS)];
    let mut next = 1;
    while let Some((node, range, levels)) = open.pop() {
        let part = &mut order[range.clone()];
        let Some((&first, others)) = part.split_first() else { continue };
        let first = boxes[first as usize];
        let bounds = others.iter().fold(first, |all, &k| all.union(&boxes[k as usize]));
        if others.is_empty() {
            tree.nodes[node] = Bvh2Node::new(bounds, 1, range.start as u32);
            continue;
        }
        let middle = range.start + split(boxes, part, levels - 1);
        tree.nodes[node] = Bvh2Node::new(bounds, 0, next as u32);
        open.push((next, range.start..middle, levels - 1));
        open.push((next + 1, middle..range.end, levels - 1));
        next += 2;
    }
    tree.primitive_indices = order;
    tree
}

/// Reorders `part` of the boxes into two, neither of which needs more than `levels`; the first ends
/// at the number returned.
fn split(boxes: &[Aabb], part: &mut [u32], levels: u32) -> usize {
    let half = part.len() / 2;
    if part.len() == 2 {
        return half;
    }
    let centre = |k: u32| boxes[k as usize].center();
    let mut centres = Aabb::empty();
    part.iter().for_each(|&k| _ = centres.extend(centre(k)));
    let scale = SAH_BINS as f32 / centres.diagonal();
    // Where all centres are at one place of an axis, NaN makes that bin 0.
    let bin = |k: u32| ((centre(k) - centres.min) * scale).to_array().map(|x| x as usize);
    let bin = |k: u32, axis: usize| bin(k)[axis].min(SAH_BINS - 1);
    match best_sah_split(boxes, part, bin, levels) {
        Some((axis, end)) => {
            let mut middle = 0;
            for i in 0..part.len() {
                if bin(part[i], axis) < end {
                    part.swap(i, middle);
                    middle += 1;
                }
            }
            middle
        }
        None => {
            let axis = centres.largest_axis();
            let along = |&k: &u32| centre(k)[axis];
            part.select_nth_unstable_by(half, |a, b| along(a).total_cmp(&along(b)));
            half
        }
    }
}

/// The axis, and the first bin of the second part, for which a ray is expected to meet the fewest
/// boxes.
fn best_sah_split(
    boxes: &[Aabb],
    part: &[u32],
    bin: impl Fn(u32, usize) -> usize,
    levels: u32,
) -> Option<(usize, usize)> {
    let mut best = (f32::INFINITY, None);
    for axis in 0..3 {
        let mut bins = [SahBin::default(); SAH_BINS];
        part.iter().for_each(|&k| bins[bin(k, axis)].add(1, &boxes[k as usize]));
        let mut behind = bins;
        for k in (1..SAH_BINS).rev() {
            let SahBin { count, bounds } = behind[k];
            behind[k - 1].add(count, &bounds);
        }
        let mut before = SahBin::default();
        for end in 1..SAH_BINS {
            before.add(bins[end - 1].count, &bins[end - 1].bounds);
            let cost = before.cost() + behind[end].cost();
            let within = |part: &SahBin| part.count > 0 && part.levels() <= levels;
            if within(&before) && within(&behind[end]) && cost < best.0 {
                best = (cost, Some((axis, end)));
            }
        }
    }
    best.1
}

/// How many boxes, and the one around them.
#[derive(Clone, Copy)]
struct SahBin {
    count: usize,
    bounds: Aabb,
}

impl Default for SahBin {
    fn default() -> SahBin {
        SahBin { count: 0, bounds: Aabb::empty() }
    }
}

impl SahBin {
    fn add(&mut self, count: usize, bounds: &Aabb) {
        self.count += count;
        self.bounds = self.bounds.union(bounds);
    }

    /// In proportion to the boxes that a ray is expected to meet.
    fn cost(&self) -> f32 {
        self.count as f32 * self.bounds.half_area()
    }

    /// Levels that halving it over and over takes.
    fn levels(&self) -> u32 {
        self.count.next_power_of_two().ilog2()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Vec3A, vec3a};

    /// Levels below the root. Parents come before their children.
    fn depth(tree: &Bvh2) -> u32 {
        let mut depths = vec![0; tree.nodes.len()];
        for (k, node) in tree.nodes.iter().enumerate().filter(|(_, node)| !node.is_leaf()) {
            let below = depths[k] + 1;
            depths[node.first_index as usize..][..2].fill(below);
        }
        depths.into_iter().max().unwrap_or(0)
    }

    #[test]
    fn crowds_give_shallow_trees() {
        const N: usize = 100_000;
        let at = |low: Vec3A, size: f32| Aabb { min: low, max: low + size };
        let turned = |k: usize| vec3a((k as f32).cos(), (k as f32).sin(), 0.0);
        let crowds: [(&str, &dyn Fn(usize) -> Aabb); 5] = [
            ("the same", &|_| at(Vec3A::ZERO, 1.0)),
            ("one in the other", &|k| at(Vec3A::ZERO, 1.0 - k as f32 / N as f32)),
            ("halved again and again", &|k| at(Vec3A::ZERO, 0.5f32.powi(k as i32 % 100))),
            ("a fan", &|k| Aabb::from_points(&[Vec3A::ZERO, turned(k)])),
            ("a row", &|k| at(Vec3A::X * k as f32, 1.0)),
        ];
        for (what, crowd) in crowds {
            let boxes: Vec<Aabb> = (0..N).map(crowd).collect();
            let tree = binary(&boxes);
            let mut there = tree.primitive_indices.clone();
            there.sort_unstable();
            assert!(there.iter().copied().eq(0..N as u32), "{what}");
            let depth = depth(&tree);
            println!("{what}: {depth}");
            assert!(depth <= MAX_LEVELS, "{what}: {depth} levels");
        }
    }
}
