//! Settings for reading a scene, and which reader reads it.

use std::path::Path;

use super::files::{MAX_BYTES, is_gltf};
#[cfg(feature = "glb")]
use super::gltf::{self, LampUnits};
use super::specular::SpecularSurfaces;
use super::{Input, obj};
use crate::error::{Error, ErrorKind, quoted};
use crate::scene::{Rgb, Scene, Sides, Sky};

/// Loads a scene with the files that it names: glTF 2.0 (feature `glb`), Wavefront OBJ with MTL, or
/// STL; by the content of the file, and STL by its extension.
///
/// The front of a face is where its corners run counter-clockwise. Lengths stay in the file's own
/// unit; glTF has metres. Normals, points, lines and curves are not used. Surfaces without a known
/// smoothing group have creases at angles above [`crate::Mesh::CREASE_DEGREES`].
///
/// **OBJ.** A face may have any number of corners, and its outline may be concave. It belongs to
/// the group of the latest `o` or `g` line ("default" before the first); a name that comes again
/// continues its group. `s` puts the faces up to the next `s` into a smoothing group, whatever `o`
/// and `g` lines come between; `s off` or `s 0` into none (Wavefront, "Object Files (.obj)",
/// Advanced Visualizer 3.0, "Grouping"): there creases are above
/// [`crate::Mesh::COPLANAR_DEGREES`]. Faces before the first `s`, and after one without a group
/// (`s` or `s on`, as some programs write), are as if in a group of their own.
///
/// Of a material, `Kd` is the diffuse reflectance ρ per channel, linear, and `Ke` the emitted
/// radiance L: the exitance becomes π L, in the file's unit times steradian. Where no material has
/// a `Ke`, a `Ka` above 1 is the radiance. Faces without a material reflect
/// [`crate::Material::DEFAULT_REFLECTANCE`]. `illum` 3 to 7 and 9 make mirrors and glass
/// ([`crate::scene::Specular`]), which pictures show; the light solution treats mirrors as their
/// diffuse part alone, and passes glass straight on, attenuated by its transmittance
/// ([`SceneSettings::specular`]).
///
/// **glTF.** Each node with a mesh is a group, and so is each of its instances; +y is up. Base
/// colour times colours of vertices is the reflectance, but for what a metal reflects as a mirror,
/// emission times strength the radiance; punctual lights are luminaires and the sun.
/// `docs/gltf.md` has the whole table.
///
/// Defects are repaired, and reported in [`Scene::warnings`]: libraries under other names or
/// missing, materials that no library defines (grey), reflectances of 1 or more
/// ([`SceneSettings::MAX_REFLECTANCE`]), polygons that cross themselves, texts in UTF-16 or
/// Latin-1, and more; `docs/obj.md` has the whole list. [`SceneSettings`] can refuse these instead,
/// sets the largest reflectance, and makes materials emit.
///
/// Files may come from anywhere. Other files are read from the folder of the scene or below, so
/// that it cannot open other files of the machine (or of its network). Only regular files are
/// read, of at most 1 GiB, as are all MTL files and all buffers of a scene together. Memory stays
/// within sixty times the size of OBJ files, and glTF files may place up to 2²⁵ triangles.
///
/// # Errors
/// [`ErrorKind::File`] for a file that cannot be read. [`ErrorKind::Scene`], with the place in the
/// file, for invalid content: coordinates that are not finite numbers, corners without a vertex, no
/// face at all, nodes below themselves; for a mesh that is compressed; and for a scene without a
/// triangle that has area.
pub fn load_scene<'i>(file: impl Into<Input<'i>>) -> Result<Scene, Error> {
    SceneSettings::default().load(file)
}

/// [`load_scene`] from memory: a file of this name, used in messages, and this content. `files` are
/// those that it may name, name and content.
///
/// # Errors
/// Those of [`load_scene`].
pub fn read_scene(
    name: impl AsRef<Path>,
    content: &[u8],
    files: &[(&str, &[u8])],
) -> Result<Scene, Error> {
    SceneSettings::default().read(name, content, files)
}

/// The former name of [`load_scene`].
///
/// # Errors
/// Those of [`load_scene`].
#[deprecated = "renamed to load_scene, which reads glTF too"]
pub fn load_obj<'i>(file: impl Into<Input<'i>>) -> Result<Scene, Error> {
    load_scene(file)
}

