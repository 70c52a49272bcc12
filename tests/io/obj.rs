//! OBJ and MTL files, good and bad: what is taken, what is refused, and what the message names.

use crate::common::keep_going;
use std::f64::consts::PI;
use std::fs;
use std::path::Path;

use radiosity::{
    Error, ErrorKind, GatheredMesh, Mesh, RayGather, RefinementSettings, Rgb, Scene, VertexMesh,
    load_obj, read_obj,
};
use tempfile::TempDir;

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
const CHALK: &str = "newmtl chalk\nKd 0.8 0.7 0.6\n";

/// Writes the files into a fresh folder and loads the first of them.
fn load(files: &[(&str, &[u8])]) -> Result<Scene, Error> {
    let folder = TempDir::new().unwrap();
    for (name, bytes) in files {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    load_obj(folder.path().join(files[0].0))
}

fn obj(text: &str) -> Result<Scene, Error> {
    load(&[("room.obj", text.as_bytes())])
}

/// A square of material `chalk`, with this library.
fn with_library(mtl: &str) -> Result<Scene, Error> {
    let text = format!("mtllib room.mtl\n{SQUARE}usemtl chalk\nf 1 2 3 4\n");
    load(&[("room.obj", text.as_bytes()), ("room.mtl", mtl.as_bytes())])
}

/// The error is of `kind` and its message has all of `parts`.
#[track_caller]
fn refused(result: Result<Scene, Error>, kind: ErrorKind, parts: &[&str]) {
    let error = result.expect_err("must be refused");
    let message = error.to_string();
    assert_eq!(error.kind(), kind, "{message}");
    for part in parts {
        assert!(message.contains(part), "'{part}' is not in: {message}");
    }
    assert!(message.lines().count() == 1 && message.len() < 600, "{message}");
}

#[track_caller]
fn warned(scene: &Scene, part: &str) {
    let warnings = scene.warnings();
    assert!(warnings.iter().any(|w| w.contains(part)), "'{part}' is not in {warnings:?}");
}

fn area(scene: &Scene) -> f64 {
    (0..scene.triangles().len()).map(|t| scene.area(t)).sum()
}

#[test]
fn files_that_cannot_be_read() {
    let folder = TempDir::new().unwrap();
    let missing = load_obj(folder.path().join("attic.obj"));
    let source = std::error::Error::source(missing.as_ref().unwrap_err()).unwrap();
    let source = source.downcast_ref::<std::io::Error>().unwrap();
    assert_eq!(source.kind(), std::io::ErrorKind::NotFound);
    refused(missing, ErrorKind::File, &["attic.obj"]);
    refused(load_obj(folder.path()), ErrorKind::File, &["folder"]);
    refused(load_obj(""), ErrorKind::File, &["cannot be read"]);
    // Opens, but cannot be read from its start.
    #[cfg(target_os = "linux")]
    refused(load_obj("/proc/self/mem"), ErrorKind::File, &["/proc/self/mem", "cannot be read"]);
    #[cfg(unix)]
    refused(load_obj(Path::new("/dev/zero")), ErrorKind::File, &["/dev/zero", "regular"]);
}

#[test]
fn a_missing_library_is_named_with_its_line_and_its_neighbours() {
    let text = format!("{SQUARE}\nmtllib paints.mtl\nf 1 2 3\n");
    let only = load(&[("room.obj", text.as_bytes())]);
    assert!(std::error::Error::source(only.as_ref().unwrap_err()).is_some());
    refused(only, ErrorKind::File, &["room.obj:6: ", "paints.mtl", "no .mtl file"]);
    let other: (&str, &[u8]) = ("paint.mtl", b"");
    let parts = ["room.obj:6: ", "paints.mtl", "has 'paint.mtl'"];
    refused(load(&[("room.obj", text.as_bytes()), other]), ErrorKind::File, &parts);
    refused(obj("mtllib\nf 1\n"), ErrorKind::Scene, &["room.obj:1: ", "no file name"]);
}

#[test]
fn libraries_lie_in_the_folder_of_the_obj_file_or_below() {
    let folder = TempDir::new().unwrap();
    let room = folder.path().join("room/room.obj");
    fs::create_dir_all(folder.path().join("room/paints")).unwrap();
    for library in ["chalk.mtl", "room/chalk.mtl", "room/paints/chalk.mtl"] {
        fs::write(folder.path().join(library), CHALK).unwrap();
    }
    let load = |library: &str| {
        fs::write(&room, format!("{SQUARE}mtllib {library}\nusemtl chalk\nf 1 2 3\n")).unwrap();
        load_obj(&room)
    };
    for inside in ["chalk.mtl", "./chalk.mtl", "paints/chalk.mtl", "paints/./chalk.mtl"] {
        assert_eq!(load(inside).unwrap().material(0).name, "chalk", "{inside}");
    }
    let absolute = folder.path().join("room/chalk.mtl").display().to_string();
    for outside in ["../chalk.mtl", "paints/../chalk.mtl", "..", "/dev/zero", &absolute] {
        let parts = ["room.obj:5: ", outside, "not in the folder of the OBJ file", "'chalk.mtl'"];
        refused(load(outside), ErrorKind::File, &parts);
    }
}

#[test]
fn libraries_that_are_no_files() {
    let folder = TempDir::new().unwrap();
    let room = folder.path().join("room.obj");
    fs::write(&room, "mtllib it.mtl\n").unwrap();
    fs::create_dir(folder.path().join("it.mtl")).unwrap();
    refused(load_obj(&room), ErrorKind::File, &["room.obj:1: ", "'it.mtl'", "folder"]);
    fs::remove_dir(folder.path().join("it.mtl")).unwrap();
    // Nobody will ever write to it.
    #[cfg(unix)]
    {
        let pipe = folder.path().join("it.mtl");
        assert!(std::process::Command::new("mkfifo").arg(pipe).status().unwrap().success());
        refused(load_obj(&room), ErrorKind::File, &["room.obj:1: ", "'it.mtl'", "regular"]);
    }
}

#[test]
fn files_that_are_too_large() {
    const MOST: u64 = 1 << 30;
    let folder = TempDir::new().unwrap();
    // With a hole, so that it takes no room on the disk.
    let hollow = |name: &str, length: u64| {
        let path = folder.path().join(name);
        fs::File::create(&path).unwrap().set_len(length).unwrap();
        path
    };
    let large = hollow("large.obj", MOST + 1);
    refused(load_obj(large), ErrorKind::File, &["large.obj: ", "more than 1073741824 bytes"]);
    // The first library leaves less for the second.
    fs::write(folder.path().join("chalk.mtl"), CHALK).unwrap();
    hollow("large.mtl", MOST);
    let room = folder.path().join("room.obj");
    fs::write(&room, "mtllib chalk.mtl\nmtllib large.mtl\n").unwrap();
    let left = format!("more than {} bytes", MOST - CHALK.len() as u64);
    refused(load_obj(&room), ErrorKind::File, &["room.obj:2: ", "'large.mtl'", &left]);
}

#[test]
fn a_library_is_loaded_once_and_names_no_other() {
    let text = format!("{}{SQUARE}usemtl chalk\nf 1 2 3\n", "mtllib room.mtl\n".repeat(1000));
    let library = format!("mtllib room.mtl\nmtllib gone.mtl\n{CHALK}");
    let files = [("room.obj", text.as_bytes()), ("room.mtl", library.as_bytes())];
    let scene = load(&files).unwrap();
    assert_eq!((scene.materials().len(), scene.warnings().len()), (1, 0));
}

#[test]
fn scenes_from_memory() {
    let text = format!("mtllib paints/a b.mtl\n{SQUARE}usemtl chalk\nf 1 2 3 4\n");
    let library = ("paints/a b.mtl", CHALK.as_bytes());
    let scene = read_obj("room.obj", text.as_bytes(), &[library]).unwrap();
    assert_eq!((area(&scene), &*scene.material(0).name), (1.0, "chalk"));
    let gone = read_obj("room.obj", text.as_bytes(), &[]);
    refused(gone, ErrorKind::File, &["room.obj:1: ", "'paints/a' cannot be read", "no .mtl"]);
    let other = read_obj("room.obj", text.as_bytes(), &[("c.mtl", b"")]);
    refused(other, ErrorKind::File, &["room.obj:1: ", "'paints/a' cannot be read", "has 'c.mtl'"]);
}

#[test]
fn long_names_and_control_characters_do_not_get_into_messages() {
    for name in ["x".repeat(1_000_000), "\u{1b}[2J\u{7}\0\u{202e}".into()] {
        let huge = "v 0 0 0\nv 1e200 0 0\nv 0 1e200 0\n";
        let colour = format!("newmtl {name}\nKd 2\n");
        for result in [
            obj(&format!("mtllib {name}\n")),
            obj(&format!("{SQUARE}usemtl {name}\n")),
            obj(&format!("{huge}g {name}\nf 1 2 3\n")),
            obj(&format!("{SQUARE}g {name}\nf 1 3 2 4\n")),
            obj(&format!("{SQUARE}f 1 2 {name}\n")),
            obj(&format!("v 0 0 {name}\n")),
            obj(&format!("s {name}\n")),
            with_library(&colour),
        ] {
            let message = result.unwrap_err().to_string();
            assert!(message.len() < 600 && !message.contains(char::is_control), "{message:?}");
            assert!(!message.contains('\u{202e}'), "{message:?}");
        }
    }
}

#[test]
fn library_names_may_have_spaces_or_be_several() {
    let body = format!("{SQUARE}usemtl chalk\nf 1 2 3\nusemtl slate\nf 1 3 4\n");
    let slate: &[u8] = b"newmtl slate\nKd 0.1\n";
    let one = format!("mtllib a b.mtl\n{body}");
    let both = [CHALK.as_bytes(), slate].concat();
    let scene = load(&[("room.obj", one.as_bytes()), ("a b.mtl", &both)]).unwrap();
    assert_eq!(scene.material(1).reflectance.to_array(), [0.1; 3]);
    let two = format!("mtllib a b.mtl\n{body}");
    let files: [(&str, &[u8]); 3] =
        [("room.obj", two.as_bytes()), ("a", CHALK.as_bytes()), ("b.mtl", slate)];
    let scene = load(&files).unwrap();
    assert_eq!(scene.material(0).reflectance.to_array(), [0.8, 0.7, 0.6]);
    assert_eq!(scene.material(1).name, "slate");
}

#[test]
fn an_unknown_material_is_refused_with_those_that_exist() {
    let text = format!("mtllib room.mtl\n{SQUARE}usemtl chlk\nf 1 2 3 4\n");
    let result = load(&[("room.obj", text.as_bytes()), ("room.mtl", CHALK.as_bytes())]);
    refused(result, ErrorKind::Scene, &["room.obj:6: ", "'chlk'", "'chalk'"]);
    let none = obj(&format!("{SQUARE}usemtl chalk\nf 1 2 3 4\n"));
    refused(none, ErrorKind::Scene, &["room.obj:5: ", "'chalk'", "mtllib FILE"]);
    refused(obj("usemtl\n"), ErrorKind::Scene, &["room.obj:1: ", "no material name"]);
}

#[test]
fn reflectance_and_radiance_are_taken_per_channel() {
    let scene = with_library("newmtl chalk\nKd 0 0.5 0.999\nKe 1 2 3 # W/(m2 sr)\n").unwrap();
    let chalk = scene.material(0);
    assert_eq!(chalk.reflectance.to_array(), [0.0, 0.5, 0.999]);
    assert_eq!(chalk.exitance.to_array(), [PI, 2.0 * PI, 3.0 * PI]);
    assert!(scene.warnings().is_empty(), "{:?}", scene.warnings());
    let scene = with_library("newmtl chalk\nKd 0.25\nKe 2\n").unwrap();
    assert_eq!(scene.material(0).reflectance.to_array(), [0.25; 3]);
    assert_eq!(scene.material(0).exitance.to_array(), [2.0 * PI; 3]);
}

#[test]
fn bad_material_numbers_name_the_line_and_the_material() {
    let bad = ["Kd 1 0 0", "Kd 0 1.5 0", "Kd 0 0 -0.1", "Kd nan 0 0", "Kd 0 inf 0", "Kd 0.5 0.5"];
    let bad = bad.into_iter().chain(["Kd", "Kd red", "Kd 0.1 0.1 0.1 0.1", "Kd spectral a.rfl 1"]);
    let bad = bad.chain(["Kd xyz 0.1 0.1 0.1", "Ke -1 0 0", "Ke 0 1e999 0", "Ke 1e308 0 0"]);
    for line in bad.chain(["d nan", "d", "Tr 1e400"]) {
        let parts = ["room.mtl:3: ", "'chalk'", &format!("{line:?}")];
        refused(with_library(&format!("newmtl chalk\n\n{line}\n")), ErrorKind::Scene, &parts);
    }
    let spectral = with_library("newmtl chalk\nKd spectral a.rfl\n");
    refused(spectral, ErrorKind::Scene, &["unsupported", "spectral"]);
    refused(with_library("Kd 0.5 0.5 0.5\n"), ErrorKind::Scene, &["room.mtl:1: ", "newmtl"]);
    refused(with_library("newmtl\n"), ErrorKind::Scene, &["room.mtl:1: ", "without a name"]);
}

#[test]
fn what_is_not_modelled_or_missing_in_a_material_is_warned_about() {
    let scene = with_library("newmtl chalk\nKs 1 1 1\n").unwrap();
    assert_eq!(scene.material(0).reflectance.to_array(), [0.0; 3]);
    warned(&scene, "black: 'chalk'");
    assert!(with_library("newmtl chalk\nKe 1 1 1\n").unwrap().warnings().is_empty());
    for texture in ["map_Kd wood.png", "map_Ke wood.png"] {
        warned(&with_library(&format!("{CHALK}{texture}\n")).unwrap(), "textures");
    }
    for clear in ["d 0.5", "d -halo 0.5", "Tr 0.5", "map_d holes.png"] {
        warned(&with_library(&format!("{CHALK}{clear}\n")).unwrap(), "transparency");
    }
    for opaque in ["d 1", "Tr 0", "Tr 1"] {
        let scene = with_library(&format!("{CHALK}{opaque}\n")).unwrap();
        assert!(scene.warnings().is_empty(), "{:?}", scene.warnings());
    }
    let scene = with_library(&format!("{CHALK}newmtl chalk\nKd 0.1\n")).unwrap();
    assert_eq!(scene.material(0).reflectance.to_array(), [0.1; 3]);
    warned(&scene, "several definitions");
    // Nobody uses it, so nobody needs to know.
    let scene = with_library(&format!("{CHALK}newmtl glass\nd 0\n")).unwrap();
    assert!(scene.warnings().is_empty(), "{:?}", scene.warnings());
}

#[test]
fn coordinates_must_be_three_finite_numbers() {
    let bad = ["0 nan 0", "NaN 0 0", "0 0 inf", "-inf 0 0", "1e999 0 0", "0 zero 0", "0 0", ""];
    for numbers in bad.into_iter().chain(["0 0 0 0", "1e300 0 0 1e-300", "0 0 0 nan", "0 0 0 1 1"])
    {
        let text = format!("# a comment\nv {numbers}\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
        let line = format!("v {numbers}").trim().to_string();
        refused(obj(&text), ErrorKind::Scene, &["room.obj:2: ", &format!("{line:?}")]);
    }
    let good = obj("v 0 0 0 0.1 0.2 0.3\nv 2 0 0 2\nv 0 1 0 # last\nf 1 2 3\n").unwrap();
    assert_eq!(area(&good), 0.5);
}

#[test]
fn scenes_without_a_face_or_without_area() {
    for text in ["", "\n\n", "# nothing\n", SQUARE, "mtllib room.obj\n"] {
        refused(obj(text), ErrorKind::Scene, &["room.obj: ", "no face"]);
    }
    let flat = format!("{SQUARE}v 2 0 0\nf 1 2 5\nf 1 1 2\nf 1 2\nf 3\nf 1 2 1 2\nf 1 2 5 2\n");
    refused(obj(&flat), ErrorKind::Scene, &["room.obj: scene: ", "6 triangles, none with area"]);
    let scene = obj(&format!("{flat}f 1 2 3\n")).unwrap();
    assert_eq!((scene.triangles().len(), scene.degenerate()), (1, 6));
    warned(&scene, "6 triangles without area");
    // Its area is a number, but that squared is not.
    let tiny = SQUARE.replace('1', "1e-80");
    refused(obj(&format!("{tiny}f 1 2 3\n")), ErrorKind::Scene, &["none with area"]);
}

#[test]
fn vertex_indices_must_exist() {
    for (corner, found) in [("0", "index 0"), ("5", "index 5 of 4"), ("-5", "index -5 of 4")] {
        for form in ["", "/1", "//1", "/1/1"] {
            let text = format!("{SQUARE}f 1 2 {corner}{form}\n");
            let parts = ["room.obj:5: ", &format!("'{corner}{form}'"), found];
            refused(obj(&text), ErrorKind::Scene, &parts);
        }
    }
    for corner in ["9223372036854775807", "-9223372036854775808", "18446744073709551616", "1.5"] {
        let text = format!("{SQUARE}f 1 2 {corner}\n");
        refused(obj(&text), ErrorKind::Scene, &["room.obj:5: ", corner]);
    }
    for corner in ["x", "/1", "1/x", "1/2/x", "1/2/3/4", "1\\2"] {
        let text = format!("{SQUARE}f 1 2 {corner}\n");
        refused(obj(&text), ErrorKind::Scene, &["room.obj:5: ", "v//vn"]);
    }
    refused(obj("f 1 2 3\n"), ErrorKind::Scene, &["room.obj:1: ", "no vertex so far"]);
    refused(obj(&format!("{SQUARE}f\n")), ErrorKind::Scene, &["room.obj:5: ", "without corners"]);
    // Counted back from where the face stands.
    let scene = obj(&format!("{SQUARE}f -4 -3 -2 -1\nv 9 9 9\nf -5 -4 -3\n")).unwrap();
    assert_eq!(area(&scene), 1.5);
    assert_eq!(scene.corners(2), scene.corners(0));
}

#[test]
fn every_form_of_corner_is_read() {
    let more = "vt 0 0\nvt 1 0\nvn 0 0 1\n";
    for face in ["1 2 3 4", "1/1 2/2 3/1 4/2", "1//1 2//1 3//1 4//1", "1/1/1 2/2/1 3/1/1 4/1/1"] {
        let scene = obj(&format!("{SQUARE}{more}f {face}\n")).unwrap();
        assert_eq!((scene.triangles().len(), area(&scene)), (2, 1.0), "{face}");
        assert_eq!(scene.normal(0).to_array(), [0., 0., 1.]);
    }
    // What is not used need not exist.
    assert_eq!(area(&obj(&format!("{SQUARE}f 1/7/9 2/-7/-9 3/0/0\n")).unwrap()), 0.5);
}

#[test]
fn bytes_that_are_no_obj_at_all() {
    // A linear congruential generator (Knuth, MMIX).
    let mut state = 1u64;
    let mut noise = |n: usize| -> Vec<u8> {
        let step = |s: u64| s.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        let byte = |_| {
            state = step(state);
            (state >> 56) as u8
        };
        (0..n).map(byte).collect()
    };
    refused(load(&[("room.obj", &noise(100_000))]), ErrorKind::Scene, &["room.obj", "no face"]);
    refused(load(&[("room.obj", &[0; 100_000])]), ErrorKind::Scene, &["room.obj", "not OBJ"]);
    // Noise between words of the format: refused or taken, but never a panic.
    let words =
        ["v", "f", "l", "o", "g", "s", "usemtl", "mtllib", "1", "-1", "0.5", "/", "\\", "\n"];
    for _ in 0..300 {
        let mut bytes = SQUARE.as_bytes().to_vec();
        for pick in noise(60) {
            let word = words.get(pick as usize % 20).map(|w| w.as_bytes().to_vec());
            bytes.extend(word.unwrap_or_else(|| vec![pick]));
            bytes.push(if pick < 128 { b' ' } else { b'\n' });
        }
        bytes.extend(b"\nf 1 2 3\n");
        let library = bytes.clone();
        let _ = load(&[("room.obj", &bytes)]);
        let text = format!("mtllib room.mtl\n{SQUARE}f 1 2 3\n");
        let _ = load(&[("room.obj", text.as_bytes()), ("room.mtl", &library)]);
    }
}

#[test]
fn names_that_are_not_utf_8_still_match() {
    let text = [b"mtllib room.mtl\n", SQUARE.as_bytes(), b"g b\xe9ton\nusemtl b\xe9ton\nf 1 2 3\n"];
    let scene = load(&[("room.obj", &text.concat()), ("room.mtl", b"newmtl b\xe9ton\nKd 0.3\n")]);
    assert_eq!(scene.unwrap().groups(), ["b\u{fffd}ton"]);
}

#[test]
fn a_polygon_of_a_hundred_thousand_corners() {
    let n = 100_000;
    let angle = |i: usize| 2.0 * PI * i as f64 / n as f64;
    let vertex = |i| format!("v {:.17} {:.17} 0\n", angle(i).cos(), angle(i).sin());
    let mut text: String = (0..n).map(vertex).collect();
    let corners: Vec<String> = (1..=n).map(|i| i.to_string()).collect();
    text += &format!("f {}\n", corners.join(" "));
    let scene = obj(&text).unwrap();
    assert_eq!(scene.triangles().len(), n - 2);
    // The polygon's own area is n/2 sin(2π/n); a sum of 1e5 terms rounds by up to 1e5 ε = 2e-11.
    assert!((area(&scene) - 0.5 * n as f64 * angle(1).sin()).abs() < 1e-10);
    // The first corner is one of all triangles: what is done around a vertex must not be done for
    // each of its neighbours.
    let mesh = Mesh::new(scene, f64::INFINITY).unwrap();
    let surface = VertexMesh::new(&mesh, &vec![Rgb::ONE; n - 2]);
    assert_eq!(surface.positions.len(), n);
    // Even light stays even, as far as the fits at the boundary let it.
    assert!(surface.radiosity.iter().all(|b| b.abs_diff_eq(Rgb::ONE, 2e-6)));
}

#[test]
fn a_polygon_of_very_many_corners_that_is_not_convex() {
    // Along a parabola from below: what is cut off has all other corners near it.
    let parabola = |n: usize| {
        let x = |i: usize| 2.0 * i as f64 / n as f64 - 1.0;
        let arc: String = (0..=n).map(|i| format!("v {} {} 0\n", x(i), x(i) * x(i))).collect();
        let corners: Vec<String> = (1..=n + 3).map(|i| i.to_string()).collect();
        obj(&format!("{arc}v 1 -1 0\nv -1 -1 0\nf {}\n", corners.join(" ")))
    };
    assert_eq!(parabola(9_997).unwrap().triangles().len(), 9_998);
    refused(parabola(9_998), ErrorKind::Scene, &["10001 corners", "may have 10000 corners"]);
}

#[test]
fn polygons_that_cannot_be_cut_are_named() {
    let text = format!("{SQUARE}g wall\nf 1 2 3\ng floor\nf 1 3 2 4\n");
    let parts = ["room.obj:8: ", "face 2 ", "'floor'"];
    refused(obj(&text), ErrorKind::Scene, &parts);
    // Concave, with the front that its corners turn to.
    let text = "v 0 0 0\nv 0 3 0\nv 1 3 0\nv 1 1 0\nv 2 1 0\nv 2 3 0\nv 3 3 0\nv 3 0 0\n";
    let scene = obj(&format!("{text}f 1 2 3 4 5 6 7 8\n")).unwrap();
    assert_eq!(area(&scene), 7.0);
    assert!((0..scene.triangles().len()).all(|t| scene.normal(t).to_array() == [0., 0., -1.]));
    // A corner given twice in a row is one corner.
    assert_eq!(obj(&format!("{SQUARE}f 1 2 2 3 4 1\n")).unwrap().triangles().len(), 2);
    assert_eq!(obj(&format!("{SQUARE}f 1 2 3 3\n")).unwrap().triangles().len(), 1);
}

#[test]
fn white_space_and_line_ends_of_every_kind() {
    let text = format!("mtllib room.mtl\n{SQUARE}g two words\nusemtl old chalk\nf 1 2 3 4\n");
    let mtl = "newmtl old chalk\nKd 0.8 0.7 0.6\n";
    let tabs = |s: &str| s.replace("two words", "two\u{1}words").replace(' ', "\t\t");
    let tabs = |s: &str| tabs(&s.replace("old chalk", "old\u{1}chalk")).replace('\u{1}', " ");
    type Change<'a> = &'a dyn Fn(&str) -> String;
    let forms: [(&str, Change); 6] = [
        ("as it is", &|s| s.into()),
        ("CRLF", &|s| s.replace('\n', "\r\n")),
        ("CR", &|s| s.replace('\n', "\r")),
        ("tabs", &tabs),
        ("byte-order mark", &|s| format!("\u{feff}{s}")),
        ("indented", &|s| format!("  {}", s.replace('\n', "  \n\t"))),
    ];
    for (form, change) in forms {
        let (text, mtl) = (change(&text), change(mtl));
        let scene = load(&[("room.obj", text.as_bytes()), ("room.mtl", mtl.as_bytes())]);
        let scene = scene.unwrap_or_else(|e| panic!("{form}: {e}"));
        assert_eq!((area(&scene), scene.groups()), (1.0, &["two words".to_string()][..]), "{form}");
        assert_eq!(scene.material(0).name, "old chalk", "{form}");
        assert!(scene.warnings().is_empty(), "{form}: {:?}", scene.warnings());
        // The line number does not depend on the form either.
        let bad = change("v 0 0 0\n\nv 0 nan 0\n");
        refused(load(&[("room.obj", bad.as_bytes())]), ErrorKind::Scene, &["room.obj:3: "]);
    }
    assert_eq!(area(&obj(&format!("{SQUARE}f 1 \\\n 2 3\\\r\n4")).unwrap()), 1.0);
}

#[test]
fn faces_without_a_material_reflect_the_default() {
    let scene = obj(&format!("{SQUARE}f 1 2 3 4\n")).unwrap();
    assert_eq!(scene.material(1).reflectance.to_array(), [0.5; 3]);
    assert_eq!(scene.material(1).exitance.to_array(), [0.0; 3]);
    assert_eq!(scene.groups(), ["default"]);
    warned(&scene, "no face names a material: all 1 reflect 0.5");
    let text = format!("{SQUARE}mtllib room.mtl\nf 1 2 3\nf 1 3 4\nusemtl chalk\nf 3 2 1\n");
    let scene = load(&[("room.obj", text.as_bytes()), ("room.mtl", CHALK.as_bytes())]).unwrap();
    let red: Vec<f64> = (0..3).map(|t| scene.material(t).reflectance.x).collect();
    assert_eq!(red, [0.5, 0.5, 0.8]);
    warned(&scene, "2 faces before the first `usemtl`");
}

#[test]
fn a_group_that_comes_again_is_the_same_group() {
    let text = "g a\nf 1 2 3\no b\nf 1 3 4\no unused\ng a\nf 1 2 4\ng\nf 2 3 4\n";
    let scene = obj(&format!("{SQUARE}{text}")).unwrap();
    assert_eq!(scene.groups(), ["a", "b", "default"]);
    let groups: Vec<u32> = scene.triangles().iter().map(|t| t.group).collect();
    assert_eq!(groups, [0, 1, 0, 2]);
}

#[test]
fn smoothing_groups_last_until_the_next() {
    let text = "f 1 2 3\ns 4294967295 # all\nf 1 2 3 4\ng a\nf 1 2 3\no b\ns 2\nf 1 2 3\n";
    let off = "s off\nf 1 2 3\ns 7\ns 0\nf 1 2 3\ns 2\nf 1 2 3\n";
    let scene = obj(&format!("{SQUARE}{text}{off}")).unwrap();
    let groups: Vec<Option<u32>> = scene.triangles().iter().map(|t| t.smoothing).collect();
    let all = Some(u32::MAX);
    assert_eq!(groups, [None, all, all, all, Some(2), Some(0), Some(0), Some(2)]);
    assert_eq!(scene.warnings().len(), 1, "only of the material: {:?}", scene.warnings());
    // Without a group they say nothing.
    let scene = obj(&format!("{SQUARE}s 1\ns\nf 1 2 3\ns 1\ns on # and\nf 1 2 3\n")).unwrap();
    assert!(scene.triangles().iter().all(|t| t.smoothing.is_none()));
    warned(&scene, "2 `s` lines without a group");
    warned(&scene, "room.obj:6");
}

#[test]
fn smoothing_groups_must_be_whole_numbers() {
    for group in ["-1", "1.0", "4294967296", "x", "nan", "1 2", "off 1", "on 1", "Off"] {
        let text = format!("{SQUARE}s {group}\nf 1 2 3\n");
        let parts =
            ["room.obj:5: ", &format!("smoothing group '{group}'"), "`s off`", "whole number"];
        refused(obj(&text), ErrorKind::Scene, &parts);
    }
}

#[test]
fn a_fold_of_two_smoothing_groups_is_a_crease() {
    // Folded by 27°, along the diagonal.
    let square = SQUARE.replace("1 1 0", "1 1 0.34");
    for (first, second, vertices) in
        [("", "", 4), ("s 1", "", 4), ("s 1", "s 2", 6), ("s off", "", 6), ("", "s 1", 6)]
    {
        let text = format!("{square}{first}\nf 1 2 4\n{second}\nf 2 3 4\n");
        let mesh = Mesh::new(obj(&text).unwrap(), f64::INFINITY).unwrap();
        let light = [Rgb::ONE; 2];
        let mut rays = RayGather::new(&mesh, 64).unwrap();
        let fine = RefinementSettings::new(9.0).gather(
            &GatheredMesh::from_elements(&mesh, &light).unwrap(),
            &mesh,
            &mut rays,
            keep_going,
        );
        for surface in [VertexMesh::new(&mesh, &light), fine.unwrap().surface] {
            assert_eq!(surface.positions.len(), vertices, "{first}, {second}");
        }
    }
}

#[test]
fn what_is_passed_over_is_counted() {
    let text = format!("{SQUARE}s off\nvt 0 0\nvn 0 0 1\np 1\nl 1 2\nl 2 3\nf 1 2 3\n");
    warned(&obj(&text).unwrap(), "3 `p` and `l` lines");
    let scene = obj(&format!("{SQUARE}curv 0 1\nf 1 2 3\nsurf 0\n")).unwrap();
    warned(&scene, "2 lines of unknown kind");
    warned(&scene, "room.obj:5");
}
