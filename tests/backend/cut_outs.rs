//! Light through holes, by rays: against closed forms, and against holes that are there.

use std::f64::consts::PI;

use glam::DVec3;
use radiosity::backend::cpu::{RayGather, RayRows};
use radiosity::backend::gpu::{HemicubeRows, TracedRows};
use radiosity::form_factor::Row;
use radiosity::form_factor::closed_form::point_to_polygon;
use radiosity::gather::{GatherPoint, IrradianceSample, RadiosityField};
use radiosity::scene::Sides;
use radiosity::verify::PathTracer;
use radiosity::{
    Backend, BakeTarget, ErrorKind, FormFactors, Gather, Mesh, Rgb, Scene, SceneSettings, Sky, Sun,
};

use crate::common::changes::same_rays;
use crate::common::cut_outs::{Lattice, Part, board, read};
use crate::common::device_rays::{ODD_RAYS, Rays, rays_apart, same_as_on_the_cpu};
use crate::common::fakes::GivenRadiosity;
use crate::common::scenes::{Quad, facing_down, facing_up, walls};
use crate::common::{gpu, keep_counting, keep_going};

/// Rounding of sums of some thousand 64-bit numbers.
const ROUNDING: f64 = 1e-12;

const SKY: Rgb = Rgb::new(1.0, 2.0, 0.5);

/// Grey, black, and both with a mask; one for backs.
const LIBRARY: &str = "newmtl grey\nKd 0.5\nnewmtl black\nKd 0\nnewmtl sheet\nKd 0.5\n\
    map_d mask.tga\nnewmtl back sheet\nKd 0.5\nmap_d mask.tga\nnewmtl lid\nKd 0\nmap_d mask.tga\n\
    newmtl lamp\nKd 0\nKe 1\nmap_d mask.tga\n";

/// A scene of one side each, of materials of [`LIBRARY`].
fn scene(parts: &[Part], mask: &Lattice, sky: impl Into<Sky>) -> Scene {
    let mut settings = SceneSettings::default();
    (settings.sides, settings.sky) = (Sides::Front, Some(sky.into()));
    read(parts, LIBRARY, &[("mask.tga", &mask.image())], &settings)
}

/// What arrives at a point of `scene`, facing `normal`, where all that it has reflects 1 W/m².
fn gathered(scene: &Scene, position: [f64; 3], normal: DVec3, rays: u32) -> IrradianceSample {
    let mesh = Mesh::new(scene.clone(), 10.0).unwrap();
    let point = GatherPoint { position: position.into(), normal, near: 1e-7 };
    let corners = vec![[0; 3]; mesh.element_count()];
    let field = RadiosityField { mesh: &mesh, corners: &corners, reflected: &[Rgb::ONE] };
    RayGather::new(&mesh, rays).unwrap().gather(&field, &[point]).unwrap()[0]
}

/// A floor at z = 0 between walls of height 1 that reflect nothing, open above.
fn well() -> Vec<Part<'static>> {
    let [left, right, front, back, floor, _] = walls([-0.5, -0.5, 0.0], [0.5, 0.5, 1.0]);
    let mut parts: Vec<Part> = [left, right, front, back].map(|wall| (wall, "black")).into();
    parts.push((floor, "grey"));
    parts
}

/// A lid above the well, as far as anything on its floor sees, and cells of it.
const LID: Quad = [[-1.0, -1.0, 1.1], [1.0, -1.0, 1.1], [1.0, 1.0, 1.1], [-1.0, 1.0, 1.1]];
const ONE_HOLE: Lattice = Lattice { side: 5, is_solid: |x, y| (x, y) != (2, 2) };

/// The well under the lid: with a mask, and of its cells.
fn wells(mask: &Lattice, sky: &Sky) -> [Scene; 2] {
    let mut masked = well();
    masked.push((LID, "lid"));
    let mut cut = well();
    cut.extend(mask.cells(LID).into_iter().map(|cell| (cell, "black")));
    [masked, cut].map(|parts| scene(&parts, mask, sky.clone()))
}

