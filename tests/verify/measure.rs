//! The measured error of solutions whose error is known.

use std::ops::ControlFlow;
use std::time::Duration;

use glam::DVec3;
use radiosity::bake::Outcome;
use radiosity::scene::Sides;
use radiosity::verify::{Progress, Settings, Stop, Verification, Verifier, verify};
use radiosity::{Backend, BakeTarget, ErrorKind, Material, Rgb, Scene, Sky, Triangle, VertexMesh};

use crate::common::keep_going;
use crate::common::scenes::{
    Quad, block, facing_down, facing_up, lamp, paint, quads, standing_block, walls,
};

/// A solution with a radiosity for each triangle.
fn solution(scene: &Scene, radiosity: impl Fn(&Triangle) -> Rgb) -> VertexMesh {
    let mut mesh = VertexMesh::default();
    for (t, triangle) in scene.triangles().iter().enumerate() {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(scene.corners(t));
        mesh.normals.extend([scene.normal(t); 3]);
        mesh.radiosity.extend([radiosity(triangle); 3]);
        mesh.faces.push([first, first + 1, first + 2]);
    }
    mesh
}

/// Closed cubes side by side, each a group: its side, and its material.
fn cubes(cubes: &[(f64, Material)]) -> Scene {
    let (mut all, mut x) = (vec![], 0.0);
    for (side, material) in cubes {
        let box_of = walls([x, 0.0, 0.0], [x + side, *side, *side]);
        all.extend(box_of.map(|wall| (wall, material.clone())));
        x += side + 1.0;
    }
    let scene = quads(&all);
    let mut triangles = scene.triangles().to_vec();
    triangles.iter_mut().for_each(|t| t.group /= 6);
    let names = (0..cubes.len()).map(|k| format!("cube{k}")).collect();
    Scene::new(scene.positions().to_vec(), triangles, names, scene.materials().to_vec()).unwrap()
}

/// Radiosity E / (1 − ρ) of a cube with the reflected part multiplied by `factor`.
fn furnace(scene: &Scene, triangle: &Triangle, factor: f64) -> Rgb {
    let Material { reflectance, exitance, .. } = &scene.materials()[triangle.material as usize];
    exitance + factor * reflectance * exitance / (Rgb::ONE - reflectance)
}

fn settings(precision: f64) -> Settings {
    let mut settings = Settings::default();
    settings.precision = precision;
    settings
}

/// `value` within four standard errors, which are below `most`.
fn check(found: Option<radiosity::verify::Estimate>, value: f64, most: f64) {
    let found = found.expect("an error");
    assert!(found.standard_error < most, "{found:?}, not {value}");
    assert!((found.value - value).abs() < 4.0 * found.standard_error, "{found:?}, not {value}");
}

/// Measures until the standard error is below `wanted`.
fn until(scene: &Scene, solution: &VertexMesh, wanted: f64) -> Verification {
    let enough = |progress: &Progress| match progress.error {
        Some(error) if error.standard_error < wanted => ControlFlow::Break(()),
        _ => ControlFlow::Continue(()),
    };
    verify(scene, solution, &settings(1e-6), enough).unwrap()
}

#[test]
fn a_fine_mesh_is_judged_at_many_points() {
    let scene = cubes(&[(1.0, paint(0.5, 1.0))]);
    let few = solution(&scene, |t| furnace(&scene, t, 1.1));
    let mut many = few.clone();
    let pad = 4096 * 64 - many.positions.len();
    many.positions.extend(vec![DVec3::splat(0.5); pad]);
    many.normals.extend(vec![DVec3::Z; pad]);
    many.radiosity.extend(vec![furnace(&scene, &scene.triangles()[0], 1.0); pad]);
    let points = |mesh| verify(&scene, mesh, &settings(0.1), keep_going).unwrap().groups[0].points;
    assert!(points(&few) < 4096 && points(&many) >= 4096, "one for 64 vertices");
}

