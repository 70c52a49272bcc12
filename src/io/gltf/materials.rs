//! Materials of a glTF scene as reflectance, exitance and glass.
//!
//! | of the file | here |
//! |---|---|
//! | base colour × texture × `COLOR_0` | reflectance, of what is no metal |
//! | metallic, roughness, their texture | a share of metal ([`diffuse_share_of_metal`]) |
//! | emissive × texture × `KHR_materials_emissive_strength` | radiance: exitance over π |
//! | `alphaMode` `MASK`; `BLEND` with a texture | cut-outs: solid from the cutoff; from a half on |
//! | `BLEND` below a half | a pane that lets 1 − alpha pass |
//! | `KHR_materials_transmission` of a half and more, `ior`, `volume` | glass of the base colour |
//! | `KHR_materials_diffuse_transmission` | transmittance |
//! | `KHR_materials_unlit` | black |
//! | `KHR_materials_pbrSpecularGlossiness` | its diffuse part |
//!
//! Without `pbrMetallicRoughness` it is no metal, though the format's default is one. Without a
//! metallic factor and texture it is one if at least half of the file's materials have either: then
//! what wrote the file leaves out the default of 1 alone, and else it leaves out all. `doubleSided`
//! says which faces are drawn, not which ones light reaches: [`Sides::Auto`](crate::scene::Sides)
//! finds these.

use std::collections::{BTreeMap, HashSet};
use std::f64::consts::PI;

use glam::{DAffine2, DVec2};

use super::super::SceneSettings;
use super::super::given::{beside_transmittance, give_light};
use super::super::obj::repairs::Repairs;
use super::super::specular::{SpecularSurfaces, diffuse_share_of_metal};
use super::super::textures::Unread;
use super::document::{Document, Material as Given, TextureInfo};
use super::images::{Coverage, Images, Metal};
use crate::error::Error;
use crate::scene::texture::{MaterialTextures, TextureMap};
use crate::scene::{Material, Rgb, Specular, WarningKind};

/// Alpha, and the share of light that passes, from which on the one or the other is all that
/// counts: surfaces are solid or clear here.
const HALF: f64 = 0.5;

/// Wrapping modes of samplers.
const CLAMP_TO_EDGE: u32 = 33071;
const MIRRORED_REPEAT: u32 = 33648;

/// The materials of a scene.
#[derive(Default)]
pub(super) struct Materials {
    pub materials: Vec<Material>,
    pub textures: BTreeMap<u32, MaterialTextures>,
}

/// Name of material `k`.
pub(super) fn name(document: &Document, k: usize) -> String {
    let name = document.materials[k].as_ref().and_then(|material| material.name.clone());
    name.filter(|name| !name.is_empty()).unwrap_or_else(|| format!("material {k}"))
}

/// The set of texture coordinates of material `k`: that of its colours, else of what it emits.
pub(super) fn coordinate_set(document: &Document, k: Option<usize>) -> usize {
    let material = k.and_then(|k| document.materials.get(k)?.as_ref());
    let first = material.and_then(|material| {
        let colour = Colour::of(material).texture;
        colour.or_else(|| material.emissive_texture.clone())
    });
    first.map_or(0, |info| set_of(&info))
}

fn set_of(info: &TextureInfo) -> usize {
    let transform = info.extensions.transform.as_ref();
    transform.and_then(|transform| transform.tex_coord).unwrap_or(info.tex_coord)
}

/// The colour that light is reflected with, and what of it is metal.
#[derive(Default)]
struct Colour {
    factor: Option<[f64; 4]>,
    texture: Option<TextureInfo>,
    metallic: f64,
    roughness: f64,
    metal_texture: Option<TextureInfo>,
    /// Whether there is a `pbrMetallicRoughness`.
    has_properties: bool,
    /// Whether it is a metal by default alone.
    is_metal_by_default: bool,
}

impl Colour {
    /// Of a material without a metallic factor, where the file means 1 by that.
    fn metal_where_omitted(mut self, omitted: f64) -> Colour {
        if self.is_metal_by_default && self.has_properties {
            self.metallic = omitted;
            self.is_metal_by_default = omitted == 0.0;
        }
        self
    }

