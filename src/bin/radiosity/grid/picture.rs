//! The picture of a grid: false colours, lines of equal value with round numbers, a legend.

use plotters::prelude::{DrawingBackend, RGBColor};
use plotters::style::text_anchor::HPos;
use radiosity::grid::{GridStatistics, MeasuredGrid, Quantity};

use super::field::{Field, Segment};
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

/// Lines of equal value, at most.
const LINES: f64 = 12.0;

/// Shades between two lines.
const SHADES: f64 = 4.0;

/// Pixels between labels of one line, at the least.
const LABELS_APART: f64 = 260.0;

/// What has no value.
const NOTHING: RGBColor = RGBColor(226, 226, 226);

/// Viridis (S. van der Walt and N. Smith 2015) at eight even places, from dark to bright.
const COLOURS: [[f64; 3]; 8] = [
    [68.0, 1.0, 84.0],
    [70.0, 50.0, 127.0],
    [54.0, 92.0, 141.0],
    [39.0, 127.0, 142.0],
    [31.0, 161.0, 135.0],
    [74.0, 194.0, 109.0],
    [159.0, 218.0, 58.0],
    [253.0, 231.0, 37.0],
];

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
    /// Between lines of equal value.
    step: f64,
    /// Of the scale.
    range: [f64; 2],
}

impl Picture<'_> {
    /// The picture as a PNG file.
    pub fn png(&self) -> Result<Vec<u8>, String> {
        let values = self.measured.measured(self.quantity).map(|value| Some(value?[0]));
        let values: Vec<Option<f64>> = values.collect();
        let counts = self.measured.grid.counts;
        let field = Field::new(counts, &values).ok_or("no point outside of solids")?;
        let layout =
            Layout::new(&self.measured.grid.plane.edges.map(|e| e.length()), counts, &field);
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
                if field.is_shown(place) { layout.colour(field.at(place)) } else { NOTHING }
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
        for level in layout.levels() {
            let lines = field.line(level, steps);
            for [a, b] in &lines {
                canvas.line(&[layout.at(*a), layout.at(*b)], BLACK, 1.2)?;
            }
            let text = round(level, layout.step);
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
        let [low, high] = field.range();
        // Where all is alike the scale still has a width.
        let span = (high - low).max(1e-3 * high.abs()).max(f64::MIN_POSITIVE);
        let step = round_step(span / LINES);
        let range = [(low / step).floor() * step, (high / step).ceil() * step];
        let high = if range[1] > range[0] { range[1] } else { range[0] + step };
        Layout { size, cell, step, range: [range[0], high] }
    }

    /// Pixels of a place in cells; the second axis goes up.
    fn at(&self, place: [f64; 2]) -> At {
        (LEFT + place[0] * self.cell[0], TOP + self.size[1] - place[1] * self.cell[1])
    }

    /// The place in cells of pixels from the map's upper left corner.
    fn place(&self, (x, y): At) -> [f64; 2] {
        [x / self.cell[0], (self.size[1] - y) / self.cell[1]]
    }

    /// Round values between both ends of the scale.
    fn levels(&self) -> impl Iterator<Item = f64> {
        let [low, high] = self.range;
        let count = ((high - low) / self.step).round() as u32;
        (1..count).map(move |k| low + f64::from(k) * self.step)
    }

    /// That of the shade that a value is in.
    fn colour(&self, value: f64) -> RGBColor {
        let [low, high] = self.range;
        let shades = ((high - low) / self.step).round().max(1.0) * SHADES;
        let shade = ((value - low) / (high - low) * shades).floor().clamp(0.0, shades - 1.0);
        let place = shade / (shades - 1.0).max(1.0) * (COLOURS.len() - 1) as f64;
        let first = (place as usize).min(COLOURS.len() - 2);
        let share = place - first as f64;
        let [r, g, b] = [0, 1, 2].map(|c| {
            (COLOURS[first][c] + share * (COLOURS[first + 1][c] - COLOURS[first][c])).round() as u8
        });
        RGBColor(r, g, b)
    }

    /// Where the labels of a line go: far from other labels and from the edges. They are added to
    /// `taken`.
    fn labels(&self, lines: &[Segment], taken: &mut Vec<At>) -> Vec<At> {
        let mut own: Vec<At> = vec![];
        loop {
            let room = |&(x, y): &At| {
                let edges = [x - LEFT, LEFT + self.size[0] - x, y - TOP, TOP + self.size[1] - y];
                let edge = edges.into_iter().fold(f64::INFINITY, f64::min);
                let to = |others: &[At]| {
                    others.iter().map(|o| (o.0 - x).hypot(o.1 - y)).fold(f64::INFINITY, f64::min)
                };
                // Twice from an edge is as good as once from another label.
                (2.0 * edge).min(to(taken)).min(200.0) + 0.01 * to(&own).min(LABELS_APART)
            };
            let middles = lines.iter().map(|[a, b]| self.at([0, 1].map(|k| (a[k] + b[k]) / 2.0)));
            let apart =
                |at: &At| own.iter().all(|o| (o.0 - at.0).hypot(o.1 - at.1) >= LABELS_APART);
            let free = middles.filter(apart).map(|at| (room(&at), at));
            let Some((best, at)) = free.max_by(|a, b| a.0.total_cmp(&b.0)) else { return own };
            if best < 24.0 {
                return own;
            }
            own.push(at);
            taken.push(at);
        }
    }

    /// The scale beside the map, with the values of the lines.
    fn legend<B: DrawingBackend>(&self, canvas: &Canvas<B>, unit: &str) -> Drawn {
        let [low, high] = self.range;
        let (left, right) = (LEFT + self.size[0] + 28.0, LEFT + self.size[0] + 50.0);
        let height = self.size[1];
        let intervals = ((high - low) / self.step).round();
        let shades = intervals * SHADES;
        let y = |value: f64| TOP + height * (high - value) / (high - low);
        for k in 0..shades as u32 {
            let [from, to] = [k, k + 1].map(|k| low + (high - low) * f64::from(k) / shades);
            canvas.fill([left, y(to), right, y(from)], self.colour((from + to) / 2.0))?;
        }
        // Where there is no room for all numbers, every second, fifth, …
        let every = round_step(16.0 * intervals / height).max(1.0) as u32;
        for k in 0..=intervals as u32 {
            let value = low + f64::from(k) * self.step;
            canvas.line(&[(left, y(value)), (right, y(value))], BLACK, 1.0)?;
            if k % every == 0 {
                let at = (right + 8.0, y(value));
                canvas.text(&round(value, self.step), at, Font::new(14.0, BLACK))?;
            }
        }
        canvas.text(unit, (left, TOP - 16.0), Font::new(14.0, BLACK).bold())
    }
}

