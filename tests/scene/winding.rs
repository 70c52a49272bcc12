//! Faces wound inside out are said in a warning, with the name of their group; others are not.

use glam::DVec3;
use radiosity::{Material, Scene, Triangle, load_obj};

use crate::common::quads;
use crate::common::scenes::{block, halves, walls};

/// Triangles of a box, seen from inside or from outside.
fn boxed(low: [f64; 3], high: [f64; 3], inside: bool) -> Vec<[DVec3; 3]> {
    let quads = if inside { walls(low, high) } else { block(low, high) };
    let triangles = quads.into_iter().flat_map(halves);
    triangles.map(|corners| corners.map(DVec3::from_array)).collect()
}

fn room() -> (&'static str, Vec<[DVec3; 3]>) {
    ("room", boxed([0.0; 3], [1.0; 3], true))
}

/// The groups that the warning names, which there is at most one of.
fn named(groups: &[(&str, Vec<[DVec3; 3]>)]) -> String {
    let corners: Vec<[DVec3; 3]> = groups.iter().flat_map(|g| g.1.clone()).collect();
    let of = (0u32..).zip(groups).flat_map(|(k, g)| g.1.iter().map(move |_| k));
    let triangle = |(t, group)| Triangle {
        corners: [0, 1, 2].map(|k| 3 * t + k),
        group,
        ..Default::default()
    };
    let mut scene = Scene::new(
        corners.concat(),
        (0u32..).zip(of).map(triangle).collect(),
        groups.iter().map(|g| g.0.into()).collect(),
        vec![Material::grey("m", 0.5)],
    )
    .unwrap();
    scene.check_winding();
    assert!(scene.warnings().len() < 2);
    let names = scene.warnings().iter().flat_map(|w| w.names.iter().map(|n| format!("'{n}'")));
    names.collect::<Vec<_>>().join(", ")
}

#[test]
fn names_groups_wound_inside_out() {
    let (low, high) = ([0.3; 3], [0.6; 3]);
    assert_eq!(named(&[room(), ("block", boxed(low, high, true))]), "'block'");
    // One side of twelve triangles.
    for side in 0..6 {
        let mut one = boxed(low, high, false);
        one[2 * side].swap(1, 2);
        one[2 * side + 1].swap(1, 2);
        assert_eq!(named(&[room(), ("block", one)]), "'block'", "{side}");
    }
    // All of the room but what stands in it.
    let outside_in = ("room", boxed([0.0; 3], [1.0; 3], false));
    let blocks = ("block", boxed(low, high, false));
    assert_eq!(named(&[outside_in, blocks.clone()]), "'room'");
    // A wall of it.
    let mut walls = room().1;
    let mut wall = walls.split_off(10);
    wall.iter_mut().for_each(|corners| corners.swap(1, 2));
    assert_eq!(named(&[("walls", walls), ("wall", wall), blocks]), "'wall'");
    // Both in one group.
    let all = [room().1, boxed(low, high, true)].concat();
    assert_eq!(named(&[("all", all)]), "'all'");
    // A screen with one face, seen from both sides.
    let screen = boxed([0.5, 0.2, 0.2], [0.9, 0.8, 0.8], true);
    assert_eq!(named(&[room(), ("screen", screen[..2].to_vec())]), "'screen'");
}

/// What has a second face in the same place is met from the front on both sides.
#[test]
fn accepts_faces_back_to_back() {
    let screen = boxed([0.5, 0.2, 0.2], [0.9, 0.8, 0.8], true)[..2].to_vec();
    let turned: Vec<_> = screen.iter().map(|&[a, b, c]| [a, c, b]).collect();
    assert_eq!(named(&[room(), ("one", screen.clone()), ("other", turned.clone())]), "");
    assert_eq!(named(&[("screen", [turned, screen].concat()), room()]), "");
}

#[test]
fn accepts_groups_wound_right() {
    let block = |low, high| boxed(low, high, false);
    assert_eq!(named(&[room()]), "");
    assert_eq!(named(&[("block", block([0.; 3], [1.; 3]))]), "");
    // What stands on the floor hides a part of it, which sees nothing but backs.
    assert_eq!(named(&[room(), ("cube", block([0.2, 0.2, 0.], [0.6, 0.6, 0.4]))]), "");
    assert_eq!(named(&[room(), ("plate", block([0.1, 0.1, 0.], [0.9, 0.9, 0.01]))]), "");
    // One in the other, and out of the room.
    let pillars =
        [block([0.4, 0.4, -0.5], [0.6, 0.6, 1.5]), block([0.2, 0.45, 0.], [0.8, 0.55, 0.5])];
    assert_eq!(named(&[room(), ("pillars", pillars.concat())]), "");
    let mut scene =
        load_obj(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj")).unwrap();
    scene.check_winding();
    assert!(scene.warnings().is_empty(), "{:?}", scene.warnings());
}

#[test]
fn ignores_face_that_sees_nothing() {
    let plate = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];
    let mut scene = quads(&[(plate, Material::grey("m", 0.5))]);
    scene.check_winding();
    assert!(scene.warnings().is_empty(), "{:?}", scene.warnings());
}
