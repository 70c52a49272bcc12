//! EnergyPlus weather files (EPW): place, and hourly irradiance of sun and sky.
//!
//! ```text
//! LOCATION,City,State,Country,Source,WMO,latitude,longitude,time zone,elevation
//! …
//! DATA PERIODS,1,records an hour,…
//! year,month,day,hour,minute,flags,…     hour 1 to 24: the one that ends then
//! ```

use std::path::Path;

use super::Input;
use super::files::read_text;
use super::text::{Line, finite, physical_lines};
use crate::error::{Error, ErrorKind, shortened};

/// Weather of a year at a place.
#[derive(Clone, Debug, PartialEq)]
pub struct Weather {
    /// Degrees north.
    pub latitude: f64,
    /// Degrees east.
    pub longitude: f64,
    /// Local standard time less UTC, hours.
    pub time_zone: f64,
    /// Spans of time whose irradiance is known, from 1 January on.
    pub records: Vec<WeatherRecord>,
    /// What is odd about the file.
    pub warnings: Vec<String>,
}

/// Mean weather over a span of time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WeatherRecord {
    /// Year: typical years are made of months of several.
    pub year: i32,
    /// From 1.
    pub month: u32,
    /// Of the month, from 1.
    pub day: u32,
    /// Its middle, hours of local standard time, in (0, 24).
    pub middle: f64,
    /// Hours.
    pub duration: f64,
    /// Irradiance of what faces the sun, W/m².
    pub direct_normal: f64,
    /// Irradiance of level ground by the sky, W/m².
    pub diffuse_horizontal: f64,
    /// Dew point, degrees Celsius, if known.
    pub dew_point: Option<f64>,
}

/// Bytes of the largest file: a year of minutes.
const MOST: u64 = 1 << 28;

/// Days of the months of a leap year.
const DAYS: [f64; 12] = [31., 29., 31., 30., 31., 30., 31., 31., 30., 31., 30., 31.];

/// From this on an irradiance is missing.
const MISSING: f64 = 9999.0;

/// The weather in an EPW file.
///
/// # Errors
/// [`ErrorKind::File`] for a file that cannot be read; [`ErrorKind::Scene`] where it is malformed,
/// with line and field.
pub fn read_epw<'i>(file: impl Into<Input<'i>>) -> Result<Weather, Error> {
    let file = file.into();
    parse(file.path(), &read_text(file.clone(), MOST)?)
}

/// The weather in the `text` of the EPW file `path`.
fn parse(path: &Path, text: &str) -> Result<Weather, Error> {
    let (mut place, mut an_hour, mut rows) = (None, 1.0, vec![]);
    for line in physical_lines(path, text).filter(|line| !line.text.is_empty()) {
        let row = Row::new(&line);
        match row.cells[0].to_ascii_uppercase().as_str() {
            "LOCATION" => {
                place = Some([
                    row.number(6, "latitude", -90.0..=90.0, "degrees north")?,
                    row.number(7, "longitude", -180.0..=180.0, "degrees east")?,
                    row.number(8, "time zone", -14.0..=14.0, "hours from UTC")?,
                ]);
            }
            "DATA PERIODS" => {
                an_hour = row.whole(2, "records an hour", 1.0..=60.0, "1, or a divisor of 60")?;
            }
            first if first.starts_with(|c: char| c.is_ascii_digit()) => {
                rows.push((row.record(an_hour)?, line.number));
            }
            _ => {}
        }
    }
    let wrong = |found: &str, remedy| {
        Error::new(ErrorKind::Scene, path.display().to_string(), found, remedy)
    };
    let [latitude, longitude, time_zone] =
        place.ok_or_else(|| wrong("no line LOCATION", "give an EPW file"))?;
    if rows.is_empty() {
        return Err(wrong("no lines of weather", "give an EPW file with data of a year"));
    }
    let mut warnings = vec![];
    let records = ordered(path, rows, &mut warnings)?;
    Ok(Weather { latitude, longitude, time_zone, records, warnings })
}

