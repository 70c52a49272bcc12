//! Form-factor rows from hemicubes: batches drawn, reduced, compacted and read back.
//!
//! ```text
//! patches ─► views (frame, rotated by a hash of patch id; 5 faces) ─► item buffer ─► reduce
//!                                                                                      │
//! rows ◄─ sum checked ◄─ readback of entries ◄─ compact ◄──────────────────────────────┘
//! ```
//!
//! A batch holds as many hemicubes as 32 MiB of item buffers, [`CompactedRows::MAX_BATCH`] and the
//! limits of the device allow, and a half or a quarter of them where memory is short.

use std::f64::consts::FRAC_PI_2;

use rayon::prelude::*;

use super::clock::Clock;
use super::compacted_rows::{CompactedRows, by_row};
use super::device::Gpu;
use super::draw_list::DrawList;
use super::error::check_hemicubes_see;
use super::item_buffer::{ItemBuffer, View};
use super::item_table::ItemTable;
use super::layout::{BACK, Corner, FIRST_FRONT, FaceView, OPEN, RowEntry, RowSettings};
use super::limits::GpuLimits;
use super::memory::Memory;
use super::reduce::{BatchSize, Reduce};
use super::resolution::Resolution;
use super::split_float::SplitFloat;
use crate::backend::AdapterKind;
use crate::error::{Error, ErrorKind};
use crate::form_factor::{Entry, FormFactors, Row, resolution_policy};
use crate::hemicube::{self, Face, Frame, RESOLUTIONS};
use crate::mesh::{Mesh, NodeId};
use crate::progress::{Instant, Timings};
use crate::sampling::hash::{split_mix64_nth, unit_interval};
use crate::visibility::offset;

/// Makes form-factor rows with hemicubes (Cohen and Greenberg 1985) on a graphics device.
///
/// The scene's own triangles are drawn over the five faces of a hemicube at a patch's centroid; the
/// element of a pixel is computed from the barycentric position on its visible triangle. A row is
/// the sum of exact pixel weights: its error is that of pixels that straddle a border between
/// elements, and of the single viewpoint.
///
/// Rows for patches that shoot little are made at a half or a quarter of the resolution: see
/// [`HemicubeRows::with_full_share`].
#[derive(Debug)]
pub struct HemicubeRows {
    gpu: Gpu,
    draw_list: DrawList,
    batches: Batches,
    coordinates: SplitFloat,
    slots: u32,
    /// Preferred number of rows per request, independent of the available memory, since it
    /// determines the order of shots.
    preferred_batch: u32,
    pub(crate) full_share: f64,
    timings: Timings,
}

/// Pipelines and buffers to draw hemicubes, a batch at a time.
#[derive(Debug)]
struct Batches {
    item_buffer: ItemBuffer,
    reduce: Reduce,
    /// The full resolution, then its halvings.
    resolutions: Vec<Resolution>,
    compacted: CompactedRows,
    clock: Option<Clock>,
    /// Maximum number of hemicubes in a batch.
    max_hemicubes: u32,
    _memory: Memory,
}

impl HemicubeRows {
    /// Default share of the emitted flux from which a patch gets the full resolution. With 128
    /// pixels the error of a whole bake increases by 1 %, at most by 3 %, over full resolution for
    /// all, and the time of rows falls by a third (measured in three scenes).
    pub const FULL_SHARE: f64 = 4e-3;

    /// Hemicubes with a top face of `resolution` × `resolution` pixels over `mesh`, and fewer
    /// pixels for patches that shoot little.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] for an unusable resolution ([`hemicube::check_resolution`]) or a mesh
    /// whose rows do not fit the device; [`ErrorKind::Memory`] when there is no memory for a single
    /// hemicube; [`ErrorKind::Device`] when the device fails.
    pub fn new(gpu: &Gpu, mesh: &Mesh, resolution: u32) -> Result<HemicubeRows, Error> {
        hemicube::check_resolution(resolution)?;
        check_hemicubes_see(mesh.scene())?;
        let limits = gpu.limits();
        check_resolution_fits(limits, resolution)?;
        check_mesh_fits(limits, mesh)?;
        let slots = slots(mesh);
        let preferred_batch = preferred_batch(gpu, resolution, slots);
        let coordinates = SplitFloat::new(mesh.scene());
        let (table, draw_list) = (ItemTable::new(mesh), DrawList::new(mesh.scene()));
        let order = &draw_list.order;
        let corners = coordinates.corners(mesh.scene(), order);
        let triangles: Vec<_> = order.iter().map(|&t| table.triangles[t as usize]).collect();
        let batches = gpu.retry_with_smaller_batches(preferred_batch, |memory, hemicubes| {
            let item_buffer = ItemBuffer::new(&memory, &corners, &triangles, hemicubes)?;
            let size = BatchSize { resolution, slots, hemicubes };
            let reduce = Reduce::new(&memory, &table.slots, size)?;
            let resolutions = Resolution::halved(&memory, &reduce, resolution, hemicubes)?;
            let row_entries = max_row_entries(slots, resolution);
            let compacted = CompactedRows::new(&memory, limits.buffer, hemicubes, row_entries)?;
            let clock = Clock::new(&memory)?;
            Ok(Batches {
                item_buffer,
                reduce,
                resolutions,
                compacted,
                clock,
                max_hemicubes: hemicubes,
                _memory: memory,
            })
        })?;
        Ok(HemicubeRows {
            gpu: gpu.clone(),
            draw_list,
            batches,
            coordinates,
            slots,
            preferred_batch,
            full_share: HemicubeRows::FULL_SHARE,
            timings: Timings::default(),
        })
    }

