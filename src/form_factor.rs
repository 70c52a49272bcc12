//! Form factors of patches, row by row: the contract between row sources and their users.
//!
//! ```text
//! row source        RayRows, HemicubeRows, your own: a patch seen from its centroid
//!   └ ProximityCorrection   near receivers: closed forms of the whole patch
//!       └ Solver, view factors: checked rows
//! ```
//!
//! Each layer is a [`FormFactors`] again and can be omitted. Sources are in
//! [`backend`](crate::backend); here are the contract, the layers that are independent of the
//! backend, the closed forms, and the policy that sets the number of samples of a row by its light.

pub mod closed_form;
pub(crate) mod proximity;
pub(crate) mod resolution_policy;
mod row;

use crate::error::{Error, ErrorKind};
use crate::mesh::{Mesh, NodeId};
pub use proximity::ProximityCorrection;
pub use row::{Entry, Row};

/// A source of rows: hemicubes on a GPU, rays on the CPU, closed forms.
///
/// **Requirements on a source.** It returns one row for each requested patch, in that order, each
/// of which passes [`Row::check`]. A row depends only on the mesh, the patch, the source's settings
/// (described by [`FormFactors::fingerprint`]) and the weight: not on earlier requests, nor on the
/// other patches of the batch. So a row can be discarded and recomputed with the same bits, and a
/// solve can be saved and resumed. Bits may differ between devices.
///
/// **Requirements on a user.** It requests patches of the mesh that the source was made for, some
/// [`FormFactors::preferred_batch_len`] at once; any number is allowed. Rows are checked where they
/// are used: the solver, the view factors and the layers of this module return an error for a row
/// that breaks its contract. An error leaves the source usable: the same or other patches can be
/// requested again.
pub trait FormFactors {
    /// The rows of `patches`, in their order.
    ///
    /// `weight` is the importance of the rows: the largest share of the emitted flux, in [0, 1] and
    /// of the worst channel, that one of `patches` is about to shoot. A source may use fewer
    /// samples for rows of little weight; 1 requests the maximum.
    ///
    /// # Errors
    /// Errors of the source, mainly [`ErrorKind::Device`].
    fn rows(&mut self, mesh: &Mesh, patches: &[NodeId], weight: f64) -> Result<Vec<Row>, Error>;

    /// Preferred number of rows per request, ≥ 1.
    fn preferred_batch_len(&self) -> usize {
        1
    }

    /// Text that identifies all that the bits of its rows depend on beside mesh, patch and weight:
    /// a saved solve is resumed only with rows of the same fingerprint.
    fn fingerprint(&self) -> String {
        "rows".into()
    }
}

/// The rows of `patches` by `source`, one each, checked for their contract.
///
/// # Errors
/// [`ErrorKind::FormFactor`] when a row breaks it, or the number of rows is wrong; those of
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
