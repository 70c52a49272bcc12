//! A uniform sky shines in from outside.

use std::f64::consts::PI;

use glam::DVec3;
use radiosity::backend::gpu::TracedGather;
use radiosity::bake::Outcome;
use radiosity::gather::{Gather, GatherPoint, GatheredMesh};
use radiosity::verify::{Settings, verify};
use radiosity::{Backend, BakeResult, BakeTarget, Camera, ErrorKind, Mesh, Rgb, Scene};

use crate::common::scenes::{Quad, facing_up, paint, quads, walls};
use crate::common::{gpu, keep_going};

const SKY: Rgb = Rgb::new(1.0, 2.0, 0.5);

fn under_sky(parts: &[(Quad, f64)]) -> Scene {
    let painted: Vec<_> = parts.iter().map(|&(quad, rho)| (quad, paint(rho, 0.0))).collect();
    quads(&painted).with_sky(SKY).unwrap()
}

fn bake(scene: &Scene, error: f64) -> BakeResult {
    BakeTarget::Error(error).bake(scene.clone(), &Backend::Cpu, keep_going).unwrap()
}

/// A floor of 1 × `length` between walls of 1 that reflect `wall`.
fn canyon(length: f64, wall: f64) -> Scene {
    let y = [-length / 2.0, length / 2.0];
    let [left, right, ..] = walls([0.0, y[0], 0.0], [1.0, y[1], 1.0]);
    under_sky(&[(facing_up([0.0, 1.0], y, 0.0), 0.5), (left, wall), (right, wall)])
}

/// Root mean square over the floor's elements, by area, of the radiosity at their centroids over
/// that of `sky_factor` there, less 1.
fn floor_error(light: &GatheredMesh, sky_factor: impl Fn(DVec3) -> Option<f64>) -> f64 {
    // Squared error and area of each element.
    let mut errors = vec![];
    for e in 0..light.mesh.element_count() {
        let node = light.mesh.element(e);
        let centroid = light.mesh.centroid(node);
        if light.mesh.normal(node).z < 0.9 || centroid.z != 0.0 {
            continue;
        }
        let Some(factor) = sky_factor(centroid) else { continue };
        let found = light.corners[e].map(|v| light.reflected[v as usize]).iter().sum::<Rgb>() / 3.0;
        let exact = 0.5 * PI * SKY * factor;
        let square = ((found - exact).length() / exact.length()).powi(2);
        errors.push((square, light.mesh.area(node)));
    }
    let area: f64 = errors.iter().map(|error| error.1).sum();
    assert!(area > 0.0);
    // The measure leaves out the hundredth of the area with the largest errors.
    errors.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut tail = 0.01 * area;
    let counted = errors.iter().map(|&(square, area)| {
        let left_out = area.min(tail);
        tail -= left_out;
        square * (area - left_out)
    });
    (counted.sum::<f64>() / (0.99 * area)).sqrt()
}

#[test]
fn open_ground_receives_pi_times_the_radiance() {
    let ground = under_sky(&[(facing_up([0.0, 1.0], [0.0, 1.0], 0.0), 0.5)]);
    let mesh = Mesh::new(ground, 1.0).unwrap();
    let point = GatherPoint { position: DVec3::new(0.4, 0.3, 1e-6), normal: DVec3::Z, near: 1e-7 };
    let dark = [Rgb::ZERO; 3];
    let corners = vec![[0, 1, 2]; mesh.element_count()];
    let field =
        radiosity::gather::RadiosityField { mesh: &mesh, corners: &corners, reflected: &dark };
    let mut rays = Backend::Cpu.gather(&mesh, 64).unwrap();
    let mut on_device = TracedGather::new(&gpu(), &mesh, 64).unwrap();
    for gatherer in [&mut *rays as &mut dyn Gather, &mut on_device] {
        let sample = gatherer.gather(&field, &[point]).unwrap()[0];
        // The device adds up in 32 bits.
        assert!((sample.irradiance / (PI * SKY) - 1.0).abs().max_element() < 1e-6, "{sample:?}");
    }
}

