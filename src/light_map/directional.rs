//! How the irradiance of texels changes with the normal, for normal maps.
//!
//! ```text
//!      n        four normals tilted by 45°, and n itself: E(n') = E(n) + b · (n' − n), spherical
//!   ╲  │  ╱     harmonics of order 1 up to the choice of constants
//!    ╲ │ ╱      b: (E₁ − E₃) / (2 sin 45°) along a tangent, (E − mean) / (1 − cos 45°) along n
//! ```
//!
//! A tilted normal sees the surface itself below the horizon, as the side of a bump does.

use std::f64::consts::FRAC_1_SQRT_2;
use std::ops::ControlFlow;

use super::coverage::NO_TRIANGLE;
use super::gathered::{LightMap, check_scene, dilate, gatherer_past};
use super::texel_points::TexelPoints;
use crate::backend::Backend;
use crate::bake::BakeResult;
use crate::error::Error;
use crate::gather::{Gather, GatherPoint, GatheredMesh, IrradianceSample};
use crate::scene::Rgb;
use crate::work::{Batches, agree};

/// Tilted normals of a texel.
const NORMALS: usize = 4;

impl LightMap {
    /// The change b of the irradiance of each texel with the normal, along x, y and z of the scene:
    /// a surface with normal n' where the texel's is n receives E + b · (n' − n), W/m² per channel,
    /// at least 0. E is [`LightMap::irradiance`]. Four gathers a texel, with the accuracy of the
    /// bake's last vertices.
    ///
    /// `progress` is as in [`LightMap::of_bake`].
    ///
    /// # Errors
    /// Those of [`LightMap::of_bake`].
    pub fn directional(
        &self,
        baked: &BakeResult,
        backend: &Backend,
        progress: impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<Option<[Vec<Rgb>; 3]>, Error> {
        self.gather_directional(&baked.light, &mut *gatherer_past(baked, backend, false)?, progress)
    }

    /// The same by the caller's `gatherer`, for the scene of `light`.
    ///
    /// # Errors
    /// Those of [`LightMap::gather`].
    pub fn gather_directional(
        &self,
        light: &GatheredMesh,
        gatherer: &mut dyn Gather,
        mut progress: impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<Option<[Vec<Rgb>; 3]>, Error> {
        check_scene(&self.atlas, light)?;
        let (field, points) = (light.radiosity_field(), TexelPoints::new(&self.atlas));
        let is_lit =
            |&k: &u32| self.gathered[k as usize] && self.triangles[k as usize] != NO_TRIANGLE;
        let texels: Vec<u32> = (0..self.gathered.len() as u32).filter(is_lit).collect();
        let mut changes = [0; 3].map(|_| vec![Rgb::ZERO; self.gathered.len()]);
        let (mut remaining, mut batches) = (&texels[..], Batches::new(64));
        while !remaining.is_empty() {
            let point = |texel: u32| points.point(texel, self.triangles[texel as usize] as usize);
            let (batch, found) = batches.try_next(&mut remaining, |batch| {
                let around: Vec<GatherPoint> =
                    batch.iter().flat_map(|&texel| tilted(point(texel).point)).collect();
                let samples = gatherer.gather(&field, &around)?;
                let of_texel = |samples: &[IrradianceSample]| -> [Rgb; NORMALS] {
                    std::array::from_fn(|k| samples[k].irradiance)
                };
                Ok::<_, Error>(samples.chunks_exact(NORMALS).map(of_texel).collect())
            })?;
            for (&texel, [e0, e1, e2, e3]) in batch.iter().zip(found) {
                let normal = point(texel).point.normal;
                let (t, b) = normal.any_orthonormal_pair();
                let middle = self.irradiance[texel as usize];
                let along_tangents = [e0 - e2, e1 - e3].map(|d| d / (2.0 * FRAC_1_SQRT_2));
                let mean = (e0 + e1 + e2 + e3) / 4.0;
                let along_normal = (middle - mean) / (1.0 - FRAC_1_SQRT_2);
                for (axis, changes) in changes.iter_mut().enumerate() {
                    changes[texel as usize] = along_tangents[0] * t[axis]
                        + along_tangents[1] * b[axis]
                        + along_normal * normal[axis];
                }
            }
            if agree(progress(texels.len() - remaining.len(), texels.len())).is_break() {
                return Ok(None);
            }
        }
        changes.iter_mut().for_each(|values| dilate(values, &self.triangles, &self.atlas));
        Ok(Some(changes))
    }
}

/// The point with its normal tilted to four sides.
fn tilted(point: GatherPoint) -> [GatherPoint; NORMALS] {
    let (t, b) = point.normal.any_orthonormal_pair();
    [t, b, -t, -b].map(|side| {
        let normal = ((point.normal + side) * FRAC_1_SQRT_2).normalize();
        GatherPoint { normal, ..point }
    })
}
