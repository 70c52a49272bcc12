//! Skies that are not the same in all directions, and the sun.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec3;
use radiosity::backend::gpu::TracedGather;
use radiosity::bake::Outcome;
use radiosity::gather::{Gather, GatherPoint, IrradianceSample, RadiosityField};
use radiosity::scene::SkyDistribution;
use radiosity::verify::{PathTracer, Settings, verify};
use radiosity::{Backend, BakeTarget, Camera, ErrorKind, Mesh, Rgb, Scene, Sky, Sun};

use crate::common::scenes::{Quad, facing_down, facing_up, paint, quads, standing_block};
use crate::common::{gpu, keep_counting, keep_going};

const ZENITH: Rgb = Rgb::new(1.0, 2.0, 0.5);

const SUN: Rgb = Rgb::new(900.0, 800.0, 700.0);

/// Half of what the sun is wide, radians: 959.63 arc seconds.
const SUN_RADIUS: f64 = 0.004_652_4;

fn overcast(up: DVec3) -> Sky {
    Sky::new(SkyDistribution::OVERCAST, ZENITH, up, up).unwrap()
}

fn sunny(direction: DVec3) -> Sky {
    Sky::default().with_sun(Sun { direction, irradiance: SUN }).unwrap()
}

fn under(sky: Sky, parts: &[(Quad, f64)]) -> Scene {
    let painted: Vec<_> = parts.iter().map(|&(quad, rho)| (quad, paint(rho, 0.0))).collect();
    quads(&painted).with_sky(sky).unwrap()
}

/// A square of ground, 1 × 1, 10 below the origin and reflecting nothing, and `others`.
fn open(sky: Sky, others: &[Quad]) -> Scene {
    let below = (facing_up([0.0, 1.0], [0.0, 1.0], -10.0), 0.0);
    let others = others.iter().map(|&quad| (quad, 0.5));
    under(sky, &[below].into_iter().chain(others).collect::<Vec<_>>())
}

/// What reaches `position` on a surface that looks along `normal`, by rays on the CPU and on the
/// device.
fn gathered(scene: &Scene, position: DVec3, normal: DVec3) -> [IrradianceSample; 2] {
    let mesh = Mesh::new(scene.clone(), f64::INFINITY).unwrap();
    let point = GatherPoint { position, normal: normal.normalize(), near: 1e-7 };
    let corners = vec![[0; 3]; mesh.element_count()];
    let field = RadiosityField { mesh: &mesh, corners: &corners, reflected: &[Rgb::ZERO] };
    let mut rays = Backend::Cpu.gather(&mesh, 1 << 14).unwrap();
    let mut on_device = TracedGather::new(&gpu(), &mesh, 1 << 14).unwrap();
    [&mut *rays as &mut dyn Gather, &mut on_device]
        .map(|gatherer| gatherer.gather(&field, &[point]).unwrap()[0])
}

/// All of `found` are `truth` but for `share` of it.
fn check(found: [IrradianceSample; 2], truth: Rgb, share: f64) {
    for sample in found {
        let off = (sample.irradiance / truth - 1.0).abs().max_element();
        assert!(off < share, "{off:e} off: {:?} is not {truth}", sample.irradiance);
    }
}

/// Pieces of a sky are 0.3° wide, pixels of these hemicubes 0.9° and fewer rays lie at the rim: of
/// what changes by all of itself over 90°, the second differences over them are below 1e-4.
const SMOOTH: f64 = 1e-4;

/// 7π/9 times the zenith for the ground (Moon and Spencer 1942), π for a uniform sky; a wall sees
/// half of the sky: by the pieces of 0.3 degrees.
#[test]
fn unoccluded_irradiance_is_that_of_closed_forms() {
    for up in [DVec3::Y, DVec3::Z, DVec3::new(1.0, 2.0, -1.0).normalize()] {
        let ground = overcast(up).irradiance(up) / overcast(up).radiance(up);
        assert!((ground / (7.0 * PI / 9.0) - 1.0).length() < 1e-4, "{ground}");
    }
    let even = Sky::uniform(Rgb::new(1.0, 2.0, 3.0));
    assert_eq!(even.irradiance(DVec3::X), PI * Rgb::new(1.0, 2.0, 3.0));
}

