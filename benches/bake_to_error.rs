//! Whole bakes to three errors of three scenes: the Cornell box, a room that is lit from the next one,
//! and one full of small boxes. The device is opened, and pipelines are warm, before anything is
//! timed. Prints the adapter, and the estimated errors.

use std::ops::ControlFlow;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use glam::DVec3;
use radiosity::{AdapterInfo, Backend, BakeTarget, Material, Rgb, Scene, Triangle, load_obj};

/// A box of walls: seen from inside, or from outside. `material` says what each of the six is of.
fn block(
    low: DVec3,
    high: DVec3,
    inside: bool,
    material: impl Fn(usize) -> u32,
) -> Vec<(Quad, u32)> {
    let corner = |k: usize| {
        let pick = |bit: usize, axis: usize| if k >> bit & 1 == 0 { low[axis] } else { high[axis] };
        DVec3::new(pick(0, 0), pick(1, 1), pick(2, 2))
    };
    // Counter-clockwise from outside: x0, x1, y0, y1, z0, z1.
    let walls: [[usize; 4]; 6] =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let quad = |k: usize| {
        let [a, b, c, d] = walls[k].map(corner);
        (if inside { [a, d, c, b] } else { [a, b, c, d] }, material(k))
    };
    (0..6).map(quad).collect()
}

type Quad = [DVec3; 4];

/// Grey, white, and a lamp.
fn scene(quads: &[(Quad, u32)]) -> Scene {
    let corners = |k: u32| [[0, 1, 2], [0, 2, 3]].map(|t| t.map(|c| 4 * k + c));
    let triangles = (0u32..).zip(quads).flat_map(|(k, &(_, material))| {
        corners(k).map(|corners| Triangle { corners, group: k, material, smoothing: None })
    });
    let names = (0..quads.len()).map(|k| format!("q{k}")).collect();
    let lamp = Material { exitance: Rgb::splat(100.0), ..Material::grey("lamp", 0.0) };
    let materials = vec![Material::grey("grey", 0.4), Material::grey("white", 0.75), lamp];
    let positions = quads.iter().flat_map(|q| q.0).collect();
    Scene::new(positions, triangles.collect(), names, materials).expect("a good scene")
}

fn next_door() -> Scene {
    let v = DVec3::new;
    let mut quads = block(v(0., 0., 0.), v(8., 4., 2.5), true, |k| u32::from(k > 3));
    // A wall with a gap, and a lamp behind it.
    quads.extend(block(v(3.9, 0.0, 0.0), v(4.0, 3.0, 2.5), false, |_| 1));
    quads.extend(block(v(1.0, 1.0, 2.3), v(1.6, 1.6, 2.35), false, |k| if k == 4 { 2 } else { 0 }));
    scene(&quads)
}

fn clutter() -> Scene {
    let v = DVec3::new;
    let mut quads = block(v(0., 0., 0.), v(5., 4., 2.5), true, |_| 1);
    quads.extend(block(v(2.0, 1.7, 2.4), v(3.0, 2.3, 2.45), false, |k| if k == 4 { 2 } else { 0 }));
    for k in 0..60 {
        let (x, y) = (0.3 + 0.45 * f64::from(k % 10), 0.4 + 0.55 * f64::from(k / 10));
        let size = 0.05 + 0.02 * f64::from(k * 7 % 11);
        let low = v(x, y, 0.02 + 0.1 * f64::from(k * 5 % 7));
        quads.extend(block(low, low + v(size, size, 0.5 * size), false, |_| 0));
    }
    scene(&quads)
}

fn bake_to_error(c: &mut Criterion) {
    let cornell = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj");
    let device = Backend::gpu(None).expect("a graphics adapter");
    let AdapterInfo { name, kind, driver } = device.adapter();
    eprintln!("adapter: {name} ({kind}), {driver}");
    let mut group = c.benchmark_group("bake_to_error");
    for (name, scene) in [
        ("cornell_box", load_obj(cornell).expect("the scene")),
        ("next_door", next_door()),
        ("clutter", clutter()),
    ] {
        for error in [0.05, 0.02, 0.01] {
            let bake = || {
                BakeTarget::Error(error)
                    .bake(scene.clone(), &device, |_| ControlFlow::Continue(()))
                    .expect("a solution")
            };
            let mut printed = false;
            group.bench_function(BenchmarkId::new(name, error), |b| {
                let mut last = None;
                b.iter(|| last = Some(bake()));
                if let Some(baked) = last.filter(|_| !std::mem::replace(&mut printed, true)) {
                    eprintln!(
                        "{name}, asked {error}: estimated {:.4}, {} vertices, {} hemicubes, {} gathers",
                        baked.estimate.total,
                        baked.light.surface.positions.len(),
                        baked.hemicubes,
                        baked.light.gather_count
                    );
                }
            });
        }
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(1))
        .measurement_time(Duration::from_secs(2));
    targets = bake_to_error
}
criterion_main!(benches);
