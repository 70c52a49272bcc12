//! Luminaires, as the command line and lists name them.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use lexopt::prelude::*;
use radiosity::camera::up_axis;
use radiosity::glam::DVec3;
use radiosity::io::{Photometry, read_photometry};
use radiosity::{Error, ErrorKind, Luminaire, Rgb, Scene};
use serde_json::{Value as Json, json};

use crate::args::{self, Stop, wrong_value};

/// What `--luminaire` takes.
const LUMINAIRE: &str = "FILE@x,y,z, perhaps with :AIM and :C0 behind it, both x,y,z, and *SCALE";

/// Bytes that a list may have.
const MAX_LIST_BYTES: u64 = 64 << 20;

/// What is said of luminaires.
#[derive(Clone, Debug, Default)]
pub struct LuminaireOptions {
    placed: Vec<Placed>,
    /// Each file that was read.
    files: Vec<(PathBuf, Arc<Photometry>)>,
    metres_per_unit: Option<f64>,
}

/// A luminaire that is to be.
#[derive(Clone, Debug)]
struct Placed {
    file: PathBuf,
    photometry: Arc<Photometry>,
    position: DVec3,
    aim: Option<DVec3>,
    c0: Option<DVec3>,
    scale: Rgb,
}

impl LuminaireOptions {
    /// Takes the value of option `name`, if it is one of these.
    pub fn option(&mut self, name: &str, parser: &mut lexopt::Parser) -> Result<bool, Stop> {
        match name {
            "luminaire" => {
                let text = parser.value()?.string()?;
                let (file, rest) = text.rsplit_once('@').ok_or_else(|| wrong(&text))?;
                let placed = self.place(file.into(), rest)?;
                self.placed.push(placed.ok_or_else(|| wrong(&text))?);
            }
            "luminaires" => {
                let path = PathBuf::from(parser.value()?);
                self.read_list(&path)?;
            }
            "metres-per-unit" => {
                let metres: f64 = args::value(parser, name, "metres, such as 0.001")?;
                if !(metres.is_finite() && metres > 0.0) {
                    return Err(wrong_value(name, &metres.to_string(), "a number above 0"));
                }
                self.metres_per_unit = Some(metres);
            }
            _ => return Ok(false),
        }
        Ok(true)
    }

    pub fn is_empty(&self) -> bool {
        self.placed.is_empty()
    }

    /// `scene` with these luminaires. Without an aim they look down.
    ///
    /// # Errors
    /// Those of [`Scene::with_luminaires`].
    pub fn over(&self, scene: Scene) -> Result<Scene, Error> {
        if self.is_empty() {
            return Ok(scene);
        }
        let down = -up_axis(&scene);
        let metres = self.metres_per_unit.unwrap_or(1.0);
        let luminaire = |placed: &Placed| {
            let aim = placed.aim.unwrap_or(down);
            let plain = placed.photometry.luminaire(placed.position, aim).in_unit_of(metres);
            let (c0, scale) = (placed.c0.unwrap_or(plain.c0), plain.scale * placed.scale);
            Luminaire { c0, scale, ..plain }
        };
        scene.with_luminaires(self.placed.iter().map(luminaire).collect())
    }

    /// What was odd about the files.
    pub fn warnings(&self) -> Vec<String> {
        let of_file = |(file, photometry): &(PathBuf, Arc<Photometry>)| {
            let line = |warning: &String| format!("{}: {warning}", file.display());
            photometry.warnings.iter().map(line).collect::<Vec<_>>()
        };
        self.files.iter().flat_map(of_file).collect()
    }

    /// Each luminaire for the report: what and where it is, and its flux in lumens.
    pub fn report(&self) -> Json {
        let entry = |placed: &Placed| {
            let Placed { file, photometry, position, aim, c0, scale } = placed;
            let axis = |axis: &Option<DVec3>| json!(axis.map(|axis| axis.to_array()));
            json!({
                "file": file.display().to_string(), "name": photometry.name,
                "at": position.to_array(), "aim": axis(aim), "c0": axis(c0),
                "scale": scale.to_array(),
                "lumens": (photometry.intensity.flux() * *scale).to_array(),
                "lamp_lumens": photometry.lamp_flux, "watts": photometry.power,
            })
        };
        self.placed.iter().map(entry).collect()
    }

