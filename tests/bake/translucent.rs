//! Light through translucent surfaces: what sky and sun bring through a sheet, and a lit curtain.

use std::f64::consts::PI;

use glam::DVec3;
use radiosity::bake::Outcome;
use radiosity::scene::SkyDistribution;
use radiosity::verify::{PathTracer, Settings, verify};
use radiosity::{
    Backend, BakeTarget, Camera, Material, Rgb, Scene, SceneSettings, Sky, Sun, VertexMesh,
};

use crate::common::scenes::{Quad, facing_up, lamp, paint, quads, walls};
use crate::common::textured::tga;
use crate::common::{gpu, keep_counting, keep_going};

const RHO: Rgb = Rgb::new(0.2, 0.3, 0.0);
const TAU: Rgb = Rgb::new(0.5, 0.3, 0.4);

fn leaf() -> Material {
    Material { reflectance: RHO, transmittance: TAU, ..Material::grey("leaf", 0.0) }
}

const SHEET: Quad = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

/// A sheet, given once, or for each of its sides and cut along the other diagonal.
fn sheets() -> [Scene; 2] {
    let [a, b, c, d] = SHEET;
    [quads(&[(SHEET, leaf())]), quads(&[(SHEET, leaf()), ([d, c, b, a], leaf())])]
}

/// Radiosity of all vertices whose normals are `normal`.
fn radiosity_of(surface: &VertexMesh, normal: DVec3) -> Vec<Rgb> {
    let facing = surface.normals.iter().zip(&surface.radiosity);
    facing.filter(|(n, _)| n.distance(normal) < 1e-6).map(|(_, &b)| b).collect()
}

/// The radiosity of the sheet's upper and lower side, by rays, hemicubes, paths and pictures, is
/// `truth` but for `share` of it.
fn check(scene: &Scene, truth: [Rgb; 2], share: f64) {
    let off = |found: Rgb, truth: Rgb| {
        let off = (found - truth).abs() / truth.max(Rgb::splat(1e-9));
        off.max_element()
    };
    for backend in [Backend::Cpu, Backend::Gpu(gpu())] {
        let baked = BakeTarget::Error(0.02).bake(scene.clone(), &backend, keep_going).unwrap();
        assert!(baked.solution.ledger.imbalance() < 1e-9);
        // The light is even: the first mesh does.
        let elements = baked.light.mesh.element_count();
        assert!(elements <= 2048, "{elements} elements");
        for (normal, truth) in [DVec3::Z, -DVec3::Z].into_iter().zip(truth) {
            let found = radiosity_of(&baked.light.surface, normal);
            assert!(!found.is_empty());
            let worst = found.iter().map(|&b| off(b, truth)).fold(0.0, f64::max);
            assert!(worst < share, "{backend:?}, {normal}: {worst:e} off {truth}");
            // And in the picture, by the vertices and gathered.
            let eye = DVec3::new(0.4, 0.45, 0.0) + 2.0 * normal;
            let target = DVec3::new(0.4, 0.45, 0.0);
            let camera = Camera { eye, target, up: DVec3::Y, vertical_fov: 1.0 };
            let light = &baked.light;
            let image = camera.interpolated_image(light, 2, 2, 1, keep_counting).unwrap().unwrap();
            let mut gatherer = backend.gather(&light.mesh, 4096).unwrap();
            let gathered =
                camera.gathered_image(light, &mut *gatherer, 2, 2, 1, keep_counting).unwrap();
            for pixel in image.pixels.into_iter().chain(gathered.unwrap().pixels) {
                assert!(off(pixel * PI, truth) < share, "{normal}: {} {truth}", pixel * PI);
            }
        }
    }
    let scene = scene.resolve_sides();
    let tracer = PathTracer::new(&scene);
    for (normal, truth) in [DVec3::Z, -DVec3::Z].into_iter().zip(truth) {
        let point = tracer.locate(DVec3::new(0.3, 0.4, 0.0), normal).unwrap();
        let found = tracer.reflected(&[point], 1 << 16, 3, keep_counting)[0];
        // Four standard errors of the mean, and rounding where all paths find the same.
        let off = (found.radiosity - truth).abs();
        assert!(off.cmple(4.0 * found.standard_error + 1e-9).all(), "{found:?} {truth}");
    }
}

