//! Scenes from Wavefront OBJ files and their MTL libraries.
//!
//! The `tobj` crate reads geometry and materials. A pass before it ([`statements`]) checks and
//! repairs the lines, keeps groups, smoothing groups and the use of materials, and passes on the
//! geometry. Then faces are cut into triangles, materials are completed and repaired, and the scene
//! is built, with a warning for each kind of defect.

mod faces;
mod materials;
pub(super) mod repairs;
mod statements;

use std::collections::HashSet;
use std::io;
use std::path::Path;

use super::SceneSettings;
use super::files::{self, FileSource};
use super::given::emit_on_both_sides;
use super::lights;
use super::mtl::Library;
use super::stl;
use super::text::{self, Line};
use crate::error::{Error, ErrorKind};
use crate::scene::{Scene, SceneTextures, Warning, WarningKind};
use repairs::Repairs;
use statements::{LineFeed, Statements, UNKNOWN_MATERIAL};

/// What files by Blender lack, and how to give it.
const NOT_EXPORTED: &str = "it leaves out lamps, the world, vertex colours and images that have no \
    file of their own: give lamps as faces that emit, --luminaire or --sun, the world as --sky, \
    and save images (Image > Save As) before the export";

/// The scene of the OBJ file `path` with this content.
pub(super) fn read_scene(
    path: &Path,
    bytes: Vec<u8>,
    files: &FileSource,
    settings: &SceneSettings,
) -> Result<Scene, Error> {
    let mut repairs = Repairs::new(settings.strict);
    let (text, encoding) = match stl::is_stl(path) {
        true => stl::to_obj(path, bytes, &mut repairs)?,
        false => files::decode(bytes),
    };
    if let Some(encoding) = encoding {
        let done = format!("read as {encoding}");
        repairs.note_at(WarningKind::Encoding, || path.display().to_string(), "", done)?;
    }
    if !stl::is_stl(path) && text::is_by_blender(&text) {
        repairs.push(Warning::new(WarningKind::Generator, 1, NOT_EXPORTED));
    }
    ObjFile::read(path, text, files, repairs)?.into_scene(settings)
}

/// The content of the OBJ file and its libraries.
struct ObjFile<'a> {
    path: &'a Path,
    files: &'a FileSource<'a>,
    models: Vec<tobj::Model>,
    statements: Statements,
    library: Library,
    repairs: Repairs,
}

