//! Rows of hemicubes, and how far off pixels may be.

use std::f64::consts::PI;

use radiosity::backend::gpu::HemicubeRows;
use radiosity::form_factor::Row;
use radiosity::mesh::NodeId;
use radiosity::{FormFactors, Gpu, Mesh};

/// Largest delta form factor of a hemicube of resolution `n`: the middle of the top face.
pub fn largest_pixel(n: u32) -> f64 {
    4.0 / (PI * f64::from(n).powi(2))
}

/// Bound on the error of a form factor to a polygon seen within the top face (or one side face),
/// when its outline there is `perimeter` long in units of half the face's width.
///
/// A pixel is counted by its centre. Wrong are only the pixels that the outline crosses, each by
/// at most half its weight (a straight line leaves the side of the centre at least half the pixel).
/// A line of `l` pixels crosses at most √2 l + 2 of them.
pub fn outline_bound(n: u32, perimeter: f64, corners: f64) -> f64 {
    let pixels = 2f64.sqrt() * perimeter * f64::from(n) / 2.0 + 2.0 * corners;
    0.5 * largest_pixel(n) * pixels
}

/// Rows of `patches` at resolution `n`, checked.
pub fn hemicube_rows(gpu: &Gpu, mesh: &Mesh, n: u32, patches: &[NodeId]) -> Vec<Row> {
    let rows = HemicubeRows::new(gpu, mesh, n).unwrap().rows(mesh, patches, 1.0).unwrap();
    rows.iter().zip(patches).for_each(|(row, &p)| row.check(mesh, p).unwrap());
    rows
}

/// Form factor to all elements of one group.
pub fn factor_to_group(mesh: &Mesh, row: &Row, group: u32) -> f64 {
    let of = |e: u32| mesh.scene().triangles()[mesh.triangle(mesh.element(e as usize))].group;
    let seen = row.entries.iter().filter(|e| of(e.element) == group);
    seen.map(|e| Row::form_factor(e.share)).sum()
}
