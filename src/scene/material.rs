//! Materials of surfaces.

use super::rgb::Rgb;
use super::sides::Sides;
use super::specular::Specular;
use crate::error::{Error, ErrorKind, quoted};

/// Reflection and emission of faces.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name, for messages and look-up.
    pub name: String,
    /// Diffuse hemispherical reflectance ρ per channel, in [0, 1). Of a texture the mean over all
    /// triangles of the material; [`Scene::reflectance_at`](super::Scene::reflectance_at) has the
    /// values.
    pub reflectance: Rgb,
    /// Exitance E per channel, W/m²: π times the emitted radiance. Of a texture the mean over all
    /// triangles of the material; [`Scene::exitance_at`](super::Scene::exitance_at) has the values.
    pub exitance: Rgb,
    /// Diffuse transmittance τ per channel: the fraction of the light arriving on either side that
    /// leaves diffusely from the other. ρ + τ < 1. Translucent surfaces reflect on both sides,
    /// whatever `sides` is. With a texture, τ is proportional to it like ρ, and this is its mean.
    pub transmittance: Rgb,
    /// Sides that reflect and emit: fronts by default. Other backs only block light.
    pub sides: Sides,
    /// Additional mirror or glass: pictures show it. The light solution passes glass that reflects
    /// nothing diffusely and does not emit, attenuated by its transmittance, and ignores all
    /// others.
    pub specular: Option<Specular>,
}

impl Material {
    /// Reflectance ρ, in every channel, of faces without a material.
    pub const DEFAULT_REFLECTANCE: f64 = 0.5;

    /// A surface that reflects `reflectance` in every channel and emits nothing.
    pub fn grey(name: impl Into<String>, reflectance: f64) -> Material {
        let (reflectance, exitance) = (Rgb::splat(reflectance), Rgb::ZERO);
        let (name, sides) = (name.into(), Sides::Front);
        let transmittance = Rgb::ZERO;
        Material { name, reflectance, transmittance, exitance, sides, specular: None }
    }

    /// Whether any arriving light is scattered diffusely, on either side, in any channel.
    pub(crate) fn scatters(&self) -> bool {
        self.albedo() != Rgb::ZERO
    }

    /// Whether any arriving light leaves diffusely from the other side.
    pub(crate) fn is_translucent(&self) -> bool {
        self.transmittance != Rgb::ZERO
    }

    /// The fraction of the arriving light that is scattered diffusely, on either side: ρ + τ per
    /// channel.
    pub(crate) fn albedo(&self) -> Rgb {
        self.reflectance + self.transmittance
    }

    /// The fraction of light per channel that passes a pane or body of it straight on; none if it
    /// blocks light. Glass with a diffuse part blocks light and reflects that part.
    pub(crate) fn clear_transmittance(&self) -> Option<Rgb> {
        match self.specular {
            Some(Specular::Glass { transmittance, .. })
                if transmittance != Rgb::ZERO && !self.scatters() && self.exitance == Rgb::ZERO =>
            {
                Some(transmittance)
            }
            _ => None,
        }
    }

    /// Checks the ranges: reflectance and transmittance in [0, 1) together, exitance finite and not
    /// negative, energy conserved.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let place = || format!("material {}", quoted(&[&self.name]));
        for (channel, rho) in ["r", "g", "b"].iter().zip(self.reflectance.to_array()) {
            if !(0.0..1.0).contains(&rho) {
                return Err(Error::new(
                    ErrorKind::Scene,
                    place(),
                    format!("reflectance {rho} in channel {channel}"),
                    "must be at least 0 and below 1: a surface cannot return all light or more",
                ));
            }
        }
        let both = self.transmittance.to_array().into_iter().zip(self.albedo().to_array());
        for (channel, (tau, albedo)) in ["r", "g", "b"].iter().zip(both) {
            if !(tau >= 0.0 && albedo < 1.0) {
                let rho = albedo - tau;
                return Err(Error::new(
                    ErrorKind::Scene,
                    place(),
                    format!("transmittance {tau} beside reflectance {rho} in channel {channel}"),
                    "must be at least 0, and both together below 1",
                ));
            }
        }
        for (channel, e) in ["r", "g", "b"].iter().zip(self.exitance.to_array()) {
            if !(e.is_finite() && e >= 0.0) {
                return Err(Error::new(
                    ErrorKind::Scene,
                    place(),
                    format!("exitance {e} in channel {channel}"),
                    "must be finite and not negative",
                ));
            }
        }
        let fault = self.specular.and_then(|specular| specular.fault(self.albedo()));
        fault.map_or(Ok(()), |(found, remedy)| {
            Err(Error::new(ErrorKind::Scene, place(), found, remedy))
        })
    }
}
