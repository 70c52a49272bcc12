//! Settings of a solve, automatic choice of the method, and the solve itself.

use std::ops::ControlFlow;

use super::flux_state::ReceivedLight;
use super::{Method, Progress, Solution, SolveSession};
use crate::error::{Error, ErrorKind};
use crate::form_factor::FormFactors;
use crate::mesh::Mesh;

/// Method of light distribution and stop rules. [`Solver::default`] shoots to 0.1 % unshot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solver {
    /// The method.
    pub method: Method,
    /// Stops when no channel has more than this share of its emitted flux unshot, in [0, 1]. The
    /// resulting error of the radiosity is at most this × emitted flux / (1 − ρ) in total, ρ the
    /// highest reflectance.
    pub unshot: f64,
    /// Stops after this many steps of the [`Method`]; for shooting, shots.
    pub max_steps: Option<u64>,
    /// Bytes for cached rows; those that do not fit are recomputed.
    pub row_memory: usize,
    /// For shooting: maximum estimated error of a patch that shoots along one row, seen from one
    /// viewpoint: √s q, where s is the share of the emitted light that it carries and q the share
    /// of this that is misplaced, estimated from its size, the distance of its receivers and the
    /// unevenness of its light; more for a patch next to a contact, whose light would all go to a
    /// spot there. Patches are as large as this permits, from clusters of many triangles down to
    /// elements. 0 makes every patch as small as `min_patch_level` allows. Elements of emitters
    /// shoot separately where they are few. Rows are assumed to be correct for near receivers: see
    /// [`ProximityCorrection`](crate::form_factor::ProximityCorrection).
    pub patch_tolerance: f64,
    /// For shooting: the smallest patches are this many quadtree levels above the elements: 4ᵏ
    /// elements, or a triangle.
    pub min_patch_level: u32,
}

impl Default for Solver {
    /// Shooting, without overshoot.
    fn default() -> Solver {
        Solver::new(Method::Shooting { overshoot: false })
    }
}

impl Solver {
    /// Maximum number of elements for [`Method::Direct`]: its matrix has 24 bytes per entry, 400 MB
    /// in total.
    pub const DIRECT_MAX_ELEMENTS: usize = 4096;

    /// `method`, to 0.1 % unshot with a GiB of rows and a patch tolerance of 0.004.
    pub fn new(method: Method) -> Solver {
        Solver {
            method,
            unshot: 1e-3,
            max_steps: None,
            row_memory: 1 << 30,
            patch_tolerance: 4e-3,
            min_patch_level: 0,
        }
    }

    /// Chooses the method for `mesh` by its size and its mean reflectance (by area, the highest
    /// channel), with the settings of [`Solver::new`]:
    ///
    /// 1. direct, for up to 512 elements: a tenth of a second;
    /// 2. else GMRES, from a reflectance of 0.9 if all rows fit in memory even when dense (8 bytes
    ///    for each pair of elements): shooting would follow some 70 bounces, where GMRES takes some
    ///    10 products; from 0.997 if rows must be recomputed for every product: 2 300 bounces;
    /// 3. else shooting.
    pub fn for_mesh(mesh: &Mesh) -> Solver {
        let [shooting, _, _, _, gmres, direct] = Method::ALL.map(Solver::new);
        let reflectance = mesh.mean_albedo().max_element();
        let count = mesh.element_count();
        let all_fit = count.saturating_mul(count).saturating_mul(8) <= gmres.row_memory;
        let bright = if all_fit { 0.9 } else { 0.997 };
        if count <= 512 {
            direct
        } else if reflectance >= bright {
            gmres
        } else {
            shooting
        }
    }

    /// Distributes the light that `mesh` emits, with rows from `form_factors`.
    ///
    /// `progress` is called for every row that is computed or that light is sent along, and may
    /// stop the solver; the solution so far is returned. Its ledger balances at any time.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when `unshot` is not in [0, 1], a setting of the method is out of
    /// range or the mesh too large for it; [`ErrorKind::Scene`] when the emitted flux is not
    /// finite; [`ErrorKind::FormFactor`] when a row breaks its contract; all errors of
    /// `form_factors`.
    pub fn solve(
        &self,
        mesh: &Mesh,
        form_factors: &mut dyn FormFactors,
        progress: impl FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Solution, Error> {
        let mut session = self.begin(mesh)?;
        session.run(form_factors, progress)?;
        session.into_solution()
    }

    /// A session over `mesh` in which no flux is shot yet.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when `unshot` is not in [0, 1], a setting of the method is out of
    /// range or the mesh too large for it; [`ErrorKind::Scene`] when the emitted flux is not
    /// finite.
    pub fn begin<'m>(&self, mesh: &'m Mesh) -> Result<SolveSession<'m>, Error> {
        self.begin_after(mesh, &ReceivedLight::default())
    }

    /// As [`Solver::begin`], for elements that have `received` light already.
    pub(crate) fn begin_after<'m>(
        &self,
        mesh: &'m Mesh,
        received: &ReceivedLight,
    ) -> Result<SolveSession<'m>, Error> {
        self.check()?;
        let (count, max) = (mesh.element_count(), Solver::DIRECT_MAX_ELEMENTS);
        if self.method == Method::Direct && count > max {
            let remedy = format!("at most {max}: use another method, such as gmres");
            let found = format!("{count} elements");
            return Err(Error::new(ErrorKind::Setting, "direct solve", found, remedy));
        }
        SolveSession::new(*self, mesh, received)
    }

    /// Whether all settings are in range.
    pub(super) fn check(&self) -> Result<(), Error> {
        let wrong = |place: String, found: &str, remedy: &str| {
            Err(Error::new(ErrorKind::Setting, place, found, remedy))
        };
        let Solver { method, unshot, patch_tolerance, .. } = *self;
        if !(0.0..=1.0).contains(&unshot) {
            return wrong(format!("unshot share {unshot}"), "out of range", "use 0 to 1");
        }
        match method {
            Method::Shooting { .. } if patch_tolerance.is_nan() || patch_tolerance < 0.0 => {
                wrong(format!("tolerance {patch_tolerance}"), "below 0", "use 0 or more")
            }
            Method::Gmres { restart: 0 } => {
                wrong("restart 0".into(), "no product", "use 1 or more products a cycle")
            }
            _ => Ok(()),
        }
    }
}
