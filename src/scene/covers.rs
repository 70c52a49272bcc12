//! Which backs of triangles are covered by the fronts of others, and by which.

use rustc_hash::FxHashMap;

/// The backs that are covered, and by what.
#[derive(Clone, Debug, Default)]
pub(super) struct Covers {
    /// Per triangle, whether all of its back is covered by the fronts of others that share corners
    /// with it, or with others that do; empty where none is.
    pub is_covered: Vec<bool>,
    /// Which ones those are, of each that is covered.
    pub covers: FxHashMap<u32, Vec<u32>>,
}

impl Covers {
    /// Whether the back of triangle `t` is covered.
    pub fn is_covered(&self, t: usize) -> bool {
        self.is_covered.get(t).is_some_and(|&covered| covered)
    }

    /// Triangles whose fronts cover it.
    pub fn covers(&self, t: usize) -> &[u32] {
        self.covers.get(&(t as u32)).map_or(&[], Vec::as_slice)
    }

    /// The same where triangle t is cut into the pieces from `firsts[t]` to `firsts[t + 1]`. These
    /// are covered as it is: what covers it may be cut elsewhere.
    pub fn cut(&self, firsts: &[u32]) -> Covers {
        let pieces = |t: u32| firsts[t as usize]..firsts[t as usize + 1];
        let covered = (0..).zip(&self.is_covered).filter(|(_, is_covered)| **is_covered);
        let mut is_covered = vec![false; firsts.last().map_or(0, |&count| count as usize)];
        covered.flat_map(|(t, _)| pieces(t)).for_each(|piece| is_covered[piece as usize] = true);
        let of_pieces = |(&t, covers): (&u32, &Vec<u32>)| {
            let covers: Vec<u32> = covers.iter().flat_map(|&s| pieces(s)).collect();
            pieces(t).map(move |piece| (piece, covers.clone())).collect::<Vec<_>>()
        };
        Covers { is_covered, covers: self.covers.iter().flat_map(of_pieces).collect() }
    }
}
