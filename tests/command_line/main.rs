//! The program: what its commands write, and how they refuse wrong usage and bad scenes.
#![cfg(feature = "cli")]

mod bands;
mod daylight;
mod emit;
mod gltf;
#[path = "../common/gltf.rs"]
mod gltf_files;
mod heat;
mod heat_tables;
mod light;
mod light_map;
mod luminaires;
mod output;
#[cfg(unix)]
mod preview;
mod scaling;
mod sky;
mod trade_off;
mod usage;
mod view_factors;
mod viewer;
#[path = "../common/weather.rs"]
mod weather;

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// Runs `radiosity COMMAND ARGS…`.
fn run(command: &str, args: &[&str]) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_radiosity"));
    program.arg(command).args(args).output().expect("the program starts")
}

/// What the program printed, to standard output and to standard error.
fn texts(out: &Output) -> [String; 2] {
    [&out.stdout, &out.stderr].map(|text| String::from_utf8_lossy(text).into_owned())
}

/// The command fails, prints one error that contains every one of `words`, and writes no PLY.
fn refused(args: &[&str], words: &[&str]) {
    let out = run("bake", args);
    let error = String::from_utf8_lossy(&out.stderr);
    assert!(!out.status.success(), "{args:?}");
    assert!(!error.contains("panicked"), "{error}");
    for word in words {
        assert!(error.contains(word), "{args:?}: '{word}' not in: {error}");
    }
}

fn cornell() -> &'static str {
    concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj")
}

/// A scene of `tests/data/cases`.
fn case(name: &str) -> String {
    format!("{}/tests/data/cases/{name}", env!("CARGO_MANIFEST_DIR"))
}

fn write(folder: &Path, name: &str, text: &str) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, text).expect("a scratch file");
    path
}

/// `--cpu` where the tests are told to do without a GPU.
fn device() -> &'static [&'static str] {
    match std::env::var_os("RADIOSITY_NO_GPU") {
        Some(_) => &["--cpu"],
        None => &[],
    }
}

/// Without any graphics driver, and with nothing said of devices.
#[test]
fn rays_take_over_where_there_is_no_device() {
    let folder = tempfile::tempdir().unwrap();
    let stem = folder.path().join("box");
    let no_backend = if cfg!(target_os = "macos") { "dx12" } else { "metal" };
    let bake = |more: &[&str]| {
        let mut program = Command::new(env!("CARGO_BIN_EXE_radiosity"));
        program.env("WGPU_BACKEND", no_backend).args([
            "bake",
            cornell(),
            "--set",
            "solve.element_size=600",
        ]);
        program.args(["--write", "ply", "--out"]).arg(&stem).args(more).output().unwrap()
    };
    let baked = bake(&[]);
    let [said, warned] = texts(&baked);
    assert!(baked.status.success(), "{warned}");
    assert!(said.contains("rays") && stem.with_extension("ply").exists(), "{said}");
    for word in ["warning: rays on the CPU", "no graphics adapter", "install"] {
        assert!(warned.contains(word), "'{word}' not in: {warned}");
    }
    // One that was asked for by name is not done without.
    let named = bake(&["--adapter", "some"]);
    assert!(!named.status.success() && texts(&named)[1].contains("no graphics adapter"));
}

