//! Ray-casting resources, created once per device: pipelines, and the most recent scene and fields.

use std::panic::resume_unwind;
use std::sync::{Arc, Mutex, OnceLock, PoisonError, Weak};

use super::field::{self, FieldBuffers};
use super::memory::Memory;
use super::pipeline;
use super::slots::Slots;
use super::traced_scene::TracedScene;
use crate::error::{Error, ErrorKind};
use crate::gather::RadiosityField;
use crate::scene::Scene;

/// Stored with a device, for all users that cast rays on it.
#[derive(Debug, Default)]
pub struct Tracing {
    gather: OnceLock<GatherPipelines>,
    rows: OnceLock<RowPipelines>,
    scene: Mutex<Option<(Weak<Scene>, Arc<TracedScene>)>>,
    /// The most recent one at the end.
    fields: Mutex<Vec<KeptField>>,
    pub slots: Mutex<Option<Slots>>,
}

/// A field on the device, of a scene there.
#[derive(Debug)]
struct KeptField {
    key: u64,
    scene: Arc<TracedScene>,
    buffers: Arc<FieldBuffers>,
}

/// A pass of a gather.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GatherPass {
    RankLights,
    HemisphereRays,
    NearPaths,
    LightRays,
    Settle,
}

impl GatherPass {
    /// All passes, with the entry point of each, which has the name of its file.
    pub const ALL: [(GatherPass, &str); 5] = [
        (GatherPass::RankLights, "rank_lights"),
        (GatherPass::HemisphereRays, "hemisphere_rays"),
        (GatherPass::NearPaths, "near_paths"),
        (GatherPass::LightRays, "light_rays"),
        (GatherPass::Settle, "settle"),
    ];

    /// The passes that cast rays from the points of a work list, in the order in which they run.
    pub const RAYS: [GatherPass; 3] =
        [GatherPass::HemisphereRays, GatherPass::NearPaths, GatherPass::LightRays];

    /// Whether its rays look light up in a field.
    pub fn reads_field(self) -> bool {
        matches!(self, GatherPass::HemisphereRays | GatherPass::NearPaths)
    }

    /// Offset in `Work` of the number of workgroups, one per point of the pass's list, bytes.
    pub fn list_offset(self) -> u64 {
        if self == GatherPass::LightRays { 12 } else { 0 }
    }
}

/// The pipelines of [`GatherPass::ALL`].
pub type GatherPipelines = [wgpu::ComputePipeline; 5];

fn gather_pipelines(device: &wgpu::Device) -> GatherPipelines {
    let compile = |(_, entry_point): (GatherPass, &str)| {
        pipeline::compute(device, &format!("{entry_point}.wgsl"), entry_point)
    };
    if cfg!(target_family = "wasm") {
        return GatherPass::ALL.map(compile);
    }
    // Drivers take up to a second for one, on one core. Not in the thread pool: one of its threads
    // may be waiting for them.
    std::thread::scope(|scope| {
        let threads = GatherPass::ALL.map(|pass| scope.spawn(move || compile(pass)));
        threads.map(|thread| thread.join().unwrap_or_else(|panic| resume_unwind(panic)))
    })
}

/// The passes of rows.
#[derive(Debug)]
pub struct RowPipelines {
    pub row_rays: wgpu::ComputePipeline,
    pub compact_rows: wgpu::ComputePipeline,
    pub compact_rows_through_panes: wgpu::ComputePipeline,
}

impl RowPipelines {
    fn new(device: &wgpu::Device) -> RowPipelines {
        let compact = |entry_point| pipeline::compute(device, "compact_rows.wgsl", entry_point);
        RowPipelines {
            row_rays: pipeline::compute(device, "row_rays.wgsl", "row_rays"),
            compact_rows: compact("compact_rows"),
            compact_rows_through_panes: compact("compact_rows_through_panes"),
        }
    }
}

impl Tracing {
    /// The passes of rows: compiled at the first call.
    pub fn row_pipelines(&self, device: &wgpu::Device) -> &RowPipelines {
        self.rows.get_or_init(|| RowPipelines::new(device))
    }

    /// The passes of a gather: compiled at the first call.
    pub fn gather_pipelines(&self, device: &wgpu::Device) -> &GatherPipelines {
        self.gather.get_or_init(|| gather_pipelines(device))
    }

    /// `scene` on the device: the result of `upload` unless it is the previous one.
    pub fn scene(
        &self,
        scene: &Arc<Scene>,
        upload: impl FnOnce() -> Result<TracedScene, Error>,
    ) -> Result<Arc<TracedScene>, Error> {
        let mut kept = self.scene.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((owner, traced)) = &*kept
            && owner.upgrade().is_some_and(|owner| Arc::ptr_eq(&owner, scene))
        {
            return Ok(traced.clone());
        }
        *kept = None;
        self.fields.lock().unwrap_or_else(PoisonError::into_inner).clear();
        let traced = Arc::new(upload()?);
        *kept = Some((Arc::downgrade(scene), traced.clone()));
        Ok(traced)
    }

    /// `field` on the device: uploaded to the result of `memory` unless it is stored.
    pub fn field(
        &self,
        scene: &Arc<TracedScene>,
        field: &RadiosityField,
        memory: impl Fn() -> Memory,
    ) -> Result<Arc<FieldBuffers>, Error> {
        let key = field::key(field);
        let mut kept = self.fields.lock().unwrap_or_else(PoisonError::into_inner);
        let is_same = |kept: &KeptField| kept.key == key && Arc::ptr_eq(&kept.scene, scene);
        let buffers = match kept.iter().position(is_same) {
            Some(k) => kept.remove(k).buffers,
            None => {
                // Two are stored: the field that vertices gather from, and the gathered one, which
                // an estimate of the error compares.
                if kept.len() >= 2 {
                    kept.remove(0);
                }
                let new = || FieldBuffers::new(memory(), field, scene.radiance_unit);
                Arc::new(new().or_else(|e| match e.kind() {
                    // The other fields are freed.
                    ErrorKind::Memory if !kept.is_empty() => {
                        kept.clear();
                        new()
                    }
                    _ => Err(e),
                })?)
            }
        };
        kept.push(KeptField { key, scene: scene.clone(), buffers: buffers.clone() });
        Ok(buffers)
    }
}
