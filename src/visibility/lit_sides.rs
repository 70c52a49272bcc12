//! Determines the sides of triangles that light can reach: these sides reflect.
//!
//! Each connected surface is tested by a few random walks from points on it, and each of its
//! triangles by more where walks from both sides of the surface reach light: nearly all surfaces of
//! most scenes are lit from one side. A walk scatters diffusely at every hit, on either side, and
//! ends at light: at a lamp that it sees or hits, or in the sky.
//!
//! ```text
//!        lamp                    The walk from the upper side of t scatters in the room and
//!   ┌─────▀▀─────┐               sees the lamp. That from its lower side stays within the body:
//!   │   ↗ ↖      │               no walk from there leaves it. The wall's outer side sees the
//!   │  ╱   ╲     │               dark sky only.
//!   │ ╱ ┌──t──┐  │
//!   │   │ ↓↗↘ │  │  → nothing    Single rays pass through seams: a side is lit if the walks from
//!   └───┴─────┴──┘               its sheet reach light, and its own do too.
//! ```
//!
//! A **sheet** is a set of connected sides of triangles, across edges shared by exactly two
//! triangles, however each is wound. The result depends on the position, not on the triangle: of
//! bodies that intersect, the outside is lit and the inside is dark.

mod closed_rooms;
mod lamp_backs;
mod repeated;
mod sheets;
mod walks;

use std::sync::Arc;

use fastrand::Rng;
use glam::DVec3;

use crate::geometry::polygon::{polygon_area, polygon_difference};
use crate::sampling::hash::split_mix64;
use crate::scene::{Scene, Sides, Treatment, Warning, WarningKind};
use crate::work;
use closed_rooms::closed_rooms;
use lamp_backs::LampBacks;
use repeated::repeated_triangles;
use sheets::{LIT_SHARE, Samples, Sheets, SideIndex, SideStatistics};
use walks::Walks;

impl Scene {
    /// The same scene with [`Sides`] applied: triangles of [`Sides::Auto`] are flipped so that
    /// light reaches their fronts, and a second triangle with reversed corners is added wherever
    /// both sides reflect or transmit light. All materials then have one side. Triangles keep their
    /// order, second ones after all others; lamps that reflect on both sides add a material that
    /// does not emit.
    ///
    /// Lit sides are determined by random walks of up to 16 bounces, the same for the same scene:
    /// from at least 16 points on each connected surface, and where both of its sides are lit, or
    /// one barely, from at least four on each side of each triangle. A triangle that light does not
    /// reach keeps its winding, and so do the walls of a closed room around all of the scene; a
    /// surface that reflects nothing has one side. Of triangles with the same corners, material and
    /// group, in either winding, the first is kept; of lamps one for each side, unless light from
    /// one reaches much further. Warnings give the numbers of dropped, flipped and doubled
    /// triangles.
    #[must_use]
    pub fn resolve_sides(&self) -> Scene {
        if is_resolved(self) {
            return self.clone();
        }
        let repeated = repeated_triangles(self);
        let drop = |&dropped: &bool| Treatment { dropped, ..Treatment::default() };
        let sides: Vec<Sides> = self.materials().iter().map(|material| material.sides).collect();
        let mut scene = self.treated(&repeated.iter().map(drop).collect::<Vec<_>>());
        let (treatments, dark_backs) = treatments(&scene, &sides);
        let count = |is: fn(&Treatment) -> bool| {
            let concerned = (0..treatments.len()).filter(|&t| is(&treatments[t]));
            let groups: Vec<u32> = concerned.map(|t| scene.triangles()[t].group).collect();
            groups
        };
        let groups_repeated =
            (0..repeated.len()).filter(|&t| repeated[t]).map(|t| self.triangles()[t].group);
        let warnings = [
            (
                WarningKind::RepeatedTriangle,
                groups_repeated.chain(count(|t| t.dropped)).collect(),
                "dropped",
            ),
            (WarningKind::Winding, count(|t| t.turned), "turned"),
            (WarningKind::BothSides, count(|t| t.doubled), "reflecting on both"),
        ];
        scene = scene.treated(&treatments);
        for (kind, groups, done) in warnings.into_iter().filter(|(_, groups, _)| !groups.is_empty())
        {
            let names = groups.iter().map(|&g| self.groups()[g as usize].as_str());
            scene.warn(Warning::new(kind, groups.len(), done).naming(names));
        }
        dark_backs.into_iter().for_each(|warning| scene.warn(warning));
        scene
    }
}

