//! OBJ and MTL files, good and bad: what is taken, what is refused, and what the message names.

use std::fs;
use std::path::Path;

use radiosity::backend::cpu::RayGather;
use radiosity::gather::{RefinementSettings, gather_at_vertices};
use radiosity::io::read_scene;
use radiosity::{ErrorKind, GatheredMesh, Mesh, Rgb, SceneSettings, VertexMesh, load_scene};
use tempfile::TempDir;

use super::obj_texts::load_strictly;
use super::obj_texts::{
    CHALK, SQUARE, area, load, name_of, obj, oddities, refused, repaired, warned,
};
use crate::common::keep_going;

#[test]
fn rejects_unreadable_files() {
    let folder = TempDir::new().unwrap();
    let missing = load_scene(folder.path().join("attic.obj"));
    let source = std::error::Error::source(missing.as_ref().unwrap_err()).unwrap();
    let source = source.downcast_ref::<std::io::Error>().unwrap();
    assert_eq!(source.kind(), std::io::ErrorKind::NotFound);
    refused(missing, ErrorKind::File, "attic.obj", &[]);
    refused(load_scene(folder.path()), ErrorKind::File, &name_of(folder.path()), &["folder"]);
    refused(load_scene(""), ErrorKind::File, "", &["cannot be read"]);
    // Opens, but cannot be read from its start.
    #[cfg(target_os = "linux")]
    refused(load_scene("/proc/self/mem"), ErrorKind::File, "/proc/self/mem", &["cannot be read"]);
    #[cfg(unix)]
    refused(load_scene(Path::new("/dev/zero")), ErrorKind::File, "/dev/zero", &["regular"]);
}

#[test]
fn rejects_files_that_are_too_large() {
    const MOST: u64 = 1 << 30;
    let folder = TempDir::new().unwrap();
    // With a hole, so that it takes no room on the disk.
    let hollow = |name: &str, length: u64| {
        let path = folder.path().join(name);
        fs::File::create(&path).unwrap().set_len(length).unwrap();
        path
    };
    let large = hollow("large.obj", MOST + 1);
    refused(load_scene(large), ErrorKind::File, "large.obj", &["more than 1073741824 bytes"]);
    // The first library leaves less for the second.
    fs::write(folder.path().join("chalk.mtl"), CHALK).unwrap();
    hollow("large.mtl", MOST);
    let room = folder.path().join("room.obj");
    fs::write(&room, "mtllib chalk.mtl\nmtllib large.mtl\n").unwrap();
    let left = format!("more than {} bytes", MOST - CHALK.len() as u64);
    refused(load_scene(&room), ErrorKind::File, "room.obj:2", &["'large.mtl'", &left]);
}

#[test]
fn scenes_from_memory() {
    let text = format!("mtllib paints/a b.mtl\n{SQUARE}usemtl chalk\nf 1 2 3 4\n");
    let library = ("paints/a b.mtl", CHALK.as_bytes());
    let scene = read_scene("room.obj", text.as_bytes(), &[library]).unwrap();
    assert_eq!((area(&scene), &*scene.material(0).name), (1.0, "chalk"));
    warned(
        &read_scene("room.obj", text.as_bytes(), &[]).unwrap(),
        "no .mtl file ('paints/a b.mtl')",
    );
    let other = read_scene("room.obj", text.as_bytes(), &[("c.mtl", b"")]).unwrap();
    warned(&other, "has 'c.mtl' ('paints/a b.mtl')");
}

