//! Where `--out` puts files, and what is said of them.

use std::path::Path;
use std::process::{Command, Output};

use radiosity::glam::DVec3;

use crate::{cornell, lit_plates, refused, run, texts, write};

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

/// Bakes coarsely to this stem, with the environment as `change` makes it.
#[cfg(unix)]
fn coarse_bake(stem: &Path, element_size: u32, change: impl Fn(&mut Command)) -> Output {
    let size = format!("solve.element_size={element_size}");
    let mut program = Command::new("sh");
    program.args(["-c", "trap '' XFSZ; ulimit -f \"$LIMIT\"; exec \"$@\"", "sh"]);
    program.arg(env!("CARGO_BIN_EXE_radiosity"));
    program.args(["bake", cornell(), "--cpu", "--gather", "none", "--image", "32,32"]);
    program.args(["--set", &size, "--out", stem.to_str().unwrap()]).env("LIMIT", "unlimited");
    change(&mut program);
    program.output().expect("the program starts")
}

#[cfg(unix)]
fn contents(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let entry = |entry: std::io::Result<std::fs::DirEntry>| {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        path.is_file().then(|| (name, std::fs::read(path).unwrap()))
    };
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().filter_map(entry).collect();
    files.sort();
    files
}

#[cfg(unix)]
#[test]
fn what_cannot_be_written_is_elsewhere_and_the_rest_stands() {
    let folder = tempfile::tempdir().unwrap();
    let temporary = folder.path().join("tmp");
    for name in ["tmp", "box.ply"] {
        std::fs::create_dir(folder.path().join(name)).unwrap();
    }
    let stem = folder.path().join("box");
    let out = coarse_bake(&stem, 300, |program| _ = program.env("TMPDIR", &temporary));
    let [said, error] = texts(&out);
    assert_eq!(out.status.code(), Some(1), "{error}");
    let last = error.lines().last().unwrap();
    assert!(last.contains("box.ply") && last.contains("it is in"), "{error}");
    let elsewhere = last.rsplit("it is in ").next().unwrap();
    assert!(std::fs::read(elsewhere).unwrap().starts_with(b"ply"));
    assert!(Path::new(elsewhere).starts_with(&temporary));
    assert!(said.contains("box.glb") && !said.contains("box.ply"), "{said}");
    let files = contents(folder.path());
    let names: Vec<&str> = files.iter().map(|(name, _)| &**name).collect();
    assert_eq!(names, ["box.exr", "box.glb", "box.json", "box.png"]);
    // The report names the other files of its set.
    let report: serde_json::Value = serde_json::from_slice(&files[2].1).unwrap();
    let listed = report["files"].as_array().unwrap();
    assert_eq!(listed.len(), 3);
    for file in listed {
        let (_, bytes) = files.iter().find(|(name, _)| file["name"] == **name).unwrap();
        assert_eq!(file["bytes"], bytes.len());
        assert_eq!(file["xxh3"], format!("{:016x}", xxhash_rust::xxh3::xxh3_64(bytes)));
    }
}

#[cfg(unix)]
#[test]
fn a_full_disk_leaves_the_files_that_were_there() {
    let folder = tempfile::tempdir().unwrap();
    let stem = folder.path().join("box");
    let first = coarse_bake(&stem, 300, |_| ());
    assert!(matches!(first.status.code(), Some(0 | 3)), "{}", texts(&first)[1]);
    let old = contents(folder.path());
    assert_eq!(old.len(), 5);
    // No file may be larger than a block or two.
    let out = coarse_bake(&stem, 100, |program| _ = program.env("LIMIT", "1"));
    let [_, error] = texts(&out);
    assert_eq!(out.status.code(), Some(1), "{error}");
    for (name, _) in &old {
        assert!(error.lines().any(|line| line.contains(name)), "{name}: {error}");
    }
    assert!(contents(folder.path()) == old);
}
