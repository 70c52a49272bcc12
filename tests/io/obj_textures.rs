//! Textures of materials: where they are looked for, what they are multiplied with, and limits.

use std::f64::consts::PI;
use std::fs;
use std::io::Write;
use std::sync::Arc;

use radiosity::glam::DVec2;
use radiosity::scene::WarningKind;
use radiosity::{Rgb, Scene, SceneSettings, load_scene};
use tempfile::TempDir;

use super::obj_texts::{SQUARE, load, oddities, repaired};
use crate::common::textured::{GREEN, RED, tga};

/// A square across u and v from 0 to 1, left half red and right half green.
fn two_halves() -> (String, Vec<u8>) {
    let text = format!(
        "mtllib room.mtl\n{SQUARE}vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl wall\n\
         f 1/1 2/2 3/3 4/4\n"
    );
    (text, tga(2, &[RED, GREEN, RED, GREEN]))
}

fn scene(library: &str) -> Scene {
    let (text, image) = two_halves();
    load(&[("room.obj", text.as_bytes()), ("room.mtl", library.as_bytes()), ("a b.tga", &image)])
        .unwrap()
}

#[test]
fn texture_lies_on_the_surface() {
    let scene = scene("newmtl wall\nKd 0.5 0.5 0.5\nmap_Kd a b.tga\n");
    assert_eq!(oddities(&scene), [], "{:?}", scene.warnings());
    assert_eq!(scene.texture_coordinates(0).unwrap(), [DVec2::ZERO, DVec2::X, DVec2::ONE]);
    let map = scene.textures(0).unwrap().reflectance.as_ref().unwrap();
    assert_eq!(map.at(DVec2::new(0.25, 0.5)), Rgb::new(0.5, 0.0, 0.0));
    // Half of the area lies on each side, of both triangles a quarter or three quarters.
    let mean = |t| map.mean(scene.texture_coordinates(t).unwrap());
    assert!(mean(0).abs_diff_eq(Rgb::new(0.125, 0.375, 0.0), 1e-12), "{}", mean(0));
    assert!(mean(1).abs_diff_eq(Rgb::new(0.375, 0.125, 0.0), 1e-12), "{}", mean(1));
    assert_eq!(scene.material(0).reflectance, Rgb::new(0.25, 0.25, 0.0));
    // Triangles that are dropped take theirs along; moved ones keep them.
    let (text, image) = two_halves();
    let text =
        format!("{}f 1/1 2/2 1/3 3/3 4/4\n", text.replace("f ", "v 2 0 0\nf 1/1 2/1 5/1\nf "));
    let library: &[u8] = b"newmtl wall\nmap_Kd a b.tga\n";
    let scene = load(&[("room.obj", text.as_bytes()), ("room.mtl", library), ("a b.tga", &image)]);
    let scene = scene.unwrap();
    assert_eq!(scene.texture_coordinates(0).unwrap(), [DVec2::ZERO, DVec2::X, DVec2::ONE]);
    assert!(scene.texture_coordinates(scene.triangles().len()).is_none());
    let moved = scene.with_transformed_group("default", radiosity::glam::DAffine3::IDENTITY);
    assert!(moved.unwrap().textures(0).is_some());
}

#[test]
fn factor_is_what_is_written_or_one() {
    // The texel 1 stays below the ceiling of a reflectance, and is itself for light.
    for (lines, reflectance, exitance) in [
        ("map_Kd a b.tga", 0.98, 0.0),
        ("Kd 0 0 0\nmap_Kd a b.tga", 0.98, 0.0),
        ("Kd 1 1 1\nmap_Kd a b.tga", 0.98, 0.0),
        ("Kd 0.3\nmap_Kd -s 1 1 1 a b.tga\nmap_Ke a b.tga", 0.3, PI),
        ("Kd 0.3\nmap_Kd a b.tga\nKe 5\nMAP_KE a b.tga", 0.3, 5.0 * PI),
    ] {
        let scene = scene(&format!("newmtl wall\n{lines}\n"));
        let textures = scene.textures(0).unwrap();
        let red = DVec2::new(0.25, 0.5);
        assert_eq!(textures.reflectance.as_ref().unwrap().at(red).x, reflectance, "{lines}");
        let emitted = textures.exitance.as_ref().map_or(0.0, |map| map.at(red).x);
        assert!((emitted - exitance).abs() < 1e-12, "{lines}: {emitted}");
    }
}

