//! `radiosity heat`: temperatures and net fluxes of groups, as a table.

mod boundaries;
mod columns;
mod table;
mod units;

use std::path::{Path, PathBuf};

use clap::Args;
use radiosity::heat::{HeatBalance, HeatSettings};
use radiosity::io::read_npz;
use radiosity::view_factor::MatrixRows;
use radiosity::{Error, Scene, ViewFactors};

use self::units::{SCALES, Scale, Temperature};
use crate::args::{self, List, Stop, list, names, one_of};
use crate::progress;
use crate::scene_options::{UNITS, unit};
use crate::view_factors::{MAX_PRINTED, ToError, enforce, print_checks};

/// Solves the radiative heat balance of groups by their view factors
#[derive(Args)]
#[command(after_help = "\
Writes temperature (K), radiosity, irradiance and net flux out (W/m²) of each group. View factors \
are made as `radiosity view-factors` makes them, or read from an npz file that it has written. \
Openings are black and have one temperature; groups are grey in each band, and diffuse. A group of \
--two-sided is a sheet: a line for each side, which have one temperature.

Columns of --boundaries, in any order, with , ; or tabs between them, and decimal points or commas:
  group        its name; with --facets that of a face (GROUP/1) or of all faces of a group; * for
               all groups that no line names; GROUP (back) for another emissivity of that side
  temperature  in K, or temperature [C], [F]; empty where the flux is given
  flux         net flux out, W/m²; 0 for adiabatic; empty where the temperature is given; of a
               two-sided group the mean over both sides
  emissivity   0 to 1; with --bands a column a band: emissivity_1, …")]
pub struct Options {
    /// Scene, an OBJ or STL file, or view factors, an npz file
    #[arg(value_name = "SCENE.obj|FACTORS.npz")]
    input: PathBuf,
    /// Boundary conditions of the groups, a CSV file
    #[arg(long, value_name = "FILE.csv")]
    boundaries: PathBuf,
    /// Wavelengths in µm that separate the bands, ascending [default: one band]
    #[arg(long, value_name = "L,…")]
    #[arg(value_parser = list::<f64>("wavelengths in µm, ascending, with commas between"))]
    bands: Option<List<f64>>,
    /// Temperature of the surroundings, in K or with its unit: 293.15, 20C, 3K [default: 0K]
    #[arg(long, value_name = "T", value_parser = units::temperature)]
    #[arg(allow_hyphen_values = true)]
    surroundings: Option<Temperature>,
    /// Scale of temperatures that have no unit: kelvin, celsius, fahrenheit [default: kelvin;
    /// required where one is below 150]
    #[arg(long, value_name = "SCALE", value_parser = one_of(SCALES))]
    temperatures: Option<Scale>,
    /// Unit of length of the file, mm, cm, m, in, ft or its metres: gives powers in W, and areas in
    /// m²
    #[arg(long, value_name = "UNIT", value_parser = unit)]
    unit: Option<f64>,
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

impl Options {
    /// Runs the command.
    pub fn run(self) -> Result<(), Stop> {
        let default = self.input.with_extension("heat.csv");
        let out = args::stem(self.out.clone(), default, &[]);
        args::check_writable(&out)?;
        let source = self.source()?;
        let band_edges = self.bands.clone().unwrap_or_default();
        let surroundings = match self.surroundings {
            Some(temperature) => temperature.kelvin("--surroundings", self.temperatures)?,
            None => 0.0,
        };
        let settings = HeatSettings { band_edges, surroundings };
        let bands = settings.band_edges.len() + 1;
        // Before the view factors, which may take minutes.
        let rows = self.rows(&source)?;
        let surfaces = boundaries::read(&self.boundaries, &rows, bands, self.temperatures)?;
        let Some(mut matrix) = self.matrix(source)? else { return Ok(()) };
        if self.enforce {
            matrix = enforce(&matrix);
        }
        let balance = progress::of_stage("solving", || {
            HeatBalance::of(&matrix, &surfaces, &settings, |_| crate::interrupt::flow())
        })?;
        let balance = balance.ok_or(Stop::Interrupted)?;
        self.print_powers(&matrix, &balance);
        print_groups(&matrix, &balance);
        self.write(&out, &matrix, &balance);
        Ok(())
    }

