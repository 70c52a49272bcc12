//! Parts of triangles for points that are distributed over octaves of the distance.
//!
//! If a scene is far larger than the region with most of its triangles, such as a ground of a
//! kilometre with a room on it, the light on the ground changes next to the room, where points
//! spread evenly over area are missing:
//!
//! ```text
//!   │       │   │ │room│ │   │       │    equal numbers of points in each strip, each
//!   └───────┴───┴─┴────┴─┴───┴───────┘    standing for its part of the area
//! ```

use glam::DVec3;

use crate::geometry::aabb::Aabb;
use crate::geometry::barycentric::WHOLE;
use crate::geometry::polygon::longest_edge;

/// The dense region from which distances are measured.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Octaves {
    /// None if nothing is far away: all is one octave.
    centre: Option<Aabb>,
}

/// A part of a triangle.
#[derive(Clone, Debug)]
pub(crate) struct Part {
    /// Weights of the triangle's second and third corner at the part's corners; none if it is the
    /// whole triangle.
    pub corners: Option<Box<[[f64; 2]; 3]>>,
    /// Length unit squared.
    pub area: f64,
    /// Area over the square of the distance: weighted by it, all octaves get equal numbers of
    /// points.
    pub angular: f64,
}

impl Octaves {
    /// Of triangles with these `middles`, in a scene with this `diagonal`.
    pub fn new(middles: impl IntoIterator<Item = DVec3>, diagonal: f64) -> Octaves {
        let middles: Vec<(DVec3, f64)> = middles.into_iter().map(|middle| (middle, 1.0)).collect();
        let is_concentrated = |centre: &Aabb| {
            // Smaller parts are lost in the rounding of coordinates.
            (4.0..1e9).contains(&(diagonal / centre.diagonal()))
        };
        // A tenth of the triangles may lie outside, at either end of each axis.
        Octaves { centre: Aabb::around_most(&middles, 0.1).filter(is_concentrated) }
    }

    /// Calls `take` with the parts of a triangle with this `area`: none is longer than its
    /// distance. A triangle with holes stays whole, since its holes are not known part by part.
    pub fn for_each_part(
        &self,
        triangle: [DVec3; 3],
        area: f64,
        has_holes: bool,
        take: &mut dyn FnMut(Part),
    ) {
        let is_split = self.centre.is_some() && !has_holes;
        self.split(&triangle, WHOLE, area, is_split, take);
    }

    /// Distance of the part plus the diagonal of the dense region; 1 if all is one octave.
    fn reach(&self, corners: [DVec3; 3]) -> f64 {
        let Some(centre) = &self.centre else { return 1.0 };
        let bounds = Aabb::from_points(corners);
        let gap = (centre.low - bounds.high).max(bounds.low - centre.high).max(DVec3::ZERO);
        centre.diagonal() + gap.length()
    }

    fn split(
        &self,
        triangle: &[DVec3; 3],
        corners: [[f64; 2]; 3],
        area: f64,
        is_split: bool,
        take: &mut dyn FnMut(Part),
    ) {
        let [a, b, c] = triangle;
        let places = corners.map(|[u, v]| a * (1.0 - u - v) + b * u + c * v);
        let reach = self.reach(places);
        if !is_split || longest_edge(places) <= reach {
            let corners = (corners != WHOLE).then(|| Box::new(corners));
            return take(Part { corners, area, angular: area / (reach * reach) });
        }
        let middle =
            |k: usize, l: usize| [0, 1].map(|axis| (corners[k][axis] + corners[l][axis]) / 2.0);
        let (p, q, r) = (middle(0, 1), middle(1, 2), middle(2, 0));
        let [a, b, c] = corners;
        for part in [[a, p, r], [p, b, q], [r, q, c], [p, q, r]] {
            self.split(triangle, part, area / 4.0, is_split, take);
        }
    }
}

impl Part {
    /// Weights of the triangle's second and third corner at the point given by those of the part.
    pub fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let Some(corners) = &self.corners else { return [x, y] };
        let [p, q, r] = **corners;
        [0, 1].map(|axis| p[axis] * (1.0 - x - y) + q[axis] * x + r[axis] * y)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;

    /// Middles of 30 triangles in a unit cube.
    fn middles() -> Vec<DVec3> {
        (0..30).map(|k| DVec3::splat(f64::from(k) / 29.0)).collect()
    }

    const GROUND: [DVec3; 3] = [
        DVec3::new(-1000.0, -1000.0, 0.0),
        DVec3::new(1000.0, -1000.0, 0.0),
        DVec3::new(-1000.0, 1000.0, 0.0),
    ];

    fn parts_of(octaves: &Octaves, has_holes: bool) -> Vec<Part> {
        let mut parts = vec![];
        octaves.for_each_part(GROUND, 2e6, has_holes, &mut |part| parts.push(part));
        parts
    }

    #[test]
    fn one_with_holes_stays_whole() {
        let octaves = Octaves::new(middles(), 2000.0);
        assert!(parts_of(&octaves, false).len() > 1);
        assert_eq!(parts_of(&octaves, true).len(), 1);
    }

    #[test]
    fn every_octave_has_its_points_and_parts_add_up() {
        let octaves = Octaves::new(middles(), 2000.0);
        let parts = parts_of(&octaves, false);
        assert!((parts.iter().map(|part| part.area).sum::<f64>() / 2e6 - 1.0).abs() < 1e-12);
        let in_ring = |from: f64, to: f64| -> f64 {
            let centre_of = |part: &Part| DVec2::from(part.place([1.0 / 3.0; 2]));
            let distance = |part: &Part| {
                let [u, v] = centre_of(part).to_array();
                let at = GROUND[0] * (1.0 - u - v) + GROUND[1] * u + GROUND[2] * v;
                at.x.abs().max(at.y.abs())
            };
            let ring = parts.iter().filter(|part| (from..to).contains(&distance(part)));
            ring.map(|part| part.angular).sum()
        };
        // The integral of 1/r² over each ring is alike; parts are as coarse as they are far away,
        // and reach is the diagonal √3 and more.
        let rings = [16.0, 32.0, 64.0, 128.0, 256.0].map(|r| in_ring(r, 2.0 * r));
        for ring in rings {
            assert!((0.6..1.7).contains(&(ring / rings[0])), "{rings:?}");
        }
    }

    #[test]
    fn nothing_is_split_where_all_is_near() {
        for octaves in [
            Octaves::new(middles(), 3.0),
            // Without extent there is no dense region.
            Octaves::new([DVec3::ONE; 30], 2000.0),
        ] {
            let parts = parts_of(&octaves, false);
            assert_eq!(parts.len(), 1);
            assert_eq!((parts[0].area, parts[0].angular), (2e6, 2e6));
            assert_eq!(parts[0].place([0.25, 0.5]), [0.25, 0.5]);
        }
    }
}
