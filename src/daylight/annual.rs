//! What a year of daylight is at points: autonomy, useful illuminance, light exposure, sun.

use std::ops::ControlFlow;
use std::sync::Arc;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::coefficients::{DaylightCoefficients, direct};
use super::year::{BATCHES, DaylightYear, LitHour};
use crate::error::{Error, ErrorKind};
use crate::gather::GatherPoint;
use crate::light::PathTracer;
use crate::scene::Scene;
use crate::visibility::buried;
use crate::work::{Batches, agree};

/// What counts, and how exact it is to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnnualSettings {
    /// Illuminance of daylight autonomy, lx.
    pub target: f64,
    /// Limits of useful daylight illuminance, lx: too dark, supplementary, autonomous, too bright
    /// (Mardaljevic et al. 2012).
    pub useful: [f64; 3],
    /// Illuminance by the sun alone that counts as exposure to it, lx (IES LM-83-12).
    pub sun: f64,
    /// Error of the exposure in the year, as a share: 95 % of the points are off by less.
    pub error: f64,
}

impl Default for AnnualSettings {
    fn default() -> AnnualSettings {
        AnnualSettings { target: 300.0, useful: [100.0, 300.0, 3000.0], sun: 1000.0, error: 0.05 }
    }
}

/// A number and its standard error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// Its standard error: by paths and by the width of patches.
    pub error: f64,
}

/// A year of daylight at a point. Shares are of the occupied hours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AnnualDaylight {
    /// Share of hours with at least the target: DA (Reinhart and Walkenhorst 2001).
    pub autonomy: Estimate,
    /// The same where hours below the target count with their share of it: cDA (Rogers 2006).
    pub continuous: Estimate,
    /// Shares of hours in the classes of useful daylight illuminance (Nabil and Mardaljevic 2005).
    pub useful: [Estimate; 4],
    /// Sum over all hours, lx h.
    pub exposure: Estimate,
    /// Occupied hours with direct sun above its limit.
    pub sun_hours: f64,
    /// Share of the point's hemisphere in which backs are seen.
    pub backface: f64,
    /// Paths.
    pub paths: usize,
}

impl AnnualDaylight {
    /// Whether the point lies inside of a solid.
    pub fn is_buried(&self) -> bool {
        self.backface > buried::INSIDE
    }
}

/// Paths of each batch: at first, and maximum; 8 192 and 2²⁰ of a point.
const PATHS: [usize; 2] = [512, 1 << 16];

/// Sums over hours: autonomy, continuous autonomy, three classes above the first, exposure.
type Sums = [f64; 6];

/// The daylight of `year` at `points` of `scene`; what shines in the scene itself, and its sky, do
/// not count. Coefficients get paths until the standard error of the exposure by them is 0.4 of the
/// error that is asked for, which leaves 0.3 to the width of patches. The same points give the same
/// bits on any number of threads. `progress` is called with the points done and all of them; where
/// it stops the work, the result is `None`.
///
/// # Errors
/// [`ErrorKind::Setting`] for an error that is not above 0.
pub fn annual_daylight(
    scene: &Arc<Scene>,
    year: &DaylightYear,
    points: &[GatherPoint],
    settings: &AnnualSettings,
    mut progress: impl FnMut(usize, usize) -> ControlFlow<()>,
) -> Result<Option<Vec<AnnualDaylight>>, Error> {
    if settings.error.is_nan() || settings.error <= 0.0 {
        let remedy = "give a share above 0, such as 0.05";
        let found = settings.error.to_string();
        return Err(Error::new(ErrorKind::Setting, "error of daylight", found, remedy));
    }
    let tracer = PathTracer::of_shared(scene.clone());
    let (mut remaining, mut done) = (points, vec![]);
    let mut batches = Batches::new(rayon::current_num_threads());
    while !remaining.is_empty() {
        let at = |point: &GatherPoint| of_point(&tracer, year, point, settings);
        let (_, found) = batches.next(&mut remaining, |batch| {
            batch.par_iter().map(at).collect::<Vec<AnnualDaylight>>()
        });
        done.extend(found);
        if agree(progress(done.len(), points.len())).is_break() {
            return Ok(None);
        }
    }
    Ok(Some(done))
}

