//! Which materials emit: `Ke`, `Ka` above 1, and what the caller says; and what he says lets light
//! through.

use std::f64::consts::PI;

use radiosity::scene::WarningKind;
use radiosity::{Error, ErrorKind, Material, Rgb, Scene, SceneSettings};

use super::obj_texts::{SQUARE, refused, warned};
use crate::common::textured::tga;

/// A wall and a lamp, with this library.
fn room(library: &str, settings: &SceneSettings) -> Result<Scene, Error> {
    let text =
        format!("mtllib room.mtl\n{SQUARE}usemtl wall\nf 1 2 3\nusemtl Ceiling Lamp\nf 1 3 4\n");
    settings.read("room.obj", text.as_bytes(), &[("room.mtl", library.as_bytes())])
}

fn emitting(emit: &[(&str, f64)]) -> SceneSettings {
    let mut settings = SceneSettings::default();
    settings.emit = emit.iter().map(|&(name, l)| (name.into(), Rgb::splat(l))).collect();
    settings
}

fn kinds(scene: &Scene) -> Vec<WarningKind> {
    scene.warnings().iter().map(|w| w.kind).collect()
}

#[test]
fn ambient_above_one_is_light_where_nothing_else_is() {
    let wall = "newmtl wall\nKd 0.5\nKa 1 1 1\n";
    let lamp = "newmtl Ceiling Lamp\nKd 0.5\nKa 20 10 0\n";
    let scene = room(&format!("{wall}{lamp}Ke 0 0 0\n"), &SceneSettings::default()).unwrap();
    assert_eq!(scene.material(0).exitance, Rgb::ZERO);
    assert_eq!(scene.material(1).exitance, PI * Rgb::new(20.0, 10.0, 0.0));
    assert_eq!(kinds(&scene), [WarningKind::AmbientAsRadiance]);
    warned(&scene, "room.mtl:4");
    let mut strict = SceneSettings::default();
    strict.strict = true;
    let refusal = room(&format!("{wall}{lamp}"), &strict);
    refused(refusal, ErrorKind::Scene, "room.mtl:4", &["`Ka` above 1", "`Ke`"]);
    // Another light, in the file or of the caller's; a colour in other units; no more than white.
    let dim = emitting(&[("wall", 1.0)]);
    let other = SceneSettings::default();
    let units = lamp.replace("Kd 0.5", "Kd 255 255 255");
    for (library, settings) in [
        (format!("{wall}{lamp}newmtl third\nKe 1 1 1\n"), &other),
        (format!("{wall}{lamp}"), &dim),
        (format!("{wall}{units}"), &other),
        (format!("{wall}{}", lamp.replace("20 10 0", "1 1 1")), &other),
    ] {
        let scene = room(&library, settings).unwrap();
        assert_eq!(scene.material(1).exitance, Rgb::ZERO, "{library}");
        assert!(!kinds(&scene).contains(&WarningKind::AmbientAsRadiance), "{library}");
    }
}

#[test]
fn caller_says_what_emits() {
    let library = "newmtl wall\nKd 0.5\nnewmtl Ceiling Lamp\nKd 0.5\nKe 7 7 7\n";
    let scene = room(library, &emitting(&[("Ceiling Lamp", 3.0), ("wall", 1.0)])).unwrap();
    assert_eq!(scene.material(0).exitance, Rgb::splat(PI));
    assert_eq!(scene.material(1).exitance, Rgb::splat(3.0 * PI));
    // Materials that no library defines can emit too.
    let scene = room("", &emitting(&[("Ceiling Lamp", 3.0)])).unwrap();
    assert_eq!(scene.material(1).exitance, Rgb::splat(3.0 * PI));
    let parts = ["'ceiling lamp'", "'wall', 'Ceiling Lamp'"];
    let unknown = room(library, &emitting(&[("ceiling lamp", 3.0)]));
    refused(unknown, ErrorKind::Scene, "room.obj", &parts);
    for radiance in [-1.0, f64::NAN, f64::INFINITY, 1e308] {
        let wrong = room(library, &emitting(&[("wall", radiance)]));
        refused(wrong, ErrorKind::Setting, "emit 'wall'", &["at least 0"]);
    }
}

#[test]
fn ceiling_is_the_callers() {
    let mut settings = SceneSettings::default();
    settings.max_reflectance = 0.9;
    let scene = room("newmtl wall\nKd 1 0.95 0.5\n", &settings).unwrap();
    assert_eq!(scene.material(0).reflectance.to_array(), [0.9, 0.95, 0.5]);
    for ceiling in [1.0, -0.1, f64::NAN] {
        settings.max_reflectance = ceiling;
        refused(room("", &settings), ErrorKind::Setting, "max_reflectance", &["below 1"]);
    }
}

#[test]
fn without_light_names_candidates() {
    let dark =
        room("newmtl wall\nKd 0.5\nnewmtl Ceiling Lamp\nKd 0.5\n", &SceneSettings::default());
    let dark = dark.unwrap();
    let warning = dark.warnings().iter().find(|w| w.kind == WarningKind::NoLight).unwrap();
    assert_eq!(warning.names, ["Ceiling Lamp"]);
    warned(&dark, "--emit 'Ceiling Lamp=15,15,15'");
    for (name, is_light) in [
        ("area_light_03", true),
        ("NEON", true),
        ("Deckenleuchte", true),
        ("led strip", true),
        ("tiled", false),
        ("sunflower", false),
        ("sun", true),
        ("wall", false),
    ] {
        let text = format!("{SQUARE}usemtl {name}\nf 1 2 3\n");
        let scene = SceneSettings::default().read("room.obj", text.as_bytes(), &[]).unwrap();
        let warning = scene.warnings().iter().find(|w| w.kind == WarningKind::NoLight).unwrap();
        assert_eq!(warning.names.len(), usize::from(is_light), "{name}");
    }
}

