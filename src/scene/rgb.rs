//! Colours.

use std::ops::RangeInclusive;

use glam::DVec3;

/// One value per colour channel (r, g, b), linear; the unit is said where it is used. Made by
/// `Rgb::new(r, g, b)` or `Rgb::splat(grey)`.
pub type Rgb = DVec3;

/// Light other than 0, in each channel and any unit: squares of it and sums over a scene are far
/// from what numbers can hold, at either end.
const LIGHT: RangeInclusive<f64> = 1e-32..=1e32;

/// What would be right in the place of what is no [`is_light`].
pub(crate) const LIGHT_REMEDY: &str =
    "must be 0, or between 1e-32 and 1e32: give all light in another unit";

/// Whether radiance, irradiance or exitance may have this colour.
pub(crate) fn is_light(colour: Rgb) -> bool {
    colour.to_array().iter().all(|value| *value == 0.0 || LIGHT.contains(value))
}

/// Luminance of a linear BT.709 colour (ITU-R BT.709, item 3.2), in its own unit.
pub(crate) fn luminance(colour: Rgb) -> f64 {
    colour.dot(Rgb::new(0.2126, 0.7152, 0.0722))
}