#[test]
fn an_overcast_sky_lights_ground_and_walls_by_its_closed_form() {
    // L_z (1 + 2 cos Z)/3 over the hemisphere: 7π/9 L_z, and over the upper half of that of a wall
    // π/6 + 4/9. Nothing comes from below the horizon.
    for up in [DVec3::Z, DVec3::Y, DVec3::new(1.0, -2.0, 0.5).normalize()] {
        let scene = open(overcast(up), &[]);
        check(gathered(&scene, DVec3::ZERO, up), 7.0 * PI / 9.0 * ZENITH, SMOOTH);
        // The horizon runs through pixels and between rays: half a pixel of those at it, of which
        // there are four times 128 or π times √(2¹⁴): less than 1/128 of the light.
        let wall = gathered(&scene, DVec3::ZERO, up.any_orthonormal_vector());
        check(wall, (PI / 6.0 + 4.0 / 9.0) * ZENITH, 1.0 / 128.0);
        let below = gathered(&scene, DVec3::new(0.0, 0.0, 1.0), -up);
        assert!(below.iter().all(|sample| sample.irradiance == Rgb::ZERO), "{below:?}");
    }
}

#[test]
fn standard_skies_have_their_gradation_and_indicatrix() {
    // Towards the zenith angle and the azimuth from the sun, whose zenith angle comes first, all
    // in degrees: worked out from the two formulas, and from Perez's own, by another program.
    let perez = |clearness, brightness, sun: f64| {
        SkyDistribution::perez(clearness, brightness, sun.to_radians()).unwrap()
    };
    let cie = |number| SkyDistribution::cie(number).unwrap();
    for (distribution, sun, zenith, azimuth, relative) in [
        (cie(12), 50.0, 30.0, 60.0, 1.419_067_178_797_464_7),
        (cie(1), 50.0, 60.0, 0.0, 0.665_157_700_559_763_6),
        (cie(7), 40.0, 70.0, 180.0, 0.501_285_183_837_914_5),
        (perez(7.0, 0.1, 40.0), 40.0, 60.0, 45.0, 1.721_111_866_460_188_5),
        (perez(1.0, 0.3, 60.0), 60.0, 30.0, 90.0, 0.953_100_743_080_980_1),
        (cie(5), 10.0, 85.0, 30.0, 1.0),
    ] {
        let towards = |zenith: f64, azimuth: f64| {
            let (z, a) = (zenith.to_radians(), azimuth.to_radians());
            DVec3::new(z.sin() * a.cos(), z.sin() * a.sin(), z.cos())
        };
        let sky = Sky::new(distribution, ZENITH, DVec3::Z, 3.0 * towards(sun, 0.0)).unwrap();
        // The middle of a piece of 0.3°, in which the radiance changes by as much over a radian.
        let found = sky.radiance(towards(zenith, azimuth)) / ZENITH;
        assert!((found - relative).abs().max_element() < 0.01 * relative, "{found} {relative}");
        assert_eq!(sky.radiance(towards(90.1, azimuth)), Rgb::ZERO);
    }
    assert_eq!((SkyDistribution::cie(0), SkyDistribution::cie(16)), (None, None));
    assert_eq!(SkyDistribution::perez(0.9, 0.1, 0.1), None);
    assert_eq!(SkyDistribution::perez(2.0, f64::NAN, 0.1), None);
}

#[test]
fn the_sun_lights_by_the_cosine() {
    let direction = DVec3::new(0.36, -0.48, 0.8);
    let scene = open(sunny(7.0 * direction), &[]);
    let tangent = direction.any_orthonormal_vector();
    for degrees in [0.0f64, 30.0, 60.0, 85.0, 89.0] {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        let found = gathered(&scene, DVec3::ZERO, cosine * direction + sine * tangent);
        check([found[0]; 2], cosine * SUN, 1e-12);
        // The device has its normal in 32 bits, 6e-8 of a cosine of down to 0.017.
        check([found[1]; 2], cosine * SUN, 1e-5);
        assert!(found.iter().all(|sample| sample.direct == sample.irradiance));
    }
    // With its middle on the horizon: half of the disc, whose points are at sines up to its radius,
    // on average 4/(3π) of that. The pixels of the horizon's line, a thirtieth of the disc's.
    let found = gathered(&scene, DVec3::ZERO, tangent);
    check(found, 4.0 / (3.0 * PI) * SUN_RADIUS / 2.0 * SUN, 0.1);
    let (sine, cosine) = (FRAC_PI_2 + 1.01 * SUN_RADIUS).sin_cos();
    let found = gathered(&scene, DVec3::ZERO, cosine * direction + sine * tangent);
    assert!(found.iter().all(|sample| sample.irradiance == Rgb::ZERO), "{found:?}");
}

