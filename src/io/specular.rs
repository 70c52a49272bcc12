//! Mirrors and glass in materials of MTL files.
//!
//! `illum` names a model (Wavefront, "Advanced Visualizer" 3.0, appendix B1, "Illumination
//! models"). Many programs write it, and the values that it uses, by default:
//!
//! | `illum` | counts as | if |
//! |---|---|---|
//! | 3 | mirror of reflectance `Ks` | `Ks` is above 0 |
//! | 5 | polished: `Ks` at normal incidence, more from the side | `Ks` is above 0 |
//! | 4, 9 | glass of transmittance 1 − `d`; without a `d` below 1, 1 − `Tf` | that is above 0 |
//! | 6, 7 | glass of transmittance (1 − `d`) `Tf`; without a `d` below 1, `Tf` | see below |
//! | others, none | diffuse | |
//!
//! - Without a `d` below 1, a `Tr` between 0 and 1 counts as 1 − `d`. Files differ in which end of
//!   `Tr` is opaque, so that 0 and 1 are ignored.
//! - Maya writes 4 without `d` for all materials, with a `Tf` of 1 for opaque and of 0 for clear
//!   ones.
//! - In 6 and 7 a `Tf` of 0 or of 1 in all channels is ignored, and counts as 1. If `d` is ignored
//!   too, the material is glass only if there is no `d` and `Ni` is above 1.
//! - `Ni` is the refractive index if it is above 1 and at most 5; else that of window glass, 1.5.
//! - Channels of `Ks` and `Tf` are clamped to [0, 1]. `Ns` is ignored: all mirrors are perfect.
//!
//! The diffuse part of a mirror or glass is `Kd`, limited in each channel so that both together
//! reflect no more than they receive. Without a `Kd` there is none. Glass that light passes
//! ([`SpecularSurfaces::Clear`]) has none, whatever `Kd` is: in files it is the colour of a preview
//! more often than a haze.

//!
//! Blender's exporter writes 3 for all opaque metals, with the metal's colour in `Kd`, `metallic`
//! in `Ka`, 1000 (1 − roughness)² in `Ns`, and a `Ks` that has no effect on metals there. In files
//! that begin with `# Blender` `Kd` is therefore all that such a metal reflects: of `metallic`
//! times that a share by its roughness diffusely ([`diffuse_share_of_metal`]) and the rest as a
//! mirror, as there is no gloss here. Metals with a `map_Kd` are diffuse, since mirrors have one
//! colour.

use crate::scene::{Rgb, Specular};

/// Treatment of mirrors and glass in the light solution.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum SpecularSurfaces {
    /// Mirrors as their diffuse part; glass as clear panes, which light passes straight on,
    /// attenuated by the transmittance: its diffuse part is ignored. Pictures show both.
    #[default]
    Clear,
    /// Both as their diffuse part: glass blocks light. Pictures show mirrors and glass.
    Diffuse,
    /// Both as black. Pictures show mirrors and glass without a diffuse part.
    Black,
    /// `illum` is ignored: all is diffuse, also in pictures.
    Ignore,
}

impl SpecularSurfaces {
    /// The treatment of mirrors and glass, for a warning.
    pub fn treatment(self) -> &'static str {
        match self {
            SpecularSurfaces::Clear => {
                "pictures show it; light passes glass, and of mirrors only the diffuse part counts"
            }
            SpecularSurfaces::Diffuse => {
                "pictures show it; for the light that is spread only its diffuse part counts"
            }
            SpecularSurfaces::Black => "pictures show it; for the light that is spread it is black",
            SpecularSurfaces::Ignore => "ignored: it is diffuse",
        }
    }
}

/// Statements of a material about mirrors and glass, as written; none if unreadable.
#[derive(Default)]
pub(super) struct SpecularStatements {
    /// `illum`.
    pub model: u8,
    /// `Ks`.
    pub specular: Option<Rgb>,
    /// `Tf`.
    pub filter: Option<Rgb>,
    /// `Ni`.
    pub refractive_index: Option<f64>,
    /// `d`.
    pub dissolve: Option<f64>,
    /// `Tr`, if it is between 0 and 1.
    pub transparency: Option<f64>,
    /// `Kd`, `Ka` and `Ns` of a metal by Blender.
    pub metal: Option<MetalStatements>,
}

/// Statements of a material of `illum` 3 by Blender, as written.
pub(super) struct MetalStatements {
    /// `Kd`; none beside a `map_Kd`.
    pub colour: Option<Rgb>,
    /// `Ka`.
    pub metallic: Option<Rgb>,
    /// `Ns`.
    pub shininess: Option<f64>,
}

impl MetalStatements {
    /// What it reflects as a mirror, per channel.
    fn reflectance(&self) -> Rgb {
        let metallic = self.metallic.map_or(1.0, |share| share.element_sum() / 3.0);
        let smoothness = self.shininess.map_or(1.0, |ns| (ns.max(0.0) / 1000.0).sqrt().min(1.0));
        let colour = self.colour.unwrap_or(Rgb::ZERO).clamp(Rgb::ZERO, Rgb::ONE);
        metallic.clamp(0.0, 1.0) * (1.0 - diffuse_share_of_metal(1.0 - smoothness)) * colour
    }
}

