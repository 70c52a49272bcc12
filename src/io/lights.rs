//! Which materials emit: `Ke`, else `Ka` above 1, and what the user says.
//!
//! MTL has no statement for light. `Ke` is the radiance that a material emits by common usage; some
//! scenes, older than that usage, give a lamp an ambient colour far above 1 instead, as Intel's
//! Embree and what was made after its Cornell box do. Many more merely call a material "light": the
//! warning that nothing emits names these.

use crate::scene::{Material, Rgb, Sky, Warning, WarningKind};

/// What is part of the names that lamps are given, in lower case.
const LIGHT_NAMES: [&str; 22] = [
    "light", "lamp", "emissive", "emission", "emit", "bulb", "lumi", "neon", "glow", "led", "lite",
    "leuchte", "licht", "lampe", "luz", "luce", "lumiere", "lumière", "lampada", "fluor",
    "halogen", "sun",
];

/// Names of materials that look like lamps.
fn candidates<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let is_light = |name: &&str| {
        let name = name.to_lowercase();
        LIGHT_NAMES.iter().any(|light| match *light {
            // Within other words these say nothing: "tiled", "sundry", "satellite".
            "led" | "sun" | "lite" => {
                name.split(|c: char| !c.is_alphabetic()).any(|word| word == *light)
            }
            light => name.contains(light),
        })
    };
    names.filter(is_light).collect()
}

/// Radiance of the sky over a scene in which nothing emits, unless said otherwise, W/(m² sr).
const DEFAULT_SKY: Rgb = Rgb::ONE;

/// The sky over a scene of `used` materials where `wanted` is asked for; and the warning that none
/// of them emits, if none does and no sky was asked for.
pub(super) fn sky_and_warning<'a>(
    used: impl Iterator<Item = &'a Material> + Clone,
    wanted: Option<&Sky>,
) -> (Sky, Option<Warning>) {
    let is_dark = !used.clone().any(|m| m.exitance.max_element() > 0.0);
    let warns = is_dark && wanted.is_none_or(Sky::is_black);
    let default = Sky::uniform(if is_dark { DEFAULT_SKY } else { Rgb::ZERO });
    let sky = wanted.cloned().unwrap_or(default);
    let warning = warns.then(|| no_light(used, sky.is_black()));
    (sky, warning)
}

/// The warning that none of `used` emits, under a sky that may be black.
fn no_light<'a>(used: impl Iterator<Item = &'a Material> + Clone, is_black: bool) -> Warning {
    let names = candidates(used.clone().map(|m| m.name.as_str()));
    let example = names.first().or(Some(&"MATERIAL")).map(|name| crate::error::shortened(name));
    let example = example.unwrap_or_default().escape_debug().to_string();
    let example = if example.contains(' ') {
        format!("'{example}=15,15,15'")
    } else {
        format!("{example}=15,15,15")
    };
    let under = match is_black {
        true => "left dark",
        false => "lit from outside by a sky of radiance 1",
    };
    let done = match names.len() {
        0 => format!("{under}; for a lamp write `Ke` into a material, or --emit {example}"),
        _ => format!("{under}; these names say light: write `Ke` into them, or --emit {example}"),
    };
    Warning::new(WarningKind::NoLight, 1, done).naming(names)
}
