//! Sheets: connected sides of triangles.

use fastrand::Rng;
use serde::{Deserialize, Serialize};

use crate::geometry::union_find::UnionFind;
use crate::sampling::hash::split_mix64;
use crate::scene::{HalfEdge, Scene};
use crate::work;

/// A sheet is dark if a smaller share of the walks from it reaches light. The share is 3 to 5 % in
/// the gap between the Cornell box's lamp and its ceiling, and almost 0 through seams; in the
/// second of two rooms, which has no lamp, it is 25 to 40 %.
pub const LIT_SHARE: f64 = 0.1;

/// Points per side, whatever its area: a few dozen triangles of a sheet that are lit from the other
/// side than its large ones are found. Plain choice.
const SHARE_OF_SIDES: f64 = 0.125;

/// A side of a triangle: twice its index, plus one for its back.
pub type SideIndex = usize;

/// The sheets of a scene.
pub struct Sheets {
    /// Per side, the first side of its sheet.
    first: Vec<SideIndex>,
    /// Per triangle, scene unit squared.
    areas: Vec<f64>,
    /// Minimum number of sample points on a sheet.
    of_sheet: f64,
}

impl Sheets {
    pub fn new(scene: &Scene) -> Sheets {
        let first = first_sides(scene);
        let count = (0..first.len()).filter(|&side| first[side] == side).count();
        // More where there are few sheets, 16384 in all. Of 16 walks from a side of which a share
        // of `LIT_SHARE` reaches light, at least one does with a probability of 81 %, and of a
        // share of a quarter 99 %. Plain choice.
        let of_sheet = (16384.0 / count as f64).clamp(16.0, 128.0);
        let areas = (0..scene.triangles().len()).map(|t| scene.area(t)).collect();
        Sheets { first, areas, of_sheet }
    }

    /// The expected number of sample points on each of `sides`, of which those of each sheet share
    /// its points by area.
    fn densities(&self, sides: &[SideIndex]) -> Vec<f64> {
        let mut of_sheets = vec![0.0; self.first.len()];
        sides.iter().for_each(|&side| of_sheets[self.first[side]] += self.areas[side / 2]);
        let total: f64 = self.areas.iter().sum();
        let density = |&side: &SideIndex| {
            let area = self.areas[side / 2];
            let of_area = 2048.0 * area / total;
            SHARE_OF_SIDES + of_area + self.of_sheet * area / of_sheets[self.first[side]]
        };
        sides.iter().map(density).collect()
    }

    /// The first side of the sheet of a side.
    pub fn first(&self, side: SideIndex) -> SideIndex {
        self.first[side]
    }

    /// Calls `find` for sample points on `sides`, in proportion to area on each sheet, with a
    /// random sequence of its own per side.
    pub fn sample(
        &self,
        sides: &[SideIndex],
        find: impl Fn(SideIndex, &mut Rng) -> Option<f64> + Sync,
    ) -> SideStatistics<'_> {
        let mut statistics = SideStatistics {
            sheets: self,
            of_sides: vec![Samples::default(); self.first.len()],
            of_sheets: vec![Samples::default(); self.first.len()],
        };
        statistics.add(sides, 0, |density, rng| (density + rng.f64()) as usize, find);
        statistics
    }
}

/// Results of the sample points on sides.
pub struct SideStatistics<'a> {
    sheets: &'a Sheets,
    /// Per side; without points for sides that were not sampled.
    of_sides: Vec<Samples>,
    /// By the first side of each sheet.
    of_sheets: Vec<Samples>,
}

impl SideStatistics<'_> {
    /// Calls `find` for at least four points on each of `sides`: enough to overrule the result of a
    /// sheet if most of them agree. Plain choice.
    pub fn add_points(
        &mut self,
        sides: &[SideIndex],
        find: impl Fn(SideIndex, &mut Rng) -> Option<f64> + Sync,
    ) {
        self.add(sides, 1, |density, _| density.max(4.0).ceil() as usize, find);
    }

    fn add(
        &mut self,
        sides: &[SideIndex],
        stream: u64,
        count: impl Fn(f64, &mut Rng) -> usize + Sync,
        find: impl Fn(SideIndex, &mut Rng) -> Option<f64> + Sync,
    ) {
        let densities: Vec<f64> = self.sheets.densities(sides);
        let from_side = |k: usize| {
            let (side, density) = (sides[k], densities[k]);
            let mut rng = Rng::with_seed(split_mix64(side as u64) ^ stream);
            let points = count(density, &mut rng);
            let mut samples = Samples { points: points as f64, ..Samples::default() };
            for value in (0..points).filter_map(|_| find(side, &mut rng)) {
                samples.hits += 1.0;
                samples.sum += value;
            }
            samples
        };
        for (&side, samples) in sides.iter().zip(work::map(sides.len(), from_side)) {
            self.of_sides[side].add(samples);
            self.of_sheets[self.sheets.first[side]].add(samples);
        }
    }

    /// The result of a side.
    pub fn of(&self, side: SideIndex) -> Samples {
        self.of_sides[side]
    }

    /// The result of the sampled sides of its sheet.
    pub fn of_sheet(&self, side: SideIndex) -> Samples {
        self.of_sheets[self.sheets.first[side]]
    }
}

/// Results at some points.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Samples {
    /// Number of points.
    pub points: f64,
    /// Number of points with a value.
    pub hits: f64,
    /// Sum of the values.
    sum: f64,
}

impl Samples {
    fn add(&mut self, more: Samples) {
        self.points += more.points;
        self.hits += more.hits;
        self.sum += more.sum;
    }

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
