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

impl Target {
    /// The error that is asked for, if one is.
    pub fn error(&self) -> Option<f64> {
        match self {
            Target::Error(error) => Some(*error),
            Target::Settings(_) => None,
        }
    }
}

/// One bake.
pub struct Run {
    /// The setting that was varied for it.
    pub knob: &'static str,
    pub value: String,
    pub target: Target,
}

impl Run {
    pub fn name(&self) -> String {
        format!("{} {}", self.knob, self.value)
    }
}

/// A setting that is varied: its name, the values that the function is called with, which changes
/// settings and gives the new value in words. The first two values are those of quick runs.
type Variation = (&'static str, &'static [f64], fn(&mut BakeSettings, f64) -> String);

/// Factors of the value meant for the error, but for counts. The values meant for it are left out.
const VARIATIONS: [Variation; 7] = [
    ("resolution", &[0.5, 2.0, 0.25], |settings, factor| {
        let pixels = &mut settings.solve.hemicube_resolution;
        *pixels = 2 * (factor * f64::from(*pixels) / 2.0).round().max(1.0) as u32;
        let of_hemicubes = pixels.to_string();
        change_gather(settings, |gather| {
            gather.rays = (factor * factor * f64::from(gather.rays)).ceil().max(16.0) as u32;
        });
        of_hemicubes
    }),
    ("element size", &[2.0, 0.5, 4.0], |settings, factor| {
        settings.solve.element_size *= factor;
        change_gather(settings, |gather| {
            gather.element_size *= factor;
            gather.refinement.min_edge *= factor;
        });
        short(settings.solve.element_size)
    }),
    ("unshot", &[4.0, 16.0, 0.25, 64.0], |settings, factor| {
        settings.solve.solver.unshot *= factor;
        percent(settings.solve.solver.unshot)
    }),
    ("near field", &[-1.0, 3.0, 1.0], |settings, reach| {
        settings.solve.near_reach = reach;
        if reach < 0.0 { "none".into() } else { reach.to_string() }
    }),
    ("no gather", &[1.0, 0.5, 2.0, 0.25], |settings, factor| {
        settings.solve.element_size *= factor;
        settings.gather = None;
        short(settings.solve.element_size)
    }),
    ("passes", &[1.0, 3.0, 2.0], |settings, passes| {
        change_gather(settings, |gather| gather.refinement.gather_passes = passes as u32);
        passes.to_string()
    }),
    ("mesh error", &[2.0, 0.5, 4.0, 0.25], |settings, factor| {
        let mut changed = 0.0;
        change_gather(settings, |gather| {
            let tolerance = &mut gather.refinement.mesh_error;
            *tolerance = (factor * *tolerance).min(1.0);
            changed = *tolerance;
            gather.refinement.interpolation_tolerance *= factor;
        });
        percent(changed)
    }),
];

fn change_gather(settings: &mut BakeSettings, change: impl FnOnce(&mut GatherSettings)) {
    if let Some(gather) = &mut settings.gather {
        change(gather);
    }
}

/// All runs; none twice, and first that of fixed settings for the least error.
pub fn runs(scene: &Scene, quick: bool) -> Vec<Run> {
    let all = [0.01, 0.02, 0.05, 0.1];
    let (errors, base_error, targets) =
        if quick { (&all[1..], 0.05, &all[2..]) } else { (&all[..], 0.02, &all[..]) };
    let meant_for = |error: f64| BakeSettings::for_error(error, scene);
    let efforts = errors.iter().map(|&error| ("meant for", percent(error), meant_for(error)));
    let base = meant_for(base_error);
    let varied = VARIATIONS.iter().flat_map(|&(knob, values, change)| {
        let base = &base;
        values.iter().take(if quick { 2 } else { values.len() }).map(move |&value| {
            let mut settings = base.clone();
            (knob, change(&mut settings, value), settings)
        })
    });
    let mut runs: Vec<Run> = vec![];
    for (knob, value, settings) in efforts.chain(varied) {
        let same = |r: &Run| matches!(&r.target, Target::Settings(other) if **other == settings);
        if !runs.iter().any(same) {
            runs.push(Run { knob, value, target: Target::Settings(Box::new(settings)) });
        }
    }
    runs.extend(targets.iter().map(|&error| Run {
        knob: "asked for",
        value: percent(error),
        target: Target::Error(error),
    }));
    runs
}

pub fn percent(share: f64) -> String {
    format!("{} %", short(100.0 * share))
}

/// Two digits, or all before the point.
fn short(value: f64) -> String {
    if value <= 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let digits = (1 - libm::log10(value).floor() as i32).max(0) as usize;
    let text = format!("{value:.digits$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').into(),
        false => text,
    }
}
