//! Shot light as far as hemicubes resolve it.
//!
//! A pixel of a hemicube gives all its light to the one element at its centre. Elements that are
//! far smaller than a pixel's footprint, as those of a finely tessellated body, so get nothing from
//! most patches and far too much from one: their mean is right, single ones are off by a hundred
//! times. A vertex in a crevice sees a few of them only. So what vertices gather is averaged over
//! clusters of triangles of about the size of a footprint:
//!
//! ```text
//!   shot        ▁▁█▁▁▁▁█▁▁▁▁▁█▁        one value a triangle
//!   resolved    ▂▂▂▂▂▃▃▃▃▃▂▂▂▂▂        one value a cluster, the same flux
//! ```
//!
//! Triangles that are larger than a footprint keep their elements.

use crate::mesh::Mesh;
use crate::scene::Rgb;
use crate::vertex::irradiance;

/// The `radiosity` of the elements of `mesh`, W/m², with what is reflected averaged over clusters
/// of triangles up to an area of `size`² (scene unit): the same irradiance for all of them.
pub(super) fn resolved_light(mesh: &Mesh, radiosity: &[Rgb], size: f64) -> Vec<Rgb> {
    let mut resolved = radiosity.to_vec();
    let clusters = mesh.clusters();
    let mut open = clusters.roots().to_vec();
    while let Some(cluster) = open.pop() {
        let Some(parts) = clusters.parts(cluster) else { continue };
        if clusters.area(cluster) > size * size {
            open.extend(parts);
            continue;
        }
        let triangles = clusters.triangles(cluster);
        let elements = || triangles.iter().flat_map(|&t| mesh.elements_of(mesh.root(t as usize)));
        // Reflected flux, and what it would be for an irradiance of 1.
        let (mut flux, mut unit_flux) = (Rgb::ZERO, Rgb::ZERO);
        for e in elements() {
            let area = mesh.solid_area(mesh.element(e));
            flux += (radiosity[e] - mesh.exitance(e)) * area;
            unit_flux += mesh.albedo(e) * area;
        }
        let irradiance = irradiance(flux, unit_flux);
        for e in elements() {
            resolved[e] = mesh.exitance(e) + mesh.albedo(e) * irradiance;
        }
    }
    resolved
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DVec3;

    use super::*;
    use crate::scene::{Material, Scene, Triangle};

    /// A flat strip of `count` squares with edges of 1, and a square with an edge of 8 above it.
    fn strip(count: u32) -> Mesh {
        let mut positions: Vec<DVec3> = (0..2 * (count + 1))
            .map(|k| DVec3::new(f64::from(k / 2), f64::from(k % 2), 0.0))
            .collect();
        let first = positions.len() as u32;
        for [x, y] in [[0.0, 0.0], [8.0, 0.0], [8.0, 8.0], [0.0, 8.0]] {
            positions.push(DVec3::new(x, y, 9.0));
        }
        let mut corners = vec![[first, first + 1, first + 2], [first, first + 2, first + 3]];
        for k in (0..2 * count).step_by(2) {
            corners.extend([[k, k + 2, k + 3], [k, k + 3, k + 1]]);
        }
        let triangle = |corners| Triangle { corners, ..Default::default() };
        let triangles = corners.into_iter().map(triangle).collect();
        let materials = vec![Material { exitance: Rgb::X, ..Material::grey("grey", 0.5) }];
        let scene = Scene::new(positions, triangles, vec!["strip".into()], materials).unwrap();
        Mesh::new(Arc::new(scene), 100.0).unwrap()
    }

    #[test]
    fn small_triangles_share_their_light_and_large_ones_keep_it() {
        let mesh = strip(16);
        let radiosity: Vec<Rgb> =
            (0..mesh.element_count()).map(|e| Rgb::splat(e as f64 + 2.0)).collect();
        let resolved = resolved_light(&mesh, &radiosity, 2.0);
        // Triangles of an area of 32 are above 2²; those of 0.5 go together up to 4: eight of them.
        assert_eq!(resolved[..2], radiosity[..2]);
        let values: std::collections::BTreeSet<u64> =
            resolved[2..].iter().map(|b| b.y.to_bits()).collect();
        assert!((4..=8).contains(&values.len()), "{} clusters of 32 triangles", values.len());
        let flux = |values: &[Rgb]| {
            let areas = (0..values.len()).map(|e| mesh.area(mesh.element(e)));
            values.iter().zip(areas).map(|(&b, area)| b * area).sum::<Rgb>()
        };
        // The same flux, but for rounding of 34 terms.
        assert!(flux(&resolved).abs_diff_eq(flux(&radiosity), 1e-12 * flux(&radiosity).x));
    }

    #[test]
    fn what_is_emitted_stays() {
        let mesh = strip(4);
        let emitted: Vec<Rgb> = (0..mesh.element_count()).map(|e| mesh.exitance(e)).collect();
        assert_eq!(resolved_light(&mesh, &emitted, 100.0), emitted);
    }
}