/// [`Scene::resolve_sides`], where necessary.
pub(crate) fn resolved(scene: Arc<Scene>) -> Arc<Scene> {
    if is_resolved(&scene) { scene } else { Arc::new(scene.resolve_sides()) }
}

/// Whether all materials have one side, and translucent triangles another behind them.
pub(crate) fn is_resolved(scene: &Scene) -> bool {
    let is_missing = |t: usize| scene.material(t).is_translucent() && !scene.is_back_covered(t);
    scene.materials().iter().all(|material| material.sides == Sides::Front)
        && !(0..scene.triangles().len()).any(is_missing)
}

/// The treatment of each triangle of `scene`, whose materials have these `sides`, and the warning
/// of lamps that are dark on a side from which they would light something.
fn treatments(scene: &Scene, sides: &[Sides]) -> (Vec<Treatment>, Option<Warning>) {
    let count = scene.triangles().len();
    let sheets = Sheets::new(scene);
    let walks = Walks::new(scene, sides, &sheets);
    let all: Vec<SideIndex> = (0..2 * count).filter(|_| walks.has_light()).collect();
    let to_light = |side, rng: &mut Rng| {
        let start = walks.random_start(side, rng)?;
        walks.walk_to_light(start, side, rng)
    };
    let mut light = sheets.sample(&all, to_light);
    // Elsewhere the result is that of the sheets: one of the sides is dark, and the other surely
    // reaches the share that counts as lit, or nothing.
    let in_doubt = |t: usize| {
        let [front, back] = [2 * t, 2 * t + 1].map(|side| light.of_sheet(side));
        let is_unsure = |s: Samples| s.hits > 0.0 && s.share() < 3.0 * LIT_SHARE;
        let are_both_lit = front.hits > 0.0 && back.hits > 0.0;
        let is_covered = || walks.has_light() && is_covered(&walks, t);
        are_both_lit || is_unsure(front) || is_unsure(back) || is_covered()
    };
    let are_in_doubt = work::map(count, in_doubt);
    let in_doubt = (0..count).filter(|&t| are_in_doubt[t]);
    let in_doubt: Vec<SideIndex> = in_doubt.flat_map(|t| [2 * t, 2 * t + 1]).collect();
    light.add_points(&in_doubt, to_light);
    let lit = LitSides::new(scene, &light, &all);
    let is_room = closed_rooms(scene);
    let backs = LampBacks::new(scene, &walks, &sheets);
    let treatment = |t: usize| {
        let is_glass = scene.material(t).specular.is_some_and(|specular| specular.is_glass());
        if is_glass && !scene.material(t).scatters() {
            // Both of its sides are used anyway, and it encloses a body as it is.
            return Treatment::default();
        }
        let is_translucent = scene.material(t).is_translucent();
        let [is_front_lit, is_back_lit] = [2 * t, 2 * t + 1].map(|side| lit.is_lit[side]);
        let turned = match (walks.sides_of(t), walks.shines_from_back(t)) {
            (Sides::Auto, Some(shines_from_back)) => shines_from_back,
            // A translucent triangle has both sides and is never flipped.
            (Sides::Auto, None) if is_translucent => false,
            (Sides::Auto, None) => walks.has_light() && lit.faces_backward(t) && !is_room[t],
            _ => false,
        };
        let (is_other_lit, other) =
            if turned { (is_front_lit, 2 * t) } else { (is_back_lit, 2 * t + 1) };
        let doubled = match walks.sides_of(t) {
            _ if is_translucent => !scene.is_back_covered(t),
            Sides::Front => false,
            Sides::Emitting => backs.are_open(t),
            Sides::Both => true,
            Sides::Auto => is_other_lit && lit.is_bright(other) && !is_room[t],
        };
        let is_dark = walks.sides_of(t) == Sides::Auto && !is_front_lit && !is_back_lit;
        let reflects = scene.material(t).scatters() || scene.material(t).specular.is_some();
        let shines_on_both = walks.sides_of(t) == Sides::Emitting;
        Treatment {
            dropped: walks.is_inner_side_of_lamp(t)
                || is_dark && !is_glass && walks.has_light() && is_in_the_way(scene, &walks, t),
            turned,
            doubled: doubled && (reflects || shines_on_both),
            shines_on_both,
        }
    };
    (work::map(count, treatment), backs.warning(scene, &walks, &lit.is_lit))
}

