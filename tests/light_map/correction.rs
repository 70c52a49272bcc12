//! Maps that paths correct, against a closed form.

use radiosity::light_map::{Atlas, Coordinates, LightMap, Resolution};
use radiosity::{Backend, BakeTarget, GatheredMesh, Material, Mesh, Rgb};

use crate::common::scenes::walls;
use crate::common::{keep_counting, keep_going, quads};

/// Two cubes side by side, whose walls emit 1 and 0.1 and reflect half: irradiance is 2 and 0.2
/// everywhere. The light given lacks 10 to 40 % of what is reflected in the bright cube alone, in
/// small elements, and in large ones that are near to all points, where gathers follow paths.
#[test]
fn paths_correct_what_the_light_lacks() {
    let cube = |x: f64, exitance: f64| {
        let material = Material { exitance: Rgb::splat(exitance), ..Material::grey("wall", 0.5) };
        walls([x, 0.0, 0.0], [x + 1.0, 1.0, 1.0]).map(|wall| (wall, material.clone()))
    };
    let scene = quads(&[cube(0.0, 1.0), cube(1.001, 0.1)].concat());
    let atlas = Atlas::new(scene, Resolution::Pixels(96), Coordinates::Unwrapped).unwrap();
    let target = BakeTarget::Error(0.3);
    let mut baked = target.bake(atlas.scene().clone(), &Backend::Cpu, keep_going).unwrap();
    for (edge, error) in [(0.2, 0.05), (0.2, 0.02), (2.0, 0.02)] {
        let mesh = Mesh::new(atlas.scene().clone(), edge).unwrap();
        let radiosity = |e: usize| {
            let x = mesh.centroid(mesh.element(e)).x;
            mesh.exitance(e) * if x < 1.0 { 1.9 - 0.3 * x } else { 2.0 }
        };
        let radiosity: Vec<Rgb> = (0..mesh.element_count()).map(radiosity).collect();
        baked.light = GatheredMesh::from_elements(&mesh, &radiosity).unwrap();
        let map = LightMap::of_bake(atlas.clone(), &baked, &Backend::Cpu, keep_counting);
        let mut map = map.unwrap().unwrap();
        let (before, _) = errors(&map, 2.0);
        let stated = map.correct(&baked, error, keep_counting).unwrap().unwrap();
        let (after, of_texels) = errors(&map, 2.0);
        println!("{edge} {error}: {before:.4} {after:.4} stated {stated:.4} {of_texels:.4}");
        assert!(before > 0.03 && after <= 0.55 * before, "{before} {after}");
        assert!(stated <= error, "{stated}");
        // Of texels the noise of their gathers is stated too. Errors of the light are stated too
        // large by the standard error of the spreads, most of it where cells do not differ.
        assert!((0.25..1.1).contains(&(after / of_texels)), "{after} {of_texels}");
        let (dark, of_texels) = errors(&map, 0.2);
        assert!(dark <= 1.1 * of_texels, "{dark} {of_texels}");
    }
}

/// Root mean square of the relative errors of the texels in the cube with this irradiance, and that
/// of those that are stated.
fn errors(map: &LightMap, irradiance: f64) -> (f64, f64) {
    let (mut squares, mut stated, mut count) = (0.0, 0.0, 0.0);
    for (k, value) in map.irradiance.iter().enumerate() {
        let share = value.x / irradiance;
        if map.gathered[k] && (0.5..2.0).contains(&share) {
            squares += (share - 1.0).powi(2);
            // Lengths over three channels that are equal.
            stated += (map.standard_error[k] / (3f64.sqrt() * irradiance)).powi(2);
            count += 1.0;
        }
    }
    assert!(count > 500.0, "{count}");
    ((squares / count).sqrt(), (stated / count).sqrt())
}
