//! `radiosity grid`: irradiance or illuminance on measuring grids, as a table and as pictures.

mod annual;
mod picture;
mod table;

use std::path::PathBuf;

use clap::Args;
use picture::{Picture, three_digits};
use radiosity::glam::DVec3;
use radiosity::grid::{
    GridPlane, GridSettings, GridStatistics, MeasuredGrid, MeasuringGrid, Quantity,
};
use radiosity::{Error, ErrorKind, Scene};

use crate::args::{self, Output, Parsed, Stop, numbers, value};
use crate::canvas::scale::Scale;
use crate::light::{Light, LightOptions};
use crate::{progress, standard};

/// A length for people.
const METRES: &str = "a length in metres";

/// Measures irradiance or illuminance on measuring grids, by default above each floor
#[derive(Args)]
#[command(after_help = "\
Bakes the scene and measures light at the points of grids. Writes STEM.grid.csv, a line a \
point with its standard error, and a picture in false colours of each grid, STEM.grid.png or \
STEM.grid-1.png and so on; prints mean, minimum, maximum and uniformity (minimum / mean). Points \
inside solids are marked and do not count. Lengths are in metres. With --weather the table has a \
year of daylight: docs/daylight.md.")]
pub struct Options {
    /// Scene: OBJ, glTF or STL
    #[arg(value_name = "SCENE.obj")]
    scene: PathBuf,
    /// Measure above this group: its highest side that faces up or, if none does, before the side
    /// with the largest area; may be repeated
    #[arg(long = "group", value_name = "NAME")]
    groups: Vec<String>,
    /// Measure on this parallelogram: a corner and two edges, scene unit; light arrives from where
    /// the cross product of the edges points; may be repeated
    #[arg(long = "plane", value_name = "NUMBERS", value_parser = plane)]
    planes: Vec<GridPlane>,
    /// Height of grids above floors and groups [default: 0.8; above groups 0]
    #[arg(long, value_name = "H", value_parser = value::<f64>(METRES))]
    height: Option<f64>,
    /// Width that is left out along edges [default: above floors 0.5, along walls; else 0]
    #[arg(long, value_name = "W", value_parser = value::<f64>(METRES))]
    strip: Option<f64>,
    /// Maximum distance of points [default: 0.2 * 5^log10(d), limited to 10, EN 12464-1, where d is
    /// the longer side, or the shorter one where the longer is twice as long or more]
    #[arg(long, value_name = "P", value_parser = value::<f64>(METRES))]
    spacing: Option<f64>,
    /// Measure illuminance, lx: `Ke` and skies are luminances, cd/m², of which 0.2126 are of r,
    /// 0.7152 of g and 0.0722 of b. Without it: irradiance, W/m², the mean of the channels
    #[arg(long)]
    photometric: bool,
    /// Daylight of a year instead, lx, by the weather in this EPW file: autonomy, useful daylight
    /// illuminance, exposure, and shares of the grid, sDA and ASE
    #[arg(long, value_name = "FILE")]
    weather: Option<PathBuf>,
    /// Occupied hours of each day with --weather, local standard time
    #[arg(long, value_name = "FROM,TO", default_value = "8,18", requires = "weather")]
    #[arg(value_parser = hours)]
    hours: [f64; 2],
    /// Illuminance of daylight autonomy with --weather, lx
    #[arg(long, value_name = "LX", default_value_t = 300.0, requires = "weather")]
    #[arg(value_parser = illuminance)]
    target: f64,
    #[command(flatten)]
    output: Output,
    #[command(flatten)]
    light: LightOptions,
}

/// A corner and two edges.
fn plane(text: &str) -> Parsed<GridPlane> {
    let [a, b, c, d, e, f, g, h, i] = numbers("nine numbers: a corner and two edges")(text)?;
    let edges = [DVec3::new(d, e, f), DVec3::new(g, h, i)];
    Ok(GridPlane { origin: DVec3::new(a, b, c), edges })
}

/// Two times of the day.
fn hours(text: &str) -> Parsed<[f64; 2]> {
    let expected = "two hours of the day, the earlier first, from 0 to 24";
    let [from, to] = numbers(expected)(text)?;
    let is_fine = 0.0 <= from && from < to && to <= 24.0;
    is_fine.then_some([from, to]).ok_or_else(|| args::give(expected))
}

