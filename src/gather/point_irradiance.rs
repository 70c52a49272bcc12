//! Irradiance at points anywhere: on surfaces or in the air, each with its standard error.
//!
//! A point gathers four times, from slightly different heights. Each is another cell of the
//! rotation, so that directions differ while the light is the same. The mean is the irradiance, and
//! the scatter of the four gives its standard error:
//!
//! ```text
//!    ●  E_3        E = (E_0 + E_1 + E_2 + E_3) / 4
//!    ●  E_2
//!    ●  E_1        standard error = √(Σ (E_k − E)² / (4 · 3)), per channel
//!    ●  E_0
//!   ─┴─────── surface, if there is one
//! ```

use std::ops::ControlFlow;

use serde::{Deserialize, Serialize};

use super::two_sided::{TwoSidedPoint, gather_two_sided};
use super::{Gather, GatherPoint, GatheredMesh, IrradianceSample};
use crate::error::{Error, ErrorKind};
use crate::sampling::rotation::CellRotation;
use crate::scene::Rgb;
use crate::visibility::buried;
use crate::work::{Batches, agree};

/// Gathers of one point: few, and their standard error is yet seldom far too small. With three
/// degrees of freedom it is below a tenth of the true one once in 700 times; of two gathers, with
/// one degree, it is so once in twelve.
const GATHERS: usize = 4;

/// Irradiance at a point, and how well it is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PointIrradiance {
    /// Irradiance, W/m² per channel.
    pub irradiance: Rgb,
    /// Standard error of [`PointIrradiance::irradiance`] by sampling, W/m² per channel. What the
    /// light itself is off by is not in it.
    pub standard_error: Rgb,
    /// Share of the hemisphere in which nothing is seen, in [0, 1].
    pub escaped: f64,
    /// Share of the hemisphere in which backs of surfaces are seen, in [0, 1]: next to 1 inside of
    /// a solid.
    pub backface: f64,
}

impl PointIrradiance {
    /// Whether the point lies inside of a solid: it sees next to nothing but backs.
    pub fn is_buried(&self) -> bool {
        self.backface > buried::INSIDE
    }

    /// The mean of gathers, with their scatter.
    fn of_gathers(samples: &[IrradianceSample]) -> PointIrradiance {
        let share = 1.0 / samples.len() as f64;
        let mean =
            |value: fn(&IrradianceSample) -> f64| share * samples.iter().map(value).sum::<f64>();
        let irradiance = share * samples.iter().map(|s| s.irradiance).sum::<Rgb>();
        let deviations = samples.iter().map(|s| s.irradiance - irradiance);
        let squares = deviations.map(|d| d * d).sum::<Rgb>();
        let pairs = samples.len() * (samples.len() - 1).max(1);
        PointIrradiance {
            irradiance,
            standard_error: (squares / pairs as f64).sqrt(),
            escaped: mean(|s| s.escaped),
            backface: mean(|s| s.backface),
        }
    }
}

/// The irradiance that `light` causes at each of `points`, in their order. They may lie anywhere:
/// [`GatherPoint::above`] makes them of places on surfaces or in the air.
///
/// `gatherer` is of the scene of `light`; [`Backend::gather_to_noise`] makes one that casts as many
/// rays as a relative noise takes, more where they disagree. The same points give the same bits
/// whatever their order and however many threads there are. `progress` is called with the points
/// done and all of them, several times a second; where it stops the work, the result is `None`.
///
/// [`Backend::gather_to_noise`]: crate::Backend::gather_to_noise
///
/// # Errors
/// [`ErrorKind::Setting`] for a point whose numbers are not finite, whose normal has not length 1
/// or whose near distance is not positive; those of `gatherer`.
pub fn irradiance_at(
    light: &GatheredMesh,
    points: &[GatherPoint],
    gatherer: &mut dyn Gather,
    progress: impl FnMut(usize, usize) -> ControlFlow<()>,
) -> Result<Option<Vec<PointIrradiance>>, Error> {
    points.iter().enumerate().try_for_each(|(k, point)| point.check(k))?;
    let points: Vec<TwoSidedPoint> = points.iter().map(|&p| TwoSidedPoint::one_sided(p)).collect();
    two_sided_irradiance_at(light, &points, gatherer, progress)
}

/// The same for points on surfaces that light may come through.
///
/// # Errors
/// Those of `gatherer`.
pub(crate) fn two_sided_irradiance_at(
    light: &GatheredMesh,
    points: &[TwoSidedPoint],
    gatherer: &mut dyn Gather,
    mut progress: impl FnMut(usize, usize) -> ControlFlow<()>,
) -> Result<Option<Vec<PointIrradiance>>, Error> {
    let field = light.radiosity_field();
    let mut found = Vec::with_capacity(points.len());
    let mut remaining = points;
    let mut batches = Batches::new(gatherer.preferred_batch_len().div_ceil(GATHERS));
    while !remaining.is_empty() {
        let (_, irradiance) = batches.try_next(&mut remaining, |batch| {
            let heights = |&point| (0..GATHERS).map(move |k| raised(point, k));
            let batch: Vec<TwoSidedPoint> = batch.iter().flat_map(heights).collect();
            let samples = gather_two_sided(gatherer, &field, &batch)?;
            Ok::<_, Error>(samples.chunks(GATHERS).map(PointIrradiance::of_gathers).collect())
        })?;
        found.extend(irradiance);
        if agree(progress(found.len(), points.len())).is_break() {
            return Ok(None);
        }
    }
    Ok(Some(found))
}

/// Initial number of rays of each gather of a point for a relative `noise` of their mean, and the
/// noise that is allowed to each. All gathers together cast about the initial rays of a vertex of a
/// bake, 20 over the error; more are cast where they disagree.
pub(crate) fn rays_for_noise(noise: f64) -> (u32, f64) {
    let rays = (5.0 / noise).clamp(32.0, 16384.0);
    (rays.ceil() as u32, noise * (GATHERS as f64).sqrt())
}

/// `point` in another cell of the rotation for each `k`: no two heights share one.
fn raised(point: TwoSidedPoint, k: usize) -> TwoSidedPoint {
    // A step along an axis of the cells must exceed their edge, and the normal may be oblique.
    let step = 2.0 * CellRotation::LARGEST_CELL * point.point.near;
    point.raised_by(step * k as f64)
}

impl GatherPoint {
    /// Checks point `k` of a list.
    fn check(&self, k: usize) -> Result<(), Error> {
        let GatherPoint { position, normal, near } = self;
        let (found, remedy) = if !position.is_finite() {
            (format!("position {position}"), "give finite coordinates")
        } else if !normal.is_normalized() {
            (format!("normal {normal}"), "give a normal of length 1")
        } else if !(near.is_finite() && *near > 0.0) {
            (format!("near distance {near}"), "give a length above 0")
        } else {
            return Ok(());
        };
        Err(Error::new(ErrorKind::Setting, format!("gather point {k}"), found, remedy))
    }
}
