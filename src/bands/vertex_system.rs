//! The radiosity equation at the vertices, for all bands with the same rows.
//!
//! B − E = R, and R = s + (ρ K_front + τ K_behind) R: K are rows over the vertices, from few rays,
//! and s is the reflected light of emitters, the sky and the sun. Jacobi's iteration
//! adds one bounce per sweep. Rows sum to at most 1, so that with c = max (ρ + τ) in a band the
//! remainder after a sweep that changed R by δ is at most δ c / (1 − c), in the maximum norm: a
//! band ends where that is small.

use std::ops::ControlFlow;

use serde::{Deserialize, Serialize};

use super::lookup::{Lookup, add};
use super::spectra::Bands;
use crate::gather::point_row::PointRow;
use crate::gather::vertex_rows::VertexRow;
use crate::linear::gauss_seidel::{self, Equations};

/// A band has converged if its remainder is at most this share of the mean reflected light of
/// vertices: far below the noise of any rays, so that results hardly depend on it.
const MAX_REMAINDER: f64 = 1e-4;

/// Maximum number of sweeps: at a reflectance of 0.98 a band takes some 600. The remainder is
/// reported.
const MAX_SWEEPS: u32 = 2000;

/// The equation of one vertex.
#[derive(Serialize, Deserialize)]
pub(super) struct VertexEquation {
    /// Reflected part of the emitted light, W/m² by band.
    source: Vec<f64>,
    front: Vec<(u32, f32)>,
    behind: Vec<(u32, f32)>,
}

/// The equations of all vertices.
pub(super) struct VertexSystem<'a> {
    pub bands: &'a Bands,
    /// Material of each vertex; `None` where nothing reflects.
    pub materials: &'a [Option<u32>],
    pub equations: Vec<VertexEquation>,
}

/// Reflected light of vertices, and statistics of the iteration.
pub(super) struct Converged {
    /// Reflected radiosity of all vertices, W/m², bands side by side.
    pub reflected: Vec<f64>,
    /// Number of sweeps of each band.
    pub sweeps: Vec<u32>,
    /// Upper bound of the remainder of the reflected radiosity at any vertex, over the mean.
    pub remainder: Vec<f64>,
}

impl VertexEquation {
    /// The equation of a vertex of `material` with this row.
    pub fn new(lookup: &Lookup, material: u32, row: &VertexRow) -> VertexEquation {
        let bands = lookup.bands;
        let material = &bands.materials[material as usize];
        let mut source = vec![0.0; bands.bands.len()];
        let mut emitted = vec![0.0; bands.bands.len()];
        for (rows, albedo) in
            [(&row.front, &material.reflectance), (&row.behind, &material.transmittance)]
        {
            emitted.fill(0.0);
            rows.iter().for_each(|row| lookup.add_emitted(row, &mut emitted));
            for (source, (albedo, emitted)) in source.iter_mut().zip(albedo.iter().zip(&emitted)) {
                *source += albedo * emitted;
            }
        }
        let [front, behind] = [&row.front, &row.behind].map(|rows| merged(lookup, rows));
        VertexEquation { source, front, behind }
    }

    /// The equation of a vertex that reflects nothing.
    pub fn dark(bands: &Bands) -> VertexEquation {
        let source = vec![0.0; bands.bands.len()];
        VertexEquation { source, front: vec![], behind: vec![] }
    }

    /// The weighted mean of `others`; weights sum to 1.
    pub fn mean(others: &[(&VertexEquation, f64)]) -> VertexEquation {
        let mut source = vec![0.0; others.first().map_or(0, |(first, _)| first.source.len())];
        let (mut front, mut behind) = (vec![], vec![]);
        for &(other, weight) in others {
            add(&mut source, weight, &other.source);
            let weighted = |&(v, factor): &(u32, f32)| (v, factor * weight as f32);
            front.extend(other.front.iter().map(weighted));
            behind.extend(other.behind.iter().map(weighted));
        }
        VertexEquation { source, front, behind }
    }
}

