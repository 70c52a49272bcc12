//! Automatic choice of a camera for a scene that has none.
//!
//! ```text
//!   up axis ──► outside: directions around the scene, from the distance at which it fits
//!           └─► inside:  points of the scene's box, at mid-height of their room
//!                          └─► scored coarsely ──► the best in all directions ──► best score
//! ```
//!
//! Views from inside and outside compete by their score ([`ViewScorer`]): from outside, a room
//! shows only the backs of its walls, and from within, an object shows only itself. Everything is
//! deterministic.

use std::f64::consts::TAU;

use glam::DVec3;
use rayon::prelude::*;

use super::Camera;
use super::up_axis::up_axis;
use super::view_score::{Face, ViewScorer, faces};
use crate::gather::GatheredMesh;
use crate::geometry::aabb::Aabb;
use crate::sampling::low_discrepancy::{r2_point, radical_inverse};
use crate::scene::Scene;

/// Vertical field of view from outside and from inside, degrees. Plain choice: rooms need a wide
/// one.
const OUTSIDE_FOV: f64 = 40.0;
const INSIDE_FOV: f64 = 70.0;

/// Elevations above the horizon of views from outside, degrees, and factors of their scores. Plain
/// choice.
const ELEVATIONS: [(f64, f64); 5] =
    [(0.0, 0.98), (10.0, 0.95), (25.0, 1.0), (40.0, 0.95), (-25.0, 0.5)];

/// Angles below the horizon of views from inside, degrees. Plain choice.
const PITCHES: [f64; 2] = [0.0, 12.0];

/// Number of directions around the vertical axis, for the final and for the coarse scores of points
/// inside. Plain choice.
const AZIMUTHS: u32 = 16;
const COARSE_AZIMUTHS: u32 = 8;

/// Number of points inside that are scored coarsely, and in all directions. Plain choice.
const INSIDE_POINTS: usize = 256;
const BEST_POINTS: usize = 24;

/// Rays along a side of the picture for coarse and for final scores. Plain choice.
const COARSE_RAYS: usize = 8;
const RAYS: usize = 20;

/// Margin around a scene seen from outside, as a fraction of the picture. Plain choice.
const MARGIN: f64 = 0.04;

/// Height of an eye as a fraction of that between floor and ceiling. Plain choice: a standing
/// person.
const EYE_HEIGHT: f64 = 0.55;

/// Least fraction of directions in which an eye inside sees fronts, and number of directions
/// tested. Plain choice: a room may lack a wall, 1/6 of all directions; a street is not a room.
const ENCLOSURE: f64 = 0.75;
const ENCLOSURE_RAYS: usize = 64;

/// Distances that an eye inside is moved back, as fractions of the free distance behind it. Plain
/// choice: 0.85 is nearly at the wall.
const STEPS_BACK: [f64; 2] = [0.0, 0.85];

/// Fraction of the vertices along each horizontal axis that may be outliers on either side; largest
/// core without them, as a fraction of the scene's diagonal; least height of the core, as a
/// fraction of the scene's. Plain choice: objects on a large ground have a core, furniture in a
/// room has none.
const OUTLYING_SHARE: f64 = 0.02;
const CORE_SIZE: f64 = 0.6;
const CORE_HEIGHT: f64 = 0.8;

/// Fraction of the reflected light that may lie outside the lit box, at either end of an axis;
/// least ratio of the diagonals of the scene and of that box for the box to be framed instead.
/// Plain choice: in an ordinary room the light fills the room.
const UNLIT_SHARE: f64 = 0.01;
const LIT_CONCENTRATION: f64 = 4.0;

impl Camera {
    /// Chooses a view of `light`, for a picture of this width over height: from inside where the
    /// scene is a room, from outside where it is an object.
    ///
    /// The view is the one, of many points and directions, whose rays hit most of the scene's
    /// parts, on lit fronts, few backs, and nothing right before the eye. +y or +z is up, whichever
    /// is more likely for the scene. The same light gives the same view. It costs some 500 000
    /// rays.
    pub fn framing(light: &GatheredMesh, aspect: f64) -> Camera {
        let scene = light.mesh.scene();
        let up = up_axis(scene);
        let points = reflecting_points(scene);
        let (core, inside) = match lit_box(light) {
            // A lamp in a long tunnel: only the lit part is worth framing.
            Some(lit) => (lit.corners().to_vec(), lit),
            None => (core(&points, up), scene.reflecting_bounds()),
        };
        let scorer = ViewScorer::new(light, Aabb::from_points(core.iter().copied()));
        let framing = Framing { scorer, inside, up, aspect };
        let mut views = framing.outside(&points);
        if core != points {
            views.extend(framing.outside(&core));
        }
        views.extend(framing.inside());
        let best = framing.best(&views, RAYS);
        framing.rounded(best)
    }
}

