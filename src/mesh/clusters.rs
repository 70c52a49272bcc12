//! Levels above the triangle: clusters of neighbours that face much the same way.
//!
//! Two clusters become one across a shared side, cheapest pair first, until no pair is left that
//! may: greedy merging along the edges of the dual graph (Garland, Willmott and Heckbert 2001),
//! which is how the face clusters of Willmott, Heckbert and Garland (1999) are made. Only a smooth
//! surface of one group and one material is merged, and no normal in a cluster is further than
//! [`SPREAD_DEGREES`] from its axis: what a cluster sends out is much like what one flat patch does.

use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap, HashMap};

use glam::DVec3;

use super::Smooth;
use crate::scene::Scene;

/// No triangle's normal is further than this from its cluster's axis, degrees.
pub(crate) const SPREAD_DEGREES: f64 = 35.0;

/// Binary trees over the triangles of a scene. Cluster `t` is triangle `t` alone, for all triangles;
/// the clusters of two parts follow.
#[derive(Clone, Debug)]
pub(crate) struct Clusters {
    clusters: Vec<Cluster>,
    /// The two parts of each cluster that is not a triangle.
    parts: Vec<[u32; 2]>,
    /// Clusters that are part of no other, ascending.
    roots: Vec<u32>,
}

/// What merging needs to know of a set of triangles.
#[derive(Clone, Copy, Debug)]
struct Cluster {
    area: f64,
    centroid: DVec3,
    /// Integral of the squared distance from the centroid, length unit⁴.
    spread: f64,
    /// Area-weighted mean normal, of unit length.
    axis: DVec3,
    /// Area-weighted sum of normals.
    vector: DVec3,
    /// No normal is further from the axis, radians.
    angle: f64,
}

impl Clusters {
    /// The clusters of `scene`, in time that is linear in its triangles but for the sorting.
    pub fn new(scene: &Scene) -> Clusters {
        let count = scene.triangles().len();
        let mut clusters: Vec<Cluster> = (0..count).map(|t| Cluster::of(scene, t)).collect();
        let mut parts: Vec<[u32; 2]> = vec![];
        let mut beside = neighbours(scene);
        let mut whole = vec![true; count];
        let mut queue = BinaryHeap::new();
        for (a, others) in (0u32..).zip(&beside) {
            for &b in others.range(a + 1..) {
                queue.extend(candidate(&clusters, a, b));
            }
        }
        while let Some(Reverse((_, a, b))) = queue.pop() {
            if !(whole[a as usize] && whole[b as usize]) {
                continue;
            }
            let merged = clusters.len() as u32;
            clusters.push(clusters[a as usize].with(&clusters[b as usize]));
            parts.push([a, b]);
            whole.push(true);
            let mut others = BTreeSet::new();
            for part in [a, b] {
                whole[part as usize] = false;
                others.append(&mut beside[part as usize]);
            }
            others.retain(|&o| o != a && o != b);
            for &o in &others {
                let its = &mut beside[o as usize];
                its.remove(&a);
                its.remove(&b);
                its.insert(merged);
                queue.extend(candidate(&clusters, o, merged));
            }
            beside.push(others);
        }
        let roots = (0..clusters.len() as u32).filter(|&c| whole[c as usize]).collect();
        Clusters { clusters, parts, roots }
    }

    /// Clusters that together cover every triangle once and are part of no other.
    pub fn roots(&self) -> &[u32] {
        &self.roots
    }

    /// The two parts of `cluster`, or `None` for a triangle.
    pub fn parts(&self, cluster: u32) -> Option<[u32; 2]> {
        let triangles = self.clusters.len() - self.parts.len();
        (cluster as usize).checked_sub(triangles).map(|k| self.parts[k])
    }

    /// The triangles of `cluster`, ascending.
    pub fn triangles(&self, cluster: u32) -> Vec<u32> {
        let (mut open, mut triangles) = (vec![cluster], vec![]);
        while let Some(c) = open.pop() {
            match self.parts(c) {
                Some(parts) => open.extend(parts),
                None => triangles.push(c),
            }
        }
        triangles.sort_unstable();
        triangles
    }
}

impl Cluster {
    fn of(scene: &Scene, t: usize) -> Cluster {
        let [a, b, c] = scene.corners(t);
        let (area, axis) = (scene.area(t), scene.normal(t));
        let centroid = a + ((b - a) + (c - a)) / 3.0;
        // The three corners and the centroid, as a rule for integrals of degree two.
        let square: f64 = [a, b, c].iter().map(|p| p.distance_squared(centroid)).sum();
        let spread = area * square / 12.0;
        Cluster { area, centroid, spread, axis, vector: axis * area, angle: 0.0 }
    }

    fn with(&self, other: &Cluster) -> Cluster {
        let area = self.area + other.area;
        let share = other.area / area;
        let centroid = self.centroid + (other.centroid - self.centroid) * share;
        let apart = self.centroid.distance_squared(other.centroid);
        let spread = self.spread + other.spread + self.area * share * apart;
        let vector = self.vector + other.vector;
        let axis = vector.normalize_or_zero();
        let reach = |c: &Cluster| axis.dot(c.axis).clamp(-1.0, 1.0).acos() + c.angle;
        Cluster { area, centroid, spread, axis, vector, angle: reach(self).max(reach(other)) }
    }
}

/// A pair that may merge, by what it costs: small and compact clusters first, flat before bent.
fn candidate(clusters: &[Cluster], a: u32, b: u32) -> Option<Reverse<(u64, u32, u32)>> {
    let merged = clusters[a as usize].with(&clusters[b as usize]);
    let flat = merged.vector.length() / merged.area;
    // In units of the fourth power of length: the extent, and as much again for a spread of normals
    // of one (1 − flat² is their variance).
    let cost = merged.spread + merged.area * merged.area * (1.0 - flat * flat).max(0.0);
    // The bits of positive floats are in the order of their values.
    (merged.angle <= SPREAD_DEGREES.to_radians()).then(|| Reverse((cost.to_bits(), a, b)))
}

/// For each triangle those across a side where the surface goes on smoothly.
fn neighbours(scene: &Scene) -> Vec<BTreeSet<u32>> {
    let smooth = Smooth::new(scene);
    let mut beside = vec![BTreeSet::new(); smooth.sides.len()];
    let mut first: HashMap<u32, u32> = HashMap::new();
    for (t, sides) in (0u32..).zip(&smooth.sides) {
        for side in sides {
            match first.insert(side.id, t) {
                Some(other) if other != t => {
                    beside[t as usize].insert(other);
                    beside[other as usize].insert(t);
                }
                _ => {}
            }
        }
    }
    beside
}
