//! The texels from which a point is interpolated.

use glam::DVec2;

use crate::scene::Rgb;

/// The four texels around a point, and their weights: bilinear interpolation.
#[derive(Clone, Copy, Debug)]
pub(super) struct Footprint {
    pub texels: [u32; 4],
    pub weights: [f64; 4],
}

impl Footprint {
    /// Of a point in units of texels; beyond the border the texels on it are used.
    pub fn of(point: DVec2, [width, height]: [u32; 2]) -> Footprint {
        let axis = |x: f64, count: u32| {
            let x = x.clamp(0.0, f64::from(count - 1));
            let first = (x.floor() as u32).min(count.saturating_sub(2));
            (first, (first + 1).min(count - 1), x - f64::from(first))
        };
        let (left, right, u) = axis(point.x, width);
        let (above, below, v) = axis(point.y, height);
        let texel = |column: u32, row: u32| row * width + column;
        Footprint {
            texels: [
                texel(left, above),
                texel(right, above),
                texel(left, below),
                texel(right, below),
            ],
            weights: [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v],
        }
    }

    /// The value at the point of a map with these `values`.
    pub fn value(&self, values: &[Rgb]) -> Rgb {
        self.texels.iter().zip(self.weights).map(|(&k, weight)| values[k as usize] * weight).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linear_values_are_interpolated_exactly() {
        // Value 2x + 3y at centre (x, y) of 5 × 4 texels; clamped beyond them.
        let values: Vec<Rgb> =
            (0..20).map(|k| Rgb::splat(f64::from(2 * (k % 5) + 3 * (k / 5)))).collect();
        for (point, wanted) in
            [([1.25, 2.5], 10.0), ([4.0, 3.0], 17.0), ([-3.0, 1.5], 4.5), ([9.0, 9.0], 17.0)]
        {
            let value = Footprint::of(point.into(), [5, 4]).value(&values);
            assert_eq!(value, Rgb::splat(wanted), "{point:?}");
        }
        assert_eq!(Footprint::of(DVec2::splat(0.3), [1, 1]).value(&values[7..]), values[7]);
    }
}
