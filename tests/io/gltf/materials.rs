use std::f64::consts::PI;
use std::ops::ControlFlow;

use radiosity::io::SpecularSurfaces;
use radiosity::scene::{Specular, WarningKind};
use radiosity::{Backend, BakeTarget, Material, Rgb, Scene};
use serde_json::{Value, json};

use super::{has_warning, read, read_with};
use crate::common::gltf::{Gltf, SQUARE};

/// The material of this JSON, as it is read.
fn material(json: Value) -> Material {
    read(&Gltf::of_material(json)).unwrap().materials()[0].clone()
}

fn base(factor: [f64; 4], metallic: f64, roughness: f64) -> Value {
    json!({ "pbrMetallicRoughness": {
        "baseColorFactor": factor, "metallicFactor": metallic, "roughnessFactor": roughness } })
}

#[test]
fn base_colours_are_reflectances() {
    let plain = material(base([0.8, 0.4, 0.2, 1.0], 0.0, 0.3));
    assert_eq!((plain.reflectance, plain.specular), (Rgb::new(0.8, 0.4, 0.2), None));
    // A reflectance of 1 is replaced, and one below 0 too.
    let scene = read(&Gltf::of_material(base([1.0, 0.5, -1.0, 1.0], 0.0, 1.0))).unwrap();
    assert_eq!(scene.materials()[0].reflectance, Rgb::new(0.98, 0.5, 0.0));
    assert!(has_warning(&scene, WarningKind::HighReflectance));
    assert!(has_warning(&scene, WarningKind::NegativeColour));
    let glossy = json!({ "diffuseFactor": [0.3, 0.2, 0.1, 1], "specularFactor": [1, 1, 1] });
    let glossy = json!({ "extensions": { "KHR_materials_pbrSpecularGlossiness": glossy } });
    assert_eq!(material(glossy).reflectance, Rgb::new(0.3, 0.2, 0.1));
    let unlit = material(json!({ "extensions": { "KHR_materials_unlit": {} } }));
    assert_eq!((unlit.reflectance, unlit.exitance), (Rgb::ZERO, Rgb::ZERO));
}

/// What is left of a metal: shares of a GGX lobe by 4096 points of its integral, made by another
/// program, of which 64 differ by 0.004.
#[test]
fn rough_metals_reflect_a_share() {
    for (metallic, roughness, share) in
        [(1.0, 0.0, 0.0), (1.0, 0.5, 0.5266), (0.5, 0.5, 0.7633), (1.0, 1.0, 1.0)]
    {
        let metal = material(base([0.8, 0.4, 0.2, 1.0], metallic, roughness));
        let reflected = metal.reflectance / Rgb::new(0.8, 0.4, 0.2);
        assert!(reflected.abs_diff_eq(Rgb::splat(share), 4e-3), "{roughness}: {reflected}");
        let mirror = match metal.specular {
            Some(Specular::Mirror { reflectance }) => reflectance,
            None => Rgb::ZERO,
            other => panic!("{other:?}"),
        };
        assert!((mirror + metal.reflectance).abs_diff_eq(Rgb::new(0.8, 0.4, 0.2), 1e-12));
    }
    let gltf = Gltf::of_material(base([0.8, 0.4, 0.2, 1.0], 1.0, 0.1));
    let ignored = read_with(&gltf, |s| s.specular = SpecularSurfaces::Ignore).unwrap();
    assert_eq!(ignored.materials()[0].reflectance, Rgb::new(0.8, 0.4, 0.2));
}

/// Of materials without a metallic factor: none is a metal, unless other materials have one.
#[test]
fn omitted_metallic_factors() {
    let pbr = json!({ "baseColorFactor": [0.5, 0.5, 0.5, 1], "roughnessFactor": 0 });
    let omitted = json!({ "pbrMetallicRoughness": pbr });
    let alone = read(&Gltf::of_material(omitted.clone())).unwrap();
    assert_eq!(alone.materials()[0].reflectance, Rgb::splat(0.5));
    assert!(has_warning(&alone, WarningKind::MetalByDefault));
    let mut beside = Gltf::of_material(omitted);
    beside.json["materials"].as_array_mut().unwrap().push(base([0.5, 0.5, 0.5, 1.0], 0.0, 1.0));
    let beside = read(&beside).unwrap();
    assert_eq!(beside.materials()[0].reflectance, Rgb::ZERO);
    assert!(has_warning(&beside, WarningKind::Metal));
    // Without any property, or without a material at all.
    for bare in [json!({}), json!({ "pbrMetallicRoughness": {} }), json!({ "extras": 1 })] {
        let scene = read(&Gltf::of_material(bare)).unwrap();
        assert_eq!(scene.materials()[0].reflectance, Rgb::splat(0.5));
        assert!(has_warning(&scene, WarningKind::MaterialWithoutColour));
    }
}

