//! Light gathered at the vertices of a mesh that is kept as it is.

use std::ops::ControlFlow;
use std::sync::Arc;

use rayon::prelude::*;

use super::buried::extrapolate_into_buried;
use super::gather_points::VertexGatherPoints;
use super::sampled_mesh::SampledMesh;
use super::two_sided::{TwoSidedPoint, gather_two_sided};
use super::{Gather, GatheredMesh, IrradianceSample};
use crate::accuracy::hidden::NEAR;
use crate::error::Error;
use crate::mesh::{Mesh, SurfaceTopology};
use crate::progress::StopReason;

use crate::scene::Rgb;
use crate::vertex::VertexMesh;
use crate::vertex::keys::Vertices;
use crate::work::{Batches, agree};

/// The vertices of a mesh, each with what it gathered.
pub(crate) struct KeptVertices {
    mesh: Mesh,
    topology: Arc<SurfaceTopology>,
    vertices: Vertices,
    /// Where each vertex gathered.
    points: Vec<TwoSidedPoint>,
    /// Albedo of the surface of each vertex.
    albedo: Vec<Rgb>,
    /// Area of a third of the elements around each vertex, scene unit squared.
    area: Vec<f64>,
    samples: Vec<IrradianceSample>,
    /// Whether each vertex sees nothing but the inside of what touches its surface.
    buried: Vec<bool>,
    gather_count: u64,
}

impl KeptVertices {
    /// Gathers `light`, on any mesh of the same surfaces, at the vertices of `mesh` that reflect. A
    /// vertex whose gather point is buried is tried again in another element around it. None where
    /// `progress`, called with the vertices done and all of them, breaks.
    ///
    /// # Errors
    /// Those of `gatherer`.
    pub fn gather(
        mesh: Mesh,
        light: &GatheredMesh,
        gatherer: &mut dyn Gather,
        mut progress: impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<Option<KeptVertices>, Error> {
        let topology = SurfaceTopology::of_scene(mesh.scene());
        let vertices = Vertices::new(&mesh, &topology);
        let count = vertices.positions.len();
        let mut area = vec![0.0; count];
        for (e, corners) in vertices.corners.iter().enumerate() {
            corners
                .iter()
                .for_each(|&v| area[v as usize] += mesh.solid_area(mesh.element(e)) / 3.0);
        }
        let (mut samples, mut buried) =
            (vec![IrradianceSample::default(); count], vec![false; count]);
        let gather_points = {
            let touching = NEAR * mesh.scene().reflecting_bounds().diagonal();
            VertexGatherPoints::new(&mesh, &vertices, touching)
        };
        let all = 0..count as u32;
        let mut points: Vec<TwoSidedPoint> =
            all.clone().into_par_iter().map(|v| gather_points.nearest_point(v, 0)).collect();
        let albedo: Vec<Rgb> = all.clone().map(|v| gather_points.albedo(v)).collect();
        let field = light.radiosity_field();
        let mut pending: Vec<u32> = all.filter(|&v| albedo[v as usize] != Rgb::ZERO).collect();
        let (total, mut done, mut gather_count) = (pending.len(), 0, 0);
        let mut batches = Batches::new(gatherer.preferred_batch_len());
        for attempt in 0.. {
            let (mut retries, mut remaining) = (vec![], &pending[..]);
            while !remaining.is_empty() {
                let (batch, gathered) = batches.try_next(&mut remaining, |batch| {
                    let of_batch: Vec<TwoSidedPoint> =
                        batch.iter().map(|&v| points[v as usize]).collect();
                    gather_two_sided(gatherer, &field, &of_batch)
                })?;
                for (&v, sample) in batch.iter().zip(gathered) {
                    buried[v as usize] = gather_points.is_buried(v, &sample);
                    samples[v as usize] = sample;
                    if buried[v as usize] && gather_points.has_more(v, attempt) {
                        retries.push(v);
                    } else {
                        done += 1;
                    }
                }
                gather_count += batch.len() as u64;
                if agree(progress(done, total)).is_break() {
                    return Ok(None);
                }
            }
            if retries.is_empty() {
                break;
            }
            for &v in &retries {
                points[v as usize] = gather_points.nearest_point(v, attempt + 1);
            }
            pending = retries;
        }
        drop(gather_points);
        let kept = KeptVertices {
            mesh,
            topology,
            vertices,
            points,
            albedo,
            area,
            samples,
            buried,
            gather_count,
        };
        Ok(Some(kept))
    }

    /// The vertices that gathered light.
    pub fn open(&self) -> Vec<u32> {
        let is_open = |&v: &u32| !self.buried[v as usize] && self.albedo[v as usize] != Rgb::ZERO;
        (0..self.samples.len() as u32).filter(is_open).collect()
    }

    /// Where vertex `v` gathered.
    pub fn point(&self, v: u32) -> TwoSidedPoint {
        self.points[v as usize]
    }

    /// A third of the area around vertex `v`, scene unit squared.
    pub fn area(&self, v: u32) -> f64 {
        self.area[v as usize]
    }

    /// What vertex `v` gathered.
    pub fn sample(&self, v: u32) -> &IrradianceSample {
        &self.samples[v as usize]
    }

    /// Sets the irradiance of vertex `v` and its standard error, W/m².
    pub fn set(&mut self, v: u32, irradiance: Rgb, standard_error: f64) {
        let sample = &mut self.samples[v as usize];
        (sample.irradiance, sample.noise) = (irradiance, standard_error);
    }

    /// The light at the vertices, with its standard error. Buried vertices next to others have what
    /// these suggest.
    pub fn light(self) -> GatheredMesh {
        let count = self.samples.len();
        let reflected: Vec<Rgb> = self
            .albedo
            .iter()
            .zip(&self.samples)
            .map(|(albedo, s)| *albedo * s.irradiance)
            .collect();
        let error = |(reflected, sample): (&Rgb, &IrradianceSample)| {
            let all = sample.irradiance.length();
            if all > 0.0 { sample.noise * (reflected.length() / all) } else { 0.0 }
        };
        let noise: Vec<f64> = reflected.iter().zip(&self.samples).map(error).collect();
        let mut samples = SampledMesh {
            mesh: self.mesh,
            topology: self.topology,
            vertices: self.vertices,
            reflected,
            noise,
            weights: vec![1.0; count],
            buried: self.buried,
            direct: vec![],
            hidden: vec![false; count],
        };
        extrapolate_into_buried(&mut samples);
        let (mesh, reflected) = (samples.mesh.clone(), samples.reflected.clone());
        let error = std::mem::take(&mut samples.noise);
        let (surface, corners) = samples.into_vertex_mesh();
        GatheredMesh {
            surface: VertexMesh { error, ..surface },
            mesh,
            corners,
            reflected,
            gather_count: self.gather_count,
            relative_change: 0.0,
            stop: StopReason::Converged,
        }
    }
}
