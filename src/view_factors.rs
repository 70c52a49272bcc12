//! View factors between whole groups, as heat transfer means them.

use crate::error::Error;
use crate::form_factor::{FormFactors, Row};
use crate::mesh::{Mesh, NodeId};
use crate::solve::Go;

/// The matrix of area-averaged form factors between the groups of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewFactors {
    /// Names of the groups, in the order of rows and columns.
    pub names: Vec<String>,
    /// Area of each group, length unit squared.
    pub areas: Vec<f64>,
    /// `factors[i][j]`: fraction of the flux leaving group i that arrives at fronts of group j.
    pub factors: Vec<Vec<f64>>,
    /// Fraction of the flux leaving group i that meets nothing.
    pub open: Vec<f64>,
    /// Fraction of the flux leaving group i that meets the back of a surface.
    pub back: Vec<f64>,
}

impl ViewFactors {
    /// Averages the rows of all elements of `mesh` over their groups, weighted by area. `progress`
    /// is told elements done and elements in all, and may cancel: then there is no matrix.
    ///
    /// Each element is seen from its centroid: elements must be small against the distance to what
    /// they see, or the error is that of the proximity assumption (Baum, Rushmeier, Winget 1989).
    ///
    /// # Errors
    /// Whatever `form_factors` fails with, or a row that breaks its contract.
    pub fn new(
        mesh: &Mesh,
        form_factors: &mut dyn FormFactors,
        mut progress: impl FnMut(usize, usize) -> Go,
    ) -> Result<Option<ViewFactors>, Error> {
        let scene = mesh.scene();
        let count = scene.groups().len();
        let group = |node: NodeId| scene.triangles()[mesh.triangle(node)].group as usize;
        let mut sums = ViewFactors {
            names: scene.groups().to_vec(),
            areas: vec![0.0; count],
            factors: vec![vec![0.0; count]; count],
            open: vec![0.0; count],
            back: vec![0.0; count],
        };
        let elements: Vec<NodeId> = (0..mesh.element_count()).map(|e| mesh.element(e)).collect();
        let mut done = 0;
        for batch in elements.chunks(form_factors.batch().max(1)) {
            for (row, &from) in form_factors.rows(mesh, batch)?.iter().zip(batch) {
                row.check(mesh, from)?;
                let (i, area) = (group(from), mesh.area(from));
                for entry in &row.entries {
                    let to = group(mesh.element(entry.element as usize));
                    sums.factors[i][to] += area * Row::form_factor(entry.share);
                }
                sums.open[i] += area * Row::form_factor(row.open);
                sums.back[i] += area * Row::form_factor(row.back);
                sums.areas[i] += area;
            }
            done += batch.len();
            if progress(done, elements.len()).is_break() {
                return Ok(None);
            }
        }
        for i in 0..count {
            let area = sums.areas[i];
            let shares = sums.factors[i].iter_mut().chain([&mut sums.open[i], &mut sums.back[i]]);
            shares.for_each(|share| *share /= area);
        }
        Ok(Some(sums))
    }
}
