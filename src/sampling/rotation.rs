//! How far the fans and hemicubes of places are turned about their normals.

use glam::DVec3;

use crate::gather::GatherPoint;
use crate::scene::Scene;

/// CellRotation over one scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CellRotation {
    low: DVec3,
    /// Longest side of the box around the scene, its own unit.
    size: f64,
}

/// Where cells double, in powers of two: nothing in particular, so that no round number is there.
const DOUBLING: f64 = 0.377;

/// Smallest cells, in powers of two of the scene's size: for places that see what is next to them.
const SMALLEST: f64 = -40.0;

impl CellRotation {
    /// For places in `scene`.
    pub fn new(scene: &Scene) -> CellRotation {
        let (low, high) = scene.bounds();
        CellRotation { low, size: (high - low).max_element() }
    }

    /// A turn in [0, 1) that differs from place to place: a hash of the cell that it is in, 8 to 16
    /// times as large as the distance from which on it sees. However large the scene is and wherever
    /// it stands, a place has the same turn; rounding is too small to carry one to another cell, but
    /// for a few in a hundred thousand, a million sizes from the origin.
    pub fn of(&self, place: &GatherPoint) -> f64 {
        let near = (place.near / self.size).log2() + DOUBLING;
        let cells = (-(near.floor() + 3.0).max(SMALLEST)).exp2() / self.size;
        let mix = |h: u64, x: i64| {
            // The finaliser of SplitMix64 (Steele, Lea, Flood 2014).
            let mut z = (h ^ x as u64).wrapping_add(0x9e37_79b9_7f4a_7c15);
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            z ^ (z >> 31)
        };
        let cell = ((place.position - self.low) * cells).round().as_i64vec3();
        let bits = cell.to_array().into_iter().fold(0, mix);
        (bits >> 11) as f64 / (1u64 << 53) as f64
    }
}