    /// Full resolution for patches that shoot at least this share of the emitted flux, in [0, 1];
    /// for others it is halved once or twice, but to no less than 16 pixels along an edge, by their
    /// share: resolution ∝ share^0.4 minimizes the error for the time. [`HemicubeRows::FULL_SHARE`]
    /// by default; with 0 all rows are at full resolution.
    pub fn with_full_share(self, full_share: f64) -> HemicubeRows {
        HemicubeRows { full_share, ..self }
    }

    /// Time of the passes so far.
    pub fn timings(&self) -> Timings {
        self.timings
    }

    /// Hemicubes drawn so far.
    pub fn drawn(&self) -> u64 {
        self.batches.resolutions.iter().map(|r| r.drawn).sum()
    }

    /// Hemicubes drawn so far at each resolution: pixels along an edge of the top face, and number;
    /// the full one first, then its halvings.
    pub fn drawn_by_resolution(&self) -> Vec<(u32, u64)> {
        self.batches.resolutions.iter().map(|r| (r.pixels, r.drawn)).collect()
    }

    /// The faces of the hemicube over `patch`.
    fn views(&self, mesh: &Mesh, patch: NodeId) -> [View; 5] {
        let frame = Frame::new(mesh.normal(patch), rotation(patch));
        let near = self.coordinates.length(mesh.area(patch).sqrt() * offset::SURFACE_LIFT);
        let centre = mesh.centroid(patch);
        let [eye, eye_low] = self.coordinates.parts(centre);
        let own_triangle = self.draw_list.position_of[mesh.triangle(patch)];
        Face::all(&frame).map(|face| View {
            face: FaceView {
                eye,
                near,
                right: face.right.as_vec3().to_array(),
                bottom: face.bottom as f32,
                up: face.up.as_vec3().to_array(),
                own_triangle,
                forward: face.forward.as_vec3().to_array(),
                padding: 0,
                eye_low,
                padding_2: 0,
            },
            runs: self.draw_list.in_view(centre, &face),
        })
    }

    /// One hemicube a patch, of resolution number `at`; `None` where there is no room for their
    /// entries.
    fn draw_batch(
        &mut self,
        mesh: &Mesh,
        patches: &[NodeId],
        at: usize,
    ) -> Result<Option<Vec<Row>>, Error> {
        let start = Instant::now();
        let views: Vec<[View; 5]> = patches.par_iter().map(|&p| self.views(mesh, p)).collect();
        let count = patches.len() as u32;
        let (gpu, slots) = (&self.gpu, self.slots);
        let Batches { item_buffer, reduce, resolutions, compacted, clock, .. } = &mut self.batches;
        let Resolution { pixels, targets, bindings, drawn } = &mut resolutions[at];
        let settings = RowSettings { slots, entries: compacted.entries, ..Default::default() };
        let max_entries = u64::from(max_row_entries(slots, *pixels)) * u64::from(count);
        let rows = gpu.with_error_scopes(|| {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            let queries = clock.as_ref().map(|clock| &clock.queries);
            item_buffer.draw(&gpu.queue, &mut encoder, targets, views.as_flattened(), queries);
            reduce.reduce(&mut encoder, targets, bindings, count, queries);
            compacted.compact(gpu, &mut encoder, &reduce.rows, count, false);
            if let Some(clock) = clock {
                clock.resolve(&mut encoder);
            }
            let submitted = compacted.submit(gpu, encoder, settings, max_entries);
            let rows = compacted.read(gpu, &submitted, |entries| rows_of(entries, patches))?;
            let seconds = clock.as_ref().map(|clock| clock.seconds(gpu, submitted.submission));
            let (draw, reduce) = seconds.transpose()?.unwrap_or_default();
            self.timings.draw += draw;
            self.timings.reduce += reduce;
            self.timings.readback += (start.elapsed().as_secs_f64() - draw - reduce).max(0.0);
            Ok(rows)
        })?;
        *drawn += u64::from(count);
        rows.transpose().map_err(|found| gpu.invalid_result(found))
    }
}

