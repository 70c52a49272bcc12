//! Helpers of the tests that compare shaders with their twins: scenes, reading back, pictures.

use std::sync::Arc;

use bytemuck::Pod;
use glam::{DAffine2, DVec2, DVec3};

use super::device::Gpu;
use crate::gather::GatherPoint;
use crate::mesh::Mesh;
use crate::sampling::hash::{split_mix64_nth, unit_interval};
use crate::scene::texture::{MaterialTextures, Texture, TextureMap};
use crate::scene::{
    Material, Rgb, Scene, SceneTextures, Sky, SkyDistribution, Specular, Sun, Triangle,
};

/// Shifts of pixel centres, pixels: none, then the other points of a grid of ±1/128 in steps of
/// 1/256. Devices round corners of triangles to a grid of 1/256 pixel, and edge functions in 32
/// bits add less than that again: the item of a device at a pixel is that of the twin at one of
/// these points, or between them.
pub fn offsets() -> Vec<[f64; 2]> {
    let steps = || (-2..=2).map(|k| f64::from(k) / 256.0);
    let grid = steps().flat_map(|y| steps().map(move |x| [x, y]));
    std::iter::once([0.0; 2]).chain(grid.filter(|o| *o != [0.0; 2])).collect()
}

/// The device; tests that need one are ignored if RADIOSITY_NO_GPU is set.
pub fn gpu() -> Gpu {
    Gpu::new(None).expect("a graphics adapter, or RADIOSITY_NO_GPU set")
}

/// The same scene with a texture on all walls and lights.
pub fn textured_scene() -> Mesh {
    let mesh = scene();
    let plain = mesh.scene();
    let texel = |k: u8| [k.wrapping_mul(67), k.wrapping_mul(151), k.wrapping_mul(29)];
    let texture = Arc::new(Texture::new(5, 7, (0..35).map(texel).collect()).unwrap());
    let map = |factor: Rgb| TextureMap { factor, ..TextureMap::new(texture.clone()) };
    let textures = |(m, material): (u32, &Material)| {
        let exitance = Some(map(material.exitance)).filter(|_| material.exitance != Rgb::ZERO);
        (m, MaterialTextures { reflectance: Some(map(Rgb::splat(0.9))), exitance, mask: None })
    };
    let coordinates = |t: usize| {
        let turned = DVec2::from_angle(t as f64);
        [DVec2::ZERO, DVec2::X, DVec2::Y].map(|corner| turned.rotate(corner))
    };
    let scene = Scene::with_textures(
        plain.positions().to_vec(),
        plain.triangles().to_vec(),
        plain.groups().to_vec(),
        plain.materials().to_vec(),
        SceneTextures {
            coordinates: (0..plain.triangles().len()).map(coordinates).collect(),
            of_materials: (0..).zip(plain.materials()).map(textures).collect(),
            ..SceneTextures::default()
        },
    );
    mesh.with_scene(scene.unwrap()).unwrap()
}

/// A floor in quadtrees of uneven depth, and around it: a ceiling, a wall that extends below the
/// horizon and behind the eye, a triangle that shows its back, one that has a front on either side,
/// and two lights with something in front of the first.
pub fn scene() -> Mesh {
    let triangles = [
        ([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]], 0),
        ([[-1.0, -1.0, 1.3], [-1.0, 3.1, 1.45], [3.3, -1.2, 1.2]], 0),
        ([[-0.7, -0.9, -0.5], [-0.6, 2.9, -0.6], [-0.9, 0.9, 1.1]], 0),
        ([[2.2, -0.5, 0.1], [2.3, 1.7, 0.15], [2.1, 0.6, 1.0]], 0),
        ([[0.4, 0.3, 1.0], [0.5, 0.9, 1.05], [1.0, 0.4, 0.95]], 1),
        ([[0.5, 0.45, 0.6], [0.55, 0.7, 0.62], [0.8, 0.5, 0.58]], 0),
        ([[1.8, 1.6, 0.9], [1.5, 1.9, 0.5], [1.9, 1.9, 0.6]], 2),
        ([[1.2, 0.1, 0.4], [1.6, 0.5, 0.5], [1.5, 0.1, 0.9]], 0),
        ([[1.2, 0.1, 0.4], [1.5, 0.1, 0.9], [1.6, 0.5, 0.5]], 0),
    ];
    let positions = triangles.iter().flat_map(|t| t.0.map(DVec3::from_array)).collect();
    let triangles = (0..).zip(triangles).map(|(t, (_, material))| Triangle {
        corners: [3 * t, 3 * t + 1, 3 * t + 2],
        material,
        ..Default::default()
    });
    let light = |name: &str, exitance: Rgb| Material { exitance, ..Material::grey(name, 0.5) };
    let materials = vec![
        Material::grey("wall", 0.5),
        light("lamp", Rgb::new(3.0, 2.0, 1.0)),
        light("window", Rgb::new(0.5, 0.7, 1.1)),
    ];
    let scene = Scene::new(positions, triangles.collect(), vec!["all".into()], materials);
    let mesh = Mesh::new(scene.unwrap(), 1.2).unwrap();
    let split: Vec<usize> = (0..mesh.element_count()).filter(|e| e % 3 == 1).collect();
    let mesh = mesh.split(&split).unwrap();
    let split: Vec<usize> = (0..mesh.element_count()).filter(|e| e % 5 == 2).collect();
    mesh.split(&split).unwrap()
}