/// Merges the rows of a point to one row over the vertices.
fn merged(lookup: &Lookup, rows: &[PointRow]) -> Vec<(u32, f32)> {
    let corners = |(vertices, weights): ([u32; 3], [f64; 3])| vertices.into_iter().zip(weights);
    let mut entries: Vec<(u32, f64)> =
        rows.iter().flat_map(|row| lookup.weights(row)).flat_map(corners).collect();
    entries.sort_by_key(|&(v, _)| v);
    let runs = entries.chunk_by(|a, b| a.0 == b.0);
    runs.map(|run| (run[0].0, run.iter().map(|&(_, weight)| weight).sum::<f64>() as f32)).collect()
}

impl VertexSystem<'_> {
    /// Sweeps until every band has converged, or [`MAX_SWEEPS`] times; `None` if `progress` breaks,
    /// which is called after each sweep.
    pub fn solve(&self, mut progress: impl FnMut() -> ControlFlow<()>) -> Option<Converged> {
        let count = self.bands.bands.len();
        let contraction: Vec<f64> = (0..count)
            .map(|b| self.bands.materials.iter().map(|m| m.albedo(b)).fold(0.0, f64::max))
            .collect();
        let mut now: Vec<f64> =
            self.equations.iter().flat_map(|equation| equation.source.iter().copied()).collect();
        let mut converged = Converged {
            reflected: now.clone(),
            sweeps: vec![0; count],
            remainder: vec![f64::INFINITY; count],
        };
        let mut sweep = 0;
        while sweep < MAX_SWEEPS && converged.remainder.iter().any(|&left| left > MAX_REMAINDER) {
            sweep += 1;
            let next = gauss_seidel::sweep(self, &now, count, 1);
            let (change, mean) = (largest_change(&now, &next, count), means(&next, count));
            now = next;
            for b in 0..count {
                if converged.remainder[b] <= MAX_REMAINDER {
                    continue;
                }
                let left = change[b] * contraction[b] / (1.0 - contraction[b]);
                converged.remainder[b] = if left > 0.0 { left / mean[b] } else { 0.0 };
                converged.sweeps[b] = sweep;
                let values = now.iter().skip(b).step_by(count);
                let stored = converged.reflected.iter_mut().skip(b).step_by(count);
                stored.zip(values).for_each(|(stored, &value)| *stored = value);
            }
            if progress().is_break() {
                return None;
            }
        }
        Some(converged)
    }
}

impl Equations for VertexSystem<'_> {
    fn evaluate<'x>(&self, k: usize, x: impl Fn(usize) -> &'x [f64], value: &mut [f64]) {
        let equation = &self.equations[k];
        value.copy_from_slice(&equation.source);
        let Some(material) = self.materials[k].map(|m| &self.bands.materials[m as usize]) else {
            return;
        };
        let mut irradiance = vec![0.0; value.len()];
        for (row, albedo) in
            [(&equation.front, &material.reflectance), (&equation.behind, &material.transmittance)]
        {
            irradiance.fill(0.0);
            for &(v, factor) in row {
                add(&mut irradiance, f64::from(factor), x(v as usize));
            }
            let received = albedo.iter().zip(&irradiance);
            for (value, (albedo, received)) in value.iter_mut().zip(received) {
                *value += albedo * received;
            }
        }
    }
}

/// The largest difference at any vertex, by band.
fn largest_change(before: &[f64], after: &[f64], count: usize) -> Vec<f64> {
    let mut largest = vec![0.0; count];
    for (before, after) in before.chunks(count).zip(after.chunks(count)) {
        for (largest, (a, b)) in largest.iter_mut().zip(before.iter().zip(after)) {
            *largest = f64::max(*largest, (a - b).abs());
        }
    }
    largest
}

/// The mean over the vertices, by band.
fn means(values: &[f64], count: usize) -> Vec<f64> {
    let mut sums = vec![0.0; count];
    values.chunks(count).for_each(|values| add(&mut sums, 1.0, values));
    let vertices = (values.len() / count).max(1) as f64;
    sums.into_iter().map(|sum| sum / vertices).collect()
}
