//! Images with gathered light: every pixel gathers the irradiance at its hits.
//!
//! ```text
//!   pixel's primary rays ── group by smooth surface ── split groups with an edge of a shadow
//!     └ each group gathers once, in its middle:  L = (E + ρ · irradiance) / π, weighted by rays
//! ```
//!
//! Irradiance is smooth within a group, so one gather stands for all of its rays, while the edges
//! of objects are antialiased by all of them. Edges of shadows show in the radiosity at vertices,
//! which is interpolated at no cost: groups in which that varies are halved.

use std::f64::consts::PI;
use std::ops::ControlFlow;
use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use super::second_pass::{SecondPass, Sighting};
use super::textured::{LitSurface, Sight};
use super::{Camera, PrimaryRays, RadianceImage, Seen};
use crate::error::Error;
use crate::gather::GatheredMesh;
use crate::gather::gather_points::{SurfaceOffset, is_buried};
use crate::gather::two_sided::{TwoSidedPoint, gather_two_sided};
use crate::gather::{Gather, GatherPoint, IrradianceSample};
use crate::mesh::SurfaceTopology;
use crate::scene::Rgb;
use crate::visibility::ray_scene::Hit;
use crate::work::{Batches, agree};

impl Camera {
    /// Draws `light` with the primary rays of [`Camera::image`], but with irradiance gathered at
    /// their hits: the radiance of a point is (E + ρ × irradiance) / π, W/(m² sr).
    ///
    /// Rays of one pixel that hit the same smooth surface share one gather in their middle, unless
    /// the radiosity at the vertices shows an edge of a shadow between them. So most pixels gather
    /// once, while edges are as clean as the rays are dense. Surfaces that reflect nothing do not
    /// gather. Mirrors and glass are followed as in [`Camera::interpolated_image`]. `progress` is
    /// called with the number of pixels done and of all pixels, several times a second. It may stop
    /// the work; the result is `None` then.
    ///
    /// # Errors
    /// Those of [`Camera::check`] and of `gatherer`.
    pub fn gathered_image(
        &self,
        light: &GatheredMesh,
        gatherer: &mut dyn Gather,
        width: u32,
        height: u32,
        samples: u32,
        mut progress: impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<Option<RadianceImage>, Error> {
        let GatheredMesh { mesh, surface, .. } = light;
        let rays = PrimaryRays::new(self, surface, Some(mesh), width, height, samples)?;
        // Bounds the memory for hits, some 10 MiB.
        let bands = rays.bands(width * height, 1 << 16);
        let view = GatheredView::new(LitSurface { rays, light });
        let field = light.radiosity_field();
        let mut pixels = vec![Rgb::ZERO; width as usize * height as usize];
        let mut sky = vec![false; pixels.len()];
        let total = pixels.len();
        let mut batches = Batches::new(64);
        for band in bands {
            let end = band.end;
            let (gathering, others): (Vec<PixelPart>, Vec<PixelPart>) =
                view.parts(band).into_iter().partition(|p| p.albedo != Rgb::ZERO);
            for part in others {
                pixels[part.pixel] += part.interpolated;
                sky[part.pixel] = part.is_whole_sky;
            }
            let mut queue = &gathering[..];
            while !queue.is_empty() {
                let (batch, gathered) = batches.try_next(&mut queue, |batch| {
                    let points: Vec<TwoSidedPoint> = batch.iter().map(|part| part.point).collect();
                    gather_two_sided(gatherer, &field, &points)
                })?;
                for (part, sample) in batch.iter().zip(&gathered) {
                    pixels[part.pixel] += part.radiance(sample);
                }
                // Parts of the last pixel may be in the next batch.
                let done = batch.last().map_or(0, |part| part.pixel);
                if agree(progress(done, total)).is_break() {
                    return Ok(None);
                }
            }
            if agree(progress(end as usize, total)).is_break() {
                return Ok(None);
            }
        }
        Ok(Some(RadianceImage { width, height, pixels, sky }))
    }
}

/// A group of a pixel's rays that hit one smooth surface and share a gather.
struct PixelPart {
    pixel: usize,
    point: TwoSidedPoint,
    /// Square root of the element's area, scene unit.
    size: f64,
    /// Fraction of the pixel's rays per channel, in [0, 1].
    weight: Rgb,
    exitance: Rgb,
    albedo: Rgb,
    /// Radiance that it adds to the pixel by the radiosity at vertices, W/(m² sr).
    interpolated: Rgb,
    /// Whether all rays of the pixel see the sky.
    is_whole_sky: bool,
}

impl PixelPart {
    /// Radiance that it adds to the pixel by the irradiance gathered at its point, W/(m² sr).
    fn radiance(&self, sample: &IrradianceSample) -> Rgb {
        if is_buried(sample, self.size) {
            return self.interpolated;
        }
        (self.exitance + self.albedo * sample.irradiance) * self.weight / PI
    }
}

/// A front hit of a ray or of a branch of it.
struct SeenHit {
    hit: Hit,
    /// Fraction of its radiance that reaches the camera, per channel, in [0, 1].
    weight: Rgb,
    sight: Sight,
}

/// Sky seen by the rays of a pixel.
#[derive(Default)]
struct SkySeen {
    /// Rays that reach the sky directly, without mirrors or glass.
    direct_rays: u32,
    /// Sum over all rays, W/(m² sr).
    radiance: Rgb,
}

/// Hits with the same history on the same smooth surface. The history is 0 for hits of primary
/// rays.
type Group = ((u64, u32), Vec<SeenHit>);

/// A solution as seen by the camera's rays.
struct GatheredView<'a> {
    lit: LitSurface<'a>,
    second_pass: Option<SecondPass>,
    offset: SurfaceOffset,
    /// Per triangle of the scene, the smooth surface that it is a part of.
    surfaces: Vec<u32>,
}

