//! The tail of the errors: the points with the largest that together have a given share of the
//! area.

use super::largest_first::in_order;

/// What of each point is not in the tail.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Trimmed {
    /// Share of each point's area that is not in the tail: 0 or 1, but for one point.
    pub kept: Vec<f64>,
    /// Error of the point through which the cut goes; infinite without a tail.
    pub cut: f64,
}

/// Splits off a `tail`, a share of the area: the points with the largest errors. Each of `points`
/// has an area and an error, in any unit; of equal errors, the first is first.
pub(crate) fn trimmed(points: &[(f64, f64)], tail: f64) -> Trimmed {
    let mut kept = vec![1.0; points.len()];
    let mut cut = f64::INFINITY;
    let mut room = tail * points.iter().map(|(area, _)| area).sum::<f64>();
    if room <= 0.0 {
        return Trimmed { kept, cut };
    }
    let error = |k: u32| points[k as usize].1;
    let all = (0..points.len() as u32).collect();
    for k in in_order(all, |&a: &u32, &b| error(b).total_cmp(&error(a)).then(a.cmp(&b))) {
        let (area, error) = points[k as usize];
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tail_is_largest_errors_by_area() {
        let points = [(1.0, 3.0), (2.0, 5.0), (4.0, 1.0), (1.0, 3.0)];
        // An eighth, a quarter, and all of what is above: areas 2 of error 5, then 1 and 1 of 3.
        let of = |tail| trimmed(&points, tail);
        assert_eq!(of(0.0), Trimmed { kept: vec![1.0; 4], cut: f64::INFINITY });
        assert_eq!(of(0.125), Trimmed { kept: vec![1.0, 0.5, 1.0, 1.0], cut: 5.0 });
        assert_eq!(of(0.3125), Trimmed { kept: vec![0.5, 0.0, 1.0, 1.0], cut: 3.0 });
        assert_eq!(of(0.5), Trimmed { kept: vec![0.0, 0.0, 1.0, 0.0], cut: 1.0 });
    }
}