/// The next of 1, 2 and 5 times powers of ten that is no less than `step`.
fn round_step(step: f64) -> f64 {
    let power = 10f64.powf(step.log10().floor());
    let all = [1.0, 2.0, 5.0, 10.0].map(|digit| digit * power);
    all.into_iter().find(|round| *round >= step * (1.0 - 1e-9)).unwrap_or(10.0 * power)
}

/// A multiple of `step` with the digits that it takes.
fn round(value: f64, step: f64) -> String {
    let digits = (-step.log10().floor()).clamp(0.0, 12.0) as usize;
    let value = if value.abs() < step / 2.0 { 0.0 } else { value };
    format!("{value:.digits$}")
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
    fn steps_and_numbers_are_round() {
        for (step, want) in [(0.7, 1.0), (1.0, 1.0), (1.1, 2.0), (33.0, 50.0), (0.0021, 0.005)] {
            assert!((round_step(step) / want - 1.0).abs() < 1e-12, "{step}");
        }
        assert_eq!(
            [round(0.30000001, 0.1), round(-1e-17, 0.1), round(150.0, 50.0)],
            ["0.3", "0.0", "150"]
        );
        assert_eq!([123.4, 12.34, 0.01234, 0.0].map(three_digits), ["123", "12.3", "0.0123", "0"]);
    }
}
