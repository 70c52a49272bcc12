//! Irradiance gathered with rays on the device: batches of points, several in flight.
//!
//! ```text
//! points ─► rank lights ─┬► rays over the hemisphere ─► near paths ─┬► settle ─┬─► samples
//!                        └► rays to lights ────────────────────────┘   ▲      │     read back
//!                                    more rays, where halves disagree ─┴──────┘
//! ```
//!
//! The sums are those of [`RayGather`], in 32 bits. Lists of the points that need more rays are
//! made on the device: the host waits for samples only. Rays to luminaires are cast on the CPU, and
//! in scenes with luminaires all rays of points that near surfaces cover: paths on the device do
//! not sample luminaires.

use std::collections::VecDeque;
use std::sync::{Arc, PoisonError};

use rayon::prelude::*;

use super::device::Gpu;
use super::field::{self, FieldBuffers};
use super::layout::{GatherSettings, Sample, TEXELS_PER_LINE, TracedPoint, WORK_HEADER_BYTES};
use super::limits::MAX_POINTS;
use super::memory::Memory;
use super::pipeline::bind_group;
use super::slots::{IN_FLIGHT, Slot, Slots};
use super::traced_scene::TracedScene;
use super::tracing::GatherPass;
use crate::backend::adapter::AdapterKind;
use crate::backend::cpu::RayGather;
use crate::backend::cpu::gather::{MOST_RAYS, RAYS_PER_SHADOW_RAY, max_rays, min_rays, samples};
use crate::error::{Error, ErrorKind};
use crate::gather::lights::Lights;
use crate::gather::{Gather, GatherPoint, IrradianceSample, RadiosityField};
use crate::mesh::Mesh;
use crate::progress::Instant;
use crate::sampling::hemisphere::HemisphereSamples;
use crate::sampling::rotation::{CellRotation, second_rotation};
use crate::scene::Rgb;

/// Gathers by casting cosine-distributed rays on a graphics device, in compute passes.
///
/// Every ray carries the same share of the hemisphere. A light's irradiance is its closed form
/// times its visible share: by rays to points on it or, where it fills much of the hemisphere, by
/// the rays over that.
#[derive(Debug)]
pub struct TracedGather {
    gpu: Gpu,
    lights: Arc<Lights>,
    scene: Arc<TracedScene>,
    rotations: CellRotation,
    /// For light of luminaires; `None` without luminaires.
    on_cpu: Option<RayGather>,
    triangles: usize,
    min_rays: u32,
    max_rays: u32,
    noise: f64,
    dim: f64,
    /// Whether paths find the light of near surfaces.
    near_field: bool,
    directions: wgpu::TextureView,
    _memory: Memory,
    rays: u64,
    seconds: f64,
}

/// A batch in flight.
struct InFlight {
    slot: usize,
    points: usize,
    submission: wgpu::SubmissionIndex,
}

/// Maximum number of rays of a point in one pass, 64 per lane: lavapipe (Mesa 22.3) leaves all
/// loops of an invocation after 65 535 iterations in total, and a ray takes some hundred.
const PASS_RAYS: u32 = 4096;

/// The same of passes that follow paths from near surfaces, by kind of device. A path of 128
/// vertices casts up to 384 rays: lavapipe's loops have room for one per lane. On hardware a ray
/// with its path takes some ten times as long as a ray, of which most end after a few vertices:
/// plain choice, within seconds even if none does.
fn path_rays(kind: AdapterKind) -> u32 {
    match kind {
        AdapterKind::Cpu => 64,
        _ => 1024,
    }
}

impl TracedGather {
    /// About `count` rays per point over the triangles of `mesh`'s scene: the nearest power of two.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when `count` is 0 or above 2²⁰, or for a scene that does not fit the
    /// device; [`ErrorKind::Memory`] when there is no memory; [`ErrorKind::Device`] when the device
    /// fails.
    pub fn new(gpu: &Gpu, mesh: &Mesh, count: u32) -> Result<TracedGather, Error> {
        TracedGather::with_noise(gpu, mesh, count, f64::INFINITY, 0.0)
    }

