//! What results of textured scenes say: files, and how far off they are.

use std::f64::consts::PI;

use gltf::mesh::Semantic;
use gltf::texture::WrappingMode;
use radiosity::glam::{DVec3, Vec3};
use radiosity::io::ToneCurve;
use radiosity::verify::{Settings, verify};
use radiosity::{
    Backend, BakeTarget, ErrorKind, GatheredMesh, Mesh, Rgb, Scene, SceneSettings, VertexMesh,
    read_ply, write_glb, write_ply,
};

use crate::common::keep_going;
use crate::common::textured::{GREEN, RED, box_with_floor, box_with_wall, checkerboard, tga};

fn baked(scene: &Scene, error: f64) -> GatheredMesh {
    BakeTarget::Error(error).bake(scene.clone(), &Backend::Cpu, keep_going).unwrap().light
}

/// `irradiance` × ρ + exitance is the radiosity, in the file: at vertices whose elements are all
/// of one material, and, of a texture, all of one reflectance.
#[test]
fn irradiance_makes_the_radiosity() {
    let scene = box_with_wall("newmtl wall\nKd 0.5\nmap_Kd a.tga", &tga(2, &[RED, GREEN]));
    let light = baked(&scene, 0.1);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("it.ply");
    write_ply(&path, &light.surface).unwrap();
    let VertexMesh { positions, radiosity, irradiance, .. } = read_ply(&path).unwrap();
    let mut textured = 0;
    for (face, &e) in light.surface.faces.iter().zip(&light.surface.elements) {
        let mesh: &Mesh = &light.mesh;
        let e = e as usize;
        let t = mesh.triangle(mesh.element(e));
        for v in face.map(|v| v as usize) {
            let at_edge = (positions[v].y - 0.5).abs() < 1e-6;
            if at_edge && scene.textures(t).is_some() {
                continue;
            }
            textured += usize::from(scene.textures(t).is_some());
            let wanted = mesh.exitance(e) + mesh.reflectance(e) * irradiance[v];
            // Numbers of 24 bits.
            let off = radiosity[v].distance(wanted);
            assert!(off < 1e-6 * wanted.length(), "{}: {wanted}", radiosity[v]);
            assert!(irradiance[v].min_element() > 0.0 || mesh.reflectance(e).z == 0.0);
        }
    }
    assert!(textured > 50, "{textured}");
}

#[test]
fn glb_has_texture_coordinates_and_irradiance() {
    let map = "newmtl wall\nKd 0.5\nmap_Kd a.tga";
    let image = tga(2, &[RED, GREEN]);
    let scene = box_with_wall(map, &image);
    let mesh = Mesh::new(scene, 0.3).unwrap();
    let radiosity: Vec<Rgb> =
        (0..mesh.element_count()).map(|e| mesh.exitance(e) + 2.0 * mesh.reflectance(e)).collect();
    let light = GatheredMesh::from_elements(&mesh, &radiosity).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    write_glb(&path, &light, &ToneCurve::fit(&light.surface.radiosity)).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let document = gltf::Gltf::from_slice(&bytes).unwrap().document;
    let binary = gltf::Glb::from_slice(&bytes).unwrap().bin.unwrap();
    let irradiance_name = Semantic::Extras("IRRADIANCE".into());
    let mut textured = 0;
    for primitive in document.meshes().flat_map(|mesh| mesh.primitives()) {
        let reader = primitive.reader(|_| Some(&binary));
        let positions: Vec<[f32; 3]> = reader.read_positions().unwrap().collect();
        let indices: Vec<u32> = reader.read_indices().unwrap().into_u32().collect();
        assert!(indices.iter().all(|&v| (v as usize) < positions.len()));
        let is_wall = primitive.material().name() == Some("wall");
        let irradiance = primitive.get(&irradiance_name);
        assert_eq!((reader.read_tex_coords(0).is_some(), irradiance.is_some()), (is_wall, is_wall));
        if !is_wall {
            continue;
        }
        let places: Vec<[f32; 2]> = reader.read_tex_coords(0).unwrap().into_f32().collect();
        let irradiance: Vec<[f32; 3]> =
            gltf::accessor::Iter::new(irradiance.unwrap(), |_| Some(&binary[..]))
                .unwrap()
                .collect();
        assert_eq!((places.len(), irradiance.len()), (positions.len(), positions.len()));
        for ((p, place), e) in positions.iter().zip(places).zip(irradiance) {
            // The wall lies along y and z, and v of glTF points down.
            let wanted = [p[1], 1.0 - p[2]];
            assert!((0..2).all(|k| (place[k] - wanted[k]).abs() < 1e-6), "{p:?}: {place:?}");
            assert!((e[0] - 2.0).abs() < 1e-5 && e[2] == 0.0, "{e:?}");
            textured += 1;
        }
    }
    // A grid of 9 × 9 vertices: one material and no seam, so none is there twice.
    assert_eq!(textured, 81);
}

