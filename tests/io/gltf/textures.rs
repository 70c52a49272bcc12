use std::f64::consts::FRAC_PI_2;
use std::io::Cursor;

use image::{ImageFormat, RgbaImage};
use radiosity::io::read_scene;
use radiosity::scene::WarningKind;
use radiosity::{Rgb, Scene, SceneSettings};
use serde_json::{Value, json};

use super::{has_warning, read};
use crate::common::gltf::Gltf;

/// A PNG or WebP image of `width` texels a row.
fn encoded(width: u32, texels: &[[u8; 4]], format: ImageFormat) -> Vec<u8> {
    let height = texels.len() as u32 / width;
    let image = RgbaImage::from_raw(width, height, texels.as_flattened().to_vec()).unwrap();
    let mut bytes = Cursor::new(vec![]);
    image.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

const RED: [u8; 4] = [255, 0, 0, 255];
const GREEN: [u8; 4] = [0, 255, 0, 255];
const BLUE: [u8; 4] = [0, 0, 255, 255];
const WHITE: [u8; 4] = [255; 4];

/// Red and green above blue and white.
const QUARTERS: [[u8; 4]; 4] = [RED, GREEN, BLUE, WHITE];

/// A square of a material with these images, each a texture of its own.
fn textured(material: Value, images: &[Vec<u8>]) -> Gltf {
    let mut gltf = Gltf::of_material(material);
    let image = |view: usize| json!({ "bufferView": view, "mimeType": "image/png" });
    let views: Vec<Value> = images.iter().map(|bytes| image(gltf.add_view(bytes))).collect();
    gltf.json["textures"] = (0..images.len()).map(|k| json!({ "source": k })).collect();
    gltf.json["images"] = Value::Array(views);
    gltf
}

fn base_texture(more: Value) -> Value {
    json!({ "pbrMetallicRoughness": {
        "baseColorFactor": [0.9, 0.9, 0.9, 1], "metallicFactor": 0, "baseColorTexture": more } })
}

/// Reflectance of a point of the square, by its own coordinates; the first triangle is below the
/// diagonal.
fn at(scene: &Scene, [x, y]: [f64; 2]) -> Rgb {
    // Texels have a colour each, and are met in the middle.
    if y <= x { scene.reflectance_at(0, [x - y, y]) } else { scene.reflectance_at(1, [x, y - x]) }
}

fn check_quarters(scene: &Scene, wanted: [Rgb; 4]) {
    let places = [[0.25, 0.75], [0.75, 0.75], [0.25, 0.25], [0.75, 0.25]];
    for (place, wanted) in places.into_iter().zip(wanted) {
        let found = at(scene, place);
        assert!(found.abs_diff_eq(wanted, 1e-6), "{place:?}: {found} {wanted}");
    }
}

fn colours() -> [Rgb; 4] {
    [Rgb::X, Rgb::Y, Rgb::Z, Rgb::ONE].map(|colour| 0.9 * colour)
}

/// The first row of an image is at the top of the square, whose v = 0 is there.
#[test]
fn images_lie_as_their_coordinates_say() {
    for format in [ImageFormat::Png, ImageFormat::WebP] {
        let image = encoded(2, &QUARTERS, format);
        let scene = read(&textured(base_texture(json!({ "index": 0 })), &[image])).unwrap();
        check_quarters(&scene, colours());
    }
}

#[test]
fn images_are_found_in_data_and_files() {
    let png = encoded(2, &QUARTERS, ImageFormat::Png);
    let mut gltf = textured(base_texture(json!({ "index": 0 })), std::slice::from_ref(&png));
    gltf.json["images"] = json!([{ "uri": "a%20file%C3%A9.png" }]);
    gltf.json["buffers"] = json!([{ "byteLength": gltf.binary.len(), "uri": "all.bin" }]);
    let json = gltf.json.to_string();
    let files: [(&str, &[u8]); 2] = [("a fileé.png", &png), ("all.bin", &gltf.binary)];
    check_quarters(&read_scene("it.gltf", json.as_bytes(), &files).unwrap(), colours());
    // One pixel of red as a data URI; the texture's image is missing without its file.
    gltf.json["images"] = json!([{ "uri": "data:image/png;base64,\
        iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGP4\
        z8AAAAMBAQDJ/pLvAAAAAElFTkSuQmCC" }]);
    let json = gltf.json.to_string();
    check_quarters(
        &read_scene("it.gltf", json.as_bytes(), &files[1..]).unwrap(),
        [0.9 * Rgb::X; 4],
    );
    gltf.json["images"] = json!([{ "uri": "elsewhere.png" }]);
    let json = gltf.json.to_string();
    let scene = read_scene("it.gltf", json.as_bytes(), &files[1..]).unwrap();
    assert!(has_warning(&scene, WarningKind::MissingTexture));
    assert_eq!(scene.materials()[0].reflectance, Rgb::splat(0.9));
    let mut strict = SceneSettings::default();
    strict.strict = true;
    assert!(strict.read("it.gltf", json.as_bytes(), &files[1..]).is_err());
    let e = read_scene("it.gltf", json.as_bytes(), &[]).unwrap_err().to_string();
    assert!(e.contains("the file 'all.bin' is not there"), "{e}");
}

/// The example of the extension's own text: the lower left quarter of the image, turned clockwise;
/// and its second one, which turns v over.
#[test]
fn coordinates_are_transformed() {
    let with = |transform: Value| {
        let extensions = json!({ "KHR_texture_transform": transform });
        let texture = base_texture(json!({ "index": 0, "extensions": extensions }));
        // Four texels a side: each quarter of the first image has four of its own.
        let texel = |k: usize| [if k / 4 >= 2 && k % 4 < 2 { 255 } else { 0 }, 0, 0, 255];
        let mut texels: Vec<[u8; 4]> = (0..16).map(texel).collect();
        // The lower left quarter: red, green above blue, white.
        (texels[8], texels[9], texels[12], texels[13]) = (RED, GREEN, BLUE, WHITE);
        read(&textured(texture, &[encoded(4, &texels, ImageFormat::Png)])).unwrap()
    };
    let [red, green, blue, white] = colours();
    let turned = with(json!({ "offset": [0, 1], "rotation": FRAC_PI_2, "scale": [0.5, 0.5] }));
    // Turned clockwise, what was below on the left is above on the left.
    check_quarters(&turned, [blue, red, white, green]);
    let quarter = with(json!({ "offset": [0, 0.5], "scale": [0.5, 0.5] }));
    check_quarters(&quarter, [red, green, blue, white]);
    let over = with(json!({ "offset": [0, 1], "scale": [0.5, -0.5] }));
    check_quarters(&over, [blue, white, red, green]);
}

/// Metal of roughness 0 in the right half reflects nothing diffusely; in the left half there is
/// none.
#[test]
fn metal_follows_its_texture() {
    let metal = encoded(2, &[[0, 0, 0, 255], [0, 0, 255, 255]], ImageFormat::Png);
    let material = json!({ "pbrMetallicRoughness": {
        "baseColorFactor": [0.9, 0.9, 0.9, 1], "baseColorTexture": { "index": 0 },
        "metallicRoughnessTexture": { "index": 1 } } });
    let images = [encoded(2, &QUARTERS, ImageFormat::Png), metal.clone()];
    let scene = read(&textured(material, &images)).unwrap();
    check_quarters(&scene, [0.9 * Rgb::X, Rgb::ZERO, 0.9 * Rgb::Z, Rgb::ZERO]);
    // The same without a texture of colours.
    let material = json!({ "pbrMetallicRoughness": {
        "baseColorFactor": [0.9, 0.9, 0.9, 1], "metallicRoughnessTexture": { "index": 0 } } });
    let scene = read(&textured(material, &[metal])).unwrap();
    check_quarters(&scene, [Rgb::splat(0.9), Rgb::ZERO, Rgb::splat(0.9), Rgb::ZERO]);
}

/// Alpha of a quarter, and of three quarters.
#[test]
fn alpha_cuts_holes() {
    let texels = [[255, 255, 255, 64], [255, 255, 255, 191]];
    let image = encoded(2, &texels, ImageFormat::Png);
    let with = |mode: Value| {
        let mut material = base_texture(json!({ "index": 0 }));
        material.as_object_mut().unwrap().extend(mode.as_object().unwrap().clone());
        read(&textured(material, std::slice::from_ref(&image))).unwrap()
    };
    let solid = |scene: &Scene| (0..2).map(|t| scene.solid_area(t)).sum::<f64>();
    for (mode, area) in [
        (json!({ "alphaMode": "OPAQUE" }), 1.0),
        (json!({ "alphaMode": "MASK" }), 0.5),
        (json!({ "alphaMode": "MASK", "alphaCutoff": 0.2 }), 1.0),
        (json!({ "alphaMode": "BLEND" }), 0.5),
    ] {
        let found = solid(&with(mode.clone()));
        assert!((found - area).abs() < 1e-6, "{mode}: {found}");
    }
    // Nothing is solid: a pane that lets 1 - alpha pass.
    let clear = encoded(1, &[[255, 255, 255, 51]], ImageFormat::Png);
    let mut material = base_texture(json!({ "index": 0 }));
    material["alphaMode"] = json!("BLEND");
    let pane = read(&textured(material, &[clear])).unwrap();
    let share = match pane.materials()[0].specular {
        Some(radiosity::scene::Specular::Glass { transmittance, .. }) => transmittance,
        other => panic!("{other:?}"),
    };
    assert!(share.abs_diff_eq(Rgb::splat(0.8), 1e-12), "{share}");
}

/// KTX2 alone is not read, and the message says how to get PNG.
#[test]
fn other_formats_are_said() {
    let mut gltf = textured(base_texture(json!({ "index": 0 })), &[vec![1, 2, 3]]);
    gltf.json["textures"] = json!([{ "extensions": { "KHR_texture_basisu": { "source": 0 } } }]);
    gltf.json["extensionsRequired"] = json!(["KHR_texture_basisu", "ACME_light"]);
    let scene = read(&gltf).unwrap();
    let text: String = scene.warnings().iter().map(|w| format!("{w}\n")).collect();
    assert!(text.contains("KHR_texture_basisu (KTX2) alone; npx @gltf-transform/cli"), "{text}");
    assert!(text.contains("1 extension that is not read: left out") && text.contains("ACME_light"));
}