#[test]
fn a_canyon_is_lit_by_the_strip_above_it() {
    let scene = canyon(200.0, 0.0);
    let baked = bake(&scene, 0.05);
    assert_eq!(baked.outcome, Outcome::Reached);
    // Half the difference of the sines of the strip's edges (Hottel's crossed strings); at the
    // middle half of this length the ends hide less than (1/50)² of it.
    let sine = |x: f64| x / x.hypot(1.0);
    let factor = |p: DVec3| (p.y.abs() < 50.0).then(|| (sine(p.x) + sine(1.0 - p.x)) / 2.0);
    let error = floor_error(&baked.light, factor);
    assert!(error < 0.05, "{error}");
}

#[test]
fn the_bottom_of_a_well_sees_its_opening() {
    const DEPTH: f64 = 4.0;
    let mut parts = vec![(facing_up([0.0, 1.0], [0.0, 1.0], 0.0), 0.5)];
    let [a, b, c, d, ..] = walls([0.0; 3], [1.0, 1.0, DEPTH]);
    parts.extend([a, b, c, d].map(|wall| (wall, 0.0)));
    let baked = bake(&under_sky(&parts), 0.05);
    assert_eq!(baked.outcome, Outcome::Reached);
    // From a point to a parallel rectangle above, a corner of which is above the point (Howell,
    // configuration B-4): four of these.
    let corner = |a: f64, b: f64| {
        let (x, y) = (a.hypot(DEPTH), b.hypot(DEPTH));
        (a / x * (b / x).atan() + b / y * (a / y).atan()) / (2.0 * PI)
    };
    let factor = |p: DVec3| {
        let sides = |x: f64| [x, 1.0 - x];
        Some(sides(p.x).iter().flat_map(|&a| sides(p.y).map(|b| corner(a, b))).sum())
    };
    let error = floor_error(&baked.light, factor);
    assert!(error < 0.05, "{error}");
}

#[test]
fn a_window_lights_the_floor_by_what_is_seen_through_it() {
    // A room of 4 × 5 × 3 whose wall at y = 0 is four pieces around an opening.
    const OPENING: [[f64; 2]; 2] = [[1.0, 2.5], [0.9, 2.1]];
    let [west, east, _, north, floor, ceiling] = walls([0.0; 3], [4.0, 5.0, 3.0]);
    let piece = |[x0, x1]: [f64; 2], [z0, z1]: [f64; 2]| {
        [[x0, 0.0, z0], [x0, 0.0, z1], [x1, 0.0, z1], [x1, 0.0, z0]]
    };
    let [[left, right], [sill, head]] = OPENING;
    let mut parts = vec![(floor, 0.5)];
    parts.extend([west, east, north, ceiling].map(|wall| (wall, 0.0)));
    parts.extend([[0.0, left], [right, 4.0]].map(|x| (piece(x, [0.0, 3.0]), 0.0)));
    parts.extend([[0.0, sill], [head, 3.0]].map(|z| (piece([left, right], z), 0.0)));
    let baked = bake(&under_sky(&parts), 0.05);
    assert_eq!(baked.outcome, Outcome::Reached);
    // From a point at distance y to a rectangle at right angles that stands on its plane, as wide
    // as x to one side and as high as z (Howell, configuration B-3); by differences of four.
    let standing = |x: f64, y: f64, z: f64| {
        let slant = y.hypot(z);
        ((x / y).atan() - y / slant * (x / slant).atan()) / (2.0 * PI)
    };
    let factor = |p: DVec3| {
        let upto = |z: f64| standing(right - p.x, p.y, z) - standing(left - p.x, p.y, z);
        Some(upto(head) - upto(sill))
    };
    let error = floor_error(&baked.light, factor);
    assert!(error < 0.05, "{error}");
}