/// Scenes with all kinds of objects that rays may hit, by name.
pub fn traced_scenes() -> Vec<(&'static str, Mesh)> {
    vec![
        ("quadtrees", scene()),
        ("textures", textured_scene()),
        ("sky and sun", under_sky_and_sun()),
        ("panes", room_with_panes()),
        ("cut-outs", sheets_with_holes()),
        ("wide lights", wide_lights()),
        ("many lights", many_lights()),
        ("doubled faces", room_with_doubled_leaf()),
    ]
}

/// The scene under a sky that varies with direction, with a sun.
pub fn under_sky_and_sun() -> Mesh {
    let mesh = scene();
    let distribution = SkyDistribution::cie(12).unwrap();
    let (up, sun) = (DVec3::new(0.1, 0.3, 1.0), DVec3::new(0.2, 0.1, 1.0));
    let sky = Sky::new(distribution, Rgb::new(1.0, 2.0, 3.0), up, sun).unwrap();
    let sky = sky.with_sun(Sun { direction: sun, irradiance: Rgb::new(3.0, 2.0, 1.0) }).unwrap();
    mesh.with_scene(mesh.scene().clone().with_sky(sky).unwrap()).unwrap()
}

/// Corners of a quadrilateral, counter-clockwise seen from its front.
type Quad = [[f64; 3]; 4];

fn facing_up([x0, x1]: [f64; 2], [y0, y1]: [f64; 2], z: f64) -> Quad {
    [[x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z]]
}

fn facing_down(x: [f64; 2], y: [f64; 2], z: f64) -> Quad {
    let [a, b, c, d] = facing_up(x, y, z);
    [a, d, c, b]
}

/// Walls of a unit cube seen from inside: x low and high, y, z.
fn walls() -> [Quad; 6] {
    let (a, x) = (0.0, 1.0);
    [
        [[a, a, a], [a, x, a], [a, x, x], [a, a, x]],
        [[x, a, a], [x, a, x], [x, x, x], [x, x, a]],
        [[a, a, a], [a, a, x], [x, a, x], [x, a, a]],
        [[a, x, a], [x, x, a], [x, x, x], [a, x, x]],
        [[a, a, a], [x, a, a], [x, x, a], [a, x, a]],
        [[a, a, x], [a, x, x], [x, x, x], [x, a, x]],
    ]
}

fn emitting(exitance: [f64; 3]) -> Material {
    Material { exitance: exitance.into(), ..Material::grey("lamp", 0.5) }
}

fn glass(transmittance: [f64; 3]) -> Material {
    let transmittance = transmittance.into();
    let specular = Some(Specular::Glass { refractive_index: 1.5, transmittance });
    Material { specular, ..Material::grey("glass", 0.0) }
}

/// Triangles of quadrilaterals, each with its own material.
struct Parts {
    positions: Vec<DVec3>,
    triangles: Vec<Triangle>,
    materials: Vec<Material>,
}

impl Parts {
    fn new(quads: &[(Quad, Material)]) -> Parts {
        let mut parts = Parts { positions: vec![], triangles: vec![], materials: vec![] };
        for ([a, b, c, d], material) in quads {
            parts.add(&[[*a, *b, *c], [*a, *c, *d]], material.clone());
        }
        parts
    }

