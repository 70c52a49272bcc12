//! The proximity repair: near receivers get their factor from the whole patch, not its centroid.

use glam::DVec3;
use rayon::prelude::*;

use super::closed_form::point_to_polygon;
use super::{FormFactors, Row, checked_rows};
use crate::error::Error;
use crate::mesh::{Mesh, NodeId};

/// Rows of another maker, with the entries of near receivers mended.
///
/// A row maker sees a patch from its centroid, as if all its light came from there. That is off for
/// a receiver within a few patch diameters (the proximity assumption of Baum, Rushmeier and Winget
/// 1989). Such an entry is multiplied by what closed forms say of it: the factor from the
/// receiver's centroid to the whole patch, turned round by reciprocity, over the factor from the
/// patch's centroid to the whole receiver (both Lambert's). What the maker found hidden stays
/// hidden. All other entries share the difference in proportion, so that the row still sums to one.
#[derive(Debug)]
pub struct ProximityCorrection<M> {
    rows: M,
    near: Near,
    moved: f64,
    made: u64,
}

/// What counts as near.
#[derive(Debug)]
struct Near {
    /// In patch diameters.
    reach: f64,
    /// About each element.
    spheres: Vec<Sphere>,
}

/// On grids many are just at the reach: rounding is not to tell which of them are near.
const TIE: f64 = 1.0 + 1e-6;

/// A sphere about an element.
#[derive(Clone, Copy, Debug)]
struct Sphere {
    centre: DVec3,
    radius: f64,
}

impl<M: FormFactors> ProximityCorrection<M> {
    /// Mends receivers in `mesh` whose surface is within `reach` patch diameters of the patch's;
    /// below 0 none, not even those that touch it.
    pub fn new(rows: M, mesh: &Mesh, reach: f64) -> ProximityCorrection<M> {
        let elements = (0..mesh.element_count()).map(|e| mesh.element(e));
        let spheres = elements.map(|n| Sphere::around(mesh, n)).collect();
        ProximityCorrection { rows, near: Near { reach, spheres }, moved: 0.0, made: 0 }
    }

    /// The maker of the rows.
    pub fn inner(&self) -> &M {
        &self.rows
    }

    /// Size of the correction: the share of a row, in [0, 1], that went to other receivers than the
    /// maker said, in the mean over all rows so far.
    pub fn moved(&self) -> f64 {
        if self.made == 0 { 0.0 } else { self.moved / self.made as f64 }
    }

    /// The maker's own rows, nothing mended; checked, since to mend what is no row may panic.
    pub(super) fn raw(
        &mut self,
        mesh: &Mesh,
        patches: &[NodeId],
        unshot_share: f64,
    ) -> Result<Vec<Row>, Error> {
        checked_rows(&mut self.rows, mesh, patches, unshot_share)
    }

    /// Mends `rows` as seen from the centroids of `patches`.
    pub(super) fn mend(&mut self, mesh: &Mesh, patches: &[NodeId], rows: &mut [Row]) {
        if self.near.reach < 0.0 {
            return;
        }
        let near = &self.near;
        let pairs = rows.par_iter_mut().zip(patches);
        let moved: Vec<f64> = pairs.map(|(row, &patch)| near.mend(mesh, patch, row)).collect();
        self.made += moved.len() as u64;
        self.moved += moved.iter().sum::<f64>();
    }
}

impl<M: FormFactors> FormFactors for ProximityCorrection<M> {
    fn rows(
        &mut self,
        mesh: &Mesh,
        patches: &[NodeId],
        unshot_share: f64,
    ) -> Result<Vec<Row>, Error> {
        let mut rows = self.raw(mesh, patches, unshot_share)?;
        self.mend(mesh, patches, &mut rows);
        Ok(rows)
    }

    fn preferred_batch_len(&self) -> usize {
        self.rows.preferred_batch_len()
    }

    fn fingerprint(&self) -> String {
        format!("{}, near {}", self.rows.fingerprint(), self.near.reach)
    }
}

impl Near {
    /// Mends one row and says what share of it went elsewhere.
    fn mend(&self, mesh: &Mesh, patch: NodeId, row: &mut Row) -> f64 {
        let (polygon, normal) = (mesh.corners(patch), mesh.normal(patch));
        let around = Sphere::around(mesh, patch);
        let (mut near_before, mut near_after) = (0.0, 0.0);
        let mut mended: Vec<(usize, f64)> = vec![];
        for (k, entry) in row.entries.iter().enumerate() {
            let sphere = self.spheres[entry.element as usize];
            if sphere.gap(&around) > self.reach * 2.0 * around.radius * TIE {
                continue;
            }
            let element = mesh.element(entry.element as usize);
            let from_centroid = point_to_polygon(around.centre, normal, &mesh.corners(element));
            let back = point_to_polygon(sphere.centre, mesh.normal(element), &polygon);
            let from_all = back * mesh.area(element) / mesh.area(patch);
            let before = Row::form_factor(entry.share);
            let after = before * from_all / from_centroid;
            if after.is_finite() {
                near_before += before;
                near_after += after;
                mended.push((k, after));
            }
        }
        if mended.is_empty() || near_after >= 1.0 || near_before >= 1.0 {
            return 0.0;
        }
        let far = (1.0 - near_after) / (1.0 - near_before);
        let shares = row.entries.iter().map(|e| e.share).chain([row.escaped, row.backface]);
        let before: Vec<f64> = shares.map(Row::form_factor).collect();
        let mut after: Vec<f64> = before.iter().map(|f| f * far).collect();
        mended.into_iter().for_each(|(k, factor)| after[k] = factor);
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

    /// A lower bound on the distance between what is in the two.
    fn gap(&self, other: &Sphere) -> f64 {
        self.centre.distance(other.centre) - self.radius - other.radius
    }
}
