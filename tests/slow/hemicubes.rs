//! Hemicubes of up to 1024 pixels against closed forms.

use glam::DVec3;
use radiosity::backend::gpu::HemicubeRows;
use radiosity::form_factor::closed_form::{point_to_polygon, polygon_to_polygon};
use radiosity::mesh::NodeId;
use radiosity::{Mesh, Rgb, Solver};

use crate::common::closed_forms::from_centroid;
use crate::common::hemicubes::{factor_to_group, hemicube_rows, outline_bound};
use crate::common::measures::mean_and_worst;
use crate::common::scenes::{grey, paint};
use crate::common::{cube, gpu, keep_going, quads};

/// Area-averaged factor between two unit squares from rows at every element; its error has two
/// causes, each with its own bound: pixels, against the closed form from the same points, and the
/// points, against the closed form from the whole area.
fn between_unit_squares(second: [[f64; 3]; 4], exact: f64, quadrature: f64, perimeter: f64) {
    let gpu = gpu();
    let first = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];
    let (p, q) = (first.map(DVec3::from_array), second.map(DVec3::from_array));
    assert!((polygon_to_polygon(&p, &q) - exact).abs() < 5e-9, "{}", polygon_to_polygon(&p, &q));
    let mesh = Mesh::new(quads(&[(first, grey()), (second, grey())]), 0.1).unwrap();
    let patches: Vec<NodeId> = [0, 1]
        .into_iter()
        .flat_map(|t| mesh.elements_of(mesh.root(t)))
        .map(|e| mesh.element(e))
        .collect();
    let point = |&n: &NodeId| point_to_polygon(mesh.centroid(n), mesh.normal(n), &q) * mesh.area(n);
    let at_points: f64 = patches.iter().map(point).sum();
    assert!((at_points - exact).abs() <= quadrature, "{at_points} {exact}");
    for n in [16, 64, 256, 1024] {
        let rows = hemicube_rows(&gpu, &mesh, n, &patches);
        let got: f64 = rows
            .iter()
            .zip(&patches)
            .map(|(r, &n)| factor_to_group(&mesh, r, 1) * mesh.area(n))
            .sum();
        let bound = outline_bound(n, perimeter, 12.0);
        println!(
            "n {n:4}: pixels {:+.2e} within {bound:.1e}, points {:+.2e}",
            got - at_points,
            at_points - exact
        );
        assert!((got - at_points).abs() <= bound, "n {n}: {got} {at_points} {bound}");
        assert!((got - exact).abs() <= bound + quadrature);
    }
}

#[test]
#[ignore = "slow"]
fn parallel_unit_squares_match_closed_form() {
    // Centroid rule: for a triangle of longest edge h, |error| ≤ h²/24·max|∇²F| or less; ∇²F of
    // the point factor is below 4 here, h = 0.0884: 1.3e-3. The outline on the hemicube is at most
    // the square's, 4 sides of 1 at distance 1, in units of half a face: 4 times 1, wherever the
    // point is; folded over the edge of the top face it gets no longer.
    let above = [[0., 0., 1.], [0., 1., 1.], [1., 1., 1.], [1., 0., 1.]];
    between_unit_squares(above, 0.199_824_895_698_387_46, 1.3e-3, 4.0);
}

#[test]
#[ignore = "slow"]
fn perpendicular_unit_squares_match_closed_form() {
    // Near the shared edge the point factor runs up to 1/2 like a function of (distance to edge)/
    // (length), so the centroid rule misses up to a share of the edge row's own area times its
    // factor's variation: 0.0625 · 1/2 · 1/4. The outline spans at most two faces: 8 half-faces.
    let wall = [[1., 0., 0.], [1., 0., 1.], [1., 1., 1.], [1., 1., 0.]];
    between_unit_squares(wall, 0.200_043_776_075_403_16, 7.9e-3, 8.0);
}

#[test]
#[ignore = "slow"]
fn white_furnace_conserves_energy() {
    let gpu = gpu();
    for (rho, answer) in [(0.5, 2.0), (0.99, 100.0)] {
        let mesh = Mesh::new(cube(&paint(rho, 1.0)), 0.2).unwrap();
        let settings = Solver { unshot: 1e-7, ..Default::default() };
        let mut hemicubes = HemicubeRows::new(&gpu, &mesh, 256).unwrap();
        let s = settings.solve(&mesh, &mut hemicubes, keep_going).unwrap();
        let (mean, worst) = mean_and_worst(&mesh, &s, Rgb::splat(answer));
        // Flux is conserved, so the mean is short by no more than the unshot share, which would
        // still bring 1/(1−ρ) times itself, relative to 1/(1−ρ).
        assert!((mean.x / answer - 1.0).abs() < 1e-6, "ρ {rho}: mean {mean}");
        // An element is off because patches shoot from their centroids (the proximity assumption
        // of Baum, Rushmeier, Winget 1989), which closed forms from the same centroids show too.
        // What is left is pixels: an element gets its light from 192 patches of 4 times its area,
        // with factors of 1/768: 67 pixels of 2e-5, up to 14·√67 of them crossed by the outline
        // and off by half at random: 4·√192·2e-5·√(115/12) = 0.34 % of its light; six of them.
        let twin = settings.solve(&mesh, &mut from_centroid(), keep_going).unwrap();
        let ratio = s.radiosity.iter().zip(&twin.radiosity).map(|(a, b)| (a.x / b.x - 1.0).abs());
        let pixels = ratio.fold(0.0, f64::max);
        println!("ρ {rho}: mean {}, worst element {worst:.1e}, by pixels {pixels:.1e}", mean.x);
        assert!(pixels < 0.02, "ρ {rho}: {pixels}");
    }
}