#[test]
fn bake_writes_all_it_says() {
    let folder = tempfile::tempdir().unwrap();
    let stem = folder.path().join("box.one");
    let mut args =
        vec![cornell(), "--out", stem.to_str().unwrap(), "--set", "solve.element_size=150"];
    args.extend([
        "--set",
        "hemicube_resolution=64",
        "--set",
        "unshot=0.01",
        "--set",
        "row_memory=16777216",
    ]);
    args.extend(["--camera", "278,273,-800,278,273,0,39.3077", "--image", "24,16", "--elements"]);
    args.extend(device());
    let out = run("bake", &args);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let said = String::from_utf8_lossy(&out.stdout);
    assert!(said.contains("adapter") && said.contains("elements"), "{said}");
    let size =
        |ending| std::fs::metadata(folder.path().join(format!("box.one.{ending}"))).unwrap().len();
    assert!(size("ply") > 1000 && size("glb") > 1000);
    assert!(size("exr") > 24 * 16 * 4 && size("png") > 100);
    assert!(size("elements.ply") > size("ply"), "corners of elements are not shared");
    let json = std::fs::read(folder.path().join("box.one.json")).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
    for key in ["scene", "adapter", "settings", "triangles", "elements", "vertices", "shots"] {
        assert!(json.get(key).is_some(), "{key}");
    }
    for part in ["emitted", "absorbed", "left", "back", "unshot", "overshot"] {
        assert_eq!(json["ledger"][part].as_array().unwrap().len(), 3, "{part}");
    }
    for stage in ["load", "mesh", "draw", "reduce", "readback", "solve", "vertices", "write"] {
        assert!(json["seconds"][stage].is_number(), "{stage}");
    }
    assert_eq!(json["triangles"], 32);
    assert_eq!(json["settings"]["solve.hemicube_resolution"], 64);
    let drawn = json["hemicubes_by_resolution"].as_object().unwrap();
    if device().is_empty() {
        assert_eq!(json["rows_by"], "hemicubes");
        assert_eq!(drawn.keys().collect::<Vec<_>>(), ["64", "32", "16"]);
        let all: u64 = drawn.values().map(|n| n.as_u64().unwrap()).sum();
        assert!(json["hemicubes"] == all && drawn["32"] != 0, "{json}");
        assert!(said.contains(&format!(" {all} hemicubes, ")), "{said}");
    }
    assert!(json["ledger"]["emitted"][0].as_f64().unwrap() > 0.0);
    assert!(json["seconds"]["total"].as_f64().unwrap() > 0.0);
    // Two runs, the same bytes.
    let first = std::fs::read(folder.path().join("box.one.ply")).unwrap();
    assert!(run("bake", &args).status.success());
    assert!(first == std::fs::read(folder.path().join("box.one.ply")).unwrap());
    // All at full resolution: other rows, and none of the others drawn.
    args.extend(["--set", "full_resolution_share=0"]);
    assert!(run("bake", &args).status.success());
    assert!(first != std::fs::read(folder.path().join("box.one.ply")).unwrap());
    let json = std::fs::read(folder.path().join("box.one.json")).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
    assert_eq!(json["settings"]["solve.full_resolution_share"], 0.0);
    if device().is_empty() {
        assert_eq!(json["hemicubes_by_resolution"]["64"], json["hemicubes"]);
    }
    // Rays say that they are rays.
    args.push("--cpu");
    let out = run("bake", &args);
    let said = String::from_utf8_lossy(&out.stdout);
    let json = std::fs::read(folder.path().join("box.one.json")).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
    assert_eq!(
        (&json["rows_by"], &json["hemicubes_by_resolution"]),
        (&"rays".into(), &serde_json::json!({}))
    );
    assert!(said.contains(&format!(" {} rows of rays, ", json["hemicubes"])), "{said}");
}

