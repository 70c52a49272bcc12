//! The report of a bake: what was done, with what, and where the light and the time went; as JSON
//! and as a small table.

use std::time::Duration;

use radiosity::backend::{AdapterInfo, RowMaker};
use radiosity::bake::{ErrorEstimate, GroupError, Obstacle, Outcome, Timings};
use radiosity::bands::BandLight;
use radiosity::solver::Ledger;
use radiosity::{BakeResult, Rgb};
use serde_json::{Map, Value, json};

use crate::bake::files::Picture;
use crate::bake::{Target, bands, settings};
use crate::camera_option::camera_value;
use crate::luminaires::Luminaires;
use crate::progress;

/// What the report tells of.
pub struct Report {
    /// The scene, as the user named it.
    pub scene: String,
    /// The options that give its sky, where that is more than a radiance.
    pub sky: Option<String>,
    /// What else lights it that is no surface.
    pub luminaires: Luminaires,
    /// Name, type and driver of what made the rows.
    pub adapter: AdapterInfo,
    /// What was asked for.
    pub target: Target,
    /// When it was to stop before the error is reached.
    pub limit: Option<Duration>,
    /// Triangles with area.
    pub triangles: usize,
    /// Seconds of reading the scene.
    pub load: f64,
    /// Seconds of opening the device.
    pub open: f64,
    /// Seconds of drawing the picture and writing all other files.
    pub write: f64,
    /// Seconds of all.
    pub total: f64,
    /// What deserves a look.
    pub warnings: Vec<String>,
    /// How the picture was taken, if there is one.
    pub picture: Option<Picture>,
    /// Whether Ctrl-C stopped the bake.
    pub stopped: bool,
    /// The light in bands, if it was asked for.
    pub bands: Option<BandLight>,
    pub baked: BakeResult,
}

impl Report {
    pub fn to_json(&self) -> Value {
        let baked = &self.baked;
        let AdapterInfo { name, kind, driver } = &self.adapter;
        let by_resolution = baked.hemicubes_by_resolution.iter();
        let by_resolution = by_resolution.map(|(pixels, count)| (pixels.to_string(), json!(count)));
        let seconds = self.seconds().map(|(stage, seconds)| (stage.to_string(), json!(seconds)));
        let mut report = json!({
            "scene": self.scene,
            "adapter": { "name": name, "type": kind.to_string(), "driver": driver },
            "goal": self.goal(),
            "settings": settings::report(&baked.settings),
            "triangles": self.triangles,
            "sky": match &self.sky {
                Some(words) => json!(words),
                None => {
                    let radiance = baked.mesh.scene().sky().uniform_radiance();
                    json!(radiance.unwrap_or(Rgb::ZERO).to_array())
                }
            },
            "luminaires": self.luminaires.report(),
            "shot_elements": baked.mesh.element_count(),
            "elements": baked.light.mesh.element_count(),
            "vertices": baked.light.surface.positions.len(),
            "shots": baked.solution.shots,
            "hemicubes": baked.hemicubes,
            "rows_by": baked.row_maker.to_string(),
            "hemicubes_by_resolution": Map::from_iter(by_resolution),
            "gathers": baked.light.gather_count,
            "gather_change": baked.light.relative_change,
            "gather_stop": self.gather_stop(),
            "near_correction": baked.mean_near_correction,
            "stop": baked.solution.stop.to_string(),
            "ledger": ledger(&baked.solution.ledger),
            "error": self.errors(),
            "outcome": baked.outcome.to_string(),
            "seconds": Map::from_iter(seconds),
            "camera": self.picture.map(|Picture { camera, .. }| json!({
                "eye": camera.eye.to_array(), "target": camera.target.to_array(),
                "up": camera.up.to_array(), "vertical_fov": camera.vertical_fov,
            })),
            "exposure": self.picture.map(|picture| picture.exposure),
            "stopped": self.stopped,
            "warnings": self.warnings,
        });
        if let Some(light) = &self.bands {
            report["bands"] = bands::report(light);
        }
        report
    }

    /// What was to be reached, and within which time.
    fn goal(&self) -> Value {
        let mut goal = match self.target {
            Target::Settings(_) => return Value::Null,
            Target::Error(error) => json!({ "error": error }),
            Target::ErrorEach(error) => json!({ "error_each": error }),
            Target::Seconds(seconds) => return json!({ "seconds": seconds }),
        };
        if let Some(limit) = self.limit {
            goal["seconds"] = json!(limit.as_secs_f64());
        }
        goal
    }

