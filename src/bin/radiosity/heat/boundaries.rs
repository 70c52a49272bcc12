//! Boundary conditions of groups, from a table.

use std::collections::HashMap;
use std::path::Path;

use radiosity::Error;
use radiosity::heat::{Boundary, Surface};
use radiosity::view_factor::MatrixRows;

use super::columns::Columns;
use super::table::{Line, Numbers, Table, wrong};
use super::units::{SURELY_KELVIN, Scale};
use crate::view_factors::is_facet_of;

/// What a line says of a group.
struct Known {
    /// `None` where temperature and flux are empty.
    boundary: Option<Boundary>,
    emissivity: Vec<f64>,
    is_used: bool,
    place: String,
}

/// The boundary conditions that the table `path` gives for `rows`, in `bands` bands.
///
/// `scale` is that of temperatures, where the header names no unit.
///
/// # Errors
/// [`radiosity::ErrorKind::File`] where it cannot be read, with its line where something is wrong
/// with one, for temperatures that may be in kelvin or in degrees Celsius, and for groups that it
/// does not name, or that are not there.
pub fn read(
    path: &Path,
    rows: &MatrixRows,
    bands: usize,
    scale: Option<Scale>,
) -> Result<Vec<Surface>, Error> {
    let table = Table::read(path, "the columns group, temperature, flux and emissivity")?;
    let columns = Columns::new(&table, bands)?;
    let numbers = table.numbers(&columns.numeric())?;
    let scale = columns.scale.or(scale);
    if scale.is_none() {
        check_scale(&table, &columns, &numbers)?;
    }
    let reader = LineReader { columns, numbers, scale: scale.unwrap_or(Scale::Kelvin) };
    let mut known: HashMap<String, Known> = HashMap::new();
    for line in table.lines() {
        let name = line.cell(reader.columns.group).to_string();
        if let Some(other) = known.get(&name) {
            let found = format!("group '{name}' a second time, after {}", other.place);
            return Err(wrong(&line.place, found, "name each group once"));
        }
        known.insert(name, reader.known(&line)?);
    }
    let surfaces = of_rows(rows, &mut known, table.file())?;
    let is_unused = |(name, line): &(&String, &Known)| !line.is_used && *name != "*";
    if let Some((name, line)) = known.iter().filter(is_unused).min_by_key(|(_, l)| &l.place) {
        let found = format!("group '{name}', which is not there");
        return Err(wrong(&line.place, found, "name groups as the scene does"));
    }
    Ok(surfaces)
}

/// Whether all temperatures are such that they are in kelvin.
fn check_scale(table: &Table, columns: &Columns, numbers: &Numbers) -> Result<(), Error> {
    let Some(column) = columns.temperature else { return Ok(()) };
    let may_be_celsius =
        |line: &Line| numbers.parse(line.cell(column)).is_some_and(|value| value < SURELY_KELVIN);
    let lines: Vec<Line> = table.lines().filter(may_be_celsius).collect();
    let Some(first) = lines.first() else { return Ok(()) };
    let of_line = |line: &Line| {
        let (number, group) = (line.cell(column), line.cell(columns.group));
        format!("{number} of group '{group}'")
    };
    let mut found = lines.iter().take(3).map(of_line).collect::<Vec<_>>().join(", ");
    if lines.len() > 3 {
        found += &format!(" and {} more", lines.len() - 3);
    }
    let found = format!("temperature {found}, without a unit, below {SURELY_KELVIN}");
    let remedy = "call the column temperature [K] or temperature [C], or add --temperatures \
                  kelvin or --temperatures celsius";
    Err(wrong(&first.place, found, remedy))
}

/// Reads lines.
struct LineReader {
    columns: Columns,
    numbers: Numbers,
    scale: Scale,
}

