//! The settings of a bake that `--set` sets and the report has, by their names in the library.

use std::sync::Arc;

use clap::CommandFactory;
use radiosity::BakeSettings;
use radiosity::solver::Method;
use serde_json::{Map, Value, json};

use crate::args::{Parsed, give};

/// A setting made by an option, after all others were chosen.
pub type Adjustment = Arc<dyn Fn(&mut BakeSettings) + Send + Sync>;

/// A field of [`BakeSettings`].
struct Setting {
    /// Its path there.
    name: &'static str,
    /// What it is, its unit, and in brackets what it is unless set.
    meaning: &'static str,
    read: fn(&str) -> Parsed<Adjustment>,
    /// As JSON; none where vertices do not gather and it is of those that do.
    get: fn(&BakeSettings) -> Option<Value>,
}

/// The type of a field.
trait Field: Clone + Send + Sync + 'static {
    fn read(text: &str) -> Parsed<Self>;
    fn json(&self) -> Value;
}

macro_rules! field {
    ($($type:ty, $expected:literal, $value:ident => $json:expr;)+) => {
        $(impl Field for $type {
            fn read(text: &str) -> Parsed<$type> {
                text.parse().map_err(|_| give($expected))
            }

            fn json(&self) -> Value {
                let $value = self;
                json!($json)
            }
        })+
    };
}

field! {
    bool, "true or false", value => value;
    f64, "a number", value => value;
    u32, "a whole number of at least zero", value => value;
    u64, "a whole number of at least zero", value => value;
    usize, "a whole number of at least zero", value => value;
    Method, "shooting, overshoot, jacobi, gauss-seidel, gmres or direct", it => it.to_string();
}

impl<T: Field> Field for Option<T> {
    fn read(text: &str) -> Parsed<Option<T>> {
        T::read(text).map(Some)
    }

    fn json(&self) -> Value {
        self.as_ref().map_or(Value::Null, T::json)
    }
}

/// A field of [`SolveSettings`](radiosity::bake::SolveSettings) or, where vertices gather, of
/// [`GatherSettings`](radiosity::bake::GatherSettings).
macro_rules! setting {
    (solve $(.$field:ident)+, $meaning:literal) => {
        Setting {
            name: concat!("solve", $(".", stringify!($field)),+),
            meaning: $meaning,
            read: |text| {
                let value = Field::read(text)?;
                Ok(Arc::new(move |s: &mut BakeSettings| s.solve $(.$field)+ = Clone::clone(&value)))
            },
            get: |s| Some(s.solve $(.$field)+.json()),
        }
    };
    (gather $(.$field:ident)+, $meaning:literal) => {
        Setting {
            name: concat!("gather", $(".", stringify!($field)),+),
            meaning: $meaning,
            read: |text| {
                let value = Field::read(text)?;
                Ok(Arc::new(move |s: &mut BakeSettings| {
                    if let Some(gather) = &mut s.gather {
                        gather $(.$field)+ = Clone::clone(&value);
                    }
                }))
            },
            get: |s| s.gather.as_ref().map(|gather| gather $(.$field)+.json()),
        }
    };
}

#[rustfmt::skip] // a line a name
const SETTINGS: &[Setting] = &[
    setting!(solve.element_size,
        "longest edge of an element that light is shot on, scene unit [by the error; without one, \
         diagonal / 32 at least]"),
    setting!(solve.hemicube_resolution,
        "pixels along an edge of a hemicube's top face, even, for patches that shoot much; dimmer \
         ones have fewer, 16 at least [by the error; without one, 128]"),
    setting!(solve.full_resolution_share,
        "share of the emitted light from which on a patch shoots much; 0 for all patches [by the \
         device]"),
    setting!(solve.near_reach,
        "closed forms for receivers within this many patch diameters; below 0 for none [1]"),
    Setting {
        name: "solve.solver.method",
        meaning: "how light is spread: shooting, overshoot, jacobi, gauss-seidel, gmres or direct \
                  [gmres where reflectance is near one, else shooting]",
        read: |text| {
            let method: Method = Field::read(text)?;
            Ok(Arc::new(move |s: &mut BakeSettings| {
                s.solve.solver.method = method;
                s.solve.gmres_if_bright = false;
            }))
        },
        get: |s| Some((!s.solve.gmres_if_bright).then_some(s.solve.solver.method).json()),
    },
    setting!(solve.solver.unshot,
        "share of the emitted flux at which the solver stops [by the error; without one, 0.0001]"),
    setting!(solve.solver.max_steps,
        "steps after which the solver stops; for shooting, shots [none]"),
    setting!(solve.solver.row_memory,
        "memory for form-factor rows that are kept, bytes [1073741824]"),
    setting!(solve.solver.patch_tolerance,
        "error of a patch's light for which the patch may shoot as a whole; 0 for patches as small \
         as possible [by the error; without one, 0.004]"),
    setting!(solve.solver.min_patch_level,
        "levels of the smallest patches above the elements; 4^N elements a patch [0]"),
    setting!(solve.ambient,
        "whether the unshot light is added, spread evenly; files say so [false]"),
    setting!(gather.element_size,
        "longest edge of the elements whose corners gather first, scene unit [by the error]"),
    setting!(gather.contact_levels,
        "levels by which those elements are split that other surfaces touch [by the error]"),
    setting!(gather.rays,
        "rays a vertex [by the error]"),
    setting!(gather.noise_tolerance,
        "share of the irradiance that its error by noise may be before rays are doubled, up to \
         16-fold; inf for never [the error]"),
    setting!(gather.refinement.mesh_error,
        "predicted error of the mesh, as a share of radiosity, at which splitting stops [by the \
         error]"),
    setting!(gather.refinement.min_edge,
        "length over which light may change; elements are split down to an eighth of it; scene \
         unit [by the error]"),
    setting!(gather.refinement.interpolation_tolerance,
        "share of radiosity by which the quadratic interpolant may differ from an element before \
         it is split once more, without a gather; inf for never [by the error]"),
    setting!(gather.refinement.max_elements,
        "maximum number of elements [524288; of large scenes 20 a triangle, up to 4 million]"),
    setting!(gather.refinement.initial_subdivisions,
        "subdivisions of all elements before refinement; --gather sets it [0]"),
    setting!(gather.refinement.gather_passes,
        "passes in which all vertices gather, each the light of the pass before [by the error]"),
];

