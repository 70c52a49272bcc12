//! Which boxes overlap: a tree of boxes, halved again and again.

use std::ops::Range;

use rayon::prelude::*;

use crate::geometry::aabb::Aabb;

/// A box that overlaps with more others than this is in a crowd: thousands of faces in one place.
const CROWD: usize = 256;

/// For each box, the others that it overlaps with, in no order that means anything. Two in crowds
/// are told of each other if there are at most [`CROWD`] such boxes, or if one of them is among the
/// first so many by `rank`: time and memory go with the number of boxes, not with its square.
pub(super) fn overlaps(boxes: &[Aabb], rank: impl Fn(usize) -> f64) -> Vec<Vec<u32>> {
    let tree = Tree::new(boxes);
    let others = |k: usize| {
        let mut others = vec![];
        tree.visit(boxes[k], &mut |other| {
            if other as usize != k {
                others.push(other);
            }
            others.len() <= CROWD
        });
        others
    };
    let mut out: Vec<Vec<u32>> = (0..boxes.len()).into_par_iter().map(others).collect();
    let crowded: Vec<bool> = out.iter().map(|others| others.len() > CROWD).collect();
    // Those not in crowds have found all; those in crowds hear of them, and of the first in crowds.
    let mut crowd: Vec<u32> = (0..boxes.len() as u32).filter(|&k| crowded[k as usize]).collect();
    crowd.sort_by(|&a, &b| rank(b as usize).total_cmp(&rank(a as usize)));
    let first = &crowd[..crowd.len().min(CROWD)];
    let mut is_first = vec![false; boxes.len()];
    first.iter().for_each(|&k| is_first[k as usize] = true);
    crowd.iter().for_each(|&k| out[k as usize].clear());
    for k in 0..boxes.len() {
        if !crowded[k] {
            let heard: Vec<u32> = out[k].iter().copied().filter(|&c| crowded[c as usize]).collect();
            heard.into_iter().for_each(|c| out[c as usize].push(k as u32));
            continue;
        }
        for c in first.iter().map(|&c| c as usize) {
            if c != k && boxes[k].overlaps(&boxes[c]) {
                out[k].push(c as u32);
                if !is_first[k] {
                    out[c].push(k as u32);
                }
            }
        }
    }
    out
}

/// Boxes by halves along the longest axis of their middles. The parts of node k are nodes 2k + 1
/// and 2k + 2.
struct Tree<'a> {
    boxes: &'a [Aabb],
    order: Vec<u32>,
    bounds: Vec<Aabb>,
}

/// Boxes in a leaf, at most.
const LEAF: usize = 4;

impl Tree<'_> {
    fn new(boxes: &[Aabb]) -> Tree<'_> {
        let order = (0..boxes.len() as u32).collect();
        let bounds = vec![Aabb::EMPTY; 2 * boxes.len().next_power_of_two()];
        let mut tree = Tree { boxes, order, bounds };
        tree.build(0, 0..boxes.len());
        tree
    }

    fn build(&mut self, node: usize, range: Range<usize>) {
        let part = &mut self.order[range.clone()];
        let boxes = part.iter().map(|&k| self.boxes[k as usize]);
        self.bounds[node] = boxes.fold(Aabb::EMPTY, Aabb::union);
        if range.len() <= LEAF {
            return;
        }
        let middle = |k: u32| self.boxes[k as usize].centre();
        let axis = Aabb::from_points(part.iter().map(|&k| middle(k))).longest_axis();
        let half = part.len() / 2;
        part.select_nth_unstable_by(half, |&a, &b| middle(a)[axis].total_cmp(&middle(b)[axis]));
        let half = range.start + half;
        self.build(2 * node + 1, range.start..half);
        self.build(2 * node + 2, half..range.end);
    }

    /// Calls `visit` with every box that overlaps with `with`, until it says no.
    fn visit(&self, with: Aabb, visit: &mut impl FnMut(u32) -> bool) {
        let mut open = vec![(0, 0..self.order.len())];
        while let Some((node, range)) = open.pop() {
            if !self.bounds[node].overlaps(&with) {
                continue;
            }
            if range.len() > LEAF {
                let half = range.start + range.len() / 2;
                open.push((2 * node + 1, range.start..half));
                open.push((2 * node + 2, half..range.end));
                continue;
            }
            let mut here =
                self.order[range].iter().filter(|&&k| self.boxes[k as usize].overlaps(&with));
            if !here.all(|&k| visit(k)) {
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::sampling::hash::{split_mix64_nth, unit_interval};

    const UNIT: Aabb = Aabb { low: DVec3::ZERO, high: DVec3::ONE };

    /// Cubes in a unit cube, at random.
    fn cubes(count: u32, size: f64) -> Vec<Aabb> {
        let random = |k: u32| unit_interval(split_mix64_nth(k.into()));
        let low = |k: u32| DVec3::new(random(3 * k), random(3 * k + 1), random(3 * k + 2));
        (0..count).map(|k| Aabb { low: low(k), high: low(k) + size }).collect()
    }

    fn sorted(boxes: &[Aabb]) -> Vec<Vec<u32>> {
        let mut all = overlaps(boxes, |k| -(k as f64));
        all.iter_mut().for_each(|others| others.sort_unstable());
        all
    }

    /// Every box against every other.
    fn plainly(boxes: &[Aabb]) -> Vec<Vec<u32>> {
        let others = |k: usize| {
            let touches = |&m: &usize| m != k && boxes[m].overlaps(&boxes[k]);
            (0..boxes.len()).filter(touches).map(|m| m as u32).collect()
        };
        (0..boxes.len()).map(others).collect()
    }

    #[test]
    fn all_that_overlaps_is_found() {
        for (count, size) in [(0, 0.1), (1, 0.1), (2, 2.0), (4, 0.5), (5, 0.5), (3000, 0.05)] {
            let boxes = cubes(count, size);
            assert!(sorted(&boxes) == plainly(&boxes), "{count}");
        }
    }

    #[test]
    fn what_many_stand_on_hears_of_all_of_them() {
        // Some floors, each below all the cubes, are in crowds; the cubes are not.
        let mut boxes = cubes(3000, 0.02);
        boxes.extend([UNIT; 3]);
        let all = sorted(&boxes);
        assert!(all == plainly(&boxes));
        assert!(all[3000].len() > 10 * CROWD);
    }

    #[test]
    fn a_crowd_takes_no_square() {
        const N: usize = 20_000;
        let all = sorted(&[UNIT; N]);
        // Each hears of the first 256, which hear of each.
        let expected = |k: usize| if k < CROWD { N - 1 } else { CROWD };
        assert!((0..N).all(|k| all[k].len() == expected(k)));
    }
}
