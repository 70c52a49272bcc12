//! Where `--out` puts files, and what is said of them.

use std::path::Path;

use radiosity::glam::DVec3;

use crate::{lit_plates, refused, run, texts, write};

/// Runs a quick `command` on the scene of two plates in `folder`, with this `--out`; gives the
/// files that it says it wrote.
fn written(folder: &Path, command: &str, out: &str, more: &[&str]) -> Vec<String> {
    let scene = lit_plates(folder).display().to_string();
    let mut args = vec![scene.as_str(), "--cpu", "--error", "0.5", "--out", out];
    args.extend(more);
    let output = run(command, &args);
    let [said, told] = texts(&output);
    assert!(output.status.success(), "{told}");
    let mut lines = said.lines().filter_map(|line| line.strip_prefix("wrote      "));
    let files: Vec<String> =
        lines.next().unwrap_or_else(|| panic!("{said}")).split(", ").map(String::from).collect();
    assert!(lines.next().is_none(), "{said}");
    for file in &files {
        assert!(Path::new(file).is_file(), "{file}");
    }
    files
}

const QUICK: [(&str, &[&str], &[&str]); 4] = [
    ("bake", &["--write", "ply,glb,json"], &["ply", "glb", "json"]),
    ("light-map", &["--size", "16"], &["exr", "glb"]),
    ("grid", &["--group", "floor"], &["grid.png", "grid.csv"]),
    ("probes", &["--counts", "1,1,1"], &["probes.json", "probes.csv"]),
];

#[test]
fn files_go_into_a_folder_or_by_a_stem_and_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name).display().to_string();
    std::fs::create_dir(place("results")).unwrap();
    for (command, options, endings) in QUICK {
        let named = |stem: &str, ending: &&str| place(&format!("{stem}.{ending}"));
        let stem = if command == "light-map" { "results/lit.light-map" } else { "results/lit" };
        let in_folder: Vec<String> = endings.iter().map(|ending| named(stem, ending)).collect();
        assert_eq!(written(folder.path(), command, &place("results"), options), in_folder);
        assert_eq!(written(folder.path(), command, &place("results/"), options), in_folder);
        // An ending that files have anyway is not given twice; another one is a part of the name.
        let ending = endings[0].rsplit('.').next().unwrap();
        for (out, stem) in [(format!("a.{ending}"), "a"), ("a.b".into(), "a.b")] {
            let by_stem: Vec<String> = endings.iter().map(|ending| named(stem, ending)).collect();
            assert_eq!(written(folder.path(), command, &place(&out), options), by_stem);
        }
    }
    let missing = place("missing/");
    let out = run("bake", &[&place("lit.obj"), "--cpu", "--out", &missing]);
    let error = &texts(&out)[1];
    assert!(!out.status.success() && error.contains("choose a folder that exists"), "{error}");
}

#[test]
fn a_kept_mesh_has_the_vertices_of_the_file_in_their_order() {
    let folder = tempfile::tempdir().unwrap();
    let text = "v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 0 -1\nv 0 1 0\nf 2 3 4\nf 2 5 3\n";
    let scene = write(folder.path(), "corner.obj", text);
    let stem = folder.path().join("lit");
    let out = run(
        "bake",
        &[
            scene.to_str().unwrap(),
            "--keep-mesh",
            "--cpu",
            "--error",
            "0.2",
            "--write",
            "ply,json",
            "--out",
            stem.to_str().unwrap(),
        ],
    );
    let [said, told] = texts(&out);
    assert!(out.status.success(), "{said}{told}");
    assert!(told.contains("2 vertices are shared by surfaces that meet in a crease"), "{told}");
    let ply = radiosity::read_ply(folder.path().join("lit.ply")).unwrap();
    let positions: Vec<[f64; 3]> = ply.positions.iter().map(DVec3::to_array).collect();
    let of_file = [[9., 9., 9.], [0., 0., 0.], [1., 0., 0.], [0., 0., -1.], [0., 1., 0.]];
    assert_eq!(positions, of_file);
    let report = std::fs::read_to_string(folder.path().join("lit.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    // Both sides of either triangle are lit; the file has the front of each.
    assert_eq!((report["elements"].as_u64(), ply.faces.len()), (Some(4), 2));
    refused(&["x.obj", "--keep-mesh", "--time", "3"], &["cannot be used with"]);
}