    fn source(&self) -> Result<Source, Stop> {
        let path = &self.input;
        if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("npz")) {
            if self.factors.has_two_sided() {
                return Err(Stop::usage("--two-sided belongs to a scene: view factors have sides"));
            }
            let matrix = progress::of_reading(path, || read_npz(path))?;
            return Ok(Source::Matrix(matrix));
        }
        Ok(Source::Scene(Box::new(self.factors.scene(path)?)))
    }

    /// The view factors of `source`, with their checks printed, in the first process.
    fn matrix(&self, source: Source) -> Result<Option<ViewFactors>, Stop> {
        let (matrix, scene) = match source {
            Source::Scene(scene) => (self.factors.matrix(&scene)?, Some(scene)),
            Source::Matrix(matrix) => (Some(matrix), None),
        };
        if let Some(matrix) = &matrix {
            print_checks(matrix);
            if let Some(scene) = scene {
                self.factors.print_backs_met(&scene, matrix)?;
            }
        }
        Ok(matrix)
    }

    /// The rows of the matrix that `source` gives.
    fn rows(&self, source: &Source) -> Result<MatrixRows, Error> {
        match source {
            Source::Scene(scene) => self.factors.matrix_rows(scene),
            Source::Matrix(matrix) => Ok(matrix.rows()),
        }
    }

    /// Prints the balance as a whole: in W where the unit of length is known, else in W/m² of all
    /// surfaces, which does not depend on it.
    fn print_powers(&self, matrix: &ViewFactors, balance: &HeatBalance) {
        let (factor, unit) = match self.unit {
            Some(metres) => (metres * metres, "W"),
            None => (1.0 / matrix.areas.iter().sum::<f64>(), "W/m²"),
        };
        let HeatBalance { supplied, lost_to_surroundings, lost_to_backs, imbalance, .. } = balance;
        let [supplied, lost_to_surroundings, lost_to_backs, imbalance] =
            [supplied, lost_to_surroundings, lost_to_backs, imbalance].map(|power| factor * power);
        say!(
            "heat: {supplied:.6e} {unit} out of groups, {lost_to_surroundings:.6e} {unit} to the \
             surroundings, {lost_to_backs:.6e} {unit} lost to backs, {imbalance:.1e} {unit} out of \
             balance; residual {:.1e} after {} products",
            balance.residual,
            balance.products
        );
        if self.unit.is_none() {
            say!(
                "  per area of all surfaces: the file has no unit of length; --unit {} gives W",
                names(UNITS).join("|")
            );
        }
    }

    /// Writes a line a group.
    fn write(&self, path: &Path, matrix: &ViewFactors, balance: &HeatBalance) {
        let head = "group,area,temperature,radiosity,irradiance,net_flux,standard_error";
        let head = if self.unit.is_some() { format!("{head},power") } else { head.into() };
        let square = self.unit.map_or(1.0, |metres| metres * metres);
        let groups = matrix.names.iter().zip(&matrix.areas).zip(&balance.groups);
        let lines = groups.map(|((name, area), group)| {
            let temperature = group.temperature.map_or(String::new(), |t| t.to_string());
            let (area, flux) = (square * area, group.net_flux);
            let numbers = [group.radiosity, group.irradiance, flux.value, flux.error];
            let power = self.unit.map(|_| area * flux.value);
            let start = [name.clone(), area.to_string(), temperature];
            let numbers = numbers.into_iter().chain(power).map(|number| number.to_string());
            start.into_iter().chain(numbers).collect()
        });
        args::write_file(path, &args::csv(&head, lines));
    }
}

/// Prints a line a group if there are few.
fn print_groups(matrix: &ViewFactors, balance: &HeatBalance) {
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