impl LineReader {
    fn known(&self, line: &Line) -> Result<Known, Error> {
        let Columns { temperature, flux, emissivities, .. } = &self.columns;
        let optional = |column: &Option<usize>| match column {
            Some(column) => self.number(line, *column),
            None => Ok(None),
        };
        let boundary = match (optional(temperature)?, optional(flux)?) {
            (Some(t), None) => Some(Boundary::Temperature(self.scale.kelvin(t))),
            (None, Some(q)) => Some(Boundary::NetFlux(q)),
            (None, None) => None,
            (Some(_), Some(_)) => {
                let remedy = "give a temperature or a flux, and leave the other empty";
                return Err(wrong(&line.place, "temperature and flux", remedy));
            }
        };
        let emissivity = emissivities.iter().map(|&column| {
            let missing = || {
                let found = format!("no {}", self.columns.names[column]);
                wrong(&line.place, found, "give one in each band, 0 to 1")
            };
            self.number(line, column)?.ok_or_else(missing)
        });
        let emissivity = emissivity.collect::<Result<_, _>>()?;
        Ok(Known { boundary, emissivity, is_used: false, place: line.place.clone() })
    }

    fn number(&self, line: &Line, column: usize) -> Result<Option<f64>, Error> {
        let cell = line.cell(column);
        if cell.is_empty() {
            return Ok(None);
        }
        let number = self.numbers.parse(cell).ok_or_else(|| {
            let found = format!("{} '{cell}'", self.columns.names[column]);
            wrong(&line.place, found, "give a number, and its unit in the header")
        });
        number.map(Some)
    }
}

/// What `known` says of each row: the back of a two-sided group may have a line with its
/// emissivity, and has all else of its front.
fn of_rows(
    rows: &MatrixRows,
    known: &mut HashMap<String, Known>,
    file: &str,
) -> Result<Vec<Surface>, Error> {
    let mut surfaces: Vec<Surface> = Vec::with_capacity(rows.names.len());
    for (name, front) in rows.names.iter().zip(&rows.back_of) {
        surfaces.push(match front.map(|front| front as usize) {
            None => of_front(name, known, file)?,
            Some(front) => {
                let whole = whole_of(&rows.names[front]).map(|whole| format!("{whole} (back)"));
                of_back(name, whole, surfaces[front].clone(), known)?
            }
        });
    }
    Ok(surfaces)
}

/// The line of a group: its own, that of the whole that a facet is of, or that of all others.
fn of_front(name: &str, known: &mut HashMap<String, Known>, file: &str) -> Result<Surface, Error> {
    let candidates = [Some(name), whole_of(name), Some("*")];
    let found = candidates.into_iter().flatten().find(|key| known.contains_key(*key));
    let Some(line) = found.and_then(|key| known.get_mut(key)) else {
        let remedy = "give it a line, or one for all others, *";
        return Err(wrong(file, format!("nothing of group '{name}'"), remedy));
    };
    line.is_used = true;
    let boundary = line.boundary.ok_or_else(|| {
        let remedy = "give a temperature or a flux, and leave the other empty";
        wrong(&line.place, "neither temperature nor flux", remedy)
    })?;
    Ok(Surface { boundary, emissivity: line.emissivity.clone() })
}

/// The group that `name` is a facet of.
fn whole_of(name: &str) -> Option<&str> {
    let (whole, _) = name.rsplit_once('/')?;
    is_facet_of(name, whole).then_some(whole)
}

/// The back `name` of a group whose `front` this is; `whole` is that of the group it is a facet of.
fn of_back(
    name: &str,
    whole: Option<String>,
    front: Surface,
    known: &mut HashMap<String, Known>,
) -> Result<Surface, Error> {
    let candidates = [Some(name.to_string()), whole];
    let found = candidates.into_iter().flatten().find(|key| known.contains_key(key));
    let Some(line) = found.and_then(|key| known.get_mut(&key)) else { return Ok(front) };
    line.is_used = true;
    if line.boundary.is_some() {
        let remedy = "give its emissivity alone: temperature and flux are those of both sides";
        return Err(wrong(&line.place, "a temperature or a flux of a back", remedy));
    }
    Ok(Surface { emissivity: line.emissivity.clone(), ..front })
}
