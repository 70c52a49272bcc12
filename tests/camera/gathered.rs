//! The camera image whose pixels gather: against a closed form, and against the plain image.

use std::f64::consts::PI;
use std::ops::ControlFlow;
use std::time::Duration;

use glam::DVec3;
use radiosity::backend::cpu::RayGather;
use radiosity::camera::RadianceImage;
use radiosity::form_factor::closed_form::point_to_polygon;
use radiosity::gather::{GatherPoint, IrradianceSample, RadiosityField};
use radiosity::{Camera, Error, ErrorKind, Gather, GatheredMesh, Material, Mesh, Rgb};

use crate::common::{keep_counting, quads};

/// Faces up.
const FLOOR: [[f64; 3]; 4] = [[0., 0., 0.], [0., 0., 3.], [4., 0., 3.], [4., 0., 0.]];

/// Faces down.
const LAMP: [[f64; 3]; 4] = [[1., 2., 1.], [2., 2., 1.], [2., 2., 2.], [1., 2., 2.]];

const EXITANCE: Rgb = Rgb::new(3.0, 2.0, 1.0);

const REFLECTANCE: Rgb = Rgb::new(0.5, 0.25, 0.75);

/// A floor under a square lamp that reflects nothing, so that the floor has no other light. Its
/// elements are said to have radiosity `floor`, W/m².
fn lamp_over_floor(floor: Rgb) -> GatheredMesh {
    let lamp = Material { exitance: EXITANCE, ..Material::grey("lamp", 0.0) };
    let tinted = Material { reflectance: REFLECTANCE, ..Material::grey("floor", 0.0) };
    let mesh = Mesh::new(quads(&[(FLOOR, tinted), (LAMP, lamp)]), 1.0).unwrap();
    let emitted = |e| mesh.material(mesh.element(e)).exitance;
    let value = |e| if emitted(e) == Rgb::ZERO { floor } else { emitted(e) };
    let radiosity: Vec<Rgb> = (0..mesh.element_count()).map(value).collect();
    GatheredMesh::from_elements(&mesh, &radiosity).unwrap()
}

/// Looks over the floor and past its end, from below the lamp, which it sees above.
const CAMERA: Camera = Camera {
    eye: DVec3::new(2.5, 1.0, -2.0),
    target: DVec3::new(1.5, 0.8, 1.5),
    up: DVec3::Y,
    vertical_fov: 60.0,
};

const SIZE: (u32, u32) = (48, 32);

fn draw(light: &GatheredMesh, gather: &mut dyn Gather, samples: u32) -> RadianceImage {
    let image = CAMERA.gathered_image(light, gather, SIZE.0, SIZE.1, samples, keep_counting);
    image.unwrap().expect("nobody stopped it")
}

#[test]
fn picture_without_textures_is_that_of_its_surface() {
    let light = lamp_over_floor(Rgb::new(0.5, 1.0, 2.0));
    // Rays of several bands, the last of which is not whole.
    let (width, height, samples) = (333, 101, 5);
    let mut counts = vec![];
    let image = CAMERA.interpolated_image(&light, width, height, samples, |done, of| {
        counts.push((done, of));
        ControlFlow::Continue(())
    });
    let plain = CAMERA.image(&light.surface, width, height, samples).unwrap();
    // Its rays meet triangles of the scene, those of the surface its faces: but for rounding of
    // weights, some 1e-15, they find the same.
    let same = image.unwrap().unwrap().pixels.into_iter().zip(&plain.pixels);
    assert!(same.into_iter().all(|(a, b)| a.distance(*b) < 1e-13 * (1.0 + b.length())));
    let all = (width * height) as usize;
    assert!(counts.len() > 2 && counts.is_sorted(), "{counts:?}");
    assert_eq!(counts.last(), Some(&(all, all)));
    // Stopped, it gives nothing, at once.
    let mut calls = 0;
    let stopped = CAMERA.interpolated_image(&light, width, height, samples, |_, _| {
        calls += 1;
        ControlFlow::Break(())
    });
    assert!(stopped.unwrap().is_none() && calls == 1);
}

