//! `bake --bands`: what it writes, and how it refuses files of bands.

use std::path::Path;

use super::{cornell, refused, run, write};

/// The measured spectra of the Cornell box.
fn spectra() -> &'static str {
    concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.bands.json")
}

/// Arguments of a coarse bake of the Cornell box to `stem`.
fn coarse<'a>(stem: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let coarse = [
        "--cpu",
        "--gather",
        "needed",
        "--set",
        "gather.element_size=300",
        "--set",
        "max_elements=1",
    ];
    let quick =
        ["--set", "solve.element_size=300", "--set", "rays=128", "--image", "32,32", "--out", stem];
    [&[cornell()], &coarse[..], &quick, more].concat()
}

/// Bakes the Cornell box coarsely to `stem`, with more arguments.
fn bake(stem: &Path, more: &[&str]) -> String {
    let out = run("bake", &coarse(stem.to_str().unwrap(), more));
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    String::from_utf8(out.stdout).unwrap()
}

/// The header of a PLY file.
fn header(path: &Path) -> String {
    let bytes = std::fs::read(path).unwrap();
    let text = String::from_utf8_lossy(&bytes).into_owned();
    text.split("end_header").next().unwrap().to_string()
}

#[test]
fn bands_are_written_beside_what_is_always_written() {
    let folder = tempfile::tempdir().unwrap();
    let (with, without) = (folder.path().join("with"), folder.path().join("without"));
    bake(&without, &["--write", "ply,png,glb"]);
    let table = bake(&with, &["--write", "ply,png,exr,glb,json,csv", "--bands", spectra()]);
    assert!(table.contains("bands      76, error at most about"), "{table}");
    // Red, green and blue are what they are without bands.
    for ending in ["ply", "png", "glb"] {
        let [a, b] =
            [&with, &without].map(|stem| std::fs::read(stem.with_added_extension(ending)).unwrap());
        assert!(a == b, "{ending} differs");
    }
    let ply = header(&with.with_added_extension("bands.ply"));
    for property in ["radiosity_400", "irradiance_548", "error_700"] {
        assert!(ply.contains(&format!("property float {property}\n")), "{ply}");
    }
    assert!(ply.contains("property uchar red"), "{ply}");
    assert!(with.with_added_extension("bands.png").exists());
    assert!(with.with_added_extension("bands.exr").exists());
    let csv = std::fs::read_to_string(with.with_added_extension("bands.csv")).unwrap();
    let mut lines = csv.lines();
    let columns: Vec<&str> = lines.next().unwrap().split(',').collect();
    assert_eq!(columns.len(), 3 + 3 * 76);
    assert_eq!(columns[..4], ["x", "y", "z", "radiosity_400"]);
    let vertices: usize = ply
        .lines()
        .find_map(|line| line.strip_prefix("element vertex "))
        .and_then(|count| count.parse().ok())
        .unwrap();
    assert_eq!(lines.count(), vertices);
    let report = std::fs::read_to_string(with.with_added_extension("json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    assert_eq!(report["bands"].as_array().unwrap().len(), 76);
    assert_eq!(report["bands"][1]["wavelength"], 404.0);
    // The lamp emits nothing at 400 nm, and 8.32 % of 8 at 404.
    assert_eq!(report["bands"][0]["noise"], 0.0);
    assert!(report["bands"][1]["error"].as_f64().unwrap() > 0.0);
}

#[test]
fn bands_without_wavelengths_have_no_colours() {
    let folder = tempfile::tempdir().unwrap();
    let (stem, file) = (folder.path().join("named"), folder.path().join("named.json"));
    let named = r#"{"bands": ["visible", "heat"], "materials": {
        "*": {"reflectance": [0.5, 0.8]},
        "light": {"reflectance": 0, "emission": [1, 3]}}}"#;
    std::fs::write(&file, named).unwrap();
    bake(&stem, &["--write", "ply,png", "--bands", file.to_str().unwrap()]);
    let ply = header(&stem.with_added_extension("bands.ply"));
    assert!(ply.contains("radiosity_visible") && ply.contains("error_heat"), "{ply}");
    assert!(!ply.contains("uchar red") && !stem.with_added_extension("bands.png").exists());
}

#[test]
fn state_of_other_bands_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let state = folder.path().join("box.state").display().to_string();
    let of = |reflectance: &str| {
        let text = r#"{"bands": [400], "materials": {"*": {"reflectance": R}}}"#;
        write(folder.path(), "spectra.json", &text.replace('R', reflectance)).display().to_string()
    };
    let stem = folder.path().join("box");
    let (same, other) = (of("0.5"), folder.path().join("other").display().to_string());
    bake(&stem, &["--state", &state, "--bands", &same]);
    bake(&stem, &["--state", &state, "--bands", &same]);
    // The same path, with another content.
    assert_eq!(of("0.6"), same);
    refused(&coarse(&other, &["--state", &state, "--bands", &same]), &["box.state", "other"]);
}

#[test]
fn bad_files_of_bands_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let materials = r#""materials": {"*": {"reflectance": 0.5}}"#;
    let missing = folder.path().join("missing.json");
    refused(&[cornell(), "--bands", missing.to_str().unwrap()], &["missing.json", "be read"]);
    let cases = [
        ("{", vec!["bad.json:1", "EOF"]),
        (r#"{"bands": [1, 2]}"#, vec!["`materials`"]),
        (r#"{"bands": [400], "materials": {"*": {"reflektance": 1}}}"#, vec!["reflektance"]),
        (r#"{"bands": [[400]], MATERIALS}"#, vec!["a wavelength in nm, a name"]),
        (r#"{"bands": [400], "sky": "blue", MATERIALS}"#, vec!["a number for all bands"]),
        (r#"{"bands": [400], "sky": [1, 2], MATERIALS}"#, vec!["sky", "2 values for 1 bands"]),
        (r#"{"bands": [400], "sky": {"450": 1}, MATERIALS}"#, vec!["nothing for band 400"]),
        (r#"{"bands": ["a"], "sky": {"450": 1}, MATERIALS}"#, vec!["has no wavelength"]),
        (r#"{"bands": [400], "sky": {"x": 1}, MATERIALS}"#, vec!["'x'", "by numbers"]),
        (r#"{"bands": [400], "materials": {"chrome": {"reflectance": 0}}}"#, vec!["'chrome'"]),
        (r#"{"bands": [400], "materials": {"red": {"reflectance": 0}}}"#, vec!["'white'", "*"]),
        (r#"{"bands": [400], "materials": {"*": {"reflectance": 1}}}"#, vec!["below 1"]),
        (r#"{"bands": [], MATERIALS}"#, vec!["bands: none"]),
    ];
    for (text, words) in cases {
        let file = write(folder.path(), "bad.json", &text.replace("MATERIALS", materials));
        refused(&[cornell(), "--bands", file.to_str().unwrap()], &words);
    }
}