impl<'a> ObjFile<'a> {
    fn read(
        path: &'a Path,
        text: String,
        files: &'a FileSource,
        repairs: Repairs,
    ) -> Result<ObjFile<'a>, Error> {
        let (statements, library) = (Statements::default(), Library::default());
        let mut file = ObjFile { path, files, models: vec![], statements, library, repairs };
        let (mut number, mut failure) = (0, None);
        let mut lines = text::lines(path, &text);
        let feed = LineFeed::new(|out: &mut Vec<u8>| {
            while out.is_empty()
                && let Some(line) = lines.next()
            {
                number = line.number;
                if let Err(e) = file.line(&line, out) {
                    failure = Some(e);
                    return Err(io::ErrorKind::InvalidData.into());
                }
            }
            Ok(())
        });
        // No line names a library: those are read by `ObjFile::line`.
        let no_library = |_: &Path| Err(tobj::LoadError::GenericFailure);
        let options = tobj::LoadOptions::default();
        let read = tobj::load_obj_buf(&mut io::BufReader::new(feed), &options, no_library);
        if let Some(failure) = failure {
            return Err(failure);
        }
        let (models, _) = read.map_err(|e| {
            let remedy = "write it as the OBJ format has it";
            let place = text::place(path, number);
            Error::new(ErrorKind::Scene, place, e.to_string(), remedy).with_source(e)
        })?;
        Ok(ObjFile { models, ..file })
    }

    /// Processes `line`, and appends what tobj reads of it to `out`.
    fn line(&mut self, line: &Line, out: &mut Vec<u8>) -> Result<(), Error> {
        match line.keyword() {
            ("mtllib", names) => self.library.load(line, names, self.files, &mut self.repairs),
            _ => self.statements.line(line, &self.library, &mut self.repairs, out),
        }
    }

    fn into_scene(mut self, settings: &SceneSettings) -> Result<Scene, Error> {
        if self.statements.faces.is_empty() {
            return Err(self.without_faces());
        }
        self.find_default_library()?;
        let named = self.named_materials()?;
        if settings.facets {
            self.statements.make_each_face_a_group();
        }
        let models = std::mem::take(&mut self.models);
        let mut geometry = self.geometry(models, &named, settings.texture_coordinates)?;
        let used: HashSet<u32> = geometry.triangles.iter().map(|t| t.material).collect();
        self.library.warn(&used, settings.specular, &settings.emit, &mut self.repairs);
        let mut materials = self.materials(&used, &geometry.triangles, settings)?;
        let textures = self.textures(&used, &mut materials, settings)?;
        emit_on_both_sides(&mut materials, &textures, settings);
        if textures.is_empty() && !settings.texture_coordinates {
            geometry.texture_coordinates = vec![];
        }
        let groups = std::mem::take(&mut self.statements.groups.list);
        let scene = Scene::with_textures(
            geometry.positions,
            geometry.triangles,
            groups,
            materials,
            SceneTextures {
                coordinates: geometry.texture_coordinates,
                of_materials: textures,
                ..SceneTextures::default()
            },
        );
        let mut scene = scene.map_err(|e| e.inside(self.path))?;
        let is_used = |(i, _): &(usize, _)| used.contains(&(*i as u32));
        let emitting = scene.materials().iter().enumerate().filter(is_used).map(|(_, m)| m);
        let (sky, dark) = lights::sky_and_warning(emitting, settings.sky.as_ref(), &settings.emit);
        self.repairs.into_warnings().into_iter().chain(dark).for_each(|w| scene.warn(w));
        scene.with_comments(self.statements.comments).with_sky(sky)
    }

    /// The error that there is no face, with counts of the content.
    fn without_faces(&self) -> Error {
        let mut found = format!("no face, {} vertices", self.statements.positions.len());
        for kind in [
            WarningKind::FewCorners,
            WarningKind::PointsAndLines,
            WarningKind::FreeForm,
            WarningKind::UnknownStatement,
        ] {
            let count = self.repairs.count_of(kind);
            if count > 0 {
                let (one, many) = kind.nouns();
                found += &format!(", {count} {}", if count == 1 { one } else { many });
            }
        }
        let remedy = match stl::is_stl(self.path) {
            true => "give an STL file with facets",
            false => "give an OBJ file with `v` and `f` lines",
        };
        Error::new(ErrorKind::Scene, self.path.display().to_string(), found, remedy)
    }

    /// If materials are undefined and no library was loaded, loads the one with the name of the OBJ
    /// file, as Blender and Assimp do.
    fn find_default_library(&mut self) -> Result<(), Error> {
        let names = &self.statements.materials.list;
        if !self.library.is_empty() || names.is_empty() {
            return Ok(());
        }
        let stem = self.path.file_stem().unwrap_or_default().to_string_lossy();
        let name = self.path.file_name().unwrap_or_default().to_string_lossy();
        let candidates = [format!("{stem}.mtl"), format!("{name}.mtl")];
        let Some(found) = candidates.iter().find_map(|name| self.files.find(name)) else {
            return Ok(());
        };
        let number = self.statements.first_use.first().map_or(0, |&line| line as usize);
        let line = Line { file: self.path, number, text: "usemtl".into() };
        let done = "taken since it has the name of the OBJ file";
        self.repairs.note(WarningKind::LibraryElsewhere, &line, &found, done)?;
        self.library.take(&line, &found, self.files, &mut self.repairs)
    }

    /// For each name of `usemtl` lines, the index of its material: those of the library, then those
    /// that no library defines, then the one of faces without a material.
    fn named_materials(&mut self) -> Result<Vec<u32>, Error> {
        let mut unknown = self.library.materials.len() as u32;
        let there = self.library.contents();
        let mut named = vec![];
        for (name, &line) in self.statements.materials.list.iter().zip(&self.statements.first_use) {
            named.push(match self.library.find(name) {
                Some(known) => known,
                None => {
                    let place = || text::place(self.path, line as usize);
                    let kind = WarningKind::UnknownMaterial;
                    let done = || format!("{UNKNOWN_MATERIAL}{there}");
                    self.repairs.note_at(kind, place, name, done())?;
                    unknown += 1;
                    unknown - 1
                }
            });
        }
        named.push(unknown);
        Ok(named)
    }
}
