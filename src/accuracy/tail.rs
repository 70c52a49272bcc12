//! The tail of the errors: the points with the largest that together have a given share of the
//! area.

use rayon::prelude::*;

/// What of each point is not in the tail.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Trimmed {
    /// Share of each point's area that is not in the tail: 0 or 1, but for one point.
    pub kept: Vec<f64>,
    /// Error of the point through which the cut goes; infinite without a tail.
    pub cut: f64,
}

/// Points in the order of their errors, from the largest down.
pub(crate) struct Ranking<'a> {
    points: &'a [(f64, f64)],
    order: Vec<u32>,
    /// Sum of the areas.
    area: f64,
}

impl Ranking<'_> {
    /// Each of `points` has an area and an error, in any unit; of equal errors, the first is first.
    pub fn new(points: &[(f64, f64)]) -> Ranking<'_> {
        let mut order: Vec<u32> = (0..points.len() as u32).collect();
        let error = |k: u32| points[k as usize].1;
        order.par_sort_unstable_by(|&a, &b| error(b).total_cmp(&error(a)).then(a.cmp(&b)));
        Ranking { points, order, area: points.iter().map(|(area, _)| area).sum() }
    }

    /// Splits off a `tail`, a share of the area: the points with the largest errors.
    pub fn trimmed(&self, tail: f64) -> Trimmed {
        let mut kept = vec![1.0; self.points.len()];
        let mut cut = f64::INFINITY;
        let mut room = tail * self.area;
        if room <= 0.0 {
            return Trimmed { kept, cut };
        }
        for &k in &self.order {
            let (area, error) = self.points[k as usize];
            cut = error;
            if area > room {
                kept[k as usize] = 1.0 - room / area;
                break;
            }
            kept[k as usize] = 0.0;
            room -= area;
        }
        Trimmed { kept, cut }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tail_is_largest_errors_by_area() {
        let points = [(1.0, 3.0), (2.0, 5.0), (4.0, 1.0), (1.0, 3.0)];
        // An eighth, a quarter, and all of what is above: areas 2 of error 5, then 1 and 1 of 3.
        let ranking = Ranking::new(&points);
        let of = |tail| ranking.trimmed(tail);
        assert_eq!(of(0.0), Trimmed { kept: vec![1.0; 4], cut: f64::INFINITY });
        assert_eq!(of(0.125), Trimmed { kept: vec![1.0, 0.5, 1.0, 1.0], cut: 5.0 });
        assert_eq!(of(0.3125), Trimmed { kept: vec![0.5, 0.0, 1.0, 1.0], cut: 3.0 });
        assert_eq!(of(0.5), Trimmed { kept: vec![0.0, 0.0, 1.0, 0.0], cut: 1.0 });
    }
}