    /// Adaptive: doubles the number of rays, up to 16 times, until the error estimate is below
    /// `noise`·max(E, `dim`): see [`RayGather::with_noise`].
    ///
    /// [`RayGather::with_noise`]: crate::backend::cpu::RayGather::with_noise
    ///
    /// # Errors
    /// Those of [`TracedGather::new`].
    pub fn with_noise(
        gpu: &Gpu,
        mesh: &Mesh,
        count: u32,
        noise: f64,
        dim: f64,
    ) -> Result<TracedGather, Error> {
        let min_rays = min_rays(count)?;
        let max_rays = max_rays(min_rays, noise, MOST_RAYS);
        check_textures(gpu.limits().texture)?;
        let scene = mesh.scene();
        let lights = Arc::new(Lights::new(mesh.shared_scene()));
        let traced = gpu.traced_scene(&mesh.shared_scene(), &lights)?;
        let samples = samples(scene, max_rays, min_rays);
        let memory = gpu.memory();
        let directions = ordered_directions(&samples, min_rays);
        let directions = gpu.with_error_scopes(|| memory.lines("directions", &directions))?;
        Ok(TracedGather {
            gpu: gpu.clone(),
            lights,
            scene: traced,
            rotations: CellRotation::new(&scene.bounds()),
            on_cpu: match scene.luminaires().is_empty() {
                true => None,
                false => Some(RayGather::new(mesh, count)?.with_noise(noise, dim)),
            },
            triangles: scene.triangles().len(),
            min_rays,
            max_rays,
            noise,
            dim,
            near_field: false,
            directions,
            _memory: memory,
            rays: 0,
            seconds: 0.0,
        })
    }

    /// Doubles the number of rays up to `times` as many, at most 16: see
    /// [`RayGather::with_most_rays`].
    ///
    /// [`RayGather::with_most_rays`]: crate::backend::cpu::RayGather::with_most_rays
    pub fn with_most_rays(self, times: u32) -> TracedGather {
        let on_cpu = self.on_cpu.map(|gather| gather.with_most_rays(times));
        let max_rays = max_rays(self.min_rays, self.noise, times).min(self.max_rays);
        TracedGather { max_rays, on_cpu, ..self }
    }

    /// Finds the light of near surfaces by paths: see [`RayGather::with_near_field`].
    ///
    /// [`RayGather::with_near_field`]: crate::backend::cpu::RayGather::with_near_field
    pub fn with_near_field(self) -> TracedGather {
        let on_cpu = self.on_cpu.map(RayGather::with_near_field);
        TracedGather { near_field: true, on_cpu, ..self }
    }

    /// Rays cast so far, those to lights included.
    pub fn rays(&self) -> u64 {
        self.rays
    }

    /// Seconds of gathers so far, measured on the host.
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    fn traced_point(&self, point: &GatherPoint) -> TracedPoint {
        let [position, position_low] = self.scene.coordinates.parts(point.position);
        let rotation = self.rotations.at(point.position, point.near);
        let luminaires = self.luminaires(point) / self.scene.radiance_unit;
        TracedPoint {
            position,
            near: self.scene.coordinates.length(point.near),
            position_low,
            rotation: rotation as f32,
            normal: point.normal.as_vec3().to_array(),
            second_rotation: second_rotation(rotation) as f32,
            luminaires: luminaires.as_vec3().to_array(),
            padding: 0,
        }
    }

    /// Direct irradiance from luminaires, W/m².
    fn luminaires(&self, point: &GatherPoint) -> Rgb {
        self.on_cpu.as_ref().map_or(Rgb::ZERO, |gather| gather.of_luminaires(point))
    }

