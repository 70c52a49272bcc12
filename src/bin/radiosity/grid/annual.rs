//! A year of daylight on measuring grids, by the weather in a file.

use std::path::Path;
use std::sync::Arc;

use chrono::{DateTime, Datelike, Duration, FixedOffset, NaiveDate};
use radiosity::daylight::{
    AnnualDaylight, AnnualSettings, DaylightHour, DaylightYear, Estimate, annual_daylight,
};
use radiosity::gather::GatherPoint;
use radiosity::grid::MeasuringGrid;
use radiosity::io::{Weather, WeatherRecord, read_epw};
use radiosity::scene::SolarIrradiance;
use radiosity::{Error, ErrorKind, Scene};

use super::picture::Picture;
use super::{Options, Placed};
use crate::args::{self, Stop};
use crate::canvas::scale::Scale;
use crate::measured_sky::DEW_POINT;
use crate::sun::{Compass, Site, angle_between};
use crate::{interrupt, progress};

/// Share of hours with the target from which a point counts in sDA, and hours of sun above which it
/// counts in ASE (IES LM-83-12).
const LM_83: (f64, f64) = (0.5, 250.0);

/// The daylight of a grid.
struct AnnualGrid<'a> {
    place: &'a str,
    grid: &'a MeasuringGrid,
    /// Of its points, in their order.
    values: Vec<Option<AnnualDaylight>>,
}

/// Runs `radiosity grid --weather`.
pub fn run(options: &Options, file: &Path, scene: Scene, grids: &[Placed]) -> Result<(), Stop> {
    let weather = progress::of_reading(file, || read_epw(file))?;
    weather.warnings.iter().for_each(|warning| eprintln!("warning: {warning}"));
    let year = progress::of_stage("the skies of the year", || {
        let compass = Compass::new(scene.up(), options.light.reading.sky.north())?;
        let hours: Result<Vec<DaylightHour>, Error> =
            weather.records.iter().map(|r| hour(r, &weather, &compass, options.hours)).collect();
        DaylightYear::new(&hours?, scene.up())
    })?;
    interrupt::catch();
    let scene = Arc::new(scene);
    let error = options.light.error();
    let settings = AnnualSettings { target: options.target, error, ..AnnualSettings::default() };
    let mut measured = vec![];
    for (place, grid) in grids {
        let points: Vec<GatherPoint> = grid.gather_points(&scene)?;
        let found = progress::of_count("points", |report| {
            annual_daylight(&scene, &year, &points, &settings, report)
        })?;
        let mut found = found.ok_or(Stop::Interrupted)?.into_iter();
        let values = grid.points.iter().map(|p| p.and_then(|_| found.next())).collect();
        measured.push(AnnualGrid { place, grid, values });
    }
    write(options, &measured)?;
    progress::print_written();
    let is_off = |value: &AnnualDaylight| {
        !value.is_buried() && value.exposure.error > 0.5 * error * value.exposure.value
    };
    let is_reached = !measured.iter().flat_map(|m| m.values.iter().flatten()).any(is_off);
    options.light.print_outcome(is_reached);
    args::end_at(is_reached)
}

/// Sun and sky of a record: the sun stands where it does in the middle of its time.
fn hour(
    record: &WeatherRecord,
    weather: &Weather,
    compass: &Compass,
    [from, to]: [f64; 2],
) -> Result<DaylightHour, Error> {
    let &WeatherRecord { year, month, day, middle, duration, dew_point, .. } = record;
    let wrong = |found: String| {
        let place = format!("weather of {year}-{month:02}-{day:02}");
        Error::new(ErrorKind::Scene, place, found, "give a date and a place on the Earth")
    };
    // A typical year may have 29 February of a year that has none.
    let date = NaiveDate::from_ymd_opt(year, month, day)
        .or_else(|| NaiveDate::from_ymd_opt(2024, month, day))
        .ok_or_else(|| wrong("no such day".into()))?;
    let seconds = |hours: f64| Duration::seconds((3600.0 * hours).round() as i64);
    let zone = FixedOffset::east_opt((3600.0 * weather.time_zone) as i32)
        .ok_or_else(|| wrong(format!("time zone {}", weather.time_zone)))?;
    let utc = date.and_time(chrono::NaiveTime::MIN) + seconds(middle - weather.time_zone);
    let site = Site { latitude: weather.latitude, longitude: weather.longitude };
    let time = DateTime::from_naive_utc_and_offset(utc, zone);
    let towards_sun = site.towards_sun(&time, compass).map_err(wrong)?;
    let light = SolarIrradiance {
        direct_normal: record.direct_normal,
        diffuse_horizontal: record.diffuse_horizontal,
        sun_zenith: angle_between(compass.up, towards_sun),
        extraterrestrial: SolarIrradiance::extraterrestrial_on(date.ordinal()),
    };
    let dew_point = dew_point.unwrap_or(DEW_POINT);
    let is_occupied = (from..to).contains(&middle);
    Ok(DaylightHour { light, towards_sun, dew_point, duration, is_occupied })
}

