//! Sweeps over all elements: Jacobi and Gauss–Seidel.
//!
//! To relax an element is to pass on what it has unshot, so that its residual is 0. Gauss–Seidel
//! relaxes one element after another; Jacobi all at once, which makes a sweep a bounce of light;
//! always the one with most to pass on, Southwell's way, is shooting (Gortler, Cohen and Slusallek
//! 1994).

use super::run::Run;
use super::{Go, Stop};
use crate::error::Error;
use crate::scene::Rgb;

/// What an element passes on in a sweep.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Sweep {
    /// What it had when the sweep began.
    Jacobi,
    /// What it has when its turn comes. Elements that emit have theirs first.
    GaussSeidel,
}

/// Sweeps until done; a step is a sweep. After k sweeps of Jacobi what leaves is e + Me + … + Mᵏe.
pub(super) fn relax(run: &mut Run, sweep: Sweep, steps: Option<u64>) -> Result<Stop, Error> {
    let count = run.state.flux.unshot.len();
    let emits = |e: &usize| run.state.flux.unshot[*e] != Rgb::ZERO;
    let (sources, mut others): (Vec<usize>, Vec<usize>) = (0..count).partition(emits);
    // What is black never has anything to pass on.
    others.retain(|&e| run.state.reflectance[e] != Rgb::ZERO);
    let order = [sources, others].concat();
    loop {
        if run.has_converged()? {
            return Ok(Stop::Converged);
        }
        if steps.is_some_and(|most| run.steps >= most) {
            return Ok(Stop::Steps);
        }
        let unshot = &mut run.state.flux.unshot;
        let go = match sweep {
            Sweep::GaussSeidel => {
                let due = |run: &mut Run, e: usize| std::mem::take(&mut run.state.flux.unshot[e]);
                pass_on(run, &order, due)?
            }
            Sweep::Jacobi => {
                let mut held = std::mem::replace(unshot, vec![Rgb::ZERO; count]);
                let due: Vec<usize> =
                    order.iter().copied().filter(|&e| held[e] != Rgb::ZERO).collect();
                let go = pass_on(run, &due, |_, e| std::mem::take(&mut held[e]));
                run.state.flux.unshot.iter_mut().zip(held).for_each(|(u, h)| *u += h);
                go?
            }
        };
        if go.is_break() {
            return Ok(Stop::Cancelled);
        }
        run.steps += 1;
    }
}

/// Passes on, of each of `elements` in turn, the flux that `due` hands out. Rows are asked for as
/// they are needed, so that a sweep which reaches few elements makes few.
fn pass_on(
    run: &mut Run,
    elements: &[usize],
    mut due: impl FnMut(&mut Run, usize) -> Rgb,
) -> Result<Go, Error> {
    let mut at = 0;
    while at < elements.len() {
        for row in run.rows.next(&elements[at..])? {
            let flux = due(run, elements[at]);
            at += 1;
            if flux != Rgb::ZERO {
                run.state.pass_on(flux, &row);
                run.shots += 1;
            }
            let unshot_share = run.state.ledger.unshot_share();
            if run.tell(unshot_share).is_break() {
                return Ok(Go::Break(()));
            }
        }
    }
    Ok(Go::Continue(()))
}
