//! Lamps of a glTF scene: point and spot lights as luminaires, directional ones as the sun
//! (Khronos, `KHR_lights_punctual`).
//!
//! Intensities are candela, and lux of a directional light; what surfaces emit is per m² and
//! steradian, in whatever unit the file has. Blender has watts for both, and by default its
//! exporter multiplies lamps alone by 683 lm/W. Which of its modes was used is not in the file:
//!
//! | lighting mode | point, spot of P W | sun of s W/m² |
//! |---|---|---|
//! | Standard | 683 P / (4π) cd | 683 s lx |
//! | Unitless | P / (4π) cd | s lx |
//! | Raw | P cd | s lx |
//!
//! So lamps in files by Blender are divided by 683 where that makes the watts of more of them
//! round numbers, as people type them, than the other modes do; they are watts then, as what
//! surfaces emit is.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::document::{Document, Light};
use super::nodes::{Nodes, Placed, name};
use crate::error::Error;
use crate::scene::{IntensityDistribution, Luminaire, Rgb, Sun, Warning, WarningKind};

/// Luminous efficacy of Blender's exporter, lm/W: that of the definition of the candela.
const EFFICACY: f64 = 683.0;

/// How intensities of lamps in a file become those of the scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum LampUnits {
    /// As watts in files by Blender, if they look so; else as candela.
    #[default]
    Auto,
    /// Candela and lux, as they are.
    Candela,
    /// Candela and lux divided by 683 lm/W: W/sr and W/m².
    Watts,
}

/// The lamps of a scene.
#[derive(Default)]
pub(super) struct Lamps {
    pub luminaires: Vec<Luminaire>,
    pub sun: Option<Sun>,
    pub warnings: Vec<Warning>,
}

/// A lamp of the file at its node.
struct Lamp<'a> {
    light: &'a Light,
    name: String,
    world: DAffine3,
}

impl Lamps {
    pub fn new(document: &Document, nodes: &Nodes, units: LampUnits) -> Result<Lamps, Error> {
        let lamp = |placed: &Placed| {
            let of_node = document.nodes[placed.node].extensions.light.as_ref()?;
            let light = document.extensions.lights.lights.get(of_node.light)?.as_ref()?;
            Some(Lamp { light, name: name(document, placed.node), world: placed.world })
        };
        let all: Vec<Lamp<'_>> = nodes.placed.iter().filter_map(lamp).collect();
        let is_lit = |lamp: &&Lamp<'_>| lamp.light.intensity > 0.0 && lamp.colour() != Rgb::ZERO;
        let lit: Vec<&Lamp<'_>> = all.iter().filter(is_lit).collect();
        let mut lamps = Lamps::default();
        if lit.is_empty() {
            return Ok(lamps);
        }
        let generator = document.asset.generator.as_deref().unwrap_or("");
        let is_by_blender = generator.contains("Blender");
        let in_watts = match units {
            LampUnits::Auto => is_by_blender && are_standard(&lit),
            LampUnits::Candela => false,
            LampUnits::Watts => true,
        };
        let factor = if in_watts { 1.0 / EFFICACY } else { 1.0 };
        let names = || lit.iter().map(|lamp| lamp.name.clone());
        let done = match (in_watts, units) {
            (true, LampUnits::Auto) => {
                "divided by 683 lm/W, as Blender writes them: watts, as what surfaces emit; \
                 --lamp-units candela takes them as they are"
            }
            (true, _) => "divided by 683 lm/W: watts, as what surfaces emit",
            (false, _) => {
                "taken as they are, beside what surfaces emit per m² and steradian; \
                 --lamp-units watts divides them by 683 lm/W"
            }
        };
        let note = Warning::new(WarningKind::LampUnits, lit.len(), done).naming(names());
        lamps.warnings.push(note);
        let mut suns = vec![];
        for lamp in &lit {
            match lamp.light.kind.as_str() {
                "directional" => suns.push((lamp, factor * lamp.light.intensity * lamp.colour())),
                _ => lamps.luminaires.push(lamp.luminaire(factor)?),
            }
        }
        let is_cut_off = |lamp: &&&Lamp<'_>| lamp.light.range.is_some();
        let cut_off: Vec<String> =
            lit.iter().filter(is_cut_off).map(|lamp| lamp.name.clone()).collect();
        if !cut_off.is_empty() {
            let done = "light goes on beyond it, with the inverse square of distance";
            let kind = WarningKind::LampRange;
            lamps.warnings.push(Warning::new(kind, cut_off.len(), done).naming(cut_off));
        }
        suns.sort_by(|a, b| b.1.element_sum().total_cmp(&a.1.element_sum()));
        if let Some((lamp, irradiance)) = suns.first() {
            let direction = -lamp.forward();
            lamps.sun = Some(Sun { direction, irradiance: *irradiance });
        }
        if suns.len() > 1 {
            let done = "the brightest alone shines";
            let names = suns[1..].iter().map(|(lamp, _)| lamp.name.clone());
            lamps
                .warnings
                .push(Warning::new(WarningKind::MoreSuns, suns.len() - 1, done).naming(names));
        }
        Ok(lamps)
    }
}

