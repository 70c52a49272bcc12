//! What arrives on the two sides of a translucent surface, as one irradiance.
//!
//! B − E = ρ E_front + τ E_back = (ρ + τ) E, with E the mean of both irradiances by the shares that
//! leave of each. So whatever follows has one irradiance and one albedo, as on any other surface.

use glam::DVec3;

use super::{Gather, GatherPoint, IrradianceSample, RadiosityField};
use crate::error::Error;
use crate::scene::{Material, Rgb};
use crate::visibility::offset;

/// A gather point, and how much counts what arrives on the other side of its surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TwoSidedPoint {
    pub point: GatherPoint,
    /// Of the point above the surface, scene unit.
    height: f64,
    /// τ / (ρ + τ) per channel, in [0, 1].
    behind: Rgb,
    /// What its squared error counts.
    weight: f64,
}

impl TwoSidedPoint {
    /// `point` on a surface of `material`.
    pub fn new(point: GatherPoint, material: &Material) -> TwoSidedPoint {
        let albedo = material.albedo();
        let share = material.transmittance / albedo;
        let behind = Rgb::select(albedo.cmpgt(Rgb::ZERO), share, Rgb::ZERO);
        TwoSidedPoint { behind, ..TwoSidedPoint::one_sided(point) }
    }

    /// `point`, on a surface whose other side does not count.
    pub fn one_sided(point: GatherPoint) -> TwoSidedPoint {
        let height = point.near / offset::NEAR_OF_LIFT;
        TwoSidedPoint { point, height, behind: Rgb::ZERO, weight: 1.0 }
    }

    /// The same, whose squared error counts `weight`.
    pub fn weighing(self, weight: f64) -> TwoSidedPoint {
        TwoSidedPoint { weight, ..self }
    }

    /// A point beside, `inward`, by 0.5e-3 to 1.5e-3 of `size` (scene unit), that of the element:
    /// the light is the same there, and the rotation of the directions another. The step depends on
    /// `turn`, in [0, 1).
    pub fn beside(self, inward: DVec3, size: f64, turn: f64) -> TwoSidedPoint {
        let step = (1e-3 * size * (0.5 + turn)).min(inward.length());
        self.moved_by(inward.normalize_or_zero() * step)
    }

    /// The same a `step` further on.
    fn moved_by(self, step: DVec3) -> TwoSidedPoint {
        let point = GatherPoint { position: self.point.position + step, ..self.point };
        TwoSidedPoint { point, ..self }
    }

    /// By how much what arrives on the point's own side counts per channel, and on the other.
    pub fn shares(&self) -> [Rgb; 2] {
        [Rgb::ONE - self.behind, self.behind]
    }

    /// The same a `step` higher above the surface, scene unit.
    pub fn raised_by(self, step: f64) -> TwoSidedPoint {
        let raised = self.moved_by(step * self.point.normal);
        TwoSidedPoint { height: self.height + step, ..raised }
    }

    /// The point on the other side of the surface, as far below it as this is above.
    pub fn other_side(&self) -> GatherPoint {
        let GatherPoint { position, normal, near } = self.point;
        GatherPoint { position: position - 2.0 * self.height * normal, normal: -normal, near }
    }
}

/// What `gatherer` finds at `points`, with the irradiance and direct light of both sides where the
/// other counts. All else is of the points' own side.
///
/// # Errors
/// Those of [`Gather::gather`].
pub(crate) fn gather_two_sided(
    gatherer: &mut dyn Gather,
    field: &RadiosityField,
    points: &[TwoSidedPoint],
) -> Result<Vec<IrradianceSample>, Error> {
    let [samples] = with_both_sides(points, |points, weights| {
        Ok([gatherer.gather_weighted(field, points, weights)?])
    })?;
    Ok(samples)
}

/// The same from two fields of one scene, field by field, with the same directions.
///
/// # Errors
/// Those of [`Gather::gather`].
pub(crate) fn gather_both_two_sided(
    gatherer: &mut dyn Gather,
    fields: [&RadiosityField; 2],
    points: &[TwoSidedPoint],
) -> Result<[Vec<IrradianceSample>; 2], Error> {
    with_both_sides(points, |points, _| gatherer.gather_both(fields, points))
}

/// Samples of each of some fields.
type ByField<const FIELDS: usize> = [Vec<IrradianceSample>; FIELDS];

/// What `gather` finds at `points` from each of its fields, on both sides.
fn with_both_sides<const FIELDS: usize>(
    points: &[TwoSidedPoint],
    mut gather: impl FnMut(&[GatherPoint], &[f64]) -> Result<ByField<FIELDS>, Error>,
) -> Result<ByField<FIELDS>, Error> {
    let fronts: Vec<GatherPoint> = points.iter().map(|p| p.point).collect();
    let weights: Vec<f64> = points.iter().map(|p| p.weight).collect();
    let mut samples = gather(&fronts, &weights)?;
    let is_two_sided = |k: &usize| points[*k].behind != Rgb::ZERO;
    let two_sided: Vec<usize> = (0..points.len()).filter(is_two_sided).collect();
    if two_sided.is_empty() {
        return Ok(samples);
    }
    let backs: Vec<GatherPoint> = two_sided.iter().map(|&k| points[k].other_side()).collect();
    let weights: Vec<f64> = two_sided.iter().map(|&k| weights[k]).collect();
    for (samples, behind) in samples.iter_mut().zip(gather(&backs, &weights)?) {
        for (&k, &back) in two_sided.iter().zip(&behind) {
            samples[k] = mixed(samples[k], back, points[k].behind);
        }
    }
    Ok(samples)
}

/// `front` with the light of both sides, of which the other one counts with `share`.
fn mixed(front: IrradianceSample, back: IrradianceSample, share: Rgb) -> IrradianceSample {
    let mean = share.element_sum() / 3.0;
    IrradianceSample {
        irradiance: front.irradiance + share * (back.irradiance - front.irradiance),
        direct: front.direct + share * (back.direct - front.direct),
        directional: match (front.directional, back.directional) {
            (Some(front), Some(back)) => Some(front + share * (back - front)),
            _ => None,
        },
        noise: libm::hypot((1.0 - mean) * front.noise, mean * back.noise),
        near_paths: front.near_paths || back.near_paths,
        ..front
    }
}