#[test]
fn messages_omit_long_names_and_control_characters() {
    for name in ["x".repeat(1_000_000), "\u{1b}[2J\u{7}\0\u{202e}".into()] {
        let huge = "v 0 0 0\nv 1e200 0 0\nv 0 1e200 0\n";
        let colour = format!("newmtl {name}\nKd 2\n");
        let strict = |text: &str| load_strictly(&[("room.obj", text.as_bytes())]);
        let library = format!("mtllib m.mtl\n{SQUARE}usemtl {name}\nf 1 2 3\n");
        let library = [("room.obj", library.as_bytes()), ("m.mtl", colour.as_bytes())];
        for result in [
            strict(&format!("mtllib {name}\n")),
            strict(&format!("{SQUARE}usemtl {name}\nf 1 2 3\n")),
            obj(&format!("{huge}g {name}\nf 1 2 3\n")),
            strict(&format!("{SQUARE}g {name}\nf 1 3 2 4\n")),
            obj(&format!("{SQUARE}f 1 2 {name}\n")),
            obj(&format!("v 0 0 {name}\n")),
            strict(&format!("s {name}\n")),
            load_strictly(&library),
        ] {
            let message = result.unwrap_err().to_string();
            assert!(message.len() < 600 && !message.contains(char::is_control), "{message:?}");
            assert!(!message.contains('\u{202e}'), "{message:?}");
        }
        let odd = format!("mtllib {name}\n{SQUARE}usemtl {name}\nf 1 2 3\ng {name}\nf 1 3 2 4\n");
        for scene in [obj(&odd), load(&library)] {
            for warning in scene.unwrap().warnings().iter().map(ToString::to_string) {
                assert!(warning.len() < 600 && !warning.contains(char::is_control), "{warning:?}");
            }
        }
    }
}

