//! Pieces of triangles that are far larger than the lit region: a quadtree has
//! [`super::Mesh::MAX_DEPTH`] levels, and twelve halvings of a ground plane of a kilometre leave
//! elements of a quarter of a metre, which do not resolve the room that stands on it.
//!
//! Pieces grow with their distance from the light as elements do, so that each octave of the
//! distance has the same number. They are made by halving longest edges; if an edge is not the
//! longest of both triangles at it, the triangle with a longer one is halved first (Rivara,
//! "Algorithms for refining triangular grids suitable for adaptive and multigrid techniques",
//! 1984), so that no corner of a piece lies on the side of another:
//!
//! ```text
//!   ┌───────────────┐        ┌───────────────┐
//!   │             ╱ │        │╲     ╱│     ╱ │
//!   │         ╱     │        │  ╲ ╱  │  ╱    │
//!   │     ╱         │   ─►   ├───────┼───────┤
//!   │ ╱             │        │ ╲ │ ╱ │  ╲    │
//!   └─■─────────────┘        └─■─────┴───────┘   ■ the light
//! ```

use std::sync::Arc;

use glam::DVec3;
use rustc_hash::{FxHashMap, FxHashSet};

use super::SurfaceTopology;
use super::sizing::size_growth;
use crate::geometry::aabb::Aabb;
use crate::scene::{Piece, Scene, longest_edge};

/// `scene` with its reflecting triangles cut until none has a longer edge than the diagonal of
/// `region`, which has the light, times the growth with the distance from it; unchanged if none is
/// so large. Below a piece there are [`super::Mesh::MAX_DEPTH`] levels of elements, down to 1/4096
/// of the region.
pub(crate) fn cut_large_triangles(scene: &Arc<Scene>, region: &Aabb) -> Arc<Scene> {
    // Smaller pieces are lost in the rounding of coordinates.
    let min_extent = region.diagonal().max(scene.reflecting_bounds().diagonal() / 1e9);
    let is_large = |t: usize, corners: &[DVec3; 3]| {
        let material = scene.material(t);
        // Glass cut only partly would enclose no body.
        material.scatters()
            && !material.specular.is_some_and(|specular| specular.is_glass())
            && longest_edge(*corners) > min_extent * size_growth(Some(region), corners)
    };
    let count = scene.triangles().len();
    if !(0..count).any(|t| is_large(t, &scene.corners(t))) {
        return scene.clone();
    }
    match Bisection::new(scene).run(is_large) {
        Some(pieces) => Arc::new(scene.cut(pieces)),
        None => scene.clone(),
    }
}

/// Two corners on the smooth surface, the lower first.
type Edge = (u32, u32);

/// A part of a triangle.
#[derive(Clone, Copy)]
struct Part {
    triangle: usize,
    /// Identities of its corners on the smooth surface.
    ids: [u32; 3],
    corners: [DVec3; 3],
    /// Weights of the triangle's second and third corner at each corner.
    weights: [[f64; 2]; 3],
}

/// Triangles in parts that fit together.
struct Bisection {
    parts: Vec<Part>,
    /// The parts at each edge.
    at_edge: FxHashMap<Edge, Vec<usize>>,
    /// The midpoint of each edge that was halved.
    middles: FxHashMap<Edge, u32>,
    next_id: u32,
}

impl Part {
    fn edge(&self, k: usize) -> Edge {
        let (a, b) = (self.ids[k], self.ids[(k + 1) % 3]);
        (a.min(b), a.max(b))
    }

    /// The side to halve first: the longest and, of sides equal up to rounding, one chosen equally
    /// for all triangles.
    fn longest(&self) -> usize {
        let rounded = |k: usize| {
            let length = self.corners[k].distance(self.corners[(k + 1) % 3]);
            (length as f32, self.edge(k))
        };
        let order = |&k: &usize, &l: &usize| {
            let ((a, e), (b, f)) = (rounded(k), rounded(l));
            a.total_cmp(&b).then(e.cmp(&f))
        };
        (0..3).max_by(order).expect("three sides")
    }

