//! What the camera's rays meet of a solution, with its textures.
//!
//! Vertices hold the light, which is smooth; the texture is looked up where a ray meets it. A
//! look-up is filtered over what lies between neighbouring rays, so that a texture far away does
//! not flicker.

use glam::DVec3;

use super::PrimaryRays;
use crate::gather::GatheredMesh;
use crate::scene::{Rgb, Scene};
use crate::visibility::ray_scene::Hit;

/// A solution as the camera's rays meet it.
pub(super) struct LitSurface<'a> {
    pub rays: PrimaryRays<'a>,
    pub light: &'a GatheredMesh,
}

impl LitSurface<'_> {
    /// Reflectance per channel and exitance, W/m², at a hit.
    pub fn reflectance_and_exitance(&self, hit: &Hit) -> [Rgb; 2] {
        let (scene, t) = (self.light.mesh.scene(), self.triangle(hit));
        if scene.textures(t).is_none() {
            let material = scene.material(t);
            return [material.reflectance, material.exitance];
        }
        let position = self.rays.interpolate(hit, &self.light.surface.positions);
        let (place, share) = (scene.barycentric(t, position), self.share(scene, t, position));
        [scene.reflectance_around(t, place, share), scene.exitance_around(t, place, share)]
    }

    /// Radiosity at a hit, W/m²: by the light at the vertices and the texture at the hit.
    pub fn radiosity(&self, hit: &Hit) -> Rgb {
        let surface = &self.light.surface;
        if self.light.mesh.scene().textures(self.triangle(hit)).is_none() {
            return self.rays.interpolate(hit, &surface.radiosity);
        }
        let [reflectance, exitance] = self.reflectance_and_exitance(hit);
        exitance + reflectance * self.rays.interpolate(hit, &surface.irradiance)
    }

    /// Radiosity at a hit as if no material were textured, W/m²: it shows the light.
    pub fn untextured_radiosity(&self, hit: &Hit) -> Rgb {
        let (scene, t, surface) =
            (self.light.mesh.scene(), self.triangle(hit), &self.light.surface);
        if scene.textures(t).is_none() {
            return self.rays.interpolate(hit, &surface.radiosity);
        }
        scene.material(t).reflectance * self.rays.interpolate(hit, &surface.irradiance)
    }

    /// The element of the mesh that was hit.
    pub fn element(&self, hit: &Hit) -> usize {
        self.light.surface.elements[hit.triangle] as usize
    }

    /// The triangle of the scene that was hit.
    pub fn triangle(&self, hit: &Hit) -> usize {
        let mesh = &self.light.mesh;
        mesh.triangle(mesh.element(self.element(hit)))
    }

    /// The share of triangle `t` that lies between a ray to `position` on it and its neighbours.
    fn share(&self, scene: &Scene, t: usize, position: DVec3) -> f64 {
        let to = position - self.rays.eye;
        let depth = to.dot(self.rays.forward);
        let normal = scene.normal(t);
        // A cross-section of the rays' pyramid there, and how much of the surface it covers.
        let section = (self.rays.right.cross(self.rays.down).length() * depth * depth).abs();
        let facing = (normal.dot(to) / to.length()).abs();
        let across = (self.rays.forward.dot(to) / to.length()).abs();
        (section * across / facing / scene.area(t)).min(1.0)
    }
}
