//! The first phase of a bake: light is shot on elements.
//!
//! The scene is cut into elements. Rows of form factors come from the backend and are corrected for
//! near receivers; a solver sends light along them.
//!
//! ```text
//! backend ─► ProximityCorrection ─► Solver ─► radiosity of elements
//! ```

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Duration;

use crate::backend::RowMaker;
use crate::bake::controller::ErrorTarget;
use crate::bake::estimator::{self, ErrorEstimator, EstimatedError};
use crate::bake::fallback::{ResilientBackend, ResilientRows};
use crate::bake::model;
use crate::bake::outcome::{Obstacle, Outcome};
use crate::bake::progress::{BakeProgress, Reporter, StageClock};
use crate::bake::received_light::received;
use crate::bake::result::BakedLight;
use crate::bake::settings::{BakeSettings, SolveSettings};
use crate::bake::strata::SampleCounts;
use crate::bake::validator::{self, Validator};
use crate::error::Error;
use crate::form_factor::FormFactors;
use crate::form_factor::proximity::ProximityCorrection;
use crate::gather::GatheredMesh;
use crate::mesh::Mesh;
use crate::progress::StopReason;
use crate::scene::Scene;
use crate::solver::{Progress, ReceivedLight, Solution};
use crate::verify::octaves_of;
use crate::work::now;

/// Time of shooting until its light is shown first. Plain choice: a picture within half a second,
/// and none of scenes that take no longer.
const FIRST_LIGHT: Duration = Duration::from_millis(250);

/// What the first phase leaves to the second.
pub(super) struct ShotLight {
    pub mesh: Mesh,
    pub solution: Solution,
    /// Rows drawn or cast.
    pub hemicubes: u64,
    pub row_maker: RowMaker,
    pub hemicubes_by_resolution: Vec<(u32, u64)>,
    /// Mean share of a row that the proximity correction moved.
    pub mean_near_correction: f64,
}

impl ShotLight {
    /// The emission of `mesh`, of which nothing is shot.
    pub fn nothing(mesh: Mesh) -> ShotLight {
        ShotLight {
            solution: Solution::nothing_shot(&mesh),
            mesh,
            hemicubes: 0,
            row_maker: RowMaker::Rays,
            hemicubes_by_resolution: vec![],
            mean_near_correction: 0.0,
        }
    }
}

/// Shoots the light of `scene`.
pub(super) fn shoot(
    settings: &SolveSettings,
    scene: &Arc<Scene>,
    backend: &ResilientBackend,
    reporter: &mut Reporter,
    clock: &mut StageClock,
) -> Result<ShotLight, Error> {
    let sizing = settings.sizing(scene, settings.element_size);
    let mesh = Mesh::sized(scene.clone(), &sizing, model::MAX_SHOOTING_DEPTH)?;
    let rows = backend.rows(&mesh, settings)?;
    let mut rows = ProximityCorrection::new(rows, &mesh, settings.near_reach);
    clock.timings.mesh = clock.lap();
    let mut proceed = || reporter.report(BakeProgress::Shooting(Progress::NOTHING_SHOT));
    let received = received(&mesh, &settings.gathered_materials, backend, &mut proceed)?;
    let mut solution = solve(settings, &mesh, &received, &mut rows, reporter)?;
    if settings.ambient {
        solution.ledger.add_ambient(&mesh, &mut solution.radiosity);
    }
    let sources: &ResilientRows = rows.inner();
    let mut row_seconds = 0.0;
    for source in [sources.first()].into_iter().chain(sources.second()) {
        clock.timings += source.timings();
        row_seconds += source.seconds();
    }
    clock.timings.solve = clock.lap() - row_seconds;
    let hemicubes = solution.rows_made;
    let mean_near_correction = rows.mean_correction();
    let row_maker = sources.first().maker();
    let hemicubes_by_resolution = sources.first().drawn_by_resolution();
    drop(rows);
    Ok(ShotLight {
        mesh,
        solution,
        hemicubes,
        row_maker,
        hemicubes_by_resolution,
        mean_near_correction,
    })
}

