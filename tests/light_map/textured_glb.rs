//! GLB files of light maps with textures, glass and two sides.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DVec3, Vec3};
use gltf::material::AlphaMode;
use gltf::texture::WrappingMode;
use radiosity::backend::cpu::RayGather;
use radiosity::io::{ToneCurve, write_light_map_glb};
use radiosity::light_map::{Atlas, Coordinates, LightMap, Resolution};
use radiosity::scene::Sides;
use radiosity::{GatheredMesh, Mesh, Rgb, Scene, SceneSettings};

use crate::common::keep_counting;
use crate::common::textured::tga;

/// Corners of a unit box, with texture coordinates that repeat an image twice.
const BOX: &str = "mtllib box.mtl\n\
    v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
    vt 0 0\nvt 2 0\nvt 2 1\nvt 0 1\n\
    g top\nusemtl lamp\nf 5 8 7 6\ng sides\nusemtl grey\nf 2 6 7 3\nf 1 5 6 2\nf 4 3 7 8\n\
    g floor\nusemtl tiles\nf 1/1 2/2 3/3 4/4\ng pane\nusemtl glass\nf 1 4 8 5\n";

/// The light map of a box, 48 texels wide: a floor of two tiles, a lamp for a ceiling, and a pane.
fn map(tiles: &str) -> LightMap {
    let library = format!(
        "newmtl lamp\nKd 0.2\nKe 1\nnewmtl grey\nKd 0.5\nnewmtl tiles\n{tiles}\n\
         newmtl glass\nillum 4\nd 0.25\n"
    );
    let image = tga(2, &[[128; 3], [255, 0, 0]]);
    let files: [(&str, &[u8]); 2] = [("box.mtl", library.as_bytes()), ("a.tga", &image)];
    let mut settings = SceneSettings::default();
    settings.sides = Sides::Front;
    of_scene(settings.read("box.obj", BOX.as_bytes(), &files).unwrap())
}

fn of_scene(scene: Scene) -> LightMap {
    let scene = Arc::new(scene);
    let atlas = Atlas::new(scene, Resolution::Pixels(48), Coordinates::Unwrapped).unwrap();
    let mesh = Mesh::new(atlas.scene().clone(), 0.5).unwrap();
    let radiosity: Vec<Rgb> =
        (0..mesh.element_count()).map(|e| mesh.exitance(e) + mesh.reflectance(e)).collect();
    let light = GatheredMesh::from_elements(&mesh, &radiosity).unwrap();
    let mut rays = RayGather::new(&mesh, 64).unwrap();
    LightMap::gather(atlas, &light, &mut rays, keep_counting).unwrap().unwrap()
}

/// The colour of a vertex, and the map's light there.
struct Vertex {
    colour: Rgb,
    light: Rgb,
}

/// The file of a map.
struct File {
    document: gltf::Document,
    binary: Vec<u8>,
}

impl File {
    fn of(map: &LightMap, tone: &ToneCurve) -> File {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.glb");
        write_light_map_glb(&path, map, tone).unwrap();
        // Validates all that the specification says of the JSON.
        let gltf::Gltf { document, blob } = gltf::Gltf::open(&path).unwrap();
        File { document, binary: blob.unwrap() }
    }

