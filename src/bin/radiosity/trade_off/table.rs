//! The table of a trade-off, a line a run: as text for the terminal, and as CSV with all settings.

use super::Results;
use crate::args;
use crate::bake::settings;

impl Results {
    /// The runs by time, as text.
    pub fn text(&self) -> String {
        let mut order: Vec<usize> = (0..self.runs.len()).collect();
        order.sort_by(|&a, &b| self.runs[a].1.seconds.total_cmp(&self.runs[b].1.seconds));
        let mut out = format!(
            "{:>26} {:>9} {:>14} {:>14} {:>11} {:>9}\n",
            "run", "seconds", "error %", "with tail %", "estimated %", "vertices"
        );
        for k in order {
            let (run, m) = &self.runs[k];
            let [error, with_tail] = [m.error, m.error_with_tail]
                .map(|e| format!("{:.2} ± {:.2}", 100.0 * e.value, 100.0 * e.standard_error));
            out += &format!(
                "{:>26} {:>9.2} {error:>14} {with_tail:>14} {:>11.2} {:>9} {}\n",
                run.name(),
                m.seconds,
                100.0 * m.estimated,
                m.vertices,
                if self.front.contains(&k) { "best" } else { "" }
            );
        }
        let tail = 100.0 * self.measure.tail;
        out + &format!(
            "best: no other fixed settings are both faster and better; error: without the {tail} % \
             of the\narea where it is largest; estimated: by the bake itself"
        )
    }

    /// A row a run under a row of column names; shares, not per cent.
    pub fn csv(&self) -> Vec<u8> {
        let names: Vec<&str> = self.row(0).into_iter().map(|(name, _)| name).collect();
        let cells = |k| self.row(k).into_iter().map(|(_, cell)| cell).collect();
        args::csv(&names.join(","), (0..self.runs.len()).map(cells))
    }

    /// Columns and cells of run `k`.
    fn row(&self, k: usize) -> Vec<(&'static str, String)> {
        let (run, m) = &self.runs[k];
        let mut row = vec![
            ("knob", run.knob.to_string()),
            ("value", run.value.clone()),
            ("seconds", m.seconds.to_string()),
            ("error", m.error.value.to_string()),
            ("standard_error", m.error.standard_error.to_string()),
            ("error_with_tail", m.error_with_tail.value.to_string()),
            ("standard_error_with_tail", m.error_with_tail.standard_error.to_string()),
            ("estimated", m.estimated.to_string()),
            ("vertices", m.vertices.to_string()),
            ("best", u8::from(self.front.contains(&k)).to_string()),
        ];
        row.extend(settings::cells(&m.settings));
        row
    }
}
