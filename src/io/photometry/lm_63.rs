//! IESNA LM-63 files, of 1986 to 2019.
//!
//! ```text
//! IESNA:LM-63-2002                          since 1991
//! [LUMINAIRE] …                             keywords
//! TILT=NONE                                 or INCLUDE and its numbers, or the name of a file
//! lamps lumens multiplier vertical horizontal type units width length height
//! ballast-factor future-use watts
//! vertical angles …  horizontal angles …  for each horizontal angle its candela values …
//! ```
//!
//! Length is along C = 0°, width across it. ANSI/IESNA LM-63-2002, sections 5.3 to 5.13.

use std::iter::Peekable;
use std::path::Path;

use glam::DVec3;

use super::super::text::{Line, physical_lines};
use super::numbers::{Comma, Numbers};
use super::planes::{ANGLE_TOLERANCE, Planes};
use super::{Photometry, name_of};
use crate::error::{Error, ErrorKind};
use crate::scene::{IntensityDistribution, Opening, Pole};

/// Whether `text` is an LM-63 file: by its first line, or by a line for the tilt.
pub fn is_lm_63(text: &str) -> bool {
    let start = text.trim_start_matches('\u{feff}').trim_start();
    let says = |name: &str| start.get(..name.len()).is_some_and(|s| s.eq_ignore_ascii_case(name));
    says("IES") || physical_lines(Path::new(""), text).any(|line| tilt(&line).is_some())
}

/// The tilt of a line, if it has one.
fn tilt<'a>(line: &'a Line) -> Option<&'a str> {
    let (keyword, value) = line.text.split_once('=')?;
    keyword.trim().eq_ignore_ascii_case("TILT").then_some(value.trim())
}

pub fn read(file: &Path, text: &str) -> Result<Photometry, Error> {
    let separated = read_with(file, text, Comma::Separates);
    let oddities = |read: &Result<Photometry, Error>| {
        read.as_ref().map_or(usize::MAX, |photometry| photometry.warnings.len())
    };
    if oddities(&separated) == 0 || !text.contains(',') {
        return separated;
    }
    // If that gives fewer defects, commas are decimal commas.
    let mut decimal = read_with(file, text, Comma::IsDecimal);
    if oddities(&decimal) >= oddities(&separated) {
        return separated;
    }
    if let Ok(photometry) = &mut decimal {
        photometry.warnings.push("commas are taken for those of decimal fractions".into());
    }
    decimal
}

fn read_with(file: &Path, text: &str, comma: Comma) -> Result<Photometry, Error> {
    let mut warnings = vec![];
    let mut rest = physical_lines(file, text).peekable();
    let (name, tilt) = keywords(&mut rest, comma);
    let mut numbers = Numbers::new(file, rest, comma);
    match tilt.as_deref() {
        Some(none) if none.eq_ignore_ascii_case("NONE") => {}
        Some(include) if include.eq_ignore_ascii_case("INCLUDE") => {
            skip_tilt(&mut numbers, &mut warnings)?;
        }
        Some(name) => {
            let name = crate::error::shortened(name).escape_debug().to_string();
            warnings.push(format!("the tilt's file '{name}' is not read: no tilt is applied"));
        }
        None => warnings.push("there is no line TILT=NONE".into()),
    }
    let header = Header::read(&mut numbers, &mut warnings)?;
    let (planes, polar) = (header.horizontal, header.vertical);
    let angles = numbers.list(polar, "a vertical angle")?;
    let azimuths = numbers.list(planes, "a horizontal angle")?;
    let mut measured = Planes { angles, planes: vec![] };
    for azimuth in azimuths {
        measured.planes.push((azimuth, numbers.list(polar, "a candela value")?));
    }
    measured.sort(&mut warnings);
    measured.scale(header.factor, &mut warnings);
    let intensity = header.distribution(measured, &mut warnings).map_err(|e| e.inside(file))?;
    let left = numbers.left();
    if left > 0 {
        warnings.push(format!("{left} words after the last candela value are left out"));
    }
    Ok(Photometry {
        name,
        intensity: intensity.into(),
        opening: header.opening,
        lamp_flux: header.lamp_flux,
        power: header.power,
        warnings,
    })
}

