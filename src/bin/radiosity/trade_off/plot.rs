//! The chart: error over time of all runs.

use plotters::prelude::RGBColor;
use plotters::style::text_anchor::HPos;

use super::Results;
use super::runs::percent;
use crate::canvas::scale::Scale;
use crate::canvas::{self, At, BLACK, Canvas, Drawn, Font, GREY, LIGHT, Side};

const FRONT: RGBColor = RGBColor(31, 95, 168);
const TARGET: RGBColor = RGBColor(205, 72, 20);

/// Left, top, right and bottom of the map, pixels.
const MAP: [f64; 4] = [95.0, 124.0, 1180.0, 750.0];

impl Results {
    /// The chart as a PNG file.
    pub fn png(&self) -> Result<Vec<u8>, String> {
        canvas::png((1200, 820), |canvas| self.draw(canvas))
    }

    fn draw(&self, canvas: &Canvas) -> Drawn {
        self.draw_frame(canvas)?;
        legend(canvas, 94.0)?;
        self.draw_runs(canvas)
    }

    /// The title, and the axes.
    fn draw_frame(&self, canvas: &Canvas) -> Drawn {
        let [left, top, right, bottom] = MAP;
        let title = format!("What a bake of {} costs and how far it is off", self.scene);
        canvas.text(&title, (left, 28.0), Font::new(26.0, BLACK).bold())?;
        let tail = 100.0 * self.measure.tail;
        let line = format!(
            "{}; errors are root mean squares, without the {tail} % of the area where they are \
             largest",
            self.adapter
        );
        canvas.text(&line, (left, 62.0), Font::new(17.0, GREY))?;
        let (seconds, errors) = self.scales();
        let corner = (left, bottom);
        canvas.axis(&seconds, [corner, (right, bottom)], Side::Below, bottom - top)?;
        canvas.axis(&errors, [corner, (left, top)], Side::Left, right - left)?;
        let font = Font::new(16.0, BLACK).anchor(HPos::Center);
        canvas.text("seconds", ((left + right) / 2.0, bottom + 46.0), font)?;
        canvas.upright("error, % of radiosity", (left - 62.0, (top + bottom) / 2.0), font)
    }

    /// The errors that were asked for, all runs, and the names of the best.
    fn draw_runs(&self, canvas: &Canvas) -> Drawn {
        let ([left, top, right, bottom], (seconds, errors)) = (MAP, self.scales());
        let at = |time: f64, error: f64| {
            let x = left + (right - left) * seconds.share(time);
            (x, bottom - (bottom - top) * errors.share(100.0 * error))
        };
        let of_run = |k: usize| at(self.runs[k].1.seconds, self.runs[k].1.known_error());
        let asked = |k: usize| self.runs[k].0.target.error();
        let runs = 0..self.runs.len();
        for error in runs.clone().filter_map(asked) {
            let y = at(1.0, error).1;
            canvas.line(&[(left, y), (right, y)], TARGET, 1.0)?;
            let font = Font::new(15.0, TARGET).anchor(HPos::Right);
            canvas.text(&format!("{} asked", percent(error)), (right - 6.0, y - 11.0), font)?;
        }
        for k in runs.clone().filter(|&k| asked(k).is_none()) {
            canvas.dot(of_run(k), 5.0, LIGHT)?;
        }
        let front: Vec<At> = self.front.iter().map(|&k| of_run(k)).collect();
        canvas.line(&front, FRONT, 2.0)?;
        // Below the front, where no fixed settings are; labels need 150 by 17 pixels.
        let away = 12.0;
        let font = Font::new(15.0, FRONT).anchor(HPos::Right);
        let mut last = (f64::NEG_INFINITY, f64::NEG_INFINITY);
        for (&k, &(x, y)) in self.front.iter().zip(&front) {
            canvas.dot((x, y), 6.0, FRONT)?;
            let below = y + away;
            last = (x, if x - last.0 >= 150.0 { below } else { below.max(last.1 + 17.0) });
            canvas.text(&self.runs[k].0.name(), (x - away / 2.0, last.1), font)?;
        }
        for k in runs.filter(|&k| asked(k).is_some()) {
            let (x, y) = of_run(k);
            canvas.diamond((x, y), 11.0, TARGET)?;
            let font = Font::new(16.0, TARGET).bold();
            canvas.text(&self.runs[k].0.name(), (x + away, y - away), font)?;
        }
        Ok(())
    }

    /// Of seconds and of errors in per cent, with all runs and targets on them.
    fn scales(&self) -> (Scale, Scale) {
        let ends = |values: &mut dyn Iterator<Item = f64>| {
            values.fold((f64::INFINITY, 0.0), |(low, high), v| (v.min(low), v.max(high)))
        };
        let (fastest, slowest) = ends(&mut self.runs.iter().map(|(_, m)| m.seconds));
        let targets = self.runs.iter().filter_map(|(run, _)| run.target.error());
        let errors = self.runs.iter().map(|(_, m)| m.known_error()).chain(targets);
        let (least, largest) = ends(&mut errors.map(|error| 100.0 * error));
        // Room for the label of the fastest run.
        (Scale::logarithmic(fastest / 1.5, slowest), Scale::logarithmic(least, largest))
    }
}

fn legend(canvas: &Canvas, y: f64) -> Drawn {
    let font = Font::new(16.0, BLACK);
    let [best, asked] = [245.0, 585.0].map(|x| (x, y));
    canvas.dot((100.0, y), 5.0, LIGHT)?;
    canvas.text("fixed settings", (114.0, y), font)?;
    canvas.dot(best, 6.0, FRONT)?;
    canvas.text("the best of them, and what was changed", (259.0, y), font)?;
    canvas.diamond(asked, 10.0, TARGET)?;
    canvas.text("chosen for the error at the line", (602.0, y), font)
}