    fn primitive(&self, material: &str) -> gltf::Primitive<'_> {
        let mut all = self.document.meshes().flat_map(|mesh| mesh.primitives());
        all.find(|p| p.material().name() == Some(material)).unwrap()
    }

    /// The vertices of the floor, at the right places of both images.
    fn vertices(&self, primitive: &gltf::Primitive<'_>, map: &LightMap) -> Vec<Vertex> {
        let reader = primitive.reader(|_| Some(&self.binary));
        let given: Vec<[f32; 2]> = reader.read_tex_coords(0).unwrap().into_f32().collect();
        let places: Vec<[f32; 2]> = reader.read_tex_coords(1).unwrap().into_f32().collect();
        let colours: Vec<[f32; 3]> = reader.read_colors(0).unwrap().into_rgb_f32().collect();
        let scene = map.atlas.scene();
        let is_floor = |&t: &usize| scene.material(t).name == "tiles";
        let floor: Vec<usize> = (0..scene.triangles().len()).filter(is_floor).collect();
        let positions = reader.read_positions().unwrap().map(Vec3::from).enumerate();
        positions
            .map(|(k, p)| {
                let is_near = |found: [f32; 2], wanted: [f64; 2]| {
                    (0..2).all(|c| (f64::from(found[c]) - wanted[c]).abs() < 1e-5)
                };
                assert!(is_near(given[k], [2.0 * f64::from(p.x), 1.0 - f64::from(p.y)]), "{p}");
                let of = |&t: &usize| (t, weights(scene, t, p));
                let (t, weights) = floor.iter().map(of).max_by(inside).unwrap();
                let place = at(map.atlas.coordinates(t).map(|q| q.extend(0.0)), weights);
                assert!(is_near(places[k], [place.x, place.y]), "{p}");
                let colour = Rgb::from(colours[k].map(f64::from));
                Vertex { colour, light: map.irradiance_at(t, weights) }
            })
            .collect()
    }

    fn image(&self, texture: &gltf::Texture<'_>) -> image::RgbImage {
        let gltf::image::Source::View { view, .. } = texture.source().source() else {
            panic!("an image of its own")
        };
        let png = &self.binary[view.offset()..view.offset() + view.length()];
        image::load_from_memory(png).unwrap().into_rgb8()
    }
}

/// Linear colour of sRGB, by IEC 61966-2-1.
fn linear(texel: [u8; 3]) -> Rgb {
    let linear = |s: u8| match f64::from(s) / 255.0 {
        x if x <= 0.04045 => x / 12.92,
        x => ((x + 0.055) / 1.055).powf(2.4),
    };
    Rgb::from(texel.map(linear))
}

/// What viewers make of the image and of `COLOR_0` is the tone of the texture in the map's light,
/// in the median light and, of the mean, in any other; and the map's places go with it.
#[test]
fn textures_are_kept_and_lit() {
    let texels = [[128; 3], [255, 0, 0]];
    for (tiles, reflectance, radiance) in [
        ("Kd 0.5\nmap_Kd a.tga", [0.5; 3], [0.0; 3]),
        ("Kd 0.3 0.6 0.2\nmap_Kd -clamp on a.tga", [0.3, 0.6, 0.2], [0.0; 3]),
        ("Kd 0.5\nKe 0.4 0.1 0.1\nmap_Ke a.tga", [0.5; 3], [0.4, 0.1, 0.1]),
    ] {
        let (map, emits) = (map(tiles), tiles.contains("map_Ke"));
        let tone = ToneCurve::fit(&map.radiosity());
        let file = File::of(&map, &tone);
        assert_eq!(file.document.images().count(), 2);
        let primitive = file.primitive("tiles");
        let shown = primitive.material().pbr_metallic_roughness().base_color_texture().unwrap();
        assert_eq!(shown.tex_coord(), 0);
        let is_clamped = shown.texture().sampler().wrap_s() == WrappingMode::ClampToEdge;
        assert_eq!(is_clamped, tiles.contains("-clamp"));
        let image: Vec<Rgb> =
            file.image(&shown.texture()).pixels().map(|texel| linear(texel.0)).collect();
        let vertices = file.vertices(&primitive, &map);
        // A floor of a sixth of a map 48 texels wide, in elements of two of them.
        assert!(vertices.len() > 40 && image.len() == 2);
        let of_texel = |texel: Rgb, light: Rgb| {
            let [of_light, of_lamp] = if emits { [Rgb::ONE, texel] } else { [texel, Rgb::ONE] };
            let emitted = PI * Rgb::from(radiance) * of_lamp;
            tone.linear(emitted + Rgb::from(reflectance) * of_light * light)
        };
        let material = map.atlas.scene().materials().iter().find(|m| m.name == "tiles").unwrap();
        let of_mean = |light: Rgb| tone.linear(material.exitance + material.reflectance * light);
        let mut order: Vec<usize> = (0..vertices.len()).collect();
        let brightness = |&k: &usize| of_mean(vertices[k].light).element_sum();
        order.sort_by(|a, b| brightness(a).total_cmp(&brightness(b)));
        let median = &vertices[order[vertices.len() / 2]];
        for (shown, texel) in image.iter().zip(texels.map(linear)) {
            // A channel of an image is off by half a step at most; the lightest, where sRGB is
            // steepest, is 2.4 / 1.055 / 255 = 0.009 wide.
            let (found, wanted) = (median.colour * shown, of_texel(texel, median.light));
            assert!(found.abs_diff_eq(wanted, 0.0045), "{found}, not {wanted}: {tiles}");
        }
        for vertex in &vertices {
            let ratio = of_mean(vertex.light) / of_mean(median.light);
            // Numbers of 24 bits; glTF has no colour above 1.
            let wanted = (median.colour * ratio).min(Rgb::ONE);
            assert!(vertex.colour.abs_diff_eq(wanted, 1e-5), "{tiles}");
        }
    }
}

