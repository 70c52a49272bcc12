//! Files for viewers: axes, unit and exposure.

use std::path::Path;

use serde_json::Value;

use crate::{cornell, lit_plates, run, texts};

/// The JSON of a GLB file.
fn json_of(path: &Path) -> Value {
    let bytes = std::fs::read(path).unwrap();
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    serde_json::from_slice(&bytes[20..20 + length]).unwrap()
}

/// The node at the top of a GLB file.
fn top(json: &Value) -> &Value {
    let top = json["scenes"][0]["nodes"][0].as_u64().unwrap() as usize;
    &json["nodes"][top]
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().map_or(vec![], |all| all.iter().map(|x| x.as_f64().unwrap()).collect())
}

/// Runs `command` on a scene; it gives GLB files, and the camera of a report if there is one.
fn written(scene: &str, command: &str, more: &[&str]) -> Value {
    let folder = tempfile::tempdir().unwrap();
    let stem = folder.path().join("a");
    let mut args = vec![scene, "--cpu", "--error", "0.5", "--out", stem.to_str().unwrap()];
    args.extend(more);
    let out = run(command, &args);
    assert!(out.status.success(), "{}", texts(&out)[1]);
    let mut json = json_of(&stem.with_added_extension("glb"));
    if let Ok(report) = std::fs::read(stem.with_added_extension("json")) {
        json["report"] = serde_json::from_slice(&report).unwrap();
    }
    json
}

#[test]
fn glb_is_upright_and_in_metres() {
    let folder = tempfile::tempdir().unwrap();
    let scene = lit_plates(folder.path()).display().to_string();
    let half = std::f64::consts::FRAC_1_SQRT_2;
    for (command, formats) in
        [("bake", ["--write", "glb,json,png"]), ("light-map", ["--write", "glb"])]
    {
        let with = |more: &[&str]| written(&scene, command, &[&formats[..], more].concat());
        // The plates are level in z, which becomes +Y by a quarter turn about x.
        let found = with(&[]);
        let turned = numbers(&top(&found)["rotation"]);
        assert!((turned[0] + half).abs() < 1e-6 && (turned[3] - half).abs() < 1e-6, "{turned:?}");
        assert!(top(&found)["scale"].is_null());
        for (unit, metres) in [("mm", 1e-3), ("cm", 0.01), ("in", 0.0254), ("ft", 0.3048)] {
            let scale = numbers(&top(&with(&["--unit", unit]))["scale"]);
            assert!(scale.len() == 3 && scale.iter().all(|x| (x - metres).abs() < 1e-7 * metres));
        }
        assert!(top(&with(&["--up", "0,1,0", "--unit", "m"]))["rotation"].is_null());
        // A quarter turn about z takes x to y.
        let turned = numbers(&top(&with(&["--up", "2,0,0"]))["rotation"]);
        assert!((turned[2] - half).abs() < 1e-6 && (turned[3] - half).abs() < 1e-6, "{turned:?}");
    }
    let out = run("bake", &[&scene, "--unit", "yd"]);
    assert!(out.status.code() == Some(2) && texts(&out)[1].contains("mm, cm, m, in, ft"));
}

#[test]
fn pictures_follow_up() {
    let folder = tempfile::tempdir().unwrap();
    let scene = lit_plates(folder.path()).display().to_string();
    for (up, wanted) in
        [("0,0,1", [0.0, 0.0, 1.0]), ("0,-2,0", [0.0, -1.0, 0.0]), ("1,0,0", [1.0, 0.0, 0.0])]
    {
        let found = written(&scene, "bake", &["--write", "glb,json,png", "--up", up]);
        assert_eq!(numbers(&found["report"]["camera"]["up"]), wanted, "{up}");
    }
    let found = written(&scene, "bake", &["--write", "glb,json,png"]);
    assert_eq!(numbers(&found["report"]["camera"]["up"]), [0.0, 0.0, 1.0]);
}

fn exposure(json: &Value) -> f64 {
    json["asset"]["extras"]["exposure"].as_f64().unwrap()
}

/// The GLB of a light map is shown as brightly as that of a bake, and by the same option.
#[test]
fn light_maps_are_exposed_as_bakes() {
    let bake = ["--write", "glb,json,png"];
    let map = ["--write", "glb", "--size", "64"];
    let [of_bake, of_map] = [("bake", &bake[..]), ("light-map", &map)]
        .map(|(command, more)| exposure(&written(cornell(), command, more)));
    assert_eq!(of_bake, of_map);
    let [of_bake, of_map] = [("bake", &bake[..]), ("light-map", &map)].map(|(command, more)| {
        exposure(&written(cornell(), command, &[more, &["--exposure", "2"]].concat()))
    });
    // A factor of radiance, which is radiosity over pi.
    assert_eq!((of_bake, of_map), (2.0 / std::f64::consts::PI, 2.0 / std::f64::consts::PI));
    let out = run("light-map", &[cornell(), "--exposure", "-1"]);
    assert!(!out.status.success() && texts(&out)[1].contains("above 0"), "{}", texts(&out)[1]);
}

#[test]
fn lamps_emit_on_the_sides_that_are_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let sheets = "mtllib lit.mtl\nusemtl grey\no floor\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n\
                  f 1 2 3 4\no ceiling\nv 0 0 2\nv 0 1 2\nv 1 1 2\nv 1 0 2\nf 5 6 7 8\n\
                  usemtl lamp\no lamp\nv 0 0 1\nv 0 1 1\nv 1 1 1\nv 1 0 1\nf 9 10 11 12\n";
    lit_plates(folder.path());
    let scene = crate::write(folder.path(), "sheets.obj", sheets).display().to_string();
    let said = |more: &[&str]| {
        let mut args = vec![&*scene, "--cpu", "--error", "0.5", "--write", "ply", "--up", "0,0,1"];
        args.extend(more);
        let out = run("bake", &args);
        assert!(out.status.success(), "{}", texts(&out)[1]);
        let ply = radiosity::read_ply(folder.path().join("sheets.ply")).unwrap();
        let lit = |z: f64| {
            let all = ply.positions.iter().zip(&ply.radiosity).filter(|(p, _)| p.z == z);
            all.map(|(_, b)| b.x).fold(0.0, f64::max)
        };
        (texts(&out)[1].clone(), [lit(0.0), lit(2.0)])
    };
    let (warned, [_, ceiling]) = said(&[]);
    assert!(
        warned.contains("2 triangles of lamps that face surfaces on their dark sides"),
        "{warned}"
    );
    let (warned, [floor, of_both]) = said(&["--emit-sides", "both"]);
    assert!(!warned.contains("dark sides"), "{warned}");
    assert!(ceiling < 0.1 * of_both && (floor / of_both - 1.0).abs() < 0.2, "{floor} {of_both}");
    let (_, [_, of_front]) = said(&["--emit-sides", "front"]);
    assert_eq!(of_front, ceiling);
}
