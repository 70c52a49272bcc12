//! The settled light on the device: quadtrees, and the radiosity at their elements' corners.

use rayon::prelude::*;

use super::device::Gpu;
use super::layout::INNER;
use crate::error::{Error, ErrorKind};
use crate::gather::Sources;
use crate::mesh::NodeId;

/// Bytes of an element's three corners, four floats each.
const ELEMENT_BYTES: u64 = 48;

/// Two arrays that `radiance.wgsl` reads.
#[derive(Debug)]
pub struct SourceBuffers {
    /// Per node, [`INNER`] plus the first of its four children, or its element.
    pub nodes: wgpu::Buffer,
    /// Per element, the reflected radiosity at its three corners, W/m² per channel, and a zero.
    pub elements: wgpu::Buffer,
}

impl SourceBuffers {
    /// Checks `sources` against a scene of so many triangles, and uploads them.
    pub fn new(gpu: &Gpu, sources: &Sources, triangles: usize) -> Result<SourceBuffers, Error> {
        check(gpu, sources, triangles)?;
        let Sources { mesh, corners, reflected } = *sources;
        let first_child = |n: usize| mesh.children(NodeId(n as u32)).map_or(0, |c| INNER | c[0].0);
        let mut nodes: Vec<u32> = (0..mesh.node_count()).map(first_child).collect();
        for e in 0..mesh.element_count() {
            nodes[mesh.element(e).0 as usize] = e as u32;
        }
        let value = |k: u32| reflected[k as usize].as_vec3().extend(0.0).to_array();
        let elements: Vec<[[f32; 4]; 3]> = corners.par_iter().map(|c| c.map(value)).collect();
        Ok(SourceBuffers {
            nodes: gpu.storage("nodes", bytemuck::cast_slice(&nodes)),
            elements: gpu.storage("elements", bytemuck::cast_slice(&elements)),
        })
    }
}

fn check(gpu: &Gpu, sources: &Sources, triangles: usize) -> Result<(), Error> {
    let Sources { mesh, corners, reflected } = *sources;
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
    let limits = gpu.device.limits();
    let buffer = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    if elements as u64 * ELEMENT_BYTES > buffer {
        let remedy = format!("this device holds {}", buffer / ELEMENT_BYTES);
        return setting(format!("{elements} elements"), remedy);
    }
    Ok(())
}
