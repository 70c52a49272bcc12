//! Cases 5.6 to 5.8 of CIE 171:2006. Right values are closed forms; the tables have fewer digits,
//! and table 19 is wrong (I. Ashdown, "CIE 171:2006 – Errata", 2016).

use std::f64::consts::PI;

use glam::DVec3;
use radiosity::form_factor::closed_form::point_to_polygon;
use radiosity::gather::GatherPoint;
use radiosity::scene::{IntensityDistribution, Luminaire};
use radiosity::{Backend, BakeTarget, GatheredMesh, Material, Rgb, Sky, Sun};

use crate::case::{Case, Section};
use crate::scenes::{Quad, block, facing_down, facing_up, paint, quads, walls};
use crate::{Result, furnace, go};

/// Rays of a point.
const RAYS: u32 = 1 << 18;

/// Error that bakes of the room are asked for.
const ASKED: f64 = 0.02;

pub fn section() -> Result<Section> {
    let mut cases = reflection()?;
    cases.extend(past_an_obstruction()?);
    for rho in [0.05, 0.2, 0.5, 0.8, 0.95] {
        cases.push(room(rho)?);
    }
    let bands = "5.6, 5.7: the edge of what is seen crosses at most 4.5 √N of the strata of N = \
        2¹⁸ rays, each right or wrong by half: four standard deviations are 4.2 N^(−3/4) of \
        all the hemisphere, 0.036 %. 5.8: the 2 % that the bake is asked for.";
    Ok(Section { title: "CIE 171:2006", bands, cases })
}

/// A surface under a sun that makes its radiosity 1, among black ones.
struct Sunlit {
    surface: Quad,
    reflectance: f64,
    others: Vec<Quad>,
    to_sun: DVec3,
    /// Of the angle between the sun and the surface's normal.
    cosine: f64,
}

impl Sunlit {
    fn settled(&self) -> Result<GatheredMesh> {
        let black = self.others.iter().map(|&quad| (quad, paint(0.0, 0.0)));
        let first = (self.surface, paint(self.reflectance, 0.0));
        let all: Vec<_> = std::iter::once(first).chain(black).collect();
        let irradiance = Rgb::splat(1.0 / (self.reflectance * self.cosine));
        let sky = Sky::default().with_sun(Sun { direction: self.to_sun, irradiance })?;
        Ok(BakeTarget::Error(0.01).bake(quads(&all).with_sky(sky)?, &Backend::Cpu, go)?.light)
    }
}

/// Points in a row, named from a letter on.
struct Row {
    case: &'static str,
    first: char,
    points: Vec<DVec3>,
    normal: DVec3,
}

impl Row {
    /// The light at each from `seen`, what is seen from there of the surface that reflects.
    fn cases(&self, light: &GatheredMesh, seen: impl Fn(DVec3) -> Quad) -> Result<Vec<Case>> {
        let normal = self.normal;
        let above = |&p: &DVec3| GatherPoint { position: p + 1e-6 * normal, normal, near: 1e-7 };
        let points: Vec<GatherPoint> = self.points.iter().map(above).collect();
        let mut rays = Backend::Cpu.gather(&light.mesh, RAYS)?;
        let samples = rays.gather(&light.radiosity_field(), &points)?;
        let case = |((&point, sample), name): ((&DVec3, _), char)| {
            let sample: &radiosity::gather::IrradianceSample = sample;
            Case {
                name: format!("{}, point {name}", self.case),
                source: "closed form; tables 17 and 19 (errata 2016) to their digits".into(),
                quantity: "E/(E ρ of the surface), %".into(),
                right: 100.0 * point_to_polygon(point, normal, &seen(point).map(DVec3::from_array)),
                here: 100.0 * (sample.irradiance - sample.direct).x,
                band: 100.0 * 4.2 * f64::from(RAYS).powf(-0.75),
            }
        };
        Ok(self.points.iter().zip(&samples).zip(self.first..).map(case).collect())
    }
}

/// Places 0.5 m apart.
fn row(count: u32, from: DVec3, step: DVec3) -> Vec<DVec3> {
    (0..count).map(|k| from + 0.5 * f64::from(k) * step).collect()
}

