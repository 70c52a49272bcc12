//! Where surfaces lie in a light map.

use glam::{DVec2, DVec3};
use radiosity::light_map::{Atlas, Coordinates, LayoutSettings, Resolution, Unusable};
use radiosity::scene::Sides;
use radiosity::{ErrorKind, Scene, SceneSettings};

use crate::common::cornell_box;

/// Two triangles of a rectangle, 2 × 1, and a third one apart from them, on half the size of the
/// texture: `third` has the places of its corners.
fn scene(third: &str) -> Scene {
    let text = format!(
        "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nv 5 0 0\nv 6 0 0\nv 5 1 0\n\
         vt 0 0\nvt 1 0\nvt 1 0.5\nvt 0 0.5\n{third}\n\
         f 1/1 2/2 3/3\nf 1/1 3/3 4/4\nf 5/5 6/6 7/7\n"
    );
    read(&text)
}

fn read(text: &str) -> Scene {
    let mut settings = SceneSettings::default();
    settings.texture_coordinates = true;
    settings.sides = Sides::Front;
    settings.read("scene.obj", text.as_bytes(), &[]).unwrap()
}

/// On a quarter of the texture above the rectangle.
const APART: &str = "vt 0 0.5\nvt 0.5 0.5\nvt 0 1";

#[test]
fn coordinates_of_the_file_are_kept_with_v_downwards() {
    let scene = scene(APART);
    let atlas = Atlas::new(scene.clone(), Resolution::Pixels(64), Coordinates::Auto).unwrap();
    assert_eq!((atlas.unusable(), atlas.charts()), (None, None));
    assert_eq!((atlas.width(), atlas.height()), (64, 64));
    let wanted = [[[0., 1.], [1., 1.], [1., 0.5]], [[0., 1.], [1., 0.5], [0., 0.5]]];
    for (t, corners) in wanted.into_iter().enumerate() {
        assert_eq!(atlas.coordinates(t), corners.map(DVec2::from));
    }
    // 2.5 of area on 5/8 of the texture: texels of 2/20.
    let atlas = Atlas::new(scene, Resolution::TexelSize(0.1), Coordinates::Given).unwrap();
    assert_eq!((atlas.width(), atlas.height()), (20, 20));
    assert!((atlas.texel_size() - 0.1).abs() < 1e-12);
    // Unless asked for, coordinates that nobody needs are not kept.
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n";
    let scene = SceneSettings::default().read("a.obj", text.as_bytes(), &[]).unwrap();
    assert_eq!(scene.texture_coordinates(0), None);
}

