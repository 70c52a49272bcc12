//! Materials of MTL files.
//!
//! | statement | meaning here |
//! |---|---|
//! | `newmtl` | begins a material |
//! | `Kd` | diffuse reflectance ρ per channel, linear |
//! | `Ke` | emitted radiance L per channel: exitance π L |
//! | `d`, `Tr`, `map_d` | transparency: not modelled, warned about |
//! | `map_Kd`, `map_Ke` | textures: not modelled, warned about |
//!
//! All others do not change diffuse light, and are skipped.

use std::collections::{HashMap, HashSet};
use std::f64::consts::PI;
use std::io;
use std::path::PathBuf;

use super::files::{LibrarySource, MAX_BYTES};
use super::text::{self, Line, finite, words};
use crate::error::{Error, ErrorKind, quoted};
use crate::scene::{Material, Rgb};

/// The materials of all libraries loaded so far.
#[derive(Default)]
pub(super) struct Library {
    entries: Vec<Entry>,
    by_name: HashMap<String, u32>,
    files: HashSet<PathBuf>,
    bytes: u64,
    redefined: Vec<String>,
}

/// One `newmtl` and what follows it.
struct Entry {
    name: String,
    reflectance: Option<Rgb>,
    exitance: Rgb,
    textured: bool,
    transparent: bool,
}

impl Library {
    /// Index of the material that `name` stands for.
    pub fn find(&self, name: &str) -> Option<u32> {
        self.by_name.get(name).copied()
    }

    /// What a `usemtl` that found nothing should have said.
    pub fn remedy(&self) -> String {
        let names: Vec<_> = self.entries.iter().map(|e| &e.name).collect();
        match (self.files.len(), names.len()) {
            (0, _) => "add `mtllib FILE` above it, with a file that defines the material".into(),
            (_, 0) => "define it with `newmtl`: the libraries loaded so far are empty".into(),
            _ => format!("the libraries loaded so far define {}", quoted(&names)),
        }
    }

    /// Loads the files that a `mtllib` line names: one name, which may contain spaces, or several.
    pub fn load(&mut self, line: &Line, names: &str, files: &LibrarySource) -> Result<(), Error> {
        if names.is_empty() {
            return Err(line.parse_error("no file name", "write `mtllib FILE`"));
        }
        let as_one_name = self.read(names, files);
        if as_one_name.is_ok() || names.split_whitespace().nth(1).is_none() {
            return self.take(line, names, as_one_name, files);
        }
        for name in names.split_whitespace() {
            let text = self.read(name, files);
            self.take(line, name, text, files)?;
        }
        Ok(())
    }

    /// The text of file `name`; nothing if it is loaded already.
    fn read(&self, name: &str, files: &LibrarySource) -> io::Result<String> {
        if self.files.contains(&files.path(name)) {
            return Ok(String::new());
        }
        files.read(name, MAX_BYTES.saturating_sub(self.bytes))
    }

    /// Takes in the `text` of file `name`.
    fn take(
        &mut self,
        line: &Line,
        name: &str,
        text: io::Result<String>,
        files: &LibrarySource,
    ) -> Result<(), Error> {
        let text = text.map_err(|e| {
            let found = format!("{} cannot be read: {e}", quoted(&[name]));
            line.parse_error_as(ErrorKind::File, found, files.libraries()).with_source(e)
        })?;
        self.bytes += text.len() as u64;
        let (path, start) = (files.path(name), self.entries.len());
        text::lines(&path, &text).try_for_each(|line| self.line(&line, start))?;
        self.files.insert(path);
        Ok(())
    }

    /// Takes in one line of a file whose first material has the index `start`.
    fn line(&mut self, line: &Line, start: usize) -> Result<(), Error> {
        let (keyword, rest) = line.keyword();
        if keyword == "newmtl" {
            return self.begin(line, rest);
        }
        if !["Kd", "Ke", "d", "Tr", "map_Kd", "map_Ke", "map_d"].contains(&keyword) {
            return Ok(());
        }
        let Some(entry) = self.entries.get_mut(start..).and_then(<[_]>::last_mut) else {
            return Err(
                line.parse_error(format!("`{keyword}` of no material"), "begin with `newmtl`")
            );
        };
        match keyword {
            "Kd" => entry.reflectance = Some(reflectance(line, &entry.name, rest)?),
            "Ke" => entry.exitance = exitance(line, &entry.name, rest)?,
            "map_Kd" | "map_Ke" => entry.textured = true,
            "map_d" => entry.transparent = true,
            _ => {
                let number = words(rest).last().and_then(finite);
                let x =
                    number.ok_or_else(|| unusable_value(line, &entry.name, "a finite number"))?;
                // Files disagree about which end of `Tr` is opaque.
                entry.transparent |= x < 1.0 && (keyword == "d" || x > 0.0);
            }
        }
        Ok(())
    }

