//! Sheets: connected sides of triangles.

use fastrand::Rng;
use rayon::prelude::*;

use crate::geometry::union_find::UnionFind;
use crate::sampling::hash::split_mix64;
use crate::scene::{HalfEdge, Scene};

/// A sheet is dark if a smaller share of the walks from it reaches light. The share is 3 to 5 % in
/// the gap between the Cornell box's lamp and its ceiling, and almost 0 through seams; in the
/// second of two rooms, which has no lamp, it is 25 to 40 %.
pub const LIT_SHARE: f64 = 0.1;

/// A side of a triangle: twice its index, plus one for its back.
pub type SideIndex = usize;

/// The sheets of a scene.
pub struct Sheets {
    /// Per side, the first side of its sheet.
    first: Vec<SideIndex>,
    /// Per side, the number of sample points on it.
    points: Vec<usize>,
}

impl Sheets {
    pub fn new(scene: &Scene) -> Sheets {
        let first = first_sides(scene);
        let mut sizes = vec![0u32; first.len()];
        first.iter().for_each(|&side| sizes[side] += 1);
        let count = sizes.iter().filter(|&&size| size > 0).count();
        let of_sheet = (16384.0 / count as f64).min(128.0);
        let total_area: f64 = (0..scene.triangles().len()).map(|t| scene.area(t)).sum();
        let points = |(side, &first): (SideIndex, &SideIndex)| {
            let of_area = 2048.0 * scene.area(side / 2) / total_area;
            let of_sheet = of_sheet / f64::from(sizes[first]);
            // Enough on each side to overrule the result of its sheet if most of them agree, more
            // on large triangles, and more where there are few sheets: 128 each, and 16384 in all
            // at most. Plain choice.
            of_area.max(4.0).max(of_sheet).ceil() as usize
        };
        let points = first.iter().enumerate().map(points).collect();
        Sheets { first, points }
    }

    /// The first side of the sheet of a side.
    pub fn first(&self, side: SideIndex) -> SideIndex {
        self.first[side]
    }

    /// Calls `find` for the sample points on each of `sides`, with a random sequence of its own per
    /// side.
    pub fn sample(
        &self,
        sides: &[SideIndex],
        find: impl Fn(SideIndex, &mut Rng) -> Option<f64> + Sync,
    ) -> SideStatistics<'_> {
        let from_side = |&side: &SideIndex| {
            let mut rng = Rng::with_seed(split_mix64(side as u64));
            let mut samples = Samples { points: self.points[side] as f64, ..Samples::default() };
            for value in (0..self.points[side]).filter_map(|_| find(side, &mut rng)) {
                samples.hits += 1.0;
                samples.sum += value;
            }
            (side, samples)
        };
        let samples: Vec<(SideIndex, Samples)> = sides.par_iter().map(from_side).collect();
        let mut of_sides = vec![Samples::default(); self.first.len()];
        let mut of_sheets = of_sides.clone();
        for (side, samples) in samples {
            let sheet = &mut of_sheets[self.first[side]];
            sheet.points += samples.points;
            sheet.hits += samples.hits;
            sheet.sum += samples.sum;
            of_sides[side] = samples;
        }
        SideStatistics { sheets: self, of_sides, of_sheets }
    }
}

/// Results of the sample points on sides.
pub struct SideStatistics<'a> {
    sheets: &'a Sheets,
    /// Per side; empty for sides that were not sampled.
    of_sides: Vec<Samples>,
    /// By the first side of each sheet.
    of_sheets: Vec<Samples>,
}

impl SideStatistics<'_> {
    /// The result of a side that was sampled.
    pub fn of(&self, side: SideIndex) -> Samples {
        self.of_sides[side]
    }

    /// The result of the sampled sides of its sheet.
    pub fn of_sheet(&self, side: SideIndex) -> Samples {
        self.of_sheets[self.sheets.first[side]]
    }
}

/// Results at some points.
#[derive(Clone, Copy, Debug, Default)]
pub struct Samples {
    /// Number of points.
    pub points: f64,
    /// Number of points with a value.
    pub hits: f64,
    /// Sum of the values.
    sum: f64,
}

impl Samples {
    /// Share of the points with a value.
    pub fn share(self) -> f64 {
        self.hits / self.points
    }

    /// Mean value; points without one count as 0.
    pub fn mean(self) -> f64 {
        self.sum / self.points
    }
}

/// Per side of a triangle of `scene`, the first side of its sheet.
fn first_sides(scene: &Scene) -> Vec<SideIndex> {
    let count = scene.triangles().len();
    let mut sheets = UnionFind::new(2 * count);
    for sharing in scene.half_edges().chunk_by(HalfEdge::has_ends_of) {
        let [a, b] = sharing else { continue };
        let (t, s) = (a.triangle, b.triangle);
        if scene.triangles()[t].group == scene.triangles()[s].group {
            // With consistent winding, the triangles run along the shared edge in opposite
            // directions.
            let across = usize::from(a.reversed == b.reversed);
            sheets.join(2 * t, 2 * s + across);
            sheets.join(2 * t + 1, 2 * s + 1 - across);
        }
    }
    (0..2 * count).map(|side| sheets.find(side)).collect()
}
