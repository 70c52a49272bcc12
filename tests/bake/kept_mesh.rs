//! Light at the vertices of a scene that is kept as it is.

use std::f64::consts::PI;
use std::ops::ControlFlow;

use radiosity::glam::DVec3;
use radiosity::scene::Sides;
use radiosity::{Backend, BakeResult, BakeTarget, Rgb, Scene, SceneSettings, kept_mesh};

use crate::common::{keep_counting, keep_going};

/// A floor of 2 × 2 squares with a lamp of 1 × 1 above its middle, 1 high, radiance 1. The fifth
/// vertex is of no face; the last face is a wall that shares an edge with the floor.
const FLOOR: &str = "\
v -1 -1 0\nv 0 -1 0\nv 1 -1 0\nv -1 0 0\nv 7 7 7\nv 0 0 0\nv 1 0 0\nv -1 1 0\nv 0 1 0\nv 1 1 0\n\
v -0.5 -0.5 1\nv -0.5 0.5 1\nv 0.5 0.5 1\nv 0.5 -0.5 1\n\
usemtl grey\nf 1 2 6 4\nf 2 3 7 6\nf 4 6 9 8\nf 6 7 10 9\nusemtl lamp\nf 11 12 13 14\n";

fn scene(more: &str) -> Scene {
    let mut settings = SceneSettings::default();
    settings.sides = Sides::Front;
    let materials = "newmtl grey\nKd 0.5 0.5 0.5\nnewmtl lamp\nKd 0 0 0\nKe 1 1 1\n";
    let text = format!("mtllib m.mtl\n{FLOOR}{more}");
    settings.read("scene.obj", text.as_bytes(), &[("m.mtl", materials.as_bytes())]).unwrap()
}

fn kept(scene: Scene, error: f64) -> BakeResult {
    let target = BakeTarget::Error(kept_mesh::error_of_bake(error));
    let baked = target.bake(scene.clone(), &Backend::Cpu, keep_going).unwrap();
    baked.on_kept_mesh(scene, error, &Backend::Cpu, keep_counting).unwrap().unwrap()
}

/// Form factor from a point of the floor to the lamp: the sum over its corners of that to the
/// rectangle between the corner and the point above (Howell, Menguc, configuration B-4).
fn form_factor(p: DVec3) -> f64 {
    let corner = |a: f64, b: f64| {
        let (u, v) = ((1.0 + a * a).sqrt(), (1.0 + b * b).sqrt());
        (a / u * (b / u).atan() + b / v * (a / v).atan()) / (2.0 * PI)
    };
    let [x0, x1, y0, y1] = [-0.5 - p.x, 0.5 - p.x, -0.5 - p.y, 0.5 - p.y];
    corner(x1, y1) - corner(x0, y1) - corner(x1, y0) + corner(x0, y0)
}

#[test]
fn vertices_of_the_file_have_the_light_of_closed_forms() {
    let error = 0.01;
    let baked = kept(scene(""), error);
    let (surface, shared) = baked.light.at_positions();
    assert_eq!((surface.positions.len(), surface.faces.len(), shared), (14, 10, 0));
    assert_eq!(surface.positions[4], DVec3::splat(7.0));
    assert_eq!(surface.irradiance[4], Rgb::ZERO);
    assert!(baked.estimate.total <= error, "{:?}", baked.estimate);
    let mut squares = 0.0;
    let floor = [0, 1, 2, 3, 5, 6, 7, 8, 9];
    for v in floor {
        let truth = PI * form_factor(surface.positions[v]);
        let found = surface.irradiance[v];
        // It gathers a thousandth of a square inside of its face, where the light differs by no
        // more than twice that.
        let off = (found.x / truth - 1.0).abs();
        let stated = surface.error[v] / surface.radiosity[v].length();
        println!("{v}: {found} {truth}, off {off}, stated {stated}");
        assert!(off < 0.002 + 3.0 * stated, "{v}: {found} {truth} {stated}");
        assert_eq!(surface.normals[v], DVec3::Z);
        squares += off * off / floor.len() as f64;
    }
    assert!(squares.sqrt() < error, "{squares}");
    // The lamp has what it emits.
    assert!((surface.radiosity[10].x - PI).abs() < 1e-12);
}

#[test]
fn surfaces_that_meet_in_a_crease_have_light_of_their_own_but_for_the_order_of_the_file() {
    let wall = "v -1 1 1\nv 1 1 1\nusemtl grey\nf 8 9 10 16 15\n";
    let baked = kept(scene(wall), 0.05);
    let (surface, shared) = baked.light.at_positions();
    assert_eq!((surface.positions.len(), shared), (16, 3));
    // The mean of the floor's and the wall's, weighted by the area of their triangles.
    let (mesh, corners) = (&baked.light.mesh, &baked.light.corners);
    let (mut sum, mut area) = (0.0, 0.0);
    for (e, corners) in corners.iter().enumerate() {
        let node = mesh.element(e);
        for (p, &v) in mesh.scene().triangles()[e].corners.iter().zip(corners) {
            if *p == 8 {
                sum += mesh.area(node) * baked.light.surface.radiosity[v as usize].x;
                area += mesh.area(node);
            }
        }
    }
    assert!((surface.radiosity[8].x / (sum / area) - 1.0).abs() < 1e-12);
    let apart = baked.light.surface.positions.iter().filter(|&&p| p == DVec3::new(0., 1., 0.));
    assert_eq!(apart.count(), 2);
}

#[test]
fn stopped_vertices_give_nothing_and_stopped_paths_the_error_without_them() {
    let scene = scene("");
    let baked = BakeTarget::Error(0.1).bake(scene.clone(), &Backend::Cpu, keep_going).unwrap();
    let stop = |_, _| ControlFlow::Break(());
    assert!(baked.on_kept_mesh(scene.clone(), 0.05, &Backend::Cpu, stop).unwrap().is_none());
    // The nine vertices of the floor are done before the paths.
    let stop_paths = |_, of: usize| match of {
        9 => ControlFlow::Continue(()),
        _ => ControlFlow::Break(()),
    };
    let kept = baked.on_kept_mesh(scene, 0.05, &Backend::Cpu, stop_paths).unwrap().unwrap();
    assert_eq!(kept.estimate.sources, baked.estimate.total);
    assert!(kept.outcome.to_string().contains("it was stopped"), "{}", kept.outcome);
}