    fn add(&mut self, triangles: &[[[f64; 3]; 3]], material: Material) {
        let number = self.materials.len() as u32;
        self.materials.push(material);
        for corners in triangles {
            let first = self.positions.len() as u32;
            self.positions.extend(corners.map(DVec3::from_array));
            let corners = [first, first + 1, first + 2];
            self.triangles.push(Triangle { corners, material: number, ..Default::default() });
        }
    }

    fn mesh(self, sky: Sky, element_size: f64) -> Mesh {
        let Parts { positions, triangles, materials } = self;
        let scene = Scene::new(positions, triangles, vec!["all".into()], materials).unwrap();
        Mesh::new(scene.with_sky(sky).unwrap(), element_size).unwrap()
    }
}

/// A room that is open to one side, to a sun low in the sky, with a lamp above two tinted panes,
/// which are wider than the room, and a third in front of the open side.
fn room_with_panes() -> Mesh {
    let mut parts: Vec<(Quad, Material)> =
        walls().map(|wall| (wall, Material::grey("wall", 0.5))).to_vec();
    parts.remove(1);
    parts.push((facing_down([0.3, 0.7], [0.4, 0.7], 0.99), emitting([7.0, 5.0, 3.0])));
    let wide = [-0.5, 1.5];
    parts.push((facing_up(wide, [-0.4, 1.5], 0.61), glass([0.9, 0.5, 0.7])));
    parts.push((facing_up(wide, [-0.4, 1.5], 0.72), glass([0.3, 0.8, 1.0])));
    let upright = [[1.2, 1.7, -0.3], [1.2, -0.6, -0.3], [1.2, -0.6, 0.5], [1.2, 1.7, 0.5]];
    parts.push((upright, glass([0.6, 0.6, 0.25])));
    let sun = Sun { direction: DVec3::new(1.0, 0.2, 0.3), irradiance: Rgb::new(2.0, 1.5, 1.0) };
    let sky = Sky::uniform(Rgb::new(0.1, 0.2, 0.3)).with_sun(sun).unwrap();
    Parts::new(&parts).mesh(sky, 0.4)
}

/// A sheet above a floor whose mask repeats, below a lamp with holes whose mask ends at its border;
/// a second lamp illuminates through the sheet only.
fn sheets_with_holes() -> Mesh {
    let parts = Parts::new(&[
        (facing_up([0.0, 2.0], [0.0, 2.0], 0.0), Material::grey("floor", 0.5)),
        (facing_up([-0.1, 1.3], [0.1, 1.9], 0.55), Material::grey("sheet", 0.5)),
        (facing_down([0.4, 1.5], [0.3, 1.6], 1.2), emitting([3.0, 2.0, 1.0])),
        (facing_down([-0.6, -0.2], [0.3, 0.9], 0.9), emitting([1.0, 2.0, 3.0])),
    ]);
    let solid = |k: usize| [if k * k % 7 % 3 == 1 { 0 } else { 255 }; 3];
    let texture = Arc::new(Texture::new(5, 7, (0..35).map(solid).collect()).unwrap());
    let mask = |clamped: bool, scale: DVec2| {
        let offset = DVec2::new(0.31, -1.7) * f64::from(!clamped);
        let placement = DAffine2::from_scale_angle_translation(scale, 0.0, offset);
        let mask = TextureMap { placement, clamped, ..TextureMap::new(texture.clone()) };
        MaterialTextures { mask: Some(mask), ..Default::default() }
    };
    let of_materials = [(1, mask(false, DVec2::new(2.3, 1.4))), (2, mask(true, DVec2::splat(1.2)))];
    let (low, high) = ([DVec2::ZERO, DVec2::X, DVec2::ONE], [DVec2::ZERO, DVec2::ONE, DVec2::Y]);
    let coordinates =
        (0..parts.triangles.len()).map(|t| if t % 2 == 0 { low } else { high }).collect();
    let Parts { positions, triangles, materials } = parts;
    let groups = vec!["all".into()];
    let of_materials = of_materials.into_iter().collect();
    let textures = SceneTextures { coordinates, of_materials, ..SceneTextures::default() };
    let scene = Scene::with_textures(positions, triangles, groups, materials, textures).unwrap();
    Mesh::new(scene.with_sky(Sky::uniform(Rgb::new(0.2, 0.1, 0.3))).unwrap(), 0.7).unwrap()
}