fn illuminance(text: &str) -> Parsed<f64> {
    let expected = "an illuminance above 0, lx";
    let lux = value::<f64>(expected)(text)?;
    (lux.is_finite() && lux > 0.0).then_some(lux).ok_or_else(|| args::give(expected))
}

/// A grid, and where it is, in words.
type Placed = (String, MeasuringGrid);

impl Options {
    /// Runs the command.
    pub fn run(mut self) -> Result<(), Stop> {
        self.output.name(standard::stem(&self.scene), &["csv", "png"])?;
        self.light.reading.needs_up = self.planes.is_empty() || self.weather.is_some();
        if self.weather.is_some() {
            self.light.reading.sky.be_of_weather()?;
        }
        if self.photometric {
            self.light.reading.sky.be_photometric();
        }
        let scene = self.light.scene(&self.scene)?;
        // Before the bake, which may take minutes.
        let grids = self.grids(&scene)?;
        if let Some(weather) = &self.weather {
            return annual::run(&self, weather, scene, &grids);
        }
        let light = self.light.bake(scene)?;
        let mut measured = self.measure(&grids, &light)?.ok_or(Stop::Interrupted)?;
        let is_reached = self.correct(&mut measured, &light)?.ok_or(Stop::Interrupted)?;
        let outdoors = self.outdoors(light.baked.light.mesh.scene());
        self.write(&grids, &measured, outdoors)?;
        progress::print_written();
        self.light.print_outcome(is_reached);
        args::end_at(is_reached)
    }

    /// Length of a metre in the scene's unit.
    fn metre(&self) -> f64 {
        1.0 / self.light.reading.unit
    }

    fn quantity(&self) -> Quantity {
        if self.photometric { Quantity::Illuminance } else { Quantity::Irradiance }
    }

    fn settings(&self, strip: f64) -> GridSettings {
        let strip = self.strip.unwrap_or(strip);
        GridSettings { metre: self.metre(), strip, spacing: self.spacing }
    }

    /// Where it is measured.
    fn grids(&self, scene: &Scene) -> Result<Vec<Placed>, Error> {
        let up = scene.up();
        let (task, floor) = (self.settings(0.0), self.settings(GridSettings::default().strip));
        if self.groups.is_empty() && self.planes.is_empty() {
            // That of desks, m.
            let height = self.height.unwrap_or(0.8);
            let grids = MeasuringGrid::above_floors(scene, up, height, &floor)?;
            if grids.is_empty() {
                let found = format!("nothing is large enough where {up} is up");
                let remedy = "name a --group or give a --plane; --unit is that of the scene";
                return Err(Error::new(ErrorKind::Setting, "floors of the scene", found, remedy));
            }
            return Ok(grids.into_iter().map(|grid| raised(grid, height)).collect());
        }
        let height = self.height.unwrap_or(0.0);
        let above_group = |group: &String| {
            let grid = MeasuringGrid::above_group(scene, group, up, height, &task)?;
            Ok(raised(grid, height))
        };
        let on_plane = |plane: &GridPlane| {
            let place = format!("plane at {}", plane.origin);
            Ok((place, MeasuringGrid::on_plane("plane", *plane, &task)?))
        };
        let groups = self.groups.iter().map(above_group);
        groups.chain(self.planes.iter().map(on_plane)).collect()
    }

    /// What is measured; none where Ctrl-C stopped it.
    fn measure(&self, grids: &[Placed], light: &Light) -> Result<Option<Vec<MeasuredGrid>>, Error> {
        let (lit, grids) = (&light.baked.light, grids.iter().map(|(_, grid)| grid.clone()));
        let grids: Vec<MeasuringGrid> = grids.collect();
        progress::of_count("points", |report| {
            let mut gatherers = |noise| light.device.gather_to_noise(lit, noise);
            MeasuringGrid::measure_to(&grids, lit, &mut gatherers, self.light.error(), report)
        })
    }

    /// Corrects the values by paths, to the error that was asked for; whether that is reached, none
    /// where Ctrl-C stopped it.
    fn correct(&self, measured: &mut [MeasuredGrid], light: &Light) -> Result<Option<bool>, Error> {
        let lit = &light.baked.light;
        progress::of_count("paths", |report| {
            let mut is_reached = true;
            for grid in measured.iter_mut() {
                let Some(correction) = grid.correct(lit, self.light.error(), &mut *report)? else {
                    return Ok(None);
                };
                is_reached &= correction.is_reached;
            }
            Ok(Some(is_reached))
        })
    }

