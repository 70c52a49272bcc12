//! Means of an image over triangles, by integrals along their sides.
//!
//! ```text
//!   ∬ f dx dy = ∮ F dy,   F(x, y) = ∫₀ˣ f(t, y) dt                      (Green 1828)
//!
//!   ┌───┬───┬───┬───┐     Cells are squares of one colour, so that F is linear along x in each,
//!   │   │  ╱│   │   │     and the integral over the part of a side within a cell is F at its
//!   ├───┼─╱─┼───┼───┤     middle times dy. F is a sum over the cells of a row to the left, kept
//!   │   │╱  │   │   │     for every sixteenth of them.
//!   └───┴───┴───┴───┘
//! ```
//!
//! So a mean is exact for every triangle, and its cost is proportional to the outline in cells,
//! not to the area or to how often the image repeats in it.

use glam::DVec2;

use crate::scene::rgb::Rgb;

/// Cells per kept sum: two bytes for each texel, with those of coarser levels. Plain choice.
const BLOCK: usize = 16;

/// Sums over the cells of each row of an image, in columns of texels.
pub(super) struct RowSums {
    /// Cells along a row, and rows.
    cells: [u32; 2],
    /// Texels along u and v.
    texels: [u32; 2],
    /// Texels across a cell; the last one may be narrower.
    cell_width: f64,
    blocks_per_row: usize,
    /// For each block of a row, the sum over all cells before it.
    before: Vec<[f64; 3]>,
}

/// How an image continues along one axis.
#[derive(Clone, Copy)]
struct Axis {
    /// Texels.
    extent: f64,
    /// Texels across a cell; the last one may be narrower.
    cell: f64,
    cells: u32,
    /// Whether the border goes on beyond the image, which else repeats.
    clamped: bool,
}

impl Axis {
    /// The repetition that contains `position`, and the cell of it.
    fn cell_at(&self, position: f64) -> (f64, u32) {
        let repetition = if self.clamped { 0.0 } else { (position / self.extent).floor() };
        let within = (position - repetition * self.extent) / self.cell;
        // Saturating, as borders go on.
        (repetition, (within as u32).min(self.cells - 1))
    }

    /// The borders of cells above `low` and below `high`, ascending.
    fn borders(self, low: f64, high: f64) -> impl Iterator<Item = f64> {
        let (mut repetition, cell) = self.cell_at(low);
        let mut next = cell + 1;
        std::iter::from_fn(move || {
            loop {
                if next >= self.cells {
                    if self.clamped {
                        return None;
                    }
                    (repetition, next) = (repetition + 1.0, 0);
                }
                let border = repetition * self.extent + f64::from(next) * self.cell;
                next += 1;
                if border >= high {
                    return None;
                }
                if border > low {
                    return Some(border);
                }
            }
        })
    }

    /// Crossings of borders along `length` texels, at most.
    fn crossings(&self, length: f64) -> f64 {
        length.abs() / self.cell.min(self.extent)
    }
}

impl RowSums {
    /// Of an image of this many `texels`, in this many `cells` that are `cell_width` texels wide,
    /// each of the colour that `cell` has for a column and a row.
    pub fn new(
        texels: [u32; 2],
        cells: [u32; 2],
        cell_width: f64,
        cell: impl Fn(u32, u32) -> Rgb,
    ) -> RowSums {
        let [columns, rows] = cells;
        let blocks_per_row = (columns as usize).div_ceil(BLOCK);
        let mut before = Vec::with_capacity(blocks_per_row * rows as usize);
        for y in 0..rows {
            let mut sum = Rgb::ZERO;
            for x in 0..columns {
                if (x as usize).is_multiple_of(BLOCK) {
                    before.push((cell_width * sum).to_array());
                }
                sum += cell(x, y);
            }
        }
        RowSums { cells, texels, cell_width, blocks_per_row, before }
    }