    /// Its two halves, `middle` being the midpoint of side `k`.
    fn halves(&self, k: usize, middle: u32) -> [Part; 2] {
        let (a, b) = (k, (k + 1) % 3);
        let corner = (self.corners[a] + self.corners[b]) / 2.0;
        let [[u, v], [s, t]] = [self.weights[a], self.weights[b]];
        let weights = [(u + s) / 2.0, (v + t) / 2.0];
        [b, a].map(|replaced| {
            let mut half = *self;
            half.ids[replaced] = middle;
            half.corners[replaced] = corner;
            half.weights[replaced] = weights;
            half
        })
    }
}

impl Bisection {
    fn new(scene: &Scene) -> Bisection {
        let topology = SurfaceTopology::of_scene(scene);
        let whole = |(triangle, &ids): (usize, &[u32; 3])| {
            let Piece { corners, weights, .. } = Piece::whole(scene.corners(triangle));
            Part { triangle, ids, corners, weights }
        };
        let mut bisection = Bisection {
            parts: topology.corners.iter().enumerate().map(whole).collect(),
            at_edge: FxHashMap::default(),
            middles: FxHashMap::default(),
            next_id: 3 * topology.corners.len() as u32,
        };
        for p in 0..bisection.parts.len() {
            bisection.enter(p);
        }
        bisection
    }

    /// Halves parts that are `is_large` by their triangle and corners, and those needed for a
    /// conforming result; returns the pieces of each triangle, unless there are too many.
    fn run(mut self, is_large: impl Fn(usize, &[DVec3; 3]) -> bool) -> Option<Vec<Vec<Piece>>> {
        let triangles = self.parts.len();
        let max_parts = (2 * triangles).max(1 << 18);
        let mut pending: Vec<usize> = (0..triangles).collect();
        while let Some(p) = pending.pop() {
            let Part { triangle, corners, .. } = self.parts[p];
            if is_large(triangle, &corners) {
                pending.push(p);
                self.halve_next(p, &mut pending);
            }
            if self.parts.len() > max_parts {
                return None;
            }
        }
        let mut pieces: Vec<Vec<Piece>> = (0..triangles).map(|_| vec![]).collect();
        for Part { triangle, corners, weights, .. } in self.parts {
            pieces[triangle].push(Piece { corners, weights, cut: [false; 3] });
        }
        Some(pieces)
    }

    /// Goes from part `p` over longest edges to one that is the longest of all parts at it, and
    /// halves these parts; new ones are added to `pending`.
    fn halve_next(&mut self, mut p: usize, pending: &mut Vec<usize>) {
        let mut passed = FxHashSet::default();
        loop {
            let edge = self.parts[p].edge(self.parts[p].longest());
            let longer = |&&q: &&usize| self.parts[q].edge(self.parts[q].longest()) != edge;
            // Edges grow from part to part, except where rounding makes a length differ between two
            // triangles: no edge is passed twice.
            let other = self.at_edge[&edge].iter().find(longer).copied();
            match other {
                Some(q) if passed.insert(edge) => p = q,
                _ => return self.halve(edge, pending),
            }
        }
    }

    /// Halves all parts at `edge`.
    fn halve(&mut self, edge: Edge, pending: &mut Vec<usize>) {
        let next_id = self.next_id;
        let middle = *self.middles.entry(edge).or_insert(next_id);
        self.next_id = next_id.max(middle + 1);
        for p in self.at_edge.remove(&edge).unwrap_or_default() {
            let part = self.parts[p];
            let k = (0..3).find(|&k| part.edge(k) == edge).expect("a side of the part");
            for j in (0..3).filter(|&j| j != k) {
                self.at_edge.entry(part.edge(j)).or_default().retain(|&other| other != p);
            }
            let [first, second] = part.halves(k, middle);
            self.parts[p] = first;
            self.enter(p);
            self.parts.push(second);
            self.enter(self.parts.len() - 1);
            pending.push(self.parts.len() - 1);
        }
    }