/// The name of the luminaire by the lines before those of numbers, and its tilt, if it has one.
fn keywords<'a>(
    lines: &mut Peekable<impl Iterator<Item = Line<'a>>>,
    comma: Comma,
) -> (String, Option<String>) {
    let mut names = [const { String::new() }; 3];
    let mut said = None;
    while let Some(line) = lines.next_if(|line| !is_header(line, comma)) {
        said = tilt(&line).map(String::from);
        if said.is_some() {
            break;
        }
        for (name, keyword) in names.iter_mut().zip(["[MANUFAC]", "[LUMINAIRE]", "[LUMCAT]"]) {
            let value = line.text.strip_prefix(keyword).map(name_of);
            if name.is_empty() {
                *name = value.unwrap_or_default();
            }
        }
    }
    let named = names.into_iter().filter(|name| !name.is_empty()).collect::<Vec<_>>();
    (name_of(&named.join(" ")), said)
}

/// Whether a line is the first one of numbers, for files without a tilt line.
fn is_header(line: &Line, comma: Comma) -> bool {
    let text = line.text.replace(',', if comma == Comma::Separates { " " } else { "." });
    let words: Vec<&str> = text.split_whitespace().collect();
    words.len() >= 10 && words.iter().all(|word| word.parse::<f64>().is_ok())
}

/// Skips the numbers of TILT=INCLUDE.
fn skip_tilt(numbers: &mut Numbers, warnings: &mut Vec<String>) -> Result<(), Error> {
    numbers.next("the lamp's geometry of the tilt")?;
    let pairs = numbers.count("the number of tilt angles")?;
    numbers.list(pairs, "a tilt angle")?;
    let factors = numbers.list(pairs, "a tilt factor")?;
    if factors.iter().any(|&factor| factor != 1.0) {
        warnings.push("tilt factors are not applied: the luminaire is as it was measured".into());
    }
    Ok(())
}

/// The numbers before the angles.
struct Header {
    lamp_flux: Option<f64>,
    /// Factor of the candela values.
    factor: f64,
    vertical: usize,
    horizontal: usize,
    kind: Kind,
    opening: Opening,
    power: f64,
}

/// Photometric types.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    C,
    B,
    A,
}

impl Header {
    fn read(numbers: &mut Numbers, warnings: &mut Vec<String>) -> Result<Header, Error> {
        let lamps = numbers.next("the number of lamps")?;
        let lumens = numbers.next("the lumens of a lamp")?;
        let multiplier = numbers.next("the multiplier")?;
        let vertical = numbers.count("the number of vertical angles")?;
        let horizontal = numbers.count("the number of horizontal angles")?;
        let kind = match numbers.next("the photometric type")? {
            1.0 => Kind::C,
            2.0 => Kind::B,
            3.0 => Kind::A,
            other => {
                let found = format!("photometric type {other}");
                return Err(numbers.error(found, "give 1 (C), 2 (B) or 3 (A)"));
            }
        };
        let metres = match numbers.next("the type of units")? {
            1.0 => 0.3048,
            2.0 => 1.0,
            other => {
                warnings.push(format!("units of type {other} are taken for metres"));
                1.0
            }
        };
        let mut size = || Ok::<_, Error>(metres * numbers.next("a size of the opening")?);
        let [width, length, height] = [size()?, size()?, size()?];
        let mut factor = 1.0;
        for what in ["multiplier", "ballast factor", "factor for future use"] {
            let value = if what == "multiplier" { multiplier } else { numbers.next(what)? };
            if value < 0.0 {
                return Err(numbers.error(format!("{what} {value}"), "give more than 0"));
            }
            if value == 0.0 {
                warnings.push(format!("the {what} 0 is taken for 1"));
            } else {
                factor *= value;
            }
        }
        let power = numbers.next("the input watts")?.max(0.0);
        let is_absolute = lumens < 0.0;
        Ok(Header {
            lamp_flux: (!is_absolute).then_some(lamps.abs() * lumens),
            factor,
            vertical,
            horizontal,
            kind,
            opening: opening(width, length, height),
            power,
        })
    }

