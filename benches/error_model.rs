//! Measures the model of error and cost that controls bakes (`src/bake/model.rs`), and prints each
//! law beside the model's number.
//!
//!     RADIOSITY_BENCH=full cargo bench --bench error_model [-- SCENE.obj …]
//!
//! In full only. Without scenes it takes scenes/cornell_box.obj. Rays on the CPU, so that it runs
//! anywhere.
//!
//! - One setting at a time is varied around those for an error of 5 %, and the part of the
//!   estimated error that follows it is fitted: part = scale · setting^exponent.
//! - The scene is baked to several errors, and the settings and seconds that it came to are fitted.
//! - The standard errors of vertices are compared with how far they are from a finer bake.
//!
//! With `rows` before the scenes it measures rows of form factors instead, on the graphics adapter:
//! the cost by which bakes choose between hemicubes and rays (`radiosity::backend::cost`).
//!
//! Fits are by least squares of the logarithms. A part below 1e-6 is left out of its fit.

mod common;
#[path = "error_model/row_cost.rs"]
mod row_cost;

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use common::{keep_going, truth};
use glam::DVec3;
use radiosity::accuracy::Measure;
use radiosity::backend::cpu::RayGather;
use radiosity::bake::{ErrorEstimate, GatherSettings};
use radiosity::gather::GatherPoint;
use radiosity::{
    Backend, BakeResult, BakeSettings, BakeTarget, Error, Gather, GatheredMesh, Rgb, Scene,
    VertexMesh, load_scene,
};

/// The error around whose settings others are varied.
const BASE: f64 = 0.05;

/// Errors that the scene is baked to.
const TARGETS: [f64; 4] = [0.1, 0.07, 0.05, 0.035];

/// The error of the bake that others are compared with: its own is small beside theirs.
const REFERENCE: f64 = 0.015;

/// Points at which bakes are compared.
const POINTS: usize = 400;

