//! Double logarithmic axes, and labels beside points.

use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

use super::grid::short;
use crate::canvas::{At, Canvas, Drawn, FAINT, Font, GREY, LIGHT};

/// A rectangle with seconds from left to right and an error from below, both logarithmic.
pub struct Axes {
    pub left: f64,
    pub top: f64,
    pub right: f64,
    pub bottom: f64,
    pub seconds: [f64; 2],
    pub errors: [f64; 2],
    taken: Vec<Taken>,
    crossed: Vec<At>,
}

/// What is covered: left, top, right, bottom.
type Taken = [f64; 4];

impl Axes {
    pub fn new(frame: [f64; 4], seconds: [f64; 2], errors: [f64; 2]) -> Axes {
        let [left, top, right, bottom] = frame;
        Axes { left, top, right, bottom, seconds, errors, taken: vec![], crossed: vec![] }
    }

    pub fn at(&self, seconds: f64, error: f64) -> At {
        let share = |v: f64, [low, high]: [f64; 2]| (v / low).ln() / (high / low).ln();
        let x = self.left + (self.right - self.left) * share(seconds, self.seconds);
        (x, self.bottom - (self.bottom - self.top) * share(error, self.errors))
    }

    pub fn holds(&self, (x, y): At) -> bool {
        x >= self.left && x <= self.right && y >= self.top && y <= self.bottom
    }

    /// Grid lines, numbers and names of the axes.
    pub fn draw<B: DrawingBackend>(&self, canvas: &Canvas<B>, size: f64, named: bool) -> Drawn {
        let font = Font::new(size, GREY);
        for s in ticks(self.seconds) {
            let (x, _) = self.at(s, 1.0);
            canvas.line(&[(x, self.top), (x, self.bottom)], FAINT, 1.0)?;
            let below = (x, self.bottom + 0.9 * size);
            canvas.text(&short(s), below, font.anchor(HPos::Center))?;
        }
        for e in ticks(self.errors.map(|e| 100.0 * e)) {
            let (_, y) = self.at(1.0, e / 100.0);
            canvas.line(&[(self.left, y), (self.right, y)], FAINT, 1.0)?;
            canvas.text(&short(e), (self.left - 7.0, y), font.anchor(HPos::Right))?;
        }
        let (l, t, r, b) = (self.left, self.top, self.right, self.bottom);
        canvas.line(&[(l, t), (r, t), (r, b), (l, b), (l, t)], LIGHT, 1.0)?;
        let font = Font::new(size, BLACK).anchor(HPos::Center);
        canvas.text("seconds", ((l + r) / 2.0, b + 2.3 * size), font)?;
        if named {
            let at = (l - 3.4 * size, (t + b) / 2.0);
            canvas.upright("RMS error, % of radiosity", at, font)?;
        }
        Ok(())
    }

    /// Keeps labels off a mark.
    pub fn take(&mut self, (x, y): At, radius: f64) {
        let r = radius + 4.0;
        self.taken.push([x - r, y - r, x + r, y + r]);
    }

    /// Keeps labels off a line, where there is another place for them.
    pub fn cross(&mut self, points: &[At]) {
        for pair in points.windows(2) {
            let ((a, b), (c, d)) = (pair[0], pair[1]);
            let steps = ((c - a).hypot(d - b) / 4.0).ceil().max(1.0);
            let step = |k: usize| k as f64 / steps;
            let between = (0..=steps as usize).map(step);
            self.crossed.extend(between.map(|s| (a + s * (c - a), b + s * (d - b))));
        }
    }

    /// Writes a label where it covers least, near what it is for.
    pub fn label<B: DrawingBackend>(
        &mut self,
        canvas: &Canvas<B>,
        text: &str,
        (x, y): At,
        font: Font,
    ) -> Drawn {
        let (width, height) = (canvas.text_width(text, font)?, 0.95 * font.size);
        let mut best = (f64::INFINITY, [0.0; 4], 0.0);
        for away in [10.0, 14.0, 20.0, 28.0, 38.0, 50.0, 64.0, 80.0, 98.0] {
            for turn in 0..16 {
                let (sin, cos) = (f64::from(turn) * std::f64::consts::TAU / 16.0).sin_cos();
                // The nearest point of the box lies that far away.
                let middle_x =
                    x + cos * away + cos.signum() * f64::min(1.0, 2.0 * cos.abs()) * width / 2.0;
                let middle_y = y + sin * (away + height / 2.0);
                let rect = [
                    middle_x - width / 2.0,
                    middle_y - height / 2.0,
                    middle_x + width / 2.0,
                    middle_y + height / 2.0,
                ];
                let outside = rect[0] < self.left + 2.0
                    || rect[1] < self.top + 2.0
                    || rect[2] > self.right - 2.0
                    || rect[3] > self.bottom - 2.0;
                let covered: f64 = self.taken.iter().map(|&t| overlap(t, rect)).sum();
                let inside = |&&(a, b): &&At| {
                    a > rect[0] - 2.0 && a < rect[2] + 2.0 && b > rect[1] && b < rect[3]
                };
                let crossed = self.crossed.iter().filter(inside).count() as f64;
                let cost = if outside { 1e9 } else { 0.0 } + 50.0 * covered + 6.0 * crossed + away;
                if cost < best.0 {
                    best = (cost, rect, away);
                }
            }
        }
        let (_, rect, away) = best;
        if away > 20.0 {
            let end = (x.clamp(rect[0], rect[2]), y.clamp(rect[1], rect[3]));
            canvas.line(&[(x, y), end], font.colour, 1.0)?;
            self.cross(&[(x, y), end]);
        }
        self.taken.push(rect);
        let at = ((rect[0] + rect[2]) / 2.0, (rect[1] + rect[3]) / 2.0);
        canvas.text(text, at, font.anchor(HPos::Center))
    }
}

fn overlap(a: Taken, b: Taken) -> f64 {
    let width = a[2].min(b[2]) - a[0].max(b[0]);
    let height = a[3].min(b[3]) - a[1].max(b[1]);
    width.max(0.0) * height.max(0.0)
}

/// Round numbers in a range: 1, 2 and 5 times powers of ten, or these powers alone.
fn ticks([low, high]: [f64; 2]) -> Vec<f64> {
    let digits: &[f64] = if high / low < 1000.0 { &[1.0, 2.0, 5.0] } else { &[1.0] };
    let powers = low.log10().floor() as i32..=high.log10().ceil() as i32;
    let all = powers.flat_map(|p| digits.iter().map(move |d| d * 10f64.powi(p)));
    all.filter(|&v| v >= low && v <= high).collect()
}

/// The range of `values`, and some more on both sides.
pub fn range(values: impl Iterator<Item = f64>, more: f64) -> [f64; 2] {
    let values = values.filter(|v| v.is_finite() && *v > 0.0);
    let (low, high) =
        values.fold((f64::INFINITY, 0.0), |(l, h): (f64, f64), v| (l.min(v), h.max(v)));
    if low > high {
        return [0.1, 10.0];
    }
    let more = (high / low).powf(more).max(1.3);
    [low / more, high * more]
}
