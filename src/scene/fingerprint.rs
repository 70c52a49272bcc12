//! A hash of all that the light of a scene depends on.

use serde::Serialize;
use xxhash_rust::xxh3::Xxh3;

use super::{Luminaire, Material, Scene};

impl Scene {
    /// A hash of triangles, groups, materials, textures, and light from outside. Names do not
    /// matter, nor does the order of vertices.
    pub fn fingerprint(&self) -> u64 {
        let mut all = Xxh3::new();
        for (t, triangle) in self.triangles.iter().enumerate() {
            let super::Triangle { corners: _, group, material, smoothing } = triangle;
            add(&mut all, &(self.corners(t), group, material, smoothing));
        }
        for Material { name: _, reflectance, exitance, transmittance, sides, specular } in
            &self.materials
        {
            let other = format!("{sides:?} {specular:?}");
            add(&mut all, &(reflectance, exitance, transmittance, other));
        }
        let textures = &self.textures;
        add(&mut all, &(&textures.coordinates, &textures.colours, &textures.solid_shares));
        for (m, of_material) in &textures.of_materials {
            add(&mut all, &(m, format!("{of_material:?}")));
            of_material.images().for_each(|image| all.update(image.bytes()));
        }
        let sky = &self.sky;
        add(&mut all, &(sky.uniform_radiance(), sky.map(), sky.sun()));
        for luminaire in self.luminaires.iter() {
            let Luminaire { intensity, position, aim, c0, opening, scale } = luminaire;
            add(&mut all, &(&**intensity, position, aim, c0, opening, scale));
        }
        add(&mut all, &(&self.cut_sides, self.crease_degrees));
        all.digest()
    }
}

/// Adds the bytes of `value`.
pub(crate) fn add(all: &mut Xxh3, value: &impl Serialize) {
    all.update(&postcard::to_extend(value, vec![]).expect("a vector takes all bytes"));
}
