use std::f64::consts::PI;

use radiosity::gather::{GatherPoint, RadiosityField};
use radiosity::glam::DVec3;
use radiosity::io::{LampUnits, read_cameras};
use radiosity::scene::WarningKind;
use radiosity::{Backend, Gather as _, Mesh, Rgb, Scene};
use serde_json::{Value, json};

use super::{has_warning, read, read_with};
use crate::common::gltf::{Gltf, merged};

/// A square floor of 4 m whose middle is the origin, facing +y, and a lamp 2 m above that shines
/// down.
fn floor_under(light: Value) -> Gltf {
    let mut gltf = Gltf::new(json!([
        { "mesh": 0, "name": "floor", "scale": [4, 1, 4], "translation": [-2, 0, 2],
          "rotation": [-(0.5f64.sqrt()), 0, 0, 0.5f64.sqrt()] },
        { "name": "lamp", "translation": [0, 2, 0],
          "rotation": [-(0.5f64.sqrt()), 0, 0, 0.5f64.sqrt()],
          "extensions": { "KHR_lights_punctual": { "light": 0 } } },
    ]));
    // The scale turns with the square: before that its y is the floor's z.
    gltf.json["nodes"][0]["scale"] = json!([4, 4, 1]);
    gltf.add_square(0);
    gltf.json["materials"] = json!([{ "pbrMetallicRoughness":
        { "baseColorFactor": [0.5, 0.5, 0.5, 1], "metallicFactor": 0 } }]);
    gltf.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [light] } });
    gltf
}

/// Compares the light of the lamp all over the floor with a closed form. Between the cones of a
/// spot it is linear in 128 steps of the angle: off by 1/8 of their square times the second
/// derivative, 1e-4 of the intensity at most.
fn check(gltf: &Gltf, irradiance: impl Fn(DVec3) -> f64) {
    let mesh = Mesh::new(read(gltf).unwrap(), f64::INFINITY).unwrap();
    let corners = vec![[0; 3]; mesh.element_count()];
    let field = RadiosityField { mesh: &mesh, corners: &corners, reflected: &[Rgb::ZERO] };
    let at =
        |k: u32| DVec3::new(-1.9 + 0.2 * f64::from(k % 20), 0.0, -1.9 + 0.2 * f64::from(k / 20));
    let point = |k: u32| GatherPoint { position: at(k), normal: DVec3::Y, near: 1e-7 };
    let points: Vec<GatherPoint> = (0..400).map(point).collect();
    let samples = Backend::Cpu.gather(&mesh, 64).unwrap().gather(&field, &points).unwrap();
    let brightest = points.iter().map(|p| irradiance(p.position)).fold(0.0, f64::max);
    assert!(brightest > 0.0);
    for (point, sample) in points.iter().zip(samples) {
        let (found, wanted) = (sample.irradiance.y, irradiance(point.position));
        assert!((found - wanted).abs() < 1e-3 * brightest, "{point:?}: {found} {wanted}");
    }
}

#[test]
fn point_lights_follow_the_inverse_square() {
    let light = json!({ "type": "point", "intensity": 300.0, "color": [1, 0.5, 0], "range": 3 });
    let gltf = floor_under(light);
    check(&gltf, |p| 150.0 * 2.0 / (p.x * p.x + 4.0 + p.z * p.z).powf(1.5));
    assert!(has_warning(&read(&gltf).unwrap(), WarningKind::LampRange));
}

#[test]
fn spot_lights_have_two_cones() {
    let (inner, outer) = (0.3f64, 0.6f64);
    let spot = json!({ "innerConeAngle": inner, "outerConeAngle": outer });
    check(&floor_under(json!({ "type": "spot", "intensity": 300.0, "spot": spot })), |p| {
        let distance = (p.x * p.x + 4.0 + p.z * p.z).sqrt();
        let cosine = 2.0 / distance;
        let share = (cosine - outer.cos()) / (inner.cos() - outer.cos());
        300.0 * share.clamp(0.0, 1.0).powi(2) * cosine / distance.powi(2)
    });
    // The cones by default.
    check(&floor_under(json!({ "type": "spot", "intensity": 300.0 })), |p| {
        let distance = (p.x * p.x + 4.0 + p.z * p.z).sqrt();
        let cosine = 2.0 / distance;
        let share = (cosine - 0.5f64.sqrt()) / (1.0 - 0.5f64.sqrt());
        300.0 * share.clamp(0.0, 1.0).powi(2) * cosine / distance.powi(2)
    });
}

#[test]
fn directional_lights_are_the_sun_in_lux() {
    let mut gltf = floor_under(json!({ "type": "directional", "intensity": 70.0 }));
    check(&gltf, |_| 70.0);
    // Turned by 60° from straight down.
    let (sine, cosine) = (PI / 12.0).sin_cos();
    gltf.json["nodes"][1]["rotation"] = json!([-sine, 0, 0, cosine]);
    check(&gltf, |_| 70.0 * (PI / 3.0).cos());
}

