//! Segments split where they cross, on a lattice finer than that of their ends, so that hardly any
//! two have a point in common but ends.
//!
//! A crossing is rounded to the lattice, and its segments bend there; they may cross others then,
//! so that it is done again until none crosses (J. D. Hobby, "Practical segment intersection with
//! finite precision output", 1999).

use super::snapping::{LatticePoint, STEPS};

/// Steps of the finer lattice in one of the other.
const FINER: i64 = 4;

/// Steps of the finer lattice along a side.
pub(super) const FINE_STEPS: i64 = FINER * STEPS as i64;

/// A point on the finer lattice.
pub(super) type FinePoint = [i64; 2];

type Segment = [FinePoint; 2];

/// Rounds after which those that still cross are left so: within a few steps of an end of one.
const ROUNDS: usize = 16;

/// `segments` in parts. Crossings inside the triangle stay off its sides, whose points are those of
/// the triangle beyond, too.
pub(super) fn split_at_crossings(segments: &[[LatticePoint; 2]]) -> Vec<Segment> {
    let fine = |point: LatticePoint| point.map(|k| FINER * i64::from(k));
    let mut all: Vec<Segment> = segments.iter().map(|ends| ends.map(fine)).collect();
    for _ in 0..ROUNDS {
        all.iter_mut().for_each(|ends| ends.sort_unstable());
        all.sort_unstable();
        all.dedup();
        let splits = splits(&all);
        let count = all.len();
        all = all.iter().zip(splits).flat_map(|(ends, points)| parts(*ends, points)).collect();
        if all.len() == count {
            break;
        }
    }
    all
}

/// The points at which each of `all`, sorted by their first ends, is split.
fn splits(all: &[Segment]) -> Vec<Vec<FinePoint>> {
    let mut splits = vec![vec![]; all.len()];
    for (i, &[a, b]) in all.iter().enumerate() {
        for (j, &[c, d]) in all.iter().enumerate().skip(i + 1) {
            if c[0] > b[0] {
                break;
            }
            let [of_c, of_d] = [c, d].map(|p| orientation([a, b], p));
            let [of_a, of_b] = [a, b].map(|p| orientation([c, d], p));
            if of_c.signum() * of_d.signum() < 0 && of_a.signum() * of_b.signum() < 0 {
                let crossing = inside(rounded([a, b], of_a, of_a - of_b));
                splits[i].push(crossing);
                splits[j].push(crossing);
            }
            splits[i]
                .extend([(c, of_c), (d, of_d)].into_iter().filter(|(_, o)| *o == 0).map(first));
            splits[j]
                .extend([(a, of_a), (b, of_b)].into_iter().filter(|(_, o)| *o == 0).map(first));
        }
    }
    splits
}

fn first((point, _): (FinePoint, i128)) -> FinePoint {
    point
}

/// Twice the area of a segment and a point: positive to its left.
fn orientation([a, b]: Segment, p: FinePoint) -> i128 {
    let difference = |k: usize, q: FinePoint| i128::from(q[k] - a[k]);
    difference(0, b) * difference(1, p) - difference(1, b) * difference(0, p)
}

/// The lattice point nearest to a + (b − a) part/whole.
fn rounded([a, b]: Segment, part: i128, whole: i128) -> FinePoint {
    let along = |k: usize| {
        let product = 2 * i128::from(b[k] - a[k]) * part + whole;
        a[k] + product.div_euclid(2 * whole) as i64
    };
    [along(0), along(1)]
}

/// The nearest point off the sides of the triangle.
fn inside([u, v]: FinePoint) -> FinePoint {
    let [u, v] = [u.max(1), v.max(1)];
    let beyond = (u + v - (FINE_STEPS - 1)).max(0);
    if u > v { [u - beyond, v] } else { [u, v - beyond] }
}

/// The parts of a segment between its ends and `points` near its line.
fn parts([a, b]: Segment, mut points: Vec<FinePoint>) -> Vec<Segment> {
    let along = |p: &FinePoint| {
        [0, 1].map(|k| i128::from(p[k] - a[k]) * i128::from(b[k] - a[k])).iter().sum::<i128>()
    };
    let length = along(&b);
    points.retain(|p| *p != a && *p != b && (1..length).contains(&along(p)));
    points.sort_by_key(along);
    points.push(b);
    points.dedup();
    let starts = std::iter::once(a).chain(points.clone());
    starts.zip(points).map(|(from, to)| [from, to]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use fastrand::Rng;
    use glam::DVec2;

    /// Random segments, long ones and ones of few steps: afterwards no two cross, but for some
    /// whose crossing is rounded to an end of one and lies beyond that of the other. Half a step of
    /// rounding is a few where the angle is small: 3.8 is the maximum in 5000 rounds.
    #[test]
    fn no_two_parts_cross() {
        let mut rng = Rng::with_seed(3);
        for round in 0..200 {
            let side = STEPS >> rng.u32(0..20);
            let mut point = || {
                let u = rng.u32(0..=side);
                [u, rng.u32(0..=side - u)]
            };
            let segments: Vec<_> = (0..20).map(|_| [point(), point()]).collect();
            let segments: Vec<_> = segments.into_iter().filter(|[a, b]| a != b).collect();
            let all = split_at_crossings(&segments);
            for (i, &[a, b]) in all.iter().enumerate() {
                for &[c, d] in &all[i + 1..] {
                    let [of_c, of_d] = [c, d].map(|p| orientation([a, b], p));
                    let [of_a, of_b] = [a, b].map(|p| orientation([c, d], p));
                    if of_c.signum() * of_d.signum() >= 0 || of_a.signum() * of_b.signum() >= 0 {
                        continue;
                    }
                    let share = of_a as f64 / (of_a - of_b) as f64;
                    let [a, b, c, d] = [a, b, c, d].map(|p| DVec2::from_array(p.map(|x| x as f64)));
                    let crossing = a.lerp(b, share);
                    let off = [a, b, c, d].map(|end| end.distance(crossing));
                    let off = off.into_iter().fold(f64::INFINITY, f64::min);
                    assert!(off < 8.0, "{round}: {off} steps: {segments:?}");
                }
            }
        }
    }
}