#[test]
fn light_between_the_walls_of_a_canyon_is_as_path_traced() {
    let scene = canyon(6.0, 0.7);
    let baked = bake(&scene, 0.05);
    assert_eq!(baked.outcome, Outcome::Reached);
    let found = verify(&scene, &baked.light.surface, &Settings::default(), keep_going).unwrap();
    let error = found.error.unwrap();
    assert!(error.value - 2.0 * error.standard_error < 0.05, "{error:?}");
    assert!(error.value < 0.1, "{error:?}");
}

#[test]
fn a_closed_box_gets_none() {
    let parts = walls([0.0; 3], [1.0; 3]).map(|wall| (wall, 0.5));
    let baked = bake(&under_sky(&parts), 0.1);
    assert!(baked.light.surface.radiosity.iter().all(|&b| b == Rgb::ZERO));
}

#[test]
fn what_nothing_hides_is_sky_in_the_picture() {
    let baked = bake(&under_sky(&[(facing_up([0.0, 1.0], [0.0, 1.0], 0.0), 0.5)]), 0.1);
    let camera = Camera {
        eye: DVec3::new(0.5, 0.5, 1.0),
        target: DVec3::ZERO,
        up: DVec3::Y,
        vertical_fov: 1.0,
    };
    for (target, radiance) in [(DVec3::new(0.5, 0.6, 2.0), 1.0), (DVec3::new(0.5, 0.55, 0.0), 0.5)]
    {
        let camera = Camera { target, ..camera };
        let image = camera.image(&baked.light.surface, 2, 2, 1).unwrap();
        for pixel in &image.pixels {
            // All of the ground's light is the sky's.
            assert!((*pixel - radiance * SKY).length() < 1e-6, "{pixel} {radiance}");
        }
        let mut rays = Backend::Cpu.gather(&baked.light.mesh, 64).unwrap();
        let gathered = camera
            .gathered_image(&baked.light, &mut *rays, 2, 2, 1, |_, _| {
                std::ops::ControlFlow::Continue(())
            })
            .unwrap()
            .unwrap();
        assert!(gathered.pixels.iter().all(|p| (*p - radiance * SKY).length() < 1e-6));
    }
}

#[test]
fn a_sky_is_no_less_than_dark() {
    let ground = quads(&[(facing_up([0.0, 1.0], [0.0, 1.0], 0.0), paint(0.5, 0.0))]);
    for radiance in [Rgb::new(0.0, -1.0, 0.0), Rgb::splat(f64::NAN), Rgb::splat(f64::MAX)] {
        let error = ground.clone().with_sky(radiance).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Scene);
        assert!(error.to_string().contains("sky"), "{error}");
    }
}

#[test]
fn what_sees_nothing_but_the_sky_hides_no_error() {
    let [west, ..] = walls([0.0; 3], [1.0; 3]);
    let corner = [(facing_up([0.0, 1.0], [0.0, 1.0], 0.0), 0.5), (west, 0.8)];
    // A hundred times as large, above them, looking up.
    let roof = (facing_up([0.0, 14.0], [0.0, 14.0], 2.0), 0.5);
    let roofed = [&corner[..], &[roof]].concat();
    let [alone, baked] = [&corner[..], &roofed].map(|parts| bake(&under_sky(parts), 0.1));
    // The light under the roof is another, and so is the error, but not a tenth.
    let (told, of_all) = (alone.estimate.total, baked.estimate.total);
    assert!(of_all > 0.5 * told && told > 1e-3, "{told} {of_all}");
    let scene = under_sky(&roofed);
    let mut solution = baked.light.surface.clone();
    for (position, radiosity) in solution.positions.iter().zip(&mut solution.radiosity) {
        *radiosity *= if position.z == 2.0 { 0.5 } else { 1.0 };
    }
    solution.irradiance.clear();
    let found = verify(&scene, &solution, &Settings::default(), keep_going).unwrap();
    assert_eq!(found.groups.iter().map(|g| g.hidden_share).collect::<Vec<_>>(), [0.0, 0.0, 1.0]);
    assert!(found.error.unwrap().value < 0.1 && found.error_with_hidden.unwrap().value > 0.4);
}
