//! How the commands read a scene, and what lights it that is no surface.

use std::path::Path;

use lexopt::prelude::*;
use radiosity::io::SpecularSurfaces;
use radiosity::{Error, ObjSettings, Rgb, Scene, Sides};

use crate::args::{Stop, rgb, value, wrong_value};
use crate::luminaires::LuminaireOptions;
use crate::sky::SkyOptions;

/// What is said of how a scene is to be read.
#[derive(Clone, Debug, Default)]
pub struct SceneOptions {
    obj: ObjSettings,
    pub sky: SkyOptions,
    pub luminaires: LuminaireOptions,
}

impl SceneOptions {
    /// Those under which mirrors and glass are surfaces as all others are.
    pub fn ignoring_specular() -> SceneOptions {
        let mut options = SceneOptions::default();
        options.obj.specular = SpecularSurfaces::Ignore;
        options
    }

    /// Makes each face a group of its own.
    pub fn by_facets(&mut self) {
        self.obj.facets = true;
    }

    /// Keeps texture coordinates, whether or not there are textures.
    pub fn with_texture_coordinates(&mut self) {
        self.obj.texture_coordinates = true;
    }

    /// Takes option `name` with its value, if it is one of these.
    pub fn option(&mut self, name: &str, parser: &mut lexopt::Parser) -> Result<bool, Stop> {
        match name {
            "strict" => self.obj.strict = true,
            "max-reflectance" => {
                self.obj.max_reflectance = value(parser, "max-reflectance", "a number below 1")?;
            }
            "emit" => self.obj.emit.push(of_material(parser, "emit")?),
            "transmit" => self.obj.transmit.push(of_material(parser, "transmit")?),
            "sides" => self.obj.sides = sides(parser)?,
            "specular" => self.obj.specular = specular(parser)?,
            _ => return Ok(self.sky.option(name, parser)? || self.luminaires.option(name, parser)?),
        }
        Ok(true)
    }

    /// Tells the user what is odd about a scene and what lights it, and returns that.
    pub fn print_warnings(&self, scene: &Scene) -> Vec<String> {
        let mut warnings = self.luminaires.warnings();
        warnings.extend(self.sky.warning(scene));
        warnings.extend(scene.warnings().iter().map(ToString::to_string));
        warnings.iter().for_each(|warning| eprintln!("warning: {warning}"));
        warnings
    }

    /// The scene of an OBJ file, under the sky and with the luminaires that were asked for.
    ///
    /// # Errors
    /// Those of [`ObjSettings::load`], [`SkyOptions::over`] and [`LuminaireOptions::over`].
    pub fn load(&self, path: &Path) -> Result<Scene, Error> {
        let mut obj = self.obj.clone();
        obj.sky = self.sky.while_reading();
        if !self.luminaires.is_empty() {
            obj.sky.get_or_insert_default();
        }
        self.luminaires.over(self.sky.over(obj.load(path)?)?)
    }
}

/// `MATERIAL=r,g,b`, or one number for all three.
fn of_material(parser: &mut lexopt::Parser, option: &str) -> Result<(String, Rgb), Stop> {
    let text = parser.value()?.string()?;
    let wrong = || wrong_value(option, &text, "MATERIAL=r,g,b");
    let (name, colour) = text.rsplit_once('=').ok_or_else(wrong)?;
    Ok((name.into(), rgb(colour).ok_or_else(wrong)?))
}

/// What surfaces do on their two sides, by its name.
fn sides(parser: &mut lexopt::Parser) -> Result<Sides, Stop> {
    let text = parser.value()?.string()?;
    match text.as_str() {
        "auto" => Ok(Sides::Auto),
        "front" => Ok(Sides::Front),
        "both" => Ok(Sides::Both),
        _ => Err(wrong_value("sides", &text, "auto, front or both")),
    }
}

/// What mirrors and glass count as where light is spread, by its name.
fn specular(parser: &mut lexopt::Parser) -> Result<SpecularSurfaces, Stop> {
    let text = parser.value()?.string()?;
    match text.as_str() {
        "clear" => Ok(SpecularSurfaces::Clear),
        "diffuse" => Ok(SpecularSurfaces::Diffuse),
        "black" => Ok(SpecularSurfaces::Black),
        "ignore" => Ok(SpecularSurfaces::Ignore),
        _ => Err(wrong_value("specular", &text, "clear, diffuse, black or ignore")),
    }
}
