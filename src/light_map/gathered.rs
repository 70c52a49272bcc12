//! Texels that gather the light of a bake.

use std::ops::ControlFlow;

use super::atlas::Atlas;
use super::coverage::{NO_TRIANGLE, triangles_of_texels};
use super::dilation::fill_from_neighbours;
use super::seams;
use super::texel_points::TexelPoints;
use crate::backend::{Backend, GatherRays};
use crate::bake::BakeResult;
use crate::error::{Error, ErrorKind};
use crate::gather::gather_points::is_buried;
use crate::gather::two_sided::{TwoSidedPoint, gather_two_sided};
use crate::gather::{Gather, GatheredMesh, IrradianceSample};
use crate::scene::Rgb;
use crate::work::{Batches, agree};

/// The irradiance of all surfaces of a scene in one texture.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct LightMap {
    /// Its texture coordinates.
    pub atlas: Atlas,
    /// Irradiance of each texel, row by row from the top, W/m² per channel, linear: multiplied by a
    /// surface's reflectance, texture included, it gives the reflected radiosity. On a translucent
    /// surface it is the mean of both sides, like
    /// [`VertexMesh::irradiance`](crate::VertexMesh::irradiance).
    pub irradiance: Vec<Rgb>,
    /// Whether a texel gathered. Others are empty, or filled from their neighbours.
    pub gathered: Vec<bool>,
    /// Standard error of each texel that gathered, W/m², a length over the channels: by sampling
    /// alone until the map is [corrected](LightMap::correct).
    pub standard_error: Vec<f64>,
    /// Whether paths had the light of near surfaces at a texel.
    pub(super) near_paths: Vec<bool>,
    /// The triangle on which each texel gathers, or none.
    pub(super) triangles: Vec<u32>,
}

impl LightMap {
    /// The light of a bake, gathered at the texels of `atlas`: with the final number of rays of its
    /// vertices, so that a texel has the requested accuracy. If the device fails, rays on the CPU
    /// continue.
    ///
    /// Texels inside solids, and below objects that stand on their surface, are filled from their
    /// neighbours. `progress` is called with the number of texels done and of all texels, several
    /// times a second; if it stops the work, the result is `None`. The same bake and atlas give the
    /// same bits, on any number of threads.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] for the bake of another scene than that of `atlas`; those of
    /// [`Backend::gather`].
    pub fn of_bake(
        atlas: Atlas,
        baked: &BakeResult,
        backend: &Backend,
        progress: impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<Option<LightMap>, Error> {
        LightMap::gather(atlas, &baked.light, &mut *gatherer(baked, backend)?, progress)
    }

    /// The same by the caller's `gatherer`, for the scene of `light`.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] for light of another scene than that of `atlas`; those of `gatherer`.
    pub fn gather(
        atlas: Atlas,
        light: &GatheredMesh,
        gatherer: &mut dyn Gather,
        mut progress: impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<Option<LightMap>, Error> {
        check_scene(&atlas, light)?;
        let corners = (0..atlas.coordinates.len()).map(|t| atlas.corners(t));
        let triangles = triangles_of_texels(atlas.size, corners);
        let covered: Vec<u32> = (0..triangles.len() as u32)
            .filter(|&texel| triangles[texel as usize] != NO_TRIANGLE)
            .collect();
        if agree(progress(0, covered.len())).is_break() {
            return Ok(None);
        }
        let mut map = LightMap::empty(atlas.clone(), triangles);
        let (field, points) = (light.radiosity_field(), TexelPoints::new(&atlas));
        let (mut remaining, mut batches) = (&covered[..], Batches::new(256));
        while !remaining.is_empty() {
            let (batch, samples) = batches.try_next(&mut remaining, |batch| {
                let point = |&texel: &u32| points.point(texel, map.triangle(texel));
                let batch_points: Vec<TwoSidedPoint> = batch.iter().map(point).collect();
                gather_two_sided(gatherer, &field, &batch_points)
            })?;
            for (&texel, sample) in batch.iter().zip(&samples) {
                let size = points.texel_size(map.triangle(texel));
                map.set(texel as usize, sample, !is_buried(sample, size));
            }
            if agree(progress(covered.len() - remaining.len(), covered.len())).is_break() {
                return Ok(None);
            }
        }
        map.finish();
        Ok(Some(map))
    }

    /// A map whose texels gather on these triangles, or on none, and did not yet.
    fn empty(atlas: Atlas, triangles: Vec<u32>) -> LightMap {
        let count = triangles.len();
        LightMap {
            atlas,
            // The system gives it zeroed, and page by page as texels are gathered: 1.6 GB at 8192².
            irradiance: bytemuck::allocation::zeroed_vec(count),
            gathered: vec![false; count],
            standard_error: vec![0.0; count],
            near_paths: vec![false; count],
            triangles,
        }
    }

    /// The triangle that a texel gathers on.
    fn triangle(&self, texel: u32) -> usize {
        self.triangles[texel as usize] as usize
    }

    /// Sets what a texel gathered: it counts if the texel `is_open`, not inside of anything.
    fn set(&mut self, texel: usize, sample: &IrradianceSample, is_open: bool) {
        self.irradiance[texel] = sample.irradiance;
        self.standard_error[texel] = sample.noise;
        self.near_paths[texel] = sample.near_paths;
        self.gathered[texel] = is_open;
    }

    /// Fills texels that did not gather, and makes seams agree.
    pub(super) fn finish(&mut self) {
        let LightMap { atlas, irradiance, gathered, triangles, .. } = self;
        let is_buried = |&k: &u32| triangles[k as usize] != NO_TRIANGLE && !gathered[k as usize];
        let buried = (0..triangles.len() as u32).filter(is_buried).collect();
        let mut known = gathered.clone();
        fill_from_neighbours(irradiance, &mut known, atlas.size, buried, usize::MAX);
        seams::weld(atlas, irradiance);
        dilate(irradiance, triangles, atlas);
    }

    /// Radiosity of each texel, W/m² per channel: exitance and reflected light of its material,
    /// without textures.
    pub fn radiosity(&self) -> Vec<Rgb> {
        let scene = self.atlas.scene();
        let of_texel = |(&t, &irradiance): (&u32, &Rgb)| {
            if t == NO_TRIANGLE {
                return Rgb::ZERO;
            }
            let material = scene.material(t as usize);
            material.exitance + material.albedo() * irradiance
        };
        let mut radiosity: Vec<Rgb> =
            self.triangles.iter().zip(&self.irradiance).map(of_texel).collect();
        dilate(&mut radiosity, &self.triangles, &self.atlas);
        radiosity
    }

    /// Fraction of all texels that triangles cover, in [0, 1].
    pub fn coverage(&self) -> f64 {
        let covered = self.covered().iter().filter(|&&covered| covered).count();
        covered as f64 / self.triangles.len() as f64
    }

    /// Whether triangles cover each texel.
    pub(super) fn covered(&self) -> Vec<bool> {
        self.triangles.iter().map(|&t| t != NO_TRIANGLE).collect()
    }
}

/// A gatherer for the light of `baked` with the accuracy of its last vertices.
pub(super) fn gatherer<'a>(
    baked: &BakeResult,
    backend: &Backend,
) -> Result<Box<dyn Gather + 'a>, Error> {
    gatherer_past(baked, backend, true)
}

