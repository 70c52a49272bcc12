//! View factors between whole groups, as heat transfer means them.

use std::ops::ControlFlow;
mod checks;
mod convex_polygons;
mod cubature;
mod enforcement;
mod exchange;
mod far_field;
mod point_visibility;
mod sampled;
mod shaft;
mod visual_events;

use std::collections::BTreeMap;

use rayon::prelude::*;

use self::convex_polygons::{ConvexPolygon, Merge, pieces};
use self::cubature::total;
use self::exchange::{PairVisibility, link};
use self::point_visibility::PointVisibility;
use self::shaft::Tree;
use crate::error::{Error, ErrorKind};
use crate::sampling::hash::split_mix64;
use crate::scene::Scene;

pub use self::checks::{ErrorStats, MatrixChecks};
pub use self::enforcement::EnforcementReport;

/// The matrix of area-averaged form factors between the groups of a scene, sparse, with an error
/// beside every factor.
///
/// F_ij is the fraction of the flux leaving group i (the row) that arrives at fronts of group j
/// (the column), 0 to 1.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewFactors {
    /// Names of the groups, in the order of rows and columns.
    pub names: Vec<String>,
    /// Radiating area of each group, length unit squared; both sides of a two-sided group.
    pub areas: Vec<f64>,
    /// Per group i, the groups j that it sees, by ascending index.
    pub factors: Vec<Vec<Factor>>,
    /// Fraction of the flux leaving group i that meets nothing. Of an exact matrix this is what is
    /// left over: in a closed scene, the closure error of the row.
    pub open: Vec<Estimate>,
    /// Fraction of the flux leaving group i that meets the back of a surface.
    pub back: Vec<Estimate>,
    /// What it means that a pair is not in `factors`.
    pub absent: Missing,
}

/// What it means that there is no factor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Missing {
    /// The factor is zero: one is behind the other, or all is hidden.
    Zero,
    /// No pixel or ray from one has met the other; the factor may be small.
    NotSeen,
}

/// One nonzero of a matrix of view factors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Factor {
    /// The group that receives.
    pub to: u32,
    /// The factor, 0 to 1.
    pub value: f64,
    /// Standard error of the value.
    pub error: f64,
}

/// A value and its standard error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Its standard error.
    pub error: f64,
}

impl Estimate {
    /// Nothing over nothing is nothing: a group without area neither gives nor takes.
    fn over(self, area: f64) -> Estimate {
        if area == 0.0 {
            return Estimate::default();
        }
        Estimate { value: self.value / area, error: self.error / area }
    }
}

/// How far below the error asked for the cautious error of every sum is brought. The likely one is
/// a tenth of that again: rows of thousands of factors then close to a tenth of what was asked.
const SAFETY: f64 = 0.1;

