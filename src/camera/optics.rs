//! Reflection, refraction and transmission at smooth boundaries. Cosines are those of the angle of
//! incidence, in [0, 1].

use glam::DVec3;

use crate::scene::Rgb;

/// Reflectance of the boundary to a medium with `ratio` times the refractive index, for unpolarised
/// light: the mean of both polarisations (Fresnel 1823), and 1 beyond the critical angle.
pub(super) fn fresnel(cosine: f64, ratio: f64) -> f64 {
    if ratio == 1.0 {
        return 0.0;
    }
    let refracted_sine_squared = (1.0 - cosine * cosine) / (ratio * ratio);
    if refracted_sine_squared >= 1.0 {
        return 1.0;
    }
    let refracted = (1.0 - refracted_sine_squared).sqrt();
    let perpendicular = (cosine - ratio * refracted) / (cosine + ratio * refracted);
    let parallel = (ratio * cosine - refracted) / (ratio * cosine + refracted);
    (perpendicular * perpendicular + parallel * parallel) / 2.0
}

/// The direction behind a boundary with unit `normal`, which `direction` (unit length) hits from
/// the side of the normal, to a medium with `ratio` times the refractive index (Snell 1621); none
/// beyond the critical angle.
pub(super) fn refracted(direction: DVec3, normal: DVec3, ratio: f64) -> Option<DVec3> {
    let cosine = -direction.dot(normal);
    let square = 1.0 - (1.0 - cosine * cosine) / (ratio * ratio);
    (square > 0.0).then(|| (direction + (cosine - ratio * square.sqrt()) * normal) / ratio)
}

/// Increase of a polished surface's reflectance R at this angle over that at normal incidence, as a
/// fraction of 1 − R (Schlick 1994, equation 15).
pub(super) fn schlick(cosine: f64) -> f64 {
    (1.0 - cosine).powi(5)
}

/// Reflectance and transmittance of a pane whose faces reflect `face` and whose inside transmits
/// `transmittance` from one face to the other: the sums of all reflections between them.
pub(super) fn pane(face: f64, transmittance: Rgb) -> [Rgb; 2] {
    let through = (1.0 - face) * (1.0 - face) * transmittance;
    let again = Rgb::ONE - face * face * transmittance * transmittance;
    // At grazing incidence no light enters, and both are 0.
    let through = Rgb::select(again.cmpgt(Rgb::ZERO), through / again, Rgb::ZERO);
    [face + face * transmittance * through, through]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cosine of the refracted angle.
    fn refracted_cosine(cosine: f64, ratio: f64) -> f64 {
        (1.0 - (1.0 - cosine * cosine) / (ratio * ratio)).sqrt()
    }

    #[test]
    fn reflectance_at_known_angles() {
        for n in [1.1_f64, 1.33, 1.5, 2.42, 1.0 / 1.5, 1.0] {
            let normal = ((n - 1.0) / (n + 1.0)).powi(2);
            assert!((fresnel(1.0, n) - normal).abs() < 1e-16, "{n}");
            assert!((fresnel(0.0, n) - f64::from(n != 1.0)).abs() < 1e-15, "{n}");
            // Brewster's angle, tan θ = n: the reflected light is polarised, r = cos² − sin² of it.
            let cosine = 1.0 / (1.0 + n * n).sqrt();
            let polarised = (2.0 * cosine * cosine - 1.0).powi(2) / 2.0;
            assert!((fresnel(cosine, n) - polarised).abs() < 1e-15, "{n}");
        }
    }

    #[test]
    fn reflectance_is_the_same_from_both_sides() {
        for n in [1.2, 1.5, 2.4] {
            for k in 0..=100 {
                let cosine = f64::from(k) / 100.0;
                let behind = refracted_cosine(cosine, n);
                // At grazing angles the angle behind has half of the digits.
                let off = fresnel(cosine, n) - fresnel(behind, 1.0 / n);
                assert!(off.abs() < 1e-7, "{n} {cosine}: {off}");
            }
        }
    }

    #[test]
    fn reflection_is_total_beyond_the_critical_angle() {
        let n: f64 = 1.5;
        let critical = (1.0 - 1.0 / (n * n)).sqrt();
        for cosine in [0.0, 0.3, critical - 1e-12] {
            assert_eq!(fresnel(cosine, 1.0 / n), 1.0);
            let direction = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, -cosine);
            assert_eq!(refracted(direction, DVec3::Z, 1.0 / n), None);
        }
        assert!(fresnel(critical + 1e-3, 1.0 / n) < 0.9);
    }

    #[test]
    fn refraction_follows_the_law_of_sines() {
        for ratio in [1.5, 1.0, 1.0 / 1.5, 1.33 / 1.5] {
            for k in 0..40 {
                let angle = f64::from(k) / 41.0 * std::f64::consts::FRAC_PI_2;
                let direction = DVec3::new(0.6 * angle.sin(), 0.8 * angle.sin(), -angle.cos());
                let Some(refracted) = refracted(direction, DVec3::Z, ratio) else {
                    assert!(angle.sin() >= ratio, "{ratio} {angle}");
                    continue;
                };
                assert!((refracted.length() - 1.0).abs() < 1e-14);
                let want = direction.truncate() / ratio;
                assert!((refracted.truncate() - want).length() < 1e-15 && refracted.z < 0.0);
            }
        }
    }

    #[test]
    fn panes_sum_all_reflections_between_their_faces() {
        // Clear: R' = 2R / (1 + R), T' = (1 − R) / (1 + R) (Stokes 1862).
        for face in [0.0, 0.04, 0.3, 0.999, 1.0] {
            let [reflected, through] = pane(face, Rgb::ONE);
            assert!((reflected - Rgb::splat(2.0 * face / (1.0 + face))).length() < 1e-12);
            assert!((through - Rgb::splat((1.0 - face) / (1.0 + face))).length() < 1e-12);
        }
        // Tinted: each reflection by itself.
        let (face, tint) = (0.3, Rgb::new(1.0, 0.5, 0.0));
        let (mut reflected, mut through, mut inside) = (Rgb::splat(face), Rgb::ZERO, 1.0 - face);
        let mut passed = tint;
        for k in 0..100 {
            let out = (1.0 - face) * inside * passed;
            if k % 2 == 0 {
                through += out;
            } else {
                reflected += out;
            }
            (inside, passed) = (face * inside, passed * tint);
        }
        let [r, t] = pane(face, tint);
        assert!((r - reflected).length() < 1e-15 && (t - through).length() < 1e-15);
    }
}