impl Lamp<'_> {
    fn colour(&self) -> Rgb {
        Rgb::from_array(self.light.color).max(Rgb::ZERO)
    }

    /// Where the lamp shines to: -z of its node.
    fn forward(&self) -> DVec3 {
        self.world.transform_vector3(DVec3::NEG_Z).normalize_or(DVec3::NEG_Y)
    }

    fn luminaire(&self, factor: f64) -> Result<Luminaire, Error> {
        let intensity = match self.light.kind.as_str() {
            "spot" => spot(self.light.spot.inner_cone_angle, self.light.spot.outer_cone_angle)?,
            _ => IntensityDistribution::isotropic(1.0)?,
        };
        let plain = Luminaire::new(Arc::new(intensity), self.world.translation, self.forward());
        Ok(Luminaire { scale: factor * self.light.intensity * self.colour(), ..plain })
    }
}

/// A spot light of intensity 1 within its inner cone, which falls off to 0 at its outer cone, both
/// in radians from the axis: by the square of the share of the difference of cosines, as the
/// extension recommends.
fn spot(inner: f64, outer: f64) -> Result<IntensityDistribution, Error> {
    /// Steps between the cones, linear in between: off by some 1e-4 at most.
    const STEPS: u32 = 128;
    let outer = if outer.is_finite() { outer.clamp(1e-3, PI / 2.0) } else { PI / 4.0 };
    let inner = if inner.is_finite() { inner.clamp(0.0, outer - 1e-4) } else { 0.0 };
    let (mut angles, mut values) = (vec![], vec![]);
    if inner > 0.0 {
        angles.push(0.0);
        values.push(1.0);
    }
    for k in 0..=STEPS {
        let angle = inner + f64::from(k) / f64::from(STEPS) * (outer - inner);
        let share = (libm::cos(angle) - libm::cos(outer)) / (libm::cos(inner) - libm::cos(outer));
        angles.push(angle.to_degrees());
        values.push(share.clamp(0.0, 1.0).powi(2));
    }
    IntensityDistribution::new(&[0.0], &angles, values)
}

/// Whether watts of more lamps are round if they are divided by 683 lm/W than if not; that too, if
/// as many are.
fn are_standard(lamps: &[&Lamp<'_>]) -> bool {
    let round = |efficacy: f64, turn: f64| {
        let watts = |lamp: &&Lamp<'_>| match lamp.light.kind.as_str() {
            "directional" => lamp.light.intensity / efficacy,
            _ => lamp.light.intensity / efficacy * turn,
        };
        lamps.iter().map(watts).filter(|&watts| is_round(watts)).count()
    };
    let standard = round(EFFICACY, 4.0 * PI);
    standard >= round(1.0, 4.0 * PI).max(round(1.0, 1.0))
}

/// Whether `value` has at most two digits, up to the rounding of 32-bit floats.
fn is_round(value: f64) -> bool {
    let digits = value / libm::pow(10f64, libm::log10(value).floor() - 1.0);
    (digits - digits.round()).abs() < 1e-5 * digits
}
