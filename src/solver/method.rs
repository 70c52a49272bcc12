//! One interface to all methods, and the rule that picks one.

use std::fmt;
use std::ops::ControlFlow;
use std::str::FromStr;

use super::flux_state::FluxState;
use super::row_cache::RowCache;
use super::session::{Counters, MethodState, SolveSession};
use super::{MAX_DIRECT, Progress, Shooting, Solution};
use crate::error::{Error, ErrorKind};
use crate::form_factor::FormFactors;
use crate::mesh::Mesh;
use crate::scene::Rgb;

/// How light is spread. All methods solve the same equations to the same share of unshot flux; all but
/// shooting from patches larger than elements make, or keep, a row for every element that has light.
///
/// | method | a step | for |
/// |---|---|---|
/// | shooting | a shot | large scenes: only patches that matter get rows |
/// | Jacobi | a bounce | light after a given number of bounces |
/// | Gauss–Seidel | a sweep | what Jacobi does, in about half the sweeps |
/// | GMRES | a product with all rows | reflectance near one |
/// | direct | the solve | small scenes, and to judge the others |
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// The brightest patch passes on its light, again and again: see [`Shooting`].
    Shooting {
        /// See [`Shooting::tolerance`]; 0 shoots by elements, as all other methods do.
        tolerance: f64,
        /// See [`Shooting::level`].
        level: u32,
        /// See [`Shooting::overshoot`].
        overshoot: bool,
    },
    /// All elements at once pass on what they have: E, then E + ME, then E + ME + M²E …
    Jacobi,
    /// One element after another passes on what it has by then, sources first.
    GaussSeidel,
    /// Restarted GMRES (Saad and Schultz 1986).
    Gmres {
        /// Products with all rows until it starts again, 1 or more; twice as many where that takes it
        /// nowhere. Each takes 48 bytes an element.
        restart: usize,
    },
    /// Gaussian elimination, to rounding whatever unshot share is asked for; at most [`MAX_DIRECT`]
    /// elements.
    ///
    /// [`MAX_DIRECT`]: crate::MAX_DIRECT
    Direct,
}

impl Method {
    /// Every method as [`FromStr`] makes it of its name.
    pub const ALL: [Method; 6] = {
        let (tolerance, level) = (Shooting::TOLERANCE, 0);
        [
            Method::Shooting { tolerance, level, overshoot: false },
            Method::Shooting { tolerance, level, overshoot: true },
            Method::Jacobi,
            Method::GaussSeidel,
            Method::Gmres { restart: 50 },
            Method::Direct,
        ]
    };

    fn name(&self) -> &'static str {
        match self {
            Method::Shooting { overshoot: false, .. } => "shooting",
            Method::Shooting { overshoot: true, .. } => "overshoot",
            Method::Jacobi => "jacobi",
            Method::GaussSeidel => "gauss-seidel",
            Method::Gmres { .. } => "gmres",
            Method::Direct => "direct",
        }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Method {
    type Err = Error;

    /// The method of that name: shooting, overshoot, jacobi, gauss-seidel, gmres or direct.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when there is none.
    fn from_str(name: &str) -> Result<Method, Error> {
        let names = Method::ALL.map(|m| m.name()).join(", ");
        let unknown = || {
            Error::new(
                ErrorKind::Setting,
                "solver",
                format!("'{name}'"),
                format!("use one of {names}"),
            )
        };
        Method::ALL.into_iter().find(|m| m.name() == name).ok_or_else(unknown)
    }
}

/// A method and when it stops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solver {
    /// How light is spread.
    pub method: Method,
    /// StopReason when no channel has more than this share of its emitted flux unshot, in [0, 1]. Radiosity
    /// is off by no more than that brings: at most this × emitted flux / (1 − ρ) in all, ρ the highest
    /// reflectance.
    pub unshot: f64,
    /// StopReason after this many steps of the [`Method`].
    pub steps: Option<u64>,
    /// Bytes that kept rows may take; those that do not fit are made again.
    pub row_memory: usize,
}

impl Solver {
    /// Elements up to which [`Solver::for_mesh`] solves directly: a tenth of a second.
    pub const FEW: usize = 512;

    /// Mean reflectance from which on [`Solver::for_mesh`] asks for GMRES where all rows fit in
    /// memory: shooting would follow some 70 bounces for 0.1 % unshot, where GMRES takes some 10
    /// products.
    pub const BRIGHT: f64 = 0.9;

