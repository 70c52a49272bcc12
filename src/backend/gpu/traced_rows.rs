//! Form-factor rows from rays on the device: batches of patches, whose hits are counted and
//! compacted there.
//!
//! ```text
//! patches ─► a ray per lane ─► counts, dense: patch × slot ─► entries, row by row ─► readback
//!                                                   ▲  zeros  │
//!                                                   └─────────┘
//! ```

use std::sync::Arc;

use rayon::prelude::*;

use super::compacted_rows::{CompactedRows, by_row};
use super::device::Gpu;
use super::field::quadtrees;
use super::layout::{BACK, FIRST_FRONT, OPEN, RowEntry, RowSettings, TracedPatch};
use super::memory::Memory;
use super::pipeline::bind_group;
use super::traced_gather::{check_textures, local_directions};
use super::traced_scene::TracedScene;
use crate::backend::cpu::rows::{self as cpu, rays_for_importance, rotation, row_of_counts};
use crate::error::{Error, ErrorKind};
use crate::form_factor::{FormFactors, Row};
use crate::gather::lights::Lights;
use crate::mesh::{Mesh, NodeId};
use crate::sampling::hemisphere::HemisphereSamples;
use crate::scene::Rgb;
use crate::visibility::offset;

/// Makes form-factor rows by casting cosine-distributed rays from a patch's centroid on a graphics
/// device: the rows of [`RayRows`](crate::backend::cpu::RayRows), except for rays that rounding
/// deflects.
///
/// Every ray carries the same share of the light, so a form factor is a count: for n rays the
/// standard error of an entry F is at most √(F(1−F)/n).
#[derive(Debug)]
pub struct TracedRows {
    gpu: Gpu,
    scene: Arc<TracedScene>,
    count: u32,
    /// Directions by number of rays: all, and the smaller numbers requested so far.
    directions: Vec<(u32, wgpu::TextureView)>,
    buffers: Buffers,
    has_panes: bool,
    slots: u32,
    pub(crate) full_share: f64,
}

#[derive(Debug)]
struct Buffers {
    quadtrees: wgpu::Buffer,
    patches: wgpu::Buffer,
    counts: wgpu::Buffer,
    compacted: CompactedRows,
    /// Maximum number of patches of a batch.
    patches_at_once: u32,
    memory: Memory,
}

impl TracedRows {
    /// `count` rays per row over the triangles of `mesh`, and fewer for patches that shoot little.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when `count` is 0 or above 2²⁰, [`ErrorKind::Memory`] when a row does
    /// not fit the device or there is no memory, [`ErrorKind::Device`] when the device fails.
    pub fn new(gpu: &Gpu, mesh: &Mesh, count: u32) -> Result<TracedRows, Error> {
        let samples = HemisphereSamples::new(count)?;
        check_textures(gpu.limits().texture)?;
        let lights = Lights::new(mesh.shared_scene());
        let scene = gpu.traced_scene(&mesh.shared_scene(), &lights)?;
        let has_panes = mesh.scene().clear_panes().is_some();
        let slots = mesh.element_count() as u32 + FIRST_FRONT;
        let row_bytes = u64::from(slots) * if has_panes { 16 } else { 4 };
        // Any WebGPU device binds 128 MiB.
        let max_bytes = gpu.limits().buffer.min(128 << 20);
        if row_bytes > max_bytes {
            let found = format!("rows of {row_bytes} bytes");
            let remedy = format!("this device has room for {max_bytes}");
            return Err(Error::new(ErrorKind::Memory, "mesh".to_string(), found, remedy));
        }
        let patches_at_once = (max_bytes / row_bytes).min(CompactedRows::MAX_BATCH.into()) as u32;
        let buffers = gpu.with_error_scopes(|| {
            Buffers::new(gpu, mesh, row_bytes, count.min(slots), patches_at_once)
        })?;
        let mut rows = TracedRows {
            gpu: gpu.clone(),
            scene,
            count,
            directions: vec![],
            buffers,
            has_panes,
            slots,
            full_share: crate::backend::cpu::RayRows::FULL_SHARE,
        };
        rows.add_directions(&samples, count)?;
        Ok(rows)
    }

