//! Light at the vertices of a scene that is kept as it is: nothing is split.
//!
//! ```text
//!   a bake ──► its light ──► gathered at each vertex ──► corrected by paths ──► errors of vertices
//! ```
//!
//! For programs that need the vertices they know, in their order. How far light is from linear
//! between them is not measured: the error is that at the vertices alone.

use std::ops::ControlFlow;
use std::sync::Arc;

use glam::DVec3;
use rustc_hash::FxHashSet;

use crate::backend::{Backend, GatherRays};
use crate::bake::{BakeResult, BakeSettings, ErrorEstimate, Obstacle, Outcome, check_error};
use crate::error::Error;
use crate::gather::GatheredMesh;
use crate::gather::kept_mesh::KeptVertices;
use crate::mesh::Mesh;
use crate::path_correction::{GatheredPoint, SurfaceGoal, correct_surface, scales};
use crate::progress::Instant;
use crate::scene::{Rgb, Scene};
use crate::vertex::VertexMesh;
use crate::visibility::lit_sides;

/// How many times further off than light at the vertices that of the bake may be: each vertex
/// averages its errors over a hemisphere, and what is left takes paths, whose number scatters much.
/// A room of 1 576 vertices to 5 % takes 13, 14, 8 and 4 s with 1, 1.5, 2 and 3; one of 3 786 takes
/// 13, 11, more than 100 and 4; a hall of 77 764 takes 82, 49, 71 and more than 200 (two cores).
const LOOSER: f64 = 1.5;

/// Largest error of the bake: light that is missed altogether is not averaged.
const LOOSEST: f64 = 0.3;

/// The error, as a share, of the bake to gather from for an error at vertices.
#[must_use]
pub fn error_of_bake(error: f64) -> f64 {
    (LOOSER * error).min(error.max(LOOSEST))
}

