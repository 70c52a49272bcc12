//! `radiosity heat`: a scene, its view factors, sheets, units.

use std::path::Path;

use super::{case, run, texts, write};

/// The rows of the table beside `scene`, by name.
fn table(path: &Path) -> Vec<csv::StringRecord> {
    let mut table = csv::Reader::from_path(path).unwrap();
    table.records().map(Result::unwrap).collect()
}

/// Temperature and net flux of a group.
fn of_group(rows: &[csv::StringRecord], name: &str) -> [f64; 2] {
    let row = rows.iter().find(|row| &row[0] == name).unwrap_or_else(|| panic!("{name}: {rows:?}"));
    [2, 5].map(|column| row[column].parse().unwrap())
}

/// Runs `radiosity heat` on `scene` with the table `known` and more options; the rows of its table,
/// and what it printed.
fn heat(scene: &str, known: &str, more: &[&str]) -> (Vec<csv::StringRecord>, [String; 2]) {
    let folder = tempfile::tempdir().unwrap();
    let known = write(folder.path(), "known.csv", known);
    let out = folder.path().join("heat.csv");
    let files = [scene, "--boundaries", known.to_str().unwrap(), "--out", out.to_str().unwrap()];
    let done = run("heat", &[&files[..], more].concat());
    let said = texts(&done);
    assert!(done.status.success(), "{}", said[1]);
    (table(&out), said)
}

/// A floor, and above it a lid as large, both of 1 m², 1 m apart.
const TWO_SQUARES: &str = "o floor\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n\
                           o lid\nv 0 0 1\nv 0 1 1\nv 1 1 1\nv 1 0 1\nf 5 6 7 8\n";

#[test]
fn heat_of_a_scene_and_of_its_view_factors() {
    let folder = tempfile::tempdir().unwrap();
    let scene = write(folder.path(), "squares.obj", TWO_SQUARES);
    let boundaries = write(
        folder.path(),
        "known.csv",
        "Group, temperature, flux, emissivity\nfloor/1, 500, , 1\n*, , 0, 0.3\n",
    );
    let [scene, boundaries] = [&scene, &boundaries].map(|path| path.to_str().unwrap());
    let out = run("view-factors", &[scene, "--facets", "--format", "npz"]);
    assert!(out.status.success());
    let matrix = scene.replace(".obj", ".npz");
    for input in [&[scene, "--facets"][..], &[&matrix]] {
        let known = ["--boundaries", boundaries, "--surroundings", "300"];
        let out = run("heat", &[input, &known].concat());
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        let mut table = csv::Reader::from_path(scene.replace(".obj", ".heat.csv")).unwrap();
        let rows: Vec<csv::StringRecord> = table.records().map(Result::unwrap).collect();
        assert_eq!([&rows[0][0], &rows[1][0]], ["floor/1", "lid/1"]);
        let number = |row: usize, column: usize| rows[row][column].parse::<f64>().unwrap();
        // Opposite faces of a cube see 0.19982490 of each other. What is adiabatic is as warm as
        // what it sees: σT⁴ = F σ 500⁴ + (1 − F) σ 300⁴.
        let (f, [hot, cold]) = (0.199_824_896, [500f64.powi(4), 300f64.powi(4)]);
        let temperature = (f * hot + (1.0 - f) * cold).powf(0.25);
        assert!((number(1, 2) - temperature).abs() < 1e-5, "{rows:?}");
        let flux = 5.670374419e-8 * (1.0 - f * f) * (hot - cold);
        assert!((number(0, 5) - flux).abs() < 1e-4, "{rows:?}");
        assert_eq!((number(1, 5), number(0, 1)), (0.0, 1.0));
    }
}

#[test]
fn boundaries_that_say_nothing_are_refused_with_their_line() {
    let folder = tempfile::tempdir().unwrap();
    let scene = write(folder.path(), "squares.obj", TWO_SQUARES);
    let head = "group,temperature,flux,emissivity\n";
    for (text, words) in [
        ("group,temperature,flux\n", &["no column 'emissivity'"][..]),
        ("floor,300,1,1\n", &[":2:", "temperature and flux"]),
        ("floor,,,1\n", &[":2:", "neither"]),
        ("floor,300,,1\nlid,300,,x\n", &[":3:", "emissivity 'x'", "give a number"]),
        ("floor,300,,1\nlid,300,,\n", &[":3:", "no emissivity"]),
        ("floor,300,,1\nfloor,302,,1\n", &[":3:", "'floor' a second time"]),
        ("floor,300,,1\n", &["nothing of group 'lid'"]),
        ("roof,300,,1\n*,300,,1\n", &[":2:", "group 'roof'", "not there"]),
        ("floor,300,,1\nlid,300,,7\n", &["group 'lid'", "emissivity 7"]),
    ] {
        let text = if text.starts_with("group") { text.into() } else { format!("{head}{text}") };
        let known = write(folder.path(), "known.csv", &text);
        let [scene, known] = [&scene, &known].map(|path| path.to_str().unwrap());
        let out = run("heat", &[scene, "--boundaries", known]);
        let error = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(1));
        assert!(words.iter().all(|word| error.contains(word)), "{words:?}: {error}");
    }
}

