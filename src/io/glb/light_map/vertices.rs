//! The triangles of a light map's scene, with what they have at their corners.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3, Vec3};
use rustc_hash::FxHashMap;

use super::super::primitives::Shown;
use super::super::two_sides::TwoSides;
use crate::error::Error;
use crate::light_map::LightMap;
use crate::scene::Rgb;

/// A corner of faces.
#[derive(Clone, Copy)]
pub(super) struct Vertex {
    /// Relative to the origin, scene unit.
    pub position: Vec3,
    pub normal: Vec3,
    /// Texture coordinates in the page of the map and in the scene's file, v downwards; the latter
    /// not finite where it has none.
    pub place: [f32; 2],
    pub given: [f32; 2],
}

impl Vertex {
    fn bits(&self) -> [u32; 10] {
        let [p, n] = [self.position, self.normal].map(|v| v.to_array());
        let all = [p[0], p[1], p[2], n[0], n[1], n[2]];
        let mut bits = [0; 10];
        let of_all = all.into_iter().chain(self.place).chain(self.given);
        bits.iter_mut().zip(of_all).for_each(|(bits, x)| *bits = x.to_bits());
        bits
    }
}

/// The triangles of one group, one material and one page of the map, with textures that they are
/// shown with or without.
pub(super) struct Primitive<'a> {
    pub group: u32,
    pub material: u32,
    pub shown: Option<Shown<'a>>,
    /// Index of the page of the map.
    pub page: usize,
    pub vertices: Vec<Vertex>,
    /// Of each vertex if there is a texture, W/m² per channel.
    pub irradiances: Vec<Rgb>,
    pub faces: Vec<[u32; 3]>,
    /// Index of each vertex.
    numbers: FxHashMap<[u32; 10], u32>,
}

/// The triangles of a map's scene by group, then material, positions relative to `origin`.
///
/// # Errors
/// Those of [`LightMap::surface`].
pub(super) fn primitives(map: &LightMap, origin: Vec3) -> Result<Vec<Primitive<'_>>, Error> {
    let (scene, sides) = (map.atlas.scene(), TwoSides::apart(map.atlas.scene()));
    let corners = Corners { map, normals: map.atlas.corner_normals(), sides, origin };
    let shown = |t: usize| {
        let has_places = scene
            .texture_coordinates(t)
            .is_some_and(|places| places.iter().all(|place| place.as_vec2().is_finite()));
        scene.textures(t).filter(|_| has_places).and_then(Shown::of)
    };
    let mut all: BTreeMap<(u32, u32, bool, usize), Primitive<'_>> = BTreeMap::new();
    let mut add = |t: usize, weights: [[f64; 2]; 3]| {
        let (triangle, shown) = (&scene.triangles()[t], shown(t));
        let (group, material) = (triangle.group, triangle.material);
        let (page, _) = map.atlas.page_coordinates(t);
        let primitive = all.entry((group, material, shown.is_some(), page)).or_insert_with(|| {
            let (vertices, irradiances, faces) = (vec![], vec![], vec![]);
            let numbers = FxHashMap::default();
            Primitive { group, material, shown, page, vertices, irradiances, faces, numbers }
        });
        let face = weights.map(|weights| primitive.number(&corners, t, weights));
        primitive.faces.push(face);
    };
    let is_textured: Vec<bool> = (0..scene.triangles().len()).map(|t| shown(t).is_some()).collect();
    let whole = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
    (0..is_textured.len()).filter(|&t| !is_textured[t]).for_each(|t| add(t, whole));
    if is_textured.contains(&true) {
        let elements = map.elements()?.filter(|element| is_textured[element.triangle]);
        elements.for_each(|element| add(element.triangle, element.weights));
    }
    Ok(all.into_values().collect())
}

impl Primitive<'_> {
    /// Index of the vertex at a point of triangle `t`.
    fn number(&mut self, corners: &Corners<'_>, t: usize, weights: [f64; 2]) -> u32 {
        let vertex = corners.vertex(t, weights);
        let next = self.vertices.len() as u32;
        let number = *self.numbers.entry(vertex.bits()).or_insert(next);
        if number == next {
            self.vertices.push(vertex);
            if self.shown.is_some() {
                self.irradiances.push(corners.map.irradiance_at(t, weights));
            }
        }
        number
    }
}

/// What triangles have at their corners.
struct Corners<'a> {
    map: &'a LightMap,
    normals: Vec<[DVec3; 3]>,
    sides: TwoSides,
    origin: Vec3,
}

impl Corners<'_> {
    /// The vertex at the point of triangle `t` with these weights of the second and third corner.
    fn vertex(&self, t: usize, [u, v]: [f64; 2]) -> Vertex {
        let scene = self.map.atlas.scene();
        let weights = [1.0 - u - v, u, v];
        let at = |corners: [DVec3; 3]| (0..3).map(|k| corners[k] * weights[k]).sum::<DVec3>();
        let at_place = |corners: [DVec2; 3]| (0..3).map(|k| corners[k] * weights[k]).sum::<DVec2>();
        let position = at(scene.corners(t)) + self.sides.shift(t, [u, v]);
        Vertex {
            position: (position - self.origin.as_dvec3()).as_vec3(),
            // glTF allows only length 1.
            normal: at(self.normals[t]).as_vec3().normalize_or(Vec3::Y),
            place: at_place(self.map.atlas.page_coordinates(t).1).as_vec2().to_array(),
            given: at_place(given_places(self.map, t)).as_vec2().to_array(),
        }
    }
}

/// Texture coordinates of the corners of triangle `t` in its file, v downwards; not finite if it
/// has none.
fn given_places(map: &LightMap, t: usize) -> [DVec2; 3] {
    let scene = map.atlas.scene();
    let frame = scene.textures(t).and_then(Shown::of).and_then(|shown| shown.frame());
    scene.texture_coordinates(t).unwrap_or([DVec2::NAN; 3]).map(|place| {
        let place = frame.map_or(place, |map| map.placed(place));
        DVec2::new(place.x, 1.0 - place.y)
    })
}
