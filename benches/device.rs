//! What a graphics device does beside the CPU: rays of gathers, and rows of form factors by each of
//! their makers. The tables of `docs/data` are made of what it prints.
//!
//!     cargo bench --bench device [-- SCENE.obj …]
//!
//! Without scenes it builds rooms of 32, 4 000 and 128 000 triangles itself, so that the binary
//! runs on a machine without the checkout. The reflected radiosity is made up: 1 to 2 W/m², by
//! position. Points are spread over the surfaces by area. Each figure is the best of three.

use std::sync::Arc;
use std::time::Instant;

use glam::DVec3;
use radiosity::backend::cpu::{RayGather, RayRows};
use radiosity::backend::gpu::{HemicubeRows, TracedGather, TracedRows};
use radiosity::gather::{GatherPoint, IrradianceSample, RadiosityField};
use radiosity::mesh::NodeId;
use radiosity::{
    Error, FormFactors, Gather, Gpu, Material, Mesh, Rgb, Scene, Triangle, load_scene,
};

/// Rays of a point over the hemisphere.
const RAYS: u32 = 256;

/// Points on the device, and on the CPU, which takes longer for each.
const POINTS: [usize; 2] = [200_000, 4_000];

/// Points on a software device.
const FEW_POINTS: usize = 2_000;

/// Seconds that the rows of one maker may take, about.
const ROW_SECONDS: f64 = 0.5;

fn main() -> Result<(), Error> {
    let arguments = std::env::args().skip(1).filter(|argument| !argument.starts_with("--"));
    let paths: Vec<String> = arguments.collect();
    let gpu = Gpu::new(None)?;
    let adapter = gpu.adapter();
    println!("adapter\t{}\t{}\t{}", adapter.name, adapter.kind, adapter.driver);
    println!("threads\t{}", std::thread::available_parallelism().map_or(1, std::num::NonZero::get));
    let scenes: Vec<(String, Arc<Scene>)> = match paths.is_empty() {
        true => [32, 4_000, 128_000].map(|n| (format!("room of {n}"), room(n).into())).into(),
        false => paths
            .into_iter()
            .map(|path| load_scene(&path).map(|scene| (path, scene.into())))
            .collect::<Result<_, Error>>()?,
    };
    println!("scene\ttriangles\twhat\tmaker\tsetting\ta second\tnote");
    for (name, scene) in scenes {
        let bench = Bench { gpu: &gpu, name, scene };
        bench.gathers()?;
        bench.rows()?;
    }
    Ok(())
}

struct Bench<'a> {
    gpu: &'a Gpu,
    name: String,
    scene: Arc<Scene>,
}

