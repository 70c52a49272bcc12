//! Scenes from glTF 2.0 files, binary and JSON (Khronos, "glTF 2.0 Specification", 2021).
//!
//! ```text
//!   container ── document ── nodes ──┬── geometry   meshes, once for each node and instance
//!       │                            ├── lights     punctual lights as luminaires and the sun
//!     buffers ── accessors, images ──┴── materials  reflectance, exitance, cut-outs, glass
//! ```
//!
//! The file is read as it is: what light does not need is not looked at, so that a mistake in an
//! animation does no harm, and all numbers keep 64 bits.

mod accessors;
mod additions;
mod container;
mod document;
mod fault;
mod geometry;
mod images;
mod lights;
mod lit;
#[cfg(feature = "light-map")]
mod mapped;
mod materials;
mod nodes;
mod rewritten;

use std::collections::HashSet;
use std::io::Read as _;
use std::path::Path;

use glam::{DVec3, Vec3};

use super::files::{FileSource, MAX_BYTES, is_gltf};
use super::given::{check_names, emit_on_both_sides};
use super::lights::sky_and_warning;
use super::obj::repairs::Repairs;
use super::{Input, SceneSettings};
use crate::camera::Camera;
use crate::error::Error;
use crate::scene::{Scene, SceneTextures, Warning, WarningKind};
use container::{Buffers, Container};
use document::Document;
use fault::Fault;
use geometry::Geometry;
use images::Images;
pub use lights::LampUnits;
use lights::Lamps;
pub use lit::{LitVertices, write_lit_gltf};
#[cfg(feature = "light-map")]
pub use mapped::{MapBinding, write_mapped_gltf};
use materials::MaterialReader;
use nodes::{Nodes, Placed};

/// Extensions that are read, or that light does not depend on.
const KNOWN_EXTENSIONS: [&str; 24] = [
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_animation_pointer",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    "KHR_texture_basisu",
    "KHR_texture_transform",
];

/// The scene of the glTF file `path` with this content.
pub(super) fn read_scene(
    path: &Path,
    bytes: &[u8],
    files: &FileSource<'_>,
    settings: &SceneSettings,
) -> Result<Scene, Error> {
    let at_file = |fault: Fault| fault.at(path.display().to_string());
    let container = Container::new(bytes).map_err(at_file)?;
    let document = container.document().map_err(at_file)?;
    let buffers = Buffers::new(&container, &document, files);
    let nodes = Nodes::new(&document, settings.scene.as_deref()).map_err(at_file)?;
    let set_of = |material: Option<usize>| materials::coordinate_set(&document, material);
    let geometry = Geometry::new(&document, &buffers, &nodes, &set_of);
    let geometry = geometry.map_err(|(node, fault)| fault.at(node).inside(path))?;
    let mut repairs = Repairs::new(settings.strict);
    note_odd_parts(&document, &nodes, &geometry, path, &mut repairs)?;
    build(path, &document, &buffers, &nodes, geometry, repairs, settings)
}

/// Notes what of a document is not read, or read in a way that has to be said.
fn note_odd_parts(
    document: &Document,
    nodes: &Nodes,
    geometry: &Geometry,
    path: &Path,
    repairs: &mut Repairs,
) -> Result<(), Error> {
    let unknown = document.extensions_required.iter();
    let unknown: Vec<&String> =
        unknown.filter(|name| !KNOWN_EXTENSIONS.contains(&name.as_str())).collect();
    if !unknown.is_empty() {
        let done = "left out, though the file requires it";
        let warning = Warning::new(WarningKind::Extension, unknown.len(), done);
        repairs.push(warning.naming(unknown));
    }
    for &node in &nodes.shared {
        let place = || path.display().to_string();
        let name = nodes::name(document, node);
        repairs.note_at(WarningKind::SharedNode, place, &name, "below the first of them alone")?;
    }
    if !geometry.skinned.is_empty() {
        let done = "as its joints stand in the file, without motion";
        let warning = Warning::new(WarningKind::Skin, geometry.skinned.len(), done);
        repairs.push(warning.naming(&geometry.skinned));
    }
    if geometry.points_and_lines > 0 {
        let count = geometry.points_and_lines;
        repairs.push(Warning::new(WarningKind::PointsAndLines, count, "skipped"));
    }
    Ok(())
}

