//! View factors between whole groups of surfaces, as used in heat transfer.
//!
//! F_ij is the fraction of the flux leaving group i that arrives at fronts of group j, averaged
//! over the area of i. Of a two-sided group the front and the back are a row each
//! ([`MatrixRows`]). There are two methods; [`ViewFactors::new`] selects one by the predicted
//! time of the first:
//!
//! ```text
//! ViewFactors::exact     error far below the requested one; time ~ polygons², and more with many
//!                        blockers between
//!   coplanar triangles ─→ convex polygons ─→ each pair once
//!     unoccluded     closed form (contour integral), or Gauss cubature where far
//!     occluded       adaptive cubature over one of the two: at each point Lambert's formula over
//!                    the other, less the shadows of all blockers; blockers from a shaft around
//!                    the pair; cells cut along visual events
//!
//! ViewFactors::sparse    with the requested error; time ~ polygons, and pairs that see one
//!                        another
//!   rays from each polygon ─→ pairs that matter
//!     small          the count of rays
//!     others         the cheapest of shadow rays, closed forms, or visible parts from points
//! ```
//!
//! [`ViewFactors::checks`] measures closure, reciprocity and bounds of any matrix, and
//! [`ViewFactors::enforced`] makes a matrix that satisfies them. Files: [`crate::io`].

mod assembler;
mod backs_met;
mod blocker_tree;
mod checks;
mod convex_polygons;
mod cubature;
mod effort;
mod enforcement;
mod fronts;
mod known_blockers;
mod matrix;
mod matrix_rows;
mod pair_estimate;
mod pair_visibility;
mod partial_matrix;
mod point_visibility;
mod polygon_points;
mod ray_rows;
mod scene_polygons;
mod shadow_rays;
mod shaft;
mod sparse;
mod tolerances;
mod unoccluded;
mod visible_mean;
mod visual_events;

use std::ops::{ControlFlow, Range};

use self::assembler::Assembler;
use self::partial_matrix::{Making, Method};
use self::scene_polygons::ScenePolygons;
use crate::error::{Error, ErrorKind};
use crate::scene::Scene;

pub use self::backs_met::{BackMet, backs_met};
pub use self::checks::{ErrorStats, MatrixChecks};
pub use self::enforcement::EnforcementReport;
pub use self::matrix::{Estimate, Factor, MatrixSize, Missing, ViewFactors};
pub use self::matrix_rows::MatrixRows;
pub(crate) use self::matrix_rows::are_sides;
pub use self::partial_matrix::PartialMatrix;