/// The sides that light reaches.
struct LitSides<'a> {
    is_lit: Vec<bool>,
    light: &'a SideStatistics<'a>,
    /// Minimum irradiance for a second side, W/m² summed over the channels.
    min_irradiance: f64,
}

impl<'a> LitSides<'a> {
    /// From the results `light` of walks from the `sampled` sides, both of each triangle; all
    /// others are dark.
    fn new(scene: &Scene, light: &'a SideStatistics, sampled: &[SideIndex]) -> LitSides<'a> {
        let mut is_lit = vec![false; 2 * scene.triangles().len()];
        let (mut flux, mut lit_area) = (0.0, 0.0);
        for sides in sampled.chunks_exact(2) {
            // Whether no walk from the side itself reaches light, and that has a probability below
            // 5 % given the share of its sheet.
            let is_darker = |&side: &SideIndex| {
                let (own, share) = (light.of(side), light.of_sheet(side).share());
                own.hits == 0.0 && libm::pow(1.0 - share, own.points) < 0.05
            };
            // Where no walk from either side reaches light and that is improbable for one if lit,
            // both are dark.
            let neither = sides.iter().all(|&side| light.of(side).hits == 0.0);
            let is_dark = neither && sides.iter().any(is_darker);
            for side in sides.iter().filter(|&side| !is_dark && !is_darker(side)) {
                is_lit[*side] = light.of_sheet(*side).share() >= LIT_SHARE;
                let has_points = light.of(*side).points > 0.0;
                if is_lit[*side] && has_points && scene.material(side / 2).scatters() {
                    flux += light.of(*side).mean() * scene.solid_area(side / 2);
                    lit_area += scene.solid_area(side / 2);
                }
            }
        }
        // Light of that whole amount is an error of 0.2 %, since the measure counts nothing as
        // darker than a twentieth of the mean.
        LitSides { is_lit, light, min_irradiance: 1e-4 * flux / lit_area }
    }

    /// Whether light reaches the back of triangle `t` and not its front; where it reaches neither,
    /// whether it reaches far more of the back's sheet.
    fn faces_backward(&self, t: usize) -> bool {
        match [2 * t, 2 * t + 1].map(|side| self.is_lit[side]) {
            [false, false] => {
                let [front, back] = [2 * t, 2 * t + 1].map(|s| self.light.of_sheet(s).share());
                back >= LIT_SHARE && back > 2.0 * front
            }
            [is_front_lit, is_back_lit] => is_back_lit && !is_front_lit,
        }
    }

    fn is_bright(&self, side: SideIndex) -> bool {
        self.light.of_sheet(side).mean() >= self.min_irradiance
    }
}

/// Whether a front coincides with the back of triangle `t` at some point.
fn is_covered(walks: &Walks, t: usize) -> bool {
    let mut rng = Rng::with_seed(split_mix64(t as u64));
    walks.front_before(walks.random_point(t, &mut rng), 2 * t + 1).is_some()
}

/// Whether all of the back of triangle `t` coincides with fronts of others that light reaches: rays
/// there may hit the back instead of these.
fn is_in_the_way(scene: &Scene, walks: &Walks, t: usize) -> bool {
    let (back, mut rng) = (2 * t + 1, Rng::with_seed(split_mix64(t as u64)));
    let (corners, normal) = (scene.corners(t), scene.normal(t));
    let (mut open, mut covers, mut reached) = (vec![corners.to_vec()], vec![], 0);
    let points = 64;
    for _ in 0..points {
        let at = walks.random_point(t, &mut rng);
        let Some(cover) = walks.front_before(at, back) else { return false };
        if !covers.contains(&cover) {
            covers.push(cover);
            let flat = |p: DVec3| p - normal.dot(p - corners[0]) * normal;
            let cover = scene.corners(cover).map(flat);
            let taken_off = |part: &Vec<DVec3>| polygon_difference(part, &cover, -normal);
            open = open.iter().flat_map(taken_off).collect();
        }
        reached += u32::from(walks.walk_to_light(at, back, &mut rng).is_some());
    }
    // Slivers between outlines stay open by rounding.
    let left: f64 = open.iter().map(|part| polygon_area(part)).sum();
    left <= 1e-6 * scene.area(t) && f64::from(reached) >= LIT_SHARE * f64::from(points)
}
