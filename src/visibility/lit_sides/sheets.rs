//! Sheets: sides of triangles that continue one another.

use fastrand::Rng;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::geometry::union_find::UnionFind;
use crate::geometry::weld::Weld;
use crate::sampling::hash::split_mix64;
use crate::scene::Scene;

/// A side of a triangle: twice its number, and one more for its back.
pub type SideIndex = usize;

/// Places on each side of a triangle, at least: enough to object to its sheet where most places of
/// that say the same. Chosen by hand, as are the numbers below.
const PLACES: f64 = 4.0;

/// And for large triangles: so many over all area, on one side.
const PLACES_OVER_ALL: f64 = 2048.0;

/// And where sheets are few, so many on each, or their part of so many on all.
const PLACES_OF_SHEET: f64 = 128.0;
const PLACES_OF_SHEETS: f64 = 16384.0;

/// The sheets of a scene.
pub struct Sheets {
    /// Per side, the first one of its sheet.
    first: Vec<SideIndex>,
    /// Per side, the places on it that are asked.
    places: Vec<usize>,
}

impl Sheets {
    pub fn new(scene: &Scene) -> Sheets {
        let first = first_sides(scene);
        let mut sizes = vec![0u32; first.len()];
        first.iter().for_each(|&side| sizes[side] += 1);
        let count = sizes.iter().filter(|&&size| size > 0).count();
        let of_sheet = (PLACES_OF_SHEETS / count as f64).min(PLACES_OF_SHEET);
        let total_area: f64 = (0..scene.triangles().len()).map(|t| scene.area(t)).sum();
        let places = |(side, &first): (SideIndex, &SideIndex)| {
            let of_area = PLACES_OVER_ALL * scene.area(side / 2) / total_area;
            let of_sheet = of_sheet / f64::from(sizes[first]);
            PLACES.max(of_area).max(of_sheet).ceil() as usize
        };
        let places = first.iter().enumerate().map(places).collect();
        Sheets { first, places }
    }

    /// What `find` finds from places on each of `sides`, by random numbers of its own.
    pub fn ask(
        &self,
        sides: &[SideIndex],
        find: impl Fn(SideIndex, &mut Rng) -> Option<f64> + Sync,
    ) -> Answers<'_> {
        let from_side = |&side: &SideIndex| {
            let mut rng = Rng::with_seed(split_mix64(side as u64));
            let mut found = Found { places: self.places[side] as f64, ..Found::default() };
            for value in (0..self.places[side]).filter_map(|_| find(side, &mut rng)) {
                found.hits += 1.0;
                found.sum += value;
            }
            (side, found)
        };
        let of_sides: FxHashMap<SideIndex, Found> = sides.par_iter().map(from_side).collect();
        let mut of_sheets: FxHashMap<SideIndex, Found> = FxHashMap::default();
        for side in sides {
            let (sheet, found) = (of_sheets.entry(self.first[*side]).or_default(), of_sides[side]);
            sheet.places += found.places;
            sheet.hits += found.hits;
            sheet.sum += found.sum;
        }
        Answers { sheets: self, of_sides, of_sheets }
    }
}

/// What was found from places on sides.
pub struct Answers<'a> {
    sheets: &'a Sheets,
    of_sides: FxHashMap<SideIndex, Found>,
    /// By the first side of each.
    of_sheets: FxHashMap<SideIndex, Found>,
}

impl Answers<'_> {
    /// From a side that was asked.
    pub fn of(&self, side: SideIndex) -> Found {
        self.of_sides[&side]
    }

    /// From those of its sheet that were asked.
    pub fn of_sheet(&self, side: SideIndex) -> Found {
        self.of_sheets[&self.sheets.first[side]]
    }
}

/// What was found from some places.
#[derive(Clone, Copy, Debug, Default)]
pub struct Found {
    /// Places.
    pub places: f64,
    /// Those from which anything was found.
    pub hits: f64,
    /// The sum of it.
    sum: f64,
}

impl Found {
    /// Share of the places from which anything was found.
    pub fn share(self) -> f64 {
        self.hits / self.places
    }

    /// Mean of what was found, nothing counted as 0.
    pub fn mean(self) -> f64 {
        self.sum / self.places
    }
}

/// Per side of a triangle of `scene`, the first side of its sheet.
fn first_sides(scene: &Scene) -> Vec<SideIndex> {
    let count = scene.triangles().len();
    let mut sheets = UnionFind::new(2 * count);
    for triangles in triangles_at_edges(scene).values() {
        let &[(t, forward), (s, also_forward)] = triangles.as_slice() else { continue };
        if scene.triangles()[t].group == scene.triangles()[s].group {
            // Wound alike, one runs forward along what they share, and the other back.
            let across = usize::from(forward == also_forward);
            sheets.join(2 * t, 2 * s + across);
            sheets.join(2 * t + 1, 2 * s + 1 - across);
        }
    }
    (0..2 * count).map(|side| sheets.find(side)).collect()
}

/// The triangles at each edge of `scene`, by the welded positions at its ends, lower first, and
/// whether each runs along it from the lower to the higher.
pub fn triangles_at_edges(scene: &Scene) -> FxHashMap<(u32, u32), Vec<(usize, bool)>> {
    let mut weld = Weld::default();
    let mut at_edges: FxHashMap<(u32, u32), Vec<(usize, bool)>> = FxHashMap::default();
    for t in 0..scene.triangles().len() {
        let [a, b, c] = scene.corners(t).map(|p| weld.number(p));
        for (a, b) in [(a, b), (b, c), (c, a)] {
            at_edges.entry((a.min(b), a.max(b))).or_default().push((t, a < b));
        }
    }
    at_edges
}
