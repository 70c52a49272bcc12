//! `radiosity grid` and `radiosity probes`, under a sky alone: π times its radiance from above.

use std::f64::consts::PI;
use std::path::{Path, PathBuf};

use super::{device, run, write};

/// A black ground of 6 m by 4 m in millimetres, and a block on it without a bottom.
pub fn ground(folder: &Path) -> PathBuf {
    let scene = "mtllib ground.mtl\nusemtl black\n\
                 o ground\nv 0 0 0\nv 6000 0 0\nv 6000 4000 0\nv 0 4000 0\nf 1 2 3 4\n\
                 o block\nv 1000 1000 0\nv 2000 1000 0\nv 2000 2000 0\nv 1000 2000 0\n\
                 v 1000 1000 2000\nv 2000 1000 2000\nv 2000 2000 2000\nv 1000 2000 2000\n\
                 f 5 6 10 9\nf 6 7 11 10\nf 7 8 12 11\nf 8 5 9 12\nf 9 10 11 12\n";
    write(folder, "ground.mtl", "newmtl black\nKd 0 0 0\n");
    write(folder, "ground.obj", scene)
}

/// The lines of a CSV file as words, its header first.
pub fn table(path: &Path) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(path).unwrap();
    text.lines().map(|line| line.split(',').map(String::from).collect()).collect()
}

pub fn number(word: &str) -> f64 {
    word.parse().unwrap()
}

#[test]
fn grid_measures_above_each_floor_and_above_groups() {
    let folder = tempfile::tempdir().unwrap();
    let scene = ground(folder.path());
    let mut args = vec![scene.to_str().unwrap(), "--unit", "mm", "--photometric"];
    args.extend(["--sky", "100", "--up", "0,0,1"]);
    args.extend(device());
    let out = run("grid", &args);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let said = String::from_utf8_lossy(&out.stdout);
    let rows = table(&folder.path().join("ground.grid.csv"));
    assert_eq!(rows[0][..7], ["grid", "column", "row", "x", "y", "z", "illuminance"]);
    // 5 m by 3 m, with p = 0.616 m.
    assert_eq!(rows.len(), 1 + 9 * 5);
    let mut inside = 0;
    for row in &rows[1..] {
        assert_eq!((row[0].as_str(), row[5].as_str()), ("1 ground", "800"));
        let within = |word: &str| number(word) > 1000.0 && number(word) < 2000.0;
        assert_eq!(row[11] == "1", within(&row[3]) && within(&row[4]), "{row:?}");
        inside += usize::from(row[11] == "1");
        assert!(number(&row[6]) < 100.0 * PI * (1.0 + 1e-9));
    }
    // Far from the block there is next to nothing but sky.
    assert!((number(&rows.last().unwrap()[6]) / (100.0 * PI) - 1.0).abs() < 0.05, "{said}");
    assert!(inside > 0 && said.contains(&format!("{inside} inside of solids")), "{said}");
    assert!(said.contains("1 ground: mean") && said.contains(" lx ± "), "{said}");
    let picture = image_size(&folder.path().join("ground.grid.png"));
    assert!(picture.0 > 700 && picture.1 > 400, "{picture:?}");

    let stem = folder.path().join("tops");
    args.extend(["--group", "block", "--out", stem.to_str().unwrap()]);
    args.extend(["--plane", "4000,0,3000,1000,0,0,0,1000,0", "--spacing", "1"]);
    let out = run("grid", &args);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let rows = table(&folder.path().join("tops.grid.csv"));
    assert_eq!(rows.len(), 3, "{rows:?}");
    for (row, (name, x, z)) in
        rows[1..].iter().zip([("1 block", 1500.0, 2000.0), ("2 plane", 4500.0, 3000.0)])
    {
        assert_eq!((row[0].as_str(), number(&row[3]), number(&row[5])), (name, x, z));
        assert!((number(&row[6]) / (100.0 * PI) - 1.0).abs() < 1e-9, "{row:?}");
    }
    assert!(folder.path().join("tops.grid-2.png").exists());

    args.extend(["--group", "table"]);
    let out = run("grid", &args);
    let error = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.code() == Some(1) && error.contains("'ground', 'block'"), "{error}");
}

/// Measured irradiance in lux: DNI and DHI times the efficacy of each, as tested in
/// `scene::solar_irradiance`; the sun 40° from the zenith, at its mean distance.
#[test]
fn measured_irradiance_is_converted_to_lux() {
    let folder = tempfile::tempdir().unwrap();
    let scene = ground(folder.path());
    let (sine, cosine) = 40f64.to_radians().sin_cos();
    let sun = format!("{sine},0,{cosine}");
    let mut args = vec![scene.to_str().unwrap(), "--unit", "mm", "--group", "block"];
    args.extend(["--up", "0,0,1", "--sky", "irradiance:850,90,5", "--sun", &sun, "--cpu"]);
    for (more, truth) in [
        (&["--photometric"][..], 850.0 * cosine * 102.140_409_206 + 90.0 * 137.567_988_611),
        (&[], 850.0 * cosine + 90.0),
    ] {
        let out = run("grid", &[&args, more].concat());
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        let rows = table(&folder.path().join("ground.grid.csv"));
        // The share of the sky, 12 %, by some hundred rays: within 5 % of itself.
        for row in &rows[1..] {
            assert!((number(&row[6]) / truth - 1.0).abs() < 6e-3, "{row:?} {truth}");
        }
    }
}

