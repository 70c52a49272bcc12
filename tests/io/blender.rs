//! What Blender's exporter writes into OBJ and MTL files.

use std::f64::consts::PI;

use radiosity::io::SpecularSurfaces;
use radiosity::scene::{Specular, WarningKind};
use radiosity::{Rgb, Scene, SceneSettings};

use super::obj_texts::{SQUARE, load, oddities, warned};
use crate::common::textured::{GREEN, RED, tga};

/// The first line of an MTL file by Blender.
const BY_BLENDER: &str = "# Blender 4.2.1 LTS MTL File: 'loft.blend'\n# www.blender.org\n\n";

/// A square of material `a` of this library, beside the image `a.tga` of a red and a green texel.
fn square(library: &str, settings: &SceneSettings) -> Scene {
    let text = format!(
        "mtllib a.mtl\n{SQUARE}vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl a\nf 1/1 2/2 3/3 4/4\n"
    );
    let image = tga(2, &[RED, GREEN]);
    let files: [(&str, &[u8]); 2] = [("a.mtl", library.as_bytes()), ("a.tga", &image)];
    settings.read("a.obj", text.as_bytes(), &files).unwrap()
}

/// A metal: colour, `metallic` and roughness, as Blender writes them beside a specular level.
fn metal(colour: [f64; 3], metallic: f64, roughness: f64) -> String {
    let shininess = 1000.0 * (1.0 - roughness) * (1.0 - roughness);
    let [r, g, b] = colour;
    format!(
        "newmtl a\nNs {shininess}\nKa {metallic} {metallic} {metallic}\nKd {r} {g} {b}\n\
         Ks 0.5 0.5 0.5\nKe 0 0 0\nNi 1.45\nd 1\nillum 3\n"
    )
}

/// Shares of metals of these roughnesses that are diffuse, by 4096 points of the integral, made by
/// another program: 64 differ by 0.004.
#[test]
fn metals_reflect_their_colour_in_all() {
    let (brass, copper, chrome) = ([0.9, 0.7, 0.3], [0.95, 0.55, 0.4], [1.0, 1.0, 1.0]);
    for (colour, metallic, roughness, diffuse_share) in [
        (brass, 1.0, 0.3, 0.1539),
        (copper, 1.0, 0.75, 0.9349),
        (chrome, 0.6, 0.0, 0.0),
        (brass, 0.02, 0.5, 0.5266),
    ] {
        let library = format!("{BY_BLENDER}{}", metal(colour, metallic, roughness));
        let scene = square(&library, &SceneSettings::default());
        let material = scene.material(0);
        let Some(Specular::Mirror { reflectance }) = material.specular else {
            panic!("{material:?}");
        };
        // In the file they have as many digits as 64-bit numbers.
        let all = Rgb::from(colour).min(Rgb::splat(0.98));
        let share = metallic * (1.0 - diffuse_share);
        assert!(reflectance.abs_diff_eq(share * Rgb::from(colour), 4e-3), "{reflectance}");
        let diffuse = (all - reflectance).max(Rgb::ZERO);
        assert!(material.reflectance.abs_diff_eq(diffuse, 1e-12), "{material:?}");
        assert!((material.reflectance + reflectance).max_element() <= 1.0);
        warned(&scene, "1 material of metal: `Kd` is all that it reflects");
        assert!(!oddities(&scene).contains(&WarningKind::MoreThanAll));
        // Without mirrors it is all diffuse.
        let mut settings = SceneSettings::default();
        settings.specular = SpecularSurfaces::Ignore;
        let scene = square(&library, &settings);
        assert_eq!((scene.material(0).specular, scene.material(0).reflectance), (None, all));
        assert!(!oddities(&scene).contains(&WarningKind::Metal));
    }
}