    fn of(material: &Given) -> Colour {
        if let Some(glossy) = &material.extensions.specular_glossiness {
            let (factor, texture) = (glossy.diffuse_factor, glossy.diffuse_texture.clone());
            return Colour { factor, texture, ..Colour::default() };
        }
        let Some(pbr) = material.pbr_metallic_roughness.clone() else {
            return Colour { is_metal_by_default: true, ..Colour::default() };
        };
        let given = pbr.metallic_factor.or(pbr.metallic_roughness_texture.as_ref().map(|_| 1.0));
        Colour {
            factor: pbr.base_color_factor,
            texture: pbr.base_color_texture,
            metallic: given.unwrap_or(0.0).clamp(0.0, 1.0),
            roughness: pbr.roughness_factor.unwrap_or(1.0).clamp(0.0, 1.0),
            metal_texture: pbr.metallic_roughness_texture,
            has_properties: true,
            is_metal_by_default: given.is_none(),
        }
    }

    fn rgb(&self) -> Rgb {
        let [r, g, b, _] = self.factor.unwrap_or([1.0; 4]);
        Rgb::new(r, g, b)
    }

    fn alpha(&self) -> f64 {
        self.factor.map_or(1.0, |[.., alpha]| alpha.clamp(0.0, 1.0))
    }
}

/// Materials while they are read.
pub(super) struct MaterialReader<'a, 'b> {
    pub document: &'a Document,
    pub images: Images<'a, 'b>,
    pub settings: &'a SceneSettings,
    pub repairs: &'a mut Repairs,
    /// Materials that triangles have.
    pub used: HashSet<u32>,
    /// Metallic of materials without a factor.
    pub omitted_metallic: f64,
    /// Whether each material has colours of vertices.
    pub is_coloured: &'a [bool],
}

impl MaterialReader<'_, '_> {
    /// All materials of the document, and one for triangles without a material.
    pub fn read(mut self) -> Result<Materials, Error> {
        let mut all = Materials::default();
        for k in 0..self.is_coloured.len() {
            let given = self.document.materials.get(k);
            let name = given.map_or_else(|| "(default)".into(), |_| name(self.document, k));
            let unreadable = Given::default();
            let material = given.map_or(&unreadable, |given| given.as_ref().unwrap_or(&unreadable));
            if matches!(given, Some(None)) {
                let done = "taken as one without properties";
                self.note(k, WarningKind::MaterialStatement, done, &name)?;
            }
            let (material, maps) = self.material(k, &name, material)?;
            if maps.reflectance.is_some() || maps.exitance.is_some() || maps.mask.is_some() {
                all.textures.insert(k as u32, maps);
            }
            all.materials.push(Material { name, sides: self.settings.sides, ..material });
        }
        Ok(all)
    }

    /// Notes `done` about material `k`, if it is used.
    fn note(
        &mut self,
        k: usize,
        kind: WarningKind,
        done: impl Into<String>,
        name: &str,
    ) -> Result<(), Error> {
        match self.used.contains(&(k as u32)) {
            true => self.repairs.note_at(kind, || format!("material {k}"), name, done),
            false => Ok(()),
        }
    }

