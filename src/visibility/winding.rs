//! Whether faces are wound so that the light meets their fronts.

use rayon::prelude::*;

use crate::error::quoted;
use crate::sampling::hemisphere::HemisphereSamples;
use crate::sampling::surface::{AreaSampler, SurfacePoint};
use crate::scene::Scene;
use crate::visibility::ray_scene::{Hit, RayScene};
use crate::visibility::{buried, offset};

/// Places on the fronts of faces that look around, evenly over the area, and rays of each.
const PLACES: usize = 2048;
const RAYS: u32 = 32;

/// Looks at a face or a group from which on there is something to be said of it.
const FEWEST: u32 = 16;

impl Scene {
    /// Adds a warning that names the groups with faces that seem to be wound inside out: those that
    /// are met from behind as often as half of what they are met from the front, or more, by rays
    /// that leave fronts everywhere. (From a closed body that is wound inside out as many looks meet
    /// fronts within as meet backs from without.) Faces that are to be seen from both sides and
    /// have but one are named too: light that meets a back is lost.
    ///
    /// Casts 65 536 rays, the same for the same scene. In a scene that is all of one group, a closed
    /// body without others within cannot be told from a room.
    pub fn check_winding(&mut self) {
        let tallies = looks(self);
        let mut groups = vec![Tally::default(); self.groups().len()];
        let mut turned = vec![false; groups.len()];
        for (triangle, tally) in self.triangles().iter().zip(&tallies) {
            groups[triangle.group as usize].add(tally);
            turned[triangle.group as usize] |= tally.is_turned();
        }
        let turned = (0..groups.len()).filter(|&g| turned[g] || groups[g].is_turned());
        let names: Vec<&str> = turned.map(|g| &*self.groups()[g]).collect();
        if !names.is_empty() {
            self.warn(format!(
                "groups with faces that are seen from behind, where light is lost: {}; turn them if \
                 they are wound inside out, or give them a second face",
                quoted(&names)
            ));
        }
    }
}

/// How often rays met a face or a group.
#[derive(Clone, Copy, Default)]
struct Tally {
    front: u32,
    back: u32,
    /// Backs, from places that see little else: within a body that stands on them, or in a room that
    /// is wound inside out.
    shut: u32,
}

impl Tally {
    fn add(&mut self, other: &Tally) {
        self.front += other.front;
        self.back += other.back;
        self.shut += other.shut;
    }

    fn is_turned(&self) -> bool {
        let from_behind = if self.front == 0 { self.back + self.shut } else { self.back };
        self.front + from_behind >= FEWEST && 2 * from_behind >= self.front
    }
}

/// How often every triangle is met.
fn looks(scene: &Scene) -> Vec<Tally> {
    let count = scene.triangles().len();
    let rays = RayScene::of_scene(scene);
    let fan = HemisphereSamples::progressive(RAYS);
    let surface = AreaSampler::new((0..count).map(|t| scene.area(t)));
    let points: Vec<SurfacePoint> = surface.spread(PLACES, 0.0).collect();
    let look = |point: SurfacePoint| -> Vec<Option<Hit>> {
        let (t, [u, v]) = (point.triangle, point.barycentric);
        let [a, b, c] = scene.corners(t);
        let (eye, start) =
            (a + (b - a) * u + (c - a) * v, offset::RAY_START * scene.area(t).sqrt());
        let directions = fan.directions(scene.normal(t), v);
        directions.map(|d| rays.closest_hit(eye, d, start, Some(t))).collect()
    };
    let found: Vec<_> = points.into_par_iter().map(look).collect();
    let mut tallies = vec![Tally::default(); count];
    for hits in found {
        let backs = hits.iter().flatten().filter(|hit| !hit.front).count();
        let shut = backs as f64 > buried::ENCLOSED * f64::from(RAYS);
        for hit in hits.iter().flatten() {
            let tally = &mut tallies[hit.triangle];
            match (hit.front, shut) {
                (true, _) => tally.front += 1,
                (false, true) => tally.shut += 1,
                (false, false) => tally.back += 1,
            }
        }
    }
    tallies
}