    /// The estimated error, of the whole and of each group.
    fn errors(&self) -> Value {
        let baked = &self.baked;
        let mut whole = parts(&baked.estimate);
        let names = baked.mesh.scene().groups();
        let groups = baked.groups.iter().map(|group| {
            let mut entry = json!({
                "group": names.get(group.group as usize),
                "error": group.estimate.total,
                "area": group.area_share,
                "tail_share": group.tail_share,
            });
            merge(&mut entry, parts(&group.estimate));
            entry
        });
        whole["unshot_bound"] = json!(baked.estimate.unshot_bound);
        whole["groups"] = groups.collect();
        whole
    }

    /// The groups that are furthest off, worst first, and how the bake ended.
    fn verdict(&self) -> Vec<String> {
        let baked = &self.baked;
        let names = baked.mesh.scene().groups();
        let mut worst: Vec<_> = baked.groups.iter().collect();
        worst.sort_by(|a, b| b.estimate.total.total_cmp(&a.estimate.total));
        let name = |group: u32| names.get(group as usize).map_or("", String::as_str);
        let line = |g: &&GroupError| {
            let ErrorEstimate { total, uncertainty, .. } = g.estimate;
            format!("{} {:.1} ± {:.1} %", name(g.group), 100.0 * total, 100.0 * uncertainty)
        };
        let worst: Vec<String> = worst.iter().take(4).map(line).collect();
        let mut lines = vec![];
        if baked.groups.len() > 1 {
            lines.push(format!("groups     worst: {}", worst.join(", ")));
        }
        lines.extend(self.outcome());
        lines
    }

    /// Whether what was asked for was reached.
    fn outcome(&self) -> Option<String> {
        let baked = &self.baked;
        let estimated = 100.0 * baked.estimate.total;
        if baked.light.surface.radiosity.iter().all(|&b| b == Rgb::ZERO) && !self.stopped {
            return Some("no light falls on what reflects: there is no error".into());
        }
        let (error, each) = match self.target {
            Target::Error(error) => (error, ""),
            Target::ErrorEach(error) => (error, " for each group"),
            _ if self.stopped => {
                return Some(format!(
                    "stopped: this is what there was, about {estimated:.2} % off"
                ));
            }
            Target::Seconds(_) => {
                return Some(format!("as exact as the time allowed: about {estimated:.2} %"));
            }
            Target::Settings(_) => {
                return Some("no error asked for: --error 0.05 goes on until 5 %".into());
            }
        };
        let remedy = match baked.outcome {
            Outcome::Missed(Obstacle::Time) => {
                let seconds = self.limit.unwrap_or_default().as_secs_f64();
                format!("; give it more than --time {seconds}, or allow a larger error")
            }
            Outcome::Missed(Obstacle::Elements) => {
                let most = baked.settings.gather.as_ref().map(|g| g.refinement.max_elements);
                let most = most.unwrap_or_default();
                format!("; allow more than --set max_elements={most}, which takes memory and time")
            }
            Outcome::Missed(obstacle) => {
                format!("; {}", obstacle.remedy(baked.settings.gather.as_ref()))
            }
            _ => String::new(),
        };
        // In the digits that it was asked in.
        let (asked, outcome) = ((100.0 * error) as f32, baked.outcome);
        Some(format!("{asked} %{each} {outcome} (about {estimated:.2} %){remedy}"))
    }

    /// Why gathering stopped.
    fn gather_stop(&self) -> String {
        match self.baked.settings.gather {
            Some(_) => self.baked.light.stop.to_string(),
            None => "none".into(),
        }
    }

    /// A line a subject, shares in percent.
    pub fn table(&self) -> String {
        let mut lines = self.work();
        lines.push(light_line(&self.baked.solution.ledger));
        lines.push(error_line(&self.baked.estimate));
        let seconds = self.seconds().map(|(stage, seconds)| format!("{stage} {seconds:.2}"));
        lines.push(format!("seconds    {}", seconds.join(", ")));
        lines.extend(self.luminaires.table());
        if let Some(Picture { camera, exposure }) = &self.picture {
            let camera = camera_value(camera);
            lines.push(format!("picture    --camera {camera} --exposure {exposure}"));
        }
        lines.extend(progress::written());
        lines.extend(self.verdict());
        lines.extend(self.bands.as_ref().map(bands::words));
        lines.join("\n")
    }

