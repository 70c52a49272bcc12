//! `radiance.wgsl` and `hemisphere_sum.wgsl` against their twins, as points really gather.

use glam::Vec4;

use super::*;
use crate::backend::cpu::hemisphere_sum::{Columns, PointImage, WORDS, add_columns, add_up};
use crate::backend::cpu::radiance;
use crate::backend::cpu::rasterizer::{Image, Viewport};
use crate::backend::cpu::sky;
use crate::backend::gpu::hemisphere_sum::weights;
use crate::backend::gpu::layout::{LANES, Summation};
use crate::backend::gpu::sky::{axes, texels};
use crate::backend::gpu::sources::{element_texels, quadtrees};
use crate::backend::gpu::test_support::{
    gpu, offsets, picture, read_buffer, read_texture, scene, shade, textured_scene,
};
use crate::sampling::hash::{split_mix64_nth, unit_interval};
use crate::scene::SkyDistribution;

/// Where view `k` of a point is drawn: a face of the hemicube, or a tile below it.
fn viewport(k: usize, n: u32) -> Viewport {
    if k < 5 {
        let lines = Face::rows(k, n);
        return Viewport { x: 0, y: lines.start, width: n, height: lines.len() as u32 };
    }
    let (tile, per_line) = (k as u32 - 5, n.max(TILE) / TILE);
    let (x, y) = (tile % per_line * TILE, 3 * n + tile / per_line * TILE);
    Viewport { x, y, width: TILE, height: TILE }
}

/// Every channel of a pixel lies between what the twin has within 1/128 pixel around its centre:
/// see [`offsets`]. Beyond that 32-bit arithmetic of some 30 steps, each off by 2⁻²⁴ of the largest
/// value in it, which is below `most`: 2⁻¹⁹ of that.
fn compare_images(width: u32, device: &[Vec4], twins: &[Vec<Vec4>], what: &str) {
    let mut unsure = 0;
    for channel in 0..4 {
        let [a, b] = [device, &twins[0]]
            .map(|image| image.iter().map(|pixel| pixel[channel]).collect::<Vec<f32>>());
        let most = b.iter().fold(0.0, |most: f32, v| most.max(v.abs()));
        let slack = most * 2f32.powi(-19);
        let range = |k: usize| {
            let values = twins.iter().map(|twin| twin[k][channel]);
            values.fold((f32::MAX, f32::MIN), |(low, high), v| (low.min(v), high.max(v)))
        };
        let wrong: Vec<bool> = (0..a.len())
            .map(|k| {
                let (low, high) = range(k);
                a[k] < low - slack || a[k] > high + slack
            })
            .collect();
        unsure += (0..a.len()).filter(|&k| range(k).1 - range(k).0 > 0.05 * most).count();
        let wrongs = wrong.iter().filter(|w| **w).count();
        let [a, b] = [a, b].map(|i| i.into_iter().map(|v| shade(v, most)).collect::<Vec<_>>());
        assert!(
            wrongs == 0,
            "{what}, channel {channel}: {wrongs} pixels\n{}",
            picture(width as usize, &a, &b, &wrong)
        );
    }
    assert!(unsure * 5 < 4 * device.len(), "{what}: {unsure} of {} values", 4 * device.len());
}

