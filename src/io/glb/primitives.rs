//! The faces of a solution, split by groups and materials, with texture coordinates.
//!
//! Vertices are shared within a primitive except where texture coordinates jump: a seam has one
//! vertex for each side.

use std::collections::BTreeMap;

use glam::{DVec2, Vec2};
use rustc_hash::FxHashMap;

use super::two_sides::TwoSides;
use crate::gather::GatheredMesh;
use crate::scene::texture::{MaterialTextures, TextureMap};

/// The faces of one group and one material.
pub(super) struct Primitive<'a> {
    pub group: u32,
    pub material: u32,
    /// Whether the faces stand for both sides of a surface.
    pub is_double_sided: bool,
    /// Vertices of the surface, in the order of the file.
    pub vertices: Vec<u32>,
    /// Texture coordinates of each, v downwards; empty where a corner has none.
    pub places: Vec<Vec2>,
    /// The texture that it is shown with, if it has texture coordinates.
    pub shown: Option<Shown<'a>>,
    /// Faces, by indices of their corners in `vertices`.
    pub faces: Vec<[u32; 3]>,
}

/// The textures that a surface is shown with: one, or both.
#[derive(Clone, Copy)]
pub(super) struct Shown<'a> {
    pub colours: Option<&'a TextureMap>,
    /// Whether they are textures of the emitted, not of the reflected light.
    pub emits: bool,
    pub mask: Option<&'a TextureMap>,
}

impl<'a> Shown<'a> {
    /// The texture of the exitance, else of the reflectance, and the mask.
    pub fn of(textures: &'a MaterialTextures) -> Option<Shown<'a>> {
        let MaterialTextures { reflectance, exitance, mask } = textures;
        // One texel has no picture; colours of vertices are multiplied with it.
        let picture = |map: &&'a TextureMap| map.texture.size() != [1, 1];
        let (colours, emits) =
            (exitance.as_ref().or(reflectance.as_ref()).filter(picture), exitance.is_some());
        let shown = Shown { colours, emits, mask: mask.as_ref() };
        shown.frame().is_some().then_some(shown)
    }

    /// The texture whose scale and offset apply to the coordinates.
    pub fn frame(&self) -> Option<&'a TextureMap> {
        self.colours.or(self.mask)
    }
}

/// A face of the surface, and its triangle of the scene.
type Face = ([u32; 3], usize);

/// Group, material, and whether both sides are seen.
type Key = (u32, u32, bool);

/// The faces of `light` by group, then material, in the order of the scene's.
pub(super) fn primitives<'a>(light: &'a GatheredMesh, sides: &TwoSides) -> Vec<Primitive<'a>> {
    let (surface, mesh) = (&light.surface, &light.mesh);
    let mut faces: BTreeMap<Key, Vec<Face>> = BTreeMap::new();
    for (&face, &element) in surface.faces.iter().zip(&surface.elements) {
        let t = mesh.triangle(mesh.element(element as usize));
        if !sides.is_omitted(t) {
            let triangle = mesh.scene().triangles()[t];
            let key = (triangle.group, triangle.material, sides.is_double_sided(t));
            faces.entry(key).or_default().push((face, t));
        }
    }
    let mut places = Places::new(surface.positions.len());
    let mut primitives = vec![];
    for (k, (key, faces)) in faces.into_iter().enumerate() {
        primitives.push(if faces.iter().all(|&(_, t)| has_texture_coordinates(light, t)) {
            textured(light, key, &faces)
        } else {
            let mut vertices = vec![];
            let of_face = |(face, _): &Face| places.of_face(k, face, &mut vertices);
            let faces = faces.iter().map(of_face).collect();
            let (group, material, is_double_sided) = key;
            let (places, shown) = (vec![], None);
            Primitive { group, material, is_double_sided, vertices, places, shown, faces }
        });
    }
    primitives
}

/// Per vertex of the surface, the last primitive that has it, and its index there.
struct Places(Vec<(usize, u32)>);

impl Places {
    fn new(vertices: usize) -> Places {
        Places(vec![(usize::MAX, 0); vertices])
    }

    /// Indices of the corners of a face in the `vertices` of primitive `k`; missing ones are added.
    fn of_face(&mut self, k: usize, face: &[u32; 3], vertices: &mut Vec<u32>) -> [u32; 3] {
        face.map(|v| {
            let place = &mut self.0[v as usize];
            if place.0 != k {
                *place = (k, vertices.len() as u32);
                vertices.push(v);
            }
            place.1
        })
    }
}

fn has_texture_coordinates(light: &GatheredMesh, t: usize) -> bool {
    let corners = light.mesh.scene().texture_coordinates(t);
    corners.is_some_and(|corners| corners.iter().all(|place| place.as_vec2().is_finite()))
}

/// The primitive of `faces`, each with its triangle of the scene.
fn textured<'a>(
    light: &'a GatheredMesh,
    (group, material, is_double_sided): Key,
    faces: &[Face],
) -> Primitive<'a> {
    let (surface, scene) = (&light.surface, light.mesh.scene());
    let shown = faces.first().and_then(|&(_, t)| Shown::of(scene.textures(t)?));
    let mut numbers: FxHashMap<(u32, [i64; 2]), u32> = FxHashMap::default();
    let (mut vertices, mut places) = (vec![], vec![]);
    let mut number = |v: u32, t: usize| {
        let barycentric = scene.barycentric(t, surface.positions[v as usize]);
        let place = scene.texture_point(t, barycentric);
        let frame = shown.and_then(|shown| shown.frame());
        let place = frame.map_or(place, |map| map.placed(place));
        let place = DVec2::new(place.x, 1.0 - place.y);
        // Nearer coordinates are one vertex: a hundredth of a texel of a large image, far more than
        // the rounding difference of two triangles along their common side.
        let cell = (place / 2f64.powi(-20)).round().to_array().map(|x| x as i64);
        *numbers.entry((v, cell)).or_insert_with(|| {
            vertices.push(v);
            places.push(place.as_vec2());
            vertices.len() as u32 - 1
        })
    };
    let faces = faces.iter().map(|(face, t)| face.map(|v| number(v, *t))).collect();
    Primitive { group, material, is_double_sided, vertices, places, shown, faces }
}
