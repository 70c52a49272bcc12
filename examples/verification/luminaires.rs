//! Photometric files.

use std::f64::consts::PI;

use glam::DVec3;
use radiosity::io::read_photometry;
use radiosity::scene::Luminaire;

use crate::case::{Case, Section};
use crate::scenes::{facing_up, paint, quads};
use crate::{Result, file, points};

/// Angles between the values of the files, radians.
const STEP: f64 = PI / 36.0;

pub fn section() -> Result<Section> {
    let mut cases = fluxes()?;
    cases.extend(under_a_downlight()?);
    let bands = "Flux of cos³ and cos: linear interpolation over h = 5° is off by h²/8 of the \
        second derivative, at most 3 and 1 times the peak: 3h²/2 and h²/4 of the flux. \
        Direct and indirect: digits of the file, 5e-5 of 83.545 cd, and rounding. Points: \
        digits of the file.";
    Ok(Section { title: "Luminaires", bands, cases })
}

fn data(name: &str) -> std::path::PathBuf {
    file("examples/verification/data").join(name)
}

fn fluxes() -> Result<Vec<Case>> {
    // Constant below 90°, linear from there to 95°, constant above: ∫ 2π I sin θ dθ.
    let (down, up, h) = (238.7, 83.545, STEP);
    let ramp = down * h.sin() + (up - down) / h * (h * h.sin() + h.cos() - 1.0);
    let both = 2.0 * PI * (down + ramp + up * (1.0 - h.sin()));
    let mut cases = vec![];
    for (name, source, right, share) in [
        ("downlight.ies", "its lamp lumens: I₀ cos³ θ", 3000.0, 1.5 * STEP * STEP),
        ("cosine.ldt", "its lamp lumens: I₀ cos θ", 3000.0, STEP * STEP / 4.0),
        ("direct_indirect.ies", "closed form of its table", both, 5e-5 / 83.545),
    ] {
        let file = read_photometry(data(name))?;
        cases.push(Case {
            name: name.into(),
            source: source.into(),
            quantity: "flux, lm".into(),
            right,
            here: file.intensity.flux(),
            band: share * right,
        });
    }
    Ok(cases)
}

/// A lamp 2 m above a floor: E = I₀ cos³ θ · cos θ / r² at angles of the table.
fn under_a_downlight() -> Result<Vec<Case>> {
    let file = read_photometry(data("downlight.ies"))?;
    let mut cases = vec![];
    for degrees in [0.0f64, 30.0, 45.0, 60.0] {
        let lamp = Luminaire::new(file.intensity.clone(), 2.0 * DVec3::Z, DVec3::NEG_Z);
        // Below the point, so that the ground is not in its way.
        let ground = (facing_up([0.0, 1.0], [0.0, 1.0], -10.0), paint(0.0, 0.0));
        let scene = quads(&[ground]).with_luminaires(vec![lamp])?;
        let (tangent, cosine) = (degrees.to_radians().tan(), degrees.to_radians().cos());
        let intensity = 3000.0 * 2.0 / PI * cosine.powi(3);
        let right = intensity * cosine.powi(3) / 4.0;
        cases.push(Case {
            name: format!("downlight.ies, point {degrees}° from the axis"),
            source: "closed form, I cos θ / r²".into(),
            quantity: "illuminance, lx".into(),
            right,
            here: points::irradiance(&scene, 2.0 * tangent * DVec3::X)?,
            band: (5e-5 / intensity + 1e-12) * right,
        });
    }
    Ok(cases)
}
