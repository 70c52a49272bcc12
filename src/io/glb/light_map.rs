//! A scene with its light map as glTF binary: the scene's own triangles, and one image for all but
//! textured ones, or one for each page. Those have their textures, times the map's light at
//! vertices that are as dense as texels: glTF has no material that multiplies two images.

mod vertices;

use std::collections::BTreeMap;
use std::io;

use glam::Vec3;
use gltf_json::mesh::Semantic;
use gltf_json::texture::MinFilter;
use gltf_json::validation::Checked::Valid;
use gltf_json::{Index, Material, Texture, Value};
use image::{ExtendedColorType, ImageResult};

use super::file::{Attributes, GlbFile};
use super::images::{Images, mean_radiosity, png};
use super::materials::{Look, unlit};
use super::origin;
use super::settings::GlbSettings;
use crate::error::Error;
use crate::io::Output;
use crate::light_map::{LightMap, MapPage};
use crate::scene::Rgb;
use vertices::{Primitive, Vertex, primitives};

/// Writes the scene of a light map as glTF 2.0 binary, `.glb`, with `POSITION`, `NORMAL` (of smooth
/// surfaces), `TEXCOORD_1`, the coordinates in the page of the light map, and `TEXCOORD_0`, those
/// of the scene's file on materials all of whose faces have some, else the same as `TEXCOORD_1`.
///
/// A node for each group and a primitive for each of its materials, by their names; materials and
/// axes are as with [`write_glb`](crate::write_glb), and the two sides of a surface always lie
/// apart. The file has the radiosity of each page as an image (PNG) through a tone curve of
/// radiosity, the colour of the scene's own triangles. Triangles with a texture, of `map_Ke` before
/// `map_Kd`, have that instead, cut to elements of two texels of the map, whose light is in
/// `COLOR_0`. A program with a light map of its own multiplies the textures with the irradiance of
/// [`write_light_map_exr`](crate::io::write_light_map_exr) instead.
///
/// # Errors
/// [`crate::ErrorKind::File`] when the file cannot be written, or would be larger than 4 GiB; those
/// of [`LightMap::surface`].
pub fn write_light_map_glb<'o>(
    out: impl Into<Output<'o>>,
    map: &LightMap,
    settings: impl Into<GlbSettings>,
) -> Result<(), Error> {
    let (out, settings) = (out.into(), settings.into());
    let failed = |e| out.cannot_write(io::Error::other(e));
    let (scene, origin) = (map.atlas.scene(), origin(map.atlas.scene().bounds()));
    let primitives = primitives(map, origin)?;
    let model = Model::new(map, &settings, &primitives).map_err(failed)?;
    let mut file = GlbFile::new(&model.notes());
    // The first images. Without mipmaps, in which charts would run together.
    let pages = map.atlas.pages();
    let of_pages: Vec<Index<Texture>> = (0..pages.len() as u32)
        .map(|page| file.add_texture(Index::new(page), MinFilter::Linear, true))
        .collect();
    let (mut materials, mut groups) = (BTreeMap::new(), vec![]);
    for of_group in primitives.chunk_by(|a, b| a.group == b.group) {
        let mut parts = vec![];
        for primitive in of_group {
            let page = Some(primitive.page).filter(|_| primitive.shown.is_none());
            let key = (primitive.material, page);
            let material = || model.add_material(&mut file, primitive, of_pages[primitive.page]);
            let material = *materials.entry(key).or_insert_with(material);
            let attributes = model.add_attributes(&mut file, primitive);
            parts.push(file.triangles(attributes, &primitive.faces, material));
        }
        groups.push(file.add_group(&scene.groups()[of_group[0].group as usize], parts));
    }
    let radiosity = map.radiosity();
    for page in (0..pages.len()).map(|k| map.page(k)) {
        let group = page.page.group.map(|group| scene.groups()[group as usize].as_str());
        let name = group.map_or("light map".into(), |group| format!("light map {group}"));
        file.add_image(model.image(page, &radiosity).map_err(failed)?, Some(&name));
    }
    for png in model.images.into_files() {
        file.add_image(png, None);
    }
    file.write(out, settings.top_node(scene, origin.as_dvec3()), groups)
}

/// The file's content beside its triangles.
struct Model<'a> {
    map: &'a LightMap,
    settings: &'a GlbSettings,
    /// Of textured materials.
    images: Images,
}