/// Texels of the only image of a glTF file.
fn image_of(document: &gltf::Document, binary: &[u8]) -> image::RgbImage {
    assert_eq!(document.images().len(), 1);
    let gltf::image::Source::View { view, mime_type } = document.images().next().unwrap().source()
    else {
        panic!("an image outside of the file");
    };
    assert_eq!(mime_type, "image/png");
    let bytes = &binary[view.offset()..view.offset() + view.length()];
    image::load_from_memory_with_format(bytes, image::ImageFormat::Png).unwrap().into_rgb8()
}

fn texture_of<'a>(primitive: &gltf::Primitive<'a>) -> Option<gltf::Texture<'a>> {
    let colour = primitive.material().pbr_metallic_roughness().base_color_texture();
    colour.map(|info| info.texture())
}

/// What viewers make of the image and of `COLOR_0` is the tone of the texture under the light, in
/// the median light and, of the mean, in any other: of light that is reflected, and of a lamp's.
#[test]
fn glb_shows_textures_in_the_light_on_them() {
    // Of sRGB 128, linear 0.2158605 (IEC 61966-2-1), and white.
    let texels = [[128; 3], [255; 3]];
    let linear = [Rgb::splat(0.2158605), Rgb::ONE];
    let reflectance = Rgb::new(0.3, 0.4, 0.5);
    for (maps, emitted, clamped) in [
        // The image is doubled and shifted.
        ("map_Kd -s 2 1 -o 0.25 0.5 -clamp on a.tga", Rgb::ZERO, true),
        ("map_Kd a.tga", Rgb::ZERO, false),
        ("Ke 3 2 1\nmap_Ke a.tga", PI * Rgb::new(3.0, 2.0, 1.0), false),
    ] {
        let map = format!("newmtl wall\nKd 0.3 0.4 0.5\n{maps}");
        let mesh = Mesh::new(box_with_wall(&map, &tga(2, &texels)), 0.3).unwrap();
        let wall = mesh.scene().materials().iter().find(|m| m.name == "wall").unwrap();
        // Lit more to the top, which is at z = 1.
        let irradiance = |p: DVec3| 1.0 + p.z;
        let element = |e| {
            let light = irradiance(mesh.centroid(mesh.element(e)));
            mesh.exitance(e) + light * mesh.reflectance(e)
        };
        let radiosity: Vec<Rgb> = (0..mesh.element_count()).map(element).collect();
        let mut light = GatheredMesh::from_elements(&mesh, &radiosity).unwrap();
        let known = light.surface.positions.iter().map(|&p| Rgb::splat(irradiance(p)));
        light.surface.irradiance = known.collect();
        let tone = ToneCurve::fit(&light.surface.radiosity);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.glb");
        write_glb(&path, &light, &tone).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let document = gltf::Gltf::from_slice(&bytes).unwrap().document;
        let binary = gltf::Glb::from_slice(&bytes).unwrap().bin.unwrap();
        assert_eq!(document.buffers().next().unwrap().length(), binary.len());
        let image: Vec<[u8; 3]> =
            image_of(&document, &binary).pixels().map(|pixel| pixel.0).collect();

        let is_wall = |p: &gltf::Primitive<'_>| p.material().name() == Some("wall");
        let primitives: Vec<_> = document.meshes().flat_map(|mesh| mesh.primitives()).collect();
        assert!(primitives.iter().all(|p| texture_of(p).is_some() == is_wall(p)));
        let primitive = primitives.into_iter().find(is_wall).unwrap();
        let sampler = texture_of(&primitive).unwrap().sampler();
        let wrapped = if clamped { WrappingMode::ClampToEdge } else { WrappingMode::Repeat };
        assert_eq!([sampler.wrap_s(), sampler.wrap_t()], [wrapped; 2]);
        let reader = primitive.reader(|_| Some(&binary));
        let positions: Vec<[f32; 3]> = reader.read_positions().unwrap().collect();
        let places: Vec<[f32; 2]> = reader.read_tex_coords(0).unwrap().into_f32().collect();
        let [scale, offset] =
            if clamped { [[2.0, 1.0], [0.25, 0.5]] } else { [[1.0; 2], [0.0; 2]] };
        for (p, place) in positions.iter().zip(places) {
            let wanted = [p[1] * scale[0] + offset[0], 1.0 - (p[2] * scale[1] + offset[1])];
            assert!((0..2).all(|k| (place[k] - wanted[k]).abs() < 1e-6), "{p:?}: {place:?}");
        }
        let colours: Vec<Rgb> = reader
            .read_colors(0)
            .unwrap()
            .into_rgb_f32()
            .map(|c| Rgb::from(c.map(f64::from)))
            .collect();
        // The light in the middle is the median's.
        let light_at = |p: &[f32; 3]| irradiance(Vec3::from(*p).as_dvec3());
        let middle = positions.iter().position(|p| (p[2] - 0.5).abs() < 1e-6).unwrap();
        for (shown, texel) in image.iter().zip(linear) {
            let radiosity = if emitted == Rgb::ZERO {
                1.5 * reflectance * texel
            } else {
                emitted * texel + 1.5 * wall.reflectance
            };
            let wanted = tone.linear(radiosity);
            // A channel of an image is off by half a step at most; the lightest, where sRGB is
            // steepest, is 2.4 / 1.055 / 255 = 0.009 wide.
            let found = colours[middle] * linear_of(*shown);
            assert!(found.abs_diff_eq(wanted, 0.0045), "{found}, not {wanted}: {maps}");
        }
        for (p, colour) in positions.iter().zip(&colours) {
            let mean = |light: f64| tone.linear(wall.exitance + light * wall.reflectance);
            let wanted = mean(light_at(p)) / mean(1.5);
            // Numbers of 24 bits; glTF has no colour above 1.
            let wanted = (colours[middle] * wanted).min(Rgb::ONE);
            assert!(colour.abs_diff_eq(wanted, 1e-5), "{colour}, not {wanted}: {maps}");
        }
    }
}

