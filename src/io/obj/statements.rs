//! The pass over an OBJ file before tobj: data that tobj does not return or accept.
//!
//! ```text
//!   lines of the file ──► Statements ──► v, vt, f ──► tobj ──► positions, corners of faces
//!                             │
//!                             ▼
//!                           notes by face: line, group, smoothing group, material
//! ```
//!
//! tobj reads the lines one by one through [`LineFeed`]; the text is not kept. The changes to the
//! lines and their reasons:
//!
//! | statement | input of tobj | reason: tobj |
//! |---|---|---|
//! | `v` | three numbers | takes three more for a colour |
//! | `f` | corners counted from 1, `v` or `v/vt` | accepts bad indices, reports no line |
//! | `vt` | the same; before the first, a `vt` of NaN | gives corners without one that of another |
//! | `o`, `g`, `usemtl` | nothing; a `g` after many corners | keeps 24 bytes a corner until then |
//! | `l`, `p` | nothing | makes faces of lines |
//!
//! Each `g` ends a model, in which tobj numbers vertices by their first use;
//! [`Statements::vertex_order`] is that order.

use std::collections::HashMap;
use std::io::{self, Read, Write as _};

use glam::DVec3;

use super::super::mtl::Library;
use super::super::text::{Line, finite, words};
use super::repairs::Repairs;
use crate::error::{Error, quoted};
use crate::scene::WarningKind;

/// Treatment of faces whose material is unknown.
pub(super) const UNKNOWN_MATERIAL: &str = "they are grey, reflectance 0.5";

/// Attributes of a face beside its corners.
pub(super) struct FaceNote {
    pub line: u32,
    /// As in [`crate::Triangle::smoothing`].
    pub smoothing: Option<u32>,
    /// Index into the groups.
    pub group: u32,
    /// Index into [`Statements::material_uses`].
    pub material: u32,
}

/// A `usemtl` line with faces.
#[derive(Clone, Copy, Default, PartialEq)]
pub(super) struct MaterialUse {
    /// Index into the names of materials; none before the first line, and for one without a name.
    pub name: Option<u32>,
    /// Index into the materials of the libraries, if one above the line defines it.
    pub known: Option<u32>,
}

/// Names in the order of their first use.
#[derive(Default)]
pub(super) struct Names {
    pub list: Vec<String>,
    by_name: HashMap<String, u32>,
}

impl Names {
    fn index(&mut self, name: &str) -> u32 {
        if let Some(&known) = self.by_name.get(name) {
            return known;
        }
        let new = self.list.len() as u32;
        self.by_name.insert(name.into(), new);
        self.list.push(name.into());
        new
    }
}

/// The state after the lines so far.
#[derive(Default)]
pub(super) struct Statements {
    pub faces: Vec<FaceNote>,
    /// Comments before the first face, without `#`, the first of them.
    pub comments: Vec<String>,
    pub material_uses: Vec<MaterialUse>,
    /// Numbers of the vertices from 0, in the order of tobj's models: by first use in each.
    pub vertex_order: Vec<u32>,
    pub groups: Names,
    /// Names of materials that faces use.
    pub materials: Names,
    /// Line of the first use of each of them.
    pub first_use: Vec<u32>,
    /// Positions of all vertices, used or not.
    pub positions: Vec<DVec3>,
    pub texture_coordinates: u32,
    group_name: String,
    group: Option<u32>,
    material_name: String,
    material: MaterialUse,
    material_line: u32,
    smoothing: Option<u32>,
    /// Per vertex, the last model that uses it, counted from 1.
    last_model: Vec<u32>,
    /// Number of models before the current one, and of corners in it.
    models: u32,
    model_corners: usize,
    /// Vertex and texture coordinate of each corner of a face, counted from 1; 0 for none.
    corners: Vec<[u32; 2]>,
}

impl Statements {
    fn comment(&mut self, line: &Line) {
        // Programs name themselves in the first lines.
        let (most_lines, most_characters) = (32, 200);
        if self.faces.is_empty() && self.comments.len() < most_lines {
            let text = line.text.trim_start_matches('#').trim();
            self.comments.push(text.chars().take(most_characters).collect());
        }
    }

    /// Processes `line`, which comes after those that load the `library` so far, and appends its
    /// replacement for tobj to `out`.
    pub fn line(
        &mut self,
        line: &Line,
        library: &Library,
        repairs: &mut Repairs,
        out: &mut Vec<u8>,
    ) -> Result<(), Error> {
        let (keyword, rest) = line.keyword();
        let passed_over = |repairs: &mut Repairs, kind| repairs.note(kind, line, "", "passed over");
        match keyword {
            "v" => self.vertex(line, rest, repairs, out)?,
            "vt" => self.texture_coordinate(rest, out),
            "f" => self.face(line, rest, repairs, out)?,
            "o" | "g" => (self.group_name, self.group) = (rest.into(), None),
            "usemtl" => {
                self.material_name = rest.into();
                self.material = MaterialUse { name: None, known: library.find(rest) };
                self.material_line = line.number as u32;
                if rest.is_empty() {
                    repairs.note(WarningKind::UnknownMaterial, line, "", UNKNOWN_MATERIAL)?;
                }
            }
            "s" => self.smooth(line, rest, repairs)?,
            "p" | "l" => passed_over(repairs, WarningKind::PointsAndLines)?,
            "vn" | "" => {}
            "vp" | "cstype" | "deg" | "bmat" | "step" | "curv" | "curv2" | "surf" | "parm"
            | "trim" | "hole" | "scrv" | "sp" | "end" | "con" => {
                passed_over(repairs, WarningKind::FreeForm)?;
            }
            comment if comment.starts_with('#') => self.comment(line),
            _ => passed_over(repairs, WarningKind::UnknownStatement)?,
        }
        Ok(())
    }