    fn begin(&mut self, line: &Line, name: &str) -> Result<(), Error> {
        if name.is_empty() {
            return Err(line.parse_error("a material without a name", "write `newmtl NAME`"));
        }
        if self.by_name.insert(name.into(), self.entries.len() as u32).is_some() {
            self.redefined.push(name.into());
        }
        self.entries.push(Entry {
            name: name.into(),
            reflectance: None,
            exitance: Rgb::ZERO,
            textured: false,
            transparent: false,
        });
        Ok(())
    }

    /// The materials by index, and warnings about those for which `used` holds.
    pub fn into_materials(mut self, used: &HashSet<u32>) -> (Vec<Material>, Vec<String>) {
        self.redefined.sort();
        self.redefined.dedup();
        let names = |odd: fn(&Entry) -> bool| {
            let entries = self.entries.iter().enumerate();
            let odd = entries.filter(|(i, e)| used.contains(&(*i as u32)) && odd(e));
            odd.map(|(_, e)| e.name.clone()).collect::<Vec<_>>()
        };
        let dark = |e: &Entry| e.reflectance.is_none() && e.exitance == Rgb::ZERO;
        let lists = [
            (names(dark), "neither `Kd` nor `Ke`, so they are black"),
            (names(|e| e.textured), "textures, which are not modelled: `Kd` and `Ke` count alone"),
            (names(|e| e.transparent), "transparency, which is not modelled: they are opaque"),
            (self.redefined, "several definitions: each `usemtl` takes the last one above it"),
        ];
        let lists = lists.into_iter().filter(|(names, _)| !names.is_empty());
        let warnings = lists.map(|(n, what)| format!("materials with {what}: {}", quoted(&n)));
        let warnings = warnings.collect();
        let material = |e: Entry| Material {
            name: e.name,
            reflectance: e.reflectance.unwrap_or(Rgb::ZERO),
            exitance: e.exitance,
        };
        (self.entries.into_iter().map(material).collect(), warnings)
    }
}

fn reflectance(line: &Line, name: &str, rest: &str) -> Result<Rgb, Error> {
    let rho = colour(line, name, rest)?;
    if rho.to_array().iter().any(|x| !(0.0..1.0).contains(x)) {
        let right = "a diffuse reflectance of at least 0 and below 1 in each channel";
        return Err(unusable_value(line, name, right));
    }
    Ok(rho)
}

/// `Ke` is radiance L; a diffuse surface then has the exitance π L.
fn exitance(line: &Line, name: &str, rest: &str) -> Result<Rgb, Error> {
    let exitance = PI * colour(line, name, rest)?;
    if !exitance.is_finite() || exitance.min_element() < 0.0 {
        return Err(unusable_value(line, name, "a radiance of at least 0 in each channel"));
    }
    Ok(exitance)
}

/// Three finite numbers, or one for all channels.
fn colour(line: &Line, name: &str, rest: &str) -> Result<Rgb, Error> {
    if let Some(form @ ("spectral" | "xyz")) = words(rest).next() {
        let found = format!("material {}: unsupported form `{form}`", quoted(&[name]));
        return Err(line.parse_error(found, "write linear r g b"));
    }
    let numbers: Option<Vec<f64>> = words(rest).take(4).map(finite).collect();
    match numbers.as_deref() {
        Some(&[grey]) => Ok(Rgb::splat(grey)),
        Some(&[r, g, b]) => Ok(Rgb::new(r, g, b)),
        _ => Err(unusable_value(line, name, "three finite numbers r g b, or one for all three")),
    }
}

fn unusable_value(line: &Line, name: &str, right: &str) -> Error {
    line.parse_error(
        format!("material {}: unusable value", quoted(&[name])),
        format!("write {right}"),
    )
}
