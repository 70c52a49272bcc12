//! The chart: error over time of all runs in one panel, then of each setting's runs by themselves.

use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

use super::Results;
use super::grid::{Panel, Target, percent};
use super::plot::{Axes, range};
use crate::canvas::{self, BLACK, Canvas, Drawn, Font, GREY, LIGHT, Mark};

const WIDTH: u32 = 1200;
const HEIGHT: u32 = 1700;

const FRONT: RGBColor = RGBColor(31, 95, 168);
const TARGET: RGBColor = RGBColor(205, 72, 20);
const SERIES: [RGBColor; 3] = [FRONT, RGBColor(150, 60, 140), RGBColor(30, 130, 70)];

pub fn svg(results: &Results) -> Result<String, String> {
    canvas::svg((WIDTH, HEIGHT), |canvas| results.draw(canvas))
}

pub fn png(results: &Results) -> Result<Vec<u8>, String> {
    canvas::png((WIDTH, HEIGHT), |canvas| results.draw(canvas))
}

impl Results {
    fn draw<B: DrawingBackend>(&self, canvas: &Canvas<B>) -> Drawn {
        let middle = f64::from(WIDTH) / 2.0;
        let title = format!("What a bake of {} costs and how far it is off", self.scene);
        canvas.text(&title, (middle, 32.0), Font::new(30.0, BLACK).bold().anchor(HPos::Center))?;
        let tail = 100.0 * self.measure.tail;
        let against = format!("root mean square errors without a tail of {tail} % of the area");
        let line = format!("{}; {against}", self.adapter);
        canvas.text(&line, (middle, 68.0), Font::new(19.0, GREY).anchor(HPos::Center))?;
        self.legend(canvas, 104.0)?;
        self.main(canvas, [95.0, 128.0, 1180.0, 790.0])?;

        let runs = || self.grid.panels.iter().flat_map(|p| &p.series).flat_map(|s| &s.runs);
        let seconds = range(runs().map(|r| self.measured[r.1].seconds), 0.1);
        let errors = range(runs().map(|r| self.measured[r.1].known_error()), 0.12);
        let heading = format!(
            "One knob at a time, around the settings meant for {} (ringed)",
            percent(self.grid.base_error)
        );
        let font = Font::new(24.0, BLACK).bold().anchor(HPos::Center);
        canvas.text(&heading, (middle, 890.0), font)?;
        for (k, panel) in self.grid.panels.iter().enumerate() {
            let (left, top) = (95.0 + 373.0 * (k % 3) as f64, 975.0 + 400.0 * (k / 3) as f64);
            let frame = [left, top, left + 335.0, top + 270.0];
            self.knob(canvas, panel, Axes::new(frame, seconds, errors), k % 3 == 0)?;
        }
        Ok(())
    }

    fn at(&self, axes: &Axes, run: usize) -> (f64, f64) {
        axes.at(self.measured[run].seconds, self.measured[run].known_error())
    }

    fn legend<B: DrawingBackend>(&self, canvas: &Canvas<B>, y: f64) -> Drawn {
        let font = Font::new(18.0, BLACK);
        let mut x = 95.0;
        for (name, mark, colour) in [
            ("fixed settings", Mark::Dot(5.0), LIGHT),
            ("the best of them, and what was changed", Mark::Dot(6.0), FRONT),
            ("chosen by the dial", Mark::Diamond(11.0), TARGET),
        ] {
            canvas.mark(mark, (x + 12.0, y), colour)?;
            canvas.text(name, (x + 30.0, y), font)?;
            x += 62.0 + canvas.text_width(name, font)?;
        }
        canvas.line(&[(x, y), (x + 26.0, y)], TARGET, 1.0)?;
        canvas.text("error asked of it", (x + 34.0, y), font)
    }

