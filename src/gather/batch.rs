//! A batch of vertices that gather at once, and what follows for their values.

use super::gather_points::VertexGatherPoints;
use super::{Gather, GatherPoint, IrradianceSample, RadiosityField};
use crate::error::Error;
use crate::scene::Rgb;

/// A batch of vertices, and what was gathered at one point of each.
pub(super) struct Batch<'v> {
    pub vertices: &'v [u32],
    samples: Vec<IrradianceSample>,
    /// The same from the previous source, with the same points; where only differences are wanted.
    previous: Option<Vec<IrradianceSample>>,
}

/// Gathers one point for each of `vertices`.
pub(super) fn gather_batch<'v>(
    vertices: &'v [u32],
    places: Vec<GatherPoint>,
    source: &RadiosityField,
    previous: Option<&RadiosityField>,
    gatherer: &mut dyn Gather,
) -> Result<Batch<'v>, Error> {
    let samples = gatherer.gather(source, &places)?;
    let previous = match previous {
        Some(previous) => Some(gatherer.gather(previous, &places)?),
        None => None,
    };
    Ok(Batch { vertices, samples, previous })
}

impl Batch<'_> {
    /// Vertices whose point of this attempt is buried and that have another one.
    pub fn unresolved(&self, points: &VertexGatherPoints, attempt: usize) -> Vec<u32> {
        let pairs = self.vertices.iter().zip(&self.samples);
        pairs
            .filter(|&(&v, sample)| points.is_buried(v, sample) && points.has_more(v, attempt))
            .map(|(&v, _)| v)
            .collect()
    }

    /// Writes what was gathered to the `reflected` radiosity of the vertices, and which of them are
    /// `buried`.
    pub fn apply(&self, points: &VertexGatherPoints, reflected: &mut [Rgb], buried: &mut [bool]) {
        match &self.previous {
            Some(previous) => self.apply_difference(previous, points, reflected),
            None => self.apply_samples(points, reflected, buried),
        }
    }

    /// ρ E where a vertex is not buried.
    fn apply_samples(
        &self,
        points: &VertexGatherPoints,
        reflected: &mut [Rgb],
        buried: &mut [bool],
    ) {
        for (&v, sample) in self.vertices.iter().zip(&self.samples) {
            let is_buried = points.is_buried(v, sample);
            buried[v as usize] = is_buried;
            if !is_buried {
                reflected[v as usize] = points.reflectance(v) * sample.irradiance;
            }
        }
    }

    /// ρ (E − E_previous) added where a vertex is not buried; never below zero.
    fn apply_difference(
        &self,
        previous: &[IrradianceSample],
        points: &VertexGatherPoints,
        reflected: &mut [Rgb],
    ) {
        for (k, (&v, sample)) in self.vertices.iter().zip(&self.samples).enumerate() {
            if points.is_buried(v, sample) {
                continue;
            }
            let difference = sample.irradiance - previous[k].irradiance;
            let value = &mut reflected[v as usize];
            *value = (*value + points.reflectance(v) * difference).max(Rgb::ZERO);
        }
    }
}