/// Without `--camera` there is a picture too, and the camera that is told draws it again.
#[test]
fn bake_chooses_a_camera_that_can_be_typed_again() {
    let folder = tempfile::tempdir().unwrap();
    let scene = lit_plates(folder.path());
    let bake = |stem: &str, more: &[&str]| {
        let out = folder.path().join(stem);
        let mut args = vec![scene.to_str().unwrap(), "--out", out.to_str().unwrap(), "--cpu"];
        args.extend([
            "--set",
            "solve.element_size=0.4",
            "--set",
            "hemicube_resolution=16",
            "--image",
            "24,16",
        ]);
        args.extend(more);
        let out = run("bake", &args);
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        String::from_utf8(out.stdout).unwrap()
    };
    let read = |name: &str| std::fs::read(folder.path().join(name));
    let said = bake("chosen", &[]);
    let camera = said.split_whitespace().skip_while(|word| *word != "--camera").nth(1).unwrap();
    assert!(bake("typed", &["--camera", camera, "--write", "png"]).contains(camera));
    // So does the exposure, for meshes too; another one shows other colours.
    let exposure = said.split_whitespace().skip_while(|word| *word != "--exposure").nth(1).unwrap();
    assert!(bake("exposed", &["--camera", camera, "--exposure", exposure]).contains(exposure));
    for ending in ["png", "ply", "glb"] {
        let [exposed, chosen] =
            ["exposed", "chosen"].map(|s| read(&format!("{s}.{ending}")).unwrap());
        assert!(exposed == chosen, "{ending}");
    }
    bake("bright", &["--camera", camera, "--exposure", "9"]);
    for ending in ["png", "ply", "glb"] {
        let [bright, chosen] =
            ["bright", "chosen"].map(|s| read(&format!("{s}.{ending}")).unwrap());
        assert!(bright != chosen, "{ending}");
    }
    assert!(read("typed.png").unwrap() == read("chosen.png").unwrap(), "{camera}");
    assert!(
        read("typed.ply").is_err() && read("typed.json").is_err() && read("typed.exr").is_err()
    );
    // Seen from z: the same picture with another direction up is turned.
    let [up_y, up_x] =
        ["", ",1,0,0"].map(|up| ["--camera", "0.5,0.5,0.9,0.5,0.5,0,60"].join("=") + up);
    bake("up_y", &[&up_y]);
    bake("up_x", &[&up_x]);
    assert!(read("up_y.exr").unwrap() != read("up_x.exr").unwrap());
}

#[test]
fn bake_goes_on_from_a_saved_state_with_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let state = folder.path().join("light.state");
    for solver in ["shooting", "gmres"] {
        let method = format!("method={solver}");
        let bake = |name: &str, more: &[&str]| {
            let stem = folder.path().join(name);
            let mut args = vec![cornell(), "--cpu", "--out", stem.to_str().unwrap()];
            args.extend([
                "--set",
                "solve.element_size=200",
                "--set",
                "hemicube_resolution=32",
                "--set",
                &method,
            ]);
            args.extend(more);
            let out = run("bake", &args);
            assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
            std::fs::read(stem.with_extension("ply")).unwrap()
        };
        let path = state.to_str().unwrap();
        let whole = bake("whole", &[]);
        assert!(bake("kept", &["--state", path]) == whole, "{solver}");
        // As a kill leaves it.
        let kept = std::fs::read(&state).unwrap();
        std::fs::write(&state, &kept[..kept.len() / 2]).unwrap();
        assert!(bake("on", &["--state", path]) == whole, "{solver}");
        let mut args =
            vec![cornell(), "--cpu", "--set", "solve.element_size=150", "--set", &method];
        args.extend(["--state", path]);
        refused(&args, &["light.state", "other 'target or settings'"]);
        std::fs::remove_file(&state).unwrap();
    }
    refused(
        &[cornell(), "--state", "x", "--time", "1"],
        &["--time", "cannot be used with", "--state"],
    );
    refused(&[cornell(), "--cpu", "--set", "method=newton"], &["'method=newton'", "gauss-seidel"]);
}

/// Writes lit.obj: a grey square, and a lamp of its size above it.
fn lit_plates(folder: &Path) -> PathBuf {
    write(folder, "lit.mtl", "newmtl lamp\nKd 0 0 0\nKe 5 5 5\nnewmtl grey\nKd 0.5 0.5 0.5\n");
    let plates = "mtllib lit.mtl\nusemtl grey\no floor\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n\
                  f 1 2 3 4\nusemtl lamp\no lamp\nv 0 0 1\nv 0 1 1\nv 1 1 1\nv 1 0 1\nf 5 6 7 8\n";
    write(folder, "lit.obj", plates)
}

