//! Settings of the adaptive gather, and what values they may have.

use crate::error::{Error, ErrorKind};
use crate::scene::Aabb;

/// Settings of [`gather_at_vertices`](super::gather_at_vertices): where elements are split, how
/// far, and how often all vertices gather.
#[derive(Clone, Debug, PartialEq)]
pub struct RefinementSettings {
    /// The error that the mesh may have, in (0, 1]: relative, root mean square over the area, as
    /// far as it can be predicted from the values at vertices. Elements are split where most of it
    /// is until it is no more.
    pub mesh_error: f64,
    /// Light may change over this length, and seldom over less: elements of the first mesh that
    /// are more than four times as long are split whatever their corners say, and none whose
    /// longest edge is an eighth of it; scene unit, above 0.
    pub min_edge: f64,
    /// After the last pass, an element is split once more where the quadratic interpolant of the
    /// gathered values differs from it by more than this share of its radiosity. The new vertices
    /// get the interpolant's values and do not gather. Above 0; infinity for never.
    pub interpolation_tolerance: f64,
    /// Elements at most. Those with the largest surplus are split first.
    pub max_elements: usize,
    /// Uniform subdivisions of all elements before adaptive refinement starts.
    pub initial_subdivisions: u32,
    /// How often all vertices gather: in the first pass the light given, in each further one what
    /// the pass before it found, so each adds a bounce. 0 counts as 1.
    pub gather_passes: u32,
    /// Where most of the light is, if that is a small part of the mesh: `min_edge` holds there, and
    /// grows with the distance from it, 1 + distance/diagonal times. With none, it holds
    /// everywhere.
    pub region: Option<Aabb>,
    /// Factor of the smallest edge, and of the longest of the first mesh as elements are judged by
    /// it, on the triangles of each group, above 0: for small objects in a large scene that are to
    /// be as right as it. Those beyond the end of the list have 1.
    pub group_scales: Vec<f64>,
    /// Factor of both tolerances and the smallest edge on the triangles of each group, above 0;
    /// those beyond the end of the list have 1.
    pub group_factors: Vec<f64>,
}

impl RefinementSettings {
    /// Default of [`RefinementSettings::max_elements`].
    pub const DEFAULT_MAX_ELEMENTS: usize = 1 << 19;

    /// Refines down to elements with edges of `min_edge` (scene unit), to an error of the mesh of 2
    /// % and an interpolation tolerance of 0.25 %, with no uniform subdivision and one pass.
    pub fn new(min_edge: f64) -> RefinementSettings {
        RefinementSettings {
            mesh_error: 0.02,
            min_edge,
            interpolation_tolerance: 0.0025,
            max_elements: RefinementSettings::DEFAULT_MAX_ELEMENTS,
            initial_subdivisions: 0,
            gather_passes: 1,
            region: None,
            group_scales: vec![],
            group_factors: vec![],
        }
    }

    /// Factor of lengths on triangles of `group`.
    pub(crate) fn group_scale(&self, group: u32) -> f64 {
        self.group_scales.get(group as usize).copied().unwrap_or(1.0)
    }

    /// Factor of the tolerances on triangles of `group`.
    pub(crate) fn group_factor(&self, group: u32) -> f64 {
        self.group_factors.get(group as usize).copied().unwrap_or(1.0)
    }

    /// Whether [`gather_at_vertices`](super::gather_at_vertices) accepts these settings: worth
    /// asking before a long solve.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] for an error of the mesh outside (0, 1], or a smallest edge or an
    /// interpolation tolerance, or a factor that is not above 0.
    pub fn check(&self) -> Result<(), Error> {
        let bad = |place: String, found: &str, remedy: &str| {
            Err(Error::new(ErrorKind::Setting, place, found, remedy))
        };
        if !(self.mesh_error > 0.0 && self.mesh_error <= 1.0) {
            let place = format!("error of the mesh {}", self.mesh_error);
            return bad(place, "out of range", "use a share above 0 and up to 1");
        }
        if self.min_edge.is_nan() || self.min_edge <= 0.0 {
            let place = format!("smallest element {}", self.min_edge);
            return bad(place, "not above 0", "use a length in the scene's unit");
        }
        if self.interpolation_tolerance.is_nan() || self.interpolation_tolerance <= 0.0 {
            let place = format!("interpolation tolerance {}", self.interpolation_tolerance);
            return bad(place, "not above 0", "use a share above 0, or infinity for none");
        }
        for factors in [&self.group_factors, &self.group_scales] {
            if let Some(k) = factors.iter().position(|f| f.is_nan() || *f <= 0.0) {
                let place = format!("factor {} of group {k}", factors[k]);
                return bad(place, "not above 0", "use 1 for no change");
            }
        }
        Ok(())
    }
}
