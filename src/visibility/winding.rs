//! Whether faces are wound so that light meets their fronts.
//!
//! ```text
//!   points on fronts, evenly over the area
//!        │ cosine-weighted rays
//!        ▼
//!   what each ray meets first: a front, or a back
//!        │ counted per triangle and per group
//!        ▼
//!   met from behind half as often as from the front, or more: inverted
//! ```
//!
//! Points that see backs almost everywhere are enclosed: within a body that stands on their
//! surface, or in a room that is inverted as a whole. What they meet counts only for triangles
//! whose front is never met.

use rayon::prelude::*;

use crate::sampling::hemisphere::HemisphereSamples;
use crate::sampling::surface::{AreaSampler, SurfacePoint};
use crate::scene::{Scene, Warning, WarningKind};
use crate::visibility::ray_scene::{Hit, RayScene};
use crate::visibility::{buried, offset};

/// Points on the fronts of faces from which rays are cast, spread evenly over the area, and rays
/// from each. Chosen by hand; no measurement was kept.
const SAMPLES: usize = 2048;
const RAYS_PER_SAMPLE: u32 = 32;

/// Hits from which on a verdict is given of a triangle or a group. Chosen by hand; no measurement
/// was kept.
const MIN_HITS: u32 = 16;

impl Scene {
    /// Adds a warning that names the groups with faces that seem to be wound inside out: those that
    /// are met from behind half as often as from the front, or more, by rays that leave fronts
    /// everywhere. (From a closed body that is wound inside out, as many rays meet fronts within as
    /// meet backs from without.) Faces that are to be seen from both sides but have only one are
    /// named too: light that meets a back is lost.
    ///
    /// Casts 65 536 rays, the same for the same scene. In a scene that is all of one group, a
    /// closed body without others within cannot be told from a room.
    pub fn check_winding(&mut self) {
        let of_triangles = sample_orientation(self);
        let mut of_groups = vec![HitCounts::default(); self.groups().len()];
        let mut inverted = vec![false; self.groups().len()];
        for (triangle, counts) in self.triangles().iter().zip(&of_triangles) {
            of_groups[triangle.group as usize].add(counts);
            inverted[triangle.group as usize] |= counts.is_inverted();
        }
        let named = (0..of_groups.len()).filter(|&g| inverted[g] || of_groups[g].is_inverted());
        let names: Vec<&str> = named.map(|g| &*self.groups()[g]).collect();
        if !names.is_empty() {
            let done = "light is lost there: turn their faces if they are wound inside out; where \
                        they are seen from both sides, give each a second face";
            let names = names.into_iter();
            self.warn(Warning::new(WarningKind::Winding, names.len(), done).naming(names));
        }
    }
}

/// How often rays met a triangle or a group.
#[derive(Clone, Copy, Default)]
struct HitCounts {
    front: u32,
    back: u32,
    /// Backs met from points that are enclosed.
    back_from_enclosed: u32,
}

impl HitCounts {
    fn add(&mut self, other: &HitCounts) {
        self.front += other.front;
        self.back += other.back;
        self.back_from_enclosed += other.back_from_enclosed;
    }

    fn is_inverted(&self) -> bool {
        let mut behind = self.back;
        if self.front == 0 {
            behind += self.back_from_enclosed;
        }
        self.front + behind >= MIN_HITS && 2 * behind >= self.front
    }
}

/// Casts rays from points on all fronts, and counts how often every triangle is met.
fn sample_orientation(scene: &Scene) -> Vec<HitCounts> {
    let count = scene.triangles().len();
    let rays = RayScene::of_scene(scene);
    let samples = HemisphereSamples::progressive(RAYS_PER_SAMPLE);
    let surface = AreaSampler::new((0..count).map(|t| scene.area(t)));
    let points: Vec<SurfacePoint> = surface.spread(SAMPLES, 0.0).collect();
    let trace = |point: SurfacePoint| -> Vec<Option<Hit>> {
        let (t, [u, v]) = (point.triangle, point.barycentric);
        let [a, b, c] = scene.corners(t);
        let eye = a + (b - a) * u + (c - a) * v;
        let start = offset::RAY_START * scene.area(t).sqrt();
        let directions = samples.directions(scene.normal(t), v);
        directions.map(|d| rays.closest_hit(eye, d, start, Some(t))).collect()
    };
    let hits_of_points: Vec<_> = points.into_par_iter().map(trace).collect();
    let mut counts = vec![HitCounts::default(); count];
    for hits in hits_of_points {
        let backs = hits.iter().flatten().filter(|hit| !hit.front).count();
        let enclosed = backs as f64 > buried::ENCLOSED * f64::from(RAYS_PER_SAMPLE);
        for hit in hits.iter().flatten() {
            let counts = &mut counts[hit.triangle];
            match (hit.front, enclosed) {
                (true, _) => counts.front += 1,
                (false, true) => counts.back_from_enclosed += 1,
                (false, false) => counts.back += 1,
            }
        }
    }
    counts
}