#[test]
fn options_move_the_texture() {
    let at = |options: &str, u: f64| {
        let scene = scene(&format!("newmtl wall\nKd 0.5\nmap_Kd {options} a b.tga\n"));
        scene.textures(0).unwrap().reflectance.as_ref().unwrap().at(DVec2::new(u, 0.5)).x
    };
    assert_eq!([at("", 0.25), at("-o 0.5 0", 0.25), at("-s 3 1", 0.25)], [0.5, 0.0, 0.0]);
    assert_eq!([at("", 1.25), at("-clamp on", 1.25), at("-clamp off", 1.25)], [0.5, 0.0, 0.5]);
    let scene = scene("newmtl wall\nKd 0.5\nmap_Kd -bm 1 a b.tga\n");
    assert_eq!(oddities(&scene), [WarningKind::TextureOptions]);
}

#[test]
fn texture_that_is_not_there_is_its_kd() {
    let (text, _) = two_halves();
    let library = "newmtl wall\nKd 0.3\nmap_Kd ..\\walls\\gone.png\n";
    let files = [("room.obj", text.as_bytes()), ("room.mtl", library.as_bytes())];
    let scene = repaired(&files, "1 texture that is not there", "room.mtl:1", "gone.png");
    assert_eq!(scene.material(0).reflectance.to_array(), [0.3; 3]);
    assert!(scene.textures(0).is_none() && scene.texture_coordinates(0).is_none());
    // With neither, grey.
    let scene = self::scene("newmtl wall\nmap_Kd gone.png\n");
    assert_eq!(scene.material(0).reflectance.to_array(), [0.5; 3]);
    // Looked for as libraries are.
    for name in ["A B.TGA", "C:\\art\\a b.tga", "../a b.tga", "textures/a b.tga"] {
        let scene = self::scene(&format!("newmtl wall\nmap_Kd {name}\n"));
        assert!(scene.textures(0).is_some(), "{name}");
    }
}

#[test]
fn image_is_read_once() {
    let text = format!("mtllib room.mtl\n{SQUARE}usemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\n");
    let image = tga(2, &[RED, GREEN]);
    for name in ["./a.tga", "A.TGA", ".\\art\\..\\a.tga"] {
        let library = format!("newmtl a\nmap_Kd a.tga\nnewmtl b\nmap_Kd {name}\n");
        let library = ("room.mtl", library.as_bytes());
        let scene = load(&[("room.obj", text.as_bytes()), library, ("a.tga", &image)]).unwrap();
        let texture = |t| &scene.textures(t).unwrap().reflectance.as_ref().unwrap().texture;
        assert!(Arc::ptr_eq(texture(0), texture(1)), "{name}");
    }
}

#[test]
fn file_of_an_image_may_have_256_mib() {
    let folder = TempDir::new().unwrap();
    let (text, _) = two_halves();
    fs::write(folder.path().join("room.obj"), text).unwrap();
    fs::write(folder.path().join("room.mtl"), "newmtl wall\nKd 0.3\nmap_Kd a.png\n").unwrap();
    // With a hole, so that it takes no room on the disk.
    fs::File::create(folder.path().join("a.png")).unwrap().set_len((1 << 28) + 1).unwrap();
    let scene = load_scene(folder.path().join("room.obj")).unwrap();
    assert_eq!(oddities(&scene), [WarningKind::LargeTexture]);
    let warning = scene.warnings()[0].to_string();
    assert!(warning.contains("more than 268435456 bytes"), "{warning}");
    assert_eq!(scene.material(0).reflectance.to_array(), [0.3; 3]);
}

