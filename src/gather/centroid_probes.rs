//! Centroid probes: gathers by few rays at the centroids of elements.
//!
//! If all corners of an element are lit, a narrow shadow in its middle affects no vertex, nor does
//! light that repeats itself from vertex to vertex, as of lamps in rows. So before refinement ends,
//! each centroid gathers once. As far as the light differs from the interpolant of the corners by
//! more than noise, the element has that error, and is split if it pays.

use super::gather_points::{SurfaceOffset, is_buried};
use super::refinement_indicator::ErrorScale;
use super::sampled_mesh::{SampledMesh, after_split};
use super::surplus::{CERTAIN_ERRORS, beyond_noise};
use super::two_sided::{TwoSidedPoint, gather_two_sided};
use super::{Gather, IrradianceSample, RadiosityField};
use crate::error::Error;
use crate::scene::Rgb;

/// Relative errors of elements, root mean square, by their centroids.
#[derive(Clone)]
pub(super) struct CentroidProbes {
    /// By element; NaN where it was not probed.
    errors: Vec<f32>,
}

impl CentroidProbes {
    /// For a number of `elements`, none of which was probed.
    pub fn new(elements: usize) -> CentroidProbes {
        CentroidProbes { errors: vec![f32::NAN; elements] }
    }

    /// The error of element `e`: 0 where it was not probed.
    pub fn error(&self, e: usize) -> f64 {
        let error = f64::from(self.errors[e]);
        if error.is_nan() { 0.0 } else { error }
    }

    /// Whether element `e` was probed.
    pub fn is_probed(&self, e: usize) -> bool {
        !self.errors[e].is_nan()
    }

    /// Replaces each of the elements `split` (ascending) by four that were not probed.
    pub fn split(&mut self, split: &[usize]) {
        self.errors = after_split(&self.errors, split, f32::NAN);
    }

    /// Sets the errors that the `elements` were probed to have.
    pub fn set(&mut self, elements: &[usize], errors: &[f32]) {
        elements.iter().zip(errors).for_each(|(&e, &error)| self.errors[e] = error);
    }
}

/// The errors of `elements`, by `source` gathered at their centroids. Errors are relative to at
/// least the floor of `scale`; centroids that are buried have none.
pub(super) fn probe(
    samples: &SampledMesh,
    elements: &[usize],
    source: &RadiosityField,
    scale: &ErrorScale,
    gatherer: &mut dyn Gather,
) -> Result<Vec<f32>, Error> {
    let mesh = &samples.mesh;
    let above = SurfaceOffset::new(mesh.scene());
    let point = |&e: &usize| {
        let node = mesh.element(e);
        TwoSidedPoint::new(above.above_element(mesh, node), mesh.material(node))
    };
    let points: Vec<TwoSidedPoint> = elements.iter().map(point).collect();
    let gathered = gather_two_sided(gatherer, source, &points)?;
    let error = |(&e, sample): (&usize, &IrradianceSample)| {
        let material = mesh.material(mesh.element(e));
        let probed = material.albedo() * sample.irradiance + material.exitance;
        let corners = samples.corners()[e].map(|v| samples.reflected[v as usize]);
        let expected = corners.iter().sum::<Rgb>() / 3.0 + material.exitance;
        let darker = probed.length().min(expected.length()).max(scale.radiosity_floor);
        let of_corners = samples.corners()[e].map(|v| samples.noise[v as usize].powi(2));
        let own = material.albedo().max_element() * sample.noise;
        let noise = (own * own + of_corners.iter().sum::<f64>() / 9.0).sqrt();
        let difference = beyond_noise((probed - expected).length(), CERTAIN_ERRORS * noise);
        let is_known = !is_buried(sample, scale.touching()) && darker > 0.0;
        // Of a bump of unknown shape over the whole element, half is the root mean square.
        if is_known { (0.5 * difference / darker) as f32 } else { 0.0 }
    };
    Ok(elements.iter().zip(&gathered).map(error).collect())
}
