//! MTL files, good and bad: what is taken and what is repaired.

use std::f64::consts::PI;

use radiosity::io::SpecularSurfaces;
use radiosity::scene::{Specular, WarningKind};
use radiosity::{ErrorKind, Rgb, SceneSettings};

use super::obj_texts::{
    CHALK, SQUARE, load, load_strictly, obj, oddities, refused, repaired, warned, with_library,
};

/// A scene of one square of material `chalk`, with this library.
fn chalk_files<'a>(text: &'a str, library: &'a str) -> [(&'a str, &'a [u8]); 2] {
    [("room.obj", text.as_bytes()), ("room.mtl", library.as_bytes())]
}

fn room() -> String {
    format!("mtllib room.mtl\n{SQUARE}usemtl chalk\nf 1 2 3 4\n")
}

#[test]
fn unknown_materials_are_grey() {
    let text = format!("mtllib room.mtl\n{SQUARE}usemtl chlk\nf 1 2 3 4\nusemtl x\nf 1 2 3\n");
    let files = chalk_files(&text, CHALK);
    let scene = repaired(&files, "2 unknown materials", "room.obj:6", "'chlk'");
    assert_eq!(scene.material(0).reflectance.to_array(), [0.5; 3]);
    assert_eq!((&*scene.material(0).name, &*scene.material(2).name), ("chlk", "x"));
    let unknown = scene.warnings().iter().find(|w| w.kind == WarningKind::UnknownMaterial).unwrap();
    assert_eq!((unknown.count, &*unknown.names), (2, &["chlk".to_string(), "x".into()][..]));
    assert!(unknown.place.as_ref().unwrap().ends_with("room.obj:6"));
    // Without a name, as without the line.
    let text = format!("{SQUARE}usemtl\nf 1 2 3\n");
    let files: [(&str, &[u8]); 1] = [("room.obj", text.as_bytes())];
    repaired(&files, "1 unknown material", "room.obj:5", "newmtl");
    // Quotes are no part of a name, unless the library has them too.
    for (used, defined) in [("\"warm white\"", "warm white"), ("\"a\"", "\"a\"")] {
        let text = format!("mtllib room.mtl\n{SQUARE}usemtl {used}\nf 1 2 3\n");
        let library = format!("newmtl {defined}\nKd 0.25 0.25 0.25\n");
        let scene = load(&chalk_files(&text, &library)).unwrap();
        assert_eq!(scene.material(0).reflectance.to_array(), [0.25; 3], "{used}");
        assert!(scene.warnings().iter().all(|w| w.kind != WarningKind::UnknownMaterial));
    }
    // A library may come after those who use it.
    let text = format!("{SQUARE}usemtl chalk\nf 1 2 3\nmtllib room.mtl\n");
    assert_eq!(oddities(&load(&chalk_files(&text, CHALK)).unwrap()), []);
}

#[test]
fn reads_reflectance_and_radiance_per_channel() {
    let scene = with_library("newmtl chalk\nKd 0 0.5 0.999\nKe 1 2 3 # W/(m2 sr)\n").unwrap();
    let chalk = scene.material(0);
    assert_eq!(chalk.reflectance.to_array(), [0.0, 0.5, 0.999]);
    assert_eq!(chalk.exitance.to_array(), [PI, 2.0 * PI, 3.0 * PI]);
    assert!(scene.warnings().is_empty(), "{:?}", scene.warnings());
    let scene = with_library("newmtl chalk\n\tkd 0.25\n  KE 2\n").unwrap();
    assert_eq!(scene.material(0).reflectance.to_array(), [0.25; 3]);
    assert_eq!(scene.material(0).exitance.to_array(), [2.0 * PI; 3]);
}

#[test]
fn impossible_colours_are_taken_down() {
    let text = room();
    for (colour, reflectance) in [
        ("1 0.99 0", [0.98, 0.99, 0.0]),
        ("0 1.5 255", [0.0, 0.98, 0.98]),
        ("0 1e300 0.2", [0.0, 0.98, 0.2]),
    ] {
        let library = format!("newmtl chalk\n\nKd {colour}\n");
        let files = chalk_files(&text, &library);
        let scene = repaired(&files, "reflect 0.98 ('chalk')", "room.mtl:1", "below 1");
        assert_eq!(scene.material(0).reflectance.to_array(), reflectance);
    }
    for (colours, reflectance, exitance) in [
        ("Kd 0.1 0.2 -0.1", [0.1, 0.2, 0.0], [0.0; 3]),
        ("Kd 0.1\nKe 1 -1 0", [0.1; 3], [PI, 0.0, 0.0]),
    ] {
        let library = format!("newmtl chalk\n{colours}\n");
        let files = chalk_files(&text, &library);
        let scene = repaired(&files, "channels are 0 ('chalk')", "room.mtl:1", "at least 0");
        assert_eq!(scene.material(0).reflectance.to_array(), reflectance);
        assert_eq!(scene.material(0).exitance.to_array(), exitance);
    }
    // Radiance whose exitance has no number.
    let library = "newmtl chalk\nKe 1e308 0 0\n";
    repaired(&chalk_files(&text, library), "emits nothing", "room.mtl:1", "'chalk'");
    // Nobody uses it, so nobody needs to know.
    let library = format!("{CHALK}newmtl snow\nKd 1\n");
    assert_eq!(oddities(&load_strictly(&chalk_files(&text, &library)).unwrap()), []);
}