/// The unit of lamps: 100 W and 40 W as Blender's exporter writes them by default, and by its other
/// modes.
#[test]
fn lamps_by_blender_are_watts() {
    let with = |intensities: [f64; 2], generator: &str| {
        let light = json!({ "type": "point", "intensity": intensities[0] });
        let mut gltf = floor_under(light);
        let lamp = gltf.json["nodes"][1].clone();
        let of_node = json!({ "KHR_lights_punctual": { "light": 1 } });
        let other = merged(lamp, json!({ "extensions": of_node }));
        gltf.json["nodes"].as_array_mut().unwrap().push(other);
        gltf.json["scenes"] = json!([{ "nodes": [0, 1, 2] }]);
        gltf.json["extensions"]["KHR_lights_punctual"]["lights"]
            .as_array_mut()
            .unwrap()
            .push(json!({ "type": "point", "intensity": intensities[1] }));
        gltf.json["asset"]["generator"] = json!(generator);
        gltf
    };
    let scale = |scene: Scene| scene.luminaires()[0].scale.x;
    let blender = "Khronos glTF Blender I/O v4.5.48";
    let watts = [100.0, 40.0];
    let standard = watts.map(|w| w * 683.0 / (4.0 * PI));
    let unitless = watts.map(|w| w / (4.0 * PI));
    for (intensities, generator, wanted) in [
        (standard, blender, 100.0 / (4.0 * PI)),
        (unitless, blender, unitless[0]),
        (watts, blender, watts[0]),
        (standard, "another", standard[0]),
    ] {
        let gltf = with(intensities, generator);
        let scene = read(&gltf).unwrap();
        assert!(has_warning(&scene, WarningKind::LampUnits));
        let found = scale(scene);
        assert!((found / wanted - 1.0).abs() < 1e-12, "{generator}: {found} {wanted}");
        for (units, wanted) in
            [(LampUnits::Candela, intensities[0]), (LampUnits::Watts, intensities[0] / 683.0)]
        {
            let found = scale(read_with(&gltf, |settings| settings.lamp_units = units).unwrap());
            assert!((found / wanted - 1.0).abs() < 1e-12, "{generator}: {found} {wanted}");
        }
    }
}

#[test]
fn lamps_leave_the_sky_dark_and_the_brightest_sun_shines() {
    let mut gltf = floor_under(json!({ "type": "directional", "intensity": 3.0 }));
    gltf.json["nodes"].as_array_mut().unwrap().push(json!({
        "rotation": [0, 0, 0, 1], "extensions": { "KHR_lights_punctual": { "light": 1 } }
    }));
    gltf.json["scenes"] = json!([{ "nodes": [0, 1, 2] }]);
    gltf.json["extensions"]["KHR_lights_punctual"]["lights"]
        .as_array_mut()
        .unwrap()
        .push(json!({ "type": "directional", "intensity": 10.0, "color": [0.0, 0.5, 1.0] }));
    let scene = read(&gltf).unwrap();
    let sun = scene.sky().sun().unwrap();
    assert_eq!((sun.irradiance, sun.direction), (Rgb::new(0.0, 5.0, 10.0), DVec3::Z));
    assert_eq!(scene.sky().uniform_radiance(), Some(Rgb::ZERO));
    assert!(has_warning(&scene, WarningKind::MoreSuns));
    assert!(!has_warning(&scene, WarningKind::NoLight));
    // Without lamps there is a sky, and advice.
    gltf.json["extensions"] = json!({});
    gltf.json["asset"]["generator"] = json!("Khronos glTF Blender I/O v4.5.48");
    let dark = read(&gltf).unwrap();
    assert_eq!(dark.sky().uniform_radiance(), Some(Rgb::ONE));
    let advice = dark.warnings().iter().find(|w| w.kind == WarningKind::NoLight).unwrap();
    assert!(advice.to_string().contains("Include > Data > Punctual Lights"), "{advice}");
}

#[test]
fn cameras_look_along_minus_z() {
    let mut gltf = Gltf::new(json!([
        { "camera": 0, "name": "flat" },
        { "camera": 1, "name": "door", "translation": [1, 2, 3],
          "rotation": [0, 0.5f64.sqrt(), 0, 0.5f64.sqrt()] },
    ]));
    gltf.json["cameras"] = json!([
        { "type": "orthographic", "orthographic": { "xmag": 1, "ymag": 1, "zfar": 9, "znear": 1 } },
        { "type": "perspective", "perspective": { "yfov": PI / 3.0, "znear": 0.1 } },
    ]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("it.glb");
    std::fs::write(&path, gltf.glb()).unwrap();
    let cameras = read_cameras(&path).unwrap();
    let [(name, camera)] = &cameras[..] else { panic!("{} cameras", cameras.len()) };
    assert_eq!((name.as_str(), camera.eye), ("door", DVec3::new(1.0, 2.0, 3.0)));
    assert!((camera.target - camera.eye).abs_diff_eq(DVec3::NEG_X, 1e-12));
    assert!((camera.vertical_fov - 60.0).abs() < 1e-12 && camera.up.abs_diff_eq(DVec3::Y, 1e-12));
    assert!(read_cameras("scenes/cornell_box.obj").unwrap().is_empty());
}
