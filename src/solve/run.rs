//! A solve under way: state, rows, and what all methods do alike with them.

use std::time::Instant;

use super::rows::Rows;
use super::state::State;
use super::{Go, Method, Progress, Solution, Stop};
use crate::error::{Error, ErrorKind};
use crate::form_factor::FormFactors;
use crate::mesh::Mesh;

/// One solve.
pub(super) struct Run<'a> {
    pub state: State<'a>,
    pub rows: Rows<'a>,
    progress: &'a mut dyn FnMut(&Progress) -> Go,
    start: Instant,
    /// Converged when no channel has more than this share of its emitted flux unshot.
    pub unshot: f64,
    /// Rows sent along.
    pub shots: u64,
    pub steps: u64,
}

/// Less than this share unshot cannot change a radiosity in f64, not even in a room whose lamps emit
/// 1e-12 of what others do: asking for 0 ends here.
const LEAST_UNSHOT: f64 = 1e-28;

impl<'a> Run<'a> {
    /// Nothing is shot yet.
    pub fn new(
        mesh: &'a Mesh,
        maker: &'a mut dyn FormFactors,
        progress: &'a mut dyn FnMut(&Progress) -> Go,
        unshot: f64,
        row_memory: usize,
    ) -> Result<Run<'a>, Error> {
        if !(0.0..=1.0).contains(&unshot) {
            let place = format!("unshot share {unshot}");
            return Err(Error::new(ErrorKind::Setting, place, "out of range", "use 0 to 1"));
        }
        let state = State::new(mesh)?;
        let (rows, start) = (Rows::new(mesh, maker, row_memory), Instant::now());
        let unshot = unshot.max(LEAST_UNSHOT);
        Ok(Run { state, rows, progress, start, unshot, shots: 0, steps: 0 })
    }

    /// Counts and checks what there is; whether that is enough.
    pub fn has_converged(&mut self) -> Result<bool, Error> {
        self.state.settle()?;
        Ok(self.state.ledger.unshot_share() <= self.unshot)
    }

    /// Tells where the solve is; whether to go on.
    pub fn tell(&mut self, unshot_share: f64) -> Go {
        let Run { shots, steps, ref rows, start, .. } = *self;
        let rows_made = rows.made;
        (self.progress)(&Progress {
            steps,
            shots,
            rows_made,
            unshot_share,
            elapsed: start.elapsed(),
        })
    }

    /// What was reached.
    pub fn solution(mut self, method: Method, stop: Stop) -> Result<Solution, Error> {
        self.state.settle()?;
        let Run { state, rows, shots, steps, .. } = self;
        let (radiosity, rows_made) = (state.radiosity(), rows.made);
        Ok(Solution { radiosity, ledger: state.ledger, method, steps, shots, rows_made, stop })
    }
}
