//! `radiosity heat`: temperatures and net fluxes of groups, as a table.

mod boundaries;

use std::path::{Path, PathBuf};

use lexopt::prelude::*;
use radiosity::heat::{HeatBalance, HeatSettings};
use radiosity::io::read_npz;
use radiosity::{Error, ErrorKind, Scene, ViewFactors};

use crate::args::{self, Stop};
use crate::progress;
use crate::scene_options::SceneOptions;
use crate::view_factors::{MAX_PRINTED, ToError, enforce, print_checks};

pub const USAGE: &str = "\
usage: radiosity heat SCENE.obj --boundaries FILE.csv [--facets] [--error E] [--two-sided NAME]…
                      [--bands L,…] [--surroundings T] [--enforce] [--out FILE.csv]
       radiosity heat FACTORS.npz --boundaries FILE.csv …

Writes the radiative heat balance of the groups of a scene: temperatures (K), radiosity, irradiance
and net flux out (W/m²) of each, beside the scene as SCENE.heat.csv. View factors are made as
`radiosity view-factors` makes them, or read from a file that it has written. What is seen through
openings is black and has one temperature; groups are grey in each band, and diffuse. Powers are in
W where lengths are in m.

  --boundaries FILE   what is known of the groups, as CSV with the columns
                        group        its name; with --facets that of a face (GROUP/1) or of all
                                     faces of a group; * for all that no line names
                        temperature  K, or empty where the flux is given
                        flux         net flux out, W/m²: what heats the group otherwise; 0 if it is
                                     adiabatic; empty where the temperature is given
                        emissivity   0 to 1; with --bands as many columns, emissivity_1, …
  --bands L,…         wavelengths in µm that part the bands
  --surroundings T    temperature of the surroundings in K [0]
  --facets, --error E, --two-sided NAME   as in `radiosity view-factors`
  --enforce           make the view factors keep closure and reciprocity first: heat then balances
  --out FILE.csv      the table, or a folder for it
  --strict            refuse what would be repaired in the file";

/// What is asked of the command.
struct Options {
    input: PathBuf,
    reading: SceneOptions,
    factors: ToError,
    boundaries: PathBuf,
    settings: HeatSettings,
    enforce: bool,
    out: PathBuf,
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

/// Runs the command.
pub fn run(parser: &mut lexopt::Parser) -> Result<(), Stop> {
    let options = Options::parse(parser)?;
    args::check_writable(&options.out)?;
    let source = options.source()?;
    let bands = options.settings.band_edges.len() + 1;
    // Before the view factors, which may take minutes.
    let surfaces = boundaries::read(&options.boundaries, source.groups(), bands)?;
    let mut matrix = match source {
        Source::Scene(scene) => options.factors.matrix(&scene)?,
        Source::Matrix(matrix) => matrix,
    };
    print_checks(&matrix);
    if options.enforce {
        matrix = enforce(&matrix);
    }
    let balance = progress::of_stage("solving", || {
        HeatBalance::of(&matrix, &surfaces, &options.settings, |_| crate::interrupt::flow())
    })?;
    let balance = balance.ok_or(Stop::Interrupted)?;
    print_balance(&matrix, &balance);
    progress::of_writing(&options.out, |path| write(path, &matrix, &balance))?;
    Ok(())
}

impl Options {
    fn parse(parser: &mut lexopt::Parser) -> Result<Options, Stop> {
        let (mut scenes, mut boundaries, mut out) = (vec![], None, None);
        let (mut settings, mut enforce) = (HeatSettings::default(), false);
        let mut factors = ToError::default();
        let mut reading = SceneOptions::ignoring_specular();
        while let Some(arg) = parser.next()? {
            match arg {
                Long("help") | Short('h') => return Err(Stop::Help),
                Long("boundaries") => boundaries = Some(parser.value()?.into()),
                Long("bands") => {
                    let text: String = args::value(parser, "bands", "wavelengths")?;
                    let edges: Result<Vec<f64>, _> =
                        text.split(',').map(|edge| edge.trim().parse()).collect();
                    let expected = "wavelengths in µm, ascending, with commas between";
                    settings.band_edges =
                        edges.map_err(|_| args::wrong_value("bands", &text, expected))?;
                }
                Long("surroundings") => {
                    settings.surroundings = args::value(parser, "surroundings", "a temperature")?;
                }
                Long("enforce") => enforce = true,
                Long("out") => out = Some(parser.value()?.into()),
                Long("facets") => {
                    factors.facets = true;
                    reading.by_facets();
                }
                Long("error") => factors.error = args::value(parser, "error", "a number")?,
                Long("two-sided") => {
                    factors.two_sided.push(args::value(parser, "two-sided", "a group's name")?);
                }
                Long("strict") => _ = reading.option("strict", parser)?,
                Value(path) => scenes.push(path.into()),
                _ => return Err(arg.unexpected().into()),
            }
        }
        let input = args::only_scene(scenes)?;
        let Some(boundaries) = boundaries else {
            return Err(Stop::usage("no --boundaries: what is known of the groups"));
        };
        let out = args::stem(out, input.with_extension("heat.csv"), &[]);
        Ok(Options { input, reading, factors, boundaries, settings, enforce, out })
    }

    fn source(&self) -> Result<Source, Error> {
        let path = &self.input;
        if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("npz")) {
            return progress::of_reading(path, || read_npz(path)).map(Source::Matrix);
        }
        progress::of_reading(path, || self.reading.load(path).map(Box::new)).map(Source::Scene)
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
    let table = || -> csv::Result<()> {
        let mut table = csv::Writer::from_path(path)?;
        table.write_record([
            "group",
            "area",
            "temperature",
            "radiosity",
            "irradiance",
            "net_flux",
            "standard_error",
        ])?;
        for ((name, area), group) in matrix.names.iter().zip(&matrix.areas).zip(&balance.groups) {
            let numbers = [
                Some(*area),
                group.temperature,
                Some(group.radiosity),
                Some(group.irradiance),
                Some(group.net_flux.value),
                Some(group.net_flux.error),
            ];
            let numbers = numbers.map(|number| number.map_or(String::new(), |x| x.to_string()));
            table.write_record(std::iter::once(name).chain(&numbers))?;
        }
        Ok(table.flush()?)
    };
    table().map_err(|e| {
        let remedy = "choose a folder that exists, can be written and has room";
        let found = format!("cannot be written: {e}");
        Error::new(ErrorKind::File, path.display().to_string(), found, remedy).with_source(e)
    })
}
