//! A scene with its light map in bevy: `cargo run --release -- room.light-map.glb
//! room.light-map.ktx2`, of `radiosity light-map room.glb --write glb,ktx2 --bind none`.
//!
//! Materials reflect the irradiance of the map; the file shows it as colours, for programs without
//! light maps, and says beside them what surfaces are.

use std::f32::consts::PI;
use std::path::PathBuf;

use bevy::camera::Exposure;
use bevy::gltf::GltfMaterialExtras;
use bevy::pbr::Lightmap;
use bevy::prelude::*;

/// The light map.
#[derive(Resource)]
struct Map(Handle<Image>);

fn main() {
    let mut files = std::env::args().skip(1);
    let (Some(scene), Some(map)) = (files.next(), files.next()) else {
        eprintln!("usage: radiosity-in-bevy SCENE.light-map.glb SCENE.light-map.ktx2");
        std::process::exit(2);
    };
    let absolute = |file: String| std::path::absolute(file).expect("a path");
    let [scene, map] = [scene, map].map(absolute);
    App::new()
        .add_plugins(DefaultPlugins.set(AssetPlugin {
            unapproved_path_mode: bevy::asset::UnapprovedPathMode::Allow,
            ..default()
        }))
        .insert_resource(GlobalAmbientLight::NONE)
        .add_systems(Startup, move |mut commands: Commands, assets: Res<AssetServer>| {
            start(&mut commands, &assets, &scene, &map);
        })
        .add_systems(Update, light)
        .run();
}

fn start(commands: &mut Commands, assets: &AssetServer, scene: &PathBuf, map: &PathBuf) {
    commands.insert_resource(Map(assets.load(map.clone())));
    let scene = assets.load(GltfAssetLabel::Scene(0).from_asset(scene.clone()));
    commands.spawn(WorldAssetRoot(scene));
    let from = Transform::from_xyz(3.7, 1.8, -4.3).looking_at(Vec3::new(2.0, 1.3, -2.6), Vec3::Y);
    commands.spawn((Camera3d::default(), from));
}

/// Gives each mesh that comes with the scene its light map.
fn light(
    mut commands: Commands,
    map: Res<Map>,
    meshes: Query<
        (Entity, &MeshMaterial3d<StandardMaterial>, Option<&GltfMaterialExtras>),
        (With<Mesh3d>, Without<Lightmap>),
    >,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    for (entity, material, extras) in &meshes {
        commands.entity(entity).insert(Lightmap { image: map.0.clone(), ..default() });
        let Some(mut material) = materials.get_mut(&material.0) else { continue };
        let values = |name: &str| extras.and_then(|extras| channels(&extras.value, name));
        let [r, g, b] = values("reflectance").unwrap_or([0.5; 3]);
        let [x, y, z] = values("exitance").unwrap_or([0.0; 3]).map(|x| x / PI);
        material.unlit = false;
        material.base_color = Color::linear_rgb(r, g, b);
        material.base_color_texture = None;
        material.emissive = LinearRgba::rgb(x, y, z);
        material.perceptual_roughness = 1.0;
        material.reflectance = 0.0;
        // bevy shows a light map times the colour, this and the camera's exposure.
        material.lightmap_exposure = 1.0 / (PI * Exposure::default().exposure());
    }
}

/// Three numbers of a material's extras, `"name":[r,g,b]`.
fn channels(extras: &str, name: &str) -> Option<[f32; 3]> {
    let (_, after) = extras.split_once(&format!("\"{name}\""))?;
    let (_, list) = after.split_once('[')?;
    let (list, _) = list.split_once(']')?;
    let numbers: Vec<f32> = list.split(',').filter_map(|x| x.trim().parse().ok()).collect();
    numbers.try_into().ok()
}
