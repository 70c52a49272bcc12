//! A year of daylight, against closed forms and against the light of single hours.

mod epw;

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use glam::DVec3;
use radiosity::daylight::{
    AnnualDaylight, AnnualSettings, DaylightHour, DaylightYear, Estimate, annual_daylight,
};
use radiosity::gather::{GatherPoint, irradiance_at};
use radiosity::path_correction::correct_by_paths;
use radiosity::scene::SolarIrradiance;
use radiosity::{Backend, BakeTarget, Material, Scene, Sky, Sun};

use crate::common::scenes::{facing_up, walls};
use crate::common::{keep_counting, keep_going, quads};

/// An hour with the sun at this elevation and azimuth, degrees, +z up and +y north.
fn hour(
    direct_normal: f64,
    diffuse_horizontal: f64,
    [elevation, azimuth]: [f64; 2],
) -> DaylightHour {
    let (sine, cosine) = elevation.to_radians().sin_cos();
    let (east, north) = azimuth.to_radians().sin_cos();
    let light = SolarIrradiance {
        direct_normal,
        diffuse_horizontal,
        sun_zenith: FRAC_PI_2 - elevation.to_radians(),
        extraterrestrial: SolarIrradiance::SOLAR_CONSTANT,
    };
    let towards_sun = DVec3::new(cosine * east, cosine * north, sine);
    DaylightHour { light, towards_sun, dew_point: 11.0, duration: 1.0, is_occupied: true }
}

fn measured(
    scene: &Scene,
    points: &[GatherPoint],
    hours: &[DaylightHour],
    error: f64,
) -> Vec<AnnualDaylight> {
    let year = DaylightYear::new(hours, DVec3::Z).unwrap();
    let settings = AnnualSettings { error, ..AnnualSettings::default() };
    let scene = Arc::new(scene.clone());
    annual_daylight(&scene, &year, points, &settings, keep_counting).unwrap().unwrap()
}

/// Black ground and a point above it, which sees all of the sky.
fn open_ground() -> (Scene, GatherPoint) {
    let black = Material::grey("black", 0.0);
    let scene = quads(&[(facing_up([-1.0, 1.0], [-1.0, 1.0], 0.0), black)]);
    let point = GatherPoint::above(&scene, DVec3::new(0.0, 0.0, 0.5), DVec3::Z, 0.1);
    (scene, point)
}

fn near(found: Estimate, truth: f64) {
    // Four standard errors; the rounding of sums in 32 bits, and the mean cosine over the rim of
    // the sun, half of the square of its radius, 1.1e-5, below that of its middle.
    let within = 4.0 * found.error + 2e-5 * truth;
    assert!((found.value - truth).abs() <= within, "{found:?} {truth}");
}

/// Level open ground receives what the file says, whatever the sky looks like: DNI sin h + DHI,
/// times the efficacy of each.
#[test]
fn open_ground_receives_what_was_measured() {
    let (scene, point) = open_ground();
    for (direct, diffuse, sun) in
        [(0.0, 120.0, [30.0, 90.0]), (800.0, 90.0, [50.0, 200.0]), (600.0, 0.0, [20.0, 0.0])]
    {
        let hour = hour(direct, diffuse, sun);
        let efficacy = hour.light.efficacy(11.0);
        let level = direct * efficacy.direct * sun[0].to_radians().sin();
        let found = measured(&scene, &[point], &[hour], 0.01)[0];
        near(found.exposure, level + diffuse * efficacy.diffuse);
        // 0.4 % by paths, and what the cosine differs by over a wide patch.
        assert!(found.exposure.error < 0.01 * found.exposure.value, "{found:?}");
        assert_eq!(found.sun_hours, if level > 1000.0 { 1.0 } else { 0.0 });
        assert_eq!(found.backface, 0.0);
    }
}

/// Hours of known illuminance and darkness: shares of each class are those of the hours.
#[test]
fn shares_are_those_of_the_hours() {
    let (scene, point) = open_ground();
    let by_lux = |lux: f64| {
        // Overcast with the sun at 30°: the efficacy depends a little on the irradiance itself.
        let mut diffuse = lux / 110.0;
        for _ in 0..50 {
            diffuse = lux / hour(0.0, diffuse, [30.0, 90.0]).light.efficacy(11.0).diffuse;
        }
        hour(0.0, diffuse, [30.0, 90.0])
    };
    let mut hours: Vec<DaylightHour> =
        [50.0, 200.0, 240.0, 1000.0, 2000.0, 2500.0, 5000.0].map(by_lux).to_vec();
    hours.push(hour(0.0, 0.0, [-20.0, 0.0]));
    let mut unseen = by_lux(1e4);
    (unseen.is_occupied, unseen.duration) = (false, 0.5);
    hours.push(unseen);
    let found = measured(&scene, &[point], &hours, 0.01)[0];
    // Noise of 1 % is far from every limit.
    assert_eq!(found.autonomy, Estimate { value: 4.0 / 8.0, error: 0.0 });
    assert_eq!(found.useful.map(|class| class.value), [2.0, 2.0, 3.0, 1.0].map(|n| n / 8.0));
    near(found.continuous, (490.0 / 300.0 + 4.0) / 8.0);
    near(found.exposure, 10_990.0 + 0.5 * 1e4);
    assert_eq!(found.sun_hours, 0.0);
}