impl ViewFactors {
    /// The matrix of `scene` with an absolute standard error well below `error` on every factor.
    /// The groups of index `two_sided` give and take on both sides. `progress` is told convex
    /// pieces done and in all, and may cancel: then there is no matrix.
    ///
    /// Coplanar triangles become convex pieces. Pairs of pieces with nothing in between are exact:
    /// the contour integral of Schröder and Hanrahan (1993), see
    /// [`crate::form_factor::closed_form::polygon_to_polygon`]; 1e-13, or 6e-8 of the factor where
    /// they are more than 8 radii apart. Of others, one is cut into triangles, and each of these is
    /// gathered over by Radon's seven-point rule from what a point sees of the other: Lambert's
    /// formula (1760) over what the shadows of all blockers leave of it, exact. Triangles are cut
    /// until rules of different degree agree; the error told is what the last cuts have changed.
    /// Reciprocity A_i F_ij = A_j F_ji holds to rounding, since every pair is met once.
    ///
    /// Time grows with the square of the number of pieces, and with those that stand in between.
    /// For scenes of more than some ten thousand pieces see [`ViewFactors::sampled`].
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when `error` is not in (0, 1) or a group does not exist.
    pub fn new(
        scene: &Scene,
        error: f64,
        two_sided: &[usize],
        mut progress: impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<Option<ViewFactors>, Error> {
        let groups = scene.groups().len();
        let setting = |place: &str, found: String, remedy: String| {
            Err(Error::new(ErrorKind::Setting, place, found, remedy))
        };
        if !(error > 0.0 && error < 1.0) {
            return setting("error", error.to_string(), "it must be in (0, 1)".into());
        }
        if let Some(group) = two_sided.iter().find(|g| **g >= groups) {
            let remedy = format!("the scene has {groups} groups");
            return setting("two-sided group", group.to_string(), remedy);
        }
        let unit = scene.bounds().longest_side().log2().floor().exp2();
        let engine = Assembler::new(scene, unit, error, two_sided);
        let mut sums = Sums::new(groups);
        let count = engine.fronts.len();
        let batch = (count / 100).clamp(4, 64);
        for start in (0..count).step_by(batch) {
            let end = (start + batch).min(count);
            let rows: Vec<_> = (start..end).into_par_iter().map(|s| engine.row(s)).collect();
            for (s, row) in (start..end).zip(rows) {
                sums.add(engine.fronts[s].group as usize, row);
            }
            if progress(end, count).is_break() {
                return Ok(None);
            }
        }
        Ok(Some(sums.finish(scene, &engine.areas, unit)))
    }

    /// The factor from group `i` to group `j`; zero where there is none.
    pub fn factor(&self, i: usize, j: usize) -> Estimate {
        let row = &self.factors[i];
        let found = row.binary_search_by_key(&j, |f| f.to as usize);
        found.map_or(Estimate::default(), |k| Estimate { value: row[k].value, error: row[k].error })
    }

    /// What is left of rows when all that is known is taken off, as `open`.
    fn with_open_left(mut self) -> ViewFactors {
        let rows = self.factors.iter().zip(&self.back).zip(&self.areas);
        let left = |((row, back), area): ((&Vec<Factor>, &Estimate), &f64)| {
            if *area == 0.0 {
                return Estimate::default();
            }
            let sum: f64 = row.iter().map(|f| f.value).sum();
            let squares: f64 = row.iter().map(|f| f.error.powi(2)).sum();
            Estimate { value: 1.0 - sum - back.value, error: (squares + back.error.powi(2)).sqrt() }
        };
        self.open = rows.map(left).collect();
        self
    }
}

/// All that a row needs to know.
struct Assembler {
    /// Pieces that give and take, by group.
    fronts: Vec<ConvexPolygon>,
    /// What of the backs of pieces can be met.
    backs: Vec<ConvexPolygon>,
    blockers: Tree,
    areas: Vec<f64>,
    error: f64,
}

/// Flux from one piece to later pieces of its own group and to later groups.
struct PieceRow {
    fronts: Vec<(u32, Estimate)>,
    back: Estimate,
}

impl Assembler {
    fn new(scene: &Scene, unit: f64, error: f64, two_sided: &[usize]) -> Assembler {
        let mut fronts = pieces(scene, unit, Merge::WithinGroups);
        let both = |piece: &&ConvexPolygon| two_sided.contains(&(piece.group as usize));
        let reversed: Vec<ConvexPolygon> =
            fronts.iter().filter(both).map(ConvexPolygon::reversed).collect();
        fronts.extend(reversed);
        fronts.sort_by_key(|piece| piece.group);
        let blockers = Tree::new(pieces(scene, unit, Merge::AcrossGroups));
        let backs = blockers.backs(&Tree::new(fronts.clone()));
        let mut areas = vec![0.0; scene.groups().len()];
        fronts.iter().for_each(|piece| areas[piece.group as usize] += piece.area);
        Assembler { fronts, backs, blockers, areas, error }
    }

