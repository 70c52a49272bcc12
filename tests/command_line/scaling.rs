//! `--costs` and `radiosity scaling`: how long a run would take on many processes.

use std::fs;

use crate::{cornell, run, texts};

/// The columns of each line of numbers.
fn table(text: &str) -> Vec<Vec<f64>> {
    let numbers = |line: &str| line.split_whitespace().map(str::parse).collect::<Result<_, _>>();
    text.lines()
        .filter_map(|line| numbers(line).ok())
        .filter(|row: &Vec<f64>| !row.is_empty())
        .collect()
}

#[test]
fn costs_of_a_bake_tell_its_time_on_more_processes() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let [plain, recorded, costs] = ["plain", "recorded", "costs.json"].map(path);
    let bake = |out: &str, more: &[&str]| {
        let args = [cornell(), "--cpu", "--error", "0.05", "--write", "ply", "--out", out];
        let out = run("bake", &[&args[..], more].concat());
        assert!(out.status.success(), "{:?}", texts(&out));
    };
    bake(&plain, &[]);
    bake(&recorded, &["--costs", &costs]);
    let ply = |out: &str| fs::read(format!("{out}.ply")).unwrap();
    assert!(ply(&plain) == ply(&recorded), "recording changes nothing");
    let before = fs::read(&costs).unwrap();
    let out = run("scaling", &[&costs, "--processes", "1,2,64"]);
    let [said, told] = texts(&out);
    assert!(out.status.success(), "{told}");
    assert!(fs::read(&costs).unwrap() == before, "costs are read, not written");
    let rows = table(&said);
    assert_eq!(rows.iter().map(|row| row[0]).collect::<Vec<_>>(), [1.0, 2.0, 64.0], "{said}");
    for row in &rows {
        let [processes, seconds, efficiency, shared, own, waiting, exchange] = row[..] else {
            panic!("{said}")
        };
        // Rounded to hundredths; efficiency to thousandths.
        assert!((shared + own + waiting + exchange - seconds).abs() < 0.03, "{said}");
        assert!(seconds > 0.0 && own > 0.0 && efficiency <= 1.0, "{said}");
        assert!((shared - rows[0][3] / processes).abs() < 0.02, "{said}");
        assert_eq!(waiting + exchange > 0.0, processes > 1.0, "{said}");
    }
    // A scene ten times as large takes ten times as long on one process.
    let [larger, _] = texts(&run("scaling", &[&costs, "--processes", "1", "--times", "10"]));
    assert!((table(&larger)[0][1] / rows[0][1] - 10.0).abs() < 0.2, "{larger}{said}");
}

#[test]
fn what_has_no_costs_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("costs.json").display().to_string();
    let refused = |args: &[&str], status: i32, words: &[&str]| {
        let out = run("scaling", args);
        let [_, told] = texts(&out);
        assert_eq!(out.status.code(), Some(status), "{told}");
        words.iter().for_each(|word| assert!(told.contains(word), "'{word}' not in {told}"));
    };
    refused(&[&path], 1, &["costs.json", "--costs"]);
    fs::write(&path, "{\"threads\":1,\"events\":[{\"Own\":-3}]}").unwrap();
    refused(&[&path], 1, &["costs.json", "column", "--costs"]);
    fs::write(&path, "{\"threads\":1,\"events\":[{\"Own\":3}]}").unwrap();
    refused(&[&path, "--processes", "0"], 2, &["--processes"]);
    refused(&[&path, "--bandwidth", "0"], 2, &["--bandwidth"]);
    refused(&[&path, "--latency", "-1"], 2, &["--latency"]);
    refused(&[&path, "--times", "none"], 2, &["--times"]);
}
