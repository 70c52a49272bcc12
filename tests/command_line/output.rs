//! Where `--out` puts files, and what is said of them.

use std::path::Path;

use crate::{lit_plates, run, texts};

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
