//! MTL files, good and bad, and where they lie.

use std::f64::consts::PI;
use std::fs;

use radiosity::{ErrorKind, load_obj};
use tempfile::TempDir;

use super::obj_texts::{CHALK, SQUARE, load, obj, refused, warned, with_library};

#[test]
fn missing_library_names_line_and_neighbours() {
    let text = format!("{SQUARE}\nmtllib paints.mtl\nf 1 2 3\n");
    let only = load(&[("room.obj", text.as_bytes())]);
    assert!(std::error::Error::source(only.as_ref().unwrap_err()).is_some());
    refused(only, ErrorKind::File, "room.obj:6", &["paints.mtl", "no .mtl file"]);
    let other: (&str, &[u8]) = ("paint.mtl", b"");
    let parts = ["paints.mtl", "has 'paint.mtl'"];
    refused(load(&[("room.obj", text.as_bytes()), other]), ErrorKind::File, "room.obj:6", &parts);
    refused(obj("mtllib\nf 1\n"), ErrorKind::Scene, "room.obj:1", &["no file name"]);
}

#[test]
fn rejects_libraries_outside_the_folder() {
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
        let parts = [outside, "not in the folder of the OBJ file", "'chalk.mtl'"];
        refused(load(outside), ErrorKind::File, "room.obj:5", &parts);
    }
}

#[test]
fn rejects_libraries_that_are_no_files() {
    let folder = TempDir::new().unwrap();
    let room = folder.path().join("room.obj");
    fs::write(&room, "mtllib it.mtl\n").unwrap();
    fs::create_dir(folder.path().join("it.mtl")).unwrap();
    refused(load_obj(&room), ErrorKind::File, "room.obj:1", &["'it.mtl'", "folder"]);
    fs::remove_dir(folder.path().join("it.mtl")).unwrap();
    // Nobody will ever write to it.
    #[cfg(unix)]
    {
        let pipe = folder.path().join("it.mtl");
        assert!(std::process::Command::new("mkfifo").arg(pipe).status().unwrap().success());
        refused(load_obj(&room), ErrorKind::File, "room.obj:1", &["'it.mtl'", "regular"]);
    }
}

#[test]
fn library_is_loaded_once() {
    let text = format!("{}{SQUARE}usemtl chalk\nf 1 2 3\n", "mtllib room.mtl\n".repeat(1000));
    let library = format!("mtllib room.mtl\nmtllib gone.mtl\n{CHALK}");
    let files = [("room.obj", text.as_bytes()), ("room.mtl", library.as_bytes())];
    let scene = load(&files).unwrap();
    assert_eq!((scene.materials().len(), scene.warnings().len()), (1, 0));
}

#[test]
fn library_names_may_have_spaces() {
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
fn unknown_material_lists_those_that_exist() {
    let text = format!("mtllib room.mtl\n{SQUARE}usemtl chlk\nf 1 2 3 4\n");
    let result = load(&[("room.obj", text.as_bytes()), ("room.mtl", CHALK.as_bytes())]);
    refused(result, ErrorKind::Scene, "room.obj:6", &["'chlk'", "'chalk'"]);
    let none = obj(&format!("{SQUARE}usemtl chalk\nf 1 2 3 4\n"));
    refused(none, ErrorKind::Scene, "room.obj:5", &["'chalk'", "mtllib FILE"]);
    refused(obj("usemtl\n"), ErrorKind::Scene, "room.obj:1", &["no material name"]);
}

#[test]
fn reads_reflectance_and_radiance_per_channel() {
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
fn bad_material_numbers_name_line_and_material() {
    let bad = ["Kd 1 0 0", "Kd 0 1.5 0", "Kd 0 0 -0.1", "Kd nan 0 0", "Kd 0 inf 0", "Kd 0.5 0.5"];
    let bad = bad.into_iter().chain(["Kd", "Kd red", "Kd 0.1 0.1 0.1 0.1", "Kd spectral a.rfl 1"]);
    let bad = bad.chain(["Kd xyz 0.1 0.1 0.1", "Ke -1 0 0", "Ke 0 1e999 0", "Ke 1e308 0 0"]);
    for line in bad.chain(["d nan", "d", "Tr 1e400"]) {
        let parts = ["'chalk'", &format!("{line:?}")];
        refused(
            with_library(&format!("newmtl chalk\n\n{line}\n")),
            ErrorKind::Scene,
            "room.mtl:3",
            &parts,
        );
    }
    let spectral = with_library("newmtl chalk\nKd spectral a.rfl\n");
    refused(spectral, ErrorKind::Scene, "room.mtl:2", &["unsupported", "spectral"]);
    refused(with_library("Kd 0.5 0.5 0.5\n"), ErrorKind::Scene, "room.mtl:1", &["newmtl"]);
    refused(with_library("newmtl\n"), ErrorKind::Scene, "room.mtl:1", &["without a name"]);
}

#[test]
fn warns_of_unmodelled_material_properties() {
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
fn faces_without_material_reflect_default() {
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
