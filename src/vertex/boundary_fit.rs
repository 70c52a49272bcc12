//! Vertices at the boundary of a smooth surface: extrapolated, since all their elements lie to one
//! side and a mean would be that of a place further in.

use glam::{DMat3, DVec3};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::corner_singularity;
use super::keys::ElementLoops;
use crate::mesh::Mesh;
use crate::scene::Rgb;

/// Elements that a plane is fitted to, at least: three would let it swing freely.
const FEWEST: usize = 4;

/// How far the weights of a fit may be from a sum of one.
const ROUNDING: f64 = 1e-6;

/// A vertex with as many elements around it is a hub. Six are usual, and the pole of a fine sphere
/// has some hundred.
const HUB: usize = 256;

/// Replaces in `radiosity` the value of every boundary vertex by that of a linear fit to the
/// elements around it and around its neighbours, weighted by area and nearness, mended by what it
/// gets from surfaces that meet there. Vertices with too few elements, or all of them on a line,
/// keep what they have. No value is let below zero.
pub(super) fn extrapolate(
    mesh: &Mesh,
    rims: &ElementLoops,
    positions: &[DVec3],
    normals: &[DVec3],
    element_radiosity: &[Rgb],
    radiosity: &mut [Rgb],
) {
    let ends = ends(mesh, rims, positions, normals);
    let fitted = |end: &BoundaryVertex| {
        let terms = end.fit.iter().map(|&(e, weight)| element_radiosity[e as usize] * weight);
        if end.fit.is_empty() { radiosity[end.vertex] } else { terms.sum() }
    };
    let fitted: Vec<Rgb> = ends.iter().map(fitted).collect();
    let mended = corner_singularity::mend(mesh, &ends, element_radiosity, &fitted);
    for (end, value) in ends.iter().zip(mended) {
        if value.is_finite() {
            radiosity[end.vertex] = value;
        }
    }
}

/// A boundary vertex, where a surface ends.
pub(super) struct BoundaryVertex {
    pub vertex: usize,
    pub position: DVec3,
    /// Elements and their weights in the linear fit; nothing where there is no fit.
    pub fit: Vec<(u32, f64)>,
    /// Elements of this surface within three rings, ascending.
    pub wide: Vec<u32>,
}

/// The ends of all surfaces, by ascending vertex.
pub(super) fn ends(
    mesh: &Mesh,
    rims: &ElementLoops,
    positions: &[DVec3],
    normals: &[DVec3],
) -> Vec<BoundaryVertex> {
    let around = elements_around(rims, positions.len());
    let end = |vertex: usize| {
        let near = ring(rims, &around, &around[vertex]);
        let wide = ring(rims, &around, &near);
        let position = positions[vertex];
        BoundaryVertex { vertex, position, fit: fit(mesh, near, position, normals[vertex]), wide }
    };
    boundary(rims).into_par_iter().map(end).collect()
}

/// Weights with which values at the centroids of `near` sum up to that of their linear fit at `at`;
/// none if they do not define one.
fn fit(mesh: &Mesh, near: Vec<u32>, at: DVec3, normal: DVec3) -> Vec<(u32, f64)> {
    if near.len() < FEWEST {
        return vec![];
    }
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    // Normal equations of B ≈ a + g·(x − x_v) in the tangent plane; a is what is wanted.
    let mut matrix = DMat3::ZERO;
    let row_of = |e: u32| {
        let node = mesh.element(e as usize);
        let (offset, area) = (mesh.centroid(node) - at, mesh.area(node));
        let weight = area / (offset.length_squared() + area);
        let scale = 1.0 / area.sqrt();
        let x = DVec3::new(1.0, offset.dot(tangent) * scale, offset.dot(bitangent) * scale);
        matrix += DMat3::from_cols(x * x.x, x * x.y, x * x.z) * weight;
        (e, x * weight)
    };
    let rows: Vec<(u32, DVec3)> = near.into_iter().map(row_of).collect();
    let first = matrix.inverse().row(0);
    let weights: Vec<(u32, f64)> = rows.into_iter().map(|(e, x)| (e, first.dot(x))).collect();
    // They sum to one, but for rounding, which is all that is left of centroids close to a line.
    let sum: f64 = weights.iter().map(|(_, weight)| weight).sum();
    if (sum - 1.0).abs() < ROUNDING { weights } else { vec![] }
}

/// The elements that share a vertex with one of `elements`, those included, ascending. Hubs do not
/// count: all at a hub would have all others there in their rings.
fn ring(rims: &ElementLoops, around: &[Vec<u32>], elements: &[u32]) -> Vec<u32> {
    let vertices = elements.iter().flat_map(|&e| rims.of(e as usize));
    let others = vertices.map(|&v| &around[v as usize]).filter(|others| others.len() < HUB);
    let mut ring: Vec<u32> = others.flatten().chain(elements).copied().collect();
    ring.sort_unstable();
    ring.dedup();
    ring
}

/// Vertices on a side that only one element has, ascending.
fn boundary(rims: &ElementLoops) -> Vec<usize> {
    let mut sides: FxHashMap<(u32, u32), u32> = FxHashMap::default();
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
fn elements_around(rims: &ElementLoops, vertices: usize) -> Vec<Vec<u32>> {
    let mut around = vec![vec![]; vertices];
    for (e, rim) in rims.iter() {
        rim.iter().for_each(|&v| around[v as usize].push(e as u32));
    }
    around
}
