//! What is known of groups, from a CSV file.

use std::collections::HashMap;
use std::path::Path;

use csv::StringRecord;
use radiosity::heat::{Boundary, Surface};
use radiosity::{Error, ErrorKind};

use crate::view_factors::is_facet_of;

/// One line.
struct Line {
    surface: Surface,
    is_used: bool,
    place: String,
}

/// Where a line has what, by its column.
struct Columns {
    header: StringRecord,
    group: usize,
    temperature: usize,
    flux: usize,
    /// In each band.
    emissivities: Vec<usize>,
}

/// What the file `path` says of each of the groups `names`, in `bands` bands.
///
/// # Errors
/// [`ErrorKind::File`] where it cannot be read, with its line where something is wrong with one,
/// and for groups that it does not name, or that are not there.
pub fn read(path: &Path, names: &[String], bands: usize) -> Result<Vec<Surface>, Error> {
    let file = path.display().to_string();
    let not_read = |e: csv::Error| {
        let remedy = "give a CSV file with the columns group, temperature, flux and emissivity";
        wrong(&file, format!("cannot be read: {e}"), remedy).with_source(e)
    };
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_path(path);
    let reader = reader.as_mut().map_err(|e| {
        let found = format!("cannot be read: {e}");
        wrong(&file, found, "give a CSV file that can be read")
    })?;
    let columns = Columns::new(reader.headers().map_err(not_read)?, bands, &file)?;
    let mut lines: HashMap<String, Line> = HashMap::new();
    for record in reader.records() {
        let record = record.map_err(not_read)?;
        let place = format!("{file}:{}", record.position().map_or(0, csv::Position::line));
        let surface = columns.surface(&record, &place)?;
        let name = record[columns.group].to_string();
        if lines.contains_key(&name) {
            let found = format!("group '{name}' a second time");
            return Err(wrong(&place, found, "name each group once"));
        }
        lines.insert(name, Line { surface, is_used: false, place });
    }
    of_groups(names, lines, &file)
}

fn wrong(place: &str, found: String, remedy: &str) -> Error {
    Error::new(ErrorKind::File, place, found, remedy)
}

impl Columns {
    fn new(header: &StringRecord, bands: usize, file: &str) -> Result<Columns, Error> {
        let column = |name: &str| {
            header.iter().position(|column| column.eq_ignore_ascii_case(name)).ok_or_else(|| {
                wrong(file, format!("no column '{name}'"), "the first line names the columns")
            })
        };
        Ok(Columns {
            group: column("group")?,
            temperature: column("temperature")?,
            flux: column("flux")?,
            emissivities: match bands {
                1 => vec![column("emissivity")?],
                _ => {
                    let all = (1..=bands).map(|k| column(&format!("emissivity_{k}")));
                    all.collect::<Result<_, _>>()?
                }
            },
            header: header.clone(),
        })
    }

    /// What a line says, at this `place`.
    fn surface(&self, record: &StringRecord, place: &str) -> Result<Surface, Error> {
        let number = |column: usize| match &record[column] {
            "" => Ok(None),
            text => text.parse().map(Some).map_err(|_| {
                wrong(place, format!("{} '{text}'", &self.header[column]), "give a number")
            }),
        };
        let boundary = match (number(self.temperature)?, number(self.flux)?) {
            (Some(t), None) => Boundary::Temperature(t),
            (None, Some(q)) => Boundary::NetFlux(q),
            (both, _) => {
                let found = if both.is_some() { "temperature and flux" } else { "neither" };
                let remedy = "give a temperature or a flux, and leave the other empty";
                return Err(wrong(place, found.into(), remedy));
            }
        };
        let emissivity = self.emissivities.iter().map(|&column| {
            let missing = || format!("no {}", &self.header[column]);
            let missing = || wrong(place, missing(), "give one in each band, 0 to 1");
            number(column)?.ok_or_else(missing)
        });
        Ok(Surface { boundary, emissivity: emissivity.collect::<Result<_, _>>()? })
    }
}

/// What the lines say of the groups `names`: that of the group itself, of the whole that a facet is
/// of, or of all others.
fn of_groups(
    names: &[String],
    mut lines: HashMap<String, Line>,
    file: &str,
) -> Result<Vec<Surface>, Error> {
    let mut surfaces = Vec::with_capacity(names.len());
    for name in names {
        let whole = name.rsplit_once('/').map(|(whole, _)| whole);
        let whole = whole.filter(|whole| is_facet_of(name, whole));
        let candidates = [Some(name.as_str()), whole, Some("*")];
        let known = candidates.into_iter().flatten().find(|key| lines.contains_key(*key));
        let Some(line) = known.and_then(|key| lines.get_mut(key)) else {
            let remedy = "give it a line, or one for all others, *";
            return Err(wrong(file, format!("nothing of group '{name}'"), remedy));
        };
        line.is_used = true;
        surfaces.push(line.surface.clone());
    }
    let is_unused = |(name, line): &(&String, &Line)| !line.is_used && *name != "*";
    if let Some((name, line)) = lines.iter().filter(is_unused).min_by_key(|(_, l)| &l.place) {
        let found = format!("group '{name}', which is not there");
        return Err(wrong(&line.place, found, "name groups as the scene does"));
    }
    Ok(surfaces)
}
