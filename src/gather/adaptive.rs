//! The adaptive gather: irradiance at the vertices of a mesh, refined where linear interpolation
//! fails.
//!
//! ```text
//!   for each pass:                               source light: the last pass's result
//!     vertices ── gather points ── Gather ── irradiance E ── reflected = ρ E
//!        │             └ buried in something? try another element around the vertex
//!        │                └ buried everywhere: extrapolated from the neighbours
//!     elements whose midside surplus is too large are split; new vertices gather; again
//!   last: split once more onto the quadratic interpolant, no gather
//! ```
//!
//! With the source light fixed, a pass is one Jacobi step of the radiosity equation at the vertices
//! (a final gather). Each further pass adds a bounce. Coarser tolerances do for all passes but the
//! last, since those only light the next.

use std::borrow::Cow;
use std::ops::ControlFlow;
use std::sync::Arc;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::batch::{Batch, VertexValues};
use super::buried::extrapolate_into_buried;
use super::centroid_probes::{CentroidProbes, probe};
use super::directional_light::DirectionalLight;
use super::further_bounces::GatheredFrom;
use super::gather_points::VertexGatherPoints;
use super::gathered_mesh::GatheredMesh;
use super::interpolated_refinement::interpolated_refinement;
use super::point_row::PointRows;
use super::progress::Progress;
use super::refinement_indicator::{ErrorScale, counted_area, has_buried_node, squared_error};
use super::refinement_settings::RefinementSettings;
use super::sampled_mesh::{SampledMesh, after_split};
use super::shadow_edges::resolve_shadow_edges;
use super::source_light::SourceLight;
use super::surplus::mean_preserving;
use super::two_sided::{TwoSidedPoint, gather_two_sided};
use super::vertex_weights::vertex_weights;
use super::{Gather, RadiosityField};
use crate::accuracy::Measure;
use crate::accuracy::largest_first::in_order;
use crate::accuracy::tail::trimmed;
use crate::error::Error;
use crate::mesh::Mesh;
use crate::progress::StopReason;

use crate::scene::{Aabb, Rgb};
use crate::work::{self, Batches, agree};

/// Called with the progress after every batch; may stop the gather.
pub(crate) type ProgressCallback<'a> = dyn FnMut(&Progress) -> ControlFlow<()> + 'a;

/// The makers of gathers and rows of [`AdaptiveGather::run_passes`].
pub(crate) struct Gatherers<'g> {
    /// Of the last pass.
    pub last: &'g mut dyn Gather,
    /// Of the passes before it; the same if there is none.
    pub coarse: Option<&'g mut dyn Gather>,
    /// At the centroids of elements, in the last pass.
    pub probes: Option<&'g mut dyn Gather>,
    /// Rows of all vertices, by which they exchange all further bounces of what they have gathered.
    pub bounces: Option<&'g dyn PointRows>,
}

/// Gathers `source` at the vertices of `mesh`, splits elements, gathers at the new vertices, and so
/// on: B = E + ρ Σ F_vj B_j.
///
/// `source` is of the same scene, on any mesh: light that was shot on fine elements, which cost
/// hemicubes nothing, is gathered at the corners of coarse ones.
///
/// Elements are split by their hierarchical surplus (Yserentant 1986): how far the value at a new
/// vertex is from the mean of the two that it lies between. Vertices under something that touches
/// their surface see no light; they get values extrapolated from their neighbours, so that no
/// darkness leaks out. `progress` is called after every batch of vertices; where it breaks, what
/// was reached so far is returned, with [`StopReason::Cancelled`].
///
/// # Errors
/// [`ErrorKind::Setting`](crate::ErrorKind::Setting) for a setting out of range or a `source` of
/// another scene; those of `gatherer`.
pub fn gather_at_vertices(
    source: &GatheredMesh,
    mesh: &Mesh,
    settings: &RefinementSettings,
    gatherer: &mut dyn Gather,
    mut progress: impl FnMut(&Progress) -> ControlFlow<()>,
) -> Result<GatheredMesh, Error> {
    settings.check()?;
    source.check_scene(mesh)?;
    // The error of the settings is over all of the area.
    let measure = Measure { tail: 0.0, ..Measure::default() };
    let mut state =
        AdaptiveGather::new(mesh.clone(), &source.radiosity_field(), settings.region, measure);
    let gatherers = Gatherers { last: gatherer, coarse: None, probes: None, bounces: None };
    let stop = state.run_passes(settings, gatherers, &mut |p| agree(progress(p)))?;
    let result = if stop == StopReason::Cancelled {
        state.to_gathered_mesh()
    } else {
        state.interpolated(settings)?.0
    };
    Ok(GatheredMesh { stop, ..result })
}

