//! A batch of vertices that gather at once.

use rayon::prelude::*;

use super::IrradianceSample;
use super::directional_light::{Direct, DirectionalLight};
use super::gather_points::VertexGatherPoints;
use crate::accuracy::hidden::LitRegion;
use crate::scene::Rgb;

/// A batch of vertices, with a sample at one point of each.
pub(super) struct Batch<'v> {
    pub vertices: &'v [u32],
    pub samples: Vec<IrradianceSample>,
}

/// Values of vertices, by their number.
pub(super) struct VertexValues<'s> {
    /// Reflected radiosity, W/m² per channel.
    pub reflected: &'s mut [Rgb],
    /// Standard errors of that, W/m²: lengths over the channels.
    pub noise: &'s mut [f64],
    pub buried: &'s mut [bool],
    pub hidden: &'s mut [bool],
    /// Empty where there is no directional light.
    pub direct: &'s mut [Direct],
}

impl Batch<'_> {
    /// Vertices whose point of this attempt is buried and that have another one.
    pub fn unresolved(&self, points: &VertexGatherPoints, attempt: usize) -> Vec<u32> {
        let pairs = self.vertices.par_iter().zip(&self.samples);
        pairs
            .filter(|&(&v, sample)| points.is_buried(v, sample) && points.has_more(v, attempt))
            .map(|(&v, _)| v)
            .collect()
    }

    /// Writes the samples of this `attempt` to the values of the vertices that it resolves, and the
    /// part of them that comes from `light` apart. The light is in `region`.
    pub fn apply(
        &self,
        points: &VertexGatherPoints,
        attempt: usize,
        region: &LitRegion,
        light: Option<&DirectionalLight>,
        values: &mut VertexValues,
    ) {
        let value = |(&v, sample): (&u32, &IrradianceSample)| {
            let is_buried = points.is_buried(v, sample);
            if is_buried && points.has_more(v, attempt) {
                return None;
            }
            // (ρ + τ) E, which is darkness at a buried vertex.
            let albedo = points.albedo(v);
            let noise = reflected_noise(albedo, sample);
            let is_hidden = points.outlook(v, sample).is_hidden(region, points.position(v));
            let direct = match light {
                Some(light) if !is_buried => {
                    light.reflected(albedo, &points.point(v, attempt), sample.directional)
                }
                _ => Direct::default(),
            };
            Some((v, albedo * sample.irradiance, noise, [is_buried, is_hidden], direct))
        };
        let pairs = self.vertices.par_iter().zip(&self.samples);
        let resolved: Vec<(u32, Rgb, f64, [bool; 2], Direct)> = pairs.filter_map(value).collect();
        for (v, reflected, noise, [is_buried, is_hidden], direct) in resolved {
            let v = v as usize;
            values.reflected[v] = reflected;
            values.noise[v] = noise;
            values.buried[v] = is_buried;
            values.hidden[v] = is_hidden;
            if light.is_some() {
                values.direct[v] = direct;
            }
        }
    }
}

/// Standard error of what a surface of `albedo` reflects of `sample`, W/m²: a length over the
/// channels, in each of which the noise is the same share of the light.
fn reflected_noise(albedo: Rgb, sample: &IrradianceSample) -> f64 {
    let all = sample.irradiance.length();
    if all > 0.0 { sample.noise * ((albedo * sample.irradiance).length() / all) } else { 0.0 }
}
