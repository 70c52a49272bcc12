//! View factors as tables.

use radiosity::io::view_factors::write_csv_matrix;

use crate::common::cube;
use crate::common::scenes::grey;
use crate::common::view_factors::exact_view_factors;

#[test]
fn matrix_csv_reads_back() {
    let mut matrix = exact_view_factors(&cube(&grey()), 1e-4);
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
}
