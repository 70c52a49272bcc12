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
use rayon::prelude::*;

use super::sampled_mesh::SampledMesh;
use crate::scene::Rgb;

/// In the place of a vertex's number: it has none.
const UNNUMBERED: usize = usize::MAX;

/// Gives buried vertices next to others the values that these suggest.
pub(super) fn extrapolate_into_buried(samples: &mut SampledMesh) {
    if !samples.buried.contains(&true) {
        return;
    }
    let (buried, positions) = (&samples.buried, &samples.vertices.positions);
    // Elements with a buried vertex on their outline, and one that is not.
    let outline = |e: usize| samples.vertices.outlines.of(e).iter().map(|&v| v as usize);
    let is_on_the_way = |&e: &usize| {
        let mut inside = outline(e).map(|v| buried[v]);
        inside.next().is_some_and(|first| inside.any(|other| other != first))
    };
    let on_the_way: Vec<usize> =
        (0..samples.corners().len()).into_par_iter().filter(is_on_the_way).collect();
    // The vertices of these have numbers among themselves.
    let mut numbers = vec![UNNUMBERED; buried.len()];
    let mut vertices = vec![];
    for v in on_the_way.iter().flat_map(|&e| outline(e)) {
        if numbers[v] == UNNUMBERED {
            numbers[v] = vertices.len();
            vertices.push(v);
        }
    }
    let gradients = vertex_gradients(samples, &numbers, vertices.len());
    // For each of them that is buried the sum of the values that its neighbours suggest, each over
    // its distance, and the sum of 1/distance.
    let mut sums = vec![(Rgb::ZERO, 0.0); vertices.len()];
    for e in on_the_way {
        for v in outline(e).filter(|&v| buried[v]) {
            for w in outline(e).filter(|&w| !buried[w]) {
                let step = positions[v] - positions[w];
                let value = samples.reflected[w];
                let extrapolated = value + gradients[numbers[w]] * step;
                // Gradients next to a contact are steep, and those of slivers may overflow.
                let extrapolated = if extrapolated.is_finite() { extrapolated } else { value };
                let value = extrapolated.clamp(value * 0.5, value * 2.0);
                // Two vertices may be at one point.
                let distance = step.length().max(samples.mesh.scene().coordinate_ulp());
                let sum = &mut sums[numbers[v]];
                sum.0 += value / distance;
                sum.1 += 1.0 / distance;
            }
        }
    }
    for (v, (sum, weight)) in vertices.into_iter().zip(sums) {
        if weight > 0.0 {
            samples.reflected[v] = sum / weight;
        }
    }
}

/// Gradient of the reflected radiosity at the vertices with `numbers` below `count`, W/m² per scene
/// unit: a matrix that takes a step to a change. The mean over the elements around a vertex without
/// buried corners, weighted by area.
fn vertex_gradients(samples: &SampledMesh, numbers: &[usize], count: usize) -> Vec<DMat3> {
    let weighted = |e: usize| {
        let corners = samples.corners()[e].map(|v| v as usize);
        let is_needed = corners.iter().any(|&v| numbers[v] != UNNUMBERED);
        if !is_needed || corners.iter().any(|&v| samples.buried[v]) {
            return None;
        }
        let positions = corners.map(|v| samples.vertices.positions[v]);
        let values = corners.map(|v| samples.reflected[v]);
        let area = samples.mesh.area(samples.mesh.element(e));
        Some((corners, triangle_gradient(positions, values) * area, area))
    };
    let elements = (0..samples.corners().len()).into_par_iter();
    let weighted: Vec<([usize; 3], DMat3, f64)> = elements.filter_map(weighted).collect();
    let mut sums = vec![(DMat3::ZERO, 0.0); count];
    for (corners, gradient, area) in weighted {
        for v in corners {
            if let Some(sum) = sums.get_mut(numbers[v]) {
                sum.0 += gradient;
                sum.1 += area;
            }
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