/// A view, and a factor of its score by its kind.
type View = (Camera, f64);

struct Framing<'a> {
    scorer: ViewScorer<'a>,
    /// Box of the candidate eyes inside, scene unit.
    inside: Aabb,
    up: DVec3,
    aspect: f64,
}

impl Framing<'_> {
    /// The view with the highest score; the first of equals.
    fn best(&self, views: &[View], rays: usize) -> Camera {
        let scores = self.scores(views, rays);
        let better = |best: usize, k: usize| if scores[k] > scores[best] { k } else { best };
        views[(0..views.len()).fold(0, better)].0
    }

    fn scores(&self, views: &[View], rays: usize) -> Vec<f64> {
        let score = |(camera, liking): &View| liking * self.scorer.score(camera, self.aspect, rays);
        views.par_iter().map(score).collect()
    }

    /// The horizontal direction at an azimuth, in turns.
    fn horizontal(&self, turns: f64) -> DVec3 {
        // The first direction is −z where +y is up, and +y where +z is up.
        let first = if self.up == DVec3::Y { DVec3::NEG_Z } else { DVec3::Y };
        let (sine, cosine) = (turns * TAU).sin_cos();
        first * cosine + first.cross(self.up) * sine
    }

    /// Views from outside, each from the least distance at which all of `points` fit in the
    /// picture.
    fn outside(&self, points: &[DVec3]) -> Vec<View> {
        let mut directions = vec![];
        for (elevation, liking) in ELEVATIONS {
            let (sine, cosine) = f64::to_radians(elevation).sin_cos();
            for k in 0..AZIMUTHS {
                let horizontal = self.horizontal(f64::from(k) / f64::from(AZIMUTHS));
                directions.push((horizontal * cosine - self.up * sine, liking));
            }
        }
        let view = |&(forward, liking): &(DVec3, f64)| (self.fitted(points, forward), liking);
        directions.par_iter().map(view).collect()
    }

    /// The view along unit `forward` from the least distance at which all of `points` are in the
    /// picture.
    fn fitted(&self, points: &[DVec3], forward: DVec3) -> Camera {
        let centre = self.scorer.focus.centre();
        let frame =
            Camera { eye: DVec3::ZERO, target: forward, up: self.up, vertical_fov: OUTSIDE_FOV };
        let [right, up, _] = frame.frame();
        let half = (OUTSIDE_FOV.to_radians() / 2.0).tan() * (1.0 - 2.0 * MARGIN);
        // On each of two opposite sides, the plane of the frustum through the outermost point: the
        // eye lies where both planes meet.
        let sides = |axis: DVec3, tangent: f64| {
            let reach = |axis: DVec3| {
                let behind =
                    |p: &DVec3| (*p - centre).dot(axis) - tangent * (*p - centre).dot(forward);
                points.iter().map(behind).fold(f64::NEG_INFINITY, f64::max)
            };
            let (high, low) = (reach(axis), reach(-axis));
            ((high - low) / 2.0, -(high + low) / (2.0 * tangent))
        };
        let (x, back_x) = sides(right, half * self.aspect);
        let (y, back_y) = sides(up, half);
        // A flat scene seen along its plane has no depth: keep a minimum distance.
        let diagonal = self.scorer.focus.diagonal();
        let back = back_x.min(back_y).min(-0.05 * diagonal);
        let eye = centre + right * x + up * y + forward * back;
        let target = eye - forward * back;
        Camera { eye, target, ..frame }
    }

    /// Views in all directions from the points inside with the best coarse scores.
    fn inside(&self) -> Vec<View> {
        let eyes: Vec<DVec3> =
            (0..INSIDE_POINTS).into_par_iter().filter_map(|k| self.inside_eye(k)).collect();
        let look = |eye: &DVec3, azimuths: u32, pitches: &[f64]| {
            let mut views = vec![];
            for &pitch in pitches {
                let (sine, cosine) = f64::to_radians(pitch).sin_cos();
                for k in 0..azimuths {
                    let horizontal = self.horizontal(f64::from(k) / f64::from(azimuths));
                    let forward = horizontal * cosine - self.up * sine;
                    for step in STEPS_BACK {
                        views.push((self.inside_view(*eye, forward, step), 1.0));
                    }
                }
            }
            views
        };
        let coarse = |eye: &DVec3| {
            let scores = self.scores(&look(eye, COARSE_AZIMUTHS, &PITCHES[..1]), COARSE_RAYS);
            scores.into_iter().fold(0.0, f64::max)
        };
        let scores: Vec<f64> = eyes.par_iter().map(coarse).collect();
        let mut order: Vec<usize> = (0..eyes.len()).filter(|&k| scores[k] > 0.0).collect();
        order.sort_by(|&a, &b| scores[b].total_cmp(&scores[a]));
        order.truncate(BEST_POINTS);
        order.iter().flat_map(|&k| look(&eyes[k], AZIMUTHS, &PITCHES)).collect()
    }

    /// The view along unit `forward` from `eye`, moved back by the fraction `step` of the free
    /// distance behind it.
    fn inside_view(&self, eye: DVec3, forward: DVec3, step: f64) -> Camera {
        let diagonal = self.scorer.focus.diagonal();
        let free = self.scorer.rays.closest_hit(eye, -forward, 0.0, None);
        let eye = eye - forward * free.map_or(0.0, |hit| hit.distance * step);
        let target = eye + forward * diagonal / 4.0;
        Camera { eye, target, up: self.up, vertical_fov: INSIDE_FOV }
    }

    /// Point `k` of the box inside, moved to eye height between the floor below and the ceiling
    /// above, if there are both. None where that is not inside.
    fn inside_eye(&self, k: usize) -> Option<DVec3> {
        let [x, y] = r2_point(k, 0.5);
        let place = DVec3::new(x, y, radical_inverse(k as u32 + 1));
        let point = self.inside.low + self.inside.size() * place;
        let distance = |direction: DVec3| {
            self.scorer
                .rays
                .closest_hit(point, direction, 0.0, None)
                .map(|hit| (hit.distance, hit.front))
        };
        let eye = match (distance(-self.up), distance(self.up)) {
            (Some((floor, true)), Some((ceiling, true))) => {
                point + self.up * (EYE_HEIGHT * (floor + ceiling) - floor)
            }
            _ => point,
        };
        (self.scorer.enclosure(eye, ENCLOSURE_RAYS) >= ENCLOSURE).then_some(eye)
    }

    /// The same view with rounded coordinates: steps below 1e-4 of the scene's size.
    fn rounded(&self, camera: Camera) -> Camera {
        let digits = 4 - self.scorer.focus.diagonal().log10().floor() as i32;
        let round = |x: f64| {
            let scale = 10f64.powi(digits.abs());
            if digits >= 0 { (x * scale).round() / scale } else { (x / scale).round() * scale }
        };
        let round = |p: DVec3| DVec3::new(round(p.x), round(p.y), round(p.z)) + DVec3::ZERO;
        let rounded = Camera { eye: round(camera.eye), target: round(camera.target), ..camera };
        if rounded.check(1, 1, 1).is_ok() { rounded } else { camera }
    }
}