#[test]
fn gathered_radiance_matches_closed_form() {
    let light = lamp_over_floor(Rgb::ONE);
    let image = draw(&light, &mut RayGather::new(&light.mesh, 64).unwrap(), 1);
    let forward = (CAMERA.target - CAMERA.eye).normalize();
    let right = forward.cross(DVec3::Y).normalize();
    let up = right.cross(forward);
    let step = 2.0 * (CAMERA.vertical_fov.to_radians() / 2.0).tan() / f64::from(SIZE.1);
    let (mut floor, mut lamp) = (0, 0);
    for (k, &radiance) in (0..).zip(&image.pixels) {
        let x = (f64::from(k % SIZE.0) + 0.5 - f64::from(SIZE.0) / 2.0) * step;
        let y = (f64::from(SIZE.1) / 2.0 - f64::from(k / SIZE.0) - 0.5) * step;
        let direction = forward + right * x + up * y;
        // Where the line of sight meets a horizontal rectangle.
        let meets = |quad: [[f64; 3]; 4]| {
            let [low, high] = [quad[0], quad[2]].map(DVec3::from_array);
            let along = (low.y - CAMERA.eye.y) / direction.y;
            let at = DVec3 { y: low.y, ..CAMERA.eye + direction * along };
            (along > 0.0 && at.cmpge(low).all() && at.cmple(high).all()).then_some(at)
        };
        let want = if let Some(at) = meets(FLOOR) {
            floor += 1;
            let factor = point_to_polygon(at, DVec3::Y, &LAMP.map(DVec3::from_array));
            REFLECTANCE * EXITANCE * factor / PI
        } else if meets(LAMP).is_some() {
            lamp += 1;
            EXITANCE / PI
        } else {
            Rgb::ZERO
        };
        // Seen from depth h below the lamp, F is about h² A / (π r⁴). A place is at most 1e-4 of an
        // element's size, which is below 1, nearer than h = 2: 2 · 1e-4 / 2 off, or less.
        assert!((radiance - want).length() <= 1e-4 * want.length(), "{k}: {radiance} {want}");
    }
    assert!(floor > 250 && lamp > 15, "{floor} {lamp}");
}

/// Finds the same irradiance everywhere, and counts the places.
struct Even {
    irradiance: Rgb,
    places: usize,
}

impl Gather for Even {
    fn gather(
        &mut self,
        _: &RadiosityField,
        places: &[GatherPoint],
    ) -> Result<Vec<IrradianceSample>, Error> {
        self.places += places.len();
        Ok(vec![
            IrradianceSample { irradiance: self.irradiance, ..Default::default() };
            places.len()
        ])
    }
}

#[test]
fn gathered_image_covers_pixels_like_plain_image() {
    // The floor is as bright as what it gathers, so both images are to be the same; what is partly
    // covered tells whether all lines of sight count.
    let irradiance = Rgb::new(1.0, 2.0, 3.0);
    let light = lamp_over_floor(REFLECTANCE * irradiance);
    let mut even = Even { irradiance, places: 0 };
    let gathered = draw(&light, &mut even, 4);
    let plain = CAMERA.image(&light.surface, SIZE.0, SIZE.1, 4).unwrap();
    let of_floor = REFLECTANCE.x * irradiance.x / PI;
    let (mut seen, mut partly) = (0, 0);
    for (a, b) in gathered.pixels.iter().zip(&plain.pixels) {
        // Sums of 16 equal values, rounded.
        assert!((*a - *b).length() < 1e-14, "{a} {b}");
        // Only the floor is bluer than it is red.
        let floor = a.z > a.x;
        seen += usize::from(floor);
        partly += usize::from(floor && a.x < 0.99 * of_floor);
    }
    assert!(partly > 20, "{partly}");
    // One gather a pixel, however many lines of sight; none on the lamp.
    assert_eq!(even.places, seen);
}