/// Irradiance on the floor of a well whose walls and lid are black.
fn on_floor(scene: &Scene, [x, y]: [f64; 2], rays: u32) -> Rgb {
    let mut materials = scene.materials().to_vec();
    materials.iter_mut().for_each(|m| m.reflectance = Rgb::ZERO);
    let mesh = Mesh::new(scene.with_materials(materials).unwrap(), 10.0).unwrap();
    let point = GatherPoint { position: DVec3::new(x, y, 1e-6), normal: DVec3::Z, near: 1e-7 };
    let corners = vec![[0; 3]; mesh.element_count()];
    let field = RadiosityField { mesh: &mesh, corners: &corners, reflected: &[Rgb::ZERO] };
    RayGather::new(&mesh, rays).unwrap().gather(&field, &[point]).unwrap()[0].irradiance
}

#[test]
fn the_sky_through_a_square_hole_has_its_closed_form() {
    let hole = facing_down([-0.2, 0.2], [-0.2, 0.2], 1.1).map(DVec3::from_array);
    let [masked, cut] = wells(&ONE_HOLE, &SKY.into());
    for at in [[0.0, 0.0], [0.1, -0.2], [-0.3, 0.2]] {
        let rays = 1 << 16;
        let [found, there] = [&masked, &cut].map(|scene| on_floor(scene, at, rays));
        // The same rays, which meet what is there or not.
        assert!(found.abs_diff_eq(there, ROUNDING), "{found} {there}");

        let eye = DVec3::new(at[0], at[1], 1e-6);
        let truth = PI * SKY * point_to_polygon(eye, DVec3::Z, &hole);
        // Of n = 65 536 strata the edges of a hole with a share F of them cut some 4 √(n F), each
        // of which is off by a third: √(4 √(n F)) / 3 / (n F), of 1000 rays or more 0.4 %. Thrice.
        assert!(((found - truth) / truth).abs().max_element() < 0.012, "{found} {truth}");
        let tracer = PathTracer::new(&masked);
        let point = tracer.locate(DVec3::new(at[0], at[1], 0.0), DVec3::Z).unwrap();
        let traced = tracer.reflected(&[point], 100_000, 7, keep_counting)[0];
        let off = (traced.radiosity - 0.5 * truth).abs();
        assert!(off.cmple(4.0 * traced.standard_error).all(), "{traced:?} {truth}");
    }
}

#[test]
fn the_sun_shines_through_holes_to_the_right_places() {
    let mask = Lattice { side: 8, is_solid: board };
    let toward = DVec3::new(0.3, -0.2, 1.0);
    let sky = Sky::default().with_sun(Sun { direction: toward, irradiance: SKY }).unwrap();
    let parts = [(facing_up([-1.0, 1.0], [-1.0, 1.0], 0.0), "grey"), (LID, "sheet")];
    let scene = scene(&parts, &mask, sky);
    let tracer = PathTracer::new(&scene);
    let (mut seen, mut hidden) = (0, 0);
    for k in 0..400u32 {
        let [x, y] = [0.618, 0.755].map(|step| -0.6 + 1.2 * (step * f64::from(k)).fract());
        // Where the middle of the sun is seen through the lid, in its cells of a quarter.
        let through = DVec3::new(x, y, 0.0) + 1.1 * toward;
        let cells = [(through.x + 1.0) * 4.0, (1.0 - through.y) * 4.0];
        // The sun's disc is 5e-3 × 1.1 wide up there, 0.025 of a cell either way and a little more.
        if cells.iter().any(|c| (c - c.round()).abs() < 0.04 || !(0.0..8.0).contains(c)) {
            continue;
        }
        let is_lit = !board(cells[0] as usize, cells[1] as usize);
        let cosine = toward.normalize().z;
        let truth = if is_lit { SKY * cosine } else { Rgb::ZERO };
        let found = on_floor(&scene, [x, y], 256);
        let point = tracer.locate(DVec3::new(x, y, 0.0), DVec3::Z).unwrap();
        let traced = tracer.reflected(&[point], 16, 7, keep_counting)[0].radiosity / 0.5;
        for found in [found, traced] {
            // The cosine over a disc of radius 4.65e-3; that of 16 points on it.
            let share = 1e-3 * 4.65;
            assert!(found.abs_diff_eq(truth, share * truth.max_element()), "{x} {y}: {found}");
        }
        *(if is_lit { &mut seen } else { &mut hidden }) += 1;
    }
    assert!(seen > 50 && hidden > 50, "{seen} {hidden}");
}

