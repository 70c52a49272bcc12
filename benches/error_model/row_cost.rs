//! Seconds of a row, by a hemicube and by rays, fitted to the cost by which bakes choose between
//! the two (`radiosity::backend::cost`), and the triangles from which on rays are chosen.
//!
//! Each scene is measured as it is and with all triangles cut into four, again and again. A row
//! takes the least of several batches: other work on the machine only adds. The fits are by least
//! squares of relative errors, so that short rows count as much as long ones.

use std::sync::Arc;
use std::time::Instant;

use radiosity::backend::RowMaker;
use radiosity::backend::cost::{self, RowCost};
use radiosity::backend::cpu::RayRows;
use radiosity::backend::gpu::{HemicubeRows, TracedRows};
use radiosity::form_factor::Row;
use radiosity::mesh::NodeId;
use radiosity::{BakeSettings, Error, FormFactors, Gpu, Mesh, Scene};

use crate::common::scenes::cut_into_four;

const RESOLUTIONS: [u32; 5] = [16, 32, 64, 128, 256];

/// Scenes are not cut to more triangles than this.
const MAX_TRIANGLES: usize = 150_000;

/// Rows in a batch, and batches that are timed.
const BATCH: usize = 16;
const BATCHES: usize = 8;

/// Error of a bake in whose elements rows are compared.
const ERROR: f64 = 0.1;

/// Rays of the rows that others are compared with.
const TRUTH_RAYS: u32 = 1 << 20;

/// Seconds of one row, three ways.
struct Sample {
    triangles: usize,
    resolution: u32,
    hemicube: f64,
    on_device: f64,
    rays: f64,
}

/// Measures rows over `scenes` and prints each constant beside that of the model.
pub fn measure(gpu: &Gpu, scenes: &[Arc<Scene>]) -> Result<(), Error> {
    let mut samples = vec![];
    println!(
        "{:>9} {:>6} {:>12} {:>12} {:>12}   seconds a row",
        "triangles", "pixels", "hemicube", "rays, device", "rays"
    );
    for scene in scenes {
        let mut scene = Scene::clone(scene);
        loop {
            for sample in over_resolutions(gpu, &scene)? {
                let Sample { triangles, resolution, hemicube, on_device, rays } = sample;
                let seconds = format!("{hemicube:12.2e} {on_device:12.2e} {rays:12.2e}");
                println!("{triangles:9} {resolution:6} {seconds}");
                samples.push(sample);
            }
            if 4 * scene.triangles().len() > MAX_TRIANGLES {
                break;
            }
            scene = cut_into_four(&scene);
        }
    }
    let model = RowCost::of(gpu.adapter().kind);
    let fitted = fit(&samples);
    println!("{:25} {:>10} {:>10}", "seconds", "fitted", "model");
    for (name, of) in PARTS {
        println!("{name:25} {:>10.1e} {:>10.1e}", of(&fitted), of(&model));
    }
    for scene in scenes {
        rays_at_equal_error(gpu, scene)?;
    }
    println!("{:25} {:>10} {:>10}", "rays from triangles on", "fitted", "model");
    for resolution in RESOLUTIONS {
        let [fitted, model] = [fitted, model].map(|cost| crossing(&cost, resolution));
        println!("{:25} {fitted:>10} {model:>10}", format!("{resolution} pixels"));
    }
    Ok(())
}