    /// Mean over the triangle with these `corners` in texels, rows from the top; `cell` as it was
    /// for the sums. None where the triangle is thinner than rounding, or where its sides cross
    /// more than `crossings` cells.
    pub fn mean(
        &self,
        corners: [DVec2; 3],
        clamped: bool,
        crossings: f64,
        cell: impl Fn(u32, u32) -> Rgb,
    ) -> Option<Rgb> {
        let axis = |k: usize| Axis {
            extent: self.texels[k].into(),
            cell: self.cell_width,
            cells: self.cells[k],
            clamped,
        };
        let axes = [axis(0), axis(1)];
        let cell_of = |p: DVec2| [axes[0].cell_at(p.x), axes[1].cell_at(p.y)];
        let [a, b, c] = corners;
        if cell_of(a) == cell_of(b) && cell_of(b) == cell_of(c) {
            let [(_, column), (_, row)] = cell_of(a);
            return Some(cell(column, row));
        }
        let sides = [(a, b), (b, c), (c, a)];
        let crossed = |&(p, q): &(DVec2, DVec2)| {
            let [x, y] = (q - p).to_array();
            axes[0].crossings(x) + axes[1].crossings(y)
        };
        let outline: f64 = sides.iter().map(|(p, q)| p.distance(*q)).sum();
        let area = 0.5 * (b - a).perp_dot(c - a);
        // F is up to a row long, in 53 bits, and so is its integral along the outline.
        let rounding = f64::EPSILON * outline * (axes[0].extent + corners_reach(corners));
        let is_thin = area.abs() * 1e-6 <= rounding;
        if is_thin || sides.iter().map(crossed).sum::<f64>() > crossings {
            return None;
        }
        let integral: Rgb = sides.into_iter().map(|(p, q)| self.integral(p, q, axes, &cell)).sum();
        Some((integral / area).max(Rgb::ZERO))
    }

    /// ∫ F dy along the straight line from `p` to `q`, texels.
    fn integral(
        &self,
        p: DVec2,
        q: DVec2,
        [across, down]: [Axis; 2],
        cell: &impl Fn(u32, u32) -> Rgb,
    ) -> Rgb {
        if p.y == q.y {
            return Rgb::ZERO;
        }
        let (low, high, sign) = if p.y < q.y { (p, q, 1.0) } else { (q, p, -1.0) };
        let slope = (high.x - low.x) / (high.y - low.y);
        let mut sum = Rgb::ZERO;
        let mut from = low;
        let ends = down.borders(low.y, high.y).map(|y| DVec2::new(low.x + (y - low.y) * slope, y));
        for to in ends.chain([high]) {
            let (_, row) = down.cell_at(0.5 * (from.y + to.y));
            let (left, right) = (from.x.min(to.x), from.x.max(to.x));
            let width = right - left;
            let mut start = left;
            for end in across.borders(left, right).chain([right]) {
                let share = if width > 0.0 { (end - start) / width } else { 1.0 };
                let middle = 0.5 * (start + end);
                sum += share * (to.y - from.y) * self.row_integral(middle, row, across, cell);
                start = end;
            }
            from = to;
        }
        sign * sum
    }

    /// F: the integral along `row` from 0 to `x`, texels.
    fn row_integral(&self, x: f64, row: u32, across: Axis, cell: &impl Fn(u32, u32) -> Rgb) -> Rgb {
        let (repetition, column) = across.cell_at(x);
        let (start, last) = (f64::from(column) * across.cell, across.cells - 1);
        let within = x - repetition * across.extent - start;
        let integral = self.sum_before(column, row, cell) + within * cell(column, row);
        if repetition == 0.0 {
            return integral;
        }
        let rest = across.extent - f64::from(last) * across.cell;
        integral + repetition * (self.sum_before(last, row, cell) + rest * cell(last, row))
    }

    /// The sum over the cells of `row` before `column`, in columns of texels.
    fn sum_before(&self, column: u32, row: u32, cell: &impl Fn(u32, u32) -> Rgb) -> Rgb {
        let block = column as usize / BLOCK;
        let first = (block * BLOCK) as u32;
        let rest: Rgb = (first..column).map(|x| cell(x, row)).sum();
        Rgb::from(self.before[row as usize * self.blocks_per_row + block]) + self.cell_width * rest
    }
}

/// How far the corners are from the first column.
fn corners_reach(corners: [DVec2; 3]) -> f64 {
    corners.iter().map(|corner| corner.x.abs()).fold(0.0, f64::max)
}
