//! The light of all bands at the vertices of a bake.

use std::ops::ControlFlow;

use super::cie::Observer;
use super::error::{BandError, relative_noise};
use super::final_gather::GatheredVertex;
use super::lookup::{Lookup, add};
use super::spectra::{Band, Bands};
use super::surface_vertices::SurfaceVertices;
use super::vertex_system::{Converged, VertexEquation, VertexSystem};
use crate::accuracy::hidden;
use crate::backend::cpu::RayGather;
use crate::bake::BakeResult;
use crate::bake::model;
use crate::error::{Error, ErrorKind};
use crate::gather::vertex_rows::{VertexRows, neighbours_of_buried};
use crate::mesh::Mesh;
use crate::scene::{Rgb, Sky};
use crate::vertex::VertexMesh;

/// Ratio of the rays of a vertex for the final gather to those for the iteration, whose noise
/// differs from vertex to vertex and is averaged over all that a vertex sees. Plain choice.
const ITERATION_RAY_DIVISOR: u32 = 16;

/// Minimum number of rays of a vertex for the iteration. Plain choice.
const MIN_ITERATION_RAYS: u32 = 64;

/// Radiosity and irradiance of all bands at the vertices of a surface.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct BandLight {
    /// The bands, in the order in which they were given.
    pub bands: Vec<Band>,
    /// The surface of the bake, with its light in red, green and blue: positions, normals, faces.
    pub surface: VertexMesh,
    /// Radiosity, W/m² or W/(m² nm): the values of all bands at the first vertex, then at the next.
    pub radiosity: Vec<f64>,
    /// Irradiance in the same order, as in [`VertexMesh::irradiance`].
    pub irradiance: Vec<f64>,
    /// Standard error of the radiosity by noise, in the same order.
    pub noise: Vec<f64>,
    /// Estimated error of each band.
    pub errors: Vec<BandError>,
    /// Sweeps until each band converged.
    pub sweeps: Vec<u32>,
    sky: Vec<f64>,
}

impl Bands {
    /// The light of these bands at the vertices of `baked`, by rays on the CPU: the same number as
    /// its vertices gathered with. `progress` is called with the number of rows made and their
    /// total; if it breaks there is no light.
    ///
    /// # Errors
    /// Those of [`Bands::check`] for the scene that was baked; [`ErrorKind::Setting`] where `baked`
    /// was combined from several bakes.
    pub fn light(
        &self,
        baked: &BakeResult,
        mut progress: impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<Option<BandLight>, Error> {
        let mesh = &baked.light.mesh;
        self.check(mesh.scene())?;
        let surface = SurfaceVertices::new(mesh);
        if surface.count() != baked.light.surface.positions.len() {
            let found = format!("a surface of {} vertices", baked.light.surface.positions.len());
            let remedy = format!("those of its mesh are {}", surface.count());
            return Err(Error::new(ErrorKind::Setting, "light of a bake", found, remedy));
        }
        let rays = baked.settings.gather.as_ref().map_or(model::ELEMENT_RAYS, |g| g.rays);
        let gathered = Gathering::new(self, mesh, &surface, baked).light(rays, &mut progress)?;
        let Some(Gathered { converged, reflected, noise }) = gathered else { return Ok(None) };
        let corners = &surface.vertices.corners;
        let count = self.bands.len();
        let of_rays = relative_noise(mesh, corners, &reflected, &noise, count);
        let parts = of_rays.into_iter().zip(&converged.remainder);
        let of_bake = baked.estimate.total;
        let errors = parts.map(|(noise, &left)| BandError::new(noise, left, of_bake)).collect();
        let mut light = BandLight {
            bands: self.bands.clone(),
            surface: baked.light.surface.clone(),
            radiosity: reflected.clone(),
            irradiance: reflected,
            noise,
            errors,
            sweeps: converged.sweeps,
            sky: self.sky.clone(),
        };
        light.reflect(self, mesh, corners);
        for values in [&mut light.radiosity, &mut light.irradiance, &mut light.noise] {
            surface.extend(values, count);
        }
        Ok(Some(light))
    }
}

/// The vertices of a bake, and the data to gather there.
struct Gathering<'a> {
    bands: &'a Bands,
    mesh: &'a Mesh,
    surface: &'a SurfaceVertices,
    lookup: Lookup<'a>,
    /// Distance below which surfaces touch, scene unit.
    touching: f64,
}

