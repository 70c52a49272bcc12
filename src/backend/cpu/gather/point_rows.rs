//! Rows of points from the rays of a gather.

use std::ops::Range;

use glam::DVec3;

use super::RayGather;
use super::direct_light::DirectLight;
use super::near_field::{NearField, NearLight, NearRay};
use super::scene_rays::RAYS_PER_SHADOW_RAY;
use crate::gather::GatherPoint;
use crate::gather::near_surface::is_near;
use crate::gather::point_row::{PointRow, PointRows, SurfaceHit};
use crate::gather::visible::Visible;
use crate::mesh::Mesh;
use crate::scene::Rgb;
use crate::visibility::ray_scene::Hit;

impl PointRows for RayGather {
    fn rows(&self, mesh: &Mesh, point: &GatherPoint, parts: u32) -> Vec<PointRow> {
        let light = DirectLight::new(&self.scene, self.min_rays, point, f64::INFINITY);
        let count = (self.min_rays / parts.max(1)).max(1);
        let parts = (0..parts).map(|part| part * count..(part + 1) * count);
        // The same for all parts: the light of luminaires has almost no noise.
        let luminaires = self.scene.luminaires().unscaled(point);
        let row = |range| PointRow {
            luminaires: luminaires.clone(),
            ..self.row(mesh, point, &light, range)
        };
        parts.map(row).collect()
    }

    fn surface_row(&self, mesh: &Mesh, source: &Mesh, point: &GatherPoint) -> PointRow {
        self.row_of_surfaces([mesh, source], point, None, 0..self.min_rays)
    }
}

impl RayGather {
    /// The row of `point` by the rays of `range`, with rays to the lights of `direct`.
    fn row(
        &self,
        mesh: &Mesh,
        point: &GatherPoint,
        direct: &DirectLight,
        range: Range<u32>,
    ) -> PointRow {
        let mut row = self.row_of_surfaces([mesh, mesh], point, Some(direct), range.clone());
        let scene = mesh.scene();
        let range = range.start / RAYS_PER_SHADOW_RAY..range.end.div_ceil(RAYS_PER_SHADOW_RAY);
        row.emitters.extend(direct.emitters(range.clone()));
        if let Some(sun) = scene.sky().sun() {
            let visible = direct.rays_to_sun(sun, range);
            let cosine = point.normal.dot(sun.direction);
            let unoccluded = sun.unoccluded(cosine).map(|_| cosine);
            row.sun = mean(visible.seen) * visible.share_of(unoccluded);
        }
        row
    }

    /// The same without entries for the sun and the lights that `direct` sends rays to. Without
    /// `direct`, lights are treated like any surface.
    fn row_of_surfaces(
        &self,
        [mesh, source]: [&Mesh; 2],
        point: &GatherPoint,
        direct: Option<&DirectLight>,
        range: Range<u32>,
    ) -> PointRow {
        let rotation = self.scene.rotations.at(point.position, point.near);
        let share = 1.0 / range.len() as f64;
        let mut row =
            PointRow { share, hits: Vec::with_capacity(range.len()), ..Default::default() };
        // Emission on the way is in no row: rows with lights leave near surfaces as they are.
        let near_field = self.near_field.as_ref().filter(|_| direct.is_none());
        let (mut near, wide) = (vec![], direct.map_or(&[][..], DirectLight::wide));
        let mut of_wide: Vec<Visible> = wide.iter().map(|_| Visible::default()).collect();
        let samples = self.samples(self.min_rays);
        self.cast((point, samples), rotation, range.clone(), |ray, direction, hit| {
            let passed = |end: f64| self.passed_evenly(point, direction, end);
            if let Some(direct) = direct {
                direct.add_to_wide(&mut of_wide, direction, hit, passed);
            }
            let Some(hit) = hit else {
                row.sky += share * passed(f64::INFINITY).x;
                return;
            };
            row.inverse_distance += share / hit.distance;
            if !hit.front {
                row.backface += share;
                return;
            }
            let passed = passed(hit.distance);
            if near_field.is_some() && is_near(source, &hit) {
                near.push((row.hits.len(), NearRay { hit, direction, passed, ray }));
            }
            row.hits.push(surface_hit(mesh, &hit, passed, direct.is_none()));
        });
        let is_covered = NearField::is_covered(near.len(), range.len());
        if let Some(near_field) = near_field.filter(|_| is_covered) {
            for (k, ray) in near {
                let path = near_field.light(source, point, rotation, &ray, false);
                move_to_end(&mut row.hits[k], mesh, &path);
            }
        }
        for (wide, visible) in wide.iter().zip(&of_wide) {
            row.emitters.push((wide.patch.material, mean(wide.form_factor(visible))));
        }
        row
    }

    /// Transmittance of panes on a ray from `point` up to a distance, the same for all channels.
    fn passed_evenly(&self, point: &GatherPoint, direction: DVec3, end: f64) -> Rgb {
        let reach = point.near..end;
        Rgb::splat(mean(self.scene.panes.transmittance(point.position, direction, reach)))
    }
}

/// Moves a hit of a near surface to the end of its path, on the elements of `mesh`.
fn move_to_end(hit: &mut SurfaceHit, mesh: &Mesh, path: &NearLight) {
    match &path.end {
        Some((share, end)) => *hit = surface_hit(mesh, end, hit.passed * *share, hit.emits),
        None => hit.passed = Rgb::ZERO,
    }
}

/// A hit on the elements of `mesh`, of which this share arrives.
fn surface_hit(mesh: &Mesh, hit: &Hit, passed: Rgb, emits: bool) -> SurfaceHit {
    let (element, barycentric) = mesh.element_at(hit.triangle, hit.u, hit.v);
    SurfaceHit { element: element as u32, barycentric, passed, emits }
}

/// The mean over the channels.
fn mean(share: Rgb) -> f64 {
    share.element_sum() / 3.0
}
