//! STL files, ASCII and binary, converted to OBJ text, which the OBJ reader reads.
//!
//! | STL | OBJ |
//! |---|---|
//! | `solid NAME` | `g NAME` |
//! | `vertex x y z` | `v x y z`, with the same digits |
//! | `endloop` | `f` with the vertices since the last one |
//!
//! Each line of an ASCII file becomes one line, so that messages name the file's own lines. Normals
//! are only checked; the front is where corners run counter-clockwise, as the format defines it (3D
//! Systems, "StereoLithography Interface Specification", 1989).

use std::fmt::Write as _;
use std::path::Path;

use glam::{DVec3, Vec3};

use super::files;
use super::obj::repairs::Repairs;
use super::text::{place, words};
use crate::error::{Error, ErrorKind};
use crate::scene::WarningKind;

/// Bytes before the triangles of a binary file: a comment of 80, and the number of triangles.
const HEADER: usize = 84;

/// Bytes of a triangle: normal and corners, 12 floats, and two undefined bytes.
const TRIANGLE: usize = 50;

/// Whether `path` has the extension of STL files.
pub(super) fn is_stl(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("stl"))
}

/// OBJ text of the STL file `path` with this content, and its encoding if that is not UTF-8.
pub(super) fn to_obj(
    path: &Path,
    bytes: Vec<u8>,
    repairs: &mut Repairs,
) -> Result<(String, Option<&'static str>), Error> {
    // Binary files may begin with `solid` too, but have the length given by their count.
    let said = bytes
        .get(HEADER - 4..HEADER)
        .map_or(0, |count| u32::from_le_bytes([count[0], count[1], count[2], count[3]]) as usize);
    let is_as_long = said > 0 && bytes.len() == HEADER + TRIANGLE * said;
    if !is_as_long && is_ascii(&bytes) {
        let (text, encoding) = files::decode(bytes);
        return Ok((of_ascii(path, &text, repairs)?, encoding));
    }
    let is_text = |byte: &u8| byte.is_ascii_graphic() || byte.is_ascii_whitespace();
    if bytes.len() < HEADER || !is_as_long && bytes.iter().take(1024).all(is_text) {
        let found = format!("{} bytes with neither a facet nor a binary header", bytes.len());
        let remedy = "give an ASCII or binary STL file";
        return Err(Error::new(ErrorKind::Scene, path.display().to_string(), found, remedy));
    }
    Ok((of_binary(path, &bytes[HEADER..], said, repairs)?, None))
}

/// Whether this is text that begins with a solid or has facets.
fn is_ascii(bytes: &[u8]) -> bool {
    let first = &bytes[..bytes.len().min(1024)];
    let first = files::decode(first.to_vec()).0.to_ascii_lowercase();
    let begins = first.trim_start_matches('\u{feff}').trim_start().starts_with("solid");
    !first.contains('\0') && (begins || first.contains("facet"))
}

/// A facet that is being read.
#[derive(Default)]
struct Facet {
    normal: DVec3,
    corners: Vec<DVec3>,
}

impl Facet {
    /// Whether its normal points away from its front.
    fn is_opposed(&self) -> bool {
        let [a, b, c, ..] = self.corners[..] else { return false };
        (b - a).cross(c - a).dot(self.normal) < 0.0
    }
}

