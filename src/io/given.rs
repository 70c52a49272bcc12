//! Materials that the caller lets emit or transmit light, by their names.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::PI;
use std::path::Path;

use super::SceneSettings;
use crate::error::{Error, ErrorKind, nearest, quoted};
use crate::scene::texture::{MaterialTextures, TextureMap};
use crate::scene::{Material, Rgb, Sides, Triangle};

/// Lets `material` emit and transmit what the settings say of its name.
pub(super) fn give_light(material: &mut Material, settings: &SceneSettings) {
    let of_name = |given: &'_ &(String, Rgb)| given.0 == material.name;
    if let Some((_, radiance)) = settings.emit.iter().rfind(of_name) {
        material.exitance = PI * *radiance;
    }
    for (_, transmittance) in settings.transmit.iter().filter(of_name) {
        let all = material.albedo();
        material.transmittance = transmittance.min(Rgb::splat(settings.max_reflectance));
        material.reflectance = (all - material.transmittance).max(Rgb::ZERO);
    }
}

/// Lets what emits do so on both sides, if the settings say so.
pub(super) fn emit_on_both_sides(
    materials: &mut [Material],
    textures: &BTreeMap<u32, MaterialTextures>,
    settings: &SceneSettings,
) {
    for (k, material) in (0u32..).zip(materials).filter(|_| settings.emit_both_sides) {
        let shows_light = textures.get(&k).is_some_and(|maps| maps.exitance.is_some());
        if shows_light || material.exitance != Rgb::ZERO {
            material.sides = Sides::Emitting;
        }
    }
}

/// `map`, whose factor is all light that `material` scatters, as the texture of its reflectance
/// alone: if it is translucent, its transmittance becomes a share of the texture.
pub(super) fn beside_transmittance(mut map: TextureMap, material: &mut Material) -> TextureMap {
    let mean = map.texture.whole_mean();
    if material.is_translucent() {
        // The transmittance is a fraction of the texture's total; the remaining reflectance gives
        // the distribution over the texture.
        let all = map.factor * mean;
        let share = material.transmittance / all.max(Rgb::splat(f64::MIN_POSITIVE));
        let share = share.min(Rgb::splat(0.99));
        material.transmittance = share * all;
        map.factor *= Rgb::ONE - share;
    }
    TextureMap { mean: map.factor * mean, ..map }
}

/// Checks whether all materials that the settings name are in the scene of the file `path`.
pub(super) fn check_names(
    materials: &[Material],
    triangles: &[Triangle],
    groups: &[String],
    path: &Path,
    settings: &SceneSettings,
) -> Result<(), Error> {
    let emitting = settings.emit.iter().map(|(name, _)| (name, "that could emit"));
    let transmitting = settings.transmit.iter();
    let transmitting = transmitting.map(|(name, _)| (name, "that could let light through"));
    for (name, what) in emitting.chain(transmitting) {
        if materials.iter().any(|material| material.name == *name) {
            continue;
        }
        let names: Vec<&str> = materials.iter().map(|m| m.name.as_str()).collect();
        let place = path.display().to_string();
        if let Some((found, remedy)) = group_named(name, &names, triangles, groups) {
            return Err(Error::new(ErrorKind::Scene, place, found, remedy));
        }
        let found = format!("no material {} {what}", quoted(&[name]));
        let meant = nearest(name, names.iter().copied());
        let meant =
            meant.map_or(String::new(), |near| format!("did you mean {}? ", quoted(&[near])));
        let remedy = format!("{meant}its materials are {}", quoted(&names));
        return Err(Error::new(ErrorKind::Scene, place, found, remedy));
    }
    Ok(())
}

/// If `name` is a group and not a material: the finding, and the correction.
fn group_named(
    name: &str,
    materials: &[&str],
    triangles: &[Triangle],
    groups: &[String],
) -> Option<(String, String)> {
    let group = groups.iter().position(|group| group == name)? as u32;
    let in_group = triangles.iter().filter(|t| t.group == group);
    let own: BTreeSet<u32> = in_group.map(|t| t.material).collect();
    let own_names: Vec<&str> =
        own.iter().filter_map(|&k| materials.get(k as usize).copied()).collect();
    let sharing = triangles.iter().filter(|t| own.contains(&t.material));
    let sharing = sharing.map(|t| t.group).collect::<BTreeSet<u32>>().len();
    let (group, list) = (quoted(&[name]), quoted(&own_names));
    let found = match (own_names.len(), sharing) {
        (0, _) => return None,
        (1, 1) => {
            return Some((
                format!("{group} is a group, of material {list}"),
                "name the material".into(),
            ));
        }
        (1, _) => format!("{group} is a group, of material {list}, which {sharing} groups share"),
        _ => format!("{group} is a group, of materials {list}"),
    };
    Some((found, "give it a material of its own".into()))
}
