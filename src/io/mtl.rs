//! Materials of MTL files.
//!
//! | statement | meaning here |
//! |---|---|
//! | `newmtl` | begins a material |
//! | `Kd` | diffuse reflectance ρ per channel, linear |
//! | `Ke` | emitted radiance L per channel: exitance π L |
//! | `Ka` | radiance, if above 1 and no material has a `Ke`: see [`super::lights`] |
//! | `illum`, `Ks`, `Ni`, `Tf`, `d`, `Tr` | mirrors and glass: see [`super::specular`] |
//! | `Ns` | roughness of Blender's metals |
//! | `d`, `Tr` of others | transparency: not modelled, warned about |
//! | `map_Kd`, `map_Ke` | textures, multiplied by `Kd` and `Ke`: see [`super::textures`] |
//! | `map_d` | a mask: holes where it is below a half |
//!
//! All other statements do not change diffuse light, and are skipped. tobj reads the materials, one
//! at a time so that its large records do not accumulate. It gets only the statements above, with
//! three finite numbers each: it reports no line for others, panics at fewer numbers, and accepts
//! numbers that are not finite.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::io::{self, Write as _};

use super::files::{self, FileSource, MAX_BYTES};
use super::obj::repairs::Repairs;
use super::specular::{MetalStatements, SpecularStatements, SpecularSurfaces};
use super::text::{self, Line, finite, words};
use crate::error::{Error, ErrorKind, quoted_few, shortened};
use crate::scene::{Rgb, Specular, Warning, WarningKind};

/// The materials of all libraries loaded so far.
#[derive(Default)]
pub(super) struct Library {
    pub materials: Vec<MtlMaterial>,
    by_name: HashMap<String, u32>,
    /// Files that were loaded, by their path from the scene's folder.
    files: Vec<String>,
    bytes: u64,
    redefined: BTreeSet<String>,
}

/// One `newmtl` and its statements, as written.
pub(super) struct MtlMaterial {
    pub name: String,
    /// `Kd`.
    pub reflectance: Option<Rgb>,
    /// `Ke`.
    pub radiance: Option<Rgb>,
    /// `Ka`.
    pub ambient: Option<Rgb>,
    /// `map_Kd` and `map_Ke`, with their options.
    pub textures: [Option<Box<str>>; 2],
    /// `map_d`, with its options.
    pub mask: Option<Box<str>>,
    /// `illum` and the statements that it uses.
    pub specular: Option<Specular>,
    /// Whether Blender wrote it.
    by_blender: bool,
    transparent: bool,
    /// Its `newmtl` line, and the file by index.
    line: u32,
    file: u32,
}

impl Library {
    /// Index of the material `name`, with its quotes or without.
    pub fn find(&self, name: &str) -> Option<u32> {
        let named = |name: &str| self.by_name.get(name).copied();
        named(name).or_else(|| named(name.trim_matches('"')))
    }

    /// Whether no file has been loaded.
    pub fn is_empty(&self) -> bool {
        self.files.is_empty()
    }

    /// The materials of the libraries, for the end of a message: `; a.mtl has 'b', 'c'`. Empty if
    /// there is no library.
    pub fn contents(&self) -> String {
        let of_file = |(file, name): (usize, &String)| {
            let names = self.materials.iter().filter(|m| m.file as usize == file);
            let names: Vec<&str> = names.map(|m| m.name.as_str()).collect();
            let names = match names.len() {
                0 => "no material".into(),
                _ => quoted_few(&names, 4),
            };
            format!("; {} has {names}", shortened(name).escape_debug())
        };
        self.files.iter().enumerate().take(2).map(of_file).collect()
    }

    /// Where `material` is defined.
    pub fn place(&self, material: &MtlMaterial, files: &FileSource) -> String {
        text::place(&files.path(&self.files[material.file as usize]), material.line as usize)
    }