type Part = (&'static str, fn(&RowCost) -> f64);

const PARTS: [Part; 6] = [
    ("hemicube", |cost| cost.hemicube),
    ("triangle", |cost| cost.triangle),
    ("pixel", |cost| cost.pixel),
    ("row of rays, device", |cost| cost.device_row),
    ("ray, a level, device", |cost| cost.device_ray_level),
    ("ray, a level", |cost| cost.ray_level),
];

fn over_resolutions(gpu: &Gpu, scene: &Scene) -> Result<Vec<Sample>, Error> {
    let mesh = Mesh::new(scene.clone(), f64::INFINITY)?;
    let triangles = scene.triangles().len();
    let mut samples = vec![];
    for resolution in RESOLUTIONS {
        let hemicube = seconds(&mut HemicubeRows::new(gpu, &mesh, resolution)?, &mesh)?;
        let rays = seconds(&mut RayRows::new(&mesh, resolution.pow(2))?, &mesh)?;
        let on_device = seconds(&mut TracedRows::new(gpu, &mesh, resolution.pow(2))?, &mesh)?;
        samples.push(Sample { triangles, resolution, hemicube, on_device, rays });
    }
    Ok(samples)
}

/// Seconds of a row, in batches of other patches each.
fn seconds(rows: &mut dyn FormFactors, mesh: &Mesh) -> Result<f64, Error> {
    let mut least = f64::INFINITY;
    for batch in 0..BATCHES {
        let patches = patches(mesh, batch * BATCH, BATCH);
        let start = Instant::now();
        rows.rows(mesh, &patches, 1.0)?;
        least = least.min(start.elapsed().as_secs_f64() / BATCH as f64);
    }
    Ok(least)
}

/// Elements spread over `mesh`.
fn patches(mesh: &Mesh, first: usize, count: usize) -> Vec<NodeId> {
    let of = |k: usize| mesh.element(k * 7919 % mesh.element_count());
    (first..first + count).map(of).collect()
}

fn fit(samples: &[Sample]) -> RowCost {
    let hemicubes = samples.iter().map(|s| {
        let pixels = 3.0 * f64::from(s.resolution).powi(2);
        ([1.0, s.triangles as f64, pixels], s.hemicube)
    });
    let [hemicube, triangle, pixel] = least_squares(hemicubes);
    let rays = samples.iter().map(|s| {
        let rays = f64::from(s.resolution).powi(2);
        ([rays * cost::tree_levels(s.triangles)], s.rays)
    });
    let [ray_level] = least_squares(rays);
    let on_device = samples.iter().map(|s| {
        let levels = cost::tree_levels(s.triangles.max(cost::MIN_DEVICE_TRIANGLES));
        ([1.0, f64::from(s.resolution).powi(2) * levels], s.on_device)
    });
    let [device_row, device_ray_level] = least_squares(on_device);
    RowCost { hemicube, triangle, pixel, device_row, device_ray_level, ray_level }
}

/// x for the least Σ (row·x / value − 1)², by the normal equations.
fn least_squares<const N: usize>(equations: impl Iterator<Item = ([f64; N], f64)>) -> [f64; N] {
    let (mut matrix, mut right) = ([[0.0; N]; N], [0.0; N]);
    for (row, value) in equations {
        let row = row.map(|x| x / value);
        for i in 0..N {
            right[i] += row[i];
            (0..N).for_each(|j| matrix[i][j] += row[i] * row[j]);
        }
    }
    // Gauss and Jordan; the matrix is positive definite, and needs no pivots.
    for k in 0..N {
        let (pivot, value) = (matrix[k], right[k]);
        for i in (0..N).filter(|&i| i != k) {
            let factor = matrix[i][k] / pivot[k];
            (0..N).for_each(|j| matrix[i][j] -= factor * pivot[j]);
            right[i] -= factor * value;
        }
    }
    std::array::from_fn(|k| right[k] / matrix[k][k])
}

/// Prints how many rays a row takes to err as a hemicube does, over the square of its resolution.
fn rays_at_equal_error(gpu: &Gpu, scene: &Arc<Scene>) -> Result<(), Error> {
    let size = BakeSettings::for_error(ERROR, scene).solve.element_size;
    let mesh = Mesh::new(scene.clone(), size)?;
    let patches = patches(&mesh, 0, 4 * BATCH);
    let truth = RayRows::new(&mesh, TRUTH_RAYS)?.rows(&mesh, &patches, 1.0)?;
    let error = |rows: &mut dyn FormFactors| -> Result<f64, Error> {
        let rows = rows.rows(&mesh, &patches, 1.0)?;
        Ok(rows.iter().zip(&truth).map(|(row, truth)| square(&mesh, row, truth)).sum::<f64>())
    };
    let mut measured = vec![];
    for resolution in &RESOLUTIONS[..4] {
        let drawn = error(&mut HemicubeRows::new(gpu, &mesh, *resolution)?)?;
        let rays = resolution.pow(2);
        let once = error(&mut RayRows::new(&mesh, rays)?)?;
        let fourfold = error(&mut RayRows::new(&mesh, 4 * rays)?)?;
        // The error of rays is a power of their number between the two.
        let factor = 4f64.powf((once / drawn).ln() / (once / fourfold).ln());
        measured.push(format!("{resolution} px: {factor:.2}"));
    }
    let model = cost::RAYS_AT_EQUAL_ERROR;
    println!("{:25} {:>10} {model:>10.2}   {}", "rays at equal error", "", measured.join("  "));
    Ok(())
}

/// Squared difference of the radiosity that two rows bring, over the area.
fn square(mesh: &Mesh, row: &Row, truth: &Row) -> f64 {
    let mut shares = vec![0.0; mesh.element_count()];
    for entry in &row.entries {
        shares[entry.element as usize] += f64::from(entry.share);
    }
    for entry in &truth.entries {
        shares[entry.element as usize] -= f64::from(entry.share);
    }
    let of = |(e, share): (usize, &f64)| {
        (share / f64::from(Row::TOTAL)).powi(2) / mesh.area(mesh.element(e))
    };
    shares.iter().enumerate().map(of).sum()
}

/// The triangles from which on a row of `resolution` is left to rays, within 2 %.
fn crossing(cost: &RowCost, resolution: u32) -> usize {
    let mut counts = (0..1000).map(|k| 1.02f64.powi(k) as usize);
    let makers = [RowMaker::Hemicubes, RowMaker::Rays];
    let is_drawn = |&t: &usize| cost.cheapest(makers, t, resolution) == Some(RowMaker::Hemicubes);
    counts.rfind(is_drawn).map_or(0, |last| last + 1)
}
