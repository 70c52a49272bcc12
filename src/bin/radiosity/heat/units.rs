//! Units of temperatures and lengths, as options and headers name them.

use radiosity::{Error, ErrorKind};

use crate::args::{Names, Parsed, give};

/// A scale of temperatures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scale {
    Kelvin,
    Celsius,
    Fahrenheit,
}

/// The scales by their names.
pub const SCALES: Names<Scale> =
    &[("kelvin", Scale::Kelvin), ("celsius", Scale::Celsius), ("fahrenheit", Scale::Fahrenheit)];

/// Temperatures without a unit below this may be in degrees Celsius: rooms, skies and boilers are;
/// what is colder than this in kelvin, as cryostats and space are, is rare. Plain choice.
pub const SURELY_KELVIN: f64 = 150.0;

impl Scale {
    /// A temperature of this scale in K.
    pub fn kelvin(self, value: f64) -> f64 {
        match self {
            Scale::Kelvin => value,
            Scale::Celsius => value + 273.15,
            Scale::Fahrenheit => (value + 459.67) / 1.8,
        }
    }

    /// The scale that a unit stands for.
    pub fn of_unit(unit: &str) -> Option<Scale> {
        let unit = unit.to_lowercase();
        match unit.trim_start_matches(['°', 'º']).trim_start_matches("deg").trim_start() {
            "k" | "kelvin" => Some(Scale::Kelvin),
            "c" | "celsius" | "℃" => Some(Scale::Celsius),
            "f" | "fahrenheit" | "℉" => Some(Scale::Fahrenheit),
            _ => None,
        }
    }
}

/// A temperature as an option gives it.
#[derive(Clone, Copy, Debug)]
pub struct Temperature {
    value: f64,
    scale: Option<Scale>,
}

impl Temperature {
    /// It in K; where it has no unit, `scale` is that of `--temperatures`.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] where neither is given and it may be in degrees Celsius.
    pub fn kelvin(self, option: &str, scale: Option<Scale>) -> Result<f64, Error> {
        let Temperature { value, scale: own } = self;
        match own.or(scale) {
            Some(scale) => Ok(scale.kelvin(value)),
            None if value < SURELY_KELVIN => {
                let found = format!("{value} without a unit");
                let remedy = format!("give {value}K or {value}C");
                Err(Error::new(ErrorKind::Setting, option, found, remedy))
            }
            None => Ok(value),
        }
    }
}

/// Reads a number, and its unit if there is one.
pub fn temperature(text: &str) -> Parsed<Temperature> {
    let end = text.rfind(|c: char| c.is_ascii_digit() || c == '.').map_or(0, |k| k + 1);
    let (number, unit) = text.split_at(end);
    let wrong = || give("a temperature in K, or with its unit, such as 293.15 or 20C");
    let value = number.parse().map_err(|_| wrong())?;
    let scale = match unit.trim() {
        "" => None,
        unit => Some(Scale::of_unit(unit).ok_or_else(wrong)?),
    };
    Ok(Temperature { value, scale })
}
