//! Bakes to an error and within a time, with rays on the CPU; truth is path-traced or has a closed
//! form.

use std::ops::ControlFlow;
use std::time::Duration;

use radiosity::bake::{BakeProgress, Obstacle, Outcome};
use radiosity::gather::RefinementSettings;
use radiosity::solver::StopReason;
use radiosity::{
    Backend, BakeResult, BakeSettings, BakeTarget, ErrorKind, Material, Rgb, Scene, Solver,
};

use crate::common::{cornell_box, cube, keep_going, quads};

fn cornell() -> Scene {
    cornell_box(f64::INFINITY).scene().clone()
}

fn bake_to_error(scene: Scene, error: f64) -> BakeResult {
    BakeTarget::Error(error).bake(scene, &Backend::Cpu, keep_going).unwrap()
}

/// A closed room in which all is known: B = 1/(1 − ρ) everywhere.
fn furnace(reflectance: f64) -> Scene {
    cube(&Material { exitance: Rgb::ONE, ..Material::grey("glow", reflectance) })
}

#[test]
fn furnace_is_exact_and_estimated_so() {
    let baked = bake_to_error(furnace(0.5), 0.02);
    // Most of what is left is what was not shot, e/40 = 5e-4 of what is emitted, of which half
    // returns, and what few looks into corners miss.
    let all = &baked.light.surface.radiosity;
    let rms = all.iter().map(|b| (b.x / 2.0 - 1.0).powi(2)).sum::<f64>() / all.len() as f64;
    println!("off by {}, {:?}", rms.sqrt(), baked.estimate);
    assert!(rms.sqrt() < 5e-3, "{}", rms.sqrt());
    assert!(baked.estimate.total < 5e-3, "{:?}", baked.estimate);
}

/// Light that is wrong by a known share, and its estimate: shooting stopped early.
#[test]
fn estimate_covers_unshot_light() {
    for reflectance in [0.5, 0.8] {
        for unshot in [0.3, 0.1, 0.03] {
            let mut settings = BakeSettings::for_error(0.02, &furnace(reflectance));
            settings.solve.solver = Solver { unshot, patch_tolerance: 0.0, ..Solver::default() };
            settings.solve.element_size = 0.5;
            settings.gather = None;
            let baked = settings.bake(furnace(reflectance), &Backend::Cpu, keep_going).unwrap();
            let (even, left) = (1.0 / (1.0 - reflectance), baked.solution.ledger.unshot_share());
            let mean = baked.solution.radiosity.iter().map(|b| b.x).sum::<f64>()
                / baked.solution.radiosity.len() as f64;
            // All elements are equal here: what is missing is ρ/(1 − ρ) of what was not shot.
            let missing = 1.0 - mean / even;
            assert!((missing - left * reflectance).abs() < 1e-9, "{missing} {left}");
            // A share of what is there, not of what there would be.
            let share = missing / (1.0 - missing);
            let bound = baked.estimate.unshot_bound;
            // That of vertices, whose mean is not exactly that of the elements: these differ by
            // what single shots left, some 1e-4 of all.
            assert!((bound / share - 1.0).abs() < 1e-3, "{bound} {share}");
            let estimated = baked.estimate.total;
            println!(
                "{reflectance} {unshot}: missing {missing:.4}, estimated {:?}",
                baked.estimate
            );
            assert!(estimated > 0.5 * missing && estimated < 3.0 * missing);
        }
    }
}

#[test]
fn settings_made_by_hand_stay() {
    let overrides = |settings: &mut BakeSettings| {
        settings.solve.hemicube_resolution = 48;
        if let Some(gather) = &mut settings.gather {
            (gather.rays, gather.noise_tolerance) = (77, 0.05);
            gather.refinement =
                RefinementSettings { gather_passes: 1, ..RefinementSettings::new(60.0) };
        }
    };
    let baked =
        BakeTarget::Error(0.01).bake_with(cornell(), &Backend::Cpu, overrides, keep_going).unwrap();
    let mut want = BakeSettings::for_error(0.01, &cornell());
    overrides(&mut want);
    assert_eq!(baked.settings, want);
    assert!(baked.estimate.total > 0.01, "and it says that it fell short");
}

#[test]
fn two_runs_give_the_same_bits() {
    let [one, two] = [0, 1].map(|_| bake_to_error(cornell(), 0.1));
    assert!(one.light.surface.radiosity == two.light.surface.radiosity);
    assert!(one.light.surface.error == two.light.surface.error);
    assert_eq!(one.estimate, two.estimate);
    assert_eq!(one.settings, two.settings);
}

