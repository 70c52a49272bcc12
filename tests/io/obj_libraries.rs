//! Where libraries of materials are looked for, and where not.

use std::fs;

use radiosity::scene::WarningKind;
use radiosity::{ErrorKind, load_scene};
use tempfile::TempDir;

use super::obj_texts::{
    CHALK, SQUARE, load, load_strictly, obj, oddities, refused, repaired, warned,
};

const SLATE: &[u8] = b"newmtl slate\nKd 0.1\n";

/// Two triangles of `chalk` and `slate`, with this before them.
fn two(first: &str) -> String {
    format!("{first}\n{SQUARE}usemtl chalk\nf 1 2 3\nusemtl slate\nf 1 3 4\n")
}

#[test]
fn missing_library_names_line_and_neighbours() {
    let text = format!("{SQUARE}\nmtllib paints.mtl\nf 1 2 3\n");
    let only: [(&str, &[u8]); 1] = [("room.obj", text.as_bytes())];
    warned(&load(&only).unwrap(), "has no .mtl file ('paints.mtl')");
    refused(load_strictly(&only), ErrorKind::Scene, "room.obj:6", &["'paints.mtl'"]);
    let files: [(&str, &[u8]); 2] = [only[0], ("paint.mtl", b"")];
    repaired(&files, "has 'paint.mtl' ('paints.mtl')", "room.obj:6", "'paints.mtl'");
    warned(&obj(&format!("mtllib\n{SQUARE}f 1 2 3\n")).unwrap(), "1 missing library");
}

#[test]
fn library_is_looked_for_below_the_folder_only() {
    let folder = TempDir::new().unwrap();
    let room = folder.path().join("room/room.obj");
    fs::create_dir_all(folder.path().join("room/Paints")).unwrap();
    for library in ["outside.mtl", "room/chalk.mtl", "room/Paints/paint.mtl"] {
        fs::write(folder.path().join(library), CHALK).unwrap();
    }
    let load = |library: &str| {
        fs::write(&room, format!("{SQUARE}mtllib {library}\nusemtl chalk\nf 1 2 3\n")).unwrap();
        load_scene(&room).unwrap()
    };
    let as_written = ["chalk.mtl", "./chalk.mtl", "Paints/paint.mtl", "Paints/./paint.mtl"];
    for inside in as_written {
        let scene = load(inside);
        assert_eq!((scene.material(0).reflectance.x, oddities(&scene).len()), (0.8, 0), "{inside}");
    }
    let absolute = folder.path().join("room/chalk.mtl").display().to_string();
    for elsewhere in [
        "Paints\\paint.mtl",
        ".\\paints\\PAINT.MTL",
        "CHALK.mtl",
        "C:\\Users\\ann\\room\\Paints\\paint.mtl",
        "/home/ann/chalk.mtl",
        "../chalk.mtl",
        "Paints/../chalk.mtl",
        "gone/chalk.mtl",
        &absolute,
    ] {
        let scene = load(elsewhere);
        assert_eq!(scene.material(0).reflectance.x, 0.8, "{elsewhere}");
        assert_eq!(oddities(&scene), [WarningKind::LibraryElsewhere], "{elsewhere}");
    }
    let gone = |scene: &radiosity::Scene| {
        scene.material(0).reflectance.x == 0.5
            && oddities(scene) == [WarningKind::MissingLibrary, WarningKind::UnknownMaterial]
    };
    let absolute = folder.path().join("outside.mtl").display().to_string();
    for outside in ["../outside.mtl", "..", "/dev/zero", &absolute, "paint.mtl"] {
        assert!(gone(&load(outside)), "{outside}");
    }
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("../outside.mtl", folder.path().join("room/link.mtl")).unwrap();
        assert!(gone(&load("link.mtl")), "a link out of the folder");
    }
}

#[test]
fn libraries_that_are_no_files_are_missing() {
    let folder = TempDir::new().unwrap();
    let room = folder.path().join("room.obj");
    fs::write(&room, format!("mtllib it.mtl\n{SQUARE}f 1 2 3\n")).unwrap();
    fs::create_dir(folder.path().join("it.mtl")).unwrap();
    warned(&load_scene(&room).unwrap(), "1 missing library, at ");
    fs::remove_dir(folder.path().join("it.mtl")).unwrap();
    // Nobody will ever write to it.
    #[cfg(unix)]
    {
        let pipe = folder.path().join("it.mtl");
        assert!(std::process::Command::new("mkfifo").arg(pipe).status().unwrap().success());
        warned(&load_scene(&room).unwrap(), "1 missing library, at ");
    }
}

