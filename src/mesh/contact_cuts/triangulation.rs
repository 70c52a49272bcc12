//! A triangle in pieces: a constrained Delaunay triangulation of its contact segments, with points
//! added until angles are not too sharp (Ruppert, "A Delaunay refinement algorithm for quality
//! 2-dimensional mesh generation", 1995; both by the `spade` crate).

use glam::{DVec2, DVec3};
use spade::handles::DirectedEdgeHandle;
use spade::{
    AngleLimit, ConstrainedDelaunayTriangulation, Point2, RefinementParameters, Triangulation,
};

use super::crossings::{FINE_STEPS, FinePoint, split_at_crossings};
use super::snapping::{Cuts, LatticePoint, STEPS};
use crate::mesh::Side;
use crate::scene::Piece;

/// Weights are rounded to multiples of one over this, the lattice of crossings: points of that and
/// of the coarser one are unchanged.
const ROUNDING: f64 = FINE_STEPS as f64;

type Delaunay = ConstrainedDelaunayTriangulation<Point2<f64>>;

/// A triangle to be cut.
pub(super) struct CutTriangle {
    pub corners: [DVec3; 3],
    /// Its sides on the smooth surface.
    pub sides: [Side; 3],
    /// Edge below which no element is split, scene unit.
    pub finest: f64,
}

impl CutTriangle {
    /// The pieces made by `cuts`: the whole triangle if there are none.
    pub fn pieces(&self, cuts: &Cuts) -> Vec<Piece> {
        let is_whole = cuts.segments.is_empty() && cuts.on_sides.iter().all(Vec::is_empty);
        let pieces = if is_whole { None } else { self.triangulated(cuts) };
        pieces.unwrap_or_else(|| vec![Piece::whole(self.corners)])
    }

    /// The factor of the first weight that makes angles about right: a power of two, which keeps
    /// points on a side exactly on it.
    fn stretch(&self) -> f64 {
        let [a, b, c] = self.corners;
        libm::exp2(libm::log2(b.distance(a) / c.distance(a)).round())
    }

    /// The triangulation of the cuts by stretched weights.
    fn constrained(&self, cuts: &Cuts) -> Option<Delaunay> {
        let stretch = self.stretch();
        let position = |[u, v]: LatticePoint| {
            let [u, v] = [u, v].map(|k| f64::from(k) / f64::from(STEPS));
            Point2::new(u * stretch, v)
        };
        let mut triangulation = Delaunay::new();
        for k in 0..3 {
            let mut steps = vec![0, STEPS];
            steps.extend(&cuts.on_sides[k]);
            steps.sort_unstable();
            let on_side = |step: u32| [[step, 0], [STEPS - step, step], [0, STEPS - step]][k];
            for pair in steps.windows(2) {
                let from = triangulation.insert(position(on_side(pair[0]))).ok()?;
                let to = triangulation.insert(position(on_side(pair[1]))).ok()?;
                triangulation.add_constraint(from, to);
            }
        }
        let fine = |[u, v]: FinePoint| {
            let [u, v] = [u, v].map(|k| k as f64 / FINE_STEPS as f64);
            Point2::new(u * stretch, v)
        };
        let mut constraints = vec![];
        for [from, to] in split_at_crossings(&cuts.segments) {
            let ends =
                [triangulation.insert(fine(from)).ok()?, triangulation.insert(fine(to)).ok()?];
            constraints.push(ends);
        }
        // All ends are known, so that a constraint ends at those on its way.
        for [from, to] in constraints {
            if triangulation.can_add_constraint(from, to) {
                triangulation.add_constraint(from, to);
            }
        }
        Some(triangulation)
    }

    fn triangulated(&self, cuts: &Cuts) -> Option<Vec<Piece>> {
        let [a, b, c] = self.corners;
        let stretch = self.stretch();
        let mut triangulation = self.constrained(cuts)?;
        // In these coordinates the whole triangle has half the stretch as area.
        let area = 0.5 * (b - a).cross(c - a).length();
        let min_area = 0.1 * self.finest.powi(2) / area * stretch / 2.0;
        // Below 20.7 degrees it terminates (Ruppert 1995).
        triangulation.refine(
            RefinementParameters::new()
                .keep_constraint_edges()
                .with_min_required_area(min_area)
                .with_max_additional_vertices(1000)
                .with_angle_limit(AngleLimit::from_deg(20.0)),
        );
        let weights_of = |edge: DirectedEdgeHandle<'_, _, _, _, _>| {
            let Point2 { x, y }: Point2<f64> = edge.from().position();
            [x / stretch, y].map(|w| (w * ROUNDING).round() / ROUNDING)
        };
        let is_sliver = |edges: [DirectedEdgeHandle<'_, _, _, _, _>; 3]| {
            let [p, q, r] = edges.map(|edge| DVec2::from_array(weights_of(edge)));
            // The rounding of where segments cross.
            (q - p).perp_dot(r - p) < 1e-10
        };
        let faces = triangulation.inner_faces().map(|face| face.adjacent_edges());
        let piece = |edges: [DirectedEdgeHandle<'_, _, _, _, _>; 3]| {
            let weights = edges.map(weights_of);
            let cut = [0, 1, 2].map(|k| {
                let other = edges[k].rev().face().as_inner();
                let is_cut = edges[k].is_constraint_edge()
                    || other.is_some_and(|other| is_sliver(other.adjacent_edges()));
                is_cut && !is_on_side([weights[k], weights[(k + 1) % 3]])
            });
            Piece { corners: weights.map(|w| self.position(w)), weights, cut }
        };
        Some(faces.filter(|&edges| !is_sliver(edges)).map(piece).collect())
    }

    /// The position with these weights of the second and third corner: on a side bit for bit the
    /// same as for the other triangle.
    fn position(&self, [u, v]: [f64; 2]) -> DVec3 {
        let on_side = |k: usize, share: f64| {
            let (from, to) = (self.corners[k], self.corners[(k + 1) % 3]);
            match self.sides[k].reversed {
                true => to * share + from * (1.0 - share),
                false => from * (1.0 - share) + to * share,
            }
        };
        let [a, b, c] = self.corners;
        match (u, v) {
            (0.0, 0.0) => a,
            (1.0, 0.0) => b,
            (0.0, 1.0) => c,
            (u, 0.0) => on_side(0, u),
            (u, v) if u + v == 1.0 => on_side(1, v),
            (0.0, v) => on_side(2, 1.0 - v),
            (u, v) => a * (1.0 - u - v) + b * u + c * v,
        }
    }
}