#[test]
fn bake_gathers_without_a_gpu() {
    let folder = tempfile::tempdir().unwrap();
    let stem = folder.path().join("lit");
    let scene = lit_plates(folder.path());
    let mut args = vec![scene.to_str().unwrap(), "--out", stem.to_str().unwrap(), "--cpu"];
    args.extend([
        "--set",
        "solve.element_size=0.4",
        "--set",
        "hemicube_resolution=16",
        "--gather",
        "needed",
    ]);
    args.extend(["--set", "min_edge=0.2"]);
    let out = run("bake", &args);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let json: serde_json::Value =
        serde_json::from_slice(&std::fs::read(stem.with_extension("json")).unwrap()).unwrap();
    let number = |key: &str| json[key].as_u64().unwrap();
    // The floor's vertices at least, 5 × 5 of them; the lamp reflects nothing and need not look.
    assert!(number("gathers") >= 25, "{json}");
    assert!(number("elements") >= 64 && json["settings"]["gather"] == "needed", "{json}");
    let ply = std::fs::read(stem.with_extension("ply")).unwrap();
    let header = String::from_utf8_lossy(&ply[..ply.len().min(300)]);
    assert!(
        header.starts_with("ply")
            && header.contains(&format!("element vertex {}", number("vertices")))
    );
}

#[test]
fn verify_prints_estimated_beside_measured_errors() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name).display().to_string();
    lit_plates(folder.path());
    // The floor sees a fifth of the lamp's light at its middle, a seventh at its corners.
    let vertex = |p: &str, b: f64| format!("{p} {b} {b} {b}\n");
    let corners: String = ["0 0 0", "1 0 0", "1 1 0", "0 1 0"].map(|p| vertex(p, 1.1)).concat();
    let lamp: String = ["0 0 1", "0 1 1", "1 1 1", "1 0 1"].map(|p| vertex(p, 15.7)).concat();
    let header = "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\n\
                  property float z\nproperty float radiosity_r\nproperty float radiosity_g\n\
                  property float radiosity_b\nelement face 2\n\
                  property list uchar int vertex_indices\nend_header\n";
    let faces = "4 0 1 2 3\n4 4 5 6 7\n";
    write(folder.path(), "lit.ply", &format!("{header}{corners}{lamp}{faces}"));
    let told =
        "{\"error\": {\"total\": 0.25, \"groups\": [{\"group\": \"floor\", \"error\": 0.125}]}}";
    write(folder.path(), "lit.json", told);
    let (csv, ply) = (place("table.csv"), place("points.ply"));
    let mut args = vec![place("lit.obj"), place("lit.ply"), "--seed".into(), "3".into()];
    args.extend(["--csv".into(), csv.clone(), "--points-ply".into(), ply.clone()]);
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    let out = run("verify", &args);
    let table = String::from_utf8_lossy(&out.stdout);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let lines: Vec<Vec<&str>> = table.lines().map(|l| l.split_whitespace().collect()).collect();
    assert_eq!(lines[1][..3], ["floor", "100.00", "0.00"], "{table}");
    assert_eq!((lines[1][4], lines[2][4], lines[2][0]), ("12.50", "25.00", "all"), "{table}");
    assert!(lines[3].starts_with(&["known", "to"]) && !table.contains("lamp"), "{table}");
    // 25 % estimated, and 20 to 50 % measured; 1 % estimated is far off.
    assert!(table.trim_end().ends_with("agree within a factor of 2"), "{table}");
    let text = std::fs::read_to_string(csv).unwrap();
    let rows: Vec<Vec<&str>> = text.lines().map(|l| l.split(',').collect()).collect();
    let measured: f64 = rows[2][5].parse().unwrap();
    assert!(rows[1][5] == rows[2][5] && (0.1..1.0).contains(&measured), "{text}");
    let points = std::fs::read_to_string(ply).unwrap();
    let count: usize = lines[2][3].parse().unwrap();
    assert!(points.contains(&format!("element vertex {count}\n")), "{points}");
    assert_eq!(points.lines().skip_while(|l| *l != "end_header").count(), count + 1);
    // The same numbers again; and radiosity at the middle, π · 5 · 0.5 · 0.2395 by the closed form.
    let again = run("verify", &args[..4]);
    let cut = |text: &[u8]| String::from_utf8_lossy(text).lines().take(3).collect::<String>();
    assert_eq!(cut(&again.stdout), cut(&out.stdout));
    let point = "{\"p\": [0.5, 0.5, 0], \"n\": [0, 0, 1], \"B\": [1.8817, 1.8817, 1.8817], \
                 \"se\": [1e-4, 1e-4, 1e-4]}";
    write(folder.path(), "p.json", &format!("{{\"points\": [{point}]}}"));
    let out = run("verify", &[args[0], "--points", &place("p.json"), "--csv", &place("p.csv")]);
    let said = String::from_utf8_lossy(&out.stdout);
    assert!(said.contains("3 channels: mean") && out.status.success(), "{said}");
    let text = std::fs::read_to_string(place("p.csv")).unwrap();
    let row: Vec<f64> =
        text.lines().nth(1).unwrap().split(',').map(|x| x.parse().unwrap()).collect();
    assert!((row[3] - 1.8817).abs() < 4.0 * row[6] && row[6] < 0.02, "{text}");
    write(folder.path(), "lit.json", "{\"error\": {\"total\": 0.01}}");
    let said = run("verify", &args[..4]).stdout;
    let said = String::from_utf8_lossy(&said);
    assert!(said.lines().last().unwrap().ends_with("times further off than estimated"), "{said}");
    // A file that tells its error itself, beside the report of another bake, and then alone.
    let told = header.replacen('\n', "\ncomment estimated error 30.001 % of reflected\n", 1);
    write(folder.path(), "lit.ply", &format!("{told}{corners}{lamp}{faces}"));
    for has_report in [true, false] {
        let out = run("verify", &args[..4]);
        let [said, warned] = [out.stdout, out.stderr].map(|s| String::from_utf8(s).unwrap());
        let all = said.lines().nth(2).unwrap();
        assert!(all.split_whitespace().nth(4) == Some("30.00"), "{said}");
        assert_eq!(warned.contains("lit.json is of another bake"), has_report, "{warned}");
        let _ = std::fs::remove_file(place("lit.json"));
    }
    write(folder.path(), "lit.ply", &format!("{header}{corners}{lamp}{faces}"));
    // What cannot be.
    let wrong = |args: &[&str], words: &[&str]| {
        let out = run("verify", args);
        let error = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(1), "{error}");
        assert!(words.iter().all(|word| error.contains(word)), "{error}");
    };
    wrong(&[args[0], "no.ply"], &["no.ply"]);
    wrong(&[args[0], args[0]], &["lit.obj", "PLY"]);
    wrong(&[cornell(), args[1]], &["solution", "of this scene"]);
    wrong(&[args[0], args[1], "--precision", "0"], &["precision", "above 0"]);
    wrong(&[args[0], args[1], "--csv", "no/such/folder/x"], &["no/such/folder"]);
    wrong(&[args[0], "--points", args[1]], &["lit.ply", "points"]);
    write(folder.path(), "off.json", "{\"points\": [{\"p\": [5, 5, 5], \"n\": [0, 0, 1]}]}");
    wrong(&[args[0], "--points", &place("off.json")], &["off.json: point 1", "no surface"]);
}

