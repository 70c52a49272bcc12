//! The proximity correction: near receivers get the factor of the whole patch instead of its
//! centroid.
//!
//! A row source sees a patch from its centroid, as if all its light left from there. That is wrong
//! for a receiver within a few patch diameters (the proximity assumption of Baum, Rushmeier and
//! Winget 1989). Each entry whose receiver is near is scaled, with closed forms of Lambert for both
//! factors:
//!
//! ```text
//!            F(receiver's centroid → whole patch) × A_receiver / A_patch    by reciprocity
//! share  ×=  ──────────────────────────────────────────────────────────
//!            F(patch's centroid → whole receiver)
//! ```
//!
//! So receivers that the source sees as hidden stay hidden. Receivers much larger than the patch
//! are not corrected: for them the centroid of the patch is the better viewpoint. All other entries
//! are scaled by one factor, so that the row still sums to one.

use glam::DVec3;
use rayon::prelude::*;

use super::closed_form::point_to_polygon;
use super::{FormFactors, Row, checked_rows};
use crate::error::Error;
use crate::mesh::{Mesh, NodeId};

/// Lengths within this factor of a bound count as below it. On grids many receivers are just at the
/// reach, or just twice as large: rounding must not decide which of them are corrected.
const REACH_TOLERANCE: f64 = 1.0 + 1e-6;

/// Rows of another source, with the entries of near receivers corrected by closed forms.
///
/// The correction is for the proximity assumption of Baum, Rushmeier and Winget (1989): that all
/// light of a patch leaves its centroid, which is wrong for receivers within a few patch diameters.
#[derive(Debug)]
pub struct ProximityCorrection<M> {
    source: M,
    near_field: NearField,
    /// Sum over rows of the share that moved to other receivers.
    total_correction: f64,
    /// Rows corrected so far.
    rows: u64,
}

/// Determines the receivers near a patch.
#[derive(Debug)]
struct NearField {
    /// In patch diameters.
    reach: f64,
    /// One per element.
    spheres: Vec<Sphere>,
}

/// A bounding sphere about the centroid of a node.
#[derive(Clone, Copy, Debug)]
struct Sphere {
    centre: DVec3,
    radius: f64,
}

impl<M: FormFactors> ProximityCorrection<M> {
    /// Corrects receivers in `mesh` whose surface is within `reach` patch diameters of the patch's;
    /// if below 0 none, not even those that touch it.
    pub fn new(source: M, mesh: &Mesh, reach: f64) -> ProximityCorrection<M> {
        let elements = (0..mesh.element_count()).map(|e| mesh.element(e));
        let spheres = elements.map(|node| Sphere::around(mesh, node)).collect();
        let near_field = NearField { reach, spheres };
        ProximityCorrection { source, near_field, total_correction: 0.0, rows: 0 }
    }

    /// The source of the rows.
    pub fn inner(&self) -> &M {
        &self.source
    }

    /// Size of the correction: the share of a row, in [0, 1], that moved to other receivers, mean
    /// over all rows so far.
    pub fn mean_correction(&self) -> f64 {
        if self.rows == 0 { 0.0 } else { self.total_correction / self.rows as f64 }
    }

    /// Corrects `rows`, seen from the centroids of `patches`.
    fn correct(&mut self, mesh: &Mesh, patches: &[NodeId], rows: &mut [Row]) {
        if self.near_field.reach < 0.0 {
            return;
        }
        let near_field = &self.near_field;
        let pairs = rows.par_iter_mut().zip(patches);
        let corrections: Vec<f64> =
            pairs.map(|(row, &patch)| near_field.correct(mesh, patch, row)).collect();
        self.rows += corrections.len() as u64;
        self.total_correction += corrections.iter().sum::<f64>();
    }
}

impl<M: FormFactors> FormFactors for ProximityCorrection<M> {
    fn rows(&mut self, mesh: &Mesh, patches: &[NodeId], weight: f64) -> Result<Vec<Row>, Error> {
        // The correction of a row that breaks its contract may panic.
        let mut rows = checked_rows(&mut self.source, mesh, patches, weight)?;
        self.correct(mesh, patches, &mut rows);
        Ok(rows)
    }

    fn preferred_batch_len(&self) -> usize {
        self.source.preferred_batch_len()
    }

    fn fingerprint(&self) -> String {
        format!("{}, near {}", self.source.fingerprint(), self.near_field.reach)
    }
}

impl NearField {
    /// Corrects one row; returns the share of it that moved to other receivers.
    fn correct(&self, mesh: &Mesh, patch: NodeId, row: &mut Row) -> f64 {
        let (polygon, normal) = (mesh.corners(patch), mesh.normal(patch));
        let around = Sphere::around(mesh, patch);
        let mut near_before = 0.0;
        let mut near_after = 0.0;
        let mut corrected: Vec<(usize, f64)> = vec![];
        for (k, entry) in row.entries.iter().enumerate() {
            let sphere = self.spheres[entry.element as usize];
            let is_far = sphere.gap(&around) > self.reach * 2.0 * around.radius * REACH_TOLERANCE;
            // The centroid of a larger receiver represents it worse than the patch's represents the
            // patch.
            if is_far || sphere.radius > 2.0 * around.radius * REACH_TOLERANCE {
                continue;
            }
            let element = mesh.element(entry.element as usize);
            let from_centroid = point_to_polygon(around.centre, normal, &mesh.corners(element));
            let back = point_to_polygon(sphere.centre, mesh.normal(element), &polygon);
            let from_patch = back * mesh.area(element) / mesh.area(patch);
            let before = Row::form_factor(entry.share);
            let after = before * from_patch / from_centroid;
            // The centroid may be in the receiver's plane and not see it.
            if after.is_finite() {
                near_before += before;
                near_after += after;
                corrected.push((k, after));
            }
        }
        if corrected.is_empty() || near_after >= 1.0 || near_before >= 1.0 {
            return 0.0;
        }
        let far_scale = (1.0 - near_after) / (1.0 - near_before);
        let shares = row.entries.iter().map(|e| e.share).chain([row.escaped, row.backface]);
        let before: Vec<f64> = shares.map(Row::form_factor).collect();
        let mut after: Vec<f64> = before.iter().map(|f| f * far_scale).collect();
        for (k, factor) in corrected {
            after[k] = factor;
        }
        row.set_factors(&after);
        before.iter().zip(&after).map(|(a, b)| (a - b).abs()).sum::<f64>() / 2.0
    }
}

impl Sphere {
    fn around(mesh: &Mesh, node: NodeId) -> Sphere {
        let centre = mesh.centroid(node);
        let radius = mesh.corners(node).iter().map(|p| p.distance(centre)).fold(0.0, f64::max);
        Sphere { centre, radius }
    }

    /// A lower bound on the distance between the contents of the two.
    fn gap(&self, other: &Sphere) -> f64 {
        self.centre.distance(other.centre) - self.radius - other.radius
    }
}
