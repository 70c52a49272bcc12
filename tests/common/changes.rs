//! Changes of a solved scene, and how far apart two solutions are.

use glam::{DAffine3, DVec3};
use radiosity::backend::cpu::RayRows;
use radiosity::solver::Method;
use radiosity::{Material, Mesh, Rgb, Solution, Solver};

/// Rays, as many for each row whatever light it carries: equal equations, however they are solved.
pub fn same_rays(mesh: &Mesh) -> RayRows {
    RayRows::new(mesh, 1024).unwrap().with_full_share(0.0)
}

/// `method`, shooting by elements.
pub fn by_elements(method: Method) -> Solver {
    Solver { patch_tolerance: 0.0, ..Solver::new(method) }
}

/// `mesh` with what `change` makes of its materials.
pub fn painted(mesh: &Mesh, change: impl Fn(&mut Material)) -> Mesh {
    let mut materials = mesh.scene().materials().to_vec();
    materials.iter_mut().for_each(change);
    mesh.with_scene(mesh.scene().with_materials(materials).unwrap()).unwrap()
}

/// `mesh` with all of `group` moved by a vector.
pub fn shifted(mesh: &Mesh, group: &str, by: [f64; 3]) -> Mesh {
    let by = DAffine3::from_translation(DVec3::from_array(by));
    mesh.with_scene(mesh.scene().with_transformed_group(group, by).unwrap()).unwrap()
}

/// Sum over elements of the differences of flux, as a share of what is emitted: the worst channel.
pub fn flux_difference(mesh: &Mesh, s: &Solution, judge: &Solution) -> f64 {
    let area = |e: usize| mesh.area(mesh.element(e));
    let flux = |e: usize| (s.radiosity[e] - judge.radiosity[e]).abs() * area(e);
    let sum: Rgb = (0..mesh.element_count()).map(flux).sum();
    (sum / judge.ledger.emitted).max_element()
}

/// The energy of `s` balances.
pub fn assert_balanced(s: &Solution) {
    assert!(s.ledger.imbalance() <= 1e-9, "{:e}", s.ledger.imbalance());
    assert!(s.radiosity.iter().all(|b| b.is_finite()));
}
