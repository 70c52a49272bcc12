//! The picture of a grid: false colours, lines of equal value with round numbers, a legend.

use plotters::prelude::{DrawingBackend, RGBColor};
use plotters::style::text_anchor::HPos;
use radiosity::glam::DVec3;
use radiosity::grid::{GridStatistics, MeasuredGrid, Quantity};

use super::field::{Field, Segment};
use super::scale::{Scale, round, round_step};
use crate::canvas::{self, At, BLACK, Canvas, Drawn, Font, GREY, Mark};

/// Longest side of the map, and what is around it, in pixels.
const MAP: f64 = 720.0;
const LEFT: f64 = 70.0;
const TOP: f64 = 92.0;
const RIGHT: f64 = 150.0;
const BOTTOM: f64 = 64.0;

/// Least width and height of the map.
const NARROWEST: f64 = 120.0;

/// Width for the lines of text at the least.
const TEXT: f64 = 560.0;

/// Pixels between labels of one line, at the least.
const LABELS_APART: f64 = 260.0;

/// Pixels that a label takes from its middle, and from which on there is no need for more.
const ROOM: f64 = 24.0;
const FAR: f64 = 200.0;

/// What has no value.
const NOTHING: RGBColor = RGBColor(226, 226, 226);

/// A grid as it is drawn.
pub struct Picture<'a> {
    pub measured: &'a MeasuredGrid,
    pub statistics: &'a GridStatistics,
    pub quantity: Quantity,
    /// What is said below the title.
    pub place: &'a str,
    /// Length of a metre in the scene's unit.
    pub metre: f64,
}

/// Where things are on the canvas.
struct Layout {
    /// Of the map, in pixels.
    size: [f64; 2],
    /// Pixels a cell.
    cell: [f64; 2],
    scale: Scale,
}

impl Picture<'_> {
    /// The picture as a PNG file.
    pub fn png(&self) -> Result<Vec<u8>, String> {
        let values = self.measured.measured(self.quantity).map(|value| Some(value?[0]));
        let values: Vec<Option<f64>> = values.collect();
        let counts = self.measured.grid.counts;
        let field = Field::new(counts, &values).ok_or("no point outside of solids")?;
        let layout =
            Layout::new(&self.measured.grid.plane.edges.map(DVec3::length), counts, &field);
        let width = LEFT + layout.size[0].max(TEXT - LEFT) + RIGHT;
        let height = TOP + layout.size[1] + BOTTOM;
        canvas::png((width as u32, height as u32), |canvas| self.draw(canvas, &field, &layout))
    }

    fn draw<B: DrawingBackend>(&self, canvas: &Canvas<B>, field: &Field, layout: &Layout) -> Drawn {
        let quantity = match self.quantity {
            Quantity::Irradiance => "Irradiance",
            Quantity::Illuminance => "Illuminance",
        };
        let title = format!("{quantity} in {}, {}", self.quantity.unit(), self.place);
        canvas.text(&title, (LEFT, 24.0), Font::new(20.0, BLACK).bold())?;
        let GridStatistics { mean, minimum, maximum, uniformity, .. } = self.statistics;
        let line = format!(
            "mean {}   minimum {}   maximum {}   uniformity {uniformity:.2}",
            three_digits(*mean),
            three_digits(*minimum),
            three_digits(*maximum)
        );
        canvas.text(&line, (LEFT, 52.0), Font::new(16.0, GREY))?;
        self.map(canvas, field, layout)?;
        self.axes(canvas, layout)?;
        layout.legend(canvas, self.quantity.unit())
    }

    /// Colours, lines, and dots where it was measured.
    fn map<B: DrawingBackend>(&self, canvas: &Canvas<B>, field: &Field, layout: &Layout) -> Drawn {
        let [width, height] = layout.size.map(|pixels| pixels as usize);
        for y in 0..height {
            let colour_at = |x: usize| {
                let place = layout.place((x as f64 + 0.5, y as f64 + 0.5));
                if field.is_shown(place) {
                    layout.scale.colour(layout.scale.share(field.at(place)))
                } else {
                    NOTHING
                }
            };
            let mut start = 0;
            while start < width {
                let colour = colour_at(start);
                let end = (start..width).find(|&x| colour_at(x) != colour).unwrap_or(width);
                let row = [start, y, end, y + 1].map(|pixels| pixels as f64);
                let place = [LEFT + row[0], TOP + row[1], LEFT + row[2], TOP + row[3]];
                canvas.fill(place, colour)?;
                start = end;
            }
        }
        for (k, _) in self.measured.values.iter().enumerate().filter(|(_, v)| v.is_some()) {
            let columns = self.measured.grid.counts[0];
            let middle = [k % columns, k / columns].map(|n| n as f64 + 0.5);
            if field.is_shown(middle) {
                canvas.mark(Mark::Dot(1.3), layout.at(middle), RGBColor(255, 255, 255))?;
            }
        }
        let steps = (layout.cell[0].max(layout.cell[1]) / 6.0).ceil().max(1.0) as usize;
        let mut labels: Vec<At> = vec![];
        let mut texts = vec![];
        let levels = layout.scale.values();
        for (k, &level) in levels.iter().enumerate().skip(1).take(levels.len() - 2) {
            let lines = field.line(level, steps);
            for [a, b] in &lines {
                canvas.line(&[layout.at(*a), layout.at(*b)], BLACK, 1.2)?;
            }
            let text = layout.scale.text(k);
            for at in layout.labels(&lines, &mut labels) {
                texts.push((text.clone(), at));
            }
        }
        let font = Font::new(14.0, BLACK).bold().anchor(HPos::Center);
        for (text, (x, y)) in texts {
            let half = canvas.text_width(&text, font)? / 2.0 + 3.0;
            canvas.fill([x - half, y - 9.0, x + half, y + 9.0], RGBColor(255, 255, 255))?;
            canvas.text(&text, (x, y), font)?;
        }
        Ok(())
    }

    /// A frame, and metres along it.
    fn axes<B: DrawingBackend>(&self, canvas: &Canvas<B>, layout: &Layout) -> Drawn {
        let [width, height] = layout.size;
        let (right, bottom) = (LEFT + width, TOP + height);
        let frame = [(LEFT, TOP), (right, TOP), (right, bottom), (LEFT, bottom), (LEFT, TOP)];
        canvas.line(&frame, BLACK, 1.0)?;
        let font = Font::new(14.0, GREY);
        let lengths = self.measured.grid.plane.edges.map(|edge| edge.length() / self.metre);
        let step = round_step(lengths[0].max(lengths[1]) / 6.0);
        let ticks = |length: f64| {
            (0..).map(move |k| f64::from(k) * step).take_while(move |x| *x <= length * 1.0001)
        };
        for x in ticks(lengths[0]) {
            let at = LEFT + width * x / lengths[0];
            canvas.line(&[(at, bottom), (at, bottom + 5.0)], BLACK, 1.0)?;
            canvas.text(&round(x, step), (at, bottom + 16.0), font.anchor(HPos::Center))?;
        }
        for y in ticks(lengths[1]) {
            let at = bottom - height * y / lengths[1];
            canvas.line(&[(LEFT - 5.0, at), (LEFT, at)], BLACK, 1.0)?;
            canvas.text(&round(y, step), (LEFT - 9.0, at), font.anchor(HPos::Right))?;
        }
        let middle = (LEFT + width / 2.0, bottom + 40.0);
        canvas.text("metres", middle, font.anchor(HPos::Center))
    }
}