    /// Loads the files named by a `mtllib` line: one name or several, each of which may contain
    /// spaces, with or without backslashes before them.
    pub fn load(
        &mut self,
        line: &Line,
        names: &str,
        files: &FileSource,
        repairs: &mut Repairs,
    ) -> Result<(), Error> {
        let whole = names.trim_matches('"');
        if files.find(whole).is_some() {
            self.load_file(line, whole, files, repairs)?;
        } else {
            let words = escaped_words(names);
            let mut at = 0;
            while at < words.len() {
                let most = 8.min(words.len() - at);
                let name = |count: &usize| words[at..at + count].join(" ");
                let known = (1..=most).rev().find(|count| files.find(&name(count)).is_some());
                // A missing name ends at a word with a library's extension.
                let ends = |word: &String| word.to_ascii_lowercase().ends_with(".mtl");
                let to_end = words[at..].iter().position(ends).map_or(words.len() - at, |k| k + 1);
                let count = known.unwrap_or(to_end);
                self.load_file(line, &name(&count), files, repairs)?;
                at += count;
            }
            if words.is_empty() {
                note_missing(line, "", files, repairs)?;
            }
        }
        Ok(())
    }

    /// Loads the library `name`, if it exists and was not loaded before.
    fn load_file(
        &mut self,
        line: &Line,
        name: &str,
        files: &FileSource,
        repairs: &mut Repairs,
    ) -> Result<(), Error> {
        let Some(found) = files.find(name) else {
            return note_missing(line, name, files, repairs);
        };
        if files::plain(&found) != files::plain(name) {
            repairs.note(
                WarningKind::LibraryElsewhere,
                line,
                name,
                format!("'{found}' is taken"),
            )?;
        }
        self.take(line, &found, files, repairs)
    }

    /// Loads the existing file `found`, once.
    pub fn take(
        &mut self,
        line: &Line,
        found: &str,
        files: &FileSource,
        repairs: &mut Repairs,
    ) -> Result<(), Error> {
        if self.files.iter().any(|file| file == found) {
            return Ok(());
        }
        let bytes = match files.read(found, MAX_BYTES.saturating_sub(self.bytes)) {
            Err(e) if e.kind() != io::ErrorKind::FileTooLarge => {
                return note_missing(line, found, files, repairs);
            }
            bytes => bytes.map_err(|e| {
                let found = format!("{} cannot be read: {e}", crate::error::quoted(&[found]));
                line.parse_error_as(ErrorKind::File, found, files.libraries()).with_source(e)
            })?,
        };
        self.bytes += bytes.len() as u64;
        self.files.push(found.into());
        let path = files.path(found);
        let (text, encoding) = files::decode(bytes);
        if let Some(encoding) = encoding {
            let done = format!("read as {encoding}");
            repairs.note_at(WarningKind::Encoding, || path.display().to_string(), "", done)?;
        }
        let by_blender = text::is_by_blender(&text);
        let mut block = Block::default();
        for line in text::lines(&path, &text) {
            if line.keyword().0.eq_ignore_ascii_case("newmtl") {
                self.push(std::mem::take(&mut block), by_blender);
            }
            block.line(&line, repairs)?;
        }
        self.push(block, by_blender);
        Ok(())
    }

    /// Passes `block` to tobj, if it begins with a material.
    fn push(&mut self, block: Block, by_blender: bool) {
        if block.line == 0 {
            return;
        }
        let Ok((materials, _)) = tobj::load_mtl_buf(&mut &*block.statements) else { return };
        for material in materials {
            let index = self.materials.len() as u32;
            if self.by_name.insert(material.name.clone(), index).is_some() {
                self.redefined.insert(material.name.clone());
            }
            let file = self.files.len() as u32 - 1;
            self.materials.push(MtlMaterial {
                line: block.line,
                file,
                ..MtlMaterial::new(material, by_blender)
            });
        }
    }

    /// Names of the `used` materials that are `odd`.
    fn names(&self, used: &HashSet<u32>, odd: &dyn Fn(&MtlMaterial) -> bool) -> Vec<&str> {
        let all = self.materials.iter().enumerate();
        let odd = all.filter(|(i, m)| used.contains(&(*i as u32)) && odd(m));
        odd.map(|(_, m)| m.name.as_str()).collect()
    }