    fn main<B: DrawingBackend>(&self, canvas: &Canvas<B>, frame: [f64; 4]) -> Drawn {
        let runs = &self.grid.runs;
        let asked = |k: usize| match runs[k].target {
            Target::Error(error) => Some(error),
            Target::Settings(_) => None,
        };
        let targets: Vec<(usize, f64)> =
            (0..runs.len()).filter_map(|k| Some((k, asked(k)?))).collect();
        let errors = self
            .measured
            .iter()
            .map(super::Measured::known_error)
            .chain(targets.iter().map(|d| d.1));
        let seconds = range(self.measured.iter().map(|m| m.seconds), 0.07);
        let mut axes = Axes::new(frame, seconds, range(errors, 0.07));
        axes.draw(canvas, 20.0, true)?;
        for &(_, error) in &targets {
            let (_, y) = axes.at(1.0, error);
            canvas.line(&[(axes.left, y), (axes.right, y)], TARGET, 1.0)?;
            axes.cross(&[(axes.left, y), (axes.right, y)]);
            let text = format!("{} asked", percent(error));
            let font = Font::new(16.0, TARGET).anchor(HPos::Right);
            let width = canvas.text_width(&text, font)?;
            canvas.text(&text, (axes.right - 6.0, y - 11.0), font)?;
            axes.take((axes.right - 6.0 - width / 2.0, y - 11.0), width / 2.0);
        }
        for k in (0..runs.len()).filter(|&k| asked(k).is_none()) {
            let at = self.at(&axes, k);
            canvas.mark(Mark::Dot(5.0), at, LIGHT)?;
            axes.take(at, 5.0);
        }
        let front: Vec<_> = self.front.iter().map(|&k| self.at(&axes, k)).collect();
        canvas.line(&front, FRONT, 2.0)?;
        axes.cross(&front);
        for &at in &front {
            canvas.mark(Mark::Dot(6.0), at, FRONT)?;
            axes.take(at, 6.0);
        }
        for &(k, _) in &targets {
            let at = self.at(&axes, k);
            canvas.mark(Mark::Diamond(12.0), at, TARGET)?;
            axes.take(at, 11.0);
        }
        for &(k, error) in &targets {
            let at = self.at(&axes, k);
            let font = Font::new(20.0, TARGET).bold();
            axes.label(canvas, &format!("dial {}", percent(error)), at, font)?;
        }
        for (&k, &at) in self.front.iter().zip(&front) {
            let (knob, value) = (runs[k].knob, &runs[k].value);
            let text = match knob {
                "effort" => format!("meant for {value}"),
                "no gather" => format!("no gather, element size {value}"),
                "resolution" => format!("resolution {value} px"),
                _ => format!("{knob} {value}"),
            };
            axes.label(canvas, &text, at, Font::new(16.0, FRONT))?;
        }
        Ok(())
    }

    fn knob<B: DrawingBackend>(
        &self,
        canvas: &Canvas<B>,
        panel: &Panel,
        mut axes: Axes,
        first: bool,
    ) -> Drawn {
        let (left, top) = (axes.left, axes.top);
        canvas.text(panel.title, (left, top - 42.0), Font::new(20.0, BLACK).bold())?;
        let mut x = left;
        if panel.series.len() == 1 {
            canvas.text(panel.note, (x, top - 17.0), Font::new(15.0, GREY))?;
        } else {
            for (series, colour) in panel.series.iter().zip(SERIES) {
                let font = Font::new(15.0, colour).bold();
                canvas.text(series.name, (x, top - 17.0), font)?;
                x += canvas.text_width(series.name, font)? + 22.0;
            }
        }
        axes.draw(canvas, 17.0, first)?;
        for (k, run) in self.grid.runs.iter().enumerate() {
            let at = self.at(&axes, k);
            if matches!(run.target, Target::Settings(_)) && axes.holds(at) {
                canvas.mark(Mark::Dot(3.0), at, LIGHT)?;
                axes.cross(&[at, at]);
            }
        }
        for (series, colour) in panel.series.iter().zip(SERIES) {
            let points: Vec<_> = series.runs.iter().map(|r| self.at(&axes, r.1)).collect();
            canvas.line(&points, colour, 2.0)?;
            axes.cross(&points);
            for &at in &points {
                canvas.mark(Mark::Dot(4.5), at, colour)?;
                axes.take(at, 4.5);
            }
        }
        let base = self.at(&axes, self.grid.base);
        canvas.mark(Mark::Ring(9.0), base, BLACK)?;
        axes.take(base, 9.0);
        for (series, colour) in panel.series.iter().zip(SERIES) {
            for (label, run) in &series.runs {
                axes.label(canvas, label, self.at(&axes, *run), Font::new(16.0, colour))?;
            }
        }
        Ok(())
    }
}
