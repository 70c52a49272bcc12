//! Light in bands: what materials are in each, from a JSON file, and the files of that light.

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::path::Path;

use radiosity::bands::{Band, BandError, BandLight, BandMaterial, Bands};
use radiosity::scene::Luminaire;
use radiosity::{BakeResult, Error, ErrorKind, Scene};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::{args, interrupt, progress};

/// A file of bands.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BandFile {
    /// Where its numbers are from; for the reader.
    #[serde(rename = "source")]
    _source: Option<String>,
    bands: Vec<BandEntry>,
    materials: BTreeMap<String, MaterialEntry>,
    #[serde(default)]
    sky: Spectrum,
    #[serde(default)]
    sun: Spectrum,
    /// Of all luminaires alike; none is dark.
    luminaires: Option<Spectrum>,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "a band is a wavelength in nm, a name, or {name, wavelength}")]
enum BandEntry {
    Wavelength(f64),
    Name(String),
    Both { name: String, wavelength: f64 },
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MaterialEntry {
    reflectance: Spectrum,
    #[serde(default)]
    transmittance: Spectrum,
    /// Radiance.
    #[serde(default)]
    emission: Spectrum,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "give a number for all bands, a list of one a band, or {nm: value}")]
enum Spectrum {
    Same(f64),
    Each(Vec<f64>),
    /// By wavelengths in nm; linear in between.
    Table(BTreeMap<String, f64>),
}

impl Default for Spectrum {
    fn default() -> Spectrum {
        Spectrum::Same(0.0)
    }
}

impl From<&BandEntry> for Band {
    fn from(entry: &BandEntry) -> Band {
        match entry {
            BandEntry::Wavelength(nm) => Band { name: nm.to_string(), wavelength: Some(*nm) },
            BandEntry::Name(name) => Band { name: name.clone(), wavelength: None },
            BandEntry::Both { name, wavelength } => {
                Band { name: name.clone(), wavelength: Some(*wavelength) }
            }
        }
    }
}

impl Spectrum {
    /// Its value in each band, or what is wrong with it and what would be right.
    fn values(&self, bands: &[Band]) -> Result<Vec<f64>, (String, &'static str)> {
        match self {
            Spectrum::Same(value) => Ok(vec![*value; bands.len()]),
            Spectrum::Each(values) if values.len() == bands.len() => Ok(values.clone()),
            Spectrum::Each(values) => {
                let found = format!("{} values for {} bands", values.len(), bands.len());
                Err((found, "give one for each band"))
            }
            Spectrum::Table(table) => {
                let mut points = vec![];
                for (nm, &value) in table {
                    let bad = |_| (format!("'{nm}'"), "name wavelengths by numbers, in nm");
                    points.push((nm.parse::<f64>().map_err(bad)?, value));
                }
                points.sort_by(|a, b| a.0.total_cmp(&b.0));
                bands.iter().map(|band| interpolated(&points, band)).collect()
            }
        }
    }
}

/// The value of a table, by ascending wavelength, in `band`.
fn interpolated(points: &[(f64, f64)], band: &Band) -> Result<f64, (String, &'static str)> {
    let missing = |what: &str| format!("nothing for band {}{what}", band.name);
    let Some(nm) = band.wavelength else {
        let remedy = "give bands wavelengths, or a list of values";
        return Err((missing(", which has no wavelength"), remedy));
    };
    let after = points.partition_point(|&(at, _)| at < nm);
    match (points.get(after.wrapping_sub(1)), points.get(after)) {
        (_, Some(&(at, value))) if at == nm => Ok(value),
        (Some(&(low, a)), Some(&(high, b))) => Ok(a + (b - a) * (nm - low) / (high - low)),
        _ => Err((missing(""), "give wavelengths on both sides of each band's")),
    }
}

/// What the file `path` says of the materials of `scene`.
///
/// # Errors
/// [`ErrorKind::File`] where it cannot be read or is not understood; those of [`Bands::check`].
pub fn read(path: &Path, scene: &Scene) -> Result<Bands, Error> {
    let file = path.display().to_string();
    let bytes = std::fs::read(path).map_err(|e| {
        let found = format!("cannot be read: {e}");
        wrong(file.clone(), found, "give a JSON file that can be read").with_source(e)
    })?;
    let BandFile { bands, materials, sky, sun, luminaires, .. } = serde_json::from_slice(&bytes)
        .map_err(|e| {
            let place = format!("{file}:{}", e.line());
            let remedy = "give bands, and materials with their reflectance: see docs/bands.md";
            wrong(place, e.to_string(), remedy).with_source(e)
        })?;
    let bands: Vec<Band> = bands.iter().map(Band::from).collect();
    let values = |spectrum: &Spectrum, what: &str| {
        let place = || format!("{file}: {what}");
        spectrum.values(&bands).map_err(|(found, remedy)| wrong(place(), found, remedy))
    };
    let of_bands = of_materials(&materials, scene, &file, values)?;
    let (sky, sun) = (values(&sky, "sky")?, values(&sun, "sun")?);
    let luminaires = match luminaires {
        Some(spectrum) => values(&spectrum, "luminaires")?,
        None if scene.luminaires().is_empty() => vec![],
        None => {
            let remedy = "give luminaires, what their intensities count in each band, or 0";
            return Err(wrong(file, "nothing of luminaires".into(), remedy));
        }
    };
    // A scale is for all bands, as a number of three channels is.
    let of_luminaire = |lamp: &Luminaire| {
        let scale = lamp.scale.element_sum() / 3.0;
        luminaires.iter().map(|value| scale * value).collect()
    };
    let luminaires = scene.luminaires().iter().map(of_luminaire).collect();
    let bands = Bands { bands, materials: of_bands, sky, sun, luminaires };
    bands.check(scene)?;
    Ok(bands)
}