/// The share of what a metal of this `roughness`, in [0, 1], reflects that counts as diffuse; the
/// rest is that of a mirror. Together they have the energy and, with light from straight above, the
/// mean cosine m to the mirror direction of a GGX lobe of α = roughness² (Walter, Marschner, Li and
/// Torrance, "Microfacet models for refraction", EGSR 2007, equations 33 and 34): Lambert's cosine
/// is 2/3 and a mirror's 1, so that the share is 3 (1 − m). Roughness 0.3, 0.5 and 0.7 are 0.15,
/// 0.53 and 0.87; from 0.82 on it is 1.
///
/// With u the squared tangent of the angle of the half vector, straight reflection is
/// ∫₀¹ α²/(α² + u)² G du, and its cosine (1 − u)/(1 + u).
pub(super) fn diffuse_share_of_metal(roughness: f64) -> f64 {
    /// Midpoints of equal parts of ∫ α²/(α² + u)² du = u/(α² + u): within 0.004 of 4096.
    const POINTS: u32 = 64;
    let alpha = roughness.clamp(0.0, 1.0).powi(2);
    let square = alpha * alpha;
    let (mut energy, mut along) = (0.0, 0.0);
    for k in 0..POINTS {
        let part = (f64::from(k) + 0.5) / f64::from(POINTS) / (1.0 + square);
        let u = square * part / (1.0 - part);
        let masking = 2.0 / (1.0 + (1.0 + 4.0 * square * u / (1.0 - u).powi(2)).sqrt());
        energy += masking;
        along += masking * (1.0 - u) / (1.0 + u);
    }
    (3.0 * (1.0 - along / energy)).clamp(0.0, 1.0)
}

impl SpecularStatements {
    /// The mirror or glass of these statements.
    pub fn surface(&self) -> Option<Specular> {
        let share = |colour: Rgb| colour.clamp(Rgb::ZERO, Rgb::ONE);
        let reflectance = match &self.metal {
            Some(metal) => metal.reflectance(),
            None => share(self.specular.unwrap_or(Rgb::ZERO)),
        };
        let transmittance = match self.model {
            3 if reflectance != Rgb::ZERO => return Some(Specular::Mirror { reflectance }),
            5 if reflectance != Rgb::ZERO => return Some(Specular::Polished { reflectance }),
            4 | 9 => self.clearness().or(self.filter.map(|filter| Rgb::ONE - share(filter)))?,
            6 | 7 => {
                let filter = self.filter.map(share);
                let filter = filter.filter(|&tf| tf != Rgb::ZERO && tf != Rgb::ONE);
                let refracts = self.refractive_index.is_some_and(|n| n > 1.0);
                let by_index = refracts && self.dissolve.is_none();
                match (self.clearness(), filter) {
                    (Some(clear), filter) => clear * filter.unwrap_or(Rgb::ONE),
                    (None, Some(filter)) => filter,
                    (None, None) if by_index => Rgb::ONE,
                    (None, None) => return None,
                }
            }
            _ => return None,
        };
        let known = |&n: &f64| n > 1.0 && n <= Specular::MAX_REFRACTIVE_INDEX;
        let index = self.refractive_index.filter(known);
        // That of window glass.
        let refractive_index = index.unwrap_or(1.5);
        (transmittance != Rgb::ZERO).then_some(Specular::Glass { refractive_index, transmittance })
    }

