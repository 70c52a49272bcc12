//! Evenly distributed points on convex polygons.

use glam::DVec3;

use crate::geometry::COINCIDENCE_TOLERANCE;
use crate::geometry::polygon::fan;
use crate::sampling::hash::split_mix64;

/// Point `k` of a scrambled Sobol set in four dimensions, in (0, 1)⁴; every `seed` gives another
/// set (B. Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020). Of a power-of-two
/// number of points up to 2¹⁶, both halves are as evenly distributed as the whole.
pub(super) fn scrambled_point(k: u32, seed: u64) -> [f64; 4] {
    let set = split_mix64(seed.wrapping_add(u64::from(k >> 16))) as u32;
    // Half a step between the coordinates, multiples of 2⁻²⁴: no point is on the boundary.
    sobol_burley::sample_4d(k & 0xffff, 0, set).map(|x| f64::from(x) + 0.5 / f64::from(1 << 24))
}

/// A convex polygon to sample: maps the unit square piecewise onto it, preserving area and so even
/// distribution.
pub(super) struct PolygonPoints {
    pieces: Vec<Piece>,
}

/// A triangle of the fan of a polygon, or a parallelogram.
struct Piece {
    origin: DVec3,
    /// Edges from the origin.
    edges: [DVec3; 2],
    is_parallelogram: bool,
    /// Cumulative share of the polygon's area up to the end of this piece.
    end: f64,
}

impl PolygonPoints {
    /// For a polygon with area.
    pub fn new(polygon: &[DVec3]) -> PolygonPoints {
        if let &[a, b, c, d] = polygon
            && (a + c - b - d).length() <= COINCIDENCE_TOLERANCE * (c - a).length()
        {
            let edges = [b - a, d - a];
            let all = Piece { origin: a, edges, is_parallelogram: true, end: 1.0 };
            return PolygonPoints { pieces: vec![all] };
        }
        let area = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).length();
        let total: f64 = fan(polygon).map(area).sum();
        let mut sum = 0.0;
        let piece = |triangle: [DVec3; 3]| {
            sum += area(triangle);
            let [origin, b, c] = triangle;
            let edges = [b - origin, c - origin];
            Piece { origin, edges, is_parallelogram: false, end: sum / total }
        };
        PolygonPoints { pieces: fan(polygon).map(piece).collect() }
    }

    /// The point at (u, v) in (0, 1)²: an area-preserving map.
    pub fn at(&self, u: f64, v: f64) -> DVec3 {
        let before = self.pieces.partition_point(|piece| piece.end <= u);
        let k = before.min(self.pieces.len() - 1);
        let Piece { origin, edges: [x, y], is_parallelogram, end } = self.pieces[k];
        let start = if k == 0 { 0.0 } else { self.pieces[k - 1].end };
        let u = ((u - start) / (end - start)).clamp(0.0, 1.0);
        let [u, v] = if is_parallelogram { [u, v] } else { onto_triangle(u, v) };
        origin + u * x + v * y
    }
}

/// The square folded onto the triangle of u + v ≤ 1 along its diagonal (E. Heitz, "A low-distortion
/// map between triangle and square", 2019).
fn onto_triangle(u: f64, v: f64) -> [f64; 2] {
    let half = 0.5 * u.min(v);
    if u > v { [u - half, half] } else { [half, v - half] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_fill_a_polygon_evenly() {
        // A kite of area 4 with unequal triangles: 1 below y = 1, 3 above.
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
        // A line cuts some 64 of the 4096 cells of a net; half of them wrong would be 0.008.
        assert!((share(&|p| p.y < 1.0) - 0.25).abs() < 0.008);
        assert!((share(&|p| p.x < 0.0) - 0.5).abs() < 0.008);
        assert!(all.iter().all(|p| (p.z - 2.0).abs() < 1e-15));
        let centroid = all.iter().sum::<DVec3>() / all.len() as f64;
        assert!((centroid.y - 5.0 / 3.0).abs() < 0.01, "{centroid}");
    }

    #[test]
    fn a_parallelogram_has_the_cells_of_the_square() {
        let (x, y) = (DVec3::new(2.0, 0.5, 0.0), DVec3::new(0.3, 0.0, 1.0));
        let points =
            PolygonPoints::new(&[DVec3::ONE, DVec3::ONE + x, DVec3::ONE + x + y, DVec3::ONE + y]);
        // 64 points of a net: one in each of 8 × 8 cells.
        let mut cells = [0; 64];
        for k in 0..64 {
            let [u, v, ..] = scrambled_point(k, 3);
            let along = points.at(u, v) - DVec3::ONE;
            let height = along.z;
            let way = (along.x - 0.3 * height) / 2.0;
            cells[(8.0 * way) as usize * 8 + (8.0 * height) as usize] += 1;
        }
        assert_eq!(cells, [1; 64]);
    }
}
