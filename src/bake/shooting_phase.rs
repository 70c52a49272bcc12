//! The first half of a bake: light that is shot, on elements.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::bake::error_estimate::{ErrorEstimate, ErrorEstimator, LEAST_PLACES};
use crate::bake::fallback::{ResilientBackend, ResilientRows};
use crate::bake::progress::{BakeProgress, ProgressCallback, report};
use crate::bake::settings::{BakeSettings, SolveSettings};
use crate::error::Error;
use crate::form_factor::FormFactors;
use crate::form_factor::proximity::ProximityCorrection;
use crate::form_factor::viewpoints::AdaptiveViewpoints;
use crate::mesh::Mesh;
use crate::progress::StopReason;
use crate::progress::{Timings, lap};
use crate::scene::Scene;
use crate::solver::{Progress, Solution};
use crate::vertex::gathering::GatheredMesh;

/// Light that was shot.
pub(super) struct ShootingPhase {
    pub mesh: Mesh,
    pub solution: Solution,
    pub hemicubes: u64,
    pub hemicubes_by_resolution: Vec<(u32, u64)>,
    pub near_moved: f64,
    pub seconds: Timings,
    pub since: Instant,
}

impl ShootingPhase {
    pub fn new(
        settings: &BakeSettings,
        scene: &Arc<Scene>,
        device: &ResilientBackend,
        progress: ProgressCallback,
    ) -> Result<ShootingPhase, Error> {
        let mut since = Instant::now();
        settings.check()?;
        let settings = &settings.solve;
        let mesh = Mesh::new(scene.clone(), settings.element_size)?
            .split_at_contacts(settings.contact_levels);
        let rows = device.rows(&mesh, settings)?;
        let near = ProximityCorrection::new(rows, &mesh, settings.near_reach);
        let levels = if settings.viewpoint_tolerance.is_some() { u32::MAX } else { 0 };
        let tolerance = settings.viewpoint_tolerance.unwrap_or(1.0);
        let mut rows = AdaptiveViewpoints::new(near, tolerance, levels);
        let mut seconds = Timings { mesh: lap(&mut since), ..Default::default() };
        let mut tell = |p: &Progress| report(device, &BakeProgress::Shooting(*p), progress);
        let mut solution = solve(settings, &mesh, &mut rows, &mut tell)?;
        if settings.ambient {
            solution.ledger.add_ambient(&mesh, &mut solution.radiosity);
        }
        let relay: &ResilientRows = rows.inner().inner();
        let mut in_rows = 0.0;
        for maker in [relay.first()].into_iter().chain(relay.second()) {
            seconds += maker.timings();
            in_rows += maker.seconds();
        }
        seconds.solve = lap(&mut since) - in_rows;
        let rotations = u64::from(settings.rotations.get());
        let hemicubes = (solution.rows_made + rows.extra()) * rotations;
        let near_moved = rows.inner().moved();
        let hemicubes_by_resolution = relay.first().drawn_by_resolution();
        drop(rows);
        Ok(ShootingPhase {
            mesh,
            solution,
            hemicubes,
            hemicubes_by_resolution,
            near_moved,
            seconds,
            since,
        })
    }

    /// The elements' own light, as it is.
    pub fn judge(
        mut self,
        effort: &BakeSettings,
        mut light: GatheredMesh,
        device: &ResilientBackend,
        progress: ProgressCallback,
    ) -> Result<(GatheredMesh, ErrorEstimate, ShootingPhase, BakeSettings), Error> {
        self.seconds.vertices = lap(&mut self.since);
        let spread = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|v| light.reflected[v as usize]);
            a.distance(b).max(b.distance(c)).max(c.distance(a)) / 4.0
        };
        let rest: Vec<f64> = light.corners.iter().map(spread).collect();
        let mut looks = device.gather(&self.mesh, LOOKS, f64::INFINITY, 0.0)?;
        let ledger = &self.solution.ledger;
        let judged =
            ErrorEstimator { light: &light, sources: &light, rest: &rest, ledger, sweeps: 0 };
        let of = LEAST_PLACES;
        let mut cancelled = self.solution.stop == StopReason::Cancelled;
        let (certificate, error) = judged.judge(of, &mut *looks, &mut |samples| {
            cancelled = cancelled
                || report(device, &BakeProgress::Estimating { samples, of }, progress).is_break();
            if cancelled { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })?;
        light.surface.error = error;
        self.seconds.estimate = lap(&mut self.since);
        let _ = report(device, &BakeProgress::Estimated(certificate), progress);
        Ok((light, certificate, self, effort.clone()))
    }
}

/// Spreads the light of `mesh`; from a saved state on if there is one, and saves it.
fn solve(
    settings: &SolveSettings,
    mesh: &Mesh,
    rows: &mut dyn FormFactors,
    progress: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Solution, Error> {
    let solver = settings.solver_for(mesh);
    let Some(path) = &settings.checkpoint else { return solver.solve(mesh, rows, progress) };
    let mut solve = match path.exists() {
        true => solver.resume(mesh, rows, path)?,
        false => solver.begin(mesh)?,
    };
    let (mut saved, mut took) = (Instant::now(), Duration::ZERO);
    loop {
        let stop = solve.advance(rows, &mut *progress)?;
        if stop.is_some() || saved.elapsed() >= SAVING * took {
            let start = Instant::now();
            solve.save(path)?;
            (saved, took) = (Instant::now(), start.elapsed());
        }
        if stop.is_some() {
            return solve.into_solution();
        }
    }
}

/// Solving goes on for so many times what saving takes.
const SAVING: u32 = 10;

/// Looks a place where vertices do not gather.
const LOOKS: u32 = 1024;
