//! The visibility repair: what it finds behind a plate, and what it spends where there is none.

use radiosity::form_factor::closed_form::polygon_to_polygon;
use radiosity::form_factor::{AdaptiveViewpoints, Entry, ProximityCorrection, Row};
use radiosity::mesh::NodeId;
use radiosity::{Error, ErrorKind, FormFactors, Material, Mesh, RayRows};

use crate::common::closed_forms::{ClosedForms, from_centroid};
use crate::common::{cube, quads};

/// Where the plate stands: the patch's centroid is at x = 2/3, behind it.
const PLATE: f64 = 0.7;

/// A unit square on the floor, a plate that stands on it at x = 0.7, and a wall at x = 1.5 that no
/// point of the floor before the plate sees, since the plate reaches beyond all lines to the wall.
/// The patch is the floor's first triangle, (0, 0), (1, 0), (1, 1), five levels over elements.
fn screened() -> (Mesh, NodeId) {
    let floor = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];
    let plate = [[PLATE, -1.1, 0.], [PLATE, -1.1, 2.1], [PLATE, 2.1, 2.1], [PLATE, 2.1, 0.]];
    let wall = [[1.5, -1., 0.], [1.5, -1., 2.], [1.5, 2., 2.], [1.5, 2., 0.]];
    let scene = quads(&[floor, plate, wall].map(|q| (q, Material::grey("g", 0.5))));
    let mesh = Mesh::new(scene, 2f64.sqrt() / 32.0).unwrap();
    let patch = mesh.root(0);
    assert_eq!(mesh.elements_of(patch).len(), 4usize.pow(5));
    (mesh, patch)
}

fn rays(mesh: &Mesh) -> ProximityCorrection<RayRows> {
    ProximityCorrection::new(RayRows::new(mesh, 1024).unwrap(), mesh, -1.0)
}

/// Form factor to the wall, the last group.
fn to_wall(mesh: &Mesh, row: &Row) -> f64 {
    let on_wall = |e: &&Entry| mesh.triangle(mesh.element(e.element as usize)) >= 4;
    row.entries.iter().filter(on_wall).map(|e| Row::form_factor(e.share)).sum()
}

#[test]
fn patch_behind_plate_is_seen_from_both_sides() {
    let (mesh, patch) = screened();
    let corners = |q: [[f64; 3]; 4]| q.map(glam::DVec3::from_array);
    let before = corners([[PLATE, 0., 0.], [1., 0., 0.], [1., 1., 0.], [PLATE, PLATE, 0.]]);
    let wall = corners([[1.5, -1., 0.], [1.5, -1., 2.], [1.5, 2., 2.], [1.5, 2., 0.]]);
    let lit = 1.0 - PLATE * PLATE;
    let exact = lit * polygon_to_polygon(&before, &wall);
    let see = |levels: u32| {
        let mut rows = AdaptiveViewpoints::new(rays(&mesh), 0.02, levels);
        let row = rows.rows(&mesh, &[patch], 1.0).unwrap().remove(0);
        row.check(&mesh, patch).unwrap();
        (to_wall(&mesh, &row), rows.extra_rows())
    };
    assert_eq!(see(0), (0.0, 0), "the centroid sees nothing of the wall");
    for levels in [4, 5] {
        let (got, extra) = see(levels);
        // Cells of side h = 2⁻ᴸ that the plate cuts are all in one column, at most 2·0.7/h + 1 of
        // them with h² of the patch each. Of a cell, the lit part is taken for all or nothing: off
        // by at most 2/3, since the centroid is a third into it, and half as much again in its
        // factor to the wall, 0.5 at the most, there. Rays: 1024 stratified ones a cell over some
        // 100 lit cells, below 0.4/√10⁵ = 0.002 (as if independent); parts not gone down into are
        // off by the tolerance at the most, and curve to both sides.
        let h = 0.5f64.powi(levels as i32);
        let bound = (2.0 * PLATE / h + 1.0) * h * h * (2.0 / 3.0) * 0.5 + 0.002;
        println!("levels {levels}: {got:.4} of {exact:.4} within {bound:.4}, {extra} rows more");
        assert!((got - exact).abs() < bound && bound < exact / 3.0);
        // All parts would be 4ᴸ − 1 more; only those about the plate are worth it: in each level
        // two columns of cells at the most.
        assert!(extra > 30 && extra < 4u64.pow(levels) - 1, "{extra}");
    }
}

