//! Covered backs of triangles, and the triangles whose fronts cover them.

use rustc_hash::FxHashMap;

/// Of each triangle whose whole back is covered, the triangles whose fronts cover it: they share
/// corners with it, or with others that do. Pieces of a triangle share a list.
#[derive(Clone, Debug, Default)]
pub(super) struct Covers {
    /// By triangle, its list.
    list_of: FxHashMap<u32, u32>,
    /// Ascending.
    lists: Vec<Vec<u32>>,
}

impl Covers {
    /// Of triangles and what covers them.
    pub fn new(covered: impl Iterator<Item = (u32, Vec<u32>)>) -> Covers {
        let mut covers = Covers::default();
        for (t, mut list) in covered {
            list.sort_unstable();
            covers.list_of.insert(t, covers.lists.len() as u32);
            covers.lists.push(list);
        }
        covers
    }

    /// Whether the back of triangle `t` is covered.
    pub fn is_covered(&self, t: usize) -> bool {
        self.list_of.contains_key(&(t as u32))
    }

    /// Triangles whose fronts cover it, ascending; none if it is open.
    pub fn of(&self, t: usize) -> &[u32] {
        self.list_of.get(&(t as u32)).map_or(&[], |&list| &self.lists[list as usize])
    }

    /// The same for triangles t cut into the pieces from `firsts[t]` to `firsts[t + 1]`. All pieces
    /// of a triangle keep all pieces of its covers, which may be cut differently.
    pub fn cut(&self, firsts: &[u32]) -> Covers {
        let pieces = |t: u32| firsts[t as usize]..firsts[t as usize + 1];
        let list = |covers: &Vec<u32>| covers.iter().flat_map(|&s| pieces(s)).collect();
        let of_pieces = |(&t, &list): (&u32, &u32)| pieces(t).map(move |piece| (piece, list));
        Covers {
            list_of: self.list_of.iter().flat_map(of_pieces).collect(),
            lists: self.lists.iter().map(list).collect(),
        }
    }

    /// Of triangles that cover one another, those that come after one of theirs, ascending, and
    /// those that are covered by others alone.
    #[cfg(any(feature = "glb", test))]
    pub fn seconds(&self) -> Vec<usize> {
        // Of each list the lists of its members, or none where one is open.
        let lists_of_members: Vec<Vec<Option<u32>>> = self
            .lists
            .iter()
            .map(|members| {
                let mut lists: Vec<_> =
                    members.iter().map(|t| self.list_of.get(t).copied()).collect();
                lists.sort_unstable();
                lists.dedup();
                lists
            })
            .collect();
        let is_second = |(&s, &list): (&u32, &u32)| {
            let is_last = self.lists[list as usize].first().is_some_and(|&first| first < s);
            let covers_back = |list: &Option<u32>| {
                list.is_some_and(|list| self.lists[list as usize].binary_search(&s).is_ok())
            };
            (is_last || !lists_of_members[list as usize].iter().all(covers_back))
                .then_some(s as usize)
        };
        let mut seconds: Vec<usize> = self.list_of.iter().filter_map(is_second).collect();
        seconds.sort_unstable();
        seconds
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles 0 and 1 are one sheet, 2 and 3 its other side, cut into two and one pieces, three
    /// and one; 4 is covered by 2, which it does not cover.
    #[test]
    fn pieces_share_the_covers_of_their_triangle() {
        let covered = [(0, vec![3, 2]), (1, vec![2, 3]), (2, vec![0, 1]), (3, vec![1, 0])];
        let covers = Covers::new(covered.into_iter().chain([(4, vec![2])]));
        assert_eq!(covers.seconds(), [2, 3, 4]);
        let cut = covers.cut(&[0, 2, 3, 6, 7, 8]);
        assert_eq!((cut.of(0), cut.of(1), cut.of(2)), (&[3, 4, 5, 6][..], cut.of(0), cut.of(0)));
        assert_eq!((cut.of(5), cut.of(7)), (&[0, 1, 2][..], &[3, 4, 5][..]));
        assert_eq!(cut.seconds(), [3, 4, 5, 6, 7]);
        assert!(cut.is_covered(7) && !covers.is_covered(5) && covers.of(5).is_empty());
    }
}
