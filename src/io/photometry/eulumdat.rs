//! EULUMDAT files (A. Stockmar, "EULUMDAT – ein Leuchtendatenformat für den europäischen
//! Beleuchtungsplaner", Licht '90): a line for each item, then the numbers.
//!
//! | line | |
//! |---|---|
//! | 1 | company |
//! | 3 to 7 | symmetry, C-planes and their step, angles γ and their step |
//! | 9 | name |
//! | 16 to 21 | opening: length or diameter, width or 0, heights at C = 0°, 90°, 180°, 270°, mm |
//! | 24 | factor for the intensities |
//! | 26 | sets of lamps, see [`lamp_set`]; six lines of each |
//! | then | ten direct ratios, C-angles, γ-angles, intensities in cd/klm plane by plane |
//!
//! Length is along C = 90°, width along C = 0°.

use std::path::Path;

use glam::DVec3;

use super::super::text::{Line, finite, physical_lines, place};
use super::lamp_set::{self, LampSet};
use super::numbers::{Comma, Numbers};
use super::planes::{ANGLE_TOLERANCE, Planes};
use super::{Photometry, name_of};
use crate::error::{Error, ErrorKind, quoted};
use crate::scene::{Opening, Pole};

/// Lines before those of the sets of lamps.
const HEADER: usize = 26;

pub fn read(file: &Path, text: &str, lamp_set: Option<usize>) -> Result<Photometry, Error> {
    let mut warnings = vec![];
    let mut rest = physical_lines(file, text);
    let lines: Vec<Line> = rest.by_ref().take(HEADER).collect();
    let field = |number: usize| Field { file, number, line: lines.get(number - 1) };
    let Header { symmetry, planes, angles, opening, mut factor, sets } =
        Header::read(&field, &mut warnings)?;
    let lines_of_sets: Vec<Line> = rest.by_ref().take(LampSet::LINES * sets).collect();
    let lamp = |k: usize| Field { file, number: HEADER + 1 + k, line: lines_of_sets.get(k) };
    let text = |k: usize| lamp(k).text().to_string();
    let number = |k: usize| lamp(k).number_or_zero();
    let sets: Vec<LampSet> = (0..sets).map(|set| LampSet::new(set, text, number)).collect();
    let set = lamp_set::choose(&sets, lamp_set);
    let LampSet { flux, is_absolute, power, .. } =
        set.map_err(|(found, remedy)| field(26).error(found, &remedy))?;
    if flux > 0.0 {
        factor *= flux / 1000.0;
    } else {
        warnings.push("lamps without flux: intensities are taken for candela".into());
    }
    let mut numbers = Numbers::new(file, rest, Comma::IsDecimal);
    numbers.list(10, "a direct ratio")?;
    let azimuths = numbers.list(planes, "a C-angle")?;
    let angles = numbers.list(angles, "an angle γ")?;
    let (symmetry, mut planes) =
        measured_planes(symmetry, azimuths, angles, &mut numbers, &mut warnings)?;
    planes.sort(&mut warnings);
    planes.scale(factor, &mut warnings);
    let wrong = |found: String| numbers.error(found, "give those that the symmetry needs");
    unfold(symmetry, &mut planes).map_err(wrong)?;
    let intensity = planes.distribution(Pole::Aim).map_err(|e| e.inside(file))?;
    Ok(Photometry {
        name: name_of(&format!("{} {}", field(1).text(), field(9).text())),
        intensity: intensity.into(),
        opening,
        lamp_flux: (!is_absolute && flux > 0.0).then_some(flux),
        power,
        warnings,
    })
}

/// The numbers of the header.
struct Header {
    symmetry: u8,
    /// C-planes, and angles γ in each.
    planes: usize,
    angles: usize,
    opening: Opening,
    /// Factor of the intensities.
    factor: f64,
    /// Sets of lamps.
    sets: usize,
}

impl Header {
    fn read<'a>(
        field: &impl Fn(usize) -> Field<'a>,
        warnings: &mut Vec<String>,
    ) -> Result<Header, Error> {
        let symmetry = match field(3).value() {
            Some(code) if [0.0, 1.0, 2.0, 3.0, 4.0].contains(&code) => code as u8,
            _ => {
                let found = format!("{} for the symmetry", quoted(&[field(3).text()]));
                let remedy = "give an IESNA LM-63 file, or a EULUMDAT file with 0 to 4 in line 3";
                return Err(field(3).error(found, remedy));
            }
        };
        let planes = field(4).count("the number of C-planes")?;
        let angles = field(6).count("the number of angles in a plane")?;
        let size = [16, 17, 18, 19, 20, 21].map(|k| field(k).number_or_zero() / 1000.0);
        let mut factor = field(24).number_or_zero();
        if factor <= 0.0 {
            warnings.push(format!("the factor {factor} for intensities is taken for 1"));
            factor = 1.0;
        }
        let sets = field(26).number("the number of sets of lamps")?;
        if !(0.0..=20.0).contains(&sets) || sets.fract() != 0.0 {
            let found = format!("{sets} sets of lamps");
            return Err(field(26).error(found, "give a whole number from 0 to 20"));
        }
        let (opening, sets) = (opening(size), sets as usize);
        Ok(Header { symmetry, planes, angles, opening, factor, sets })
    }
}

