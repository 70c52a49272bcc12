//! Polygons of OBJ files are cut into triangles.

use std::f64::consts::PI;

use radiosity::{Mesh, Rgb, VertexMesh, load_scene};

use super::obj_texts::{SQUARE, area, obj, repaired, warned};
use crate::common::framed::{Frame, HERE};

#[test]
fn polygons_are_cut_alike_anywhere() {
    // An L with a corner in the middle of a side, and one on a line with its neighbours.
    let outline = [[0., 0.], [1., 0.], [2., 0.], [2., 1.], [1., 1.], [1., 2.], [0., 2.], [0., 0.7]];
    let folder = tempfile::tempdir().unwrap();
    for frame in [HERE, Frame::scaled(1e-9), Frame::scaled(1e9), Frame::shifted(1e6)] {
        for first in 0..outline.len() {
            let corner = |k: usize| {
                let [x, y] = outline[(first + k) % outline.len()];
                let [x, y, z] = frame.place([x, y, 0.0]);
                format!("v {x:e} {y:e} {z:e}\n")
            };
            let text: String = (0..outline.len()).map(corner).collect();
            let path = folder.path().join("l.obj");
            std::fs::write(&path, text + "f 1 2 3 4 5 6 7 8\n").unwrap();
            let scene = load_scene(&path).unwrap();
            let area: f64 = (0..scene.triangles().len()).map(|t| scene.area(t)).sum();
            // Steps of 2e-10, some of them around an outline of 8.
            assert!((area / frame.scale.powi(2) - 3.0).abs() < 1e-8, "{frame:?} {first}: {area}");
            let up = scene.normal(0);
            assert!((0..scene.triangles().len()).all(|t| scene.normal(t).dot(up) > 0.99));
        }
    }
}

#[test]
fn convex_polygon_of_100_000_corners() {
    let n = 100_000;
    let angle = |i: usize| 2.0 * PI * i as f64 / n as f64;
    let vertex = |i| format!("v {:.17} {:.17} 0\n", angle(i).cos(), angle(i).sin());
    let mut text: String = (0..n).map(vertex).collect();
    let corners: Vec<String> = (1..=n).map(|i| i.to_string()).collect();
    text += &format!("f {}\n", corners.join(" "));
    let scene = obj(&text).unwrap();
    assert_eq!(scene.triangles().len(), n - 2);
    // The polygon's own area is n/2 sin(2π/n); a sum of 1e5 terms rounds by up to 1e5 ε = 2e-11.
    assert!((area(&scene) - 0.5 * n as f64 * angle(1).sin()).abs() < 1e-10);
    // The first corner is one of all triangles: what is done around a vertex must not be done for
    // each of its neighbours.
    let mesh = Mesh::new(scene, f64::INFINITY).unwrap();
    let surface = VertexMesh::new(&mesh, &vec![Rgb::ONE; n - 2]);
    assert_eq!(surface.positions.len(), n);
    // Even light stays even, as far as the fits at the boundary let it.
    assert!(surface.radiosity.iter().all(|b| b.abs_diff_eq(Rgb::ONE, 2e-6)));
}

#[test]
fn fans_concave_polygons_above_10_000_corners() {
    // Along a parabola from below: what is cut off has all other corners near it.
    let parabola = |n: usize| {
        let x = |i: usize| 2.0 * i as f64 / n as f64 - 1.0;
        let arc: String = (0..=n).map(|i| format!("v {} {} 0\n", x(i), x(i) * x(i))).collect();
        let corners: Vec<String> = (1..=n + 3).map(|i| i.to_string()).collect();
        format!("{arc}v 1 -1 0\nv -1 -1 0\nf {}\n", corners.join(" "))
    };
    assert_eq!(obj(&parabola(9_997)).unwrap().triangles().len(), 9_998);
    let text = parabola(9_998);
    let files: [(&str, &[u8]); 1] = [("room.obj", text.as_bytes())];
    let scene = repaired(&files, "1 polygon", "room.obj:10002", "may have 10000 corners");
    assert_eq!(scene.triangles().len(), 9_999);
}

#[test]
fn polygons_that_cross_themselves_are_cut_somehow() {
    let text = format!("{SQUARE}g wall\nf 1 2 3\ng floor\nf 1 3 2 4\n");
    let files: [(&str, &[u8]); 1] = [("room.obj", text.as_bytes())];
    let scene = repaired(&files, "cross", "room.obj:8", "'floor'");
    assert_eq!(scene.triangles().len(), 3);
    assert!(scene.warnings().iter().any(|w| w.names == ["floor"]));
    // Two loops of different size: what of them can be cut turns as the larger does.
    let loops = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv -1 -1 0\nv -1 0 0\nf 1 2 3 4 5\n";
    let scene = obj(loops).unwrap();
    warned(&scene, "1 polygon that crosses itself");
    assert!((0..scene.triangles().len()).all(|t| scene.normal(t).to_array() == [0., 0., 1.]));
    assert!(area(&scene) > 2.0, "{}", area(&scene));
    // Concave, with the front that its corners turn to.
    let text = "v 0 0 0\nv 0 3 0\nv 1 3 0\nv 1 1 0\nv 2 1 0\nv 2 3 0\nv 3 3 0\nv 3 0 0\n";
    let scene = obj(&format!("{text}f 1 2 3 4 5 6 7 8\n")).unwrap();
    assert_eq!(area(&scene), 7.0);
    assert!((0..scene.triangles().len()).all(|t| scene.normal(t).to_array() == [0., 0., -1.]));
    // A corner given twice in a row is one corner.
    for (face, triangles) in [("1 2 2 3 4 1", 2), ("1 2 3 3", 1)] {
        let text = format!("{SQUARE}f {face}\n");
        let files: [(&str, &[u8]); 1] = [("room.obj", text.as_bytes())];
        let scene = repaired(&files, "1 corner given twice", "room.obj:5", "each corner once");
        assert_eq!(scene.triangles().len(), triangles);
    }
}