#[test]
fn edge_coverage_resolves_every_sample() {
    // A square straight ahead whose left edge is x pixels into the image: n² lines of sight have
    // n² different places across a pixel, each 1/n² wide, so coverage is off by half of that.
    let lamp = Material { exitance: Rgb::splat(PI), ..Material::grey("lamp", 0.0) };
    let (size, n) = (8, 4);
    for k in 0..20 {
        let x = 2.0 + f64::from(k) / 20.0;
        let left = x - f64::from(size) / 2.0;
        let quad = [[left, -9., 0.], [9., -9., 0.], [9., 9., 0.], [left, 9., 0.]];
        let mesh = Mesh::new(quads(&[(quad, lamp.clone())]), 99.0).unwrap();
        let radiosity = vec![Rgb::splat(PI); mesh.element_count()];
        let light = GatheredMesh::from_elements(&mesh, &radiosity).unwrap();
        // One unit is one pixel.
        let eye = DVec3::new(0.0, 0.0, f64::from(size) / 2.0);
        let camera = Camera { eye, target: DVec3::ZERO, up: DVec3::Y, vertical_fov: 90.0 };
        let image = camera.image(&light.surface, size, size, n).unwrap();
        for row in image.pixels.chunks(size as usize) {
            let off = row[2].x - (3.0 - x);
            assert!(off.abs() <= 0.5 / f64::from(n * n) + 1e-12, "edge at {x}: {off}");
        }
    }
}

#[test]
fn gathered_image_is_independent_of_batch_size() {
    let light = lamp_over_floor(Rgb::ONE);
    let rays = || RayGather::new(&light.mesh, 64).unwrap();
    let image = draw(&light, &mut rays(), 2);
    // Slow at first, so that fewer points gather at once from then on: batches aim at a duration.
    // Nothing here is asserted of time.
    struct Slow(RayGather, Duration);
    impl Gather for Slow {
        fn gather(
            &mut self,
            s: &RadiosityField,
            places: &[GatherPoint],
        ) -> Result<Vec<IrradianceSample>, Error> {
            std::thread::sleep(std::mem::take(&mut self.1));
            self.0.gather(s, places)
        }
    }
    let slow = draw(&light, &mut Slow(rays(), Duration::from_millis(300)), 2);
    assert!(image.pixels == slow.pixels);
}

#[test]
fn cancelled_gathered_image_is_none() {
    let light = lamp_over_floor(Rgb::ONE);
    let mut rays = RayGather::new(&light.mesh, 64).unwrap();
    let mut told = vec![];
    let stopped = CAMERA.gathered_image(&light, &mut rays, SIZE.0, SIZE.1, 2, |done, of| {
        told.push((done, of));
        if told.len() < 3 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    });
    assert!(stopped.unwrap().is_none());
    assert!(told.len() == 3 && told.is_sorted());
    assert!(told.iter().all(|&(done, of)| done <= of && of == 48 * 32), "{told:?}");
}

#[test]
fn bad_settings_are_refused() {
    let light = lamp_over_floor(Rgb::ONE);
    let mut even = Even { irradiance: Rgb::ONE, places: 0 };
    for (camera, width, samples) in [
        (CAMERA, 0, 1),
        (CAMERA, 8, 0),
        (CAMERA, 8, 257),
        (Camera { target: CAMERA.eye, ..CAMERA }, 8, 1),
    ] {
        let image = camera.gathered_image(&light, &mut even, width, 8, samples, keep_counting);
        assert_eq!(image.unwrap_err().kind(), ErrorKind::Setting);
    }
    assert_eq!(even.places, 0);
    let e = GatheredMesh::from_elements(&light.mesh, &[Rgb::ONE]).unwrap_err();
    assert_eq!(e.kind(), ErrorKind::Setting);
}