#[test]
fn a_sheet_under_a_sky_glows_on_both_sides() {
    let zenith = Rgb::new(1.0, 2.0, 0.5);
    let overcast = Sky::new(SkyDistribution::OVERCAST, zenith, DVec3::Z, DVec3::Z).unwrap();
    for scene in sheets() {
        // All around: π L on each side. Hemicubes' weights sum to one in 32-bit floats.
        let even = scene.clone().with_sky(zenith).unwrap();
        check(&even, [(RHO + TAU) * PI * zenith; 2], 1e-6);
        // Above only: 7π/9 L_z, of which the lower side sees what comes through. A bake for 2 %
        // has n ≥ 256 rays, in rings whose middles are off by 1/n of the sky's change or less: 2/3.
        let above = scene.with_sky(overcast.clone()).unwrap();
        check(&above, [RHO, TAU].map(|share| share * 7.0 * PI / 9.0 * zenith), 2.0 / 3.0 / 256.0);
    }
}

#[test]
fn the_sun_shines_through_a_sheet_by_its_cosine() {
    let irradiance = Rgb::new(900.0, 800.0, 700.0);
    for direction in [DVec3::new(0.3, 0.2, -0.9), DVec3::new(-0.5, 0.7, 0.4)] {
        let sky = Sky::default().with_sun(Sun { direction, irradiance }).unwrap();
        let arrives = irradiance * direction.normalize().z.abs();
        let [near, far] = [RHO * arrives, TAU * arrives];
        let truth = if direction.z > 0.0 { [near, far] } else { [far, near] };
        for scene in sheets() {
            // All of the sun is above the horizon: its cosine is that of its middle but for the
            // square of its radius, 4.65e-3, over 4; hemicubes' tiles have some 10⁴ pixels of it.
            check(&scene.with_sky(sky.clone()).unwrap(), truth, 1e-4);
        }
    }
}

#[test]
fn a_furnace_is_the_same_on_both_sides_of_a_sheet() {
    // Everything emits E and keeps ρ + τ, a sheet that is given for both sides among it:
    // B = E / (1 − ρ − τ) everywhere.
    const ALBEDO: f64 = 0.9;
    for through in [0.5, 0.8] {
        let tau = Rgb::splat(through * ALBEDO);
        let sheet = Material { transmittance: tau, ..paint(ALBEDO * (1.0 - through), 1.0) };
        let walls = walls([0.0; 3], [3.0, 2.0, 2.0]).map(|wall| (wall, paint(ALBEDO, 1.0)));
        let [a, b, c, d] = [[1.2, 0.3, 0.5], [1.4, 1.7, 0.4], [1.4, 1.8, 1.6], [1.2, 0.4, 1.7]];
        let sides = [([a, b, c, d], sheet.clone()), ([d, c, b, a], sheet)];
        let scene = quads(&walls.into_iter().chain(sides).collect::<Vec<_>>());
        let target = BakeTarget::Error(0.05);
        let baked = target.bake(scene, &Backend::Cpu, keep_going).unwrap();
        assert_eq!(baked.outcome, Outcome::Reached);
        // What is reflected and let through, which the error is of.
        let (light, truth) = (&baked.light, 1.0 / (1.0 - ALBEDO) - 1.0);
        for is_sheet in [false, true] {
            let (mut squares, mut area) = (0.0, 0.0);
            for (e, corners) in light.corners.iter().enumerate() {
                let node = light.mesh.element(e);
                if (light.mesh.material(node).transmittance != Rgb::ZERO) == is_sheet {
                    let sum: Rgb = corners.iter().map(|&v| light.reflected[v as usize]).sum();
                    let off = (sum / 3.0 / truth - 1.0).abs().max_element();
                    squares += off * off * light.mesh.area(node);
                    area += light.mesh.area(node);
                }
            }
            let error = (squares / area).sqrt();
            assert!(area > 0.0 && error < 0.05, "{through}, sheet {is_sheet}: {error}");
        }
    }
}

