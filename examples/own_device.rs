//! Lesson 8 of 9: a wgpu device that the program has already, for its own drawing, is used for the
//! bake too. The wgpu version must be that of this crate.
//!
//!     cargo run --release --example own_device

use std::ops::ControlFlow;

use radiosity::backend::gpu::GpuLimits;
use radiosity::{Backend, BakeTarget, Gpu, load_scene};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let options = wgpu::RequestAdapterOptions::default();
    let adapter = pollster::block_on(instance.request_adapter(&options))?;
    let descriptor = wgpu::DeviceDescriptor {
        required_limits: wgpu::Limits::default(), // enough for small scenes
        ..Default::default()
    };
    let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))?;

    // Both are handles: the program keeps its own.
    let limits = GpuLimits { memory: 256 << 20, ..GpuLimits::NONE }; // leave the rest to others
    let gpu = Gpu::from_wgpu(device.clone(), queue.clone(), &limits)?;
    let scene = load_scene(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj"))?;
    let target = BakeTarget::Error(0.05);
    let baked = target.bake(scene, &Backend::Gpu(gpu), |_| ControlFlow::Continue(()))?;

    // One buffer of radiosity, ready for a vertex shader.
    let values: Vec<f32> =
        baked.light.surface.radiosity.iter().flat_map(|b| b.as_vec3().to_array()).collect();
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("radiosity"),
        size: 4 * values.len() as u64,
        usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    queue.write_buffer(&buffer, 0, bytemuck::cast_slice(&values));
    println!("{} vertices in a buffer", values.len() / 3);
    Ok(())
}
