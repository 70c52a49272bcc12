//! Covered backs of triangles, and the triangles whose fronts cover them.

use rustc_hash::FxHashMap;

/// Of each triangle whose whole back is covered, the triangles whose fronts cover it: they share
/// corners with it, or with others that do.
#[derive(Clone, Debug, Default)]
pub(super) struct Covers(pub FxHashMap<u32, Vec<u32>>);

impl Covers {
    /// Whether the back of triangle `t` is covered.
    pub fn is_covered(&self, t: usize) -> bool {
        self.0.contains_key(&(t as u32))
    }

    /// Triangles whose fronts cover it; none if it is open.
    pub fn of(&self, t: usize) -> &[u32] {
        self.0.get(&(t as u32)).map_or(&[], Vec::as_slice)
    }

    /// The same for triangles t cut into the pieces from `firsts[t]` to `firsts[t + 1]`. All pieces
    /// of a triangle keep all pieces of its covers, which may be cut differently.
    pub fn cut(&self, firsts: &[u32]) -> Covers {
        let pieces = |t: u32| firsts[t as usize]..firsts[t as usize + 1];
        let of_pieces = |(&t, covers): (&u32, &Vec<u32>)| {
            let covers: Vec<u32> = covers.iter().flat_map(|&s| pieces(s)).collect();
            pieces(t).map(move |piece| (piece, covers.clone())).collect::<Vec<_>>()
        };
        Covers(self.0.iter().flat_map(of_pieces).collect())
    }
}
