//! Pictures of textured surfaces: as sharp as the texture.

use std::f64::consts::PI;

use glam::DVec3;
use radiosity::backend::cpu::RayGather;
use radiosity::camera::RadianceImage;
use radiosity::{Camera, GatheredMesh, Mesh, Rgb};

use crate::common::keep_counting;
use crate::common::textured::{GREEN, RED, box_with_wall, checkerboard, tga};

/// Looks at the wall x = 0 of the box from its middle.
const CAMERA: Camera = Camera {
    eye: DVec3::new(0.5, 0.5, 0.5),
    target: DVec3::new(0.0, 0.5, 0.5),
    up: DVec3::Z,
    vertical_fov: 80.0,
};

/// The box with a wall of this image in even light: every element has the irradiance 1.
fn evenly_lit(image: &[u8]) -> GatheredMesh {
    let scene = box_with_wall("newmtl wall\nKd 0.5\nmap_Kd a.tga", image);
    let mesh = Mesh::new(scene, 0.3).unwrap();
    let radiosity = |e| mesh.exitance(e) + mesh.reflectance(e);
    let radiosity: Vec<Rgb> = (0..mesh.element_count()).map(radiosity).collect();
    GatheredMesh::from_elements(&mesh, &radiosity).unwrap()
}

#[test]
fn edges_of_a_texture_are_sharp() {
    // Texels of 1/256 of the wall are between those of one colour.
    let row: Vec<[u8; 3]> = (0..256).map(|k| if k < 128 { RED } else { GREEN }).collect();
    let light = evenly_lit(&tga(256, &row));
    let (width, height) = (65, 65);
    let image = CAMERA.interpolated_image(&light, width, height, 4, keep_counting);
    let image = image.unwrap().unwrap();
    let mut rays = RayGather::new(&light.mesh, 64).unwrap();
    let gathered = CAMERA.gathered_image(&light, &mut rays, width, height, 2, keep_counting);
    let gathered = gathered.unwrap().unwrap();
    let middle = |image: &RadianceImage| image.pixels[65 * 32..65 * 33].to_vec();
    // The view's right is +y, where green is. All but the pixel in the middle are of one half.
    for (x, pixel) in middle(&image).into_iter().enumerate().filter(|(x, _)| *x != 32) {
        let wanted = if x < 32 { Rgb::X } else { Rgb::Y };
        assert!(pixel.abs_diff_eq(0.5 / PI * wanted, 1e-6), "{x}: {pixel}");
    }
    for (x, pixel) in middle(&gathered).into_iter().enumerate().filter(|(x, _)| *x != 32) {
        let (own, other) = if x < 32 { (pixel.x, pixel.y) } else { (pixel.y, pixel.x) };
        assert!(own > 0.1 && other == 0.0, "{x}: {pixel}");
    }
    // The vertices alone have both colours for as far as an element reaches.
    let blurred = middle(&CAMERA.image(&light.surface, width, height, 4).unwrap());
    assert!(blurred[30].y > 0.01 && blurred[34].x > 0.01, "{} {}", blurred[30], blurred[34]);
}

/// A board of squares a tenth of a pixel large is grey, evenly.
#[test]
fn textures_far_away_are_filtered() {
    let light = evenly_lit(&checkerboard(512));
    let image = CAMERA.interpolated_image(&light, 33, 33, 2, keep_counting).unwrap().unwrap();
    let mean = light.mesh.scene().materials().iter().find(|m| m.name == "wall").unwrap();
    for pixel in &image.pixels {
        // Of 4 rays, each between means of 8 × 8 squares or so.
        let wanted = mean.reflectance / PI;
        assert!(pixel.distance(wanted) < 0.02 * wanted.length(), "{pixel} {wanted}");
    }
}
