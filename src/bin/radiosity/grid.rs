//! `radiosity grid`: irradiance or illuminance on measuring grids, as a table and as pictures.

mod field;
mod picture;
mod scale;
mod table;

use std::path::{Path, PathBuf};

use lexopt::prelude::*;
use picture::{Picture, three_digits};
use radiosity::camera::up_axis;
use radiosity::glam::DVec3;
use radiosity::grid::{
    GridPlane, GridSettings, GridStatistics, MeasuredGrid, MeasuringGrid, Quantity,
};
use radiosity::{Error, ErrorKind, Scene};

use crate::args::{self, Stop};
use crate::light::{Light, LightOptions, light_usage};
use crate::{interrupt, progress};

pub const USAGE: &str = concat!(
    "\
usage: radiosity grid SCENE.obj [--group NAME | --plane ox,oy,oz,ux,uy,uz,vx,vy,vz]…
                      [--height H] [--strip W] [--spacing P] [--metre X] [--photometric]
                      [--error X] [--out STEM] [--adapter NAME | --cpu]

Bakes the scene and measures what arrives at the points of grids: above each floor, unless groups
or planes are named. Writes STEM.grid.csv (a line a point, with its standard error) and a picture in
false colours with lines of equal value for each grid, STEM.grid.png or STEM.grid-1.png and so on,
and prints mean, minimum, maximum and uniformity, minimum over mean. Points inside of solids are
marked and do not count. Lengths are in metres.

Where:
  --group NAME      above this group instead: its highest side that faces up or, if none does,
                    before the side that most of it shows; may be repeated
  --plane …         a corner and two edges, in the scene's unit: light arrives from where the cross
                    product of the edges points; may be repeated
  --height H        of grids above floors and groups [0.8; above groups 0]
  --strip W         what is left out along edges [above floors 0.5, along the walls; else 0]
  --spacing P       between points, at most [0.2 * 5^log10(d), and 10, as in EN 12464-1: d is the
                    longer side, or the shorter one where the other is at least twice as long]
  --metre X         length of a metre in the scene's unit: 1000 where that is a millimetre [1]
  --up x,y,z        which way is up [+y or +z, whichever seems to be]
What:
  --photometric     `Ke` and skies are luminances in cd/m²: measure illuminance in lx, of which
                    0.2126 are of r, 0.7152 of g and 0.0722 of b; else irradiance in W/m², the mean
                    of the channels
  --out STEM        where the files go, and how they begin [the scene without its ending]; a folder
                    takes files of the scene's name
",
    light_usage!()
);

/// Height above floors, m: that of desks.
const DESK_HEIGHT: f64 = 0.8;

/// What is asked of the command.
struct Options {
    scene: PathBuf,
    light: LightOptions,
    groups: Vec<String>,
    planes: Vec<GridPlane>,
    height: Option<f64>,
    strip: Option<f64>,
    spacing: Option<f64>,
    metre: f64,
    quantity: Quantity,
    stem: PathBuf,
}

/// A grid, and where it is, in words.
type Placed = (String, MeasuringGrid);

/// Runs the command.
pub fn run(parser: &mut lexopt::Parser) -> Result<(), Stop> {
    let options = Options::parse(parser)?;
    args::check_writable(&options.file(".csv"))?;
    let scene = options.light.scene(&options.scene)?;
    // Before the bake, which may take minutes.
    let grids = options.grids(&scene)?;
    let light = options.light.bake(scene)?;
    let measured = options.measure(&grids, &light)?.ok_or(Stop::Interrupted)?;
    options.write(&grids, &measured)?;
    progress::print_written();
    args::end()
}

