//! Light that is gathered from textured surfaces, and the mesh that it is gathered on.

use glam::DVec3;
use radiosity::backend::cpu::RayGather;
use radiosity::backend::gpu::TracedGather;
use radiosity::gather::{GatherPoint, RefinementSettings, gather_at_vertices};
use radiosity::solver::Method;
use radiosity::{Backend, BakeTarget, Gather, GatheredMesh, Mesh, Rgb, Scene, Solver};

use crate::common::textured::{
    GREEN, RED, box_with_divided_floor, box_with_floor, box_with_halves, checkerboard, elements_of,
    tga,
};
use crate::common::{closed_forms, gpu, keep_going};

/// The light of elements of `scene`.
fn lit(scene: Scene) -> (Mesh, GatheredMesh) {
    let mesh = Mesh::new(scene, 0.2).unwrap();
    let solver = Solver { unshot: 1e-6, ..Solver::new(Method::GaussSeidel) };
    let solution = solver.solve(&mesh, &mut closed_forms::exact(), keep_going).unwrap();
    let light = GatheredMesh::from_elements(&mesh, &solution.radiosity).unwrap();
    (mesh, light)
}

/// Red and green halves of a wall: a texture's, and two materials.
fn halves() -> [Scene; 2] {
    let image = tga(2, &[RED, GREEN]);
    let textured = "newmtl wall\nKd 0.8\nmap_Kd a.tga";
    let plain = "newmtl red\nKd 0.8 0 0\nnewmtl green\nKd 0 0.8 0";
    [
        box_with_halves(["wall", "wall"], textured, &image),
        box_with_halves(["red", "green"], plain, &image),
    ]
}

/// Irradiance is continuous across the halves of a texture, and has a boundary between two
/// materials. So they differ a little there, and what they send with them; by rays that are the
/// same for both there is no other difference.
#[test]
fn gathered_irradiance_is_that_of_walls_of_those_colours() {
    let [textured, plain] = halves().map(|scene| {
        let (mesh, light) = lit(scene);
        let mut rays = RayGather::new(&mesh, 1 << 10).unwrap();
        let settings = RefinementSettings::new(1e9);
        gather_at_vertices(&light, &mesh, &settings, &mut rays, keep_going).unwrap()
    });
    let floor = elements_of(&textured.mesh, "floor");
    assert!(floor.len() > 100);
    let mut redness = 0.0f64;
    for e in floor {
        for (a, b) in textured.corners[e].iter().zip(plain.corners[e]) {
            let a = textured.surface.irradiance[*a as usize];
            let b = plain.surface.irradiance[b as usize];
            assert!(a.distance(b) < 0.01 * b.length(), "element {e}: {a} {b}");
            redness = redness.max(a.x / a.y);
        }
    }
    assert!(redness > 1.1, "it matters: {redness}");
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn rays_see_the_same_textures_on_a_device() {
    let (mesh, light) = lit(halves()[0].clone());
    let mut on_device = TracedGather::new(&gpu(), &mesh, 1 << 12).unwrap();
    let mut rays = RayGather::new(&mesh, 1 << 12).unwrap();
    let point = |x: f64, y: f64| GatherPoint {
        position: DVec3::new(x, y, 1e-4),
        normal: DVec3::Z,
        near: 1e-5,
    };
    let points: Vec<GatherPoint> =
        [[0.1, 0.2], [0.1, 0.8], [0.3, 0.5], [0.9, 0.1]].map(|[x, y]| point(x, y)).to_vec();
    let field = light.radiosity_field();
    let [a, b] =
        [on_device.gather(&field, &points).unwrap(), rays.gather(&field, &points).unwrap()];
    for (a, b) in a.iter().zip(&b) {
        // The same rays, but for those within rounding of an edge.
        let (a, b) = (a.irradiance, b.irradiance);
        assert!(a.distance(b) < 5e-3 * b.length(), "{a} {b}");
    }
    assert!(a[0].irradiance.x > 1.1 * a[1].irradiance.x, "it matters");
}

#[test]
fn textures_in_detail_do_not_split_elements() {
    let textured = box_with_floor("newmtl floor\nKd 0.8\nmap_Kd a.tga", &checkerboard(64));
    let mean = textured.materials().iter().find(|m| m.name == "floor").unwrap().reflectance.x;
    let even = box_with_floor(&format!("newmtl floor\nKd {mean}"), &[]);
    let [textured, even] = [textured, even].map(|scene| {
        let baked = BakeTarget::Error(0.05).bake(scene, &Backend::Cpu, keep_going).unwrap();
        let mesh = baked.light.mesh;
        [elements_of(&mesh, "floor").len(), mesh.element_count()]
    });
    for (a, b) in textured.into_iter().zip(even) {
        // A square is a sixteenth of the room, so light that bleeds differs next to the floor.
        assert!((a as f64 / b as f64 - 1.0).abs() < 0.1, "{textured:?} {even:?}");
    }
}

/// A black channel of a piece, from which nothing can be told of what arrives, does not darken the
/// light that vertices are given.
#[test]
fn black_pieces_lose_no_light() {
    let (mesh, light) = lit(halves()[0].clone());
    let (_, plain) = lit(box_with_halves(["wall", "wall"], "newmtl wall\nKd 0.4 0.4 0", &[]));
    for group in ["first", "second"] {
        for e in elements_of(&mesh, group) {
            let mean = |light: &GatheredMesh| -> Rgb {
                let irradiance = light.corners[e].map(|v| light.surface.irradiance[v as usize]);
                irradiance.iter().sum::<Rgb>() / 3.0
            };
            let (a, b) = (mean(&light), mean(&plain));
            // The light of both comes from a ceiling that is the same, and grey walls.
            assert!((a / b - 1.0).abs().truncate().max_element() < 0.1, "{a} {b}");
        }
    }
}

/// A wall that stands on a textured floor cuts it: each piece has its part of the texture.
#[test]
fn pieces_of_a_cut_floor_keep_the_texture() {
    let scene =
        box_with_divided_floor("newmtl floor\nKd 0.5\nmap_Kd a.tga", &tga(2, &[RED, GREEN]));
    let baked = BakeTarget::Error(0.1).bake(scene.clone(), &Backend::Cpu, keep_going).unwrap();
    let cut = baked.mesh.scene();
    assert!(cut.triangles().len() > scene.triangles().len());
    let mut seen = [0; 2];
    for t in (0..cut.triangles().len()).filter(|&t| cut.textures(t).is_some()) {
        for barycentric in [[0.2, 0.2], [0.6, 0.2], [0.2, 0.6]] {
            let [u, v] = barycentric;
            let [a, b, c] = cut.corners(t);
            let x = (a * (1.0 - u - v) + b * u + c * v).x;
            // Bilinear between the middles of two texels that repeat.
            if (0.3..0.45).contains(&x) || (0.8..0.95).contains(&x) {
                let reflectance = cut.reflectance_at(t, barycentric);
                let left = reflectance.x > reflectance.y;
                seen[usize::from(left)] += 1;
                assert_eq!(left, x < 0.5, "{x}: {reflectance}");
            }
        }
    }
    assert!(seen.iter().all(|&count| count > 0), "{seen:?}");
}
