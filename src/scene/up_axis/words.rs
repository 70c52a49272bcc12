//! Evidence for the up axis from words: comments of the file, and names of groups and materials.

use glam::DVec3;

use super::Evidence;
use crate::error::quoted;
use crate::scene::Scene;

/// Names of level surfaces, as parts of words of group and material names: English, German, French,
/// Spanish, Italian.
const LEVEL: &[&str] = &[
    "floor",
    "ceil",
    "ground",
    "terrain",
    "street",
    "road",
    "pavement",
    "lawn",
    "tabletop",
    "boden",
    "decke",
    "strasse",
    "plancher",
    "plafond",
    "suelo",
    "techo",
    "pavimento",
    "soffitto",
];

/// The same of upright ones.
const UPRIGHT: &[&str] = &["wall", "wand", "mauer", "pared", "parete", "facade", "fassade"];

/// Programs by words of their comments, and log-odds for the axis that their OBJ files have up by
/// default. Blender, 3ds Max and SketchUp ask, and propose y. Plain choice.
const PROGRAMS: &[(&str, f64)] = &[
    ("blender", -0.7),
    ("3ds max", -0.7),
    ("sketchup", -0.7),
    ("maya", -1.5),
    ("lightwave", -1.5),
    ("osm2world", -1.5),
    ("houdini", -1.5),
    ("unity", -1.5),
    ("freecad", 1.5),
    ("ifcconvert", 1.5),
    ("ifcopenshell", 1.5),
    ("ifcplusplus", 1.5),
    ("3dfier", 1.5),
    ("citygml2objs", 1.5),
    ("rhino", 0.7),
    ("revit", 0.7),
    ("autocad", 1.5),
];

/// Log-odds of a statement: of a hundred comments that name an axis, a few are of another program's
/// convention.
const STATEMENT: f64 = 6.0;

/// Log-odds of names, where all of the area with such names agrees: right on 35 of 36 scenes that
/// have them, ln 35 = 3.6 (`docs/data/up_axis.tsv`). Two of four walls are upright about the wrong
/// axis too, which leaves half.
const NAMES: f64 = 4.0;

pub(super) fn evidence(scene: &Scene) -> Vec<Evidence> {
    let words = comment_words(scene.comments());
    let statement = stated_axis(&words).map(|(is_z, phrase)| Evidence {
        log_odds: if is_z { STATEMENT } else { -STATEMENT },
        reason: format!("\"{phrase}\" in the comments of the file"),
    });
    let program = PROGRAMS.iter().find(|(program, _)| {
        let parts: Vec<&str> = program.split(' ').collect();
        words.windows(parts.len()).any(|at| at == parts)
    });
    let program = program.map(|&(program, log_odds)| Evidence {
        log_odds,
        reason: format!("\"{program}\" in the comments of the file"),
    });
    statement.into_iter().chain(program).chain(of_names(scene)).collect()
}

/// Words of the comments in lower case; lines end with an empty one.
fn comment_words(comments: &[String]) -> Vec<String> {
    let of_line = |line: &String| {
        let lower = line.to_lowercase();
        let words = lower.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty());
        let mut words: Vec<String> = words.map(String::from).collect();
        words.push(String::new());
        words
    };
    comments.iter().flat_map(of_line).collect()
}

/// Whether +z or +y is said to be up, and in which words; none if both or neither are.
fn stated_axis(words: &[String]) -> Option<(bool, String)> {
    let forms: [&[&str]; 8] = [
        &["?", "up"],
        &["?", "is", "up"],
        &["?", "axis", "up"],
        &["?", "axis", "is", "up"],
        &["up", "?"],
        &["up", "is", "?"],
        &["up", "axis", "?"],
        &["up", "axis", "is", "?"],
    ];
    let says = |axis: &str| {
        forms.iter().find_map(|form| {
            let matches = |at: &&[String]| {
                at.iter()
                    .zip(*form)
                    .all(|(word, part)| word == if *part == "?" { axis } else { part })
            };
            words.windows(form.len()).find(matches).map(|phrase| phrase.join(" "))
        })
    };
    match (says("y"), says("z")) {
        (None, Some(phrase)) => Some((true, phrase)),
        (Some(phrase), None) => Some((false, phrase)),
        _ => None,
    }
}

/// Area with names of level or of upright surfaces.
#[derive(Default)]
struct Named {
    area: f64,
    /// What of it is as its names say about y, and about z.
    fitting: [f64; 2],
    /// The first names.
    names: Vec<String>,
}

impl Named {
    fn evidence(self) -> Option<Evidence> {
        let [y, z] = self.fitting.map(|fitting| fitting / self.area);
        (self.area > 0.0 && y != z).then(|| Evidence {
            log_odds: NAMES * (z - y),
            reason: format!("surfaces named {}", quoted(&self.names)),
        })
    }
}

/// Of names of level and of upright surfaces: those of groups, else of materials.
fn of_names(scene: &Scene) -> impl Iterator<Item = Evidence> {
    let kinds = |names: &mut dyn Iterator<Item = &String>| names.map(|name| kind(name)).collect();
    let group_kinds: Vec<Option<Kind>> = kinds(&mut scene.groups().iter());
    let material_kinds: Vec<Option<Kind>> =
        kinds(&mut scene.materials().iter().map(|material| &material.name));
    let (mut level, mut upright) = (Named::default(), Named::default());
    for (t, triangle) in scene.triangles().iter().enumerate() {
        let [group, material] = [triangle.group, triangle.material].map(|k| k as usize);
        let of_group = group_kinds[group].map(|kind| (kind, &scene.groups()[group]));
        let of_material =
            || material_kinds[material].map(|kind| (kind, &scene.materials()[material].name));
        let Some((kind, name)) = of_group.or_else(of_material) else { continue };
        let named = if kind == Kind::Level { &mut level } else { &mut upright };
        let (area, normal) = (scene.area(t), scene.normal(t));
        named.area += area;
        for (axis, fitting) in [DVec3::Y, DVec3::Z].into_iter().zip(&mut named.fitting) {
            // Within 10 degrees: terrain and scanned floors slope.
            let fits = match kind {
                Kind::Level => normal.dot(axis).abs() > 0.985,
                Kind::Upright => normal.dot(axis).abs() < 0.174,
            };
            *fitting += if fits { area } else { 0.0 };
        }
        if named.names.len() < 3 && !named.names.contains(name) {
            named.names.push(name.clone());
        }
    }
    [level, upright].into_iter().filter_map(Named::evidence)
}

/// How surfaces lie that have a name.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Level,
    Upright,
}

/// How surfaces with this name lie; none if it does not say.
fn kind(name: &str) -> Option<Kind> {
    let lower = name.to_lowercase();
    let has = |list: &[&str]| list.iter().any(|word| lower.contains(word));
    match (has(LEVEL), has(UPRIGHT)) {
        (true, false) => Some(Kind::Level),
        (false, true) => Some(Kind::Upright),
        _ => None,
    }
}