/// A floor of 4 m × 4 m that reflects 30 % under a sun at 35°; above it a wall from 0.5 m on, and a
/// ceiling at 3 m.
fn reflection() -> Result<Vec<Case>> {
    let floor = facing_up([0.0, 4.0], [0.0, 4.0], 0.0);
    let wall = walls([0.0, 0.0, 0.5], [4.0, 4.0, 3.0])[2];
    let ceiling = facing_down([0.0, 4.0], [0.0, 4.0], 3.0);
    let (sine, cosine) = 35f64.to_radians().sin_cos();
    let to_sun = DVec3::new(0.0, cosine, sine);
    let others = vec![wall, ceiling];
    let light = Sunlit { surface: floor, reflectance: 0.3, others, to_sun, cosine: sine };
    let light = light.settled()?;
    let on_wall = row(5, DVec3::new(2.0, 0.0, 0.75), DVec3::Z);
    let on_ceiling = row(8, DVec3::new(2.0, 0.25, 3.0), DVec3::Y);
    let case = "5.6 diffuse reflection";
    let wall = Row { case, first: 'B', points: on_wall, normal: DVec3::Y };
    let ceiling = Row { case, first: 'G', points: on_ceiling, normal: DVec3::NEG_Z };
    let mut cases = wall.cases(&light, |_| floor)?;
    cases.extend(ceiling.cases(&light, |_| floor)?);
    Ok(cases)
}

/// A wall of 4 m × 3 m that reflects 60 % under a sun at 60°, behind a block 1 m high; another wall
/// 4 m before it, and a floor up to the block.
fn past_an_obstruction() -> Result<Vec<Case>> {
    let of_room = walls([0.0; 3], [4.0, 4.0, 3.0]);
    let floor = facing_up([0.0, 4.0], [0.0, 2.5], 0.0);
    let mut others = block([0.0, 2.5, 0.0], [4.0, 2.7, 1.0]).to_vec();
    others.extend([of_room[2], floor]);
    let (sine, cosine) = 60f64.to_radians().sin_cos();
    let to_sun = DVec3::new(0.0, -cosine, sine);
    let light = Sunlit { surface: of_room[3], reflectance: 0.6, others, to_sun, cosine };
    let light = light.settled()?;
    // Above the nearer and the further edge of the block's top.
    let seen = |from: DVec3| {
        let past = |edge: f64| from.z + (1.0 - from.z) * (4.0 - from.y) / (edge - from.y);
        let low = past(2.5).max(past(2.7)).clamp(0.0, 3.0);
        [[0.0, 4.0, low], [4.0, 4.0, low], [4.0, 4.0, 3.0], [0.0, 4.0, 3.0]]
    };
    let on_wall = row(6, DVec3::new(2.0, 0.0, 2.75), DVec3::NEG_Z);
    let on_floor = row(5, DVec3::new(2.0, 0.25, 0.0), DVec3::Y);
    let case = "5.7 reflection past an obstruction";
    let wall = Row { case, first: 'A', points: on_wall, normal: DVec3::Y };
    let floor = Row { case, first: 'G', points: on_floor, normal: DVec3::Z };
    let mut cases = wall.cases(&light, seen)?;
    cases.extend(floor.cases(&light, seen)?);
    Ok(cases)
}

/// A point of 10 000 lm in the middle of a cube of 4 m: surfaces absorb what it sends, so that the
/// mean of E is Φ/(A (1 − ρ)).
fn room(rho: f64) -> Result<Case> {
    const FLUX: f64 = 10_000.0;
    const AREA: f64 = 96.0;
    let scene = quads(&walls([0.0; 3], [4.0; 3]).map(|wall| (wall, Material::grey("wall", rho))));
    let even = IntensityDistribution::isotropic(FLUX / (4.0 * PI))?;
    let lamp = Luminaire::new(even, DVec3::splat(2.0), DVec3::NEG_Z);
    let scene = scene.with_luminaires(vec![lamp])?;
    let baked = BakeTarget::Error(ASKED).bake(scene, &Backend::Cpu, go)?;
    let right = FLUX / (AREA * (1.0 - rho));
    Ok(Case {
        name: format!("5.8 light in a cube, ρ = {rho}"),
        source: "closed form, Φ/(A (1 − ρ)); table 20 is ρ times that".into(),
        quantity: "mean illuminance, lx".into(),
        right,
        here: furnace::mean(&baked.light.surface) / rho,
        band: ASKED * right,
    })
}
