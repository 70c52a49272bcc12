//! One number for what arrives: irradiance or illuminance.

use crate::scene::{Rgb, luminance};

/// What a grid is of: how three channels become one number, and its unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Irradiance, W/m²: the mean of the channels.
    Irradiance,
    /// Illuminance, lx: the channels weighted as linear BT.709 weights them to luminance, 0.2126,
    /// 0.7152 and 0.0722, which add up to one. For scenes whose radiances are luminances in cd/m²,
    /// a white lamp of 1000 cd/m² having 1000 in each channel; nothing is multiplied by lumens per
    /// watt.
    Illuminance,
}

impl Quantity {
    /// The number for three channels.
    pub fn of(self, channels: Rgb) -> f64 {
        match self {
            Quantity::Irradiance => channels.element_sum() / 3.0,
            Quantity::Illuminance => luminance(channels),
        }
    }

    /// Its unit.
    pub fn unit(self) -> &'static str {
        match self {
            Quantity::Irradiance => "W/m²",
            Quantity::Illuminance => "lx",
        }
    }
}