    fn sample(&self, sample: &Sample) -> Result<IrradianceSample, String> {
        let unit = self.scene.radiance_unit;
        let light = |c: [f32; 3]| Rgb::from_array(c.map(f64::from)) * unit;
        let sample = IrradianceSample {
            irradiance: light(sample.irradiance),
            direct: light(sample.direct),
            directional: None,
            noise: f64::from(sample.noise) * unit,
            escaped: sample.escaped.into(),
            backface: sample.back.into(),
            inverse_distance: self.scene.coordinates.inverse_length(sample.inverse_distance),
            near_paths: sample.covered != 0,
        };
        let share = |x: f64| (0.0..=1.0).contains(&x);
        let is_light = |c: Rgb| c.is_finite() && c.min_element() >= 0.0;
        let is_sound = is_light(sample.irradiance)
            && is_light(sample.direct)
            && sample.noise >= 0.0
            && share(sample.escaped)
            && share(sample.backface)
            && sample.inverse_distance >= 0.0
            && sample.inverse_distance.is_finite();
        if is_sound { Ok(sample) } else { Err(format!("{sample:?}")) }
    }

    /// Number of points of one batch: limited by the time of a dispatch, and at most `max`.
    fn batch_len(&self, max: u32) -> u32 {
        let per_ray = match (self.gpu.adapter().kind, self.rays) {
            (AdapterKind::Cpu, 0) => 1e-6,
            (_, 0) => 2e-8,
            (_, rays) => self.seconds / rays as f64,
        };
        let seconds = per_ray * f64::from(self.min_rays.min(PASS_RAYS));
        // A dispatch takes 20 ms: drivers abort those of seconds, and a desktop freezes meanwhile.
        ((0.02 / seconds) as u32).max(64).min(max)
    }

    /// The samples of `points`, in batches of at most `max_len`, and whether paths found the light
    /// of surfaces near them.
    fn gather_all(
        &mut self,
        field: &FieldBuffers,
        points: &[TracedPoint],
        max_len: u32,
    ) -> Result<Vec<IrradianceSample>, Error> {
        let gpu = self.gpu.clone();
        let mut kept = gpu.tracing.slots.lock().unwrap_or_else(PoisonError::into_inner);
        let len = (self.batch_len(max_len) as usize).min(points.len());
        // For all rays of the first pass, or of the last doubling.
        let rays = self.min_rays.max(self.max_rays / 2);
        let passes = [PASS_RAYS, self.path_rays()].map(|of_pass| rays.div_ceil(of_pass));
        let has_passes = |slots: &Slots| (0..2).all(|k| slots.passes[k] >= passes[k]);
        let has_room = |slots: &Slots| slots.points as usize >= len && has_passes(slots);
        // Taken out, so that a failing batch leaves no unfinished slots.
        let slots = match kept.take().filter(has_room) {
            Some(slots) => slots,
            None => Slots::new(gpu.memory(), (len as u32).next_power_of_two(), passes)?,
        };
        let mut out = Vec::with_capacity(points.len());
        let mut waiting: VecDeque<InFlight> = VecDeque::new();
        let bound: Vec<Bound> = slots.slots.iter().map(|slot| self.bind(slot, field)).collect();
        for (number, batch) in points.chunks(len.max(1)).enumerate() {
            if waiting.len() == IN_FLIGHT
                && let Some(oldest) = waiting.pop_front()
            {
                self.read(&slots, &oldest, &mut out)?;
            }
            let slot = number % IN_FLIGHT;
            let submission = self.submit(&slots, slot, &bound[slot], batch);
            waiting.push_back(InFlight { slot, points: batch.len(), submission });
        }
        for batch in waiting {
            self.read(&slots, &batch, &mut out)?;
        }
        *kept = Some(slots);
        Ok(out)
    }

