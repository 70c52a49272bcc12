//! What the tests that compare shaders with their twins share: a scene, reading back, pictures.

use std::sync::Arc;

use bytemuck::Pod;
use glam::{DVec2, DVec3};

use super::device::Gpu;
use crate::mesh::Mesh;
use crate::scene::texture::{MaterialTextures, Texture, TextureMap};
use crate::scene::{Material, Rgb, Scene, Triangle};

/// Shifts of pixel centres, pixels: none, then the other points of a grid of ±1/128 in steps of
/// 1/256. Devices round corners of triangles to a grid of 1/256 pixel, and edge functions in 32
/// bits add less than that again: what a device draws at a pixel is what the twin draws at one of
/// these points, or between them.
pub fn offsets() -> Vec<[f64; 2]> {
    let steps = || (-2..=2).map(|k| f64::from(k) / 256.0);
    let grid = steps().flat_map(|y| steps().map(move |x| [x, y]));
    std::iter::once([0.0; 2]).chain(grid.filter(|o| *o != [0.0; 2])).collect()
}

/// The device; tests that need one are ignored where RADIOSITY_NO_GPU says that none is there.
pub fn gpu() -> Gpu {
    Gpu::new(None).expect("a graphics adapter, or RADIOSITY_NO_GPU set")
}

/// The same scene with a texture on all walls and lights.
pub fn textured_scene() -> Mesh {
    let mesh = scene();
    let plain = mesh.scene();
    let texel = |k: u8| [k.wrapping_mul(67), k.wrapping_mul(151), k.wrapping_mul(29)];
    let texture = Arc::new(Texture::new(5, 7, (0..35).map(texel).collect()).unwrap());
    let map = |factor: Rgb| TextureMap {
        texture: texture.clone(),
        factor,
        ceiling: f64::MAX,
        mean: Rgb::ONE,
        scale: DVec2::ONE,
        offset: DVec2::ZERO,
        clamped: false,
    };
    let textures = |(m, material): (u32, &Material)| {
        let exitance = Some(map(material.exitance)).filter(|_| material.exitance != Rgb::ZERO);
        (m, MaterialTextures { reflectance: Some(map(Rgb::splat(0.9))), exitance, mask: None })
    };
    let place = |t: usize| {
        let turned = DVec2::from_angle(t as f64);
        [DVec2::ZERO, DVec2::X, DVec2::Y].map(|corner| turned.rotate(corner))
    };
    let scene = Scene::with_textures(
        plain.positions().to_vec(),
        plain.triangles().to_vec(),
        plain.groups().to_vec(),
        plain.materials().to_vec(),
        (0..plain.triangles().len()).map(place).collect(),
        (0..).zip(plain.materials()).map(textures).collect(),
    );
    mesh.with_scene(scene.unwrap()).unwrap()
}

/// A floor in quadtrees of uneven depth, and around it: a ceiling, a wall that reaches below the
/// horizon and behind the eye, a triangle that shows its back, one that has a front on either
/// side, and two lights with something in front of the first.
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

/// Two images of symbols side by side, the device's and the twin's, and where they differ; of wide
/// ones the lines that do.
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

/// A symbol for an item: `.` for nothing, `#` for a back, then digits and letters, again and again.
pub fn symbol(item: u32) -> char {
    const CELLS: &[u8; 62] = b"0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ";
    match item {
        super::layout::OPEN => '.',
        super::layout::BACK => '#',
        cell => CELLS[(cell - super::layout::FIRST_CELL) as usize % 62].into(),
    }
}
