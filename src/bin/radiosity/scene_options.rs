//! How the commands read a scene, and what lights it that is no surface.

use std::path::Path;

use clap::Args;
use radiosity::io::{LampUnits, SpecularSurfaces};
use radiosity::scene::{Sides, UpAxis};
use radiosity::{Error, Rgb, Scene, SceneSettings};

use crate::args::{Names, Parsed, give, one_of, rgb, value};
use crate::luminaires::{LuminaireOptions, Luminaires};
use crate::sky::SkyOptions;
use crate::{progress, standard};

const SIDES: Names<Sides> =
    &[("auto", Sides::Auto), ("front", Sides::Front), ("both", Sides::Both)];

/// Of the light of lamps.
const EMIT_SIDES: Names<Sides> = &[("front", Sides::Front), ("both", Sides::Both)];

const SPECULAR: Names<SpecularSurfaces> = &[
    ("clear", SpecularSurfaces::Clear),
    ("diffuse", SpecularSurfaces::Diffuse),
    ("black", SpecularSurfaces::Black),
    ("ignore", SpecularSurfaces::Ignore),
];

const LAMP_UNITS: Names<LampUnits> =
    &[("auto", LampUnits::Auto), ("candela", LampUnits::Candela), ("watts", LampUnits::Watts)];

/// Units of length, in metres.
pub const UNITS: Names<f64> =
    &[("mm", 1e-3), ("cm", 1e-2), ("m", 1.0), ("in", 0.0254), ("ft", 0.3048)];

/// A unit of length in metres: by its name, or as a number of metres.
pub fn unit(text: &str) -> Parsed<f64> {
    let is_length = |metres: &f64| metres.is_finite() && *metres > 0.0;
    let metres = one_of(UNITS)(text).ok().or_else(|| text.parse().ok().filter(is_length));
    metres.ok_or_else(|| give("mm, cm, m, in, ft, or a number of metres above 0"))
}

/// How a scene is read, and what lights it.
#[derive(Args)]
#[command(next_help_heading = "Scene and light (more: radiosity bake --list-settings)")]
pub struct SceneOptions {
    #[command(flatten)]
    pub sky: SkyOptions,
    #[command(flatten)]
    luminaires: LuminaireOptions,
    /// Radiance that this material emits, W/(m² sr), times its `map_Ke` if it has one; may be
    /// repeated
    #[arg(long, value_name = "MATERIAL=r,g,b", value_parser = of_material)]
    emit: Vec<(String, Rgb)>,
    /// Unit of the scene's lengths: mm, cm, m, in, ft or its metres. Luminaires, measuring grids
    /// and glb files have metres
    #[arg(long, value_name = "UNIT", default_value = "m", value_parser = unit)]
    pub unit: f64,
    /// Sides of faces that emit: front, or both as in Blender
    #[arg(long, value_name = "SIDES", hide = true, default_value = "front")]
    #[arg(value_parser = one_of(EMIT_SIDES))]
    emit_sides: Sides,
    /// Share of the light on either side of this material that leaves diffusely from the other side
    /// instead of being reflected; may be repeated
    #[arg(long, value_name = "MATERIAL=r,g,b", hide = true, value_parser = of_material)]
    transmit: Vec<(String, Rgb)>,
    /// Sides of surfaces that reflect: auto, those that light can reach; front; or both
    #[arg(long, value_name = "SIDES", default_value = "auto", value_parser = one_of(SIDES))]
    sides: Sides,
    /// What mirrors and glass are for diffuse light. clear: glass transmits it unscattered, and
    /// mirrors reflect their diffuse part; diffuse: both reflect their diffuse part; black; ignore:
    /// both are diffuse. Pictures show them as mirrors and glass
    #[arg(long, value_name = "KIND", hide = true, default_value = "clear")]
    #[arg(value_parser = one_of(SPECULAR))]
    specular: SpecularSurfaces,
    /// Reflectance that replaces one of 1 or more, below 1
    #[arg(long, value_name = "X", hide = true, value_parser = value::<f64>("a number below 1"))]
    #[arg(default_value_t = SceneSettings::MAX_REFLECTANCE)]
    max_reflectance: f64,
    /// Refuse a file that would have to be repaired
    #[arg(long, hide = true)]
    strict: bool,
    /// Scene of a glTF file, by its name or number [its own]
    #[arg(long = "scene", value_name = "NAME", hide = true)]
    pub scene_name: Option<String>,
    /// What intensities of lamps in a glTF file are, beside what surfaces emit in W/(m² sr).
    /// candela: as they are; watts: lumens, at 683 lm/W; auto: watts in files by Blender whose
    /// lamps have round numbers of them
    #[arg(long, value_name = "UNITS", hide = true, default_value = "auto")]
    #[arg(value_parser = one_of(LAMP_UNITS))]
    lamp_units: LampUnits,
    /// Whether texture coordinates are kept where there is no texture.
    #[arg(skip)]
    pub texture_coordinates: bool,
    /// Whether the command depends on which way is up.
    #[arg(skip)]
    pub needs_up: bool,
}

