//! The columns of a table of boundary conditions, by their headers.
//!
//! A header is a name and, behind it, a unit in any of the ways `temperature [C]`,
//! `Temperature (°C)`, `temperature_C`, `temperature / C` or `temperature, C`.

use radiosity::Error;

use super::table::{Table, wrong};
use super::units::Scale;

/// Which column has what.
pub struct Columns {
    /// Names of all columns, without units.
    pub names: Vec<String>,
    pub group: usize,
    pub temperature: Option<usize>,
    pub flux: Option<usize>,
    /// In each band.
    pub emissivities: Vec<usize>,
    /// Of temperatures, where the header names their unit.
    pub scale: Option<Scale>,
}

/// A column with its unit, if there is one.
struct Column {
    index: usize,
    unit: String,
}

/// Units of fluxes, as they are after blanks, `^`, `_` and `·` are left out.
const FLUX_UNITS: [&str; 4] = ["w/m²", "w/m2", "wm-2", "wm2"];

impl Columns {
    /// The columns for `bands` bands.
    ///
    /// # Errors
    /// [`radiosity::ErrorKind::File`] where one is missing or there twice, or has another unit.
    pub fn new(table: &Table, bands: usize) -> Result<Columns, Error> {
        let names = match bands {
            1 => vec!["emissivity".to_string()],
            _ => (1..=bands).map(|k| format!("emissivity_{k}")).collect(),
        };
        let find = |name: &str| find(table, name);
        let [temperature, flux] = [find("temperature")?, find("flux")?];
        let scale = match temperature.as_ref().map(|column| column.unit.as_str()) {
            None | Some("") => None,
            Some(unit) => Some(Scale::of_unit(unit).ok_or_else(|| {
                wrong(table.file(), format!("temperature in '{unit}'"), "give K, C or F")
            })?),
        };
        let required = |name: &str| {
            find(name)?.ok_or_else(|| {
                let remedy = "the first line names the columns";
                wrong(table.file(), format!("no column '{name}'"), remedy)
            })
        };
        let (group, mut emissivities) = (required("group")?, vec![]);
        for name in &names {
            let column = required(name)?;
            check_unit(table, name, &column, &["-", "1"], "leave the unit out")?;
            emissivities.push(column.index);
        }
        if let Some(flux) = &flux {
            check_unit(table, "flux", flux, &FLUX_UNITS, "give W/m²")?;
        }
        let [temperature, flux] = [temperature, flux].map(|column| column.map(|c| c.index));
        let columns =
            Columns { names: vec![], group: group.index, temperature, flux, emissivities, scale };
        Ok(columns.with_names(table))
    }

    /// The columns that have numbers.
    pub fn numeric(&self) -> Vec<usize> {
        let [t, q] = [self.temperature, self.flux];
        t.into_iter().chain(q).chain(self.emissivities.iter().copied()).collect()
    }

    /// The same with the names of all columns; warns of those that are not used.
    fn with_names(mut self, table: &Table) -> Columns {
        self.names = table.header.iter().map(String::from).collect();
        let used = [self.numeric(), vec![self.group]].concat();
        for (k, name) in self.names.iter().enumerate() {
            if !used.contains(&k) && table.lines().any(|line| !line.cell(k).is_empty()) {
                eprintln!("warning: {}: column '{name}' is not used", table.file());
            }
        }
        self
    }
}

/// The column of this name.
fn find(table: &Table, name: &str) -> Result<Option<Column>, Error> {
    let columns = table.header.iter().enumerate();
    let mut named = columns.filter_map(|(index, header)| {
        let unit = unit_behind(header, name)?;
        Some(Column { index, unit })
    });
    let (first, second) = (named.next(), named.next());
    match second {
        Some(_) => {
            let found = format!("two columns '{name}'");
            Err(wrong(table.file(), found, "name each column once"))
        }
        None => Ok(first),
    }
}

/// What is behind `name` in a header, its unit; `None` where it is the header of something else.
fn unit_behind(header: &str, name: &str) -> Option<String> {
    let start = header.get(..name.len())?;
    let rest = &header[name.len()..];
    let is_name = start.eq_ignore_ascii_case(name);
    let ends = rest.is_empty() || rest.starts_with([' ', '_', '[', '(', '/', ',', ';', ':', '°']);
    let outer = |c: char| c.is_whitespace() || "[]()/,;:_".contains(c);
    (is_name && ends).then(|| rest.trim_matches(outer).to_string())
}

fn check_unit(
    table: &Table,
    name: &str,
    column: &Column,
    known: &[&str],
    remedy: &str,
) -> Result<(), Error> {
    let plain: String =
        column.unit.to_lowercase().chars().filter(|c| !" ^_·*".contains(*c)).collect();
    if plain.is_empty() || known.contains(&&*plain) {
        return Ok(());
    }
    Err(wrong(table.file(), format!("{name} in '{}'", column.unit), remedy))
}