    /// The same where rows must be made again for every product: 2 300 bounces.
    pub const BRIGHTEST: f64 = 0.997;

    /// `method`, to 0.1 % unshot with a GiB of rows.
    pub fn new(method: Method) -> Solver {
        let Shooting { unshot, shots, row_memory, .. } = Shooting::default();
        Solver { method, unshot, steps: shots, row_memory }
    }

    /// The method that `mesh` asks for, by its size and by its mean reflectance (by area, the highest
    /// channel), with [`Solver::new`]'s settings:
    ///
    /// 1. direct, for up to [`Solver::FEW`] elements;
    /// 2. else GMRES, from [`Solver::BRIGHT`] on while all rows fit in memory, full as they may be (8
    ///    bytes for each pair of elements), or from [`Solver::BRIGHTEST`] on if they do not;
    /// 3. else shooting.
    pub fn for_mesh(mesh: &Mesh) -> Solver {
        let [shooting, _, _, _, gmres, direct] = Method::ALL.map(Solver::new);
        let elements = (0..mesh.element_count()).map(|e| mesh.element(e));
        let area: f64 = elements.clone().map(|n| mesh.area(n)).sum();
        let reflects: Rgb = elements.map(|n| mesh.material(n).reflectance * mesh.area(n)).sum();
        let reflectance = (reflects / area).max_element();
        let count = mesh.element_count();
        let all_fit = count.saturating_mul(count).saturating_mul(8) <= gmres.row_memory;
        let bright = if all_fit { Solver::BRIGHT } else { Solver::BRIGHTEST };
        match () {
            _ if count <= Solver::FEW => direct,
            _ if reflectance >= bright => gmres,
            _ => shooting,
        }
    }

    /// Spreads the light that `mesh` emits, with rows from `form_factors`.
    ///
    /// `progress` is told of every row that light is sent along, or that is made, and may stop the
    /// solver; what was reached is returned. Its ledger closes, whenever that is.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when `unshot` is not in [0, 1], a setting of the method is out of range or
    /// the mesh too large for it; [`ErrorKind::Scene`] when the emitted flux is not finite;
    /// [`ErrorKind::FormFactor`] when a row breaks its contract; whatever `form_factors` fails with.
    pub fn solve(
        &self,
        mesh: &Mesh,
        form_factors: &mut dyn FormFactors,
        mut progress: impl FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Solution, Error> {
        let mut solve = self.begin(mesh)?;
        solve.run(form_factors, &mut progress)?;
        solve.into_solution()
    }

    /// A solve of `mesh` in which nothing is shot yet.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when `unshot` is not in [0, 1], a setting of the method is out of range or
    /// the mesh too large for it; [`ErrorKind::Scene`] when the emitted flux is not finite.
    pub fn begin<'m>(&self, mesh: &'m Mesh) -> Result<SolveSession<'m>, Error> {
        self.check()?;
        let count = mesh.element_count();
        if self.method == Method::Direct && count > MAX_DIRECT {
            let remedy = format!("at most {MAX_DIRECT}: use another method, such as gmres");
            let found = format!("{count} elements");
            return Err(Error::new(ErrorKind::Setting, "direct solve", found, remedy));
        }
        Ok(SolveSession {
            solver: *self,
            state: FluxState::new(mesh)?,
            rows: RowCache::new(self.row_memory),
            course: MethodState::new(self.method, mesh),
            done: Counters::default(),
            stop: None,
            made_by: String::new(),
        })
    }

    /// Whether all settings are in range.
    pub(super) fn check(&self) -> Result<(), Error> {
        let wrong = |place: String, found: &str, remedy: &str| {
            Err(Error::new(ErrorKind::Setting, place, found, remedy))
        };
        if !(0.0..=1.0).contains(&self.unshot) {
            return wrong(format!("unshot share {}", self.unshot), "out of range", "use 0 to 1");
        }
        match self.method {
            Method::Shooting { tolerance, .. } if tolerance.is_nan() || tolerance < 0.0 => {
                wrong(format!("tolerance {tolerance}"), "below 0", "use 0 or more")
            }
            Method::Gmres { restart: 0 } => {
                wrong("restart 0".into(), "no product", "use 1 or more products a cycle")
            }
            _ => Ok(()),
        }
    }
}