#[test]
fn rejects_bad_coordinates() {
    let bad = ["0 nan 0", "NaN 0 0", "0 0 inf", "-inf 0 0", "1e999 0 0", "0 zero 0", "0 0", ""];
    for numbers in bad.into_iter().chain(["0 0 0 0", "1e300 0 0 1e-300", "0 0 0 nan"]) {
        let text = format!("# a comment\nv {numbers}\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
        let line = format!("v {numbers}").trim().to_string();
        refused(obj(&text), ErrorKind::Scene, "room.obj:2", &[&format!("{line:?}")]);
    }
    let good = obj("v 0 0 0 0.1 0.2 0.3\nv 2 0 0 2\nv 0 1 0 # last\nf 1 2 3\n").unwrap();
    assert_eq!(area(&good), 0.5);
    // With opacity, and with numbers that nobody knows.
    let more = "v 0 0 0 1 1 1 0.5\nv 1 0 0 7 7\nv 0 1 0 1 2 3 4 5\nf 1 2 3\n";
    let files: [(&str, &[u8]); 1] = [("room.obj", more.as_bytes())];
    let scene = repaired(&files, "2 vertices with too many numbers", "room.obj:2", "`v x y z`");
    assert_eq!(area(&scene), 0.5);
}

#[test]
fn rejects_scenes_without_area() {
    for text in ["", "\n\n", "# nothing\n", SQUARE, "mtllib room.obj\n"] {
        refused(obj(text), ErrorKind::Scene, "room.obj", &["no face"]);
    }
    let flat = format!("{SQUARE}v 2 0 0\nf 1 2 5\nf 1 1 2\nf 1 2\nf 3\nf 1 2 1 2\nf 1 2 5 2\n");
    refused(obj(&flat), ErrorKind::Scene, "room.obj: scene", &["2 triangles, none with area"]);
    let text = format!("{flat}f 1 2 3\n");
    let files: [(&str, &[u8]); 1] = [("room.obj", text.as_bytes())];
    let scene = repaired(&files, "4 faces of fewer than three", "room.obj:7", "three corners");
    assert_eq!((scene.triangles().len(), scene.degenerate()), (1, 2));
    warned(&scene, "2 triangles without area");
    // Its area is a number, but that squared is not.
    let tiny = SQUARE.replace('1', "1e-80");
    refused(
        obj(&format!("{tiny}f 1 2 3\n")),
        ErrorKind::Scene,
        "room.obj: scene",
        &["none with area"],
    );
}

#[test]
fn rejects_bad_vertex_indices() {
    for (corner, found) in [("0", "index 0"), ("5", "index 5 of 4"), ("-5", "index -5 of 4")] {
        for form in ["", "/1", "//1", "/1/1"] {
            let text = format!("{SQUARE}f 1 2 {corner}{form}\n");
            let parts = [&format!("'{corner}{form}'"), found];
            refused(obj(&text), ErrorKind::Scene, "room.obj:5", &parts);
        }
    }
    for corner in ["9223372036854775807", "-9223372036854775808", "18446744073709551616", "1.5"] {
        let text = format!("{SQUARE}f 1 2 {corner}\n");
        refused(obj(&text), ErrorKind::Scene, "room.obj:5", &[corner]);
    }
    for corner in ["x", "/1", "1/x", "1/2/x", "1/2/3/4", "1\\2"] {
        let text = format!("{SQUARE}f 1 2 {corner}\n");
        refused(obj(&text), ErrorKind::Scene, "room.obj:5", &["v//vn"]);
    }
    refused(obj("f 1 2 3\n"), ErrorKind::Scene, "room.obj:1", &["no vertex so far"]);
    // Counted back from where the face stands.
    let scene = obj(&format!("{SQUARE}f -4 -3 -2 -1\nv 9 9 9\nf -5 -4 -3\n")).unwrap();
    assert_eq!(area(&scene), 1.5);
    assert_eq!(scene.corners(2), scene.corners(0));
}

#[test]
fn reads_every_form_of_corner() {
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
fn survives_random_bytes() {
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
    refused(load(&[("room.obj", &noise(100_000))]), ErrorKind::Scene, "room.obj", &["no face"]);
    refused(load(&[("room.obj", &[0; 100_000])]), ErrorKind::Scene, "room.obj", &["unknown kind"]);
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
fn names_outside_utf_8_match() {
    let text = [b"mtllib room.mtl\n", SQUARE.as_bytes(), b"g b\xe9ton\nusemtl b\xe9ton\nf 1 2 3\n"];
    let scene = load(&[("room.obj", &text.concat()), ("room.mtl", b"newmtl b\xe9ton\nKd 0.3\n")]);
    let scene = scene.unwrap();
    assert_eq!(
        (scene.groups(), &*scene.material(0).name),
        (&["b\u{e9}ton".into()][..], "b\u{e9}ton")
    );
    warned(&scene, "2 texts that are not UTF-8");
}

#[test]
fn reads_every_kind_of_white_space() {
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
        assert_eq!(oddities(&scene), [], "{form}: {:?}", scene.warnings());
        // The line number does not depend on the form either.
        let bad = change("v 0 0 0\n\nv 0 nan 0\n");
        refused(load(&[("room.obj", bad.as_bytes())]), ErrorKind::Scene, "room.obj:3", &[]);
    }
    assert_eq!(area(&obj(&format!("{SQUARE}f 1 \\\n 2 3\\\r\n4")).unwrap()), 1.0);
}

#[test]
fn repeated_group_is_one_group() {
    let text = "g a\nf 1 2 3\no b\nf 1 3 4\no unused\ng a\nf 1 2 4\ng\nf 2 3 4\n";
    let scene = obj(&format!("{SQUARE}{text}")).unwrap();
    assert_eq!(scene.groups(), ["a", "b", "default"]);
    let groups: Vec<u32> = scene.triangles().iter().map(|t| t.group).collect();
    assert_eq!(groups, [0, 1, 0, 2]);
}

#[test]
fn facets_are_groups_in_the_order_of_the_file() {
    let long = "x".repeat(80);
    let text = format!("{SQUARE}g a\nf 1 2 3\ng {long}\nf 1 2 3 4\ng a\nf 1 3 4\nf 2 3 4\n");
    let mut settings = SceneSettings::default();
    settings.facets = true;
    let scene = settings.read("square.obj", text.as_bytes(), &[]).unwrap();
    // A name that is too long to be there once a face is told by its number.
    assert_eq!(scene.groups(), ["a/1", "group 2/1", "a/2", "a/3"]);
    let groups: Vec<u32> = scene.triangles().iter().map(|t| t.group).collect();
    // A face of four corners is one facet.
    assert_eq!(groups, [0, 1, 1, 2, 3]);
}

#[test]
fn smoothing_group_lasts_until_next() {
    let text = "f 1 2 3\ns 4294967295 # all\nf 1 2 3 4\ng a\nf 1 2 3\no b\ns 2\nf 1 2 3\n";
    let off = "s off\nf 1 2 3\ns 7\ns 0\nf 1 2 3\ns 2\nf 1 2 3\n";
    let scene = obj(&format!("{SQUARE}{text}{off}")).unwrap();
    let groups: Vec<Option<u32>> = scene.triangles().iter().map(|t| t.smoothing).collect();
    let all = Some(u32::MAX);
    assert_eq!(groups, [None, all, all, all, Some(2), Some(0), Some(0), Some(2)]);
    assert_eq!(oddities(&scene).len(), 1, "only of the material: {:?}", scene.warnings());
    // Without a group they say nothing.
    let scene = obj(&format!("{SQUARE}s 1\ns\nf 1 2 3\ns 1\ns on # and\nf 1 2 3\n")).unwrap();
    assert!(scene.triangles().iter().all(|t| t.smoothing.is_none()));
    warned(&scene, "2 `s` lines without a group");
    warned(&scene, "room.obj:6");
}

#[test]
fn odd_smoothing_groups_are_read_as_far_as_they_go() {
    for (group, smoothing) in [
        ("-1", None),
        ("1.0", None),
        ("4294967296", None),
        ("x", None),
        ("nan", None),
        ("1 2", Some(1)),
        ("300 300 300 50", Some(300)),
        ("off 1", Some(0)),
        ("on 1", None),
    ] {
        let text = format!("{SQUARE}s 7\ns {group}\nf 1 2 3\n");
        let files: [(&str, &[u8]); 1] = [("room.obj", text.as_bytes())];
        let scene = repaired(&files, "1 smoothing group that is no", "room.obj:6", "`s off`");
        assert_eq!(scene.triangles()[0].smoothing, smoothing, "{group}");
    }
    let scene = obj(&format!("{SQUARE}s Off\nf 1 2 3\n")).unwrap();
    assert_eq!((scene.triangles()[0].smoothing, oddities(&scene).len()), (Some(0), 1));
}

#[test]
fn smoothing_groups_decide_creases() {
    // Folded by 27°, along the diagonal.
    let square = SQUARE.replace("1 1 0", "1 1 0.34");
    for (first, second, vertices) in
        [("", "", 4), ("s 1", "", 4), ("s 1", "s 2", 6), ("s off", "", 6), ("", "s 1", 6)]
    {
        let text = format!("{square}{first}\nf 1 2 4\n{second}\nf 2 3 4\n");
        let mesh = Mesh::new(obj(&text).unwrap(), f64::INFINITY).unwrap();
        let light = [Rgb::ONE; 2];
        let mut rays = RayGather::new(&mesh, 64).unwrap();
        let fine = gather_at_vertices(
            &GatheredMesh::from_elements(&mesh, &light).unwrap(),
            &mesh,
            &RefinementSettings::new(9.0),
            &mut rays,
            keep_going,
        );
        for surface in [VertexMesh::new(&mesh, &light), fine.unwrap().surface] {
            assert_eq!(surface.positions.len(), vertices, "{first}, {second}");
        }
    }
}

#[test]
fn warns_of_ignored_lines() {
    let text = format!("{SQUARE}s off\nvt 0 0\nvn 0 0 1\np 1\nl 1 2\nl 2 3\nf 1 2 3\n");
    warned(&obj(&text).unwrap(), "3 `p` and `l` lines");
    let scene = obj(&format!("{SQUARE}curv 0 1\nf 1 2 3\nwhat 0\nsurf 0\nlod 3\n")).unwrap();
    warned(&scene, "2 lines of free-form curves or surfaces, first at ");
    warned(&scene, "2 lines of unknown kind");
    warned(&scene, "room.obj:5");
    // Without a face, the error says what there is instead.
    let curves = obj(&format!("{SQUARE}p 1\nl 1 2\ncstype bezier\ncurv 0 1 1 2\nend\nf 1 2\n"));
    let parts = ["no face, 4 vertices", "1 face of fewer", "2 `p` and `l`", "3 lines of free-form"];
    refused(curves, ErrorKind::Scene, "room.obj", &parts);
}