    /// Warns of statements of `used` materials that are not modelled, or only partly.
    /// `emit` are those that the caller lets emit.
    pub fn warn(
        &self,
        used: &HashSet<u32>,
        surfaces: SpecularSurfaces,
        emit: &[(String, Rgb)],
        repairs: &mut Repairs,
    ) {
        let names = |odd: &dyn Fn(&MtlMaterial) -> bool| self.names(used, odd);
        let redefined: Vec<&str> = self.redefined.iter().map(String::as_str).collect();
        let is_specular = |m: &MtlMaterial| m.specular.is_some();
        let shown = surfaces != SpecularSurfaces::Ignore;
        let is_opaque = |m: &MtlMaterial| m.transparent && !(shown && is_specular(m));
        let is_metal = |m: &MtlMaterial| shown && m.is_metal();
        let is_given = |name: &str| emit.iter().any(|(given, _)| given == name);
        let lacks_strength = |m: &MtlMaterial| m.lacks_strength() && !is_given(&m.name);
        let lists = [
            (
                WarningKind::Metal,
                names(&is_metal),
                "`Kd` is all that it reflects: as a mirror by `Ka` (metallic) and the smoothness \
                 in `Ns`, the rest diffusely",
            ),
            (
                WarningKind::EmissionStrength,
                names(&lacks_strength),
                "its strength is 1, as Blender's exporter leaves it out: --emit MATERIAL=STRENGTH \
                 multiplies the image",
            ),
            (
                WarningKind::Transparency,
                names(&is_opaque),
                "opaque: what passes light has `illum` 4, 6, 7 or 9",
            ),
            (WarningKind::Specular, names(&is_specular), surfaces.treatment()),
            (
                WarningKind::RedefinedMaterial,
                redefined,
                "each `usemtl` takes the last one above it",
            ),
        ];
        for (kind, names, done) in lists {
            if !names.is_empty() {
                repairs.push(Warning::new(kind, names.len(), done).naming(names));
            }
        }
    }
}

fn note_missing(
    line: &Line,
    name: &str,
    files: &FileSource,
    repairs: &mut Repairs,
) -> Result<(), Error> {
    // Searching the folder is not repeated for each of many.
    let first = repairs.count_of(WarningKind::MissingLibrary) == 0;
    let there = if first { files.libraries() } else { String::new() };
    let done = format!("its materials are grey; {there}");
    repairs.note(WarningKind::MissingLibrary, line, name, done)
}

/// The words of `text`; a backslash before a space makes it part of a word, and so do quotes.
fn escaped_words(text: &str) -> Vec<String> {
    let mut words = vec![];
    let (mut word, mut quoted) = (String::new(), false);
    let mut letters = text.chars().peekable();
    while let Some(letter) = letters.next() {
        match letter {
            '"' => quoted = !quoted,
            '\\' if letters.peek().is_some_and(|c| c.is_whitespace()) => {
                word.extend(letters.next());
            }
            space if space.is_whitespace() && !quoted => {
                words.push(std::mem::take(&mut word));
            }
            other => word.push(other),
        }
    }
    words.push(word);
    words.retain(|word| !word.is_empty());
    words
}

impl MtlMaterial {
    /// Whether it has any image.
    pub fn has_images(&self) -> bool {
        self.textures.iter().chain([&self.mask]).any(Option::is_some)
    }

    /// Whether it is a metal by Blender, part of whose `Kd` is a mirror.
    pub fn is_metal(&self) -> bool {
        self.by_blender && matches!(self.specular, Some(Specular::Mirror { .. }))
    }

    /// Whether Blender left out the strength of its emission, as it does beside a `map_Ke`.
    fn lacks_strength(&self) -> bool {
        let has_strength = self.radiance.is_some_and(|l| l != Rgb::ZERO);
        self.by_blender && self.textures[1].is_some() && !has_strength
    }

