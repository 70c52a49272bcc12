//! A camera for a scene that nobody has chosen one for.
//!
//! ```text
//!   up axis ──► outside: directions around the scene, as near as all of it fits in the picture
//!           └─► inside:  points of the scene's box, at mid-height of the room that they are in
//!                          └─► scored coarsely ──► the best in all directions ──► best score
//! ```
//!
//! Inside and outside compete by what is seen ([`ViewScorer`]): from outside, a room shows the
//! backs of its walls, and an object shows nothing else from within. Everything is deterministic.

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

/// Vertical field of view from outside and from inside, degrees. Chosen by hand: a room asks for a
/// wide one.
const OUTSIDE_FOV: f64 = 40.0;
const INSIDE_FOV: f64 = 70.0;

/// How far above the horizon a view from outside is taken, degrees, and how much such a view is
/// liked. Chosen by hand.
const ELEVATIONS: [(f64, f64); 5] =
    [(0.0, 0.98), (10.0, 0.95), (25.0, 1.0), (40.0, 0.95), (-25.0, 0.5)];

/// How far below the horizon a view from inside looks, degrees. Chosen by hand.
const PITCHES: [f64; 2] = [0.0, 12.0];

/// Directions around the vertical axis; and how many of them points inside are looked at with
/// first. Chosen by hand.
const AZIMUTHS: u32 = 16;
const COARSE_AZIMUTHS: u32 = 8;

/// Points inside that are looked at, and how many of them in all directions. Chosen by hand.
const INSIDE_POINTS: usize = 256;
const BEST_POINTS: usize = 24;

/// Rays along a side of the picture: for a first look, and for a choice. Chosen by hand.
const COARSE_RAYS: usize = 8;
const RAYS: usize = 20;

/// Margin around a scene seen from outside, as a share of the picture. Chosen by hand.
const MARGIN: f64 = 0.04;

/// Height of an eye between floor and ceiling. Chosen by hand: that of a person who stands.
const EYE_HEIGHT: f64 = 0.55;

/// Share of all directions in which an eye inside sees fronts, at least, and directions that are
/// tried. Chosen by hand: a room may lack a wall, a sixth of all, but a street is no room.
const ENCLOSURE: f64 = 0.75;
const ENCLOSURE_RAYS: usize = 64;

/// How far back an eye inside is moved of what is free behind it: to the wall nearly. Chosen by
/// hand.
const STEPS_BACK: [f64; 2] = [0.0, 0.85];

/// Share of the vertices along each level axis that may be outlying on either side; the largest
/// core without them, as a share of the scene's diagonal, and the least height, as a share of the
/// scene's. Chosen by hand: objects on a large ground have a core, furniture in a room has none.
const OUTLYING_SHARE: f64 = 0.02;
const CORE_SIZE: f64 = 0.6;
const CORE_HEIGHT: f64 = 0.8;

/// Share of the reflected light that may lie outside of the box where the light is, at either end
/// of an axis; and how many times smaller than the scene that box has to be to be framed instead.
/// Chosen by hand: in an ordinary room the light fills the room.
const UNLIT_SHARE: f64 = 0.01;
const LIT_CONCENTRATION: f64 = 4.0;

impl Camera {
    /// Chooses a view of `light`, for a picture of this width over height: from inside where the
    /// scene is a room, from outside where it is an object.
    ///
    /// Of views from many places in many directions it is the one whose rays meet most of the
    /// scene's parts, on lit fronts, few backs, and nothing right before the eye. +y or +z is up,
    /// whichever the scene suggests. The same light gives the same view. It costs some 500 000
    /// rays.
    pub fn framing(light: &GatheredMesh, aspect: f64) -> Camera {
        let scene = light.mesh.scene();
        let up = up_axis(scene);
        let points = reflecting_points(scene);
        let (core, inside) = match lit_box(light) {
            // A lamp in a long tunnel: where it is dark, there is nothing to see.
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

/// A view, and how much views of its kind are liked: a factor of its score.
type View = (Camera, f64);

struct Framing<'a> {
    scorer: ViewScorer<'a>,
    /// Where eyes inside are looked for, scene unit.
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

    /// Views from outside, each as near as all of `points` fit in the picture.
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

    /// The view along `forward`, unit length, from as near as all of `points` are in the picture.
    fn fitted(&self, points: &[DVec3], forward: DVec3) -> Camera {
        let centre = self.scorer.focus.centre();
        let frame =
            Camera { eye: DVec3::ZERO, target: forward, up: self.up, vertical_fov: OUTSIDE_FOV };
        let [right, up, _] = frame.frame();
        let half = (OUTSIDE_FOV.to_radians() / 2.0).tan() * (1.0 - 2.0 * MARGIN);
        // A plane of the frustum through the outermost point on its side, for each of two sides:
        // the eye lies where both meet.
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
        // A flat scene seen along its plane has no depth: keep a distance.
        let diagonal = self.scorer.focus.diagonal();
        let back = back_x.min(back_y).min(-0.05 * diagonal);
        let eye = centre + right * x + up * y + forward * back;
        let target = eye - forward * back;
        Camera { eye, target, ..frame }
    }

    /// Views in all directions from the points inside that show most.
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

    /// The view along `forward`, unit length, from a part of the way from `eye` to what is behind
    /// it.
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

    /// The same view with as few digits as show no difference: steps below a ten-thousandth of the
    /// scene.
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

/// Vertices of what reflects, or of all where nothing does.
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

/// The box where nearly all light is reflected; none where that is not much smaller than the scene.
fn lit_box(light: &GatheredMesh) -> Option<Aabb> {
    let flux = |face: Face| (face.centre, face.area * face.reflected.length());
    let places: Vec<(DVec3, f64)> = faces(light).map(flux).collect();
    let whole = light.mesh.scene().reflecting_bounds().diagonal();
    Aabb::around_most(&places, UNLIT_SHARE).filter(|lit| lit.diagonal() * LIT_CONCENTRATION < whole)
}

/// Those of `points` that are not among the outlying ones; all, if what is left is not much
/// smaller.
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
