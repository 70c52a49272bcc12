//! A row maker for scenes without occluders.

use radiosity::form_factor::closed_form::{point_to_polygon, polygon_to_polygon};
use radiosity::form_factor::{Entry, Row};
use radiosity::mesh::NodeId;
use radiosity::{Error, FormFactors, Mesh};

/// Rows of closed forms, for scenes without occluders: exact, from all of the patch's area, or
/// as a hemicube without pixels would see them, from the patch's centroid.
pub struct ClosedForms {
    from_centroid: bool,
    /// Rows made so far.
    pub made: u64,
}

pub fn exact() -> ClosedForms {
    ClosedForms { from_centroid: false, made: 0 }
}

pub fn from_centroid() -> ClosedForms {
    ClosedForms { from_centroid: true, made: 0 }
}

impl FormFactors for ClosedForms {
    fn rows(&mut self, mesh: &Mesh, patches: &[NodeId], _: f64) -> Result<Vec<Row>, Error> {
        self.made += patches.len() as u64;
        let row = |&patch: &NodeId| {
            let (polygon, eye, n) = (mesh.corners(patch), mesh.centroid(patch), mesh.normal(patch));
            let factor = |e: usize| {
                let to = mesh.corners(mesh.element(e));
                match self.from_centroid {
                    true => point_to_polygon(eye, n, &to),
                    false => polygon_to_polygon(&polygon, &to),
                }
            };
            // Rounded by the running sum: the row is off by half a share, whatever its length.
            let (mut sum, mut given) = (0.0f64, 0);
            let mut entries = vec![];
            for e in 0..mesh.element_count() {
                sum += factor(e);
                let upto = (sum * f64::from(Row::TOTAL)).round() as u32;
                if upto > given {
                    entries.push(Entry { element: e as u32, share: upto - given });
                    given = upto;
                }
            }
            Row { entries, escaped: Row::TOTAL - given, ..Row::default() }
        };
        Ok(patches.iter().map(row).collect())
    }

    fn preferred_batch_len(&self) -> usize {
        4
    }
}
