//! Scenes from Wavefront OBJ files and their MTL libraries.
//!
//! One pass over the lines collects positions, and faces with the group, material and smoothing
//! group that are current at their line ([`ObjParser`]). All numbers are checked there, so that an
//! error names its line. Then faces are cut into triangles and the scene is made, with a warning
//! for each kind of thing that was skipped or replaced by a default.

use std::collections::{HashMap, HashSet};
use std::io;
use std::path::Path;

use glam::DVec3;

use super::files::{self, LibrarySource, MAX_BYTES};
use super::mtl::Library;
use super::text::{self, Line, finite, words};
use crate::error::{Error, ErrorKind, quoted};
use crate::geometry::triangulation::{MAX_EAR_CLIPPING_CORNERS, triangulate};
use crate::scene::{Material, Scene, Triangle};

/// Group of the faces that come before any `o` or `g` line.
const DEFAULT_GROUP: &str = "default";

/// Loads a Wavefront OBJ file and the MTL files that it names.
///
/// The front of a face is where its corners run counter-clockwise. A face may have any number of
/// corners, and its outline may be concave, but must not cross itself. It belongs to the group of
/// the latest `o` or `g` line ("default" before the first); a name that comes again continues its
/// group. Lengths stay in the file's own unit. Normals, texture coordinates, points and lines are
/// not used.
///
/// `s` puts the faces up to the next `s` into a smoothing group, whatever `o` and `g` lines come
/// between; `s off` or `s 0` into none (Wavefront, "Object Files (.obj)", Advanced
/// Visualizer 3.0, "Grouping"). In one group surfaces have creases at angles above
/// [`crate::Mesh::CREASE_DEGREES`], else above [`crate::Mesh::COPLANAR_DEGREES`]. Faces before the
/// first `s`, and after one without a group (`s` or `s on`, as some programs write), are as if in a
/// group of their own.
///
/// Of a material, `Kd` is the diffuse reflectance ρ per channel, linear, and `Ke` the emitted
/// radiance L: the exitance becomes π L, in the file's unit times steradian. Faces without a
/// material reflect [`Material::DEFAULT_REFLECTANCE`].
///
/// Files may come from anywhere. MTL files are read from the folder of the OBJ file or
/// below: absolute names and `..` are refused, so that a scene cannot have other files of the
/// machine (or of its network) opened. Only regular files are read, of at most 1 GiB, as are all
/// MTL files of a scene together. Memory stays within forty times the size of the files.
///
/// What is read but not modelled, or replaced by a default, is in [`Scene::warnings`].
///
/// # Errors
/// [`ErrorKind::File`] for a file that cannot be read. [`ErrorKind::Scene`], with file and line,
/// for one whose content cannot be used: numbers that are not finite, corners without a vertex,
/// unknown materials, smoothing groups that are not whole numbers, reflectances outside [0, 1),
/// negative radiances, outlines that cross themselves; and for a scene without a triangle that has
/// area.
pub fn load_obj(path: impl AsRef<Path>) -> Result<Scene, Error> {
    let path = path.as_ref();
    let text = files::read(path, MAX_BYTES);
    read_text(path, text, &LibrarySource::Folder(path.parent().unwrap_or(Path::new(""))))
}

/// [`load_obj`] from memory: an OBJ file of this name, for messages, and this content. `libraries`
/// are the MTL files, name and content, that its `mtllib` lines may name.
///
/// # Errors
/// Those of [`load_obj`].
pub fn read_obj(
    name: impl AsRef<Path>,
    obj: &[u8],
    libraries: &[(&str, &[u8])],
) -> Result<Scene, Error> {
    read_text(
        name.as_ref(),
        files::limited(obj.into(), MAX_BYTES),
        &LibrarySource::Memory(libraries),
    )
}

fn read_text(path: &Path, text: io::Result<String>, files: &LibrarySource) -> Result<Scene, Error> {
    let text = text.map_err(|e| {
        let (place, found) = (path.display().to_string(), format!("cannot be read: {e}"));
        Error::new(ErrorKind::File, place, found, "give a readable OBJ file").with_source(e)
    })?;
    ObjParser::parse(path, &text, files)?.into_scene(path)
}

/// What one pass over the lines finds. Every number is checked here, where its line is known.
#[derive(Default)]
struct ObjParser {
    positions: Vec<DVec3>,
    /// Of all faces, one after the other, as indices into the positions.
    corners: Vec<u32>,
    faces: Vec<Face>,
    groups: Vec<String>,
    group_by_name: HashMap<String, u32>,
    /// What the latest `o` or `g` line says, and its index once a face needs it.
    group_name: String,
    group: Option<u32>,
    library: Library,
    material: Option<u32>,
    /// By the latest `s` line, as in [`Triangle::smoothing`].
    smoothing: Option<u32>,
    /// `s` lines with neither a group nor `off`.
    without_group: usize,
    first_without_group: String,
    points_and_lines: usize,
    unknown: usize,
    first_unknown: String,
}