    /// `v x y z`, with a fourth number as divisor, or with a colour, which is left out.
    fn vertex(
        &mut self,
        line: &Line,
        rest: &str,
        repairs: &mut Repairs,
        out: &mut Vec<u8>,
    ) -> Result<(), Error> {
        let words: Vec<&str> = words(rest).take(9).collect();
        let used = if words.len() == 4 { 4 } else { 3 };
        if words.len() < 3 {
            let found = format!("{} words after `v`", words.len());
            return Err(line.parse_error(found, "a vertex is `v x y z`"));
        }
        if ![3, 4, 6, 7].contains(&words.len()) {
            repairs.note(WarningKind::VertexNumbers, line, "", "the first three are its place")?;
        }
        let mut numbers = [0.0, 0.0, 0.0, 1.0];
        for (number, word) in numbers.iter_mut().zip(&words[..used]) {
            *number = finite(word).ok_or_else(|| {
                let found = format!("coordinate {}", quoted(&[word]));
                line.parse_error(found, "coordinates must be finite numbers")
            })?;
        }
        let position = DVec3::from_slice(&numbers) / numbers[3];
        if !position.is_finite() {
            let found = format!("weight {}", numbers[3]);
            return Err(line.parse_error(found, "leave the fourth number out"));
        }
        self.positions.push(position);
        self.last_model.push(0);
        // tobj has the faces alone to read.
        emit(out, format_args!("v 0 0 0\n"));
        Ok(())
    }

    /// `vt u v`; invalid numbers make corners without texture coordinates.
    fn texture_coordinate(&mut self, rest: &str, out: &mut Vec<u8>) {
        if self.texture_coordinates == 0 {
            emit(out, format_args!("vt nan nan\n"));
        }
        self.texture_coordinates += 1;
        let mut words = words(rest);
        let (u, v) = (words.next().unwrap_or("nan"), words.next().unwrap_or("0"));
        match (finite(u), finite(v)) {
            (Some(_), Some(_)) => emit(out, format_args!("vt {u} {v}\n")),
            _ => emit(out, format_args!("vt nan nan\n")),
        }
    }

    /// `f` and its corners: `v`, `v/vt`, `v//vn` or `v/vt/vn` each.
    fn face(
        &mut self,
        line: &Line,
        rest: &str,
        repairs: &mut Repairs,
        out: &mut Vec<u8>,
    ) -> Result<(), Error> {
        let repeated = self.read_corners(line, rest)?;
        let [first, second] = [0, 1].map(|k| self.corners.get(k).map(|c| c[0]));
        if !self.corners.iter().any(|c| Some(c[0]) != first && Some(c[0]) != second) {
            return repairs.note(WarningKind::FewCorners, line, "", "dropped");
        }
        if repeated {
            repairs.note(WarningKind::RepeatedCorner, line, "", "taken for one")?;
        }
        if self.model_corners >= 1 << 14 {
            emit(out, format_args!("g\n"));
            (self.models, self.model_corners) = (self.models + 1, 0);
        }
        self.model_corners += self.corners.len();
        let (line, smoothing, group) = (line.number as u32, self.smoothing, self.current_group());
        let material = self.current_material();
        self.faces.push(FaceNote { line, smoothing, group, material });
        emit(out, format_args!("f"));
        for &[vertex, texture_coordinate] in &self.corners {
            let last = &mut self.last_model[vertex as usize - 1];
            if *last != self.models + 1 {
                *last = self.models + 1;
                self.vertex_order.push(vertex - 1);
            }
            emit(out, format_args!(" {vertex}"));
            if self.texture_coordinates > 0 {
                emit(out, format_args!("/{}", texture_coordinate + 1));
            }
        }
        emit(out, format_args!("\n"));
        Ok(())
    }

    /// Reads the corners of a face, each once where it comes several times in a row; returns
    /// whether one does.
    fn read_corners(&mut self, line: &Line, rest: &str) -> Result<bool, Error> {
        self.corners.clear();
        for word in words(rest) {
            let corner = self.corner(line, word)?;
            self.corners.push(corner);
        }
        let given = self.corners.len();
        self.corners.dedup_by_key(|corner| corner[0]);
        let ends = |corners: &[[u32; 2]]| {
            corners.len() > 1 && corners[0][0] == corners[corners.len() - 1][0]
        };
        while ends(&self.corners) {
            self.corners.pop();
        }
        Ok(self.corners.len() < given)
    }