    fn row(&self, s: usize) -> PieceRow {
        let mut eye = PointVisibility::default();
        let from = &self.fronts[s];
        let mut fronts: Vec<(u32, Estimate)> = Vec::new();
        let own = self.areas[from.group as usize];
        // Errors of the pieces of a group are independent: squares add up.
        let share = SAFETY * self.error * (from.area / own).sqrt();
        let mut t = s + 1;
        for group in self.fronts[s + 1..].chunk_by(|a, b| a.group == b.group) {
            let to = group[0].group;
            let receivers = group.iter().zip(t..);
            t += group.len();
            let tolerance = share * own.min(self.areas[to as usize]);
            let flux = self.flux(from, s, receivers, tolerance, &mut eye);
            if flux.value > 0.0 || flux.error > 0.0 {
                fronts.push((to, flux));
            }
        }
        let receivers = self.backs.iter().zip(self.fronts.len()..);
        let back = self.flux(from, s, receivers, share * own, &mut eye);
        PieceRow { fronts, back }
    }

    /// Flux to all of `receivers`, numbered.
    fn flux<'b>(
        &self,
        from: &ConvexPolygon,
        s: usize,
        receivers: impl Iterator<Item = (&'b ConvexPolygon, usize)>,
        tolerance: f64,
        eye: &mut PointVisibility,
    ) -> Estimate {
        let mut whole = Estimate::default();
        let mut partial = Vec::new();
        for (to, t) in receivers {
            let seed = split_mix64(split_mix64(s as u64) ^ t as u64);
            match link(from, to, &self.blockers, eye, seed) {
                PairVisibility::Nothing => {}
                PairVisibility::Whole(flux) => {
                    whole.value += flux.value;
                    whole.error += flux.error;
                }
                PairVisibility::OccludedPair(pair) => partial.push(*pair),
            }
        }
        let rest = total(&mut partial, tolerance, eye);
        Estimate { value: whole.value + rest.value, error: whole.error.hypot(rest.error) }
    }
}

/// Fluxes between groups, in squares of `unit`, errors squared.
struct Sums {
    rows: Vec<BTreeMap<u32, (f64, f64)>>,
    back: Vec<(f64, f64)>,
}

impl Sums {
    fn new(groups: usize) -> Sums {
        Sums { rows: vec![BTreeMap::new(); groups], back: vec![(0.0, 0.0); groups] }
    }

    fn add(&mut self, from: usize, row: PieceRow) {
        for (to, flux) in row.fronts {
            // Pairs within a group are met once and count both ways.
            let twice = if to as usize == from { 2.0 } else { 1.0 };
            let sum = self.rows[from].entry(to).or_default();
            sum.0 += twice * flux.value;
            sum.1 += (twice * flux.error).powi(2);
        }
        self.back[from].0 += row.back.value;
        self.back[from].1 += row.back.error.powi(2);
    }

    fn finish(self, scene: &Scene, areas: &[f64], unit: f64) -> ViewFactors {
        let mut factors: Vec<Vec<Factor>> = vec![Vec::new(); areas.len()];
        let estimate = |(value, square): (f64, f64)| Estimate { value, error: square.sqrt() };
        for (i, row) in self.rows.iter().enumerate() {
            for (&to, &sum) in row {
                let Estimate { value, error } = estimate(sum).over(areas[i]);
                factors[i].push(Factor { to, value, error });
                if to as usize != i {
                    let Estimate { value, error } = estimate(sum).over(areas[to as usize]);
                    factors[to as usize].push(Factor { to: i as u32, value, error });
                }
            }
        }
        factors.iter_mut().for_each(|row| row.sort_by_key(|f| f.to));
        let backs = self.back.iter().zip(areas);
        ViewFactors {
            names: scene.groups().to_vec(),
            areas: areas.iter().map(|area| area * unit * unit).collect(),
            factors,
            open: Vec::new(),
            back: backs.map(|(&sum, &area)| estimate(sum).over(area)).collect(),
            absent: Missing::Zero,
        }
        .with_open_left()
    }
}
