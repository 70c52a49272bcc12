//! A hash of all that the light on a mesh depends on.

use serde::Serialize;
use xxhash_rust::xxh3::Xxh3;

use super::Mesh;
use crate::scene::Luminaire;

impl Mesh {
    /// A hash of positions, materials, light from outside, elements and clusters. Names do not
    /// matter, nor does the order of vertices.
    pub(crate) fn fingerprint(&self) -> u64 {
        let scene = self.scene();
        let mut all = Xxh3::new();
        for t in 0..scene.triangles().len() {
            let material = scene.material(t);
            let diffuse = [material.reflectance, material.exitance, material.transmittance];
            let passed = scene.clear_panes().and_then(|panes| panes.transmittance(t));
            let of_mask = scene.mask(t).and_then(|_| scene.texture_coordinates(t));
            add(&mut all, &(scene.corners(t), diffuse, passed, of_mask));
        }
        for e in 0..self.element_count() {
            let node = self.node(self.element(e));
            let light = scene.has_textures().then(|| [self.reflectance(e), self.exitance(e)]);
            add(&mut all, &(node.triangle, node.cell, light));
        }
        for (m, mask) in scene.masks() {
            let texture = &mask.texture;
            add(&mut all, &(m, mask.clamped, mask.placement, texture.size()));
            all.update(texture.bytes());
        }
        let sky = scene.sky();
        add(&mut all, &(sky.uniform_radiance(), sky.map(), sky.sun()));
        for luminaire in scene.luminaires() {
            let Luminaire { intensity, position, aim, c0, opening, scale } = luminaire;
            add(&mut all, &(&**intensity, position, aim, c0, opening, scale));
        }
        self.clusters().tree().for_each(|parts| add(&mut all, &parts));
        all.digest()
    }
}

fn add(all: &mut Xxh3, value: &impl Serialize) {
    all.update(&postcard::to_extend(value, vec![]).expect("a vector takes all bytes"));
}
