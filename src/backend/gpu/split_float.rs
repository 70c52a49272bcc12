//! Coordinates on a device: relative to the middle of the scene, in units of its size, each as the
//! sum of two 32-bit numbers. They are the same for a scene of any scale at any position.
//!
//! ```text
//! p = (position − middle) / longest side  ≈  high + low       2⁻⁴⁸ of the scene's size is kept
//! from the eye: (high − eye_high) + (low − eye_low)           the first difference is exact nearby
//! ```

use glam::DVec3;

use super::layout::Corner;
use crate::scene::Scene;

/// A scene's own coordinates on the device.
#[derive(Clone, Copy, Debug)]
pub struct SplitFloat {
    origin: DVec3,
    /// Longest side of the box around the scene, its own unit.
    unit: f64,
}

impl SplitFloat {
    pub fn new(scene: &Scene) -> SplitFloat {
        let bounds = scene.bounds();
        SplitFloat { origin: bounds.centre(), unit: bounds.longest_side() }
    }

    /// The two parts of `p`, high and low: 32 bits of it, and 32 bits of the remainder. Differences
    /// of parts are added, and near an eye the first of them is exact, so that small objects there
    /// keep their shape.
    pub fn parts(&self, p: DVec3) -> [[f32; 3]; 2] {
        let p = (p - self.origin) / self.unit;
        let high = p.as_vec3();
        [high.to_array(), (p - high.as_dvec3()).as_vec3().to_array()]
    }

    /// Corners of `triangles` of `scene` in order, as `item_buffer.wgsl` reads them.
    pub fn corners(&self, scene: &Scene, triangles: &[u32]) -> Vec<Corner> {
        let corners = |&t: &u32| {
            let back_is_covered = scene.is_back_covered(t as usize).into();
            scene.corners(t as usize).map(|p| {
                let [high, low] = self.parts(p);
                Corner { high, back_is_covered, low, padding: 0 }
            })
        };
        triangles.iter().flat_map(corners).collect()
    }

    /// One unit of the scene, in units of the device.
    pub fn length_unit(&self) -> f64 {
        1.0 / self.unit
    }

    /// An area, in squares of the device's unit.
    pub fn area(&self, area: f64) -> f32 {
        (area / self.unit / self.unit) as f32
    }

    /// A length, in the device's unit.
    pub fn length(&self, length: f64) -> f32 {
        (length / self.unit) as f32
    }

    /// An inverse length, converted from the device's to the scene's unit.
    pub fn inverse_length(&self, inverse: f32) -> f64 {
        f64::from(inverse) / self.unit
    }
}
