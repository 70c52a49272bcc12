//! What the rays of one point add up to.

use crate::gather::IrradianceSample;
use crate::scene::Rgb;

/// Sums over rays.
#[derive(Debug)]
pub(super) struct RaySums<const FIELDS: usize> {
    /// Without what surfaces reflect.
    pub hemisphere: IrradianceSample,
    /// What surfaces reflect, by field.
    pub reflected: [Rgb; FIELDS],
    /// The largest radiosity that one ray found, reflected by the first field or the sky's, W/m².
    pub max_contribution: f64,
    pub lights: Vec<Visible>,
    /// Cosines instead of form factors.
    pub sun: Visible,
}

/// Sums of form factors over points on a light.
#[derive(Debug, Default)]
pub(super) struct Visible {
    pub points: f64,
    /// To those that are visible; per channel, what panes let through.
    pub seen: Rgb,
    /// To all that are above the horizon and face the point.
    pub all: f64,
}

impl<const FIELDS: usize> Default for RaySums<FIELDS> {
    fn default() -> RaySums<FIELDS> {
        RaySums {
            hemisphere: IrradianceSample::default(),
            reflected: [Rgb::ZERO; FIELDS],
            max_contribution: 0.0,
            lights: vec![],
            sun: Visible::default(),
        }
    }
}

impl<const FIELDS: usize> RaySums<FIELDS> {
    pub fn add(&mut self, other: &RaySums<FIELDS>) {
        let (sum, term) = (&mut self.hemisphere, &other.hemisphere);
        sum.irradiance += term.irradiance;
        sum.escaped += term.escaped;
        sum.backface += term.backface;
        sum.inverse_distance += term.inverse_distance;
        for (sum, term) in self.reflected.iter_mut().zip(other.reflected) {
            *sum += term;
        }
        self.max_contribution = self.max_contribution.max(other.max_contribution);
        for (sum, term) in self.lights.iter_mut().zip(&other.lights) {
            sum.add(term);
        }
        self.sun.add(&other.sun);
    }
}

impl Visible {
    /// What one unit of `seen` counts: a share of the form factor of all of the light where that is
    /// known by closed form, else of the points.
    pub fn share_of(&self, unoccluded: Option<f64>) -> f64 {
        match unoccluded {
            Some(factor) => factor / self.all.max(1e-300),
            None => 1.0 / self.points.max(1.0),
        }
    }

    pub fn add(&mut self, other: &Visible) {
        self.points += other.points;
        self.seen += other.seen;
        self.all += other.all;
    }
}
