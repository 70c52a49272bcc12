//! What is written, read back.

use std::ops::ControlFlow;
use std::path::Path;

use crate::common::{cube, keep_going, quads};
use glam::DVec3;
use radiosity::{
    Camera, ErrorKind, Material, Mesh, RadianceImage, RayRows, Rgb, Solver, VertexMesh,
    ViewFactors, write_exr, write_ply, write_png, write_view_factors,
};

fn surface() -> VertexMesh {
    let mesh = Mesh::new(cube(&Material::grey("g", 0.5)), 0.4).unwrap();
    let ramp: Vec<Rgb> = (0..mesh.element_count())
        .map(|e| Rgb::new(1.0, 2.0, 3.0) * mesh.centroid(mesh.element(e)).x + 0.5)
        .collect();
    VertexMesh::new(&mesh, &ramp)
}

#[test]
fn a_ply_has_every_vertex_and_face_bit_for_bit() {
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
        "property uchar red",
        "property uchar green",
        "property uchar blue",
        &faces,
        "property list uchar int vertex_indices",
        "end_header",
    ];
    assert_eq!(lines, want);
    let (body, stride) = (&bytes[end..], 9 * 4 + 3);
    for (v, record) in body.chunks(stride).take(surface.positions.len()).enumerate() {
        let float = |k: usize| f32::from_le_bytes(record[4 * k..4 * k + 4].try_into().unwrap());
        let three = |k: usize| [float(k), float(k + 1), float(k + 2)];
        assert_eq!(three(0), surface.positions[v].as_vec3().to_array());
        assert_eq!(three(3), surface.normals[v].as_vec3().to_array());
        assert_eq!(three(6), surface.radiosity[v].as_vec3().to_array());
    }
    let faces = &body[stride * surface.positions.len()..];
    assert_eq!(faces.len(), 13 * surface.faces.len());
    for (record, face) in faces.chunks(13).zip(&surface.faces) {
        let index = |k: usize| u32::from_le_bytes(record[k..k + 4].try_into().unwrap());
        assert_eq!((record[0], [index(1), index(5), index(9)]), (3, *face));
    }
}

#[test]
fn an_exr_holds_the_radiance_and_a_png_its_picture() {
    let pixels = (0..12).map(|k| Rgb::new(f64::from(k), 0.25, 1e-3 * f64::from(k))).collect();
    let image = RadianceImage { width: 4, height: 3, pixels };
    let folder = tempfile::tempdir().unwrap();
    let (exr, png) = (folder.path().join("i.exr"), folder.path().join("i.png"));
    write_exr(&exr, &image).unwrap();
    write_png(&png, &image).unwrap();
    let read = exr::prelude::read_first_rgba_layer_from_file(
        &exr,
        |size, _| vec![[0f32; 3]; size.area()],
        |store, at, (r, g, b, _): (f32, f32, f32, f32)| store[at.y() * 4 + at.x()] = [r, g, b],
    )
    .unwrap();
    let want: Vec<[f32; 3]> = image.pixels.iter().map(|c| c.as_vec3().to_array()).collect();
    assert_eq!(read.layer_data.channel_data.pixels, want);
    let read = image::open(&png).unwrap().into_rgb8();
    assert_eq!(read.dimensions(), (4, 3));
    // Brighter radiance, brighter pixel: red rises along the image, and is never past green first.
    assert!(read.get_pixel(0, 0)[0] == 0 && read.get_pixel(3, 2)[0] > read.get_pixel(1, 0)[0]);
}

