//! The mesh that an adaptive gather refines, with a value at every vertex.
//!
//! Elements are split into four by the midpoints of their sides. Vertices are known by keys that do
//! not depend on the mesh (see `vertex::keys`), so values carry over from a mesh to the finer one.
//! A new vertex starts with the mean of the two it lies between, until it gathers.

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use super::RadiosityField;
use super::directional_light::Direct;
use crate::error::Error;
use crate::mesh::{Mesh, SurfaceTopology};
use crate::scene::Rgb;
use crate::vertex::VertexMesh;
use crate::vertex::hanging_nodes::HangingNodes;
use crate::vertex::keys::Vertices;

/// A mesh with reflected radiosity at its vertices.
#[derive(Clone)]
pub(crate) struct SampledMesh {
    pub mesh: Mesh,
    pub topology: Arc<SurfaceTopology>,
    pub vertices: Vertices,
    /// Reflected radiosity B − E at the vertices, W/m² per channel.
    pub reflected: Vec<Rgb>,
    /// Standard error of `reflected` by the rays of each vertex, W/m²: a length over the channels.
    pub noise: Vec<f64>,
    /// What the squared error of a vertex counts in that of the whole, by the area around it before
    /// elements were split; see [`vertex_weights`](super::vertex_weights).
    pub weights: Vec<f64>,
    /// Whether a vertex is buried: all its gather points lie inside something that touches its
    /// surface. Its value is extrapolated from its neighbours.
    pub buried: Vec<bool>,
    /// What the sun and luminaires add to `reflected`; empty in scenes without.
    pub direct: Vec<Direct>,
    /// Whether a vertex has gathered and is [hidden](crate::accuracy::hidden): it has no error.
    pub hidden: Vec<bool>,
}

impl SampledMesh {
    /// `mesh` with the values that `field`, of the same scene, has at its vertices.
    pub fn new(mesh: Mesh, field: &RadiosityField) -> SampledMesh {
        let topology = SurfaceTopology::of_scene(mesh.scene());
        let vertices = Vertices::new(&mesh, &topology);
        let places: Vec<(usize, [f64; 2])> = vertices.barycentric().collect();
        let value = |&(t, [u, v]): &(usize, [f64; 2])| field.untextured_at(t, u, v);
        let reflected: Vec<Rgb> = places.par_iter().map(value).collect();
        let noise = vec![0.0; reflected.len()];
        let weights = vec![1.0; reflected.len()];
        let buried = vec![false; reflected.len()];
        let hidden = buried.clone();
        let direct = match mesh.scene().has_directional_light() {
            true => vec![Direct::default(); reflected.len()],
            false => vec![],
        };
        SampledMesh { mesh, topology, vertices, reflected, noise, weights, buried, direct, hidden }
    }

    /// The vertices at the corners of each element, by element.
    pub fn corners(&self) -> &[[u32; 3]] {
        &self.vertices.corners
    }

    /// These `reflected` values of the vertices as a light to gather, W/m².
    pub fn field<'a>(&'a self, reflected: &'a [Rgb]) -> RadiosityField<'a> {
        RadiosityField { mesh: &self.mesh, corners: self.corners(), reflected }
    }

    /// Whether element `e` may be split: not at the finest level, and not where nothing is
    /// reflected.
    pub fn is_splittable(&self, e: usize) -> bool {
        let node = self.mesh.element(e);
        self.mesh.cell(node).level < Mesh::MAX_DEPTH && self.mesh.scatters(node)
    }

    /// Whether all corners of element `e` are hidden.
    pub fn is_hidden(&self, e: usize) -> bool {
        self.corners()[e].iter().all(|&v| self.hidden[v as usize])
    }

    /// Splits `elements` (ascending) into four each, which are in the place of the one. Values of
    /// old vertices are kept; gives those that were not there before, ascending.
    pub fn split(&mut self, elements: &[usize]) -> Result<Vec<u32>, Error> {
        let (finer, old_numbers) = self.with_split(elements)?;
        *self = finer;
        Ok(new_vertices(&old_numbers))
    }

