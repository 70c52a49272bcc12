//! Estimated error of the light of a band.

use crate::mesh::Mesh;

/// Estimated error of the reflected radiosity of a band: shares of it, root mean squares over the
/// area that reflects in the band.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct BandError {
    /// The root of the sum of the squares of all parts.
    pub total: f64,
    /// Difference between two halves of the rays of a vertex.
    pub noise: f64,
    /// Upper bound of the omitted light of further bounces.
    pub remainder: f64,
    /// Estimated error of the bake in red, green and blue, mainly of its mesh, which is also that
    /// of the bands. It is one figure for the whole scene, so dark rooms may be further off, and it
    /// does not include light that only bands have.
    pub of_bake: f64,
}

impl BandError {
    pub(super) fn new(noise: f64, remainder: f64, of_bake: f64) -> BandError {
        let total = libm::hypot(libm::hypot(noise, remainder), of_bake);
        BandError { total, noise, remainder, of_bake }
    }
}

/// The root mean square of `noise` over that of `reflected`, by band: values of the vertices at the
/// `corners` of the elements of `mesh`, `count` bands side by side, weighted by area.
pub(super) fn relative_noise(
    mesh: &Mesh,
    corners: &[[u32; 3]],
    reflected: &[f64],
    noise: &[f64],
    count: usize,
) -> Vec<f64> {
    let mut sums = vec![(0.0, 0.0); count];
    for (e, corners) in corners.iter().enumerate() {
        let area = mesh.solid_area(mesh.element(e));
        for v in corners.map(|v| v as usize) {
            for (b, sum) in sums.iter_mut().enumerate() {
                sum.0 += area * noise[v * count + b].powi(2);
                sum.1 += area * reflected[v * count + b].powi(2);
            }
        }
    }
    sums.into_iter()
        .map(|(noise, all)| if all > 0.0 { (noise / all).sqrt() } else { 0.0 })
        .collect()
}
