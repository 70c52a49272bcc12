//! Photometric quantities: irradiance or illuminance as one number.

use crate::scene::{Rgb, luminance};

/// The quantity of a grid: conversion of three channels to one number, and its unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Irradiance, W/m²: the mean of the channels.
    Irradiance,
    /// Illuminance, lx: the channels weighted as linear BT.709 weights them to luminance, 0.2126,
    /// 0.7152 and 0.0722, whose sum is 1. For scenes whose radiances are luminances in cd/m²: a
    /// white lamp of 1000 cd/m² has 1000 in each channel. No factor of lumens per watt is applied.
    Illuminance,
}

impl Quantity {
    /// The value for three channels.
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