/// σ (773.15⁴ − 293.15⁴): plates of the radiation shield.
const DROP: f64 = 19_842.1;

const SHIELD: [&str; 4] = ["--two-sided", "lead shield", "--surroundings", "293.15"];

fn shield_table(front: &str, back: &str) -> String {
    let plates = "group,temperature,flux,emissivity\ncold,293.15,,1\nhot,773.15,,1\n";
    format!("{plates}lead shield,,0,{front}\n{back}")
}

#[test]
fn shield_between_plates() {
    let shield = case("shield.stl");
    for (emissivity, flux) in [("0.48", 4762.0), ("0.05", 496.0), ("1", 9921.0)] {
        let (rows, _) = heat(&shield, &shield_table(emissivity, ""), &SHIELD);
        let [[_, hot], [_, cold]] = ["hot", "cold"].map(|name| of_group(&rows, name));
        // Plates of 1000 × 1000 half a unit apart: 2e-3 of the emission gets out at the edges.
        assert!((hot - flux).abs() < 2e-3 * flux.max(DROP), "{emissivity}: {rows:?}");
        assert!((cold + flux).abs() < 2e-3 * flux.max(DROP), "{emissivity}: {rows:?}");
        let [[front, taken], [back, given]] =
            ["lead shield", "lead shield (back)"].map(|name| of_group(&rows, name));
        // A fourth of the share of what gets out.
        assert!((front - 653.5).abs() < 0.3 && front == back, "{rows:?}");
        assert!((taken + given).abs() < 1e-9 * DROP && taken.abs() > 0.9 * flux, "{rows:?}");
    }
}

#[test]
fn sheets_have_sides_in_files_facets_and_tables() {
    let folder = tempfile::tempdir().unwrap();
    let shield = case("shield.stl");
    // By view factors of a file.
    let out = folder.path().to_str().unwrap();
    let sides = ["--format", "npz", "--two-sided", "lead shield"];
    assert!(run("view-factors", &[&[&shield, "--out", out], &sides[..]].concat()).status.success());
    let matrix = folder.path().join("shield.npz");
    let matrix = matrix.to_str().unwrap();
    let known = shield_table("0.48", "");
    let (rows, _) = heat(&shield, &known, &SHIELD);
    let (from_file, _) = heat(matrix, &known, &SHIELD[2..]);
    assert_eq!(rows, from_file);
    let table = write(folder.path(), "k.csv", &known);
    let refused =
        run("heat", &[&[matrix, "--boundaries", table.to_str().unwrap()], &SHIELD[..]].concat());
    assert!(texts(&refused)[1].contains("view factors have sides"));
    // Each side its own emissivity: 1/(1/0.48 + 1/0.05) of what passes black plates.
    let (rows, _) = heat(&shield, &shield_table("0.48", "lead shield (back),,,0.05\n"), &SHIELD);
    let [_, hot] = of_group(&rows, "hot");
    assert!((hot - DROP / (1.0 / 0.48 + 1.0 / 0.05)).abs() < 2e-3 * DROP, "{rows:?}");
    // Facets: each is a sheet; a line of the whole back is that of all of them.
    let unlike = shield_table("0.48", "lead shield (back),,,0.05\n");
    let (facets, _) = heat(&shield, &unlike, &[&SHIELD[..], &["--facets"]].concat());
    let power: f64 = (1..=2).map(|k| of_group(&facets, &format!("hot/{k}"))[1] / 2.0).sum();
    assert!((power - hot).abs() < 2e-3 * DROP, "{facets:?}");
    let (rows, _) = heat(&shield, &known, &[&SHIELD[..], &["--facets"]].concat());
    for facet in 1..=2 {
        let [[t, _], [same, _]] =
            ["", " (back)"].map(|side| of_group(&rows, &format!("lead shield/{facet}{side}")));
        assert!(t == same && (t - 653.5).abs() < 0.3, "{rows:?}");
    }
    // A back has no temperature of its own.
    let wrong = shield_table("0.48", "lead shield (back),300,,0.05\n");
    let table = write(folder.path(), "wrong.csv", &wrong);
    let table = table.to_str().unwrap();
    let refused = run("heat", &[&[&shield, "--boundaries", table], &SHIELD[..]].concat());
    let [_, error] = texts(&refused);
    assert!(error.contains("wrong.csv:5:") && error.contains("both sides"), "{error}");
}

