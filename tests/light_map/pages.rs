//! Several maps for one scene: pages of one size, and one for each group.

use std::sync::Arc;

use glam::DVec2;
use image::GenericImageView;
use radiosity::backend::cpu::RayGather;
use radiosity::io::{rgbm_range, write_light_map_exr, write_light_map_ktx2, write_light_map_rgbm};
use radiosity::light_map::{Atlas, Coordinates, LayoutSettings, LightMap, Maps, Resolution};
use radiosity::scene::Sides;
use radiosity::{ErrorKind, GatheredMesh, Mesh, Rgb, SceneSettings};

use crate::common::{cornell_box, keep_counting};

/// The map of the Cornell box with its lamp alone, laid out by these settings.
fn map_of_box(settings: &LayoutSettings) -> LightMap {
    let scene = Arc::new(cornell_box(f64::INFINITY).scene().clone());
    let atlas = Atlas::with_settings(scene, settings).unwrap();
    let mesh = Mesh::new(atlas.scene().clone(), f64::INFINITY).unwrap();
    let radiosity: Vec<Rgb> = (0..mesh.element_count()).map(|e| mesh.exitance(e)).collect();
    let light = GatheredMesh::from_elements(&mesh, &radiosity).unwrap();
    let mut rays = RayGather::new(&mesh, 64).unwrap();
    LightMap::gather(atlas, &light, &mut rays, keep_counting).unwrap().unwrap()
}

/// What an image of this size shows at `place` by bilinear filtering, as programs do.
fn shown(values: &[Rgb], [width, height]: [u32; 2], place: DVec2) -> Rgb {
    let at = place * DVec2::new(width.into(), height.into()) - 0.5;
    let texel = |x: f64, y: f64| {
        let [x, y] = [(x, width), (y, height)].map(|(x, n)| x.clamp(0.0, f64::from(n - 1)) as u32);
        values[(y * width + x) as usize]
    };
    let (low, share) = (at.floor(), at - at.floor());
    let row = |y: f64| texel(low.x, y).lerp(texel(low.x + 1.0, y), share.x);
    row(low.y).lerp(row(low.y + 1.0), share.y)
}

/// Every page shows what the map as a whole shows, at its own coordinates; `values` reads a page.
fn pages_show_the_map(map: &LightMap, values: impl Fn(usize) -> ([u32; 2], Vec<Rgb>), step: f64) {
    let atlas = &map.atlas;
    let pages: Vec<_> = (0..atlas.pages().len()).map(values).collect();
    for t in 0..atlas.scene().triangles().len() {
        let (page, [a, b, c]) = atlas.page_coordinates(t);
        for weights in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.3, 0.4], [0.5, 0.5], [0.1, 0.7]] {
            let [u, v] = weights;
            let place = a * (1.0 - u - v) + b * u + c * v;
            let inside = place.cmpge(DVec2::ZERO).all() && place.cmple(DVec2::ONE).all();
            assert!(inside, "triangle {t}: {place}");
            let (size, values) = &pages[page];
            let (found, wanted) = (shown(values, *size, place), map.irradiance_at(t, weights));
            let off = (found - wanted).abs().max_element();
            assert!(
                off <= step * wanted.max_element().max(1e-6),
                "{t} {weights:?}: {found} {wanted}"
            );
        }
    }
}

/// Pages read from EXR files.
fn of_exr(map: &LightMap) -> impl Fn(usize) -> ([u32; 2], Vec<Rgb>) {
    |k| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        write_light_map_exr(&path, map.page(k)).unwrap();
        let image = exr::prelude::read_first_flat_layer_from_file(&path).unwrap().layer_data;
        let channels = ["R", "G", "B"].map(|name| {
            let list = &image.channel_data.list;
            let channel = list.iter().find(|channel| channel.name.eq(name)).unwrap();
            channel.sample_data.values_as_f32().collect::<Vec<f32>>()
        });
        let texel = |k: usize| Rgb::from_array([0, 1, 2].map(|c: usize| channels[c][k].into()));
        let size = [image.size.x() as u32, image.size.y() as u32];
        (size, (0..channels[0].len()).map(texel).collect())
    }
}

#[test]
fn surfaces_are_spread_over_pages_of_one_size() {
    let mut settings = LayoutSettings::new(Resolution::TexelSize(10.0));
    settings.maps = Maps::Pages(64);
    let map = map_of_box(&settings);
    let pages = map.atlas.pages();
    // Surfaces of 1.9e6 have 19 000 texels, more than four pages have.
    assert!(pages.len() > 4, "{}", pages.len());
    assert!(pages.iter().all(|page| page.size == [64, 64] && page.group.is_none()));
    assert!((map.atlas.texel_size() / 10.0 - 1.0).abs() < 1e-3);
    // 32 bits of a channel, and of coordinates in a page.
    pages_show_the_map(&map, of_exr(&map), 1e-3);
    // A wall has no room in a page of half its size.
    settings.maps = Maps::Pages(32);
    let mesh = cornell_box(f64::INFINITY);
    let e = Atlas::with_settings(Arc::new(mesh.scene().clone()), &settings).unwrap_err();
    assert!(e.kind() == ErrorKind::Setting && e.to_string().contains("no room"), "{e}");
    // Pages have no number of texels that all surfaces could share.
    settings.resolution = Resolution::Pixels(64);
    let e = Atlas::with_settings(Arc::new(mesh.scene().clone()), &settings).unwrap_err();
    assert!(e.kind() == ErrorKind::Setting && e.to_string().contains("no size of texels"), "{e}");
}