#[test]
fn coordinates_that_cannot_be_used_are_told_and_replaced() {
    for (third, unusable, words) in [
        ("vt 0 0.5\nvt 0.5 0.5\nvt 0 1.2", Unusable::Outside(1), "out of [0, 1] for 1 triangle"),
        ("vt 0 0.5\nvt 0.5 0.5\nvt 1 0.5", Unusable::Collapsed(1), "on a point or line"),
        (
            "vt 0 0.1\nvt 0.5 0.1\nvt 0 1",
            Unusable::Overlapping([1, 2]),
            "overlapping for triangles 2 and 3",
        ),
    ] {
        let scene = scene(third);
        let pixels = Resolution::Pixels(64);
        let atlas = Atlas::new(scene.clone(), pixels, Coordinates::Auto).unwrap();
        assert_eq!(atlas.unusable(), Some(&unusable));
        assert_eq!(atlas.charts(), Some(2));
        let e = Atlas::new(scene, pixels, Coordinates::Given).unwrap_err();
        assert!(e.kind() == ErrorKind::Scene && e.to_string().contains(words), "{e}");
    }
    let bare = read("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    let atlas = Atlas::new(bare, Resolution::Pixels(64), Coordinates::Auto).unwrap();
    assert_eq!(atlas.unusable(), Some(&Unusable::Missing(1)));
}

#[test]
fn neighbours_may_overlap_by_what_few_digits_leave() {
    // Of 64 texels 0.003 are 0.2, less than the quarter that the centre of a texel lies inside.
    let near = scene("vt 0 0.497\nvt 0.5 0.497\nvt 0 1");
    let atlas = |side| Atlas::new(near.clone(), Resolution::Pixels(side), Coordinates::Auto);
    assert_eq!(atlas(64).unwrap().unusable(), None);
    // Of 1024 they are 3.
    assert_eq!(atlas(1024).unwrap().unusable(), Some(&Unusable::Overlapping([1, 2])));
}

#[test]
fn new_coordinates_lie_apart_and_are_as_large_as_surfaces() {
    let scene = cornell_box(f64::INFINITY).scene().clone();
    let atlas = Atlas::new(scene, Resolution::TexelSize(4.0), Coordinates::Unwrapped).unwrap();
    let scene = atlas.scene();
    let size = DVec2::new(atlas.width().into(), atlas.height().into());
    let triangles = 0..scene.triangles().len();
    let corners: Vec<[DVec2; 3]> =
        triangles.clone().map(|t| atlas.coordinates(t).map(|p| p * size)).collect();
    for t in triangles.clone() {
        let [a, b, c] = corners[t];
        // 32 bits of a coordinate leave 6e-8 of 500 texels or so, of edges of 20 and more.
        let texels = (b - a).perp_dot(c - a) / 2.0;
        assert!((texels * 16.0 / scene.area(t) - 1.0).abs() < 1e-4, "triangle {t}");
        assert!(corners[t].iter().all(|p| p.cmpge(DVec2::ZERO).all() && p.cmple(size).all()));
    }
    // Six texels between charts: between sides of triangles that face elsewhere.
    let side = |t: usize, k: usize| [corners[t][k], corners[t][(k + 1) % 3]];
    let facing = |t: usize| -> DVec3 { scene.normal(t) };
    for (s, t) in triangles.clone().flat_map(|s| triangles.clone().map(move |t| (s, t))) {
        if facing(s).dot(facing(t)) > 0.99 {
            continue;
        }
        for [from, to] in [0, 1, 2].map(|k| side(t, k)) {
            for corner in corners[s] {
                let along = to - from;
                let share = ((corner - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
                let distance = corner.distance(from + along * share);
                assert!(distance > 6.0 - 1e-3, "{s} {t}: {distance}");
            }
        }
    }
}

#[test]
fn resolutions_out_of_range_are_refused() {
    for resolution in [
        Resolution::Pixels(0),
        Resolution::Pixels(8193),
        Resolution::TexelSize(0.0),
        Resolution::TexelSize(f64::NAN),
        Resolution::TexelSize(f64::INFINITY),
        Resolution::TexelSize(1e-5),
        Resolution::TexelSize(1e-300),
        // Charts and what is around them do not fit.
        Resolution::Pixels(4),
    ] {
        for coordinates in [Coordinates::Auto, Coordinates::Unwrapped] {
            if resolution == Resolution::Pixels(4) && coordinates == Coordinates::Auto {
                continue;
            }
            let e = Atlas::new(scene(APART), resolution, coordinates).unwrap_err();
            assert_eq!(e.kind(), ErrorKind::Setting, "{resolution:?}: {e}");
        }
    }
}

#[test]
fn the_fewest_texels_have_room_and_half_as_many_do_not() {
    let scene = cornell_box(f64::INFINITY).scene().clone();
    let mut settings = LayoutSettings::new(Resolution::Pixels(1));
    (settings.coordinates, settings.padding) = (Coordinates::Unwrapped, 8);
    let atlas = Atlas::in_fewest_texels(scene.clone(), &settings).unwrap();
    // 17 charts and 16 texels between them.
    assert!(atlas.width().is_power_of_two() && atlas.width() > 64, "{}", atlas.width());
    settings.resolution = Resolution::Pixels(atlas.width() / 2);
    let refused = Atlas::with_settings(scene.clone(), &settings).unwrap_err();
    assert_eq!(refused.kind(), ErrorKind::Setting);
    settings.padding = 2;
    let refused = Atlas::in_fewest_texels(scene, &settings).unwrap_err();
    assert!(refused.to_string().contains("padding of 2"), "{refused}");
}