/// Number of hemicubes in a batch where there is enough memory.
fn preferred_batch(gpu: &Gpu, resolution: u32, slots: u32) -> u32 {
    let (limits, item_bytes) = (gpu.limits(), Reduce::items_bytes(resolution));
    let max_batch = match gpu.assumed_kind() {
        // More are no faster. Plain choice; no recorded measurement.
        AdapterKind::Cpu => 16,
        _ => CompactedRows::MAX_BATCH,
    };
    // A software device draws 32 MiB of item buffers in a fraction of a second.
    u64::from(max_batch.min(limits.layers))
        .min(((32 << 20) / item_bytes).max(1))
        .min(limits.buffer / item_bytes)
        .min(limits.buffer / row_bytes(slots)) as u32
}

/// Words of a dense row over `mesh`.
fn slots(mesh: &Mesh) -> u32 {
    mesh.element_count() as u32 + FIRST_FRONT
}

/// Bytes of a dense row of this number of words.
fn row_bytes(slots: u32) -> u64 {
    u64::from(slots) * 4
}

/// Maximum number of entries of a row: that of the hemicube's pixels, a top face of `resolution`²
/// and four side faces of half as many.
fn max_row_entries(slots: u32, resolution: u32) -> u32 {
    slots.min(3 * resolution * resolution)
}

fn check_resolution_fits(limits: GpuLimits, resolution: u32) -> Result<(), Error> {
    let fits = |n: &u32| 3 * n <= limits.texture && Reduce::items_bytes(*n) <= limits.buffer;
    if fits(&resolution) {
        return Ok(());
    }
    let max = RESOLUTIONS.rev().find(fits).unwrap_or(0) / 2 * 2;
    let place = format!("hemicube resolution {resolution}");
    let found = format!("an item buffer of {resolution} × {} pixels", 3 * resolution);
    let remedy = format!("this device allows resolutions up to {max}");
    Err(Error::new(ErrorKind::Setting, place, found, remedy))
}

fn check_mesh_fits(limits: GpuLimits, mesh: &Mesh) -> Result<(), Error> {
    let items = ItemTable::count(mesh);
    let triangles = mesh.scene().triangles().len() as u64;
    let triangle_bytes = 3 * size_of::<Corner>() as u64;
    let largest = row_bytes(slots(mesh)).max(items * 4).max(triangles * triangle_bytes);
    if largest <= limits.buffer {
        return Ok(());
    }
    let found = format!("{items} finest cells of elements in {triangles} triangles");
    let (cells, triangles) = (limits.buffer / 4, limits.buffer / triangle_bytes);
    let remedy = format!("this device holds {cells} and {triangles}");
    Err(Error::new(ErrorKind::Memory, "mesh".to_string(), found, remedy))
}

impl FormFactors for HemicubeRows {
    fn rows(&mut self, mesh: &Mesh, patches: &[NodeId], weight: f64) -> Result<Vec<Row>, Error> {
        let halvings = resolution_policy::halvings_for_importance(weight, self.full_share) as usize;
        let at = halvings.min(self.batches.resolutions.len() - 1);
        let (gpu, batch_len) = (self.gpu.clone(), self.batches.max_hemicubes);
        let draw = |batch: &[_]| self.draw_batch(mesh, batch, at);
        CompactedRows::in_batches(&gpu, patches, batch_len, draw)
    }

    fn preferred_batch_len(&self) -> usize {
        self.preferred_batch as usize
    }

    fn fingerprint(&self) -> String {
        let resolution = self.batches.resolutions[0].pixels;
        format!("hemicubes of {resolution}, all from {}", self.full_share)
    }
}

/// Rotation of a patch's hemicube about its normal, radians: a hash of its id, so that neighbours
/// do not repeat one another's pixel pattern and every run has the same.
fn rotation(patch: NodeId) -> f64 {
    unit_interval(split_mix64_nth(patch.0.into())) * FRAC_PI_2
}

/// The rows of `patches` by the entries of all; or the first that is wrong.
fn rows_of(entries: &[RowEntry], patches: &[NodeId]) -> Result<Vec<Row>, String> {
    let rows = by_row(entries, patches.len())?;
    rows.par_iter().zip(patches).map(|(row, &patch)| row_of(row, patch)).collect()
}

/// The row of `patch` by its entries, if these sum to 1; else an error message.
fn row_of(entries: &[RowEntry], patch: NodeId) -> Result<Row, String> {
    let (lost, seen) = entries.split_at(entries.partition_point(|e| e.slot < FIRST_FRONT));
    let entry = |e: &RowEntry| Entry { element: e.slot - FIRST_FRONT, share: e.count };
    let share = |slot: u32| lost.iter().find(|e| e.slot == slot).map_or(0, |e| e.count);
    let row = Row {
        entries: seen.iter().map(entry).collect(),
        escaped: share(OPEN),
        backface: share(BACK),
        passed: vec![],
    };
    if row.sum() != u64::from(Row::TOTAL) {
        return Err(format!("shares of patch {} that sum to {}", patch.0, row.closure()));
    }
    Ok(row)
}

#[cfg(test)]
mod twin_tests;

#[cfg(test)]
mod tests;
