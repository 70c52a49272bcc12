//! The sides of lamps that do not emit: whether light from there would get anywhere.
//!
//! ```text
//!   ───────────────── ceiling          Programs differ in whether a face emits on both of its
//!      ▲ ▲ ▲ ▲                         sides. It makes no difference right below a ceiling: light
//!     ━━━━━━━━━  lamp                  stays in the gap. It does a hand's breadth below, where
//!      ▼ ▼ ▼ ▼                         light leaves the gap at its sides.
//! ```

use std::collections::BTreeMap;

use fastrand::Rng;
use glam::DVec3;

use super::sheets::{LIT_SHARE, Sheets, SideIndex, SideStatistics};
use super::walks::Walks;
use crate::geometry::aabb::Aabb;
use crate::scene::{Scene, Sides, Warning, WarningKind};

/// Random walks from the sides of lamps on which these do not emit.
pub struct LampBacks<'a> {
    /// Of each lamp, that side.
    dark: BTreeMap<usize, SideIndex>,
    /// Of [`walk`]s from there.
    free: SideStatistics<'a>,
}

impl<'a> LampBacks<'a> {
    pub fn new(scene: &Scene, walks: &Walks, sheets: &'a Sheets) -> LampBacks<'a> {
        let dark_side = |t: usize| {
            let shines_from_back = walks.shines_from_back(t)?;
            Some((t, 2 * t + usize::from(!shines_from_back)))
        };
        let dark: BTreeMap<usize, SideIndex> =
            (0..scene.triangles().len()).filter_map(dark_side).collect();
        let mut boxes: BTreeMap<SideIndex, Aabb> = BTreeMap::new();
        for (&t, &side) in &dark {
            let bounds = boxes.entry(sheets.first(side)).or_insert(Aabb::EMPTY);
            scene.corners(t).into_iter().for_each(|corner| bounds.include(corner));
        }
        let sides: Vec<SideIndex> = dark.values().copied().collect();
        let free = sheets.sample(&sides, |side, rng| {
            let width = boxes[&sheets.first(side)].diagonal();
            let start = walks.random_start(side, rng)?;
            let is_dark = |side: SideIndex| dark.get(&(side / 2)) == Some(&side);
            walk(walks, (start, side), width, is_dark, rng)
        });
        LampBacks { dark, free }
    }

    /// Whether any light would get away from the side on which lamp `t` does not emit.
    pub fn are_open(&self, t: usize) -> bool {
        self.dark.get(&t).is_some_and(|&side| self.free.of_sheet(side).hits > 0.0)
    }

    /// The warning of lamps that would light something from there that is not the inside of a body:
    /// of that nothing is lit, nor leads into the open.
    pub fn warning(&self, scene: &Scene, walks: &Walks, is_lit: &[bool]) -> Option<Warning> {
        let is_dark = |(t, side): &(&usize, &SideIndex)| {
            let free = self.free.of_sheet(**side);
            let share = if is_lit[**side] { free.share() } else { free.mean() };
            walks.sides_of(**t) != Sides::Emitting
                && !scene.is_back_covered(**t)
                && share >= LIT_SHARE
        };
        let lamps: Vec<usize> = self.dark.iter().filter(is_dark).map(|(&t, _)| t).collect();
        let done = "dark there, as by `--emit-sides front`; programs such as Blender emit on both \
                    sides of a face: `--emit-sides both`";
        let names =
            lamps.iter().map(|&t| scene.groups()[scene.triangles()[t].group as usize].as_str());
        let warning = Warning::new(WarningKind::DarkBack, lamps.len(), done).naming(names);
        (!lamps.is_empty()).then_some(warning)
    }
}

/// A random walk from a point on the dark side of a lamp until it meets such a side again: 1 if it
/// leaves the scene after it met a surface, 0 if it met one farther away than the lamp is wide,
/// none otherwise.
fn walk(
    walks: &Walks,
    start: (DVec3, SideIndex),
    width: f64,
    is_dark: impl Fn(SideIndex) -> bool,
    rng: &mut Rng,
) -> Option<f64> {
    let (mut at, mut side) = start;
    let (mut has_met, mut is_far) = (false, false);
    // As many bounces as other walks have.
    for _ in 0..16 {
        let direction = walks.random_direction(side, rng);
        let Some((next, next_side)) = walks.next(at, side, direction) else {
            return has_met.then_some(1.0);
        };
        if is_dark(next_side) {
            break;
        }
        has_met = true;
        is_far |= next.distance(start.0) > width;
        (at, side) = (next, next_side);
    }
    is_far.then_some(0.0)
}
