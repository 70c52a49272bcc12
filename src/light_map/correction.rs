//! What a bake's light misses at texels, by paths.

use std::ops::ControlFlow;

use super::gathered::{LightMap, check_scene};
use super::texel_points::TexelPoints;
use crate::bake::BakeResult;
use crate::error::Error;
use crate::path_correction::{Goal, MissingLight, PathOrigin, missed_light, scales};
use crate::scene::Rgb;

/// Edge of the finest cells over which texels share paths, in texels.
const TEXELS_OF_CELL: f64 = 4.0;

impl LightMap {
    /// Corrects the irradiance of texels by paths, until the error of the light that they gathered,
    /// the root mean square over their area of errors as in [`accuracy`](crate::accuracy), is
    /// estimated to be at most `error`, a share. Returns that estimate: it is larger where the
    /// maximum number of paths, 2²³, does not suffice. What is lost of the light between texels is
    /// not in it. [`standard_error`](LightMap::standard_error) is that against the true light then.
    ///
    /// `baked` is the bake that the map was gathered from. The same map gives the same bits on any
    /// number of threads. `progress` is called with the number of paths done and of those that will
    /// be at least, several times a second; if it stops the work, the result is `None` and the map
    /// is as it was.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`](crate::ErrorKind::Setting) for the bake of another scene.
    pub fn correct(
        &mut self,
        baked: &BakeResult,
        error: f64,
        progress: impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<Option<f64>, Error> {
        check_scene(&self.atlas, &baked.light)?;
        let texels: Vec<u32> =
            (0..self.gathered.len() as u32).filter(|&k| self.gathered[k as usize]).collect();
        let sizes = texels.iter().map(|&texel| self.irradiance[texel as usize].length());
        let scales = scales(sizes, baked.settings.measure.floor);
        let points = TexelPoints::new(&self.atlas);
        let scene = self.atlas.scene();
        let (origin, diagonal) = (scene.bounds().low, scene.bounds().diagonal());
        let triangle = |texel: u32| self.triangles[texel as usize] as usize;
        let origin_of = |(&texel, &scale): (&u32, &f64)| {
            let point = points.point(texel, triangle(texel)).point;
            PathOrigin {
                position: (point.position - origin) / diagonal,
                normal: point.normal,
                scale,
                area: points.texel_size(triangle(texel)).powi(2),
            }
        };
        let origins: Vec<PathOrigin> = texels.iter().zip(&scales).map(origin_of).collect();
        let missing = MissingLight::new(&baked.light);
        let sample = |k: usize, path: usize| {
            let texel = texels[k];
            let point = points.point(texel, triangle(texel));
            let near_paths = self.near_paths[texel as usize];
            missing.irradiance_two_sided(&point, near_paths, path).to_array()
        };
        let finest = TEXELS_OF_CELL * self.atlas.texel_size() / diagonal;
        let (expected, goal) =
            ([baked.estimate.of_light(), baked.estimate.total], Goal::Mean(error));
        let Some(found) = missed_light(&origins, finest, expected, &goal, sample, progress) else {
            return Ok(None);
        };
        for (k, &texel) in texels.iter().enumerate() {
            let texel = texel as usize;
            let corrected = self.irradiance[texel] + scales[k] * Rgb::from_array(found.missed[k]);
            self.irradiance[texel] = corrected.max(Rgb::ZERO);
            let of_light = scales[k] * found.variance[k].sqrt();
            self.standard_error[texel] = self.standard_error[texel].hypot(of_light);
        }
        self.finish();
        Ok(Some(found.error))
    }
}
