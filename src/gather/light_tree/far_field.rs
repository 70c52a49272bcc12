//! Intensity by direction, as seen from afar: a table over an octahedron.
//!
//! ```text
//!        ●───●───●        Directions by |x| + |y| + |z| = 1, the lower half folded outwards
//!        │ ╱ │ ╲ │        (Praun and Hoppe 2003); bilinear in the cells. Values at the middles of
//!        ●───●───●        cells, which the table does not keep, measure its error.
//!        │ ╲ │ ╱ │
//!        ●───●───●
//! ```

use glam::{DVec3, Vec3};

use crate::scene::Rgb;

/// Cells along a side: even, so that the six axes are nodes.
const CELLS: usize = 8;

const NODES: usize = CELLS + 1;

/// Intensity by direction.
#[derive(Clone, Debug)]
pub(super) struct FarField {
    /// W/sr per channel, row by row.
    values: [[Vec3; NODES]; NODES],
    /// The largest error at the middle of a cell, W/sr, summed over the channels.
    pub error: f64,
    /// The largest value at a node, W/sr, summed over the channels.
    pub largest: f64,
}

/// The directions in which a table needs the intensity: at its nodes, then at the middles of cells.
pub(super) fn directions() -> impl Iterator<Item = DVec3> {
    let nodes = (0..NODES * NODES).map(|k| [k % NODES, k / NODES].map(|i| i as f64));
    let middles = (0..CELLS * CELLS).map(|k| [k % CELLS, k / CELLS].map(|i| i as f64 + 0.5));
    nodes.chain(middles).map(direction)
}

/// The unit direction at a position in units of cells.
fn direction(at: [f64; 2]) -> DVec3 {
    let [x, y] = at.map(|i| 2.0 * i / CELLS as f64 - 1.0);
    let z = 1.0 - x.abs() - y.abs();
    let below = (-z).max(0.0);
    DVec3::new(x - below.copysign(x), y - below.copysign(y), z).normalize()
}

impl FarField {
    /// A table of `samples` in the directions of [`directions`], W/sr per channel.
    pub fn new(samples: &[Rgb]) -> FarField {
        let (nodes, middles) = samples.split_at(NODES * NODES);
        let value = |j: usize, i: usize| nodes[j * NODES + i].as_vec3();
        let values = std::array::from_fn(|j| std::array::from_fn(|i| value(j, i)));
        let largest = nodes.iter().map(|value| value.element_sum()).fold(0.0, f64::max);
        let mut table = FarField { values, error: 0.0, largest };
        let error = |(k, &middle): (usize, &Rgb)| {
            let at = [k % CELLS, k / CELLS].map(|i| i as f64 + 0.5);
            (table.at(at) - middle).abs().element_sum()
        };
        table.error = middles.iter().enumerate().map(error).fold(0.0, f64::max);
        table
    }

    /// Intensity in a unit `direction`, W/sr per channel.
    pub fn intensity(&self, direction: DVec3) -> Rgb {
        let DVec3 { x, y, z } = direction / direction.abs().element_sum();
        let [x, y] = match z >= 0.0 {
            true => [x, y],
            false => [(1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y)],
        };
        self.at([x, y].map(|c| (0.5 * (c + 1.0)).clamp(0.0, 1.0) * CELLS as f64))
    }

    /// The value at a position in units of cells.
    fn at(&self, at: [f64; 2]) -> Rgb {
        let [i, j] = at.map(|c| (c as usize).min(CELLS - 1));
        let [x, y] = [at[0] - i as f64, at[1] - j as f64];
        let along = |row: &[Vec3; NODES]| row[i].as_dvec3().lerp(row[i + 1].as_dvec3(), x);
        along(&self.values[j]).lerp(along(&self.values[j + 1]), y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_exact_at_its_nodes_and_knows_its_error_between_them() {
        let intensity = |d: DVec3| Rgb::new(2.0 + d.x, d.y * d.z, d.z * d.z);
        let samples: Vec<Rgb> = directions().map(intensity).collect();
        let table = FarField::new(&samples);
        for (d, value) in directions().zip(&samples).take(NODES * NODES) {
            // Rounding of 32-bit numbers up to 3.
            assert!((table.intensity(d) - *value).abs().max_element() < 1e-6, "{d}");
        }
        // At any directions the error is hardly above that at the middles.
        let off = |k: usize| {
            let [u, v] = crate::sampling::low_discrepancy::r2_point(k, 0.3);
            let d = direction([u, v].map(|x| x * CELLS as f64));
            (table.intensity(d) - intensity(d)).abs().element_sum()
        };
        let largest = (0..4096).map(off).fold(0.0, f64::max);
        assert!(largest < 1.01 * table.error, "{largest}, not {}", table.error);
        // Chords of z² at the fold, where a cell is an eighth of a right angle wide.
        assert!(table.error < 0.2, "{}", table.error);
    }
}