impl Bench<'_> {
    fn print(&self, what: &str, maker: &str, setting: &str, rate: f64, note: &str) {
        let Bench { name, scene, .. } = self;
        let count = scene.triangles().len();
        println!("{name}\t{count}\t{what}\t{maker}\t{setting}\t{rate:.4e}\t{note}");
    }

    /// Rays a second of gathers, those to lights included on the device.
    fn gathers(&self) -> Result<(), Error> {
        let mesh = Mesh::new(self.scene.clone(), f64::INFINITY)?;
        let elements = mesh.element_count();
        let corners: Vec<[u32; 3]> =
            (0..elements as u32).map(|e| [3 * e, 3 * e + 1, 3 * e + 2]).collect();
        let (low, size) = (self.scene.bounds().low, self.scene.bounds().longest_side());
        let value = |p: DVec3| Rgb::ONE + (p - low) / size;
        let reflected: Vec<Rgb> =
            (0..elements).flat_map(|e| mesh.corners(mesh.element(e)).map(value)).collect();
        let field = RadiosityField { mesh: &mesh, corners: &corners, reflected: &reflected };
        let is_hardware = self.gpu.adapter().kind != radiosity::backend::AdapterKind::Cpu;
        let [many, few] = POINTS;
        let points = points(&self.scene, if is_hardware { many } else { FEW_POINTS });
        let setting = format!("{RAYS} rays");
        let mut by_rays = RayGather::new(&mesh, RAYS)?;
        let few = &points[..few.min(points.len())];
        let (seconds, expected) = best(|| by_rays.gather(&field, few))?;
        let rate = f64::from(RAYS) * few.len() as f64 / seconds;
        self.print("gather", "rays on the CPU", &setting, rate, "");
        let mut by_device = TracedGather::new(self.gpu, &mesh, RAYS)?;
        let start = Instant::now();
        by_device.gather(&field, &few[..1])?;
        println!("# first gather: {:.3} s", start.elapsed().as_secs_f64());
        let before = by_device.rays();
        let (seconds, found) = best(|| by_device.gather(&field, &points))?;
        let rays = (by_device.rays() - before) as f64 / REPEATS as f64;
        let note = agreement(&expected, &found);
        self.print("gather", "rays on the device", &setting, rays / seconds, &note);
        Ok(())
    }

    /// Rows a second.
    fn rows(&self) -> Result<(), Error> {
        let bounds = self.scene.bounds();
        let mesh = Mesh::new(self.scene.clone(), bounds.longest_side() / 16.0)?;
        for resolution in [64, 128, 256] {
            let mut hemicubes = HemicubeRows::new(self.gpu, &mesh, resolution)?;
            let rate = rows_a_second(&mut hemicubes, &mesh)?;
            let elements = format!("{} elements", mesh.element_count());
            self.print("rows", "hemicubes", &format!("{resolution} pixels"), rate, &elements);
            let mut rays = TracedRows::new(self.gpu, &mesh, resolution * resolution)?;
            let rate = rows_a_second(&mut rays, &mesh)?;
            let setting = format!("{resolution}² rays");
            self.print("rows", "rays on the device", &setting, rate, &elements);
            let mut rays = RayRows::new(&mesh, resolution * resolution)?;
            let rate = rows_a_second(&mut rays, &mesh)?;
            let setting = format!("{resolution}² rays");
            self.print("rows", "rays on the CPU", &setting, rate, &elements);
        }
        Ok(())
    }
}

/// Times that each gather runs.
const REPEATS: usize = 3;

/// The shortest time that `work` takes, s, and what it makes.
fn best<T>(mut work: impl FnMut() -> Result<T, Error>) -> Result<(f64, T), Error> {
    let mut timed = || {
        let start = Instant::now();
        work().map(|result| (start.elapsed().as_secs_f64(), result))
    };
    let mut best = timed()?;
    for _ in 1..REPEATS {
        let next = timed()?;
        best = if next.0 < best.0 { next } else { best };
    }
    Ok(best)
}

/// How far apart two gathers of the same points are, and the mean of the first.
fn agreement(expected: &[IrradianceSample], found: &[IrradianceSample]) -> String {
    let mean = expected.iter().map(|s| s.irradiance.length()).sum::<f64>() / expected.len() as f64;
    let mut apart: Vec<f64> = expected
        .iter()
        .zip(found)
        .map(|(a, b)| a.irradiance.distance(b.irradiance) / mean)
        .collect();
    apart.sort_by(f64::total_cmp);
    let at = |share: f64| apart[((apart.len() - 1) as f64 * share) as usize];
    let sum = |s: &[IrradianceSample]| s.iter().map(|s| s.irradiance.length()).sum::<f64>();
    let bias = sum(&found[..expected.len()]) / sum(expected) - 1.0;
    format!(
        "apart by {:.1e} (median), {:.1e} (99 %), {:.1e} (maximum), {bias:.1e} (all)",
        at(0.5),
        at(0.99),
        at(1.0)
    )
}