/// Whether both points are on one side of the triangle.
fn is_on_side(points: [[f64; 2]; 2]) -> bool {
    let all = |on: fn([f64; 2]) -> bool| points.into_iter().all(on);
    all(|[u, _]| u == 0.0) || all(|[_, v]| v == 0.0) || all(|[u, v]| u + v == 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::contact_cuts::snapping::side_steps;
    use fastrand::Rng;

    fn triangle(finest: f64) -> CutTriangle {
        let corners = [[1.0, 2.0, 3.0], [7.0, 1.0, 2.0], [2.0, 9.0, 8.0]].map(DVec3::from_array);
        let side = |reversed| Side { id: 0, reversed };
        CutTriangle { corners, sides: [side(false), side(true), side(false)], finest }
    }

    #[test]
    fn pieces_cover_a_triangle_whatever_cuts_it() {
        let mut rng = Rng::with_seed(7);
        let area = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a) / 2.0;
        let whole = area(triangle(0.5).corners);
        for round in 0..500 {
            // Coarse lattices make points coincide and segments overlap or meet in one point.
            let coarse = STEPS >> rng.u32(1..12);
            let mut point = || {
                let u = rng.u32(0..=STEPS / coarse);
                [u * coarse, rng.u32(0..=STEPS / coarse - u) * coarse]
            };
            let count = 1 + round % 12;
            let segments: Vec<_> = (0..count).map(|_| [point(), point()]).collect();
            let inside = |s: &[LatticePoint; 2]| s[0] != s[1];
            let segments: Vec<_> = segments.into_iter().filter(inside).collect();
            let on_sides = [vec![coarse], vec![], vec![coarse, STEPS - coarse]];
            let within =
                |steps: Vec<u32>| steps.into_iter().filter(|&s| s < STEPS).collect::<Vec<_>>();
            let mut on_sides = on_sides.map(within);
            for end in segments.iter().flatten() {
                for (steps, step) in on_sides.iter_mut().zip(side_steps(*end)) {
                    steps.extend(step);
                }
            }
            let cuts = Cuts { segments, on_sides };
            let pieces = triangle(0.5).pieces(&cuts);
            let areas = pieces.iter().map(|piece| area(piece.corners));
            let sum: DVec3 = areas.clone().sum();
            assert!(sum.distance(whole) < 1e-9 * whole.length(), "{round}: {cuts:?}");
            assert!(areas.clone().all(|a| a.dot(whole) > 0.0), "{round}: {cuts:?}");
            // Every side within the triangle has two pieces, so that the surface continues: where
            // segments overlap, their cuts may differ by rounding.
            let mut sides = std::collections::HashMap::new();
            for Piece { weights, cut, .. } in &pieces {
                for k in 0..3 {
                    let ends = [weights[k], weights[(k + 1) % 3]];
                    if !cut[k] && !is_on_side(ends) {
                        let key = ends.map(|w| w.map(f64::to_bits));
                        let key = [key[0].min(key[1]), key[0].max(key[1])];
                        *sides.entry(key).or_insert(0) += 1;
                    }
                }
            }
            assert!(sides.values().all(|&count| count == 2), "{round}: {cuts:?}");
        }
    }

    #[test]
    fn sides_of_pieces_are_cut_where_segments_are() {
        let half = STEPS / 2;
        let cuts = Cuts {
            segments: vec![[[half, 0], [0, half]]],
            on_sides: [vec![half], vec![], vec![half]],
        };
        let pieces = triangle(100.0).pieces(&cuts);
        let cut: usize = pieces.iter().flat_map(|p| p.cut).filter(|&cut| cut).count();
        assert_eq!((pieces.len(), cut), (3, 2), "one side, of a piece before and one behind");
        assert_eq!(triangle(1.0).pieces(&Cuts::default()).len(), 1);
    }
}
