//! How much vertices count in the error of the whole, by which they share rays.
//!
//! By n rays the squared error of a vertex is about σ²/n^1.5, and it counts with the area a around
//! it. Of a given number of rays in total, Σ a σ²/n^1.5 is least where the last ray of each vertex
//! lowers it by as much: a σ²/n^2.5 is the same for all, so that n ∝ (a σ²)^0.4.
//!
//! The area is that before elements are split. Those that are split have much of the error, as have
//! their parts, however small: a σ² stays about the same, and only a is known. By the areas of the
//! parts, the edge of a lamp's shadow had few rays and was split for their noise, without end.

use rayon::prelude::*;

use super::refinement_indicator::{ErrorScale, error_weight};
use super::refinement_settings::RefinementSettings;
use super::sampled_mesh::SampledMesh;

/// Number of rays ∝ weight^this.
pub(crate) const RAYS_BY_WEIGHT: f64 = 0.4;

/// The weight of each vertex: the area around it as it counts in the error of the whole, over one
/// by which the mean square error is what it would be if all had the number of rays of a weight of
/// 1. With a^0.4 rays each, Σ a/n^1.5 ∝ Σ a^0.4.
pub(super) fn vertex_weights(
    samples: &SampledMesh,
    scale: &ErrorScale,
    settings: &RefinementSettings,
) -> Vec<f64> {
    // A third of that of an element.
    let of_element = |e: usize| error_weight(samples, scale, settings, e) / 3.0;
    let elements = 0..samples.mesh.element_count();
    let of_elements: Vec<f64> = elements.into_par_iter().map(of_element).collect();
    let mut weights = vec![0.0; samples.reflected.len()];
    for (corners, area) in samples.corners().iter().zip(of_elements) {
        for &v in corners {
            weights[v as usize] += area;
        }
    }
    as_weights(&mut weights);
    weights
}

/// Divides `areas` by that of a weight of 1.
fn as_weights(areas: &mut [f64]) {
    let sum = areas.iter().sum::<f64>();
    let powers = areas.par_iter().map(|&area| libm::pow(area, RAYS_BY_WEIGHT)).sum::<f64>();
    let reference = libm::pow(sum / powers, 1.0 / (1.0 - RAYS_BY_WEIGHT));
    if reference > 0.0 {
        areas.iter_mut().for_each(|area| *area /= reference);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_change_no_mean_square_error() {
        let areas: Vec<f64> = (0..100).map(|k| f64::exp(f64::from(k * 37 % 100) / 20.0)).collect();
        let mut weights = areas.clone();
        as_weights(&mut weights);
        let rays = |weight: &f64| weight.powf(RAYS_BY_WEIGHT);
        let squares = areas.iter().zip(&weights).map(|(area, w)| area * rays(w).powf(-1.5));
        let sum = areas.iter().sum::<f64>();
        assert!((squares.sum::<f64>() / sum - 1.0).abs() < 1e-12);
        // By the Cauchy inequality for unequal areas; here 0.70.
        let mean = weights.iter().map(rays).sum::<f64>() / 100.0;
        println!("{mean} of the rays");
        assert!(mean < 0.8);
        let mut equal = [7.0; 5];
        as_weights(&mut equal);
        assert!(equal.iter().all(|weight| (weight - 1.0).abs() < 1e-12));
        let mut none = [0.0; 3];
        as_weights(&mut none);
        assert_eq!(none, [0.0; 3]);
    }
}