    /// A line for each file: how many, and the lumens of one.
    pub fn table(&self) -> Vec<String> {
        let line = |(file, photometry): &(PathBuf, Arc<Photometry>)| {
            let count = self.placed.iter().filter(|placed| placed.file == *file).count();
            let (file, name, flux) =
                (file.display(), &photometry.name, photometry.intensity.flux());
            format!("luminaire  {file} ({name}): {count} of {flux:.1} lm")
        };
        self.files.iter().map(line).collect()
    }

    /// The luminaire that what follows the file in `--luminaire` says; none if it makes no sense.
    fn place(&mut self, file: PathBuf, rest: &str) -> Result<Option<Placed>, Error> {
        let (axes, scale) = rest.rsplit_once('*').unwrap_or((rest, "1"));
        let vectors: Option<Vec<DVec3>> = axes.split(':').map(vector).collect();
        let (Some(vectors), Some(scale)) = (vectors, args::rgb(scale)) else { return Ok(None) };
        let ([position] | [position, _] | [position, _, _]) = vectors[..] else { return Ok(None) };
        let (aim, c0) = (vectors.get(1).copied(), vectors.get(2).copied());
        let photometry = self.photometry(&file)?;
        Ok(Some(Placed { file, photometry, position, aim, c0, scale }))
    }

    /// What `file` holds, read once.
    fn photometry(&mut self, file: &Path) -> Result<Arc<Photometry>, Error> {
        if let Some((_, known)) = self.files.iter().find(|(path, _)| path == file) {
            return Ok(known.clone());
        }
        let photometry = Arc::new(read_photometry(file)?);
        self.files.push((file.into(), photometry.clone()));
        Ok(photometry)
    }

    /// Takes the luminaires of a JSON list, whose files lie in its folder.
    fn read_list(&mut self, path: &Path) -> Result<(), Error> {
        let wrong = |kind, found: String| {
            let remedy = "give a list of {\"file\": \"a.ies\", \"at\": [x, y, z]}, perhaps with \
                          \"aim\", \"c0\" and \"scale\"";
            Error::new(kind, path.display().to_string(), found, remedy)
        };
        let length = std::fs::metadata(path).map_or(0, |about| about.len());
        if length > MAX_LIST_BYTES {
            return Err(wrong(ErrorKind::File, format!("{length} bytes")));
        }
        let bytes = std::fs::read(path)
            .map_err(|e| wrong(ErrorKind::File, format!("cannot be read: {e}")).with_source(e))?;
        let list: Vec<Entry> = serde_json::from_slice(&bytes)
            .map_err(|e| wrong(ErrorKind::Setting, e.to_string()).with_source(e))?;
        let folder = path.parent().unwrap_or(Path::new(""));
        for Entry { file, at, aim, c0, scale } in list {
            let file = folder.join(file);
            let photometry = self.photometry(&file)?;
            let scale = match scale {
                None => Rgb::ONE,
                Some(Scale::Grey(grey)) => Rgb::splat(grey),
                Some(Scale::Colour(colour)) => colour,
            };
            self.placed.push(Placed { file, photometry, position: at, aim, c0, scale });
        }
        Ok(())
    }
}

/// An entry of a list.
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    file: PathBuf,
    at: DVec3,
    aim: Option<DVec3>,
    c0: Option<DVec3>,
    scale: Option<Scale>,
}

#[derive(serde::Deserialize)]
#[serde(untagged)]
enum Scale {
    Grey(f64),
    Colour(Rgb),
}

/// `x,y,z`.
fn vector(text: &str) -> Option<DVec3> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|n| n.trim().parse()).collect();
    Some(DVec3::from_array(numbers.ok()?.try_into().ok()?))
}

fn wrong(text: &str) -> Stop {
    wrong_value("luminaire", text, LUMINAIRE)
}
