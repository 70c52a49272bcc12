//! Rows that break the contract of `FormFactors` are refused, whoever asked for them.

use radiosity::form_factor::{Entry, ProximityCorrection, Row};
use radiosity::mesh::NodeId;
use radiosity::solver::Method;
use radiosity::{Error, ErrorKind, FormFactors, Mesh, Solver};

use crate::common::closed_forms::exact;
use crate::common::fakes::GivenRows;
use crate::common::scenes::paint;
use crate::common::{cube, keep_going};

/// The same row for every patch, but `missing` rows too few.
struct RepeatedRow {
    row: Row,
    missing: usize,
}

impl FormFactors for RepeatedRow {
    fn rows(&mut self, _: &Mesh, patches: &[NodeId], _: f64) -> Result<Vec<Row>, Error> {
        Ok(vec![self.row.clone(); patches.len().saturating_sub(self.missing)])
    }
}

#[test]
fn every_user_rejects_invalid_rows() {
    let mesh = Mesh::new(cube(&paint(0.5, 1.0)), 0.3).unwrap();
    let row = |element: u32, share: u32, escaped: u32| {
        let entries = vec![Entry { element, share }];
        Row { entries, escaped, ..Row::default() }
    };
    let total = Row::TOTAL;
    // An element that does not exist; sums too small, too large and beyond 32 bits; a row missing.
    let bad = [
        (row(1 << 30, total, 0), 0),
        (row(1, 5, 0), 0),
        (row(1, total, 1), 0),
        (row(1, total, total), 0),
        (row(1, total, 0), 1),
    ];
    let patch = [mesh.root(0)];
    for (row, missing) in bad {
        let given = || RepeatedRow { row: row.clone(), missing };
        let near = || ProximityCorrection::new(given(), &mesh, 1e9);
        let errors = [
            Solver::new(Method::ALL[0]).solve(&mesh, &mut given(), keep_going).unwrap_err(),
            near().rows(&mesh, &patch, 1.0).unwrap_err(),
        ];
        for e in errors {
            assert_eq!(e.kind(), ErrorKind::FormFactor, "{e}");
        }
    }
}

#[test]
fn shooting_rejects_invalid_rows() {
    let mesh = Mesh::new(cube(&paint(0.8, 1.0)), 2.0).unwrap();
    let half = Row::TOTAL / 2;
    let entry = |element, share| Entry { element, share };
    let good =
        Row { entries: vec![entry(1, half), entry(3, Row::TOTAL - half)], ..Default::default() };
    let bad = [
        vec![],
        vec![good.clone(), good.clone()],
        vec![Row { escaped: half, ..Default::default() }],
        vec![Row { escaped: 1, ..good.clone() }],
        vec![Row {
            entries: vec![entry(3, half), entry(1, Row::TOTAL - half)],
            ..Default::default()
        }],
        vec![Row { entries: vec![entry(12, Row::TOTAL)], ..Default::default() }],
        vec![Row { passed: vec![[0; 3]; 3], ..good.clone() }],
        vec![Row { passed: vec![[0; 3]; 5], ..good.clone() }],
    ];
    for rows in bad {
        let e = Solver::default().solve(&mesh, &mut GivenRows(rows), keep_going).unwrap_err();
        assert_eq!(e.kind(), ErrorKind::FormFactor, "{e}");
    }
    let one = Solver { max_steps: Some(1), ..Default::default() };
    assert!(one.solve(&mesh, &mut GivenRows(vec![good]), keep_going).is_ok());
    for unshot in [-0.1, 1.1, f64::NAN] {
        let settings = Solver { unshot, ..Default::default() };
        let e = settings.solve(&mesh, &mut exact(), keep_going).unwrap_err();
        assert_eq!(e.kind(), ErrorKind::Setting);
    }
}