#[test]
fn an_exact_solution_has_no_error() {
    let scene = cubes(&[(1.0, paint(0.5, 1.0))]);
    let exact = solution(&scene, |t| furnace(&scene, t, 1.0));
    let found = until(&scene, &exact, 0.006);
    assert_eq!(found.stop, Stop::Cancelled);
    // Near zero the standard error of the root is that of the square's root.
    let error = found.error.unwrap();
    assert!(error.value < 2.0 * error.standard_error && error.standard_error < 0.006, "{error:?}");
    assert!((found.mean_reflected - 3f64.sqrt()).abs() < 0.01);
}

#[test]
fn a_tenth_too_much_is_ten_percent() {
    let bright = Material { reflectance: Rgb::new(0.2, 0.5, 0.8), ..paint(0.0, 1.0) };
    let scene = cubes(&[(1.0, bright)]);
    for factor in [1.1, 0.9] {
        let wrong = solution(&scene, |t| furnace(&scene, t, factor));
        let found = verify(&scene, &wrong, &settings(0.05), keep_going).unwrap();
        assert_eq!((found.stop, found.missing), (Stop::Precise, 0));
        check(found.error, 0.1, 0.0051);
    }
}

#[test]
fn groups_weigh_by_their_area() {
    // Areas 6 and 24: the error of the whole is that of the second times √(4/5).
    let scene = cubes(&[(1.0, paint(0.5, 1.0)), (2.0, paint(0.5, 1.0))]);
    let half = solution(&scene, |t| furnace(&scene, t, if t.group == 0 { 1.0 } else { 1.3 }));
    let found = verify(&scene, &half, &settings(0.05), keep_going).unwrap();
    check(found.error, 0.3 * 0.8f64.sqrt(), 0.02);
    assert_eq!(found.groups.len(), 2);
    assert!(found.groups[0].error.unwrap().value < 0.1);
    check(found.groups[1].error, 0.3, 0.02);
    for (group, share) in found.groups.iter().zip([0.2, 0.8]) {
        assert!((group.area_share - share).abs() < 1e-12 && group.hidden_share == 0.0);
        assert!((group.points as f64 / found.points.len() as f64 - share).abs() < 0.01);
    }
}

/// A two hundredth of the area is off by 200 %, all else by 10 %: the tail of 1 % holds the former.
#[test]
fn the_tail_does_not_count_and_is_told_with_the_error() {
    let side = (0.005f64 / 0.995).sqrt();
    let scene = cubes(&[(1.0, paint(0.5, 1.0)), (side, paint(0.5, 1.0))]);
    let wrong = solution(&scene, |t| furnace(&scene, t, if t.group == 0 { 1.1 } else { 3.0 }));
    let plain = (0.995 * 0.1f64.powi(2) + 0.005 * 2f64.powi(2)).sqrt();
    let found = verify(&scene, &wrong, &settings(0.05), keep_going).unwrap();
    check(found.error, 0.1, 0.006);
    check(found.error_with_tail, plain, 0.04);
    let mut without_tail = settings(0.05);
    without_tail.measure.tail = 0.0;
    let all = verify(&scene, &wrong, &without_tail, keep_going).unwrap();
    check(all.error, plain, 0.04);
    assert_eq!((all.error, all.tail), (all.error_with_tail, Some(0.0)));
}

#[test]
fn solutions_are_measured_at_the_same_points() {
    let scene = cubes(&[(1.0, paint(0.5, 1.0))]);
    let off_by = |factor: f64| solution(&scene, |t| furnace(&scene, t, factor));
    let mut verifier = Verifier::new(&scene, &settings(0.05)).unwrap();
    let none = verifier.measure_at_same_points(&off_by(1.1)).unwrap();
    assert_eq!((none.error, none.points.len()), (None, 0));
    let first = verifier.measure(&off_by(1.1), keep_going).unwrap();
    assert_eq!(
        first.error,
        verify(&scene, &off_by(1.1), &settings(0.05), keep_going).unwrap().error
    );
    for factor in [0.7, 1.2] {
        let other = verifier.measure_at_same_points(&off_by(factor)).unwrap();
        check(other.error, (factor - 1.0).abs(), 0.01);
        assert_eq!((other.stop, other.paths), (Stop::Rounds, first.paths));
        let points = |of: &Verification| -> Vec<(DVec3, Rgb)> {
            of.points.iter().map(|p| (p.position, p.measured)).collect()
        };
        assert!(points(&other) == points(&first));
    }
    assert_eq!(verifier.measure_at_same_points(&off_by(1.1)).unwrap().error, first.error);
    let both = cubes(&[(1.0, Material { sides: Sides::Both, ..paint(0.5, 1.0) })]);
    let error = Verifier::new(&both, &settings(0.05)).unwrap_err();
    assert!(error.to_string().contains("resolve_sides"), "{error}");
    assert!(Verifier::new(&both.resolve_sides(), &settings(0.05)).is_ok());
}

