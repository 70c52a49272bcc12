//! The runs: one setting at a time is varied around those meant for one error, and some errors are
//! asked for as targets.

use radiosity::bake::GatherSettings;
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
    /// The setting that was varied for it.
    pub knob: &'static str,
    pub value: String,
    pub target: Target,
}

/// The runs of one variation, in the order of its values, each with its label.
pub struct Series {
    pub name: &'static str,
    pub runs: Vec<(String, usize)>,
}

/// All runs in one panel of the chart.
pub struct Panel {
    pub title: &'static str,
    pub note: &'static str,
    pub series: Vec<Series>,
}

/// All runs; none twice, and first that of fixed settings for the least error.
pub struct Grid {
    pub runs: Vec<Run>,
    pub panels: Vec<Panel>,
    /// The run around which settings are varied, and the error that it is meant for.
    pub base: usize,
    pub base_error: f64,
}

/// A setting that is varied: the values that `change` is called with, and the label of what comes
/// of it.
struct Variation {
    knob: &'static str,
    /// Among the series of its panel.
    name: &'static str,
    values: &'static [f64],
    quick_values: &'static [f64],
    change: fn(&mut BakeSettings, f64),
    label: fn(&BakeSettings) -> String,
}

/// Title, note and variations of a panel.
type PanelPlan = (&'static str, &'static str, &'static [Variation]);

const PANELS: [PanelPlan; 5] = [
    ("Resolution", "hemicube pixels an edge; rays as their square", &[RESOLUTION]),
    ("Element size", "edge of those that shoot; others with it", &[ELEMENT_SIZE]),
    ("Unshot share", "of the light, at which shooting stops", &[UNSHOT]),
    ("Near field", "closed forms within so many patch diameters", &[NEAR_FIELD]),
    ("Gather", "none; how often; how much elements may be off", &[NO_GATHER, SWEEPS, MESH_ERROR]),
];

const RESOLUTION: Variation = Variation {
    knob: "resolution",
    name: "",
    values: &[0.25, 0.5, 1.0, 2.0],
    quick_values: &[0.5, 1.0, 2.0],
    change: |settings, factor| {
        let pixels = &mut settings.solve.hemicube_resolution;
        *pixels = 2 * (factor * f64::from(*pixels) / 2.0).round().max(1.0) as u32;
        change_gather(settings, |gather| {
            gather.rays = (factor * factor * f64::from(gather.rays)).ceil().max(16.0) as u32;
        });
    },
    label: |settings| settings.solve.hemicube_resolution.to_string(),
};

const ELEMENT_SIZE: Variation = Variation {
    knob: "element size",
    name: "",
    values: &[4.0, 2.0, 1.0, 0.5],
    quick_values: &[2.0, 1.0, 0.5],
    change: |settings, factor| {
        settings.solve.element_size *= factor;
        change_gather(settings, |gather| {
            gather.element_size *= factor;
            gather.refinement.min_edge *= factor;
        });
    },
    label: element_size,
};

const UNSHOT: Variation = Variation {
    knob: "unshot",
    name: "",
    values: &[64.0, 16.0, 4.0, 1.0, 0.25],
    quick_values: &[16.0, 4.0, 1.0],
    change: |settings, factor| settings.solve.solver.unshot *= factor,
    label: |settings| percent(settings.solve.solver.unshot),
};

const NEAR_FIELD: Variation = Variation {
    knob: "near field",
    name: "",
    values: &[-1.0, 1.0, 3.0],
    quick_values: &[-1.0, 1.0, 3.0],
    change: |settings, reach| settings.solve.near_reach = reach,
    label: |settings| match settings.solve.near_reach {
        reach if reach < 0.0 => "none".into(),
        reach => reach.to_string(),
    },
};

const NO_GATHER: Variation = Variation {
    knob: "no gather",
    name: "none, element size",
    values: &[2.0, 1.0, 0.5, 0.25],
    quick_values: &[2.0, 1.0, 0.5],
    change: |settings, factor| {
        settings.solve.element_size *= factor;
        settings.gather = None;
    },
    label: element_size,
};

const SWEEPS: Variation = Variation {
    knob: "sweeps",
    name: "sweeps",
    values: &[1.0, 2.0, 3.0],
    quick_values: &[1.0, 2.0, 3.0],
    change: |settings, passes| {
        change_gather(settings, |gather| gather.refinement.gather_passes = passes as u32);
    },
    label: |settings| {
        settings.gather.as_ref().map_or(0, |g| g.refinement.gather_passes).to_string()
    },
};

const MESH_ERROR: Variation = Variation {
    knob: "mesh error",
    name: "mesh",
    values: &[4.0, 2.0, 1.0, 0.5, 0.25],
    quick_values: &[2.0, 1.0, 0.5],
    change: |settings, factor| {
        change_gather(settings, |gather| {
            let tolerance = &mut gather.refinement.mesh_error;
            *tolerance = (factor * *tolerance).min(1.0);
            gather.refinement.interpolation_tolerance *= factor;
        });
    },
    label: |settings| percent(settings.gather.as_ref().map_or(0.0, |g| g.refinement.mesh_error)),
};

fn change_gather(settings: &mut BakeSettings, change: impl Fn(&mut GatherSettings)) {
    if let Some(gather) = &mut settings.gather {
        change(gather);
    }
}

fn element_size(settings: &BakeSettings) -> String {
    short(settings.solve.element_size)
}

impl Grid {
    pub fn new(scene: &Scene, quick: bool) -> Grid {
        let all = [0.01, 0.02, 0.05, 0.1];
        let (errors, base_error, targets) =
            if quick { (&all[1..], 0.05, &all[2..]) } else { (&all[..], 0.02, &all[..]) };
        let mut grid = Grid { runs: vec![], panels: vec![], base: 0, base_error };
        for &error in errors {
            let run = grid.add("effort", percent(error), BakeSettings::for_error(error, scene));
            if error == base_error {
                grid.base = run;
            }
        }
        let base = BakeSettings::for_error(base_error, scene);
        for (title, note, variations) in PANELS {
            let series = variations.iter().map(|v| grid.vary(&base, v, quick)).collect();
            grid.panels.push(Panel { title, note, series });
        }
        for &error in targets {
            let (value, target) = (percent(error), Target::Error(error));
            grid.runs.push(Run { knob: "dial", value, target });
        }
        grid
    }

    /// Adds the runs of one variation of `base`.
    fn vary(&mut self, base: &BakeSettings, variation: &Variation, quick: bool) -> Series {
        let values = if quick { variation.quick_values } else { variation.values };
        let mut runs = vec![];
        for &value in values {
            let mut settings = base.clone();
            (variation.change)(&mut settings, value);
            let label = (variation.label)(&settings);
            runs.push((label.clone(), self.add(variation.knob, label, settings)));
        }
        Series { name: variation.name, runs }
    }

    /// The index of the run of these settings, which is added unless it is there.
    fn add(&mut self, knob: &'static str, value: String, settings: BakeSettings) -> usize {
        let same =
            |run: &Run| matches!(&run.target, Target::Settings(other) if **other == settings);
        if let Some(index) = self.runs.iter().position(same) {
            return index;
        }
        self.runs.push(Run { knob, value, target: Target::Settings(Box::new(settings)) });
        self.runs.len() - 1
    }
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
