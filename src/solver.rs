//! What a solver gives back and tells on its way: solution and progress.

mod checkpoint;
mod direct;
mod flux_state;
mod gmres;
mod incremental;
mod ledger;
mod method;
mod patch_cut;
mod relaxation;
mod row_cache;
mod session;
mod settings;
mod shooting;

use std::time::Duration;

use crate::error::{Error, ErrorKind};
use crate::progress::StopReason;
use crate::scene::Rgb;
pub use ledger::Ledger;
pub use method::Method;
pub use session::SolveSession;
pub use settings::Solver;

/// Radiosity of every element, and how the solver got there.
#[derive(Clone, Debug)]
pub struct Solution {
    /// Radiosity B of each element: emitted plus reflected, W/m² per channel.
    pub radiosity: Vec<Rgb>,
    /// Where all emitted light has gone.
    pub ledger: Ledger,
    /// How it was solved.
    pub method: Method,
    /// What was done, in the unit of its [`Method`]: shots, bounces, sweeps, products. Jacobi's are
    /// the bounces that the radiosity has in full.
    pub steps: u64,
    /// Rows that light was sent along, for patches or, in most methods, elements.
    pub shots: u64,
    /// Rows that had to be made; fewer than shots where rows were kept.
    pub rows_made: u64,
    /// Why the solver stopped.
    pub stop: StopReason,
}

/// How far a solver is, told after every shot or row.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Steps done so far, in the unit of the [`Method`].
    pub steps: u64,
    /// Rows that light was sent along so far.
    pub shots: u64,
    /// Rows made so far.
    pub rows_made: u64,
    /// Share of the emitted flux that is unshot or overshot, in the worst channel; with GMRES no more
    /// than this is, and a direct solve has 1 until it is through.
    pub unshot_share: f64,
    /// Time since the solver was set going.
    pub elapsed: Duration,
}

impl Solution {
    /// Lights that were solved one by one, mixed: each of `parts`, of the same mesh, by its weight a
    /// channel, none below 0. Radiosity is linear in what is emitted; so is the ledger. Rows and shots
    /// are those of all, the stop that of the first which did not converge.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when there are no parts, they have different numbers of elements, or a
    /// weight is below 0 or not finite.
    pub fn linear_combination(parts: &[(Rgb, &Solution)]) -> Result<Solution, Error> {
        let wrong = |place: String, found: String, remedy: &str| {
            Err(Error::new(ErrorKind::Setting, place, found, remedy))
        };
        let Some((_, first)) = parts.first() else {
            return wrong("lights".into(), "none".into(), "mix one or more");
        };
        let count = first.radiosity.len();
        let mut mixed = Solution {
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
            mixed.radiosity.iter_mut().zip(&part.radiosity).for_each(|(m, b)| *m += weight * *b);
            mixed.ledger.add(weight, &part.ledger);
            mixed.steps += part.steps;
            mixed.shots += part.shots;
            mixed.rows_made += part.rows_made;
            if mixed.stop == StopReason::Converged {
                mixed.stop = part.stop;
            }
        }
        Ok(mixed)
    }
}
