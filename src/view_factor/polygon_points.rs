//! Points spread evenly over convex polygons.

use glam::DVec3;

use crate::geometry::polygon::fan;
use crate::sampling::hash::split_mix64;

/// Points of one scrambled set at most; further ones come from further sets.
const SET_SIZE: u32 = 1 << 16;

/// Half a step between the coordinates of a set, which are multiples of 2⁻²⁴: no point is on a rim.
const HALF_STEP: f64 = 0.5 / (1 << 24) as f64;

/// Point `k` of a scrambled Sobol set in four dimensions, in (0, 1)⁴; every `seed` gives a set of
/// its own (B. Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020). Of a power of two,
/// both halves are as evenly spread as the whole.
pub(super) fn scrambled_point(k: u32, seed: u64) -> [f64; 4] {
    let set = split_mix64(seed.wrapping_add(u64::from(k / SET_SIZE))) as u32;
    sobol_burley::sample_4d(k % SET_SIZE, 0, set).map(|x| f64::from(x) + HALF_STEP)
}

/// A convex polygon that points are spread over.
pub(super) struct PolygonPoints {
    /// The triangles of its fan, each with the share of the area up to its end.
    triangles: Vec<([DVec3; 3], f64)>,
}

impl PolygonPoints {
    /// For a polygon with area.
    pub fn new(polygon: &[DVec3]) -> PolygonPoints {
        let area = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).length();
        let total: f64 = fan(polygon).map(area).sum();
        let mut sum = 0.0;
        let with_end = |triangle| {
            sum += area(triangle);
            (triangle, sum / total)
        };
        PolygonPoints { triangles: fan(polygon).map(with_end).collect() }
    }

    /// The point that (u, v) in (0, 1)² stands for: equal areas stand for equal areas.
    pub fn at(&self, u: f64, v: f64) -> DVec3 {
        let before = self.triangles.partition_point(|(_, end)| *end <= u);
        let k = before.min(self.triangles.len() - 1);
        let ([a, b, c], end) = self.triangles[k];
        let start = if k == 0 { 0.0 } else { self.triangles[k - 1].1 };
        // From the corner of the fan, the share of the area grows as the square of the way.
        let way = ((u - start) / (end - start)).clamp(0.0, 1.0).sqrt();
        a + way * ((1.0 - v) * (b - a) + v * (c - a))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_fill_a_polygon_evenly() {
        // A kite of area 4 whose triangles are unlike: 1 below y = 1, 3 above.
        let kite = [(0.0, 0.0), (1.0, 1.0), (0.0, 4.0), (-1.0, 1.0)];
        let kite = kite.map(|(x, y)| DVec3::new(x, y, 2.0));
        let points = PolygonPoints::new(&kite);
        let at = |k| {
            let [u, v, ..] = scrambled_point(k, 7);
            points.at(u, v)
        };
        let all: Vec<DVec3> = (0..4096).map(at).collect();
        let share = |is_in: &dyn Fn(&DVec3) -> bool| {
            all.iter().filter(|p| is_in(p)).count() as f64 / all.len() as f64
        };
        // A line cuts some 64 of the 4096 cells of a net; half of them off would be 0.008.
        assert!((share(&|p| p.y < 1.0) - 0.25).abs() < 0.008);
        assert!((share(&|p| p.x < 0.0) - 0.5).abs() < 0.008);
        assert!(all.iter().all(|p| (p.z - 2.0).abs() < 1e-15));
        let centroid = all.iter().sum::<DVec3>() / all.len() as f64;
        assert!((centroid.y - 5.0 / 3.0).abs() < 0.01, "{centroid}");
    }
}
