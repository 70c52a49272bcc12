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

use fearless_simd::{Simd, SimdBase, SimdMask, f32x8};
use glam::{DVec3, Vec3A};

use crate::geometry::aabb::Aabb;

use super::collapse::WIDTH;
use super::min_max::MinMax;
use super::sah_tree::Aabb32;

/// Longest side of the scene in the hierarchy's own unit. Plain choice: products of three of them
/// and their inverses are far within the range of 32-bit numbers.
pub(super) const SCENE_SIZE: f32 = 1e5;

/// Margin of boxes on every side, in the hierarchy's unit: 1e-6 of the scene, several roundings of
/// a 32-bit coordinate (6e-8 each).
const BOX_MARGIN: f32 = 1e-6 * SCENE_SIZE;

/// Conversion from the scene's unit to the hierarchy's.
#[derive(Debug)]
pub(crate) struct LocalUnit {
    /// Middle of the scene.
    origin: DVec3,
    scale: f64,
}

/// Eight 32-bit lanes in memory, aligned for one load.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(super) struct Lanes(pub [f32; WIDTH]);

/// Eight boxes: planes of their low and high sides along x, y and z.
pub(super) type BoxPlanes = [[Lanes; 3]; 2];

/// The same in registers.
pub(super) type LoadedPlanes<S> = [[f32x8<S>; 3]; 2];

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

    /// Whether rays from `from`, scene unit, keep within the margins: no further from the centre
    /// than twice the size of what is to be hit.
    #[inline(always)]
    pub fn is_near(&self, from: DVec3) -> bool {
        self.to_local(from).abs().max_element() <= 2.0 * f64::from(SCENE_SIZE)
    }

    /// The distance along `direction` (any length, in units of it) from `from` to the point nearest
    /// to the centre.
    #[inline(always)]
    pub fn nearest_to_centre(&self, from: DVec3, direction: DVec3) -> f64 {
        (self.origin - from).dot(direction) / direction.length_squared()
    }

    /// The ray along `direction` (any length) from `from` within `reach` in units of it, and the
    /// length of that unit in units of the ray's own.
    #[inline]
    pub(super) fn ray(&self, from: DVec3, direction: DVec3, reach: Range<f64>) -> (Ray32, f64) {
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

/// The planes relative to `origin`.
#[inline(always)]
pub(super) fn planes_from<S: Simd>(
    simd: S,
    planes: &BoxPlanes,
    origin: &[f32x8<S>; 3],
) -> LoadedPlanes<S> {
    let [low, high] = planes;
    let from = |plane: &Lanes, axis: usize| f32x8::load_array_ref(simd, &plane.0) - origin[axis];
    [
        [from(&low[0], 0), from(&low[1], 1), from(&low[2], 2)],
        [from(&high[0], 0), from(&high[1], 1), from(&high[2], 2)],
    ]
}

/// The three components, each in all lanes.
#[inline(always)]
pub(super) fn splat<S: Simd, V: SimdBase<S, Element = f32>>(simd: S, v: Vec3A) -> [V; 3] {
    let [x, y, z] = v.to_array();
    [V::splat(simd, x), V::splat(simd, y), V::splat(simd, z)]
}

impl Ray32 {
    /// Mask of the boxes, of eight, that the ray hits between start and end, one bit each, and the
    /// distances of entry. The planes are relative to the ray's origin.
    #[inline(always)]
    pub fn meets<S: Simd>(&self, simd: S, planes: &LoadedPlanes<S>) -> (u32, f32x8<S>) {
        let inverse: [f32x8<S>; 3] = splat(simd, self.inverse);
        let [x, y, z] = self.near_sides.map(|side| side & 1);
        let [near_x, near_y, near_z] =
            [planes[x][0] * inverse[0], planes[y][1] * inverse[1], planes[z][2] * inverse[2]];
        let [far_x, far_y, far_z] = [
            planes[x ^ 1][0] * inverse[0],
            planes[y ^ 1][1] * inverse[1],
            planes[z ^ 1][2] * inverse[2],
        ];
        let (start, end) = (f32x8::splat(simd, self.start), f32x8::splat(simd, self.end));
        let entry = near_x.larger(near_y).larger(near_z.larger(start));
        let exit = far_x.smaller(far_y).smaller(far_z.smaller(end));
        (entry.simd_le(exit).to_bitmask() as u32, entry)
    }
}
