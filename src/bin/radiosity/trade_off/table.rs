//! The tables of a trade-off: all runs as CSV, and a summary for the terminal.

use std::fmt::Write;

use super::Results;
use super::grid::{Target, percent};

const HEADER: &str = "\
knob,value,element_size,contacts,hemicube,rotations,near,unshot,patch_tolerance,gather,\
gather_size,gather_contacts,rays,bend,curve,smallest,sweeps,bake_seconds,error_over_area,\
error_all_points,error_against,estimate,vertices,shot_elements,elements,hemicubes,\
gathers,on_front\n";

impl Results {
    /// The fastest fixed settings whose error is no larger than that of run `k`.
    fn as_good(&self, k: usize) -> Option<usize> {
        let error = self.measured[k].errors.area;
        self.front.iter().copied().find(|&f| self.measured[f].errors.area <= error)
    }

    /// A row a run.
    pub fn csv(&self) -> String {
        let mut out = String::from(HEADER);
        for (k, (run, m)) in self.grid.runs.iter().zip(&self.measured).enumerate() {
            let e = &m.settings;
            let gather = e.gather.as_ref().map_or("none,,,,,,,".to_string(), |g| {
                let s = &g.refinement;
                let (size, contacts, rays) = (g.element_size, g.contact_levels, g.rays);
                let (bend, curve) = (s.surplus_tolerance, s.interpolation_tolerance);
                let (smallest, sweeps) = (s.min_edge, s.gather_passes);
                format!("needed,{size:.6},{contacts},{rays},{bend},{curve},{smallest:.6},{sweeps}")
            });
            let all = m.errors.all.map_or(String::new(), |all| format!("{all:.6}"));
            let _ = writeln!(
                out,
                "{},{},{:.6},{},{},{},{},{},{},{gather},{:.4},{:.6},{all},{},{:.6},{},{},{},{},{},{}",
                run.knob,
                run.value,
                e.solve.element_size,
                e.solve.contact_levels,
                e.solve.hemicube_resolution,
                e.solve.rotations,
                e.solve.near_reach,
                e.solve.solver.unshot,
                e.solve.solver.patch_tolerance,
                m.seconds,
                m.errors.area,
                self.reference.name(),
                m.estimate,
                m.vertices,
                m.shot_elements,
                m.elements,
                m.hemicubes,
                m.gathers,
                u8::from(self.front.contains(&k))
            );
        }
        out
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
