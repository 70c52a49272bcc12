//! Triangles in spatially compact chunks, so that a face of a hemicube draws only those that can be
//! in its view.
//!
//! ```text
//! drawing order   t7 t2 t9 t4 | t1 t0 t5 t8 | t3 t6 …      median splits of the longest extent
//! chunks          [ box 0    ] [ box 1    ] [ box 2 …      at most MAX_TRIANGLES_PER_CHUNK each
//! in view         [ run 0                 ]                boxes behind no plane of the view
//! ```

use std::ops::Range;

use glam::DVec3;

use crate::geometry::aabb::Aabb;
use crate::geometry::bvh::Bvh;
use crate::hemicube::Face;
use crate::scene::Scene;

/// Maximum number of triangles in a chunk: below this, testing a box costs more than drawing its
/// triangles. Plain choice; no recorded measurement.
const MAX_TRIANGLES_PER_CHUNK: usize = 16;

/// A drawing order, and the bounding box of each chunk of it.
#[derive(Debug)]
pub struct DrawList {
    /// Triangle at each position of the drawing order.
    pub order: Vec<u32>,
    /// Position of each triangle in the drawing order.
    pub position_of: Vec<u32>,
    chunks: Vec<Chunk>,
}

#[derive(Debug)]
struct Chunk {
    positions: Range<u32>,
    centre: DVec3,
    half: DVec3,
}

impl DrawList {
    /// Halves the triangles of `scene` recursively at the median of their longest extent.
    pub fn new(scene: &Scene) -> DrawList {
        let middle = |t: usize| scene.corners(t).iter().sum::<DVec3>() / 3.0;
        let middles: Vec<DVec3> = (0..scene.triangles().len()).map(middle).collect();
        let boxes: Vec<Aabb> =
            (0..middles.len()).map(|t| Aabb::from_points(scene.corners(t))).collect();
        let bvh = Bvh::new(&boxes, MAX_TRIANGLES_PER_CHUNK, |part, _| halve(part, &middles));
        // The device rounds to 32 bits: boxes grow by a few steps of its coordinates.
        let margin = scene.bounds().longest_side() * 8.0 * f64::from(f32::EPSILON);
        let chunk = |(leaf, bounds): (Range<usize>, &Aabb)| {
            let positions = leaf.start as u32..leaf.end as u32;
            let centre = bounds.low.midpoint(bounds.high);
            Chunk { positions, centre, half: bounds.size() / 2.0 + margin }
        };
        let chunks = bvh.leaves().map(chunk).collect();
        let order = bvh.order().to_vec();
        let mut position_of = vec![0; order.len()];
        for (position, &t) in (0..).zip(&order) {
            position_of[t as usize] = position;
        }
        DrawList { order, position_of, chunks }
    }

    /// Runs of the drawing order whose triangles may be visible in `face` from `eye`.
    pub fn in_view(&self, eye: DVec3, face: &Face) -> Vec<Range<u32>> {
        let Face { right, up, forward, bottom } = *face;
        // Inward normals of the five planes through the eye that bound the view.
        let planes =
            [forward, forward + right, forward - right, forward - up, up - bottom * forward];
        let mut runs: Vec<Range<u32>> = vec![];
        for Chunk { positions, centre, half } in &self.chunks {
            // If the box's farthest point along a normal is behind the plane, all of it is.
            let behind = |n: &DVec3| n.dot(centre - eye) + n.abs().dot(*half) < 0.0;
            if planes.iter().any(behind) {
                continue;
            }
            match runs.last_mut() {
                // On software devices the time of a draw with clipping grows with the square of
                // its size. Plain choice; no recorded measurement.
                Some(run) if run.end == positions.start && run.len() < 128 => {
                    run.end = positions.end;
                }
                _ => runs.push(positions.clone()),
            }
        }
        runs
    }
}

/// Sorts triangles along the axis of the largest extent of their centroids, `middles`.
fn halve(order: &mut [u32], middles: &[DVec3]) {
    let axis = Aabb::from_points(order.iter().map(|&t| middles[t as usize])).longest_axis();
    let along = |t: &u32| middles[*t as usize][axis];
    // Ties by index: the same order on every run.
    order.sort_unstable_by(|a, b| along(a).total_cmp(&along(b)).then(a.cmp(b)));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hemicube::Frame;
    use crate::scene::{Material, Triangle};

    /// A thousand small triangles on a sphere around the origin.
    fn sphere() -> Scene {
        let (mut positions, mut triangles) = (vec![], vec![]);
        for k in 0..1000u32 {
            let z = (f64::from(k) + 0.5) / 500.0 - 1.0;
            let (sin, cos) = (f64::from(k) * 2.4).sin_cos();
            let r = (1.0 - z * z).sqrt();
            let p = DVec3::new(r * cos, r * sin, z);
            let (x, y) = p.any_orthonormal_pair();
            positions.extend([p, p + 0.01 * x, p + 0.01 * y]);
            let corners = [3 * k, 3 * k + 1, 3 * k + 2];
            triangles.push(Triangle { corners, ..Default::default() });
        }
        let material = Material::grey("g", 0.5);
        Scene::new(positions, triangles, vec!["g".into()], vec![material]).unwrap()
    }

    #[test]
    fn every_triangle_has_one_position() {
        let draw_list = DrawList::new(&sphere());
        for (position, &t) in (0..).zip(&draw_list.order) {
            assert_eq!(draw_list.position_of[t as usize], position);
        }
        let covered: u32 = draw_list.chunks.iter().map(|c| c.positions.len() as u32).sum();
        assert_eq!(covered, 1000);
        assert!(draw_list.chunks.iter().all(|c| c.positions.len() <= MAX_TRIANGLES_PER_CHUNK));
    }

    #[test]
    fn runs_hold_all_that_a_face_sees() {
        let scene = sphere();
        let draw_list = DrawList::new(&scene);
        let faces = Face::all(&Frame::new(DVec3::new(0.6, 0.0, 0.8), 0.3));
        let mut drawn = 0;
        for face in &faces {
            let runs = draw_list.in_view(DVec3::ZERO, face);
            drawn += runs.iter().map(std::iter::ExactSizeIterator::len).sum::<usize>();
            for t in 0..1000 {
                let d = scene.corners(t)[0];
                let w = d.dot(face.forward);
                let (h, v) = (d.dot(face.right) / w, d.dot(face.up) / w);
                let seen = w > 0.0 && h.abs() < 1.0 && v < 1.0 && v > face.bottom;
                let position = draw_list.position_of[t];
                assert!(!seen || runs.iter().any(|r| r.contains(&position)), "triangle {t}");
            }
        }
        // Half the sphere is above the horizon; boxes of chunks extend into other views.
        assert!(drawn < 3 * 1000, "{drawn} of 5000");
    }
}