impl ViewFactors {
    /// The matrix of `scene` with two absolute standard errors of at most `error` on every factor,
    /// or far smaller ones: [`ViewFactors::exact`] unless that would take minutes, else
    /// [`ViewFactors::sparse`]. [`ViewFactors::absent`] tells the two apart. Of several processes
    /// ([`crate::work`]) the first has the matrix, and others none.
    ///
    /// The time is predicted from cubature of up to a few thousand pairs.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when `error` is not in (0, 1) or a group does not exist.
    pub fn new(
        scene: &Scene,
        error: f64,
        two_sided: &[usize],
        progress: impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<Option<ViewFactors>, Error> {
        whole(scene, error, two_sided, None, progress)
    }

    /// Approximate size of the matrix that [`ViewFactors::new`] makes: estimated from the rays of
    /// some polygons where it is sparse, all pairs as an upper bound where it is exact. Takes some
    /// seconds.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when `error` is not in (0, 1) or a group does not exist.
    pub fn predicted_size(
        scene: &Scene,
        error: f64,
        two_sided: &[usize],
    ) -> Result<MatrixSize, Error> {
        check_settings(scene, error, two_sided)?;
        let polygons = ScenePolygons::new(scene, two_sided);
        if effort::method(&polygons, error) == Method::Sparse {
            return Ok(sparse::predicted_size(scene, polygons, error));
        }
        let factors = polygons.fronts.rows.count().pow(2);
        // Measured: 28 to 34 bytes for cubes with a box inside.
        Ok(MatrixSize { factors, bytes: 35 * factors })
    }

    /// The matrix of `scene` with an absolute standard error well below `error` on every factor.
    ///
    /// Groups with an index in `two_sided` emit and receive on both sides, and have a row for each:
    /// the backs come after all groups, in their order. `progress` is called
    /// with the number of convex polygons done and their total, and may cancel: then there is no
    /// matrix. The result has the same bits on every run.
    ///
    /// Coplanar triangles become convex polygons. Unoccluded pairs are exact: the contour integral
    /// of Schröder and Hanrahan (1993), see
    /// [`crate::form_factor::closed_form::polygon_to_polygon`]; error 1e-13, or 6e-8 of the factor
    /// where they are more than 8 radii apart. Of an occluded pair, one polygon is cut into
    /// triangles. Radon's seven-point rule integrates over each triangle the form factor from a
    /// point to the visible part of the other polygon, which is exact: Lambert's formula (1760)
    /// over the polygon less the shadows of all blockers. Triangles are cut until rules of
    /// different degree agree; the reported error is the change due to the last cuts. Reciprocity
    /// A_i F_ij = A_j F_ji holds to rounding, since every pair is computed once.
    ///
    /// Time grows with the square of the number of polygons, and with the number of blockers.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when `error` is not in (0, 1) or a group does not exist.
    pub fn exact(
        scene: &Scene,
        error: f64,
        two_sided: &[usize],
        progress: impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<Option<ViewFactors>, Error> {
        whole(scene, error, two_sided, Some(Method::Exact), progress)
    }

    /// The matrix of many polygons that each see few others: with two absolute standard errors of
    /// at most `error` on every factor, where the limits on points and rays of a pair allow it.
    ///
    /// Rays from every polygon determine which polygons see each other. A pair is estimated if a
    /// ray of either has hit the other, by the cheapest method that is accurate enough: the count
    /// of rays, shadow rays, a closed form, or the visible part of one from points of the other.
    /// Pairs that no ray has hit are left out ([`Missing::Unmet`]): by far most of their factors
    /// are below `error`. `open` is the remainder of the row. `progress` and `two_sided` are those
    /// of [`ViewFactors::exact`]. The result has the same bits on every run, for any number of
    /// threads.
    ///
    /// Where two surfaces coincide, rays hit one of them: sums of rows do not show this.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when `error` is not in (0, 1) or a group does not exist.
    pub fn sparse(
        scene: &Scene,
        error: f64,
        two_sided: &[usize],
        progress: impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<Option<ViewFactors>, Error> {
        whole(scene, error, two_sided, Some(Method::Sparse), progress)
    }

    /// The rows `from` of the exact matrix: a reference for another matrix.
    ///
    /// Settings, errors and `progress` (called with rows) are those of [`ViewFactors::exact`].
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when `error` is not in (0, 1) or a group does not exist.
    pub fn exact_rows(
        scene: &Scene,
        error: f64,
        two_sided: &[usize],
        from: &[usize],
        mut progress: impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<Option<Vec<Vec<Factor>>>, Error> {
        check_settings(scene, error, two_sided)?;
        let polygons = ScenePolygons::new(scene, two_sided);
        let count = polygons.fronts.rows.count();
        if let Some(row) = from.iter().find(|row| **row >= count) {
            let remedy = format!("the matrix has {count} rows");
            return Err(Error::new(ErrorKind::Setting, "row", row.to_string(), remedy));
        }
        let assembler = Assembler::new(polygons, error);
        let mut rows = Vec::with_capacity(from.len());
        for &group in from {
            rows.push(assembler.whole_row(group));
            if progress(rows.len(), from.len()).is_break() {
                return Ok(None);
            }
        }
        Ok(Some(rows))
    }
}

impl PartialMatrix {
    /// Computes those rows `wanted` that are not in `done`, of the matrix that
    /// [`ViewFactors::new`] makes with these settings, and returns them with those of `done`.
    ///
    /// `progress` is
    /// called with the rows done, the number of polygons done and their total, and may stop the
    /// work: the rows done so far are returned. Of several processes the first has the rows.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when `error` is not in (0, 1), a group or a row does not exist, or
    /// `done` belongs to another scene or other settings.
    pub fn make(
        scene: &Scene,
        error: f64,
        two_sided: &[usize],
        wanted: Range<usize>,
        done: Option<PartialMatrix>,
        mut progress: impl FnMut(&PartialMatrix, usize, usize) -> ControlFlow<()>,
    ) -> Result<PartialMatrix, Error> {
        check_settings(scene, error, two_sided)?;
        let polygons = ScenePolygons::new(scene, two_sided);
        let count = polygons.fronts.rows.count();
        if wanted.start > wanted.end || wanted.end > count {
            let found = format!("{}..{}", wanted.start, wanted.end);
            let remedy = format!("the matrix has {count} rows, from 0");
            return Err(Error::new(ErrorKind::Setting, "rows", found, remedy));
        }
        let method = effort::method(&polygons, error);
        let mut part = PartialMatrix::none(scene, error, two_sided, method, &polygons);
        if let Some(done) = done {
            part.check_fits(&done, "rows that are done")?;
            part = done;
        }
        Ok(with_rows(part, scene, polygons, error, wanted, &mut progress).0)
    }
}

/// The whole matrix by `method`, or by the one that is faster, or `None` if `progress` stops it.
fn whole(
    scene: &Scene,
    error: f64,
    two_sided: &[usize],
    method: Option<Method>,
    mut progress: impl FnMut(usize, usize) -> ControlFlow<()>,
) -> Result<Option<ViewFactors>, Error> {
    check_settings(scene, error, two_sided)?;
    let polygons = ScenePolygons::new(scene, two_sided);
    let method = method.unwrap_or_else(|| effort::method(&polygons, error));
    let part = PartialMatrix::none(scene, error, two_sided, method, &polygons);
    let all = 0..polygons.fronts.rows.count();
    let mut told = |_: &PartialMatrix, done, of| progress(done, of);
    let (part, is_done) = with_rows(part, scene, polygons, error, all, &mut told);
    Ok(if is_done { part.into_matrix().ok() } else { None })
}

/// `part` with the rows `wanted` added, and whether the work was completed.
fn with_rows(
    part: PartialMatrix,
    scene: &Scene,
    polygons: ScenePolygons,
    error: f64,
    wanted: Range<usize>,
    progress: &mut dyn FnMut(&PartialMatrix, usize, usize) -> ControlFlow<()>,
) -> (PartialMatrix, bool) {
    let wanted = part.polygons_without_rows(wanted);
    let mut making = Making { part, progress };
    let done = match making.part.method() {
        Method::Exact => assembler::make(polygons, error, &wanted, &mut making),
        Method::Sparse => sparse::make(scene, polygons, error, &wanted, &mut making),
    };
    (making.part, done.is_some())
}

/// Whether `error` and `two_sided` are valid settings of [`ViewFactors::new`].
fn check_settings(scene: &Scene, error: f64, two_sided: &[usize]) -> Result<(), Error> {
    if !(error > 0.0 && error < 1.0) {
        let remedy = "it must be in (0, 1)";
        return Err(Error::new(ErrorKind::Setting, "error", error.to_string(), remedy));
    }
    check_two_sided(scene, two_sided)
}

/// Whether these groups are in `scene`.
fn check_two_sided(scene: &Scene, two_sided: &[usize]) -> Result<(), Error> {
    let groups = scene.groups().len();
    match two_sided.iter().find(|group| **group >= groups) {
        None => Ok(()),
        Some(group) => {
            let remedy = format!("the scene has {groups} groups");
            Err(Error::new(ErrorKind::Setting, "two-sided group", group.to_string(), remedy))
        }
    }
}
