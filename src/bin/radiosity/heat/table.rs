//! Tables as spreadsheets write them: separators, decimal commas, empty cells and lines.
//!
//! | item | rule |
//! |---|---|
//! | text | UTF-8, UTF-16 or Windows-1252, any line ends, with or without a byte-order mark |
//! | separator | that of a first line `sep=;`; else `;`, tab or `,`: the first in the header |
//! | cells | quoted or not; where a line ends early they are empty; empty lines are skipped |
//! | decimals | a point or a comma, one of them in all of a table |

use std::path::Path;

use csv::StringRecord;
use radiosity::io::read_text;
use radiosity::{Error, ErrorKind};

/// The largest table: some million lines.
const MAX_BYTES: u64 = 1 << 28;

/// The header of a table, and its lines.
pub struct Table {
    file: String,
    pub header: StringRecord,
    lines: Vec<StringRecord>,
    separator: u8,
}

/// A line with cells that are not empty.
pub struct Line<'a> {
    record: &'a StringRecord,
    /// The file, and the line's number.
    pub place: String,
}

impl Line<'_> {
    /// The cell of a column; empty where the line ends before it.
    pub fn cell(&self, column: usize) -> &str {
        self.record.get(column).unwrap_or("")
    }
}

/// The sign between the integer part and the decimals.
#[derive(Clone, Copy, PartialEq)]
enum DecimalSign {
    Point,
    Comma,
}

/// How the numbers of a table are written.
pub struct Numbers {
    sign: DecimalSign,
}

/// The error of something in a table, which is shown without control characters, and not at any
/// length.
pub fn wrong(place: &str, found: impl Into<String>, remedy: impl Into<String>) -> Error {
    let plain = |c: char| if c.is_control() { ' ' } else { c };
    let found: String = found.into().chars().map(plain).take(300).collect();
    Error::new(ErrorKind::File, place, found, remedy)
}

impl Table {
    /// Reads the file `path`, whose header should name the columns `expected`.
    ///
    /// # Errors
    /// [`ErrorKind::File`] when it cannot be read, has no header, or a line with more cells than
    /// that.
    pub fn read(path: &Path, expected: &str) -> Result<Table, Error> {
        let (file, text) = (path.display().to_string(), read_text(path, MAX_BYTES)?);
        let separator = separator(&text);
        let mut reader = csv::ReaderBuilder::new();
        reader.delimiter(separator).trim(csv::Trim::All).has_headers(false).flexible(true);
        let mut records = vec![];
        for record in reader.from_reader(text.as_bytes()).into_records() {
            let record = record.map_err(|e| {
                let found = format!("cannot be read: {e}");
                wrong(&file, found, format!("give a CSV file with {expected}")).with_source(e)
            })?;
            let is_empty = record.iter().all(str::is_empty);
            let names_separator = records.is_empty() && is_separator_line(&record);
            if !is_empty && !names_separator {
                records.push(record);
            }
        }
        if records.is_empty() {
            return Err(wrong(&file, "an empty table", format!("give a header with {expected}")));
        }
        let table = Table { file, header: records.remove(0), lines: records, separator };
        table.check_lengths()?;
        Ok(table)
    }

    /// The file's name.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// The lines below the header.
    pub fn lines(&self) -> impl Iterator<Item = Line<'_>> {
        self.lines.iter().map(|record| Line { record, place: self.place(record) })
    }

    fn place(&self, record: &StringRecord) -> String {
        format!("{}:{}", self.file, record.position().map_or(0, csv::Position::line))
    }

    /// Whether no line has more in it than the header has columns: it may be separated by
    /// something else.
    fn check_lengths(&self) -> Result<(), Error> {
        let columns = self.header.len();
        for record in &self.lines {
            if let Some(cell) = record.iter().skip(columns).find(|cell| !cell.is_empty()) {
                let found = format!("'{cell}' after the last of {columns} columns");
                let remedy = "give each line as many cells as the header, with ; between them \
                              where decimals have commas";
                return Err(wrong(&self.place(record), found, remedy));
            }
        }
        Ok(())
    }

    /// How the numbers in `columns` are written.
    ///
    /// # Errors
    /// [`ErrorKind::File`] where some have decimal commas and others points, and for commas between
    /// thousands or decimals, where nothing tells which.
    pub fn numbers(&self, columns: &[usize]) -> Result<Numbers, Error> {
        let cells = || {
            self.lines().flat_map(|line| {
                let cells: Vec<_> = columns.iter().map(|&k| line.cell(k).to_string()).collect();
                cells.into_iter().map(move |cell| (line.place.clone(), cell))
            })
        };
        let first = |sign: char| cells().find(|(_, cell)| cell.contains(sign));
        let Some((place, with_comma)) = first(',') else {
            return Ok(Numbers { sign: DecimalSign::Point });
        };
        if let Some((other, with_point)) = first('.') {
            let found = format!("'{with_comma}', and '{with_point}' in {other}");
            let remedy = "write decimals with a point or a comma throughout, and thousands plain";
            return Err(wrong(&place, found, remedy));
        }
        let mut grouped = cells().filter(|(_, cell)| has_thousands(cell));
        if self.separator == b','
            && let Some((place, cell)) = grouped.next()
        {
            let remedy = "write thousands without a comma, and decimals with a point";
            return Err(wrong(&place, format!("'{cell}', thousands or decimals"), remedy));
        }
        Ok(Numbers { sign: DecimalSign::Comma })
    }
}

impl Numbers {
    /// The number in a cell; `None` where it is empty or no number.
    pub fn parse(&self, cell: &str) -> Option<f64> {
        match self.sign {
            DecimalSign::Point => cell.parse().ok(),
            DecimalSign::Comma => cell.replacen(',', ".", 1).parse().ok(),
        }
    }
}

/// The separator of a table: of `;`, tab and `,` the first that is in its first line with text.
fn separator(text: &str) -> u8 {
    let mut lines = text.split(['\n', '\r']).filter(|line| !line.trim().is_empty());
    let header = lines.next().unwrap_or("");
    let mut is_quoted = false;
    let outside = header.chars().filter(|c| {
        is_quoted ^= *c == '"';
        !is_quoted
    });
    let outside: String = outside.collect();
    let found = [';', '\t', ','].into_iter().find(|c| outside.contains(*c));
    found.map_or(b',', |c| c as u8)
}

/// Whether this is a line such as `sep=;`, by which spreadsheets name the separator.
fn is_separator_line(record: &StringRecord) -> bool {
    let is_named = record.get(0).is_some_and(|cell| cell.eq_ignore_ascii_case("sep="));
    is_named && record.iter().skip(1).all(str::is_empty)
}

/// Whether `cell` may be a whole number with commas between its thousands.
fn has_thousands(cell: &str) -> bool {
    let mut groups = cell.trim_start_matches(['-', '+']).split(',');
    let is_digits = |group: &str| group.bytes().all(|b| b.is_ascii_digit());
    let first = groups.next().unwrap_or("");
    cell.contains(',')
        && (1..=3).contains(&first.len())
        && is_digits(first)
        && first != "0"
        && groups.all(|group| group.len() == 3 && is_digits(group))
}