/// A floor under lights that fill much of its sky, one of them with a fold, so that one part of it
/// hides another; a small light with a fold, one with two parts above one another, an ordinary one,
/// one that is too dim to be sampled, and a block in between.
fn wide_lights() -> Mesh {
    let mut parts = Parts::new(&[
        (facing_up([0.0, 2.0], [0.0, 2.0], 0.0), Material::grey("floor", 0.5)),
        (facing_down([-0.2, 1.1], [-0.2, 2.2], 0.4), emitting([2.0, 3.0, 1.0])),
        (facing_up([0.3, 0.6], [0.4, 0.8], 0.15), Material::grey("block", 0.5)),
        (facing_down([0.3, 0.6], [0.4, 0.8], 0.14), Material::grey("block", 0.5)),
        (facing_down([2.2, 2.4], [0.2, 0.5], 0.8), emitting([5.0, 1.0, 2.0])),
        (facing_down([-0.9, -0.8], [1.5, 1.6], 0.5), emitting([4e-3, 3e-3, 2e-3])),
    ]);
    // Along the line from q to r two triangles share an edge, with their fronts facing each other.
    let mut folded = |q: [f64; 3], r: [f64; 3], ends: [[f64; 3]; 2], exitance| {
        parts.add(&[[r, q, ends[0]], [q, r, ends[1]]], emitting(exitance));
    };
    folded(
        [1.6, 0.1, 0.75],
        [1.6, 1.9, 0.75],
        [[1.15, 1.0, 0.3], [2.2, 1.0, 0.3]],
        [1.0, 1.5, 2.0],
    );
    folded(
        [-0.6, 0.5, 0.9],
        [-0.6, 0.8, 0.9],
        [[-0.7, 0.6, 0.75], [-0.4, 0.6, 0.75]],
        [4.0, 4.5, 6.0],
    );
    // Two that face down and share a corner: the lower one hides much of the upper one.
    let (a, b, c) = ([-0.6, 1.1, 0.9], [-0.6, 1.4, 0.9], [-0.2, 1.2, 0.9]);
    parts.add(&[[a, b, c], [a, [-0.5, 1.5, 0.75], [-0.1, 1.1, 0.75]]], emitting([3.0, 2.0, 4.0]));
    parts.mesh(Sky::uniform(Rgb::new(0.2, 0.1, 0.3)), 0.9)
}

/// A floor, and a lamp in the plane of a ceiling that continues behind it.
pub fn lamp_within_ceiling() -> Mesh {
    let x = [0.0, 1.0];
    let parts = [
        (facing_up(x, x, 0.0), Material::grey("floor", 0.5)),
        (facing_down(x, x, 0.7), Material::grey("ceiling", 0.5)),
        (facing_down([0.13, 0.61], [0.37, 0.83], 0.7), emitting([1.0, 2.0, 3.0])),
    ];
    Parts::new(&parts).mesh(Sky::default(), 0.3)
}

/// More lights than a workgroup has lanes above a floor, two of them coinciding, and a pane over
/// some of the floor.
fn many_lights() -> Mesh {
    let floor = (facing_up([0.0, 2.0], [0.0, 2.0], 0.0), Material::grey("floor", 0.5));
    let mut parts = Parts::new(&[floor]);
    for k in 0..70 {
        let (x, y) = (f64::from(k % 10) * 0.21, f64::from(k / 10) * 0.3);
        let z = 0.7 + 0.05 * f64::from(k * 7 % 9);
        let corners = [[x, y, z], [x + 0.03, y + 0.14, z], [x + 0.12, y + 0.02, z + 0.01]];
        let power = 0.3 * f64::from(1 + k * 37 % 11);
        parts.add(&[corners], emitting([power, 2.0 * power, 0.5 * power]));
    }
    let bright = [[0.6, 0.8, 0.5], [0.7, 1.2, 0.5], [0.9, 0.7, 0.52]];
    parts.add(&[bright], emitting([30.0, 20.0, 10.0]));
    parts.add(&[bright], emitting([20.0, 30.0, 15.0]));
    let pane = [[-0.2, -0.2, 0.3], [1.0, -0.2, 0.33], [0.8, 2.2, 0.36]];
    parts.add(&[pane], glass([0.9, 0.4, 0.6]));
    parts.mesh(Sky::default(), 0.8)
}