#[test]
fn a_camera_sees_what_stands_before_it() {
    // A glowing square left of a dark one, seen from its front; nothing around.
    let glow = Material { exitance: Rgb::splat(std::f64::consts::PI), ..Material::grey("g", 0.0) };
    let left = [[-1., -1., 0.], [0., -1., 0.], [0., 1., 0.], [-1., 1., 0.]];
    let right = [[0., -1., 0.], [1., -1., 0.], [1., 1., 0.], [0., 1., 0.]];
    let mesh = Mesh::new(quads(&[(left, glow), (right, Material::grey("d", 0.0))]), 9.0).unwrap();
    let solution =
        Solver::default().solve(&mesh, &mut RayRows::new(&mesh, 16).unwrap(), keep_going).unwrap();
    let surface = VertexMesh::new(&mesh, &solution.radiosity);
    let camera = Camera { eye: DVec3::new(0., 0., 2.), target: DVec3::ZERO, vertical_fov: 90.0 };
    // 8 pixels span 4 at distance 2: half a unit each. Radiance of the glow is 1.
    let image = camera.image(&surface, 8, 8, 2).unwrap();
    let row = |y: usize| image.pixels[8 * y..8 * y + 8].iter().map(|c| c.x).collect::<Vec<_>>();
    assert_eq!(row(0), [0.0; 8]);
    for (x, radiance) in row(3).into_iter().enumerate() {
        let want = if (2..4).contains(&x) { 1.0 } else { 0.0 };
        assert!((radiance - want).abs() < 1e-12, "{x}: {radiance}");
    }
    // From behind, backs are black.
    let behind = Camera { eye: DVec3::new(0., 0., -2.), ..camera };
    assert!(behind.image(&surface, 8, 8, 1).unwrap().pixels.iter().all(|&c| c == Rgb::ZERO));
    // Straight up, and bad settings.
    let up = Camera { eye: DVec3::ZERO, target: DVec3::Y, vertical_fov: 40.0 };
    assert!(up.image(&surface, 2, 2, 1).is_ok());
    for bad in [
        Camera { vertical_fov: 0.0, ..camera },
        Camera { vertical_fov: 180.0, ..camera },
        Camera { target: camera.eye, ..camera },
        Camera { eye: DVec3::NAN, ..camera },
    ] {
        assert_eq!(bad.image(&surface, 8, 8, 1).unwrap_err().kind(), ErrorKind::Setting);
    }
    for (width, height, samples) in [(0, 8, 1), (8, 0, 1), (1 << 20, 8, 1), (8, 8, 0)] {
        assert!(camera.image(&surface, width, height, samples).is_err());
    }
}

#[test]
fn view_factors_of_a_cube_as_csv() {
    let mesh = Mesh::new(cube(&Material::grey("g", 0.5)), 0.36).unwrap();
    let mut rays = RayRows::new(&mesh, 4096).unwrap();
    let mut done = vec![];
    let matrix = ViewFactors::sampled(&mesh, &mut rays, |k, of| {
        done.push((k, of));
        ControlFlow::Continue(())
    });
    let mut matrix = matrix.unwrap().unwrap();
    assert_eq!(done.last(), Some(&(192, 192)));
    for i in 0..6 {
        assert!((matrix.areas[i] - 1.0).abs() < 1e-14);
        let sum: f64 = matrix.factors[i].iter().map(|f| f.value).sum();
        assert!((sum + matrix.open[i].value + matrix.back[i].value - 1.0).abs() < 1e-8);
        for j in 0..6 {
            // 0.1998 for opposite walls, (1 − 0.1998)/4 = 0.2000 for the others. 32 rows of 4096
            // rays: 0.0011 in a standard error; elements of 0.35 see the next wall from their
            // centroids, which costs up to 0.01.
            let want = if i == j { 0.0 } else { 0.2 };
            assert!((matrix.factor(i, j).value - want).abs() < 0.015, "{i} {j}");
        }
    }
    matrix.names[1] = "a \"b\", c".into();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cube.csv");
    write_view_factors(&path, &matrix).unwrap();
    let text = std::fs::read_to_string(path).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 7);
    assert_eq!(lines[0], "F from row to column,q0,\"a \"\"b\"\", c\",q2,q3,q4,q5,open,back,area");
    let first: Vec<&str> = lines[1].split(',').collect();
    assert_eq!((first[0], first.len()), ("q0", 10));
    assert!((first[2].parse::<f64>().unwrap() - matrix.factor(0, 1).value).abs() < 1e-9);
    let stopped = ViewFactors::sampled(&mesh, &mut rays, |_, _| ControlFlow::Break(()));
    assert!(stopped.unwrap().is_none());
}

#[test]
fn a_place_that_cannot_be_written_is_named() {
    let (surface, missing) = (surface(), Path::new("no/such/folder/x"));
    let image = RadianceImage { width: 1, height: 1, pixels: vec![Rgb::ONE] };
    for e in [
        write_ply(missing, &surface).unwrap_err(),
        write_exr(missing, &image).unwrap_err(),
        write_png(missing, &image).unwrap_err(),
    ] {
        assert_eq!(e.kind(), ErrorKind::File);
        assert!(e.to_string().contains("no/such/folder/x"), "{e}");
    }
}
