//! The materials of a scene from those of its libraries: repaired, with textures, and with the
//! light given by the caller.

use std::collections::{BTreeMap, HashSet};
use std::f64::consts::PI;
use std::sync::Arc;

use glam::DAffine2;

use super::super::SceneSettings;
use super::super::given::{beside_transmittance, check_names, give_light};
use super::super::mtl::MtlMaterial;
use super::super::specular::SpecularSurfaces;
use super::super::textures::{TextureStatement, Textures, Unread};
use super::ObjFile;
use super::repairs::Repairs;
use super::statements::UNKNOWN_MATERIAL;
use crate::error::Error;
use crate::scene::texture::{MaterialTextures, Texture, TextureMap};
use crate::scene::{Material, Rgb, Specular, Triangle, WarningKind};

impl ObjFile<'_> {
    /// The textures of `materials`, whose reflectance and exitance become the means of these; empty
    /// if no used material has a readable texture.
    pub(super) fn textures(
        &mut self,
        used: &HashSet<u32>,
        materials: &mut [Material],
        settings: &SceneSettings,
    ) -> Result<BTreeMap<u32, MaterialTextures>, Error> {
        let mut images = Textures::new(self.files);
        let mut all: BTreeMap<u32, MaterialTextures> = BTreeMap::new();
        let library = (0u32..).zip(self.library.materials.iter().zip(materials));
        for (index, (mtl, material)) in library.filter(|(index, _)| used.contains(index)) {
            let place = || self.library.place(mtl, self.files);
            let mut maps = MaterialTextures::default();
            let mut map = |statement: &str| {
                let without = "`Kd` and `Ke` count alone";
                let find = |name: &str| images.get(name).map(Some);
                texture_map(statement, find, &mut self.repairs, place, without)
            };
            if let Some(statement) = mtl.textures[0].as_deref().filter(|_| !mtl.is_black(settings))
                && let Some(map) = map(statement)?
            {
                maps.reflectance = Some(mtl.reflectance_map(map, material, settings));
            }
            if let Some(statement) = &mtl.textures[1]
                && let Some(map) = map(statement)?
            {
                let given = settings.emit.iter().rfind(|(name, _)| *name == material.name);
                let radiance = given.map(|(_, radiance)| *radiance);
                let radiance = radiance.or(mtl.radiance.filter(is_not_black)).unwrap_or(Rgb::ONE);
                let factor = PI * radiance.max(Rgb::ZERO);
                let mean = factor * map.texture.whole_mean();
                maps.exitance = Some(TextureMap { factor, mean, ..map });
            }
            if let Some(statement) = &mtl.mask {
                let colours = mtl.textures[0].as_deref();
                let colours = colours.map(|colours| TextureStatement::parse(colours).name);
                let find = |name: &str| images.mask(name, colours.as_deref());
                maps.mask = texture_map(statement, find, &mut self.repairs, place, "it is opaque")?;
            }
            if maps.reflectance.is_some() || maps.exitance.is_some() || maps.mask.is_some() {
                all.insert(index, maps);
            }
        }
        Ok(all)
    }

    /// All materials, by the indices of [`ObjFile::named_materials`]. Defects are repaired, and
    /// reported if the material is `used`.
    pub(super) fn materials(
        &mut self,
        used: &HashSet<u32>,
        triangles: &[Triangle],
        settings: &SceneSettings,
    ) -> Result<Vec<Material>, Error> {
        let library = &mut self.library;
        let mut materials = Vec::with_capacity(library.materials.len());
        let emits = |m: &MtlMaterial| m.radiance.is_some_and(|l| l.max_element() > 0.0);
        let ambient_counts = settings.emit.is_empty() && !library.materials.iter().any(emits);
        for index in 0..library.materials.len() {
            let material = &library.materials[index];
            let place = || library.place(material, self.files);
            let used = used.contains(&(index as u32));
            let mut note = |kind, done: String| match used {
                true => self.repairs.note_at(kind, place, &material.name, done),
                false => Ok(()),
            };
            let complete = material.complete(settings, ambient_counts, &mut note)?;
            // Moved, not cloned: there may be many, with long names.
            let name = std::mem::take(&mut library.materials[index].name);
            materials.push(Material { name, ..complete });
        }
        let grey = |name: &str| Material::grey(name, Material::DEFAULT_REFLECTANCE);
        let names = &self.statements.materials.list;
        let unknown = names.iter().filter(|name| library.find(name).is_none());
        materials.extend(unknown.map(|name| grey(name)));
        if used.contains(&(materials.len() as u32)) {
            materials.push(grey("(default)"));
        }
        for material in &mut materials {
            material.sides = settings.sides;
            give_light(material, settings);
        }
        let groups = &self.statements.groups.list;
        check_names(&materials, triangles, groups, self.path, settings)?;
        Ok(materials)
    }
}

