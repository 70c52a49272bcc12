//! A binary tree of boxes (bounding volume hierarchy) for spatial queries.
//!
//! Items are halved until at most the size of a leaf is left, and every node has the box around its
//! items. A query descends into the nodes whose box it accepts:
//!
//! ```text
//!            ┌───────────────┐
//!            │ all items     │            order: 4 1 │ 0 3 │ 2 5
//!            └──┬─────────┬──┘                   leaf  leaf  leaf
//!        ┌──────┴──┐   ┌──┴───┐           Leaves are ranges of one order of
//!        │ 4 1 0 3 │   │ 2 5  │           items, and queries visit them in
//!        └──┬───┬──┘   └──────┘           that order.
//!          4 1  0 3
//! ```
//!
//! The caller halves the items of a node: by the middles of boxes, by other points of the items,
//! with ties broken by index or not. The order of leaves determines the order of results, and so
//! the rounding of sums over them. Rays have their own tree, see [`crate::visibility`].

use std::ops::{ControlFlow, Range};

use super::aabb::Aabb;

/// A binary tree of boxes over numbered items.
#[derive(Debug)]
pub(crate) struct Bvh {
    /// All items, those of a leaf side by side.
    order: Vec<u32>,
    /// The root first; parents before their children.
    nodes: Vec<Node>,
}

#[derive(Debug)]
struct Node {
    /// Box around all items below.
    bounds: Aabb,
    /// Range of the items below in the order.
    items: Range<usize>,
    /// Both halves, unless this is a leaf.
    children: Option<[usize; 2]>,
}

impl Bvh {
    /// A tree over `boxes`, one per item, with leaves of at most `leaf_size` items.
    ///
    /// `halve` is called with the items of an inner node and the box around them. It partitions the
    /// items at the middle, index ⌊n/2⌋, as by a median.
    pub fn new(boxes: &[Aabb], leaf_size: usize, halve: impl Fn(&mut [u32], &Aabb)) -> Bvh {
        let mut bvh = Bvh { order: (0..boxes.len() as u32).collect(), nodes: vec![] };
        if !boxes.is_empty() {
            bvh.build(0..boxes.len(), boxes, leaf_size, &halve);
        }
        bvh
    }

    /// Adds the node of these items and all below it; returns its number.
    fn build(
        &mut self,
        items: Range<usize>,
        boxes: &[Aabb],
        leaf_size: usize,
        halve: &impl Fn(&mut [u32], &Aabb),
    ) -> usize {
        let part = &mut self.order[items.clone()];
        let bounds = part.iter().map(|&k| boxes[k as usize]).fold(Aabb::EMPTY, Aabb::union);
        let node = self.nodes.len();
        if items.len() <= leaf_size {
            self.nodes.push(Node { bounds, items, children: None });
            return node;
        }
        halve(part, &bounds);
        let middle = items.start + items.len() / 2;
        self.nodes.push(Node { bounds, items: items.clone(), children: None });
        let first = self.build(items.start..middle, boxes, leaf_size, halve);
        let second = self.build(middle..items.end, boxes, leaf_size, halve);
        self.nodes[node].children = Some([first, second]);
        node
    }

    /// All items, in the order of the leaves.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// Each leaf in order: the range of its items in [`Bvh::order`], and the box around them.
    pub fn leaves(&self) -> impl Iterator<Item = (Range<usize>, &Aabb)> {
        let leaves = self.nodes.iter().filter(|node| node.children.is_none());
        leaves.map(|node| (node.items.clone(), &node.bounds))
    }

    /// Calls `visit`, in the order of the leaves, with every item of each leaf that is reached
    /// through nodes whose box `enters` accepts, until it breaks. Items' own boxes are not tested.
    pub fn visit(
        &self,
        enters: impl Fn(&Aabb) -> bool,
        mut visit: impl FnMut(u32) -> ControlFlow<()>,
    ) {
        let mut open = vec![];
        if !self.nodes.is_empty() {
            open.push(0);
        }
        while let Some(node) = open.pop() {
            let Node { bounds, items, children } = &self.nodes[node];
            if !enters(bounds) {
                continue;
            }
            if let &Some([first, second]) = children {
                open.extend([second, first]);
                continue;
            }
            for &item in &self.order[items.clone()] {
                if visit(item).is_break() {
                    return;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    /// Unit cubes at random in a row of `count` units, and a tree that halves them along it.
    fn row(count: u32) -> (Vec<Aabb>, Bvh) {
        let low = |k: u32| DVec3::X * f64::from(k * 37 % count);
        let boxes: Vec<Aabb> =
            (0..count).map(|k| Aabb { low: low(k), high: low(k) + 1.0 }).collect();
        let along = |&k: &u32| boxes[k as usize].low.x;
        let bvh = Bvh::new(&boxes, 3, |part, _| {
            part.sort_by(|a, b| along(a).total_cmp(&along(b)));
        });
        (boxes, bvh)
    }

    #[test]
    fn leaves_hold_every_item_once_in_order() {
        let (boxes, bvh) = row(100);
        let mut sorted = bvh.order().to_vec();
        sorted.sort_unstable();
        assert_eq!(sorted, (0..100).collect::<Vec<_>>());
        let mut next = 0;
        for (items, bounds) in bvh.leaves() {
            assert_eq!((items.start, items.len() <= 3), (next, true));
            next = items.end;
            for &k in &bvh.order()[items] {
                assert_eq!(bounds.union(boxes[k as usize]), *bounds);
            }
        }
        assert_eq!(next, 100);
    }

    #[test]
    fn visit_reaches_overlaps_and_stops() {
        let (boxes, bvh) = row(100);
        let query = Aabb { low: DVec3::X * 20.5, high: DVec3::X * 29.5 };
        let mut visited = vec![];
        bvh.visit(
            |bounds| bounds.overlaps(&query),
            |k| {
                visited.push(k);
                ControlFlow::Continue(())
            },
        );
        for k in 0..100 {
            assert!(visited.contains(&k) || !boxes[k as usize].overlaps(&query), "{k}");
        }
        // Ten overlap; a leaf at either end adds up to two more.
        assert!(visited.len() <= 14, "{}", visited.len());
        let mut visited = 0;
        bvh.visit(
            |_| true,
            |_| {
                visited += 1;
                if visited < 5 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
            },
        );
        assert_eq!(visited, 5);
        Bvh::new(&[], 4, |_, _| {}).visit(|_| true, |_| unreachable!("no items"));
    }
}
