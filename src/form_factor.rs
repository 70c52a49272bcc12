//! Form factors of patches, row by row: the contract between what makes rows and what uses them.
//!
//! ```text
//! row source        RayRows, HemicubeRows, your own: a patch seen from its centroid
//!   └ ProximityCorrection   near receivers: closed forms of the whole patch
//!       └ AdaptiveViewpoints   occluders that split a patch: the mean of what its parts see
//!           └ Solver, view factors: checked rows
//! ```
//!
//! Each layer is a [`FormFactors`] again; any of them can be left out. Sources stand in
//! [`backend`](crate::backend); here are the contract, the layers that know no backend, the closed
//! forms, and the policy that gives rows as many samples as their light is worth.

pub mod closed_form;
pub(crate) mod proximity;
pub(crate) mod resolution_policy;
mod row;
mod shared;
pub(crate) mod viewpoints;

use crate::error::{Error, ErrorKind};
use crate::mesh::{Mesh, NodeId};
pub use proximity::ProximityCorrection;
pub use row::{Entry, Row};
pub use shared::SharedRows;
pub use viewpoints::AdaptiveViewpoints;

/// A source of rows: hemicubes on a GPU, rays on the CPU, closed forms.
///
/// **What a source must do.** It returns one row for each patch that is asked for, in that order,
/// each of which passes [`Row::check`]. A row depends on the mesh, the patch, the source's settings
/// (what [`FormFactors::fingerprint`] names) and the weight alone: not on what was asked for
/// before, nor on the other patches of the batch. So a row can be thrown away and made again with
/// the same bits, and a solve can be saved and resumed. Bits may differ between devices.
///
/// **What a user does.** It asks for patches of the mesh that the source was made for, some
/// [`FormFactors::preferred_batch_len`] at once; any number is allowed. Rows are checked where they
/// are used: the solver, the view factors and the layers of this module return an error for a row
/// that breaks its contract. An error leaves the source usable: the same or other patches can be
/// asked for again.
pub trait FormFactors {
    /// The rows of `patches`, in their order.
    ///
    /// `weight` says what is at stake: the largest share of the emitted flux, in [0, 1] and of
    /// the worst channel, that one of `patches` is about to shoot. A source may use fewer samples
    /// for rows of little weight; 1 asks for all it can do.
    ///
    /// # Errors
    /// What keeps the source from making them, [`ErrorKind::Device`] above all.
    fn rows(&mut self, mesh: &Mesh, patches: &[NodeId], weight: f64) -> Result<Vec<Row>, Error>;

    /// How many rows are best asked for at once, 1 or more.
    fn preferred_batch_len(&self) -> usize {
        1
    }

    /// Everything that the bits of its rows depend on beside mesh, patch and weight, in words:
    /// a saved solve is resumed only with rows of the same fingerprint.
    fn fingerprint(&self) -> String {
        "rows".into()
    }
}

/// The rows of `patches` by `source`, one each, every one of which keeps its contract.
///
/// # Errors
/// [`ErrorKind::FormFactor`] when one does not, or there are too few or too many; those of
/// `source`.
pub(crate) fn checked_rows(
    source: &mut (impl FormFactors + ?Sized),
    mesh: &Mesh,
    patches: &[NodeId],
    weight: f64,
) -> Result<Vec<Row>, Error> {
    let rows = source.rows(mesh, patches, weight)?;
    if rows.len() != patches.len() {
        let found = format!("{} rows for {} patches", rows.len(), patches.len());
        let remedy = "FormFactors::rows must return one row a patch";
        return Err(Error::new(ErrorKind::FormFactor, "form factors", found, remedy));
    }
    for (&patch, row) in patches.iter().zip(&rows) {
        row.check(mesh, patch)?;
    }
    Ok(rows)
}
