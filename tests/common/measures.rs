//! Sums over elements of a solution.

use radiosity::{Mesh, Rgb, Solution};

/// Area-weighted mean radiosity, and the largest relative deviation of an element from `exact`.
pub fn mean_and_worst(mesh: &Mesh, s: &Solution, exact: Rgb) -> (Rgb, f64) {
    let area = |e: usize| mesh.area(mesh.element(e));
    let flux: Rgb = s.radiosity.iter().zip(0..).map(|(&b, e)| b * area(e)).sum();
    let total: f64 = (0..mesh.element_count()).map(area).sum();
    let off = |b: &Rgb| ((*b - exact) / exact).abs().max_element();
    (flux / total, s.radiosity.iter().map(off).fold(0.0, f64::max))
}

/// The same to the last bit, in all that is told of light.
pub fn assert_same_bits(a: &Solution, b: &Solution) {
    assert!(a.radiosity == b.radiosity && a.ledger == b.ledger, "{}", a.method);
    assert_eq!((a.steps, a.shots, a.stop), (b.steps, b.shots, b.stop), "{}", a.method);
}