/// The light that vertices gathered.
struct Gathered {
    /// The light that they gathered it from.
    converged: Converged,
    /// Reflected radiosity of all vertices, W/m², bands side by side.
    reflected: Vec<f64>,
    /// Its standard error, in the same order.
    noise: Vec<f64>,
}

impl<'a> Gathering<'a> {
    fn new(
        bands: &'a Bands,
        mesh: &'a Mesh,
        surface: &'a SurfaceVertices,
        baked: &BakeResult,
    ) -> Gathering<'a> {
        let region = baked.settings.solve.region;
        let diagonal = region.unwrap_or_else(|| mesh.scene().reflecting_bounds()).diagonal();
        let touching = hidden::NEAR * diagonal;
        let lookup = Lookup::new(bands, mesh, &surface.vertices.corners);
        Gathering { bands, mesh, surface, lookup, touching }
    }

    /// Iterates the light with few rays, and gathers it with many.
    fn light(
        &self,
        rays: u32,
        progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<Option<Gathered>, Error> {
        let few_rays = (rays / ITERATION_RAY_DIVISOR).max(MIN_ITERATION_RAYS).min(rays);
        let few = RayGather::new(self.mesh, few_rays)?;
        let many = RayGather::new(self.mesh, rays)?;
        let rows = |maker| VertexRows::new(self.mesh, &self.surface.vertices, self.touching, maker);
        let (few, many) = (rows(&few), rows(&many));
        let count = self.surface.vertices.positions.len();
        let materials: Vec<Option<u32>> =
            (0..count as u32).map(|v| few.material(v).filter(|&m| self.scatters(m))).collect();
        let scattering: Vec<u32> =
            (0..count as u32).filter(|&v| materials[v as usize].is_some()).collect();
        let of = 2 * scattering.len();
        let Some(converged) =
            self.converge(&few, &materials, &scattering, |done| progress(done, of))
        else {
            return Ok(None);
        };
        let many = many.map(
            &scattering,
            2,
            |v, row| {
                let material = materials[v as usize].unwrap_or_default();
                let reflected = &converged.reflected;
                (GatheredVertex::new(&self.lookup, material, row, reflected), row.buried)
            },
            |_, made| made,
            |done| progress(scattering.len() + done, of),
        );
        let Some(many) = many else { return Ok(None) };
        let (mut reflected, mut noise) = (vec![], vec![]);
        let vertices = self.all_vertices(&scattering, many, || GatheredVertex::dark(self.bands));
        let (vertices, buried) = vertices;
        for GatheredVertex { reflected: values, noise: errors } in vertices {
            reflected.extend(values);
            noise.extend(errors);
        }
        for (v, neighbours) in neighbours_of_buried(&self.surface.vertices, &buried) {
            for values in [&mut reflected, &mut noise] {
                self.set_mean(values, v, &neighbours);
            }
        }
        Ok(Some(Gathered { converged, reflected, noise }))
    }

    /// Whether `material` reflects or transmits diffusely in any band. Rays pass clear panes.
    fn scatters(&self, material: u32) -> bool {
        let of_bands = &self.bands.materials[material as usize];
        let is_clear = self.mesh.scene().materials()[material as usize].clear_transmittance();
        is_clear.is_none() && (0..self.bands.bands.len()).any(|b| of_bands.albedo(b) > 0.0)
    }

    /// The light that the iteration converges to with these `rows`.
    fn converge(
        &self,
        rows: &VertexRows,
        materials: &[Option<u32>],
        scattering: &[u32],
        mut progress: impl FnMut(usize) -> ControlFlow<()>,
    ) -> Option<Converged> {
        let equations = rows.map(
            scattering,
            1,
            |v, row| {
                let material = materials[v as usize].unwrap_or_default();
                (VertexEquation::new(&self.lookup, material, row), row.buried)
            },
            |_, equation| equation,
            &mut progress,
        )?;
        let dark = || VertexEquation::dark(self.bands);
        let (mut equations, buried) = self.all_vertices(scattering, equations, dark);
        for (v, neighbours) in neighbours_of_buried(&self.surface.vertices, &buried) {
            let others: Vec<(&VertexEquation, f64)> =
                neighbours.iter().map(|&(w, weight)| (&equations[w as usize], weight)).collect();
            equations[v as usize] = VertexEquation::mean(&others);
        }
        let done = scattering.len();
        VertexSystem { bands: self.bands, materials, equations }.solve(|| progress(done))
    }

    /// Extends the `results` of the `scattering` vertices to all, with `dark` for the others;
    /// also whether each is buried.
    fn all_vertices<T>(
        &self,
        scattering: &[u32],
        results: Vec<(T, bool)>,
        dark: impl Fn() -> T,
    ) -> (Vec<T>, Vec<bool>) {
        let mut results = scattering.iter().zip(results).peekable();
        let vertices = 0..self.surface.vertices.positions.len() as u32;
        let of_vertex = |v: u32| match results.next_if(|(w, _)| **w == v) {
            Some((_, result)) => result,
            None => (dark(), false),
        };
        vertices.map(of_vertex).unzip()
    }

    /// Sets the values of vertex `v` to the weighted mean of those of `neighbours`.
    fn set_mean(&self, values: &mut [f64], v: u32, neighbours: &[(u32, f64)]) {
        let count = self.bands.bands.len();
        let mut mean = vec![0.0; count];
        for &(w, weight) in neighbours {
            add(&mut mean, weight, &values[w as usize * count..][..count]);
        }
        values[v as usize * count..][..count].copy_from_slice(&mean);
    }
}

