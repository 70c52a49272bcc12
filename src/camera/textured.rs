//! A solution with its textures, at the hits of camera rays.
//!
//! Vertices hold the light, which is smooth; the texture is looked up at each hit. A look-up is
//! filtered over the area between neighbouring rays, so that distant textures do not flicker.

use glam::DVec3;

use super::PrimaryRays;
use crate::gather::GatheredMesh;
use crate::scene::{Rgb, Scene};
use crate::visibility::ray_scene::Hit;

/// A solution as seen by the camera's rays.
pub(super) struct LitSurface<'a> {
    pub rays: PrimaryRays<'a>,
    pub light: &'a GatheredMesh,
}

/// Eye and view axis for a hit; behind mirrors, their mirror images.
#[derive(Clone, Copy)]
pub(super) struct Sight {
    /// Scene unit.
    pub eye: DVec3,
    /// Its dot product with a vector from the eye is the depth along the view's axis.
    pub forward: DVec3,
}

impl LitSurface<'_> {
    /// That of the camera itself.
    pub fn direct_sight(&self) -> Sight {
        Sight { eye: self.rays.eye, forward: self.rays.forward }
    }

    /// Albedo per channel and exitance, W/m², at a hit.
    pub fn albedo_and_exitance(&self, hit: &Hit, sight: &Sight) -> [Rgb; 2] {
        let (scene, t) = (self.scene(), hit.triangle);
        if scene.textures(t).is_none() {
            let material = scene.material(t);
            return [material.albedo(), material.exitance];
        }
        let position = self.rays.interpolate(hit, &self.light.surface.positions);
        let (point, share) = (scene.barycentric(t, position), self.share(t, position, sight));
        [scene.albedo_around(t, point, share), scene.exitance_around(t, point, share)]
    }

    /// Radiosity at a hit, W/m²: by the light at the vertices and the texture at the hit.
    pub fn radiosity(&self, hit: &Hit, sight: &Sight) -> Rgb {
        let surface = &self.light.surface;
        if self.light.mesh.scene().textures(hit.triangle).is_none() {
            return self.rays.interpolate(hit, &surface.radiosity);
        }
        let [albedo, exitance] = self.albedo_and_exitance(hit, sight);
        exitance + albedo * self.rays.interpolate(hit, &surface.irradiance)
    }

    /// Radiosity at a hit as if no material were textured, W/m²: it shows the light.
    pub fn untextured_radiosity(&self, hit: &Hit) -> Rgb {
        let (scene, t, surface) = (self.light.mesh.scene(), hit.triangle, &self.light.surface);
        if scene.textures(t).is_none() {
            return self.rays.interpolate(hit, &surface.radiosity);
        }
        scene.material(t).albedo() * self.rays.interpolate(hit, &surface.irradiance)
    }

    /// The element of the mesh that was hit.
    pub fn element(&self, hit: &Hit) -> usize {
        self.light.mesh.element_at(hit.triangle, hit.u, hit.v).0
    }

    /// The scene that is seen.
    pub fn scene(&self) -> &Scene {
        self.light.mesh.scene()
    }

    /// The fraction of triangle `t` that lies between a ray to `position` on it and its neighbours.
    fn share(&self, t: usize, position: DVec3, sight: &Sight) -> f64 {
        let to = position - sight.eye;
        let depth = to.dot(sight.forward);
        let (scene, normal) = (self.scene(), self.scene().normal(t));
        // Cross-section of the rays' pyramid at that depth, and its projection onto the surface.
        let section = (self.rays.right.cross(self.rays.down).length() * depth * depth).abs();
        let facing = (normal.dot(to) / to.length()).abs();
        let across = (sight.forward.dot(to) / to.length()).abs();
        (section * across / facing / scene.area(t)).min(1.0)
    }
}
