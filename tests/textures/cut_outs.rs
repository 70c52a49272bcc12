//! How surfaces with holes are shown: in pictures, and to viewers of glTF.

use std::collections::HashSet;
use std::f64::consts::PI;

use gltf::material::AlphaMode;
use radiosity::backend::cpu::RayGather;
use radiosity::io::ToneCurve;
use radiosity::scene::Sides;
use radiosity::{Camera, GatheredMesh, Mesh, Rgb, Scene, SceneSettings, write_glb};

use crate::common::cut_outs::{Lattice, Part, read};
use crate::common::keep_counting;
use crate::common::scenes::facing_up;
use crate::common::textured::tga;

const MASK: Lattice = Lattice { side: 4, is_solid: |x, y| (x, y) != (1, 0) && (x + y) % 3 != 1 };
const SKY: Rgb = Rgb::new(1.0, 2.0, 0.5);

/// A sheet across (0, 0) to (4, 4) with holes above a larger ground, lit so that ground, sheet and
/// sky have a radiosity of their own each.
fn sheet_above_ground(sheet: &str) -> (Scene, [Rgb; 2]) {
    let parts: [Part; 2] = [
        (facing_up([-1.0, 5.0], [-1.0, 5.0], 0.0), "ground"),
        (facing_up([0.0, 4.0], [0.0, 4.0], 1.0), "sheet"),
    ];
    let library = format!("newmtl ground\nKd 0.5\nnewmtl sheet\nKd 0.5\n{sheet}\n");
    let colours = tga(2, &[[255, 0, 0], [0, 255, 0], [0, 0, 255], [255; 3]]);
    let images = [("mask.tga", &MASK.image()[..]), ("a.tga", &colours[..])];
    let mut settings = SceneSettings::default();
    (settings.sides, settings.sky) = (Sides::Front, Some(SKY.into()));
    let scene = read(&parts, &library, &images, &settings);
    (scene, [Rgb::new(3.0, 1.0, 2.0), Rgb::new(0.5, 4.0, 1.0)])
}

fn lit(scene: Scene, radiosity: [Rgb; 2]) -> GatheredMesh {
    let mesh = Mesh::new(scene, 1.5).unwrap();
    let element = |e: usize| {
        let node = mesh.element(e);
        radiosity[mesh.scene().triangles()[mesh.triangle(node)].group as usize]
            * (mesh.reflectance(e) / mesh.material(node).reflectance)
    };
    let radiosity: Vec<Rgb> = (0..mesh.element_count()).map(element).collect();
    GatheredMesh::from_elements(&mesh, &radiosity).unwrap()
}

#[test]
fn pixels_see_through_holes() {
    let (scene, radiosity) = sheet_above_ground("map_d mask.tga");
    let light = lit(scene, radiosity);
    // From far above: 6 × 6 pixels, of which each sees one unit of the ground, or a cell.
    let eye = glam::DVec3::new(2.0, 2.0, 1000.0);
    let vertical_fov = 2.0 * (3.0f64 / 1000.0).atan().to_degrees();
    let target = glam::DVec3::new(2.0, 2.0, 0.0);
    let camera = Camera { eye, target, up: glam::DVec3::Y, vertical_fov };
    let image = camera.interpolated_image(&light, 6, 6, 2, keep_counting).unwrap().unwrap();
    let mut gatherer = RayGather::new(&light.mesh, 64).unwrap();
    let gathered = camera.gathered_image(&light, &mut gatherer, 6, 6, 2, keep_counting);
    let gathered = gathered.unwrap().unwrap();
    let mut seen = [0, 0];
    for k in 0..36 {
        let [x, y] = [k % 6, k / 6];
        let on_sheet = (1..5).contains(&x) && (1..5).contains(&y);
        let is_solid = on_sheet && (MASK.is_solid)(x - 1, y - 1);
        seen[usize::from(is_solid)] += 1;
        let truth = radiosity[usize::from(is_solid)] / PI;
        // One radiosity for all of a surface: rounding of means.
        let found = image.pixels[k];
        assert!(found.abs_diff_eq(truth, 1e-9), "{x} {y}: {found} {truth}");
        // The ground is dimmer where the sheet is above it; the sheet sees all of the sky.
        let found = gathered.pixels[k];
        let open = 0.5 * SKY;
        let agrees = if is_solid { found.abs_diff_eq(open, 1e-9) } else { found.x < open.x };
        assert!(agrees, "{x} {y}: {found} {open}");
    }
    assert_eq!(seen, [36 - 11, 11]);
}

/// The image of the sheet in a GLB file, texels of red, green, blue and alpha, and its size.
fn shown(sheet: &str) -> ([u32; 2], Vec<[u8; 4]>) {
    let (scene, radiosity) = sheet_above_ground(sheet);
    let light = lit(scene, radiosity);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    write_glb(&path, &light, &ToneCurve::fit(&light.surface.radiosity)).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    // Validates all that the specification says of the JSON.
    let document = gltf::Gltf::from_slice(&bytes).unwrap().document;
    let binary = gltf::Glb::from_slice(&bytes).unwrap().bin.unwrap();
    for material in document.materials() {
        let is_sheet = material.name() == Some("sheet");
        let mode = if is_sheet { AlphaMode::Mask } else { AlphaMode::Opaque };
        assert_eq!(material.alpha_mode(), mode);
        assert_eq!(material.alpha_cutoff(), is_sheet.then_some(0.5));
        let colour = material.pbr_metallic_roughness().base_color_texture();
        assert_eq!(colour.is_some(), is_sheet);
    }
    let gltf::image::Source::View { view, .. } = document.images().next().unwrap().source() else {
        panic!("an image outside of the file");
    };
    let png = &binary[view.offset()..view.offset() + view.length()];
    let image = image::load_from_memory_with_format(png, image::ImageFormat::Png).unwrap();
    let image = image.into_rgba8();
    ([image.width(), image.height()], image.pixels().map(|pixel| pixel.0).collect())
}

#[test]
fn viewers_see_through_holes() {
    let is_solid = |x: usize, y: usize| (MASK.is_solid)(x, y);
    let alpha_of = |solid: bool| if solid { 255 } else { 0 };
    // With a texture of four texels, and with none; the larger image counts.
    for (sheet, colours) in [("map_d mask.tga", 1), ("map_Kd a.tga\nmap_d mask.tga", 4)] {
        let (size, texels) = shown(sheet);
        assert_eq!(size, [4, 4]);
        for (k, texel) in texels.iter().enumerate() {
            assert_eq!(texel[3], alpha_of(is_solid(k % 4, k / 4)), "{sheet}: {k}");
        }
        // Each texel of the smaller image is four.
        let block = |k: usize| texels[k % 4 / 2 * 2 + k / 8 * 8];
        assert!((0..16).all(|k| texels[k][..3] == block(k)[..3]), "{texels:?}");
        let different: HashSet<_> = texels.iter().map(|texel| &texel[..3]).collect();
        assert_eq!(different.len(), colours);
    }
    // A mask that lies otherwise than the colours: moved by a texel.
    let (_, texels) = shown("map_Kd a.tga\nmap_d -o 0.25 0 mask.tga");
    for (k, texel) in texels.iter().enumerate() {
        assert_eq!(texel[3], alpha_of(is_solid((k + 1) % 4, k / 4)), "{k}");
    }
}