#[test]
fn each_group_has_a_map() {
    let mut settings = LayoutSettings::new(Resolution::TexelSize(15.0));
    settings.maps = Maps::EachGroup;
    settings.padding = 8;
    let map = map_of_box(&settings);
    let (atlas, scene) = (&map.atlas, map.atlas.scene());
    assert_eq!(atlas.pages().len(), scene.groups().len());
    for (t, triangle) in scene.triangles().iter().enumerate() {
        let (page, _) = atlas.page_coordinates(t);
        assert_eq!(atlas.pages()[page].group, Some(triangle.group));
    }
    pages_show_the_map(&map, of_exr(&map), 1e-3);
    assert_eq!(atlas.smaller_images(), 3);
}

/// Two squares that have all of [0, 1] each: two maps have room for them, one has not.
#[test]
fn coordinates_of_a_file_may_be_those_of_each_group() {
    let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
                vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\ng a\nf 1/1 2/2 3/3 4/4\ng b\nf 5/1 6/2 7/3 8/4\n";
    let mut reading = SceneSettings::default();
    reading.texture_coordinates = true;
    reading.sides = Sides::Front;
    let scene = Arc::new(reading.read("scene.obj", text.as_bytes(), &[]).unwrap());
    let mut settings = LayoutSettings::new(Resolution::Pixels(20));
    settings.coordinates = Coordinates::Given;
    let e = Atlas::with_settings(scene.clone(), &settings).unwrap_err();
    assert!(e.to_string().contains("overlapping for triangles"), "{e}");
    settings.maps = Maps::EachGroup;
    let atlas = Atlas::with_settings(scene, &settings).unwrap();
    assert_eq!((atlas.pages().len(), atlas.unusable(), atlas.charts()), (2, None, None));
    let corners = [DVec2::new(0.0, 1.0), DVec2::new(1.0, 1.0), DVec2::new(1.0, 0.0)];
    for (t, page) in [(0, 0), (2, 1)] {
        let (of, found) = atlas.page_coordinates(t);
        assert_eq!(of, page);
        assert!(found.iter().zip(corners).all(|(a, b)| a.distance(b) < 1e-12), "{found:?}");
    }
}

#[test]
fn rgbm_and_ktx2_are_read_by_others_within_their_precision() {
    let mut settings = LayoutSettings::new(Resolution::TexelSize(12.0));
    (settings.maps, settings.padding) = (Maps::Pages(64), 4);
    let map = map_of_box(&settings);
    let folder = tempfile::tempdir().unwrap();
    let range = rgbm_range(&map);
    let of_rgbm = |k: usize| {
        let path = folder.path().join("a.png");
        write_light_map_rgbm(&path, map.page(k), range).unwrap();
        let image = image::open(&path).unwrap();
        let texel = |p: image::Rgba<u8>| {
            let [r, g, b, m] = p.0.map(|x| f64::from(x) / 255.0);
            range * (m * Rgb::new(r, g, b)).powf(2.0)
        };
        let (width, height) = image.dimensions();
        ([width, height], image.pixels().map(|(_, _, p)| texel(p)).collect())
    };
    let of_ktx2 = |k: usize| {
        let path = folder.path().join("a.ktx2");
        write_light_map_ktx2(&path, map.page(k)).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let reader = ktx2::Reader::new(bytes.as_slice()).unwrap();
        let header = reader.header();
        assert_eq!(header.format, Some(ktx2::Format::E5B9G9R9_UFLOAT_PACK32));
        let levels: Vec<_> = reader.levels().collect();
        // A padding of 4 texels lasts for images of a half and a quarter.
        assert_eq!(levels.iter().map(|l| l.data.len()).collect::<Vec<_>>(), [16384, 4096, 1024]);
        let texel = |bytes: &[u8]| {
            let bits = u32::from_le_bytes(bytes.try_into().unwrap());
            let step = f64::from((bits >> 27) as i32 - 24).exp2();
            Rgb::from_array([0, 9, 18].map(|bit| f64::from(bits >> bit & 511) * step))
        };
        let size = [header.pixel_width, header.pixel_height];
        (size, levels[0].data.chunks_exact(4).map(texel).collect())
    };
    // Half a step of 1/512, relative to up to twice the brightest channel, and 32 bits of places.
    pages_show_the_map(&map, of_ktx2, 1.0 / 512.0 + 1e-3);
    // Texels are off by (1 + d)² − 1, d half a step of colour over alpha's own step less: the box
    // has light of a thousandth of the range, with an alpha of 8 steps, d = 0.5/255 · 8/7.
    pages_show_the_map(&map, of_rgbm, 2.0 * 0.5 / 255.0 * 8.0 / 7.0 + 2e-3);
}
