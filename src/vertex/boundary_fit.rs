//! Values at the boundary of a smooth surface, by a linear fit.
//!
//! All elements around a boundary vertex lie to one side of it, so their mean is the value at a
//! point further in. Instead, a linear function is fitted to the elements around the vertex and
//! around their vertices, and extrapolated:
//!
//! ```text
//!   boundary ──v──●──●──   B ≈ a + g · (x − x_v) in the tangent plane at v,
//!             │╲ ╱│╲ ╱│    least squares over element centroids x,
//!             ●──●──●──    weights A / (|x − x_v|² + A) for elements of area A;
//!             │╲ ╱│╲ ╱│    the value at v is a
//! ```
//!
//! The solution is linear in the elements' values, so a fit is kept as one weight per element.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::keys::ElementLoops;
use crate::geometry::incidence::Incidence;
use crate::mesh::Mesh;
use crate::scene::Rgb;

/// A vertex on the boundary of a smooth surface.
pub(super) struct BoundaryVertex {
    /// Index of the vertex.
    pub vertex: usize,
    /// Elements and their weights in the linear fit, which sum to one; empty where there is no fit.
    pub fit: Vec<(u32, f64)>,
}

impl BoundaryVertex {
    /// The fit's value for these values of elements; `fallback` where there is no fit.
    pub fn fitted(&self, elements: &[Rgb], fallback: Rgb) -> Rgb {
        if self.fit.is_empty() {
            return fallback;
        }
        self.fit.iter().map(|&(e, weight)| elements[e as usize] * weight).sum()
    }
}

/// The boundary vertices of all smooth surfaces, by ascending vertex.
pub(super) fn boundary_vertices(
    mesh: &Mesh,
    outlines: &ElementLoops,
    positions: &[DVec3],
    normals: &[DVec3],
) -> Vec<BoundaryVertex> {
    let around = Incidence::new(positions.len(), || outlines.iter());
    let boundary_vertex = |vertex: usize| {
        let near = ring(outlines, &around, around.at(vertex as u32));
        let fit = linear_fit(mesh, near, positions[vertex], normals[vertex]);
        BoundaryVertex { vertex, fit }
    };
    vertices_on_boundary(outlines).into_par_iter().map(boundary_vertex).collect()
}

/// Weights with which values at the centroids of `elements` sum up to that of their linear fit at
/// `position`; empty if they do not define one.
fn linear_fit(mesh: &Mesh, elements: Vec<u32>, position: DVec3, normal: DVec3) -> Vec<(u32, f64)> {
    // A plane through three elements passes exactly, and amplifies their noise.
    if elements.len() < 4 {
        return vec![];
    }
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    // Normal equations for (a, g); only a is wanted, which is the first row of the inverse.
    let mut matrix = DMat3::ZERO;
    let row_of = |e: u32| {
        let node = mesh.element(e as usize);
        let (offset, area) = (mesh.centroid(node) - position, mesh.area(node));
        let weight = mesh.solid_share(node) * area / (offset.length_squared() + area);
        let scale = 1.0 / area.sqrt();
        let x = DVec3::new(1.0, offset.dot(tangent) * scale, offset.dot(bitangent) * scale);
        matrix += DMat3::from_cols(x * x.x, x * x.y, x * x.z) * weight;
        (e, x * weight)
    };
    let rows: Vec<(u32, DVec3)> = elements.into_iter().map(row_of).collect();
    let first = matrix.inverse().row(0);
    let weights: Vec<(u32, f64)> = rows.into_iter().map(|(e, x)| (e, first.dot(x))).collect();
    let sum: f64 = weights.iter().map(|(_, weight)| weight).sum();
    let amplification: f64 = weights.iter().map(|(_, weight)| weight.abs()).sum();
    // With all centroids close to one line the matrix is singular, and the sum is not 1. Errors of
    // elements are amplified 2 times at the end of a strip, 2.5 times at the corner of a rectangle
    // and 36 times by slivers along a line.
    let is_regular = (sum - 1.0).abs() < 1e-6;
    if is_regular && amplification < 4.0 { weights } else { vec![] }
}

/// The elements that share a vertex with one of `elements`, those included, ascending. Vertices of
/// 256 elements and more are not grown across, which would take quadratic time: six are usual, and
/// the pole of a fine sphere has about a hundred.
fn ring(outlines: &ElementLoops, around: &Incidence, elements: &[u32]) -> Vec<u32> {
    let vertices = elements.iter().flat_map(|&e| outlines.of(e as usize));
    let neighbours = vertices.map(|&v| around.at(v)).filter(|n| n.len() < 256);
    let mut ring: Vec<u32> = neighbours.flatten().chain(elements).copied().collect();
    ring.sort_unstable();
    ring.dedup();
    ring
}

/// Vertices on a side that only one element has, ascending.
fn vertices_on_boundary(outlines: &ElementLoops) -> Vec<usize> {
    let mut sides: Vec<[u32; 2]> = vec![];
    for (_, outline) in outlines.iter() {
        let next = outline.iter().cycle().skip(1);
        sides.extend(outline.iter().zip(next).map(|(&a, &b)| [a.min(b), a.max(b)]));
    }
    sides.par_sort_unstable();
    let single = sides.chunk_by(|side, next| side == next).filter(|alike| alike.len() == 1);
    let mut vertices: Vec<usize> = single.flat_map(|side| side[0].map(|v| v as usize)).collect();
    vertices.sort_unstable();
    vertices.dedup();
    vertices
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::mesh::SurfaceTopology;
    use crate::scene::{Material, Scene, Triangle};
    use crate::vertex::keys::Vertices;

    /// Fits at the corners of a fan: a triangle for each two neighbours of `rim` around the origin.
    fn fits(rim: &[[f64; 2]]) -> Vec<Vec<(u32, f64)>> {
        let at = |&[x, y]: &[f64; 2]| DVec3::new(x, y, 0.0);
        let triangle = |k: u32| Triangle { corners: [0, k, k + 1], ..Default::default() };
        let scene = Scene::new(
            std::iter::once(DVec3::ZERO).chain(rim.iter().map(at)).collect(),
            (1..rim.len() as u32).map(triangle).collect(),
            vec!["fan".into()],
            vec![Material::grey("fan", 0.5)],
        );
        let mesh = Mesh::new(scene.unwrap(), f64::INFINITY).unwrap();
        let Vertices { positions, outlines, .. } =
            Vertices::new(&mesh, &SurfaceTopology::new(mesh.scene()));
        let normals = vec![DVec3::Z; positions.len()];
        let boundary = boundary_vertices(&mesh, &outlines, &positions, &normals);
        boundary.into_iter().map(|vertex| vertex.fit).collect()
    }

    #[test]
    fn fits_that_amplify_errors_are_left_out() {
        // From the middle of a half disc, and from both ends of its straight side, its triangles
        // lie in all directions; from the rim they all lie along an arc.
        let fan = |angle: f64| -> Vec<[f64; 2]> {
            (0..7).map(|k| f64::from(k) * angle).map(|a| [a.cos(), a.sin()]).collect()
        };
        let count = |rim: &[[f64; 2]]| fits(rim).iter().filter(|fit| !fit.is_empty()).count();
        assert!(count(&fan(PI / 6.0)) >= 3);
        // Nearly on a line: what is across it is extrapolated from a hundredth of that.
        assert_eq!(count(&fan(0.02)), 0);
    }
}
