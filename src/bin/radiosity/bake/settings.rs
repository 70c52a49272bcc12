//! The settings of a bake that options set: a table of each option's name, what its value should
//! be, and the field it sets. The report writes every field under the name in [`report`].

use std::str::FromStr;

use radiosity::BakeSettings;
use radiosity::bake::GatherSettings;
use radiosity::gather::RefinementSettings;
use serde_json::{Map, Value, json};

use crate::args::{self, Stop};

/// A setting made by hand, after all others were chosen.
pub type Adjustment = Box<dyn Fn(&mut BakeSettings)>;

/// An option `--name VALUE` and the setting it makes.
pub struct Setting {
    pub name: &'static str,
    /// What the value should be, for errors.
    expected: &'static str,
    /// Reads the value, if it is as expected.
    read: fn(&str) -> Option<Adjustment>,
}

impl Setting {
    pub fn named(name: &str) -> Option<&'static Setting> {
        SETTINGS.iter().find(|setting| setting.name == name)
    }

    /// The adjustment that the option's value asks for.
    pub fn adjustment(&self, parser: &mut lexopt::Parser) -> Result<Adjustment, Stop> {
        let text: String = args::value(parser, self.name, self.expected)?;
        (self.read)(&text).ok_or_else(|| args::wrong_value(self.name, &text, self.expected))
    }
}

const NUMBER: &str = "a number";
const COUNT: &str = "a whole number of at least zero";
const POSITIVE: &str = "a whole number above zero";
const SOLVER: &str = "shooting, overshoot, jacobi, gauss-seidel, gmres or direct";

/// Bytes in the megabyte (2²⁰) that memory is given in.
const MEGABYTE: usize = 1 << 20;

const fn setting(
    name: &'static str,
    expected: &'static str,
    read: fn(&str) -> Option<Adjustment>,
) -> Setting {
    Setting { name, expected, read }
}

#[rustfmt::skip] // one line a setting
const SETTINGS: [Setting; 22] = [
    setting("element-size", NUMBER, |v| bake(v, |s, v| s.solve.element_size = v)),
    setting("contacts", COUNT, |v| bake(v, |s, v| s.solve.contact_levels = v)),
    setting("hemicube", COUNT, |v| bake(v, |s, v| s.solve.hemicube_resolution = v)),
    setting("full-share", NUMBER, |v| bake(v, |s, v| s.solve.full_resolution_share = Some(v))),
    setting("near", NUMBER, |v| bake(v, |s, v| s.solve.near_reach = v)),
    setting("viewpoints", NUMBER, |v| bake(v, |s, v| s.solve.viewpoint_tolerance = Some(v))),
    setting("rotations", POSITIVE, |v| bake(v, |s, v| s.solve.rotations = v)),
    setting("solver", SOLVER, |v| bake(v, |s, v| {
        s.solve.solver.method = v;
        s.solve.gmres_if_bright = false;
    })),
    setting("unshot", NUMBER, |v| bake(v, |s, v| s.solve.solver.unshot = v)),
    setting("shots", COUNT, |v| bake(v, |s, v| s.solve.solver.max_steps = Some(v))),
    setting("row-memory", COUNT, |v| bake(v, |s, v: usize| {
        s.solve.solver.row_memory = v.saturating_mul(MEGABYTE);
    })),
    setting("patch-tolerance", NUMBER, |v| bake(v, |s, v| s.solve.solver.patch_tolerance = v)),
    setting("patch-level", COUNT, |v| bake(v, |s, v| s.solve.solver.min_patch_level = v)),
    setting("gather-size", NUMBER, |v| gather(v, |g, v| g.element_size = v)),
    setting("gather-contacts", COUNT, |v| gather(v, |g, v| g.contact_levels = v)),
    setting("rays", COUNT, |v| gather(v, |g, v| g.rays = v)),
    setting("noise", NUMBER, |v| gather(v, |g, v| g.noise_tolerance = v)),
    setting("mesh-error", NUMBER, |v| gather(v, |g, v| g.refinement.mesh_error = v)),
    setting("curve", NUMBER, |v| gather(v, |g, v| g.refinement.interpolation_tolerance = v)),
    setting("smallest", NUMBER, |v| gather(v, |g, v| g.refinement.min_edge = v)),
    setting("max-elements", COUNT, |v| gather(v, |g, v| g.refinement.max_elements = v)),
    setting("sweeps", COUNT, |v| gather(v, |g, v| g.refinement.gather_passes = v)),
];

/// A setting of any bake.
fn bake<T>(value: &str, set: fn(&mut BakeSettings, T)) -> Option<Adjustment>
where
    T: FromStr + Clone + 'static,
{
    let value: T = value.parse().ok()?;
    Some(Box::new(move |settings| set(settings, value.clone())))
}

/// A setting of vertices that gather; where they do not, it changes nothing.
fn gather<T>(value: &str, set: fn(&mut GatherSettings, T)) -> Option<Adjustment>
where
    T: FromStr + Clone + 'static,
{
    let value: T = value.parse().ok()?;
    Some(Box::new(move |settings| {
        if let Some(gather) = &mut settings.gather {
            set(gather, value.clone());
        }
    }))
}

/// All settings, as the report names them. JSON has no infinity: `noise` and `curve` are null where
/// they are infinite.
pub fn report(settings: &BakeSettings) -> Map<String, Value> {
    let solve = &settings.solve;
    let solver = &solve.solver;
    let mut report = json!({
        "element_size": solve.element_size,
        "region": solve.region.map(|r| [r.low.to_array(), r.high.to_array()]),
        "gathered_lights": solve.gathered_materials,
        "contacts": settings.solve.contact_levels,
        "hemicube": settings.solve.hemicube_resolution,
        "full_share": settings.solve.full_resolution_share,
        "near": settings.solve.near_reach,
        "viewpoints": settings.solve.viewpoint_tolerance,
        "rotations": settings.solve.rotations.get(),
        "solver": (!settings.solve.gmres_if_bright).then(|| solver.method.to_string()),
        "unshot": solver.unshot,
        "shots": solver.max_steps,
        "row_memory": solver.row_memory,
        "patch_tolerance": solver.patch_tolerance,
        "patch_level": solver.min_patch_level,
        "ambient": solve.ambient,
        "gather": if settings.gather.is_some() { "needed" } else { "none" },
    });
    if let Some(gather) = &settings.gather {
        let GatherSettings { element_size, contact_levels, rays, noise_tolerance, .. } = gather;
        let RefinementSettings {
            mesh_error,
            min_edge: smallest,
            interpolation_tolerance: curve,
            max_elements: elements,
            initial_subdivisions: everywhere,
            gather_passes: sweeps,
            region: _,
            gap_factor,
            group_scales,
            group_factors,
        } = &gather.refinement;
        report["gather_size"] = json!(element_size);
        report["gather_contacts"] = json!(contact_levels);
        report["rays"] = json!(rays);
        report["noise"] = json!(noise_tolerance);
        report["mesh_error"] = json!(mesh_error);
        report["smallest"] = json!(smallest);
        report["curve"] = json!(curve);
        report["max_elements"] = json!(elements);
        report["gather_levels"] = json!(everywhere);
        report["sweeps"] = json!(sweeps);
        report["gap_factor"] = json!(gap_factor);
        report["group_scales"] = json!(group_scales);
        report["group_factors"] = json!(group_factors);
    }
    match report {
        Value::Object(map) => map,
        _ => unreachable!("an object was made"),
    }
}