    /// Submits a batch.
    fn submit(
        &self,
        slots: &Slots,
        slot: usize,
        bound: &Bound,
        points: &[TracedPoint],
    ) -> wgpu::SubmissionIndex {
        let gpu = &self.gpu;
        let no_work = &slots.no_work;
        let slot = &slots.slots[slot];
        let count = points.len() as u32;
        gpu.queue.write_buffer(&slot.points, 0, bytemuck::cast_slice(points));
        gpu.queue.write_buffer(&slot.work, 0, bytemuck::cast_slice(&all_work(count)));
        self.write_settings(slot, count);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            bound.set(&mut pass, GatherPass::RankLights, 0);
            pass.dispatch_workgroups(count, 1, 1);
        }
        let doublings = (self.max_rays / self.min_rays).ilog2();
        for round in 0..=if self.has_lights() { 2 * doublings } else { doublings } {
            // The second half has the same number of rays as all before it: at most this.
            let rays = self.min_rays << round.min(doublings).saturating_sub(1);
            let mut pass = encoder.begin_compute_pass(&Default::default());
            for (of_gather, number) in self.ray_passes(rays) {
                bound.set(&mut pass, of_gather, number);
                pass.dispatch_workgroups_indirect(&slot.work, of_gather.list_offset());
            }
            drop(pass);
            encoder.copy_buffer_to_buffer(no_work, 0, &slot.work, 0, WORK_HEADER_BYTES);
            let mut pass = encoder.begin_compute_pass(&Default::default());
            bound.set(&mut pass, GatherPass::Settle, 0);
            pass.dispatch_workgroups(count.div_ceil(64), 1, 1);
        }
        let bytes = size_of::<Sample>() as u64 * u64::from(count);
        encoder.copy_buffer_to_buffer(&slot.samples, 0, &slot.staging, 0, bytes);
        gpu.queue.submit([encoder.finish()])
    }

    /// Writes the settings of all passes over `points` points.
    fn write_settings(&self, slot: &Slot, points: u32) {
        let of_paths = (self.path_rays(), &slot.path_settings);
        for (pass_rays, buffers) in [(PASS_RAYS, &slot.settings), of_paths] {
            for (pass, buffer) in (0..).zip(buffers) {
                let settings = GatherSettings {
                    min_rays: self.min_rays,
                    max_rays: self.max_rays,
                    noise: self.noise as f32,
                    dim: (self.dim / self.scene.radiance_unit) as f32,
                    points,
                    first: pass * pass_rays,
                    pass_rays,
                    near_field: self.near_field.into(),
                };
                self.gpu.queue.write_buffer(buffer, 0, bytemuck::bytes_of(&settings));
            }
        }
    }

    /// The passes that cast at most `rays` rays over the hemisphere from each point, and those to
    /// lights: each kind with the numbers of its passes, in order.
    fn ray_passes(&self, rays: u32) -> impl Iterator<Item = (GatherPass, usize)> {
        let shadow_rays = (rays / RAYS_PER_SHADOW_RAY).max(2);
        let numbers = [
            rays.div_ceil(PASS_RAYS),
            if self.near_field { rays.div_ceil(self.path_rays()) } else { 0 },
            if self.has_lights() { shadow_rays.div_ceil(PASS_RAYS) } else { 0 },
        ];
        let passes = GatherPass::RAYS.into_iter().zip(numbers);
        passes.flat_map(|(pass, count)| (0..count as usize).map(move |number| (pass, number)))
    }

    /// Number of rays of a point in one pass that follows paths.
    fn path_rays(&self) -> u32 {
        path_rays(self.gpu.adapter().kind)
    }

    fn has_lights(&self) -> bool {
        !self.lights.lights.is_empty() || self.lights.scene().sky().sun().is_some()
    }

    /// Waits for a batch and reads its samples.
    fn read(
        &mut self,
        slots: &Slots,
        batch: &InFlight,
        out: &mut Vec<IrradianceSample>,
    ) -> Result<(), Error> {
        let staging = &slots.slots[batch.slot].staging;
        let slice = staging.slice(..(size_of::<Sample>() * batch.points) as u64);
        let mut rays = 0;
        let samples = self.gpu.read_mapped(slice, batch.submission.clone(), |bytes| {
            let samples: &[Sample] = bytemuck::cast_slice(bytes);
            rays = samples.iter().map(|s| u64::from(s.rays + s.shadow_rays)).sum();
            samples.par_iter().map(|s| self.sample(s)).collect::<Result<Vec<_>, String>>()
        })?;
        staging.unmap();
        self.rays += rays;
        out.extend(samples.map_err(|found| self.gpu.invalid_result(found))?);
        Ok(())
    }

    /// All passes over one slot, with their bindings.
    fn bind(&self, slot: &Slot, field: &FieldBuffers) -> Bound {
        let pipelines = self.gpu.tracing.gather_pipelines(&self.gpu.device).iter();
        let passes = GatherPass::ALL.into_iter().zip(pipelines);
        Bound(passes.map(|((pass, _), p)| self.bind_pass(pass, p.clone(), slot, field)).collect())
    }

    fn bind_pass(
        &self,
        pass: GatherPass,
        pipeline: wgpu::ComputePipeline,
        slot: &Slot,
        field: &FieldBuffers,
    ) -> BoundPass {
        let group = |number: u32, entries: &[(u32, wgpu::BindingResource)]| {
            let layout = pipeline.get_bind_group_layout(number);
            bind_group(&self.gpu.device, "gather", &layout, entries)
        };
        let mut groups = vec![(0, group(0, &self.scene_bindings(pass)))];
        if pass.reads_field() {
            let elements = wgpu::BindingResource::TextureView(&field.elements);
            let field = [(0, field.quadtrees.as_entire_binding()), (1, elements)];
            groups.push((2, group(2, &field)));
        }
        let settings = match pass {
            GatherPass::NearPaths => &slot.path_settings,
            _ => &slot.settings,
        };
        let batch = self.batch_bindings(pass, slot);
        let batches = settings
            .iter()
            .map(|settings| group(1, &[&batch[..], &[(3, settings.as_entire_binding())]].concat()))
            .collect();
        BoundPass { pipeline, groups, batches }
    }

    /// Bindings of group 0.
    fn scene_bindings(&self, pass: GatherPass) -> Vec<(u32, wgpu::BindingResource<'_>)> {
        use GatherPass::*;
        let scene = &self.scene;
        let geometry = scene.geometry();
        let lights = [(5, scene.lights.as_entire_binding()), (6, scene.lamps.as_entire_binding())];
        match pass {
            RankLights => [&geometry[1..], &lights].concat(),
            LightRays => [&geometry[..], &lights].concat(),
            Settle => [&geometry[2..3], &lights[..1]].concat(),
            HemisphereRays | NearPaths => {
                let sky = [(7, wgpu::BindingResource::TextureView(&scene.sky))];
                [&geometry[..], &lights, &sky].concat()
            }
        }
    }

    /// Bindings of group 1 without the settings.
    fn batch_bindings<'a>(
        &'a self,
        pass: GatherPass,
        slot: &'a Slot,
    ) -> Vec<(u32, wgpu::BindingResource<'a>)> {
        let mut bindings =
            vec![(0, slot.points.as_entire_binding()), (1, slot.states.as_entire_binding())];
        if pass.reads_field() {
            bindings.push((2, wgpu::BindingResource::TextureView(&self.directions)));
        }
        if pass == GatherPass::Settle {
            bindings.push((2, slot.samples.as_entire_binding()));
        }
        if pass != GatherPass::RankLights {
            bindings.push((4, slot.work.as_entire_binding()));
        }
        bindings
    }
}

