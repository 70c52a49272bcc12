//! The patches that shoot: a cut through the hierarchy of clusters, triangles and their quadtrees,
//! finer where more light leaves.
//!
//! A patch is a cluster of triangles, a triangle, or a node of its quadtree. It shoots for all
//! elements below it along one row, seen from one viewpoint. The cut begins with the largest
//! patches. Before a patch shoots, its error ([`patch_error`](super::patch_error)) is compared with
//! the tolerance; above it, the patch is replaced by its parts:
//!
//! ```text
//! clusters            ●                      ●
//!                   ╱   ╲                  ╱   ╲
//! triangles       ●───────●──── cut ──╮   ●     ●
//!               ╱╱╲╲    ╱╱╲╲          ╰──●●●●──●●●●
//! elements      ○○○○    ○○○○             ○○○○  ○○○○
//! ```
//!
//! The cut is only ever refined. A viewpoint whose row shows that it is inside a solid is rejected,
//! and another point of the patch is used.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashSet};
use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::flux_state::Flux;
use super::patch_error::{InverseDistanceMoments, Surfaces, patch_error};
use crate::form_factor::Row;
use crate::geometry::rounding::tie_stable_key;
use crate::mesh::{Clusters, Mesh, NodeId};
use crate::scene::Rgb;
use crate::visibility::buried;

/// The patches that shoot. Together they cover every element once.
#[derive(Clone)]
pub(super) struct PatchCut<'m> {
    surfaces: Surfaces<'m>,
    clusters: &'m Clusters,
    patches: Vec<ShootingPatch>,
    /// Viewpoints that see mostly back faces.
    occluded_viewpoints: HashSet<NodeId>,
    /// Maximum error of a patch that shoots.
    tolerance: f64,
    /// Quadtree levels above the elements below which no patch is split.
    min_level: u32,
}

/// A patch that shoots.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct ShootingPatch {
    source: Source,
    /// Elements below it, as disjoint ranges that do not touch.
    #[serde(skip)]
    elements: Vec<Range<usize>>,
    /// The node whose row it shoots along; set before the first shot.
    viewpoint: Option<NodeId>,
    distances: InverseDistanceMoments,
    /// Whether it emits and has not shot yet.
    is_unshot_emitter: bool,
    /// Number of its viewpoints that saw mostly back faces.
    rejected_viewpoints: u32,
}

/// Position of a patch in the hierarchy.
#[derive(Clone, Copy, Serialize, Deserialize)]
enum Source {
    Cluster(u32),
    Node(NodeId),
}

/// A cut as it is saved.
#[derive(Serialize, Deserialize)]
pub(super) struct CutSnapshot {
    pub patches: Vec<ShootingPatch>,
    occluded_viewpoints: Vec<NodeId>,
}

/// A shot to be taken.
pub(super) struct Shot {
    /// Index of the patch in the cut.
    index: usize,
    /// The node whose row is used.
    pub patch: NodeId,
    /// The elements whose flux is shot.
    pub elements: Vec<Range<usize>>,
}

