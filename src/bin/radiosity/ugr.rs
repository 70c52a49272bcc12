//! `radiosity ugr`: the unified glare rating of observers.

use std::path::PathBuf;

use clap::Args;
use radiosity::glam::DVec3;
use radiosity::glare::{Glare, GlareSource, Observer};

use crate::args::{self, Output, Parsed, Stop, numbers};
use crate::scene_options::{Input, SceneOptions};
use crate::{interrupt, progress, standard};

/// Computes the unified glare rating (UGR, CIE 117) of observers
#[derive(Args)]
#[command(after_help = "\
`Ke` and skies are luminances, cd/m². The background luminance is found by paths, without a bake; \
sources are luminaires with an opening, and surfaces that emit, those that hang together as one. \
Prints UGR with the standard error by that of the background; writes STEM.ugr.csv, a line a \
source: luminance, cd/m², solid angle, sr, position index, and its L²ω/p². See \
docs/daylight.md.")]
pub struct Options {
    /// Scene: OBJ, glTF or STL
    #[arg(value_name = "SCENE.obj")]
    scene: PathBuf,
    /// Eye and line of sight of an observer, scene unit; may be repeated
    #[arg(long = "observer", value_name = "x,y,z,dx,dy,dz", required = true)]
    #[arg(value_parser = observer)]
    observers: Vec<[DVec3; 2]>,
    #[command(flatten)]
    output: Output,
    #[command(flatten)]
    reading: SceneOptions,
}

/// Eye and line of sight.
fn observer(text: &str) -> Parsed<[DVec3; 2]> {
    let [a, b, c, d, e, f] = numbers("six numbers: the eye and the line of sight")(text)?;
    Ok([DVec3::new(a, b, c), DVec3::new(d, e, f)])
}

impl Options {
    /// Runs the command.
    pub fn run(mut self) -> Result<(), Stop> {
        self.output.name(standard::stem(&self.scene), &["csv"])?;
        self.reading.needs_up = true;
        self.reading.sky.be_photometric();
        let Input { scene, .. } = self.reading.read(&self.scene)?;
        interrupt::catch();
        let mut rows = vec![];
        for (k, &[eye, direction]) in (1..).zip(&self.observers) {
            let observer = Observer { eye, direction, up: scene.up() };
            let glare = progress::of_count("paths", |report| Glare::of(&scene, &observer, report))?;
            let glare = glare.ok_or(Stop::Interrupted)?;
            say!("observer {k}: {}", summary(&glare));
            warnings(k, &glare);
            rows.extend(glare.sources.iter().map(|source| row(k, source)));
        }
        let head = "observer,source,luminance,solid_angle,position_index,term,x,y,z";
        self.output.write("ugr.csv", &args::csv(head, rows));
        progress::print_written();
        args::end()
    }
}

/// The rating in words.
fn summary(glare: &Glare) -> String {
    let background = &glare.background;
    let rating = match glare.rating() {
        Some(rating) => format!("UGR {rating:.2} ± {:.2}", glare.standard_error()),
        None if glare.sources.is_empty() => "UGR undefined: no source in view".into(),
        None => "UGR undefined: the background is black".into(),
    };
    format!(
        "{rating}; background {:.4} cd/m² ± {:.2} %, sources: {}",
        background.luminance,
        100.0 * background.standard_error / background.luminance.max(f64::MIN_POSITIVE),
        glare.sources.len()
    )
}

/// Prints what the rating leaves out, or is not made for.
fn warnings(number: usize, glare: &Glare) {
    let warn = |what: &str, names: &[String]| {
        if !names.is_empty() {
            eprintln!("warning: observer {number}: {what}: {}", names.join(", "));
        }
    };
    warn("behind it, and not counted", &glare.behind);
    warn("without an opening, and not counted: no luminance is known", &glare.without_size);
    // CIE 117-1995, 2: range of the rating.
    let is_odd = |source: &&GlareSource| !(0.0003..=0.1).contains(&source.solid_angle);
    let odd: Vec<String> = glare.sources.iter().filter(is_odd).map(|s| s.name.clone()).collect();
    warn("solid angles outside of 0.0003 to 0.1 sr, for which UGR is made", &odd);
}

/// A line of the table.
fn row(number: usize, source: &GlareSource) -> Vec<String> {
    let GlareSource { name, luminance, solid_angle, direction, position_index } = source;
    let numbers = [*luminance, *solid_angle, *position_index, source.term()];
    let numbers = numbers.into_iter().chain(direction.to_array()).map(|x| x.to_string());
    [number.to_string(), name.clone()].into_iter().chain(numbers).collect()
}
