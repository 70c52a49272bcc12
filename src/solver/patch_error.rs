//! The estimated error of a patch that shoots along one row, seen from one viewpoint.
//!
//! The light that leaves elements e of a patch is sent as if all of it left the viewpoint v, in the
//! direction of its normal. The share that this misplaces is estimated from moments of the source
//! distribution about the viewpoint, weighted by the flux Φ_e that leaves each element, and from
//! moments of the inverse distance r of the receivers, weighted by form factor:
//!
//! ```text
//! m₁ = Σ Φ_e (x_e − v) / Φ     mean offset                length
//! m₂ = Σ Φ_e |x_e − v|² / Φ    mean square offset         length²
//! n₁ = Σ Φ_e (n_e − n_v) / Φ   mean normal deviation      1
//! n₂ = Σ Φ_e |n_e − n_v|² / Φ  mean square deviation      1
//! u  = Σ |Φ_e − Φ A_e/A| / Φ   unevenness, in [0, 2)      1
//! d₁ = Σ F_vj / r_j            mean inverse distance      1/length
//! d₂ = Σ F_vj / r_j²           mean square of it          1/length²
//!
//! q = min(1, |m₁| d₁ + m₂ d₂ + 3 u √(m₂ d₂) + |n₁| + n₂)  share of the patch's light misplaced
//! p = m₂ √(d₂ / A)             light on a spot, A the area of all surfaces
//! error = max(√s q, min(1, s A/A_p) p),  s the share of the emitted flux that leaves the patch
//! ```
//!
//! The weight 3 of unevenness is a plain choice, above 1 since a corner of the patch sends to its
//! neighbours, not to the mean receiver.
//!
//! A patch with share s adds s q² to the mean square of q over all light, so that equal errors √s q
//! put the patches where the flux is. Hanrahan, Salzman and Aupperle (1991) refine links between
//! two patches by brightness likewise.
//!
//! The second term is for patches that touch something next to their viewpoint. All light of such a
//! patch, from an area m₂, is sent to a spot of area 1/d₂, which becomes m₂ d₂ times too bright: a
//! relative error whose mean square over all surfaces is p². The light concerned may be a small
//! share of the scene's, so that the first term misses it. Patches that are darker than the mean
//! (their area is A_p) make dimmer spots.

use std::ops::Range;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::flux_state::Flux;
use crate::form_factor::Row;
use crate::mesh::{Mesh, NodeId};

/// The surfaces of a mesh.
#[derive(Clone)]
pub(super) struct Surfaces<'m> {
    pub mesh: &'m Mesh,
    /// Centroid of each element.
    pub centroids: Vec<DVec3>,
    /// Total area, square of the scene's unit.
    pub area: f64,
}

impl<'m> Surfaces<'m> {
    pub fn of(mesh: &'m Mesh) -> Surfaces<'m> {
        let scene = mesh.scene();
        Surfaces {
            mesh,
            centroids: (0..mesh.element_count()).map(|e| mesh.centroid(mesh.element(e))).collect(),
            area: (0..scene.triangles().len()).map(|t| scene.solid_area(t)).sum(),
        }
    }
}

/// Means of 1/r and 1/r² over all that a patch sees, r the distance of a receiver's centroid from
/// the viewpoint.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub(super) struct InverseDistanceMoments {
    /// d₁, 1/length.
    first: f64,
    /// d₂, 1/length².
    second: f64,
}

impl InverseDistanceMoments {
    /// Moments at the middle of a cube of this surface area: a guess for patches without a row.
    pub fn in_cube_of_area(area: f64) -> InverseDistanceMoments {
        InverseDistanceMoments { first: (6.0 / area).sqrt(), second: 6.0 / area }
    }

    /// Moments of `row`, seen from `viewpoint`. `centroids` are those of all elements.
    pub fn of_row(row: &Row, viewpoint: DVec3, centroids: &[DVec3]) -> InverseDistanceMoments {
        let mut moments = InverseDistanceMoments { first: 0.0, second: 0.0 };
        for entry in &row.entries {
            let factor = Row::form_factor(entry.share);
            let distance = centroids[entry.element as usize].distance(viewpoint);
            moments.first += factor / distance;
            moments.second += factor / (distance * distance);
        }
        moments
    }

