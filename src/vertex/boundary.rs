//! Vertices at the boundary of a smooth surface: extrapolated, since all their elements lie to one
//! side and a mean would be that of a place further in.

use std::collections::HashMap;

use glam::{DMat3, DVec3};

use super::Rims;
use crate::mesh::Mesh;
use crate::scene::Rgb;

/// Elements that a plane is fitted to, at least: three would let it swing freely.
const FEWEST: usize = 4;

/// Replaces in `radiosity` the value of every boundary vertex by that of a linear fit to the
/// elements around it and around its neighbours, weighted by area and nearness. Vertices with too
/// few elements, or all of them on a line, keep what they have. No value is let below zero.
pub(super) fn extrapolate(
    mesh: &Mesh,
    rims: &Rims,
    positions: &[DVec3],
    normals: &[DVec3],
    element_radiosity: &[Rgb],
    radiosity: &mut [Rgb],
) {
    let around = elements_around(rims, positions.len());
    for v in boundary(rims) {
        let rings = around[v].iter().flat_map(|&e| rims.of(e as usize));
        let mut near: Vec<u32> = rings.flat_map(|&w| &around[w as usize]).copied().collect();
        near.sort_unstable();
        near.dedup();
        if near.len() < FEWEST {
            continue;
        }
        let (tangent, bitangent) = normals[v].any_orthonormal_pair();
        // Normal equations of B ≈ a + g·(x − x_v) in the tangent plane; a is what is wanted.
        let (mut matrix, mut right) = (DMat3::ZERO, [Rgb::ZERO; 3]);
        for &e in &near {
            let node = mesh.element(e as usize);
            let (offset, area) = (mesh.centroid(node) - positions[v], mesh.area(node));
            let weight = area / (offset.length_squared() + area);
            let scale = 1.0 / area.sqrt();
            let x = DVec3::new(1.0, offset.dot(tangent) * scale, offset.dot(bitangent) * scale);
            matrix += DMat3::from_cols(x * x.x, x * x.y, x * x.z) * weight;
            for (k, sum) in right.iter_mut().enumerate() {
                *sum += element_radiosity[e as usize] * (x[k] * weight);
            }
        }
        let row = matrix.inverse().row(0);
        let value = right[0] * row.x + right[1] * row.y + right[2] * row.z;
        if value.is_finite() {
            radiosity[v] = value.max(Rgb::ZERO);
        }
    }
}

/// Vertices on a side that only one element has, ascending.
fn boundary(rims: &Rims) -> Vec<usize> {
    let mut sides: HashMap<(u32, u32), u32> = HashMap::new();
    for (_, rim) in rims.iter() {
        for (k, &a) in rim.iter().enumerate() {
            let b = rim[(k + 1) % rim.len()];
            *sides.entry((a.min(b), a.max(b))).or_default() += 1;
        }
    }
    let single = sides.into_iter().filter(|&(_, count)| count == 1);
    let mut vertices: Vec<usize> =
        single.flat_map(|((a, b), _)| [a as usize, b as usize]).collect();
    vertices.sort_unstable();
    vertices.dedup();
    vertices
}

/// The elements around each vertex.
fn elements_around(rims: &Rims, vertices: usize) -> Vec<Vec<u32>> {
    let mut around = vec![vec![]; vertices];
    for (e, rim) in rims.iter() {
        rim.iter().for_each(|&v| around[v as usize].push(e as u32));
    }
    around
}
