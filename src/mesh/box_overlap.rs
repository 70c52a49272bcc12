//! Overlapping pairs of axis-aligned boxes, in linear time even if thousands coincide.
//!
//! Each box queries a tree of boxes for its partners, and stops once it has more than
//! [`MAX_OVERLAPS`]: it is *crowded* then. Boxes that are not crowded have all of their partners,
//! and are added to those of crowded ones. Among crowded boxes only the highest-ranked are paired:
//!
//! ```text
//!                      partner not crowded   partner crowded
//! box not crowded      complete              complete
//! box crowded          complete              if one of both is among the
//!                                            MAX_OVERLAPS highest-ranked
//! ```

use std::ops::ControlFlow;

use crate::geometry::aabb::Aabb;
use crate::geometry::bvh::Bvh;
use crate::work;

/// Number of overlapping boxes above which a box is crowded: thousands of faces at one point. Plain
/// choice, well above the number at a point of an ordinary mesh; no measurement was kept.
const MAX_OVERLAPS: usize = 256;

/// For each box, the others that it overlaps, in no particular order. Pairs are complete unless
/// both boxes have more than [`MAX_OVERLAPS`] partners; of those, only pairs are given in which one
/// is among the [`MAX_OVERLAPS`] of highest `rank`. Time and memory are O(n · [`MAX_OVERLAPS`]),
/// but for the tree's O(n log n).
pub(super) fn overlapping_pairs(boxes: &[Aabb], rank: impl Fn(usize) -> f64) -> Vec<Vec<u32>> {
    let tree = tree(boxes);
    let first_partners = |k: usize| first_partners(&tree, boxes, k);
    let mut partners: Vec<Vec<u32>> = work::map(boxes.len(), first_partners);
    let crowded: Vec<bool> = partners.iter().map(|of_box| of_box.len() > MAX_OVERLAPS).collect();
    let mut ranked: Vec<u32> = (0..boxes.len() as u32).filter(|&k| crowded[k as usize]).collect();
    for &k in &ranked {
        partners[k as usize].clear();
    }
    ranked.sort_by(|&a, &b| rank(b as usize).total_cmp(&rank(a as usize)));
    ranked.truncate(MAX_OVERLAPS);
    let mut is_ranked = vec![false; boxes.len()];
    for &k in &ranked {
        is_ranked[k as usize] = true;
    }
    for k in 0..boxes.len() {
        if crowded[k] {
            pair_with_ranked(k, boxes, &ranked, &is_ranked, &mut partners);
        } else {
            tell_crowded(k, &crowded, &mut partners);
        }
    }
    partners
}

/// Boxes halved along the axis of the largest extent of their centres.
fn tree(boxes: &[Aabb]) -> Bvh {
    let centre = |&k: &u32| boxes[k as usize].centre();
    Bvh::new(boxes, 4, |part, _| {
        let axis = Aabb::from_points(part.iter().map(centre)).longest_axis();
        let half = part.len() / 2;
        part.select_nth_unstable_by(half, |a, b| centre(a)[axis].total_cmp(&centre(b)[axis]));
    })
}

/// Boxes that box `k` overlaps, up to [`MAX_OVERLAPS`] + 1 of them.
fn first_partners(tree: &Bvh, boxes: &[Aabb], k: usize) -> Vec<u32> {
    let mut partners = vec![];
    let visit = |other: u32| {
        if other as usize != k && boxes[other as usize].overlaps(&boxes[k]) {
            partners.push(other);
        }
        if partners.len() > MAX_OVERLAPS {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    };
    tree.visit(|bounds| bounds.overlaps(&boxes[k]), visit);
    partners
}

/// Adds box `k`, which is not crowded and has all of its partners, to its crowded partners.
fn tell_crowded(k: usize, crowded: &[bool], partners: &mut [Vec<u32>]) {
    let to_tell: Vec<u32> =
        partners[k].iter().copied().filter(|&other| crowded[other as usize]).collect();
    for other in to_tell {
        partners[other as usize].push(k as u32);
    }
}

/// Pairs the crowded box `k` with the crowded boxes of highest rank.
fn pair_with_ranked(
    k: usize,
    boxes: &[Aabb],
    ranked: &[u32],
    is_ranked: &[bool],
    partners: &mut [Vec<u32>],
) {
    for other in ranked.iter().map(|&other| other as usize) {
        if other != k && boxes[k].overlaps(&boxes[other]) {
            partners[k].push(other as u32);
            if !is_ranked[k] {
                partners[other].push(k as u32);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::sampling::hash::{split_mix64_nth, unit_interval};

    fn unit() -> Aabb {
        Aabb { low: DVec3::ZERO, high: DVec3::ONE }
    }

    /// Cubes in a unit cube, at random.
    fn cubes(count: u32, size: f64) -> Vec<Aabb> {
        let random = |k: u32| unit_interval(split_mix64_nth(k.into()));
        let low = |k: u32| DVec3::new(random(3 * k), random(3 * k + 1), random(3 * k + 2));
        (0..count).map(|k| Aabb { low: low(k), high: low(k) + size }).collect()
    }

    fn sorted(boxes: &[Aabb]) -> Vec<Vec<u32>> {
        let mut all = overlapping_pairs(boxes, |k| -(k as f64));
        all.iter_mut().for_each(|others| others.sort_unstable());
        all
    }

    /// Every box against every other.
    fn brute_force(boxes: &[Aabb]) -> Vec<Vec<u32>> {
        let others = |k: usize| {
            let touches = |&m: &usize| m != k && boxes[m].overlaps(&boxes[k]);
            (0..boxes.len()).filter(touches).map(|m| m as u32).collect()
        };
        (0..boxes.len()).map(others).collect()
    }

    #[test]
    fn finds_all_overlaps() {
        for (count, size) in [(0, 0.1), (1, 0.1), (2, 2.0), (4, 0.5), (5, 0.5), (3000, 0.05)] {
            let boxes = cubes(count, size);
            assert!(sorted(&boxes) == brute_force(&boxes), "{count}");
        }
    }

    #[test]
    fn crowded_boxes_find_all_others() {
        // Some floors, each below all the cubes, are in crowds; the cubes are not.
        let mut boxes = cubes(3000, 0.02);
        boxes.extend([unit(); 3]);
        let all = sorted(&boxes);
        assert!(all == brute_force(&boxes));
        assert!(all[3000].len() > 10 * MAX_OVERLAPS);
    }

    #[test]
    fn is_linear_in_crowds() {
        let n = 20_000;
        let all = sorted(&vec![unit(); n]);
        // Each is paired with the 256 of highest rank, and these with all.
        let expected = |k: usize| if k < MAX_OVERLAPS { n - 1 } else { MAX_OVERLAPS };
        assert!((0..n).all(|k| all[k].len() == expected(k)));
    }
}