/// A closed room with a sheet across it that has holes, once for each side.
fn room_with_a_sheet() -> Vec<Part<'static>> {
    let sheet = facing_up([0.1, 0.8], [0.2, 0.9], 0.6);
    let [a, b, c, d] = sheet;
    let mut parts: Vec<Part> = walls([0.0; 3], [1.0; 3]).map(|wall| (wall, "grey")).into();
    parts.extend([(sheet, "sheet"), ([d, c, b, a], "back sheet")]);
    parts
}

#[test]
fn a_closed_room_with_holes_in_it_is_closed() {
    let scene = scene(&room_with_a_sheet(), &Lattice { side: 6, is_solid: board }, SKY);
    // On walls, on solid cells of the sheet, along its diagonal, and in holes.
    for (at, normal) in [
        ([0.5, 0.5, 0.0], DVec3::Z),
        ([0.5, 0.5, 1.0], -DVec3::Z),
        ([0.15, 0.85, 0.6], DVec3::Z),
        ([0.15, 0.85, 0.6], -DVec3::Z),
        ([0.4, 0.5, 0.6], DVec3::Z),
        ([0.28, 0.85, 0.6], -DVec3::Z),
        ([0.0, 0.3, 0.60001], DVec3::X),
    ] {
        let position = (DVec3::from(at) + 1e-6 * normal).to_array();
        let found = gathered(&scene, position, normal, 4096);
        assert_eq!((found.escaped, found.backface), (0.0, 0.0), "{at:?} {normal}");
        assert!(found.irradiance.abs_diff_eq(Rgb::ONE, ROUNDING), "{at:?}: {}", found.irradiance);
    }
    let mesh = Mesh::new(scene, 0.2).unwrap();
    let patches: Vec<_> = (0..mesh.element_count()).map(|e| mesh.element(e)).collect();
    for (row, patch) in same_rays(&mesh).rows(&mesh, &patches, 1.0).unwrap().iter().zip(patches) {
        row.check(&mesh, patch).unwrap();
        assert_eq!((row.escaped, row.backface), (0, 0));
        let holes = row
            .entries
            .iter()
            .filter(|entry| mesh.solid_area(mesh.element(entry.element as usize)) == 0.0);
        assert_eq!(holes.count(), 0, "nothing meets a hole");
    }
}

#[test]
fn rows_go_through_holes_as_if_they_were_there() {
    let mask = Lattice { side: 6, is_solid: |x, y| x % 3 == 0 || y % 2 == 0 };
    let [masked, cut] = wells(&mask, &SKY.into());
    let rows = [&masked, &cut].map(|scene| {
        let mesh = Mesh::new(scene.clone(), 10.0).unwrap();
        // The floor, of the same numbers in both.
        let patches = [8, 9].map(|t| mesh.root(t));
        same_rays(&mesh).rows(&mesh, &patches, 1.0).unwrap()
    });
    let mut open = 0.0;
    for (a, b) in rows[0].iter().zip(&rows[1]) {
        assert_eq!((a.escaped, a.backface), (b.escaped, b.backface));
        open += Row::form_factor(a.escaped);
    }
    assert!(open > 0.01 * rows[0].len() as f64);
}

#[test]
fn a_solid_sheet_behind_one_with_holes_is_not_open() {
    // In one place and back to back, one with holes: through these the other's back is met.
    let sheet = facing_up([0.0, 1.0], [0.0, 1.0], 0.5);
    let [a, b, c, d] = sheet;
    let mut parts: Vec<Part> = walls([0.0; 3], [1.0; 3]).map(|wall| (wall, "grey")).into();
    parts.extend([(sheet, "sheet"), ([d, c, b, a], "grey")]);
    let scene = scene(&parts, &Lattice { side: 4, is_solid: board }, SKY);
    let above = gathered(&scene, [0.3, 0.4, 1.0 - 1e-6], -DVec3::Z, 4096);
    // What sees the sheet, less the walls above it: two halves, by the board.
    let sheet = point_to_polygon(
        DVec3::new(0.3, 0.4, 1.0),
        -DVec3::Z,
        &[a, b, c, d].map(DVec3::from_array),
    );
    // Half of 4096 rays in 16 squares of the board, of which a third of those on edges is off.
    assert!((above.backface / sheet - 0.5).abs() < 0.03, "{} {sheet}", above.backface);
    // From below it is solid.
    let below = gathered(&scene, [0.3, 0.4, 1e-6], DVec3::Z, 4096);
    assert_eq!((below.backface, below.escaped), (0.0, 0.0));
}