#[test]
fn output_that_nobody_reads_is_no_failure() {
    for args in [["--help"], ["--version"]] {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let mut program = Command::new(env!("CARGO_BIN_EXE_radiosity"));
        let out = program.args(args).stdout(writer).stderr(Stdio::piped()).output().unwrap();
        let error = String::from_utf8_lossy(&out.stderr);
        assert!(out.status.success() && error.is_empty(), "{args:?}: {error}");
    }
}

#[test]
fn help_and_version_succeed() {
    for args in [
        &["--help"][..],
        &["bake", "-h"],
        &["view-factors", "--help"],
        &["trade-off", "-h"],
        &["verify", "--help"],
        &["grid", "--help"],
        &["probes", "--help"],
    ] {
        let out = run(args[0], &args[1..]);
        let text = String::from_utf8_lossy(&out.stdout);
        assert!(out.status.success() && text.contains("Usage: radiosity"), "{args:?}: {text}");
    }
    let out = run("--version", &[]);
    assert_eq!(out.stdout, format!("radiosity {}\n", env!("CARGO_PKG_VERSION")).as_bytes());
}

#[test]
fn wrong_usage_has_status_2_and_says_what_would_be_right() {
    for (args, words) in [
        (&["fry"][..], &["'fry'", "--help"][..]),
        (&["bakes"], &["'bakes'", "'bake'"]),
        (&["--what"], &["'--what'"]),
        (&["bake"], &["<SCENE.obj>", "Usage: radiosity bake", "'--help'"]),
        (&["bake", "a.obj", "b.obj"], &["'b.obj'", "Usage: radiosity bake"]),
        (&["bake", "a.obj", "--set", "rays=many"], &["--set", "'rays=many'", "whole number"]),
        (&["bake", "a.obj", "--camera", "1,2,3"], &["--camera", "'1,2,3'", "7 numbers", "or 10"]),
        (&["bake", "a.obj", "--write", "ply,gif"], &["--write", "'ply,gif'", "json, exr"]),
        (&["view-factors", "--error", "1e-3"], &["<SCENE.obj>", "Usage: radiosity view-factors"]),
        (&["view-factors", "a.obj", "--format", "xls"], &["'xls'", "csv, list, mtx, npy, npz"]),
        (&["view-factors", "a.obj", "--cpu"], &["'--cpu'"]),
        (&["heat", "a.obj"], &["not provided", "--boundaries <FILE.csv>"]),
        (&["heat", "a.obj", "--boundaries", "b", "--bands", "1,x"], &["'1,x'", "µm"]),
        (&["merge"], &["not provided", "<FILE.rows>"]),
        (&["verify", "a.obj"], &["<SOLUTION.ply>", "Usage: radiosity verify"]),
        (&["verify", "a.obj", "b.ply", "c.ply"], &["'c.ply'", "Usage: radiosity verify"]),
        (&["verify", "a.obj", "b.ply", "--time", "soon"], &["--time", "'soon'", "inf"]),
        (&["verify", "a.obj", "b.ply", "--time", "-1"], &["--time", "'-1'"]),
        (&["verify", "a.obj", "b.ply", "--paths", "1"], &["--paths", "cannot be used with"]),
        (
            &["verify", "a.obj", "--points", "p", "--points-per-group", "9"],
            &["'--points <FILE.json>'", "'--points-per-group <N>'"],
        ),
        (&["grid", "a.obj", "--plane", "1,2,3"], &["'1,2,3'", "nine numbers", "two edges"]),
        (&["probes", "a.obj"], &["not provided", "--spacing <X>"]),
        (&["probes", "a.obj", "--counts", "2,2"], &["'2,2'", "three whole numbers"]),
        (&["trade-off", "--slow"], &["'--slow'", "Usage: radiosity trade-off"]),
        (&["trade-off", "a.obj", "--tail", "some"], &["--tail", "'some'", "a share"]),
    ] {
        let out = run(args[0], &args[1..]);
        let error = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(2), "{args:?}: {error}");
        assert!(out.stdout.is_empty(), "{args:?}");
        assert!(words.iter().all(|word| error.contains(word)), "{args:?}: {error}");
    }
}

