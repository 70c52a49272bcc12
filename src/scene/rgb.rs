//! Colours.

use glam::DVec3;

/// One value per colour channel (r, g, b), linear; the unit is said where it is used. Made by
/// `Rgb::new(r, g, b)` or `Rgb::splat(grey)`.
pub type Rgb = DVec3;
