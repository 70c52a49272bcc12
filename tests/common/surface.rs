//! Whether a surface of vertices is whole: no cracks, no vertex on another's side.
#![allow(dead_code, reason = "each test program uses a part of it")]

use std::collections::HashMap;

use glam::DVec3;
use radiosity::{Mesh, VertexMesh};

/// Panics unless `surface` covers each group of the scene of `mesh`, all of them flat quads as
/// [`super::quads`] makes them, once and without cracks.
pub fn assert_whole(mesh: &Mesh, surface: &VertexMesh) {
    assert_eq!(surface.faces.len(), surface.elements.len());
    let scene = mesh.scene();
    let groups = scene.groups().len();
    let group = |t: usize| scene.triangles()[t].group as usize;
    let mut faces = vec![vec![]; groups];
    for (face, &e) in surface.faces.iter().zip(&surface.elements) {
        faces[group(mesh.triangle(mesh.element(e as usize)))].push(*face);
    }
    for (g, faces) in faces.iter().enumerate() {
        let triangles: Vec<usize> =
            (0..scene.triangles().len()).filter(|&t| group(t) == g).collect();
        let normal = scene.normal(triangles[0]);
        let quad = |k: usize| scene.positions()[4 * g + k % 4];
        let area: f64 = triangles.iter().map(|&t| scene.area(t)).sum();
        let outline: f64 = (0..4).map(|k| quad(k).distance(quad(k + 1))).sum();
        assert_quad(surface, faces, normal, area, outline);
    }
}

/// Panics unless `surface` is watertight wherever the scene of `mesh` is: vertices at the very same
/// position taken as one, every side of its faces is run as often one way as the other, but for
/// those on edges where the scene's triangles do not match either.
pub fn assert_watertight(mesh: &Mesh, surface: &VertexMesh) {
    let scene = mesh.scene();
    let sides = |corners: [DVec3; 3]| [0, 1, 2].map(|k| (corners[k], corners[(k + 1) % 3]));
    let triangles = (0..scene.triangles().len()).flat_map(|t| sides(scene.corners(t)));
    let wanted = unmatched(triangles);
    let faces = surface.faces.iter().map(|f| f.map(|v| surface.positions[v as usize]));
    let found = unmatched(faces.flat_map(sides));
    let length =
        |open: &[(DVec3, DVec3)]| -> f64 { open.iter().map(|(a, b)| a.distance(*b)).sum() };
    let (wanted_length, found_length) = (length(&wanted), length(&found));
    // Lengths of parts add up to that of the whole, rounded once each.
    let bound = 1e-15 * (1.0 + found.len() as f64) * wanted_length;
    assert!((found_length - wanted_length).abs() <= bound, "{found_length} open, {wanted_length}");
    for (a, b) in found {
        // On one of the scene's open edges, and the same way round: a billionth of it off at most.
        let on = |&(from, to): &(DVec3, DVec3)| {
            let along = to - from;
            let off = |p: DVec3| (p - from).cross(along).length() / along.length_squared();
            off(a).max(off(b)) < 1e-9 && (b - a).dot(along) > 0.0
        };
        assert!(wanted.iter().any(on), "open from {a} to {b}");
    }
}

/// The sides that are run more often one way than the other, as often as that.
fn unmatched(sides: impl Iterator<Item = (DVec3, DVec3)>) -> Vec<(DVec3, DVec3)> {
    let bits = |p: DVec3| (p + DVec3::ZERO).to_array().map(f64::to_bits);
    let mut runs: HashMap<[[u64; 3]; 2], (i32, DVec3, DVec3)> = HashMap::new();
    for (a, b) in sides {
        let (from, to) = if bits(a) < bits(b) { (a, b) } else { (b, a) };
        let run = runs.entry([bits(from), bits(to)]).or_insert((0, from, to));
        run.0 += if from == a { 1 } else { -1 };
    }
    let open = |(count, a, b): (i32, DVec3, DVec3)| {
        let side = if count > 0 { (a, b) } else { (b, a) };
        std::iter::repeat_n(side, count.unsigned_abs() as usize)
    };
    runs.into_values().flat_map(open).collect()
}

fn assert_quad(surface: &VertexMesh, faces: &[[u32; 3]], normal: DVec3, area: f64, outline: f64) {
    let at = |v: u32| surface.positions[v as usize];
    // Every face faces the front and the areas add up: with sides that match, nothing is covered
    // twice. Coordinates round by 1e-16 of their size, a few hundred times over.
    let signed = |f: &[u32; 3]| (at(f[1]) - at(f[0])).cross(at(f[2]) - at(f[0])).dot(normal) / 2.0;
    assert!(faces.iter().all(|f| signed(f) > 0.0), "a face that is turned over");
    let covered: f64 = faces.iter().map(signed).sum();
    assert!((covered - area).abs() < 1e-12 * area, "{covered} of {area}");
    // Inside, every side is run once each way; on the outline once.
    let mut runs: HashMap<(u32, u32), [u32; 2]> = HashMap::new();
    for f in faces {
        for (a, b) in [(f[0], f[1]), (f[1], f[2]), (f[2], f[0])] {
            runs.entry((a.min(b), a.max(b))).or_default()[usize::from(a > b)] += 1;
        }
    }
    let mut length = 0.0;
    for (&(a, b), &run) in &runs {
        match run {
            [1, 1] => {}
            [1, 0] | [0, 1] => length += at(a).distance(at(b)),
            other => panic!("a side that is run {other:?} times"),
        }
    }
    assert!((length - outline).abs() < 1e-12 * outline, "{length} around, not {outline}");
    // By positions: no vertex on the inside of a side, or where another one is.
    let mut vertices: Vec<u32> = faces.iter().flatten().copied().collect();
    vertices.sort_unstable();
    vertices.dedup();
    for &(a, b) in runs.keys() {
        let (from, along) = (at(a), at(b) - at(a));
        for &v in vertices.iter().filter(|&&v| v != a && v != b) {
            let share = ((at(v) - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
            let off = at(v).distance(from + along * share);
            assert!(off > 1e-9 * along.length(), "vertex {v} on the side from {a} to {b}");
        }
    }
}
