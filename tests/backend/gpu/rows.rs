//! Rows from hemicubes: against closed forms, against rays, and against themselves.

use std::f64::consts::PI;

use glam::DVec3;
use radiosity::backend::cpu::RayRows;
use radiosity::backend::gpu::HemicubeRows;
use radiosity::form_factor::Row;
use radiosity::form_factor::closed_form::point_to_polygon;
use radiosity::mesh::NodeId;
use radiosity::{ErrorKind, FormFactors, Gpu, Mesh};

use crate::common::hemicubes::{factor_to_group, hemicube_rows, largest_pixel, outline_bound};
use crate::common::scenes::grey;
use crate::common::{cornell_box, cube, gpu, quads};

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn square_on_axis_matches_closed_form() {
    let gpu = gpu();
    // A speck at the origin looks at a square of side 0.5 at distance 1 (Howell, B-3, four times).
    let speck = [[-1e-3, -1e-3, 0.], [1e-3, -1e-3, 0.], [0., 2e-3, 0.], [-1e-3, 0., 0.]];
    let square = [[-0.25, -0.25, 1.], [-0.25, 0.25, 1.], [0.25, 0.25, 1.], [0.25, -0.25, 1.]];
    let mesh = Mesh::new(quads(&[(speck, grey()), (square, grey())]), f64::INFINITY).unwrap();
    let r = (1.0f64 + 0.25 * 0.25).sqrt();
    let exact = 4.0 / PI * (0.25 / r) * (0.25 / r).atan();
    let corners = square.map(DVec3::from_array);
    assert!((point_to_polygon(DVec3::ZERO, DVec3::Z, &corners) - exact).abs() < 1e-14);
    for n in [16, 32, 64, 128, 256, 512, 1024] {
        let row = &hemicube_rows(&gpu, &mesh, n, &[mesh.element(0)])[0];
        let got = factor_to_group(&mesh, row, 1);
        // The centroid of the speck's first triangle is 7e-4 off the axis: a shift of the order
        // of its square; the outline is 4 sides of 0.5.
        let bound = outline_bound(n, 2.0, 4.0) + 1e-6;
        println!("n {n:4}: error {:+.2e}, bound {bound:.1e}", got - exact);
        assert!((got - exact).abs() <= bound, "n {n}: {got} {exact} {bound}");
        assert_eq!(row.backface, 0);
    }
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn closed_cube_has_no_gaps() {
    let gpu = gpu();
    let mesh = Mesh::new(cube(&grey()), 0.3).unwrap();
    let patches: Vec<NodeId> = (0..mesh.element_count()).map(|e| mesh.element(e)).collect();
    for (row, &p) in hemicube_rows(&gpu, &mesh, 64, &patches).iter().zip(&patches) {
        // Pixels look along directions of at least 1/64 above the horizon: no gap at the edges.
        assert_eq!((row.escaped, row.backface), (0, 0));
        assert_eq!(row.closure(), 1.0);
        let own = mesh.scene().triangles()[mesh.triangle(p)].group;
        assert_eq!(factor_to_group(&mesh, row, own), 0.0, "a flat wall does not see itself");
    }
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn culling_leaves_no_holes() {
    let gpu = gpu();
    // A closed cube of 1 536 triangles, of which each face of a hemicube draws only a part: one
    // triangle left out in error would be a hole.
    let cube = cube(&grey());
    let mut tiles = vec![];
    for wall in (0..cube.triangles().len()).step_by(2) {
        let [a, b, c] = cube.corners(wall);
        let at = |u: u32, v: u32| a + (b - a) * f64::from(u) / 16. + (c - b) * f64::from(v) / 16.;
        for (u, v) in (0..256).map(|k| (k % 16, k / 16)) {
            let corners = [at(u, v), at(u + 1, v), at(u + 1, v + 1), at(u, v + 1)];
            tiles.push((corners.map(|p| p.to_array()), grey()));
        }
    }
    let mesh = Mesh::new(quads(&tiles), f64::INFINITY).unwrap();
    let patches: Vec<NodeId> =
        (0..mesh.element_count()).step_by(31).map(|e| mesh.element(e)).collect();
    for (row, &p) in hemicube_rows(&gpu, &mesh, 64, &patches).iter().zip(&patches) {
        assert_eq!((row.escaped, row.backface), (0, 0), "from {}", mesh.centroid(p));
    }
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn back_faces_block_and_are_counted() {
    let gpu = gpu();
    let floor = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];
    // A screen that shows its back to the floor, close over it, and hides the lid.
    let screen = [[-9., -9., 0.1], [9., -9., 0.1], [9., 9., 0.1], [-9., 9., 0.1]];
    let lid = [[0., 0., 1.], [0., 1., 1.], [1., 1., 1.], [1., 0., 1.]];
    let mesh = Mesh::new(quads(&[(floor, grey()), (screen, grey()), (lid, grey())]), 0.5).unwrap();
    let patches: Vec<NodeId> = mesh.elements_of(mesh.root(0)).map(|e| mesh.element(e)).collect();
    for row in hemicube_rows(&gpu, &mesh, 64, &patches) {
        assert_eq!(row.entries, []);
        // At least 8 to each side at height 0.1: all but 0.5·(1 − 8/√(64.01))·4 ≈ 3e-4 is covered.
        assert!(Row::form_factor(row.backface) > 1.0 - 4e-4, "{}", Row::form_factor(row.backface));
    }
}

/// GPU and CPU rows of the same patches differ by no more than both their sampling errors.
fn agree(size: f64, n: u32, rays: u32, count: usize) {
    let gpu = gpu();
    let mesh = cornell_box(size);
    let all = mesh.element_count();
    let patches: Vec<NodeId> = (0..count).map(|k| mesh.element(k * 7919 % all)).collect();
    let gpu_rows = hemicube_rows(&gpu, &mesh, n, &patches);
    let cpu_rows = RayRows::new(&mesh, rays).unwrap().rows(&mesh, &patches, 1.0).unwrap();
    let (pixel, mut worst) = (largest_pixel(n), 0.0f64);
    for (a, b) in gpu_rows.iter().zip(&cpu_rows) {
        let dense = |row: &Row| {
            let mut shares = vec![0; all];
            row.entries.iter().for_each(|e| shares[e.element as usize] = e.share);
            shares.extend([row.escaped, row.backface]);
            shares.into_iter().map(Row::form_factor).collect::<Vec<f64>>()
        };
        for (e, (f, g)) in dense(a).into_iter().zip(dense(b)).enumerate() {
            let seen = f.max(g);
            // Rays: a count of independent hits, variance F(1 − F)/rays. Pixels: those on the
            // outline, each uniform within half its weight either way, variance pixel²/12. A
            // region of p pixels has an outline of at most 7√p pixels crossed if it is compact
            // (a right triangle's is 6.8√p); foreshortened elements are longer: twice that.
            let crossed = 14.0 * (seen / pixel).sqrt() + 6.0;
            let variance = seen * (1.0 - seen) / f64::from(rays) + crossed * pixel * pixel / 12.0;
            // Six standard errors, since there are 10⁵ entries, and what Poisson counts of a few
            // rays add to a Gaussian tail.
            let bound = 6.0 * variance.sqrt() + 8.0 / f64::from(rays);
            worst = worst.max((f - g).abs() / bound);
            assert!((f - g).abs() <= bound, "entry {e}: GPU {f}, CPU {g}, bound {bound}");
        }
    }
    println!("worst difference {worst:.2} of its bound");
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn hemicubes_agree_with_rays_element_by_element() {
    agree(60.0, 256, 1 << 16, 24);
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn hemicubes_agree_with_rays_triangle_by_triangle() {
    agree(f64::INFINITY, 512, 1 << 18, 32);
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn rows_are_independent_of_batching() {
    let gpu = gpu();
    let mesh = cornell_box(100.0);
    let patches: Vec<NodeId> =
        (0..70).map(|k| mesh.element(k * 13 % mesh.element_count())).collect();
    let mut maker = HemicubeRows::new(&gpu, &mesh, 64).unwrap();
    let together = maker.rows(&mesh, &patches, 1.0).unwrap();
    for (row, &p) in together.iter().zip(&patches) {
        assert!(&maker.rows(&mesh, &[p], 1.0).unwrap()[0] == row, "{p:?}");
    }
    // One for each row, twice.
    assert_eq!(maker.drawn(), 2 * patches.len() as u64);
    assert!(
        HemicubeRows::new(&gpu, &mesh, 64).unwrap().rows(&mesh, &patches, 1.0).unwrap() == together
    );
    assert_eq!(maker.rows(&mesh, &[], 1.0).unwrap(), []);
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn far_scene_has_the_same_rows() {
    let gpu = gpu();
    // Moved by a thousand of its sizes, in steps that 64-bit coordinates hold exactly: the device
    // works about a local origin and sees the very same numbers.
    let near = cornell_box(200.0);
    let moved: Vec<DVec3> =
        near.scene().positions().iter().map(|&p| p + DVec3::splat(f64::from(1 << 19))).collect();
    let s = near.scene();
    let (triangles, groups, materials) =
        (s.triangles().to_vec(), s.groups().to_vec(), s.materials().to_vec());
    let far = radiosity::Scene::new(moved, triangles, groups, materials).unwrap();
    let far = Mesh::new(far, 200.0).unwrap();
    let patches: Vec<NodeId> = (0..40).map(|e| near.element(e * 5)).collect();
    let (a, b) =
        (hemicube_rows(&gpu, &near, 64, &patches), hemicube_rows(&gpu, &far, 64, &patches));
    for (a, b) in a.iter().zip(&b) {
        let total = |row: &Row| row.entries.iter().map(|e| u64::from(e.share)).sum::<u64>();
        // Positions round at 2^19 by 2^-34: a pixel on a border may flip, no more than a few.
        let pixels = 8.0 * largest_pixel(64);
        assert!((total(a) as f64 - total(b) as f64).abs() <= pixels * f64::from(Row::TOTAL));
    }
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn rejects_bad_resolutions_and_adapters() {
    let gpu = gpu();
    let mesh = cornell_box(200.0);
    for n in [0, 7, 100_000] {
        let e = HemicubeRows::new(&gpu, &mesh, n).unwrap_err();
        assert_eq!(e.kind(), ErrorKind::Setting);
        assert!(e.to_string().contains(&n.to_string()), "{e}");
    }
    let e = Gpu::new(Some("no such adapter")).unwrap_err();
    assert_eq!(e.kind(), ErrorKind::Device);
    assert!(e.to_string().contains(&gpu.adapter().name), "lists what there is: {e}");
}
