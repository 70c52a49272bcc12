//! What a solution says of a point: its face there, interpolated.

use glam::DVec3;

use super::path_tracer::{SurfacePoint, nearest_surface};
use crate::error::{Error, ErrorKind};
use crate::scene::{Rgb, Scene};
use crate::vertex::VertexMesh;
use crate::visibility::ray_scene::RayScene;

/// A solution that can be asked at points.
pub(super) struct SolutionLookup<'a> {
    solution: &'a VertexMesh,
    rays: RayScene,
    normals: Vec<DVec3>,
    /// Of the scene, scene unit.
    diagonal: f64,
}

impl<'a> SolutionLookup<'a> {
    /// Checks `solution`, of `scene`.
    pub fn new(solution: &'a VertexMesh, scene: &Scene) -> Result<SolutionLookup<'a>, Error> {
        let diagonal = scene.bounds().diagonal();
        let VertexMesh { positions, radiosity, irradiance, faces, .. } = solution;
        let wrong = |found: String, remedy: &str| {
            Err(Error::new(ErrorKind::Scene, "solution", found, remedy))
        };
        let (vertices, values) = (positions.len(), radiosity.len());
        if vertices != values {
            let found = format!("{values} values of radiosity at {vertices} vertices");
            return wrong(found, "give one for each");
        }
        if scene.has_textures() && irradiance.len() != vertices {
            let found = format!("{} values of irradiance at {vertices} vertices", irradiance.len());
            return wrong(found, "give one for each, as `bake` writes them: there are textures");
        }
        let unknown = irradiance.iter().position(|e| !e.is_finite());
        if let Some(v) = unknown.filter(|_| scene.has_textures()) {
            let found = format!("vertex {} with irradiance {}", v + 1, irradiance[v]);
            return wrong(found, "all numbers must be finite");
        }
        let finite = |(p, b): (&DVec3, &Rgb)| p.is_finite() && b.is_finite();
        if let Some(v) = positions.iter().zip(radiosity).position(|pair| !finite(pair)) {
            let found = format!("vertex {} at {} with {}", v + 1, positions[v], radiosity[v]);
            return wrong(found, "all numbers must be finite");
        }
        let outside = |face: &[u32; 3]| face.iter().any(|&v| v as usize >= vertices);
        if let Some(f) = faces.iter().position(outside) {
            let found = format!("face {} of vertices {:?}", f + 1, faces[f]);
            return wrong(found, "indices must be below the number of vertices");
        }
        if faces.is_empty() {
            return wrong("no faces".into(), "give the whole surface of the scene");
        }
        let corners = |face: &[u32; 3]| face.map(|v| positions[v as usize]);
        let normal = |face| {
            let [a, b, c] = corners(face);
            let scale = (b - a).abs().max((c - a).abs()).max_element().max(f64::MIN_POSITIVE);
            ((b - a) / scale).cross((c - a) / scale).normalize_or_zero()
        };
        let rays = RayScene::new(faces.iter().map(corners));
        let normals = faces.iter().map(normal).collect();
        Ok(SolutionLookup { solution, rays, normals, diagonal })
    }

    /// Radiosity that `point` of `scene` reflects with the reflectance of its material, W/m²: by
    /// the nearest face that faces alike. None where there is none.
    pub fn reflected(&self, scene: &Scene, point: &SurfacePoint) -> Option<Rgb> {
        let (position, normal) = (point.position, scene.normal(point.triangle));
        let hit = nearest_surface(&self.rays, &self.normals, position, normal, self.diagonal)?;
        let face = self.solution.faces[hit.triangle];
        let interpolated = |values: &[Rgb]| {
            let [a, b, c] = face.map(|v| values[v as usize]);
            (1.0 - hit.u - hit.v) * a + hit.u * b + hit.v * c
        };
        let material = scene.material(point.triangle);
        Some(match scene.textures(point.triangle) {
            Some(_) => material.reflectance * interpolated(&self.solution.irradiance),
            None => interpolated(&self.solution.radiosity) - material.exitance,
        })
    }
}
