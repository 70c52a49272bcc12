//! Who shoots: a cut through clusters, triangles and their quadtrees, finer where more is at stake.
//!
//! A shooter is a cluster of triangles, a triangle, or a node of its quadtree. It shoots for all
//! elements below it along one row, seen from one place. That is off by how far its light is from
//! that place, beside how far its receivers are: a share q of what it sends, by first and second
//! moments of position, normal and brightness. With a share s of the emitted light, it adds s q²
//! to the mean square of q over all light; where √s q is above the tolerance, its parts shoot. So
//! effort follows flux, and is spread evenly (Hanrahan, Salzman and Aupperle 1991 refine by
//! brightness likewise, there the links between two patches).

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashSet};
use std::ops::Range;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::flux_state::Flux;
use crate::form_factor::Row;
use crate::geometry::rounding::tie_stable_key;
use crate::mesh::{Clusters, Mesh, NodeId};
use crate::scene::Rgb;
use crate::visibility::buried;

/// The shooters. Together they cover every element once, and they only ever get smaller.
#[derive(Clone)]
pub(super) struct PatchCut<'m> {
    mesh: &'m Mesh,
    clusters: &'m Clusters,
    /// Centroid of each element.
    centroids: Vec<DVec3>,
    cut: Vec<ShootingPatch>,
    /// Nodes that see mostly backs.
    blind: HashSet<NodeId>,
    /// Most that √s q may be.
    tolerance: f64,
    /// Quadtree levels above the elements that are not gone below.
    level: u32,
}

/// One that shoots.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct ShootingPatch {
    source: Source,
    #[serde(skip)]
    elements: Vec<Range<usize>>,
    /// The node whose row this shoots along, once it has shot or is about to.
    patch: Option<NodeId>,
    near: InverseDistanceMoments,
    /// Emits and has not shot yet.
    fresh: bool,
    /// Times that its patch saw mostly backs.
    rejected: u32,
}

#[derive(Clone, Copy, Serialize, Deserialize)]
enum Source {
    Cluster(u32),
    Node(NodeId),
}

/// Means of 1/r and 1/r² over what a patch sees, r from its centroid; 1/length unit, and squared.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct InverseDistanceMoments {
    first: f64,
    second: f64,
}

/// The shooters as they are saved.
#[derive(Serialize, Deserialize)]
pub(super) struct CutSnapshot {
    pub shooters: Vec<ShootingPatch>,
    blind: Vec<NodeId>,
}

/// A shot to be taken.
pub(super) struct Shot {
    /// GatherPoint in the cut.
    shooter: usize,
    /// The node whose row it goes along.
    pub patch: NodeId,
    /// The elements that are shot for.
    pub elements: Vec<Range<usize>>,
}