/// State of an adaptive gather, which can go on with other settings.
#[derive(Clone)]
pub(crate) struct AdaptiveGather {
    /// The light that vertices gather.
    source: SourceLight,
    samples: SampledMesh,
    probes: CentroidProbes,
    /// Whose shadows have sharp edges.
    directional_light: Option<Arc<DirectionalLight>>,
    scale: ErrorScale,
    /// Change of the values by the last pass, relative.
    relative_change: f64,
    /// Times that the result became the source.
    pass: u32,
    /// Whether the source has all bounces.
    has_all_bounces: bool,
    /// Whether all vertices have gathered.
    has_gathered_all: bool,
    /// Times that elements have been split, over all passes.
    refinements: u32,
    /// Points at which light was gathered.
    gather_count: u64,
}

impl AdaptiveGather {
    /// Starts on `mesh` with the values that `source`, of the same scene, has at its vertices. Most
    /// of the light is in `region`.
    pub fn new(
        mesh: Mesh,
        source: &RadiosityField,
        region: Option<Aabb>,
        measure: Measure,
    ) -> AdaptiveGather {
        let scale = ErrorScale::new(&mesh, source, region, measure);
        AdaptiveGather {
            probes: CentroidProbes::new(mesh.element_count()),
            directional_light: DirectionalLight::of_scene(mesh.shared_scene()).map(Arc::new),
            samples: SampledMesh::new(mesh, source),
            source: SourceLight::new(*source),
            scale,
            relative_change: 0.0,
            pass: 0,
            has_all_bounces: false,
            has_gathered_all: false,
            refinements: 0,
            gather_count: 0,
        }
    }