    fn material(
        &mut self,
        k: usize,
        name: &str,
        given: &Given,
    ) -> Result<(Material, MaterialTextures), Error> {
        use SpecularSurfaces::{Black, Clear, Ignore};
        let (ceiling, specular) = (self.settings.max_reflectance, self.settings.specular);
        let extensions = &given.extensions;
        let mut maps = MaterialTextures::default();
        if extensions.unlit.is_some() {
            self.note(k, WarningKind::Unlit, "black: light does not change how it is shown", name)?;
            return Ok((Material::grey("", 0.0), maps));
        }
        let colour = Colour::of(given).metal_where_omitted(self.omitted_metallic);
        let is_bare = colour.factor.is_none() && colour.texture.is_none() && !self.is_coloured[k];
        let radiance = self.radiance(k, name, given);
        let mut base = colour.rgb();
        if is_bare && radiance == Rgb::ZERO {
            base = Rgb::splat(Material::DEFAULT_REFLECTANCE);
            let done = "reflecting 0.5, where the format's default is white metal";
            self.note(k, WarningKind::MaterialWithoutColour, done, name)?;
        } else if colour.is_metal_by_default {
            let done = "no metal, where the format's default is one";
            self.note(k, WarningKind::MetalByDefault, done, name)?;
        }
        if base.min_element() < 0.0 {
            self.note(k, WarningKind::NegativeColour, "those channels are 0", name)?;
            base = base.max(Rgb::ZERO);
        }
        if base.max_element() >= 1.0 {
            let done = format!("those channels reflect {ceiling}");
            self.note(k, WarningKind::HighReflectance, done, name)?;
            let below_one = |rho: f64| if rho < 1.0 { rho } else { ceiling };
            base = Rgb::from_array(base.to_array().map(below_one));
        }
        // Metal.
        let mut material = Material::grey("", 0.0);
        let metal = self.metal(k, name, &colour)?;
        let uniform = match metal {
            UniformOrTexture::Uniform(metallic, roughness) if specular != Ignore => {
                let share = diffuse_share_of_metal(roughness);
                let mirror = metallic * (1.0 - share);
                if mirror > 0.0 && colour.texture.is_none() && !self.is_coloured[k] {
                    material.specular = Some(Specular::Mirror { reflectance: mirror * base });
                }
                if metallic > 0.0 {
                    let done = "by its roughness a share is reflected diffusely, the rest as by a \
                                mirror, which the light solution leaves out";
                    self.note(k, WarningKind::Metal, done, name)?;
                }
                1.0 - mirror
            }
            _ => 1.0,
        };
        let mut reflectance = uniform * base;
        if specular == Black && material.specular.is_some() {
            reflectance = Rgb::ZERO;
        }
        // Glass and panes.
        let alpha = self.coverage(k, name, given, &colour, &mut maps)?;
        let glass = self.glass(k, name, given, alpha, colour.rgb())?;
        if let Some(glass) = glass.filter(|_| specular != Ignore) {
            let room = Rgb::ONE - glass.share();
            reflectance =
                if matches!(specular, Clear | Black) { Rgb::ZERO } else { reflectance.min(room) };
            material.specular = Some(glass);
        }
        if let Some(through) = &extensions.diffuse_transmission {
            let share = through.diffuse_transmission_factor.clamp(0.0, 1.0);
            let tint = through.diffuse_transmission_color_factor.map_or(Rgb::ONE, Rgb::from_array);
            reflectance *= 1.0 - share;
            let most = (Rgb::splat(ceiling) - reflectance).max(Rgb::ZERO);
            material.transmittance = (share * tint).clamp(Rgb::ZERO, most);
        }
        material.reflectance = reflectance;
        let exitance = PI * radiance;
        let is_usable = exitance.is_finite() && exitance.min_element() >= 0.0;
        if !is_usable {
            self.note(k, WarningKind::MaterialStatement, "it emits nothing", name)?;
        }
        material.exitance = if is_usable { exitance } else { Rgb::ZERO };
        material.name = name.into();
        give_light(&mut material, self.settings);
        if material.scatters() {
            maps.reflectance = self.reflectance_map(k, name, &colour, metal, &mut material)?;
        }
        if let Some(info) = given.emissive_texture.as_ref().filter(|_| radiance != Rgb::ZERO) {
            maps.exitance = self.exitance_map(k, name, given, info, material.exitance)?;
            if let Some(map) = &maps.exitance {
                material.exitance = map.mean;
            }
        }
        if let Some(map) = &maps.reflectance {
            material.reflectance = map.mean;
        }
        Ok((material, maps))
    }

    /// Emitted radiance, without its texture: the file's, or that of the settings.
    fn radiance(&self, k: usize, name: &str, given: &Given) -> Rgb {
        let emit = self.settings.emit.iter().rfind(|(emitting, _)| emitting == name);
        if let Some((_, radiance)) = emit.filter(|_| k < self.document.materials.len()) {
            return *radiance;
        }
        let strength = given.extensions.emissive_strength.as_ref();
        let strength = strength.map_or(1.0, |extension| extension.emissive_strength);
        strength * given.emissive_factor.map_or(Rgb::ZERO, Rgb::from_array)
    }

    /// Metallic and roughness, as numbers or as a texture that lies where that of the colours does.
    fn metal(&mut self, k: usize, name: &str, colour: &Colour) -> Result<UniformOrTexture, Error> {
        let Colour { metallic, roughness, .. } = *colour;
        let Some(info) = colour.metal_texture.as_ref().filter(|_| metallic > 0.0) else {
            return Ok(UniformOrTexture::Uniform(metallic, roughness));
        };
        let is_beside = colour.texture.as_ref().is_none_or(|of_colour| {
            set_of(of_colour) == set_of(info) && placement(of_colour) == placement(info)
        });
        let texture = info.index;
        match self.images.mean_metal(texture) {
            Ok(_) if is_beside => {
                Ok(UniformOrTexture::Texture(Metal { texture, metallic, roughness }))
            }
            Ok([blue, green]) => Ok(UniformOrTexture::Uniform(metallic * blue, roughness * green)),
            Err(unread) => {
                self.unread(k, name, &unread, "it is no metal")?;
                Ok(UniformOrTexture::Uniform(0.0, 1.0))
            }
        }
    }