    /// All rays for patches that shoot at least this share of the emitted flux, in [0, 1]: see
    /// [`RayRows::with_full_share`](crate::backend::cpu::RayRows::with_full_share).
    pub fn with_full_share(self, full_share: f64) -> TracedRows {
        TracedRows { full_share, ..self }
    }

    fn add_directions(&mut self, samples: &HemisphereSamples, count: u32) -> Result<usize, Error> {
        let (directions, memory) = (local_directions(samples), &self.buffers.memory);
        let view = self.gpu.with_error_scopes(|| memory.lines("directions", &directions))?;
        self.directions.push((count, view));
        Ok(self.directions.len() - 1)
    }

    fn traced_patch(&self, mesh: &Mesh, patch: NodeId) -> TracedPatch {
        let [position, position_low] = self.scene.coordinates.parts(mesh.viewpoint(patch));
        let near = offset::RAY_START * mesh.area(patch).sqrt();
        TracedPatch {
            position,
            near: self.scene.coordinates.length(near),
            position_low,
            own_triangle: mesh.triangle(patch) as u32,
            normal: mesh.normal(patch).as_vec3().to_array(),
            rotation: rotation(patch) as f32,
        }
    }

    /// The rows of a batch by `rays` rays each in the directions of number `at`; `None` where there
    /// is no room for their entries.
    fn batch(
        &mut self,
        mesh: &Mesh,
        patches: &[NodeId],
        rays: u32,
        at: usize,
    ) -> Result<Option<Vec<Row>>, Error> {
        let traced: Vec<TracedPatch> =
            patches.par_iter().map(|&p| self.traced_patch(mesh, p)).collect();
        let settings = RowSettings {
            rays,
            slots: self.slots,
            unit: passed_unit(rays) as f32,
            entries: self.buffers.compacted.entries,
        };
        let gpu = self.gpu.clone();
        let (has_panes, count) = (self.has_panes, patches.len());
        let rows = gpu.with_error_scopes(|| {
            self.entries(&traced, settings, at, |entries| rows_of(entries, count, rays, has_panes))
        })?;
        rows.transpose().map_err(|found| gpu.invalid_result(found))
    }

    /// The result of `read` for the entries of all rows, row by row in any order, slots ascending;
    /// `None` if they exceed the capacity.
    fn entries<T>(
        &mut self,
        patches: &[TracedPatch],
        settings: RowSettings,
        at: usize,
        read: impl Fn(&[RowEntry]) -> T,
    ) -> Result<Option<T>, Error> {
        let Buffers { quadtrees, patches: patch_buffer, counts, compacted, .. } = &mut self.buffers;
        let gpu = &self.gpu;
        gpu.queue.write_buffer(patch_buffer, 0, bytemuck::cast_slice(patches));
        let pipeline = &gpu.tracing.row_pipelines(&gpu.device).row_rays;
        let group = |group: u32, entries: &[(u32, wgpu::BindingResource)]| {
            let layout = pipeline.get_bind_group_layout(group);
            bind_group(&gpu.device, "rows", &layout, entries)
        };
        let lights = [(5, self.scene.lights.as_entire_binding())];
        let geometry = [&self.scene.geometry()[..], &lights].concat();
        let batch = [
            (0, patch_buffer.as_entire_binding()),
            (1, counts.as_entire_binding()),
            (2, wgpu::BindingResource::TextureView(&self.directions[at].1)),
            (3, compacted.settings.as_entire_binding()),
        ];
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &group(0, &geometry), &[]);
            pass.set_bind_group(1, &group(1, &batch), &[]);
            pass.set_bind_group(2, &group(2, &[(0, quadtrees.as_entire_binding())]), &[]);
            pass.dispatch_workgroups(settings.rays.div_ceil(64), patches.len() as u32, 1);
        }
        compacted.compact(gpu, &mut encoder, counts, patches.len() as u32, self.has_panes);
        let max_entries = u64::from(settings.rays.min(settings.slots)) * patches.len() as u64;
        let submitted = compacted.submit(gpu, encoder, settings, max_entries);
        compacted.read(gpu, &submitted, read)
    }
}

