//! Light through clear panes: weakened by each, once. All by rays.
//!
//! Most scenes are compared with themselves made of perfectly clear glass, through which the same
//! rays go: what is left differs by the panes alone, exactly but for rounding.

use std::f64::consts::PI;

use glam::DVec3;
use radiosity::backend::cpu::{RayGather, RayRows};
use radiosity::backend::gpu::{HemicubeRows, TracedRows};
use radiosity::bake::Outcome;
use radiosity::form_factor::Row;
use radiosity::gather::{GatherPoint, RadiosityField};
use radiosity::io::ToneCurve;
use radiosity::scene::Specular;
use radiosity::solver::Method;
use radiosity::verify::{PathTracer, Settings, verify};
use radiosity::{
    Backend, BakeTarget, ErrorKind, FormFactors, Gather, Material, Mesh, Rgb, Scene, Solver, Sun,
    Triangle,
};

use crate::common::changes::{assert_balanced, by_elements, painted, same_rays, shifted};
use crate::common::device_rays::{ODD_RAYS, Rays, rays_apart, same_as_on_the_cpu};
use crate::common::fakes::GivenRadiosity;
use crate::common::measures::assert_same_bits;
use crate::common::scenes::{
    Quad, block, facing_down, facing_up, lamp, paint, quads, standing_block, walls,
};
use crate::common::{cornell_box, gpu, keep_counting, keep_going};

/// Rounding of a few products and sums of 64-bit numbers.
const ROUNDING: f64 = 1e-12;

const COLOURS: [Rgb; 4] = [
    Rgb::new(0.9, 0.5, 0.7),
    Rgb::new(0.3, 0.8, 1.0),
    Rgb::new(0.6, 0.6, 0.25),
    Rgb::new(0.75, 0.95, 0.4),
];

const SKY: Rgb = Rgb::new(1.0, 2.0, 0.5);

fn glass(name: &str, transmittance: Rgb) -> Material {
    let specular = Some(Specular::Glass { refractive_index: 1.5, transmittance });
    Material { specular, ..Material::grey(name, 0.0) }
}

/// `parts`, and triangles of one clear material.
fn with_glass(parts: &[(Quad, Material)], faces: &[[DVec3; 3]], transmittance: Rgb) -> Scene {
    let scene = quads(parts);
    let (mut positions, mut triangles) = (scene.positions().to_vec(), scene.triangles().to_vec());
    let (mut groups, mut materials) = (scene.groups().to_vec(), scene.materials().to_vec());
    let (group, material) = (groups.len() as u32, materials.len() as u32);
    for face in faces {
        let first = positions.len() as u32;
        positions.extend(face);
        let corners = [first, first + 1, first + 2];
        triangles.push(Triangle { corners, group, material, smoothing: None });
    }
    groups.push("glass".into());
    materials.push(glass("glass", transmittance));
    Scene::new(positions, triangles, groups, materials).unwrap()
}

/// The two halves of a quadrilateral, along this diagonal or the other.
fn halves(quad: Quad, other: bool) -> [[DVec3; 3]; 2] {
    let [a, b, c, d] = quad.map(DVec3::from_array);
    if other { [[a, b, d], [b, c, d]] } else { [[a, b, c], [a, c, d]] }
}

/// Irradiance at `position`, facing up, by rays.
fn irradiance(scene: &Scene, position: [f64; 3]) -> Rgb {
    let mesh = Mesh::new(scene.clone(), 10.0).unwrap();
    let point = GatherPoint { position: position.into(), normal: DVec3::Z, near: 1e-7 };
    let corners = vec![[0; 3]; mesh.element_count()];
    let field = RadiosityField { mesh: &mesh, corners: &corners, reflected: &[Rgb::ZERO] };
    RayGather::new(&mesh, 4096).unwrap().gather(&field, &[point]).unwrap()[0].irradiance
}

fn assert_close(found: Rgb, truth: Rgb, error: f64) {
    assert!(((found - truth) / truth).abs().max_element() <= error, "{found}, not {truth}");
}