    /// Turns each face into a group of its own, named `group/n` for the n-th face of its group.
    pub fn make_each_face_a_group(&mut self) {
        let of_file = std::mem::take(&mut self.groups.list);
        let mut counts = vec![0u32; of_file.len()];
        for (number, face) in (0..).zip(&mut self.faces) {
            let count = &mut counts[face.group as usize];
            *count += 1;
            let name = &of_file[face.group as usize];
            // A long name in every face is more memory than the file's size explains.
            self.groups.list.push(match name.len() {
                0..=64 => format!("{name}/{count}"),
                _ => format!("group {}/{count}", face.group + 1),
            });
            face.group = number;
        }
    }

    /// Index of the current group of faces.
    fn current_group(&mut self) -> u32 {
        *self.group.get_or_insert_with(|| {
            let name = if self.group_name.is_empty() { "default" } else { &self.group_name };
            self.groups.index(name)
        })
    }

    /// Index of the current material's use.
    fn current_material(&mut self) -> u32 {
        if self.material.name.is_none() && !self.material_name.is_empty() {
            let name = self.materials.index(&self.material_name);
            if name as usize == self.first_use.len() {
                self.first_use.push(self.material_line);
            }
            self.material.name = Some(name);
        }
        if self.material_uses.last() != Some(&self.material) {
            self.material_uses.push(self.material);
        }
        self.material_uses.len() as u32 - 1
    }

    /// Vertex, which must exist, and texture coordinate, if it exists, of a corner.
    fn corner(&self, line: &Line, word: &str) -> Result<[u32; 2], Error> {
        let bad = |found: &str, remedy: String| {
            Err(line.parse_error(format!("corner {}, {found}", quoted(&[word])), remedy))
        };
        let mut parts = word.split('/');
        let vertex = parts.next().unwrap_or(word);
        let Ok(index) = vertex.parse::<i64>() else {
            return bad("not a vertex index", "write `v`, `v/vt`, `v//vn` or `v/vt/vn`".into());
        };
        let texture_coordinate = parts.clone().next().unwrap_or("");
        let is_integer_or_empty = |part: &str| part.is_empty() || part.parse::<i64>().is_ok();
        if parts.clone().count() > 2 || !parts.all(is_integer_or_empty) {
            return bad("not whole numbers", "write `v`, `v/vt`, `v//vn` or `v/vt/vn`".into());
        }
        let counted = |index: i64, count: u32| {
            let from_start =
                if index < 0 { i64::from(count).checked_add(index)? + 1 } else { index };
            u32::try_from(from_start).ok().filter(|&k| 0 < k && k <= count)
        };
        if index == 0 {
            return bad("vertex index 0", "count from 1, or back from -1".into());
        }
        let vertices = self.positions.len() as u32;
        let Some(vertex) = counted(index, vertices) else {
            return match vertices {
                0 => bad("but no vertex so far", "put `v` lines above the faces".into()),
                n => bad(
                    &format!("vertex index {index} of {n} vertices so far"),
                    format!("use 1 to {n}, or -1 to -{n} counting back"),
                ),
            };
        };
        let texture_coordinate = texture_coordinate.parse().ok();
        let texture_coordinate =
            texture_coordinate.and_then(|k| counted(k, self.texture_coordinates));
        Ok([vertex, texture_coordinate.unwrap_or(0)])
    }

    /// `s` with a group, or with `off`; without either it has no effect.
    fn smooth(&mut self, line: &Line, rest: &str, repairs: &mut Repairs) -> Result<(), Error> {
        let mut words = words(rest);
        let word = words.next().unwrap_or("").to_ascii_lowercase();
        self.smoothing = if word == "off" { Some(0) } else { word.parse().ok() };
        let says_nothing = word.is_empty() || word == "on";
        if words.next().is_some() || (self.smoothing.is_none() && !says_nothing) {
            let done = "the first word counts if it is one, else creases by angle alone";
            repairs.note(WarningKind::SmoothingGroup, line, "", done)?;
        } else if says_nothing {
            let done = "creases by angle alone there";
            repairs.note(WarningKind::SmoothingWithoutGroup, line, "", done)?;
        }
        Ok(())
    }
}

/// Appends text; writing to a vector cannot fail.
fn emit(out: &mut Vec<u8>, text: std::fmt::Arguments) {
    let _ = out.write_fmt(text);
}

/// Text produced on demand: `fill` appends the next piece of it, or nothing at its end.
pub(super) struct LineFeed<F> {
    fill: F,
    buffer: Vec<u8>,
    at: usize,
}

impl<F: FnMut(&mut Vec<u8>) -> io::Result<()>> LineFeed<F> {
    pub fn new(fill: F) -> LineFeed<F> {
        LineFeed { fill, buffer: vec![], at: 0 }
    }
}

impl<F: FnMut(&mut Vec<u8>) -> io::Result<()>> Read for LineFeed<F> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        if self.at == self.buffer.len() {
            self.buffer.clear();
            self.at = 0;
            (self.fill)(&mut self.buffer)?;
        }
        let count = (&self.buffer[self.at..]).read(bytes)?;
        self.at += count;
        Ok(count)
    }
}
