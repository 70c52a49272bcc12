//! Lookup of the light of all bands along the row of a point.
//!
//! Values of all bands are stored together per vertex: a ray hit costs one lookup in the mesh,
//! whatever the number of bands.

use std::f64::consts::PI;

use super::spectra::Bands;
use crate::gather::point_row::PointRow;
use crate::mesh::Mesh;
use crate::scene::Rgb;

/// The data that rows are looked up in.
pub(super) struct Lookup<'a> {
    pub bands: &'a Bands,
    /// The vertices at the corners of each element.
    corners: &'a [[u32; 3]],
    /// The exitance of each element by band; `None` where it is 0 in all bands.
    exitance: Vec<Option<&'a [f64]>>,
}

impl<'a> Lookup<'a> {
    pub fn new(bands: &'a Bands, mesh: &Mesh, corners: &'a [[u32; 3]]) -> Lookup<'a> {
        let exitance = |e: usize| {
            let material = mesh.scene().triangles()[mesh.triangle(mesh.element(e))].material;
            let exitance = &bands.materials[material as usize].exitance[..];
            exitance.iter().any(|&e| e > 0.0).then_some(exitance)
        };
        Lookup { bands, corners, exitance: (0..mesh.element_count()).map(exitance).collect() }
    }

    /// Adds to `irradiance` (W/m² by band) the light of emitters, luminaires, the sky and the sun
    /// along `row`.
    pub fn add_emitted(&self, row: &PointRow, irradiance: &mut [f64]) {
        for &(material, factor) in &row.emitters {
            add(irradiance, factor, &self.bands.materials[material as usize].exitance);
        }
        for hit in row.hits.iter().filter(|hit| hit.emits) {
            if let Some(exitance) = self.exitance[hit.element as usize] {
                add(irradiance, row.share * mean(hit.passed), exitance);
            }
        }
        for &(k, factor) in &row.luminaires {
            add(irradiance, factor, &self.bands.luminaires[k as usize]);
        }
        add(irradiance, PI * row.sky, &self.bands.sky);
        add(irradiance, row.sun, &self.bands.sun);
    }

    /// Adds the light reflected by surfaces along `row`: `reflected` has that of all vertices,
    /// W/m², bands side by side.
    pub fn add_reflected(&self, row: &PointRow, reflected: &[f64], irradiance: &mut [f64]) {
        let count = irradiance.len();
        let of_vertex = |v: u32| &reflected[v as usize * count..][..count];
        for (corners, weights) in self.weights(row) {
            let [a, b, c] = corners.map(of_vertex);
            let values = a.iter().zip(b).zip(c);
            for (sum, ((a, b), c)) in irradiance.iter_mut().zip(values) {
                *sum += weights[0] * a + weights[1] * b + weights[2] * c;
            }
        }
    }

    /// The vertices around each hit of `row`, and the form factor of each.
    pub fn weights(&self, row: &PointRow) -> impl Iterator<Item = ([u32; 3], [f64; 3])> {
        row.hits.iter().map(move |hit| {
            let ([u, v], factor) = (hit.barycentric, row.share * mean(hit.passed));
            let weights = [(1.0 - u - v) * factor, u * factor, v * factor];
            (self.corners[hit.element as usize], weights)
        })
    }
}

/// Adds `factor` times `values` to `sums`, band by band.
pub(super) fn add(sums: &mut [f64], factor: f64, values: &[f64]) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += factor * value;
    }
}

/// Mean of the channels.
fn mean(channels: Rgb) -> f64 {
    channels.element_sum() / 3.0
}
