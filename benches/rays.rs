//! Rays on the CPU: those of rows and of gathers, many from one point, and those of a picture, one
//! by one. No GPU is used.
//!
//! On the Cornell box, and on the same with each of its 32 triangles cut into 256. Throughput is in
//! rays, over all threads: `RAYON_NUM_THREADS=1` tells that of one.

mod common;

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use radiosity::backend::cpu::{RayGather, RayRows};
use radiosity::gather::{GatherPoint, RadiosityField};
use radiosity::mesh::NodeId;
use radiosity::{Camera, FormFactors, Gather, Mesh, Rgb, Scene, VertexMesh};

/// Rays of a row and of a gather, and how many of each an iteration makes.
const ROW_RAYS: u32 = 1024;
const ROWS: usize = 16;
const GATHER_RAYS: u32 = 64;
const POINTS: usize = 256;

/// Pixels along the sides of the picture, one ray each.
const PIXELS: u32 = 128;

fn rays(c: &mut Criterion) {
    let mut cut = common::cornell_box();
    (0..4).for_each(|_| cut = common::scenes::cut_into_four(&cut));
    for scene in [common::cornell_box(), cut] {
        measure(c, scene);
    }
}

fn measure(c: &mut Criterion, scene: Scene) {
    let triangles = scene.triangles().len();
    let mesh = Mesh::new(scene, f64::INFINITY).expect("a mesh");
    let elements = mesh.element_count();
    let some = |k: usize| mesh.element(k * 7919 % elements);
    let mut group = c.benchmark_group("cornell_box/rays");

    let mut rows = RayRows::new(&mesh, ROW_RAYS).expect("rows");
    let patches: Vec<NodeId> = (0..ROWS).map(some).collect();
    group.throughput(Throughput::Elements(u64::from(ROW_RAYS) * ROWS as u64));
    group.bench_function(BenchmarkId::new("rows", triangles), |b| {
        b.iter(|| black_box(rows.rows(&mesh, &patches, 1.0)));
    });

    let mut gather = RayGather::new(&mesh, GATHER_RAYS).expect("a gather");
    let corners = vec![[0; 3]; elements];
    let field = RadiosityField { mesh: &mesh, corners: &corners, reflected: &[Rgb::ONE] };
    let points: Vec<GatherPoint> = (0..POINTS)
        .map(|k| {
            let node = some(k);
            let (normal, near) = (mesh.normal(node), 1e-3 * mesh.area(node).sqrt());
            let position = mesh.corners(node).iter().sum::<DVec3>() / 3.0 + near * normal;
            GatherPoint { position, normal, near }
        })
        .collect();
    group.throughput(Throughput::Elements(u64::from(GATHER_RAYS) * POINTS as u64));
    group.bench_function(BenchmarkId::new("gather", triangles), |b| {
        b.iter(|| black_box(gather.gather(&field, &points)));
    });

    let surface = VertexMesh::new(&mesh, &vec![Rgb::ONE; elements]);
    let (eye, target) = (DVec3::new(278.0, 273.0, -800.0), DVec3::new(278.0, 273.0, 280.0));
    let camera = Camera { eye, target, up: DVec3::Y, vertical_fov: 40.0 };
    group.throughput(Throughput::Elements(u64::from(PIXELS * PIXELS)));
    group.bench_function(BenchmarkId::new("picture", triangles), |b| {
        b.iter(|| black_box(camera.image(&surface, PIXELS, PIXELS, 1)));
    });
    group.finish();
}

criterion_group! { name = benches; config = common::criterion(); targets = rays }
criterion_main!(benches);
