//! What a bake's light misses at texels, by paths.

use std::ops::ControlFlow;

use super::gathered::{LightMap, check_scene};
use super::texel_points::TexelPoints;
use crate::bake::BakeResult;
use crate::error::Error;
use crate::path_correction::{GatheredPoint, SurfaceGoal, correct_surface};

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
        let points = TexelPoints::new(&self.atlas);
        let point = |k: usize| {
            let texel = texels[k];
            let triangle = self.triangles[texel as usize] as usize;
            GatheredPoint {
                point: points.point(texel, triangle),
                area: points.texel_size(triangle).powi(2),
                irradiance: self.irradiance[texel as usize],
                near_paths: self.near_paths[texel as usize],
            }
        };
        let goal = SurfaceGoal {
            error,
            expected: [baked.estimate.of_light(), baked.estimate.total],
            floor: baked.settings.measure.floor,
            finest: TEXELS_OF_CELL * self.atlas.texel_size(),
        };
        let Some(found) = correct_surface(&baked.light, texels.len(), point, &goal, progress)
        else {
            return Ok(None);
        };
        for (k, &texel) in texels.iter().enumerate() {
            let texel = texel as usize;
            self.irradiance[texel] = found.irradiance[k];
            self.standard_error[texel] =
                libm::hypot(self.standard_error[texel], found.standard_error[k]);
        }
        self.finish();
        Ok(Some(found.error))
    }
}