/// Sums of `terms` positive numbers in the same order, each term good to `term_error` steps of
/// 2⁻²³: devices may fuse a product with a sum, which saves a rounding, so that bits can differ by
/// as much as roundings amount to.
fn compare_columns(device: &Columns, twin: &Columns, n: u32, what: &str) {
    let mut same_bits = true;
    for word in 0..WORDS {
        // A term of the hemicube is one product. One of a tile is some 20 operations; the height
        // above the horizon loses digits by cancellation, of lights as high as these at most a few.
        let (terms, term_error) =
            if word < 8 { (3 * n * n / LANES, 1) } else { (TILE * TILE / LANES, 64) };
        for lane in 0..LANES as usize {
            let (a, b) = (device[word][lane], twin[word][lane]);
            same_bits &= a.to_bits() == b.to_bits();
            let bound = (terms + term_error + 8) as f32 * f32::EPSILON * b;
            assert!((a - b).abs() <= bound, "{what}, number {word}, lane {lane}: {a} {b}");
        }
    }
    println!("{what}: columns have the same bits: {same_bits}");
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn radiance_and_hemisphere_sum_equal_their_twins() {
    compare(&scene());
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn textured_radiance_equals_its_twin() {
    let mesh = textured_scene();
    let relative: Vec<Rgb> =
        (0..mesh.element_count()).map(|e| mesh.relative_reflectance(e)).collect();
    let low = relative.iter().fold(Rgb::INFINITY, |low, r| low.min(*r));
    let high = relative.iter().fold(Rgb::ZERO, |high, r| high.max(*r));
    assert!((high / low).min_element() > 1.5, "the texture matters: {low} {high}");
    compare(&mesh);
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn sky_and_sun_equal_their_twins() {
    let mesh = scene();
    let distribution = SkyDistribution::cie(12).unwrap();
    let (up, sun) = (DVec3::new(0.1, 0.3, 1.0), DVec3::new(0.2, 0.1, 1.0));
    let sky = crate::scene::Sky::new(distribution, Rgb::new(1.0, 2.0, 3.0), up, sun).unwrap();
    let sky = sky.with_sun(Sun { direction: sun, irradiance: Rgb::ONE }).unwrap();
    compare(&mesh.with_scene(mesh.scene().clone().with_sky(sky).unwrap()).unwrap());
}

/// What two points in `mesh` gather, pass by pass, on the device and by the twins.
fn compare(mesh: &Mesh) {
    let gpu = gpu();
    let corners: Vec<[u32; 3]> =
        (0..mesh.element_count() as u32).map(|e| [3 * e, 3 * e + 1, 3 * e + 2]).collect();
    let random = |k: u64| unit_interval(split_mix64_nth(k));
    let reflected: Vec<Rgb> = (0..3 * corners.len() as u64)
        .map(|k| Rgb::new(random(3 * k), random(3 * k + 1), random(3 * k + 2)))
        .collect();
    let sources = RadiosityField { mesh, corners: &corners, reflected: &reflected };
    let point = |x: f64, y: f64, normal: [f64; 3]| GatherPoint {
        position: DVec3::new(x, y, 0.01),
        normal: DVec3::from_array(normal).normalize(),
        near: 1e-3,
    };
    let points = [point(0.3, 0.4, [0.0, 0.0, 1.0]), point(0.9, 0.6, [0.1, 0.2, 1.0])];
    // Tiles wider than the hemicube; two tiles side by side; more than one line of threads.
    for n in [8, 40, 64] {
        let mut gather = HemicubeGather::new(&gpu, mesh, n).unwrap();
        gather.gather(&sources, &points).unwrap();
        let Batches { radiance: passes, sum, .. } = gather.batches.as_ref().unwrap();
        let drawn = gather.drawn_scene(mesh.scene());
        let (draws, of_lights) = drawn.draws();
        let triangles: Vec<_> = draws.iter().map(|&t| drawn.triangle(t)).collect();
        let positions = gather.coordinates.corners(mesh.scene(), &draws);
        let (lattices, nodes) = quadtrees(mesh);
        let twin = radiance::Radiance {
            corners: &positions,
            triangles: &triangles,
            lattices: &lattices,
            nodes: &nodes,
            elements: &element_texels(&sources, gather.radiance_unit),
        };
        let pieces = mesh.scene().sky().map().map(|map| texels(map, gather.radiance_unit));
        let sky = mesh.scene().sky().map().zip(pieces.as_deref());
        let sky = sky.map(|(map, pieces)| sky::Sky { axes: axes(map), pieces });
        let in_scene = gather.draw_list.order.len() as u32;
        let columns: Vec<f32> = read_buffer(&gpu, &sum.columns);
        let sums: Vec<f32> = read_buffer(&gpu, &sum.sums);
        for (k, p) in points.iter().enumerate() {
            let what = format!("{n} pixels, point {k}");
            let job = gather.job(mesh.scene(), p);
            assert_eq!(job.lights.len(), 2, "both lights have tiles");
            assert_eq!(job.sun.is_some(), sky.is_some());
            let twins: Vec<Vec<_>> = offsets()
                .into_iter()
                .map(|offset| {
                    let mut image = Image::new(gather.size.pixels(), Vec4::ZERO);
                    for (index, view) in job.views.iter().enumerate() {
                        let viewport = viewport(index, n);
                        let target = radiance::Target { view: &view.view, viewport, offset };
                        if index < 5 {
                            twin.draw_face(&mut image, target, in_scene);
                            sky.iter().for_each(|sky| sky.draw_face(&mut image, target));
                        } else if view.view.light == NO_LIGHT {
                            twin.draw_sun_tile(&mut image, target, in_scene);
                        } else {
                            let light = of_lights[view.view.light as usize].clone();
                            twin.draw_tile(&mut image, target, light, in_scene);
                        }
                    }
                    image.pixels
                })
                .collect();
            let texels: Vec<[f32; 4]> = read_texture(&gpu, &passes.targets.texture, k as u32);
            let pixels: Vec<Vec4> = texels.into_iter().map(Vec4::from).collect();
            let [width, _] = gather.size.pixels();
            compare_images(width, &pixels, &twins, &what);

            let weights = weights(n).unwrap();
            let image = PointImage { width, pixels: &pixels, weights: &weights, tiles: &job.tiles };
            let summation = Summation { resolution: n, tiles: gather.size.tiles };
            let own = &columns[k * WORDS * LANES as usize..][..WORDS * LANES as usize];
            let device: &Columns = bytemuck::cast_slice::<f32, Columns>(own).first().unwrap();
            compare_columns(device, &add_columns(&image, summation), n, &what);
            // Nothing but additions in the same order: the same bits.
            let device_sums = &sums[k * WORDS..(k + 1) * WORDS];
            assert_eq!(
                add_up(device).map(f32::to_bits)[..],
                *bytemuck::cast_slice::<f32, u32>(device_sums),
                "{what}"
            );
        }
    }
}