    fn distribution(
        &self,
        mut planes: Planes,
        warnings: &mut Vec<String>,
    ) -> Result<IntensityDistribution, Error> {
        if self.kind == Kind::C {
            unfold_c(&mut planes, warnings)?;
            return planes.distribution(Pole::Aim);
        }
        if self.horizontal < 2 || self.vertical < 2 {
            let found = format!("{} by {} angles", self.vertical, self.horizontal);
            return Err(bad(found, "types A and B need two of each at least"));
        }
        // By horizontal angle, then by vertical: both from -90° to 90° when unfolded.
        let mut planes = unfolded_at_zero(unfolded_at_zero(planes).transposed()).transposed();
        if self.kind == Kind::B {
            planes = planes.transposed();
        }
        // From latitudes to angles from the pole.
        planes.angles.iter_mut().for_each(|angle| *angle = 90.0 - *angle);
        planes.angles.reverse();
        planes.planes.iter_mut().for_each(|(_, values)| values.reverse());
        planes.distribution(if self.kind == Kind::B { Pole::C0 } else { Pole::C90 })
    }
}

/// Planes of type C, completed to a full turn.
fn unfold_c(planes: &mut Planes, warnings: &mut Vec<String>) -> Result<(), Error> {
    let Some([first, last]) = planes.span() else { return Ok(()) };
    let is = |a: f64, b: f64| (a - b).abs() < ANGLE_TOLERANCE;
    match (first, last) {
        _ if planes.planes.len() == 1 => {}
        (a, b) if is(b - a, 360.0) => {}
        (a, b) if is(a, 0.0) && is(b, 90.0) => {
            planes.mirror_at_last();
            planes.mirror_at_last();
        }
        (a, b) if is(a, 0.0) && is(b, 180.0) || is(a, 90.0) && is(b, 270.0) => {
            planes.mirror_at_last();
        }
        (a, b) if planes.can_close() => {
            warnings.push(format!("planes from {a}° to {b}° are closed to a turn"));
            planes.close();
        }
        (a, b) => {
            let remedy = "must be 0° to 0°, 90°, 180° or 360°, or 90° to 270°";
            return Err(bad(format!("horizontal angles {a}° to {b}°"), remedy));
        }
    }
    if let (Some(&low), Some(&high)) = (planes.angles.first(), planes.angles.last()) {
        let is_end = |angle: f64| [0.0, 90.0, 180.0].iter().any(|&end| is(angle, end));
        if !is_end(low) || !is_end(high) {
            warnings.push(format!("it is dark beyond the vertical angles {low}° to {high}°"));
        }
    }
    Ok(())
}

/// Planes from 0° on, with their mirror images at 0°; others unchanged.
fn unfolded_at_zero(mut planes: Planes) -> Planes {
    if planes.span().is_some_and(|[first, _]| first.abs() < ANGLE_TOLERANCE) {
        planes.planes.iter_mut().for_each(|plane| plane.0 = -plane.0);
        planes.planes.reverse();
        planes.mirror_at_last();
    }
    planes
}

/// The opening from its signed lengths: negative ones are diameters. A file of 1995 has a single
/// one for a circle.
fn opening(width: f64, length: f64, height: f64) -> Opening {
    let is_round = width < 0.0 && (length < 0.0 || length == 0.0 && height >= 0.0);
    let length = if is_round && length == 0.0 { width } else { length };
    Opening { size: DVec3::new(length, width, height).abs(), is_round }
}

fn bad(found: String, remedy: &str) -> Error {
    Error::new(ErrorKind::Scene, "angles", found, remedy)
}