/// The same, which leaves near surfaces to paths where they have a `near_field` of their own.
pub(super) fn gatherer_past<'a>(
    baked: &BakeResult,
    backend: &Backend,
    near_field: bool,
) -> Result<Box<dyn Gather + 'a>, Error> {
    let dim = baked.light.radiosity_field().radiosity_floor(baked.settings.measure.floor);
    let (rays, noise) = match &baked.settings.gather {
        Some(settings) => (settings.rays, settings.noise_tolerance),
        // For an error of about 2 %.
        None => (1024, f64::INFINITY),
    };
    let rays = GatherRays { near_field, ..GatherRays::of_many(rays, noise, dim) };
    backend.gather_with_fallback(&baked.light.mesh, rays, |_| ())
}

/// Fills empty texels next to charts from their neighbours.
pub(super) fn dilate(values: &mut [Rgb], triangles: &[u32], atlas: &Atlas) {
    let mut known: Vec<bool> = triangles.iter().map(|&t| t != NO_TRIANGLE).collect();
    let empty = (0..known.len() as u32).filter(|&k| !known[k as usize]).collect();
    let rings = atlas.filled_texels() as usize;
    fill_from_neighbours(values, &mut known, atlas.size, empty, rings);
}

/// Checks that `light` is that of the scene of `atlas`, whose triangles a bake may have cut.
pub(super) fn check_scene(atlas: &Atlas, light: &GatheredMesh) -> Result<(), Error> {
    let (scene, other) = (atlas.scene(), light.mesh.scene());
    if scene.groups() == other.groups() && scene.materials() == other.materials() {
        return Ok(());
    }
    let remedy = "bake the scene that the atlas was made for";
    Err(Error::new(ErrorKind::Setting, "light to gather", "light of another scene", remedy))
}
