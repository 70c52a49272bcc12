//! Gathering: the irradiance that a known radiosity field causes at points.
//!
//! ```text
//!   RadiosityField ──┐
//!                    ├─ Gather ── IrradianceSample per point ── B = E + ρ · irradiance
//!   GatherPoints ────┘
//! ```
//!
//! The contract is [`Gather`]; rays on a device and rays on the CPU implement it, and callers
//! differ only in their list of points: vertices, pixels of an image, or places at which the error
//! of a result is estimated. [`gather_at_vertices`] is the first of these, with refinement;
//! [`irradiance_at`] takes points anywhere, and gives each a standard error.

pub(crate) mod adaptive;
mod batch;
mod buried;
mod centroid_probes;
pub(crate) mod directional_light;
pub(crate) mod exchange;
mod further_bounces;
pub(crate) mod gather_points;
mod gathered_mesh;
mod interpolated_refinement;
pub(crate) mod kept_mesh;
pub(crate) mod light_samples;
pub(crate) mod light_tree;
pub(crate) mod lights;
pub(crate) mod luminaire_light;
pub(crate) mod near_surface;
pub(crate) mod point_irradiance;
pub(crate) mod point_row;
mod progress;
pub(crate) mod refinement_indicator;
mod refinement_settings;
mod sampled_mesh;
mod shadow_edges;
mod source_light;
mod surplus;
pub(crate) mod two_sided;
pub(crate) mod vertex_rows;
pub(crate) mod vertex_weights;
pub(crate) mod visible;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::mesh::Mesh;
use crate::scene::Rgb;
pub use adaptive::gather_at_vertices;
pub use gathered_mesh::GatheredMesh;
pub use point_irradiance::{PointIrradiance, irradiance_at};
pub use progress::Progress;
pub use refinement_settings::RefinementSettings;

/// A point at which light is gathered, on a surface or in the air.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GatherPoint {
    /// Position, scene unit: a little above the surface if there is one, so that it does not hide
    /// anything from the point.
    pub position: DVec3,
    /// Unit normal; light arrives from the hemisphere around it.
    pub normal: DVec3,
    /// Near distance, scene unit: surfaces nearer than this are not seen.
    pub near: f64,
}

/// What arrives at a [`GatherPoint`].
///
/// All shares are form factors from the point: cosine-weighted and 1 for the whole hemisphere.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct IrradianceSample {
    /// Irradiance, W/m² per channel: Σ F_pj B_j over all fronts that are seen, with B emitted plus
    /// reflected, and the sky where there is no surface.
    pub irradiance: Rgb,
    /// The part of `irradiance` that lights, luminaires and the sun send straight to the point, per
    /// channel, W/m².
    pub direct: Rgb,
    /// The part of `direct` that the sun and luminaires send, per channel, W/m²; none where the
    /// gather does not keep it apart.
    pub directional: Option<Rgb>,
    /// Standard error of `irradiance` as far as its rays tell, W/m²: a length over the channels;
    /// where they see two fields, that of the first.
    pub noise: f64,
    /// Share of the hemisphere in which nothing is seen, in [0, 1].
    pub escaped: f64,
    /// Share of the hemisphere in which backs of surfaces are seen, in [0, 1].
    pub backface: f64,
    /// Mean of 1/distance over the hemisphere, 1/scene unit; directions that see nothing count 0.
    pub inverse_distance: f64,
    /// Whether paths, in place of the field, have the light of near surfaces: those that are nearer
    /// than their element is wide.
    pub near_paths: bool,
}

/// A known radiosity field: what every point on the front of the scene reflects, interpolated
/// linearly between the corners of elements. Emission is not in it; materials have it.
#[derive(Clone, Copy, Debug)]
pub struct RadiosityField<'a> {
    /// The scene, cut into elements.
    pub mesh: &'a Mesh,
    /// Per element, the indices of its three corners in `reflected`.
    pub corners: &'a [[u32; 3]],
    /// Reflected radiosity B − E, W/m² per channel, with the reflectance of the material: it
    /// follows the light and no texture. [`RadiosityField::reflected_at`] has the texture in it.
    pub reflected: &'a [Rgb],
}

