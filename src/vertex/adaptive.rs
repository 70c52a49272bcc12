//! The state of gathering: a mesh that grows finer, and what its vertices reflect.

use std::borrow::Cow;
use std::collections::HashSet;
use std::ops::ControlFlow;

use glam::DVec3;

use super::VertexMesh;
use super::gather_points::VertexGatherPoints;
use super::gathering::{GatherProgress, GatheredMesh, RefinementSettings};
use super::hanging_nodes::HangingNodes;
use super::keys::Vertices;
use crate::error::Error;
use crate::gather::{Gather, GatherPoint};
use crate::mesh::{Mesh, SurfaceTopology};
use crate::progress::BatchSizer;
use crate::progress::StopReason;
use crate::scene::Rgb;

#[derive(Clone)]
pub(crate) struct AdaptiveGather<'a> {
    /// What shines on the vertices.
    pub(super) light: Cow<'a, GatheredMesh>,
    pub(super) mesh: Mesh,
    pub(super) smooth: SurfaceTopology,
    pub(super) vertices: Vertices,
    /// Reflected radiosity at the vertices, W/m².
    pub(super) reflected: Vec<Rgb>,
    /// Whether a vertex lies under something that touches its surface.
    pub(super) covered: Vec<bool>,
    /// How far the last sweep was from what was known before it, relative.
    change: f64,
    /// Times that what was reached has shone.
    sweep: u32,
    /// Times that elements have been split.
    level: u32,
    /// Places at which light was gathered.
    gathers: u64,
    /// Radiosity that is as good as none, W/m².
    pub(super) dim: f64,
    /// Longest edge of the elements to begin with, scene unit.
    pub(super) largest: f64,
    /// Sides across which a smooth surface goes on.
    pub(super) joined: HashSet<u32>,
}

/// Vertices that gather at once, to begin with: progress is told of after each batch.
const BATCH: usize = 256;

/// Where less than this share of the mean is reflected, errors are weighed against the share: the
/// insides of gaps are not worth most of the elements.
const DIM: f64 = 0.05;