#[test]
fn the_edge_of_a_shadow_is_as_wide_as_the_sun() {
    // A half-plane at height 1 hides a segment of the disc: the share that is seen where its edge
    // passes at `x` radii from the middle.
    let share = |x: f64| (x.acos() - x * (1.0 - x * x).sqrt()) / PI;
    let radius = SUN_RADIUS.tan();
    for x in [-1.01, -0.5, 0.0, 0.3, 0.9, 1.01] {
        let edge = radius * x;
        for shutter in [
            facing_down([-50.0, edge], [-50.0, 50.0], 1.0),
            facing_up([-50.0, edge], [-50.0, 50.0], 1.0),
        ] {
            let found = gathered(&open(sunny(DVec3::Z), &[shutter]), DVec3::ZERO, DVec3::Z);
            let truth: f64 = share(f64::clamp(x, -1.0, 1.0));
            for sample in found {
                // As many strata of rays. In 32 bits the sides of the shutter are as wide as the
                // rounding of its test, 5e-7 of its length: 0.01 radii, in which a ray or two lie.
                let off = (sample.direct / SUN - truth).abs().max_element() - 1e-12;
                let is_sharp = sample == found[0];
                let rounding = if is_sharp { 0.0 } else { 2.0 / 4096.0 };
                assert!(
                    off < 1.5 / 32.0 * (1.0 - x * x).max(0.0).sqrt() + rounding,
                    "{x}: {sample:?} {truth}"
                );
            }
        }
    }
}

#[test]
fn paths_find_the_same_sky_and_sun() {
    // Below a strip of a shutter, in a penumbra and half under the sky.
    let shutter = facing_down([-50.0, 0.0], [-50.0, 50.0], 1.0);
    let sky = overcast(DVec3::Z).with_sun(Sun { direction: DVec3::Z, irradiance: SUN }).unwrap();
    let floor = facing_up([-1.0, 1.0], [-1.0, 1.0], 0.0);
    let scene = under(sky, &[(floor, 0.5), (shutter, 0.0)]);
    let tracer = PathTracer::new(&scene);
    for x in [-0.5, 0.0, 0.0015, 0.5] {
        let point = tracer.locate(DVec3::new(x, 0.1, 0.0), DVec3::Z).unwrap();
        let found = tracer.reflected(&[point], 20_000, 3, keep_counting)[0];
        for sample in gathered(&scene, DVec3::new(x, 0.1, 1e-6), DVec3::Z) {
            let off = (found.radiosity - 0.5 * sample.irradiance).abs();
            // The penumbra to a line of pixels, as above; else rays and pixels at the edge.
            let own = if x == 0.0015 { 1.5 / 32.0 } else { 0.01 };
            let within = 4.0 * found.standard_error + own * 0.5 * sample.irradiance;
            assert!(off.cmplt(within).all(), "{x}: {found:?} {sample:?}");
        }
    }
}

#[test]
fn a_picture_lies_around_the_scene_as_it_says() {
    // A bright square in a line of eight by four: right of the middle, one above the horizon.
    const WIDTH: usize = 8;
    let mut pixels = [Rgb::ZERO; 4 * WIDTH];
    pixels[WIDTH + 4] = ZENITH;
    let sky = |up| Sky::picture(WIDTH as u32, &pixels, up).unwrap();
    let (elevation, azimuth) = (PI / 8.0, TAU / 16.0);
    let level = elevation.cos() * azimuth.cos();
    let (right, above) = (elevation.cos() * azimuth.sin(), elevation.sin());
    for (up, direction) in
        [(DVec3::Y, DVec3::new(right, above, -level)), (DVec3::Z, DVec3::new(right, level, above))]
    {
        assert_eq!(sky(up).radiance(direction), ZENITH.as_vec3().as_dvec3());
        for other in [-direction, direction.with_x(-right), direction - 2.0 * above * up] {
            assert_eq!(sky(up).radiance(other), Rgb::ZERO, "{other}");
        }
        // Its solid angle: an eighth of the way round, from the horizon to 45°.
        let found = gathered(&open(sky(up), &[]), DVec3::ZERO, up);
        let truth = TAU / 8.0 * (0.5 - 0.5 * (PI / 4.0).cos().powi(2));
        // Four edges, of pixels as of pieces: 0.9° of 45°, a quarter of it on either side.
        check(found, truth * ZENITH, 0.02);
    }
}