/// The records in the order of the year, without those that lack irradiance.
fn ordered(
    path: &Path,
    mut rows: Vec<(WeatherRecord, usize)>,
    warnings: &mut Vec<String>,
) -> Result<Vec<WeatherRecord>, Error> {
    let key = |r: &WeatherRecord| (r.month, r.day, (r.middle * 3600.0) as u32);
    if !rows.is_sorted_by_key(|row| key(&row.0)) {
        warnings.push(format!("{}: not in the order of the year; put in it", path.display()));
        rows.sort_by_key(|row| key(&row.0));
    }
    let is_double = |pair: &&[(WeatherRecord, usize)]| key(&pair[0].0) == key(&pair[1].0);
    if let Some([(_, first), (_, second)]) = rows.windows(2).find(is_double) {
        let place = format!("{}:{second}", path.display());
        let found = format!("the same time as in line {first}");
        return Err(Error::new(ErrorKind::Scene, place, found, "give each hour once"));
    }
    let hours: f64 = rows.iter().map(|row| row.0.duration).sum();
    if (hours - 8760.0).abs() > 1e-6 && (hours - 8784.0).abs() > 1e-6 {
        let path = path.display();
        warnings.push(format!("{path}: {hours} hours, not the 8760 or 8784 of a year"));
    }
    let count = rows.len();
    let is_known = |r: &WeatherRecord| r.direct_normal.max(r.diffuse_horizontal) < MISSING;
    let known: Vec<_> = rows.into_iter().map(|row| row.0).filter(is_known).collect();
    if known.len() < count {
        let missing = count - known.len();
        let path = path.display();
        warnings.push(format!("{path}: {missing} of {count} records lack irradiance; left out"));
    }
    Ok(known)
}

/// A line, in cells.
struct Row<'a> {
    line: &'a Line<'a>,
    cells: Vec<&'a str>,
}

impl<'a> Row<'a> {
    fn new(line: &'a Line<'a>) -> Row<'a> {
        Row { line, cells: line.text.split(',').map(str::trim).collect() }
    }

    /// The number in cell `k`, from 0, called `name`, if it is in `range`.
    fn number(
        &self,
        k: usize,
        name: &str,
        range: std::ops::RangeInclusive<f64>,
        unit: &str,
    ) -> Result<f64, Error> {
        let found = self.cells.get(k).copied().unwrap_or("");
        finite(found).filter(|x| range.contains(x)).ok_or_else(|| {
            let found = format!("field {}, {name}: {:?}", k + 1, shortened(found));
            let (low, high) = (range.start(), range.end());
            self.line.parse_error(found, format!("give {unit} from {low} to {high}"))
        })
    }

    /// The same for a whole number.
    fn whole(
        &self,
        k: usize,
        name: &str,
        range: std::ops::RangeInclusive<f64>,
        unit: &str,
    ) -> Result<f64, Error> {
        let number = self.number(k, name, range, unit)?;
        if number.fract() == 0.0 {
            return Ok(number);
        }
        let found = format!("field {}, {name}: {number}", k + 1);
        Err(self.line.parse_error(found, "give a whole number"))
    }

    /// A line of weather, of so many an hour.
    fn record(&self, an_hour: f64) -> Result<WeatherRecord, Error> {
        let year = self.whole(0, "year", 1.0..=9999.0, "a year")?;
        let month = self.whole(1, "month", 1.0..=12.0, "a month")?;
        let day = self.whole(2, "day", 1.0..=DAYS[month as usize - 1], "a day")?;
        let hour = self.whole(3, "hour", 1.0..=24.0, "the hour that ends then,")?;
        let minute = self.whole(4, "minute", 0.0..=60.0, "minutes")?;
        // The minute at which the record ends; files of hours have 0 or 60, and some have 30. Any
        // minute within the time of a record stands for that.
        let number = if minute == 0.0 { an_hour } else { (minute * an_hour / 60.0).ceil() };
        let irradiance = |k, name| self.number(k, name, 0.0..=1e6, "W/m², or 9999 if missing,");
        let dew_point = self.cells.get(7).and_then(|cell| finite(cell));
        Ok(WeatherRecord {
            year: year as i32,
            month: month as u32,
            day: day as u32,
            middle: hour - 1.0 + (number - 0.5) / an_hour,
            duration: 1.0 / an_hour,
            direct_normal: irradiance(14, "direct normal irradiance")?,
            diffuse_horizontal: irradiance(15, "diffuse horizontal irradiance")?,
            dew_point: dew_point.filter(|celsius| (-90.0..70.0).contains(celsius)),
        })
    }
}
