//! `radiosity heat`: temperatures and net fluxes of groups, as a table.

mod boundaries;

use std::path::{Path, PathBuf};

use clap::Args;
use radiosity::heat::{HeatBalance, HeatSettings};
use radiosity::io::read_npz;
use radiosity::{Error, Scene, ViewFactors};

use crate::args::{self, List, Stop, list, value};
use crate::progress;
use crate::view_factors::{MAX_PRINTED, ToError, enforce, print_checks};

/// Solves the radiative heat balance of groups by their view factors
#[derive(Args)]
#[command(after_help = "\
Writes temperature (K), radiosity, irradiance and net flux out (W/m²) of each group. View factors \
are made as `radiosity view-factors` makes them, or read from a file that it has written. Openings \
are black and have one temperature; groups are grey in each band, and diffuse. Powers are in W \
where lengths are in m.

Columns of --boundaries:
  group        its name; with --facets that of a face (GROUP/1) or of all faces of a group; * for
               all groups that no line names
  temperature  K; empty where the flux is given
  flux         net flux out, W/m²; 0 for adiabatic; empty where the temperature is given
  emissivity   0 to 1; with --bands a column a band: emissivity_1, …")]
pub struct Options {
    /// Scene, an OBJ file, or view factors, an npz file
    #[arg(value_name = "SCENE.obj|FACTORS.npz")]
    input: PathBuf,
    /// Boundary conditions of the groups, a CSV file
    #[arg(long, value_name = "FILE.csv")]
    boundaries: PathBuf,
    /// Wavelengths in µm that separate the bands, ascending [default: one band]
    #[arg(long, value_name = "L,…")]
    #[arg(value_parser = list::<f64>("wavelengths in µm, ascending, with commas between"))]
    bands: Option<List<f64>>,
    /// Temperature of the surroundings, K
    #[arg(long, value_name = "T", default_value = "0")]
    #[arg(value_parser = value::<f64>("a temperature"))]
    surroundings: f64,
    #[command(flatten)]
    factors: ToError,
    /// Change the view factors so that they keep closure and reciprocity: heat then balances
    #[arg(long)]
    enforce: bool,
    /// The table, or a folder for it [default: SCENE.heat.csv]
    #[arg(short, long, value_name = "FILE.csv")]
    out: Option<PathBuf>,
}

/// Where view factors come from.
enum Source {
    Scene(Box<Scene>),
    Matrix(ViewFactors),
}

impl Source {
    /// Names of the groups.
    fn groups(&self) -> &[String] {
        match self {
            Source::Scene(scene) => scene.groups(),
            Source::Matrix(matrix) => &matrix.names,
        }
    }
}

impl Options {
    /// Runs the command.
    pub fn run(self) -> Result<(), Stop> {
        let default = self.input.with_extension("heat.csv");
        let out = args::stem(self.out.clone(), default, &[]);
        args::check_writable(&out)?;
        let source = self.source()?;
        let band_edges = self.bands.clone().unwrap_or_default();
        let settings = HeatSettings { band_edges, surroundings: self.surroundings };
        let bands = settings.band_edges.len() + 1;
        // Before the view factors, which may take minutes.
        let surfaces = boundaries::read(&self.boundaries, source.groups(), bands)?;
        let mut matrix = match source {
            Source::Scene(scene) => self.factors.matrix(&scene)?,
            Source::Matrix(matrix) => matrix,
        };
        print_checks(&matrix);
        if self.enforce {
            matrix = enforce(&matrix);
        }
        let balance = progress::of_stage("solving", || {
            HeatBalance::of(&matrix, &surfaces, &settings, |_| crate::interrupt::flow())
        })?;
        let balance = balance.ok_or(Stop::Interrupted)?;
        print_balance(&matrix, &balance);
        progress::of_writing(&out, |path| write(path, &matrix, &balance))?;
        Ok(())
    }

    fn source(&self) -> Result<Source, Error> {
        let path = &self.input;
        if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("npz")) {
            return progress::of_reading(path, || read_npz(path)).map(Source::Matrix);
        }
        Ok(Source::Scene(Box::new(self.factors.scene(path)?)))
    }
}

/// Prints the balance as a whole, and the groups if there are few.
fn print_balance(matrix: &ViewFactors, balance: &HeatBalance) {
    let HeatBalance { lost_to_surroundings, lost_to_backs, imbalance, .. } = balance;
    let powers = matrix.areas.iter().zip(&balance.groups);
    let given: f64 = powers.map(|(area, group)| (area * group.net_flux.value).max(0.0)).sum();
    say!(
        "heat: {given:.6e} W out of groups, {lost_to_surroundings:.6e} W to the surroundings, \
         {lost_to_backs:.6e} W lost to backs, {imbalance:.1e} W out of balance; residual {:.1e} \
         after {} products",
        balance.residual,
        balance.products
    );
    if matrix.names.len() > MAX_PRINTED {
        return;
    }
    let width = matrix.names.iter().map(|n| n.chars().count()).max().unwrap_or(0).max(5);
    say!("{:>width$} {:>12} {:>14} {:>9}", "group", "T, K", "flux, W/m²", "± error");
    for (name, group) in matrix.names.iter().zip(&balance.groups) {
        let temperature = group.temperature.map_or("–".into(), |t| format!("{t:.6}"));
        let flux = group.net_flux;
        say!("{name:>width$} {temperature:>12} {:14.6} {:9.1e}", flux.value, flux.error);
    }
}

/// Writes a line a group.
fn write(path: &Path, matrix: &ViewFactors, balance: &HeatBalance) -> Result<(), Error> {
    let head = "group,area,temperature,radiosity,irradiance,net_flux,standard_error";
    let groups = matrix.names.iter().zip(&matrix.areas).zip(&balance.groups);
    let lines = groups.map(|((name, area), group)| {
        let temperature = group.temperature.map_or(String::new(), |t| t.to_string());
        let flux = group.net_flux;
        let numbers = [group.radiosity, group.irradiance, flux.value, flux.error];
        let start = [name.clone(), area.to_string(), temperature];
        start.into_iter().chain(numbers.map(|number| number.to_string())).collect()
    });
    args::write_file(path, &args::csv(head, lines))
}
