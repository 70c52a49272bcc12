//! Specular surfaces, mirrors and glass, as shown in pictures.
//!
//! Radiosity is diffuse. A solver uses only the diffuse part of such a surface
//! ([`Material::reflectance`](super::Material::reflectance)), and lets light pass straight through
//! glass that has none; a picture shows both.

use super::rgb::Rgb;

/// Specular reflection and transmission of a smooth surface beside its diffuse reflection. Pictures
/// that know the scene ([`Camera::interpolated_image`](crate::Camera::interpolated_image) and
/// [`Camera::gathered_image`](crate::Camera::gathered_image)) show it: the sum of its diffuse
/// radiance, B/π, and the reflected and transmitted radiance, with these factors:
///
/// | | B/π | reflected | transmitted |
/// |---|---|---|---|
/// | `Mirror` | 1 | r | – |
/// | `Polished` | 1 − (1 − cos θ)⁵ | r + (1 − r) (1 − cos θ)⁵ | – |
/// | `Glass`, a body | 1 − R | R | (1 − R) τ on the way in, 1 − R on the way out |
/// | `Glass`, a pane | 1 − R | R + (1 − R)² R τ² / (1 − R² τ²) | (1 − R)² τ / (1 − R² τ²) |
///
/// θ is the angle of incidence and R = R(θ) Fresnel's reflectance of one boundary for unpolarised
/// light (1823). A pane has the sum over all reflections between its two faces.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Specular {
    /// A perfect mirror. Its front reflects.
    Mirror {
        /// Reflectance r per channel at every angle, in [0, 1].
        reflectance: Rgb,
    },
    /// A polished surface, whose reflectance increases towards grazing angles (Schlick 1994,
    /// equation 15). Its front reflects.
    Polished {
        /// Reflectance r per channel at normal incidence, in [0, 1].
        reflectance: Rgb,
    },
    /// Clear glass, or another dielectric: it reflects and refracts. Triangles of one material that
    /// enclose a space are the surface of a body; others are panes, through which light goes
    /// straight on. Both sides are active.
    Glass {
        /// Refractive index n, in [1, [`Specular::MAX_REFRACTIVE_INDEX`]].
        refractive_index: f64,
        /// Fraction τ per channel that passes the inside of a body or a pane once, in [0, 1].
        transmittance: Rgb,
    },
}

impl Specular {
    /// Largest refractive index: above that of germanium, in the infrared.
    pub const MAX_REFRACTIVE_INDEX: f64 = 5.0;

    /// Whether it is [`Specular::Glass`].
    pub(crate) fn is_glass(&self) -> bool {
        matches!(self, Specular::Glass { .. })
    }

    /// The fraction per channel that is not available for diffuse reflection.
    pub(crate) fn share(&self) -> Rgb {
        match *self {
            Specular::Mirror { reflectance } | Specular::Polished { reflectance } => reflectance,
            Specular::Glass { transmittance, .. } => transmittance,
        }
    }

    /// The error beside this diffuse reflectance, if any, and the remedy.
    pub(super) fn fault(&self, diffuse: Rgb) -> Option<(String, &'static str)> {
        if let Specular::Glass { refractive_index: index, .. } = self
            && !(1.0..=Specular::MAX_REFRACTIVE_INDEX).contains(index)
        {
            return Some((format!("a refractive index of {index}"), "must be from 1 to 5"));
        }
        let name = if self.is_glass() { "transmittance" } else { "specular reflectance" };
        let channels = ["r", "g", "b"].into_iter().zip(self.share().to_array());
        for ((channel, share), diffuse) in channels.zip(diffuse.to_array()) {
            if !(0.0..=1.0).contains(&share) {
                let found = format!("{name} {share} in channel {channel}");
                return Some((found, "must be from 0 to 1"));
            }
            // Complementary fractions add up to one up to rounding.
            if share + diffuse > 1.0 + 4.0 * f64::EPSILON {
                let found =
                    format!("{name} {share} and reflectance {diffuse} in channel {channel}");
                return Some((found, "their sum must not be above 1: that would make light"));
            }
        }
        None
    }
}