/// A room with a lamp behind a curtain from wall to wall, of `curtain`.
fn room(curtain: Material) -> Scene {
    let mut all: Vec<(Quad, Material)> =
        walls([0.0; 3], [3.0, 2.0, 2.0]).map(|w| (w, paint(0.6, 0.0))).into();
    let x = 2.2;
    let hanging = [[x, 0.1, 0.0], [x, 0.1, 1.9], [x, 1.9, 1.9], [x, 1.9, 0.0]];
    all.push((hanging, curtain));
    let (lamp_quad, light) = (facing_up([2.5, 2.9], [0.8, 1.2], 0.3), lamp([20.0, 15.0, 10.0]));
    all.push((lamp_quad, light));
    quads(&all)
}

#[test]
fn a_lit_curtain_is_as_path_traced() {
    let curtain = Material { transmittance: Rgb::new(0.4, 0.3, 0.2), ..paint(0.4, 0.0) };
    let scene = room(curtain);
    let baked = BakeTarget::Error(0.05).bake(scene.clone(), &Backend::Cpu, keep_going).unwrap();
    assert_eq!(baked.outcome, Outcome::Reached);
    let mut settings = Settings::default();
    settings.precision = 0.3;
    let found = verify(&scene, &baked.light.surface, &settings, keep_going);
    let measured = found.unwrap().error.unwrap();
    assert!(measured.value - 2.0 * measured.standard_error < 0.05, "{measured:?}");
}

#[test]
fn a_textured_leaf_lets_light_through_in_its_colours() {
    // Two halves, of which one reflects and lets through a fifth of what the other does, all the
    // same under a sky from all around, before any vertex gathers: (ρ + τ) π L.
    let grey = [128; 3];
    let image = tga(4, &[[255; 3], [255; 3], grey, grey]);
    let text = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
        usemtl leaf\nf 1/1 2/2 3/3 4/4\n";
    let library: &[u8] = b"newmtl leaf\nKd 0.8\nmap_Kd -clamp on a.tga\n";
    let mut settings = SceneSettings::default();
    settings.transmit.push(("leaf".into(), Rgb::splat(0.4)));
    settings.sky = Some(Rgb::ONE.into());
    let files: [(&str, &[u8]); 2] = [("a.mtl", library), ("a.tga", &image)];
    let scene = settings.read("leaf.obj", text.as_bytes(), &files).unwrap();
    let baked = BakeTarget::Error(0.1).bake(scene, &Backend::Cpu, keep_going).unwrap();
    // Of sRGB, linear.
    let dim = ((128.0 / 255.0 + 0.055) / 1.055f64).powf(2.4);
    let mut seen = [0, 0];
    for e in 0..baked.mesh.element_count() {
        let corners = baked.mesh.corners(baked.mesh.element(e)).map(|p| p.x);
        let (low, high) =
            corners.into_iter().fold((1.0f64, 0.0f64), |(low, high), x| (low.min(x), high.max(x)));
        // Between the middles of texels they blend.
        let half = if high <= 0.375 {
            0
        } else if low >= 0.625 {
            1
        } else {
            continue;
        };
        seen[half] += 1;
        let truth = 0.8 * [1.0, dim][half] * PI;
        let off = (baked.solution.radiosity[e] / truth - 1.0).abs().max_element();
        // Weights of rays that add up to 1, in 32-bit floats; textures have 16 bits a channel.
        assert!(off < 1e-4, "{half}: {off:e}");
    }
    assert!(seen[0] > 20 && seen[1] > 20, "{seen:?}");
}