/// Letters of a name for each typing error in it, at least. Chosen by hand.
const LETTERS_AN_ERROR: usize = 3;

/// The part of a name behind its last point.
fn short(name: &str) -> &str {
    name.rsplit('.').next().unwrap_or(name)
}

/// The setting of this name, or of the only name that ends in it.
fn named(name: &str) -> Parsed<&'static Setting> {
    let name = name.trim().replace('-', "_");
    let is_end = |of: &str| of.strip_suffix(&*name).is_some_and(|before| before.ends_with('.'));
    let all = || SETTINGS.iter();
    if let Some(setting) = all().find(|setting| setting.name == name) {
        return Ok(setting);
    }
    match all().filter(|setting| is_end(setting.name)).collect::<Vec<_>>()[..] {
        [setting] => Ok(setting),
        [] => {
            let distance = |s: &&Setting| strsim::osa_distance(short(&name), short(s.name));
            let near = all().min_by_key(distance);
            let near = near.filter(|s| LETTERS_AN_ERROR * distance(s) <= short(&name).len());
            let meant = near.map(|s| format!(", such as {}", s.name)).unwrap_or_default();
            Err(give(&format!("a setting that `radiosity bake --list-settings` lists{meant}")))
        }
        [first, second, ..] => Err(give(&format!("{} or {}", first.name, second.name))),
    }
}

/// The adjustment that `NAME=VALUE` asks for.
pub fn adjustment(text: &str) -> Parsed<Adjustment> {
    let (name, value) = text.split_once('=').ok_or_else(|| give("NAME=VALUE"))?;
    (named(name)?.read)(value.trim())
}

/// Columns of a line.
const WIDTH: usize = 100;

/// Prints all settings, and the options that the help does not list.
pub fn print() {
    say!(
        "Settings of a bake, --set NAME=VALUE. The end of a name is enough where no other setting \
         has it:\n--set rays=512. In brackets the value unless set; without an error it is that of \
         --gather none.\n"
    );
    SETTINGS.iter().for_each(|setting| print_entry(setting.name, setting.meaning));
    say!("\nOptions that the help does not list, of the scene and the device for all commands:\n");
    let mut program = crate::Program::command();
    program.build();
    let bake = program.find_subcommand("bake").expect("it is a command");
    for option in bake.get_arguments().filter(|option| option.is_hide_set()) {
        let help = option.get_help().cloned().unwrap_or_default();
        print_entry(&option.to_string(), &help.to_string());
    }
}

/// Prints a name and, below it, a text in lines of no more than [`WIDTH`] columns.
fn print_entry(name: &str, text: &str) {
    say!("  {name}");
    let mut line = " ".repeat(5);
    for word in text.split_whitespace() {
        if line.chars().count() + 1 + word.chars().count() > WIDTH {
            say!("{line}");
            line.truncate(5);
        }
        line += " ";
        line += word;
    }
    say!("{line}");
}

/// All settings, for the report. JSON has no infinity: what is infinite is null.
pub fn report(settings: &BakeSettings) -> Map<String, Value> {
    let value = |setting: &Setting| Some((setting.name.into(), (setting.get)(settings)?));
    let mut report: Map<String, Value> = SETTINGS.iter().filter_map(value).collect();
    let mut add = |name: &str, value: Value| _ = report.insert(name.into(), value);
    let solve = &settings.solve;
    add("solve.region", json!(solve.region.map(|r| [r.low.to_array(), r.high.to_array()])));
    add("solve.gathered_materials", json!(solve.gathered_materials));
    add("gather", json!(if settings.gather.is_some() { "needed" } else { "none" }));
    if let Some(gather) = &settings.gather {
        add("gather.refinement.group_scales", json!(gather.refinement.group_scales));
        add("gather.refinement.group_factors", json!(gather.refinement.group_factors));
    }
    report
}

/// All settings by name, for a table: empty where one is of vertices that gather and none does.
pub fn cells(settings: &BakeSettings) -> impl Iterator<Item = (&'static str, String)> {
    let cell = |value: Value| match value {
        Value::String(text) => text,
        value => value.to_string(),
    };
    SETTINGS.iter().map(move |s| (s.name, (s.get)(settings).map_or(String::new(), cell)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wrong(text: &str) -> String {
        adjustment(text).err().expect("it is wrong")
    }

    #[test]
    fn settings_go_by_the_end_of_their_names() {
        for name in ["gather.rays", "rays", "refinement.min_edge", "unshot", "mesh-error"] {
            assert!(adjustment(&format!("{name}=1")).is_ok(), "{name}");
        }
        assert_eq!(wrong("element_size=1"), "give solve.element_size or gather.element_size");
        assert!(wrong("max_element=1").ends_with("such as gather.refinement.max_elements"));
        assert!(wrong("quux=1").ends_with("lists"));
        assert_eq!(wrong("rays"), "give NAME=VALUE");
        assert_eq!(wrong("rays=many"), "give a whole number of at least zero");
    }
}
