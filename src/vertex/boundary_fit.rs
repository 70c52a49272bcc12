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

/// Elements that a plane is fitted to, at least: through three it passes exactly, and swings with
/// their noise.
const MIN_FIT_POINTS: usize = 4;

/// How far the weights of a fit may be from a sum of one. More is a singular matrix: all centroids
/// are close to one line. Far above the rounding of a regular one; chosen by hand.
const MAX_WEIGHT_SUM_ERROR: f64 = 1e-6;

/// What a fit may make of errors of the elements, at most: the sum of the weights' magnitudes. One
/// end of a strip, extrapolated from both of its elements, has 2, the corner of a rectangle 2.5;
/// slivers along a line had 36. Chosen by hand, well above what plain surfaces have.
const MAX_AMPLIFICATION: f64 = 4.0;

/// Vertices with at least this many elements around them are not grown across: every element there
/// would have all others in its ring, which takes quadratic time. Six are usual, and the pole of a
/// fine sphere has some hundred. Chosen by hand.
const MAX_VALENCE: usize = 256;

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
    if elements.len() < MIN_FIT_POINTS {
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
    let is_regular = (sum - 1.0).abs() < MAX_WEIGHT_SUM_ERROR;
    if is_regular && amplification < MAX_AMPLIFICATION { weights } else { vec![] }
}

/// The elements that share a vertex with one of `elements`, those included, ascending; see
/// [`MAX_VALENCE`].
fn ring(outlines: &ElementLoops, around: &Incidence, elements: &[u32]) -> Vec<u32> {
    let vertices = elements.iter().flat_map(|&e| outlines.of(e as usize));
    let neighbours = vertices.map(|&v| around.at(v)).filter(|n| n.len() < MAX_VALENCE);
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
