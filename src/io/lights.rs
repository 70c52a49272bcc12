//! Light sources: materials that emit by `Ke`, else by `Ka` above 1, or by the caller's settings.
//!
//! MTL has no statement for light. By common usage `Ke` is the radiance that a material emits; some
//! older scenes give a lamp an ambient colour far above 1 instead, such as Intel's Embree and
//! scenes derived from its Cornell box. Many more only name a material "light": the warning that
//! nothing emits lists these.

use crate::scene::{Material, Rgb, Sky, Warning, WarningKind};

/// Words in names of lamps, in lower case.
const LIGHT_NAMES: &str = "\
    light lamp emissive emission emit emitter emitting bulb luminaire luminous luminance neon \
    glow glowing led lite leuchte licht lampe luz luce lumiere lumière lampada fluorescent fluor \
    halogen sun spotlight downlight uplight headlight flashlight lightbulb lightsource arealight";

/// Names of materials that suggest lamps.
fn candidates<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let is_light = |name: &&str| words(name).iter().any(|word| says_light(word));
    names.filter(is_light).collect()
}

/// Whether a word in lower case means a lamp, or lamps.
fn says_light(word: &str) -> bool {
    let word = word.strip_suffix('s').filter(|one| !one.is_empty()).unwrap_or(word);
    // Or a German compound, such as `Deckenleuchte`.
    LIGHT_NAMES.split(' ').any(|name| name == word)
        || ["leuchte", "lampe"].iter().any(|end| word.ends_with(end))
}

/// The words of a name, in lower case: split at characters other than letters, and before capitals,
/// as in `ceilingLamp` and `LEDPanel`.
fn words(name: &str) -> Vec<String> {
    let letters: Vec<char> = name.chars().collect();
    let mut words = vec![String::new()];
    for (k, letter) in letters.iter().enumerate() {
        let after_small = k > 0 && letters[k - 1].is_lowercase();
        let before_small = letters.get(k + 1).is_some_and(|next| next.is_lowercase());
        if !letter.is_alphabetic() || (letter.is_uppercase() && (after_small || before_small)) {
            words.push(String::new());
        }
        if let (true, Some(word)) = (letter.is_alphabetic(), words.last_mut()) {
            word.extend(letter.to_lowercase());
        }
    }
    words
}

/// The sky over a scene of `used` materials, `wanted` if given; and the warning that none of them
/// emits, if none does and no sky was given.
pub(super) fn sky_and_warning<'a>(
    used: impl Iterator<Item = &'a Material> + Clone,
    wanted: Option<&Sky>,
    emit: &[(String, Rgb)],
) -> (Sky, Option<Warning>) {
    let is_dark = !used.clone().any(|m| m.exitance.max_element() > 0.0);
    let warns = is_dark && wanted.is_none_or(Sky::is_black);
    let default = Sky::uniform(if is_dark { Rgb::ONE } else { Rgb::ZERO });
    let sky = wanted.cloned().unwrap_or(default);
    let warning = warns.then(|| match emit {
        [] => no_light(used, sky.is_black()),
        _ => {
            let under = under(sky.is_black());
            let remedy = "give one a radiance above 0, or choose the sky yourself";
            let done = format!("what was told to emit emits 0; {under}; {remedy}");
            let names = emit.iter().map(|(name, _)| crate::error::shortened(name));
            Warning::new(WarningKind::NoLight, 1, done).naming(names)
        }
    });
    (sky, warning)
}

/// The lighting of a scene without lamps, in words.
fn under(is_black: bool) -> &'static str {
    match is_black {
        true => "left dark",
        false => "lit from outside by a sky of radiance 1",
    }
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
    let under = under(is_black);
    let done = match names.len() {
        0 => format!("{under}; for a lamp write `Ke` into a material, or --emit {example}"),
        _ => format!("{under}; these names say light: write `Ke` into them, or --emit {example}"),
    };
    Warning::new(WarningKind::NoLight, 1, done).naming(names)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_say_light_by_whole_words() {
        let lamps = ["Light", "ceilingLamp", "lamps_2", "LEDPanel", "desk LED", "areaLight3"];
        assert_eq!(candidates(lamps.into_iter()), lamps);
        let others = ["Translucent_Glass_Blue", "slightly_grey", "tiled", "satellite", "s", ""];
        assert!(candidates(others.into_iter()).is_empty());
    }
}
