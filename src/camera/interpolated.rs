//! Images of a solution by the light between its vertices, with its textures.

use std::ops::ControlFlow;

use rayon::prelude::*;

use super::textured::LitSurface;
use super::{Camera, PrimaryRays, RadianceImage};
use crate::error::Error;
use crate::gather::GatheredMesh;

/// Primary rays between two reports of progress: a tenth of a second on two cores.
const RAYS_PER_BAND: u32 = 1 << 18;

impl Camera {
    /// Draws `light` as [`Camera::image`] draws its surface, with textures: where a primary ray
    /// meets a textured material, the irradiance between the vertices is reflected by the texture
    /// at that point. `progress` is called with the number of pixels done and of all pixels,
    /// several times a second. It may stop the work; the result is `None` then.
    ///
    /// # Errors
    /// Those of [`Camera::check`].
    pub fn interpolated_image(
        &self,
        light: &GatheredMesh,
        width: u32,
        height: u32,
        samples: u32,
        mut progress: impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<Option<RadianceImage>, Error> {
        let rays = PrimaryRays::of_light(self, light, width, height, samples)?;
        let count = width * height;
        let bands = rays.bands(count, RAYS_PER_BAND);
        let lit = LitSurface { rays, light };
        let (mut pixels, mut sky) = (Vec::with_capacity(count as usize), vec![]);
        for band in bands {
            let (seen, is_sky): (Vec<_>, Vec<_>) =
                lit.rays.pixels(band, &|hit| lit.radiosity(hit)).unzip();
            pixels.extend(seen);
            sky.extend(is_sky);
            if progress(pixels.len(), count as usize).is_break() {
                return Ok(None);
            }
        }
        Ok(Some(RadianceImage { width, height, pixels, sky }))
    }
}
