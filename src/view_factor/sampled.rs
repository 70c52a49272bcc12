//! View factors from form-factor rows: hemicubes or rays, as many as there are elements.

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use super::{Estimate, Factor, Missing, ViewFactors};
use crate::error::Error;
use crate::form_factor::{FormFactors, Row, checked_rows};
use crate::mesh::{Mesh, NodeId};

/// Sums of one row: by elements, and by the coarser elements that these are parts of.
#[derive(Clone, Copy, Default)]
struct Sum {
    fine: f64,
    coarse: f64,
}

impl Sum {
    fn add(&mut self, share: u32, fine: f64, coarse: f64) {
        self.fine += fine * Row::form_factor(share);
        self.coarse += coarse * Row::form_factor(share);
    }

    /// Elements are four to a coarser one, the middle one of them seen from the same point. If the
    /// errors of the four are independent and alike, the difference of the two means has three
    /// times the variance of the finer mean.
    fn estimate(self, area: f64) -> Estimate {
        let error = (self.fine - self.coarse).abs() / 3f64.sqrt();
        Estimate { value: self.fine, error }.over(area)
    }
}

#[derive(Clone, Default)]
struct Sums {
    factors: BTreeMap<u32, Sum>,
    open: Sum,
    back: Sum,
    area: f64,
}

impl ViewFactors {
    /// Averages the rows of all elements of `mesh` over their groups, weighted by area: for scenes
    /// too large for [`ViewFactors::new`]. `progress` is told elements done and elements in all, and
    /// may cancel: then there is no matrix.
    ///
    /// Each element is seen from its centroid: elements must be small against the distance to what
    /// they see, or the error is that of the proximity assumption (Baum, Rushmeier, Winget 1989).
    /// The standard error is judged by leaving out three elements of four; triangles that are not
    /// divided leave nothing to judge by and count as all error.
    ///
    /// # Errors
    /// Whatever `form_factors` fails with, or a row that breaks its contract.
    pub fn sampled(
        mesh: &Mesh,
        form_factors: &mut dyn FormFactors,
        mut progress: impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<Option<ViewFactors>, Error> {
        let scene = mesh.scene();
        let group = |node: NodeId| scene.triangles()[mesh.triangle(node)].group;
        let mut sums = vec![Sums::default(); scene.groups().len()];
        let coarse = coarse_areas(mesh);
        let elements: Vec<NodeId> = (0..mesh.element_count()).map(|e| mesh.element(e)).collect();
        let mut done = 0;
        for batch in elements.chunks(form_factors.preferred_batch_len().max(1)) {
            for (row, &from) in checked_rows(form_factors, mesh, batch, 1.0)?.iter().zip(batch) {
                let (fine, coarse) = (mesh.area(from), coarse[done]);
                let sum = &mut sums[group(from) as usize];
                for entry in &row.entries {
                    let to = group(mesh.element(entry.element as usize));
                    sum.factors.entry(to).or_default().add(entry.share, fine, coarse);
                }
                sum.open.add(row.escaped, fine, coarse);
                sum.back.add(row.backface, fine, coarse);
                sum.area += fine;
                done += 1;
            }
            if progress(done, elements.len()).is_break() {
                return Ok(None);
            }
        }
        let factors = |sum: &Sums| -> Vec<Factor> {
            let factor = |(&to, s): (&u32, &Sum)| {
                let Estimate { value, error } = s.estimate(sum.area);
                Factor { to, value, error }
            };
            sum.factors.iter().map(factor).collect()
        };
        Ok(Some(ViewFactors {
            names: scene.groups().to_vec(),
            areas: sums.iter().map(|s| s.area).collect(),
            factors: sums.iter().map(factors).collect(),
            open: sums.iter().map(|s| s.open.estimate(s.area)).collect(),
            back: sums.iter().map(|s| s.back.estimate(s.area)).collect(),
            absent: Missing::NotSeen,
        }))
    }
}

/// Per element, the area it stands for when of every four siblings only the middle one is seen
/// from.
fn coarse_areas(mesh: &Mesh) -> Vec<f64> {
    let mut areas = vec![0.0; mesh.element_count()];
    let mut open: Vec<NodeId> = (0..mesh.scene().triangles().len()).map(|t| mesh.root(t)).collect();
    while let Some(node) = open.pop() {
        let Some(children) = mesh.children(node) else { continue };
        let last = children[3];
        if children.iter().all(|&child| mesh.children(child).is_none()) {
            areas[mesh.elements_of(last).start] = mesh.area(node);
        }
        open.extend(children);
    }
    areas
}
