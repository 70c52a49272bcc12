//! Processes that share out long loops: here threads that act as such.

use std::ops::ControlFlow;

use radiosity::bake::{BakeProgress, Outcome};
use radiosity::gather::{GatherPoint, irradiance_at};
use radiosity::verify::{Settings, verify};
use radiosity::{Backend, BakeResult, BakeTarget, Rgb, Scene, load_scene};

use crate::common::processes::in_processes;

pub fn cornell_box() -> Scene {
    load_scene(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj")).unwrap()
}

pub fn go(_: &BakeProgress) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// All numbers of a bake, by their bits.
pub fn bits(baked: &BakeResult) -> (Vec<u64>, Vec<u64>) {
    let radiosity = baked.light.surface.radiosity.iter();
    let radiosity = radiosity.flat_map(Rgb::to_array).map(f64::to_bits).collect();
    (radiosity, baked.light.surface.error.iter().map(|e| e.to_bits()).collect())
}

#[test]
fn any_number_of_processes_bake_the_same_bits() {
    let bake = |_| BakeTarget::Error(0.1).bake(cornell_box(), &Backend::Cpu, go).unwrap();
    let alone = bits(&bake(0));
    for size in [2, 3] {
        let of_all = in_processes(size, bake);
        assert!(of_all.iter().all(|baked| bits(baked) == alone), "{size} processes");
    }
}

/// They gather at points, and trace paths.
#[test]
fn any_number_of_processes_measure_the_same() {
    let scene = cornell_box();
    let baked = BakeTarget::Error(0.2).bake(scene.clone(), &Backend::Cpu, go).unwrap();
    let corner = scene.bounds().low;
    let size = scene.bounds().high - corner;
    let point = |k: usize| {
        let share = glam::DVec3::new(0.3 + 0.001 * k as f64, 0.5, 0.5);
        GatherPoint { position: corner + share * size, normal: glam::DVec3::Y, near: 1e-3 }
    };
    let points: Vec<GatherPoint> = (0..300).map(point).collect();
    let measure = |_| {
        let mut gather = Backend::Cpu.gather_to_noise(&baked.light, 0.1).unwrap();
        let go = |_, _| ControlFlow::Continue(());
        let light = irradiance_at(&baked.light, &points, &mut *gather, go).unwrap().unwrap();
        let mut settings = Settings::default();
        settings.precision = 0.3;
        let measured = verify(&scene, &baked.light.surface, &settings, |_| go(0, 0)).unwrap();
        (light, measured.error)
    };
    let alone = measure(0);
    assert!(in_processes(3, measure).iter().all(|measured| *measured == alone));
}

/// One of them is asked to stop; all do, at the same point.
#[test]
fn one_process_stops_the_bake_of_all() {
    let of_all = in_processes(2, |rank| {
        BakeTarget::Error(0.02).bake(cornell_box(), &Backend::Cpu, |stage| match stage {
            BakeProgress::Gathering(_) if rank == 1 => ControlFlow::Break(()),
            _ => ControlFlow::Continue(()),
        })
    });
    let [first, second] = &of_all[..] else { panic!("two processes") };
    let (first, second) = (first.as_ref().unwrap(), second.as_ref().unwrap());
    assert!(matches!(first.outcome, Outcome::Missed(_)));
    assert_eq!(bits(first), bits(second));
}

/// Within a time all go by the clock of the first.
#[test]
fn processes_that_bake_within_a_time_agree() {
    let of_all = in_processes(2, |_| {
        let target = BakeTarget::seconds(1.0).unwrap();
        target.bake(cornell_box(), &Backend::Cpu, go).unwrap()
    });
    assert_eq!(bits(&of_all[0]), bits(&of_all[1]));
}