/// A room with a lamp and a table top that exists once for each side, at the same position.
pub fn room_with_doubled_leaf() -> Mesh {
    let mut parts: Vec<(Quad, Material)> =
        walls().map(|wall| (wall, Material::grey("wall", 0.5))).to_vec();
    let leaf = facing_up([0.3, 0.7], [0.25, 0.75], 0.4);
    let [a, b, c, d] = leaf;
    parts.push((leaf, Material::grey("leaf", 0.5)));
    parts.push(([d, c, b, a], Material::grey("leaf from below", 0.5)));
    parts.push((facing_down([0.4, 0.7], [0.2, 0.6], 0.99), emitting([1.0, 2.0, 3.0])));
    Parts::new(&parts).mesh(Sky::default(), 0.5)
}

/// Two bright plates with a gap between them that is narrower than their elements. Light comes in
/// on one side, from a lamp and a low sun through a pane, and from the sky all around; in the gap
/// there are two small lamps, one of which has a fold, and a translucent leaf. Quadtrees are
/// uneven.
pub fn narrow_gap() -> Mesh {
    let x = [0.0, 2.0];
    let white =
        |name: &str| Material { reflectance: Rgb::new(0.8, 0.6, 0.7), ..Material::grey(name, 0.5) };
    let leaf = |name: &str| Material {
        reflectance: Rgb::new(0.3, 0.5, 0.4),
        transmittance: Rgb::new(0.4, 0.3, 0.1),
        ..Material::grey(name, 0.5)
    };
    let sheet = facing_up([1.1, 1.7], [0.2, 0.9], 0.07);
    let [a, b, c, d] = sheet;
    let upright =
        |x: f64, [z0, z1]: [f64; 2]| [[x, 0.3, z0], [x, 0.3, z1], [x, 1.7, z1], [x, 1.7, z0]];
    let parts = [
        (facing_up(x, x, 0.0), white("floor")),
        (facing_down(x, x, 0.15), white("ceiling")),
        (sheet, leaf("leaf")),
        ([d, c, b, a], leaf("leaf from below")),
        (facing_down([0.5, 0.62], [1.0, 1.1], 0.12), emitting([3.0, 4.0, 2.0])),
        (upright(2.5, [-0.3, 0.4]), emitting([7.0, 5.0, 6.0])),
        (upright(2.2, [-0.5, 0.5]), glass([0.9, 0.7, 0.8])),
    ];
    let sun = Sun { direction: DVec3::new(1.0, 0.2, 0.06), irradiance: Rgb::new(9.0, 8.0, 7.0) };
    let sky = Sky::uniform(Rgb::new(0.4, 0.5, 0.6)).with_sun(sun).unwrap();
    let mut parts = Parts::new(&parts);
    let (q, r) = ([0.5, 0.5, 0.13], [0.5, 0.8, 0.13]);
    let folded = [[r, q, [0.42, 0.65, 0.05]], [q, r, [0.6, 0.65, 0.05]]];
    parts.add(&folded, emitting([2.0, 3.0, 4.0]));
    let mesh = parts.mesh(sky, 2.0);
    let split: Vec<usize> = (0..mesh.element_count()).filter(|e| e % 2 == 1).collect();
    let mesh = mesh.split(&split).unwrap();
    let split: Vec<usize> = (0..mesh.element_count()).filter(|e| e % 3 == 1).collect();
    mesh.split(&split).unwrap()
}

/// `count` points just above the elements of `mesh`, distributed over all of these.
pub fn gather_points(mesh: &Mesh, count: usize) -> Vec<GatherPoint> {
    let random = |k: usize| unit_interval(split_mix64_nth(k as u64));
    let point = |k: usize| {
        let node = mesh.element(k * mesh.element_count() / count);
        let [a, b, c] = mesh.corners(node);
        let (u, v) = (random(2 * k), random(2 * k + 1));
        let on = a + (b - a) * (0.05 + 0.9 * u) + (c - a) * (0.9 * v * (1.0 - u));
        let lift = 1e-4 * mesh.area(node).sqrt();
        let normal = mesh.normal(node);
        GatherPoint { position: on + lift * normal, normal, near: 0.25 * lift }
    };
    (0..count).map(point).collect()
}

