//! Where `--out` puts files, and what is said of them.

use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};

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

#[test]
fn files_of_another_run_than_their_report_are_recognised() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    let info = |report: &str| run("info", &[place(report).to_str().unwrap()]);
    for (command, options, report) in [
        ("bake", &["--write", "ply,json"][..], "lit.json"),
        ("light-map", &["--size", "16", "--write", "exr,json"], "lit.light-map.json"),
    ] {
        let stem = place("lit").display().to_string();
        let stem = stem + if command == "bake" { "" } else { ".light-map" };
        let files = written(folder.path(), command, &stem, options);
        assert_eq!(files.last().unwrap(), &place(report).display().to_string(), "written last");
        let same = info(report);
        assert!(same.status.success(), "{:?}", texts(&same));
        // As a kill leaves them after the first file of another run.
        let first = std::fs::read(&files[0]).unwrap();
        std::fs::write(&files[0], [&first[..first.len() - 1], b"~"].concat()).unwrap();
        let other = info(report);
        let [said, told] = texts(&other);
        assert_eq!(other.status.code(), Some(3));
        assert!(said.contains("another of the same size") && told.contains("1 of "), "{said}");
        std::fs::remove_file(&files[0]).unwrap();
        assert!(texts(&info(report))[0].contains("missing"));
    }
    std::fs::write(place("other.json"), "{}").unwrap();
    assert!(texts(&info("other.json"))[1].contains("names no files"));
}

/// The output of the program with `input` on its standard input.
fn piped(args: &[&str], input: &[u8]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_radiosity"));
    command.args(args).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    child.stdin.take().unwrap().write_all(input).unwrap();
    child.wait_with_output().unwrap()
}

#[test]
fn a_dash_is_standard_input_and_output() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name).display().to_string();
    fn bake<'a>(scene: &'a str, out: &'a str) -> Vec<&'a str> {
        vec!["bake", scene, "--cpu", "--error", "0.5", "--emit", "lamp=5,5,5", "--out", out]
    }
    // What is sent has no folder, in which a material library could be.
    let plates = std::fs::read_to_string(lit_plates(folder.path())).unwrap();
    let plates = plates.replace("mtllib lit.mtl", "");
    let scene = write(folder.path(), "plates.obj", &plates).display().to_string();
    let file = place("file");
    let args = [bake(&scene, &file), vec!["--write", "ply,glb"]].concat();
    assert!(piped(&args, b"").status.success());
    let expected = std::fs::read(place("file.ply")).unwrap();
    let through = piped(&bake("-", "-"), plates.as_bytes());
    assert!(through.status.success() && through.stdout == expected);
    assert!(texts(&through)[1].contains("about"), "the summary is elsewhere");
    // A binary glTF file, which has no ending either; and files that are named after nothing.
    let glb = std::fs::read(place("file.glb")).unwrap();
    let again = place("again");
    let read = piped(&["bake", "-", "--cpu", "--error", "0.5", "--out", &again], &glb);
    assert!(read.status.success(), "{:?}", texts(&read));
    assert!(Path::new(&place("again.glb")).is_file());
    let stl = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n\
               endloop\nendfacet\nendsolid a\n";
    let inside = folder.path().display().to_string();
    let read = piped(&["bake", "-", "--cpu", "--error", "0.5", "--out", &inside], stl.as_bytes());
    assert!(Path::new(&place("stdin.ply")).is_file(), "{:?}", texts(&read));
    let grid = run("grid", &[cornell(), "--cpu", "--out", "-"]);
    assert!(texts(&grid)[1].contains("--out -"));
    let nothing = piped(&bake("-", "-"), b"");
    assert!(!nothing.status.success() && texts(&nothing)[1].contains("standard input"));
}