/// Linear colour of sRGB, by IEC 61966-2-1.
fn linear_of(texel: [u8; 3]) -> Rgb {
    let linear = |s: u8| match f64::from(s) / 255.0 {
        x if x <= 0.04045 => x / 12.92,
        x => ((x + 0.055) / 1.055).powf(2.4),
    };
    Rgb::from(texel.map(linear))
}

#[test]
fn vertices_on_seams_are_written_for_both_sides() {
    let text = "mtllib box.mtl\nusemtl wall\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\n\
                vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\nf 2/1 5/2 6/3 3/4\n";
    let image = tga(2, &[RED, GREEN]);
    let library: &[u8] = b"newmtl wall\nKd 0.5\nmap_Kd a.tga";
    let files = [("box.mtl", library), ("a.tga", &image)];
    let scene = SceneSettings::default().read("box.obj", text.as_bytes(), &files).unwrap();
    let mesh = Mesh::new(scene, f64::INFINITY).unwrap();
    let light = GatheredMesh::from_elements(&mesh, &[Rgb::ONE; 4]).unwrap();
    assert_eq!(light.surface.positions.len(), 6);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    write_glb(&path, &light, &ToneCurve::fit(&light.surface.radiosity)).unwrap();
    let document = gltf::Gltf::open(&path).unwrap().document;
    let primitive = document.meshes().next().unwrap().primitives().next().unwrap();
    assert_eq!(primitive.get(&Semantic::TexCoords(0)).unwrap().count(), 8);
}

/// At the edge between two halves a vertex reflects the mean of both.
#[test]
fn vertices_reflect_the_mean_around_them() {
    let scene = box_with_wall("newmtl wall\nKd 0.5\nmap_Kd a.tga", &tga(2, &[RED, GREEN]));
    let mesh = Mesh::new(scene, 0.3).unwrap();
    let radiosity: Vec<Rgb> =
        (0..mesh.element_count()).map(|e| mesh.exitance(e) + mesh.reflectance(e)).collect();
    let surface = VertexMesh::new(&mesh, &radiosity);
    // Across the edge at y = ½, and in the red half.
    for (y, wanted) in [(0.5, Rgb::new(0.25, 0.25, 0.0)), (0.25, Rgb::new(0.5, 0.0, 0.0))] {
        let is_there = |v: &usize| {
            let (p, n) = (surface.positions[*v], surface.normals[*v]);
            n.x > 0.9 && (p.y - y).abs() < 1e-9 && p.z > 0.1 && p.z < 0.9
        };
        let found: Vec<Rgb> =
            (0..surface.positions.len()).filter(is_there).map(|v| surface.radiosity[v]).collect();
        assert!(found.len() >= 3);
        for value in found {
            assert!(value.abs_diff_eq(wanted, 1e-6), "{value}, not {wanted}");
        }
    }
}

#[test]
fn verify_compares_the_light() {
    let scene = box_with_floor("newmtl floor\nKd 0.8\nmap_Kd a.tga", &checkerboard(4));
    let light = baked(&scene, 0.03);
    let mut settings = Settings::default();
    (settings.precision, settings.time) = (0.2, None);
    let found = verify(&scene, &light.surface, &settings, keep_going).unwrap();
    // Asked for 3 %, and what is told is within a factor of 1.5 of what is measured, at any rate
    // for scenes in the open.
    let error = found.error.unwrap();
    assert!(error.value < 0.045, "{error:?}");
    // It sees errors of the light, and asks for it.
    let mut brighter = light.surface.clone();
    for (irradiance, normal) in brighter.irradiance.iter_mut().zip(&brighter.normals) {
        // The floor's: elsewhere what is emitted would be another.
        *irradiance *= if normal.z > 0.9 { 1.3 } else { 1.0 };
    }
    let found = verify(&scene, &brighter, &settings, keep_going).unwrap();
    let floor = scene.groups().iter().position(|name| name == "floor").unwrap();
    let floor = found.groups.iter().find(|group| group.group == floor).unwrap();
    assert!((floor.error.unwrap().value - 0.3).abs() < 0.05, "{floor:?}");
    brighter.irradiance.clear();
    let error = verify(&scene, &brighter, &settings, keep_going).unwrap_err();
    assert!(
        error.kind() == ErrorKind::Scene && error.to_string().contains("irradiance"),
        "{error}"
    );
}
