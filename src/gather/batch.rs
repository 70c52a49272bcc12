//! A batch of vertices that gather at once, and what follows for their values.

use super::gather_points::VertexGatherPoints;
use super::two_sided::{TwoSidedPoint, gather_both_two_sided, gather_two_sided};
use super::{Gather, IrradianceSample, RadiosityField};
use crate::error::Error;
use crate::scene::Rgb;

/// A batch of vertices, and what was gathered at one point of each.
pub(super) struct Batch<'v> {
    pub vertices: &'v [u32],
    samples: Vec<IrradianceSample>,
    /// The same from the previous source, with the same points; where only differences are wanted.
    previous: Option<Vec<IrradianceSample>>,
}

/// What is known at the vertices, by their number.
pub(super) struct VertexValues<'s> {
    /// Reflected radiosity, W/m² per channel.
    pub reflected: &'s mut [Rgb],
    pub buried: &'s mut [bool],
    /// Mean of 1/distance, per scene unit.
    pub inverse_distance: &'s mut [f64],
}

/// Gathers one point for each of `vertices`.
pub(super) fn gather_batch<'v>(
    vertices: &'v [u32],
    places: Vec<TwoSidedPoint>,
    source: &RadiosityField,
    previous: Option<&RadiosityField>,
    gatherer: &mut dyn Gather,
) -> Result<Batch<'v>, Error> {
    let (samples, previous) = match previous {
        Some(previous) => {
            let fields = [source, previous];
            let [samples, previous] = gather_both_two_sided(gatherer, fields, &places)?;
            (samples, Some(previous))
        }
        None => (gather_two_sided(gatherer, source, &places)?, None),
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

    /// Writes what was gathered at this `attempt` to the values of the vertices that it resolves.
    pub fn apply(&self, points: &VertexGatherPoints, attempt: usize, values: &mut VertexValues) {
        for (k, (&v, sample)) in self.vertices.iter().zip(&self.samples).enumerate() {
            let is_buried = points.is_buried(v, sample);
            if is_buried && points.has_more(v, attempt) {
                continue;
            }
            let reflected = &mut values.reflected[v as usize];
            match &self.previous {
                // (ρ + τ) (E − E_previous) added; never below zero.
                Some(previous) => {
                    let difference = sample.irradiance - previous[k].irradiance;
                    *reflected = (*reflected + points.albedo(v) * difference).max(Rgb::ZERO);
                }
                // (ρ + τ) E, which is darkness at a buried vertex.
                None => {
                    *reflected = points.albedo(v) * sample.irradiance;
                    values.buried[v as usize] = is_buried;
                    values.inverse_distance[v as usize] = sample.inverse_distance;
                }
            }
        }
    }
}