fn main() -> Result<(), Error> {
    if !common::asked_for("error_model") {
        return Ok(());
    }
    let arguments = std::env::args().skip(1).filter(|argument| !argument.starts_with("--"));
    let mut scenes: Vec<String> = arguments.collect();
    let only_rows = scenes.first().is_some_and(|first| first == "rows");
    scenes.drain(..usize::from(only_rows));
    if scenes.is_empty() {
        scenes.push(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj").into());
    }
    if only_rows {
        let scenes: Vec<_> = scenes
            .iter()
            .map(|path| Ok(Arc::new(load_scene(path)?)))
            .collect::<Result<_, Error>>()?;
        return row_cost::measure(&common::gpu(), &scenes);
    }
    for path in &scenes {
        let start = Instant::now();
        let scene = Arc::new(load_scene(path)?);
        let name = Path::new(path).file_name().unwrap_or_default().display();
        println!("{name}: {} triangles, rays on the CPU", scene.triangles().len());
        println!("{:25} {:>10} {:>10}   measured", "law", "fitted", "model");
        let bench = Bench { scene };
        bench.parts()?;
        bench.targets()?;
        bench.against_reference()?;
        println!("{:.0} s\n", start.elapsed().as_secs_f64());
    }
    Ok(())
}

struct Bench {
    scene: Arc<Scene>,
}

impl Bench {
    fn bake(&self, settings: &BakeSettings) -> Result<BakeResult, Error> {
        settings.bake(self.scene.clone(), &Backend::Cpu, keep_going)
    }

    /// Each part of the error against the setting that it follows.
    fn parts(&self) -> Result<(), Error> {
        let none = |_: &mut BakeSettings, _: f64| {};
        let mesh = self.part(
            none,
            &[4.0, 2.0, 1.0, 0.5],
            |e| e.mesh,
            |gather, factor| {
                gather.refinement.mesh_error *= factor;
                gather.refinement.min_edge *= factor;
                gather.refinement.interpolation_tolerance *= factor;
                gather.rays *= 2;
            },
        )?;
        row("mesh ~ tolerances, edge", &mesh, Some(1.0));
        let sampling = self.part(
            none,
            &[0.25, 1.0, 4.0],
            |e| e.sampling,
            |gather, factor| {
                gather.rays = (f64::from(gather.rays) * factor) as u32;
                gather.noise_tolerance = f64::INFINITY;
            },
        )?;
        row("sampling ~ rays", &sampling, Some(-0.75));
        let unshot = |settings: &mut BakeSettings, factor| settings.solve.solver.unshot *= factor;
        let unshot = self.part(unshot, &[64.0, 16.0, 4.0, 1.0], |e| e.unshot, |_, _| {})?;
        row("unshot ~ unshot share", &unshot, Some(1.0));
        let truncation = self.part(
            none,
            &[1.0, 2.0, 3.0],
            |e| e.truncation,
            |gather, passes| gather.refinement.gather_passes = passes as u32,
        )?;
        // A geometric series: the ratio of one pass to the next.
        let ratios: Vec<f64> = truncation.windows(2).map(|pair| pair[1].1 / pair[0].1).collect();
        let ratio = ratios.iter().product::<f64>().powf(1.0 / ratios.len() as f64);
        let model = format!("x{:.2}", self.mean_reflectance());
        println!(
            "{:25} {:>10} {model:>10}   {}",
            "truncation per pass",
            format!("x{ratio:.2}"),
            list(&truncation)
        );
        Ok(())
    }

    /// One part of the estimated error for each factor that settings are changed by.
    fn part(
        &self,
        solve: impl Fn(&mut BakeSettings, f64),
        factors: &[f64],
        part: impl Fn(&ErrorEstimate) -> f64,
        gather: impl Fn(&mut GatherSettings, f64),
    ) -> Result<Vec<(f64, f64)>, Error> {
        let mut found = vec![];
        for &factor in factors {
            let mut settings = BakeSettings::for_error(BASE, &self.scene);
            solve(&mut settings, factor);
            settings.gather.iter_mut().for_each(|settings| gather(settings, factor));
            found.push((factor, part(&self.bake(&settings)?.estimate)));
        }
        Ok(found)
    }

    /// What settings and seconds a bake to an error comes to, against the estimated error.
    fn targets(&self) -> Result<(), Error> {
        let diagonal = self.scene.bounds().diagonal();
        let (mut seconds, mut rays, mut surplus, mut edge) = (vec![], vec![], vec![], vec![]);
        for error in TARGETS {
            let start = Instant::now();
            let baked =
                BakeTarget::Error(error).bake(self.scene.clone(), &Backend::Cpu, keep_going)?;
            seconds.push((error, start.elapsed().as_secs_f64()));
            let Some(gather) = baked.settings.gather else { continue };
            rays.push((error, f64::from(gather.rays)));
            surplus.push((error, gather.refinement.mesh_error));
            edge.push((error, gather.refinement.min_edge / diagonal));
        }
        row("seconds ~ error", &seconds, Some(-1.6 - 1.0 / 0.75));
        let initial = |of: &dyn Fn(&GatherSettings) -> f64| -> Vec<(f64, f64)> {
            let settings =
                TARGETS.map(|error| (error, BakeSettings::for_error(error, &self.scene)));
            settings.iter().filter_map(|(e, s)| Some((*e, of(s.gather.as_ref()?)))).collect()
        };
        law("rays", &rays, &initial(&|gather| f64::from(gather.rays)));
        law("error of the mesh", &surplus, &initial(&|gather| gather.refinement.mesh_error));
        law("shortest edge", &edge, &initial(&|gather| gather.refinement.min_edge / diagonal));
        Ok(())
    }

    /// Errors against a finer bake: of elements that light is shot on, and of the estimates.
    fn against_reference(&self) -> Result<(), Error> {
        let reference = self.bake(&BakeSettings::for_error(REFERENCE, &self.scene))?;
        let mut errors = vec![];
        for factor in [4.0, 2.0, 1.0] {
            let mut settings = BakeSettings::for_error(BASE, &self.scene);
            settings.solve.element_size *= factor;
            // What vertices gather shows what was shot; they are as good as they can be otherwise.
            settings.gather = BakeSettings::for_error(0.5 * BASE, &self.scene).gather;
            settings.gather.iter_mut().for_each(|gather| gather.refinement.gather_passes = 1);
            let baked = self.bake(&settings)?;
            errors.push((factor, compare(&baked, &reference)?.error));
        }
        row("error ~ shooting edge", &errors, Some(2.5));
        for error in [0.1, BASE] {
            let baked =
                BakeTarget::Error(error).bake(self.scene.clone(), &Backend::Cpu, keep_going)?;
            let compared = compare(&baked, &reference)?;
            println!(
                "{:25} {:>10} {:>10}   asked {error}, estimated {:.4}, off by {:.4}; {:.0} % of \
                 points within 2 standard errors",
                "tail factor",
                format!("{:.2}", compared.tail_factor),
                "1.00",
                baked.estimate.total,
                compared.error,
                100.0 * compared.within
            );
        }
        Ok(())
    }

    fn mean_reflectance(&self) -> f64 {
        let (mut sum, mut area) = (Rgb::ZERO, 0.0);
        for (t, triangle) in self.scene.triangles().iter().enumerate() {
            let reflectance = self.scene.materials()[triangle.material as usize].reflectance;
            sum += reflectance * self.scene.area(t);
            area += self.scene.area(t);
        }
        (sum / area).max_element()
    }
}

/// How far one surface is from another.
struct Comparison {
    /// Relative root mean square over the area.
    error: f64,
    /// Share of the points that are off by up to twice their standard error.
    within: f64,
    /// Factor of the standard errors for 95 % of the points to be within twice these.
    tail_factor: f64,
}

/// What two bakes have at one point.
struct Pair {
    radiosity: Rgb,
    standard_error: f64,
    reference: Rgb,
}

impl Pair {
    fn difference(&self) -> f64 {
        self.radiosity.distance(self.reference)
    }

    fn relative_square(&self, floor: f64) -> f64 {
        let scale = self.radiosity.length().max(self.reference.length()).max(floor);
        (self.difference() / scale).powi(2)
    }
}

/// Compares `baked` with `reference` at points spread over the area, as the estimate does.
fn compare(baked: &BakeResult, reference: &BakeResult) -> Result<Comparison, Error> {
    let pairs = pairs(&baked.light, &reference.light.surface)?;
    let count = pairs.len().max(1) as f64;
    let mean = pairs.iter().map(|pair| pair.reference.length()).sum::<f64>() / count;
    let floor = Measure::default().floor * mean;
    let square = pairs.iter().map(|pair| pair.relative_square(floor)).sum::<f64>() / count;
    // Points that only emit are exact, and have no standard error.
    let uncertain = pairs.iter().filter(|pair| pair.standard_error > 0.0);
    let mut ratios: Vec<f64> = uncertain.map(|p| p.difference() / p.standard_error).collect();
    ratios.sort_by(f64::total_cmp);
    let quantile = ratios.get(ratios.len() * 95 / 100).copied().unwrap_or(0.0);
    let within = ratios.partition_point(|&ratio| ratio <= 2.0) as f64 / ratios.len().max(1) as f64;
    Ok(Comparison { error: square.sqrt(), within, tail_factor: quantile / 2.0 })
}

/// Both at the centroids of faces, one for every so much area; none where other surfaces cover
/// them.
fn pairs(light: &GatheredMesh, reference: &VertexMesh) -> Result<Vec<Pair>, Error> {
    let surface = &light.surface;
    let diagonal = light.mesh.scene().bounds().diagonal();
    let mut points = vec![];
    let mut faces = vec![];
    let mut position = 0.5;
    let area: f64 = surface.faces.iter().map(|face| area_normal(surface, face).length()).sum();
    let mut sum = 0.0;
    for face in &surface.faces {
        let area_normal = area_normal(surface, face);
        sum += area_normal.length() / area * POINTS as f64;
        while position < sum {
            position += 1.0;
            let centroid = face.iter().map(|&v| surface.positions[v as usize]).sum::<DVec3>() / 3.0;
            let normal = area_normal.normalize();
            let near = 1e-6 * diagonal;
            points.push(GatherPoint { position: centroid + near * normal, normal, near });
            faces.push(face);
        }
    }
    let seen = RayGather::new(&light.mesh, 256)?.gather(&light.radiosity_field(), &points)?;
    let mut pairs = vec![];
    for ((point, face), seen) in points.iter().zip(faces).zip(seen) {
        // What sees back faces mostly is under something.
        let covered = seen.backface > 0.5;
        let truth = truth::at(reference, point.position, point.normal).filter(|_| !covered);
        let Some((reference, _)) = truth else { continue };
        let mean = |values: &[f64]| face.iter().map(|&v| values[v as usize]).sum::<f64>() / 3.0;
        let radiosity = face.iter().map(|&v| surface.radiosity[v as usize]).sum::<Rgb>() / 3.0;
        pairs.push(Pair { radiosity, standard_error: mean(&surface.error), reference });
    }
    Ok(pairs)
}

/// The normal of a face, as long as its area is large.
fn area_normal(surface: &VertexMesh, face: &[u32; 3]) -> DVec3 {
    let [a, b, c] = face.map(|v| surface.positions[v as usize]);
    (b - a).cross(c - a) / 2.0
}

/// A line of the table for value = scale · error^exponent, fitted to `points` and to the `initial`
/// settings.
fn law(name: &str, points: &[(f64, f64)], initial: &[(f64, f64)]) {
    let [(fitted_scale, fitted_exponent), (scale, exponent)] = [fit(points), fit(initial)];
    println!(
        "{name:25} {:>10} {:>10}   {}",
        format!("{fitted_scale:.2} e^{fitted_exponent:.2}"),
        format!("{scale:.2} e^{exponent:.2}"),
        list(points)
    );
}

/// The same for the exponent alone.
fn row(name: &str, points: &[(f64, f64)], exponent: Option<f64>) {
    let model = exponent.map_or(String::new(), |exponent| format!("^{exponent:.2}"));
    let fitted = format!("^{:.2}", fit(points).1);
    println!("{name:25} {fitted:>10} {model:>10}   {}", list(points));
}

fn list(points: &[(f64, f64)]) -> String {
    points.iter().map(|(x, y)| format!("{x}: {y:.4}")).collect::<Vec<_>>().join("  ")
}

/// Scale and exponent of the power law through `points`, by least squares of the logarithms.
fn fit(points: &[(f64, f64)]) -> (f64, f64) {
    let logs: Vec<(f64, f64)> =
        points.iter().filter(|p| p.1 > 1e-6).map(|p| (p.0.ln(), p.1.ln())).collect();
    let count = logs.len() as f64;
    let x = logs.iter().map(|p| p.0).sum::<f64>() / count;
    let y = logs.iter().map(|p| p.1).sum::<f64>() / count;
    let covariance: f64 = logs.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    let variance: f64 = logs.iter().map(|p| (p.0 - x).powi(2)).sum();
    let exponent = covariance / variance;
    ((y - exponent * x).exp(), exponent)
}