/// Where a face stands and what it belongs to.
struct Face {
    line: usize,
    /// Where its corners end, which begin where those of the face before it end.
    end: u32,
    group: u32,
    material: Option<u32>,
    smoothing: Option<u32>,
}

impl ObjParser {
    fn parse(path: &Path, text: &str, files: &LibrarySource) -> Result<ObjParser, Error> {
        let mut parser = ObjParser::default();
        text::lines(path, text).try_for_each(|line| parser.line(&line, files))?;
        if parser.faces.is_empty() {
            let mut found = format!("no face, {} vertices", parser.positions.len());
            if parser.unknown > 0 {
                found += &format!(", {} lines that are not OBJ", parser.unknown);
            }
            let remedy = "give an OBJ file with `v` and `f` lines";
            return Err(Error::new(ErrorKind::Scene, path.display().to_string(), found, remedy));
        }
        Ok(parser)
    }

    fn line(&mut self, line: &Line, files: &LibrarySource) -> Result<(), Error> {
        let (keyword, rest) = line.keyword();
        match keyword {
            "v" => self.vertex(line, rest)?,
            "f" => self.face(line, rest)?,
            "o" | "g" => (self.group_name, self.group) = (rest.into(), None),
            "usemtl" => self.material = Some(self.use_material(line, rest)?),
            "s" => self.smooth(line, rest)?,
            "mtllib" => self.library.load(line, rest, files)?,
            "p" | "l" => self.points_and_lines += 1,
            "vt" | "vn" | "" => {}
            comment if comment.starts_with('#') => {}
            _ => {
                if self.unknown == 0 {
                    self.first_unknown = line.place();
                }
                self.unknown += 1;
            }
        }
        Ok(())
    }

    /// `v x y z`, with a fourth number to divide by, or with a colour, which is left out.
    fn vertex(&mut self, line: &Line, rest: &str) -> Result<(), Error> {
        let words: Vec<&str> = words(rest).take(7).collect();
        let used = match words.len() {
            3 | 4 => &words[..],
            6 => &words[..3],
            n => {
                return Err(
                    line.parse_error(format!("{n} words after `v`"), "a vertex is `v x y z`")
                );
            }
        };
        let mut numbers = [0.0, 0.0, 0.0, 1.0];
        for (number, word) in numbers.iter_mut().zip(used) {
            *number = finite(word).ok_or_else(|| {
                let found = format!("coordinate {}", quoted(&[word]));
                line.parse_error(found, "coordinates must be finite numbers")
            })?;
        }
        let [x, y, z, w] = numbers;
        let position = DVec3::new(x, y, z) / w;
        if !position.is_finite() {
            return Err(line.parse_error(format!("weight {w}"), "leave the fourth number out"));
        }
        self.positions.push(position);
        Ok(())
    }

    /// `f` and its corners: `v`, `v/vt`, `v//vn` or `v/vt/vn` each.
    fn face(&mut self, line: &Line, rest: &str) -> Result<(), Error> {
        if words(rest).next().is_none() {
            return Err(line.parse_error("a face without corners", "write `f` and three or more"));
        }
        for word in words(rest) {
            self.corners.push(self.corner(line, word)?);
        }
        let group = self.current_group();
        let (material, smoothing, end) = (self.material, self.smoothing, self.corners.len() as u32);
        self.faces.push(Face { line: line.number, end, group, material, smoothing });
        Ok(())
    }

    /// The vertex of a corner, which must exist.
    fn corner(&self, line: &Line, word: &str) -> Result<u32, Error> {
        let bad = |found: &str, remedy: String| {
            Err(line.parse_error(format!("corner {}, {found}", quoted(&[word])), remedy))
        };
        let mut parts = word.split('/');
        let vertex = parts.next().unwrap_or(word);
        let Ok(index) = vertex.parse::<i64>() else {
            return bad("not a vertex index", "write `v`, `v/vt`, `v//vn` or `v/vt/vn`".into());
        };
        let is_integer_or_empty = |part: &str| part.is_empty() || part.parse::<i64>().is_ok();
        if parts.clone().count() > 2 || !parts.all(is_integer_or_empty) {
            return bad("not whole numbers", "write `v`, `v/vt`, `v//vn` or `v/vt/vn`".into());
        }
        if index == 0 {
            return bad("vertex index 0", "count from 1, or back from -1".into());
        }
        let count = self.positions.len();
        if index.unsigned_abs() > count as u64 {
            return match count {
                0 => bad("but no vertex so far", "put `v` lines above the faces".into()),
                n => bad(
                    &format!("vertex index {index} of {n} vertices so far"),
                    format!("use 1 to {n}, or -1 to -{n} counting back"),
                ),
            };
        }
        Ok(if index > 0 { index - 1 } else { count as i64 + index } as u32)
    }