/// A room of 4 m by 5 m by 3 m with a window of 2 m by 1.5 m in its south wall, and ground outside.
fn room() -> Scene {
    let grey = |reflectance| Material::grey("surface", reflectance);
    let all = walls([0.0; 3], [4.0, 5.0, 3.0]);
    let faces_north = |quad: &[[f64; 3]; 4]| quad.iter().all(|corner| corner[1] == 0.0);
    let mut parts: Vec<_> =
        all.into_iter().filter(|q| !faces_north(q)).map(|q| (q, grey(0.5))).collect();
    let strip = |x: [f64; 2], z: [f64; 2]| {
        [[x[0], 0.0, z[0]], [x[0], 0.0, z[1]], [x[1], 0.0, z[1]], [x[1], 0.0, z[0]]]
    };
    for (x, z) in [
        ([0.0, 4.0], [0.0, 0.9]),
        ([0.0, 4.0], [2.4, 3.0]),
        ([0.0, 1.0], [0.9, 2.4]),
        ([3.0, 4.0], [0.9, 2.4]),
    ] {
        parts.push((strip(x, z), grey(0.5)));
    }
    assert_eq!(parts.len(), 9);
    parts.push((facing_up([-20.0, 24.0], [-30.0, 0.0], -0.1), grey(0.2)));
    quads(&parts)
}

/// Light of one hour by coefficients, against a bake under the sky and the sun of that hour with
/// its values corrected by paths: three hours, points in the sun and not.
#[test]
fn hours_are_as_if_computed_one_by_one() {
    let scene = room();
    let places = [[2.0, 1.0], [2.0, 2.5], [1.0, 4.0], [3.3, 0.6]];
    let point = |[x, y]: [f64; 2]| GatherPoint::above(&scene, DVec3::new(x, y, 0.8), DVec3::Z, 0.1);
    let points = places.map(point);
    for hour in [
        hour(0.0, 150.0, [25.0, 150.0]),
        hour(750.0, 100.0, [55.0, 185.0]),
        hour(500.0, 180.0, [30.0, 215.0]),
    ] {
        let DaylightHour { light, towards_sun, .. } = hour;
        let efficacy = light.efficacy(11.0);
        let shape = |zenith: f64| {
            let distribution = light.distribution().unwrap();
            Sky::new(distribution, DVec3::splat(zenith), DVec3::Z, towards_sun).unwrap()
        };
        let diffuse = light.diffuse_horizontal * efficacy.diffuse;
        let sky = shape(diffuse / shape(1.0).irradiance(DVec3::Z).x);
        let irradiance = DVec3::splat(light.direct_normal * efficacy.direct);
        let sun = Sun { direction: towards_sun, irradiance };
        let lit = scene.clone().with_sky(sky.with_sun(sun).unwrap()).unwrap();
        let baked = BakeTarget::Error(0.1).bake(lit, &Backend::Cpu, keep_going).unwrap().light;
        let mut gatherer = Backend::Cpu.gather_to_noise(&baked, 0.005).unwrap();
        let mut truth =
            irradiance_at(&baked, &points, &mut *gatherer, keep_counting).unwrap().unwrap();
        correct_by_paths(&baked, &points, &mut truth, 0.03, keep_counting).unwrap().unwrap();
        let found = measured(&scene, &points, &[hour], 0.03);
        for (found, truth) in found.iter().zip(&truth) {
            let Estimate { value, error } = found.exposure;
            let (true_value, true_error) = (truth.irradiance.x, truth.standard_error.x);
            // Four standard errors of the difference; that of few gathers may be too small.
            let within = 4.0 * error.hypot(true_error) + 0.002 * true_value;
            assert!((value - true_value).abs() < within, "{found:?} {truth:?}");
            assert!(error < 0.05 * value, "{found:?}");
        }
    }
}