impl BandLight {
    /// Replaces the reflected radiosity in both vectors by radiosity and irradiance.
    fn reflect(&mut self, bands: &Bands, mesh: &Mesh, corners: &[[u32; 3]]) {
        let count = self.bands.len();
        let mut is_done = vec![false; self.radiosity.len() / count];
        for (e, corners) in corners.iter().enumerate() {
            let material = mesh.scene().triangles()[mesh.triangle(mesh.element(e))].material;
            let material = &bands.materials[material as usize];
            for v in corners.map(|v| v as usize) {
                if std::mem::replace(&mut is_done[v], true) {
                    continue;
                }
                for b in 0..count {
                    let (k, albedo) = (v * count + b, material.albedo(b));
                    self.radiosity[k] += material.exitance[b];
                    self.irradiance[k] =
                        if albedo > 0.0 { self.irradiance[k] / albedo } else { 0.0 };
                }
            }
        }
    }

    /// Radiosity of vertex `v` in each band, W/m² or W/(m² nm).
    ///
    /// # Panics
    /// When there is no such vertex.
    pub fn radiosity_at(&self, v: usize) -> &[f64] {
        &self.radiosity[v * self.bands.len()..][..self.bands.len()]
    }

    /// Irradiance of vertex `v` in each band, W/m² or W/(m² nm); 0 where its material is black.
    ///
    /// # Panics
    /// When there is no such vertex.
    pub fn irradiance_at(&self, v: usize) -> &[f64] {
        &self.irradiance[v * self.bands.len()..][..self.bands.len()]
    }

    /// The surface in colours computed from the bands: radiosity and irradiance as linear BT.709.
    /// Values out of its gamut are clamped, channel by channel.
    ///
    /// # Errors
    /// Those of [`Observer::new`].
    pub fn colours(&self) -> Result<VertexMesh, Error> {
        let observer = Observer::new(&self.bands)?;
        let colour = |values: &[f64]| observer.linear_srgb(values).max(Rgb::ZERO);
        let colours = |values: &[f64]| values.chunks(self.bands.len()).map(colour).collect();
        Ok(VertexMesh {
            radiosity: colours(&self.radiosity),
            irradiance: colours(&self.irradiance),
            error: vec![],
            sky: Sky::uniform(colour(&self.sky)),
            ..self.surface.clone()
        })
    }
}