/// Width and height of a PNG image, by its header.
fn image_size(path: &Path) -> (u32, u32) {
    let bytes = std::fs::read(path).unwrap();
    let number = |at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap());
    (number(16), number(20))
}

#[test]
fn probes_are_written_as_json_and_csv() {
    let folder = tempfile::tempdir().unwrap();
    let scene = ground(folder.path());
    let mut args = vec![scene.to_str().unwrap(), "--counts", "6,4,2", "--sky", "100"];
    args.extend(["--up", "0,0,1", "--box", "0,0,0,6000,4000,2000"]);
    args.extend(device());
    let out = run("probes", &args);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let rows = table(&folder.path().join("ground.probes.csv"));
    assert_eq!((rows.len(), rows[0].len()), (1 + 48, 7 + 27));
    let text = std::fs::read_to_string(folder.path().join("ground.probes.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(json["counts"], serde_json::json!([6, 4, 2]));
    assert_eq!(json["basis"].as_array().unwrap().len(), 9);
    let probes = json["probes"].as_array().unwrap();
    for (row, probe) in rows[1..].iter().zip(probes) {
        for (word, value) in [
            (&row[2], &probe["position"][2]),
            (&row[6], &probe["deviation"]),
            (&row[7 + 3 * 2], &probe["irradiance"][2][0]),
        ] {
            // The last digit is read as it comes.
            assert!((number(word) - value.as_f64().unwrap()).abs() <= 1e-12 * number(word).abs());
        }
        assert_eq!(row[3] == "1", probe["inside"].as_bool().unwrap());
    }
    assert_eq!(rows.len() - 1, probes.len());
    // The cell of the block, below and above: its middle is inside, or sees the top from within.
    let inside = probes.iter().filter(|probe| probe["inside"] == true).count();
    assert_eq!(inside, 2);
    // Over the ground half of all is sky: E(up) is nearly 100 π, E(down) next to none.
    let last = |k: usize| number(&rows[48][7 + 3 * k]);
    let at = |z: f64| {
        (1.0 / PI).sqrt() / 2.0 * last(0)
            + (3.0 / PI).sqrt() / 2.0 * z * last(2)
            + (5.0 / PI).sqrt() / 4.0 * (3.0 * z * z - 1.0) * last(6)
    };
    assert!((at(1.0) / (100.0 * PI) - 1.0).abs() < 0.05, "{}", at(1.0));
}

/// A closed room, 3 m high along z, with these names of its floor and its ceiling: its shape says
/// nothing about which way is up.
fn shoebox(folder: &Path, [floor, ceiling]: [&str; 2]) -> PathBuf {
    let scene = format!(
        "v 0 0 0\nv 6 0 0\nv 6 4 0\nv 0 4 0\nv 0 0 3\nv 6 0 3\nv 6 4 3\nv 0 4 3\n\
         g {floor}\nf 1 2 3 4\ng {ceiling}\nf 8 7 6 5\n\
         g s\nf 1 5 6 2\ng n\nf 3 7 8 4\ng w\nf 1 4 8 5\ng e\nf 2 6 7 3\n"
    );
    write(folder, "shoebox.obj", &scene)
}

/// Which way is up follows from names, and from where luminaires hang; it is printed, and warned of
/// where nothing says it.
#[test]
fn up_follows_from_names_and_luminaires() {
    let folder = tempfile::tempdir().unwrap();
    let even = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1 9\n0 90\n0\n100 100\n";
    let lamp = write(folder.path(), "lamp.ies", even).display().to_string();
    let up = |names, at: &str, more: &[&str]| {
        let scene = shoebox(folder.path(), names).display().to_string();
        let lamp = format!("{lamp}@{at}");
        let mut args = vec![&scene, "--photometric", "--luminaire", &lamp, "--error", "0.2"];
        args.extend(more);
        args.extend(device());
        let out = run("grid", &args);
        let said = String::from_utf8(out.stderr).unwrap();
        let rows = table(&folder.path().join("shoebox.grid.csv"));
        let line = said.lines().find(|line| line.starts_with("up: ")).map(String::from);
        (line.unwrap(), said.contains("--up"), rows[1][0].clone(), number(&rows[1][5]))
    };
    let names = "up: +z, from surfaces named 'Floor', 'Ceiling'";
    let high = "3,2,2.9";
    let found = up(["Floor", "Ceiling"], "3,2,1.5", &[]);
    assert_eq!(found, (names.into(), false, "1 Floor".into(), 0.8));
    let lamps = "up: +z, from luminaires near the top along +z";
    assert_eq!(up(["a", "b"], high, &[]), (lamps.into(), false, "1 a".into(), 0.8));
    let given = up(["a", "b"], "3,2,1.5", &["--up", "0,0,1"]);
    assert_eq!(given, ("up: +z".into(), false, "1 a".into(), 0.8));
    let (line, warned, grid, _) = up(["a", "b"], "3,2,1.5", &[]);
    assert_eq!(line, "up: +y, the default of OBJ files");
    assert!(warned && grid == "1 s", "{grid}");
}