    /// Transmittance by `d` or `Tr`, if either is transparent.
    fn clearness(&self) -> Option<Rgb> {
        let by_dissolve = self.dissolve.filter(|&d| d < 1.0).map(|d| 1.0 - d.max(0.0));
        by_dissolve.or(self.transparency).map(Rgb::splat)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Option<Specular> {
        let mut statements = SpecularStatements::default();
        for statement in text.split(", ") {
            let words: Vec<&str> = statement.split(' ').collect();
            let number = |k: usize| words[k].parse::<f64>().unwrap();
            let colour = || match words.len() {
                2 => Rgb::splat(number(1)),
                _ => Rgb::new(number(1), number(2), number(3)),
            };
            match words[0] {
                "illum" => statements.model = words[1].parse().unwrap(),
                "Ks" => statements.specular = Some(colour()),
                "Tf" => statements.filter = Some(colour()),
                "Ni" => statements.refractive_index = Some(number(1)),
                "d" => statements.dissolve = Some(number(1)),
                "Tr" => statements.transparency = Some(number(1)),
                other => panic!("{other}"),
            }
        }
        statements.surface()
    }

    /// Metals as Blender writes them: a polished one, the brass of a room (roughness 0.3), a rough
    /// one, one that is half a metal, and without statements.
    #[test]
    fn metals_share_their_colour() {
        let brass = Rgb::new(0.9, 0.7, 0.3);
        let metal = |colour, metallic: Option<f64>, shininess| {
            let metal = MetalStatements { colour, metallic: metallic.map(Rgb::splat), shininess };
            let specular = Some(Rgb::splat(0.5));
            let metal = Some(metal);
            SpecularStatements { model: 3, specular, metal, ..Default::default() }.surface()
        };
        let mirror = |reflectance| Some(Specular::Mirror { reflectance });
        assert_eq!(metal(Some(brass), Some(1.0), Some(1000.0)), mirror(brass));
        // Roughness 0.3 and 0.5.
        let mirrored = |roughness| 1.0 - diffuse_share_of_metal(roughness);
        let rough_brass = metal(Some(brass), Some(1.0), Some(490.0)).unwrap().share();
        assert!(rough_brass.abs_diff_eq(mirrored(0.3) * brass, 1e-12));
        assert_eq!(metal(Some(brass), Some(0.5), Some(250.0)), mirror(0.5 * mirrored(0.5) * brass));
        assert_eq!(metal(Some(brass), None, None), mirror(brass));
        assert_eq!(metal(Some(2.0 * brass), Some(7.0), Some(1e9)).unwrap().share().y, 1.0);
        for (colour, metallic, shininess) in
            [(Some(brass), 1.0, 0.0), (Some(brass), 0.0, 490.0), (None, 1.0, 490.0)]
        {
            assert_eq!(metal(colour, Some(metallic), Some(shininess)), None);
        }
    }

    /// Values by 4096 points of the same integral, made by another program; 0.004 is the error of
    /// 64.
    #[test]
    fn rough_metal_is_diffuse() {
        for (roughness, share) in [(0.0, 0.0), (0.1, 0.0045), (0.3, 0.1539), (0.5, 0.5266)] {
            assert!((diffuse_share_of_metal(roughness) - share).abs() < 4e-3, "{roughness}");
        }
        assert!((diffuse_share_of_metal(0.7) - 0.8728).abs() < 4e-3);
        assert_eq!(diffuse_share_of_metal(1.0), 1.0);
    }

    #[test]
    fn models_make_mirrors_and_glass() {
        let mirror = |r| Some(Specular::Mirror { reflectance: r });
        let polished = |r| Some(Specular::Polished { reflectance: r });
        let tinted =
            |n, transmittance| Some(Specular::Glass { refractive_index: n, transmittance });
        let glass = |n, t| tinted(n, Rgb::splat(t));
        for (text, want) in [
            // Examples of the format's own description.
            ("illum 3, Ks 0 1 0", mirror(Rgb::Y)),
            ("illum 4, Ks 0.9, d 0.1", glass(1.5, 0.9)),
            ("illum 5, Ks 0.618 0.876 0.143", polished(Rgb::new(0.618, 0.876, 0.143))),
            ("illum 6, Tf 1, Ni 1.2", glass(1.2, 1.0)),
            ("illum 7, Ks 0.6 0.9 0.1, Tf 1, Ni 1.2", glass(1.2, 1.0)),
            // A ball in a Cornell box, and others.
            ("illum 7, Ks 0.3, Tf 0.1, Ni 2.5", glass(2.5, 0.1)),
            ("illum 7, Ks 0.3, Ni 1.33", glass(1.33, 1.0)),
            ("illum 9, Ks 1, Ni 1.45, d 0.5", glass(1.45, 0.5)),
            ("illum 9, Ks 1, d 0.1", glass(1.5, 0.9)),
            ("illum 6, d 0.5, Tf 1 0.5 0.5", tinted(1.5, Rgb::new(0.5, 0.25, 0.25))),
            ("illum 4, d 0", glass(1.5, 1.0)),
            ("illum 4, Tr 0.75", glass(1.5, 0.75)),
            // Maya's output: opaque, clear, half.
            ("illum 4, Tf 1, Ni 1, Ks 0.5", None),
            ("illum 4, Tf 0, Ni 1.8, Ks 1", glass(1.8, 1.0)),
            ("illum 4, Tf 0.5, Ni 1", glass(1.5, 0.5)),
            // Written by default.
            ("illum 4, Ks 0", None),
            ("illum 4, d 1, Ni 1", None),
            ("illum 4, Ni 42, Tf 1", None),
            ("illum 7, Ks 1", None),
            ("illum 7, Ks 1, Ni 1, d 1", None),
            ("illum 7, Ni 1.5, d 1, Tf 1", None),
            ("illum 6, Ni 1.5, d 1, Tf 0", None),
            ("illum 9, Ni 1.5", None),
            ("illum 3", None),
            ("illum 5, Ks -1", None),
            ("illum 2, Ks 1, Ni 1.5, d 0.5", None),
            ("illum 8, Ks 1", None),
            ("illum 10, Ks 1, d 0", None),
            ("d 0.1, Ni 1.5", None),
            // Out of range.
            ("illum 3, Ks 2 0.5 -1", mirror(Rgb::new(1.0, 0.5, 0.0))),
            ("illum 4, d -3, Ni 0", glass(1.5, 1.0)),
            ("illum 7, Tf 2 0.5 -1, Ni 42", tinted(1.5, Rgb::new(1.0, 0.5, 0.0))),
        ] {
            assert_eq!(parse(text), want, "{text}");
        }
    }
}
