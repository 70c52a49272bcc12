//! Which face of a mesh of vertices lies at a point of the scene.

use super::VertexMesh;
use crate::geometry::barycentric::barycentric;
use crate::mesh::Mesh;
use crate::scene::Rgb;

/// A place on a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FacePlace {
    pub face: usize,
    /// Weights of the face's second and third corner.
    pub weights: [f64; 2],
}

impl FacePlace {
    /// The least of the three weights: how far inside the face it is.
    fn inside(&self) -> f64 {
        let [u, v] = self.weights;
        u.min(v).min(1.0 - u - v)
    }
}

impl VertexMesh {
    /// The place at the barycentric position (`u`, `v`) of triangle `t` of the scene, weights of
    /// its second and third corner, where the faces are elements of `mesh` or fans in them, in
    /// their order. It takes no hierarchy of rays, which would be larger than both. None where the
    /// element has no face.
    pub(crate) fn face_at(&self, mesh: &Mesh, t: usize, [u, v]: [f64; 2]) -> Option<FacePlace> {
        let (e, _) = mesh.element_at(t, u, v);
        let e = e as u32;
        let first = self.elements.partition_point(|&other| other < e);
        let of_element = self.elements[first..].iter().take_while(|&&other| other == e);
        let [a, b, c] = mesh.scene().corners(t);
        let position = a * (1.0 - u - v) + b * u + c * v;
        let places = (first..).zip(of_element).map(|(face, _)| {
            let corners = self.faces[face].map(|v| self.positions[v as usize]);
            let weights = barycentric(corners, mesh.scene().normal(t), position);
            // Of a face without area, its middle.
            let is_known = weights.iter().all(|weight| weight.is_finite());
            FacePlace { face, weights: if is_known { weights } else { [1.0 / 3.0; 2] } }
        });
        places.max_by(|a, b| a.inside().total_cmp(&b.inside()))
    }

    /// Of one value a vertex, the one at `place`, between its corners.
    pub(crate) fn value_at(&self, place: &FacePlace, values: &[Rgb]) -> Rgb {
        let [a, b, c] = self.faces[place.face].map(|v| values[v as usize]);
        let [u, v] = place.weights;
        (1.0 - u - v) * a + u * b + v * c
    }
}
