//! Deviations of a ray that rounding may cause.

use glam::{Vec2, Vec3};

use crate::backend::gpu::layout::TracedPoint;

/// How far rays are turned, points on lights are moved (both along two axes) and origins are moved.
#[derive(Clone, Copy, Debug)]
pub struct Shift {
    pub across: Vec2,
    pub origin: Vec3,
}

impl Shift {
    /// That of the twins themselves.
    pub const NONE: Shift = Shift { across: Vec2::ZERO, origin: Vec3::ZERO };

    /// None, and deviations in all directions: a ray of the device is that of the twin for one of
    /// these, or between them.
    ///
    /// Directions: the tested devices compute sines and cosines to 2⁻²⁰, and all other rounding of
    /// a direction, some ten of 2⁻²⁴, is less. Origins: a triangle test rounds differences of
    /// coordinates, which are below 2 in units of the scene's size, some four times by 2⁻²⁴ of
    /// that.
    pub fn all() -> Vec<Shift> {
        let steps = [-1.0, 0.0, 1.0];
        let across = steps.iter().flat_map(|&y| steps.map(|x| Vec2::new(x, y)));
        let across = across.filter(|a| *a != Vec2::ZERO).map(|a| a * 2f32.powi(-20));
        let across = across.map(|across| Shift { across, ..Shift::NONE });
        let axes = [Vec3::X, Vec3::Y, Vec3::Z].into_iter().flat_map(|axis| [axis, -axis]);
        let along = axes.map(|axis| Shift { origin: axis * 2f32.powi(-21), ..Shift::NONE });
        std::iter::once(Shift::NONE).chain(across).chain(along).collect()
    }

    /// A direction, turned in the plane across it.
    pub fn direction(&self, direction: Vec3) -> Vec3 {
        if self.across == Vec2::ZERO {
            return direction;
        }
        let (x, y) = direction.any_orthonormal_pair();
        (direction + x * self.across.x + y * self.across.y).normalize()
    }

    /// A point of the unit square: a light is no wider than the hemisphere.
    pub fn moved(&self, at: Vec2) -> Vec2 {
        (at + self.across).clamp(Vec2::ZERO, Vec2::ONE)
    }

    /// A point from which rays start.
    pub fn point(&self, point: TracedPoint) -> TracedPoint {
        let position_low = (Vec3::from(point.position_low) + self.origin).to_array();
        TracedPoint { position_low, ..point }
    }
}