/// Vertices of reflecting triangles, or of all where none reflects.
fn reflecting_points(scene: &Scene) -> Vec<DVec3> {
    let triangles = 0..scene.triangles().len();
    let any = triangles.clone().any(|t| scene.material(t).scatters());
    let mut used = vec![false; scene.positions().len()];
    for t in triangles.filter(|&t| !any || scene.material(t).scatters()) {
        for corner in scene.triangles()[t].corners {
            used[corner as usize] = true;
        }
    }
    scene.positions().iter().zip(used).filter(|(_, used)| *used).map(|(p, _)| *p).collect()
}

/// The box with nearly all of the reflected light; none unless it is much smaller than the scene.
fn lit_box(light: &GatheredMesh) -> Option<Aabb> {
    let flux = |face: Face| (face.centre, face.area * face.reflected.length());
    let places: Vec<(DVec3, f64)> = faces(light).map(flux).collect();
    let whole = light.mesh.scene().reflecting_bounds().diagonal();
    Aabb::around_most(&places, UNLIT_SHARE).filter(|lit| lit.diagonal() * LIT_CONCENTRATION < whole)
}

/// `points` without the outliers; all of them unless the remaining box is much smaller.
fn core(points: &[DVec3], up: DVec3) -> Vec<DVec3> {
    let skipped = (points.len() as f64 * OUTLYING_SHARE).ceil() as usize;
    let mut inner = Aabb::EVERYTHING;
    for axis in (0..3).filter(|&axis| up[axis] == 0.0) {
        let mut along: Vec<f64> = points.iter().map(|p| p[axis]).collect();
        along.sort_unstable_by(f64::total_cmp);
        if along.len() > 2 * skipped {
            inner.low[axis] = along[skipped];
            inner.high[axis] = along[along.len() - 1 - skipped];
        }
    }
    let core: Vec<DVec3> = points.iter().copied().filter(|p| inner.contains(*p)).collect();
    let [all, part] = [points, &core].map(|points| Aabb::from_points(points.iter().copied()));
    let height = |bounds: Aabb| bounds.size().dot(up);
    let smaller = !core.is_empty() && part.diagonal() < CORE_SIZE * all.diagonal();
    if smaller && height(part) >= CORE_HEIGHT * height(all) { core } else { points.to_vec() }
}

#[cfg(test)]
mod tests;