#[test]
fn emission_has_a_strength() {
    let lamp = |extensions: Value| {
        json!({ "emissiveFactor": [1, 0.5, 0], "extensions": extensions, "name": "lamp",
            "pbrMetallicRoughness": { "baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0 } })
    };
    let strong = lamp(json!({ "KHR_materials_emissive_strength": { "emissiveStrength": 40 } }));
    assert_eq!(material(strong.clone()).exitance, PI * Rgb::new(40.0, 20.0, 0.0));
    assert_eq!(material(lamp(json!({}))).exitance, PI * Rgb::new(1.0, 0.5, 0.0));
    let given = read_with(&Gltf::of_material(strong), |settings| {
        settings.emit.push(("lamp".into(), Rgb::splat(2.0)));
    });
    assert_eq!(given.unwrap().materials()[0].exitance, Rgb::splat(2.0 * PI));
    let unknown = read_with(&Gltf::of_material(lamp(json!({}))), |settings| {
        settings.emit.push(("Lamp".into(), Rgb::ONE));
    });
    let e = unknown.unwrap_err().to_string();
    assert!(e.contains("no material 'Lamp' that could emit; did you mean 'lamp'?"), "{e}");
}

#[test]
fn glass_and_panes_let_light_pass() {
    let of = |json: Value| read(&Gltf::of_material(json)).unwrap();
    let blend = |alpha: f64| {
        let mut json = base([0.8, 0.8, 0.8, alpha], 0.0, 1.0);
        json["alphaMode"] = json!("BLEND");
        json
    };
    let pane = of(blend(0.25)).materials()[0].clone();
    let (refractive_index, transmittance) = (1.0, Rgb::splat(0.75));
    assert_eq!(pane.specular, Some(Specular::Glass { refractive_index, transmittance }));
    assert_eq!(pane.reflectance, Rgb::ZERO);
    let opaque = of(blend(0.75));
    assert_eq!(opaque.materials()[0].reflectance, Rgb::splat(0.8));
    assert!(has_warning(&opaque, WarningKind::Transparency));

    let mut glass = base([0.9, 0.8, 0.7, 1.0], 0.0, 0.0);
    glass["extensions"] = json!({
        "KHR_materials_transmission": { "transmissionFactor": 1.0 },
        "KHR_materials_ior": { "ior": 1.4 },
        "KHR_materials_volume": { "thicknessFactor": 2.0, "attenuationDistance": 1.0,
            "attenuationColor": [0.5, 1, 1] },
    });
    let Some(Specular::Glass { refractive_index, transmittance }) =
        material(glass.clone()).specular
    else {
        panic!("no glass");
    };
    assert_eq!(refractive_index, 1.4);
    assert!(transmittance.abs_diff_eq(Rgb::new(0.225, 0.8, 0.7), 1e-12), "{transmittance}");
    // What emits is opaque.
    glass["emissiveFactor"] = json!([1, 1, 1]);
    let lamp = of(glass);
    assert!(
        lamp.materials()[0].specular.is_none() && has_warning(&lamp, WarningKind::Transparency)
    );

    let mut leaf = base([0.5, 0.5, 0.5, 1.0], 0.0, 1.0);
    leaf["extensions"] = json!({ "KHR_materials_diffuse_transmission": {
        "diffuseTransmissionFactor": 0.4, "diffuseTransmissionColorFactor": [1, 0.5, 0] } });
    let leaf = material(leaf);
    assert!(leaf.reflectance.abs_diff_eq(Rgb::splat(0.3), 1e-12));
    assert!(leaf.transmittance.abs_diff_eq(Rgb::new(0.4, 0.2, 0.0), 1e-12));
}

/// A square of base colour 0.8 whose vertices have these colours.
fn coloured(component: u32, bytes: &[u8], kind: &str) -> Scene {
    let mut gltf = Gltf::of_material(base([0.8, 0.8, 0.8, 1.0], 0.0, 1.0));
    let colours = gltf.add(bytes, component, kind, 4);
    gltf.json["accessors"][colours]["normalized"] = json!(true);
    gltf.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(colours);
    read(&gltf).unwrap()
}

/// Colours that are 1 at x = 1 and 0 at x = 0: linear in between.
#[test]
fn colours_of_vertices_are_linear() {
    let bytes = SQUARE.map(|[x, ..]| [(255.0 * x) as u8; 4]).concat();
    let words: Vec<u8> =
        SQUARE.iter().flat_map(|&[x, ..]| [x, x, x]).flat_map(f32::to_le_bytes).collect();
    for scene in [coloured(5121, &bytes, "VEC4"), coloured(5126, &words, "VEC3")] {
        // Both triangles are halves of the square, and the mean of x over it is a half.
        let mean = scene.materials()[0].reflectance;
        assert!(mean.abs_diff_eq(Rgb::splat(0.4), 1e-7), "{mean}");
        for (at, x) in [([0.0, 0.0], 0.0), ([1.0, 0.0], 1.0), ([0.25, 0.25], 0.5)] {
            let found = scene.reflectance_at(0, at);
            assert!(found.abs_diff_eq(Rgb::splat(0.8 * x), 1e-7), "{at:?}: {found}");
        }
    }
}

/// A floor in the sky whose vertices have a colour reflects as one whose material has it.
#[test]
fn one_colour_of_all_vertices_is_that_of_the_material() {
    let tint = [0.5f32, 0.25, 1.0].map(f32::to_le_bytes).concat().repeat(4);
    let by_vertices = coloured(5126, &tint, "VEC3");
    let plain = read(&Gltf::of_material(base([0.4, 0.2, 0.8, 1.0], 0.0, 1.0))).unwrap();
    let [a, b] = [by_vertices, plain].map(|scene| {
        let go = |_: &_| ControlFlow::Continue(());
        BakeTarget::Error(0.1).bake(scene, &Backend::Cpu, go).unwrap().light.surface
    });
    assert_eq!(a.positions, b.positions);
    for (a, b) in a.radiosity.iter().zip(&b.radiosity) {
        // Colours are in 32 bits.
        assert!(a.abs_diff_eq(*b, 1e-7 * b.max_element()), "{a} {b}");
    }
}
