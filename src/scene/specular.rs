//! Surfaces that reflect as a mirror does, or let light through: what a picture shows of them.
//!
//! Radiosity is diffuse. A solver takes such a surface for its diffuse part alone
//! ([`Material::reflectance`](super::Material::reflectance)), and lets light pass straight through
//! glass that has none; a picture shows both.

use super::rgb::Rgb;

/// What a smooth surface does to light beside reflecting it diffusely. Pictures that know the scene
/// ([`Camera::interpolated_image`](crate::Camera::interpolated_image) and
/// [`Camera::gathered_image`](crate::Camera::gathered_image)) show it: the diffuse part of its
/// radiance, B/π, times a share, plus the radiance that comes along other directions, times others:
///
/// | | B/π counts | reflected | transmitted |
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
    /// A polished surface, which reflects more the more it is seen from the side (Schlick 1994,
    /// equation 15). Its front reflects.
    Polished {
        /// Reflectance r per channel at normal incidence, in [0, 1].
        reflectance: Rgb,
    },
    /// Clear glass, or another dielectric: it reflects and refracts. Triangles of one material
    /// that enclose a space are the surface of a body; others are panes, through which light
    /// goes straight on. Both sides count.
    Glass {
        /// Refractive index n, in [1, [`Specular::MAX_REFRACTIVE_INDEX`]].
        refractive_index: f64,
        /// Share τ per channel that passes the inside of a body or a pane once, in [0, 1].
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

    /// The share per channel that is not left for diffuse reflection.
    pub(crate) fn share(&self) -> Rgb {
        match *self {
            Specular::Mirror { reflectance } | Specular::Polished { reflectance } => reflectance,
            Specular::Glass { transmittance, .. } => transmittance,
        }
    }

    /// What is wrong with it beside this diffuse reflectance, and what would be right.
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
            // Shares that leave nothing add up to one but for rounding.
            if share + diffuse > 1.0 + 4.0 * f64::EPSILON {
                let found =
                    format!("{name} {share} and reflectance {diffuse} in channel {channel}");
                return Some((found, "their sum must not be above 1: that would make light"));
            }
        }
        None
    }
}