    /// The light that vertices gather.
    pub fn source(&self) -> RadiosityField<'_> {
        self.source.field()
    }

    /// Vertices there are.
    pub fn vertices(&self) -> usize {
        self.samples.reflected.len()
    }

    /// Bounces of what was shot that are in the values: one a time that all vertices gathered.
    pub fn bounces(&self) -> f64 {
        if self.has_all_bounces { f64::INFINITY } else { f64::from(self.pass + 1) }
    }

    /// Whether all vertices have gathered once: before that their values do not follow from the
    /// source.
    pub fn has_gathered_all(&self) -> bool {
        self.has_gathered_all
    }

    /// Radiosity below which errors are relative to this, W/m²: a length over the channels.
    pub fn radiosity_floor(&self) -> f64 {
        self.scale.radiosity_floor
    }

    /// Sets [`AdaptiveGather::radiosity_floor`], which is that of the source light at the start.
    pub fn set_radiosity_floor(&mut self, floor: f64) {
        self.scale.radiosity_floor = floor;
    }

    /// Leaves a `share` of all light; none, and all as it was, where direct light is kept apart.
    pub fn scale_light(&mut self, share: f64) -> Option<()> {
        let values = &mut self.samples.reflected;
        self.samples.direct.is_empty().then(|| values.iter_mut().for_each(|value| *value *= share))
    }

    /// Adds the same irradiance at all vertices, by which they reflect this radiosity on average,
    /// W/m² per channel.
    pub fn add_even_light(&mut self, reflected: Rgb) {
        let SampledMesh { mesh, vertices, reflected: values, .. } = &mut self.samples;
        let irradiance = reflected / mesh.mean_albedo().max(Rgb::splat(f64::MIN_POSITIVE));
        let points = VertexGatherPoints::new(mesh, vertices, self.scale.touching());
        for (v, value) in (0..).zip(values) {
            *value += points.albedo(v) * irradiance;
        }
    }

    /// What was reached so far.
    pub fn to_gathered_mesh(&self) -> GatheredMesh {
        self.gathered_mesh_of(self.samples.clone())
    }

    /// What was reached, with elements split onto the quadratic interpolant where it leaves them,
    /// and an estimate of the error that remains in each element, W/m².
    pub fn interpolated(
        &self,
        settings: &RefinementSettings,
    ) -> Result<(GatheredMesh, Vec<f64>), Error> {
        let source = self.source.field();
        let samples = match &self.directional_light {
            Some(light) => {
                Cow::Owned(resolve_shadow_edges(&self.samples, light, &self.scale, settings)?)
            }
            None => Cow::Borrowed(&self.samples),
        };
        let refined = interpolated_refinement(&samples, &source, &self.scale, settings)?;
        drop(samples);
        Ok((self.gathered_mesh_of(refined.samples), refined.residual_error))
    }

    fn gathered_mesh_of(&self, samples: SampledMesh) -> GatheredMesh {
        let mesh = samples.mesh.clone();
        let reflected = mean_preserving(&samples);
        let (surface, corners) = samples.into_vertex_mesh();
        GatheredMesh {
            mesh,
            surface,
            corners,
            reflected,
            gather_count: self.gather_count,
            relative_change: self.relative_change,
            stop: StopReason::Converged,
        }
    }

    /// Makes what was reached the light that vertices gather from now on.
    pub fn promote_to_source(&mut self) {
        let reflected = mean_preserving(&self.samples);
        self.source.replace_by(self.samples.field(&reflected));
        self.pass += 1;
    }

    /// All passes: those before the last with coarser tolerances, since each vertex of the next
    /// averages their errors over its hemisphere. Where vertices exchange all further bounces,
    /// these are added to what the last pass gathered, and only new vertices gather after that.
    pub fn run_passes(
        &mut self,
        settings: &RefinementSettings,
        gatherers: Gatherers,
        progress: &mut ProgressCallback,
    ) -> Result<StopReason, Error> {
        let Gatherers { last, mut coarse, mut probes, bounces } = gatherers;
        for remaining in (1..settings.gather_passes).rev() {
            let gatherer = coarse.as_deref_mut().unwrap_or(&mut *last);
            if self.gather_pass(&coarser(settings, remaining), gatherer, None, progress)?
                == StopReason::Cancelled
            {
                return Ok(StopReason::Cancelled);
            }
            self.promote_to_source();
        }
        let Some(rows) = bounces else {
            return self.gather_pass(settings, last, probes, progress);
        };
        // What others receive of an edge of light is blurred. With edges 1 or 3 times as long the
        // errors of four scenes are alike, and the Cornell box on a wide plane, each group to 10 %,
        // takes 34 or 15 s.
        let min_edge = coarser(settings, 1).min_edge;
        let first = RefinementSettings { min_edge, ..settings.clone() };
        if self.gather_pass(&first, last, probes.as_deref_mut(), progress)? == StopReason::Cancelled
            || self.add_further_bounces(rows, progress) == StopReason::Cancelled
        {
            return Ok(StopReason::Cancelled);
        }
        self.refine(settings, last, probes, progress)
    }

    /// Gathers the source at all vertices; nothing is split.
    pub fn gather_all(
        &mut self,
        settings: &RefinementSettings,
        gatherer: &mut dyn Gather,
        progress: &mut ProgressCallback,
    ) -> Result<StopReason, Error> {
        if !self.has_gathered_all {
            self.samples.weights = vertex_weights(&self.samples, &self.scale, settings);
        }
        let before = self.samples.reflected.clone();
        if self.gather(&self.all_vertices(), gatherer, progress)?.is_break() {
            return Ok(StopReason::Cancelled);
        }
        self.has_gathered_all = true;
        self.relative_change = self.samples.relative_change(&before);
        Ok(StopReason::Converged)
    }

    /// Gathers the source at all vertices, then refines.
    pub fn gather_pass(
        &mut self,
        settings: &RefinementSettings,
        gatherer: &mut dyn Gather,
        probes: Option<&mut (dyn Gather + '_)>,
        progress: &mut ProgressCallback,
    ) -> Result<StopReason, Error> {
        if self.gather_all(settings, gatherer, progress)? == StopReason::Cancelled {
            return Ok(StopReason::Cancelled);
        }
        self.refine(settings, gatherer, probes, progress)
    }

    /// All further bounces: adds what they do to the values, which become the source. `maker` makes
    /// a row for each vertex.
    pub fn add_further_bounces(
        &mut self,
        maker: &dyn PointRows,
        progress: &mut ProgressCallback,
    ) -> StopReason {
        let reflected = mean_preserving(&self.samples);
        let gathered = GatheredFrom {
            samples: &self.samples,
            light: self.samples.field(&reflected),
            source: self.source.field(),
        };
        let total = self.samples.reflected.len();
        let (pass, refinements) = (self.pass + 1, self.refinements);
        let elements = self.samples.mesh.element_count();
        let added = gathered.further_bounces(
            maker,
            self.scale.touching(),
            self.scale.radiosity_floor,
            |gathered| progress(&Progress { pass, refinements, elements, gathered, total }),
        );
        let Some((added, gathered)) = added else { return StopReason::Cancelled };
        let before = self.samples.reflected.clone();
        for (value, added) in self.samples.reflected.iter_mut().zip(added) {
            *value = (*value + added).max(Rgb::ZERO);
        }
        extrapolate_into_buried(&mut self.samples);
        self.relative_change = self.samples.relative_change(&before);
        self.gather_count += gathered as u64;
        self.promote_to_source();
        self.has_all_bounces = true;
        StopReason::Converged
    }

    /// Splits the elements with most of the error and gathers at the new vertices, until what
    /// `settings` allow is left and `probes`, if there are any, were made at all that count.
    pub fn refine(
        &mut self,
        settings: &RefinementSettings,
        gatherer: &mut dyn Gather,
        mut probes: Option<&mut (dyn Gather + '_)>,
        progress: &mut ProgressCallback,
    ) -> Result<StopReason, Error> {
        let mut known = vec![None; self.samples.mesh.element_count()];
        loop {
            let element_count = self.samples.mesh.element_count();
            let mut marked = self.mark(settings, &mut known);
            if marked.is_empty() {
                let Some(gatherer) = &mut probes else { return Ok(StopReason::Converged) };
                match self.probe(settings, &mut **gatherer, progress)? {
                    ControlFlow::Break(()) => return Ok(StopReason::Cancelled),
                    ControlFlow::Continue(false) => return Ok(StopReason::Converged),
                    ControlFlow::Continue(true) => known.fill(None),
                }
                continue;
            }
            // Each split adds three elements.
            let room = settings.max_elements.saturating_sub(element_count) / 3;
            marked.truncate(room);
            if marked.is_empty() {
                return Ok(StopReason::Elements);
            }
            marked.sort_unstable();
            let new_vertices = self.samples.split(&marked)?;
            self.probes.split(&marked);
            known = after_split(&known, &marked, None);
            self.refinements += 1;
            if self.gather(&new_vertices, gatherer, progress)?.is_break() {
                return Ok(StopReason::Cancelled);
            }
        }
    }

    /// Probes elements that were not probed, can be split and are not much smaller than the mean:
    /// whether there were any, or that `progress` stopped it.
    fn probe(
        &mut self,
        settings: &RefinementSettings,
        gatherer: &mut dyn Gather,
        progress: &mut ProgressCallback,
    ) -> Result<ControlFlow<(), bool>, Error> {
        let elements = self.samples.mesh.element_count();
        let counted = |e| counted_area(&self.samples, &self.scale, settings, e);
        let counted: Vec<f64> = (0..elements).into_par_iter().map(counted).collect();
        let mean = counted.iter().sum::<f64>() / elements as f64;
        let counts = |&e: &usize| {
            let is_unprobed = !self.probes.is_probed(e) && self.samples.is_splittable(e);
            // The smaller ones are many, and a tenth of the area together.
            is_unprobed && counted[e] > 0.3 * mean
        };
        let unprobed: Vec<usize> = (0..elements).filter(counts).collect();
        let (source, scale) = (self.source.field(), &self.scale);
        let mut queue = &unprobed[..];
        let mut batches = Batches::new(gatherer.preferred_batch_len());
        while !queue.is_empty() {
            let (samples, probes) = (&self.samples, &mut self.probes);
            let (batch, errors) = batches
                .try_next(&mut queue, |batch| probe(samples, batch, &source, scale, gatherer))?;
            probes.set(batch, &errors);
            let report = Progress {
                pass: self.pass,
                refinements: self.refinements,
                elements,
                gathered: unprobed.len() - queue.len(),
                total: unprobed.len(),
            };
            if progress(&report).is_break() {
                return Ok(ControlFlow::Break(()));
            }
        }
        Ok(ControlFlow::Continue(!unprobed.is_empty()))
    }

    /// The elements that are to be split, those with the largest share of the squared error first:
    /// as many as it takes for the sum to be what `settings` allow, as far as it is known
    /// beforehand. What is far from the light has a sum of its own, as has each group where these
    /// have scales of their own.
    ///
    /// What is not `known` yet of an element, its pool and its share, is added; not where a buried
    /// vertex has a part in it, since its value follows new neighbours.
    fn mark(
        &self,
        settings: &RefinementSettings,
        known: &mut [Option<(usize, Share)>],
    ) -> Vec<usize> {
        let mesh = &self.samples.mesh;
        if self.refinements < settings.initial_subdivisions {
            let all = 0..mesh.element_count();
            return all.filter(|&e| self.samples.is_splittable(e)).collect();
        }
        // Of the light that was shot: vertices may have missed some of it.
        let shot = self.source.shot();
        let share_of = |element: usize| {
            let (samples, scale) = (&self.samples, &self.scale);
            let probed = self.probes.error(element);
            let square = squared_error(samples, &shot, scale, settings, element, probed);
            // The measure leaves out what is hidden.
            let area = match samples.is_hidden(element) {
                true => 0.0,
                false => counted_area(samples, scale, settings, element),
            };
            let node = mesh.element(element);
            let pool = match settings.group_scales.is_empty() {
                true => usize::from(scale.is_far(mesh, node)),
                false => mesh.group(node) as usize,
            };
            (pool, Share { square, area, element }, has_buried_node(samples, element))
        };
        let unknown: Vec<usize> = (0..known.len()).filter(|&e| known[e].is_none()).collect();
        let found = work::map(unknown.len(), |k| share_of(unknown[k]));
        let in_place = |(element, known): (usize, &Option<(usize, Share)>)| {
            known.map(|(pool, share)| (pool, Share { element, ..share }))
        };
        let mut shares: Vec<Option<(usize, Share)>> =
            known.iter().enumerate().map(in_place).collect();
        for (&element, (pool, share, is_temporary)) in unknown.iter().zip(found) {
            shares[element] = Some((pool, share));
            known[element] = shares[element].filter(|_| !is_temporary);
        }
        let shares: Vec<(usize, Share)> = shares.into_iter().flatten().collect();
        let pools = shares.iter().map(|&(pool, _)| pool + 1).max().unwrap_or(0);
        let mut by_pool: Vec<Vec<Share>> = vec![vec![]; pools];
        for (pool, share) in shares {
            by_pool[pool].push(share);
        }
        let (allowed, tail) = (settings.mesh_error.powi(2), self.scale.tail);
        let mut marked: Vec<(f64, usize)> =
            by_pool.into_iter().flat_map(|shares| bulk_above(shares, allowed, tail)).collect();
        marked.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        marked.into_iter().map(|(_, element)| element).collect()
    }

    /// Gathers the source at `vertices`, and gives buried ones extrapolated values.
    ///
    /// A vertex whose gather point is buried is tried again in another element around it, after
    /// all the others.
    fn gather(
        &mut self,
        vertices: &[u32],
        gatherer: &mut dyn Gather,
        progress: &mut ProgressCallback,
    ) -> Result<ControlFlow<()>, Error> {
        let SampledMesh {
            mesh,
            vertices: mesh_vertices,
            reflected,
            noise,
            weights,
            buried,
            hidden,
            direct,
            ..
        } = &mut self.samples;
        let light = self.directional_light.as_deref();
        let points = VertexGatherPoints::new(mesh, mesh_vertices, self.scale.touching());
        let source = self.source.field();
        let gathers = |&v: &u32| points.albedo(v) != Rgb::ZERO;
        let mut pending: Vec<u32> = vertices.iter().copied().filter(gathers).collect();
        let total = pending.len();
        let mut gathered = 0;
        let mut batches = Batches::new(gatherer.preferred_batch_len());
        let mut attempt = 0;
        while !pending.is_empty() {
            let mut retries = vec![];
            let mut queue = &pending[..];
            while !queue.is_empty() {
                let (vertices, samples) = batches.try_next(&mut queue, |vertices| {
                    let point = |&v: &u32| points.point(v, attempt).weighing(weights[v as usize]);
                    let points: Vec<TwoSidedPoint> = vertices.par_iter().map(point).collect();
                    gather_two_sided(gatherer, &source, &points)
                })?;
                let batch = Batch { vertices, samples };
                let unresolved = batch.unresolved(&points, attempt);
                gathered += batch.vertices.len() - unresolved.len();
                retries.extend(unresolved);
                let mut values = VertexValues { reflected, noise, buried, hidden, direct };
                batch.apply(&points, attempt, &self.scale.region, light, &mut values);
                self.gather_count += batch.vertices.len() as u64;
                let report = Progress {
                    pass: self.pass,
                    refinements: self.refinements,
                    elements: mesh.element_count(),
                    gathered,
                    total,
                };
                if progress(&report).is_break() {
                    return Ok(ControlFlow::Break(()));
                }
            }
            pending = retries;
            attempt += 1;
        }
        extrapolate_into_buried(&mut self.samples);
        Ok(ControlFlow::Continue(()))
    }

    fn all_vertices(&self) -> Vec<u32> {
        (0..self.samples.reflected.len() as u32).collect()
    }
}

/// `settings` of a pass with `passes` after it: thrice the error of the mesh and the shortest edge
/// for each.
fn coarser(settings: &RefinementSettings, passes: u32) -> RefinementSettings {
    let coarsening = 3f64.powi(passes as i32);
    RefinementSettings {
        mesh_error: (settings.mesh_error * coarsening).min(1.0),
        min_edge: settings.min_edge * coarsening,
        ..settings.clone()
    }
}

/// Share of the squared error of an element that its children lose: of a jump half, of smooth light
/// 15/16. With 0.5 and 0.75, eight scenes to 10 % took 0.97 and 0.91 of the time (geometric mean)
/// that they took where the tail counted too and each round split a thousandth of the elements at
/// least (17 to 92 rounds, now 4 to 18).
const LOST_BY_SPLIT: f64 = 0.75;

/// The share of an element in the error of its mesh.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct Share {
    /// Squared error times area.
    square: f64,
    area: f64,
    element: usize,
}

