//! The exchange of an occluded pair as a mean over points of one polygon.
//!
//! ```text
//!     target            from each point: the visible part of the target, exactly
//!    ────────           (see `point_visibility`)
//!      ▬▬   blockers
//!   •  •  •  •          points: a low-discrepancy set; the error is the deviation between
//!    domain             the means of its eight parts
//! ```
//!
//! The mean is of the visible share, and the whole is known in closed form: the variation due to
//! the distance of the target adds no error.
//!
//! Much cheaper than adaptive cubature where the requested error is not far below that of a few
//! hundred points.

use glam::DVec3;

use super::matrix::Estimate;
use super::pair_visibility::FacingPair;
use super::point_visibility::{PointFactors, PointVisibility};
use super::polygon_points::{PolygonPoints, scrambled_point};
use super::shaft::Blocker;
use crate::geometry::COINCIDENCE_TOLERANCE;
use crate::geometry::polygon::polygon_area;

/// Parts of the point set: each is evenly distributed for its number of points.
const PARTS: usize = 8;

/// Minimum number of points of a pair.
pub(super) const MIN_POINTS: u32 = 2 * PARTS as u32;

/// A₁F₁₂ of `pair` past all blockers `between`, from points of its first polygon, with a standard
/// error of `tolerance` if 4096 points suffice; `unoccluded` is the value without
/// blockers.
pub(super) fn visible_mean(
    pair: &FacingPair,
    between: &[Blocker],
    unoccluded: f64,
    tolerance: f64,
    seed: u64,
    visibility: &mut PointVisibility,
) -> Estimate {
    let between = nearest_first(between, &pair.a);
    let points = PolygonPoints::new(&pair.a);
    let penumbra = narrowest_penumbra(pair, &between);
    let area = polygon_area(&pair.a);
    let (mut parts, mut known, mut count) =
        ([Seen::default(); PARTS], 0, MIN_POINTS / PARTS as u32);
    loop {
        for (part, seen) in (0..).zip(&mut parts).skip(known) {
            for k in part * count..(part + 1) * count {
                let [u, v, ..] = scrambled_point(k, seed);
                let point = points.at(u, v);
                let factors =
                    visibility.factors(point, pair.a_normal, &pair.b, pair.b_normal, &between);
                seen.add_point(factors);
            }
        }
        let spacing = (area / f64::from(PARTS as u32 * count)).sqrt();
        let share = visible_share(&parts, count, (spacing / penumbra).min(1.0));
        let mean = Estimate { value: unoccluded * share.value, error: unoccluded * share.error };
        // Limits time; the remaining error is reported.
        if mean.error <= tolerance || count >= 512 {
            return mean;
        }
        // All of them are the first half of twice the number.
        let halves = std::array::from_fn(|k| match parts.get(2 * k..2 * k + 2) {
            Some(two) => two[0].and(two[1]),
            None => Seen::default(),
        });
        (parts, known, count) = (halves, PARTS / 2, 2 * count);
    }
}

/// Sums over points of the form factors.
#[derive(Clone, Copy, Default)]
struct Seen {
    visible: f64,
    unoccluded: f64,
    /// The smallest and the largest visible share of a point.
    shares: Option<[f64; 2]>,
}

impl Seen {
    fn add_point(&mut self, factors: PointFactors) {
        let PointFactors { visible, unoccluded } = factors;
        let shares = (unoccluded > 0.0).then(|| [visible / unoccluded; 2]);
        *self = self.and(Seen { visible, unoccluded, shares });
    }

    fn and(self, other: Seen) -> Seen {
        let shares = match (self.shares, other.shares) {
            (Some([a, b]), Some([c, d])) => Some([a.min(c), b.max(d)]),
            (one, another) => one.or(another),
        };
        let visible = self.visible + other.visible;
        Seen { visible, unoccluded: self.unoccluded + other.unoccluded, shares }
    }
}

/// The visible share, by parts of `count` points each, and its standard error. `sharpness` is the
/// fraction of the whole variation over the domain that may occur between two neighbouring points.
fn visible_share(parts: &[Seen; PARTS], count: u32, sharpness: f64) -> Estimate {
    let all = parts.iter().fold(Seen::default(), |sum, part| sum.and(*part));
    let Some([low, high]) = all.shares else { return Estimate::default() };
    let value = all.visible / all.unoccluded;
    let part_of_all = all.unoccluded / PARTS as f64;
    let deviation = |part: &Seen| (part.visible - value * part.unoccluded) / part_of_all;
    let squares: f64 = parts.iter().map(|part| deviation(part).powi(2)).sum();
    let independent = (squares / (PARTS * (PARTS - 1)) as f64).sqrt();
    let of_parts = independent * dependence(sharpness);
    // A spot without points is assumed to have the area of one point and a share within the range
    // of the others; or the opposite value, where all see all or nothing.
    let points = f64::from(count) * PARTS as f64;
    let range = high - low;
    let unmet = match range < COINCIDENCE_TOLERANCE
        && (low < COINCIDENCE_TOLERANCE || high > 1.0 - COINCIDENCE_TOLERANCE)
    {
        true => 2.0 / points,
        false => 0.5 * range / points,
    };
    Estimate { value, error: libm::hypot(of_parts, sharpness * unmet) }
}

