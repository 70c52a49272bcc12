//! Scenes from glTF files.

mod cornell_box;
mod geometry;
mod lights;
mod lit;
#[cfg(feature = "light-map")]
mod mapped;
mod materials;
mod refused;
#[cfg(feature = "textures")]
mod textures;

use radiosity::scene::WarningKind;
use radiosity::{Error, Scene, SceneSettings, io::read_scene};

use crate::common::gltf::Gltf;

fn read(gltf: &Gltf) -> Result<Scene, Error> {
    read_scene("it.glb", &gltf.glb(), &[])
}

fn read_with(gltf: &Gltf, change: impl FnOnce(&mut SceneSettings)) -> Result<Scene, Error> {
    let mut settings = SceneSettings::default();
    change(&mut settings);
    settings.read("it.glb", &gltf.glb(), &[])
}

fn has_warning(scene: &Scene, kind: WarningKind) -> bool {
    scene.warnings().iter().any(|warning| warning.kind == kind)
}