impl BakeResult {
    /// The same with light at the vertices of `scene`, that of the bake before it was cut to
    /// elements: [`BakeResult::light`] is on a mesh whose elements are the triangles of the scene,
    /// with a vertex for each smooth surface that meets at a point. Each gathers the light of this
    /// bake, to [`error_of_bake`], and paths correct it until the root mean square of the errors of
    /// vertices, weighted by the area around them, is estimated to be at most `error`, a share, or
    /// there are 2²⁷ paths: [`BakeResult::estimate`] tells how much it is, of vertices
    /// alone, and [`VertexMesh::error`] has it for each.
    ///
    /// `progress` is called with the vertices, and then the paths, that are done and all of them,
    /// several times a second. If it stops the vertices, the result is `None`; if it stops the
    /// paths, it is without a correction.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`](crate::ErrorKind::Setting) for an `error` outside (0, 1); those of
    /// [`Backend::gather`].
    pub fn on_kept_mesh(
        &self,
        scene: impl Into<Arc<Scene>>,
        error: f64,
        backend: &Backend,
        mut progress: impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<Option<BakeResult>, Error> {
        check_error(error)?;
        let start = Instant::now();
        let mesh = Mesh::new(lit_sides::resolved(scene.into()), f64::INFINITY)?;
        let settings = BakeSettings::for_error(error, mesh.scene());
        let floor = self.settings.measure.floor;
        // Those of a bake to this error.
        let gather = settings.gather.as_ref();
        let (rays, noise) = gather.map_or((1024, error), |g| (g.rays, g.noise_tolerance));
        let dim = self.light.radiosity_field().radiosity_floor(floor);
        let rays = GatherRays::of_many(rays, noise, dim);
        let mut gatherer = backend.gather_with_fallback(&self.light.mesh, rays, |_| ())?;
        let kept = KeptVertices::gather(mesh, &self.light, &mut *gatherer, &mut progress)?;
        let Some(mut kept) = kept else { return Ok(None) };
        let gathered = start.elapsed().as_secs_f64();
        let open = kept.open();
        let point = |k: usize| {
            let sample = kept.sample(open[k]);
            GatheredPoint {
                point: kept.point(open[k]),
                area: kept.area(open[k]),
                irradiance: sample.irradiance,
                near_paths: sample.near_paths,
            }
        };
        // Plain choice: as fine as points that are evenly spread along a line.
        let finest = (0.5 / open.len().max(1) as f64).max(1.0 / 1024.0);
        let sampling = sampling_error(&kept, &open, floor);
        // A quarter of it where rays leave less, since paths cost by the square.
        let left = (error.powi(2) - sampling.powi(2)).max((0.25 * error).powi(2)).sqrt();
        let goal = SurfaceGoal {
            error: left,
            expected: [self.estimate.of_light(), self.estimate.total],
            floor,
            finest: finest * self.light.mesh.scene().bounds().diagonal(),
        };
        let found = correct_surface(&self.light, open.len(), point, &goal, progress);
        let (missed, paths) = match &found {
            Some(found) => (found.error, found.paths),
            None => (self.estimate.total, 0),
        };
        let estimate = ErrorEstimate::at_points(open.len(), sampling, missed, paths);
        let outcome = match &found {
            None => Outcome::Missed(Obstacle::Cancelled),
            Some(_) if estimate.total <= error => Outcome::Reached,
            Some(_) => Outcome::Missed(Obstacle::largest_part(&estimate)),
        };
        if let Some(found) = found {
            for (k, &v) in open.iter().enumerate() {
                let noise = libm::hypot(kept.sample(v).noise, found.standard_error[k]);
                kept.set(v, found.irradiance[k], noise);
            }
        }
        let mut timings = self.timings;
        timings.vertices += gathered;
        timings.estimate += start.elapsed().as_secs_f64() - gathered;
        let light = kept.light();
        Ok(Some(BakeResult { light, estimate, outcome, timings, groups: vec![], ..self.clone() }))
    }
}

/// Root mean square over area of the errors by rays at the `open` vertices, as shares.
fn sampling_error(kept: &KeptVertices, open: &[u32], floor: f64) -> f64 {
    let scales = scales(open.iter().map(|&v| kept.sample(v).irradiance.length()), floor);
    let (mut squares, mut area) = (0.0, f64::MIN_POSITIVE);
    for (&v, scale) in open.iter().zip(scales) {
        squares += kept.area(v) * (kept.sample(v).noise / scale).powi(2);
        area += kept.area(v);
    }
    (squares / area).sqrt()
}

impl GatheredMesh {
    /// Its light at [`Scene::positions`], in their order, which is that of the scene's file, with
    /// the triangles of the scene as faces: for light of [`BakeResult::on_kept_mesh`]. Of a face
    /// that is lit on both sides it is that of the front. Where several surfaces meet in a crease a
    /// vertex has their mean, weighted by the area around it; of no triangle, it is black. Also the
    /// number of vertices with a mean of several surfaces.
    pub fn at_positions(&self) -> (VertexMesh, usize) {
        let (scene, from) = (self.mesh.scene(), &self.surface);
        let count = scene.positions().len();
        let mut to = VertexMesh {
            positions: scene.positions().to_vec(),
            normals: vec![DVec3::ZERO; count],
            radiosity: vec![Rgb::ZERO; count],
            irradiance: vec![Rgb::ZERO; count],
            error: vec![0.0; count],
            sky: from.sky.clone(),
            comments: from.comments.clone(),
            ..Default::default()
        };
        let mut areas = vec![0.0; count];
        let mut first = vec![None; count];
        let mut shared = FxHashSet::default();
        let mut faces = FxHashSet::default();
        for (e, corners) in self.corners.iter().enumerate() {
            let node = self.mesh.element(e);
            let t = self.mesh.triangle(node);
            let face = scene.triangles()[t].corners;
            // Another side has the same corners, and comes later.
            let mut any_order = face;
            any_order.sort_unstable();
            if !faces.insert(any_order) {
                continue;
            }
            to.faces.push(face);
            to.elements.push(e as u32);
            let area = self.mesh.area(node);
            for (p, v) in face.into_iter().zip(corners).map(|(p, &v)| (p as usize, v as usize)) {
                if *first[p].get_or_insert(v) != v {
                    shared.insert(p);
                }
                to.normals[p] += area * self.mesh.normal(node);
                to.radiosity[p] += area * from.radiosity[v];
                to.irradiance[p] += area * from.irradiance[v];
                to.error[p] += area * from.error.get(v).copied().unwrap_or(0.0);
                areas[p] += area;
            }
        }
        for (p, &area) in areas.iter().enumerate().filter(|(_, area)| **area > 0.0) {
            to.normals[p] = to.normals[p].normalize_or_zero();
            to.radiosity[p] /= area;
            to.irradiance[p] /= area;
            to.error[p] /= area;
        }
        (to, shared.len())
    }
}
