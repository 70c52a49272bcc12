//! The proximity repair: what it mends, what it leaves alone, and what that is worth.

use radiosity::form_factor::closed_form::point_to_polygon;
use radiosity::form_factor::{ProximityCorrection, Row};
use radiosity::mesh::NodeId;
use radiosity::{FormFactors, Material, Mesh};

use crate::common::closed_forms::{exact, from_centroid};
use crate::common::cube;

fn dense(mesh: &Mesh, row: &Row) -> Vec<f64> {
    let mut factors = vec![0.0; mesh.element_count()];
    for entry in &row.entries {
        factors[entry.element as usize] = Row::form_factor(entry.share);
    }
    factors
}

/// Patches of four elements, in the walls of a cube.
fn patches(mesh: &Mesh) -> Vec<NodeId> {
    let parents = |t: usize| {
        let mut level = vec![mesh.root(t)];
        while mesh.elements_of(level[0]).len() > 4 {
            level = level.into_iter().flat_map(|n| mesh.children(n).unwrap()).collect();
        }
        level
    };
    (0..mesh.scene().triangles().len()).flat_map(parents).collect()
}

#[test]
fn near_entries_approach_area_averaged_factor() {
    let mesh = Mesh::new(cube(&Material::grey("g", 0.5)), 0.2).unwrap();
    let patches = patches(&mesh);
    let truth = exact().rows(&mesh, &patches, 1.0).unwrap();
    // Largest error of an entry against the closed form between areas, and mean share moved.
    let error = |reach: f64| {
        let mut repair = ProximityCorrection::new(from_centroid(), &mesh, reach);
        let rows = repair.rows(&mesh, &patches, 1.0).unwrap();
        let mut worst = 0.0f64;
        for ((row, right), &patch) in rows.iter().zip(&truth).zip(&patches) {
            row.check(&mesh, patch).unwrap();
            let pairs = dense(&mesh, row).into_iter().zip(dense(&mesh, right));
            worst = pairs.map(|(a, b)| (a - b).abs()).fold(worst, f64::max);
        }
        (worst, repair.mean_correction())
    };
    let ((raw, none), (mended, moved)) = (error(-1.0), error(1.0));
    println!("largest error {raw:.4} before, {mended:.4} after; {moved:.4} of a row moved");
    assert_eq!(none, 0.0);
    // Before, the patch is taken as a point; after, the element is, half its size. Where they touch
    // the error of that goes at least in proportion to the size: halved at least.
    assert!(raw > 0.01 && mended < raw / 2.0);
    // The repair moves about what the touching entries were off by, not the bulk of a row: elements
    // are coarse here, a wall has 16 patches.
    assert!(moved > 0.005 && moved < 0.1, "{moved}");
}

#[test]
fn corrected_entry_is_closed_form_from_receiver() {
    let mesh = Mesh::new(cube(&Material::grey("g", 0.5)), 0.2).unwrap();
    let patch = patches(&mesh)[0];
    let row = &ProximityCorrection::new(from_centroid(), &mesh, 0.0)
        .rows(&mesh, &[patch], 1.0)
        .unwrap()[0];
    let (mut touching, corners) = (0, mesh.corners(patch));
    for (e, factor) in dense(&mesh, row).into_iter().enumerate().filter(|f| f.1 > 0.0) {
        let node = mesh.element(e);
        if mesh.corners(node).iter().any(|p| corners.iter().any(|q| p.distance(*q) < 1e-12)) {
            let back = point_to_polygon(mesh.centroid(node), mesh.normal(node), &corners);
            let want = back * mesh.area(node) / mesh.area(patch);
            // Two roundings to a share of 2⁻³².
            assert!((factor - want).abs() < 1e-9, "element {e}: {factor} {want}");
            touching += 1;
        }
    }
    assert!(touching > 2, "{touching}");
}

#[test]
fn rows_out_of_reach_stay_unchanged() {
    let mesh = Mesh::new(cube(&Material::grey("g", 0.5)), 0.2).unwrap();
    let patches = patches(&mesh);
    let raw = from_centroid().rows(&mesh, &patches, 1.0).unwrap();
    let mut off = ProximityCorrection::new(from_centroid(), &mesh, -1.0);
    assert!(off.rows(&mesh, &patches, 1.0).unwrap() == raw);
    assert_eq!(off.preferred_batch_len(), from_centroid().preferred_batch_len());
    assert_eq!(off.inner().made as usize, patches.len());
    // A patch in the middle of a wall touches nothing but its own plane.
    let away = |p: &NodeId| {
        (mesh.centroid(*p) - 0.5).abs().to_array().iter().filter(|x| **x > 0.3).count() == 1
    };
    let middle: Vec<NodeId> = patches.iter().copied().filter(away).collect();
    assert!(!middle.is_empty());
    let mut touching = ProximityCorrection::new(from_centroid(), &mesh, 0.0);
    assert!(
        touching.rows(&mesh, &middle, 1.0).unwrap()
            == from_centroid().rows(&mesh, &middle, 1.0).unwrap()
    );
    assert_eq!(touching.mean_correction(), 0.0);
}