/// A well that is open above, with black walls; its floor is at z = 0.
fn well(half: f64) -> Vec<(Quad, Material)> {
    let x = [-half, half];
    let [left, right, front, back, ..] = walls([-half, -half, 0.0], [half, half, 1.0]);
    let walls = [left, right, front, back].map(|wall| (wall, paint(0.0, 0.0)));
    let mut all = vec![(facing_up(x, x, 0.0), paint(0.5, 0.0))];
    all.extend(walls);
    all
}

/// What passes `faces` of glass above a well, at its floor: of a sky with a sun.
fn passes_above_well(half: f64, faces: &[[DVec3; 3]]) {
    let tint = COLOURS[0];
    let under = |transmittance| {
        let sun = Sun { direction: DVec3::new(0.02, 0.01, 1.0), irradiance: Rgb::ONE };
        let sky = radiosity::Sky::uniform(SKY).with_sun(sun).unwrap();
        with_glass(&well(half), faces, transmittance).with_sky(sky).unwrap()
    };
    let at = [0.03, 0.02, 1e-6];
    let (found, clear) = (irradiance(&under(tint), at), irradiance(&under(Rgb::ONE), at));
    println!("{}", found / clear / tint);
    assert_close(found, clear * tint, ROUNDING);
    assert_close(
        clear,
        irradiance(&quads(&well(half)).with_sky(sky_with_sun()).unwrap(), at),
        0.05,
    );
    // Paths find the same: by the sky that they meet, and by the sun.
    let traced = |scene: &Scene| {
        let tracer = PathTracer::new(scene);
        let point = tracer.locate(DVec3::new(0.03, 0.02, 0.0), DVec3::Z).unwrap();
        tracer.reflected(&[point], 1000, 7, keep_counting)[0].radiosity
    };
    assert_close(traced(&under(tint)), traced(&under(Rgb::ONE)) * tint, ROUNDING);
}

fn sky_with_sun() -> radiosity::Sky {
    let sun = Sun { direction: DVec3::new(0.02, 0.01, 1.0), irradiance: Rgb::ONE };
    radiosity::Sky::uniform(SKY).with_sun(sun).unwrap()
}

#[test]
fn covers_of_open_ground_weaken_the_sky_by_each() {
    // One in the other, each without a bottom: every ray goes through each once.
    for n in 0..=4 {
        let mut parts = vec![(facing_up([-9.0, 9.0], [-9.0, 9.0], 0.0), paint(0.5, 0.0))];
        for (k, colour) in COLOURS[..n].iter().enumerate() {
            let half = 1.0 + 0.1 * k as f64;
            // Deeper than the ground, so that no ray slips below.
            let cover = standing_block([-half, half], [-half, half], -half, half);
            let name = format!("cover {k}");
            parts.extend(cover.map(|face| (face, glass(&name, *colour))));
        }
        let scene = quads(&parts).with_sky(SKY).unwrap();
        let truth = COLOURS[..n].iter().fold(PI * SKY, |light, colour| light * *colour);
        // Here rays go along planes of symmetry, and meet sides that two triangles share.
        for at in [[0.0, 0.0, 1e-6], [0.3, 0.4, 1e-6], [0.0, 0.5, 1e-6]] {
            assert_close(irradiance(&scene, at), truth, ROUNDING);
        }
    }
}

/// A room with a lamp above and a floor, with `n` panes between, as wide as the room and more.
fn lamp_above_panes(n: usize, colours: [Rgb; 4]) -> Scene {
    let mut parts = walls([0.0; 3], [1.0; 3]).map(|wall| (wall, paint(0.0, 0.0))).to_vec();
    parts[4].1 = paint(0.5, 0.0);
    parts.push((facing_down([0.3, 0.7], [0.4, 0.7], 0.99), lamp([7.0, 5.0, 3.0])));
    for (k, colour) in colours[..n].iter().enumerate() {
        let pane = facing_up([-0.5, 1.5], [-0.5, 1.5], 0.2 + 0.1 * k as f64);
        parts.push((pane, glass(&format!("pane {k}"), *colour)));
    }
    quads(&parts)
}