#[test]
fn unusable_statements_are_passed_over() {
    let text = room();
    let bad = ["Kd nan 0 0", "Kd 0 inf 0", "Kd 0.5 0.5", "Kd", "Kd red", "Kd 0.1 0.1 0.1 0.1"];
    let bad = bad.into_iter().chain(["Kd spectral a.rfl 1", "Kd xyz 0.1 0.1 0.1", "Ke 0 1e999 0"]);
    for line in bad.chain([
        "Ka x", "Ks 0 0", "Tf", "Ni inf", "illum", "illum -1", "illum x", "d nan", "d", "Tr 1e400",
        "map_Kd", "newmtl",
    ]) {
        let library = format!("newmtl chalk\nKd 0.3\n{line}\n");
        let files = chalk_files(&text, &library);
        let part = "1 unusable statement of a material, at ";
        let scene = repaired(&files, part, "room.mtl:3", &format!("{line:?}"));
        assert_eq!(scene.material(0).reflectance.to_array(), [0.3; 3], "{line}");
    }
    let before = format!("Kd 0.7\nKe 1 1 1\n{CHALK}");
    let files = chalk_files(&text, &before);
    let scene = repaired(&files, "2 unusable statements", "room.mtl:1", "newmtl");
    assert_eq!(scene.material(0).reflectance.to_array(), [0.8, 0.7, 0.6]);
}

#[test]
fn warns_of_unmodelled_material_properties() {
    let scene = with_library("newmtl chalk\nKs 1 1 1\n").unwrap();
    assert_eq!(scene.material(0).reflectance.to_array(), [0.5; 3]);
    warned(&scene, "neither colour nor emission");
    let lamp = with_library("newmtl chalk\nKe 1 1 1\n").unwrap();
    assert_eq!(lamp.material(0).reflectance.to_array(), [0.0; 3]);
    assert!(lamp.warnings().is_empty());
    for clear in ["d 0.5", "d -halo 0.5", "Tr 0.5"] {
        warned(&with_library(&format!("{CHALK}{clear}\n")).unwrap(), "transparency");
    }
    for opaque in ["d 1", "Tr 0", "Tr 1"] {
        let scene = with_library(&format!("{CHALK}{opaque}\n")).unwrap();
        assert_eq!(oddities(&scene), [], "{:?}", scene.warnings());
    }
    let scene = with_library(&format!("{CHALK}newmtl chalk\nKd 0.1\n")).unwrap();
    assert_eq!(scene.material(0).reflectance.to_array(), [0.1; 3]);
    warned(&scene, "several definitions");
    // Nobody uses it, so nobody needs to know.
    let scene = with_library(&format!("{CHALK}newmtl glass\nd 0\n")).unwrap();
    assert_eq!(oddities(&scene), [], "{:?}", scene.warnings());
}

#[test]
fn mirrors_and_glass_are_read_and_said() {
    let shown = "1 material of mirror or glass: pictures show it";
    for (text, specular, reflectance) in [
        (
            "Kd 0.1 0.4 0.9\nKs 0.5 0.7 1.5\nNs 10\nillum 3",
            Specular::Mirror { reflectance: Rgb::new(0.5, 0.7, 1.0) },
            // The rest of one is room for the diffuse part.
            [0.1, 1.0 - 0.7, 0.0],
        ),
        ("ILLUM 5\nks 0.25", Specular::Polished { reflectance: Rgb::splat(0.25) }, [0.0; 3]),
        (
            "Kd 0.3\nillum 7\nNi 1.4\nTf 0.5 0.9 1",
            Specular::Glass { refractive_index: 1.4, transmittance: Rgb::new(0.5, 0.9, 1.0) },
            [0.0; 3],
        ),
        (
            "Kd 0.3\nillum 4\nd -halo 0.75",
            Specular::Glass { refractive_index: 1.5, transmittance: Rgb::splat(0.25) },
            [0.0; 3],
        ),
        (
            "Kd 0.3\nillum 9\nTr 0.25",
            Specular::Glass { refractive_index: 1.5, transmittance: Rgb::splat(0.25) },
            [0.0; 3],
        ),
    ] {
        let scene = with_library(&format!("newmtl chalk\n{text}\n")).unwrap();
        assert_eq!(scene.material(0).specular, Some(specular), "{text}");
        assert_eq!(scene.material(0).reflectance.to_array(), reflectance, "{text}");
        // Of what is limited it is said, of others nothing else, and nobody refuses it.
        let is_limited = text.contains("illum 3");
        assert_eq!(oddities(&scene).len(), 1 + usize::from(is_limited), "{:?}", scene.warnings());
        warned(&scene, shown);
        if is_limited {
            warned(&scene, "1 mirror whose `Kd` and `Ks` are more than 1 together, at ");
        }
        let text = format!("newmtl chalk\n{text}\n");
        assert!(load_strictly(&chalk_files(&room(), &text)).is_ok());
    }
    // Written by default: as if it were not there.
    let plain = format!("{CHALK}illum 4\nTf 1.00 1.00 1.00\nNi 1.00\nKs 0.5 0.5 0.5\n");
    let scene = with_library(&plain).unwrap();
    assert_eq!((scene.material(0).specular, oddities(&scene)), (None, vec![]));
    assert_eq!(scene.material(0).reflectance.to_array(), [0.8, 0.7, 0.6]);
}

