//! Welding: one number for each distinct position.
//!
//! Positions are the same if all bits of their coordinates are, but for the sign of zero. Nothing
//! is merged within a tolerance: files repeat a shared corner to the last bit, and a tolerance
//! would tie the result to the scene's scale.

use glam::DVec3;
use rustc_hash::FxHashMap;

/// A position as the bits of its coordinates; −0 counts as 0.
pub(crate) fn position_key(position: DVec3) -> [u64; 3] {
    // −0 + 0 is 0; every other number is unchanged.
    (position + DVec3::ZERO).to_array().map(f64::to_bits)
}

/// Numbers distinct positions in the order of their first occurrence.
#[derive(Default)]
pub(crate) struct Weld {
    numbers: FxHashMap<[u64; 3], u32>,
    /// The distinct positions, by their numbers.
    pub positions: Vec<DVec3>,
}

impl Weld {
    /// The number of `position`: that of an equal earlier one, or else the next.
    pub fn number(&mut self, position: DVec3) -> u32 {
        *self.numbers.entry(position_key(position)).or_insert_with(|| {
            self.positions.push(position);
            self.positions.len() as u32 - 1
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_distinct_positions_in_order() {
        let mut weld = Weld::default();
        let zeros = [DVec3::ZERO, DVec3::X, -DVec3::ZERO, DVec3::X * (1.0 + f64::EPSILON)];
        assert_eq!(zeros.map(|p| weld.number(p)), [0, 1, 0, 2]);
        assert_eq!(weld.positions, [zeros[0], zeros[1], zeros[3]]);
    }
}
