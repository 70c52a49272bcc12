//! Irradiance by the normal.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::DVec3;
use radiosity::backend::cpu::RayGather;
use radiosity::gather::{Gather, GatherPoint};
use radiosity::light_map::{Atlas, Coordinates, LightMap, Resolution};
use radiosity::{GatheredMesh, Mesh, Rgb, Scene, Sky};

use crate::common::scenes::{facing_up, paint};
use crate::common::{cornell_box, keep_counting, quads};

fn light(scene: &Arc<Scene>, reflected: f64) -> GatheredMesh {
    let mesh = Mesh::new(scene.clone(), f64::INFINITY).unwrap();
    let radiosity: Vec<Rgb> =
        (0..mesh.element_count()).map(|e| mesh.exitance(e) + reflected).collect();
    GatheredMesh::from_elements(&mesh, &radiosity).unwrap()
}

/// Under an even sky a plane tilted by θ receives π (1 + cos θ) / 2 of it, and from a floor that
/// reflects R the rest, R (1 − cos θ) / 2: linear in the normal.
#[test]
fn under_an_even_sky_irradiance_is_linear_in_the_normal() {
    let floor = (facing_up([0.0, 1.0], [0.0, 1.0], 0.0), paint(0.5, 0.0));
    let scene = quads(&[floor]).with_sky(Sky::from(Rgb::ONE)).unwrap();
    let atlas = Atlas::new(scene, Resolution::Pixels(40), Coordinates::Unwrapped).unwrap();
    let reflected = 0.4;
    let light = light(atlas.scene(), reflected);
    let mut rays = RayGather::new(&light.mesh, 4096).unwrap();
    let map = LightMap::gather(atlas, &light, &mut rays, keep_counting).unwrap().unwrap();
    let changes = map.gather_directional(&light, &mut rays, keep_counting).unwrap().unwrap();
    // dE/dn = (π − R) / 2 along z. Rays in strata: an error of about 1/4096^0.75 of π, 0.2 %, over
    // 2 sin 45° or 1 − cos 45°, with five of them.
    let wanted = DVec3::new(0.0, 0.0, (PI - reflected) / 2.0);
    let texels: Vec<usize> = (0..map.gathered.len()).filter(|&k| map.gathered[k]).collect();
    assert!(texels.len() > 400);
    // At the border a tilted normal sees past the edge: texels in the middle.
    let mut count = 0;
    for k in texels {
        let found = [0, 1, 2].map(|axis: usize| changes[axis][k].x);
        let off = DVec3::from(found).distance(wanted);
        count += usize::from(off < 0.05);
    }
    println!("{count}");
    assert!(count > 300, "{count}");
}

/// In the Cornell box, beside gathers with 20 normals within 45° in the middle of each triangle.
/// Harmonics of order 1 are off by what light from a small lamp has beyond them.
#[test]
fn twenty_normals_receive_about_what_gathers_find() {
    let scene = Arc::new(cornell_box(f64::INFINITY).scene().clone());
    let atlas = Atlas::new(scene, Resolution::Pixels(64), Coordinates::Unwrapped).unwrap();
    let light = light(atlas.scene(), 0.1);
    let mut rays = RayGather::new(&light.mesh, 1024).unwrap();
    let map = LightMap::gather(atlas, &light, &mut rays, keep_counting).unwrap().unwrap();
    let changes = map.gather_directional(&light, &mut rays, keep_counting).unwrap().unwrap();
    let (mut squares, mut all) = (0.0, 0.0);
    let scene = map.atlas.scene();
    for t in (0..scene.triangles().len()).filter(|&t| scene.material(t).reflectance != Rgb::ZERO) {
        let [a, b, c] = scene.corners(t);
        let (middle, normal) = ((a + b + c) / 3.0, scene.normal(t));
        let point = GatherPoint::above(scene, middle, normal, 10.0);
        let mut gathered = |normal: DVec3| {
            let point = GatherPoint { normal: normal.normalize(), ..point };
            rays.gather(&light.radiosity_field(), &[point]).unwrap()[0]
        };
        // Not under what stands on it.
        if gathered(normal).backface > 0.5 {
            continue;
        }
        let at = |values: &[Rgb]| {
            let [p, q, r] = map.atlas.coordinates(t);
            let size = [map.atlas.width(), map.atlas.height()].map(f64::from);
            let [x, y] = [(p.x + q.x + r.x) / 3.0 * size[0], (p.y + q.y + r.y) / 3.0 * size[1]];
            values[y as usize * map.atlas.width() as usize + x as usize]
        };
        let (tangent, bitangent) = normal.any_orthonormal_pair();
        for k in 0..20 {
            let (tilt, turn) = (f64::from(k % 4 + 1) * 11.25, f64::from(k / 4) * 72.0);
            let (tilt, turn) = (tilt.to_radians(), turn.to_radians());
            let side = tangent * turn.cos() + bitangent * turn.sin();
            let n = normal * tilt.cos() + side * tilt.sin();
            let step = n - normal;
            let change = [0, 1, 2].map(|axis: usize| at(&changes[axis]) * step[axis]);
            let shown = map.irradiance_at(t, [1.0 / 3.0; 2]) + change.into_iter().sum::<Rgb>();
            let found = gathered(n).irradiance;
            squares += (shown - found).length_squared();
            all += found.length_squared();
        }
    }
    let off = (squares / all).sqrt();
    println!("off by {off}");
    // 0.026; up to 0.24 on sides of the blocks that the lamp's light grazes.
    assert!(off < 0.05, "{off}");
}