fn of_ascii(path: &Path, text: &str, repairs: &mut Repairs) -> Result<String, Error> {
    let (mut obj, mut facet) = (String::with_capacity(text.len()), Facet::default());
    let end = if text.contains('\n') { '\n' } else { '\r' };
    let text = text.trim_start_matches('\u{feff}');
    let mut last = 0;
    for (line, number) in text.split(end).zip(1..) {
        let line = line.trim();
        let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        match keyword.to_ascii_lowercase().as_str() {
            "solid" => emit(&mut obj, format_args!("g {}", rest.trim().trim_end_matches('\\'))),
            "facet" => {
                let numbers: Vec<f64> = words(rest).skip(1).flat_map(str::parse).collect();
                facet = Facet::default();
                if let [x, y, z] = numbers[..] {
                    facet.normal = DVec3::new(x, y, z);
                }
            }
            "vertex" => {
                let numbers: Vec<&str> = words(rest).take(3).collect();
                let parsed: Vec<f64> = numbers.iter().flat_map(|n| n.parse()).collect();
                facet.corners.push(DVec3::from_slice(&[parsed, vec![f64::NAN; 3]].concat()));
                emit(&mut obj, format_args!("v {}", numbers.join(" ")));
            }
            "endloop" | "endfacet" if !facet.corners.is_empty() => {
                if facet.is_opposed() {
                    note_opposed(repairs, || place(path, number))?;
                }
                emit(&mut obj, format_args!("f"));
                let count = facet.corners.len();
                (1..=count).rev().for_each(|back| emit(&mut obj, format_args!(" -{back}")));
                facet.corners.clear();
            }
            "outer" | "endloop" | "endfacet" | "endsolid" | "" => {}
            // A line that the OBJ reader ignores too.
            _ => emit(&mut obj, format_args!("stl {}", line.trim_end_matches('\\'))),
        }
        obj.push('\n');
        last = number;
    }
    if !facet.corners.is_empty() {
        let done = "the facet that is not complete is left out";
        repairs.note_at(WarningKind::BrokenOff, || place(path, last), "", done)?;
    }
    Ok(obj)
}

/// Triangles of a binary file from the bytes after the header, which gives their number as `said`.
fn of_binary(
    path: &Path,
    bytes: &[u8],
    said: usize,
    repairs: &mut Repairs,
) -> Result<String, Error> {
    let there = bytes.len() / TRIANGLE;
    // Writers that cannot seek leave the count at 0.
    let count = if said == 0 { there } else { said.min(there) };
    if said != there || !bytes.len().is_multiple_of(TRIANGLE) {
        let done =
            format!("its header says {said} triangles, {there} are there, and {count} are read");
        repairs.note_at(WarningKind::BrokenOff, || path.display().to_string(), "", done)?;
    }
    let mut obj = String::with_capacity(2 * bytes.len());
    emit(&mut obj, format_args!("g {}\n", path.file_stem().unwrap_or_default().to_string_lossy()));
    for (triangle, number) in bytes.chunks_exact(TRIANGLE).take(count).zip(1..) {
        let vector = |k: usize| {
            let number = |at: usize| {
                let bytes = &triangle[at..at + 4];
                f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
            };
            Vec3::new(number(12 * k), number(12 * k + 4), number(12 * k + 8))
        };
        let place = || format!("{}: triangle {number}", path.display());
        let corners = [vector(1), vector(2), vector(3)];
        if let Some(corner) = corners.iter().find(|corner| !corner.is_finite()) {
            let found = format!("coordinates {corner}");
            let remedy = "coordinates must be finite numbers";
            return Err(Error::new(ErrorKind::Scene, place(), found, remedy));
        }
        let (normal, corners_f64) = (vector(0).as_dvec3(), corners.map(Vec3::as_dvec3).to_vec());
        if (Facet { normal, corners: corners_f64 }).is_opposed() {
            note_opposed(repairs, place)?;
        }
        for Vec3 { x, y, z } in corners {
            emit(&mut obj, format_args!("v {x} {y} {z}\n"));
        }
        emit(&mut obj, format_args!("f -3 -2 -1\n"));
    }
    Ok(obj)
}

fn note_opposed(repairs: &mut Repairs, place: impl Fn() -> String) -> Result<(), Error> {
    let done = "the order of their corners counts";
    repairs.note_at(WarningKind::OpposedNormal, place, "", done)
}

/// Appends text; writing to a string cannot fail.
fn emit(obj: &mut String, text: std::fmt::Arguments) {
    let _ = obj.write_fmt(text);
}