/// The scene of what was read.
fn build(
    path: &Path,
    document: &Document,
    buffers: &Buffers<'_>,
    nodes: &Nodes,
    mut geometry: Geometry,
    mut repairs: Repairs,
    settings: &SceneSettings,
) -> Result<Scene, Error> {
    let used: HashSet<u32> = geometry.triangles.iter().map(|t| t.material).collect();
    let reader = MaterialReader {
        document,
        images: Images::new(document, buffers),
        settings,
        repairs: &mut repairs,
        used: used.clone(),
        omitted_metallic: materials::omitted_metallic(document),
        is_coloured: &geometry.is_coloured,
    };
    let materials::Materials { mut materials, textures } =
        reader.read().map_err(|e| e.inside(path))?;
    if !used.contains(&(materials.len() as u32 - 1)) {
        materials.pop();
    }
    if settings.facets {
        geometry.make_each_face_a_group();
    }
    check_names(&materials, &geometry.triangles, &geometry.groups, path, settings)?;
    emit_on_both_sides(&mut materials, &textures, settings);
    let lamps = Lamps::new(document, nodes, settings.lamp_units).map_err(|e| e.inside(path))?;
    lamps.warnings.into_iter().for_each(|warning| repairs.push(warning));
    let detail = SceneTextures {
        coordinates: match textures.is_empty() && !settings.texture_coordinates {
            true => vec![],
            false => geometry.coordinates,
        },
        colours: match geometry.is_coloured.contains(&true) {
            true => geometry.colours.iter().map(|c| c.map(Vec3::from_array)).collect(),
            false => vec![],
        },
        of_materials: textures,
        ..SceneTextures::default()
    };
    let Geometry { positions, triangles, groups, .. } = geometry;
    let scene = Scene::with_textures(positions, triangles, groups, materials, detail);
    let mut scene = scene.map_err(|e| e.inside(path))?.with_up(DVec3::Y);
    let is_used = |(i, _): &(usize, _)| used.contains(&(*i as u32));
    let emitting = scene.materials().iter().enumerate().filter(is_used).map(|(_, m)| m);
    let has_lamps = !lamps.luminaires.is_empty() || lamps.sun.is_some();
    let given = settings.sky.clone().or_else(|| has_lamps.then(Default::default));
    let (mut sky, dark) = sky_and_warning(emitting, given.as_ref(), &settings.emit);
    let dark = dark.filter(|_| !has_lamps).map(|warning| advise(warning, document));
    if let Some(sun) = lamps.sun.filter(|_| sky.sun().is_none()) {
        sky = sky.with_sun(sun).map_err(|e| e.inside(path))?;
    }
    repairs.into_warnings().into_iter().chain(dark).for_each(|warning| scene.warn(warning));
    scene.with_luminaires(lamps.luminaires).map_err(|e| e.inside(path))?.with_sky(sky)
}

/// The warning that nothing shines, with what Blender's exporter leaves out.
fn advise(mut warning: Warning, document: &Document) -> Warning {
    let generator = document.asset.generator.as_deref().unwrap_or("");
    if generator.contains("Blender") {
        warning.done += "; Blender leaves lamps out unless Include > Data > Punctual Lights is \
                         ticked at the export, and area lamps and the world always";
    }
    warning
}

impl Geometry {
    /// Makes each triangle a group, named after its own and numbered from 1 there.
    fn make_each_face_a_group(&mut self) {
        let mut counts = vec![0; self.groups.len()];
        let mut groups = vec![];
        for triangle in &mut self.triangles {
            let of = triangle.group as usize;
            counts[of] += 1;
            triangle.group = groups.len() as u32;
            groups.push(format!("{}/{}", self.groups[of], counts[of]));
        }
        self.groups = groups;
    }
}

/// What should have been given in place of a file that cannot be read.
const REMEDY: &str = "give a readable scene";

/// The ending that names of such files have, if `file` is glTF by its content: `glb` if it
/// is binary, else `gltf`.
///
/// # Errors
/// [`crate::ErrorKind::File`] if the file cannot be read.
pub fn gltf_ending<'i>(file: impl Into<Input<'i>>) -> Result<Option<&'static str>, Error> {
    let (file, mut first) = (file.into(), vec![]);
    let start = file.open(REMEDY)?.take(64).read_to_end(&mut first);
    start.map_err(|e| file.cannot_read(e, REMEDY))?;
    let ending = if first.starts_with(b"glTF") { "glb" } else { "gltf" };
    Ok(is_gltf(file.path(), &first).then_some(ending))
}

/// The perspective cameras of a glTF file's own scene, by the names of their nodes; none of other
/// files.
///
/// # Errors
/// [`crate::ErrorKind::File`] if the file cannot be read, [`crate::ErrorKind::Scene`] if its JSON
/// cannot.
pub fn read_cameras<'i>(file: impl Into<Input<'i>>) -> Result<Vec<(String, Camera)>, Error> {
    let file = file.into();
    let at_file = |fault: Fault| fault.at(file.path().display().to_string());
    if gltf_ending(file.clone())?.is_none() {
        return Ok(vec![]);
    }
    let bytes = file.read(MAX_BYTES, REMEDY)?;
    let document = Container::new(&bytes).and_then(|container| container.document());
    let document = document.map_err(at_file)?;
    let nodes = Nodes::new(&document, None).map_err(at_file)?;
    let camera = |placed: &Placed| {
        let camera = document.cameras.get(document.nodes[placed.node].camera?)?.as_ref()?;
        let (eye, world) = (placed.world.translation, placed.world);
        let camera_here = Camera {
            eye,
            target: eye + world.transform_vector3(DVec3::NEG_Z).normalize_or(DVec3::NEG_Z),
            up: world.transform_vector3(DVec3::Y),
            vertical_fov: camera.perspective.as_ref()?.yfov.to_degrees(),
        };
        Some((nodes::name(&document, placed.node), camera_here))
    };
    Ok(nodes.placed.iter().filter_map(camera).collect())
}
