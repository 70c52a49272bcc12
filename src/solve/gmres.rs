//! GMRES, restarted (Saad and Schultz 1986), on the flux that is unshot.
//!
//! A cycle looks for what to send among the unshot flux r, Ar, A²r … with A = 1 − M, such that the
//! least is unshot afterwards. Products with A of bounced light are all it asks for, so that it costs
//! what Jacobi's bounces do; but however near one the reflectance is, light that fills a scene evenly
//! is a single direction, and found in a step.
//!
//! Every vector is kept with what became of its light when it was sent, lost parts included. All of
//! it is linear, so the ledger of what a cycle sends is known without sending it, whenever it ends.

use super::ledger::largest_share;
use super::run::Run;
use super::state::{Sent, State, send};
use super::{Go, Stop};
use crate::error::{Error, ErrorKind};
use crate::scene::Rgb;

/// Cycles of `restart` products, each a step, until done.
pub(super) fn gmres(run: &mut Run, restart: usize, steps: Option<u64>) -> Result<Stop, Error> {
    if restart == 0 {
        let remedy = "use 1 or more products a cycle";
        return Err(Error::new(ErrorKind::Setting, "restart 0", "no product", remedy));
    }
    let mut length = restart;
    loop {
        if run.has_converged()? {
            return Ok(Stop::Converged);
        }
        let mut cycle = Cycle::new(&run.state);
        let mut stop = None;
        let enough = |cycle: &Cycle, run: &Run| {
            !cycle.sent.is_empty() && cycle.unshot(run) <= run.unshot || cycle.sent.len() == length
        };
        while stop.is_none() && !enough(&cycle, run) {
            if steps.is_some_and(|most| run.steps >= most) {
                stop = Some(Ok(Stop::Steps));
                continue;
            }
            match bounce(run, &cycle) {
                Ok(Some(bounced)) => {
                    cycle.extend(bounced);
                    run.steps += 1;
                }
                Ok(None) => stop = Some(Ok(Stop::Cancelled)),
                // What the cycle has found by then is in the state, as when it is cancelled.
                Err(error) => stop = Some(Err(error)),
            }
        }
        // In as many products as there are elements it would be exact: no scene holds it up for ever.
        if cycle.stalls() {
            length *= 2;
        }
        cycle.finish(&mut run.state);
        if let Some(stop) = stop {
            return stop;
        }
    }
}

/// A cycle that takes less than this share off what is unshot is followed by one of twice the length.
const LEAST_GAIN: f64 = 0.5;

/// Reflected by each element, and what became of all that was sent.
type Bounced = (Vec<Rgb>, Sent);

/// The newest vector of `cycle`, sent. Nothing when cancelled.
fn bounce(run: &mut Run, cycle: &Cycle) -> Result<Option<Bounced>, Error> {
    let vector = cycle.basis.last().map_or(&[][..], |v| v);
    let lit: Vec<usize> = (0..vector.len()).filter(|&e| vector[e] != Rgb::ZERO).collect();
    let (mut bounced, mut all) = (vec![Rgb::ZERO; vector.len()], Sent::default());
    let mut at = 0;
    while at < lit.len() {
        for row in run.rows.next(&lit[at..])? {
            let flux = vector[lit[at]];
            let sent = send(flux, &row, &run.state.reflectance, |e, w| bounced[e] += w);
            all.add(Rgb::ONE, sent);
            (at, run.shots) = (at + 1, run.shots + 1);
            if run.tell(cycle.unshot(run)) == Go::Break(()) {
                return Ok(None);
            }
        }
    }
    Ok(Some((bounced, all)))
}

/// One cycle, of all channels at once: as many systems that share rows. A channel that is through
/// goes on with vectors of 0.
struct Cycle {
    /// Σ A over A of each element. With these weights a vector's norm is no less than the sum of its
    /// fluxes' magnitudes (Cauchy and Schwarz), and the product with M nearly symmetric (it is where
    /// reflectance is one and rows are exact).
    weights: Vec<f64>,
    /// Orthonormal vectors, the first along what is unshot.
    basis: Vec<Vec<Rgb>>,
    /// What became of the light of each but the last.
    sent: Vec<Sent>,
    /// A times each but the last, in terms of the basis: columns of the Hessenberg matrix.
    columns: Vec<Vec<Rgb>>,
    /// The same as an upper triangle, after these rotations (cosine and sine).
    triangle: Vec<Vec<Rgb>>,
    rotations: Vec<[Rgb; 2]>,
    /// Norm of what was unshot.
    norm: Rgb,
    /// The unshot flux, rotated likewise; the norm of what cannot be sent away comes last.
    rest: Vec<Rgb>,
}

impl Cycle {
    fn new(state: &State) -> Cycle {
        let area = |e: usize| state.mesh.area(state.mesh.element(e));
        let count = state.flux.unshot.len();
        let whole: f64 = (0..count).map(area).sum();
        let weights: Vec<f64> = (0..count).map(|e| whole / area(e)).collect();
        // In parts of the largest, so that squares of it neither overflow nor vanish.
        let largest = state.flux.unshot.iter().fold(Rgb::ZERO, |most, u| most.max(u.abs()));
        let mut first = state.flux.unshot.clone();
        first.iter_mut().for_each(|u| *u = ratio(*u, largest));
        let norm = dot(&weights, &first, &first).map(f64::sqrt);
        first.iter_mut().for_each(|u| *u = ratio(*u, norm));
        let (sent, columns, triangle, rotations) = (vec![], vec![], vec![], vec![]);
        let (basis, norm) = (vec![first], norm * largest);
        let rest = vec![norm];
        Cycle { weights, basis, sent, columns, triangle, rotations, norm, rest }
    }