fn of_point(
    tracer: &PathTracer,
    year: &DaylightYear,
    point: &GatherPoint,
    settings: &AnnualSettings,
) -> AnnualDaylight {
    let sunlight = |hour: &LitHour| {
        hour.sun.map_or(0.0, |sun| sun.illuminance * direct(tracer, point, &sun.sun))
    };
    let suns: Vec<f64> = year.hours.iter().map(sunlight).collect();
    let mut coefficients = DaylightCoefficients::new();
    let [mut paths, most] = PATHS;
    loop {
        coefficients.trace(tracer, year, point, paths);
        let mut found = summed(year, &coefficients, &suns, settings);
        let buried = coefficients.backs() > buried::INSIDE;
        let enough = 0.4 * settings.error * found.exposure.value;
        if buried || paths >= most || found.exposure.error <= enough {
            let widened = summed(year, &coefficients.widened(year), &suns, settings);
            found.add_width(&widened);
            let sunny = year.hours.iter().zip(&suns).filter(|&(_, &sun)| sun > settings.sun);
            let occupied = sunny.filter(|(hour, _)| hour.is_occupied);
            // A sum of nothing is −0.
            found.sun_hours = occupied.map(|(hour, _)| hour.duration).sum::<f64>() + 0.0;
            return found;
        }
        paths *= 2;
    }
}

/// The year by these coefficients, with errors by a jackknife over their batches (Efron and Stein
/// 1981): it has hours on both sides of a limit as they are.
fn summed(
    year: &DaylightYear,
    coefficients: &DaylightCoefficients,
    suns: &[f64],
    settings: &AnnualSettings,
) -> AnnualDaylight {
    let mut all = [Sums::default(); BATCHES + 1];
    let count = BATCHES as f64;
    for (hour, &sun) in year.hours.iter().zip(suns) {
        let batches = coefficients.indirect(hour).map(f64::from);
        let sum: f64 = batches.iter().sum();
        let mut add = |k: usize, indirect: f64| {
            let occupied = if hour.is_occupied { hour.duration } else { 0.0 };
            let illuminance = indirect + sun;
            let above = |limit: f64| if illuminance >= limit { occupied } else { 0.0 };
            let [low, middle, high] = settings.useful.map(above);
            let share = (illuminance / settings.target).min(1.0);
            let exposure = illuminance * hour.duration;
            let more = [above(settings.target), share * occupied, low, middle, high, exposure];
            all[k].iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
        };
        batches.iter().enumerate().for_each(|(k, batch)| add(k, (sum - batch) / (count - 1.0)));
        add(BATCHES, sum / count);
    }
    let estimate = |of: &dyn Fn(&Sums) -> f64| {
        let without: Vec<f64> = all[..BATCHES].iter().map(of).collect();
        let mean = without.iter().sum::<f64>() / count;
        let squares: f64 = without.iter().map(|x| (x - mean).powi(2)).sum();
        Estimate { value: of(&all[BATCHES]), error: (squares * (count - 1.0) / count).sqrt() }
    };
    let share = |k: usize| estimate(&|sums| sums[k] / year.occupied);
    let class = |low: usize| estimate(&|sums| (sums[low] - sums[low + 1]) / year.occupied);
    AnnualDaylight {
        autonomy: share(0),
        continuous: share(1),
        useful: [estimate(&|sums| 1.0 - sums[2] / year.occupied), class(2), class(3), share(4)],
        exposure: estimate(&|sums| sums[5]),
        sun_hours: 0.0,
        backface: coefficients.backs(),
        paths: coefficients.paths * BATCHES,
    }
}

impl AnnualDaylight {
    /// Adds to errors how much the same by wider patches differs.
    fn add_width(&mut self, widened: &AnnualDaylight) {
        let add = |estimate: &mut Estimate, other: &Estimate| {
            estimate.error = libm::hypot(estimate.error, estimate.value - other.value);
        };
        add(&mut self.autonomy, &widened.autonomy);
        add(&mut self.continuous, &widened.continuous);
        add(&mut self.exposure, &widened.exposure);
        self.useful.iter_mut().zip(&widened.useful).for_each(|(a, b)| add(a, b));
    }
}
