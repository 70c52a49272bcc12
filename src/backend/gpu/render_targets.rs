//! Render targets: one layer per hemicube, so that its pixels do not depend on its index in a
//! batch.
//!
//! ```text
//! texture  ┌ layer 0 ┐ ┌ layer 1 ┐ … ┌ layer batch−1 ┐
//! depth    └─ one buffer, cleared at the start of each layer's pass ─┘
//! ```

use super::memory::Memory;
use crate::error::Error;

/// Layers of one texture, and the depth buffer that they share.
#[derive(Debug)]
pub struct RenderTargets {
    pub texture: wgpu::Texture,
    layers: Vec<wgpu::TextureView>,
    depth: wgpu::TextureView,
}

impl RenderTargets {
    /// `count` layers of `width` × `height` pixels.
    pub fn new(
        memory: &Memory,
        format: wgpu::TextureFormat,
        [width, height]: [u32; 2],
        count: u32,
    ) -> Result<RenderTargets, Error> {
        let drawn = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let readable = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC;
        let image = memory.texture("layers", [width, height, count], format, drawn | readable)?;
        let format = wgpu::TextureFormat::Depth32Float;
        let depth = memory.texture("depth", [width, height, 1], format, drawn)?;
        let layer = |base_array_layer| {
            image.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2),
                base_array_layer,
                array_layer_count: Some(1),
                ..Default::default()
            })
        };
        let layers = (0..count).map(layer).collect();
        Ok(RenderTargets { texture: image, layers, depth: depth.create_view(&Default::default()) })
    }

    /// A pass over layer `k` of the first `count`, cleared to zero, with timestamps before the
    /// first (query 0) and after the last (query 1).
    pub fn pass<'e>(
        &self,
        encoder: &'e mut wgpu::CommandEncoder,
        k: usize,
        count: usize,
        queries: Option<&wgpu::QuerySet>,
    ) -> wgpu::RenderPass<'e> {
        let (first, last) = (k == 0, k + 1 == count);
        // wgpu rejects a set of timestamps without writes.
        let queries = queries.filter(|_| first || last);
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("layer"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.layers[k],
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            timestamp_writes: queries.map(|query_set| wgpu::RenderPassTimestampWrites {
                query_set,
                beginning_of_pass_write_index: first.then_some(0),
                end_of_pass_write_index: last.then_some(1),
            }),
            occlusion_query_set: None,
            multiview_mask: None,
        })
    }

    /// Records the copy of the first `count` layers into `buffer`, whose lines are
    /// `bytes_per_line` long.
    pub fn copy(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        buffer: &wgpu::Buffer,
        bytes_per_line: u32,
        count: u32,
    ) {
        let height = self.texture.height();
        encoder.copy_texture_to_buffer(
            self.texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(bytes_per_line),
                    rows_per_image: Some(height),
                },
            },
            wgpu::Extent3d { width: self.texture.width(), height, depth_or_array_layers: count },
        );
    }
}