impl<'m> PatchCut<'m> {
    fn none(mesh: &'m Mesh, tolerance: f64, level: u32) -> PatchCut<'m> {
        let (cut, blind, centroids) = (vec![], HashSet::new(), centroids(mesh));
        PatchCut { mesh, clusters: mesh.clusters(), centroids, cut, blind, tolerance, level }
    }

    /// The largest there are; but emitters that are few shoot by their elements, since what is nearest
    /// a lamp depends most on its shape.
    pub fn new(mesh: &'m Mesh, tolerance: f64, level: u32) -> PatchCut<'m> {
        let mut all = PatchCut::none(mesh, tolerance, level);
        // As in the middle of a cube of that area.
        let area: f64 = (0..mesh.scene().triangles().len()).map(|t| mesh.scene().area(t)).sum();
        let near = InverseDistanceMoments { first: (6.0 / area).sqrt(), second: 6.0 / area };
        let emits = |t: usize| mesh.scene().material(t).exitance != Rgb::ZERO;
        let emitters = (0..mesh.scene().triangles().len()).filter(|&t| emits(t));
        let few = emitters.map(|t| mesh.elements_of(mesh.root(t)).len()).sum::<usize>() <= FEW;
        for &root in all.clusters.roots() {
            let triangles = all.clusters.triangles(root);
            let fresh = emits(triangles[0] as usize);
            if !(fresh && few) {
                let shooter = all.shooter(Source::Cluster(root), near);
                all.cut.push(ShootingPatch { fresh, ..shooter });
                continue;
            }
            let below = triangles.iter().flat_map(|&t| mesh.elements_of(mesh.root(t as usize)));
            let one = |e| all.shooter(Source::Node(mesh.element(e)), near);
            let emitters: Vec<ShootingPatch> =
                below.map(|e| ShootingPatch { fresh, ..one(e) }).collect();
            all.cut.extend(emitters);
        }
        all
    }

    /// What there is to be saved.
    pub fn cut(&self) -> CutSnapshot {
        let mut blind: Vec<NodeId> = self.blind.iter().copied().collect();
        blind.sort_unstable();
        CutSnapshot { shooters: self.cut.clone(), blind }
    }

    /// The shooters of a cut that was saved, if they are a cut through `mesh`.
    pub fn from_cut(
        mesh: &'m Mesh,
        tolerance: f64,
        level: u32,
        cut: CutSnapshot,
    ) -> Option<PatchCut<'m>> {
        let mut all = PatchCut::none(mesh, tolerance, level);
        let node = |n: NodeId| mesh.contains(n);
        let mut seen = vec![false; mesh.element_count()];
        for saved in cut.shooters {
            let known = match saved.source {
                Source::Cluster(c) => (c as usize) < all.clusters.count(),
                Source::Node(n) => node(n),
            };
            let InverseDistanceMoments { first, second } = saved.near;
            if !known || !saved.patch.is_none_or(node) || first.is_nan() || second.is_nan() {
                return None;
            }
            let elements = all.shooter(saved.source, saved.near).elements;
            for e in self::all(&elements) {
                if std::mem::replace(&mut seen[e], true) {
                    return None;
                }
            }
            all.cut.push(ShootingPatch { elements, ..saved });
        }
        all.blind = cut.blind.into_iter().collect();
        (seen.into_iter().all(|s| s) && all.blind.iter().all(|&n| node(n))).then_some(all)
    }

    /// Shoots over `mesh` from now on, whose elements are the same.
    pub fn change(&mut self, mesh: &'m Mesh) {
        (self.mesh, self.clusters, self.centroids) = (mesh, mesh.clusters(), centroids(mesh));
    }

    /// The elements of the shooter that shoots from `patch`, which sees too many backs by now, to be
    /// shot for from elsewhere. None where there is no other place.
    pub fn blinded(&mut self, patch: NodeId) -> Option<Vec<usize>> {
        let shooter = self.cut.iter_mut().find(|s| s.patch == Some(patch))?;
        let elements: Vec<usize> = all(&shooter.elements).collect();
        if elements.len() == 1 {
            return None;
        }
        shooter.patch = None;
        self.blind.insert(patch);
        Some(elements)
    }

    /// The next shots, by unshot flux, most first; emitters before all others. Ends at `rows`
    /// patches whose row is missing, at `most` shots, or where the flux falls far below the first's,
    /// so that no dim patch shoots before a bright one is lit.
    pub fn brightest(
        &mut self,
        flux: &Flux,
        rows: usize,
        most: u64,
        missing: impl Fn(NodeId) -> bool,
    ) -> Vec<Shot> {
        // Of equals the first in the cut.
        let entry = |s: &ShootingPatch, k: usize| {
            let share = flux.unshot_share(&s.elements);
            (share > 0.0).then(|| (s.fresh, tie_stable_key(share), Reverse(k)))
        };
        let mut bright: BinaryHeap<_> =
            self.cut.iter().zip(0..).filter_map(|(s, k)| entry(s, k)).collect();
        let (mut wanted, mut shots, mut floor) = (rows.max(1), Vec::<Shot>::new(), None);
        while let Some((fresh, share, Reverse(k))) = bright.pop() {
            let least = || tie_stable_key(flux.unshot_share(&self.cut[k].elements) * BATCH_FALL);
            let (first, least) = *floor.get_or_insert_with(|| (fresh, least()));
            if fresh != first || share < least || shots.len() as u64 >= most {
                break;
            }
            let parts = self.cut.len();
            if self.split(k, flux) {
                let parts = [k].into_iter().chain(parts..self.cut.len());
                bright.extend(parts.filter_map(|k| entry(&self.cut[k], k)));
                // The floor is that of a patch that shoots.
                floor = floor.filter(|_| !shots.is_empty());
                continue;
            }
            let patch = self.viewpoint(&self.cut[k], flux);
            let draws = missing(patch);
            if draws && wanted == 0 {
                break;
            }
            // A patch that stands for two shooters is drawn for one of them first.
            if draws && shots.iter().any(|s| s.patch == patch) {
                continue;
            }
            wanted -= usize::from(draws);
            let shooter = &mut self.cut[k];
            shooter.patch = Some(patch);
            shots.push(Shot { shooter: k, patch, elements: shooter.elements.clone() });
        }
        shots
    }

    /// Learns from a new row how near the receivers of `shot` are. Answers whether it is to be
    /// taken still; if not, the shooter has been split, or shoots from elsewhere.
    pub fn confirm(&mut self, shot: &Shot, row: &Row, flux: &Flux) -> bool {
        let eye = self.mesh.centroid(shot.patch);
        let mut near = InverseDistanceMoments { first: 0.0, second: 0.0 };
        for entry in &row.entries {
            let factor = Row::form_factor(entry.share);
            let distance = self.centroids[entry.element as usize].distance(eye);
            near.first += factor / distance;
            near.second += factor / (distance * distance);
        }
        let shooter = &mut self.cut[shot.shooter];
        shooter.near = near;
        let alone = all(&shooter.elements).nth(1).is_none();
        if Row::form_factor(row.backface) > buried::VIEWPOINT
            && shooter.rejected < ATTEMPTS
            && !alone
        {
            shooter.rejected += 1;
            shooter.patch = None;
            self.blind.insert(shot.patch);
            return false;
        }
        !self.split(shot.shooter, flux)
    }

    /// Notes that `shot` was taken.
    pub fn shot(&mut self, shot: &Shot) {
        self.cut[shot.shooter].fresh = false;
    }

    /// Replaces shooter `k` by its parts where it is too coarse, and these by theirs. Parts take on
    /// what is known of their whole.
    fn split(&mut self, k: usize, flux: &Flux) -> bool {
        let mut open = vec![k];
        let mut split = false;
        while let Some(k) = open.pop() {
            let ShootingPatch { source, near, .. } = self.cut[k];
            let parts = self.parts(source);
            if parts.is_empty() || self.error(&self.cut[k], flux) < self.tolerance {
                continue;
            }
            split = true;
            let mut parts = parts.into_iter().map(|part| self.shooter(part, near));
            let first = parts.next();
            let rest: Vec<ShootingPatch> = parts.collect();
            open.push(k);
            open.extend(self.cut.len()..self.cut.len() + rest.len());
            self.cut.extend(rest);
            first.into_iter().for_each(|part| self.cut[k] = part);
        }
        split
    }

    /// √s q of a shooter.
    fn error(&self, shooter: &ShootingPatch, flux: &Flux) -> f64 {
        let mesh = self.mesh;
        let share = flux.leaving_share(&shooter.elements);
        if share == 0.0 {
            return 0.0;
        }
        let patch = self.viewpoint(shooter, flux);
        let (eye, normal) = (mesh.centroid(patch), mesh.normal(patch));
        let (mut whole, mut area) = (0.0, 0.0);
        let (mut place, mut extent) = (DVec3::ZERO, 0.0);
        let (mut turn, mut bend) = (DVec3::ZERO, 0.0);
        for e in all(&shooter.elements) {
            let node = mesh.element(e);
            let (off, turned) = (self.centroids[e] - eye, mesh.normal(node) - normal);
            let light = flux.leaving(e).element_sum();
            whole += light;
            area += mesh.area(node);
            place += light * off;
            extent += light * off.length_squared();
            turn += light * turned;
            bend += light * turned.length_squared();
        }
        let even = |e: usize| whole / area * mesh.area(mesh.element(e));
        let uneven = |e: usize| (flux.leaving(e).element_sum() - even(e)).abs();
        let uneven = all(&shooter.elements).map(uneven).sum::<f64>() / whole;
        if whole <= 0.0 {
            return 0.0;
        }
        let InverseDistanceMoments { first, second } = shooter.near;
        // The angle that the patch is seen under, squared.
        let wide = extent / whole * second;
        let off = place.length() / whole * first + wide + UNEVEN * uneven * wide.sqrt();
        share.sqrt() * (off + (turn.length() + bend) / whole).min(1.0)
    }

    /// The node whose row `shooter` is to shoot along: itself, where its middle is lit; else, as
    /// for a cluster, the lit element nearest to where its light is. What no light comes to may lie
    /// in other geometry, such as the floor under a block.
    fn viewpoint(&self, shooter: &ShootingPatch, flux: &Flux) -> NodeId {
        let mesh = self.mesh;
        if let Some(patch) = shooter.patch {
            return patch;
        }
        let area = |e: usize| mesh.area(mesh.element(e));
        let light = |e: usize| flux.leaving(e).element_sum();
        let elements = || all(&shooter.elements);
        let whole: f64 = elements().map(light).sum();
        let mean = whole / elements().map(area).sum::<f64>();
        let lit = |&e: &usize| light(e) >= LIT * mean * area(e);
        if let Source::Node(node) = shooter.source
            && !self.blind.contains(&node)
        {
            let mut middle = node;
            while let Some([.., part]) = mesh.children(middle) {
                middle = part;
            }
            if mesh.elements_of(middle).all(|e| lit(&e)) {
                return node;
            }
        }
        let middle = elements().map(|e| light(e) * self.centroids[e]).sum::<DVec3>() / whole;
        let off = |e: &usize| self.centroids[*e].distance_squared(middle);
        let sees = |e: &usize| !self.blind.contains(&mesh.element(*e));
        let nearest = elements().filter(lit).filter(sees).min_by_key(|e| tie_stable_key(off(e)));
        mesh.element(nearest.unwrap_or(shooter.elements[0].start))
    }

    fn shooter(&self, source: Source, near: InverseDistanceMoments) -> ShootingPatch {
        let mesh = self.mesh;
        let (source, triangles) = match source {
            Source::Cluster(c) if self.clusters.parts(c).is_some() => {
                (source, self.clusters.triangles(c))
            }
            Source::Cluster(t) => (Source::Node(mesh.root(t as usize)), vec![]),
            Source::Node(_) => (source, vec![]),
        };
        let mut elements = match source {
            Source::Node(node) => vec![mesh.elements_of(node)],
            Source::Cluster(_) => {
                triangles.iter().map(|&t| mesh.elements_of(mesh.root(t as usize))).collect()
            }
        };
        elements.dedup_by(|next, run| {
            let joins = run.end == next.start;
            if joins {
                run.end = next.end;
            }
            joins
        });
        ShootingPatch { source, elements, patch: None, near, fresh: false, rejected: 0 }
    }

    fn parts(&self, source: Source) -> Vec<Source> {
        match source {
            Source::Cluster(c) => {
                self.clusters.parts(c).into_iter().flatten().map(Source::Cluster).collect()
            }
            Source::Node(node) => match self.mesh.children(node) {
                Some(children) if height(self.mesh, node) > self.level => {
                    children.map(Source::Node).to_vec()
                }
                _ => vec![],
            },
        }
    }
}

/// Elements of emitters that all shoot by themselves. More are rooms that glow, not lamps.
const FEW: usize = 1024;

/// A batch ends where the flux is below this share of its brightest patch.
const BATCH_FALL: f64 = 0.25;

/// Viewpoints of a patch that are tried until one does not see too many backs.
const ATTEMPTS: u32 = 4;

/// An element is lit from this share of its shooter's mean radiosity.
const LIT: f64 = 0.5;

/// Weight of uneven light: a corner of the patch sends to what is next to it, not to the mean.
const UNEVEN: f64 = 3.0;

fn all(elements: &[Range<usize>]) -> impl Iterator<Item = usize> {
    elements.iter().cloned().flatten()
}

fn centroids(mesh: &Mesh) -> Vec<DVec3> {
    (0..mesh.element_count()).map(|e| mesh.centroid(mesh.element(e))).collect()
}

/// Levels below `node`, at most.
fn height(mesh: &Mesh, node: NodeId) -> u32 {
    mesh.children(node).map_or(0, |c| 1 + c.iter().map(|&k| height(mesh, k)).max().unwrap_or(0))
}