/// All passes over one slot, in the order of [`GatherPass::ALL`].
struct Bound(Vec<BoundPass>);

struct BoundPass {
    pipeline: wgpu::ComputePipeline,
    groups: Vec<(u32, wgpu::BindGroup)>,
    /// Group 1, one per preceding pass that cast rays of the same half.
    batches: Vec<wgpu::BindGroup>,
}

impl Bound {
    /// Prepares `pass` for a dispatch of a gather's pass, the given `number` of its kind.
    fn set(&self, pass: &mut wgpu::ComputePass, of_gather: GatherPass, number: usize) {
        let BoundPass { pipeline, groups, batches } = &self.0[of_gather as usize];
        pass.set_pipeline(pipeline);
        for (group, bindings) in groups {
            pass.set_bind_group(*group, bindings, &[]);
        }
        pass.set_bind_group(1, &batches[number], &[]);
    }
}

/// `Work` with all of `count` points in both lists.
fn all_work(count: u32) -> Vec<u32> {
    [count, 1, 1, count, 1, 1, 0, 0].into_iter().chain(0..count).chain(0..count).collect()
}

/// Checks that a device supports the width of textures that are read as arrays.
pub fn check_textures(texture: u32) -> Result<(), Error> {
    if texture >= TEXELS_PER_LINE {
        return Ok(());
    }
    let found = format!("textures of {texture} pixels along an edge");
    let remedy = format!("rays on the device take {TEXELS_PER_LINE}");
    Err(Error::new(ErrorKind::Setting, "graphics device", found, remedy))
}