/// Spreads the light of `mesh`, and shows it on the way.
fn solve(
    settings: &SolveSettings,
    mesh: &Mesh,
    received: &ReceivedLight,
    rows: &mut dyn FormFactors,
    reporter: &mut Reporter,
) -> Result<Solution, Error> {
    let mut session = settings.solver_for(mesh).begin_after(mesh, received)?;
    let start = now();
    let mut next_light = FIRST_LIGHT;
    loop {
        let mut progress = |p: &Progress| {
            let progress = Progress { elapsed: now() - start, ..*p };
            reporter.report(BakeProgress::Shooting(progress))
        };
        let stop = session.advance(rows, &mut progress)?;
        if stop.is_some() {
            return session.into_solution();
        }
        if now() - start >= next_light {
            let shown = now();
            let light = Arc::new(GatheredMesh::from_elements(mesh, &session.light_so_far())?);
            if reporter.report(BakeProgress::Light { light, estimate: None }).is_break() {
                return session.into_solution();
            }
            // A tenth of the time at most is for showing.
            let end = now();
            next_light = (2 * (end - start)).max(end - start + 10 * (end - shown));
        }
    }
}

/// The elements' own light as a result: no vertex gathers, and the error is estimated.
pub(super) fn estimate_elements(
    shot: &ShotLight,
    settings: &BakeSettings,
    target: Option<ErrorTarget>,
    mut light: GatheredMesh,
    backend: &ResilientBackend,
    reporter: &mut Reporter,
    clock: &mut StageClock,
) -> Result<BakedLight, Error> {
    clock.timings.vertices = clock.lap();
    let mut gatherer = backend.gather(&shot.mesh, model::ELEMENT_RAYS, f64::INFINITY, 0.0)?;
    let estimator = ErrorEstimator {
        light: &light,
        lit_by: None,
        element_residual: &corner_spread(&light),
        ledger: &shot.solution.ledger,
        bounces: 0.0,
        measure: settings.measure,
        region: settings.solve.lit_region(shot.mesh.scene()),
        octaves: &octaves_of(shot.mesh.scene()),
        expected_floor: light.radiosity_field().radiosity_floor(settings.measure.floor),
        paths: None,
    };
    let counts = SampleCounts { total: model::MIN_SAMPLES, per_group: model::SAMPLES_PER_GROUP };
    // With settings to gather by, it was cancelled before vertices could.
    let mut cancelled = settings.gather.is_some() || shot.solution.stop == StopReason::Cancelled;
    let estimated = estimator.estimate(counts, &mut *gatherer, &mut |samples, of| {
        cancelled |= reporter.report(BakeProgress::Estimating { samples, of }).is_break();
        estimator::goes_on(cancelled, false, samples)
    })?;
    let estimated = match target {
        // The estimate of a bake that was stopped is validated, too.
        Some(target) if cancelled => {
            Validator::new(shot.mesh.scene(), settings.measure, target.each_group).validate(
                estimated,
                &light,
                Some(target.error),
                [validator::MIN_PATHS; 2],
                &mut |_, _| ControlFlow::Continue(()),
            )
        }
        _ => estimated,
    };
    let is_reached = target.is_some_and(|target| target.is_reached(estimated.errors(), cancelled));
    let EstimatedError { whole: estimate, groups, vertices, .. } = estimated;
    light.surface.error = vertices;
    clock.timings.estimate = clock.lap();
    // The bake ends here, whatever the callback says.
    let _ = reporter.report(BakeProgress::Estimated(estimate));
    let outcome = match target {
        None => Outcome::Unasked,
        Some(_) if is_reached => Outcome::Reached,
        Some(_) if cancelled => Outcome::Missed(Obstacle::Cancelled),
        Some(_) => Outcome::Missed(Obstacle::Settings),
    };
    Ok(BakedLight { light, estimate, groups, outcome, settings: settings.clone() })
}

/// A quarter of the largest difference between the corners of each element, W/m²: what its middle
/// may be off by, up to a factor that is the same for all.
fn corner_spread(light: &GatheredMesh) -> Vec<f64> {
    let spread = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|v| light.reflected[v as usize]);
        a.distance(b).max(b.distance(c)).max(c.distance(a)) / 4.0
    };
    light.corners.iter().map(spread).collect()
}