    /// What was made, and by what.
    fn work(&self) -> Vec<String> {
        let AdapterInfo { name, kind, driver } = &self.adapter;
        let (baked, light) = (&self.baked, &self.baked.light);
        let rows = match baked.row_maker {
            RowMaker::Hemicubes => "hemicubes",
            RowMaker::DeviceRays => "rows of rays on the device",
            RowMaker::Rays => "rows of rays",
        };
        vec![
            format!("adapter    {name} ({kind}), {driver}"),
            format!(
                "mesh       {} triangles, {} elements that shot, {} in the end, {} vertices",
                self.triangles,
                baked.mesh.element_count(),
                light.mesh.element_count(),
                light.surface.positions.len()
            ),
            format!(
                "shooting   {} shots, {} {rows}, {}",
                baked.solution.shots, baked.hemicubes, baked.solution.stop
            ),
            format!(
                "gathering  {} points, {}, changed the vertices by {:.2} %",
                light.gather_count,
                self.gather_stop(),
                100.0 * light.relative_change
            ),
        ]
    }

    /// Wall time of each stage. Draw, reduce and read-back are parts of making rows; `solve` is the
    /// rest of the shooting, repairs of rows included.
    fn seconds(&self) -> [(&'static str, f64); 11] {
        let Timings { mesh, draw, reduce, readback, solve, vertices, estimate, .. } =
            self.baked.timings;
        [
            ("load", self.load),
            ("open", self.open),
            ("mesh", mesh),
            ("draw", draw),
            ("reduce", reduce),
            ("readback", readback),
            ("solve", solve),
            ("vertices", vertices),
            ("estimate", estimate),
            ("write", self.write),
            ("total", self.total),
        ]
    }
}

/// The table's line of where the light went.
fn light_line(ledger: &Ledger) -> String {
    let emitted = ledger.emitted.element_sum();
    let share = |flux: Rgb| if emitted > 0.0 { 100.0 * flux.element_sum() / emitted } else { 0.0 };
    let in_panes = match share(ledger.pane_loss) {
        0.0 => String::new(),
        lost => format!("in panes {lost:.2} %, "),
    };
    format!(
        "light      absorbed {:.2} %, left {:.2} %, met backs {:.2} %, {in_panes}unshot {:.2} %",
        share(ledger.absorbed),
        share(ledger.escaped),
        share(ledger.backface_loss),
        share(ledger.unshot)
    )
}

/// The table's line of the parts of the error.
fn error_line(error: &ErrorEstimate) -> String {
    format!(
        "error      about {:.2} %: mesh {:.2}, sampling {:.2}, truncation {:.2}, unshot {:.2}, \
         sources {:.2}; tail {:.2}",
        100.0 * error.total,
        100.0 * error.mesh,
        100.0 * error.sampling,
        100.0 * error.truncation,
        100.0 * error.unshot,
        100.0 * error.sources,
        100.0 * error.tail
    )
}

/// The parts of an estimate.
fn parts(error: &ErrorEstimate) -> Value {
    json!({
        "total": error.total, "uncertainty": error.uncertainty, "tail": error.tail,
        "mesh": error.mesh,
        "sampling": error.sampling, "truncation": error.truncation,
        "unshot": error.unshot, "sources": error.sources, "samples": error.samples,
        "paths": error.paths,
    })
}

/// Adds the fields of `other` to those of `object`.
fn merge(object: &mut Value, other: Value) {
    if let (Some(object), Value::Object(other)) = (object.as_object_mut(), other) {
        object.extend(other);
    }
}

/// Where the light went, W per channel.
fn ledger(ledger: &Ledger) -> Value {
    let Ledger { emitted, absorbed, escaped, backface_loss, pane_loss, unshot, overshot } = ledger;
    json!({
        "emitted": emitted.to_array(),
        "absorbed": absorbed.to_array(),
        "left": escaped.to_array(),
        "back": backface_loss.to_array(),
        "panes": pane_loss.to_array(),
        "unshot": unshot.to_array(),
        "overshot": overshot.to_array(),
    })
}