#[test]
fn cavity_with_a_group_called_back() {
    // A grey cavity (Howell's closed forms, a box of 1 × 3 × 2).
    let known = "group,temperature,flux,emissivity\nbottom,550,,1\ntop,300,,0.75\n*,,0,0.75\n";
    let (rows, _) = heat(&case("cavity.obj"), known, &["--enforce"]);
    let names: Vec<&str> = rows.iter().map(|row| &row[0]).collect();
    assert_eq!(names, ["bottom", "top", "left", "right", "front", "back"]);
    let [_, flux] = of_group(&rows, "bottom");
    assert!((flux - 2276.0672).abs() < 5e-5, "{rows:?}");
    let [temperature, _] = of_group(&rows, "back");
    assert!((temperature - 487.527).abs() < 5e-4, "{rows:?}");
}

#[test]
fn watts_need_a_unit_of_length() {
    let folder = tempfile::tempdir().unwrap();
    let scene = write(folder.path(), "squares.obj", TWO_SQUARES);
    let scene = scene.to_str().unwrap();
    let known = "group,temperature,flux,emissivity\nfloor,500,,1\nlid,300,,0.3\n";
    let (plain, [said, _]) = heat(scene, known, &[]);
    let line = said.lines().find(|line| line.starts_with("heat:")).unwrap();
    assert!(!line.contains(" W ") && line.contains("W/m²") && said.contains("--unit"), "{said}");
    // Both squares have an area of 1: the mean over both.
    let mean: f64 = line.split_whitespace().nth(1).unwrap().parse().unwrap();
    let [_, flux] = of_group(&plain, "floor");
    assert!((mean - flux / 2.0).abs() < 1e-6 * flux, "{said}");
    for (unit, metres) in [("mm", 1e-3), ("cm", 1e-2), ("m", 1.0), ("in", 0.0254), ("ft", 0.3048)] {
        let (rows, [said, _]) = heat(scene, known, &["--unit", unit]);
        let number = |column: usize| rows[0][column].parse::<f64>().unwrap();
        // Fluxes are the same; areas are in m², powers in W.
        assert_eq!(rows[0][5], plain[0][5]);
        assert!((number(1) - metres * metres).abs() < 1e-15, "{rows:?}");
        assert!((number(7) - metres * metres * flux).abs() < 1e-12 * flux, "{rows:?}");
        let line = said.lines().find(|line| line.starts_with("heat:")).unwrap();
        let watts: f64 = line.split_whitespace().nth(1).unwrap().parse().unwrap();
        assert!((watts - number(7)).abs() < 1e-6 * watts, "{line}");
        assert!(line.contains(" W out of groups") && !said.contains("--unit"), "{said}");
    }
    let wrong = run("heat", &[scene, "--boundaries", "x", "--unit", "yard"]);
    assert!(texts(&wrong)[1].contains("mm, cm, m, in, ft"));
}

#[test]
fn surroundings_have_a_scale() {
    let folder = tempfile::tempdir().unwrap();
    let scene = write(folder.path(), "squares.obj", TWO_SQUARES);
    let scene = scene.to_str().unwrap();
    let known = "group,temperature [K],flux,emissivity\nfloor,4,,1\nlid,,0,0.3\n";
    let lid = |options: &[&str]| of_group(&heat(scene, known, options).0, "lid")[0];
    // σT⁴ = F σ 4⁴ + (1 − F) σ T_s⁴.
    let f = 0.199_824_896;
    let expected = |t: f64| (f * 256.0 + (1.0 - f) * t.powi(4)).powf(0.25);
    for (options, surroundings) in [
        (&["--surroundings", "3K"][..], 3.0),
        (&["--surroundings", "3", "--temperatures", "kelvin"], 3.0),
        (&["--surroundings", "20C"], 293.15),
        (&["--surroundings", "-10°C"], 263.15),
        (&["--surroundings", "68 F"], 293.15),
        (&["--surroundings", "20", "--temperatures", "celsius"], 293.15),
        (&["--surroundings", "293.15"], 293.15),
        (&[], 0.0),
    ] {
        let off = (lid(options) - expected(surroundings)).abs();
        assert!(off < 1e-5 * expected(surroundings), "{options:?}: {off}");
    }
    let table = write(folder.path(), "known.csv", known);
    for (option, words) in [
        ("20", &["--surroundings", "20K or 20C"][..]),
        ("0", &["0K or 0C"]),
        ("20R", &["20C"]),
        ("warm", &["293.15"]),
    ] {
        let files = [scene, "--boundaries", table.to_str().unwrap()];
        let out = run("heat", &[&files[..], &["--surroundings", option]].concat());
        let [_, error] = texts(&out);
        assert!(!out.status.success(), "{option}");
        assert!(words.iter().all(|word| error.contains(word)), "{option}: {error}");
    }
}

#[test]
fn oddities_of_the_scene_are_printed() {
    let folder = tempfile::tempdir().unwrap();
    // A face without area.
    let text = format!("{TWO_SQUARES}f 5 5 6\n");
    let scene = write(folder.path(), "odd.obj", &text);
    let known = "group,temperature,emissivity\n*,300,1\n";
    let (_, [_, warned]) = heat(scene.to_str().unwrap(), known, &[]);
    assert!(warned.contains("warning: 1 "), "{warned}");
}
