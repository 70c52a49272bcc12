//! The camera image for the final picture: each pixel gathers the light where it looks.

use std::f64::consts::PI;
use std::ops::ControlFlow;
use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use super::{Camera, PrimaryRays, RadianceImage};
use crate::error::Error;
use crate::gather::GatheredMesh;
use crate::gather::gather_points::{SurfaceOffset, is_buried};
use crate::gather::{Gather, GatherPoint, IrradianceSample};
use crate::mesh::SurfaceTopology;
use crate::progress::BatchSizer;
use crate::scene::Rgb;
use crate::visibility::ray_scene::Hit;

/// Lines of sight that are cast at once.
const BAND: u32 = 1 << 16;

/// Lines of sight share a gather unless the vertices' values differ by more than this share among
/// them: at edges of shadows.
const VARIES: f64 = 0.1;

impl Camera {
    /// Draws `light` with the lines of sight of [`Camera::image`], but lets the pixels gather for
    /// themselves: the radiance of a point is (E + ρ × irradiance) / π, W/(m² sr), with the
    /// irradiance that `gather` finds there.
    ///
    /// Lines of one pixel that meet the same smooth surface share one gather in their middle, unless
    /// the vertices tell of an edge of a shadow between them. So most pixels gather once, while edges
    /// are as clean as the lines are dense. What reflects nothing does not gather. `progress` is told
    /// how many pixels are done, and of how many, several times a second. It may stop the work: then
    /// there is no image.
    ///
    /// # Errors
    /// Those of [`Camera::check`]; whatever `gather` fails with.
    pub fn gathered_image(
        &self,
        light: &GatheredMesh,
        gather: &mut dyn Gather,
        width: u32,
        height: u32,
        samples: u32,
        mut progress: impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<Option<RadianceImage>, Error> {
        let sight = PrimaryRays::new(self, &light.surface, width, height, samples)?;
        let view = View::new(sight, light);
        let mut pixels = vec![Rgb::ZERO; width as usize * height as usize];
        let (of, band) = (pixels.len(), (BAND / (samples * samples)).max(1));
        let mut pace = BatchSizer::new(64);
        for start in (0..width * height).step_by(band as usize) {
            let end = start.saturating_add(band).min(width * height);
            let parts = view.parts(start..end);
            let (gathers, others): (Vec<Part>, Vec<Part>) =
                parts.into_iter().partition(|part| part.reflectance != Rgb::ZERO);
            others.iter().for_each(|part| pixels[part.pixel] += part.known);
            let mut left = &gathers[..];
            while !left.is_empty() {
                let done = pace.next(&mut left, |now| {
                    let places: Vec<GatherPoint> = now.iter().map(|part| part.place).collect();
                    let found = gather.gather(&light.radiosity_field(), &places)?;
                    for (part, found) in now.iter().zip(&found) {
                        pixels[part.pixel] += part.radiance(found);
                    }
                    // Of the last pixel, parts may be left.
                    Ok::<_, Error>(now.last().map_or(0, |part| part.pixel))
                })?;
                if progress(done, of).is_break() {
                    return Ok(None);
                }
            }
            if progress(end as usize, of).is_break() {
                return Ok(None);
            }
        }
        Ok(Some(RadianceImage { width, height, pixels }))
    }
}

/// What a pixel sees of one smooth surface.
struct Part {
    pixel: usize,
    place: GatherPoint,
    /// Square root of the element's area, scene unit.
    size: f64,
    /// Share of the pixel, in (0, 1].
    share: f64,
    exitance: Rgb,
    reflectance: Rgb,
    /// What it adds to the pixel by the values at vertices, W/(m² sr).
    known: Rgb,
}

impl Part {
    /// What it adds to the pixel by what was gathered, W/(m² sr).
    fn radiance(&self, found: &IrradianceSample) -> Rgb {
        if is_buried(found, self.size) {
            return self.known;
        }
        (self.exitance + self.reflectance * found.irradiance) * self.share / PI
    }
}

/// Settled light, as it is looked at.
struct View<'a> {
    sight: PrimaryRays<'a>,
    light: &'a GatheredMesh,
    above: SurfaceOffset,
    /// Per triangle, the smooth surface that it is a part of.
    surfaces: Vec<u32>,
}