fn wrong(place: String, found: String, remedy: &str) -> Error {
    Error::new(ErrorKind::File, place, found, remedy)
}

/// What the `materials` of a `file` are in the scene's, in their order; `values` reads a spectrum.
fn of_materials(
    materials: &BTreeMap<String, MaterialEntry>,
    scene: &Scene,
    file: &str,
    values: impl Fn(&Spectrum, &str) -> Result<Vec<f64>, Error>,
) -> Result<Vec<BandMaterial>, Error> {
    let known = |name: &String| scene.materials().iter().any(|material| material.name == *name);
    if let Some(name) = materials.keys().find(|name| *name != "*" && !known(name)) {
        let found = format!("material '{name}', which is not there");
        return Err(wrong(file.into(), found, "name materials as the scene does"));
    }
    let mut of_bands = vec![];
    for material in scene.materials() {
        let name = &material.name;
        let entry = materials.get(name).or_else(|| materials.get("*")).ok_or_else(|| {
            let remedy = "give it an entry, or one for all others, *";
            wrong(file.into(), format!("nothing of material '{name}'"), remedy)
        })?;
        let of = |what: &str| format!("{what} of '{name}'");
        let emission = values(&entry.emission, &of("emission"))?;
        of_bands.push(BandMaterial {
            reflectance: values(&entry.reflectance, &of("reflectance"))?,
            transmittance: values(&entry.transmittance, &of("transmittance"))?,
            exitance: emission.into_iter().map(|radiance| PI * radiance).collect(),
        });
    }
    Ok(of_bands)
}

/// The bands of the file `path`, told what the bake does not see of them.
pub fn read_and_warn(path: &Path, scene: &Scene) -> Result<Bands, Error> {
    let bands = progress::of_reading(path, || read(path, scene))?;
    let unseen = bands.unseen_by(scene);
    if !unseen.is_empty() {
        eprintln!(
            "warning: {}: the mesh is not refined by their light in bands, which red, green and \
             blue do not have; give them some, by Kd, Ke or --emit",
            unseen.join(", ")
        );
    }
    Ok(bands)
}

/// The light of `bands`, if there are any; none where Ctrl-C stopped it.
pub fn light(bands: Option<&Bands>, baked: &BakeResult) -> Result<Option<BandLight>, Error> {
    let Some(bands) = bands.filter(|_| !interrupt::stopped()) else { return Ok(None) };
    progress::of_count("rows of vertices, for all bands", |report| bands.light(baked, report))
}

/// A line a vertex: its position, then radiosity, irradiance and error by band.
pub fn table(light: &BandLight) -> Vec<u8> {
    let count = light.bands.len();
    let columns = [
        ("radiosity", &light.radiosity),
        ("irradiance", &light.irradiance),
        ("error", &light.noise),
    ];
    let mut head = "x,y,z".to_string();
    for (what, _) in columns {
        light.bands.iter().for_each(|band| head += &format!(",{what}_{}", band.name));
    }
    let lines = light.surface.positions.iter().enumerate().map(|(v, position)| {
        let values = columns.iter().flat_map(|(_, values)| &values[v * count..][..count]);
        position.to_array().iter().chain(values).map(f64::to_string).collect()
    });
    args::csv(&head, lines)
}

/// What the report tells of each band: its error and its sweeps, by name.
pub fn report(light: &BandLight) -> Value {
    let bands = light.bands.iter().zip(&light.errors).zip(&light.sweeps);
    let entry = |((band, error), sweeps): ((&Band, &BandError), &u32)| {
        let BandError { total, noise, remainder, of_bake, .. } = *error;
        json!({
            "band": band.name, "wavelength": band.wavelength, "error": total, "noise": noise,
            "remainder": remainder, "of_bake": of_bake, "sweeps": sweeps,
        })
    };
    bands.map(entry).collect()
}

/// A line for the table at the end.
pub fn words(light: &BandLight) -> String {
    let worst =
        light.bands.iter().zip(&light.errors).max_by(|a, b| a.1.total.total_cmp(&b.1.total));
    let worst = worst.map(|(band, error)| {
        format!("error at most about {:.2} %, in band {}", 100.0 * error.total, band.name)
    });
    format!("bands      {}, {}", light.bands.len(), worst.unwrap_or_default())
}
