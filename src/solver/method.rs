//! The methods of light distribution, and their names.

use std::fmt;
use std::str::FromStr;

use super::Solver;
use crate::error::{Error, ErrorKind};
use crate::linear::gmres;

/// Method of light distribution. All methods solve the same equations to the same unshot share; all
/// but shooting from patches larger than elements need a row for every element that has light.
///
/// | method | a step | for |
/// |---|---|---|
/// | shooting | a shot | large scenes: only patches that matter get rows |
/// | Jacobi | a bounce | light after a given number of bounces |
/// | Gauss–Seidel | a sweep | as Jacobi, in about half the sweeps |
/// | GMRES | a product with all rows | reflectance near one |
/// | direct | the solve | small scenes, and as a reference for the others |
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Method {
    /// Progressive shooting (Cohen, Chen, Wallace and Greenberg 1988): repeatedly, the patch with
    /// most unshot flux shoots it. [`Solver::patch_tolerance`] and [`Solver::min_patch_level`] set
    /// the size of patches.
    Shooting {
        /// Whether patches also shoot light that they have not received yet (Feda and Purgathofer
        /// 1992): the light that they would receive and reflect if all unshot light fell evenly on
        /// all surfaces. Saves shots where reflectance is high. Excess light is compensated by
        /// light that arrives later, or shot as negative light; until then the ledger counts it as
        /// [`overshot`](crate::solver::Ledger::overshot).
        overshoot: bool,
    },
    /// All elements at once pass on the light that they have: E, then E + ME, then E + ME + M²E …
    Jacobi,
    /// One element after another passes on the light that it has at that time, emitters first.
    GaussSeidel,
    /// Restarted GMRES (Saad and Schultz 1986).
    Gmres {
        /// Products with all rows until a restart, ≥ 1; doubled after a cycle that stagnates. Each
        /// product takes 48 bytes per element.
        restart: usize,
    },
    /// Gaussian elimination, to rounding error regardless of the requested unshot share; at most
    /// [`Solver::DIRECT_MAX_ELEMENTS`] elements.
    Direct,
}

impl Method {
    /// Every method as [`FromStr`] parses its name.
    pub const ALL: [Method; 6] = [
        Method::Shooting { overshoot: false },
        Method::Shooting { overshoot: true },
        Method::Jacobi,
        Method::GaussSeidel,
        Method::Gmres { restart: gmres::RESTART },
        Method::Direct,
    ];

    fn name(self) -> &'static str {
        match self {
            Method::Shooting { overshoot: false } => "shooting",
            Method::Shooting { overshoot: true } => "overshoot",
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
        Method::ALL.into_iter().find(|method| method.name() == name).ok_or_else(|| {
            let found = format!("'{name}'");
            let names = Method::ALL.map(Method::name).join(", ");
            Error::new(ErrorKind::Setting, "solver", found, format!("use one of {names}"))
        })
    }
}

/// The settings that decide which equations are solved and in which order, as text.
///
/// A saved state holds this text and is resumed only by a solver that yields the same. It is part
/// of the file format and must not change: existing files would be refused.
pub(super) fn saved_identity(solver: &Solver) -> String {
    match solver.method {
        Method::Shooting { overshoot } => {
            let Solver { patch_tolerance, min_patch_level, .. } = solver;
            format!(
                "Shooting {{ tolerance: {patch_tolerance:?}, level: {min_patch_level}, \
                 overshoot: {overshoot} }}"
            )
        }
        Method::Jacobi => "Jacobi".into(),
        Method::GaussSeidel => "GaussSeidel".into(),
        Method::Gmres { restart } => format!("Gmres {{ restart: {restart} }}"),
        Method::Direct => "Direct".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The texts in version 1 of the file format.
    #[test]
    fn identity_in_saved_states_does_not_change() {
        let texts = Method::ALL.map(|method| saved_identity(&Solver::new(method)));
        let expected = [
            "Shooting { tolerance: 0.004, level: 0, overshoot: false }",
            "Shooting { tolerance: 0.004, level: 0, overshoot: true }",
            "Jacobi",
            "GaussSeidel",
            "Gmres { restart: 50 }",
            "Direct",
        ];
        assert_eq!(texts, expected);
        for (tolerance, text) in [(0.0, "0.0"), (5.0, "5.0"), (1e-7, "1e-7"), (1e16, "1e16")] {
            let solver =
                Solver { patch_tolerance: tolerance, min_patch_level: 3, ..Solver::default() };
            let expected = format!("Shooting {{ tolerance: {text}, level: 3, overshoot: false }}");
            assert_eq!(saved_identity(&solver), expected);
        }
    }
}