    /// Whether both are numbers; those read from a file may not be.
    pub fn is_consistent(&self) -> bool {
        !self.first.is_nan() && !self.second.is_nan()
    }
}

/// Moments of the light that leaves some elements, about a viewpoint; sums, not means.
#[derive(Clone, Copy, Default)]
struct SourceMoments {
    /// Φ, W over all channels.
    flux: f64,
    /// A, length².
    area: f64,
    /// Φ m₁.
    offset: DVec3,
    /// Φ m₂.
    square_offset: f64,
    /// Φ n₁.
    normal_deviation: DVec3,
    /// Φ n₂.
    square_normal_deviation: f64,
}

impl SourceMoments {
    /// Moments of one element: its flux and area, its centroid less the viewpoint, and its normal
    /// less that of the viewpoint.
    fn of_element(flux: f64, area: f64, offset: DVec3, normal_deviation: DVec3) -> SourceMoments {
        SourceMoments {
            flux,
            area,
            offset: flux * offset,
            square_offset: flux * offset.length_squared(),
            normal_deviation: flux * normal_deviation,
            square_normal_deviation: flux * normal_deviation.length_squared(),
        }
    }

    /// Moments of the elements of both, about the same viewpoint.
    fn combine(self, other: SourceMoments) -> SourceMoments {
        SourceMoments {
            flux: self.flux + other.flux,
            area: self.area + other.area,
            offset: self.offset + other.offset,
            square_offset: self.square_offset + other.square_offset,
            normal_deviation: self.normal_deviation + other.normal_deviation,
            square_normal_deviation: self.square_normal_deviation + other.square_normal_deviation,
        }
    }

    /// p for total surface area `area` and a patch with the share `s` of the light.
    fn spot(&self, s: f64, area: f64, distances: InverseDistanceMoments) -> f64 {
        let brightness = (s * area / self.area).min(1.0);
        brightness * self.square_offset / self.flux * (distances.second / area).sqrt()
    }

    /// q for unevenness `u` and receivers at `distances`.
    fn misplaced_share(&self, u: f64, distances: InverseDistanceMoments) -> f64 {
        let InverseDistanceMoments { first: d1, second: d2 } = distances;
        // The square of the angle subtended by the patch.
        let solid = self.square_offset / self.flux * d2;
        let by_position = self.offset.length() / self.flux * d1 + solid + 3.0 * u * solid.sqrt();
        let by_normal = (self.normal_deviation.length() + self.square_normal_deviation) / self.flux;
        (by_position + by_normal).min(1.0)
    }
}

/// Error of a patch of these `elements`, seen from the centroid of node `viewpoint`; `s` is its
/// share of the emitted light, and the error is 0 where there is none.
pub(super) fn patch_error(
    s: f64,
    surfaces: &Surfaces,
    elements: &[Range<usize>],
    viewpoint: NodeId,
    distances: InverseDistanceMoments,
    flux: &Flux,
) -> f64 {
    let Surfaces { mesh, centroids, area } = surfaces;
    let light = |e: usize| flux.leaving(e).element_sum();
    let (eye, normal) = (mesh.centroid(viewpoint), mesh.normal(viewpoint));
    let mut moments = SourceMoments::default();
    for e in elements.iter().cloned().flatten() {
        let node = mesh.element(e);
        let (offset, deviation) = (centroids[e] - eye, mesh.normal(node) - normal);
        let element = SourceMoments::of_element(light(e), mesh.solid_area(node), offset, deviation);
        moments = moments.combine(element);
    }
    if moments.flux <= 0.0 {
        return 0.0;
    }
    let mut deviation = 0.0;
    for e in elements.iter().cloned().flatten() {
        let even = moments.flux / moments.area * mesh.solid_area(mesh.element(e));
        deviation += (light(e) - even).abs();
    }
    let q = moments.misplaced_share(deviation / moments.flux, distances);
    (s.sqrt() * q).max(moments.spot(s, *area, distances))
}
