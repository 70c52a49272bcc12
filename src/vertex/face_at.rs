//! Which face of a mesh of vertices lies at a point of the scene.

use super::VertexMesh;
use crate::geometry::barycentric::barycentric;
use crate::mesh::Mesh;
use crate::scene::{Rgb, Scene};

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

    /// What the surface reflects at `place`, on triangle `t` of `scene`, with the reflectance of
    /// its material, W/m².
    pub(crate) fn reflected_at(&self, scene: &Scene, t: usize, place: &FacePlace) -> Rgb {
        let material = scene.material(t);
        match scene.textures(t) {
            Some(_) => material.albedo() * self.value_at(place, &self.irradiance),
            None => self.value_at(place, &self.radiosity) - material.exitance,
        }
    }

    /// Of one value a vertex, the one at `place`, between its corners.
    pub(crate) fn value_at(&self, place: &FacePlace, values: &[Rgb]) -> Rgb {
        let [a, b, c] = self.faces[place.face].map(|v| values[v as usize]);
        let [u, v] = place.weights;
        (1.0 - u - v) * a + u * b + v * c
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::{Material, Triangle};

    #[test]
    fn every_face_is_found_at_its_points() {
        let positions = vec![DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.3), DVec3::Y];
        let triangle = |corners| Triangle { corners, ..Default::default() };
        let triangles = vec![triangle([0, 1, 2]), triangle([0, 2, 3])];
        let materials = vec![Material::grey("grey", 0.5)];
        let scene = Scene::new(positions, triangles, vec!["all".into()], materials).unwrap();
        // Elements of three sizes: those next to smaller ones are fans.
        let mesh = Mesh::new(scene, 0.8).unwrap();
        let mesh = mesh.split(&[1, 6]).unwrap();
        let mesh = mesh.split(&[2]).unwrap();
        let light: Vec<Rgb> = (0..mesh.element_count()).map(|e| Rgb::splat(e as f64)).collect();
        let surface = VertexMesh::new(&mesh, &light);
        assert!(surface.faces.len() > mesh.element_count(), "there are fans");
        let close = |a: f64, b: f64| (a - b).abs() < 1e-12;
        for (face, corners) in surface.faces.iter().enumerate() {
            let [a, b, c] = corners.map(|v| surface.positions[v as usize]);
            let t = mesh.triangle(mesh.element(surface.elements[face] as usize));
            for [u, v] in [[0.2, 0.3], [0.01, 0.01], [0.98, 0.01]] {
                let at = mesh.scene().barycentric(t, a * (1.0 - u - v) + b * u + c * v);
                let place = surface.face_at(&mesh, t, at).unwrap();
                let [x, y] = place.weights;
                assert!(place.face == face && close(x, u) && close(y, v), "{face}: {place:?}");
                let position = surface.value_at(&place, &surface.positions);
                assert!(position.distance(a * (1.0 - u - v) + b * u + c * v) < 1e-12);
            }
        }
    }
}