    /// Index of the group that faces belong to now.
    fn current_group(&mut self) -> u32 {
        let new = self.groups.len() as u32;
        *self.group.get_or_insert_with(|| {
            let name = if self.group_name.is_empty() { DEFAULT_GROUP } else { &self.group_name };
            *self.group_by_name.entry(name.into()).or_insert_with(|| {
                self.groups.push(name.into());
                new
            })
        })
    }

    /// `s` with a group, or with `off`; without either it says nothing.
    fn smooth(&mut self, line: &Line, rest: &str) -> Result<(), Error> {
        self.smoothing = match words(rest).collect::<Vec<_>>().join(" ").as_str() {
            "off" => Some(0),
            "" | "on" => {
                if self.without_group == 0 {
                    self.first_without_group = line.place();
                }
                self.without_group += 1;
                None
            }
            group => Some(group.parse().map_err(|_| {
                let remedy = format!("write `s off`, or `s` and a whole number up to {}", u32::MAX);
                line.parse_error(format!("smoothing group {}", quoted(&[group])), remedy)
            })?),
        };
        Ok(())
    }

    fn use_material(&self, line: &Line, name: &str) -> Result<u32, Error> {
        if name.is_empty() {
            return Err(line.parse_error("no material name", self.library.remedy()));
        }
        let unknown = || {
            let found = format!("unknown material {}", quoted(&[name]));
            line.parse_error(found, self.library.remedy())
        };
        self.library.find(name).ok_or_else(unknown)
    }

    fn into_scene(mut self, path: &Path) -> Result<Scene, Error> {
        let mut warnings = self.warnings();
        let used: HashSet<u32> = self.faces.iter().filter_map(|f| f.material).collect();
        let (mut materials, about) = std::mem::take(&mut self.library).into_materials(&used);
        warnings.extend(about);
        let default = materials.len() as u32;
        if self.faces.iter().any(|f| f.material.is_none()) {
            materials.push(Material::grey("(default)", Material::DEFAULT_REFLECTANCE));
        }
        let triangles = self.triangles(path, default)?;
        let scene = Scene::new(self.positions, triangles, self.groups, materials);
        let mut scene = scene.map_err(|e| e.inside(path))?;
        warnings.into_iter().for_each(|warning| scene.warn(warning));
        Ok(scene)
    }

    /// The faces as triangles, those without a material with that of index `default`.
    fn triangles(&self, path: &Path, default: u32) -> Result<Vec<Triangle>, Error> {
        let mut start = 0;
        let mut triangles = Vec::with_capacity(self.faces.len());
        for (number, face) in self.faces.iter().enumerate() {
            let corners = &self.corners[start..face.end as usize];
            start = face.end as usize;
            let points: Vec<DVec3> = corners.iter().map(|&i| self.positions[i as usize]).collect();
            let pieces = triangulate(&points).ok_or_else(|| {
                let group = quoted(&[&self.groups[face.group as usize]]);
                let found = format!(
                    "face {} ({} corners, group {group}) cannot be cut into triangles",
                    number + 1,
                    corners.len()
                );
                let remedy = format!(
                    "its outline must not cross itself, and may have {MAX_EAR_CLIPPING_CORNERS} \
                     corners unless it is convex; triangles always work"
                );
                Error::new(ErrorKind::Scene, text::place(path, face.line), found, remedy)
            })?;
            let Face { group, smoothing, .. } = *face;
            let material = face.material.unwrap_or(default);
            let triangle = |t: [usize; 3]| {
                let corners = t.map(|i| corners[i]);
                Triangle { corners, group, material, smoothing }
            };
            triangles.extend(pieces.into_iter().map(triangle));
        }
        Ok(triangles)
    }

    /// What was replaced by a default or passed over in the OBJ file.
    fn warnings(&self) -> Vec<String> {
        let mut warnings = vec![];
        let default = Material::DEFAULT_REFLECTANCE;
        match (self.faces.iter().filter(|f| f.material.is_none()).count(), self.faces.len()) {
            (0, _) => {}
            (bare, all) if bare == all => warnings.push(format!(
                "no face names a material: all {all} reflect {default} and emit nothing"
            )),
            (bare, _) => warnings.push(format!(
                "{bare} faces before the first `usemtl` reflect {default} and emit nothing"
            )),
        }
        if self.without_group > 0 {
            let (count, first) = (self.without_group, &self.first_without_group);
            warnings.push(format!(
                "{count} `s` lines without a group, first at {first}: creases by angle alone there"
            ));
        }
        if self.points_and_lines > 0 {
            let count = self.points_and_lines;
            warnings.push(format!("{count} `p` and `l` lines (points and lines) were ignored"));
        }
        if self.unknown > 0 {
            let (count, first) = (self.unknown, &self.first_unknown);
            warnings.push(format!("{count} lines of unknown kind were ignored, first at {first}"));
        }
        warnings
    }
}