#[test]
fn a_bake_within_a_time_goes_on_from_what_it_has() {
    // No time at all: light that is the same everywhere comes back at once, less than all off.
    let target = BakeTarget::Time(Duration::from_nanos(1));
    let none = target.bake(cornell(), &Backend::Cpu, keep_going).unwrap();
    assert_eq!(none.light.stop, StopReason::Cancelled);
    assert_eq!(none.light.surface.error.len(), none.light.surface.positions.len());
    assert!(none.light.surface.radiosity.iter().any(|&b| b != Rgb::ZERO));
    // Time enough on any machine: stopped by hand after so many estimates. Each begins from what
    // was gathered for the one before.
    let target = BakeTarget::Time(Duration::from_secs(1 << 30));
    let after = |estimates: usize| {
        let (mut told, mut gathered) = (vec![], 0);
        let progress = |stage: &BakeProgress| {
            match stage {
                BakeProgress::Estimated(estimate) => told.push(estimate.total),
                BakeProgress::Gathering(_) => gathered += 1,
                BakeProgress::Shooting(_) => panic!("nothing is shot"),
                _ => (),
            }
            match told.len() >= estimates {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            }
        };
        let baked = target.bake(cornell(), &Backend::Cpu, progress).unwrap();
        assert_eq!(baked.solution.shots, 0);
        (baked.light.gather_count, baked.estimate.total)
    };
    let (first, last) = (after(1), after(10));
    println!("{first:?} {last:?}");
    // Two or three times, each to at most three quarters of the error before.
    assert!(last.0 > first.0 && last.1 < 0.7 * first.1);
    // With an error it ends there, and not later.
    let time = Duration::from_secs(1 << 30);
    let target = BakeTarget::Within { error: 0.05, each_group: false, time };
    let baked = target.bake(cornell(), &Backend::Cpu, keep_going).unwrap();
    assert_eq!(baked.outcome, Outcome::Reached);
    assert!(baked.estimate.total <= 0.05 && baked.estimate.total > 0.01);
}

#[test]
fn every_stage_can_be_cancelled() {
    for at in 0..3 {
        let mut estimates = 0;
        let baked = BakeTarget::Error(0.02)
            .bake(cornell(), &Backend::Cpu, |stage| {
                let stop = match stage {
                    BakeProgress::Shooting(_) => at == 0,
                    BakeProgress::Gathering(p) => at == 1 && p.refinements > 0,
                    BakeProgress::Estimated(_) => {
                        estimates += 1;
                        at == 2
                    }
                    BakeProgress::Estimating { samples, of } => {
                        assert!(0 < *samples && samples <= of);
                        false
                    }
                    BakeProgress::DeviceFailed(error) => panic!("{error}"),
                    _ => false,
                };
                if stop { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            })
            .unwrap();
        // By gathers, and held against paths where vertices had gathered.
        let expected = if at == 0 { 1 } else { 2 };
        assert_eq!(estimates, expected, "the error of what was reached is estimated, once");
        // What was estimated before it was stopped may have been good enough.
        let is_enough = at == 2 && baked.estimate.total <= 0.02;
        let missed = Outcome::Missed(Obstacle::Cancelled);
        assert_eq!(baked.outcome, if is_enough { Outcome::Reached } else { missed });
        match at {
            0 => assert_eq!(baked.solution.stop, StopReason::Cancelled),
            1 => assert_eq!(baked.light.stop, StopReason::Cancelled),
            _ => assert_eq!(baked.light.stop, StopReason::Converged),
        }
        assert_eq!(baked.light.surface.error.len(), baked.light.surface.positions.len());
    }
}

#[test]
fn dark_and_black_scenes_are_exact() {
    let up = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];
    let lamp = Material { exitance: Rgb::ONE, ..Material::grey("lamp", 0.0) };
    for material in [Material::grey("dark", 0.5), Material::grey("black", 0.0), lamp] {
        let baked = bake_to_error(quads(&[(up, material.clone())]), 0.01);
        assert_eq!(baked.estimate.total, 0.0, "{:?}", baked.estimate);
        // Means over elements are rounded.
        let off = |b: &Rgb| b.distance(material.exitance);
        assert!(baked.light.surface.radiosity.iter().all(|b| off(b) < 1e-14));
        assert!(baked.light.surface.error.iter().all(|e| *e == 0.0));
    }
}

#[test]
fn rejects_light_whose_squares_are_no_numbers() {
    for (light, is_fine) in [(1e32, true), (1e-32, true), (1e200, false), (1e-300, false)] {
        let glow = Material { exitance: Rgb::splat(light), ..Material::grey("glow", 0.5) };
        match BakeTarget::Error(0.1).bake(cube(&glow), &Backend::Cpu, keep_going) {
            Ok(baked) => assert!(is_fine && baked.estimate.total < 0.1, "{:?}", baked.estimate),
            Err(e) => assert!(!is_fine && e.kind() == ErrorKind::Scene, "{e}"),
        }
    }
}

#[test]
fn rejects_targets_out_of_range() {
    for error in [0.0, -0.1, 1.0, 7.0, f64::NAN, f64::INFINITY] {
        let e = BakeTarget::Error(error).bake(furnace(0.5), &Backend::Cpu, keep_going).unwrap_err();
        assert_eq!(e.kind(), ErrorKind::Setting);
        assert!(e.to_string().contains("error"), "{e}");
    }
    for seconds in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let e = BakeTarget::seconds(seconds).unwrap_err();
        assert_eq!(e.kind(), ErrorKind::Setting);
    }
    let no_time = BakeTarget::Time(Duration::ZERO);
    let e = no_time.bake(furnace(0.5), &Backend::Cpu, keep_going).unwrap_err();
    assert_eq!(e.kind(), ErrorKind::Setting);
    let bad = |settings: &mut BakeSettings| {
        if let Some(gather) = &mut settings.gather {
            gather.refinement.mesh_error = 0.0;
        }
    };
    let e =
        BakeTarget::Error(0.1).bake_with(furnace(0.5), &Backend::Cpu, bad, keep_going).unwrap_err();
    assert_eq!(e.kind(), ErrorKind::Setting);
}