#[test]
fn a_small_group_has_points_of_its_own() {
    // A millionth of the area, and of the points that an even spread would give it.
    let scene = cubes(&[(1000.0, paint(0.5, 1.0)), (1.0, paint(0.5, 1.0))]);
    let wrong = solution(&scene, |t| furnace(&scene, t, if t.group == 0 { 1.1 } else { 3.0 }));
    let found = verify(&scene, &wrong, &settings(0.1), keep_going).unwrap();
    assert_eq!(found.groups[1].points, 16);
    check(found.groups[1].error, 2.0, 0.2);
    check(found.error, 0.1, 0.011);
}

#[test]
fn dark_surfaces_count_by_the_mean() {
    // Two cubes of one area that reflect 1 and 0.001: told none, the dark one is off by 0.001 of a
    // floor of 5 % of the mean.
    let scene = cubes(&[(1.0, paint(0.5, 1.0)), (1.0, paint(0.5, 0.001))]);
    let dark = solution(&scene, |t| furnace(&scene, t, if t.group == 0 { 1.2 } else { 0.0 }));
    let found = verify(&scene, &dark, &settings(0.05), keep_going).unwrap();
    check(found.groups[1].error, 0.001 / (0.05 * 0.5005), 0.002);
    check(found.groups[0].error, 0.2, 0.02);
}

#[test]
fn a_wide_plane_hides_no_room() {
    // The diagonal of all is 2.8 million: a crack of a ten thousandth of it would hold the room.
    let room = cubes(&[(1.0, paint(0.5, 1.0))]);
    let plane = facing_up([-1e6, 1e6], [-1e6, 1e6], -1.0).map(DVec3::from_array);
    let mut positions = room.positions().to_vec();
    let first = positions.len() as u32;
    positions.extend(plane);
    let mut triangles = room.triangles().to_vec();
    triangles.extend([[0, 1, 2], [0, 2, 3]].map(|corners| Triangle {
        corners: corners.map(|k: u32| first + k),
        group: 1,
        material: room.materials().len() as u32,
        ..Default::default()
    }));
    let groups = vec!["room".into(), "plane".into()];
    let materials = [room.materials(), &[paint(0.5, 0.0)]].concat();
    let scene = Scene::new(positions, triangles, groups, materials).unwrap();
    let wrong = solution(&scene, |t| match t.group {
        0 => furnace(&scene, t, 1.1),
        _ => Rgb::ZERO,
    });
    let found = verify(&scene, &wrong, &settings(0.05), keep_going).unwrap();
    assert_eq!(found.groups[0].hidden_share, 0.0);
    check(found.groups[0].error, 0.1, 0.02);
}

#[test]
fn what_only_emits_has_no_weight() {
    let floor = facing_up([0.0, 1.0], [0.0, 1.0], 0.0);
    let light = facing_down([-99.0, 100.0], [-99.0, 100.0], 1.0);
    let scene = quads(&[(floor, paint(0.5, 0.0)), (light, lamp([1.0; 3]))]);
    let off_at_the_lamp = |by: f64| {
        // The floor sees nearly nothing but the lamp: all but 1e-4.
        let told = |t: &Triangle| Rgb::splat(if t.group == 0 { 1.0 } else { 1.0 + by });
        let solution = solution(&scene, told);
        verify(&scene, &solution, &settings(0.1), keep_going).unwrap()
    };
    let (none, much) = (off_at_the_lamp(0.0), off_at_the_lamp(1e9));
    assert_eq!(none.error, much.error);
    assert_eq!(much.groups.len(), 1);
    assert_eq!(much.groups[0].group, 0);
    check(much.error, 1.0, 0.11);
}

