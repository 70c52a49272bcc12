//! Surfaces with two sides: a triangle for each side that reflects.
//!
//! ```text
//!   as in the file        turned                  doubled
//!
//!   ──────── front        ──────── back           ──────── front of t
//!   ──────── back         ──────── front          ──────── front of its twin: the same corners
//!                                                          with opposite winding
//! ```
//!
//! Each of the two covers the other's back ([`Scene::is_back_covered`]), so that rows, gathers and
//! rays treat them like any other triangles.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::texture::MaterialTextures;
use super::{Material, Rgb, Scene};

/// Treatment of the two sides of a material's surfaces. Applied when a scene is baked or verified,
/// or by [`Scene::resolve_sides`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Sides {
    /// Fronts reflect and emit, backs block.
    #[default]
    Front,
    /// Both sides reflect with the same reflectance, each with its own radiosity; fronts emit.
    Both,
    /// Each triangle reflects on the sides that light can reach, whatever its winding. It emits on
    /// its front, or on its back if the mean free path there is much longer.
    Auto,
    /// Both sides reflect and emit, but for the inside of a body from which light gets nowhere.
    Emitting,
}

/// Treatment of a triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Treatment {
    /// Left out.
    pub dropped: bool,
    /// Its back becomes its front.
    pub turned: bool,
    /// The side that is not its front reflects too.
    pub doubled: bool,
    /// That side emits too.
    pub shines_on_both: bool,
}

impl Scene {
    /// The same scene with each of its triangles treated, and materials that have one side. Twins
    /// follow all others, in their order. Unless both sides shine, they emit nothing: if the
    /// triangle's material does, they have another, of the same name, after all others.
    pub(crate) fn treated(&self, treatments: &[Treatment]) -> Scene {
        let mut scene = self.clone();
        scene.materials.iter_mut().for_each(|material| material.sides = Sides::Front);
        if treatments.iter().all(|treatment| *treatment == Treatment::default()) {
            return scene;
        }
        let mut textures = (*self.textures).clone();
        scene.triangles.clear();
        scene.cut_sides.clear();
        textures.coordinates.clear();
        textures.colours.clear();
        textures.relative_exitance.clear();
        textures.solid_shares.clear();
        let mut dark: BTreeMap<u32, u32> = BTreeMap::new();
        let is_kept = |&t: &usize| !treatments[t].dropped;
        let is_doubled = |t: &usize| is_kept(t) && treatments[*t].doubled;
        let kept = (0..treatments.len()).filter(is_kept).map(|t| (t, false));
        let twins = (0..treatments.len()).filter(is_doubled).map(|t| (t, true));
        for (t, is_twin) in kept.chain(twins) {
            let (mut triangle, mut coordinates) = (self.triangles[t], self.texture_coordinates(t));
            let mut colours = self.textures.colours.get(t).copied();
            let mut cut = self.cut_sides.get(t).copied();
            if treatments[t].turned != is_twin {
                triangle.corners.swap(1, 2);
                coordinates.iter_mut().for_each(|corners| corners.swap(1, 2));
                colours.iter_mut().for_each(|corners| corners.swap(1, 2));
                // From corners a, b, c to a, c, b: the side bc stays in the middle.
                cut.iter_mut().for_each(|sides| sides.swap(0, 2));
            }
            let material = triangle.material;
            let emits = self.materials[material as usize].exitance != Rgb::ZERO;
            if is_twin && emits && !treatments[t].shines_on_both {
                triangle.material = *dark.entry(material).or_insert_with(|| {
                    let index = scene.materials.len() as u32;
                    let without = scene.materials[material as usize].clone();
                    scene.materials.push(Material { exitance: Rgb::ZERO, ..without });
                    if let Some(maps) = self.textures.of_materials.get(&material).cloned() {
                        let maps = MaterialTextures { exitance: None, ..maps };
                        textures.of_materials.insert(index, maps);
                    }
                    index
                });
            }
            scene.triangles.push(triangle);
            scene.cut_sides.extend(cut);
            textures.coordinates.extend(coordinates);
            textures.colours.extend(colours);
            textures.relative_exitance.extend(self.textures.relative_exitance.get(t));
            textures.solid_shares.extend(self.textures.solid_shares.get(t));
        }
        Scene { textures: Arc::new(textures), shape: Arc::default(), ..scene }
    }
}
