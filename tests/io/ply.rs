//! What is written, read back.

use std::path::Path;

use radiosity::camera::RadianceImage;
use radiosity::io::{ToneCurve, write_ply_with_tone};
use radiosity::{ErrorKind, Material, Mesh, Rgb, VertexMesh, write_exr, write_ply, write_png};

use crate::common::framed::{self, Frame, HERE};
use crate::common::{cube, files};

fn surface() -> VertexMesh {
    let mesh = Mesh::new(cube(&Material::grey("g", 0.5)), 0.4).unwrap();
    let ramp: Vec<Rgb> = (0..mesh.element_count())
        .map(|e| Rgb::new(1.0, 2.0, 3.0) * mesh.centroid(mesh.element(e)).x + 0.5)
        .collect();
    VertexMesh::new(&mesh, &ramp)
}

/// The colours are those of the tone curve that is given: after twelve floats of each vertex.
#[test]
fn ply_has_the_colours_of_a_picture() {
    let (surface, folder) = (surface(), tempfile::tempdir().unwrap());
    let path = folder.path().join("cube.ply");
    let tone = ToneCurve::fit(&[Rgb::splat(20.0)]);
    write_ply_with_tone(&path, &surface, &tone).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let records = bytes[end..].chunks(51).take(surface.positions.len());
    let colours: Vec<[u8; 3]> = records.map(|record| record[48..].try_into().unwrap()).collect();
    let of = |tone: &ToneCurve| -> Vec<[u8; 3]> {
        surface.radiosity.iter().map(|&b| tone.display(b)).collect()
    };
    assert!(colours == of(&tone) && colours != of(&ToneCurve::fit(&surface.radiosity)));
}

#[test]
fn ply_reads_back_bit_for_bit() {
    let (surface, folder) = (surface(), tempfile::tempdir().unwrap());
    let path = folder.path().join("cube.ply");
    write_ply(&path, &surface).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let header = std::str::from_utf8(&bytes[..end]).unwrap();
    let lines: Vec<&str> = header.lines().filter(|l| !l.starts_with("comment")).collect();
    let vertices = format!("element vertex {}", surface.positions.len());
    let faces = format!("element face {}", surface.faces.len());
    let want = [
        "ply",
        "format binary_little_endian 1.0",
        &vertices,
        "property float x",
        "property float y",
        "property float z",
        "property float nx",
        "property float ny",
        "property float nz",
        "property float radiosity_r",
        "property float radiosity_g",
        "property float radiosity_b",
        "property float irradiance_r",
        "property float irradiance_g",
        "property float irradiance_b",
        "property uchar red",
        "property uchar green",
        "property uchar blue",
        &faces,
        "property list uchar int vertex_indices",
        "end_header",
    ];
    assert_eq!(lines, want);
    let (body, stride) = (&bytes[end..], 12 * 4 + 3);
    for (v, record) in body.chunks(stride).take(surface.positions.len()).enumerate() {
        let float = |k: usize| f32::from_le_bytes(record[4 * k..4 * k + 4].try_into().unwrap());
        let three = |k: usize| [float(k), float(k + 1), float(k + 2)];
        assert_eq!(three(0), surface.positions[v].as_vec3().to_array());
        assert_eq!(three(3), surface.normals[v].as_vec3().to_array());
        assert_eq!(three(6), surface.radiosity[v].as_vec3().to_array());
        // All of it is reflected, half of what arrives.
        assert_eq!(three(9), (2.0 * surface.radiosity[v]).as_vec3().to_array());
    }
    let faces = &body[stride * surface.positions.len()..];
    assert_eq!(faces.len(), 13 * surface.faces.len());
    for (record, face) in faces.chunks(13).zip(&surface.faces) {
        let index = |k: usize| u32::from_le_bytes(record[k..k + 4].try_into().unwrap());
        assert_eq!((record[0], [index(1), index(5), index(9)]), (3, *face));
    }
}

#[test]
fn unwritable_path_is_named() {
    let (surface, missing) = (surface(), Path::new("no/such/folder/x"));
    let image = RadianceImage { width: 1, height: 1, pixels: vec![Rgb::ONE], sky: vec![false] };
    for e in [
        write_ply(missing, &surface).unwrap_err(),
        write_exr(missing, &image).unwrap_err(),
        write_png(missing, &image).unwrap_err(),
    ] {
        assert_eq!(e.kind(), ErrorKind::File);
        assert!(e.to_string().contains("no/such/folder/x"), "{e}");
    }
}

#[test]
fn ply_uses_doubles_where_floats_fail() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ply");
    let far = Frame::shifted(1e6);
    for (frame, radiosity, place, light) in [
        (HERE, 1.0, "float x", "float radiosity_r"),
        (Frame::scaled(1e-9), 1e30, "float x", "float radiosity_r"),
        (far, 1e-29, "double x", "float radiosity_r"),
        (HERE, 1e39, "float x", "double radiosity_r"),
        (HERE, 1e-40, "float x", "double radiosity_r"),
    ] {
        write_ply(&path, &framed::even_surface(frame, radiosity)).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let header = String::from_utf8_lossy(&bytes[..600]).into_owned();
        assert!(header.contains(&format!("property {place}\n")), "{header}");
        assert!(header.contains(&format!("property {light}\n")), "{header}");
        // What 24 bits hold.
        let read = files::radiosity_of_ply(&path);
        assert!(read.iter().all(|b| (b / radiosity - 1.0).abs() < 1e-7), "{radiosity:e}");
    }
}