#[test]
fn what_is_hidden_is_left_out_and_said() {
    let mut all = vec![(facing_up([0.0, 1.0], [0.0, 1.0], 0.0), paint(0.5, 0.0))];
    let block = standing_block([0.2, 0.7], [0.3, 0.8], 0.0, 0.4);
    all.extend(block.map(|side| (side, paint(0.5, 0.0))));
    all.push((facing_down([-9.0, 10.0], [-9.0, 10.0], 2.0), lamp([1.0; 3])));
    let scene = quads(&all);
    let lit = solution(&scene, |_| Rgb::splat(0.5));
    let mut settings = settings(0.1);
    let found = verify(&scene, &lit, &settings, keep_going).unwrap();
    // A quarter of the floor, of n random points.
    let floor = found.groups[0];
    let deviation = (0.25 * 0.75 / floor.points as f64).sqrt();
    assert!((floor.hidden_share - 0.25).abs() < 4.0 * deviation, "{floor:?}");
    assert!(found.groups[1..].iter().all(|group| group.hidden_share == 0.0));
    let inside = |p: DVec3| p.x > 0.2 && p.x < 0.7 && p.y > 0.3 && p.y < 0.8 && p.z == 0.0;
    assert!(found.points.iter().all(|point| point.hidden == inside(point.position)));
    // Told 0.5 where there is no light: more than twice the mean, above a floor of 5 % of it.
    let (without, with) = (found.error.unwrap(), found.error_with_hidden.unwrap());
    assert!(without.value < 1.0 && with.value > 5.0, "{without:?} {with:?}");
    settings.hidden = true;
    let all = verify(&scene, &lit, &settings, keep_going).unwrap();
    assert_eq!(all.error, all.error_with_hidden);
    assert!(all.groups[0].error.unwrap().value > 10.0);
    // Nothing is reflected in the hidden quarter, of 2.05 in all: the mean is over the rest. Values
    // differ by 0.4 of it; three standard errors of a ratio of two means.
    let (ratio, expected) = (found.mean_reflected / all.mean_reflected, 2.05 / 1.8);
    let count = |found: &Verification| found.points.len() as f64;
    let tolerance = 3.0 * 0.4 * expected * (1.0 / count(&found) + 1.0 / count(&all)).sqrt();
    assert!(tolerance < 0.12, "{tolerance}");
    assert!((ratio - expected).abs() < tolerance, "{ratio}, {tolerance}");
}

#[test]
fn open_ground_counts_where_a_lamp_lights_it() {
    let ground = |light: Option<Quad>, sky: f64| {
        let mut all = vec![(facing_up([-5.0, 5.0], [-5.0, 5.0], 0.0), paint(0.5, 0.0))];
        all.extend(light.map(|quad| (quad, lamp([100.0; 3]))));
        quads(&all).with_sky(Sky::uniform(Rgb::splat(sky))).unwrap()
    };
    let hidden_share = |scene: Scene| {
        let baked = BakeTarget::Error(0.05).bake(scene, &Backend::Cpu, keep_going).unwrap();
        let scene = baked.light.mesh.scene();
        let found = verify(scene, &baked.light.surface, &settings(0.1), keep_going).unwrap();
        // The light of a sky alone is exact, so that nothing is left to measure.
        if found.groups[0].hidden_share == 0.0 {
            let (estimated, found) = (baked.estimate.total, found.error.unwrap().value);
            assert!(baked.outcome == Outcome::Reached && found < 0.05, "{found}");
            assert!((0.5..2.0).contains(&(estimated / found)), "{estimated} {found}");
            // One field of light of one lamp: not the half a million that there may be.
            assert!(baked.light.mesh.element_count() < 5000);
        }
        found.groups[0].hidden_share
    };
    // It covers 4e-4 of the hemisphere right below it, and sends 0.04 of 3 W/m² there.
    let small = facing_down([-0.1, 0.1], [-0.1, 0.1], 3.0);
    assert_eq!(hidden_share(ground(Some(small), 0.0)), 0.0);
    assert_eq!(hidden_share(ground(None, 1.0)), 1.0);
}