#[test]
fn bad_scenes_are_refused_with_their_name() {
    let folder = tempfile::tempdir().unwrap();
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let bad = |name: &str, text: &str| write(folder.path(), name, text).display().to_string();
    refused(&["no_such.obj"], &["no_such.obj"]);
    let empty = bad("empty.obj", "# nothing\n");
    refused(&[&empty], &["empty.obj"]);
    let flat = bad("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n");
    refused(&[&flat], &["flat.obj", "area"]);
    let nan = bad("nan.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    refused(&[&nan], &["nan.obj:1"]);
    let lib = bad("lib.obj", &format!("mtllib gone.mtl\n{triangle}usemtl a\nf 1 2 3\n"));
    refused(&["--strict", &lib], &["lib.obj:1", "gone.mtl"]);
    bad("some.mtl", "newmtl chalk\nKd 0.5 0.5 0.5\n");
    let name = bad("name.obj", &format!("mtllib some.mtl\n{triangle}usemtl cheese\nf 1 2 3\n"));
    refused(&["--strict", &name], &["name.obj:5", "cheese", "newmtl"]);
    for (k, kd) in ["1 0.5 0.5", "0.5 1.7 0.5", "0.5 0.5 -0.1"].iter().enumerate() {
        bad(&format!("kd{k}.mtl"), &format!("newmtl m\nKd {kd}\n"));
        let text = format!("mtllib kd{k}.mtl\n{triangle}usemtl m\nf 1 2 3\n");
        refused(
            &["--strict", &bad(&format!("kd{k}.obj"), &text)],
            &[&format!("kd{k}.mtl:1"), "channel"],
        );
    }
}

/// A closed box, or one without its last wall; all walls face inwards.
fn room(walls: usize) -> String {
    let mut text = String::new();
    for k in 0..8 {
        text += &format!("v {} {} {}\n", k & 1, k >> 1 & 1, k >> 2 & 1);
    }
    let faces = ["5 6 2 1", "2 4 3 1", "3 7 5 1", "6 8 4 2", "7 8 6 5", "4 8 7 3"];
    for face in &faces[..walls] {
        text += &format!("f {face}\n");
    }
    text
}

/// What the solution emits has to be what the scene emits: forgotten lamps are found.
#[test]
fn verify_wants_the_lamps_of_the_bake() {
    let folder = tempfile::tempdir().unwrap();
    let scene = write(folder.path(), "box.obj", &format!("usemtl wall\n{}", room(6)));
    let (scene, ply) = (scene.display().to_string(), scene.with_extension("ply"));
    let ply = ply.display().to_string();
    let bake = |more: &[&str]| {
        let mut args = vec![scene.as_str(), "--cpu", "--write", "ply"];
        args.extend(more);
        let out = run("bake", &args);
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        String::from_utf8(out.stdout).unwrap()
    };
    let verify = |more: &[&str]| {
        let out = run("verify", &[&[scene.as_str(), ply.as_str()][..], more].concat());
        (out.status.success(), String::from_utf8(out.stderr).unwrap())
    };
    let dark = bake(&["--error", "0.1"]);
    assert!(dark.ends_with("no light falls on what reflects: there is no error\n"), "{dark}");
    let (fine, said) = verify(&["--emit", "wall=2"]);
    assert!(!fine && said.contains("'wall' emits radiance 0,0,0, and 2,2,2"), "{said}");
    let lit = bake(&["--emit", "wall=2", "--time", "0.5"]);
    assert!(lit.lines().last().unwrap().starts_with("as exact as the time allowed: "), "{lit}");
    let (fine, said) = verify(&["--emit", "wall=1"]);
    assert!(!fine && said.contains("--emit wall=2,2,2"), "{said}");
    let (fine, said) = verify(&["--emit", "wall=2", "--precision", "1"]);
    assert!(fine, "{said}");
}

/// Ctrl-C, or the end of a batch system's time: the work stops, what there is is written, and the
/// exit status says that it was stopped.
#[cfg(unix)]
#[test]
fn an_interrupt_writes_what_there_is() {
    for signal in ["-INT", "-TERM"] {
        interrupt_by(signal);
    }
}

#[cfg(unix)]
fn interrupt_by(signal: &str) {
    let folder = tempfile::tempdir().unwrap();
    let stem = folder.path().join("box");
    let mut args = vec!["bake", cornell(), "--out", stem.to_str().unwrap(), "--cpu"];
    // Hours of work.
    args.extend(["--error", "0.00001", "--write", "ply,json"]);
    // The first line of progress says that the bake has begun.
    let [report, _] = interrupted(&args, signal, &["shooting", "gathering"]);
    assert!(report.contains("missed: it was stopped"), "{report}");
    assert!(!radiosity::io::read_ply(stem.with_extension("ply")).unwrap().faces.is_empty());
    let json = std::fs::read_to_string(stem.with_extension("json")).unwrap();
    assert!(json.contains("\"stopped\": true"), "{json}");
}

/// What the program prints that gets a `signal` once it has said one of `words`, to standard output
/// and to standard error. It ends as a program that was stopped.
#[cfg(unix)]
fn interrupted(args: &[&str], signal: &str, words: &[&str]) -> [String; 2] {
    use std::io::{BufRead, BufReader, Read};

    let mut program = Command::new(env!("CARGO_BIN_EXE_radiosity"));
    program.args(args).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = program.spawn().expect("the program starts");
    let mut log = BufReader::new(child.stderr.take().unwrap());
    let mut said = String::new();
    while !words.iter().any(|word| said.contains(word)) {
        assert!(log.read_line(&mut said).unwrap() > 0, "{said}");
    }
    let id = child.id().to_string();
    assert!(Command::new("kill").args([signal, &id]).status().unwrap().success());
    log.read_to_string(&mut said).unwrap();
    let out = child.wait_with_output().unwrap();
    let report = String::from_utf8(out.stdout).unwrap();
    assert_eq!(out.status.code(), Some(130), "{said}{report}");
    [report, said]
}

/// A picture that would take long is left out; all else is written.
#[cfg(unix)]
#[test]
fn an_interrupt_leaves_out_a_large_picture() {
    let folder = tempfile::tempdir().unwrap();
    let stem = folder.path().join("box");
    let mut args = vec!["bake", cornell(), "--out", stem.to_str().unwrap(), "--cpu"];
    // A minute of work.
    args.extend(["--error", "0.3", "--write", "ply,png,json", "--image", "8192,8192"]);
    let [report, said] = interrupted(&args, "-TERM", &["of the picture"]);
    assert!(said.contains("warning: no picture"), "{said}");
    assert!(report.contains("box.ply, ") && !report.contains("--camera"), "{report}");
    assert!(!radiosity::io::read_ply(stem.with_extension("ply")).unwrap().faces.is_empty());
    assert!(!stem.with_extension("png").exists() && stem.with_extension("json").exists());
}

#[test]
fn bad_settings_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let stem = folder.path().join("x").display().to_string();
    let with = |more: &[&str], words: &[&str]| {
        let mut args = vec![cornell(), "--out", &stem];
        args.extend(device());
        args.extend(more);
        refused(&args, words);
        assert!(std::fs::read_dir(folder.path()).unwrap().next().is_none(), "wrote nothing");
    };
    with(&["--set", "hemicube_resolution=0"], &["hemicube resolution 0", "even"]);
    with(&["--set", "hemicube_resolution=-2"], &["-2"]);
    with(&["--set", "solve.element_size=0"], &["element size 0"]);
    with(&["--set", "solve.element_size=nan"], &["element size NaN"]);
    with(&["--set", "solve.element_size=1e-9"], &["elements"]);
    with(&["--set", "unshot=2"], &["unshot share 2"]);
    with(&["--camera", "1,2,3"], &["camera", "7"]);
    with(&["--image", "0,5", "--camera", "278,273,-800,278,273,0,39"], &["0 × 5"]);
    with(&["--set", "full_resolution_share=much"], &["much"]);
    with(&["--exposure", "0"], &["exposure 0", "above 0"]);
    with(&["--error", "10%"], &["'10%'", "0.1 for 10 %"]);
    with(&["--set", "near_reach=much"], &["much"]);
    with(&["--gather", "some"], &["'some'", "none, needed, all"]);
    with(&["--set", "mesh_error=much"], &["much"]);
    with(&["--set", "max_elements=-1"], &["-1"]);
    with(&["--set", "min_edge=tiny"], &["tiny"]);
    with(&["--what"], &["--what"]);
    let coarse = [
        "--gather",
        "needed",
        "--set",
        "solve.element_size=600",
        "--set",
        "hemicube_resolution=16",
    ];
    let gathering = |more: &[&str], words: &[&str]| with(&[&coarse, more].concat(), words);
    gathering(&["--set", "mesh_error=0"], &["mesh 0", "above 0"]);
    gathering(&["--set", "mesh_error=1.5"], &["mesh 1.5"]);
    gathering(&["--set", "mesh_error=nan"], &["mesh NaN"]);
    gathering(&["--set", "min_edge=0"], &["smallest element 0"]);
    gathering(&["--set", "min_edge=-3"], &["smallest element -3"]);
    refused(&[], &["Usage"]);
    refused(&[cornell(), "--out", "no/such/folder/x"], &["no/such/folder"]);
    if device().is_empty() {
        with(&["--adapter", "no such thing"], &["no such thing", "there are"]);
    }
}