/// Points on the sides of all triangles of `mesh`'s scene, `count` on each.
pub fn on_sides(mesh: &Mesh, count: usize) -> Vec<DVec3> {
    let scene = mesh.scene();
    let sides = (0..scene.triangles().len()).flat_map(|t| {
        let [a, b, c] = scene.corners(t);
        [(a, b), (b, c), (c, a)]
    });
    let share = |k: usize| (k as f64 + 0.37) / count as f64;
    sides.flat_map(|(a, b)| (0..count).map(move |k| a.lerp(b, share(k)))).collect()
}

/// Radiosity at each corner of each element of `mesh`: indices of corners, and their values.
pub fn random_radiosity(mesh: &Mesh) -> (Vec<[u32; 3]>, Vec<Rgb>) {
    let random = |k: u64| unit_interval(split_mix64_nth(k));
    let corners: Vec<[u32; 3]> =
        (0..mesh.element_count() as u32).map(|e| [3 * e, 3 * e + 1, 3 * e + 2]).collect();
    let values = (0..3 * corners.len() as u64)
        .map(|k| Rgb::new(random(3 * k), random(3 * k + 1), random(3 * k + 2)));
    let values = values.collect();
    (corners, values)
}

/// Layer `layer` of a texture, line by line.
pub fn read_texture<T: Pod>(gpu: &Gpu, texture: &wgpu::Texture, layer: u32) -> Vec<T> {
    let (width, height) = (texture.width(), texture.height());
    let line = width * size_of::<T>() as u32;
    let padded = line.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let bytes = read(gpu, u64::from(padded * height), |encoder, staging| {
        let mut source = texture.as_image_copy();
        source.origin.z = layer;
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(padded),
            rows_per_image: None,
        };
        encoder.copy_texture_to_buffer(
            source,
            wgpu::TexelCopyBufferInfo { buffer: staging, layout },
            wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        );
    });
    let lines = bytes.chunks(padded as usize);
    lines.flat_map(|l| bytemuck::pod_collect_to_vec::<u8, T>(&l[..line as usize])).collect()
}

/// All of a buffer.
pub fn read_buffer<T: Pod>(gpu: &Gpu, buffer: &wgpu::Buffer) -> Vec<T> {
    let bytes = read(gpu, buffer.size(), |encoder, staging| {
        encoder.copy_buffer_to_buffer(buffer, 0, staging, 0, buffer.size());
    });
    bytemuck::pod_collect_to_vec(&bytes)
}

fn read(
    gpu: &Gpu,
    size: u64,
    copy: impl FnOnce(&mut wgpu::CommandEncoder, &wgpu::Buffer),
) -> Vec<u8> {
    let staging = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size,
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    copy(&mut encoder, &staging);
    gpu.queue.submit([encoder.finish()]);
    staging.slice(..).map_async(wgpu::MapMode::Read, |r| r.unwrap());
    gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    staging.slice(..).get_mapped_range().unwrap().to_vec()
}

/// Two images of symbols side by side, the device's and the twin's, and where they differ; for wide
/// ones only the lines that do.
pub fn picture(width: usize, device: &[char], twin: &[char], wrong: &[bool]) -> String {
    let mut text = format!("{:w$}  {:w$}  differs\n", "device", "twin", w = width);
    for y in 0..device.len() / width {
        let line = y * width..(y + 1) * width;
        if width > 32 && !wrong[line.clone()].contains(&true) {
            continue;
        }
        let marks: String =
            wrong[line.clone()].iter().map(|w| if *w { '!' } else { '·' }).collect();
        let [a, b] = [&device[line.clone()], &twin[line]].map(|l| l.iter().collect::<String>());
        text += &format!("{a}  {b}  {marks}\n");
    }
    text
}

/// A symbol for an item: `.` for nothing, `#` for a back, then digits and letters, repeatedly.
pub fn symbol(item: u32) -> char {
    let cells = b"0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ";
    match item {
        super::layout::OPEN => '.',
        super::layout::BACK => '#',
        cell => cells[(cell - super::layout::FIRST_FRONT) as usize % 62].into(),
    }
}