#[test]
fn rows_are_independent_of_batching() {
    let (mesh, patch) = screened();
    let patches: Vec<NodeId> =
        mesh.children(patch).unwrap().into_iter().chain([mesh.element(0), mesh.root(3)]).collect();
    let make = || AdaptiveViewpoints::new(rays(&mesh), 0.02, 3);
    let all = make().rows(&mesh, &patches, 1.0).unwrap();
    assert_eq!(all.len(), patches.len());
    assert!(make().rows(&mesh, &patches, 1.0).unwrap() == all);
    let mut one = make();
    for (row, &patch) in all.iter().zip(&patches) {
        row.check(&mesh, patch).unwrap();
        assert!(one.rows(&mesh, &[patch], 1.0).unwrap()[0] == *row);
    }
    // An element has no parts: its row is the maker's own.
    assert!(rays(&mesh).rows(&mesh, &[mesh.element(0)], 1.0).unwrap()[0] == all[4]);
}

#[test]
fn each_part_is_corrected_by_itself() {
    // Near walls and four elements a patch; closed forms, so that nothing turns with a node's id.
    let mesh = Mesh::new(cube(&Material::grey("g", 0.5)), 0.4).unwrap();
    let near = || ProximityCorrection::new(from_centroid(), &mesh, 1.0);
    let mut rows = AdaptiveViewpoints::new(near(), 0.0, 1);
    let mut patches = 0;
    for (patch, parts) in
        (0..12).flat_map(|t| mesh.children(mesh.root(t)).unwrap()).filter_map(|p| {
            let parts = mesh.children(p)?;
            mesh.children(parts[0]).is_none().then_some((p, parts))
        })
    {
        let row = rows.rows(&mesh, &[patch], 1.0).unwrap().remove(0);
        row.check(&mesh, patch).unwrap();
        let mut mean = vec![0.0; mesh.element_count()];
        for part in near().rows(&mesh, &parts, 1.0).unwrap() {
            for e in &part.entries {
                mean[e.element as usize] += f64::from(e.share) / 4.0;
            }
        }
        row.entries.iter().for_each(|e| mean[e.element as usize] -= f64::from(e.share));
        // Less than a unit for the mean's rounding; closed forms from the patch's centroid and from
        // its middle child's, some ulp apart, round to shares by a unit differently; the repair
        // takes the rounded by a ratio that stays below 10.
        let worst = mean.iter().fold(0.0, |w: f64, d| w.max(d.abs()));
        assert!(worst < 12.0, "{worst}");
        patches += 1;
    }
    assert_eq!(rows.extra_rows(), 3 * patches);
    assert_eq!(rows.inner().inner().made, 4 * patches);
}

#[test]
fn open_patches_cost_one_comparison() {
    // Two unit squares, one apart. Patches of 16 elements have corners within r = 0.17 of their
    // centroid. What the mean of their parts' views differs by is of second order: the factor's
    // curvature, at most about 4 over the distance squared, times r²/2 for the corner parts' own
    // centroids at r/2: below 4 · (0.085)² / 2 = 0.015.
    let floor = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];
    let above = [[0., 0., 1.], [0., 1., 1.], [1., 1., 1.], [1., 0., 1.]];
    let scene = quads(&[floor, above].map(|q| (q, Material::grey("g", 0.5))));
    let mesh = Mesh::new(scene, 0.1).unwrap();
    let down = |n: NodeId| mesh.children(n).unwrap();
    let patches: Vec<NodeId> = (0..4).flat_map(|t| down(mesh.root(t))).flat_map(down).collect();
    assert_eq!(mesh.elements_of(patches[0]).len(), 16);
    let spent = |tolerance: f64, levels: u32| {
        let near = ProximityCorrection::new(from_centroid(), &mesh, 1.0);
        let mut rows = AdaptiveViewpoints::new(near, tolerance, levels);
        rows.rows(&mesh, &patches, 1.0).unwrap();
        assert_eq!(rows.inner().inner().made, rows.extra_rows() + patches.len() as u64);
        rows.extra_rows()
    };
    let count = patches.len() as u64;
    assert_eq!(spent(0.015, u32::MAX), 3 * count);
    // And all of it where any difference is too much.
    assert_eq!(spent(-1.0, u32::MAX), 15 * count);
    assert_eq!(spent(-1.0, 1), 3 * count);
    assert_eq!(spent(-1.0, 0), 0);
}

#[test]
fn rejects_missing_rows_by_name() {
    struct Short(ClosedForms);
    impl FormFactors for Short {
        fn rows(
            &mut self,
            mesh: &Mesh,
            patches: &[NodeId],
            weight: f64,
        ) -> Result<Vec<Row>, Error> {
            self.0.rows(mesh, &patches[1..], weight)
        }
    }
    let mesh = Mesh::new(cube(&Material::grey("g", 0.5)), 1.0).unwrap();
    let near = ProximityCorrection::new(Short(from_centroid()), &mesh, 1.0);
    let error =
        AdaptiveViewpoints::new(near, 0.02, 1).rows(&mesh, &[mesh.root(0)], 1.0).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::FormFactor);
    assert!(error.to_string().contains("3 rows for 4 patches"), "{error}");
}