/// Those of the elements that are to be split for the mean square over all but the `tail`, a share
/// of the area, to fall to what is `allowed`, with their shares in it; of many the worst, which
/// make up most of it. What is in the tail counts for nothing, but is split where it is among the
/// worst, since it is seen.
fn bulk_above(shares: Vec<Share>, allowed: f64, tail: f64) -> Vec<(f64, usize)> {
    let area = shares.iter().map(|share| share.area).sum::<f64>();
    // Of what is unknown, nothing says that it is in the tail.
    let error = |share: &Share| {
        let is_known = share.square.is_finite() && share.area > 0.0;
        (share.area, if is_known { share.square / share.area } else { 0.0 })
    };
    let errors: Vec<(f64, f64)> = shares.iter().map(error).collect();
    let kept = trimmed(&errors, tail).kept;
    // What counts of each: nothing of what is unknown.
    let counted = |(share, kept): (Share, f64)| match share.square.is_finite() {
        true => (share, kept * share.square),
        false => (share, 0.0),
    };
    let mut shares: Vec<(Share, f64)> = shares.into_iter().zip(kept).map(counted).collect();
    let total: f64 = shares.iter().map(|(_, counted)| counted).sum();
    shares.retain(|(share, _)| share.square > 0.0);
    let order = |(a, _): &(Share, f64), (b, _): &(Share, f64)| {
        b.square.total_cmp(&a.square).then(a.element.cmp(&b.element))
    };
    // Dörfler (1996): 80 % of the error is split at a time, since the next gather may change the
    // rest.
    let (mut excess, mut bulk) = (total - allowed * (1.0 - tail) * area, 0.8 * total);
    let is_marked = move |(share, counted): &(Share, f64)| {
        let is_marked = !share.square.is_finite() || (excess > 0.0 && bulk > 0.0);
        excess -= LOST_BY_SPLIT * counted;
        bulk -= counted;
        is_marked
    };
    let marked = in_order(shares, order).take_while(is_marked);
    marked.map(|(share, _)| (share.square / area, share.element)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::cpu::RayGather;

    #[test]
    fn worst_elements_are_split_until_rest_is_allowed() {
        let share =
            |(element, square): (usize, &f64)| Share { square: *square, area: 1.0, element };
        let marked = |squares: &[f64], allowed: f64| -> Vec<usize> {
            let shares = squares.iter().enumerate().map(share).collect();
            bulk_above(shares, allowed, 0.0).into_iter().map(|(_, element)| element).collect()
        };
        let squares = [1.0, 8.0, 0.0, 4.0, 2.0];
        // Mean 3: of it 8 and 4 are the bulk, 80 %.
        assert_eq!(marked(&squares, 0.1), [1, 3]);
        assert_eq!(marked(&squares, 1.9), [1], "three quarters of 8 are enough: 9 of 15 are left");
        assert_eq!(marked(&squares, 1.7), [1, 3], "9 are more than 8.5");
        assert!(marked(&squares, 3.0).is_empty(), "no more than is allowed");
        assert_eq!(marked(&[1.0, f64::INFINITY], 3.0), [1], "nothing is known of it");
        // A fifth of the area is the tail: 8. The mean of the others is 7/4.
        let without_tail = |allowed: f64| {
            let shares = squares.iter().enumerate().map(share).collect();
            bulk_above(shares, allowed, 0.2).len()
        };
        assert_eq!(without_tail(1.76), 0);
        assert_eq!(without_tail(1.74), 2, "the worst, which is in the tail, and the worst outside");
    }

    #[test]
    fn vertices_that_exchange_bounces_gather_once() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj");
        let mesh = Mesh::new(crate::load_scene(path).unwrap(), 150.0).unwrap();
        let radiosity: Vec<Rgb> = (0..mesh.element_count()).map(|e| mesh.exitance(e)).collect();
        let light = GatheredMesh::from_elements(&mesh, &radiosity).unwrap();
        let mut rays = RayGather::new(&mesh, 16).unwrap();
        let rows = RayGather::new(&mesh, 16).unwrap();
        let mut state =
            AdaptiveGather::new(mesh, &light.radiosity_field(), None, Measure::default());
        let gatherers =
            Gatherers { last: &mut rays, coarse: None, probes: None, bounces: Some(&rows) };
        let settings = RefinementSettings::new(1e9);
        let proceed = &mut |_: &Progress| ControlFlow::Continue(());
        let mut once = state.clone();
        once.gather_all(&settings, &mut RayGather::new(&once.samples.mesh, 16).unwrap(), proceed)
            .unwrap();
        state.run_passes(&settings, gatherers, proceed).unwrap();
        // And has a row; a few points of the first are tried again in other elements.
        let counts = [state.gather_count, once.gather_count];
        assert!(once.vertices() as u64 <= counts[1] && counts[0] <= 2 * counts[1], "{counts:?}");
        assert_eq!(state.bounces(), f64::INFINITY);
    }

    #[test]
    fn further_bounces_are_those_of_passes() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj");
        let mesh = Mesh::new(crate::load_scene(path).unwrap(), 150.0).unwrap();
        let emitted = |e| mesh.exitance(e);
        let radiosity: Vec<Rgb> = (0..mesh.element_count()).map(emitted).collect();
        let light = GatheredMesh::from_elements(&mesh, &radiosity).unwrap();
        // Nothing is split: vertices keep their gather points.
        let settings = RefinementSettings::new(1e9);
        let mut rays = RayGather::new(&mesh, 256).unwrap();
        let mut proceed = |_: &Progress| ControlFlow::Continue(());
        let mut at_once =
            AdaptiveGather::new(mesh, &light.radiosity_field(), None, Measure::default());
        at_once.gather_pass(&settings, &mut rays, None, &mut proceed).unwrap();
        let mut by_passes = at_once.clone();
        let first = at_once.samples.reflected.clone();
        let stop = at_once.add_further_bounces(&rays, &mut proceed);
        assert_eq!((stop, at_once.bounces()), (StopReason::Converged, f64::INFINITY));
        // 0.8 is the largest albedo: 0.8^30 = 1e-3 of a bounce are left.
        for _ in 0..30 {
            by_passes.promote_to_source();
            let all = by_passes.all_vertices();
            let _ = by_passes.gather(&all, &mut rays, &mut proceed).unwrap();
        }
        let (mut off, mut added, mut total) = (0.0, 0.0, 0.0);
        for (v, first) in first.iter().enumerate() {
            let [a, b] = [&at_once, &by_passes].map(|state| state.samples.reflected[v]);
            off += a.distance_squared(b);
            added += b.distance_squared(*first);
            total += b.length_squared();
        }
        let [off, added] = [off, added].map(|sum| f64::sqrt(sum / total));
        println!("off by {off:.5} where bounces add {added:.5}");
        // Light of later bounces is taken as that of the nearest corner, by the same rays.
        assert!(added > 0.3 && off < 0.03 * added, "{off} {added}");
    }
}