#[test]
fn library_is_loaded_once() {
    let text = format!("{}{SQUARE}usemtl chalk\nf 1 2 3\n", "mtllib room.mtl\n".repeat(1000));
    let library = format!("mtllib room.mtl\nmtllib gone.mtl\n{CHALK}");
    let files = [("room.obj", text.as_bytes()), ("room.mtl", library.as_bytes())];
    let scene = load(&files).unwrap();
    assert_eq!((scene.materials().len(), oddities(&scene).len()), (1, 0));
    // As however it is spelled.
    let text = format!(
        "mtllib ./room.mtl\nmtllib room.mtl\nmtllib .//././room.mtl\n\
         {SQUARE}usemtl chalk\nf 1 2 3\n"
    );
    for name in ["room.mtl", "./room.mtl"] {
        let files = [("room.obj", text.as_bytes()), (name, CHALK.as_bytes())];
        for scene in [load(&files).unwrap(), load_strictly(&files).unwrap()] {
            assert_eq!((scene.materials().len(), oddities(&scene).len()), (1, 0), "{name}");
        }
    }
}

#[test]
fn library_names_may_have_spaces() {
    let chalk = CHALK.as_bytes();
    let both = [chalk, SLATE].concat();
    type Files<'a> = &'a [(&'a str, &'a [u8])];
    let cases: [(&str, Files); 9] = [
        ("mtllib a b.mtl", &[("a b.mtl", &both)]),
        ("mtllib a b.mtl", &[("a", chalk), ("b.mtl", SLATE)]),
        ("mtllib a b.mtl c.mtl", &[("a b.mtl", chalk), ("c.mtl", SLATE)]),
        ("mtllib c.mtl a b.mtl", &[("a b.mtl", chalk), ("c.mtl", SLATE)]),
        ("mtllib a b c.mtl a b d.mtl", &[("a b c.mtl", chalk), ("a b d.mtl", SLATE)]),
        ("mtllib a\\ b.mtl c.mtl", &[("a b.mtl", chalk), ("c.mtl", SLATE)]),
        ("mtllib \"a b.mtl\" \"c.mtl\"", &[("a b.mtl", chalk), ("c.mtl", SLATE)]),
        ("mtllib \"a b.mtl\"", &[("a b.mtl", &both)]),
        ("mtllib a.mtl \\\n   c.mtl", &[("a.mtl", chalk), ("c.mtl", SLATE)]),
    ];
    for (line, libraries) in cases {
        let text = two(line);
        let files = [&[("room.obj", text.as_bytes())][..], libraries].concat();
        let scene = load(&files).unwrap();
        assert_eq!(scene.material(0).reflectance.to_array(), [0.8, 0.7, 0.6], "{line}");
        assert_eq!(scene.material(1).reflectance.to_array(), [0.1; 3], "{line}");
        assert_eq!(oddities(&scene), [], "{line}: {:?}", scene.warnings());
    }
    // Some are there, some are not.
    let text = two("mtllib gone.mtl far\\ away.mtl a b.mtl");
    let files = [("room.obj", text.as_bytes()), ("a b.mtl", &*both)];
    let scene = repaired(&files, "('gone.mtl', 'far away.mtl')", "room.obj:1", "'gone.mtl'");
    assert_eq!(scene.material(1).reflectance.to_array(), [0.1; 3]);
}

#[test]
fn library_of_the_same_name_serves_where_none_is_found() {
    for first in ["", "mtllib gone.mtl"] {
        for library in ["room.mtl", "room.obj.mtl", "Room.MTL"] {
            let text = two(first);
            let both = [CHALK.as_bytes(), SLATE].concat();
            let scene = load(&[("room.obj", text.as_bytes()), (library, &both)]).unwrap();
            assert_eq!(scene.material(1).reflectance.to_array(), [0.1; 3], "{first} {library}");
            warned(&scene, &format!("('{library}')"));
        }
    }
}

#[test]
fn a_hundred_thousand_libraries_are_not_looked_for() {
    let names: String = (0..100_000).map(|k| format!(" {k}.mtl")).collect();
    let lines = names.replace(' ', "\nmtllib ");
    for libraries in [format!("mtllib{names}\n"), format!("{lines}\n")] {
        let scene = obj(&format!("{libraries}{SQUARE}f 1 2 3\n")).unwrap();
        warned(&scene, "100000 missing libraries");
    }
}