#[test]
fn a_crack_is_hidden_and_a_gap_is_not() {
    let shares = |height: f64| {
        let mut all = vec![(facing_up([0.0, 1.0], [0.0, 1.0], 0.0), paint(0.5, 0.0))];
        let hovering = block([0.2, 0.3, height], [0.7, 0.8, height + 0.4]);
        all.extend(hovering.map(|side| (side, paint(0.5, 0.0))));
        all.push((facing_down([-9.0, 10.0], [-9.0, 10.0], 2.0), lamp([1.0; 3])));
        let scene = quads(&all);
        let lit = solution(&scene, |_| Rgb::splat(0.5));
        let found = verify(&scene, &lit, &settings(0.1), keep_going).unwrap();
        let floor = found.groups[0];
        (floor.hidden_share, (0.25 * 0.75 / floor.points as f64).sqrt())
    };
    // The diagonal is 1.47: a mean of 1/distance of 2/3 over the height is above 10 000/1.47 below
    // a height of 9.8e-5.
    let (crack, deviation) = shares(3e-5);
    assert!((crack - 0.25).abs() < 4.0 * deviation, "{crack} ± {deviation}");
    assert_eq!(shares(3e-3).0, 0.0);
}

#[test]
fn seeds_not_threads_make_the_points() {
    let scene = cubes(&[(1.0, paint(0.5, 1.0)), (2.0, paint(0.5, 1.0))]);
    let wrong = solution(&scene, |t| furnace(&scene, t, 1.5));
    let measure = |threads: usize, seed: u64| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut settings = settings(0.1);
        settings.seed = seed;
        let found = pool.install(|| verify(&scene, &wrong, &settings, keep_going)).unwrap();
        let points = found.points.iter().map(|p| (p.position, p.measured)).collect::<Vec<_>>();
        (found.error, points)
    };
    assert!(measure(1, 1) == measure(3, 1));
    assert!(measure(1, 1) != measure(1, 2));
}

#[test]
fn it_stops_when_told_and_when_time_is_up() {
    let scene = cubes(&[(1.0, paint(0.5, 1.0))]);
    let exact = solution(&scene, |t| furnace(&scene, t, 1.0));
    let mut settings = settings(0.01);
    let stopped = verify(&scene, &exact, &settings, |_| ControlFlow::Break(())).unwrap();
    assert_eq!((stopped.stop, stopped.error), (Stop::Cancelled, None));
    settings.time = Some(Duration::ZERO);
    let first = verify(&scene, &exact, &settings, keep_going).unwrap();
    assert_eq!((first.stop, first.paths), (Stop::Time, 64));
    assert!(first.error.is_some() && first.points.len() >= 512);
    // Nothing is lit, nothing is told to be: no error, surely.
    let dark = quads(&[
        (facing_up([0.0, 1.0], [0.0, 1.0], 0.0), paint(0.5, 0.0)),
        (facing_up([0.0, 1.0], [0.0, 1.0], 1.0), lamp([1.0; 3])),
    ]);
    let none = verify(&dark, &solution(&dark, |_| Rgb::ZERO), &settings, keep_going).unwrap();
    assert_eq!((none.stop, none.error.unwrap().value), (Stop::Negligible, 0.0));
}

