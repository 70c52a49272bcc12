//! The tables of a trade-off: all runs as CSV, and a summary for the terminal.

use std::fmt::Write;

use radiosity::bake::GatherSettings;

use super::Results;
use super::grid::{Target, percent};

impl Results {
    /// The fastest fixed settings whose error is no larger than that of run `k`.
    fn as_good(&self, k: usize) -> Option<usize> {
        let error = self.measured[k].errors.area;
        self.front.iter().copied().find(|&f| self.measured[f].errors.area <= error)
    }

    /// A row a run, under a row of column names.
    pub fn csv(&self) -> String {
        let mut out = String::new();
        for k in 0..self.measured.len() {
            let (columns, cells): (Vec<&str>, Vec<String>) = self.row(k).into_iter().unzip();
            if k == 0 {
                let _ = writeln!(out, "{}", columns.join(","));
            }
            let _ = writeln!(out, "{}", cells.join(","));
        }
        out
    }

    /// Columns and cells of run `k`.
    fn row(&self, k: usize) -> Vec<(&'static str, String)> {
        let (run, m) = (&self.grid.runs[k], &self.measured[k]);
        let solve = &m.settings.solve;
        let mut row = vec![
            ("knob", run.knob.into()),
            ("value", run.value.clone()),
            ("element_size", format!("{:.6}", solve.element_size)),
            ("contacts", solve.contact_levels.to_string()),
            ("hemicube", solve.hemicube_resolution.to_string()),
            ("near", solve.near_reach.to_string()),
            ("unshot", solve.solver.unshot.to_string()),
            ("patch_tolerance", solve.solver.patch_tolerance.to_string()),
        ];
        row.extend(gather_cells(m.settings.gather.as_ref()));
        row.extend([
            ("bake_seconds", format!("{:.4}", m.seconds)),
            ("error_over_area", format!("{:.6}", m.errors.area)),
            ("error_all_points", m.errors.all.map_or("".into(), |all| format!("{all:.6}"))),
            ("error_against", self.reference.name().into()),
            ("estimate", format!("{:.6}", m.estimate)),
            ("vertices", m.vertices.to_string()),
            ("shot_elements", m.shot_elements.to_string()),
            ("elements", m.elements.to_string()),
            ("hemicubes", m.hemicubes.to_string()),
            ("gathers", m.gathers.to_string()),
            ("on_front", u8::from(self.front.contains(&k)).to_string()),
        ]);
        row
    }

    /// What reaching an error target takes against the fastest fixed settings that are as good.
    pub fn summary(&self) -> String {
        let mut out = format!(
            "{:>6} {:>9} {:>9} {:>9} | {:>9} {:>9} {:>7}  {}\n",
            "asked", "measured", "estimate", "seconds", "fastest s", "its error", "ratio", "by"
        );
        for (k, (run, m)) in self.grid.runs.iter().zip(&self.measured).enumerate() {
            let Target::Error(error) = run.target else { continue };
            let _ = write!(
                out,
                "{:>6} {:>8.2}% {:>8.2}% {:>9.2} | ",
                percent(error),
                100.0 * m.errors.area,
                100.0 * m.estimate,
                m.seconds
            );
            let _ = match self.as_good(k) {
                Some(best) => {
                    let (b, r) = (&self.measured[best], &self.grid.runs[best]);
                    let (seconds, error) = (b.seconds, 100.0 * b.errors.area);
                    let ratio = m.seconds / seconds;
                    let (knob, value) = (r.knob, &r.value);
                    writeln!(out, "{seconds:>9.2} {error:>8.2}% {ratio:>7.2}  {knob} {value}")
                }
                None => writeln!(out, "no fixed settings are as good"),
            };
        }
        out.push_str(
            "ratio: the dial's time over that of the fastest fixed settings with no larger error",
        );
        out
    }
}

/// Columns and cells of the settings of vertices that gather: empty where none does.
fn gather_cells(gather: Option<&GatherSettings>) -> [(&'static str, String); 8] {
    let cell = |value: fn(&GatherSettings) -> String| gather.map_or(String::new(), value);
    [
        ("gather", if gather.is_some() { "needed".into() } else { "none".into() }),
        ("gather_size", cell(|g| format!("{:.6}", g.element_size))),
        ("gather_contacts", cell(|g| g.contact_levels.to_string())),
        ("rays", cell(|g| g.rays.to_string())),
        ("mesh error", cell(|g| g.refinement.mesh_error.to_string())),
        ("curve", cell(|g| g.refinement.interpolation_tolerance.to_string())),
        ("smallest", cell(|g| format!("{:.6}", g.refinement.min_edge))),
        ("sweeps", cell(|g| g.refinement.gather_passes.to_string())),
    ]
}
