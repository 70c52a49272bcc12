//! A smooth field through the values of a grid, and lines of equal value in it.
//!
//! Values stand in the middles of cells; between them the field is cubic in both directions
//! (Catmull and Rom 1974), and beyond the outermost ones it goes on straight. Cells without a value
//! get one from their neighbours first, so that the field goes on to their edge; nothing is shown
//! in them.

/// A line's straight piece, in cells from the grid's corner.
pub type Segment = [[f64; 2]; 2];

/// The values of a grid, and what is between them.
pub struct Field {
    counts: [usize; 2],
    /// Row by row, gaps filled.
    values: Vec<f64>,
    is_shown: Vec<bool>,
    range: [f64; 2],
}

impl Field {
    /// Through `values`, row by row; none if there is no value.
    pub fn new(counts: [usize; 2], values: &[Option<f64>]) -> Option<Field> {
        let is_shown: Vec<bool> = values.iter().map(Option::is_some).collect();
        let known = || values.iter().flatten().copied();
        let range = [known().reduce(f64::min)?, known().reduce(f64::max)?];
        Some(Field { counts, values: filled(counts, values), is_shown, range })
    }

    /// The least and the largest value of a cell.
    pub fn range(&self) -> [f64; 2] {
        self.range
    }

    /// Whether the cell around this place has a value.
    pub fn is_shown(&self, place: [f64; 2]) -> bool {
        let [column, row] =
            [0, 1].map(|axis| (place[axis].max(0.0) as usize).min(self.counts[axis] - 1));
        self.is_shown[row * self.counts[0] + column]
    }

    /// The value at a place, in cells from the grid's corner: not beyond that of any cell.
    pub fn at(&self, place: [f64; 2]) -> f64 {
        let along = |axis: usize| {
            let x = place[axis] - 0.5;
            let first = x.floor().clamp(0.0, (self.counts[axis] as f64 - 2.0).max(0.0));
            (first as usize, cubic_weights(x - first))
        };
        let ((column, across), (row, up)) = (along(0), along(1));
        let mut sum = 0.0;
        for (j, weight) in up.iter().enumerate() {
            for (i, share) in across.iter().enumerate() {
                sum += weight * share * self.value(column + i, row + j);
            }
        }
        sum.clamp(self.range[0], self.range[1])
    }

    /// The value of a cell, counted from 1 on; one before the first and behind the last go on
    /// straight.
    fn value(&self, column: usize, row: usize) -> f64 {
        let [columns, rows] = self.counts;
        let in_row = |column: usize, row: usize| {
            let at = |k: usize| self.values[row * columns + k];
            straight(column, columns, at)
        };
        straight(row, rows, |row| in_row(column, row))
    }

    /// Pieces of the line where the field is `level`, found on `steps` squares a cell by linear
    /// interpolation along their edges (marching squares: W. E. Lorensen and H. E. Cline 1987, in
    /// the plane).
    pub fn line(&self, level: f64, steps: usize) -> Vec<Segment> {
        let [columns, rows] = self.counts.map(|count| count * steps);
        let place = |i: usize, j: usize| [i, j].map(|k| k as f64 / steps as f64);
        let mut lines = vec![];
        let row_of = |j: usize| -> Vec<f64> {
            (0..=columns).map(|i| self.at(place(i, j)) - level).collect()
        };
        let mut below = row_of(0);
        for j in 0..rows {
            let above = row_of(j + 1);
            for i in 0..columns {
                let middle = [i, j].map(|k| (k as f64 + 0.5) / steps as f64);
                if !self.is_shown(middle) {
                    continue;
                }
                let corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
                let values = [below[i], below[i + 1], above[i + 1], above[i]];
                let crossing = |k: usize| {
                    let (a, b) = (values[k], values[(k + 1) % 4]);
                    let share = a / (a - b);
                    let [p, q] = [corners[k], corners[(k + 1) % 4]].map(|(i, j)| place(i, j));
                    ((a < 0.0) != (b < 0.0))
                        .then(|| [0, 1].map(|axis| p[axis] + share * (q[axis] - p[axis])))
                };
                let crossings: Vec<[f64; 2]> = (0..4).filter_map(crossing).collect();
                // Two, or four around a saddle: those that follow one another.
                lines.extend(crossings.chunks_exact(2).map(|pair| [pair[0], pair[1]]));
            }
            below = above;
        }
        lines
    }
}