    /// Puts the mask of a material into `maps`, if it has holes; the share of light that a surface
    /// without any solid part stops.
    fn coverage(
        &mut self,
        k: usize,
        name: &str,
        given: &Given,
        colour: &Colour,
        maps: &mut MaterialTextures,
    ) -> Result<f64, Error> {
        let cutoff = match given.alpha_mode.as_deref() {
            Some("MASK") => given.alpha_cutoff.unwrap_or(HALF),
            Some("BLEND") => HALF,
            _ => return Ok(1.0),
        };
        let alpha = colour.alpha();
        let Some(info) = &colour.texture else {
            let is_hole = given.alpha_mode.as_deref() == Some("MASK") && alpha < cutoff;
            return Ok(if is_hole { 0.0 } else { alpha });
        };
        match self.images.coverage(info.index, alpha, cutoff) {
            Ok(Coverage::Solid) => Ok(1.0),
            Ok(Coverage::Nothing(mean)) => Ok(mean),
            Ok(Coverage::Mask(mask)) => {
                maps.mask = Some(self.lay(k, name, TextureMap::new(mask), info)?);
                Ok(1.0)
            }
            Err(unread) => {
                self.unread(k, name, &unread, "it is opaque")?;
                Ok(1.0)
            }
        }
    }

    /// The glass of a material, or the pane that stops a share `alpha` of light, if light passes
    /// more than half.
    fn glass(
        &mut self,
        k: usize,
        name: &str,
        given: &Given,
        alpha: f64,
        base: Rgb,
    ) -> Result<Option<Specular>, Error> {
        let extensions = &given.extensions;
        let passed = extensions.transmission.as_ref().map_or(0.0, |t| t.transmission_factor);
        let emits = self.radiance(k, name, given) != Rgb::ZERO;
        let is_clear = passed >= HALF || alpha < HALF;
        if (passed > 0.0 || alpha < 1.0) && (!is_clear || emits) {
            let done = "opaque: it emits light, or less than half of it passes";
            self.note(k, WarningKind::Transparency, done, name)?;
        }
        if !is_clear || emits {
            return Ok(None);
        }
        self.note(k, WarningKind::Specular, self.settings.specular.treatment(), name)?;
        if passed < HALF {
            let transmittance = Rgb::splat(1.0 - alpha);
            return Ok(Some(Specular::Glass { refractive_index: 1.0, transmittance }));
        }
        let index = extensions.ior.as_ref().and_then(|extension| extension.ior).unwrap_or(1.5);
        let index = if index > 0.0 { index } else { 1.5 };
        let inside = extensions.volume.as_ref().map_or(Rgb::ONE, |volume| {
            let colour = volume.attenuation_color.map_or(Rgb::ONE, Rgb::from_array);
            let lengths = volume.attenuation_distance.map_or(0.0, |d| volume.thickness_factor / d);
            let lengths = if lengths.is_finite() { lengths.max(0.0) } else { 0.0 };
            colour.clamp(Rgb::ZERO, Rgb::ONE).map(|share| libm::pow(share, lengths))
        });
        let transmittance = (passed.min(1.0) * base * inside).clamp(Rgb::ZERO, Rgb::ONE);
        let refractive_index = index.clamp(1.0, Specular::MAX_REFRACTIVE_INDEX);
        Ok(Some(Specular::Glass { refractive_index, transmittance }))
    }

    /// The texture of the reflectance of `material`; none if all of it reflects the same.
    fn reflectance_map(
        &mut self,
        k: usize,
        name: &str,
        colour: &Colour,
        metal: UniformOrTexture,
        material: &mut Material,
    ) -> Result<Option<TextureMap>, Error> {
        let metal = match metal {
            UniformOrTexture::Texture(metal) => Some(metal),
            UniformOrTexture::Uniform(..) => None,
        };
        let metal = metal.filter(|_| self.settings.specular != SpecularSurfaces::Ignore);
        let info = colour.texture.as_ref().or(metal.and(colour.metal_texture.as_ref()));
        if info.is_none() && !self.is_coloured[k] {
            return Ok(None);
        }
        let texture = self.images.colours(colour.texture.as_ref().map(|info| info.index), metal);
        let texture = match texture {
            Ok(texture) => texture,
            Err(unread) => {
                self.unread(k, name, &unread, "its factor alone counts")?;
                if !self.is_coloured[k] {
                    return Ok(None);
                }
                let white = self.images.colours(None, None);
                let Ok(white) = white else { return Ok(None) };
                white
            }
        };
        let (factor, ceiling) = (material.albedo(), self.settings.max_reflectance);
        let map = TextureMap { factor, ceiling, ..TextureMap::new(texture) };
        let map = beside_transmittance(map, material);
        Ok(Some(match info {
            Some(info) => self.lay(k, name, map, info)?,
            None => map,
        }))
    }

