//! Requests for rows are short whatever a source prefers, and progress is reported between them.

use std::ops::ControlFlow;

use radiosity::form_factor::Row;
use radiosity::mesh::NodeId;
use radiosity::solver::{Method, StopReason};
use radiosity::{Error, FormFactors, Mesh, Solver};

use crate::common::cornell_box;

/// Sends all light away; notes the number of rows of each request, and prefers all in one.
#[derive(Default)]
struct Requests(Vec<usize>);

impl FormFactors for Requests {
    fn rows(&mut self, _: &Mesh, patches: &[NodeId], _: f64) -> Result<Vec<Row>, Error> {
        self.0.push(patches.len());
        Ok(vec![Row { escaped: Row::TOTAL, ..Default::default() }; patches.len()])
    }

    fn preferred_batch_len(&self) -> usize {
        100_000
    }
}

/// The requests of a solve by `method` until the callback's `last` call, and the number of calls.
fn requests(mesh: &Mesh, method: Method, last: usize) -> (Vec<usize>, usize, StopReason) {
    let (mut source, mut calls) = (Requests::default(), 0);
    let solver = Solver { patch_tolerance: 0.0, unshot: 0.0, ..Solver::new(method) };
    let solution = solver.solve(mesh, &mut source, |_| {
        calls += 1;
        if calls == last { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    (source.0, calls, solution.unwrap().stop)
}

#[test]
fn no_request_is_longer_than_twice_the_longest_before() {
    // The lamp has 512 elements, all of which shoot at once.
    let mesh = cornell_box(20.0);
    for method in [Method::Shooting { overshoot: false }, Method::GaussSeidel] {
        let (requests, calls, _) = requests(&mesh, method, usize::MAX);
        println!("{method}: {requests:?}, {calls} calls");
        assert!(requests.iter().sum::<usize>() >= 512, "{requests:?}");
        let mut longest = 8;
        for &rows in &requests {
            assert!(rows <= 2 * longest, "{requests:?}");
            longest = longest.max(rows);
        }
        assert!(calls >= requests.len(), "{calls} calls for {requests:?}");
    }
}

#[test]
fn a_break_between_requests_of_a_batch_stops_the_solver() {
    let mesh = cornell_box(20.0);
    let (requests, calls, stop) = requests(&mesh, Method::Shooting { overshoot: false }, 1);
    assert_eq!((requests, calls, stop), (vec![16], 1, StopReason::Cancelled));
}