/// A scene as the options say.
pub struct Input {
    /// With its sides resolved.
    pub scene: Scene,
    pub luminaires: Luminaires,
    /// All that was printed.
    pub warnings: Vec<String>,
}

impl SceneOptions {
    /// The scene of a file, under the sky and with the luminaires that the options name. Prints
    /// warnings.
    ///
    /// # Errors
    /// Those of [`SceneSettings::load`], [`SkyOptions::over`], [`Luminaires::read`] and
    /// [`Luminaires::over`].
    pub fn read(&self, path: &Path) -> Result<Input, Error> {
        let (scene, up, luminaires) = progress::of_reading(path, || {
            let luminaires = self.luminaires.read(self.unit)?;
            let mut settings = SceneSettings::default();
            settings.strict = self.strict;
            settings.max_reflectance = self.max_reflectance;
            settings.emit.clone_from(&self.emit);
            settings.emit_both_sides = self.emit_sides == Sides::Both;
            settings.transmit.clone_from(&self.transmit);
            settings.sides = self.sides;
            settings.specular = self.specular;
            settings.texture_coordinates = self.texture_coordinates;
            settings.scene.clone_from(&self.scene_name);
            settings.lamp_units = self.lamp_units;
            settings.sky = self.sky.while_reading();
            if !luminaires.is_empty() {
                settings.sky.get_or_insert_default();
            }
            let scene = settings.load(standard::input(path)?)?;
            let up = match self.sky.up() {
                Some(axis) => UpAxis::given(axis),
                None => UpAxis::of(&scene, &luminaires.aims()),
            };
            let scene = luminaires.over(self.sky.over(scene.with_up(up.axis))?)?;
            Ok::<_, Error>((scene.resolve_sides(), up, luminaires))
        })?;
        let mut warnings = luminaires.warnings();
        let aimless = luminaires.aims().iter().any(|(_, aim)| aim.is_none());
        let needs_up = self.needs_up || self.sky.needs_up() || aimless;
        if needs_up {
            eprintln!("up: {up}");
            warnings.extend(up.warning());
        }
        warnings.extend(self.sky.warning(&scene));
        warnings.extend(scene.warnings().iter().map(ToString::to_string));
        warnings.iter().for_each(|warning| eprintln!("warning: {warning}"));
        Ok(Input { scene, luminaires, warnings })
    }
}

/// `MATERIAL=r,g,b`, or one number for all three.
fn of_material(text: &str) -> Parsed<(String, Rgb)> {
    let wrong = || give("MATERIAL=r,g,b, or one number for all three");
    let (name, colour) = text.rsplit_once('=').ok_or_else(wrong)?;
    Ok((name.into(), rgb(colour).map_err(|_| wrong())?))
}
