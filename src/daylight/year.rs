//! The sun and the sky of each hour of a year.

use glam::DVec3;
use rayon::prelude::*;

use super::patches::{PATCHES, Patches, SkyDirection, WHOLE, wholes};
use crate::error::{Error, ErrorKind};
use crate::scene::{Rgb, SkyDistribution, SolarIrradiance, Sun};

/// Batches of paths: their scatter is known to 1/√30, 18 %.
pub(super) const BATCHES: usize = 16;

/// A number for each batch.
pub(super) type Batches = [f32; BATCHES];

/// What lights an hour, or another span of time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DaylightHour {
    /// Irradiance of sun and sky.
    pub light: SolarIrradiance,
    /// Towards the sun, unit length, in the scene's axes.
    pub towards_sun: DVec3,
    /// Dew point, degrees Celsius.
    pub dew_point: f64,
    /// How long it lasts, hours.
    pub duration: f64,
    /// Whether someone is there to see it.
    pub is_occupied: bool,
}

/// An hour with light.
#[derive(Clone, Debug)]
pub(super) struct LitHour {
    /// Luminance of the patches of the sky, cd/m².
    pub sky: Vec<f32>,
    pub sun: Option<LitSun>,
    pub duration: f64,
    pub is_occupied: bool,
}

/// The sun of an hour.
#[derive(Clone, Copy, Debug)]
pub(super) struct LitSun {
    /// With an irradiance of 1.
    pub sun: Sun,
    /// Illuminance of what faces it, lx.
    pub illuminance: f64,
    pub patch: usize,
}

/// Hours of a year, as a scene is lit by them.
#[derive(Clone, Debug)]
pub struct DaylightYear {
    pub(super) patches: Patches,
    /// Hours with light.
    pub(super) hours: Vec<LitHour>,
    /// Solid angle of each patch of the sky, sr.
    pub(super) solid_angles: Vec<f64>,
    /// Hours of suns by patch: sums of illuminance, with the numbers of hours.
    pub(super) suns: Vec<SunPatch>,
    /// Occupied hours, dark ones too.
    pub(super) occupied: f64,
}

/// Suns that stand in one patch.
#[derive(Clone, Debug)]
pub(super) struct SunPatch {
    pub patch: usize,
    /// Chance of a ray to it.
    pub chance: f64,
    /// The same with those of all before it.
    pub chances: f64,
    /// Suns, each with the sum of weights up to it: illuminance times duration.
    pub suns: Vec<(Sun, f64)>,
}

impl DaylightYear {
    /// Of `hours`, where `up` is up in the scene.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] where no time is occupied, or `up` is zero.
    pub fn new(hours: &[DaylightHour], up: DVec3) -> Result<DaylightYear, Error> {
        let bad = |found: &str, remedy| Error::new(ErrorKind::Setting, "daylight", found, remedy);
        let up = up.try_normalize().ok_or_else(|| bad("no direction up", "give one"))?;
        let occupied: f64 = hours.iter().filter(|h| h.is_occupied).map(|h| h.duration).sum();
        if occupied <= 0.0 {
            return Err(bad("no occupied hour", "give hours that the weather is known of"));
        }
        let patches = Patches::new(up);
        let directions = patches.directions();
        let lit = |hour| LitHour::new(hour, &patches, &directions, up);
        let lit: Vec<LitHour> = hours.par_iter().filter_map(lit).collect();
        let mut solid_angles = vec![0.0; PATCHES];
        directions.iter().for_each(|d| solid_angles[d.patch] += d.solid_angle);
        let suns = SunPatch::all(&lit);
        Ok(DaylightYear { patches, hours: lit, solid_angles, suns, occupied })
    }

    /// The suns of a patch, in proportion to their chances.
    pub(super) fn choose(&self, random: f64) -> &SunPatch {
        let k = self.suns.partition_point(|suns| suns.chances <= random);
        &self.suns[k.min(self.suns.len() - 1)]
    }