impl<'a> AdaptiveGather<'a> {
    /// Starts on `mesh` from what `light`, of the same scene, has at its vertices.
    pub fn new(mesh: Mesh, light: &'a GatheredMesh) -> AdaptiveGather<'a> {
        let smooth = SurfaceTopology::new(mesh.scene());
        let vertices = Vertices::new(&mesh, &smooth);
        let sources = light.sources();
        let at = |&(t, [u, v]): &(usize, [f64; 2])| sources.reflected_at(t, u, v);
        let reflected: Vec<Rgb> = vertices.places.iter().map(at).collect();
        let (mut flux, mut area) = (0.0, 0.0);
        for (e, corners) in light.corners.iter().enumerate() {
            let size = light.mesh.area(light.mesh.element(e));
            let mean = corners.iter().map(|&v| light.reflected[v as usize]).sum::<Rgb>() / 3.0;
            (flux, area) = (flux + mean.length() * size, area + size);
        }
        let edge = |e| mesh.longest_edge(mesh.element(e));
        let largest = (0..mesh.element_count()).map(edge).fold(0.0, f64::max);
        let (covered, dim) = (vec![false; reflected.len()], DIM * flux / area);
        let joined = smooth.shared_edges().map(|[(t, k), _]| smooth.sides[t][k].id).collect();
        let (light, sweep, level, gathers) = (Cow::Borrowed(light), 0, 0, 0);
        AdaptiveGather {
            light,
            mesh,
            smooth,
            vertices,
            reflected,
            covered,
            change: 0.0,
            sweep,
            level,
            gathers,
            dim,
            largest,
            joined,
        }
    }

    /// What was reached.
    pub fn reached(&self) -> GatheredMesh {
        GatheredMesh {
            mesh: self.mesh.clone(),
            surface: self.surface(),
            corners: self.vertices.corners.clone(),
            reflected: self.seen(),
            gathers: self.gathers,
            change: self.change,
            stop: StopReason::Converged,
        }
    }

    /// Lets what was reached shine from now on.
    pub fn shine(&mut self) {
        self.light = Cow::Owned(self.reached());
        self.sweep += 1;
    }

    /// Root mean square over the elements of how far their vertices are from `before`, relative.
    fn distance(&self, before: &[Rgb]) -> f64 {
        let (mut off, mut all) = (0.0, 0.0);
        for (e, corners) in self.vertices.corners.iter().enumerate() {
            let area = self.mesh.area(self.mesh.element(e));
            for &v in corners {
                off += area * (self.reflected[v as usize] - before[v as usize]).length_squared();
                all += area * self.reflected[v as usize].length_squared();
            }
        }
        if all > 0.0 { (off / all).sqrt() } else { 0.0 }
    }

    /// Lets the vertices `fresh` gather what shines; given what shone `before`, only what is more or
    /// less now.
    fn gather(
        &mut self,
        fresh: &[u32],
        before: Option<&GatheredMesh>,
        gather: &mut dyn Gather,
        progress: &mut dyn FnMut(&GatherProgress) -> ControlFlow<()>,
    ) -> Result<ControlFlow<()>, Error> {
        let stands = VertexGatherPoints::new(&self.mesh, &self.vertices);
        // What reflects nothing need not look, and what is covered does not change.
        let looks = |&v: &u32| {
            stands.reflectance(v) != Rgb::ZERO && !(before.is_some() && self.covered[v as usize])
        };
        let mut left: Vec<u32> = fresh.iter().copied().filter(looks).collect();
        let sources = self.light.sources();
        let (of, mut gathered, mut pace) = (left.len(), 0, BatchSizer::new(BATCH));
        for attempt in 0.. {
            let mut again = vec![];
            let mut rest = &left[..];
            while !rest.is_empty() {
                let (batch, found, old) = pace.next(&mut rest, |batch| {
                    let places: Vec<GatherPoint> =
                        batch.iter().map(|&v| stands.place(v, attempt)).collect();
                    let found = gather.gather(&sources, &places)?;
                    let old = before.map(|light| gather.gather(&light.sources(), &places));
                    Ok::<_, Error>((batch, found, old.transpose()?))
                })?;
                self.gathers += batch.len() as u64;
                for (k, (&v, found)) in batch.iter().zip(&found).enumerate() {
                    let covered = stands.is_covered(v, found);
                    if covered && stands.has_more(v, attempt) {
                        again.push(v);
                    } else {
                        gathered += 1;
                    }
                    let reflected = &mut self.reflected[v as usize];
                    let reflectance = stands.reflectance(v);
                    match &old {
                        Some(_) if covered => {}
                        Some(old) => {
                            let more = reflectance * (found.irradiance - old[k].irradiance);
                            *reflected = (*reflected + more).max(Rgb::ZERO);
                        }
                        None => {
                            self.covered[v as usize] = covered;
                            if !covered {
                                *reflected = reflectance * found.irradiance;
                            }
                        }
                    }
                }
                let elements = self.mesh.element_count();
                let (sweep, level) = (self.sweep, self.level);
                if progress(&GatherProgress { sweep, level, elements, gathered, of }).is_break() {
                    return Ok(ControlFlow::Break(()));
                }
            }
            left = again;
            if left.is_empty() {
                break;
            }
        }
        self.uncover();
        Ok(ControlFlow::Continue(()))
    }

    /// Lets all vertices gather what shines, then splits and gathers on.
    pub fn sweep(
        &mut self,
        settings: &RefinementSettings,
        gather: &mut dyn Gather,
        progress: &mut dyn FnMut(&GatherProgress) -> ControlFlow<()>,
    ) -> Result<StopReason, Error> {
        let (before, all) = (self.reflected.clone(), 0..self.reflected.len() as u32);
        if self.gather(&all.collect::<Vec<_>>(), None, gather, progress)?.is_break() {
            return Ok(StopReason::Cancelled);
        }
        self.change = self.distance(&before);
        self.refine(settings, gather, progress)
    }

    /// Lets what was reached shine, and all vertices gather how much more or less that is than what
    /// shone before: little, so that few looks at both will do.
    pub fn settle(
        &mut self,
        gather: &mut dyn Gather,
        progress: &mut dyn FnMut(&GatherProgress) -> ControlFlow<()>,
    ) -> Result<StopReason, Error> {
        let (known, all) = (self.reflected.clone(), 0..self.reflected.len() as u32);
        let now = Cow::Owned(self.reached());
        let before = std::mem::replace(&mut self.light, now);
        self.sweep += 1;
        let go = self.gather(&all.collect::<Vec<_>>(), Some(&before), gather, progress)?;
        self.change = self.distance(&known);
        Ok(if go.is_break() { StopReason::Cancelled } else { StopReason::Converged })
    }

    /// Splits elements where the light bends by more than `settings` allow, and lets the new vertices
    /// gather, until it does nowhere.
    pub fn refine(
        &mut self,
        settings: &RefinementSettings,
        gather: &mut dyn Gather,
        progress: &mut dyn FnMut(&GatherProgress) -> ControlFlow<()>,
    ) -> Result<StopReason, Error> {
        let mut young: Vec<usize> = (0..self.mesh.element_count()).collect();
        let mut crowded = false;
        loop {
            let room = settings.elements.saturating_sub(self.mesh.element_count()) / 3;
            let mut bent: Vec<(f64, usize)> = if self.level < settings.everywhere {
                young.iter().map(|&e| (1.0, e)).filter(|b| self.splits(b.1)).collect()
            } else {
                young.iter().map(|&e| (self.bend(e, settings), e)).filter(|b| b.0 > 1.0).collect()
            };
            if bent.is_empty() && young.len() < self.mesh.element_count() {
                // What covered vertices were given depends on others that came later.
                young = (0..self.mesh.element_count()).collect();
                continue;
            }
            if bent.is_empty() {
                return Ok(if crowded { StopReason::Elements } else { StopReason::Converged });
            }
            if bent.len() > room {
                crowded = true;
                bent.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
                bent.truncate(room);
            }
            if bent.is_empty() {
                return Ok(StopReason::Elements);
            }
            let mut split: Vec<usize> = bent.into_iter().map(|b| b.1).collect();
            split.sort_unstable();
            let fresh;
            (fresh, young) = self.split(&split)?;
            if self.gather(&fresh, None, gather, progress)?.is_break() {
                return Ok(StopReason::Cancelled);
            }
        }
    }

    /// Whether element `e` can be split at all.
    pub(super) fn splits(&self, e: usize) -> bool {
        let node = self.mesh.element(e);
        self.mesh.cell(node).level < Mesh::MAX_DEPTH
            && self.mesh.material(node).reflectance != Rgb::ZERO
    }

    /// Radiosity that is as good as none, W/m².
    pub fn dim(&self) -> f64 {
        self.dim
    }

    /// What shines on the vertices.
    pub fn light(&self) -> &GatheredMesh {
        &self.light
    }

    /// Splits `elements`, which ascend. Gives the vertices that are new, which have the mean of those
    /// that they lie between, and the elements that are.
    pub(super) fn split(&mut self, elements: &[usize]) -> Result<(Vec<u32>, Vec<usize>), Error> {
        let finer = self.mesh.split(elements)?;
        self.level += 1;
        let vertices = Vertices::new(&finer, &self.smooth);
        let count = vertices.positions.len();
        let (mut reflected, mut covered) = (vec![Rgb::ZERO; count], vec![false; count]);
        let mut fresh = vec![];
        for (v, key) in vertices.keys.iter().enumerate() {
            match self.vertices.find(key) {
                Some(old) => {
                    reflected[v] = self.reflected[old as usize];
                    covered[v] = self.covered[old as usize];
                }
                None => fresh.push(v as u32),
            }
        }
        let is_new = |v: usize| self.vertices.find(&vertices.keys[v]).is_none();
        let mut young = vec![];
        for (k, &e) in elements.iter().enumerate() {
            // Each split before this one has put four elements in the place of one.
            young.extend(e + 3 * k..e + 3 * k + 4);
            let [a, b, c] = self.vertices.corners[e].map(|v| self.reflected[v as usize]);
            // The corners of the fourth part are the middles of the sides opposite a, b and c.
            let middles = vertices.corners[e + 3 * k + 3].map(|v| v as usize);
            for (m, mean) in middles.into_iter().zip([b + c, c + a, a + b]) {
                if is_new(m) {
                    reflected[m] = mean / 2.0;
                }
            }
        }
        (self.mesh, self.vertices) = (finer, vertices);
        (self.reflected, self.covered) = (reflected, covered);
        Ok((fresh, young))
    }

    /// The mesh with what its vertices emit and reflect.
    fn surface(&self) -> VertexMesh {
        let count = self.vertices.positions.len();
        let mut out = VertexMesh {
            positions: self.vertices.positions.clone(),
            normals: vec![DVec3::ZERO; count],
            radiosity: vec![Rgb::ZERO; count],
            ..Default::default()
        };
        for (e, rim) in self.vertices.rims.iter() {
            let node = self.mesh.element(e);
            let emitted = self.mesh.material(node).exitance;
            for v in rim.iter().map(|&v| v as usize) {
                out.normals[v] += self.mesh.normal(node) * self.mesh.area(node);
                out.radiosity[v] = emitted + self.reflected[v];
            }
        }
        out.normals.iter_mut().for_each(|n| *n = n.normalize_or_zero());
        let seams = HangingNodes::new(&self.mesh, &self.smooth, &self.vertices);
        out.add_elements(&self.mesh, &seams, |out, e| {
            let corners = self.vertices.corners[e].map(|v| out.radiosity[v as usize]);
            corners.iter().sum::<Rgb>() / 3.0
        });
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::cpu::RayGather;

    #[test]
    fn what_changed_is_all_there_is_to_gather() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj");
        let mesh = Mesh::new(crate::load_obj(path).unwrap(), 150.0).unwrap();
        let emitted = |e| mesh.material(mesh.element(e)).exitance;
        let radiosity: Vec<Rgb> = (0..mesh.element_count()).map(emitted).collect();
        let light = GatheredMesh::from_elements(&mesh, &radiosity).unwrap();
        // Nothing is split: a vertex stands where it stood.
        let settings = RefinementSettings::new(1e9);
        let mut gather = RayGather::new(&mesh, 256).unwrap();
        let mut go = |_: &GatherProgress| ControlFlow::Continue(());
        let mut state = AdaptiveGather::new(mesh, &light);
        state.sweep(&settings, &mut gather, &mut go).unwrap();
        let first = state.reflected.clone();
        let mut other = state.clone();
        state.settle(&mut gather, &mut go).unwrap();
        // The same looks at all that shines, on the same mesh.
        other.shine();
        let all: Vec<u32> = (0..first.len() as u32).collect();
        let _ = other.gather(&all, None, &mut gather, &mut go).unwrap();
        let whole = first.iter().map(|b| b.length()).fold(0.0, f64::max);
        let mut changed = 0.0f64;
        for (v, before) in first.iter().enumerate() {
            let [a, b] = [state.reflected[v], other.reflected[v]];
            // Sums of 256 rays, rounded in another order; covered ones follow from their neighbours.
            assert!(a.distance(b) < 1e-12 * whole, "vertex {v}: {a} {b}");
            changed = changed.max(a.distance(*before));
        }
        assert!(changed > 0.05 * whole, "a second bounce is a change: {changed} of {whole}");
        assert!(state.change > 0.05);
    }
}