impl Model<'_> {
    fn new<'a>(
        map: &'a LightMap,
        settings: &'a GlbSettings,
        primitives: &[Primitive<'_>],
    ) -> ImageResult<Model<'a>> {
        let textured =
            primitives.iter().filter_map(|p| Some((p.material, p.shown?, p.irradiances.clone())));
        let images = Images::new(map.atlas.scene().materials(), &settings.tone, textured)?;
        Ok(Model { map, settings, images })
    }

    fn notes(&self) -> BTreeMap<&'static str, Value> {
        let image = "radiosity times exposure, highlights rolled off; textured materials have \
                     their textures in their median light, and COLOR_0 relative to that";
        BTreeMap::from([
            ("TEXCOORD_1", Value::from("places in the light map")),
            ("light map", Value::from(image)),
            ("exposure", Value::from(self.settings.tone.exposure())),
        ])
    }

    /// A page of the light map of this `radiosity` as PNG, in colours.
    fn image(&self, page: MapPage, radiosity: &[Rgb]) -> ImageResult<Vec<u8>> {
        let tone = &self.settings.tone;
        let colours = page.of(radiosity).into_iter();
        let bytes: Vec<u8> = colours.flat_map(|c| tone.display(c)).collect();
        png(&bytes, page.size(), ExtendedColorType::Rgb8)
    }

    fn add_material(
        &self,
        file: &mut GlbFile,
        primitive: &Primitive<'_>,
        of_map: Index<Texture>,
    ) -> Index<Material> {
        let texture = match primitive.shown.zip(self.images.number(primitive.material)) {
            Some((shown, number)) => {
                let clamped = shown.frame().is_some_and(|map| map.clamped);
                // The pages of the light map are before them.
                let source = Index::new((number + self.map.atlas.pages().len()) as u32);
                (file.add_texture(source, MinFilter::LinearMipmapLinear, clamped), 0)
            }
            None => (of_map, 1),
        };
        let has_mask = primitive.shown.is_some_and(|shown| shown.mask.is_some());
        let material = &self.map.atlas.scene().materials()[primitive.material as usize];
        let look = Look { texture: Some(texture), has_mask, is_double_sided: false };
        file.add_material(unlit(material, look))
    }

    fn add_attributes(&self, file: &mut GlbFile, primitive: &Primitive<'_>) -> Attributes {
        let vectors = |set: &[Vec3]| set.iter().map(Vec3::to_array).collect::<Vec<_>>();
        let positions: Vec<Vec3> = primitive.vertices.iter().map(|v| v.position).collect();
        let normals: Vec<Vec3> = primitive.vertices.iter().map(|v| v.normal).collect();
        let set = |of: fn(&Vertex) -> [f32; 2]| primitive.vertices.iter().map(of).collect();
        let (places, given): (Vec<_>, Vec<_>) = (set(|v| v.place), set(|v| v.given));
        let positions = file.add_positions(&vectors(&positions));
        let normals = file.add_vectors("NORMAL", &vectors(&normals));
        let places = file.add_vectors("TEXCOORD_1", &places);
        // glTF numbers sets of coordinates from 0 on: without the file's, the map's are used for
        // both.
        let given = match given.as_flattened().iter().all(|x| x.is_finite()) {
            true => file.add_vectors("TEXCOORD_0", &given),
            false => places,
        };
        let mut all = Attributes::from([
            (Valid(Semantic::Positions), positions),
            (Valid(Semantic::Normals), normals),
            (Valid(Semantic::TexCoords(0)), given),
            (Valid(Semantic::TexCoords(1)), places),
        ]);
        let image = primitive.shown.and_then(|_| self.images.get(primitive.material));
        if let Some(image) = image {
            let material = &self.map.atlas.scene().materials()[primitive.material as usize];
            let colour = |&irradiance: &Rgb| {
                let mean = self.settings.tone.linear(mean_radiosity(material, irradiance));
                image.vertex_colour(mean).as_vec3()
            };
            let colours: Vec<Vec3> = primitive.irradiances.iter().map(colour).collect();
            let colours = file.add_vectors("COLOR_0", &vectors(&colours));
            all.insert(Valid(Semantic::Colors(0)), colours);
        }
        all
    }
}