    /// In no file yet.
    fn new(mut material: tobj::Material, by_blender: bool) -> MtlMaterial {
        let emitted = material.unknown_param.remove("map_Ke");
        let text = |key: &str| material.unknown_param.get(key).map(String::as_str);
        let rgb = |colour: Option<[f64; 3]>| colour.map(Rgb::from_array);
        // Files differ in which end of `Tr` is opaque.
        let between = text("transparent").and_then(|t| t.parse().ok());
        let model = material.illumination_model.unwrap_or(0);
        let metal = (by_blender && model == 3).then(|| MetalStatements {
            colour: rgb(material.diffuse).filter(|_| material.diffuse_texture.is_none()),
            metallic: rgb(material.ambient),
            shininess: material.shininess,
        });
        let statements = SpecularStatements {
            model,
            metal,
            specular: rgb(material.specular),
            filter: text("Tf").and_then(colour),
            refractive_index: material.optical_density,
            dissolve: material.dissolve,
            transparency: between,
        };
        MtlMaterial {
            specular: statements.surface(),
            reflectance: rgb(material.diffuse),
            radiance: rgb(material.emissive),
            ambient: rgb(material.ambient),
            textures: [material.diffuse_texture, emitted]
                .map(|name| name.map(String::into_boxed_str)),
            mask: material.dissolve_texture.map(String::into_boxed_str),
            by_blender,
            transparent: material.dissolve.is_some_and(|d| d < 1.0) || between.is_some(),
            name: material.name,
            line: 0,
            file: 0,
        }
    }
}

/// The statements of one material in the form that tobj accepts.
#[derive(Default)]
struct Block {
    statements: Vec<u8>,
    /// Line of `newmtl`; 0 before the first.
    line: u32,
}

/// Statements passed on, spelled as here. Files differ in capitalisation.
const STATEMENTS: [&str; 14] = [
    "newmtl", "Kd", "Ke", "Ka", "Ks", "Tf", "Ni", "Ns", "d", "Tr", "illum", "map_Kd", "map_Ke",
    "map_d",
];

impl Block {
    fn line(&mut self, line: &Line, repairs: &mut Repairs) -> Result<(), Error> {
        let (keyword, rest) = line.keyword();
        let Some(known) = STATEMENTS.iter().find(|known| known.eq_ignore_ascii_case(keyword))
        else {
            return Ok(());
        };
        let handed_on = match *known {
            "newmtl" if !rest.is_empty() => {
                self.line = line.number as u32;
                Some(rest.to_string())
            }
            "newmtl" => None,
            _ if self.line == 0 => None,
            "Kd" | "Ke" | "Ka" | "Ks" | "Tf" => {
                colour(rest).map(|c| format!("{:e} {:e} {:e}", c.x, c.y, c.z))
            }
            "d" | "Tr" | "Ni" | "Ns" => {
                words(rest).last().and_then(finite).map(|x| format!("{x:e}"))
            }
            "illum" => {
                let model = words(rest).next().and_then(finite);
                model.filter(|x| (0.0..256.0).contains(x)).map(|x| format!("{}", x as u8))
            }
            _ => Some(rest.to_string()).filter(|name| !name.is_empty()),
        };
        match handed_on {
            Some(transparency) if *known == "Tr" => {
                if transparency.parse().is_ok_and(|t: f64| 0.0 < t && t < 1.0) {
                    drop(writeln!(self.statements, "transparent {transparency}"));
                }
            }
            // Writing to a vector cannot fail.
            Some(values) => drop(writeln!(self.statements, "{known} {values}")),
            // It counts for few materials.
            None if *known == "Ns" => {}
            None => repairs.note(WarningKind::MaterialStatement, line, "", "passed over")?,
        }
        Ok(())
    }
}

/// Three finite numbers, or one for all channels.
fn colour(rest: &str) -> Option<Rgb> {
    let numbers: Option<Vec<f64>> = words(rest).take(4).map(finite).collect();
    match *numbers? {
        [grey] => Some(Rgb::splat(grey)),
        [r, g, b] => Some(Rgb::new(r, g, b)),
        _ => None,
    }
}
