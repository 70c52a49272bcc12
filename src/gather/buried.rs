//! Values at buried vertices: those under something that touches their surface.
//!
//! A vertex inside a box that stands on its floor sees no light. Where its elements reach out of
//! the box, though, linear interpolation would carry its darkness there (a light or shadow leak).
//! So it gets a value extrapolated from its neighbours outside; further inside vertices keep the
//! darkness that they see:
//!
//! ```text
//!            box            1. gradients at the vertices outside, from elements all outside
//!         ┌───────┐         2. x: value + gradient · step, mean weighted by 1/distance
//!   o──o──┼─x──.──┼─o       3. .: what it gathered
//!         └───────┘
//! ```

use glam::{DMat3, DVec3};

use super::sampled_mesh::SampledMesh;
use crate::scene::Rgb;

/// An extrapolated value is at least and at most this many times that of the neighbour that it is
/// extrapolated from: gradients next to a contact are steep. Chosen by hand; no measurement kept.
const MIN_RATIO: f64 = 0.5;
const MAX_RATIO: f64 = 2.0;

/// Gives buried vertices next to others the values that these suggest.
pub(super) fn extrapolate_into_buried(samples: &mut SampledMesh) {
    if !samples.buried.contains(&true) {
        return;
    }
    let gradients = vertex_gradients(samples);
    let positions = &samples.vertices.positions;
    // For every buried vertex the sum of the values that its neighbours suggest, each over its
    // distance, and the sum of 1/distance.
    let mut sums = vec![(Rgb::ZERO, 0.0); samples.buried.len()];
    for (_, outline) in samples.vertices.outlines.iter() {
        let outline = || outline.iter().map(|&v| v as usize);
        for v in outline().filter(|&v| samples.buried[v]) {
            for w in outline().filter(|&w| !samples.buried[w]) {
                let step = positions[v] - positions[w];
                let value = samples.reflected[w];
                let extrapolated = value + gradients[w] * step;
                let value = extrapolated.clamp(value * MIN_RATIO, value * MAX_RATIO);
                sums[v].0 += value / step.length();
                sums[v].1 += 1.0 / step.length();
            }
        }
    }
    for (v, (sum, weight)) in sums.into_iter().enumerate() {
        if weight > 0.0 {
            samples.reflected[v] = sum / weight;
        }
    }
}

/// Gradient of the reflected radiosity at each vertex, W/m² per scene unit: a matrix that takes a
/// step to a change. The mean over the elements around it without buried corners, weighted by area.
fn vertex_gradients(samples: &SampledMesh) -> Vec<DMat3> {
    let mut sums = vec![(DMat3::ZERO, 0.0); samples.reflected.len()];
    for (e, corners) in samples.corners().iter().enumerate() {
        if corners.iter().any(|&v| samples.buried[v as usize]) {
            continue;
        }
        let positions = corners.map(|v| samples.vertices.positions[v as usize]);
        let values = corners.map(|v| samples.reflected[v as usize]);
        let gradient = triangle_gradient(positions, values);
        let area = samples.mesh.area(samples.mesh.element(e));
        for v in corners.map(|v| v as usize) {
            sums[v].0 += gradient * area;
            sums[v].1 += area;
        }
    }
    sums.into_iter().map(|(s, area)| if area > 0.0 { s * (1.0 / area) } else { s }).collect()
}

/// Gradient of the linear function that has `values` at the corners of a triangle.
fn triangle_gradient([a, b, c]: [DVec3; 3], [p, q, r]: [Rgb; 3]) -> DMat3 {
    let (u, v) = (b - a, c - a);
    let n = u.cross(v);
    // The dual basis of the two edges: 1 along its own edge, 0 along the other.
    let du = v.cross(n) / n.length_squared();
    let dv = n.cross(u) / n.length_squared();
    outer_product(q - p, du) + outer_product(r - p, dv)
}

fn outer_product(x: Rgb, y: DVec3) -> DMat3 {
    DMat3::from_cols(x * y.x, x * y.y, x * y.z)
}
