//! The picture of a grid: each cell in the false colour of its value, and the scale of colours.

use plotters::prelude::RGBColor;
use plotters::style::text_anchor::HPos;
use radiosity::glam::DVec3;
use radiosity::grid::MeasuringGrid;

use crate::canvas::scale::Scale;
use crate::canvas::{self, BLACK, Canvas, Drawn, Font, GREY, Side};

/// Left and upper margin of the map, pixels.
const LEFT: f64 = 70.0;
const TOP: f64 = 92.0;

/// A grid as it is drawn.
pub struct Picture<'a> {
    pub grid: &'a MeasuringGrid,
    /// Of its points, in their order; none where there is none, or it is inside of a solid.
    pub values: Vec<Option<f64>>,
    pub title: String,
    /// Below the title.
    pub line: String,
    pub unit: &'a str,
    pub scale: Scale,
    /// Length of a metre in the scene's unit.
    pub metre: f64,
}

impl Picture<'_> {
    /// The picture as a PNG file.
    pub fn png(&self) -> Result<Vec<u8>, String> {
        let metres = self.grid.plane.edges.map(|edge: DVec3| edge.length() / self.metre);
        let longest = metres[0].max(metres[1]);
        let map = metres.map(|edge| (720.0 * edge / longest).max(120.0).round());
        // At least as wide as the lines of text.
        let width = LEFT + map[0].max(490.0) + 150.0;
        let size = (width as u32, (TOP + map[1] + 64.0) as u32);
        canvas::png(size, |canvas| self.draw(canvas, map, metres))
    }

    /// Draws on a `canvas`, with the map of this size in pixels and in metres.
    fn draw(&self, canvas: &Canvas, [width, height]: [f64; 2], metres: [f64; 2]) -> Drawn {
        canvas.text(&self.title, (LEFT, 24.0), Font::new(20.0, BLACK).bold())?;
        canvas.text(&self.line, (LEFT, 52.0), Font::new(16.0, GREY))?;
        let scale = &self.scale;
        let (right, bottom) = (LEFT + width, TOP + height);
        let [columns, rows] = self.grid.counts;
        let x = |column: usize| LEFT + width * column as f64 / columns as f64;
        let y = |row: usize| bottom - height * row as f64 / rows as f64;
        for (k, value) in self.values.iter().enumerate() {
            let colour =
                value.map_or(RGBColor(226, 226, 226), |value| Scale::colour(scale.share(value)));
            let (column, row) = (k % columns, k / columns);
            canvas.fill([x(column), y(row + 1), x(column + 1), y(row)], colour)?;
        }
        canvas.line(&[(LEFT, TOP), (right, TOP), (right, bottom)], BLACK, 1.0)?;
        let corner = (LEFT, bottom);
        canvas.axis(&Scale::up_to(metres[0]), [corner, (right, bottom)], Side::Below, 0.0)?;
        canvas.axis(&Scale::up_to(metres[1]), [corner, (LEFT, TOP)], Side::Left, 0.0)?;
        let font = Font::new(14.0, GREY).anchor(HPos::Center);
        canvas.text("metres", (LEFT + width / 2.0, bottom + 42.0), font)?;

        let (left, beside, steps) = (right + 28.0, right + 50.0, 128);
        let at = |share: f64| bottom - height * share;
        for k in 0..steps {
            let [low, high] = [k, k + 1].map(|k| f64::from(k) / f64::from(steps));
            let place = [left, at(high), beside, at(low)];
            canvas.fill(place, Scale::colour((low + high) / 2.0))?;
        }
        canvas.axis(scale, [(beside, bottom), (beside, TOP)], Side::Right, 0.0)?;
        canvas.text(self.unit, (left, TOP - 16.0), Font::new(14.0, BLACK).bold())
    }
}

/// A value with three digits, or all before the point.
pub fn three_digits(value: f64) -> String {
    let digits = (2.0 - libm::log10(value.abs()).floor()).clamp(0.0, 12.0) as usize;
    if value == 0.0 { "0".into() } else { format!("{value:.digits$}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits() {
        assert_eq!([123.4, 12.34, 0.01234, 0.0].map(three_digits), ["123", "12.3", "0.0123", "0"]);
    }
}