/// The directions of `samples`, ray by ray, as texels: along two tangents and the normal.
pub fn local_directions(samples: &HemisphereSamples) -> Vec<[f32; 4]> {
    samples.local().iter().map(|&[x, y, z]| [x as f32, y as f32, z as f32, 0.0]).collect()
}

/// The same, ordered. Those that are cast together (the first half of
/// `min_rays`, the second, then each doubling) are in the order of a Z-curve over azimuth and
/// elevation, so that neighbouring lanes have similar hits.
fn ordered_directions(samples: &HemisphereSamples, min_rays: u32) -> Vec<[f32; 4]> {
    let mut directions = local_directions(samples);
    let mut start = 0;
    let mut end = (min_rays / 2).max(1) as usize;
    while start < directions.len() {
        let stop = end.min(directions.len());
        directions[start..stop].sort_by_key(|&[x, y, _, _]| {
            let spread = |v: f32| ((v + 1.0) * 32_767.5) as u32;
            interleaved(spread(x)) | interleaved(spread(y)) << 1
        });
        (start, end) = (stop, 2 * stop);
    }
    directions
}

/// 16 bits, each preceded by a zero bit.
fn interleaved(bits: u32) -> u32 {
    let mut x = bits & 0xffff;
    for (shift, mask) in [(8, 0x00ff_00ff), (4, 0x0f0f_0f0f), (2, 0x3333_3333), (1, 0x5555_5555)] {
        x = (x | x << shift) & mask;
    }
    x
}

impl Gather for TracedGather {
    fn gather(
        &mut self,
        field: &RadiosityField,
        points: &[GatherPoint],
    ) -> Result<Vec<IrradianceSample>, Error> {
        let start = Instant::now();
        field::check(self.gpu.limits(), field, self.triangles)?;
        let traced: Vec<TracedPoint> = points.par_iter().map(|p| self.traced_point(p)).collect();
        let gpu = self.gpu.clone();
        let mut max_len = MAX_POINTS.min((points.len() as u32).next_power_of_two());
        let samples = loop {
            let samples = gpu.with_error_scopes(|| {
                let field = gpu.tracing.field(&self.scene, field, || gpu.memory())?;
                self.gather_all(&field, &traced, max_len)
            });
            match samples {
                // Smaller batches leave memory for the field.
                Err(e) if e.kind() == ErrorKind::Memory && max_len > 1 => {
                    max_len /= 2;
                    *gpu.tracing.slots.lock().unwrap_or_else(PoisonError::into_inner) = None;
                    gpu.free_unused()?;
                }
                samples => break samples,
            }
        };
        self.seconds += start.elapsed().as_secs_f64();
        let mut samples = samples?;
        let covered: Vec<usize> = (0..samples.len()).filter(|&k| samples[k].near_paths).collect();
        if let Some(on_cpu) = &mut self.on_cpu {
            let points: Vec<GatherPoint> = covered.iter().map(|&k| points[k]).collect();
            for (k, sample) in covered.into_iter().zip(on_cpu.gather(field, &points)?) {
                samples[k] = sample;
            }
        }
        Ok(samples)
    }

    fn preferred_batch_len(&self) -> usize {
        IN_FLIGHT * self.batch_len(MAX_POINTS) as usize
    }
}

#[cfg(test)]
mod twin_tests;
