//! Solves that are interrupted, by every method: saved after every batch, failed, cancelled.

use std::ops::ControlFlow;

use radiosity::backend::cpu::RayRows;
use radiosity::form_factor::Row;
use radiosity::mesh::NodeId;
use radiosity::solver::{Method, Progress, StopReason};
use radiosity::{Error, ErrorKind, FormFactors, Mesh, Solver};

use crate::common::measures::assert_same_bits;
use crate::common::{cornell_box, keep_going};

/// Rays, fewer for dim patches: rows depend on when they are made.
fn rays(mesh: &Mesh) -> RayRows {
    RayRows::new(mesh, 1024).unwrap()
}

/// Rays that fail after so many batches.
struct Failing(RayRows, u32);

impl FormFactors for Failing {
    fn rows(&mut self, mesh: &Mesh, patches: &[NodeId], share: f64) -> Result<Vec<Row>, Error> {
        let lost = Error::new(ErrorKind::Device, "device", "lost", "open it again");
        self.1 = self.1.checked_sub(1).ok_or(lost)?;
        self.0.rows(mesh, patches, share)
    }

    fn preferred_batch_len(&self) -> usize {
        self.0.preferred_batch_len()
    }
}

#[test]
#[ignore = "slow"]
fn resuming_after_every_batch_changes_no_bit() {
    let mesh = cornell_box(150.0);
    for solver in solvers() {
        let whole = solver.solve(&mesh, &mut rays(&mesh), keep_going).unwrap();
        let mut solve = solver.begin(&mesh).unwrap();
        let mut batches = 0;
        loop {
            let mut rows = rays(&mesh);
            let stop = solve.advance(&mut rows, keep_going).unwrap();
            let bytes = solve.to_bytes();
            if stop.is_some() {
                break;
            }
            batches += 1;
            solve = solver.resume_bytes(&mesh, &rows, &bytes).unwrap();
            assert!(solve.to_bytes() == bytes, "{}, batch {batches}", solver.method);
        }
        println!("{}: {batches} batches", solver.method);
        assert!(batches > 20 || solver.method == Method::Direct);
        assert_same_bits(&solve.into_solution().unwrap(), &whole);
    }
}

#[test]
#[ignore = "slow"]
fn row_errors_lose_no_progress() {
    let mesh = cornell_box(150.0);
    for solver in solvers() {
        let whole = solver.solve(&mesh, &mut rays(&mesh), keep_going).unwrap();
        let mut solve = solver.begin(&mesh).unwrap();
        let mut failed = 0;
        let stop = loop {
            match solve.run(&mut Failing(rays(&mesh), 7), keep_going) {
                Ok(stop) => break stop,
                Err(e) => assert_eq!(e.kind(), ErrorKind::Device),
            }
            failed += 1;
            let ledger = solve.solution().unwrap().ledger;
            assert!(ledger.imbalance() <= 1e-9);
            // A direct solve has all its rows at once or none.
            if solver.method == Method::Direct {
                break solve.run(&mut rays(&mesh), keep_going).unwrap();
            }
        };
        println!("{}: failed {failed} times", solver.method);
        assert!(failed > 0 && stop == StopReason::Converged);
        assert_same_bits(&solve.into_solution().unwrap(), &whole);
    }
}

#[test]
#[ignore = "slow"]
fn cancelled_solve_converges_to_same_light() {
    let mesh = cornell_box(300.0);
    for solver in solvers() {
        let whole = Solver { unshot: 1e-12, ..solver };
        let whole = whole.solve(&mesh, &mut rays(&mesh).with_full_share(0.0), keep_going).unwrap();
        let mut solve = Solver { unshot: 1e-12, ..solver }.begin(&mesh).unwrap();
        let (mut calls, mut rows) = (0, rays(&mesh).with_full_share(0.0));
        let stop = loop {
            let every = |_: &Progress| {
                calls += 1;
                if calls % 37 == 0 && solver.method != Method::Direct {
                    ControlFlow::Break(())
                } else {
                    ControlFlow::Continue(())
                }
            };
            match solve.run(&mut rows, every).unwrap() {
                StopReason::Cancelled => {
                    assert!(solve.solution().unwrap().ledger.imbalance() <= 1e-9);
                }
                stop => break stop,
            }
        };
        assert_eq!(stop, StopReason::Converged);
        let s = solve.into_solution().unwrap();
        for (a, b) in s.radiosity.iter().zip(&whole.radiosity) {
            // What 1e-12 of the light can bring, to elements with a thousandth of its mean.
            assert!((*a - *b).abs().cmple(1e-8 * b.abs()).all(), "{}: {a} {b}", solver.method);
        }
    }
}

/// Every method with memory for a part of the rows; GMRES in short cycles.
fn solvers() -> [Solver; 6] {
    Method::ALL.map(|method| {
        let method = match method {
            Method::Gmres { .. } => Method::Gmres { restart: 3 },
            other => other,
        };
        Solver { unshot: 1e-4, row_memory: 100_000, ..Solver::new(method) }
    })
}