#[test]
fn a_bake_under_a_clear_sky_is_as_path_traced() {
    let towards_sun = DVec3::new(0.6, 0.3, 0.5);
    let clear = Sky::new(SkyDistribution::cie(12).unwrap(), ZENITH, DVec3::Z, towards_sun).unwrap();
    let sky = clear.with_sun(Sun { direction: towards_sun, irradiance: 10.0 * ZENITH }).unwrap();
    let mut parts = vec![(facing_up([-2.0, 2.0], [-2.0, 2.0], 0.0), 0.5)];
    let block = standing_block([-0.3, 0.4], [-0.5, 0.5], 0.0, 1.0);
    parts.extend(block.into_iter().map(|side| (side, 0.7)));
    let scene = under(sky, &parts);
    let baked = BakeTarget::Error(0.05).bake(scene.clone(), &Backend::Cpu, keep_going).unwrap();
    assert_eq!(baked.outcome, Outcome::Reached);
    let found = verify(&scene, &baked.light.surface, &Settings::default(), keep_going).unwrap();
    let error = found.error.unwrap();
    assert!(error.value - 2.0 * error.standard_error < 0.05, "{error:?}");
    // The sky is in the picture, and the pixels know it.
    let eye = DVec3::new(0.0, 0.0, 5.0);
    let above = DVec3::new(0.3, 0.2, 0.9).normalize();
    let camera = Camera { eye, target: eye + above, up: DVec3::Y, vertical_fov: 0.01 };
    let image = camera.image(&baked.light.surface, 1, 1, 2).unwrap();
    assert!(image.sky[0] && (image.pixels[0] - scene.sky().radiance(above)).length() < 1e-12);
}

#[test]
fn a_side_that_looks_below_the_horizon_is_dark() {
    let plate = facing_up([0.0, 1.0], [0.0, 1.0], 1.0);
    let doubled = |sky: Sky| {
        let material =
            radiosity::Material { sides: radiosity::scene::Sides::Auto, ..paint(0.5, 0.0) };
        let scene = quads(&[(plate, material)]).with_sky(sky).unwrap();
        scene.resolve_sides().triangles().len() == 4
    };
    assert!(!doubled(overcast(DVec3::Z)), "its back sees nothing");
    assert!(!doubled(sunny(DVec3::Z)));
    let sun_from_below = Sun { direction: DVec3::new(1.0, 0.0, -0.3), irradiance: SUN };
    assert!(doubled(overcast(DVec3::Z).with_sun(sun_from_below).unwrap()));
}

#[test]
fn skies_have_light_and_directions() {
    let message = |error: Result<Sky, radiosity::Error>| {
        let error = error.unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Scene);
        error.to_string()
    };
    let new = |zenith, up| Sky::new(SkyDistribution::OVERCAST, zenith, up, DVec3::Z);
    assert!(message(new(Rgb::NEG_ONE, DVec3::Z)).contains("zenith"));
    assert!(message(new(Rgb::splat(f64::NAN), DVec3::Z)).contains("zenith"));
    assert!(message(new(Rgb::ONE, DVec3::ZERO)).contains("up"));
    assert!(message(Sky::picture(2, &[Rgb::ONE; 3], DVec3::Z)).contains("lines"));
    assert!(message(Sky::picture(0, &[], DVec3::Z)).contains("lines"));
    let mut pixels = [Rgb::ONE; 4];
    pixels[3].y = f64::INFINITY;
    assert!(message(Sky::picture(2, &pixels, DVec3::Z)).contains("pixel 1 of line 1"));
    let sun = |direction, irradiance| Sky::default().with_sun(Sun { direction, irradiance });
    assert!(message(sun(DVec3::ZERO, Rgb::ONE)).contains("sun"));
    assert!(message(sun(DVec3::X, Rgb::NEG_ONE)).contains("sun"));
    assert!(sun(DVec3::X, Rgb::ZERO).unwrap().is_black());
}
