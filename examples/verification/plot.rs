//! A page of plots: a panel for each section, a dot for each case at its deviation over its band.

use plotters::prelude::RGBColor;
use plotters::style::text_anchor::HPos;

use crate::case::Section;
use crate::program::canvas::{self, BLACK, Canvas, Drawn, Font, GREY, LIGHT};

const PASSED: RGBColor = RGBColor(31, 95, 168);
const FAILED: RGBColor = RGBColor(205, 72, 20);
const BAND: RGBColor = RGBColor(232, 241, 232);

/// Panels in a row, and their size with what is around them, pixels.
const COLUMNS: usize = 2;
const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 230.0;

/// Above the panels, pixels.
const HEAD: f64 = 84.0;

/// Deviations beyond so many bands are drawn there; a panel is a little higher.
const FURTHEST: f64 = 1.25;
const TOP: f64 = 1.4;

pub fn png(sections: &[Section]) -> Result<Vec<u8>, String> {
    let rows = sections.len().div_ceil(COLUMNS);
    let size = (WIDTH * COLUMNS as f64, HEAD + HEIGHT * rows as f64);
    canvas::png((size.0 as u32, size.1 as u32), |canvas| {
        let title = "Cases with known answers: deviation over allowed band";
        canvas.text(title, (56.0, 28.0), Font::new(24.0, BLACK).bold())?;
        let line =
            "A dot for each case, as numbered in verification.md; green: the band, red: outside.";
        canvas.text(line, (56.0, 60.0), Font::new(16.0, GREY))?;
        for (k, section) in sections.iter().enumerate() {
            let (column, row) = ((k % COLUMNS) as f64, (k / COLUMNS) as f64);
            panel(canvas, section, (WIDTH * column, HEAD + HEIGHT * row))?;
        }
        Ok(())
    })
}

fn panel(canvas: &Canvas, section: &Section, (x, y): canvas::At) -> Drawn {
    let [left, top, right, bottom] = [x + 56.0, y + 34.0, x + WIDTH - 24.0, y + HEIGHT - 34.0];
    let count = section.cases.len();
    let passed = section.cases.iter().filter(|case| case.is_passed()).count();
    let title = format!("{}: {passed} of {count} passed", section.title);
    canvas.text(&title, (left, y + 16.0), Font::new(17.0, BLACK).bold())?;
    let height = |share: f64| (top + bottom) / 2.0 - share / TOP * (bottom - top) / 2.0;
    canvas.fill([left, height(1.0), right, height(-1.0)], BAND)?;
    for (share, text) in [(1.0, "+1"), (0.0, "0"), (-1.0, "−1")] {
        let y = height(share);
        canvas.line(&[(left, y), (right, y)], LIGHT, 1.0)?;
        canvas.text(text, (left - 8.0, y), Font::new(14.0, GREY).anchor(HPos::Right))?;
    }
    let across = |number: usize| left + (right - left) * (number as f64 - 0.5) / count as f64;
    // Some ten numbers along the axis.
    let step = [1, 2, 5, 10, 20].into_iter().find(|step| count / step <= 12).unwrap_or(50);
    for number in (1..=count).filter(|number| number % step == 0) {
        let font = Font::new(14.0, GREY).anchor(HPos::Center);
        canvas.text(&number.to_string(), (across(number), bottom + 14.0), font)?;
    }
    for (number, case) in (1..).zip(&section.cases) {
        let share = if case.deviation() == 0.0 { 0.0 } else { case.deviation() / case.band };
        let share = if share.is_nan() { FURTHEST } else { share.clamp(-FURTHEST, FURTHEST) };
        let colour = if case.is_passed() { PASSED } else { FAILED };
        canvas.dot((across(number), height(share)), 4.0, colour)?;
    }
    Ok(())
}
