//! `radiosity trade-off`: all runs in a table, by the measure that the options give.

use std::fs;

use crate::{lit_plates, run, texts};

#[test]
fn trade_off_measures_with_and_without_the_tail() {
    let folder = tempfile::tempdir().unwrap();
    let scene = lit_plates(folder.path());
    // A shelf between floor and lamp: shadows have errors, and at their edges the largest.
    let shelf = "usemtl grey\no shelf\nv 0.3 0.3 0.3\nv 0.8 0.3 0.3\nv 0.8 0.8 0.3\n\
                 v 0.3 0.8 0.3\nf 9 10 11 12\n";
    fs::write(&scene, fs::read_to_string(&scene).unwrap() + shelf).unwrap();
    let (scene, stem) = (scene.display().to_string(), folder.path().join("out"));
    let mut args = vec![&*scene, "--quick", "--cpu", "--tail", "0.05", "--precision", "0.3"];
    args.extend(["--out", stem.to_str().unwrap()]);
    let out = run("trade-off", &args);
    let [said, told] = texts(&out);
    assert!(out.status.success(), "{told}");
    let text = fs::read_to_string(stem.with_extension("csv")).unwrap();
    let rows: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
    let column = |name: &str| rows[0].iter().position(|head| *head == name).expect(name);
    let numbers = |name: &str| -> Vec<f64> {
        let column = column(name);
        rows[1..].iter().map(|row| row[column].parse().expect(name)).collect()
    };
    let [error, with_tail] = ["error", "error_with_tail"].map(numbers);
    let [off, off_with_tail] = ["standard_error", "standard_error_with_tail"].map(numbers);
    for k in 0..error.len() {
        assert!(0.0 < error[k] && error[k] < 0.95 * with_tail[k], "{text}");
        assert!(off[k] > 0.0 && off_with_tail[k] > 0.0, "{text}");
    }
    // The first run is the finest; points and paths are as many as its error takes.
    assert!(off[0] <= 0.3 * error[0] && error[0] < 0.02, "{text}");
    assert!(numbers("seconds").iter().all(|&seconds| seconds > 0.0));
    for name in ["solve.element_size", "gather.rays"] {
        assert!(rows[1][column(name)].parse::<f64>().unwrap() > 0.0, "{name}");
    }
    assert!(said.contains("without the 5 % of"), "{said}");
    let best = said.lines().filter(|line| line.ends_with("best")).count();
    assert_eq!(best as f64, numbers("best").iter().sum::<f64>(), "{said}");
    assert!(best > 0 && stem.with_extension("png").exists());
}
