//! View factors from form-factor rows: hemicubes or rays, one row per element.
//!
//! F of a group is the mean of the rows of its elements, weighted by area. The error is estimated
//! by leaving out three of every four sibling elements:
//!
//! ```text
//!     ╱╲          the middle one of four siblings is seen from the same point as the triangle
//!    ╱──╲         they divide; the mean over middle ones alone, with four times the area, is
//!   ╱╲╱╲╱╲        that of a mesh half as fine
//! ```

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use super::matrix::{Estimate, Factor, Missing, ViewFactors};
use crate::error::Error;
use crate::form_factor::{FormFactors, Row, checked_rows};
use crate::mesh::{Mesh, NodeId};

/// Sum of one factor over the elements of a group, and over the coarser elements that contain them.
/// In squares of the scene's length unit.
#[derive(Clone, Copy, Default)]
struct FactorSum {
    fine: f64,
    coarse: f64,
}

impl FactorSum {
    fn add(&mut self, share: u32, fine_area: f64, coarse_area: f64) {
        self.fine += fine_area * Row::form_factor(share);
        self.coarse += coarse_area * Row::form_factor(share);
    }

    /// Four elements form a coarser one, whose viewpoint is that of the middle one. If the errors
    /// of the four are independent and have the same distribution, the difference of the two means
    /// has three times the variance of the finer mean.
    fn estimate(self, area: f64) -> Estimate {
        let error = (self.fine - self.coarse).abs() / 3f64.sqrt();
        Estimate { value: self.fine, error }.over(area)
    }
}

/// Sums over the elements of one group.
#[derive(Clone, Default)]
struct GroupSums {
    factors: BTreeMap<u32, FactorSum>,
    open: FactorSum,
    back: FactorSum,
    area: f64,
}

impl GroupSums {
    /// The row of the group.
    fn factors(&self) -> Vec<Factor> {
        let mut row = Vec::with_capacity(self.factors.len());
        for (&to, sum) in &self.factors {
            let Estimate { value, error } = sum.estimate(self.area);
            row.push(Factor { to, value, error });
        }
        row
    }
}

/// [`ViewFactors::sampled`].
pub(super) fn sample(
    mesh: &Mesh,
    form_factors: &mut dyn FormFactors,
    mut progress: impl FnMut(usize, usize) -> ControlFlow<()>,
) -> Result<Option<ViewFactors>, Error> {
    let scene = mesh.scene();
    let group = |node: NodeId| scene.triangles()[mesh.triangle(node)].group;
    let mut sums = vec![GroupSums::default(); scene.groups().len()];
    let coarse_areas = coarse_areas(mesh);
    let elements: Vec<NodeId> = (0..mesh.element_count()).map(|e| mesh.element(e)).collect();
    let mut done = 0;
    for batch in elements.chunks(form_factors.preferred_batch_len().max(1)) {
        for (row, &from) in checked_rows(form_factors, mesh, batch, 1.0)?.iter().zip(batch) {
            let (fine, coarse) = (mesh.solid_area(from), coarse_areas[done]);
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
    Ok(Some(ViewFactors {
        names: scene.groups().to_vec(),
        areas: sums.iter().map(|s| s.area).collect(),
        factors: sums.iter().map(GroupSums::factors).collect(),
        open: sums.iter().map(|s| s.open.estimate(s.area)).collect(),
        back: sums.iter().map(|s| s.back.estimate(s.area)).collect(),
        absent: Missing::NotSeen,
    }))
}

/// Per element, the area that it represents when of every four siblings only the middle one has a
/// row.
fn coarse_areas(mesh: &Mesh) -> Vec<f64> {
    let mut areas = vec![0.0; mesh.element_count()];
    let mut stack: Vec<NodeId> =
        (0..mesh.scene().triangles().len()).map(|t| mesh.root(t)).collect();
    while let Some(node) = stack.pop() {
        let Some(children) = mesh.children(node) else { continue };
        // The middle child is the last.
        let middle = children[3];
        if children.iter().all(|&child| mesh.children(child).is_none()) {
            areas[mesh.elements_of(middle).start] = mesh.solid_area(node);
        }
        stack.extend(children);
    }
    areas
}
