//! Input and output files. No other module of the library opens one, except for saved solver
//! states.
//!
//! Functions that read take an [`Input`], a path or bytes under a name; those that write take an
//! [`Output`], a path or a writer.
//!
//! | format | function | content |
//! |---|---|---|
//! | glTF 2.0 (feature `glb`) | [`load_scene`], [`read_scene`], [`SceneSettings`] | a scene |
//! | Wavefront OBJ, MTL | the same | a scene |
//! | STL, ASCII and binary | the same, by the extension of the name | a scene without materials |
//! | IESNA LM-63, EULUMDAT | [`PhotometrySettings`] | the light distribution of a luminaire |
//! | EPW | [`read_epw`] | the weather of a year at a place |
//! | PLY | [`write_ply`], [`read_ply`] | a mesh with radiosity at its vertices |
//! | glTF 2.0 binary (feature `glb`) | `write_glb` | the same by groups, for viewers |
//! | OpenEXR (feature `exr`) | `write_exr` | an image, linear radiance |
//! | both (feature `light-map`) | `write_light_map_exr`, `write_light_map_glb` | a light map |
//! | KTX 2.0 (feature `light-map`) | `write_light_map_ktx2` | a light map, with a common exponent |
//! | PNG (feature `png`) | `write_png` | an image, tone-mapped |
//! | PNG (and `light-map`) | `write_light_map_rgbm` | a light map, with a common factor |
//! | CSV, Matrix Market | [`view_factors`] | view factors between groups |
//! | NumPy's `.npz` (feature `npz`) | `write_npz`, `read_npz` | the same, as SciPy's sparse rows |

mod epw;
#[cfg(feature = "exr")]
mod exr;
mod files;
mod given;
#[cfg(feature = "glb")]
mod glb;
#[cfg(feature = "glb")]
mod gltf;
mod input;
#[cfg(feature = "light-map")]
mod ktx2;
mod lights;
mod masks;
mod mtl;
#[cfg(feature = "npz")]
mod npz;
mod obj;
mod output;
mod photometry;
mod ply;
mod ply_bands;
mod ply_reader;
#[cfg(feature = "png")]
mod png;
#[cfg(all(feature = "exr", feature = "textures"))]
mod radiance;
#[cfg(all(feature = "png", feature = "light-map"))]
mod rgbm;
mod settings;
mod specular;
mod stl;
mod text;
mod textures;
mod tone;
pub mod view_factors;

#[cfg(feature = "exr")]
pub use self::exr::write_exr;
#[cfg(all(feature = "exr", feature = "light-map"))]
pub use self::exr::{write_light_map_directional, write_light_map_exr, write_light_map_radiosity};
#[cfg(all(feature = "glb", feature = "light-map"))]
pub use self::glb::write_light_map_glb;
#[cfg(feature = "glb")]
pub use self::glb::{GlbSettings, write_glb};
#[cfg(feature = "glb")]
pub use self::gltf::{LampUnits, LitVertices, gltf_ending, read_cameras, write_lit_gltf};
#[cfg(all(feature = "glb", feature = "light-map"))]
pub use self::gltf::{MapBinding, write_mapped_gltf};
#[cfg(feature = "light-map")]
pub use self::ktx2::write_light_map_ktx2;
#[cfg(feature = "png")]
pub use self::png::{write_png, write_png_with_tone};
#[cfg(all(feature = "png", feature = "light-map"))]
pub use self::rgbm::{rgbm_range, write_light_map_rgbm};
pub use epw::{Weather, WeatherRecord, read_epw};
pub use files::read_text;
pub use input::Input;
#[cfg(feature = "npz")]
pub use npz::{read_npz, write_npz};
pub use output::Output;
pub use photometry::{Photometry, PhotometrySettings, read_photometry};
pub use ply::{write_ply, write_ply_with_tone};
pub use ply_bands::write_ply_bands;
pub use ply_reader::read_ply;
#[cfg(all(feature = "exr", feature = "textures"))]
pub use radiance::read_radiance;
#[expect(deprecated, reason = "former names stay for one release")]
pub use settings::{ObjSettings, load_obj, read_obj};
pub use settings::{SceneSettings, load_scene, read_scene};
pub use specular::SpecularSurfaces;
pub use tone::ToneCurve;