/// Of values of `count` cells, that of cell `k`, counted from 1 on: straight on beyond both ends.
fn straight(k: usize, count: usize, at: impl Fn(usize) -> f64) -> f64 {
    let second = |k: usize| if count > 1 { at(k) } else { at(0) };
    match k {
        0 => 2.0 * at(0) - second(1),
        k if k > count => 2.0 * at(count - 1) - second(count.saturating_sub(2)),
        k => at(k - 1),
    }
}

/// Weights of four values in a row at a share `t` of the way from the second to the third; straight
/// through these two where it is off the way.
fn cubic_weights(t: f64) -> [f64; 4] {
    if !(0.0..=1.0).contains(&t) {
        return [0.0, 1.0 - t, t, 0.0];
    }
    let (t2, t3) = (t * t, t * t * t);
    [
        0.5 * (-t + 2.0 * t2 - t3),
        0.5 * (2.0 - 5.0 * t2 + 3.0 * t3),
        0.5 * (t + 4.0 * t2 - 3.0 * t3),
        0.5 * (t3 - t2),
    ]
}

/// `values` with the mean of their neighbours where there is none, from the edges of gaps inwards.
fn filled([columns, rows]: [usize; 2], values: &[Option<f64>]) -> Vec<f64> {
    let mut values = values.to_vec();
    while values.iter().any(Option::is_none) && values.iter().any(Option::is_some) {
        let before = values.clone();
        for (k, value) in values.iter_mut().enumerate().filter(|(_, value)| value.is_none()) {
            let (column, row) = (k % columns, k / columns);
            let near = |k: usize, count: usize| k.saturating_sub(1)..(k + 2).min(count);
            let around = near(row, rows).flat_map(|j| near(column, columns).map(move |i| (i, j)));
            let known: Vec<f64> = around.filter_map(|(i, j)| before[j * columns + i]).collect();
            if !known.is_empty() {
                *value = Some(known.iter().sum::<f64>() / known.len() as f64);
            }
        }
    }
    values.into_iter().map(Option::unwrap_or_default).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// x + 2 y at the middles of cells, but for one gap.
    fn plane() -> Field {
        let values = (0..35).map(|k| Some((k % 7) as f64 + 2.0 * (k / 7) as f64));
        let mut values: Vec<Option<f64>> = values.collect();
        values[10] = None;
        Field::new([7, 5], &values).unwrap()
    }

    #[test]
    fn field_goes_through_its_values() {
        let field = plane();
        assert_eq!(field.range(), [0.0, 14.0]);
        for k in 0..35 {
            let (column, row) = ((k % 7) as f64, (k / 7) as f64);
            // The gap is linear in its neighbours, which are even around it.
            assert!((field.at([column + 0.5, row + 0.5]) - column - 2.0 * row).abs() < 1e-12);
            assert_eq!(field.is_shown([column + 0.9, row + 0.1]), k != 10);
        }
        // Cubics give linear fields again, to the edge but for what is beyond all values.
        for [x, y] in [[3.2, 2.7], [0.1, 2.6], [6.9, 0.2], [3.3, 4.9]] {
            assert!((field.at([x, y]) - (x - 0.5) - 2.0 * (y - 0.5)).abs() < 1e-12, "{x} {y}");
        }
        assert_eq!(field.at([0.0, 0.0]), 0.0);
        let row = Field::new([3, 1], &[Some(1.0), Some(2.0), Some(4.0)]).unwrap();
        assert!([0.1, 0.9].iter().all(|y| (row.at([1.5, *y]) - 2.0).abs() < 1e-12));
        assert!(Field::new([2, 1], &[None, None]).is_none());
    }

    #[test]
    fn lines_run_where_the_field_has_their_level() {
        let field = plane();
        let line = field.line(6.3, 4);
        assert!(!line.is_empty());
        let mut length = 0.0;
        for [a, b] in line {
            assert!((field.at(a) - 6.3).abs() < 1e-12 && (field.at(b) - 6.3).abs() < 1e-12);
            length += (a[0] - b[0]).hypot(a[1] - b[1]);
        }
        // x + 2 y = 7.8 from x = 0 to x = 7, without the gap: it crosses that from x = 3.8 to 4.
        assert!((length - 6.8 * 1.25f64.sqrt()).abs() < 1e-9, "{length}");
    }
}
