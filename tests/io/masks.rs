//! Masks of materials (`map_d`): which channel counts, options, and what is solid after all.

use radiosity::scene::WarningKind;
use radiosity::{Rgb, Scene};

use super::obj_texts::{SQUARE, load, oddities, repaired};
use crate::common::textured::tga;

/// An uncompressed TGA image with an alpha channel, rows from the top.
fn with_alpha(width: u16, texels: &[[u8; 4]]) -> Vec<u8> {
    let mut bytes = tga(width, &texels.iter().map(|&[r, g, b, _]| [r, g, b]).collect::<Vec<_>>());
    bytes.truncate(16);
    bytes.extend([32, 0x28]);
    bytes.extend(texels.iter().flat_map(|&[r, g, b, a]| [b, g, r, a]));
    bytes
}

const TEXT: &str = "mtllib room.mtl\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl wall\n";

/// A square across u and v from 0 to 1 with these lines about its material.
fn scene(lines: &str, image: &[u8]) -> Scene {
    let text = format!("{SQUARE}{TEXT}f 1/1 2/2 3/3 4/4\n");
    let library = format!("newmtl wall\nKd 0.5\n{lines}\n");
    load(&[("room.obj", text.as_bytes()), ("room.mtl", library.as_bytes()), ("a b.tga", image)])
        .unwrap()
}

/// Whether the middles of the left and the right half of the square are solid.
fn halves(scene: &Scene) -> [bool; 2] {
    // The first triangle has the corners 1, 2 and 3: (u, v) = (b + c, c).
    [[0.15, 0.1], [0.65, 0.1]].map(|place| scene.is_solid(0, place))
}

fn grey(left: u8, right: u8) -> Vec<u8> {
    tga(2, &[[left; 3], [right; 3]])
}

#[test]
fn what_is_below_a_half_is_a_hole() {
    for (levels, solid) in [
        ([0, 255], [false, true]),
        ([127, 128], [false, true]),
        ([200, 3], [true, false]),
        ([0, 127], [false, false]),
    ] {
        let scene = scene("map_d a b.tga", &grey(levels[0], levels[1]));
        assert_eq!(halves(&scene), solid, "{levels:?}");
        assert_eq!(oddities(&scene), [], "{:?}", scene.warnings());
        let share = solid.iter().filter(|&&solid| solid).count() as f64 / 2.0;
        let area = scene.solid_area(0) + scene.solid_area(1);
        assert!((area - share).abs() < 1e-12, "{area} {share}");
        assert_eq!(scene.area(0), 0.5);
    }
}

#[test]
fn an_alpha_channel_counts_if_it_says_anything() {
    let colours = [[0, 200, 0], [255; 3]];
    let image = |alpha: [u8; 2]| {
        let texels = [0, 1].map(|k| [colours[k][0], colours[k][1], colours[k][2], alpha[k]]);
        with_alpha(2, &texels)
    };
    for lines in ["map_d a b.tga", "map_Kd a b.tga\nmap_d A B.tga"] {
        assert_eq!(halves(&scene(lines, &image([255, 10]))), [true, false], "{lines}");
        assert_eq!(halves(&scene(lines, &image([10, 255]))), [false, true], "{lines}");
    }
    // Of an alpha that is the same everywhere, luminance: that of sRGB green 200 is above a half,
    // and of blue it is not.
    for alpha in [[255; 2], [0; 2]] {
        assert_eq!(halves(&scene("map_d a b.tga", &image(alpha))), [true, true]);
    }
    let blue = tga(2, &[[0, 0, 255], [255; 3]]);
    assert_eq!(halves(&scene("map_d a b.tga", &blue)), [false, true]);
    // Dark colours are no holes: a mask of that name was meant for an alpha that is not there.
    let scene = scene("map_Kd a b.tga\nmap_d a b.tga", &blue);
    assert_eq!(halves(&scene), [true, true]);
    assert!(scene.textures(0).unwrap().mask.is_none());
}

#[test]
fn options_move_the_mask() {
    let solid = |options: &str| {
        let scene = scene(&format!("map_d {options} a b.tga"), &grey(0, 255));
        assert_eq!(oddities(&scene), [], "{options}");
        halves(&scene)
    };
    assert_eq!(solid(""), [false, true]);
    assert_eq!(solid("-o 0.5 0"), [true, false]);
    assert_eq!(solid("-o 1.5 0 -clamp on"), [true, true]);
    assert_eq!(solid("-s 0.5 1"), [false, false]);
    let scene = scene("map_d -imfchan m a b.tga", &grey(0, 255));
    assert_eq!(oddities(&scene), [WarningKind::TextureOptions]);
}