impl<'m> PatchCut<'m> {
    fn empty(mesh: &'m Mesh, tolerance: f64, min_level: u32) -> PatchCut<'m> {
        PatchCut {
            surfaces: Surfaces::of(mesh),
            clusters: mesh.clusters(),
            patches: vec![],
            occluded_viewpoints: HashSet::new(),
            tolerance,
            min_level,
        }
    }

    /// The largest patches; but if emitters are few, each of their elements is a patch, since the
    /// light near a lamp depends strongly on its shape.
    pub fn new(mesh: &'m Mesh, tolerance: f64, min_level: u32) -> PatchCut<'m> {
        let mut cut = PatchCut::empty(mesh, tolerance, min_level);
        let triangles = 0..mesh.scene().triangles().len();
        let distances = InverseDistanceMoments::in_cube_of_area(cut.surfaces.area);
        let emits = |t: usize| mesh.scene().material(t).exitance != Rgb::ZERO;
        let emitter_elements: usize =
            triangles.filter(|&t| emits(t)).map(|t| mesh.elements_of(mesh.root(t)).len()).sum();
        // With more, the emitters are glowing rooms rather than lamps. Plain choice.
        let emitters_are_few = emitter_elements <= 1024;
        for &root in cut.clusters.roots() {
            let triangles = cut.clusters.triangles(root);
            // All triangles of a cluster have one material.
            let is_emitter = emits(triangles[0] as usize);
            let sources = if is_emitter && emitters_are_few {
                let nodes = triangles.iter().map(|&t| mesh.root(t as usize));
                let elements = nodes.flat_map(|root| mesh.elements_of(root));
                elements.map(|e| Source::Node(mesh.element(e))).collect()
            } else {
                vec![Source::Cluster(root)]
            };
            for source in sources {
                let mut patch = cut.patch(source, distances);
                patch.is_unshot_emitter = is_emitter;
                cut.patches.push(patch);
            }
        }
        cut
    }

    /// The saved form of the cut.
    pub fn snapshot(&self) -> CutSnapshot {
        let mut occluded_viewpoints: Vec<NodeId> =
            self.occluded_viewpoints.iter().copied().collect();
        occluded_viewpoints.sort_unstable();
        CutSnapshot { patches: self.patches.clone(), occluded_viewpoints }
    }

    /// The cut that was saved, if it is a valid cut through `mesh`.
    pub fn from_snapshot(
        mesh: &'m Mesh,
        tolerance: f64,
        min_level: u32,
        saved: CutSnapshot,
    ) -> Option<PatchCut<'m>> {
        let mut cut = PatchCut::empty(mesh, tolerance, min_level);
        let mut is_covered = vec![false; mesh.element_count()];
        for patch in saved.patches {
            let source_exists = match patch.source {
                Source::Cluster(c) => (c as usize) < cut.clusters.count(),
                Source::Node(node) => mesh.contains(node),
            };
            let viewpoint_exists = patch.viewpoint.is_none_or(|node| mesh.contains(node));
            if !source_exists || !viewpoint_exists || !patch.distances.is_consistent() {
                return None;
            }
            let elements = cut.patch(patch.source, patch.distances).elements;
            for e in indices(&elements) {
                if std::mem::replace(&mut is_covered[e], true) {
                    return None;
                }
            }
            cut.patches.push(ShootingPatch { elements, ..patch });
        }
        cut.occluded_viewpoints = saved.occluded_viewpoints.into_iter().collect();
        let viewpoints_exist = cut.occluded_viewpoints.iter().all(|&node| mesh.contains(node));
        (is_covered.into_iter().all(|c| c) && viewpoints_exist).then_some(cut)
    }

    /// Switches to `mesh`, whose elements are the same.
    pub fn set_mesh(&mut self, mesh: &'m Mesh) {
        self.surfaces = Surfaces::of(mesh);
        self.clusters = mesh.clusters();
    }

    /// Rejects the viewpoint `node`, which now sees mostly back faces, so that its patch shoots
    /// from another. Returns the elements of that patch, or `None` if it has no other point.
    pub fn reject_viewpoint(&mut self, node: NodeId) -> Option<Vec<usize>> {
        let patch = self.patches.iter_mut().find(|patch| patch.viewpoint == Some(node))?;
        let elements: Vec<usize> = indices(&patch.elements).collect();
        if elements.len() == 1 {
            return None;
        }
        patch.viewpoint = None;
        self.occluded_viewpoints.insert(node);
        Some(elements)
    }

    /// The next shots, by descending unshot flux; emitters before all others. Ends at `max_rows`
    /// patches for which `is_missing` says that the row must be computed, at `max_shots`, or where
    /// the flux falls below a quarter of the first's (plain choice), so that no dim patch shoots
    /// before a bright one has received its light.
    pub fn next_shots(
        &mut self,
        flux: &Flux,
        max_rows: usize,
        max_shots: u64,
        is_missing: impl Fn(NodeId) -> bool,
    ) -> Vec<Shot> {
        // Ties go to the first in the cut.
        let entry = |patch: &ShootingPatch, k: usize| {
            let share = flux.unshot_share(&patch.elements);
            (share > 0.0).then(|| (patch.is_unshot_emitter, tie_stable_key(share), Reverse(k)))
        };
        let all = self.patches.par_iter().enumerate().filter_map(|(k, patch)| entry(patch, k));
        let mut queue = BinaryHeap::from(all.collect::<Vec<_>>());
        let mut rows_left = max_rows.max(1);
        let mut shots: Vec<Shot> = vec![];
        // Of the first shot: whether the patch is an emitter, and the minimum flux of the others.
        let mut batch_limits = None;
        while let Some((is_emitter, share, Reverse(k))) = queue.pop() {
            let (emitters, min_share) = *batch_limits.get_or_insert_with(|| {
                let share = flux.unshot_share(&self.patches[k].elements);
                (is_emitter, tie_stable_key(0.25 * share))
            });
            let is_full = shots.len() as u64 >= max_shots;
            if is_emitter != emitters || share < min_share || is_full {
                break;
            }
            let count = self.patches.len();
            if self.split(k, flux) {
                let parts = [k].into_iter().chain(count..self.patches.len());
                queue.extend(parts.filter_map(|k| entry(&self.patches[k], k)));
                // The limits are those of the first patch that shoots unsplit.
                batch_limits = batch_limits.filter(|_| !shots.is_empty());
                continue;
            }
            let patch = self.viewpoint(&self.patches[k], flux);
            let needs_row = is_missing(patch);
            if needs_row && rows_left == 0 {
                break;
            }
            // A viewpoint shared by two patches gets its row for one of them first.
            if needs_row && shots.iter().any(|shot| shot.patch == patch) {
                continue;
            }
            rows_left -= usize::from(needs_row);
            self.patches[k].viewpoint = Some(patch);
            shots.push(Shot { index: k, patch, elements: self.patches[k].elements.clone() });
        }
        shots
    }

    /// Measures from a new row the distances of the receivers of `shot`. Returns whether the shot
    /// is still to be taken; if not, the patch has been split, or another viewpoint is needed.
    pub fn accept_or_split(&mut self, shot: &Shot, row: &Row, flux: &Flux) -> bool {
        let eye = self.surfaces.mesh.centroid(shot.patch);
        let patch = &mut self.patches[shot.index];
        patch.distances = InverseDistanceMoments::of_row(row, eye, &self.surfaces.centroids);
        let is_inside = Row::form_factor(row.backface) > buried::VIEWPOINT;
        let is_one_element = indices(&patch.elements).nth(1).is_none();
        if is_inside && !is_one_element {
            // After four, the patch is split, or shoots from the next viewpoint if it is of minimum
            // size. Plain choice.
            if patch.rejected_viewpoints < 4 {
                patch.rejected_viewpoints += 1;
                patch.viewpoint = None;
                self.occluded_viewpoints.insert(shot.patch);
                return false;
            }
            let parts = self.parts(self.patches[shot.index].source);
            if !parts.is_empty() {
                self.replace(shot.index, parts);
                self.occluded_viewpoints.insert(shot.patch);
                return false;
            }
        }
        !self.split(shot.index, flux)
    }

    /// Records that `shot` was taken.
    pub fn mark_shot(&mut self, shot: &Shot) {
        self.patches[shot.index].is_unshot_emitter = false;
    }

    /// Replaces patch `k` by its parts where it is too coarse, recursively; the first part takes
    /// its index. Returns whether it did.
    fn split(&mut self, k: usize, flux: &Flux) -> bool {
        let mut unchecked = vec![k];
        let mut has_split = false;
        while let Some(k) = unchecked.pop() {
            let parts = self.parts(self.patches[k].source);
            if parts.is_empty() || self.error(&self.patches[k], flux) < self.tolerance {
                continue;
            }
            has_split = true;
            let count = self.patches.len();
            self.replace(k, parts);
            unchecked.push(k);
            unchecked.extend(count..self.patches.len());
        }
        has_split
    }

    /// Replaces patch `k` by `parts`: the first takes its index, the others are appended.
    fn replace(&mut self, k: usize, parts: Vec<Source>) {
        let distances = self.patches[k].distances;
        for (n, part) in parts.into_iter().enumerate() {
            let part = self.patch(part, distances);
            match n {
                0 => self.patches[k] = part,
                _ => self.patches.push(part),
            }
        }
    }

    /// Error of a patch, for comparison with the tolerance.
    fn error(&self, patch: &ShootingPatch, flux: &Flux) -> f64 {
        let share = flux.leaving_share(&patch.elements);
        if share == 0.0 {
            return 0.0;
        }
        let ShootingPatch { elements, distances, .. } = patch;
        let viewpoint = self.viewpoint(patch, flux);
        patch_error(share, &self.surfaces, elements, viewpoint, *distances, flux)
    }

    /// The node whose row `patch` is to shoot along: the patch itself if its middle is lit; else,
    /// and for a cluster, the lit element nearest to the centroid of its light. Unlit elements may
    /// lie inside other geometry, such as the floor under a block.
    fn viewpoint(&self, patch: &ShootingPatch, flux: &Flux) -> NodeId {
        let mesh = self.surfaces.mesh;
        if let Some(viewpoint) = patch.viewpoint {
            return viewpoint;
        }
        let area = |e: usize| mesh.solid_area(mesh.element(e));
        let light = |e: usize| flux.leaving(e).element_sum();
        let elements = || indices(&patch.elements);
        let total: f64 = elements().map(light).sum();
        let mean = total / elements().map(area).sum::<f64>();
        // Lit elements have at least half of the mean radiosity of the patch. Plain choice.
        let is_lit = |&e: &usize| area(e) > 0.0 && light(e) >= 0.5 * mean * area(e);
        if let Source::Node(node) = patch.source
            && !self.occluded_viewpoints.contains(&node)
            && mesh.elements_of(self.middle(node)).all(|e| is_lit(&e))
        {
            return node;
        }
        let centre =
            elements().map(|e| light(e) * self.surfaces.centroids[e]).sum::<DVec3>() / total;
        let nearest = elements()
            .filter(is_lit)
            .filter(|&e| !self.occluded_viewpoints.contains(&mesh.element(e)))
            .min_by_key(|&e| tie_stable_key(self.surfaces.centroids[e].distance_squared(centre)));
        mesh.element(nearest.unwrap_or(patch.elements[0].start))
    }

    /// The deepest node with the centroid of `node`: the middle child, recursively.
    fn middle(&self, node: NodeId) -> NodeId {
        let mut middle = node;
        while let Some([.., child]) = self.surfaces.mesh.children(middle) {
            middle = child;
        }
        middle
    }

    /// The patch at `source`, before its first shot; a cluster of one triangle is that triangle.
    fn patch(&self, source: Source, distances: InverseDistanceMoments) -> ShootingPatch {
        let mesh = self.surfaces.mesh;
        let (source, mut elements) = match source {
            Source::Cluster(c) if self.clusters.parts(c).is_some() => {
                let triangles = self.clusters.triangles(c);
                let roots = triangles.iter().map(|&t| mesh.root(t as usize));
                (source, roots.map(|root| mesh.elements_of(root)).collect())
            }
            Source::Cluster(t) => {
                let root = mesh.root(t as usize);
                (Source::Node(root), vec![mesh.elements_of(root)])
            }
            Source::Node(node) => (source, vec![mesh.elements_of(node)]),
        };
        elements.dedup_by(|next, run| {
            let touches = run.end == next.start;
            if touches {
                run.end = next.end;
            }
            touches
        });
        ShootingPatch {
            source,
            elements,
            viewpoint: None,
            distances,
            is_unshot_emitter: false,
            rejected_viewpoints: 0,
        }
    }

    /// The parts of a split patch; empty where it is of minimum size.
    fn parts(&self, source: Source) -> Vec<Source> {
        match source {
            Source::Cluster(c) => {
                self.clusters.parts(c).into_iter().flatten().map(Source::Cluster).collect()
            }
            Source::Node(node) => match self.surfaces.mesh.children(node) {
                Some(children) if height(self.surfaces.mesh, node) > self.min_level => {
                    children.map(Source::Node).to_vec()
                }
                _ => vec![],
            },
        }
    }
}

/// The indices in `ranges`.
fn indices(ranges: &[Range<usize>]) -> impl Iterator<Item = usize> {
    ranges.iter().cloned().flatten()
}

/// Maximum number of quadtree levels below `node`.
fn height(mesh: &Mesh, node: NodeId) -> u32 {
    mesh.children(node).map_or(0, |c| 1 + c.iter().map(|&k| height(mesh, k)).max().unwrap_or(0))
}
