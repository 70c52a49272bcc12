//! Shader modules, pipelines and bind groups, made one way for all passes.

/// What of the triangles drawn ends up in a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DepthMode {
    /// The nearest triangle, front or back.
    Nearest,
    /// Whether there is any front, hidden or not.
    AnyFront,
    /// What is at the far end, where nothing was drawn.
    Behind,
}

/// The module of a WGSL source.
pub fn shader(device: &wgpu::Device, label: &str, source: &str) -> wgpu::ShaderModule {
    device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(label),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    })
}

/// A compute pipeline of entry point `entry_point`, its layout as the shader has it.
pub fn compute(
    device: &wgpu::Device,
    module: &wgpu::ShaderModule,
    entry_point: &str,
) -> wgpu::ComputePipeline {
    device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(entry_point),
        layout: None,
        module,
        entry_point: Some(entry_point),
        compilation_options: Default::default(),
        cache: None,
    })
}

/// A pipeline that draws triangles: entry point `vertex`, then `fragment`. Depth is reversed:
/// nearer is greater.
#[derive(Clone, Debug)]
pub struct Draw<'a> {
    pub module: &'a wgpu::ShaderModule,
    /// As the shader has it, unless given.
    pub layout: Option<&'a wgpu::PipelineLayout>,
    /// Entry point of the fragment stage.
    pub fragment: &'a str,
    pub target: wgpu::ColorTargetState,
    pub depth_mode: DepthMode,
}

impl Draw<'_> {
    /// The pipeline.
    pub fn create(self, device: &wgpu::Device) -> wgpu::RenderPipeline {
        let (compare, cull_mode) = match self.depth_mode {
            DepthMode::Nearest => (wgpu::CompareFunction::Greater, None),
            DepthMode::AnyFront => (wgpu::CompareFunction::Always, Some(wgpu::Face::Back)),
            DepthMode::Behind => (wgpu::CompareFunction::GreaterEqual, None),
        };
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(self.fragment),
            layout: self.layout,
            vertex: wgpu::VertexState {
                module: self.module,
                entry_point: Some("vertex"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState { cull_mode, ..Default::default() },
            depth_stencil: Some(wgpu::DepthStencilState {
                format: wgpu::TextureFormat::Depth32Float,
                depth_write_enabled: Some(self.depth_mode == DepthMode::Nearest),
                depth_compare: Some(compare),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: self.module,
                entry_point: Some(self.fragment),
                compilation_options: Default::default(),
                targets: &[Some(self.target)],
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}

/// A bind group of `resources` at consecutive bindings from `first` on.
pub fn bind_group(
    device: &wgpu::Device,
    label: &str,
    layout: &wgpu::BindGroupLayout,
    first: u32,
    resources: &[wgpu::BindingResource],
) -> wgpu::BindGroup {
    let numbered: Vec<_> = (first..).zip(resources.iter().cloned()).collect();
    bind_group_of(device, label, layout, &numbered)
}

/// A bind group of `resources` by their bindings.
pub fn bind_group_of(
    device: &wgpu::Device,
    label: &str,
    layout: &wgpu::BindGroupLayout,
    resources: &[(u32, wgpu::BindingResource)],
) -> wgpu::BindGroup {
    let entries: Vec<_> = resources
        .iter()
        .map(|(binding, resource)| wgpu::BindGroupEntry {
            binding: *binding,
            resource: resource.clone(),
        })
        .collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some(label),
        layout,
        entries: &entries,
    })
}