#[test]
fn mirrors_and_glass_may_be_diffuse_black_or_ignored() {
    let (text, library) = (room(), "newmtl chalk\nKd 0.3\nKe 1\nillum 9\nd 0.5\n");
    let files = chalk_files(&text, library);
    let with = |specular| {
        let mut settings = SceneSettings::default();
        settings.specular = specular;
        settings.read("room.obj", files[0].1, &files[1..]).unwrap()
    };
    let clear = with(SpecularSurfaces::Clear);
    assert_eq!(
        (clear.material(0).reflectance, clear.material(0).specular.is_some()),
        (Rgb::ZERO, true)
    );
    warned(&clear, "light passes glass");
    let diffuse = with(SpecularSurfaces::Diffuse);
    assert_eq!(diffuse.material(0).reflectance, Rgb::splat(0.3));
    assert!(diffuse.material(0).specular.is_some());
    warned(&diffuse, "only its diffuse part counts");
    let black = with(SpecularSurfaces::Black);
    assert!(black.material(0).specular.is_some());
    assert_eq!(black.material(0).reflectance, Rgb::ZERO);
    assert_eq!(black.material(0).exitance, Rgb::splat(PI));
    warned(&black, "it is black");
    let ignored = with(SpecularSurfaces::Ignore);
    assert_eq!(ignored.material(0).specular, None);
    assert_eq!(ignored.material(0).reflectance, Rgb::splat(0.3));
    warned(&ignored, "ignored: it is diffuse");
    warned(&ignored, "transparency");
}

#[test]
fn faces_without_material_reflect_default() {
    let scene = obj(&format!("{SQUARE}f 1 2 3 4\n")).unwrap();
    assert_eq!(scene.material(1).reflectance.to_array(), [0.5; 3]);
    assert_eq!(scene.material(1).exitance.to_array(), [0.0; 3]);
    assert_eq!(scene.groups(), ["default"]);
    warned(&scene, "1 face without a material: all of them reflect 0.5");
    let text = format!("{SQUARE}mtllib room.mtl\nf 1 2 3\nf 1 3 4\nusemtl chalk\nf 3 2 1\n");
    let scene = load(&chalk_files(&text, CHALK)).unwrap();
    let red: Vec<f64> = (0..3).map(|t| scene.material(t).reflectance.x).collect();
    assert_eq!(red, [0.5, 0.5, 0.8]);
    warned(&scene, "2 faces without a material: before the first `usemtl`");
}

#[test]
fn same_material_again_goes_on_as_before() {
    // tobj ends a model at each change, also where no face came between.
    let text = format!(
        "mtllib room.mtl\n{SQUARE}usemtl chalk\nf 1 2 3\nusemtl slate\nusemtl chalk\nf 1 3 4\n\
         usemtl slate\nf 1 2 4\nusemtl chalk\n"
    );
    let library = format!("{CHALK}newmtl slate\nKd 0.1\n");
    let scene = load(&chalk_files(&text, &library)).unwrap();
    let names: Vec<&str> = (0..3).map(|t| scene.material(t).name.as_str()).collect();
    assert_eq!(names, ["chalk", "chalk", "slate"]);
    assert_eq!(scene.positions().len(), 4);
}

#[test]
fn errors_of_meaning_stay_errors() {
    let text = format!("mtllib room.mtl\n{SQUARE}usemtl chalk\nf 1 2 5\n");
    refused(load(&chalk_files(&text, CHALK)), ErrorKind::Scene, "room.obj:7", &["5 of 4"]);
}
