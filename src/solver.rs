//! Solvers of the radiosity equation: from the light that a mesh emits to the radiosity of its
//! elements.
//!
//! The equation is B_i = E_i + ρ_i Σ_j F_ij B_j. All methods work on flux (W) instead and keep the
//! same state: the flux that each element has received and the part that it has not passed on yet.
//! They differ only in which elements send next:
//!
//! ```text
//! Solver (settings) ── begin ──▶ SolveSession ── advance, advance … ──▶ Solution
//!                                  │
//!   FormFactors ──▶ RowCache ──▶ StepContext ──▶ method: shooting (through a PatchCut),
//!                                  │              Jacobi or Gauss–Seidel, GMRES, direct
//!                                  ▼
//!                      FluxState: incident, unshot, Ledger
//! ```
//!
//! After every batch of rows all light is accounted for, so that a session can be inspected, saved
//! and resumed, or given a scene whose materials or objects have changed.

mod checkpoint;
mod direct;
mod flux_state;
mod geometry_delta;
mod gmres;
mod incremental;
mod ledger;
mod method;
mod method_state;
mod patch_cut;
mod patch_error;
mod relaxation;
mod row_cache;
mod saved_state;
mod session;
mod settings;
mod shooting;
mod staleness;
mod step;

use std::time::Duration;

use crate::error::{Error, ErrorKind};
use crate::mesh::Mesh;
pub use crate::progress::StopReason;
use crate::scene::Rgb;
pub(crate) use flux_state::ReceivedLight;
pub use ledger::Ledger;
pub use method::Method;
pub use session::SolveSession;
pub use settings::Solver;

/// Radiosity of every element, and statistics of the solve.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Solution {
    /// Radiosity B of each element: emitted plus reflected, W/m² per channel.
    pub radiosity: Vec<Rgb>,
    /// Energy balance of the emitted light.
    pub ledger: Ledger,
    /// The method that solved it.
    pub method: Method,
    /// Steps done, in the unit of the [`Method`]: shots, bounces, sweeps, products. For Jacobi, the
    /// number of bounces that the radiosity contains in full.
    pub steps: u64,
    /// Rows that light was sent along: of patches with shooting, of elements with the other
    /// methods.
    pub shots: u64,
    /// Rows computed; fewer than shots where rows were cached.
    pub rows_made: u64,
    /// Why the solver stopped.
    pub stop: StopReason,
}

/// Progress of a solver, reported after every shot or row.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct Progress {
    /// Steps done so far, in the unit of the [`Method`].
    pub steps: u64,
    /// Rows that light was sent along so far.
    pub shots: u64,
    /// Rows computed so far.
    pub rows_made: u64,
    /// Unshot and overshot share of the emitted flux, worst channel; with GMRES an upper bound of
    /// it, and 1 until a direct solve has finished.
    pub unshot_share: f64,
    /// Time since the solver was started.
    pub elapsed: Duration,
}

impl Progress {
    /// Before the first step.
    pub(crate) const NOTHING_SHOT: Progress =
        Progress { steps: 0, shots: 0, rows_made: 0, unshot_share: 1.0, elapsed: Duration::ZERO };
}

impl Solution {
    /// The emission of `mesh`, none of it passed on.
    pub(crate) fn nothing_shot(mesh: &Mesh) -> Solution {
        let radiosity: Vec<Rgb> = (0..mesh.element_count()).map(|e| mesh.exitance(e)).collect();
        let flux = |(e, b): (usize, &Rgb)| *b * mesh.solid_area(mesh.element(e));
        let emitted = radiosity.iter().enumerate().map(flux).sum();
        Solution {
            ledger: Ledger { emitted, unshot: emitted, ..Ledger::default() },
            radiosity,
            method: Method::Shooting { overshoot: false },
            steps: 0,
            shots: 0,
            rows_made: 0,
            stop: StopReason::Shots,
        }
    }

    /// Σ weight × solution: combines lights that were solved separately on the same mesh. Weights
    /// are per channel and ≥ 0. Radiosity and ledger are linear in the emission. Steps, shots and
    /// rows are sums over all parts; the stop reason is the first that is not
    /// [`StopReason::Converged`].
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when there are no parts, they have different numbers of elements, or
    /// a weight is below 0 or not finite.
    pub fn linear_combination(parts: &[(Rgb, &Solution)]) -> Result<Solution, Error> {
        let wrong = |place: String, found: String, remedy: &str| {
            Err(Error::new(ErrorKind::Setting, place, found, remedy))
        };
        let Some((_, first)) = parts.first() else {
            return wrong("lights".into(), "none".into(), "mix one or more");
        };
        let count = first.radiosity.len();
        let mut combined = Solution {
            radiosity: vec![Rgb::ZERO; count],
            ledger: Ledger::default(),
            steps: 0,
            shots: 0,
            rows_made: 0,
            stop: StopReason::Converged,
            ..(*first).clone()
        };
        for (k, &(weight, part)) in parts.iter().enumerate() {
            let place = format!("light {}", k + 1);
            if part.radiosity.len() != count {
                let found = format!("{} elements", part.radiosity.len());
                return wrong(place, found, "all must be solved on the same mesh");
            }
            if !weight.is_finite() || weight.min_element() < 0.0 {
                return wrong(place, format!("a weight of {weight}"), "use 0 or more");
            }
            for (sum, radiosity) in combined.radiosity.iter_mut().zip(&part.radiosity) {
                *sum += weight * *radiosity;
            }
            combined.ledger.add(weight, &part.ledger);
            combined.steps += part.steps;
            combined.shots += part.shots;
            combined.rows_made += part.rows_made;
            if combined.stop == StopReason::Converged {
                combined.stop = part.stop;
            }
        }
        Ok(combined)
    }
}
