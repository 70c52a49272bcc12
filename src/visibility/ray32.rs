//! Rays in the hierarchy's own unit and in 32 bits, and their intersection with boxes.
//!
//! ```text
//!            near  far                      A ray is in a box from the last near
//!              │    │                       plane that it crosses to the first
//!  far  ───────┼────●──         ╱           far one, if these are in that order
//!              │  ╱ │                       (Kay, Kajiya 1986).
//!  near ───────●────┼──
//! ```
//!
//! Boxes are enlarged by a margin above 32-bit rounding, and reaches are rounded outwards.

use std::ops::Range;

use glam::{DVec3, Vec3A, Vec4};

use crate::geometry::aabb::Aabb;

use super::sah_tree::Aabb32;

/// Longest side of the scene in the hierarchy's own unit. Plain choice: products of three of them
/// and their inverses are far within the range of 32-bit numbers.
pub(super) const SCENE_SIZE: f32 = 1e5;

/// Margin of boxes on every side, in the hierarchy's unit: 1e-6 of the scene, several roundings of
/// a 32-bit coordinate (6e-8 each).
const BOX_MARGIN: f32 = 1e-6 * SCENE_SIZE;

/// Conversion from the scene's unit to the hierarchy's.
#[derive(Debug)]
pub(super) struct LocalUnit {
    /// Middle of the scene.
    origin: DVec3,
    scale: f64,
}

/// Eight boxes: planes of their low and high sides along x, y and z, four per vector.
pub(super) type BoxPlanes = [[[Vec4; 2]; 3]; 2];

/// A ray in the hierarchy's unit. Distances are in units of its direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ray32 {
    pub origin: Vec3A,
    /// Its largest component is 1 or -1.
    pub direction: Vec3A,
    inverse: Vec3A,
    /// Per axis the side of a box that the ray crosses first: 0 for the low one.
    near_sides: [usize; 3],
    pub start: f32,
    pub end: f32,
}

impl LocalUnit {
    /// For a scene within `bounds`.
    pub fn new(bounds: &Aabb) -> LocalUnit {
        let size = bounds.longest_side().max(f64::MIN_POSITIVE);
        LocalUnit { origin: bounds.centre(), scale: f64::from(SCENE_SIZE) / size }
    }

    pub fn to_local(&self, point: DVec3) -> DVec3 {
        (point - self.origin) * self.scale
    }

    /// Converts a position from the hierarchy's unit to that of the scene.
    pub fn in_scene_unit(&self, position: DVec3) -> DVec3 {
        position / self.scale + self.origin
    }

    /// Bounds of a triangle, with the margin.
    pub fn bounds(&self, corners: [DVec3; 3]) -> Aabb32 {
        let [a, b, c] = corners.map(|corner| self.to_local(corner).as_vec3a());
        Aabb32 { low: a.min(b).min(c) - BOX_MARGIN, high: a.max(b).max(c) + BOX_MARGIN }
    }

    /// The ray along `direction` (any length) from `from` within `reach` in units of it, and the
    /// length of that unit in units of the ray's own.
    #[inline]
    pub fn ray(&self, from: DVec3, direction: DVec3, reach: Range<f64>) -> (Ray32, f64) {
        let length = direction.abs().max_element();
        let unit = (direction * length.recip()).as_vec3a();
        // No component has an infinite inverse. Across the scene the error is below any rounding.
        let min = Vec3A::splat(1e-20);
        let unit = Vec3A::select(unit.abs().cmplt(min), min.copysign(unit), unit);
        let (signs, length) = (unit.is_negative_bitmask() as usize, length * self.scale);
        let start = -rounded_up(-reach.start * length);
        let ray = Ray32 {
            origin: self.to_local(from).as_vec3a(),
            direction: unit,
            inverse: unit.recip(),
            near_sides: [signs & 1, signs >> 1 & 1, signs >> 2],
            // The margin of boxes covers a start at 0.
            start: if reach.start < 0.0 { start } else { start.max(0.0) },
            end: rounded_up(reach.end * length),
        };
        (ray, length)
    }
}

/// A finite distance in 32 bits, not below `distance`.
#[inline]
pub(super) fn rounded_up(distance: f64) -> f32 {
    let rounded = distance as f32;
    (rounded + 4.0 * f32::EPSILON * rounded.abs() + BOX_MARGIN).min(f32::MAX)
}

#[inline(always)]
pub(super) fn splat(v: Vec3A) -> [Vec4; 3] {
    v.to_array().map(Vec4::splat)
}

impl Ray32 {
    /// Mask of the boxes, of eight, that the ray hits between start and end, one bit each, and the
    /// distances of entry. `plane` returns the planes of [`BoxPlanes`] relative to the ray's
    /// origin.
    #[inline(always)]
    pub fn meets(&self, plane: impl Fn(usize, usize, usize) -> Vec4) -> (u32, [[f32; 4]; 2]) {
        let inverse = splat(self.inverse);
        let [x, y, z] = self.near_sides.map(|side| side & 1);
        let (start, end) = (Vec4::splat(self.start), Vec4::splat(self.end));
        let (mut hits, mut entries) = (0, [[0.0; 4]; 2]);
        for (half, entries) in entries.iter_mut().enumerate() {
            let at = |side, axis: usize| plane(side, axis, half) * inverse[axis];
            let entry = at(x, 0).max(at(y, 1)).max(at(z, 2).max(start));
            let exit = at(x ^ 1, 0).min(at(y ^ 1, 1)).min(at(z ^ 1, 2).min(end));
            hits |= entry.cmple(exit).bitmask() << (4 * half);
            *entries = entry.to_array();
        }
        (hits, entries)
    }
}
