//! Weather files.

use radiosity::ErrorKind;
use radiosity::io::{Input, Weather, read_epw};

use crate::common::weather::{DAYS, epw_at, row};

fn epw(irradiance: impl Fn(u32, u32) -> [f64; 2]) -> String {
    epw_at([48.5, -11.25, -1.0], irradiance)
}

fn read(text: &str) -> Weather {
    read_epw(Input::bytes("place.epw", text.as_bytes())).unwrap()
}

#[test]
fn a_year_is_read_by_hours() {
    let text = epw(|month, hour| [f64::from(month), f64::from(hour)]);
    let weather = read(&text);
    assert_eq!((weather.latitude, weather.longitude, weather.time_zone), (48.5, -11.25, -1.0));
    assert!(weather.warnings.is_empty(), "{:?}", weather.warnings);
    assert_eq!(weather.records.len(), 8760);
    // Hour 1 is from 0 to 1.
    let first = weather.records[0];
    assert_eq!((first.month, first.day, first.middle, first.duration), (1, 1, 0.5, 1.0));
    let record = weather.records[31 * 24 + 24 + 13];
    assert_eq!((record.month, record.day, record.middle), (2, 2, 13.5));
    assert_eq!((record.direct_normal, record.diffuse_horizontal), (2.0, 14.0));
    assert_eq!((record.year, record.dew_point), (2001, Some(7.5)));
    // However lines end and whatever is between them.
    let odd = format!("\u{feff}{}", text.replace('\n', "\r\n\r\n"));
    assert_eq!(read(&odd), weather);
    // In any order: repaired, and said.
    let [first, february] = ["2001,1,1,1,", "2001,2,1,1,"].map(|row| text.find(row).unwrap());
    let (head, january, rest) = (&text[..first], &text[first..february], &text[february..]);
    let turned = [head, rest, january].concat();
    let found = read(&turned);
    assert_eq!(found.records, weather.records);
    assert!(found.warnings.len() == 1 && found.warnings[0].contains("order"), "{found:?}");
}

#[test]
fn leap_days_parts_of_hours_and_gaps_are_read() {
    let text = epw(|_, _| [1.0, 2.0]);
    let leap: String = (1..=24).map(|h| row(2, 29, h, 0, [5.0, 6.0])).collect();
    let found = read(&(text.clone() + &leap));
    assert_eq!(found.records.len(), 8784);
    assert_eq!(found.records[(31 + 28) * 24].direct_normal, 5.0);
    // Out of order only.
    assert_eq!(found.warnings.len(), 1);

    let head = text.split("2001,").next().unwrap().replace("PERIODS,1,1,", "PERIODS,1,4,");
    let mut quarters = head;
    for (month, days) in (1..).zip(DAYS) {
        for (day, hour) in (1..=days).flat_map(|day| (1..=24).map(move |hour| (day, hour))) {
            (1..=4).for_each(|q| quarters += &row(month, day, hour, 15 * q, [3.0, 4.0]));
        }
    }
    let found = read(&quarters);
    assert!(found.records.len() == 4 * 8760 && found.warnings.is_empty(), "{:?}", found.warnings);
    let middles = [0, 1, 2, 3, 4].map(|k| found.records[k].middle);
    assert_eq!(middles, [0.125, 0.375, 0.625, 0.875, 1.125]);
    assert_eq!(found.records[9].duration, 0.25);

    let gaps = text.replacen(",1,2,0\n", ",9999,2,0\n", 3).replacen(",1,2,0\n", ",1,9999,0\n", 2);
    let found = read(&gaps);
    assert_eq!(found.records.len(), 8755);
    assert!(found.warnings[0].contains("5 of 8760 records"), "{:?}", found.warnings);
    let short = text.rsplit_once("2001,12,31,24").unwrap().0;
    assert!(read(short).warnings[0].contains("8759 hours"));
}

#[test]
fn what_is_wrong_is_said_with_line_and_field() {
    let text = epw(|_, _| [1.0, 2.0]);
    let head = text.split("2001,").next().unwrap();
    let one = |row: String| format!("{head}{row}");
    let cut: String = row(1, 1, 1, 0, [1.0, 2.0]).split(',').take(14).collect::<Vec<_>>().join(",");
    for (text, words) in [
        (text.replace("48.5", "98.5"), &["place.epw:1", "field 7", "latitude", "-90 to 90"][..]),
        (text.replace("48.5", "north"), &["place.epw:1", "\"north\""]),
        (one(row(13, 1, 1, 0, [1.0, 2.0])), &["place.epw:4", "field 2", "month", "1 to 12"]),
        (one(row(4, 31, 1, 0, [1.0, 2.0])), &["field 3", "day", "1 to 30"]),
        (one(row(4, 30, 0, 0, [1.0, 2.0])), &["field 4", "hour", "1 to 24"]),
        (one(row(4, 30, 1, 0, [-1.0, 2.0])), &["field 15", "direct normal", "W/m²", "9999"]),
        (one(row(4, 30, 1, 0, [1.0, f64::NAN])), &["field 16", "diffuse", "NaN"]),
        (one(cut), &["field 15", "\"\""]),
        (one(row(1, 1, 1, 0, [1.0, 2.0]).repeat(2)), &["place.epw:5", "same time as in line 4"]),
        (text.replace("LOCATION", "PLACE"), &["no line LOCATION"]),
        (head.to_string(), &["no lines of weather"]),
        (String::new(), &["no line LOCATION"]),
    ] {
        let error = read_epw(Input::bytes("place.epw", text.as_bytes())).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Scene);
        for word in words {
            assert!(error.to_string().contains(word), "'{word}' not in: {error}");
        }
    }
}
