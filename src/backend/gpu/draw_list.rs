//! Triangles in chunks that lie close together, so that a face of a hemicube draws only those that
//! can be in its view.

use std::ops::Range;

use glam::DVec3;

use crate::geometry::aabb::Aabb;
use crate::hemicube::Face;
use crate::scene::Scene;

/// Triangles in a chunk at most: below this, testing a box costs more than drawing what is in it.
const CHUNK: usize = 16;

/// Triangles in a run after which another begins: software devices handle a draw with anything to
/// clip in time that grows with its square.
const RUN: usize = 128;

/// An order of drawing, and the box around each run of it.
#[derive(Debug)]
pub struct DrawList {
    /// Triangle at each place of the drawing order.
    pub order: Vec<u32>,
    /// GatherPoint of each triangle in the drawing order.
    pub places: Vec<u32>,
    chunks: Vec<Chunk>,
}

#[derive(Debug)]
struct Chunk {
    places: Range<u32>,
    centre: DVec3,
    half: DVec3,
}

impl DrawList {
    /// Halves the triangles of `scene` at the median of their longest extent, again and again.
    pub fn new(scene: &Scene) -> DrawList {
        let middle = |t: usize| scene.corners(t).iter().sum::<DVec3>() / 3.0;
        let middles: Vec<DVec3> = (0..scene.triangles().len()).map(middle).collect();
        let mut order: Vec<u32> = (0..middles.len() as u32).collect();
        let mut runs = vec![];
        halve(&mut order, 0, &middles, &mut runs);
        // The device rounds to 32 bits: boxes grow by a few steps of its coordinates.
        let margin = scene.bounds().longest_side() * 8.0 * f64::from(f32::EPSILON);
        let around = |places: Range<u32>| {
            let triangles = order[places.start as usize..places.end as usize].iter();
            let corners = triangles.flat_map(|&t| scene.corners(t as usize));
            let bounds = Aabb::from_points(corners);
            let centre = bounds.low.midpoint(bounds.high);
            Chunk { places, centre, half: bounds.size() / 2.0 + margin }
        };
        let chunks = runs.into_iter().map(around).collect();
        let mut places = vec![0; order.len()];
        (0..).zip(&order).for_each(|(place, &t)| places[t as usize] = place);
        DrawList { order, places, chunks }
    }

    /// Places whose triangles can be seen by `face` from `eye`, in few runs.
    pub fn in_view(&self, eye: DVec3, face: &Face) -> Vec<Range<u32>> {
        let Face { right, up, forward, bottom } = *face;
        // Inward normals of the five planes through the eye that bound the view.
        let planes =
            [forward, forward + right, forward - right, forward - up, up - bottom * forward];
        let mut runs: Vec<Range<u32>> = vec![];
        for Chunk { places, centre, half } in &self.chunks {
            // The box's farthest point along a normal is behind the plane: so is all of it.
            let behind = |n: &DVec3| n.dot(centre - eye) + n.abs().dot(*half) < 0.0;
            if planes.iter().any(behind) {
                continue;
            }
            match runs.last_mut() {
                Some(run) if run.end == places.start && run.len() < RUN => run.end = places.end,
                _ => runs.push(places.clone()),
            }
        }
        runs
    }
}

fn halve(order: &mut [u32], start: u32, middles: &[DVec3], runs: &mut Vec<Range<u32>>) {
    if order.len() <= CHUNK {
        runs.push(start..start + order.len() as u32);
        return;
    }
    let axis = Aabb::from_points(order.iter().map(|&t| middles[t as usize])).longest_axis();
    let along = |t: &u32| middles[*t as usize][axis];
    // Ties by index: the same order on every run.
    order.sort_unstable_by(|a, b| along(a).total_cmp(&along(b)).then(a.cmp(b)));
    let (left, right) = order.split_at_mut(order.len() / 2);
    let middle = start + left.len() as u32;
    halve(left, start, middles, runs);
    halve(right, middle, middles, runs);
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
    fn every_triangle_has_one_place() {
        let chunks = DrawList::new(&sphere());
        for (place, &t) in (0..).zip(&chunks.order) {
            assert_eq!(chunks.places[t as usize], place);
        }
        let covered: u32 = chunks.chunks.iter().map(|c| c.places.len() as u32).sum();
        assert_eq!(covered, 1000);
        assert!(chunks.chunks.iter().all(|c| c.places.len() <= CHUNK));
    }

    #[test]
    fn what_a_face_sees_is_in_its_runs_and_most_of_the_rest_is_not() {
        let scene = sphere();
        let chunks = DrawList::new(&scene);
        let faces = Face::all(&Frame::new(DVec3::new(0.6, 0.0, 0.8), 0.3));
        let mut drawn = 0;
        for face in &faces {
            let runs = chunks.in_view(DVec3::ZERO, face);
            drawn += runs.iter().map(|r| r.len()).sum::<usize>();
            for t in 0..1000 {
                let d = scene.corners(t)[0];
                let w = d.dot(face.forward);
                let (h, v) = (d.dot(face.right) / w, d.dot(face.up) / w);
                let seen = w > 0.0 && h.abs() < 1.0 && v < 1.0 && v > face.bottom;
                let place = chunks.places[t];
                assert!(!seen || runs.iter().any(|r| r.contains(&place)), "triangle {t}");
            }
        }
        // Half the sphere is above the horizon; boxes of chunks reach over into other views.
        assert!(drawn < 3 * 1000, "{drawn} of 5000");
    }
}
