//! Which face of a solution lies at a point of the scene.

use glam::DVec3;

use super::path_tracer::{SurfacePoint, nearest_surfaces};
use crate::mesh::Mesh;
use crate::scene::Scene;
use crate::vertex::{FacePlace, VertexMesh};
use crate::visibility::ray_scene::{Hit, RayScene};

/// How the faces of a solution are found.
pub(super) enum Faces<'a> {
    /// Whatever they are: by rays at them.
    Any {
        rays: RayScene,
        normals: Vec<DVec3>,
        /// Of the scene, scene unit.
        diagonal: f64,
    },
    /// The faces of a mesh of the scene, in the order of its elements: they are known without a
    /// hierarchy of rays, which would take more memory than they do.
    OfMesh(&'a Mesh),
}

impl<'a> Faces<'a> {
    /// Of a `surface` of `scene`, whose faces and positions are sound.
    pub fn any(surface: &VertexMesh, scene: &Scene) -> Faces<'a> {
        let corners = |face: &[u32; 3]| face.map(|v| surface.positions[v as usize]);
        let normal = |face| {
            let [a, b, c] = corners(face);
            let scale = (b - a).abs().max((c - a).abs()).max_element().max(f64::MIN_POSITIVE);
            ((b - a) / scale).cross((c - a) / scale).normalize_or_zero()
        };
        Faces::Any {
            rays: RayScene::new(surface.faces.iter().map(corners)),
            normals: surface.faces.iter().map(normal).collect(),
            diagonal: scene.bounds().diagonal(),
        }
    }

    /// The faces of `surface` at `point` of `scene`: the nearest that face alike, more than one
    /// where they lie in one place.
    pub fn at(&self, surface: &VertexMesh, scene: &Scene, point: &SurfacePoint) -> Vec<FacePlace> {
        match self {
            Faces::Any { rays, normals, diagonal } => {
                let normal = scene.normal(point.triangle);
                let hits = nearest_surfaces(rays, normals, point.position, normal, *diagonal);
                let place = |hit: Hit| FacePlace { face: hit.triangle, weights: [hit.u, hit.v] };
                hits.into_iter().map(place).collect()
            }
            Faces::OfMesh(mesh) => {
                let place = scene.barycentric(point.triangle, point.position);
                surface.face_at(mesh, point.triangle, place).into_iter().collect()
            }
        }
    }
}
