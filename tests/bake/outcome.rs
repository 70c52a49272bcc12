//! Whether a target was met, for the whole or each group, and what stood in the way.

use std::f64::consts::PI;
use std::ops::ControlFlow;
use std::time::Duration;

use glam::DVec3;
use radiosity::bake::{BakeProgress, Obstacle, Outcome};
use radiosity::{Backend, BakeSettings, BakeTarget, Material, Rgb, Scene, Triangle, verify};

use crate::common::scenes::{block, facing_up, quads, walls};
use crate::common::{cornell_box, keep_going};

fn cornell() -> Scene {
    cornell_box(f64::INFINITY).scene().clone()
}

#[test]
fn each_group_meets_its_error() {
    let target = BakeTarget::ErrorEach(0.1);
    let baked = target.bake(cornell(), &Backend::Cpu, keep_going).unwrap();
    println!("{} {:?}", baked.outcome, baked.estimate);
    assert_eq!(baked.groups.len(), cornell().groups().len());
    let shares: f64 = baked.groups.iter().map(|group| group.area_share).sum();
    assert!((shares - 1.0).abs() < 1e-9, "{shares}");
    let worst = baked.groups.iter().map(|g| g.estimate.total).fold(0.0, f64::max);
    assert!(worst <= 0.1, "{worst}");
    assert_eq!(baked.outcome, Outcome::Reached);
    // More points on a small group than its area would give it.
    assert!(baked.groups.iter().all(|group| group.estimate.samples >= 16));
}

/// A shelf between a floor and a lamp as wide as that: at the edge of the full shadow a strip of
/// the lamp is visible, and the noise of its light is no reason to split elements without end.
#[test]
fn edges_of_a_shadow_are_not_split_for_noise() {
    let square = |z: f64, [low, high]: [f64; 2]| {
        [[low, low, z], [high, low, z], [high, high, z], [low, high, z]]
    };
    let grey = Material::grey("grey", 0.6);
    let lamp = Material { exitance: Rgb::splat(12.0), ..Material::grey("lamp", 0.0) };
    let [a, b, c, d] = square(1.0, [0.0, 1.0]);
    let faces = [
        (square(0.0, [0.0, 1.0]), grey.clone()),
        ([d, c, b, a], lamp),
        (square(0.3, [0.3, 0.8]), grey),
    ];
    // Where the first rays happen to fall differs with the error.
    for error in [0.019, 0.02, 0.021, 0.022] {
        let baked =
            BakeTarget::Error(error).bake(quads(&faces), &Backend::Cpu, keep_going).unwrap();
        let elements = baked.light.mesh.element_count();
        println!("{error}: {elements} elements, {}", baked.outcome);
        assert_eq!(baked.outcome, Outcome::Reached, "{error}");
        // 3 000 to 6 000 of 1 to 2 %; those of noise are bounded by 524 288 alone.
        assert!(elements < 20_000, "{error}: {elements}");
    }
}

/// 64 lamps below a ceiling of 6 m, in steps of 0.75 m: all vertices of coarse elements are alike,
/// and the light between them is brighter.
#[test]
fn light_in_step_with_the_mesh_is_resolved() {
    let lamp = Material { exitance: Rgb::splat(30.0), ..Material::grey("lamp", 0.0) };
    let grey = Material::grey("wall", 0.6);
    let mut faces: Vec<_> =
        walls([0.0; 3], [6.0, 6.0, 3.0]).map(|wall| (wall, grey.clone())).into_iter().collect();
    for k in 0..64 {
        let [x, y] = [k % 8, k / 8].map(|i| (f64::from(i) + 0.5) * 0.75);
        let [low, high] = [-0.05, 0.05].map(|by| [x + by, y + by, 2.75 + by]);
        faces.extend(block(low, high).map(|side| (side, lamp.clone())));
    }
    let baked = BakeTarget::Error(0.1).bake(quads(&faces), &Backend::Cpu, keep_going).unwrap();
    println!("{} {:?}", baked.outcome, baked.estimate);
    assert_eq!(baked.outcome, Outcome::Reached);
}

#[test]
fn misses_are_called_by_their_obstacle() {
    let bake = |error: f64, overrides: &dyn Fn(&mut BakeSettings)| {
        let target = BakeTarget::Error(error);
        target.bake_with(cornell(), &Backend::Cpu, overrides, keep_going).unwrap()
    };
    let few = bake(0.02, &|s| {
        if let Some(gather) = &mut s.gather {
            gather.refinement.max_elements = 1000;
        }
    });
    assert_eq!(few.outcome, Outcome::Missed(Obstacle::Elements));
    assert!(few.estimate.total > 0.02);
    let fixed = bake(0.02, &|s| {
        let coarse = BakeSettings::for_error(0.2, &cornell()).gather;
        s.gather = coarse;
    });
    assert_eq!(fixed.outcome, Outcome::Missed(Obstacle::Settings));
    let none = bake(0.02, &|s| s.gather = None);
    assert_eq!(none.outcome, Outcome::Missed(Obstacle::Settings));
    let stop = |stage: &BakeProgress| match stage {
        BakeProgress::Gathering(_) => ControlFlow::Break(()),
        _ => ControlFlow::Continue(()),
    };
    let stopped = BakeTarget::Error(0.02).bake(cornell(), &Backend::Cpu, stop).unwrap();
    assert_eq!(stopped.outcome, Outcome::Missed(Obstacle::Cancelled));
    assert_eq!(stopped.outcome.to_string(), "missed: it was stopped");
}