fn floor(mesh: &Mesh) -> impl Iterator<Item = usize> {
    (0..mesh.element_count())
        .filter(|&e| mesh.scene().triangles()[mesh.triangle(mesh.element(e))].group == 4)
}

#[test]
fn solvers_weaken_light_by_each_pane() {
    for n in 1..=4 {
        let mesh = |colours| Mesh::new(lamp_above_panes(n, colours), 0.3).unwrap();
        let (tinted, clear) = (mesh(COLOURS), mesh([Rgb::ONE; 4]));
        let product = COLOURS[..n].iter().fold(Rgb::ONE, |product, colour| product * *colour);
        for method in Method::ALL {
            let solve = |mesh: &Mesh| {
                let solver = Solver { unshot: 1e-4, ..by_elements(method) };
                solver.solve(mesh, &mut same_rays(mesh), keep_going).unwrap()
            };
            let (found, truth) = (solve(&tinted), solve(&clear));
            assert_balanced(&found);
            // Through glass of a transmittance of one nothing is lost.
            assert_eq!(truth.ledger.pane_loss, Rgb::ZERO);
            assert!(
                found.ledger.pane_loss.min_element() > 0.01 * found.ledger.emitted.min_element()
            );
            for e in floor(&tinted) {
                // What passes is a whole number of 2⁻³², of 0.12 or more; none of what is left
                // unshot is the lamp's.
                assert_close(found.radiosity[e], truth.radiosity[e] * product, 1e-8);
            }
            let sum = |s: &radiosity::Solution| floor(&tinted).map(|e| s.radiosity[e]).sum::<Rgb>();
            println!("{n} {method}: {}", sum(&found) / sum(&truth) / product);
        }
        // The lamp as it is gathered, and as paths meet it.
        let [a, b] = [&tinted, &clear].map(|mesh| irradiance(mesh.scene(), [0.4, 0.3, 1e-6]));
        assert_close(a, b * product, ROUNDING);
        let traced = |scene: &Scene| {
            let tracer = PathTracer::new(scene);
            let point = tracer.locate(DVec3::new(0.4, 0.3, 0.0), DVec3::Z).unwrap();
            tracer.reflected(&[point], 2000, 7, keep_counting)[0].radiosity
        };
        assert_close(traced(tinted.scene()), traced(clear.scene()) * product, ROUNDING);
    }
}

