//! Edges of the sun's shadows: as sharp as the shortest edge, and without gathers along them.

use glam::DVec3;
use radiosity::backend::cpu::RayGather;
use radiosity::gather::{RefinementSettings, gather_at_vertices};
use radiosity::{GatheredMesh, Mesh, Rgb, Sky, Sun};

use crate::common::scenes::{facing_down, facing_up, paint};
use crate::common::{keep_going, quads};

const SUN: f64 = 100.0;
const RHO: f64 = 0.5;

/// Shortest edge of the elements: an eighth of the setting.
const FINEST: f64 = 0.02;

/// A black sheet, one above a ground of 4 × 4, casts a square shadow; nothing else is lit.
fn lit_ground(height: f64) -> (GatheredMesh, impl Fn(DVec3) -> f64) {
    let (x, y) = ([1.5, 2.5], [1.5, 2.5]);
    let towards = DVec3::new(0.3, 0.2, 1.0);
    let sun = Sun { direction: towards.normalize(), irradiance: Rgb::splat(SUN) };
    let scene = quads(&[
        (facing_up([0.0, 4.0], [0.0, 4.0], 0.0), paint(RHO, 0.0)),
        (facing_up(x, y, height), paint(0.0, 0.0)),
        (facing_down(x, y, height), paint(0.0, 0.0)),
    ]);
    let scene = scene.with_sky(Sky::default().with_sun(sun).unwrap()).unwrap();
    let mesh = Mesh::new(scene, 0.5).unwrap();
    let dark = vec![Rgb::ZERO; mesh.element_count()];
    let source = GatheredMesh::from_elements(&mesh, &dark).unwrap();
    let settings = RefinementSettings { mesh_error: 0.3, ..RefinementSettings::new(8.0 * FINEST) };
    let mut rays = RayGather::new(&mesh, 64).unwrap();
    let light = gather_at_vertices(&source, &mesh, &settings, &mut rays, keep_going).unwrap();
    // Distance to the edge of the shadow, above 0 in it.
    let depth = move |p: DVec3| {
        let q = p + height * towards;
        let inside = |v: f64, [low, high]: [f64; 2]| (v - low).min(high - v);
        inside(q.x, x).min(inside(q.y, y))
    };
    (light, depth)
}

#[test]
fn shadow_of_sun_is_sharp_where_no_vertex_gathers() {
    let (light, depth) = lit_ground(1.0);
    let GatheredMesh { surface, gather_count, .. } = &light;
    // The penumbra is 2 · 0.00465 · 1.06 wide; linear interpolation carries it across one element,
    // whose diagonal is at most √2 of its shortest side, on either side of the edge.
    let strip = 0.00465 * 1.07 + 2f64.sqrt() * FINEST;
    let lit = RHO * SUN / DVec3::new(0.3, 0.2, 1.0).length();
    let (mut checked, mut area_of_strip) = (0, 0.0);
    for face in &surface.faces {
        let [a, b, c] = face.map(|v| surface.positions[v as usize]);
        let middle = (a + b + c) / 3.0;
        if middle.z != 0.0 {
            continue;
        }
        let at = depth(middle);
        if at.abs() <= strip {
            area_of_strip += (b - a).cross(c - a).length() / 2.0;
            continue;
        }
        let mean = face.iter().map(|&v| surface.radiosity[v as usize].x).sum::<f64>() / 3.0;
        let truth = if at > 0.0 { 0.0 } else { lit };
        // Unoccluded, the sun's irradiance is exact. A face may reach into the strip.
        let in_strip = |&v: &u32| depth(surface.positions[v as usize]).abs() <= strip;
        if face.iter().any(in_strip) {
            continue;
        }
        assert!((mean - truth).abs() < 1e-6 * lit, "{middle}: {mean}, {truth}");
        checked += 1;
    }
    assert!(checked > 100, "{checked} faces");
    // 4 long, twice as wide as the strip.
    assert!(area_of_strip < 8.0 * strip * 1.5, "{area_of_strip}");
    let vertices = surface.positions.len() as u64;
    assert!(2 * gather_count < vertices, "{gather_count} gathers for {vertices} vertices");
}