impl Layout {
    fn new(edges: &[f64; 2], counts: [usize; 2], field: &Field) -> Layout {
        let longest = edges[0].max(edges[1]);
        let size = edges.map(|edge| (MAP * edge / longest).max(NARROWEST).round());
        let cell = [0, 1].map(|axis| size[axis] / counts[axis] as f64);
        Layout { size, cell, scale: Scale::over(field.range()) }
    }

    /// Pixels of a place in cells; the second axis goes up.
    fn at(&self, place: [f64; 2]) -> At {
        (LEFT + place[0] * self.cell[0], TOP + self.size[1] - place[1] * self.cell[1])
    }

    /// The place in cells of pixels from the map's upper left corner.
    fn place(&self, (x, y): At) -> [f64; 2] {
        [x / self.cell[0], (self.size[1] - y) / self.cell[1]]
    }

    /// Where the labels of a line go: far from other labels and from the edges, and nowhere where
    /// there is no room. They are added to `taken`.
    fn labels(&self, lines: &[Segment], taken: &mut Vec<At>) -> Vec<At> {
        let mut own: Vec<At> = vec![];
        loop {
            let room = |&(x, y): &At| {
                let edges = [x - LEFT, LEFT + self.size[0] - x, y - TOP, TOP + self.size[1] - y];
                let edge = edges.into_iter().fold(f64::INFINITY, f64::min);
                // Labels are wider than high. As far from an edge as half of that from another.
                let others = taken.iter().map(|other| ((other.0 - x) / 2.0).hypot(other.1 - y));
                others.fold(2.0 * edge, f64::min).min(FAR)
            };
            let middles = lines.iter().map(|[a, b]| self.at([0, 1].map(|k| (a[k] + b[k]) / 2.0)));
            let apart =
                |at: &At| own.iter().all(|o| (o.0 - at.0).hypot(o.1 - at.1) >= LABELS_APART);
            let free = middles.filter(apart).map(|at| (room(&at), at));
            match free.max_by(|a, b| a.0.total_cmp(&b.0)) {
                Some((found, at)) if found >= ROOM => {
                    own.push(at);
                    taken.push(at);
                }
                _ => return own,
            }
        }
    }

    /// The scale beside the map, with the values of the lines.
    fn legend<B: DrawingBackend>(&self, canvas: &Canvas<B>, unit: &str) -> Drawn {
        let (left, right) = (LEFT + self.size[0] + 28.0, LEFT + self.size[0] + 50.0);
        let y = |share: f64| TOP + self.size[1] * (1.0 - share);
        let shades = self.scale.shades();
        for k in 0..shades as u32 {
            let [low, high] = [k, k + 1].map(|k| f64::from(k) / shades);
            let colour = self.scale.colour((low + high) / 2.0);
            canvas.fill([left, y(high), right, y(low)], colour)?;
        }
        let intervals = self.scale.values().len() - 1;
        // Where there is no room for all numbers, every second, fifth, …
        let every = round_step(16.0 * intervals as f64 / self.size[1]).max(1.0) as usize;
        for k in 0..=intervals {
            let at = y(k as f64 / intervals as f64);
            canvas.line(&[(left, at), (right, at)], BLACK, 1.0)?;
            if k % every == 0 {
                let text = self.scale.text(k);
                canvas.text(&text, (right + 8.0, at), Font::new(14.0, BLACK))?;
            }
        }
        canvas.text(unit, (left, TOP - 16.0), Font::new(14.0, BLACK).bold())
    }
}

/// A value with three digits, or all before the point.
pub fn three_digits(value: f64) -> String {
    let digits = (2.0 - value.abs().log10().floor()).clamp(0.0, 12.0) as usize;
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
