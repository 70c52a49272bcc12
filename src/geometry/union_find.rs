//! Disjoint sets of the numbers 0 to n − 1 (union–find), with path halving.
//!
//! Every number starts as its own set. Joining two sets attaches the tree of the one with the
//! higher representative to the other, so that the lowest member represents its set, whatever the
//! order of joining.

/// Disjoint sets, each represented by its lowest member.
pub(crate) struct UnionFind {
    /// A member of the same set, nearer to the representative, which is its own parent.
    parent: Vec<usize>,
}

impl UnionFind {
    /// `count` sets of one member each.
    pub fn new(count: usize) -> UnionFind {
        UnionFind { parent: (0..count).collect() }
    }

    /// The lowest member of the set of `k`.
    pub fn find(&mut self, mut k: usize) -> usize {
        while self.parent[k] != k {
            self.parent[k] = self.parent[self.parent[k]];
            k = self.parent[k];
        }
        k
    }

    /// Makes the sets of `a` and `b` one.
    pub fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.find(a), self.find(b));
        self.parent[a.max(b)] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lowest_member_represents_its_set_in_any_order() {
        for order in [[(4, 2), (2, 0), (3, 5)], [(3, 5), (0, 2), (2, 4)]] {
            let mut sets = UnionFind::new(6);
            for (a, b) in order {
                sets.join(a, b);
            }
            assert_eq!([0, 1, 2, 3, 4, 5].map(|k| sets.find(k)), [0, 1, 0, 3, 0, 3]);
        }
    }
}
