//! Rotations of sets of directions about the normal, from point to point.
//!
//! The same set at every point would repeat its errors as a pattern across a surface. A
//! Cranley–Patterson rotation (R. Cranley and T. N. L. Patterson 1976) shifts the azimuth of all
//! directions by a pseudo-random offset. It is hashed from the cubic cell that the point lies in,
//! so that runs repeat, and the few points of one cell share their pattern.
//!
//! ```text
//! cell edge = 5.2 to 10.4 × the point's near distance, a power of two of the scene's size
//! ┌────┬────┬────┐
//! │0.71│0.03│0.48│  offset of each cell, in turns
//! ├────┼────┼────┤
//! │0.22│0.95│0.37│
//! └────┴────┴────┘
//! ```

use glam::DVec3;

use crate::geometry::aabb::Aabb;
use crate::sampling::hash::{split_mix64, unit_interval};

/// Cranley–Patterson rotations of the azimuth, one per cell of a box.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CellRotation {
    low: DVec3,
    /// Longest side of the box, scene unit.
    size: f64,
}

/// Phase of the cell sizes, which double: a power of two. Plain choice: the cell size does not
/// change at near distances that are round fractions of the scene's size.
const DOUBLING_PHASE: f64 = 0.377;

impl CellRotation {
    /// Largest edge of a cell, in units of a point's near distance: 2^(3 + [`DOUBLING_PHASE`]).
    pub const LARGEST_CELL: f64 = 10.39;

    /// For points within `bounds`.
    pub fn new(bounds: &Aabb) -> CellRotation {
        CellRotation { low: bounds.low, size: bounds.longest_side() }
    }

    /// The offset in [0, 1), in turns, at `position` for a point that sees nothing nearer than
    /// `near` (both scene unit).
    ///
    /// Constant per cubic cell, whose edge is a power of two of the scene's size and 2^2.377 to
    /// 2^3.377 times `near`: 5.2 to 10.4. Scale and translation of the scene do not change it, up
    /// to rounding: a million scene sizes from the origin, rounding carries a few points in a
    /// hundred thousand to another cell.
    pub fn at(&self, position: DVec3, near: f64) -> f64 {
        let size_log2 = libm::log2(near / self.size) + DOUBLING_PHASE;
        // Cell numbers below 2⁴⁰ are exact.
        let cells_per_unit = libm::exp2(-(size_log2.floor() + 3.0).max(-40.0)) / self.size;
        let cell = ((position - self.low) * cells_per_unit).round().as_i64vec3();
        let mix = |hash: u64, x: i64| split_mix64(hash ^ x as u64);
        unit_interval(cell.to_array().into_iter().fold(0, mix))
    }
}

/// A second rotation, in turns, for the other coordinate: the bits of the first after its 16
/// leading ones.
pub(crate) fn second_rotation(rotation: f64) -> f64 {
    (rotation * f64::from(1u32 << 16)).fract()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit_box(scale: f64, shift: DVec3) -> CellRotation {
        CellRotation::new(&Aabb { low: shift, high: shift + scale })
    }

    #[test]
    fn rotation_is_invariant_under_scale_and_shift() {
        let shift = DVec3::new(64.0, -32.0, 16.0);
        for k in 0..100 {
            let p = DVec3::new(0.37, 0.011, 0.93) * f64::from(k) / 100.0;
            let plain = unit_box(1.0, DVec3::ZERO).at(p, 1e-3);
            assert!((0.0..1.0).contains(&plain));
            // Powers of two, and sums without rounding at this size but for the last bits.
            assert_eq!(unit_box(8.0, DVec3::ZERO).at(p * 8.0, 8e-3), plain);
            assert_eq!(unit_box(1.0, shift).at(p + shift, 1e-3), plain);
        }
    }

    #[test]
    fn rotation_is_constant_per_cell() {
        let rotation = unit_box(1.0, DVec3::ZERO);
        let at = |k: i32| rotation.at(DVec3::X * f64::from(k) / 1000.0, 1e-3);
        // 0.001 × 2^3.377 = 0.0104 and half of that bound the edge, and the power of two between is
        // 1/128: 127 whole cells and two halves.
        let mut values: Vec<f64> = (0..1000).map(at).collect();
        values.dedup();
        assert_eq!(values.len(), 129);
        assert!((3.0 + DOUBLING_PHASE).exp2() < CellRotation::LARGEST_CELL);
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        // Three standard errors of a mean of 129 values that are even in [0, 1).
        assert!((mean - 0.5).abs() < 3.0 / (12.0f64 * 129.0).sqrt(), "{mean}");
    }
}