impl Options {
    fn parse(parser: &mut lexopt::Parser) -> Result<Options, Stop> {
        let mut scenes = vec![];
        let mut out = None;
        let mut options = Options {
            scene: PathBuf::new(),
            light: LightOptions::new(),
            groups: vec![],
            planes: vec![],
            height: None,
            strip: None,
            spacing: None,
            metre: 1.0,
            quantity: Quantity::Irradiance,
            stem: PathBuf::new(),
        };
        let length = |parser: &mut lexopt::Parser, name: &str| {
            args::value::<f64>(parser, name, "a length in metres")
        };
        while let Some(arg) = parser.next()? {
            match arg {
                Long("help") | Short('h') => return Err(Stop::Help),
                Long("group") => {
                    options.groups.push(args::value(parser, "group", "a group's name")?);
                }
                Long("plane") => {
                    let expected = "nine numbers: a corner and two edges";
                    let [a, b, c, d, e, f, g, h, i] = args::numbers(parser, "plane", expected)?;
                    let edges = [DVec3::new(d, e, f), DVec3::new(g, h, i)];
                    options.planes.push(GridPlane { origin: DVec3::new(a, b, c), edges });
                }
                Long("height") => options.height = Some(length(parser, "height")?),
                Long("strip") => options.strip = Some(length(parser, "strip")?),
                Long("spacing") => options.spacing = Some(length(parser, "spacing")?),
                Long("metre") => options.metre = args::value(parser, "metre", "a length")?,
                Long("photometric") => options.quantity = Quantity::Illuminance,
                Long("out") => out = Some(PathBuf::from(parser.value()?)),
                Value(path) => scenes.push(path.into()),
                Long(name) => {
                    let name = name.to_string();
                    if !options.light.option(&name, parser)? {
                        return Err(Long(&name).unexpected().into());
                    }
                }
                _ => return Err(arg.unexpected().into()),
            }
        }
        options.scene = args::only_scene(scenes)?;
        options.stem = args::stem(out, options.scene.with_extension(""), &["csv", "png"]);
        Ok(options)
    }

    /// The file that ends so.
    fn file(&self, ending: &str) -> PathBuf {
        let mut name = self.stem.clone().into_os_string();
        name.push(format!(".grid{ending}"));
        name.into()
    }

    fn settings(&self, strip: f64) -> GridSettings {
        let strip = self.strip.unwrap_or(strip);
        GridSettings { metre: self.metre, strip, spacing: self.spacing }
    }

    /// Where it is measured.
    fn grids(&self, scene: &Scene) -> Result<Vec<Placed>, Error> {
        let up = self.light.reading.sky.up().unwrap_or_else(|| up_axis(scene));
        let (task, floor) = (self.settings(0.0), self.settings(GridSettings::default().strip));
        if self.groups.is_empty() && self.planes.is_empty() {
            let height = self.height.unwrap_or(DESK_HEIGHT);
            let grids = MeasuringGrid::above_floors(scene, up, height, &floor)?;
            if grids.is_empty() {
                let found = format!("nothing is large enough where {up} is up");
                let remedy = "name a --group or give a --plane; --metre tells the scene's unit";
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
        let lit = &light.baked.light;
        let mut gatherer = light.device.gather_to_noise(lit, self.light.noise())?;
        progress::of_count("points", |report| {
            let measure = |(_, grid): &Placed| {
                let measured = grid.measure(lit, &mut *gatherer, |done, of| {
                    report(done, of)?;
                    interrupt::flow()
                });
                measured.transpose()
            };
            let measured: Option<Result<Vec<MeasuredGrid>, Error>> =
                grids.iter().map(measure).collect();
            measured.transpose()
        })
    }

    fn write(&self, grids: &[Placed], measured: &[MeasuredGrid]) -> Result<(), Error> {
        for (k, ((place, _), measured)) in grids.iter().zip(measured).enumerate() {
            let name = format!("{} {}", k + 1, measured.grid.name);
            let Some(statistics) = measured.statistics(self.quantity) else {
                say!("{name}: all points are inside of solids");
                continue;
            };
            say!("{}", self.line(&name, measured, &statistics));
            let number = if grids.len() > 1 { format!("-{}", k + 1) } else { String::new() };
            self.draw(measured, &statistics, place, &self.file(&format!("{number}.png")))?;
        }
        progress::of_writing(&self.file(".csv"), |path| {
            let bytes = table::csv(measured, self.quantity)
                .map_err(|e| cannot_make(path, e.to_string()))?;
            args::write_file(path, &bytes)
        })
    }

    fn draw(
        &self,
        measured: &MeasuredGrid,
        statistics: &GridStatistics,
        place: &str,
        file: &Path,
    ) -> Result<(), Error> {
        let (quantity, metre) = (self.quantity, self.metre);
        let picture = Picture { measured, statistics, quantity, place, metre };
        progress::of_writing(file, |path| {
            args::write_file(path, &picture.png().map_err(|found| cannot_make(path, found))?)
        })
    }

    fn line(&self, name: &str, measured: &MeasuredGrid, statistics: &GridStatistics) -> String {
        let GridStatistics { points, mean, mean_error, minimum, maximum, uniformity, .. } =
            statistics;
        let [a, b] = measured.grid.cell().map(|edge| edge / self.metre);
        let inside = measured.values.iter().flatten().count() - points;
        let unit = self.quantity.unit();
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

fn cannot_make(file: &Path, found: impl Into<String>) -> Error {
    Error::new(ErrorKind::File, file.display().to_string(), found, "please report it")
}