    /// Registers part `p` at its edges.
    fn enter(&mut self, p: usize) {
        for k in 0..3 {
            self.at_edge.entry(self.parts[p].edge(k)).or_default().push(p);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use super::*;
    use crate::mesh::Mesh;
    use crate::scene::{Material, Triangle};

    /// A grey ground from -`half` to `half`, of a quad, and beside it a black one.
    fn ground(half: f64) -> Arc<Scene> {
        let quad = |left: f64| {
            [[left, -half], [left + 2.0 * half, -half], [left + 2.0 * half, half], [left, half]]
        };
        let corners = [quad(-half), quad(half)].concat();
        let positions = corners.into_iter().map(|[x, y]| DVec3::new(x, y, 0.0)).collect();
        let pair = |q: u32| {
            [[0, 1, 2], [0, 2, 3]].map(|corners| Triangle {
                corners: corners.map(|c| 4 * q + c),
                material: q,
                ..Default::default()
            })
        };
        let triangles = (0..2).flat_map(pair).collect();
        let materials = vec![Material::grey("grey", 0.5), Material::grey("black", 0.0)];
        Arc::new(Scene::new(positions, triangles, vec!["ground".into()], materials).unwrap())
    }

    fn region() -> Aabb {
        Aabb { low: DVec3::new(-0.3, 0.1, 0.0), high: DVec3::new(0.5, 0.7, 1.0) }
    }

    #[test]
    fn pieces_are_small_where_the_light_is_and_cover_the_ground() {
        let mut last = 0;
        for half in [1e2, 1e4, 1e6, 1e8] {
            let scene = ground(half);
            let cut = cut_large_triangles(&scene, &region());
            let pieces: Vec<usize> = (0..cut.triangles().len()).collect();
            let area: f64 = pieces.iter().map(|&t| cut.area(t)).sum();
            assert!((area / (8.0 * half * half) - 1.0).abs() < 1e-12);
            let grey = pieces.iter().filter(|&&t| cut.triangles()[t].material == 0);
            for corners in grey.map(|&t| cut.corners(t)) {
                let max_edge = region().diagonal() * size_growth(Some(&region()), &corners);
                assert!(longest_edge(corners) <= max_edge, "{half}: {corners:?}");
            }
            // The black quad is not cut. Between squares of half a side r and 2 r around the light
            // there is an area of 12 r², and a piece has r²/8 at least: halves of a square whose
            // diagonal is over r / √2. So there are at most 96 of them per octave.
            assert_eq!(pieces.iter().filter(|&&t| cut.triangles()[t].material == 1).count(), 2);
            let max_pieces = last + (100f64.log2() * 96.0) as usize;
            assert!(pieces.len() > last && pieces.len() < max_pieces, "{half}: {}", pieces.len());
            last = pieces.len();
        }
    }

    #[test]
    fn the_surface_continues_from_piece_to_piece() {
        let cut = cut_large_triangles(&ground(1e4), &region());
        let topology = SurfaceTopology::new(&cut);
        let mut shared: HashMap<u32, usize> = HashMap::new();
        for (t, sides) in topology.sides.iter().enumerate() {
            let corners = cut.corners(t);
            for (k, side) in sides.iter().enumerate() {
                let ends = [corners[k], corners[(k + 1) % 3]];
                let at_rim = |axis: usize| ends.iter().all(|p| p[axis].abs() == 1e4);
                if cut.triangles()[t].material == 0 && !at_rim(0) && !at_rim(1) {
                    *shared.entry(side.id).or_default() += 1;
                }
            }
        }
        assert!(shared.len() > 100 && shared.values().all(|&count| count == 2));
    }

    #[test]
    fn what_is_no_larger_than_the_light_stays() {
        let scene = ground(0.4);
        assert!(Arc::ptr_eq(&scene, &cut_large_triangles(&scene, &region())));
    }

    #[test]
    fn a_region_of_no_size_makes_no_pieces_of_no_size() {
        let point = Aabb { low: DVec3::ZERO, high: DVec3::splat(1e-300) };
        let cut = cut_large_triangles(&ground(1e3), &point);
        let pieces = cut.triangles().len();
        assert!((0..pieces).all(|t| cut.area(t) > 1e-13) && pieces > 100, "{pieces}");
    }

    #[test]
    fn elements_below_pieces_are_as_fine_as_below_a_room_alone() {
        let cut = cut_large_triangles(&ground(1e6), &region());
        let near = (0..cut.triangles().len())
            .map(|t| cut.corners(t))
            .filter(|corners| size_growth(Some(&region()), corners) == 1.0)
            .map(longest_edge)
            .fold(0.0, f64::max);
        let finest = near / f64::from(1 << Mesh::MAX_DEPTH);
        assert!(near > 0.0 && finest <= region().diagonal() / 4096.0);
    }
}
