//! Collapse of a binary tree: selects the nodes that become the children of wide ones.
//!
//! ```text
//!        ●                        ●            The expected cost of a wide node for a ray is
//!      ╱   ╲                  ╱ ╱ │ ╲          in proportion to its area. With C(n, i) for the
//!     ●     ●       ──►     a  b  c  ●         cost of the tree below n with at most i roots:
//!    ╱ ╲   ╱ ╲                      ╱ ╲
//!   a   b c   ●                    d   e       C(n, i) = min of C(left, k) + C(right, i − k),
//!            ╱ ╲                                         C(n, i − 1)
//!           d   e                              C(n, 1) = C(n, 8) + area(n)
//! ```
//!
//! Ylitie, Karras, Laine 2017, "Efficient incoherent ray traversal on GPUs through compressed wide
//! BVHs", section 3.1. Leaves are kept, so that their cost is constant.

use arrayvec::ArrayVec;

use super::sah_tree::SahTree;

/// Boxes in a wide node: two vectors of four 32-bit lanes.
pub(super) const WIDTH: usize = 8;

/// The optimal collapse below each node of a tree.
pub(super) struct Collapse {
    cuts: Vec<Cut>,
}

/// The collapse of one node's subtree, by the number of roots less one.
#[derive(Clone, Copy)]
struct Cut {
    cost: [f32; WIDTH],
    /// Maximum number of roots in the left child's part; 0 where the node itself is the root.
    left: [u8; WIDTH],
}

impl Collapse {
    pub fn new(tree: &SahTree) -> Collapse {
        let mut cuts = vec![Cut { cost: [0.0; WIDTH], left: [0; WIDTH] }; tree.nodes.len()];
        // Children come after their parents.
        for (number, node) in tree.nodes.iter().enumerate().rev() {
            if let Some(first) = node.children {
                cuts[number] = Cut::of(node.bounds.half_area(), &cuts[first], &cuts[first + 1]);
            }
        }
        Collapse { cuts }
    }

    /// The children of a wide node that replaces `root`; for a leaf the leaf alone.
    pub fn children(&self, tree: &SahTree, root: usize) -> ArrayVec<usize, WIDTH> {
        let mut children = ArrayVec::new();
        let mut open = vec![(root, WIDTH)];
        while let Some((node, roots)) = open.pop() {
            match (tree.nodes[node].children, usize::from(self.cuts[node].left[roots - 1])) {
                (Some(first), left) if left > 0 => {
                    open.extend([(first + 1, roots - left), (first, left)]);
                }
                _ => children.push(node),
            }
        }
        children
    }
}

impl Cut {
    fn of(area: f32, left: &Cut, right: &Cut) -> Cut {
        // Minimum cost of a split into `roots`, at least 2, and the number of roots of the left
        // part.
        let parted = |roots: usize| {
            let cost = |k: usize| (left.cost[k - 1] + right.cost[roots - k - 1], k);
            (1..roots).map(cost).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((0.0, 1))
        };
        let whole = parted(WIDTH).0 + area;
        let mut cut = Cut { cost: [whole; WIDTH], left: [0; WIDTH] };
        for roots in 2..=WIDTH {
            let (cost, k) = parted(roots);
            let before = cut.cost[roots - 2];
            let is_better = cost <= before;
            cut.cost[roots - 1] = if is_better { cost } else { before };
            cut.left[roots - 1] = if is_better { k as u8 } else { cut.left[roots - 2] };
        }
        cut
    }
}
