//! Whole bakes to an error, from scene to error estimate. The device is opened, and pipelines are
//! warm, before anything is timed. Prints the adapter and, for each bake, the error it came to.
//!
//! By default the Cornell box to 5 % and 2 %, some 40 s on two cores with lavapipe. In full also to
//! 1 %, and a room that is lit from the next one and one full of small boxes, over ten minutes:
//!
//!     RADIOSITY_BENCH=full cargo bench --bench bake_to_error

mod common;

use std::sync::Arc;

use common::scenes::{Quad, block, paint, quads, walls};
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use radiosity::{Backend, BakeResult, BakeTarget, Material, Scene};

/// Exitance of lamps, W/m².
const LAMP: f64 = 100.0;

const GREY: f64 = 0.4;
const WHITE: f64 = 0.75;

/// Quadrilaterals of one reflectance.
fn painted(faces: impl IntoIterator<Item = Quad>, reflectance: f64) -> Vec<(Quad, Material)> {
    faces.into_iter().map(|face| (face, paint(reflectance, 0.0))).collect()
}

/// A grey block whose bottom is a lamp.
fn hanging_lamp(low: [f64; 3], high: [f64; 3]) -> Vec<(Quad, Material)> {
    let mut faces = painted(block(low, high), GREY);
    faces[4].1 = paint(0.0, LAMP);
    faces
}

/// A room of 8 m × 4 m parted by a wall with a gap, and a lamp in one half.
fn next_door() -> Scene {
    let mut all = painted(walls([0.0; 3], [8.0, 4.0, 2.5]), GREY);
    all.extend(painted(block([3.9, 0.0, 0.0], [4.0, 3.0, 2.5]), WHITE));
    all.extend(hanging_lamp([1.0, 1.0, 2.3], [1.6, 1.6, 2.35]));
    quads(&all)
}

/// A room of 5 m × 4 m with 60 boxes of 5 to 25 cm in the air.
fn clutter() -> Scene {
    let mut all = painted(walls([0.0; 3], [5.0, 4.0, 2.5]), WHITE);
    all.extend(hanging_lamp([2.0, 1.7, 2.4], [3.0, 2.3, 2.45]));
    for k in 0..60 {
        let (x, y) = (0.3 + 0.45 * f64::from(k % 10), 0.4 + 0.55 * f64::from(k / 10));
        let size = 0.05 + 0.02 * f64::from(k * 7 % 11);
        let z = 0.02 + 0.1 * f64::from(k * 5 % 7);
        all.extend(painted(block([x, y, z], [x + size, y + size, z + 0.5 * size]), GREY));
    }
    quads(&all)
}

fn bakes(c: &mut Criterion) {
    let backend = Backend::Gpu(common::gpu());
    let mut scenes = vec![("cornell_box", common::cornell_box())];
    let mut errors = vec![0.05, 0.02];
    if common::full() {
        scenes.extend([("next_door", next_door()), ("clutter", clutter())]);
        errors.push(0.01);
    }
    let mut group = c.benchmark_group("bake_to_error");
    for (name, scene) in scenes {
        let scene = Arc::new(scene);
        for &error in &errors {
            let bake = || {
                let target = BakeTarget::Error(error);
                target.bake(scene.clone(), &backend, common::keep_going).expect("a solution")
            };
            let mut last = None;
            group.bench_function(BenchmarkId::new(name, error), |b| b.iter(|| last = Some(bake())));
            if let Some(baked) = last {
                report(name, error, &baked);
            }
        }
    }
    group.finish();
}

fn report(name: &str, error: f64, baked: &BakeResult) {
    eprintln!(
        "{name}, asked for {error}: estimated {:.4}, {} vertices, {} hemicubes, {} gathers",
        baked.estimate.total,
        baked.light.surface.positions.len(),
        baked.hemicubes,
        baked.light.gather_count
    );
}

criterion_group! { name = benches; config = common::criterion(); targets = bakes }
criterion_main!(benches);
