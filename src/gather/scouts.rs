//! Scouts: what corners do not see.
//!
//! Where all corners of an element are lit, a narrow shadow in its middle shows nowhere. So before
//! elements are taken for good, the middle of each gathers by few rays, once. Those where it is far
//! from what the corners interpolate to count with that error, and are split where it pays.

use super::gather_points::{SurfaceOffset, is_buried};
use super::sampled_mesh::{SampledMesh, after_split};
use super::two_sided::{TwoSidedPoint, gather_two_sided};
use super::{Gather, RadiosityField};
use crate::error::Error;
use crate::scene::Rgb;

/// Differences up to this, relative to the lesser, may be noise of few rays. Chosen by hand: where
/// it was 0.4 and rays were 16, two of three alarms were false.
const NOISE: f64 = 0.6;

/// Rays that look: fewer raise false alarms, and more cost as much as a vertex. Chosen by hand.
pub(crate) const SCOUT_RAYS: u32 = 128;

/// Share by which halves of them may disagree before there are more. Chosen by hand.
pub(crate) const SCOUT_NOISE: f64 = 0.15;

/// Elements smaller than this share of the mean are not looked at: they are many, and all of them
/// a tenth of the area. Chosen by hand.
pub(super) const LEAST_AREA: f64 = 0.3;

/// The error of an element, root mean square, over the difference in its middle: that of a bump
/// over the whole of it, whose shape is not known. Chosen by hand.
const RMS_OVER_MIDDLE: f64 = 0.5;

/// The error that each element was found to have, relative, root mean square.
#[derive(Clone)]
pub(super) struct Scouts {
    /// By element; NaN where nobody has looked yet.
    errors: Vec<f32>,
}

impl Scouts {
    /// For so many elements that nobody has looked at.
    pub fn new(elements: usize) -> Scouts {
        Scouts { errors: vec![f32::NAN; elements] }
    }

    /// The error that was found in element `e`: 0 where nobody has looked.
    pub fn error(&self, e: usize) -> f64 {
        let error = f64::from(self.errors[e]);
        if error.is_nan() { 0.0 } else { error }
    }

    /// Whether anybody has looked at element `e`.
    pub fn has_seen(&self, e: usize) -> bool {
        !self.errors[e].is_nan()
    }

    /// Takes over that four elements are in the place of each of `split` (ascending).
    pub fn split(&mut self, split: &[usize]) {
        self.errors = after_split(&self.errors, split, f32::NAN);
    }

    /// Looks at `elements`, the light of `source` by the rays of `gatherer`. Errors are relative to
    /// no less than `floor`, W/m²; places nearer than `touching` to what hides them see nothing.
    pub fn look(
        &mut self,
        samples: &SampledMesh,
        elements: &[usize],
        source: &RadiosityField,
        (floor, touching): (f64, f64),
        gatherer: &mut dyn Gather,
    ) -> Result<(), Error> {
        let mesh = &samples.mesh;
        let above = SurfaceOffset::new(mesh.scene());
        let place = |&e: &usize| {
            let node = mesh.element(e);
            TwoSidedPoint::new(above.above_element(mesh, node), mesh.material(node))
        };
        let places: Vec<TwoSidedPoint> = elements.iter().map(place).collect();
        let seen = gather_two_sided(gatherer, source, &places)?;
        for (&e, seen) in elements.iter().zip(&seen) {
            let material = mesh.material(mesh.element(e));
            let found = material.albedo() * seen.irradiance + material.exitance;
            let corners = samples.corners()[e].map(|v| samples.reflected[v as usize]);
            let expected = corners.iter().sum::<Rgb>() / 3.0 + material.exitance;
            let scale = found.length().min(expected.length()).max(floor);
            let difference = (found - expected).length() / scale;
            let is_known = !is_buried(seen, touching) && scale > 0.0;
            let is_off = is_known && difference > NOISE;
            self.errors[e] = if is_off { (RMS_OVER_MIDDLE * difference) as f32 } else { 0.0 };
        }
        Ok(())
    }
}
