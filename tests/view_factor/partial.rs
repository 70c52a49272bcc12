//! Rows made by several, in one process or many: the same bits.

use std::ops::{ControlFlow, Range};

use radiosity::view_factor::{Missing, PartialMatrix};
use radiosity::{ErrorKind, Scene, ViewFactors};

use super::sparse::town;
use crate::common::keep_counting;
use crate::common::processes::in_processes;
use crate::common::scenes::{cube, grey};

const ERROR: f64 = 0.2;

fn go(_: &PartialMatrix, _: usize, _: usize) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

fn rows(scene: &Scene, groups: Range<usize>, done: Option<PartialMatrix>) -> PartialMatrix {
    PartialMatrix::make(scene, ERROR, &[], groups, done, go).unwrap()
}

/// An exact scene, and one that is too large for that.
fn scenes() -> [(Scene, Missing); 2] {
    [(cube(&grey()), Missing::Zero), (town(15), Missing::Unmet)]
}

fn whole(scene: &Scene, absent: Missing) -> ViewFactors {
    let matrix = ViewFactors::new(scene, ERROR, &[], keep_counting).unwrap().unwrap();
    assert_eq!(matrix.absent, absent);
    matrix
}

#[test]
fn rows_in_any_order_make_the_same_matrix() {
    for (scene, absent) in scenes() {
        let expected = whole(&scene, absent);
        let n = scene.groups().len();
        let parts = [4..n, 0..1, 1..4].map(|groups| rows(&scene, groups, None));
        assert_eq!(parts[1].missing(), (1..n).collect::<Vec<_>>());
        let error = parts[1].clone().into_matrix().unwrap_err();
        assert!(error.to_string().contains(&format!("rows of {} groups missing", n - 1)));
        let kept = parts.map(|part| PartialMatrix::from_bytes(&part.to_bytes()).unwrap());
        let merged = PartialMatrix::merge(kept).unwrap();
        assert_eq!(merged.missing(), [0; 0]);
        assert_eq!(merged.into_matrix().unwrap(), expected);
    }
}

#[test]
fn what_was_stopped_goes_on() {
    for (scene, absent) in scenes() {
        let n = scene.groups().len();
        // Many threads would make all rows at once.
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let stopped = one.install(|| {
            PartialMatrix::make(&scene, ERROR, &[], 0..n, None, |part, _, _| {
                match part.missing().len() < n {
                    true => ControlFlow::Break(()),
                    false => ControlFlow::Continue(()),
                }
            })
        });
        let stopped = stopped.unwrap();
        let left = stopped.missing().len();
        assert!(left > 0 && left < n, "{left} of {n}");
        let whole_again = rows(&scene, 0..n, Some(stopped)).into_matrix().unwrap();
        assert_eq!(whole_again, whole(&scene, absent));
    }
}

#[test]
fn first_of_any_number_of_processes_makes_the_same_matrix() {
    for (scene, absent) in scenes() {
        let expected = whole(&scene, absent);
        let n = scene.groups().len();
        for size in [2, 3] {
            let made = in_processes(size, |_| {
                PartialMatrix::make(&scene, ERROR, &[], 0..n, None, go).unwrap()
            });
            let missing: Vec<usize> = made.iter().map(|part| part.missing().len()).collect();
            assert_eq!((missing[0], &missing[1..]), (0, &vec![n; size - 1][..]), "of {n}");
            let first = made.into_iter().next().unwrap();
            assert_eq!(first.into_matrix().unwrap(), expected, "{size} processes");
        }
    }
}

#[test]
fn one_process_stops_all() {
    let (scene, _) = &scenes()[1];
    let left = in_processes(2, |rank| {
        let stops = rank == 1;
        let part = PartialMatrix::make(scene, ERROR, &[], 0..5, None, |_, _, _| match stops {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        });
        part.unwrap().missing().len()
    });
    // It is told so after the first rays, before there is a row.
    assert_eq!(left, [scene.groups().len(); 2]);
}

#[test]
fn other_scenes_and_settings_are_refused() {
    let [(scene, _), (other, _)] = scenes();
    let part = rows(&scene, 0..2, None);
    let coarse = PartialMatrix::make(&scene, 0.5, &[], 0..6, None, go).unwrap();
    for wrong in [coarse, rows(&other, 0..1, None)] {
        let error = PartialMatrix::merge([part.clone(), wrong.clone()]).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Setting);
        assert!(error.to_string().contains("part 2") && error.to_string().contains("another"));
        let error = PartialMatrix::make(&scene, ERROR, &[], 0..6, Some(wrong), go);
        assert!(error.unwrap_err().to_string().contains("another scene"));
    }
    assert!(PartialMatrix::merge([]).unwrap_err().to_string().contains("none"));
    let error = PartialMatrix::make(&scene, ERROR, &[], 2..7, None, go).unwrap_err();
    assert!(error.to_string().contains("2..7; the matrix has 6 rows"), "{error}");
}

#[test]
fn bytes_that_are_damaged_are_refused() {
    let bytes = rows(&cube(&grey()), 0..6, None).to_bytes();
    for at in 0..bytes.len() {
        let mut damaged = bytes.clone();
        damaged[at] ^= 1;
        let error = PartialMatrix::from_bytes(&damaged).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::File, "byte {at}");
        assert!(PartialMatrix::from_bytes(&bytes[..at]).is_err(), "cut at {at}");
    }
}