/// A source of irradiance samples: rays on a device, rays on the CPU, or a caller's own.
///
/// A gatherer is made for one scene and owns what that takes (a ray hierarchy, buffers on a
/// device); the caller owns points and field, which may change from call to call. The field's mesh
/// must be of that scene, and may be subdivided in any way.
///
/// What an implementation must do:
/// - return one sample for each point, in the order of `points`;
/// - treat each point by itself: the same gatherer, field and point give the same bits, whichever
///   other points are in the call and however many calls were before;
/// - see the same directions from a point whatever the field, so that the difference of two fields
///   has no more noise than is in the difference;
/// - count each front by emitted plus reflected radiosity, backs as black, and directions that meet
///   no surface by the radiosity of the scene's sky, π times its radiance;
/// - add what comes straight from the sun and from the scene's luminaires, which no surface shows.
///
/// It is called with some hundred points at once or more, and should make use of all of the machine
/// for a call. Progress and cancelling are the caller's business.
pub trait Gather {
    /// What arrives at each of `points` from `field`, in their order.
    ///
    /// # Errors
    /// Whatever keeps the implementation from it: [`crate::ErrorKind::Device`] above all.
    fn gather(
        &mut self,
        field: &RadiosityField,
        points: &[GatherPoint],
    ) -> Result<Vec<IrradianceSample>, Error>;

    /// The same, where the squared errors of points count with `weights`: the number of samples of
    /// this gatherer is that of a weight of 1. Worth implementing where samples take time.
    ///
    /// # Errors
    /// Those of [`Gather::gather`].
    fn gather_weighted(
        &mut self,
        field: &RadiosityField,
        points: &[GatherPoint],
        _weights: &[f64],
    ) -> Result<Vec<IrradianceSample>, Error> {
        self.gather(field, points)
    }

    /// What arrives at each of `points` from two fields of one scene, field by field, with the same
    /// directions. Worth implementing where finding what is seen costs more than looking its light
    /// up.
    ///
    /// # Errors
    /// Those of [`Gather::gather`].
    fn gather_both(
        &mut self,
        fields: [&RadiosityField; 2],
        points: &[GatherPoint],
    ) -> Result<[Vec<IrradianceSample>; 2], Error> {
        let [first, second] = fields;
        Ok([self.gather(first, points)?, self.gather(second, points)?])
    }

    /// How many points a call should have for all of the machine to be used. Callers begin with so
    /// many where there are as many, and go by the clock from then on.
    fn preferred_batch_len(&self) -> usize {
        256
    }
}

impl<G: Gather + ?Sized> Gather for Box<G> {
    fn gather(
        &mut self,
        field: &RadiosityField,
        points: &[GatherPoint],
    ) -> Result<Vec<IrradianceSample>, Error> {
        (**self).gather(field, points)
    }

    fn gather_weighted(
        &mut self,
        field: &RadiosityField,
        points: &[GatherPoint],
        weights: &[f64],
    ) -> Result<Vec<IrradianceSample>, Error> {
        (**self).gather_weighted(field, points, weights)
    }

    fn gather_both(
        &mut self,
        fields: [&RadiosityField; 2],
        points: &[GatherPoint],
    ) -> Result<[Vec<IrradianceSample>; 2], Error> {
        (**self).gather_both(fields, points)
    }

    fn preferred_batch_len(&self) -> usize {
        (**self).preferred_batch_len()
    }
}

impl RadiosityField<'_> {
    /// Reflected radiosity below which errors are relative to this instead, W/m²: this `share` of
    /// the mean over the area that reflects; a length over the channels.
    pub(crate) fn radiosity_floor(&self, share: f64) -> f64 {
        let (mut flux, mut area) = (0.0, f64::MIN_POSITIVE);
        for (e, corners) in self.corners.iter().enumerate() {
            let node = self.mesh.element(e);
            if self.mesh.material(node).scatters() {
                let mean = corners.iter().map(|&v| self.reflected[v as usize]).sum::<Rgb>() / 3.0;
                flux += mean.length() * self.mesh.solid_area(node);
                area += self.mesh.solid_area(node);
            }
        }
        share * flux / area
    }

    /// Radiosity that barycentric position (`u`, `v`) of the scene's triangle `t` reflects, W/m²
    /// per channel: `u` and `v` are the weights of its second and third corner. An element of a
    /// textured material reflects the mean of its own piece of the texture.
    pub fn reflected_at(&self, t: usize, u: f64, v: f64) -> Rgb {
        let (element, local) = self.mesh.element_at(t, u, v);
        self.reflected_on_element(element, local)
    }

    /// The same at barycentric position (`u`, `v`) of an element.
    pub(crate) fn reflected_on_element(&self, element: usize, local: [f64; 2]) -> Rgb {
        self.interpolated(element, local) * self.mesh.relative_reflectance(element)
    }

    /// What [`RadiosityField::reflected_at`] gives if all of the material reflects alike.
    pub(crate) fn untextured_at(&self, t: usize, u: f64, v: f64) -> Rgb {
        let (element, local) = self.mesh.element_at(t, u, v);
        self.interpolated(element, local)
    }

    /// The same at barycentric position (`u`, `v`) of an element, W/m² per channel.
    fn interpolated(&self, element: usize, [u, v]: [f64; 2]) -> Rgb {
        let [a, b, c] = self.corners[element].map(|k| self.reflected[k as usize]);
        a * (1.0 - u - v) + b * u + c * v
    }
}
