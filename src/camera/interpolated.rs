//! Images of a solution by the light interpolated between its vertices, with textures and mirrors.

use std::f64::consts::PI;
use std::ops::ControlFlow;

use super::second_pass::{SecondPass, Sighting};
use super::textured::LitSurface;
use super::{Camera, PrimaryRays, RadianceImage, Seen};
use crate::error::Error;
use crate::gather::GatheredMesh;
use crate::scene::Rgb;
use crate::work;

impl Camera {
    /// Draws `light` as [`Camera::image`] draws its surface, with textures: where a primary ray
    /// hits a textured material, the irradiance between the vertices is reflected by the texture at
    /// that point. Mirrors and glass ([`crate::scene::Specular`]) are followed: a ray goes on, and
    /// splits at glass, until it hits a diffuse surface or the sky. Branches that together weigh
    /// less than 1/1024 of the ray are dropped, as are those behind 512 boundaries, for example
    /// between two parallel mirrors: they count as the mean of the others. `progress` is called
    /// with the number of pixels done and of all pixels, several times a second. It may stop the
    /// work; the result is `None` then.
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
        let GatheredMesh { mesh, surface, .. } = light;
        let rays = PrimaryRays::new(self, surface, Some(mesh), width, height, samples)?;
        let count = width * height;
        // A tenth of a second on two cores.
        let bands = rays.bands(count, 1 << 18);
        let lit = LitSurface { rays, light };
        let second_pass = SecondPass::new(&lit);
        let (mut pixels, mut sky) = (Vec::with_capacity(count as usize), vec![]);
        for band in bands {
            let seen = |k: usize| radiance(&lit, second_pass.as_ref(), band.start + k as u32);
            for (radiance, is_sky) in work::map(band.len(), seen) {
                pixels.push(radiance);
                sky.push(is_sky);
            }
            if work::agree(progress(pixels.len(), count as usize)).is_break() {
                return Ok(None);
            }
        }
        Ok(Some(RadianceImage { width, height, pixels, sky }))
    }
}

/// Radiance of pixel `k`, W/(m² sr), and whether that is sky alone, seen directly.
fn radiance(lit: &LitSurface, second_pass: Option<&SecondPass>, k: u32) -> (Rgb, bool) {
    let (mut sum, mut sky_rays) = (Rgb::ZERO, 0);
    SecondPass::sightings(second_pass, lit, k, |Sighting { seen, weight, sight, history }| {
        sum += weight
            * match seen {
                Seen::Front(hit) => lit.radiosity(&hit, &sight) / PI,
                Seen::Sky(direction) => {
                    sky_rays += u32::from(history == 0);
                    lit.light.surface.sky.radiance(direction)
                }
            };
    });
    (sum * lit.rays.weight, sky_rays == lit.rays.samples * lit.rays.samples)
}
