//! Colours.

use glam::DVec3;

/// One value per colour channel (r, g, b), linear; the unit depends on its use. Made by
/// `Rgb::new(r, g, b)` or `Rgb::splat(grey)`.
pub type Rgb = DVec3;

/// Luminance of a linear BT.709 colour (ITU-R BT.709, item 3.2), in its own unit.
pub(crate) fn luminance(colour: Rgb) -> f64 {
    colour.dot(Rgb::new(0.2126, 0.7152, 0.0722))
}