/// Of two sheets in one place each has light of its own: under the same irradiance of 1.
#[test]
fn surfaces_in_one_place_are_told_apart() {
    let sheet = facing_up([0.0, 1.0], [0.0, 1.0], 0.0);
    let lamp = (facing_down([0.0, 1.0], [0.0, 1.0], 1.0), paint(0.5, 1.0));
    for [first, second] in [[0.5, 0.2], [0.2, 0.5]] {
        let scene = quads(&[(sheet, paint(first, 0.0)), (sheet, paint(second, 0.0)), lamp.clone()]);
        let mut told = solution(&scene, |_| Rgb::ZERO);
        told.irradiance = vec![Rgb::ONE; told.positions.len()];
        let material = |t: usize| scene.materials()[scene.triangles()[t].material as usize].clone();
        let radiosity =
            (0..scene.triangles().len()).map(|t| material(t).exitance + material(t).reflectance);
        told.radiosity = radiosity.flat_map(|radiosity| [radiosity; 3]).collect();
        let mut settings = settings(1.0);
        settings.points_per_group = 64;
        let found = verify(&scene, &told, &settings, keep_going).unwrap();
        let on_sheets = found.points.iter().filter(|p| p.normal.z > 0.5);
        let told_on =
            |group| on_sheets.clone().filter(move |p| p.group == group).map(|p| p.solution.x);
        assert!(told_on(0).count() >= 64 && told_on(1).count() >= 64);
        assert!(told_on(0).all(|b| (b - first).abs() < 1e-12), "{first}");
        assert!(told_on(1).all(|b| (b - second).abs() < 1e-12), "{second}");
        // What no material of the scene would emit or reflect is refused.
        told.radiosity[..12].fill(Rgb::splat(0.7));
        let stop = |_: &Progress| ControlFlow::Break(());
        let error = verify(&scene, &told, &settings, stop).unwrap_err();
        assert!(error.to_string().contains("emits radiance"), "{error}");
    }
}

#[test]
fn what_cannot_be_measured_is_refused() {
    let scene = cubes(&[(1.0, paint(0.5, 1.0))]);
    let good = solution(&scene, |_| Rgb::ONE);
    let refused = |scene: &Scene, solution: &VertexMesh, words: &[&str]| {
        let error = verify(scene, solution, &Settings::default(), keep_going).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Scene);
        assert!(words.iter().all(|word| error.to_string().contains(word)), "{error}");
    };
    let changed = |change: fn(&mut VertexMesh)| {
        let mut mesh = good.clone();
        change(&mut mesh);
        mesh
    };
    let shifted = changed(|mesh| mesh.positions.iter_mut().for_each(|p| p.x += 0.5));
    refused(&scene, &shifted, &["random points", "none of its faces", "'cube0'", "this scene"]);
    let turned = changed(|mesh| mesh.faces.iter_mut().for_each(|face| face.swap(0, 1)));
    refused(&scene, &turned, &["none of its faces"]);
    refused(&scene, &changed(|mesh| mesh.faces[3][1] = 99), &["face 4", "99"]);
    refused(&scene, &changed(|mesh| mesh.radiosity[5].y = f64::NAN), &["vertex 6", "NaN"]);
    refused(&scene, &changed(|mesh| mesh.positions[0].x = f64::INFINITY), &["vertex 1", "inf"]);
    refused(&scene, &changed(|mesh| mesh.radiosity.truncate(4)), &["4 values"]);
    refused(&scene, &VertexMesh::default(), &["no faces"]);
    refused(&cubes(&[(1.0, paint(0.0, 1.0))]), &good, &["reflects"]);
    refused(&cubes(&[(1.0, paint(0.5, 0.0))]), &good, &["emits"]);
    // B = E + ρ H, of an irradiance H of 1: the scene's cube emits 1, the solution 0.4.
    let dimmer = changed(|mesh| {
        mesh.irradiance = vec![Rgb::ONE; mesh.positions.len()];
        mesh.radiosity = vec![Rgb::splat(0.5 + 0.4); mesh.positions.len()];
    });
    refused(&scene, &dimmer, &["emits radiance 0.1273,", "and 0.3183,", "--emit"]);
    let mut same = dimmer;
    same.radiosity = vec![Rgb::splat(1.5); same.positions.len()];
    assert!(verify(&scene, &same, &settings(1.0), |_| ControlFlow::Break(())).is_ok());
    for precision in [0.0, -1.0, f64::NAN, 2.0] {
        let error = verify(&scene, &good, &settings(precision), keep_going).unwrap_err();
        assert_eq!((error.kind(), error.place()), (ErrorKind::Setting, "precision"));
    }
    let mut few = Settings::default();
    few.points_per_group = 1;
    assert_eq!(verify(&scene, &good, &few, keep_going).unwrap_err().kind(), ErrorKind::Setting);
}