#[test]
fn corners_without_texture_coordinates_get_the_mean() {
    let text = format!(
        "mtllib room.mtl\n{SQUARE}usemtl wall\nf 1 2 3\nvt 0 0\nvt 1 0\nvt nan 1\nf 1/1 2/2 3/1\n\
         f 1/1 2//1 3/1\nf 1/1 2/9 3/3\n"
    );
    let image = tga(2, &[RED, GREEN]);
    let library: &[u8] = b"newmtl wall\nKd 0.5\nmap_Kd a.tga\n";
    let scene = load(&[("room.obj", text.as_bytes()), ("room.mtl", library), ("a.tga", &image)]);
    let scene = scene.unwrap();
    let map = scene.textures(0).unwrap().reflectance.as_ref().unwrap();
    for (t, known) in [(0, 0), (1, 3), (2, 2), (3, 1)] {
        let corners = scene.texture_coordinates(t).unwrap();
        assert_eq!(corners.iter().filter(|uv| uv.is_finite()).count(), known, "{t}");
        if known < 3 {
            assert_eq!(map.mean(corners), map.whole_mean());
        }
    }
}

/// The start of a PNG image that claims to have so many texels along each side.
fn png_that_claims(side: u32) -> Vec<u8> {
    let mut header = b"IHDR".to_vec();
    header.extend([side.to_be_bytes(), side.to_be_bytes()].concat());
    header.extend([8, 2, 0, 0, 0]);
    // The checksum of PNG (ISO 3309).
    let crc = header.iter().fold(!0u32, |crc, &byte| {
        let bit = |c: u32| if c & 1 == 1 { (c >> 1) ^ 0xedb8_8320 } else { c >> 1 };
        (0..8).fold(crc ^ u32::from(byte), |c, _| bit(c))
    });
    let mut bytes = b"\x89PNG\r\n\x1a\n".to_vec();
    bytes.write_all(&13u32.to_be_bytes()).unwrap();
    bytes.extend(header);
    bytes.extend((!crc).to_be_bytes());
    bytes.extend(*b"\0\0\0\x08IDAT");
    bytes
}

#[test]
fn images_that_claim_too_much_or_are_none_are_not_read() {
    let (text, image) = two_halves();
    let library: &[u8] = b"newmtl wall\nKd 0.3\nmap_Kd a.png\n";
    // Runs of a palette of one colour, which end before the first.
    let mut bmp = [&b"BM"[..], &[0; 8], &[58, 0, 0, 0, 40, 0, 0, 0]].concat();
    bmp.extend([5000u32, 5000].map(u32::to_le_bytes).concat());
    bmp.extend([1, 0, 8, 0, 1]);
    bmp.extend([0; 15]);
    bmp.extend([1, 0, 0, 0, 0, 0, 0, 0, 9, 9, 9, 0, 0, 1]);
    let (large, unreadable) = (WarningKind::LargeTexture, WarningKind::UnreadableTexture);
    for (bytes, kind, reason) in [
        (png_that_claims(100_000), large, "100000 × 100000 texels, and 32768 a side"),
        (png_that_claims(30_000), large, "30000 × 30000 texels, and 134217728 of all"),
        (png_that_claims(10_000), unreadable, "too short for the 10000 × 10000 texels"),
        (bmp, unreadable, "too short for the 5000 × 5000 texels"),
        (vec![], unreadable, ""),
        (vec![7; 100], unreadable, ""),
        (image[..20].to_vec(), unreadable, ""),
    ] {
        let files: [(&str, &[u8]); 3] =
            [("room.obj", text.as_bytes()), ("room.mtl", library), ("a.png", &bytes)];
        let scene = SceneSettings::default().read("room.obj", files[0].1, &files[1..]).unwrap();
        assert_eq!(oddities(&scene), [kind], "{} {:?}", bytes.len(), scene.warnings());
        let warning = scene.warnings()[0].to_string();
        assert!(warning.contains(reason) && warning.contains("`Kd` and `Ke` count"), "{warning}");
        assert!(warning.contains("room.mtl:1") && warning.contains("'a.png'"), "{warning}");
        assert_eq!(scene.material(0).reflectance.to_array(), [0.3; 3]);
        let mut strict = SceneSettings::default();
        strict.strict = true;
        let refused = strict.read("room.obj", files[0].1, &files[1..]).unwrap_err().to_string();
        assert!(refused.contains("room.mtl:1") && refused.contains("a.png"), "{refused}");
    }
}
