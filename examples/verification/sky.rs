//! Skies and the sun over open ground.

use std::f64::consts::PI;

use glam::DVec3;
use radiosity::scene::SkyDistribution;
use radiosity::{Rgb, Sky, Sun};

use crate::case::{Case, Section};
use crate::scenes::{facing_up, paint, quads};
use crate::{Result, points};

/// Of the radiance, from the middle of a piece of the sky to its corner: 0.3°/√2, and its logarithm
/// changes by less than 2 a radian in all directions that are looked at here (1.9 at most, measured
/// over 2°).
const CHANGE: f64 = 2.0 * 0.0037;

pub fn section() -> Result<Section> {
    let overcast = Sky::new(SkyDistribution::OVERCAST, Rgb::ONE, DVec3::Z, DVec3::Z)?;
    let mut cases = vec![
        under(
            "uniform sky, L = 1, ground",
            "closed form, π L",
            &Sky::uniform(Rgb::ONE),
            [PI, 1e-12],
        )?,
        under(
            "overcast sky, zenith 1, ground",
            "closed form, 7π/9 (Moon, Spencer 1942)",
            &overcast,
            [7.0 * PI / 9.0, 1e-4],
        )?,
    ];
    // A wall sees the sky as the ground does where the wall's normal is z and up is x.
    let beside = Sky::new(SkyDistribution::OVERCAST, Rgb::ONE, DVec3::X, DVec3::X)?;
    let right = PI / 6.0 + 4.0 / 9.0;
    let wall = "overcast sky, zenith 1, wall";
    cases.push(under(wall, "closed form, π/6 + 4/9", &beside, [right, 1.0 / 128.0])?);
    for degrees in [0.0f64, 30.0, 60.0, 85.0] {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        let sun = Sun { direction: DVec3::new(sine, 0.0, cosine), irradiance: Rgb::splat(1000.0) };
        let name = format!("sun of 1000 W/m², {degrees}° from the zenith");
        let sky = Sky::default().with_sun(sun)?;
        cases.push(under(&name, "closed form, E cos Z", &sky, [1000.0 * cosine, 1e-12])?);
    }
    cases.extend(luminances()?);
    let bands = "Uniform sky and sun: rounding. Overcast sky: its pieces of 0.3° and N = 2¹⁴ rays \
        take second differences of what changes by all of itself over 90°, below 1e-4; on \
        the wall the horizon runs between rays, π √N of which are at it: 1/128. CIE and \
        Perez: a corner of a piece is 0.21° from its middle, and the radiance changes by \
        less than twice itself over a radian: 0.74 %.";
    Ok(Section { title: "Sky and sun", bands, cases })
}

/// What a point that looks along z receives.
fn under(name: &str, source: &str, sky: &Sky, [right, share]: [f64; 2]) -> Result<Case> {
    let ground = (facing_up([0.0, 1.0], [0.0, 1.0], -10.0), paint(0.0, 0.0));
    let scene = quads(&[ground]).with_sky(sky.clone())?;
    Ok(Case {
        name: name.into(),
        source: source.into(),
        quantity: "irradiance, W/m²".into(),
        right,
        here: points::irradiance(&scene, DVec3::ZERO)?,
        band: share * right,
    })
}

/// Radiance over that at the zenith: a direction by its zenith angle and its azimuth from the sun,
/// whose zenith angle comes first, degrees. Worked out from the formulas by another program.
fn luminances() -> Result<Vec<Case>> {
    let cie = |n| SkyDistribution::cie(n).map(|sky| (format!("CIE sky {n}"), sky));
    let perez = |clearness: f64, brightness, sun: f64| {
        let sky = SkyDistribution::perez(clearness, brightness, sun.to_radians())?;
        Some((format!("Perez sky, clearness {clearness}, brightness {brightness}"), sky))
    };
    let mut cases = vec![];
    for (sky, [sun, zenith, azimuth], right) in [
        (cie(12), [50.0, 30.0, 60.0], 1.419_067_178_797_464_7),
        (cie(1), [50.0, 60.0, 0.0], 0.665_157_700_559_763_6),
        (cie(7), [40.0, 70.0, 180.0], 0.501_285_183_837_914_5),
        (cie(5), [10.0, 85.0, 30.0], 1.0),
        (perez(7.0, 0.1, 40.0), [40.0, 60.0, 45.0], 1.721_111_866_460_188_5),
        (perez(1.0, 0.3, 60.0), [60.0, 30.0, 90.0], 0.953_100_743_080_980_1),
    ] {
        let towards = |zenith: f64, azimuth: f64| {
            let ([sz, cz], [sa, ca]) = (sin_cos(zenith), sin_cos(azimuth));
            DVec3::new(sz * ca, sz * sa, cz)
        };
        let (name, distribution) = sky.ok_or("no such sky")?;
        let sky = Sky::new(distribution, Rgb::ONE, DVec3::Z, towards(sun, 0.0))?;
        cases.push(Case {
            name: format!("{name}, sun at {sun}°, towards {zenith}°, {azimuth}°"),
            source: "formula of CIE S 011 and of Perez 1993".into(),
            quantity: "radiance over zenith".into(),
            right,
            here: sky.radiance(towards(zenith, azimuth)).x,
            band: CHANGE * right,
        });
    }
    Ok(cases)
}

fn sin_cos(degrees: f64) -> [f64; 2] {
    let (sine, cosine) = degrees.to_radians().sin_cos();
    [sine, cosine]
}