/// Triangles of a ball of this radius about a point: an octahedron, each in four, thrice.
fn ball(centre: DVec3, radius: f64) -> Vec<[DVec3; 3]> {
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let mut faces: Vec<[DVec3; 3]> = vec![];
    for [a, b] in [[x, y], [y, -x], [-x, -y], [-y, x]] {
        faces.extend([[a, b, z], [b, a, -z]]);
    }
    for _ in 0..3 {
        let split = |[a, b, c]: [DVec3; 3]| {
            let [ab, bc, ca] = [a + b, b + c, c + a].map(DVec3::normalize);
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        faces = faces.into_iter().flat_map(split).collect();
    }
    faces.into_iter().map(|face| face.map(|p| centre + radius * p)).collect()
}

#[test]
fn bodies_of_glass_count_once() {
    let slab = block([-9.0, -9.0, 1.1], [9.0, 9.0, 1.3]);
    passes_above_well(0.5, &slab.map(|face| halves(face, false)).concat());
    // Inside out.
    let turned = walls([-9.0, -9.0, 1.1], [9.0, 9.0, 1.3]);
    passes_above_well(0.5, &turned.map(|face| halves(face, false)).concat());
    // Rays from the well are within 0.3 of the axis as high as the middle of the ball.
    passes_above_well(0.1, &ball(DVec3::new(0.0, 0.0, 2.1), 1.0));
}

#[test]
fn a_sheet_that_is_there_twice_counts_once() {
    let sheet = facing_up([-9.0, 9.0], [-9.0, 9.0], 1.1);
    let [a, b, c, d] = sheet;
    let once = halves(sheet, false);
    passes_above_well(0.5, &once);
    for again in [sheet, [a, d, c, b], [b, c, d, a]] {
        for other in [false, true] {
            passes_above_well(0.5, &[once, halves(again, other)].concat());
        }
    }
}

#[test]
fn rows_through_panes_are_symmetric_and_sum_to_one() {
    // A lamp within a block of glass, whose surface light crosses once.
    let tint = COLOURS[1];
    let mut parts = walls([0.0; 3], [1.0; 3]).map(|wall| (wall, paint(0.5, 0.0))).to_vec();
    parts.push((facing_down([0.4, 0.6], [0.4, 0.6], 0.5), lamp([1.0; 3])));
    let faces = block([0.3; 3], [0.7; 3]).map(|face| halves(face, true)).concat();
    let mesh = Mesh::new(with_glass(&parts, &faces, tint), 10.0).unwrap();
    let [lamp, floor] = [12, 8].map(|t| mesh.root(t));
    let rows = same_rays(&mesh).rows(&mesh, &[lamp, floor], 1.0).unwrap();
    let passed = |row: &Row, to: usize| {
        let k = row.entries.iter().position(|entry| entry.element as usize == to).unwrap();
        Rgb::from_array(row.passed[k].map(Row::form_factor))
    };
    rows.iter().zip([lamp, floor]).for_each(|(row, patch)| row.check(&mesh, patch).unwrap());
    // Rounded to 2⁻³².
    assert_close(passed(&rows[0], 8), tint.powf(0.5), 1e-9);
    assert_close(passed(&rows[1], 12), tint.powf(0.5), 1e-9);
    assert!(rows[0].closure() == 1.0 && rows[1].closure() == 1.0);
}

#[test]
fn rows_carry_nothing_without_panes() {
    let mesh = cornell_box(300.0);
    let patches: Vec<_> = (0..mesh.element_count()).map(|e| mesh.element(e)).collect();
    let rows = RayRows::new(&mesh, 64).unwrap().rows(&mesh, &patches, 1.0).unwrap();
    assert!(rows.iter().all(|row| row.passed.is_empty()));
}

#[test]
fn hazy_and_shining_glass_blocks_light() {
    let lid = facing_up([-9.0, 9.0], [-9.0, 9.0], 1.1);
    let under = |material: Material| {
        let mut parts = well(0.5);
        parts.push((lid, material));
        irradiance(&quads(&parts).with_sky(SKY).unwrap(), [0.03, 0.02, 1e-6])
    };
    let tinted = glass("lid", Rgb::splat(0.5));
    assert!(under(tinted.clone()).min_element() > 0.1);
    let hazy = Material { reflectance: Rgb::splat(0.1), ..tinted.clone() };
    assert_eq!(under(hazy), Rgb::ZERO);
    // Its front faces up: its back is black.
    assert_eq!(under(Material { exitance: Rgb::ONE, ..tinted }), Rgb::ZERO);
}

#[test]
fn solves_through_panes_are_saved_and_resumed() {
    let mesh = |colours| Mesh::new(lamp_above_panes(2, colours), 0.3).unwrap();
    let mesh = (mesh(COLOURS), mesh([COLOURS[2]; 4]));
    for method in Method::ALL {
        let solver = Solver { unshot: 1e-3, ..Solver::new(method) };
        let mut solve = solver.begin(&mesh.0).unwrap();
        let rows = || same_rays(&mesh.0);
        solve.advance(&mut rows(), keep_going).unwrap();
        let bytes = solve.to_bytes();
        // Of other glass it is another state.
        assert!(solver.resume_bytes(&mesh.1, &same_rays(&mesh.1), &bytes).is_err());
        let mut again = solver.resume_bytes(&mesh.0, &rows(), &bytes).unwrap();
        assert!(again.to_bytes() == bytes);
        for session in [&mut solve, &mut again] {
            session.run(&mut rows(), keep_going).unwrap();
        }
        assert_same_bits(&again.into_solution().unwrap(), &solve.into_solution().unwrap());
    }
}

#[test]
fn a_room_with_a_tinted_window_is_as_path_traced() {
    // The wall at x = 0 has a window, in a frame.
    let [_, others @ ..] = walls([0.0; 3], [2.0; 3]);
    let mut parts = others.map(|wall| (wall, paint(0.6, 0.0))).to_vec();
    let wall = |[y0, y1]: [f64; 2], [z0, z1]: [f64; 2]| -> Quad {
        [[0.0, y0, z0], [0.0, y1, z0], [0.0, y1, z1], [0.0, y0, z1]]
    };
    for frame in [
        wall([0.0, 2.0], [0.0, 0.6]),
        wall([0.0, 2.0], [1.6, 2.0]),
        wall([0.0, 0.4], [0.6, 1.6]),
        wall([1.6, 2.0], [0.6, 1.6]),
    ] {
        parts.push((frame, paint(0.6, 0.0)));
    }
    parts.push((wall([0.4, 1.6], [0.6, 1.6]), glass("window", COLOURS[0])));
    let scene = quads(&parts).with_sky(SKY).unwrap();
    let baked = BakeTarget::Error(0.05).bake(scene.clone(), &Backend::Cpu, keep_going).unwrap();
    assert_eq!(baked.outcome, Outcome::Reached);
    assert!(baked.solution.ledger.imbalance() < 1e-9);
    assert!(baked.solution.ledger.pane_loss.min_element() > 0.0);
    let found = verify(&scene, &baked.light.surface, &Settings::default(), keep_going).unwrap();
    let error = found.error.unwrap();
    println!("{error:?}");
    assert!(error.value - 2.0 * error.standard_error < 0.05, "{error:?}");
}

#[test]
fn methods_agree_where_light_goes_through_panes_again_and_again() {
    let mut scene = lamp_above_panes(2, COLOURS);
    let mut materials = scene.materials().to_vec();
    materials[..6].iter_mut().for_each(|wall| wall.reflectance = Rgb::splat(0.8));
    scene = scene.with_materials(materials).unwrap();
    let mesh = Mesh::new(scene, 0.6).unwrap();
    let solve = |method| {
        let solver = Solver { unshot: 1e-6, ..by_elements(method) };
        solver.solve(&mesh, &mut same_rays(&mesh), keep_going).unwrap()
    };
    let truth = solve(Method::Direct);
    for method in Method::ALL {
        let found = solve(method);
        assert_balanced(&found);
        // What is unshot, 1e-6, is reflected four times more, and the darkest get a hundredth of
        // the mean.
        floor(&mesh).for_each(|e| assert_close(found.radiosity[e], truth.radiosity[e], 1e-3));
    }
}

#[test]
fn rows_through_moved_panes_are_made_anew() {
    let before = Mesh::new(lamp_above_panes(1, COLOURS), 0.3).unwrap();
    let away = shifted(&before, "q7", [9.0, 0.0, 0.0]);
    let solver = Solver { unshot: 1e-4, ..by_elements(Method::ALL[0]) };
    let truth = solver.solve(&away, &mut same_rays(&away), keep_going).unwrap();
    let mut solve = solver.begin(&before).unwrap();
    solve.run(&mut same_rays(&before), keep_going).unwrap();
    // Other glass is no change of a material alone.
    let tinted = painted(&before, |material| {
        if let Some(Specular::Glass { transmittance, .. }) = &mut material.specular {
            *transmittance *= 0.5;
        }
    });
    assert!(solve.update_materials(&tinted).is_err());
    let (mut old, mut new) = (same_rays(&before), same_rays(&away));
    solve.update_geometry(&away, &mut old, &mut new, keep_going).unwrap();
    solve.run(&mut new, keep_going).unwrap();
    let found = solve.into_solution().unwrap();
    assert_balanced(&found);
    // Twice what is asked for may be misplaced, of which a tenth is on the floor.
    let sum = |s: &radiosity::Solution| floor(&away).map(|e| s.radiosity[e]).sum::<Rgb>();
    assert_close(sum(&found), sum(&truth), 1e-2);
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn rays_on_devices_go_through_panes() {
    let mesh = Mesh::new(lamp_above_panes(1, COLOURS), 0.5).unwrap();
    let light = GivenRadiosity::new(mesh, |e, _| Rgb::splat(0.5 + 0.1 * (e % 5) as f64));
    let (gpu, mesh) = (gpu(), &light.mesh);
    let rays = Rays { count: 256, noise: f64::INFINITY, many_lights: false };
    let lamp = mesh.scene().materials().iter().map(|m| m.exitance.max_element());
    let peak = 1.0 + lamp.fold(0.0, f64::max);
    same_as_on_the_cpu(&gpu, &light.sources(), &light.places(60, 1e-4), rays, peak);
    let patches = [mesh.root(0), mesh.root(12), mesh.element(5)];
    let on_device = TracedRows::new(&gpu, mesh, 4096).unwrap().rows(mesh, &patches, 1.0).unwrap();
    let on_the_cpu = RayRows::new(mesh, 4096).unwrap().rows(mesh, &patches, 1.0).unwrap();
    assert!(on_the_cpu.iter().any(|row| !row.passed.is_empty()));
    for ((device, cpu), &patch) in on_device.iter().zip(&on_the_cpu).zip(&patches) {
        device.check(mesh, patch).unwrap();
        assert!(rays_apart(device, cpu, 4096) <= ODD_RAYS, "{device:?} {cpu:?}");
        assert_eq!(device.passed.len(), cpu.passed.len());
        // Light that passes, per channel, of which single rays may be lost or dimmed otherwise.
        let through = |row: &Row| {
            let shares = row.entries.iter().map(|e| e.share).chain([row.escaped, row.backface]);
            let lit = shares.zip(&row.passed).map(|(share, passed)| {
                Rgb::from_array(passed.map(Row::form_factor)) * Row::form_factor(share)
            });
            lit.sum::<Rgb>()
        };
        let off = (through(device) - through(cpu)).abs().max_element();
        assert!(off <= ODD_RAYS / 4096.0, "{off}");
    }
}

/// What hemicubes do not see goes to rays, which is said.
#[test]
fn devices_leave_scenes_with_panes_to_rays() {
    let mesh = Mesh::new(lamp_above_panes(1, COLOURS), 0.5).unwrap();
    let gpu = gpu();
    assert_eq!(HemicubeRows::new(&gpu, &mesh, 16).unwrap_err().kind(), ErrorKind::Device);
    let backend = Backend::Gpu(gpu);
    let patches = [mesh.root(12)];
    let [device, cpu] = [&backend, &Backend::Cpu]
        .map(|b| b.rows(&mesh, 16).unwrap().rows(&mesh, &patches, 1.0).unwrap());
    assert!(device == cpu && !device[0].passed.is_empty());
    let scene = mesh.scene().clone();
    let baked = BakeTarget::Error(0.3).bake(scene, &backend, keep_going).unwrap();
    let said = baked.device_failure.expect("said").to_string();
    assert!(said.contains("clear panes"), "{said}");
    assert!(baked.solution.ledger.pane_loss.min_element() > 0.0);
}

#[test]
fn viewers_see_through_panes() {
    let mesh = Mesh::new(lamp_above_panes(1, COLOURS), 1.0).unwrap();
    let baked =
        BakeTarget::Error(0.5).bake(mesh.scene().clone(), &Backend::Cpu, keep_going).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("panes.glb");
    let tone = ToneCurve::fit(&baked.light.surface.radiosity);
    radiosity::write_glb(&path, &baked.light, &tone).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let text = String::from_utf8_lossy(&bytes);
    // One material of glass, of seven.
    assert_eq!(text.matches("BLEND").count(), 1, "{}", &text[..2000]);
}