    /// Takes in the newest vector, `bounced`, and adds the direction that is new in that.
    fn extend(&mut self, (bounced, sent): Bounced) {
        let k = self.sent.len();
        let mut new = bounced;
        new.iter_mut().zip(&self.basis[k]).for_each(|(m, v)| *m = *v - *m);
        // Modified Gram–Schmidt, enough for GMRES (Paige, Rozložník and Strakoš 2006).
        let mut column = vec![];
        for v in &self.basis {
            let along = dot(&self.weights, v, &new);
            new.iter_mut().zip(v).for_each(|(w, v)| *w -= along * v);
            column.push(along);
        }
        let norm = dot(&self.weights, &new, &new).map(f64::sqrt);
        column.push(norm);
        self.columns.push(column.clone());
        for (i, &[c, s]) in self.rotations.iter().enumerate() {
            let (a, b) = (column[i], column[i + 1]);
            (column[i], column[i + 1]) = (c * a + s * b, c * b - s * a);
        }
        let radius = (column[k] * column[k] + norm * norm).map(f64::sqrt);
        let [c, s] = [ratio(column[k], radius), ratio(norm, radius)];
        let rest = self.rest[k];
        let last = -s * rest;
        self.rest[k] = c * rest;
        self.rest.push(last);
        column[k] = radius;
        column.pop();
        self.triangle.push(column);
        self.rotations.push([c, s]);
        new.iter_mut().for_each(|w| *w = ratio(*w, norm));
        self.basis.push(new);
        self.sent.push(sent);
    }

    /// Norm of what would be unshot after the vectors so far.
    fn last(&self) -> Rgb {
        self.rest.last().map_or(Rgb::ZERO, |r| r.abs())
    }

    /// The most that would be unshot, as a share of the emitted: the worst channel.
    fn unshot(&self, run: &Run) -> f64 {
        largest_share(self.last(), run.state.ledger.emitted)
    }

    /// Whether less than [`LEAST_GAIN`] of what was unshot is gone in some channel.
    fn stalls(&self) -> bool {
        largest_share(self.last(), self.norm) > 1.0 - LEAST_GAIN
    }

    /// Sends what leaves least unshot.
    fn finish(self, state: &mut State) {
        let count = self.triangle.len();
        let mut parts = vec![Rgb::ZERO; count];
        for i in (0..count).rev() {
            let known: Rgb = (i + 1..count).map(|k| self.triangle[k][i] * parts[k]).sum();
            parts[i] = ratio(self.rest[i] - known, self.triangle[i][i]);
        }
        // A times what is sent, by the basis: that much is no longer unshot.
        let mut shot = vec![Rgb::ZERO; self.basis.len()];
        for (column, &part) in self.columns.iter().zip(&parts) {
            shot.iter_mut().zip(column).for_each(|(s, &h)| *s += h * part);
        }
        let (unshot, leaving) = (&mut state.flux.unshot, &mut state.flux.leaving);
        for (k, v) in self.basis.iter().enumerate() {
            let part = parts.get(k).map_or(Rgb::ZERO, |&p| p);
            for ((r, x), v) in unshot.iter_mut().zip(&mut *leaving).zip(v) {
                *r -= shot[k] * *v;
                *x += (part - shot[k]) * *v;
            }
        }
        let mut all = Sent::default();
        parts.iter().zip(&self.sent).for_each(|(&part, &sent)| all.add(part, sent));
        state.lose(all);
    }
}

/// Sum of products over the elements.
fn dot(weights: &[f64], a: &[Rgb], b: &[Rgb]) -> Rgb {
    weights.iter().zip(a).zip(b).map(|((&w, a), b)| w * *a * *b).sum()
}

/// `a` over `b`, and 0 where that is 0.
fn ratio(a: Rgb, b: Rgb) -> Rgb {
    Rgb::select(b.cmpeq(Rgb::ZERO), Rgb::ZERO, a / b)
}

#[cfg(test)]
mod tests {
    use super::super::{Method, Solver};
    use super::*;
    use crate::form_factor::ray_cast::RayCast;
    use crate::form_factor::{FormFactors, Row};
    use crate::mesh::{Mesh, NodeId};

    /// Rays that are not to be had any more after so many batches.
    struct Failing(RayCast, u32);

    impl FormFactors for Failing {
        fn rows(&mut self, mesh: &Mesh, patches: &[NodeId], share: f64) -> Result<Vec<Row>, Error> {
            let lost = Error::new(ErrorKind::Device, "device", "lost", "open it again");
            self.1 = self.1.checked_sub(1).ok_or(lost)?;
            self.0.rows(mesh, patches, share)
        }
    }

    #[test]
    fn what_was_found_before_rows_failed_is_kept() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj");
        let mesh = Mesh::new(crate::load_obj(path).unwrap(), 300.0).unwrap();
        let (mut go, steps) = (|_: &super::super::Progress| Go::Continue(()), 4);
        let rays = || RayCast::new(&mesh, 64).unwrap();
        // Four products, each with rows made anew; one row a batch.
        let solver = Solver {
            row_memory: 0,
            steps: Some(steps),
            ..Solver::new(Method::Gmres { restart: 50 })
        };
        let whole = solver.solve(&mesh, &mut rays(), &mut go).unwrap();
        let mut failing = Failing(rays(), whole.rows_made as u32);
        let mut run = Run::new(&mesh, &mut failing, &mut go, 0.0, 0).unwrap();
        let e = gmres(&mut run, 50, None).unwrap_err();
        assert_eq!((e.kind(), run.steps), (ErrorKind::Device, steps));
        run.state.settle().unwrap();
        assert!(run.state.radiosity() == whole.radiosity);
    }
}