/// The rows of `patches` patches by the entries of all, `rays` rays each; or the first wrong row.
fn rows_of(
    entries: &[RowEntry],
    patches: usize,
    rays: u32,
    has_panes: bool,
) -> Result<Vec<Row>, String> {
    let row = |row: &&[RowEntry]| {
        let counted: u64 = row.iter().map(|e| u64::from(e.count)).sum();
        match counted == u64::from(rays) && row.is_sorted_by_key(|e| e.slot) {
            true => Ok(row_of(row, rays, has_panes)),
            false => Err(format!("a row of {counted} rays, not {rays}")),
        }
    };
    by_row(entries, patches)?.par_iter().map(row).collect()
}

/// The row by its entries, slots ascending.
fn row_of(entries: &[RowEntry], rays: u32, has_panes: bool) -> Row {
    // OPEN and BACK are the first slots, and as items the last and the one before it.
    let lost = entries.partition_point(|e| e.slot < FIRST_FRONT);
    let items = entries[lost..].iter().chain(entries[..lost].iter().rev());
    let row = row_of_counts(items.map(|e| (item(e.slot), e.count)), rays as usize);
    let unit = passed_unit(rays);
    let mean = |e: &RowEntry| {
        let sum = Rgb::from_array(e.passed.map(f64::from));
        (sum / (unit * f64::from(e.count))).min(Rgb::ONE)
    };
    // An unattenuated ray adds the whole unit.
    let is_clear = |e: &RowEntry| e.passed == [e.count * unit as u32; 3];
    if !has_panes || entries.iter().all(is_clear) {
        return row;
    }
    let of = |item_of: u32| {
        let entry = entries.iter().find(|e| item(e.slot) == item_of);
        Row::passed(entry.map_or(Rgb::ONE, mean))
    };
    let elements = entries.iter().filter(|e| e.slot >= FIRST_FRONT);
    let passed = elements.map(|e| Row::passed(mean(e)));
    let passed = passed.chain([of(cpu::OPEN), of(cpu::BACK)]).collect();
    Row { passed, ..row }
}

/// The value of a ray in sums of transmittances: the sum over all rays fits in 32 bits.
fn passed_unit(rays: u32) -> f64 {
    f64::from((u32::MAX / rays).min(1 << 16))
}

/// The item in `row_of_counts` of a slot.
fn item(slot: u32) -> u32 {
    match slot {
        OPEN => cpu::OPEN,
        BACK => cpu::BACK,
        element => element - FIRST_FRONT,
    }
}

impl Buffers {
    fn new(
        gpu: &Gpu,
        mesh: &Mesh,
        row_bytes: u64,
        row_entries: u32,
        patches_at_once: u32,
    ) -> Result<Buffers, Error> {
        use wgpu::BufferUsages as Usage;
        let memory = gpu.memory();
        let patches = u64::from(patches_at_once);
        let storage = Usage::STORAGE | Usage::COPY_DST;
        Ok(Buffers {
            quadtrees: memory.storage("quadtrees", bytemuck::cast_slice(&quadtrees(mesh)))?,
            patches: memory.buffer(
                "patches",
                patches * size_of::<TracedPatch>() as u64,
                storage,
            )?,
            // Zero initially and after each batch.
            counts: memory.buffer("counts", patches * row_bytes, storage)?,
            compacted: CompactedRows::new(
                &memory,
                gpu.limits().buffer,
                patches_at_once,
                row_entries,
            )?,
            patches_at_once,
            memory,
        })
    }
}

impl FormFactors for TracedRows {
    fn rows(&mut self, mesh: &Mesh, patches: &[NodeId], weight: f64) -> Result<Vec<Row>, Error> {
        let rays = rays_for_importance(self.count, weight, self.full_share);
        let at = match self.directions.iter().position(|&(count, _)| count == rays) {
            Some(at) => at,
            None => self.add_directions(&HemisphereSamples::new(rays)?, rays)?,
        };
        let (gpu, batch_len) = (self.gpu.clone(), self.buffers.patches_at_once);
        let make = |batch: &[_]| self.batch(mesh, batch, rays, at);
        CompactedRows::in_batches(&gpu, patches, batch_len, make)
    }

    fn preferred_batch_len(&self) -> usize {
        CompactedRows::MAX_BATCH as usize
    }

    fn fingerprint(&self) -> String {
        format!("{} rays on the device, all from {}", self.count, self.full_share)
    }
}

#[cfg(test)]
mod twin_tests;
