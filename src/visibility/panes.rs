//! Transmittance of the panes of a scene along a segment that ends where light hits a surface.
//!
//! Panes have a separate bounding volume hierarchy, which is traversed once the end is known: rays
//! to surfaces do not hit panes, and a scene without panes has no such hierarchy.

use std::ops::Range;

use glam::DVec3;

use super::cut_outs::CutOuts;
use super::ray_scene::RayScene;
use crate::geometry::COINCIDENCE_TOLERANCE;
use crate::scene::{Rgb, Scene};

/// The panes of a scene, for rays.
#[derive(Debug)]
pub(crate) struct Panes {
    /// `None` in a scene without panes.
    rays: Option<RayScene>,
    /// Transmittance per channel of each of its triangles.
    transmittance: Vec<Rgb>,
}

impl Panes {
    /// The panes of `scene`.
    pub fn of_scene(scene: &Scene) -> Panes {
        let Some(panes) = scene.clear_panes() else {
            return Panes { rays: None, transmittance: vec![] };
        };
        let clear = |t: usize| Some((t, panes.transmittance(t)?));
        let (triangles, transmittance): (Vec<usize>, Vec<Rgb>) =
            (0..scene.triangles().len()).filter_map(clear).unzip();
        let rays = RayScene::new(triangles.iter().map(|&t| scene.corners(t)));
        let rays = rays.with_cut_outs(CutOuts::new(scene, triangles.into_iter()));
        Panes { rays: Some(rays), transmittance }
    }

    /// Whether the scene has no panes.
    pub fn is_none(&self) -> bool {
        self.rays.is_none()
    }

    /// The transmittance per channel of each pane, in the order of the scene's triangles.
    pub fn transmittances(&self) -> &[Rgb] {
        &self.transmittance
    }

    /// Transmittance per channel of all panes along `direction` (any length) from `from` within
    /// `reach` in units of it; 1 without panes. A pane right at the end does not count.
    #[inline]
    pub fn transmittance(&self, from: DVec3, direction: DVec3, reach: Range<f64>) -> Rgb {
        match &self.rays {
            None => Rgb::ONE,
            Some(rays) => self.passed(rays, from, direction, reach),
        }
    }

    fn passed(&self, rays: &RayScene, from: DVec3, direction: DVec3, reach: Range<f64>) -> Rgb {
        let (mut passed, mut seams) = (Rgb::ONE, vec![]);
        let reach = reach.start..reach.end * (1.0 - COINCIDENCE_TOLERANCE);
        rays.occluded(from, direction, reach, |hit| {
            let share = self.transmittance[hit.triangle];
            // The edge between two triangles, which both report: above the tolerance of the hits,
            // 1e-12.
            if hit.u.min(hit.v).min(1.0 - hit.u - hit.v) > 1e-11 {
                passed *= share;
            } else {
                seams.push((hit.distance, share));
            }
            false
        });
        for (k, &(distance, share)) in seams.iter().enumerate() {
            let same = |other: &(f64, Rgb)| {
                other.1 == share
                    && (other.0 - distance).abs() <= COINCIDENCE_TOLERANCE * distance.abs()
            };
            if !seams[..k].iter().any(same) {
                passed *= share;
            }
        }
        passed
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, Specular, Triangle};

    #[test]
    fn sides_between_two_triangles_count_once() {
        // A square of glass, above another at a different angle; the floor is out of the way.
        let transmittance = Rgb::new(0.5, 0.25, 0.75);
        let specular = Some(Specular::Glass { refractive_index: 1.5, transmittance });
        let glass = Material { specular, ..Material::grey("glass", 0.0) };
        let corner = |k: usize| {
            let angle = (k % 4) as f64 * std::f64::consts::FRAC_PI_2 + (k / 4) as f64 * 0.3;
            DVec3::new(angle.cos(), angle.sin(), (k / 4) as f64 + 1.0)
        };
        let positions = (0..8).map(corner).chain([1.0, 2.0, 3.0].map(|k| DVec3::splat(-k * k)));
        let positions: Vec<DVec3> = positions.chain([DVec3::new(-5.0, -3.0, -9.0)]).collect();
        let triangle = |corners, material| Triangle { corners, material, ..Default::default() };
        let corners = [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
        let mut triangles = corners.map(|corners| triangle(corners, 0)).to_vec();
        triangles.push(triangle([8, 9, 11], 1));
        let materials = vec![glass, Material::grey("floor", 0.5)];
        let scene = Scene::new(positions, triangles, vec!["all".into()], materials).unwrap();
        let (rays, panes) = (RayScene::of_scene(&scene), Panes::of_scene(&scene));
        for k in -9..10 {
            for turn in [0.0, 0.3, 0.7] {
                // Along the diagonals of both, and elsewhere.
                let across = DVec3::new(f64::cos(turn), f64::sin(turn), 0.0) * f64::from(k) / 20.0;
                for from in [across, across + DVec3::new(0.1, -0.2, 0.0)] {
                    let to = DVec3::new(across.x, across.y, 1.0) - from;
                    let passed = panes.transmittance(from, to, 0.0..3.0);
                    let off = (passed - transmittance * transmittance).abs().max_element();
                    assert!(off < 1e-15, "{k} {turn}: {passed}");
                    // The second begins at the end of this reach.
                    let passed = panes.transmittance(from, to, 0.0..2.0);
                    assert!((passed - transmittance).abs().max_element() < 1e-15);
                }
            }
        }
        assert_eq!(rays.closest_hit(DVec3::ZERO, DVec3::Z, 0.0, None), None);
    }
}
