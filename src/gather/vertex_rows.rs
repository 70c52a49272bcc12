//! Rows of the vertices of a mesh, on both sides of what is translucent.
//!
//! They are made at the same points as those where vertices gather, with the same way out for
//! vertices that are buried: another point around the vertex, and if all are buried the mean of
//! what is next to it.

use std::ops::ControlFlow;

use rayon::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::gather_points::VertexGatherPoints;
use super::point_row::{PointRow, PointRows};
use crate::mesh::Mesh;
use crate::scene::Rgb;
use crate::vertex::keys::Vertices;
use crate::work::{Batches, agree};

/// What a vertex sees, by parts of the rays.
pub(crate) struct VertexRow {
    /// From the side that the vertex is on.
    pub front: Vec<PointRow>,
    /// From the other side of a translucent surface; of others empty.
    pub behind: Vec<PointRow>,
    /// Whether the vertex is buried: it sees nothing but the inside of what touches its surface.
    pub buried: bool,
}

/// The vertices of a mesh, and what makes their rows.
pub(crate) struct VertexRows<'a> {
    mesh: &'a Mesh,
    points: VertexGatherPoints<'a>,
    maker: &'a dyn PointRows,
}

impl<'a> VertexRows<'a> {
    /// Of the `vertices` of `mesh`; surfaces nearer than `touching` (scene unit) touch.
    pub fn new(
        mesh: &'a Mesh,
        vertices: &'a Vertices,
        touching: f64,
        maker: &'a dyn PointRows,
    ) -> VertexRows<'a> {
        let points = VertexGatherPoints::new(mesh, vertices, touching);
        VertexRows { mesh, points, maker }
    }

    /// The material of each vertex, by its index; none where holes are all around it.
    pub fn material(&self, v: u32) -> Option<u32> {
        self.points.material_index(v)
    }

    /// Albedo of the surface of each vertex; 0 where holes are all around it.
    pub fn albedo(&self, v: u32) -> Rgb {
        self.points.albedo(v)
    }

    /// By how much what arrives on the side of vertex `v` counts per channel, and behind it.
    pub fn shares_of_sides(&self, v: u32) -> [Rgb; 2] {
        self.points.point(v, 0).shares()
    }

    /// The results of `work` for the row of each of `vertices`, in their order, by `parts` of the
    /// rays; what this process is to `keep` of them, each batch after it was made; none if
    /// `progress`, called after each batch with the number done, breaks.
    pub fn map<T: Send + Sync + Serialize + DeserializeOwned>(
        &self,
        vertices: &[u32],
        parts: u32,
        work: impl Fn(u32, &VertexRow) -> T + Sync,
        keep: impl Fn(u32, T) -> T,
        mut progress: impl FnMut(usize) -> ControlFlow<()>,
    ) -> Option<Vec<T>> {
        let mut results = Vec::with_capacity(vertices.len());
        let mut batches = Batches::new(256);
        let mut remaining = vertices;
        while !remaining.is_empty() {
            let made = |&v: &u32| work(v, &self.row(v, parts));
            let (_, made) = batches
                .next(&mut remaining, |batch| batch.par_iter().map(made).collect::<Vec<T>>());
            let kept = vertices[results.len()..].iter().zip(made).map(|(&v, made)| keep(v, made));
            results.extend(kept);
            if agree(progress(results.len())).is_break() {
                return None;
            }
        }
        Some(results)
    }

    fn row(&self, v: u32, parts: u32) -> VertexRow {
        let mut attempt = 0;
        loop {
            let point = self.points.point(v, attempt);
            let front = self.maker.rows(self.mesh, &point.point, parts);
            let mean = |value: fn(&PointRow) -> f64| {
                front.iter().map(value).sum::<f64>() / f64::from(parts)
            };
            let (backface, inverse_distance) =
                (mean(|row| row.backface), mean(|row| row.inverse_distance));
            let buried = self.points.sees_inside(v, backface, inverse_distance);
            if buried && self.points.has_more(v, attempt) {
                attempt += 1;
                continue;
            }
            let behind = match self.points.is_translucent(v) {
                true => self.maker.rows(self.mesh, &point.other_side(), parts),
                false => vec![],
            };
            return VertexRow { front, behind, buried };
        }
    }
}

/// For each of the `buried` vertices that are next to others on an outline of an element: those,
/// and the weight that each has in their mean, by 1/distance.
pub(crate) fn neighbours_of_buried(
    vertices: &Vertices,
    buried: &[bool],
) -> Vec<(u32, Vec<(u32, f64)>)> {
    let mut neighbours: Vec<(u32, Vec<(u32, f64)>)> = vec![];
    for (_, outline) in vertices.outlines.iter() {
        let side = |inside: bool| outline.iter().filter(move |&&v| buried[v as usize] == inside);
        for &v in side(true) {
            let distance = |w: u32| {
                let [a, b] = [v, w].map(|k| vertices.positions[k as usize]);
                a.distance(b)
            };
            neighbours.push((v, side(false).map(|&w| (w, 1.0 / distance(w))).collect()));
        }
    }
    neighbours.sort_by_key(|&(v, _)| v);
    let merged = neighbours.chunk_by(|a, b| a.0 == b.0).map(|run| {
        let mut all: Vec<(u32, f64)> = run.iter().flat_map(|(_, next)| next.clone()).collect();
        let total: f64 = all.iter().map(|&(_, weight)| weight).sum();
        all.iter_mut().for_each(|(_, weight)| *weight /= total);
        (run[0].0, all)
    });
    merged.filter(|(_, next)| !next.is_empty()).collect()
}