    /// The same as a mesh of its own, and of each of its vertices the number among these; none of
    /// one that was not there before.
    pub fn with_split(&self, elements: &[usize]) -> Result<(SampledMesh, Vec<Option<u32>>), Error> {
        let mesh = self.mesh.split(elements)?;
        let (vertices, old_numbers) = self.vertices.split(&mesh, &self.topology, elements);
        let mut reflected = kept(&self.reflected, &old_numbers);
        let mut weights = kept(&self.weights, &old_numbers);
        for (k, &e) in elements.iter().enumerate() {
            // Each split before this one has put four elements in the place of one.
            let first_child = e + 3 * k;
            let corners = self.vertices.corners[e].map(|v| v as usize);
            // The corners of the fourth child are the middles of the sides opposite its number.
            let midsides = vertices.corners[first_child + 3].map(|v| v as usize);
            for (k, m) in midsides.into_iter().enumerate() {
                if old_numbers[m].is_none() {
                    let [a, b] = [corners[(k + 1) % 3], corners[(k + 2) % 3]];
                    reflected[m] = (self.reflected[a] + self.reflected[b]) / 2.0;
                    weights[m] = (self.weights[a] + self.weights[b]) / 2.0;
                }
            }
        }
        let split = SampledMesh {
            mesh,
            topology: self.topology.clone(),
            vertices,
            reflected,
            noise: kept(&self.noise, &old_numbers),
            weights,
            buried: kept(&self.buried, &old_numbers),
            direct: match self.direct.is_empty() {
                true => vec![],
                false => kept(&self.direct, &old_numbers),
            },
            hidden: kept(&self.hidden, &old_numbers),
        };
        Ok((split, old_numbers))
    }

    /// Root mean square over the elements of how far the values at their corners are from
    /// `previous` (of the same mesh), over the root mean square of the values.
    pub fn relative_change(&self, previous: &[Rgb]) -> f64 {
        let mut difference = 0.0;
        let mut total = 0.0;
        for (e, corners) in self.corners().iter().enumerate() {
            let area = self.mesh.solid_area(self.mesh.element(e));
            for v in corners.map(|v| v as usize) {
                difference += area * (self.reflected[v] - previous[v]).length_squared();
                total += area * self.reflected[v].length_squared();
            }
        }
        if total > 0.0 { (difference / total).sqrt() } else { 0.0 }
    }

    /// The surface with what its vertices emit and reflect, without cracks; and
    /// [`SampledMesh::corners`].
    pub fn into_vertex_mesh(self) -> (VertexMesh, Vec<[u32; 3]>) {
        // All else is dropped here: the surface is as large.
        let SampledMesh { mesh, topology, vertices, reflected, .. } = self;
        let hanging_nodes = HangingNodes::new(&mesh, &topology, &vertices);
        let Vertices { positions, corners, outlines, .. } = vertices;
        let count = positions.len();
        let mut out = VertexMesh {
            positions,
            normals: vec![DVec3::ZERO; count],
            radiosity: vec![Rgb::ZERO; count],
            sky: mesh.scene().sky().clone(),
            ..Default::default()
        };
        for (e, outline) in outlines.iter() {
            let node = mesh.element(e);
            let emitted = mesh.material(node).exitance;
            for v in outline.iter().map(|&v| v as usize) {
                out.normals[v] += mesh.normal(node) * mesh.area(node);
                out.radiosity[v] = emitted + reflected[v];
            }
        }
        for normal in &mut out.normals {
            *normal = normal.normalize_or_zero();
        }
        out.reflect(&mesh, &outlines, &reflected);
        out.add_elements(&mesh, &hanging_nodes, |out, e| {
            let corners = corners[e].map(|v| v as usize);
            [&out.radiosity, &out.irradiance]
                .map(|values| corners.iter().map(|&v| values[v]).sum::<Rgb>() / 3.0)
        });
        (out, corners)
    }
}

/// The vertices that were not there before, by the `old_numbers` of all, ascending.
pub(super) fn new_vertices(old_numbers: &[Option<u32>]) -> Vec<u32> {
    let numbered = (0..).zip(old_numbers);
    numbered.filter(|(_, old)| old.is_none()).map(|(v, _)| v).collect()
}

/// One value an element when each of `split` (ascending) has become four, for which it is `new`.
pub(super) fn after_split<T: Copy>(values: &[T], split: &[usize], new: T) -> Vec<T> {
    let mut after = Vec::with_capacity(values.len() + 3 * split.len());
    let mut split = split.iter().peekable();
    for (e, &value) in values.iter().enumerate() {
        match split.next_if_eq(&&e) {
            Some(_) => after.extend([new; 4]),
            None => after.push(value),
        }
    }
    after
}

/// Of `values` of vertices those by their old numbers; zero or false of new vertices.
fn kept<T: Copy + Default + Send + Sync>(values: &[T], old_numbers: &[Option<u32>]) -> Vec<T> {
    let value = |old: &Option<u32>| old.map_or(T::default(), |v| values[v as usize]);
    old_numbers.par_iter().map(value).collect()
}
