//! The whole range of every quantity: its ends and its middle, on hemicubes and on rays. The example
//! `extremes` goes all steps of the same sweeps.

mod sweep;
mod sweeps;

use crate::common::framed::{self as scenes, Frame, HERE};
use crate::common::{files, keep_going};
use radiosity::{
    Backend, Camera, ErrorKind, Mesh, RadianceImage, RayRows, Rgb, Solver, VertexMesh, load_obj,
    write_exr, write_ply,
};

/// Goes all sweeps, and names those that do not hold.
fn sweep_with(device: &Backend) {
    let ask = sweeps::Ask { device, all: false };
    let swept: Vec<_> = sweeps::ALL.iter().map(|sweep| sweep(&ask).unwrap()).collect();
    swept.iter().for_each(|s| println!("{s:?}"));
    let broken: Vec<_> = swept.iter().filter(|s| !s.holds()).collect();
    assert!(broken.is_empty(), "{broken:#?}");
}

#[test]
fn rays_hold_over_all_ranges() {
    sweep_with(&Backend::Cpu);
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn hemicubes_hold_over_all_ranges() {
    let gpu = crate::common::gpu();
    sweep_with(&Backend::Gpu(gpu));
}

#[test]
fn a_white_furnace_takes_few_products() {
    // Light that fills the scene evenly is one direction: found in a product. What is left are 48
    // elements' own, in 48 at most; shares of 2⁻³² that differ, not light, are what takes more than one.
    let ask = sweeps::Ask { device: &Backend::Cpu, all: true };
    let s = sweeps::reflectance_of_furnace(&ask).unwrap();
    assert!(s.steps >= 12 && s.off <= 1e-4 && s.most <= 48, "{s:?}");
}

#[test]
fn ties_are_ties_at_any_scale() {
    // All walls alike: whose turn it is to shoot is a matter of order alone, unless rounding decides.
    let light = |scale: f64| {
        let scene = scenes::furnace(Frame::scaled(scale), 0.5, 1.0);
        let mesh = Mesh::new(scene, 0.2 * scale).unwrap();
        let mut rays = RayRows::new(&mesh, 256).unwrap().with_full_share(0.0);
        let s = Solver { unshot: 0.1, ..Solver::default() };
        s.solve(&mesh, &mut rays, keep_going).unwrap().radiosity
    };
    let known = light(1.0);
    for scale in [0.1, 3.0, 10.0, 1e-7] {
        let found = light(scale);
        let off = found.iter().zip(&known).map(|(a, b)| (*a / *b - 1.0).length());
        // Sums of a thousand terms; another shot before the end would be a hundredth of it.
        assert!(off.fold(0.0, f64::max) < 1e-12, "scale {scale}");
    }
}

/// A surface of one radiosity over the room at `frame`.
fn even(frame: Frame, radiosity: f64) -> VertexMesh {
    let mesh = Mesh::new(scenes::room(frame, 1.0, 1.0), f64::INFINITY).unwrap();
    let values = vec![Rgb::splat(radiosity); mesh.element_count()];
    VertexMesh::per_element(&mesh, &values)
}

#[test]
fn ply_files_have_doubles_where_floats_do_not_do() {
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
        write_ply(&path, &even(frame, radiosity)).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let header = String::from_utf8_lossy(&bytes[..600]).into_owned();
        assert!(header.contains(&format!("property {place}\n")), "{header}");
        assert!(header.contains(&format!("property {light}\n")), "{header}");
        // What 24 bits hold.
        let read = files::radiosity_of_ply(&path);
        assert!(read.iter().all(|b| (b / radiosity - 1.0).abs() < 1e-7), "{radiosity:e}");
    }
}

#[test]
fn exr_files_refuse_what_they_do_not_hold() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let image = |value: f64| {
        let mut pixels = vec![Rgb::ONE; 6];
        pixels[4] = Rgb::splat(value);
        RadianceImage { width: 3, height: 2, pixels }
    };
    write_exr(&path, &image(1e30)).unwrap();
    for value in [1e39, f64::INFINITY, f64::NAN] {
        let e = write_exr(&path, &image(value)).unwrap_err();
        assert_eq!(e.kind(), ErrorKind::File);
        assert!(e.to_string().contains("pixel 1, 1") && e.to_string().contains("3.4e38"), "{e}");
    }
}

#[test]
fn pictures_of_any_exitance_are_alike() {
    let [eye, target] = [[0.9, 0.2, 0.5], [0.2, 0.5, 0.4]].map(|p| HERE.place(p).into());
    let camera = Camera { eye, target, vertical_fov: 60.0 };
    let of = |radiosity: f64| {
        let image = camera.image(&even(HERE, radiosity), 16, 16, 1).unwrap();
        let tone = radiosity::ToneCurve::fit(&image.pixels);
        image.pixels.iter().map(|&c| tone.display(c)).collect::<Vec<_>>()
    };
    assert!(of(1.0).iter().any(|c| c[0] > 50));
    // The tone curve has no unit of light: the same but for rounding, which a byte hardly shows.
    for radiosity in [1e-30, 1e30] {
        let pairs = of(1.0).into_iter().zip(of(radiosity));
        assert!(pairs.into_iter().all(|(a, b)| (0..3).all(|k| a[k].abs_diff(b[k]) <= 1)));
    }
}

#[test]
fn polygons_far_out_are_cut_as_at_home() {
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
            let scene = load_obj(&path).unwrap();
            let area: f64 = (0..scene.triangles().len()).map(|t| scene.area(t)).sum();
            // Steps of 2e-10, some of them around an outline of 8.
            assert!((area / frame.scale.powi(2) - 3.0).abs() < 1e-8, "{frame:?} {first}: {area}");
            let up = scene.normal(0);
            assert!((0..scene.triangles().len()).all(|t| scene.normal(t).dot(up) > 0.99));
        }
    }
}