/// The former name of [`read_scene`].
///
/// # Errors
/// Those of [`read_scene`].
#[deprecated = "renamed to read_scene, which reads glTF too"]
pub fn read_obj(
    name: impl AsRef<Path>,
    obj: &[u8],
    files: &[(&str, &[u8])],
) -> Result<Scene, Error> {
    read_scene(name, obj, files)
}

/// The former name of [`SceneSettings`].
#[deprecated = "renamed to SceneSettings"]
pub type ObjSettings = SceneSettings;

/// How a scene is read: treatment of defects, and what a file does not say, such as the materials
/// that emit.
///
/// ```no_run
/// use radiosity::Rgb;
/// use radiosity::io::SceneSettings;
///
/// # fn main() -> Result<(), radiosity::Error> {
/// let mut settings = SceneSettings::default();
/// settings.emit.push(("ceiling lamp".into(), Rgb::splat(15.0)));
/// let scene = settings.load("room.obj")?;
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct SceneSettings {
    /// Refuses content that would be repaired otherwise, with its place.
    pub strict: bool,
    /// Replacement of a reflectance of 1 or more in a channel, in [0, 1).
    pub max_reflectance: f64,
    /// Materials by name, and the radiance that they emit per channel, whatever the file says; it
    /// is multiplied with an image of emitted light.
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
    /// Treatment of mirrors, metals and glass in the light solution; light passes glass by default.
    pub specular: SpecularSurfaces,
    /// Makes each face a group of its own, in the order of the file, named `group/n` for the n-th
    /// face of a group: for view factors between facets.
    pub facets: bool,
    /// Keeps texture coordinates even if no material has a texture: light maps can use them.
    pub texture_coordinates: bool,
    /// Which scene of a glTF file is read, by its name or number; none: the file's own.
    pub scene: Option<String>,
    /// What the intensities of lamps in a glTF file are beside what surfaces emit.
    #[cfg(feature = "glb")]
    pub lamp_units: LampUnits,
}

impl SceneSettings {
    /// Default of [`SceneSettings::max_reflectance`]: light is reflected by such a surface some
    /// fifty times. Plain choice, between fresh snow or barium sulphate and fast convergence.
    pub const MAX_REFLECTANCE: f64 = 0.98;

    /// Loads a scene, glTF, OBJ or STL, with the files that it names: see [`crate::load_scene`].
    ///
    /// # Errors
    /// Those of [`crate::load_scene`]; [`ErrorKind::Setting`] for a largest reflectance outside [0,
    /// 1), a radiance that is negative or not finite or a transmittance outside [0, 1);
    /// [`ErrorKind::Scene`] for an emitting or transmitting material that the scene does not have,
    /// and with [`SceneSettings::strict`] for content that would be repaired.
    pub fn load<'i>(&self, file: impl Into<Input<'i>>) -> Result<Scene, Error> {
        self.check()?;
        let file = file.into();
        let bytes = file.read(MAX_BYTES, "give a readable scene")?;
        let (path, files) = (file.path(), file.files());
        match is_gltf(path, &bytes) {
            #[cfg(feature = "glb")]
            true => gltf::read_scene(path, &bytes, &files, self),
            _ => obj::read_scene(path, bytes.into_owned(), &files, self),
        }
    }

    /// [`SceneSettings::load`] from memory: see [`crate::io::read_scene`].
    ///
    /// # Errors
    /// Those of [`SceneSettings::load`].
    pub fn read(
        &self,
        name: impl AsRef<Path>,
        content: &[u8],
        files: &[(&str, &[u8])],
    ) -> Result<Scene, Error> {
        self.load(Input::bytes(&name, content).with_files(files))
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

impl Default for SceneSettings {
    fn default() -> SceneSettings {
        let max_reflectance = SceneSettings::MAX_REFLECTANCE;
        let (sides, specular) = (Sides::Auto, SpecularSurfaces::Clear);
        let (emit, transmit) = (vec![], vec![]);
        SceneSettings {
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
            scene: None,
            #[cfg(feature = "glb")]
            lamp_units: LampUnits::Auto,
        }
    }
}
