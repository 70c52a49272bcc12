//! Shooting on stored rows: the arithmetic of the solver alone. No GPU is used; rows of the Cornell
//! box are cast as rays once, before anything is timed.
//!
//! Throughput is in shots. Every iteration is a whole solve from the emitted light to 0.1 %
//! unshot; what it asks for is handed out of memory.

mod common;

use std::collections::HashMap;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use radiosity::backend::cpu::RayRows;
use radiosity::form_factor::Row;
use radiosity::mesh::NodeId;
use radiosity::{Error, FormFactors, Mesh, Solver, VertexMesh};

/// Hands out rows that were made before.
struct Stored<'a>(&'a HashMap<NodeId, Row>);

impl FormFactors for Stored<'_> {
    fn rows(&mut self, _: &Mesh, patches: &[NodeId], _: f64) -> Result<Vec<Row>, Error> {
        Ok(patches.iter().map(|p| self.0[p].clone()).collect())
    }

    fn preferred_batch_len(&self) -> usize {
        16
    }
}

/// Makes rows and remembers them.
struct Recording(RayRows, HashMap<NodeId, Row>);

impl FormFactors for Recording {
    fn rows(&mut self, mesh: &Mesh, patches: &[NodeId], weight: f64) -> Result<Vec<Row>, Error> {
        let rows = self.0.rows(mesh, patches, weight)?;
        self.1.extend(patches.iter().copied().zip(rows.iter().cloned()));
        Ok(rows)
    }

    fn preferred_batch_len(&self) -> usize {
        16
    }
}

fn shooting(c: &mut Criterion) {
    let scene = common::cornell_box();
    let mut group = c.benchmark_group("cornell_box");
    for size in [120.0, 60.0] {
        let mesh = Mesh::new(scene.clone(), size).expect("a mesh");
        let rays = RayRows::new(&mesh, 1 << 14).expect("rays");
        let mut recording = Recording(rays, HashMap::new());
        let solution =
            Solver::default().solve(&mesh, &mut recording, common::keep_going).expect("a solution");
        let elements = mesh.element_count();
        group.throughput(Throughput::Elements(solution.shots));
        group.bench_function(BenchmarkId::new("shoot to 0.1 %", elements), |b| {
            b.iter(|| {
                Solver::default().solve(&mesh, &mut Stored(&recording.1), common::keep_going)
            });
        });
        group.throughput(Throughput::Elements(elements as u64));
        group.bench_function(BenchmarkId::new("elements to vertices", elements), |b| {
            b.iter(|| VertexMesh::new(&mesh, &solution.radiosity));
        });
    }
    group.finish();
}

criterion_group! { name = benches; config = common::criterion(); targets = shooting }
criterion_main!(benches);
