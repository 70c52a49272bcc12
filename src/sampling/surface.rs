//! Points on surfaces of triangles, in proportion to area.
//!
//! Areas are summed up triangle by triangle. A position along that sum, from 0 to the whole area,
//! lies within one triangle, and the larger a triangle, the more positions lie in it:
//!
//! ```text
//! 0        a₀   a₀+a₁              a₀+a₁+a₂
//! ├────────┼────┼──────────────────┤
//!  triangle 0  1        ↑ position: triangle 2, a fraction of the way through it
//! ```

use crate::sampling::low_discrepancy::{fold_to_triangle, r2_point};

/// Chooses triangles in proportion to their areas.
#[derive(Clone, Debug)]
pub(crate) struct AreaSampler {
    /// Area of each triangle and all before it, length unit squared.
    cumulative: Vec<f64>,
}

/// A point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SurfacePoint {
    pub triangle: usize,
    /// Barycentric weights of the triangle's second and third corner.
    pub barycentric: [f64; 2],
}

impl AreaSampler {
    /// For triangles of these areas, in their order.
    pub fn new(areas: impl IntoIterator<Item = f64>) -> AreaSampler {
        let mut sum = 0.0;
        let mut cumulative = vec![];
        for area in areas {
            sum += area;
            cumulative.push(sum);
        }
        AreaSampler { cumulative }
    }

    /// Area of all triangles, length unit squared.
    pub fn total_area(&self) -> f64 {
        self.cumulative.last().copied().unwrap_or(0.0)
    }

    /// The triangle at the position `x`, in [0, 1), of the whole area, and how much of that
    /// triangle's area lies before it, in [0, 1]. There must be a triangle.
    pub fn locate(&self, x: f64) -> (usize, f64) {
        let position = x * self.total_area();
        let last = self.cumulative.len() - 1;
        let triangle = self.cumulative.partition_point(|&end| end <= position).min(last);
        let start = if triangle == 0 { 0.0 } else { self.cumulative[triangle - 1] };
        let fraction = (position - start) / (self.cumulative[triangle] - start);
        (triangle, fraction.clamp(0.0, 1.0))
    }

    /// `count` points spread evenly over the surface: strata of equal area along the triangles'
    /// order, and within each triangle the R₂ sequence from `offset` on, folded. None without area.
    pub fn spread(&self, count: usize, offset: f64) -> impl Iterator<Item = SurfacePoint> + '_ {
        let count = if self.total_area() > 0.0 { count } else { 0 };
        (0..count).map(move |k| {
            let (triangle, _) = self.locate((k as f64 + 0.5) / count as f64);
            SurfacePoint { triangle, barycentric: fold_to_triangle(r2_point(k, offset)) }
        })
    }
}

/// A point of a triangle, by the weights of its second and third corner, then alternatives to it,
/// spread evenly over the triangle.
pub(crate) fn shifted([u, v]: [f64; 2]) -> impl Iterator<Item = [f64; 2]> {
    let shift = move |k: usize| {
        let [x, y] = r2_point(k, 0.0);
        fold_to_triangle([(u + x).fract(), (v + y).fract()])
    };
    std::iter::once([u, v]).chain((1..64).map(shift))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn locates_triangles_in_proportion_to_area() {
        let surface = AreaSampler::new([1.0, 0.0, 2.0, 1.0]);
        assert_eq!(surface.total_area(), 4.0);
        assert_eq!(surface.locate(0.0), (0, 0.0));
        assert_eq!(surface.locate(0.125), (0, 0.5));
        assert_eq!(surface.locate(0.25), (2, 0.0));
        assert_eq!(surface.locate(0.5), (2, 0.5));
        assert_eq!(surface.locate(1.0), (3, 1.0));
    }

    #[test]
    fn spreads_points_by_area_and_within_triangles() {
        let surface = AreaSampler::new([3.0, 1.0]);
        let points: Vec<SurfacePoint> = surface.spread(1000, 0.5).collect();
        assert_eq!(points.iter().filter(|p| p.triangle == 0).count(), 750);
        let mean = |k: usize| points.iter().map(|p| p.barycentric[k]).sum::<f64>() / 1000.0;
        // The centroid's weights are 1/3; a low-discrepancy mean of 1000 points is off by some
        // 1/1000.
        assert!((mean(0) - 1.0 / 3.0).abs() < 5e-3 && (mean(1) - 1.0 / 3.0).abs() < 5e-3);
        assert!(points.iter().all(|p| p.barycentric[0] + p.barycentric[1] <= 1.0));
        assert_eq!(AreaSampler::new([]).spread(10, 0.0).count(), 0);
    }
}
