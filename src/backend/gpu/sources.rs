//! The light to be gathered on the device: quadtrees, and the radiosity at their elements' corners.
//!
//! ```text
//! lattices[t] ─► nodes[first + cell]  the node of that cell, at the deepest level that the
//!                    │                quadtree of triangle t is complete to
//!                    ▼
//!                INNER + k ─► nodes[k .. k+4], its children, and so on down to
//!                    e     ─► elements: corners a, b, c of element e in three lines of a texture
//! ```

use rayon::prelude::*;

use super::layout::{ELEMENTS_A_LINE, INNER, Lattice};
use super::limits::GpuLimits;
use super::memory::Memory;
use crate::error::{Error, ErrorKind};
use crate::gather::RadiosityField;
use crate::mesh::{Mesh, NodeId};
use crate::scene::Rgb;

/// Arrays that `radiance.wgsl` reads.
#[derive(Debug)]
pub struct SourceBuffers {
    /// Per triangle, where in `nodes` those of its deepest complete level are.
    pub lattices: wgpu::Buffer,
    /// Per node, [`INNER`] plus the first of its four children, or its element.
    pub nodes: wgpu::Buffer,
    /// Per element, the reflected radiosity at its three corners, per channel, one below the
    /// other; [`ELEMENTS_A_LINE`] elements side by side.
    pub elements: wgpu::TextureView,
}

impl SourceBuffers {
    /// Checks `sources` against a scene of so many triangles, and uploads them, in units of
    /// `radiance_unit` W/m².
    pub fn new(
        memory: &Memory,
        sources: &RadiosityField,
        limits: GpuLimits,
        triangles: usize,
        radiance_unit: f64,
    ) -> Result<SourceBuffers, Error> {
        check(limits, sources, triangles)?;
        let RadiosityField { mesh, corners, .. } = *sources;
        let (lattices, nodes) = quadtrees(mesh);
        let texels = element_texels(sources, radiance_unit);
        let lines = corners.len().div_ceil(ELEMENTS_A_LINE as usize);
        let elements = memory.texels("elements", &texels, [ELEMENTS_A_LINE, 3 * lines as u32])?;
        Ok(SourceBuffers {
            lattices: memory.storage("lattices", bytemuck::cast_slice(&lattices))?,
            nodes: memory.storage("nodes", bytemuck::cast_slice(&nodes))?,
            elements,
        })
    }
}

/// The texture of the elements' corners, line by line.
pub fn element_texels(sources: &RadiosityField, radiance_unit: f64) -> Vec<[f32; 4]> {
    let RadiosityField { mesh, corners, reflected } = *sources;
    let value = |k: u32, relative: Rgb| {
        (reflected[k as usize] * relative / radiance_unit).as_vec3().extend(0.0).to_array()
    };
    let line = ELEMENTS_A_LINE as usize;
    let mut texels = vec![[0f32; 4]; corners.len().div_ceil(line) * 3 * line];
    let lines = texels.par_chunks_mut(3 * line).zip(corners.par_chunks(line)).enumerate();
    lines.for_each(|(first, (texels, corners))| {
        for (x, corner) in corners.iter().enumerate() {
            let relative = mesh.relative_reflectance(first * line + x);
            for k in 0..3 {
                texels[k * line + x] = value(corner[k], relative);
            }
        }
    });
    texels
}

/// All quadtrees' nodes as numbers, and once more those of each triangle's deepest complete level.
pub fn quadtrees(mesh: &Mesh) -> (Vec<Lattice>, Vec<u32>) {
    let first_child = |n: usize| mesh.children(NodeId(n as u32)).map_or(0, |c| INNER | c[0].0);
    let mut nodes: Vec<u32> = (0..mesh.node_count()).map(first_child).collect();
    let mut complete = vec![u32::MAX; mesh.scene().triangles().len()];
    for e in 0..mesh.element_count() {
        let node = mesh.element(e);
        nodes[node.0 as usize] = e as u32;
        let level = &mut complete[mesh.triangle(node)];
        *level = mesh.cell(node).level.min(*level);
    }
    let mut lattices = Vec::with_capacity(complete.len());
    for (t, level) in complete.into_iter().enumerate() {
        let first = nodes.len();
        nodes.resize(first + (1 << (2 * level)), 0);
        let mut level_nodes = vec![mesh.root(t)];
        for _ in 0..level {
            level_nodes =
                level_nodes.into_iter().filter_map(|n| mesh.children(n)).flatten().collect();
        }
        for node in level_nodes {
            nodes[first + mesh.cell(node).index() as usize] = nodes[node.0 as usize];
        }
        lattices.push(Lattice { first: first as u32, side: 1 << level });
    }
    (lattices, nodes)
}

fn check(limits: GpuLimits, sources: &RadiosityField, triangles: usize) -> Result<(), Error> {
    let RadiosityField { mesh, corners, reflected } = *sources;
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
    if let Some(k) = corners.iter().flatten().find(|&&k| k as usize >= reflected.len()) {
        return setting(format!("corner value {k}"), format!("must be below {}", reflected.len()));
    }
    // There are fewer than three nodes an element: less than 4/3 in trees and one in lattices.
    let most = u64::from(limits.texture / 3 * ELEMENTS_A_LINE).min(limits.buffer / 12);
    if elements as u64 > most {
        return setting(format!("{elements} elements"), format!("this device holds {most}"));
    }
    Ok(())
}
