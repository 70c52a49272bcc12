//! Settings for reading an OBJ file.

use std::path::Path;

use super::super::files::{self, FileSource, MAX_BYTES};
use super::super::specular::SpecularSurfaces;
use crate::error::{Error, ErrorKind, quoted};
use crate::scene::{Rgb, Scene, Sides, Sky};

/// Treatment of defects in an OBJ file and its libraries, and the materials that emit.
///
/// ```no_run
/// use radiosity::Rgb;
/// use radiosity::io::ObjSettings;
///
/// # fn main() -> Result<(), radiosity::Error> {
/// let mut settings = ObjSettings::default();
/// settings.emit.push(("ceiling lamp".into(), Rgb::splat(15.0)));
/// let scene = settings.load("room.obj")?;
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ObjSettings {
    /// Refuses content that would be repaired otherwise, with its line.
    pub strict: bool,
    /// Replacement of a reflectance of 1 or more in a channel, in [0, 1).
    pub max_reflectance: f64,
    /// Materials by name, and the radiance that they emit per channel, whatever the file says; it
    /// is multiplied with an image of emitted light (`map_Ke`).
    pub emit: Vec<(String, Rgb)>,
    /// Whether what emits does so on both sides of its faces, as in Blender, and not on its front
    /// alone ([`Sides::Emitting`]).
    pub emit_both_sides: bool,
    /// Materials by name that transmit light diffusely, and their transmittance per channel: the
    /// fraction of the light arriving on either side that leaves from the other. It is taken from
    /// the reflectance, texture included, as far as that suffices; a texture keeps at least a
    /// hundredth, which gives the distribution of the transmitted light.
    pub transmit: Vec<(String, Rgb)>,
    /// The light from outside ([`Scene::with_sky`]). `None`: a uniform sky of radiance
    /// 1 W/(m² sr) if nothing in the scene emits, else a black one.
    pub sky: Option<Sky>,
    /// Treatment of the two sides of surfaces.
    pub sides: Sides,
    /// Treatment of mirrors and glass in the light solution; light passes glass by default.
    pub specular: SpecularSurfaces,
    /// Makes each face a group of its own, in the order of the file, named `group/n` for the n-th
    /// face of a group: for view factors between facets.
    pub facets: bool,
    /// Keeps texture coordinates even if no material has a texture: light maps can use them.
    pub texture_coordinates: bool,
}

impl ObjSettings {
    /// Default of [`ObjSettings::max_reflectance`]: light is reflected by such a surface some fifty
    /// times. Plain choice, between fresh snow or barium sulphate and fast convergence.
    pub const MAX_REFLECTANCE: f64 = 0.98;

    /// Loads a Wavefront OBJ file and the MTL files that it names: see [`crate::load_obj`].
    ///
    /// # Errors
    /// Those of [`crate::load_obj`]; [`ErrorKind::Setting`] for a largest reflectance outside [0,
    /// 1), a radiance that is negative or not finite or a transmittance outside [0, 1);
    /// [`ErrorKind::Scene`] for an emitting or transmitting material that the scene does not have,
    /// and with [`ObjSettings::strict`] for content that would be repaired.
    pub fn load(&self, path: impl AsRef<Path>) -> Result<Scene, Error> {
        let path = path.as_ref();
        self.check()?;
        let bytes = files::read_bytes(path, MAX_BYTES);
        let files = FileSource::in_folder(path.parent().unwrap_or(Path::new("")));
        super::read_scene(path, bytes, &files, self)
    }

    /// [`ObjSettings::load`] from memory: see [`crate::io::read_obj`].
    ///
    /// # Errors
    /// Those of [`ObjSettings::load`].
    pub fn read(
        &self,
        name: impl AsRef<Path>,
        obj: &[u8],
        files: &[(&str, &[u8])],
    ) -> Result<Scene, Error> {
        self.check()?;
        let bytes = files::limited(obj, MAX_BYTES);
        super::read_scene(name.as_ref(), bytes, &FileSource::in_memory(files), self)
    }

    fn check(&self) -> Result<(), Error> {
        let ceiling = self.max_reflectance;
        if !(0.0..1.0).contains(&ceiling) {
            let remedy = "must be at least 0 and below 1";
            return Err(Error::new(
                ErrorKind::Setting,
                "max_reflectance",
                ceiling.to_string(),
                remedy,
            ));
        }
        let bad = |l: &Rgb| !(std::f64::consts::PI * *l).is_finite() || l.min_element() < 0.0;
        if let Some((name, radiance)) = self.emit.iter().find(|(_, radiance)| bad(radiance)) {
            let place = format!("emit {}", quoted(&[name]));
            let [r, g, b] = radiance.to_array();
            let found = format!("radiance {r:e}, {g:e}, {b:e}");
            let remedy = "must be finite and at least 0 in each channel";
            return Err(Error::new(ErrorKind::Setting, place, found, remedy));
        }
        let in_range = |tau: &Rgb| tau.cmpge(Rgb::ZERO).all() && tau.cmplt(Rgb::ONE).all();
        if let Some((name, tau)) = self.transmit.iter().find(|(_, tau)| !in_range(tau)) {
            let place = format!("transmit {}", quoted(&[name]));
            let [r, g, b] = tau.to_array();
            let found = format!("transmittance {r:e}, {g:e}, {b:e}");
            let remedy = "must be at least 0 and below 1 in each channel";
            return Err(Error::new(ErrorKind::Setting, place, found, remedy));
        }
        Ok(())
    }
}

impl Default for ObjSettings {
    fn default() -> ObjSettings {
        let max_reflectance = ObjSettings::MAX_REFLECTANCE;
        let (sides, specular) = (Sides::Auto, SpecularSurfaces::Clear);
        let (emit, transmit) = (vec![], vec![]);
        ObjSettings {
            strict: false,
            max_reflectance,
            emit,
            emit_both_sides: false,
            transmit,
            sky: None,
            sides,
            specular,
            facets: false,
            texture_coordinates: false,
        }
    }
}