/// `Kd` beside the mirror that `Ks` is: limited, with a warning where that changes anything.
#[test]
fn mirrors_of_others_return_no_more_than_they_get() {
    for (colours, diffuse, is_limited) in [
        ("Kd 0.9 0.7 0.3\nKs 0.5 0.5 0.5", [0.5, 0.5, 0.3], true),
        ("Kd 0.5\nKs 0.5", [0.5; 3], false),
        ("Kd 0.2 0.2 0.9\nKs 0.6 0.6 0.2", [0.2, 0.2, 0.8], true),
    ] {
        for model in [3, 5] {
            let library = format!("newmtl a\n{colours}\nKa 1 1 1\nNs 490\nillum {model}\n");
            let scene = square(&library, &SceneSettings::default());
            assert!(scene.material(0).reflectance.abs_diff_eq(Rgb::from(diffuse), 1e-15));
            let is_said = oddities(&scene).contains(&WarningKind::MoreThanAll);
            assert_eq!(is_said, is_limited, "{colours}");
            assert!(!oddities(&scene).contains(&WarningKind::Metal));
        }
    }
}

/// A mirror has one colour: with an image a metal is diffuse.
#[test]
fn textured_metals_are_diffuse() {
    let text = metal([0.8; 3], 1.0, 0.2).replace("Kd 0.8 0.8 0.8\n", "") + "map_Kd a.tga\n";
    let scene = square(&format!("{BY_BLENDER}{text}"), &SceneSettings::default());
    assert_eq!(scene.material(0).specular, None);
    // Half of the image is red, the other green, each 0.98 at most.
    assert!(scene.material(0).reflectance.abs_diff_eq(Rgb::new(0.49, 0.49, 0.0), 1e-12));
}

/// Exitance of the square in a library with this text, `emit` as by `--emit`.
fn exitance(library: &str, emit: Option<[f64; 3]>) -> (Rgb, Scene) {
    let mut settings = SceneSettings::default();
    settings.emit = emit.map(|radiance| ("a".into(), Rgb::from(radiance))).into_iter().collect();
    let scene = square(library, &settings);
    (scene.exitance(0) + scene.exitance(1), scene)
}

#[test]
fn strengths_multiply_images_of_emitted_light() {
    let map = format!("{BY_BLENDER}newmtl a\nKd 0.1 0.1 0.1\nmap_Ke a.tga\n");
    let stated = format!("{BY_BLENDER}newmtl a\nKd 0.1\nKe 3 3 3\nmap_Ke a.tga\n");
    let other = "newmtl a\nKd 0.1\nmap_Ke a.tga\n".to_string();
    let lacks = "1 `map_Ke` without a `Ke`: its strength is 1";
    // The mean of a red and a green texel; of two triangles, which split it evenly, the sum.
    let of = |[r, g, _]: [f64; 3]| PI * Rgb::new(r, g, 0.0);
    for (library, emit, wanted, is_said) in [
        (&map, None, of([1.0; 3]), true),
        (&map, Some([3.0; 3]), of([3.0; 3]), false),
        (&map, Some([4.0, 0.5, 9.0]), of([4.0, 0.5, 9.0]), false),
        (&map, Some([0.0; 3]), Rgb::ZERO, false),
        (&stated, None, of([3.0; 3]), false),
        (&stated, Some([2.0; 3]), of([2.0; 3]), false),
        (&other, None, of([1.0; 3]), false),
        (&other, Some([5.0; 3]), of([5.0; 3]), false),
    ] {
        let (found, scene) = exitance(library, emit);
        // Cells along the diagonal count with their means.
        assert!(found.abs_diff_eq(wanted, 1e-2 * wanted.max_element()), "{found}, not {wanted}");
        let warnings: Vec<String> = scene.warnings().iter().map(ToString::to_string).collect();
        assert_eq!(warnings.iter().any(|w| w.starts_with(lacks)), is_said, "{warnings:?}");
    }
}

#[test]
fn files_by_blender_are_told_what_they_lack() {
    let with = |head: &str| {
        let text = format!("{head}\n{SQUARE}f 1 2 3 4\n");
        load(&[("a.obj", text.as_bytes())]).unwrap()
    };
    for head in [
        "# Blender 5.0.1",
        "# Blender 3.4.1\r",
        "# Blender v2.79 (sub 0) OBJ File: 'loft.blend'",
        "\u{feff}# Blender 4.2.1 LTS",
    ] {
        let scene = with(head);
        warned(&scene, "1 file by Blender's OBJ exporter: it leaves out lamps, the world");
    }
    for head in ["", "# for Blender 5", "# Blenderkit", "#", "# File exported by ZBrush"] {
        assert!(!oddities(&with(head)).contains(&WarningKind::Generator), "{head}");
    }
}
