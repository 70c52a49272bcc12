//! Mirrors and glass in pictures, against what is worked out by hand.
//!
//! Light is made up: the radiosity at the vertices of walls is linear in space, so that what is
//! seen at any point is known to the last digits.

mod furnace;
mod glass;
mod mirrors;

use std::f64::consts::PI;

use glam::DVec3;
use radiosity::camera::RadianceImage;
use radiosity::scene::Specular;
use radiosity::{Camera, GatheredMesh, Material, Mesh, Rgb, Scene};

use crate::common::keep_counting;
use crate::common::scenes::{Quad, block, quads};

/// Of the weight of a ray, what may not be looked at.
pub const LEFT_OUT: f64 = 1.0 / 1024.0;

pub fn mirror(reflectance: f64) -> Material {
    let reflectance = Rgb::splat(reflectance);
    Material { specular: Some(Specular::Mirror { reflectance }), ..Material::grey("mirror", 0.0) }
}

pub fn glass(refractive_index: f64) -> Material {
    tinted_glass(refractive_index, Rgb::ONE)
}

pub fn tinted_glass(refractive_index: f64, transmittance: Rgb) -> Material {
    let specular = Some(Specular::Glass { refractive_index, transmittance });
    Material { specular, ..Material::grey("glass", 0.0) }
}

/// A block of this material.
pub fn block_of(low: [f64; 3], high: [f64; 3], material: &Material) -> Vec<(Quad, Material)> {
    block(low, high).map(|face| (face, material.clone())).to_vec()
}

/// Quadrilaterals with the same material are of one material, as glass has to be.
pub fn scene(all: &[(Quad, Material)]) -> Scene {
    let scene = quads(all);
    let first = |m: &Material| scene.materials().iter().position(|n| n == m).unwrap() as u32;
    let shared = |t: &radiosity::Triangle| {
        let material = first(&scene.materials()[t.material as usize]);
        radiosity::Triangle { material, ..*t }
    };
    let triangles = scene.triangles().iter().map(shared).collect();
    let (positions, groups) = (scene.positions().to_vec(), scene.groups().to_vec());
    Scene::new(positions, triangles, groups, scene.materials().to_vec()).unwrap()
}

/// Light over `scene` whose radiosity is `radiosity` of a place and its material, W/m².
pub fn lit(scene: Scene, radiosity: impl Fn(DVec3, &Material) -> Rgb) -> GatheredMesh {
    let mesh = Mesh::new(scene, f64::INFINITY).unwrap();
    let zero = vec![Rgb::ZERO; mesh.element_count()];
    let mut light = GatheredMesh::from_elements(&mesh, &zero).unwrap();
    let surface = &mut light.surface;
    for (face, &element) in surface.faces.iter().zip(&surface.elements) {
        let material = mesh.material(mesh.element(element as usize));
        for v in face.map(|v| v as usize) {
            surface.radiosity[v] = radiosity(surface.positions[v], material);
        }
    }
    light
}

/// Radiance of a place on a wall: linear, W/(m² sr).
pub fn wall_radiance(p: DVec3) -> Rgb {
    Rgb::new(3.0, 4.0, 5.0) + Rgb::new(0.3, -0.2, 0.1) * p.x + 0.2 * p.y + Rgb::Z * (0.3 * p.z)
}

/// [`lit`] where what is neither mirror nor glass has [`wall_radiance`].
pub fn lit_walls(scene: Scene) -> GatheredMesh {
    lit(scene, |place, material| match material.specular {
        None => PI * wall_radiance(place),
        Some(_) => Rgb::ZERO,
    })
}

pub const SIZE: (u32, u32) = (32, 24);

/// One ray a pixel, or more.
pub fn draw(camera: &Camera, light: &GatheredMesh, samples: u32) -> RadianceImage {
    let image = camera.interpolated_image(light, SIZE.0, SIZE.1, samples, keep_counting);
    image.unwrap().expect("nobody stopped it")
}

/// Directions through the middles of the pixels, unit length.
pub fn directions(camera: &Camera) -> Vec<DVec3> {
    let forward = (camera.target - camera.eye).normalize();
    let right = forward.cross(camera.up).normalize();
    let up = right.cross(forward);
    let step = 2.0 * (camera.vertical_fov.to_radians() / 2.0).tan() / f64::from(SIZE.1);
    let direction = |k: u32| {
        let x = (f64::from(k % SIZE.0) + 0.5 - f64::from(SIZE.0) / 2.0) * step;
        let y = (f64::from(SIZE.1) / 2.0 - f64::from(k / SIZE.0) - 0.5) * step;
        (forward + right * x + up * y).normalize()
    };
    (0..SIZE.0 * SIZE.1).map(direction).collect()
}

/// Where a ray that starts within a box leaves it.
pub fn leaves(low: DVec3, high: DVec3, from: DVec3, direction: DVec3) -> DVec3 {
    let far = DVec3::select(direction.cmpgt(DVec3::ZERO), high, low);
    from + direction * ((far - from) / direction).min_element()
}
