//! What the surfaces of a scene are made of.

use super::rgb::Rgb;
use super::sides::Sides;
use super::specular::Specular;
use crate::error::{Error, ErrorKind, quoted};

/// How faces reflect and emit.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name, for messages and look-up.
    pub name: String,
    /// Diffuse hemispherical reflectance ρ per channel, in [0, 1). Of a texture the mean over all
    /// triangles of the material;
    /// [`Scene::reflectance_at`](super::Scene::reflectance_at) has it in detail.
    pub reflectance: Rgb,
    /// Exitance E per channel, W/m²: π times the emitted radiance. Of a texture the mean over all
    /// triangles of the material;
    /// [`Scene::exitance_at`](super::Scene::exitance_at) has it in detail.
    pub exitance: Rgb,
    /// Diffuse transmittance τ per channel: of the light that arrives on either side, the share
    /// that leaves diffusely from the other. ρ + τ < 1. What is translucent reflects on both sides,
    /// whatever `sides` says. With a texture, τ follows it as ρ does, and this is its mean.
    pub transmittance: Rgb,
    /// Which sides do: fronts, unless set. Backs of others only block light.
    pub sides: Sides,
    /// A mirror or glass, beside that: pictures show it. The light that is spread passes glass that
    /// reflects nothing diffusely and does not emit, weakened by its transmittance; for it all else
    /// is as if it were not there.
    pub specular: Option<Specular>,
}

impl Material {
    /// Reflectance ρ, in every channel, of faces that name no material.
    pub const DEFAULT_REFLECTANCE: f64 = 0.5;

    /// A surface that reflects `reflectance` in every channel and emits nothing.
    pub fn grey(name: impl Into<String>, reflectance: f64) -> Material {
        let (reflectance, exitance) = (Rgb::splat(reflectance), Rgb::ZERO);
        let (name, sides) = (name.into(), Sides::Front);
        let transmittance = Rgb::ZERO;
        Material { name, reflectance, transmittance, exitance, sides, specular: None }
    }

    /// Whether any light that arrives leaves again diffusely, on either side, in any channel.
    pub(crate) fn scatters(&self) -> bool {
        self.albedo() != Rgb::ZERO
    }

    /// Whether any light that arrives leaves diffusely from the other side.
    pub(crate) fn is_translucent(&self) -> bool {
        self.transmittance != Rgb::ZERO
    }

    /// The share of the light that arrives which leaves again diffusely, on either side: ρ + τ per
    /// channel.
    pub(crate) fn albedo(&self) -> Rgb {
        self.reflectance + self.transmittance
    }

    /// The share of light per channel that passes a pane or body of it straight on; none where it
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

    /// Reflectance and transmittance in [0, 1) together, exitance finite and not negative, no more
    /// light than there is.
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