/// The planes whose intensities come next in `numbers`, and their symmetry: none where all of
/// `azimuths` are there.
fn measured_planes(
    symmetry: u8,
    azimuths: Vec<f64>,
    angles: Vec<f64>,
    numbers: &mut Numbers,
    warnings: &mut Vec<String>,
) -> Result<(u8, Planes), Error> {
    let values = numbers.rest();
    let measured = measured(symmetry, &azimuths);
    let (wanted, all) = (measured.len() * angles.len(), azimuths.len() * angles.len());
    if values.len() < wanted || wanted == 0 {
        let (found, planes) = (values.len(), measured.len());
        let found = format!("{found} intensities for {planes} planes of symmetry {symmetry}");
        return Err(numbers.error(found, "give a file that is whole, with counts that are right"));
    }
    let has_all = values.len() >= all && all > wanted;
    if has_all {
        warnings.push(format!("all planes are there in spite of symmetry {symmetry}: they count"));
    } else if values.len() > wanted {
        let left = values.len() - wanted;
        warnings.push(format!("{left} numbers after the last intensity are left out"));
    }
    let (symmetry, measured) = if has_all { (0, azimuths) } else { (symmetry, measured) };
    let rows = values.chunks_exact(angles.len()).map(<[f64]>::to_vec);
    let planes = measured.into_iter().zip(rows).collect();
    Ok((symmetry, Planes { angles, planes }))
}

/// The C-angles, out of `azimuths`, of the planes that a file of this `symmetry` stores, in order.
fn measured(symmetry: u8, azimuths: &[f64]) -> Vec<f64> {
    let up_to = |last: f64| azimuths.iter().copied().filter(move |&a| a <= last + ANGLE_TOLERANCE);
    match symmetry {
        1 => azimuths.iter().copied().take(1).collect(),
        2 => up_to(180.0).collect(),
        3 => {
            let from_270 = azimuths
                .iter()
                .filter(|a| (270.0 - ANGLE_TOLERANCE..360.0 - ANGLE_TOLERANCE).contains(*a));
            from_270.map(|a| a - 360.0).chain(up_to(90.0)).collect()
        }
        4 => up_to(90.0).collect(),
        _ => azimuths.to_vec(),
    }
}

/// Completes planes of this `symmetry` to a full turn; an error message if that is impossible.
fn unfold(symmetry: u8, planes: &mut Planes) -> Result<(), String> {
    let Some([first, last]) = planes.span().filter(|_| planes.planes.len() > 1) else {
        return Ok(());
    };
    let is = |from: f64, to: f64| {
        (first - from).abs() < ANGLE_TOLERANCE && (last - to).abs() < ANGLE_TOLERANCE
    };
    match symmetry {
        1 => {}
        2 if is(0.0, 180.0) => planes.mirror_at_last(),
        3 if is(-90.0, 90.0) => planes.mirror_at_last(),
        4 if is(0.0, 90.0) => {
            planes.mirror_at_last();
            planes.mirror_at_last();
        }
        0 if is(first, first + 360.0) => {}
        0 if planes.can_close() => planes.close(),
        _ => return Err(format!("C-angles {first}° to {last}° of symmetry {symmetry}")),
    }
    Ok(())
}

/// The opening from the numbers of its lines, metres. It is round if the width is 0.
fn opening([length, width, heights @ ..]: [f64; 6]) -> Opening {
    let is_round = width == 0.0 && length > 0.0;
    let across = if is_round { length } else { width };
    let height = heights.into_iter().fold(0.0, f64::max);
    Opening { size: DVec3::new(across, length, height).max(DVec3::ZERO), is_round }
}

/// A line of the header, or none if the file ends before it.
struct Field<'a> {
    file: &'a Path,
    number: usize,
    line: Option<&'a Line<'a>>,
}

impl Field<'_> {
    fn text(&self) -> &str {
        self.line.map_or("", |line| &line.text)
    }

    /// Its value, with a comma or a point before fractions; none if it is not a number.
    fn value(&self) -> Option<f64> {
        finite(self.text().split_whitespace().next()?.replace(',', ".").as_str())
    }

    /// The value or 0, for numbers that light does not depend on.
    fn number_or_zero(&self) -> f64 {
        self.value().unwrap_or(0.0)
    }

    fn number(&self, what: &str) -> Result<f64, Error> {
        let found = || format!("{} for {what}", quoted(&[self.text()]));
        let remedy = "give a number; lines that are empty count as well";
        self.value().ok_or_else(|| self.error(found(), remedy))
    }

    fn count(&self, what: &str) -> Result<usize, Error> {
        let number = self.number(what)?;
        if !(number >= 1.0 && number <= f64::from(u32::MAX) && number.fract() == 0.0) {
            return Err(self.error(format!("{what} {number}"), "give a whole number from 1"));
        }
        Ok(number as usize)
    }

    fn error(&self, found: String, remedy: &str) -> Error {
        Error::new(ErrorKind::Scene, place(self.file, self.number), found, remedy)
    }
}
