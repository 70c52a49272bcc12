//! Where the light that arrives at a point comes from: a row of form factors from the point.
//!
//! ```text
//!   irradiance = share · Σ_hits passed · B_reflected + Σ_emitters F · E + F_sky · π L + F_sun · S
//!              + Σ_luminaires E_1 · scale
//! ```
//!
//! A row is of the geometry alone, so light of any number of bands is looked up along it.

use super::GatherPoint;
use crate::mesh::Mesh;
use crate::scene::Rgb;

/// Where the light that arrives at a point comes from.
#[derive(Clone, Debug, Default)]
pub(crate) struct PointRow {
    /// The fronts that rays met, in the order of the rays.
    pub hits: Vec<SurfaceHit>,
    /// Form factor that each hit stands for.
    pub share: f64,
    /// Material, by its index, and form factor of what is visible of each light that was sampled
    /// explicitly.
    pub emitters: Vec<(u32, f64)>,
    /// Form factor of the open part of the hemisphere.
    pub sky: f64,
    /// Irradiance from the sun over that of a surface that faces it, all of it seen.
    pub sun: f64,
    /// Luminaire, by its index, and the irradiance from it in units of its scale, W/m², of each
    /// that is seen.
    pub luminaires: Vec<(u32, f64)>,
    /// Form factor of backs.
    pub backface: f64,
    /// Mean of 1/distance over the hemisphere, 1/scene unit.
    pub inverse_distance: f64,
}

/// A place on the front of a surface that a ray met.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfaceHit {
    /// The element there.
    pub element: u32,
    /// Weights of its second and third corner.
    pub barycentric: [f64; 2],
    /// Share that arrives from there: of panes the mean of the channels; by way of near surfaces
    /// each channel's own.
    pub passed: Rgb,
    /// Whether what the element emits is in no entry of [`PointRow::emitters`].
    pub emits: bool,
}

/// Makes rows of points: the same bits for the same point, whatever else was asked for.
pub(crate) trait PointRows: Sync {
    /// The rows of `point` by each of so many equal `parts` of the rays, over the elements of
    /// `mesh`. Their mean is the row by all of them.
    fn rows(&self, mesh: &Mesh, point: &GatherPoint, parts: u32) -> Vec<PointRow>;

    /// The row of what surfaces reflect to `point`, over the elements of `mesh`: no ray is sent to
    /// a light or to the sun. The light on them was gathered from elements of `source`.
    fn surface_row(&self, mesh: &Mesh, source: &Mesh, point: &GatherPoint) -> PointRow;
}

/// Makes rows of what surfaces reflect, and of no more.
pub(crate) struct SurfaceRows<'a> {
    pub maker: &'a dyn PointRows,
    /// Elements that what surfaces reflect was gathered from.
    pub source: &'a Mesh,
}

impl PointRows for SurfaceRows<'_> {
    fn rows(&self, mesh: &Mesh, point: &GatherPoint, _parts: u32) -> Vec<PointRow> {
        vec![self.surface_row(mesh, self.source, point)]
    }

    fn surface_row(&self, mesh: &Mesh, source: &Mesh, point: &GatherPoint) -> PointRow {
        self.maker.surface_row(mesh, source, point)
    }
}