impl View<'_> {
    fn new<'a>(sight: PrimaryRays<'a>, light: &'a GatheredMesh) -> View<'a> {
        let scene = light.mesh.scene();
        View {
            sight,
            light,
            above: SurfaceOffset::new(scene),
            surfaces: SurfaceTopology::new(scene).surfaces(),
        }
    }

    /// What a range of pixels sees, in their order.
    fn parts(&self, pixels: Range<u32>) -> Vec<Part> {
        let parts: Vec<Vec<Part>> = pixels.into_par_iter().map(|k| self.parts_of(k)).collect();
        parts.into_iter().flatten().collect()
    }

    fn parts_of(&self, pixel: u32) -> Vec<Part> {
        let mut surfaces: Vec<(u32, Vec<Hit>)> = vec![];
        for hit in self.sight.hits(pixel) {
            let surface = self.surface(&hit);
            match surfaces.iter_mut().find(|s| s.0 == surface) {
                Some((_, hits)) => hits.push(hit),
                None => surfaces.push((surface, vec![hit])),
            }
        }
        let mut parts = vec![];
        surfaces.iter().for_each(|(_, hits)| self.add_parts(pixel as usize, hits, &mut parts));
        parts
    }

    /// Adds what the lines that hit one surface see of it: one part, or more where the light varies.
    fn add_parts(&self, pixel: usize, hits: &[Hit], parts: &mut Vec<Part>) {
        let values = || hits.iter().map(|hit| self.sight.at(hit, &self.light.surface.radiosity));
        let known: Rgb = values().sum();
        let low = values().fold(Rgb::INFINITY, Rgb::min);
        let spread = (values().fold(Rgb::ZERO, Rgb::max) - low) * hits.len() as f64;
        if hits.len() > 1 && spread.length() > VARIES * known.length() {
            let (above, below) = hits.split_at(hits.len() / 2);
            self.add_parts(pixel, above, parts);
            self.add_parts(pixel, below, parts);
            return;
        }
        let hit = self.middle(hits);
        let (surface, mesh) = (&self.light.surface, &self.light.mesh);
        let node = mesh.element(self.element(&hit));
        let (size, material) = (mesh.area(node).sqrt(), mesh.material(node));
        let normal = self.sight.at(&hit, &surface.normals).normalize_or(mesh.normal(node));
        parts.push(Part {
            pixel,
            place: self.above.gather_point(self.sight.at(&hit, &surface.positions), normal, size),
            size,
            share: self.sight.share * hits.len() as f64,
            exitance: material.exitance,
            reflectance: material.reflectance,
            known: known * self.sight.share / PI,
        });
    }

    /// Where the line of sight through the mean of `hits` meets their surface, or else the nearest of
    /// them. Light that is linear over the surface has its mean there.
    fn middle(&self, hits: &[Hit]) -> Hit {
        let position = |hit: &Hit| self.sight.at(hit, &self.light.surface.positions);
        let mean = hits.iter().map(position).sum::<DVec3>() / hits.len() as f64;
        let away = |hit: &Hit| position(hit).distance_squared(mean);
        let first = (away(&hits[0]), hits[0]);
        let nearest = hits
            .iter()
            .map(|hit| (away(hit), *hit))
            .fold(first, |a, b| if b.0 < a.0 { b } else { a });
        let met = self.sight.hit(mean - self.sight.eye);
        met.filter(|hit| self.surface(hit) == self.surface(&hits[0])).unwrap_or(nearest.1)
    }

    fn element(&self, hit: &Hit) -> usize {
        self.light.surface.elements[hit.triangle] as usize
    }

    /// The smooth surface that was hit.
    fn surface(&self, hit: &Hit) -> u32 {
        let mesh = &self.light.mesh;
        self.surfaces[mesh.triangle(mesh.element(self.element(hit)))]
    }
}