#[test]
fn a_lamp_with_holes_shines_with_what_is_left() {
    let mask = Lattice { side: 4, is_solid: board };
    let lamp = facing_down([-0.3, 0.4], [-0.2, 0.3], 0.9);
    let [masked, cut] = [vec![lamp], mask.cells(lamp)].map(|quads| {
        let mut parts = well();
        parts.extend(quads.into_iter().map(|quad| (quad, "lamp")));
        // The cells are all solid.
        let all = Lattice { side: 4, is_solid: |_, _| true };
        scene(&parts, if parts.len() == 6 { &mask } else { &all }, Rgb::ZERO)
    });
    let area =
        |scene: &Scene| (0..scene.triangles().len()).map(|t| scene.solid_area(t)).sum::<f64>();
    assert!((area(&masked) - area(&cut)).abs() < 1e-12);
    for at in [[0.0, 0.0], [0.3, -0.2]] {
        let [found, truth] = [&masked, &cut].map(|scene| on_floor(scene, at, 1 << 14));
        // A quarter of the rays on lamps: 4096, by the share of 8 cells of 16 with 32 edges, of
        // which each cuts some 16 strata of which a third is off: √512 / 3 / 2048.
        assert!(((found - truth) / truth).abs().max_element() < 0.012, "{found} {truth}");
        let tracer = PathTracer::new(&masked);
        let point = tracer.locate(DVec3::new(at[0], at[1], 0.0), DVec3::Z).unwrap();
        let traced = tracer.reflected(&[point], 100_000, 7, keep_counting)[0];
        let off = (traced.radiosity - 0.5 * truth).abs();
        // Beside four standard errors the noise of the rays that tell the truth.
        let noise = 4.0 * traced.standard_error + 0.004 * truth;
        assert!(off.cmple(noise).all(), "{traced:?} {truth}");
    }
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn rays_on_devices_go_through_cut_outs() {
    let mesh =
        Mesh::new(scene(&room_with_a_sheet(), &Lattice { side: 6, is_solid: board }, SKY), 0.5);
    let light = GivenRadiosity::new(mesh.unwrap(), |e, _| Rgb::splat(0.5 + 0.1 * (e % 5) as f64));
    let (gpu, mesh) = (gpu(), &light.mesh);
    let rays = Rays { count: 256, noise: f64::INFINITY, many_lights: false };
    let peak = 1.0 + PI * SKY.max_element();
    same_as_on_the_cpu(&gpu, &light.sources(), &light.places(60, 1e-4), rays, peak);
    let patches = [mesh.root(0), mesh.root(12), mesh.element(5)];
    let on_device = TracedRows::new(&gpu, mesh, 4096).unwrap().rows(mesh, &patches, 1.0).unwrap();
    let on_the_cpu = RayRows::new(mesh, 4096).unwrap().rows(mesh, &patches, 1.0).unwrap();
    for ((device, cpu), &patch) in on_device.iter().zip(&on_the_cpu).zip(&patches) {
        device.check(mesh, patch).unwrap();
        assert!(rays_apart(device, cpu, 4096) <= ODD_RAYS, "{device:?} {cpu:?}");
    }
}

#[test]
fn devices_leave_scenes_with_cut_outs_to_rays() {
    let mesh =
        Mesh::new(scene(&room_with_a_sheet(), &Lattice { side: 6, is_solid: board }, SKY), 0.5);
    let (mesh, gpu) = (mesh.unwrap(), gpu());
    assert_eq!(HemicubeRows::new(&gpu, &mesh, 16).unwrap_err().kind(), ErrorKind::Device);
    let backend = Backend::Gpu(gpu);
    let patches = [mesh.root(12)];
    let [device, cpu] = [&backend, &Backend::Cpu]
        .map(|b| b.rows(&mesh, 16).unwrap().rows(&mesh, &patches, 1.0).unwrap());
    assert!(device == cpu);
    let scene = mesh.scene().clone();
    let baked = BakeTarget::Error(0.3).bake(scene, &backend, keep_going).unwrap();
    let said = baked.device_failure.expect("said").to_string();
    assert!(said.contains("cut-outs"), "{said}");
}