/// All else shows the map itself.
#[test]
fn surfaces_without_textures_show_the_map() {
    let map = map("Kd 0.5\nmap_Kd a.tga");
    let file = File::of(&map, &ToneCurve::fit(&map.radiosity()));
    for other in ["grey", "lamp", "glass"] {
        let primitive = file.primitive(other);
        let colour = primitive.material().pbr_metallic_roughness().base_color_texture().unwrap();
        assert_eq!(colour.tex_coord(), 1);
        assert!(primitive.get(&gltf::Semantic::Colors(0)).is_none());
        assert_eq!(file.image(&colour.texture()).width(), map.atlas.width());
    }
}

/// Weights of the second and third corner of triangle `t` at a point of the plane z = 0.
fn weights(scene: &Scene, t: usize, p: Vec3) -> [f64; 2] {
    let [a, b, c] = scene.corners(t);
    let (ab, ac, to) = (b - a, c - a, p.as_dvec3() - a);
    let area = ab.cross(ac).z;
    [to.cross(ac).z / area, ab.cross(to).z / area]
}

/// Which of two points lies more inside.
fn inside(a: &(usize, [f64; 2]), b: &(usize, [f64; 2])) -> std::cmp::Ordering {
    let least = |[u, v]: [f64; 2]| u.min(v).min(1.0 - u - v);
    least(a.1).total_cmp(&least(b.1))
}

fn at([a, b, c]: [DVec3; 3], [u, v]: [f64; 2]) -> DVec3 {
    a * (1.0 - u - v) + b * u + c * v
}

#[test]
fn panes_are_transparent() {
    let map = map("Kd 0.5");
    let file = File::of(&map, &ToneCurve::fit(&map.radiosity()));
    for material in file.document.materials() {
        let is_glass = material.name() == Some("glass");
        let mode = if is_glass { AlphaMode::Blend } else { AlphaMode::Opaque };
        assert_eq!(material.alpha_mode(), mode, "{:?}", material.name());
        // `d` 0.25: a quarter is opaque.
        let alpha = material.pbr_metallic_roughness().base_color_factor()[3];
        assert_eq!(alpha, if is_glass { 0.25 } else { 1.0 });
    }
}

/// A sheet for both sides lies apart, as in the file of a bake.
#[test]
fn two_sides_lie_apart() {
    let text = "v 0 0 0\nv 4 0 0\nv 0 3 0\nf 1 2 3\nf 1 3 2\n";
    let mut settings = SceneSettings::default();
    settings.sides = Sides::Front;
    let map = of_scene(settings.read("a.obj", text.as_bytes(), &[]).unwrap());
    let file = File::of(&map, &ToneCurve::fit(&map.radiosity()));
    let primitive = file.document.meshes().next().unwrap().primitives().next().unwrap();
    let reader = primitive.reader(|_| Some(&file.binary));
    let mut heights: Vec<f32> = reader.read_positions().unwrap().map(|p| p[2]).collect();
    heights.sort_by(f32::total_cmp);
    // 1e-4 of the diagonal, which is 5.
    assert_eq!(heights, [-5e-4, -5e-4, -5e-4, 0.0, 0.0, 0.0]);
}
