//! `radiosity probes`: irradiance at points in the air as spherical harmonics, for games.

use std::path::PathBuf;

use clap::{ArgGroup, Args};
use radiosity::glam::DVec3;
use radiosity::probe::{Probe, ProbeGrid, correct_probes, probes_at};
use radiosity::scene::Aabb;
use radiosity::{Error, Scene};
use serde_json::json;

use crate::args::{self, Output, Parsed, Stop, numbers, value};
use crate::light::{Light, LightOptions};
use crate::{progress, standard};

/// Gathers irradiance at a grid of probes in the air, as spherical harmonics for games
#[derive(Args)]
#[command(group(ArgGroup::new("cells").required(true).multiple(true)))]
#[command(after_help = "\
Bakes the scene and gathers the light at probes in the cells of a box: irradiance over the normal \
as spherical harmonics to order 2, nine coefficients a channel. Writes STEM.probes.json and \
STEM.probes.csv, a line a probe: along x, then rows along y, then layers along z. `inside` are \
probes in solids or behind walls: more backs than fronts and sky are visible there. Formulas and \
formats: docs/grids_and_probes.md.")]
pub struct Options {
    /// Scene: OBJ, glTF or STL
    #[arg(value_name = "SCENE.obj")]
    scene: PathBuf,
    /// Edge of a cell, scene unit, rounded so that cells fit
    #[arg(long, value_name = "X", value_parser = value::<f64>("a length"))]
    #[arg(group = "cells", overrides_with = "counts")]
    spacing: Option<f64>,
    /// Cells along x, y and z
    #[arg(long, value_name = "NX,NY,NZ", group = "cells", overrides_with = "spacing")]
    #[arg(value_parser = numbers::<usize, 3>("three whole numbers"))]
    counts: Option<[usize; 3]>,
    /// Lowest and highest corner of the box [default: those of the scene]
    #[arg(long = "box", value_name = "x,y,z,x,y,z", value_parser = bounds)]
    bounds: Option<Aabb>,
    #[command(flatten)]
    output: Output,
    #[command(flatten)]
    light: LightOptions,
}

/// The lowest and the highest corner.
fn bounds(text: &str) -> Parsed<Aabb> {
    let corners = numbers("six numbers: the lowest and the highest corner");
    let [a, b, c, d, e, f] = corners(text)?;
    Ok(Aabb { low: DVec3::new(a, b, c), high: DVec3::new(d, e, f) })
}

impl Options {
    /// Runs the command.
    pub fn run(mut self) -> Result<(), Stop> {
        self.output.name(standard::stem(&self.scene), &["csv", "json"])?;
        let scene = self.light.scene(&self.scene)?;
        let grid = self.grid(&scene)?;
        let light = self.light.bake(scene)?;
        let mut probes = self.gather(&grid, &light)?.ok_or(Stop::Interrupted)?;
        let (lit, size, error) = (&light.baked.light, grid.size(), self.light.error());
        let correction = progress::of_count("paths", |report| {
            correct_probes(lit, &mut probes, size, error, report)
        })?;
        let is_reached = correction.ok_or(Stop::Interrupted)?.is_reached;
        let inside = probes.iter().filter(|probe| probe.is_inside()).count();
        let [x, y, z] = grid.counts;
        say!("{} probes, {x} by {y} by {z}, {inside} of them inside of something", probes.len());
        self.output.write("probes.json", &json(&grid, &probes));
        self.output.write("probes.csv", &csv(&probes));
        progress::print_written();
        self.light.print_outcome(is_reached);
        args::end_at(is_reached)
    }

    fn grid(&self, scene: &Scene) -> Result<ProbeGrid, Error> {
        let bounds = self.bounds.unwrap_or_else(|| scene.bounds());
        match (self.counts, self.spacing) {
            (Some(counts), _) => ProbeGrid::with_counts(&bounds, counts),
            (None, spacing) => ProbeGrid::with_spacing(&bounds, spacing.unwrap_or_default()),
        }
    }

    /// The probes; none where Ctrl-C stopped it.
    fn gather(&self, grid: &ProbeGrid, light: &Light) -> Result<Option<Vec<Probe>>, Error> {
        let lit = &light.baked.light;
        let mut gatherer = light.device.gather_to_noise(lit, self.light.error())?;
        progress::of_count("probes", |report| {
            probes_at(lit, &grid.positions(), grid.size(), &mut *gatherer, report)
        })
    }
}

/// All of it, with what the numbers mean.
fn json(grid: &ProbeGrid, probes: &[Probe]) -> Vec<u8> {
    let head = json!({
        "quantity": "irradiance over the unit normal n, W/m2 per channel: \
                     E(n) = sum of irradiance[k] * Y_k(n)",
        "basis": [
            "sqrt(1/pi)/2", "sqrt(3/pi)/2*y", "sqrt(3/pi)/2*z", "sqrt(3/pi)/2*x",
            "sqrt(15/pi)/2*x*y", "sqrt(15/pi)/2*y*z", "sqrt(5/pi)/4*(3*z*z-1)",
            "sqrt(15/pi)/2*x*z", "sqrt(15/pi)/4*(x*x-y*y)"
        ],
        "low": grid.low.to_array(),
        "spacing": grid.spacing.to_array(),
        "counts": grid.counts,
    });
    let probe = |probe: &Probe| {
        let coefficients = probe.irradiance.coefficients.map(|c| c.to_array());
        json!({
            "position": probe.position.to_array(),
            "inside": probe.is_inside(),
            "backs": probe.backface,
            "escaped": probe.escaped,
            "deviation": probe.deviation,
            "irradiance": coefficients,
        })
        .to_string()
    };
    // A line a probe, below the head.
    let head = head.to_string();
    let probes: Vec<String> = probes.iter().map(probe).collect();
    let open = head.strip_suffix('}').unwrap_or(&head);
    format!("{open},\"probes\":[\n{}\n]}}\n", probes.join(",\n")).into_bytes()
}

/// A line a probe, with a header.
fn csv(probes: &[Probe]) -> Vec<u8> {
    let coefficients = (0..9).map(|k| format!(",r{k},g{k},b{k}")).collect::<String>();
    let head = "x,y,z,inside,backs,escaped,deviation".to_string() + &coefficients;
    let line = |probe: &Probe| {
        let inside = f64::from(u8::from(probe.is_inside()));
        let start = [inside, probe.backface, probe.escaped, probe.deviation];
        let coefficients = probe.irradiance.coefficients.iter().flat_map(DVec3::to_array);
        let numbers = probe.position.to_array().into_iter().chain(start).chain(coefficients);
        numbers.map(|number| number.to_string()).collect()
    };
    args::csv(&head, probes.iter().map(line))
}