/// The image that `find` reads for the `statement` of a material at this `place`, as it lies on
/// surfaces, with a factor of 1; none if there is nothing to show, or if it cannot be read: then
/// what counts `without` it is reported.
fn texture_map(
    statement: &str,
    find: impl FnOnce(&str) -> Result<Option<Arc<Texture>>, Unread>,
    repairs: &mut Repairs,
    place: impl Fn() -> String,
    without: &str,
) -> Result<Option<TextureMap>, Error> {
    let TextureStatement { name, scale, offset, clamped, more } =
        TextureStatement::parse(statement);
    if more {
        let done = "`-s`, `-o` and `-clamp` count alone";
        repairs.note_at(WarningKind::TextureOptions, &place, &name, done)?;
    }
    let texture = match find(&name) {
        Ok(texture) => texture,
        Err(unread) => {
            repairs.note_at(unread.kind, place, &name, unread.and_so(without))?;
            None
        }
    };
    let placement = DAffine2::from_scale_angle_translation(scale, 0.0, offset);
    Ok(texture.map(|texture| TextureMap { placement, clamped, ..TextureMap::new(texture) }))
}

fn is_not_black(colour: &Rgb) -> bool {
    *colour != Rgb::ZERO
}

impl MtlMaterial {
    /// `map` as the texture of the reflectance of `material`, which is this one: by `Kd`, or whole
    /// without one. If the material is translucent, its transmittance becomes a share of it.
    fn reflectance_map(
        &self,
        map: TextureMap,
        material: &mut Material,
        settings: &SceneSettings,
    ) -> TextureMap {
        let ceiling = settings.max_reflectance.min(self.diffuse_room(settings));
        let factor = match self.reflectance.filter(is_not_black) {
            Some(_) => material.albedo(),
            None => Rgb::splat(ceiling),
        };
        beside_transmittance(TextureMap { factor, ceiling, ..map }, material)
    }

    /// The mirror or glass of this material, if the settings use it.
    fn specular(&self, settings: &SceneSettings) -> Option<Specular> {
        self.specular.filter(|_| settings.specular != SpecularSurfaces::Ignore)
    }

    /// Whether it reflects nothing in the light solution: it is black, or clear.
    fn is_black(&self, settings: &SceneSettings) -> bool {
        match settings.specular {
            SpecularSurfaces::Black => self.specular.is_some(),
            SpecularSurfaces::Clear => self.specular.is_some_and(|specular| specular.is_glass()),
            _ => false,
        }
    }

    /// Maximum diffuse reflectance beside a mirror or glass, equal in all channels.
    fn diffuse_room(&self, settings: &SceneSettings) -> f64 {
        self.specular(settings).map_or(1.0, |specular| 1.0 - specular.share().max_element())
    }

    /// The part of `reflectance` that is diffuse beside a mirror or glass.
    fn beside(
        &self,
        specular: Specular,
        reflectance: Rgb,
        note: &mut impl FnMut(WarningKind, String) -> Result<(), Error>,
    ) -> Result<Rgb, Error> {
        let share = specular.share();
        if self.is_metal() {
            return Ok((reflectance - share).max(Rgb::ZERO));
        }
        if (reflectance + share).max_element() > 1.0 && !specular.is_glass() {
            note(WarningKind::MoreThanAll, "`Kd` is limited to 1 - `Ks`".into())?;
        }
        Ok(reflectance.min(Rgb::ONE - share))
    }

    /// As a material of a scene, without its name; `note` is called with every repair.
    fn complete(
        &self,
        settings: &SceneSettings,
        ambient_counts: bool,
        note: &mut impl FnMut(WarningKind, String) -> Result<(), Error>,
    ) -> Result<Material, Error> {
        let ceiling = settings.max_reflectance;
        let mut radiance = self.radiance.unwrap_or(Rgb::ZERO);
        let above_one = |colour: Option<Rgb>| colour.is_some_and(|c| c.max_element() > 1.0);
        // If `Kd` is above 1 too, colours may be in other units.
        if ambient_counts && above_one(self.ambient) && !above_one(self.reflectance) {
            radiance = self.ambient.unwrap_or(Rgb::ZERO);
            note(WarningKind::AmbientAsRadiance, "taken for the radiance that they emit".into())?;
        }
        let mut reflectance = self.reflectance.unwrap_or(Rgb::ZERO);
        let specular = self.specular(settings);
        let textured = self.textures.iter().any(Option::is_some);
        let is_plain = specular.is_none() || textured;
        if self.reflectance.is_none() && radiance == Rgb::ZERO && is_plain {
            reflectance = Rgb::splat(Material::DEFAULT_REFLECTANCE);
            if !textured {
                note(WarningKind::MaterialWithoutColour, UNKNOWN_MATERIAL.into())?;
            }
        }
        if reflectance.min_element() < 0.0 || radiance.min_element() < 0.0 {
            note(WarningKind::NegativeColour, "those channels are 0".into())?;
            (reflectance, radiance) = (reflectance.max(Rgb::ZERO), radiance.max(Rgb::ZERO));
        }
        if reflectance.max_element() >= 1.0 {
            note(WarningKind::HighReflectance, format!("those channels reflect {ceiling}"))?;
            let below_one = |rho: f64| if rho < 1.0 { rho } else { ceiling };
            reflectance = Rgb::from_array(reflectance.to_array().map(below_one));
        }
        let exitance = PI * radiance;
        if !exitance.is_finite() {
            note(WarningKind::MaterialStatement, "it emits nothing".into())?;
        }
        let exitance = if exitance.is_finite() { exitance } else { Rgb::ZERO };
        if let Some(specular) = specular {
            reflectance = self.beside(specular, reflectance, note)?;
        }
        if self.is_black(settings) {
            reflectance = Rgb::ZERO;
        }
        Ok(Material { reflectance, exitance, specular, ..Material::grey("", 0.0) })
    }
}
