//! Twin of `shaders/row_rays.wgsl`: cosine-distributed rays from patches, and the number that hits
//! each element.

use glam::{Vec2, Vec3};

use super::element::element_at;
use super::lights::passed;
use super::ray_arrays::RayArrays;
use super::trace::{Hit, Ray, nearest_but};
use crate::backend::gpu::layout::{
    BACK, FAR, FIRST_FRONT, NOTHING, OPEN, RowSettings, TracedPatch,
};

impl RayArrays<'_> {
    /// Number of rays that hit each slot of a patch; with panes, followed by the sums of
    /// transmittances, one row per channel.
    pub fn row_rays(&self, patch: &TracedPatch, settings: &RowSettings) -> Vec<u32> {
        let slots = settings.slots as usize;
        let rows = if self.scene.info.panes == NOTHING { 1 } else { 4 };
        let mut counts = vec![0; rows * slots];
        for k in 0..settings.rays {
            let direction = self.direction(k, patch.normal, patch.rotation);
            let (slot, share) = self.cast_ray(patch, direction);
            counts[slot as usize] += 1;
            for channel in 0..rows - 1 {
                counts[(channel + 1) * slots + slot as usize] += amount(share[channel], settings);
            }
        }
        counts
    }

    /// A ray, and its hit.
    pub fn intersect(&self, patch: &TracedPatch, direction: Vec3) -> (Ray, Hit) {
        let (origin, origin_low) = (patch.position.into(), patch.position_low.into());
        let ray = Ray { origin, origin_low, direction, near: patch.near };
        (ray, nearest_but(self.scene, &ray, patch.own_triangle))
    }

    /// The slot that a ray hits, and the transmittance of panes on the way.
    pub fn cast_ray(&self, patch: &TracedPatch, direction: Vec3) -> (u32, Vec3) {
        let scene = self.scene;
        let (ray, hit) = self.intersect(patch, direction);
        let mut slot = OPEN;
        if hit.triangle != NOTHING {
            slot = BACK;
            if hit.front {
                let index = scene.triangles[hit.triangle as usize].index;
                let at = element_at(self.quadtrees, index, Vec2::new(hit.u, hit.v));
                slot = FIRST_FRONT + at.element;
            }
        }
        let end = if hit.triangle != NOTHING { hit.distance } else { FAR };
        (slot, passed(scene, &ray, end))
    }
}

/// The value added to the sums of a channel for a ray with transmittance `share`.
pub fn amount(share: f32, settings: &RowSettings) -> u32 {
    (share * settings.unit + 0.5) as u32
}
