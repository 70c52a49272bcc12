//! The settings that are tried: one knob at a time around one base, and those chosen for an error
//! target.

use std::num::NonZeroU32;

use radiosity::{BakeSettings, Scene};

/// How far a run goes.
pub enum Target {
    /// Fixed settings.
    Settings(Box<BakeSettings>),
    /// Until the error is estimated to be below this.
    Error(f64),
}

/// One bake.
pub struct Run {
    /// The knob that was turned for it.
    pub knob: &'static str,
    pub value: String,
    pub target: Target,
}

/// Runs in the order of a knob's values, each with its label.
pub struct Series {
    pub name: &'static str,
    pub runs: Vec<(String, usize)>,
}

/// All there is of one knob.
pub struct Panel {
    pub title: &'static str,
    pub note: &'static str,
    pub series: Vec<Series>,
}

/// All runs; none twice.
pub struct Grid {
    pub runs: Vec<Run>,
    pub panels: Vec<Panel>,
    /// The run around which knobs are turned, and the error that it is meant for.
    pub base: usize,
    pub base_error: f64,
    /// The finest error of fixed settings.
    pub finest: f64,
}

impl Grid {
    pub fn new(scene: &Scene, quick: bool) -> Grid {
        let all = [0.1, 0.05, 0.02, 0.01];
        let (errors, middle, targets) =
            if quick { (&all[..3], 0.05, &all[..2]) } else { (&all[..], 0.02, &all[..]) };
        let base = BakeSettings::for_error(middle, scene);
        let mut grid = Grid {
            runs: vec![],
            panels: vec![],
            base: 0,
            base_error: middle,
            finest: errors.iter().copied().fold(1.0, f64::min),
        };
        for &error in errors {
            let run = grid.add("effort", percent(error), BakeSettings::for_error(error, scene));
            if error == middle {
                grid.base = run;
            }
        }
        grid.turn(&base, quick);
        for &error in targets {
            grid.runs.push(Run {
                knob: "dial",
                value: percent(error),
                target: Target::Error(error),
            });
        }
        grid
    }

    fn turn(&mut self, base: &BakeSettings, quick: bool) {
        let steps: &[f64] = if quick { &[0.5, 1.0, 2.0] } else { &[0.25, 0.5, 1.0, 2.0] };
        let resolution = self.vary(
            base,
            "resolution",
            "",
            steps,
            |e| e.solve.hemicube_resolution.to_string(),
            |e, f| {
                e.solve.hemicube_resolution =
                    2 * (f * f64::from(e.solve.hemicube_resolution) / 2.0).round().max(1.0) as u32;
                if let Some(gather) = &mut e.gather {
                    gather.rays = (f * f * f64::from(gather.rays)).ceil().max(16.0) as u32;
                }
            },
        );
        self.panel("Resolution", "hemicube pixels an edge; rays as their square", [resolution]);

        let steps: &[f64] = if quick { &[2.0, 1.0, 0.5] } else { &[4.0, 2.0, 1.0, 0.5] };
        let sizes = self.vary(base, "element size", "", steps, size, |e, f| {
            e.solve.element_size *= f;
            if let Some(gather) = &mut e.gather {
                gather.element_size *= f;
                gather.refinement.min_edge *= f;
            }
        });
        self.panel("Element size", "edge of those that shoot; others with it", [sizes]);

        let steps: &[f64] = if quick { &[16.0, 4.0, 1.0] } else { &[64.0, 16.0, 4.0, 1.0, 0.25] };
        let label = |e: &BakeSettings| percent(e.solve.solver.unshot);
        let unshot = self.vary(base, "unshot", "", steps, label, |e, f| e.solve.solver.unshot *= f);
        self.panel("Unshot share", "of the light, at which shooting stops", [unshot]);

        let steps: &[f64] = if quick { &[1.0, 2.0] } else { &[1.0, 2.0, 4.0] };
        let label = |e: &BakeSettings| e.solve.rotations.to_string();
        let rotations = self.vary(base, "rotations", "", steps, label, |e, f| {
            e.solve.rotations = NonZeroU32::new(f as u32).expect("not zero");
        });
        self.panel("Rotations", "hemicubes a viewpoint, averaged", [rotations]);

        let label = |e: &BakeSettings| match e.solve.near_reach {
            reach if reach < 0.0 => "none".into(),
            reach => reach.to_string(),
        };
        let near = self
            .vary(base, "near field", "", &[-1.0, 1.0, 3.0], label, |e, f| e.solve.near_reach = f);
        self.panel("Near field", "closed forms within so many patch diameters", [near]);

        let steps: &[f64] = if quick { &[2.0, 1.0, 0.5] } else { &[2.0, 1.0, 0.5, 0.25] };
        let none = self.vary(base, "no gather", "none, element size", steps, size, |e, f| {
            e.solve.element_size *= f;
            e.gather = None;
        });
        let label = |e: &BakeSettings| {
            e.gather.as_ref().map_or(0, |g| g.refinement.gather_passes).to_string()
        };
        let sweeps = self.vary(base, "sweeps", "sweeps", &[1.0, 2.0, 3.0], label, |e, f| {
            if let Some(gather) = &mut e.gather {
                gather.refinement.gather_passes = f as u32;
            }
        });
        let label = |e: &BakeSettings| {
            percent(e.gather.as_ref().map_or(0.0, |g| g.refinement.surplus_tolerance))
        };
        let steps: &[f64] = if quick { &[2.0, 1.0, 0.5] } else { &[4.0, 2.0, 1.0, 0.5, 0.25] };
        let bend = self.vary(base, "bend", "bend", steps, label, |e, f| {
            if let Some(gather) = &mut e.gather {
                gather.refinement.surplus_tolerance =
                    (f * gather.refinement.surplus_tolerance).min(1.0);
                gather.refinement.interpolation_tolerance *= f;
            }
        });
        self.panel("Gather", "none; how often; how much a side may bend", [none, sweeps, bend]);
    }

    /// The runs of `base` with one knob turned to each of `values`.
    fn vary(
        &mut self,
        base: &BakeSettings,
        knob: &'static str,
        name: &'static str,
        values: &[f64],
        label: impl Fn(&BakeSettings) -> String,
        change: impl Fn(&mut BakeSettings, f64),
    ) -> Series {
        let run = |&value: &f64| {
            let mut settings = base.clone();
            change(&mut settings, value);
            let label = label(&settings);
            (label.clone(), self.add(knob, label, settings))
        };
        Series { name, runs: values.iter().map(run).collect() }
    }

    /// A run of these settings, the one there is if they are not new.
    fn add(&mut self, knob: &'static str, value: String, settings: BakeSettings) -> usize {
        let same =
            |run: &Run| matches!(&run.target, Target::Settings(other) if **other == settings);
        if let Some(there) = self.runs.iter().position(same) {
            return there;
        }
        self.runs.push(Run { knob, value, target: Target::Settings(Box::new(settings)) });
        self.runs.len() - 1
    }

    fn panel<const N: usize>(
        &mut self,
        title: &'static str,
        note: &'static str,
        series: [Series; N],
    ) {
        self.panels.push(Panel { title, note, series: series.into() });
    }
}

fn size(settings: &BakeSettings) -> String {
    short(settings.solve.element_size)
}

pub fn percent(share: f64) -> String {
    format!("{} %", short(100.0 * share))
}

/// Two digits, or all before the point.
pub fn short(value: f64) -> String {
    if value <= 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let digits = (1 - value.log10().floor() as i32).max(0) as usize;
    let text = format!("{value:.digits$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').into(),
        false => text,
    }
}