#[test]
fn areas_beyond_the_border_are_those_of_what_is_there() {
    // From u = −1 to 2: a third lies on the image, and clamped the border goes on.
    let share = |options: &str| {
        let scene = scene(&format!("map_d {options} a b.tga"), &grey(0, 255));
        scene.solid_area(0) + scene.solid_area(1)
    };
    assert!((share("-s 3 1 -o -1 0") - 0.5).abs() < 1e-12);
    // Half of the image and all beyond: u from 0.4 to 2.4. Of 48² points on each of the triangles
    // columns are off by a half at most.
    let clamped = share("-s 2 1 -o 0.4 0 -clamp on");
    assert!((clamped - 0.95).abs() < 0.5 / 48.0, "{clamped}");
}

#[test]
fn a_mask_without_a_hole_costs_nothing() {
    for image in [grey(255, 255), grey(128, 200), with_alpha(2, &[[9, 9, 9, 128], [0, 0, 0, 255]])]
    {
        let scene = scene("map_d a b.tga", &image);
        assert!(scene.textures(0).is_none() && scene.texture_coordinates(0).is_none());
        assert_eq!(scene.solid_area(0), scene.area(0));
    }
}

#[test]
fn a_mask_that_is_not_there_is_said_and_solid() {
    let text = format!("{SQUARE}{TEXT}f 1/1 2/2 3/3 4/4\n");
    let library = "newmtl wall\nKd 0.3\nmap_d gone.png\n";
    let files = [("room.obj", text.as_bytes()), ("room.mtl", library.as_bytes())];
    let scene = repaired(&files, "1 texture that is not there", "room.mtl:1", "gone.png");
    assert!(scene.warnings()[0].to_string().contains("it is opaque"), "{:?}", scene.warnings());
    assert_eq!(scene.material(0).reflectance.to_array(), [0.3; 3]);
    assert!(scene.textures(0).is_none());
    let scene = self::scene("map_d a b.tga", b"no image");
    assert_eq!(oddities(&scene), [WarningKind::UnreadableTexture]);
}

#[test]
fn what_has_no_texture_coordinates_is_solid() {
    let text = format!("{SQUARE}{TEXT}f 1/1 2/2 3\nf 1/1 1/1 1/1\nf 1/1 3/1 4/1\n");
    let library = "newmtl wall\nKd 0.5\nmap_d a.tga\n";
    let image = grey(0, 255);
    let files: [(&str, &[u8]); 3] =
        [("room.obj", text.as_bytes()), ("room.mtl", library.as_bytes()), ("a.tga", &image)];
    let scene = load(&files).unwrap();
    assert_eq!(scene.solid_area(0), scene.area(0));
    assert!(scene.is_solid(0, [0.2, 0.3]));
    // All corners on one texel.
    assert_eq!((scene.solid_area(1), scene.is_solid(1, [0.2, 0.3])), (0.0, false));
}

#[test]
fn colours_are_those_of_what_is_solid() {
    // A quarter red, a quarter green, of which half is a hole, and half blue, which is one.
    let (red, green, blue) = ([255, 0, 0], [0, 255, 0], [0, 0, 255]);
    let colours = tga(4, &[red, green, blue, blue]);
    let mask = tga(8, &[[255; 3], [255; 3], [255; 3], [0; 3], [0; 3], [0; 3], [0; 3], [0; 3]]);
    let text = format!("{SQUARE}{TEXT}f 1/1 2/2 3/3 4/4\n");
    let library = "newmtl wall\nKd 0.6\nmap_Kd a.tga\nmap_d mask.tga\nmap_Ke a.tga\n";
    let files: [(&str, &[u8]); 4] = [
        ("room.obj", text.as_bytes()),
        ("room.mtl", library.as_bytes()),
        ("a.tga", &colours),
        ("mask.tga", &mask),
    ];
    let scene = load(&files).unwrap();
    let area = scene.solid_area(0) + scene.solid_area(1);
    assert!((area - 0.375).abs() < 1e-12, "{area}");
    // Of each triangle 48² points, of which a column is half off.
    let error = 1.5 / 48.0 / 0.375;
    let mean = Rgb::new(2.0, 1.0, 0.0) / 3.0;
    let found = scene.material(0).reflectance;
    assert!(found.abs_diff_eq(0.6 * mean, 0.6 * error), "{found}");
    let flux = (0..2).map(|t| scene.exitance(t) * scene.solid_area(t)).sum::<Rgb>();
    assert!(flux.abs_diff_eq(std::f64::consts::PI * mean * area, 4.0 * error * area), "{flux}");
    assert_eq!((found.z, flux.z), (0.0, 0.0));
}
