//! What passes the panes of a scene along a segment that ends where light meets a surface.
//!
//! Panes have a hierarchy of boxes of their own, which is asked once the end is known: nothing that
//! looks for surfaces meets a pane, and a scene without panes has no such hierarchy.

use std::cell::{Cell, RefCell};
use std::ops::Range;

use glam::DVec3;

use super::offset;
use super::ray_scene::RayScene;
use crate::scene::{Rgb, Scene};

/// The panes of a scene, for rays.
#[derive(Debug)]
pub(crate) struct Panes {
    rays: RayScene,
    /// Share per channel that passes each of its triangles.
    transmittance: Vec<Rgb>,
}

/// Barycentric weights below this are on the side between two triangles, both of which rays meet
/// there: above the tolerance of the hits, [`super::ray_scene::BARYCENTRIC_TOLERANCE`].
const SEAM: f64 = 1e-11;

/// Of what is met on such sides, this share of the distance apart, is one place: rounding of the
/// distances is some 1e-15.
const SAME_PLACE: f64 = 1e-9;

impl Panes {
    /// Those of `scene`; none if it has none.
    pub fn of_scene(scene: &Scene) -> Option<Panes> {
        let panes = scene.clear_panes()?;
        let clear = |t: usize| Some((t, panes.transmittance(t)?));
        let (triangles, transmittance): (Vec<usize>, Vec<Rgb>) =
            (0..scene.triangles().len()).filter_map(clear).unzip();
        let rays = RayScene::new(triangles.into_iter().map(|t| scene.corners(t)));
        Some(Panes { rays, transmittance })
    }

    /// The share per channel of light along `direction` (any length) from `from` that passes all
    /// panes within `reach` in units of it. A pane right at its end does not count.
    pub fn transmittance(&self, from: DVec3, direction: DVec3, reach: Range<f64>) -> Rgb {
        let passed = Cell::new(Rgb::ONE);
        let seams: RefCell<Vec<(f64, Rgb)>> = RefCell::default();
        let reach = reach.start..reach.end * (1.0 - offset::SEGMENT_END);
        self.rays.occluded(from, direction, reach, |hit| {
            let share = self.transmittance[hit.triangle];
            if hit.u.min(hit.v).min(1.0 - hit.u - hit.v) > SEAM {
                passed.set(passed.get() * share);
            } else {
                seams.borrow_mut().push((hit.distance, share));
            }
            false
        });
        let (mut passed, seams) = (passed.get(), seams.into_inner());
        for (k, &(distance, share)) in seams.iter().enumerate() {
            let same = |other: &(f64, Rgb)| {
                other.1 == share && (other.0 - distance).abs() <= SAME_PLACE * distance.abs()
            };
            if !seams[..k].iter().any(same) {
                passed *= share;
            }
        }
        passed
    }
}