impl GatheredView<'_> {
    fn new(lit: LitSurface) -> GatheredView {
        let scene = lit.light.mesh.scene();
        GatheredView {
            offset: SurfaceOffset::new(scene),
            surfaces: SurfaceTopology::of_scene(scene).surfaces(),
            second_pass: SecondPass::new(&lit),
            lit,
        }
    }

    /// The parts of a range of pixels, in their order.
    fn parts(&self, pixels: Range<u32>) -> Vec<PixelPart> {
        pixels.into_par_iter().flat_map_iter(|k| self.parts_of_pixel(k)).collect()
    }

    fn parts_of_pixel(&self, pixel: u32) -> Vec<PixelPart> {
        let mut groups: Vec<Group> = vec![];
        let mut sky = SkySeen::default();
        let second_pass = self.second_pass.as_ref();
        SecondPass::sightings(second_pass, &self.lit, pixel, |sighting| {
            let Sighting { seen, weight, sight, history } = sighting;
            let hit = match seen {
                Seen::Front(hit) => hit,
                Seen::Sky(direction) => {
                    sky.direct_rays += u32::from(history == 0);
                    sky.radiance += weight * self.lit.light.surface.sky.radiance(direction);
                    return;
                }
            };
            let key = (history, self.smooth_surface(&hit));
            let hit = SeenHit { hit, weight, sight };
            match groups.iter_mut().find(|group| group.0 == key) {
                Some((_, hits)) => hits.push(hit),
                None => groups.push((key, vec![hit])),
            }
        });
        let mut parts = vec![];
        if sky.direct_rays > 0 || sky.radiance != Rgb::ZERO {
            parts.push(self.sky_part(pixel as usize, sky));
        }
        for ((history, _), hits) in &groups {
            self.add_parts(pixel as usize, *history, hits, &mut parts);
        }
        parts
    }

    /// The part of a pixel's rays that see the sky: nothing is gathered.
    fn sky_part(&self, pixel: usize, sky: SkySeen) -> PixelPart {
        let PrimaryRays { weight, samples, .. } = self.lit.rays;
        let nowhere = GatherPoint { position: self.lit.rays.eye, normal: DVec3::Y, near: 0.0 };
        PixelPart {
            pixel,
            point: TwoSidedPoint::one_sided(nowhere),
            size: 0.0,
            weight: Rgb::ZERO,
            exitance: Rgb::ZERO,
            albedo: Rgb::ZERO,
            interpolated: sky.radiance * weight,
            is_whole_sky: sky.direct_rays == samples * samples,
        }
    }

    /// Adds the hits on one smooth surface: as one part, or as several where the radiosity varies.
    fn add_parts(&self, pixel: usize, history: u64, hits: &[SeenHit], parts: &mut Vec<PixelPart>) {
        let radiosity = || hits.iter().map(|seen| self.lit.untextured_radiosity(&seen.hit));
        let sum: Rgb = radiosity().sum();
        let low = radiosity().fold(Rgb::INFINITY, Rgb::min);
        let spread = (radiosity().fold(Rgb::ZERO, Rgb::max) - low) * hits.len() as f64;
        // Rays among which radiosity differs by more than a tenth do not share a gather: an edge of
        // a shadow lies between them. Plain choice.
        if hits.len() > 1 && spread.length() > 0.1 * sum.length() {
            // Hits are in order of sub-pixel rows: the upper and the lower half.
            let (upper, lower) = hits.split_at(hits.len() / 2);
            self.add_parts(pixel, history, upper, parts);
            self.add_parts(pixel, history, lower, parts);
            return;
        }
        let hit = self.middle_hit(hits, history == 0);
        let (surface, mesh) = (&self.lit.light.surface, &self.lit.light.mesh);
        let node = mesh.element(self.lit.element(&hit));
        let size = mesh.area(node).sqrt();
        let (albedo, exitance, sum) = self.seen_of(hits);
        let weight: Rgb = hits.iter().map(|seen| seen.weight).sum();
        let normal =
            self.lit.rays.interpolate(&hit, &surface.normals).normalize_or(mesh.normal(node));
        let position = self.lit.rays.interpolate(&hit, &surface.positions);
        let point = self.offset.gather_point(position, normal, size);
        parts.push(PixelPart {
            pixel,
            point: TwoSidedPoint::new(point, mesh.material(node)),
            size,
            weight: self.lit.rays.weight * weight,
            exitance,
            albedo,
            interpolated: sum * self.lit.rays.weight / PI,
            is_whole_sky: false,
        });
    }

    /// Weighted means of albedo and exitance over the hits, and the weighted sum of their radiosity
    /// from the vertices, W/m².
    fn seen_of(&self, hits: &[SeenHit]) -> (Rgb, Rgb, Rgb) {
        let interpolated =
            |seen: &SeenHit| seen.weight * self.lit.radiosity(&seen.hit, &seen.sight);
        let interpolated = hits.iter().map(interpolated).sum();
        let t = hits[0].hit.triangle;
        if self.lit.scene().textures(t).is_none() {
            let material = self.lit.scene().material(t);
            return (material.albedo(), material.exitance, interpolated);
        }
        let (mut albedo, mut exitance, mut sum) = (Rgb::ZERO, Rgb::ZERO, Rgb::ZERO);
        for SeenHit { hit, weight, sight } in hits {
            let [scatters, emits] = self.lit.albedo_and_exitance(hit, sight);
            albedo += weight * scatters;
            exitance += weight * emits;
            sum += weight;
        }
        // Channels of weight 0 become 0 / MIN_POSITIVE = 0.
        let sum = sum.max(Rgb::splat(f64::MIN_POSITIVE));
        (albedo / sum, exitance / sum, interpolated)
    }

    /// The hit of the ray through the mean position of `hits`, if it is on their surface and they
    /// are `direct`; otherwise the one of `hits` that is nearest to that position. Light that is
    /// linear over the surface has its mean there.
    fn middle_hit(&self, hits: &[SeenHit], direct: bool) -> Hit {
        let position =
            |hit: &Hit| self.lit.rays.interpolate(hit, &self.lit.light.surface.positions);
        let mean = hits.iter().map(|seen| position(&seen.hit)).sum::<DVec3>() / hits.len() as f64;
        let surface = self.smooth_surface(&hits[0].hit);
        if direct
            && let Some(Seen::Front(hit)) = self.lit.rays.hit(mean - self.lit.rays.eye)
            && self.smooth_surface(&hit) == surface
        {
            return hit;
        }
        let distance = |hit: &Hit| position(hit).distance_squared(mean);
        let mut nearest = (distance(&hits[0].hit), hits[0].hit);
        for SeenHit { hit, .. } in &hits[1..] {
            let candidate = (distance(hit), *hit);
            if candidate.0 < nearest.0 {
                nearest = candidate;
            }
        }
        nearest.1
    }

    /// The smooth surface that was hit.
    fn smooth_surface(&self, hit: &Hit) -> u32 {
        self.surfaces[hit.triangle]
    }
}