    fn exitance_map(
        &mut self,
        k: usize,
        name: &str,
        given: &Given,
        info: &TextureInfo,
        factor: Rgb,
    ) -> Result<Option<TextureMap>, Error> {
        match self.images.colours(Some(info.index), None) {
            Ok(texture) => {
                let mean = factor * texture.whole_mean();
                let map = TextureMap { factor, mean, ..TextureMap::new(texture) };
                if set_of(info) == coordinate_set_of(given) {
                    return self.lay(k, name, map, info).map(Some);
                }
                let done = "texture of emitted light by its mean, as its coordinates differ";
                self.note(k, WarningKind::TextureOptions, done, name)?;
                // One texel: the mean wherever it is looked up.
                Ok(uniform(map))
            }
            Err(unread) => {
                self.unread(k, name, &unread, "its factor alone counts")?;
                Ok(None)
            }
        }
    }

    /// `map` as `info` lays it on surfaces.
    fn lay(
        &mut self,
        k: usize,
        name: &str,
        map: TextureMap,
        info: &TextureInfo,
    ) -> Result<TextureMap, Error> {
        let texture = self.document.textures.get(info.index).and_then(Option::as_ref);
        let sampler = texture.and_then(|texture| texture.sampler);
        let sampler = sampler.and_then(|k| self.document.samplers.get(k)?.as_ref());
        let wraps = sampler.map_or([None; 2], |sampler| [sampler.wrap_s, sampler.wrap_t]);
        if wraps.contains(&Some(MIRRORED_REPEAT)) {
            let done = "repeated, where the file mirrors it at each repetition";
            self.note(k, WarningKind::TextureOptions, done, name)?;
        }
        let clamped = wraps == [Some(CLAMP_TO_EDGE); 2];
        Ok(TextureMap { placement: placement(info), clamped, ..map })
    }

    /// Notes that a texture of material `k` is not used, and what counts `instead`.
    fn unread(
        &mut self,
        k: usize,
        name: &str,
        unread: &Unread,
        instead: &str,
    ) -> Result<(), Error> {
        self.note(k, unread.kind, unread.and_so(instead), name)
    }
}

/// Metallic of materials without a factor: what is left out by a file whose other materials mostly
/// have one is the format's default.
pub(super) fn omitted_metallic(document: &Document) -> f64 {
    let all = document.materials.iter().flatten();
    let all = all.filter_map(|material| material.pbr_metallic_roughness.as_ref());
    let (mut given, mut omitted) = (0, 0);
    for pbr in all {
        match pbr.metallic_factor.is_some() || pbr.metallic_roughness_texture.is_some() {
            true => given += 1,
            false => omitted += 1,
        }
    }
    if given >= omitted { 1.0 } else { 0.0 }
}

/// Metallic and roughness.
#[derive(Clone, Copy)]
enum UniformOrTexture {
    Uniform(f64, f64),
    Texture(Metal),
}

fn coordinate_set_of(material: &Given) -> usize {
    let colour = Colour::of(material).texture;
    colour.as_ref().or(material.emissive_texture.as_ref()).map_or(0, set_of)
}

/// A map of one texel that has the mean of `map`.
fn uniform(map: TextureMap) -> Option<TextureMap> {
    let white = crate::scene::texture::Texture::new(1, 1, vec![[255; 3]])?;
    Some(TextureMap { factor: map.mean, ..TextureMap::new(white.into()) })
}

/// From texture coordinates, v upwards, to those of the image (`KHR_texture_transform`).
fn placement(info: &TextureInfo) -> DAffine2 {
    let Some(transform) = &info.extensions.transform else { return DAffine2::IDENTITY };
    let scale = transform.scale.map_or(DVec2::ONE, DVec2::from_array);
    let offset = transform.offset.map_or(DVec2::ZERO, DVec2::from_array);
    // Its v runs downwards, and it turns the coordinates clockwise there.
    let downwards = DAffine2::from_scale_angle_translation(DVec2::ONE, -transform.rotation, offset)
        * DAffine2::from_scale(scale);
    let flip = DAffine2::from_translation(DVec2::Y) * DAffine2::from_scale(DVec2::new(1.0, -1.0));
    let placement = flip * downwards * flip;
    if placement.is_finite() { placement } else { DAffine2::IDENTITY }
}