fn transmitting(transmit: &[(&str, [f64; 3])]) -> SceneSettings {
    let mut settings = SceneSettings::default();
    settings.transmit = transmit.iter().map(|&(name, tau)| (name.into(), tau.into())).collect();
    settings
}

#[test]
fn caller_says_what_lets_light_through() {
    let library = "newmtl wall\nKd 0.5 0.6 0.2\nnewmtl Ceiling Lamp\nKd 0.5\nKe 7 7 7\n";
    let scene = room(library, &transmitting(&[("wall", [0.2, 0.6, 0.3])])).unwrap();
    // What it reflects, it lets through instead, as far as that goes.
    assert_eq!(scene.material(0).transmittance, Rgb::new(0.2, 0.6, 0.3));
    assert!(scene.material(0).reflectance.abs_diff_eq(Rgb::new(0.3, 0.0, 0.0), 1e-15));
    assert_eq!(scene.material(1).transmittance, Rgb::ZERO);
    // The last one counts.
    let twice = transmitting(&[("wall", [0.4; 3]), ("wall", [0.0, 0.1, 0.0])]);
    let scene = room(library, &twice).unwrap();
    assert_eq!(scene.material(0).transmittance, Rgb::new(0.0, 0.1, 0.0));
    assert!(scene.material(0).reflectance.abs_diff_eq(Rgb::new(0.5, 0.5, 0.4), 1e-15));
    // No more than may be reflected.
    let scene = room(library, &transmitting(&[("wall", [0.999; 3])])).unwrap();
    assert_eq!(scene.material(0).transmittance, Rgb::splat(0.98));
    let refusal = room(library, &transmitting(&[("walls", [0.1; 3])]));
    refused(refusal, ErrorKind::Scene, "room.obj", &["'walls'", "light through", "'Ceiling Lamp'"]);
    for bad in [-0.1, 1.0, f64::NAN] {
        let refusal = room(library, &transmitting(&[("wall", [0.0, bad, 0.0])]));
        refused(refusal, ErrorKind::Setting, "transmit 'wall'", &["at least 0 and below 1"]);
    }
}

#[test]
fn what_a_texture_reflects_is_let_through_in_its_colours() {
    // A quarter of the area is black, the rest (1, 0.5, 0) by `Kd`.
    let image = tga(2, &[[0; 3], [255; 3], [255; 3], [255; 3]]);
    let text = format!("mtllib a.mtl\n{SQUARE}vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl leaf\n")
        + "f 1/1 2/2 3/3 4/4\n";
    let library: &[u8] = b"newmtl leaf\nKd 0.8 0.4 0.1\nmap_Kd a.tga\n";
    let read = |tau: [f64; 3]| {
        let files: [(&str, &[u8]); 2] = [("a.mtl", library), ("a.tga", &image)];
        transmitting(&[("leaf", tau)]).read("leaf.obj", text.as_bytes(), &files).unwrap()
    };
    let scene = read([0.3, 0.15, 0.0]);
    let Material { reflectance, transmittance, .. } = scene.material(0);
    let (white, black) = ([0.5, 0.25], [0.25, 0.5]);
    // Both together are what the texture reflects without it, everywhere.
    assert!((*reflectance + *transmittance).abs_diff_eq(Rgb::new(0.6, 0.3, 0.075), 1e-9));
    assert!(transmittance.abs_diff_eq(Rgb::new(0.3, 0.15, 0.0), 1e-9), "{transmittance}");
    assert!(scene.reflectance_at(0, white).abs_diff_eq(Rgb::new(0.4, 0.2, 0.1), 1e-9));
    assert_eq!(scene.reflectance_at(1, black), Rgb::ZERO);
    // On a piece of the texture that is brighter, both are: without the black quarter but for a
    // corner of it, as the one triangle has it.
    let text = text.replace("f 1/1 2/2 3/3 4/4", "f 1/1 2/2 3/3");
    let files: [(&str, &[u8]); 2] = [("a.mtl", library), ("a.tga", &image)];
    let half =
        transmitting(&[("leaf", [0.3, 0.15, 0.0])]).read("leaf.obj", text.as_bytes(), &files);
    let Material { reflectance: rho, transmittance: tau, .. } = half.unwrap().material(0).clone();
    assert!(rho.x > 0.3 && (tau - rho).abs().truncate().max_element() < 1e-9, "{rho} {tau}");
    // More than it reflects takes the place of `Kd`, and of that nearly all may go through.
    let scene = read([0.9; 3]);
    let Material { reflectance, transmittance, .. } = scene.material(0);
    let all = Rgb::splat(0.75 * 0.9);
    assert!(transmittance.abs_diff_eq(0.99 * all, 1e-9), "{transmittance}");
    assert!(reflectance.abs_diff_eq(0.01 * all, 1e-9), "{reflectance}");
}
