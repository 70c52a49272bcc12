//! View factors as tables.

use std::ops::ControlFlow;

use radiosity::io::view_factors::write_csv_matrix;
use radiosity::{Material, Mesh, RayRows, ViewFactors};

use crate::common::cube;

#[test]
fn matrix_csv_reads_back() {
    let mesh = Mesh::new(cube(&Material::grey("g", 0.5)), 0.36).unwrap();
    let mut rays = RayRows::new(&mesh, 4096).unwrap();
    let mut done = vec![];
    let matrix = ViewFactors::sampled(&mesh, &mut rays, |k, of| {
        done.push((k, of));
        ControlFlow::Continue(())
    });
    let mut matrix = matrix.unwrap().unwrap();
    assert_eq!(done.last(), Some(&(192, 192)));
    for i in 0..6 {
        assert!((matrix.areas[i] - 1.0).abs() < 1e-14);
        let sum: f64 = matrix.factors[i].iter().map(|f| f.value).sum();
        assert!((sum + matrix.open[i].value + matrix.back[i].value - 1.0).abs() < 1e-8);
        for j in 0..6 {
            // 0.1998 for opposite walls, (1 − 0.1998)/4 = 0.2000 for the others. 32 rows of 4096
            // rays: 0.0011 in a standard error; elements of 0.35 see the next wall from their
            // centroids, which costs up to 0.01.
            let want = if i == j { 0.0 } else { 0.2 };
            assert!((matrix.factor(i, j).value - want).abs() < 0.015, "{i} {j}");
        }
    }
    matrix.names[1] = "a \"b\", c".into();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cube.csv");
    write_csv_matrix(&path, &matrix).unwrap();
    let text = std::fs::read_to_string(path).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 7);
    assert_eq!(lines[0], "F from row to column,q0,\"a \"\"b\"\", c\",q2,q3,q4,q5,open,back,area");
    let first: Vec<&str> = lines[1].split(',').collect();
    assert_eq!((first[0], first.len()), ("q0", 10));
    assert!((first[2].parse::<f64>().unwrap() - matrix.factor(0, 1).value).abs() < 1e-9);
    let stopped = ViewFactors::sampled(&mesh, &mut rays, |_, _| ControlFlow::Break(()));
    assert!(stopped.unwrap().is_none());
}
