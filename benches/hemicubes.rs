//! Stages of making form-factor rows with hemicubes: draw, reduce, read back; over resolution and
//! elements, on the Cornell box. The adapter's name is printed first.
//!
//! Criterion's own figure, `all`, is wall time from asking to rows. `draw` and `reduce` are the
//! device's timestamps of the very same hemicubes, and `readback` the rest. Throughput is in
//! hemicubes. Every iteration draws a full batch of other patches; nothing is kept.
//!
//! By default elements of 30 mm and 64 to 256 pixels, some 20 s on two cores with lavapipe. In full
//! also elements of 60 and 15 mm and 512 pixels, some three minutes:
//!
//!     RADIOSITY_BENCH=full cargo bench --bench hemicubes

mod common;

use std::time::{Duration, Instant};

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use radiosity::backend::gpu::HemicubeRows;
use radiosity::bake::Timings;
use radiosity::mesh::NodeId;
use radiosity::{FormFactors, Gpu, Mesh};

fn stages(c: &mut Criterion) {
    let gpu = common::gpu();
    let (sizes, resolutions): (&[f64], &[u32]) = if common::full() {
        (&[60.0, 30.0, 15.0], &[64, 128, 256, 512])
    } else {
        (&[30.0], &[64, 128, 256])
    };
    for &size in sizes {
        let mesh = Mesh::new(common::cornell_box(), size).expect("a mesh");
        for &resolution in resolutions {
            measure(c, &gpu, &mesh, resolution);
        }
    }
}

fn measure(c: &mut Criterion, gpu: &Gpu, mesh: &Mesh, resolution: u32) {
    let mut hemicubes = HemicubeRows::new(gpu, mesh, resolution).expect("hemicubes");
    let batch = hemicubes.preferred_batch_len();
    let mut group = c.benchmark_group(format!("cornell_box/{} elements", mesh.element_count()));
    group.throughput(Throughput::Elements(batch as u64));
    let mut next = 0;
    let mut draw_batch = |hemicubes: &mut HemicubeRows| {
        let patches: Vec<NodeId> =
            (next..next + batch).map(|k| mesh.element(k * 7919 % mesh.element_count())).collect();
        next += batch;
        let (before, start) = (hemicubes.timings(), Instant::now());
        hemicubes.rows(mesh, &patches, 1.0).expect("rows");
        (start.elapsed(), before, hemicubes.timings())
    };
    type Part = fn(&Timings) -> f64;
    let parts: [(&str, Option<Part>); 4] = [
        ("all", None),
        ("draw", Some(|s| s.draw)),
        ("reduce", Some(|s| s.reduce)),
        ("readback", Some(|s| s.readback)),
    ];
    for (name, part) in parts {
        group.bench_function(BenchmarkId::new(name, format!("{resolution} px")), |b| {
            b.iter_custom(|iterations| {
                (0..iterations)
                    .map(|_| {
                        let (wall, before, after) = draw_batch(&mut hemicubes);
                        part.map_or(wall, |of| {
                            // A stage below the clock's tick still took some time.
                            Duration::from_secs_f64((of(&after) - of(&before)).max(1e-9))
                        })
                    })
                    .sum()
            });
        });
    }
    group.finish();
}

criterion_group! { name = benches; config = common::criterion(); targets = stages }
criterion_main!(benches);