fn rows_a_second(rows: &mut dyn FormFactors, mesh: &Mesh) -> Result<f64, Error> {
    let batch = rows.preferred_batch_len();
    let patch = |k: usize| mesh.element(k * 7919 % mesh.element_count());
    let mut made = 0;
    let patches: Vec<NodeId> = (0..batch).map(patch).collect();
    rows.rows(mesh, &patches, 1.0)?;
    let start = Instant::now();
    while start.elapsed().as_secs_f64() < ROW_SECONDS {
        let patches: Vec<NodeId> = (made..made + batch).map(patch).collect();
        rows.rows(mesh, &patches, 1.0)?;
        made += batch;
    }
    Ok(made as f64 / start.elapsed().as_secs_f64())
}

/// Points a little above surfaces, spread over them by area.
fn points(scene: &Scene, count: usize) -> Vec<GatherPoint> {
    let mut cumulative = vec![];
    let mut sum = 0.0;
    for t in 0..scene.triangles().len() {
        sum += scene.area(t);
        cumulative.push(sum);
    }
    (0..count)
        .map(|k| {
            let at = (k as f64 + 0.5) / count as f64 * sum;
            let t = cumulative.partition_point(|&end| end < at).min(cumulative.len() - 1);
            let [a, b, c] = scene.corners(t);
            let [mut u, mut v] =
                [0.754_877_666, 0.569_840_291].map(|step| (k as f64 * step).fract());
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            let lift = 1e-4 * scene.bounds().longest_side();
            let normal = scene.normal(t);
            let position = a + u * (b - a) + v * (c - a) + lift * normal;
            GatherPoint { position, normal, near: lift / 4.0 }
        })
        .collect()
}

/// A room with a lamp and boxes on its floor, of about so many triangles.
fn room(triangles: usize) -> Scene {
    let boxes = triangles.saturating_sub(14).div_ceil(12).max(1);
    let side = (boxes as f64).sqrt().ceil();
    let (mut positions, mut list) = (vec![], vec![]);
    let mut add = |low: DVec3, high: DVec3, inward: bool, material: u32| {
        let first = positions.len() as u32;
        for k in 0..8 {
            let pick = |bit: u32, low: f64, high: f64| if k >> bit & 1 == 0 { low } else { high };
            positions.push(DVec3::new(
                pick(0, low.x, high.x),
                pick(1, low.y, high.y),
                pick(2, low.z, high.z),
            ));
        }
        for [a, b, c, d] in
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
        {
            for corners in [[a, b, c], [a, c, d]] {
                let [a, b, c] = corners.map(|k: u32| first + k);
                let corners = if inward { [a, c, b] } else { [a, b, c] };
                list.push(Triangle { corners, material, ..Default::default() });
            }
        }
    };
    add(DVec3::ZERO, DVec3::new(1.0, 1.0, 0.6), true, 0);
    for k in 0..boxes {
        let cell = DVec3::new((k as f64 / side).fract() * side, (k as f64 / side).floor(), 0.0);
        let random =
            |n: usize| (k as f64 * [0.754_877_666, 0.569_840_291, 0.324_717_957][n]).fract();
        let low = (cell + DVec3::new(0.2 * random(0), 0.2 * random(1), 0.0)) / side;
        let size = DVec3::new(0.3 + 0.4 * random(1), 0.3 + 0.4 * random(2), 0.0) / side;
        let top = low + size + DVec3::Z * (0.02 + 0.3 * random(0) * random(2));
        add(low + 1e-3 / side * DVec3::Z, top, false, 0);
    }
    let first = positions.len() as u32;
    positions.extend(
        [[0.4, 0.4], [0.6, 0.4], [0.6, 0.6], [0.4, 0.6]].map(|[x, y]| DVec3::new(x, y, 0.599)),
    );
    for corners in [[0, 2, 1], [0, 3, 2]] {
        let corners = corners.map(|k| first + k);
        list.push(Triangle { corners, material: 1, ..Default::default() });
    }
    let lamp = Material { exitance: Rgb::splat(20.0), ..Material::grey("lamp", 0.0) };
    let materials = vec![Material::grey("wall", 0.5), lamp];
    Scene::new(positions, list, vec!["room".into()], materials).expect("a room")
}
