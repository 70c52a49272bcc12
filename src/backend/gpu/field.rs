//! The radiosity field on the device: quadtrees, and the radiosity at their elements' corners.
//!
//! ```text
//! quadtrees[2 t], [2 t + 1]  first node and cells along the edge of the deepest level that the
//!                    │       quadtree of triangle t is complete to
//!                    ▼
//!                INNER + k ─► quadtrees[k .. k+4], its children, and so on down to
//!                    e     ─► elements: corners a, b, c of element e in three lines of a texture
//! ```

use rayon::prelude::*;
use xxhash_rust::xxh3::xxh3_64;

use super::layout::{INNER, TEXELS_PER_LINE};
use super::limits::GpuLimits;
use super::memory::Memory;
use crate::error::{Error, ErrorKind};
use crate::gather::RadiosityField;
use crate::mesh::{Mesh, NodeId};
use crate::scene::Rgb;

/// Arrays that `shared/field.wgsl` reads.
#[derive(Debug)]
pub struct FieldBuffers {
    /// Lattices, then nodes: [`INNER`] plus the first of four children, or an element.
    pub quadtrees: wgpu::Buffer,
    /// Per element, the reflected radiosity at its three corners, per channel, in three lines, each
    /// with a channel of its reflectance; [`TEXELS_PER_LINE`] elements side by side.
    pub elements: wgpu::TextureView,
    _memory: Memory,
}

impl FieldBuffers {
    /// Uploads `field`, in units of `radiance_unit` W/m².
    pub fn new(
        memory: Memory,
        field: &RadiosityField,
        radiance_unit: f64,
    ) -> Result<FieldBuffers, Error> {
        let quadtrees = quadtrees(field.mesh);
        let texels = element_texels(field, radiance_unit);
        let lines = field.corners.len().div_ceil(TEXELS_PER_LINE as usize).max(1);
        Ok(FieldBuffers {
            quadtrees: memory.storage("quadtrees", bytemuck::cast_slice(&quadtrees))?,
            elements: memory.texels("elements", &texels, [TEXELS_PER_LINE, 3 * lines as u32])?,
            _memory: memory,
        })
    }
}

/// A hash that identifies a field of a scene: of all uploaded data.
pub fn key(field: &RadiosityField) -> u64 {
    // Items are hashed in parts, on all cores.
    let len = 1 << 16;
    let mesh = field.mesh;
    let values = field.reflected.par_chunks(len).map(|c| xxh3_64(bytemuck::cast_slice(c)));
    let corners = field.corners.par_chunks(len).map(|c| xxh3_64(bytemuck::cast_slice(c)));
    let all: Vec<usize> = (0..mesh.element_count()).collect();
    let elements = all.par_chunks(len).map(|part| {
        let nodes: Vec<u32> = part.iter().map(|&e| mesh.element(e).0).collect();
        xxh3_64(bytemuck::cast_slice(&nodes))
    });
    let parts: Vec<u64> = values.chain(corners).chain(elements).collect();
    xxh3_64(bytemuck::cast_slice(&parts))
}

/// The texture of the elements' corners, line by line.
pub fn element_texels(field: &RadiosityField, radiance_unit: f64) -> Vec<[f32; 4]> {
    let RadiosityField { mesh, corners, reflected } = *field;
    let value = |k: u32, relative: Rgb, reflectance: f64| {
        let radiosity = reflected[k as usize] * relative / radiance_unit;
        radiosity.as_vec3().extend(reflectance as f32).to_array()
    };
    let line = TEXELS_PER_LINE as usize;
    let mut texels = vec![[0f32; 4]; corners.len().div_ceil(line).max(1) * 3 * line];
    let lines = texels.par_chunks_mut(3 * line).zip(corners.par_chunks(line)).enumerate();
    lines.for_each(|(first, (texels, corners))| {
        for (x, corner) in corners.iter().enumerate() {
            let relative = mesh.relative_reflectance(first * line + x);
            let reflectance = mesh.reflectance(first * line + x).to_array();
            for k in 0..3 {
                texels[k * line + x] = value(corner[k], relative, reflectance[k]);
            }
        }
    });
    texels
}

/// Per triangle, the first node of its deepest complete level and the number of cells along its
/// edge; then all quadtrees' nodes by number, and copies of those of these levels.
pub fn quadtrees(mesh: &Mesh) -> Vec<u32> {
    let count = mesh.scene().triangles().len();
    let roots = 2 * count as u32;
    let first_child =
        |n: usize| mesh.children(NodeId(n as u32)).map_or(0, |c| INNER | (roots + c[0].0));
    let mut words = vec![0; roots as usize];
    words.par_extend((0..mesh.node_count()).into_par_iter().map(first_child));
    let mut complete = vec![u32::MAX; count];
    for e in 0..mesh.element_count() {
        let node = mesh.element(e);
        words[(roots + node.0) as usize] = e as u32;
        let level = &mut complete[mesh.triangle(node)];
        *level = mesh.cell(node).level.min(*level);
    }
    for (t, level) in complete.into_iter().enumerate() {
        let first = words.len();
        let root = mesh.root(t);
        // Most quadtrees of a scene with many triangles are a single node.
        if level == 0 {
            words.push(words[(roots + root.0) as usize]);
        } else {
            words.resize(first + (1 << (2 * level)), 0);
            let mut level_nodes = vec![root];
            for _ in 0..level {
                let children = level_nodes.into_iter().filter_map(|n| mesh.children(n));
                level_nodes = children.flatten().collect();
            }
            for node in level_nodes {
                let at = first + mesh.cell(node).index() as usize;
                words[at] = words[(roots + node.0) as usize];
            }
        }
        (words[2 * t], words[2 * t + 1]) = (first as u32, 1 << level);
    }
    words
}

/// Checks `field` against a scene of `triangles` triangles.
///
/// # Errors
/// [`ErrorKind::Setting`] for a field of another scene, with corners that do not fit its mesh, or
/// too large for the device.
pub fn check(limits: GpuLimits, field: &RadiosityField, triangles: usize) -> Result<(), Error> {
    let RadiosityField { mesh, corners, reflected } = *field;
    let setting = |found: String, remedy: String| {
        Err(Error::new(ErrorKind::Setting, "sources".to_string(), found, remedy))
    };
    let (count, elements) = (mesh.scene().triangles().len(), mesh.element_count());
    if count != triangles {
        let remedy = format!("the scene gathered in has {triangles}: give a mesh of the same");
        return setting(format!("a mesh of {count} triangles"), remedy);
    }
    if corners.len() != elements {
        let found = format!("corners of {} elements", corners.len());
        return setting(found, format!("the mesh has {elements}"));
    }
    if let Some(k) = corners.par_iter().flatten().find_any(|&&k| k as usize >= reflected.len()) {
        return setting(format!("corner value {k}"), format!("must be below {}", reflected.len()));
    }
    // There are fewer than three nodes per element: less than 4/3 in trees and one in lattices;
    // plus two words per triangle, which has at least one element.
    let max = u64::from(limits.texture / 3 * TEXELS_PER_LINE).min(limits.buffer / 20);
    if elements as u64 > max {
        return setting(format!("{elements} elements"), format!("this device holds {max}"));
    }
    Ok(())
}