/// Ratio of the standard error of the mean of all points to that of eight independent parts. Where
/// the visible share jumps, parts may be independent. Where only its slope jumps, the mean of n
/// evenly distributed points has an error of n^(−5/4) or less (of n cells √n have errors of the
/// order of n^(−3/2)), so that the error of all is 8^(−3/4) of that of independent parts.
fn dependence(sharpness: f64) -> f64 {
    // Student's t for 7 degrees of freedom and 95 %, over the 2 of a large sample.
    (2.365 / 2.0 * sharpness).max(libm::pow(PARTS as f64, -0.75))
}

/// Minimum distance on the first polygon of `pair` over which the visibility of the other may
/// change from full to none: s d / D, for a blocker at distance d and a target of width s at
/// distance D.
fn narrowest_penumbra(pair: &FacingPair, between: &[Blocker]) -> f64 {
    let height = |corner: &DVec3| pair.a_normal.dot(corner - pair.a[0]).max(0.0);
    let corners = between.iter().flat_map(|blocker| &blocker.corners);
    let lowest = corners.map(height).fold(f64::INFINITY, f64::min);
    let distances = pair.a.iter().flat_map(|a| pair.b.iter().map(|b| a.distance(*b)));
    let farthest = distances.fold(f64::MIN_POSITIVE, f64::max);
    (narrowest_width(&pair.b, pair.b_normal) * lowest / farthest).max(f64::MIN_POSITIVE)
}

/// The smallest width of a convex polygon, measured perpendicular to its edges.
fn narrowest_width(polygon: &[DVec3], normal: DVec3) -> f64 {
    let across = |k: usize| {
        let (a, b) = (polygon[k], polygon[(k + 1) % polygon.len()]);
        let inwards = normal.cross(b - a).normalize_or_zero();
        polygon.iter().map(|corner| inwards.dot(corner - a)).fold(0.0, f64::max)
    };
    (0..polygon.len()).map(across).fold(f64::INFINITY, f64::min)
}

/// Blockers by distance from the middle of a polygon: near ones hide the most, and removed regions
/// are not cut again.
fn nearest_first(blockers: &[Blocker], polygon: &[DVec3]) -> Vec<Blocker> {
    let middle = polygon.iter().sum::<DVec3>() / polygon.len() as f64;
    let square = |blocker: &Blocker| {
        let squares = blocker.corners.iter().map(|p| p.distance_squared(middle));
        squares.fold(f64::INFINITY, f64::min)
    };
    let mut order: Vec<(f64, &Blocker)> = blockers.iter().map(|b| (square(b), b)).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    order.into_iter().map(|(_, blocker)| blocker.clone()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A unit square at z = 0 that faces another at z = 1, and plates in between: the lower corner
    /// and the size of each.
    fn past(plates: &[(DVec3, f64)]) -> (FacingPair, Vec<Blocker>) {
        let square = |low: DVec3, size: f64| {
            let [x, y] = [size * DVec3::X, size * DVec3::Y];
            vec![low, low + x, low + x + y, low + y]
        };
        let pair = FacingPair {
            a: square(DVec3::ZERO, 1.0),
            a_normal: DVec3::Z,
            b: square(DVec3::Z, 1.0).into_iter().rev().collect(),
            b_normal: DVec3::NEG_Z,
        };
        let plate =
            |&(low, size): &(DVec3, f64)| Blocker { corners: square(low, size), normal: DVec3::Z };
        let plates = plates.iter().map(plate).collect();
        (pair, plates)
    }

    #[test]
    fn means_are_within_two_standard_errors() {
        // In mid air, and right on the square, where the visible share jumps.
        let airborne = DVec3::new(0.1, 0.25, 0.5);
        for (low, size) in [(airborne, 0.6), (DVec3::new(0.3, 0.37, 1e-6), 0.4)] {
            let (pair, plates) = past(&[(low, size)]);
            let unoccluded = pair.unoccluded().value;
            let mut visibility = PointVisibility::default();
            let mut mean = |tolerance, seed| {
                visible_mean(&pair, &plates, unoccluded, tolerance, seed, &mut visibility)
            };
            // 100 000 points and more.
            let many: Vec<Estimate> = (0..32).map(|seed| mean(0.0, seed)).collect();
            let truth = many.iter().map(|m| m.value).sum::<f64>() / many.len() as f64;
            for tolerance in [1e-2, 1e-3] {
                let found: Vec<Estimate> = (100..300).map(|seed| mean(tolerance, seed)).collect();
                let is_within = |m: &&Estimate| (m.value - truth).abs() <= 2.0 * m.error;
                let within = found.iter().filter(is_within).count();
                let off: f64 = found.iter().map(|m| (m.value - truth).powi(2)).sum();
                let off = (off / found.len() as f64).sqrt();
                println!("{low} {tolerance}: {within} of 200 within, off by {off:.1e}");
                assert!(within >= 190, "{low} {tolerance}: {within}");
                assert!(found.iter().all(|m| m.error <= tolerance));
            }
        }
    }

    #[test]
    fn penumbras_grow_with_the_distance_of_what_hides() {
        let width = |plates: &[(DVec3, f64)]| {
            let (pair, plates) = past(plates);
            narrowest_penumbra(&pair, &plates)
        };
        // 1 wide, √3 away at most; the lower plate counts.
        let high = (DVec3::new(0.2, 0.2, 0.5), 0.5);
        let low = (DVec3::new(0.0, 0.0, 0.1), 0.5);
        assert!((width(&[high]) - 0.5 / 3f64.sqrt()).abs() < 1e-12);
        assert!((width(&[high, low]) - 0.1 / 3f64.sqrt()).abs() < 1e-12);
    }
}