#[test]
fn without_an_error_there_is_nothing_to_miss() {
    let settings = BakeSettings::for_error(0.1, &cornell());
    let baked = settings.bake(cornell(), &Backend::Cpu, keep_going).unwrap();
    assert_eq!(baked.outcome, Outcome::Unasked);
    let target = BakeTarget::Time(Duration::from_nanos(1));
    let baked = target.bake(cornell(), &Backend::Cpu, keep_going).unwrap();
    assert_eq!(baked.outcome, Outcome::Unasked);
}

#[test]
fn an_error_within_a_time_is_reached_or_the_time_is_up() {
    let bake = |error, each_group, time, stop: bool| {
        let flow = if stop { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
        let target = BakeTarget::Within { error, each_group, time };
        target.bake(cornell(), &Backend::Cpu, |_| flow)
    };
    let hour = Duration::from_secs(3600);
    for each_group in [false, true] {
        let reached = bake(0.1, each_group, hour, false).unwrap();
        assert_eq!(reached.outcome, Outcome::Reached);
        assert!(reached.estimate.total <= 0.1, "{:?}", reached.estimate);
        let soon = bake(0.1, each_group, Duration::from_nanos(1), false).unwrap();
        assert_eq!(soon.outcome, Outcome::Missed(Obstacle::Time));
        assert_eq!(soon.outcome.to_string(), "missed: the time was up");
    }
    let stopped = bake(0.1, false, hour, true).unwrap();
    assert_eq!(stopped.outcome, Outcome::Missed(Obstacle::Cancelled));
    assert!(bake(1.5, false, hour, false).unwrap_err().to_string().contains("error 1.5"));
    assert!(bake(0.1, false, Duration::ZERO, false).unwrap_err().to_string().contains("time"));
}

#[test]
fn a_lamp_alone_has_no_error() {
    // It reflects what nothing sends it: 0, but for the rounding of 0.3 π beside it.
    let lamp = Material { exitance: Rgb::splat(0.3 * PI), ..Material::grey("lamp", 0.9) };
    let scene = quads(&[(facing_up([0.0, 0.7], [0.0, 0.3], 0.1), lamp)]);
    let baked = BakeTarget::Error(0.1).bake(scene, &Backend::Cpu, keep_going).unwrap();
    assert_eq!(baked.outcome, Outcome::Reached);
    assert!(baked.estimate.total < 1e-3, "{:?}", baked.estimate);
}

/// Light shot on two elements a wall is off, and what the vertices gather from it too.
#[test]
fn light_shot_too_coarsely_is_estimated_so() {
    let coarse = |settings: &mut BakeSettings| {
        settings.solve.element_size = 1e3;
        settings.solve.near_reach = -1.0;
        if let Some(gather) = &mut settings.gather {
            gather.refinement.gather_passes = 1;
        }
    };
    let target = BakeTarget::Error(0.05);
    let baked = target.bake_with(cornell(), &Backend::Cpu, coarse, keep_going).unwrap();
    // To a quarter of the error, which is enough beside a factor of two.
    let mut settings = verify::Settings::default();
    settings.precision = 0.25;
    let proceed = |_: &verify::Progress| ControlFlow::Continue(());
    let measured = verify::verify(&cornell(), &baked.light.surface, &settings, proceed).unwrap();
    let (told, measured) = (baked.estimate, measured.error.unwrap().value);
    println!("{}, told {told:?}, measured {measured}", baked.outcome);
    // What is told of an error is to be within a factor of two of it.
    assert!((0.5..2.0).contains(&(told.total / measured)), "{told:?} {measured}");
}

/// A column of 16 faces, folded by 22.5°, beside a lamp: its faces are flat, whatever is between
/// them, unless its file says that it is smooth.
#[test]
fn flat_faces_take_few_elements() {
    let count = |smoothing: Option<u32>| {
        let rim = |k: u32, z: f64| {
            let (sin, cos) = (f64::from(k) * PI / 8.0).sin_cos();
            DVec3::new(cos, sin, z)
        };
        let mut positions: Vec<DVec3> = (0..16).flat_map(|k| [rim(k, 0.0), rim(k, 4.0)]).collect();
        let mut triangles = vec![];
        for k in 0..16 {
            let [a, b, c, d] = [2 * k, (2 * k + 2) % 32, (2 * k + 3) % 32, 2 * k + 1];
            for corners in [[a, b, c], [a, c, d]] {
                triangles.push(Triangle { corners, group: 0, material: 0, smoothing });
            }
        }
        // Four metres off, facing it.
        let lamp = [[4.0, -1.0, 1.0], [4.0, -1.0, 3.0], [4.0, 1.0, 3.0], [4.0, 1.0, 1.0]];
        positions.extend(lamp.map(DVec3::from_array));
        for corners in [[32, 33, 34], [32, 34, 35]] {
            triangles.push(Triangle { corners, group: 1, material: 1, smoothing: None });
        }
        let materials = vec![Material::grey("column", 0.5), lamp_material()];
        let names = ["column", "lamp"].map(String::from).to_vec();
        let scene = Scene::new(positions, triangles, names, materials).unwrap();
        let baked = BakeTarget::Error(0.05).bake(scene, &Backend::Cpu, keep_going).unwrap();
        assert_eq!(baked.outcome, Outcome::Reached);
        baked.light.mesh.element_count()
    };
    let (flat, smooth) = (count(None), count(Some(1)));
    println!("{flat} elements, {smooth} where folds are smooth");
    assert!(2 * flat < smooth, "{flat} {smooth}");
}

fn lamp_material() -> Material {
    Material { exitance: Rgb::splat(10.0), ..Material::grey("lamp", 0.0) }
}