    /// Means over each of Tregenza's whole patches of coefficients of the sky and of suns.
    pub(super) fn widened(&self, [sky, sun]: [&[Batches]; 2]) -> [Vec<Batches>; 2] {
        let whole = wholes();
        let mean = |values: &[Batches], weights: &[f64]| {
            let (mut sums, mut all) = ([[0.0; BATCHES]; WHOLE], [0.0; WHOLE]);
            for ((&w, value), weight) in whole.iter().zip(values).zip(weights) {
                sums[w].iter_mut().zip(value).for_each(|(sum, x)| *sum += *weight as f32 * x);
                all[w] += weight;
            }
            let of = |&w: &usize| sums[w].map(|sum| sum / all[w].max(f64::MIN_POSITIVE) as f32);
            whole.iter().map(of).collect()
        };
        let mut suns = vec![0.0; PATCHES];
        self.suns.iter().for_each(|s| suns[s.patch] = s.weight());
        [mean(sky, &self.solid_angles), mean(sun, &suns)]
    }
}

impl LitHour {
    /// None in the dark.
    fn new(
        hour: &DaylightHour,
        patches: &Patches,
        directions: &[SkyDirection],
        up: DVec3,
    ) -> Option<LitHour> {
        let DaylightHour { light, towards_sun, dew_point, duration, is_occupied } = *hour;
        let efficacy = light.efficacy(dew_point);
        let illuminance = light.direct_normal * efficacy.direct;
        let patch = patches.of(towards_sun).filter(|_| illuminance > 0.0);
        let sun = patch.map(|patch| LitSun {
            sun: Sun { direction: towards_sun, irradiance: Rgb::ONE },
            illuminance,
            patch,
        });
        let diffuse = light.diffuse_horizontal * efficacy.diffuse;
        let models = [light.distribution(), SkyDistribution::cie(5)];
        // The second where the zenith of the first is black, and nothing relative to it.
        let skies = models.into_iter().flatten().take(if diffuse > 0.0 { 2 } else { 0 });
        let mut skies = skies.map(|model| relative_sky(model, towards_sun, directions, up));
        let sky = skies.find(|sky| sky.level > 0.0);
        if sky.is_none() && sun.is_none() {
            return None;
        }
        let sky = sky.map_or_else(
            || vec![0.0; PATCHES],
            |RelativeSky { radiance, level }| {
                radiance.iter().map(|x| (x * diffuse / level) as f32).collect()
            },
        );
        Some(LitHour { sky, sun, duration, is_occupied })
    }
}

/// A sky relative to its zenith.
struct RelativeSky {
    /// Mean radiance of each patch.
    radiance: Vec<f64>,
    /// Irradiance of level ground.
    level: f64,
}

fn relative_sky(
    model: SkyDistribution,
    towards_sun: DVec3,
    directions: &[SkyDirection],
    up: DVec3,
) -> RelativeSky {
    let relative = model.relative_to_zenith(up.dot(towards_sun));
    let (mut sums, mut weights, mut level) = (vec![0.0; PATCHES], vec![0.0; PATCHES], 0.0);
    for &SkyDirection { patch, direction, solid_angle } in directions {
        let cosine = direction.dot(up);
        let flux = relative(cosine, direction.dot(towards_sun)) * solid_angle;
        sums[patch] += flux;
        weights[patch] += solid_angle;
        level += flux * cosine;
    }
    let radiance = sums.iter().zip(&weights).map(|(sum, weight)| sum / weight).collect();
    RelativeSky { radiance, level }
}

impl SunPatch {
    /// Those of all hours. Half of the chances are even, so that rare suns are known too.
    fn all(hours: &[LitHour]) -> Vec<SunPatch> {
        let mut found: Vec<SunPatch> = vec![];
        for hour in hours {
            let Some(LitSun { sun, illuminance, patch }) = hour.sun else { continue };
            let k = found.iter().position(|s| s.patch == patch).unwrap_or_else(|| {
                found.push(SunPatch { patch, chance: 0.0, chances: 0.0, suns: vec![] });
                found.len() - 1
            });
            let before = found[k].weight();
            found[k].suns.push((sun, before + illuminance * hour.duration));
        }
        let (all, count) = (found.iter().map(SunPatch::weight).sum::<f64>(), found.len() as f64);
        let mut chances = 0.0;
        for suns in &mut found {
            suns.chance = 0.5 * suns.weight() / all + 0.5 / count;
            chances += suns.chance;
            suns.chances = chances;
        }
        found
    }

    /// What its suns bring in the year, lx h.
    fn weight(&self) -> f64 {
        self.suns.last().map_or(0.0, |sun| sun.1)
    }

    /// One of its suns, in proportion to what it brings in the year.
    pub fn sun(&self, random: f64) -> &Sun {
        let at = random * self.weight();
        let k = self.suns.partition_point(|sun| sun.1 <= at);
        &self.suns[k.min(self.suns.len() - 1)].0
    }
}
