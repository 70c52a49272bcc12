//! Luminaires, as the command line and lists name them.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;
use radiosity::glam::DVec3;
use radiosity::io::{Photometry, PhotometrySettings};
use radiosity::scene::Luminaire;
use radiosity::{Error, ErrorKind, Rgb, Scene};
use serde_json::{Value as Json, json};

use crate::args::{self, Parsed, give, value};

/// What `--luminaire` takes.
const LUMINAIRE: &str =
    "FILE@x,y,z, with :AIM and :C0 behind it where needed, both x,y,z, and *SCALE";

/// Luminaires that the options name.
#[derive(Args)]
pub struct LuminaireOptions {
    /// Lamp with the intensities of FILE (.ies LM-63, .ldt EULUMDAT) at x,y,z; :x,y,z the direction
    /// that it is aimed along [down], :x,y,z the direction of C = 0° [+x], *SCALE a factor or r,g,b
    /// [1]; may be repeated
    #[arg(long, value_name = "FILE@x,y,z…", value_parser = luminaire)]
    luminaire: Vec<Given>,
    /// Lamps as a JSON list of {"file": "a.ies", "at": [x, y, z]}, with "aim", "c0" and "scale"
    /// where needed; files are in the folder of the list; may be repeated
    #[arg(long, value_name = "LIST.json", hide = true)]
    luminaires: Vec<PathBuf>,
    /// Set of lamps, from 1, of EULUMDAT files with several, which are alternatives
    #[arg(long, value_name = "N", value_parser = value::<usize>("a whole number from 1"))]
    #[arg(hide = true)]
    lamp_set: Option<usize>,
}

/// A luminaire as an option names it.
#[derive(Clone, Debug)]
struct Given {
    file: PathBuf,
    position: DVec3,
    aim: Option<DVec3>,
    c0: Option<DVec3>,
    scale: Rgb,
}

/// Luminaires, their files read.
#[derive(Clone, Debug)]
pub struct Luminaires {
    placed: Vec<(Given, Arc<Photometry>)>,
    /// Each file that was read.
    files: Vec<(PathBuf, Arc<Photometry>)>,
    settings: PhotometrySettings,
    metres_per_unit: f64,
}

impl LuminaireOptions {
    /// Reads the files of luminaires, for a scene whose unit is `metres_per_unit` long.
    ///
    /// # Errors
    /// Those of [`PhotometrySettings::read`]; [`ErrorKind`] `File` and `Setting` for lists.
    pub fn read(&self, metres_per_unit: f64) -> Result<Luminaires, Error> {
        let mut settings = PhotometrySettings::default();
        settings.lamp_set = self.lamp_set;
        let mut read = Luminaires { placed: vec![], files: vec![], settings, metres_per_unit };
        for given in &self.luminaire {
            read.place(given.clone())?;
        }
        self.luminaires.iter().try_for_each(|list| read.place_list(list))?;
        Ok(read)
    }
}

impl Luminaires {
    pub fn is_empty(&self) -> bool {
        self.placed.is_empty()
    }

    /// `scene` with these luminaires beside its own, whose unit of length is the metre. Without an
    /// aim they look down.
    ///
    /// # Errors
    /// Those of [`Scene::with_luminaires`].
    pub fn over(&self, scene: Scene) -> Result<Scene, Error> {
        if self.is_empty() && scene.luminaires().is_empty() {
            return Ok(scene);
        }
        let down = -scene.up();
        let metres = self.metres_per_unit;
        let luminaire = |(given, photometry): &(Given, Arc<Photometry>)| {
            let aim = given.aim.unwrap_or(down);
            let plain = photometry.luminaire(given.position, aim).in_unit_of(metres);
            let (c0, scale) = (given.c0.unwrap_or(plain.c0), plain.scale * given.scale);
            Luminaire { c0, scale, ..plain }
        };
        let of_file = |lamp: &Luminaire| lamp.clone().in_unit_of(metres);
        let own = scene.luminaires().iter().map(of_file);
        let all = own.chain(self.placed.iter().map(luminaire)).collect();
        scene.with_luminaires(all)
    }

    /// The positions, and the aims that are given.
    pub fn aims(&self) -> Vec<(DVec3, Option<DVec3>)> {
        self.placed.iter().map(|(given, _)| (given.position, given.aim)).collect()
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
        let entry = |(given, photometry): &(Given, Arc<Photometry>)| {
            let Given { file, position, aim, c0, scale } = given;
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
            let count = self.placed.iter().filter(|(given, _)| given.file == *file).count();
            let (file, name, flux) =
                (file.display(), &photometry.name, photometry.intensity.flux());
            format!("luminaire  {file} ({name}): {count} of {flux:.1} lm")
        };
        self.files.iter().map(line).collect()
    }

    /// Adds a luminaire.
    fn place(&mut self, given: Given) -> Result<(), Error> {
        let photometry = self.photometry(&given.file)?;
        self.placed.push((given, photometry));
        Ok(())
    }

    /// What `file` holds, read once.
    fn photometry(&mut self, file: &Path) -> Result<Arc<Photometry>, Error> {
        if let Some((_, known)) = self.files.iter().find(|(path, _)| path == file) {
            return Ok(known.clone());
        }
        let photometry = Arc::new(self.settings.read(file)?);
        self.files.push((file.into(), photometry.clone()));
        Ok(photometry)
    }

    /// Adds the luminaires of a JSON list, whose files are in its folder.
    fn place_list(&mut self, path: &Path) -> Result<(), Error> {
        let wrong = |kind, found: String| {
            let remedy = "give a list of {\"file\": \"a.ies\", \"at\": [x, y, z]}, perhaps with \
                          \"aim\", \"c0\" and \"scale\"";
            Error::new(kind, path.display().to_string(), found, remedy)
        };
        let length = std::fs::metadata(path).map_or(0, |about| about.len());
        if length > 64 << 20 {
            return Err(wrong(ErrorKind::File, format!("{length} bytes")));
        }
        let bytes = std::fs::read(path)
            .map_err(|e| wrong(ErrorKind::File, format!("cannot be read: {e}")).with_source(e))?;
        let list: Vec<Entry> = serde_json::from_slice(&bytes)
            .map_err(|e| wrong(ErrorKind::Setting, e.to_string()).with_source(e))?;
        let folder = path.parent().unwrap_or(Path::new(""));
        for Entry { file, at, aim, c0, scale } in list {
            let file = folder.join(file);
            let scale = match scale {
                None => Rgb::ONE,
                Some(Scale::Grey(grey)) => Rgb::splat(grey),
                Some(Scale::Colour(colour)) => colour,
            };
            self.place(Given { file, position: at, aim, c0, scale })?;
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

/// `FILE@x,y,z`, with an aim, a direction of C = 0° and a scale where they are given.
fn luminaire(text: &str) -> Parsed<Given> {
    let wrong = || give(LUMINAIRE);
    let (file, rest) = text.rsplit_once('@').ok_or_else(wrong)?;
    let (axes, scale) = rest.rsplit_once('*').unwrap_or((rest, "1"));
    let vector = |text| args::numbers(LUMINAIRE)(text).map(DVec3::from_array);
    let vectors = axes.split(':').map(vector).collect::<Parsed<Vec<DVec3>>>()?;
    let ([position] | [position, _] | [position, _, _]) = vectors[..] else { return Err(wrong()) };
    let (aim, c0) = (vectors.get(1).copied(), vectors.get(2).copied());
    let scale = args::rgb(scale).map_err(|_| wrong())?;
    Ok(Given { file: file.into(), position, aim, c0, scale })
}