    /// What a level surface without anything around receives, where the daylight factor is defined:
    /// under an overcast sky alone.
    fn outdoors(&self, scene: &Scene) -> Option<f64> {
        let is_alone = !scene.has_emitter() && scene.luminaires().is_empty();
        let is_overcast = self.light.reading.sky.is_overcast() && scene.sky().sun().is_none();
        let irradiance = || self.quantity().of(scene.sky().irradiance(scene.up()));
        (is_alone && is_overcast).then(irradiance).filter(|&irradiance| irradiance > 0.0)
    }

    fn write(
        &self,
        grids: &[Placed],
        measured: &[MeasuredGrid],
        outdoors: Option<f64>,
    ) -> Result<(), Error> {
        for (k, ((place, _), measured)) in grids.iter().zip(measured).enumerate() {
            let name = format!("{} {}", k + 1, measured.grid.name);
            let Some(statistics) = measured.statistics(self.quantity()) else {
                say!("{name}: all points are inside of solids");
                continue;
            };
            say!("{}", self.line(&name, measured, &statistics));
            if let Some(outdoors) = outdoors {
                let [mean, least] =
                    [statistics.mean, statistics.minimum].map(|value| 100.0 * value / outdoors);
                let unit = self.quantity().unit();
                say!(
                    "{name}: daylight factor mean {mean:.2} %, minimum {least:.2} %, of {} {unit} \
                     outdoors",
                    three_digits(outdoors)
                );
            }
            let number = if grids.len() > 1 { format!("-{}", k + 1) } else { String::new() };
            let picture = self.picture(measured, &statistics, place);
            self.write_picture(&picture, &number)?;
        }
        self.output.write("grid.csv", &table::csv(measured, self.quantity()));
        Ok(())
    }

    fn picture<'a>(
        &self,
        measured: &'a MeasuredGrid,
        statistics: &GridStatistics,
        place: &str,
    ) -> Picture<'a> {
        let quantity = match self.quantity() {
            Quantity::Irradiance => "Irradiance",
            Quantity::Illuminance => "Illuminance",
        };
        let GridStatistics { mean, minimum, maximum, uniformity, .. } = *statistics;
        let [mean, low, high] = [mean, minimum, maximum].map(three_digits);
        let values = measured.measured(self.quantity()).map(|value| value.map(|[value, _]| value));
        let unit = self.quantity().unit();
        Picture {
            grid: &measured.grid,
            values: values.collect(),
            title: format!("{quantity} in {unit}, {place}"),
            line: format!(
                "mean {mean}   minimum {low}   maximum {high}   uniformity {uniformity:.2}"
            ),
            unit,
            scale: Scale::of_colours(minimum, maximum),
            metre: self.metre(),
        }
    }

    fn write_picture(&self, picture: &Picture, number: &str) -> Result<(), Error> {
        let png = picture.png().map_err(|found| {
            Error::new(ErrorKind::File, "the picture of a grid", found, "please report it")
        })?;
        self.output.write(&format!("grid{number}.png"), &png);
        Ok(())
    }

    fn line(&self, name: &str, measured: &MeasuredGrid, statistics: &GridStatistics) -> String {
        let GridStatistics { points, mean, mean_error, minimum, maximum, uniformity, .. } =
            statistics;
        let [a, b] = measured.grid.cell().map(|edge| edge / self.metre());
        let inside = measured.values.iter().flatten().count() - points;
        let unit = self.quantity().unit();
        let error = if *mean > 0.0 { 100.0 * mean_error / mean } else { 0.0 };
        let [mean, minimum, maximum] = [mean, minimum, maximum].map(|value| three_digits(*value));
        let left_out = if inside > 0 { format!(", {inside} inside of solids") } else { "".into() };
        format!(
            "{name}: mean {mean} {unit} ± {error:.2} %, minimum {minimum}, maximum {maximum}, \
             uniformity {uniformity:.3}; {points} points{left_out}, {a:.2} m by {b:.2} m apart"
        )
    }
}

/// A grid this many metres above what it is named after.
fn raised(grid: MeasuringGrid, height: f64) -> Placed {
    (format!("{height} m above {}", grid.name), grid)
}
