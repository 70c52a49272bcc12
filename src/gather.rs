//! The contract between whoever gathers the settled light at places and whoever uses it.

pub(crate) mod light_projection;
pub(crate) mod lights;

use glam::DVec3;

use crate::error::Error;
use crate::mesh::Mesh;
use crate::scene::Rgb;

/// A place on a surface at which light is gathered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GatherPoint {
    /// Where, in the scene's unit: a little above the surface, so that nothing hides it.
    pub position: DVec3,
    /// Unit normal; what is above its plane is seen.
    pub normal: DVec3,
    /// Nothing nearer than this is seen, scene unit.
    pub near: f64,
}

/// What arrives at a [`GatherPoint`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct IrradianceSample {
    /// Irradiance, W/m² per channel: Σ F_pj B_j over all that is seen.
    pub irradiance: Rgb,
    /// The part of it that comes straight from lights which were looked at one by one.
    pub direct: Rgb,
    /// Share of the hemisphere's form factor in which nothing is seen.
    pub escaped: f64,
    /// Share in which backs of surfaces are seen.
    pub backface: f64,
    /// Mean of 1/distance over the hemisphere, weighted by form factor; what is open counts 0.
    pub inverse_distance: f64,
}

/// The settled light: what every point of the scene's fronts reflects, interpolated linearly from
/// the corners of the elements. What they emit is known from their materials.
#[derive(Clone, Copy, Debug)]
pub struct RadiosityField<'a> {
    /// The scene, cut into elements.
    pub mesh: &'a Mesh,
    /// Per element, where its three corners' values are in `reflected`.
    pub corners: &'a [[u32; 3]],
    /// Reflected radiosity B − E, W/m² per channel.
    pub reflected: &'a [Rgb],
}

/// Someone who gathers: hemicubes on a GPU, rays on the CPU.
pub trait Gather {
    /// What arrives at each of `places`, in their order.
    ///
    /// # Errors
    /// Whatever keeps the gatherer from it, [`crate::ErrorKind::Device`] above all.
    fn gather(
        &mut self,
        sources: &RadiosityField,
        places: &[GatherPoint],
    ) -> Result<Vec<IrradianceSample>, Error>;
}

impl<G: Gather + ?Sized> Gather for Box<G> {
    fn gather(
        &mut self,
        sources: &RadiosityField,
        places: &[GatherPoint],
    ) -> Result<Vec<IrradianceSample>, Error> {
        (**self).gather(sources, places)
    }
}

impl RadiosityField<'_> {
    /// Reflected radiosity at barycentric position (`u`, `v`) of triangle `t`.
    pub(crate) fn reflected_at(&self, t: usize, u: f64, v: f64) -> Rgb {
        let (element, [u, v]) = self.mesh.element_at(t, u, v);
        let [a, b, c] = self.corners[element].map(|k| self.reflected[k as usize]);
        a * (1.0 - u - v) + b * u + c * v
    }
}