fn write(options: &Options, grids: &[AnnualGrid]) -> Result<(), Error> {
    for (k, annual) in grids.iter().enumerate() {
        let name = format!("{} {}", k + 1, annual.grid.name);
        let Some(line) = annual.line(options) else {
            say!("{name}: all points are inside of solids");
            continue;
        };
        say!("{name}: {line}");
        let number = if grids.len() > 1 { format!("-{}", k + 1) } else { String::new() };
        options.write_picture(&annual.picture(options), &number)?;
    }
    options.output.write("grid.csv", &table(grids));
    Ok(())
}

impl AnnualGrid<'_> {
    /// Values outside of solids.
    fn open(&self) -> Vec<&AnnualDaylight> {
        self.values.iter().flatten().filter(|value| !value.is_buried()).collect()
    }

    /// A summary; none where all points are inside of solids.
    fn line(&self, options: &Options) -> Option<String> {
        let open = self.open();
        let count = open.len() as f64;
        let mean = |of: fn(&AnnualDaylight) -> f64| open.iter().map(|v| of(v)).sum::<f64>() / count;
        let share = |is: &dyn Fn(&AnnualDaylight) -> bool| {
            100.0 * open.iter().filter(|value| is(value)).count() as f64 / count
        };
        let (half, sunny) = LM_83;
        // Where all points are off by two standard errors, one way and the other.
        let [low, enough, high] = [-2.0, 0.0, 2.0].map(|off| {
            share(&|v: &AnnualDaylight| v.autonomy.value + off * v.autonomy.error >= half)
        });
        let exposed = share(&|v| v.sun_hours > sunny);
        let [a, b, c, d] = [
            mean(|v| v.useful[0].value),
            mean(|v| v.useful[1].value),
            mean(|v| v.useful[2].value),
            mean(|v| v.useful[3].value),
        ]
        .map(|share| 100.0 * share);
        let target = options.target;
        (count > 0.0).then(|| {
            format!(
                "sDA{target}/50% {enough:.1} % ({low:.1} to {high:.1}), ASE1000,250 {exposed:.1} \
                 %, mean DA{target} {:.1} % (a point ± {:.1}), UDI <100 {a:.1}, 100-300 {b:.1}, \
                 300-3000 {c:.1}, >3000 lx {d:.1} %, mean {:.0} klx h a year; {count} points",
                100.0 * mean(|v| v.autonomy.value),
                100.0 * mean(|v| v.autonomy.error),
                mean(|v| v.exposure.value) / 1000.0,
            )
        })
    }

    fn picture(&self, options: &Options) -> Picture<'_> {
        let of = |value: &Option<AnnualDaylight>| {
            value.filter(|v| !v.is_buried()).map(|v| 100.0 * v.autonomy.value)
        };
        let [from, to] = options.hours;
        Picture {
            grid: self.grid,
            values: self.values.iter().map(of).collect(),
            title: format!("Daylight autonomy in %, {}", self.place),
            line: format!("{} lx, from {from} to {to} h of each day", options.target),
            unit: "%",
            scale: Scale::up_to(100.0),
            metre: options.metre(),
        }
    }
}

/// A line a point.
fn table(grids: &[AnnualGrid]) -> Vec<u8> {
    let head = "grid,column,row,x,y,z,da_percent,da_error,continuous_da_percent,\
                udi_below_100_percent,udi_100_300_percent,udi_300_3000_percent,\
                udi_above_3000_percent,udi_300_3000_error,exposure_lxh,exposure_error_lxh,\
                sun_hours,inside";
    let mut rows = vec![];
    for (k, annual) in grids.iter().enumerate() {
        let grid = annual.grid;
        for (n, (point, value)) in grid.points.iter().zip(&annual.values).enumerate() {
            let (Some(point), Some(value)) = (point, value) else { continue };
            let percent = |x: f64| (100.0 * x).to_string();
            let both = |e: &Estimate| [percent(e.value), percent(e.error)];
            let mut row = vec![format!("{} {}", k + 1, grid.name)];
            row.extend([n % grid.counts[0], n / grid.counts[0]].map(|n| n.to_string()));
            row.extend(point.to_array().map(|x| x.to_string()));
            row.extend(both(&value.autonomy));
            row.push(percent(value.continuous.value));
            row.extend(value.useful.iter().map(|class| percent(class.value)));
            row.push(percent(value.useful[2].error));
            let Estimate { value: exposure, error } = value.exposure;
            row.extend([exposure, error, value.sun_hours].map(|x| x.to_string()));
            row.push(u8::from(value.is_buried()).to_string());
            rows.push(row);
        }
    }
    args::csv(head, rows)
}
