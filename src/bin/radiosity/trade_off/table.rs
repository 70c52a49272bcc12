//! The table of a trade-off, a line a run: as text for the terminal, and as CSV with all settings.

use std::fmt::Write;

use super::Results;
use crate::bake::settings;

impl Results {
    /// The runs by time, as text.
    pub fn text(&self) -> String {
        let mut order: Vec<usize> = (0..self.measured.len()).collect();
        order.sort_by(|&a, &b| self.measured[a].seconds.total_cmp(&self.measured[b].seconds));
        let mut out = format!(
            "{:>26} {:>9} {:>14} {:>14} {:>7} {:>9}\n",
            "run", "seconds", "error %", "with tail %", "told %", "vertices"
        );
        for k in order {
            let (run, m) = (&self.grid.runs[k], &self.measured[k]);
            let [error, with_tail] = [m.error, m.error_with_tail]
                .map(|e| format!("{:.2} ± {:.2}", 100.0 * e.value, 100.0 * e.standard_error));
            let _ = writeln!(
                out,
                "{:>26} {:>9.2} {error:>14} {with_tail:>14} {:>7.2} {:>9} {}",
                format!("{} {}", run.knob, run.value),
                m.seconds,
                100.0 * m.told,
                m.vertices,
                if self.front.contains(&k) { "best" } else { "" }
            );
        }
        let _ = write!(
            out,
            "best: no other fixed settings are both faster and better; error: without the {} % of \
             the area where it is largest; told: by the bake",
            100.0 * self.measure.tail
        );
        out
    }

    /// A row a run, in their order, under a row of column names; shares and not per cent.
    pub fn csv(&self) -> String {
        let mut out = String::new();
        for k in 0..self.measured.len() {
            let (columns, cells): (Vec<String>, Vec<String>) = self.row(k).into_iter().unzip();
            if k == 0 {
                let _ = writeln!(out, "{}", columns.join(","));
            }
            let _ = writeln!(out, "{}", cells.join(","));
        }
        out
    }

    /// Columns and cells of run `k`.
    fn row(&self, k: usize) -> Vec<(String, String)> {
        let (run, m) = (&self.grid.runs[k], &self.measured[k]);
        let mut row: Vec<(String, String)> = [
            ("knob", run.knob.to_string()),
            ("value", run.value.clone()),
            ("seconds", m.seconds.to_string()),
            ("error", m.error.value.to_string()),
            ("standard_error", m.error.standard_error.to_string()),
            ("error_with_tail", m.error_with_tail.value.to_string()),
            ("standard_error_with_tail", m.error_with_tail.standard_error.to_string()),
            ("told", m.told.to_string()),
            ("vertices", m.vertices.to_string()),
            ("best", u8::from(self.front.contains(&k)).to_string()),
        ]
        .map(|(name, cell)| (name.to_string(), cell))
        .to_vec();
        row.extend(settings::cells(&m.settings));
        row
    }
}
