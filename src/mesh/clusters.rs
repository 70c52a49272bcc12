//! Levels above the triangle: clusters of neighbours with similar normals.
//!
//! Two clusters are merged across a shared side, cheapest pair first, until no pair is allowed:
//! greedy merging along the edges of the dual graph (Garland, Willmott and Heckbert 2001), as for
//! the face clusters of Willmott, Heckbert and Garland (1999). Only a surface of one group and one
//! material is merged, and no normal in a cluster deviates by more than
//! [`MAX_NORMAL_DEVIATION_DEGREES`] from its axis: the light leaving a cluster is close to that of
//! one flat patch. Smoothing groups are ignored: they affect the shading of a surface, not the
//! light that leaves it.
//!
//! ```text
//! roots              7              6
//!                ╭───┴───╮        ╭─┴─╮      Clusters 0 to 4 are the five triangles; each
//!                5       │        │   │      pair that merges makes the next number.
//!              ╭─┴─╮     │        │   │
//! triangles    0   1     2        3   4
//! ```

use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap};

use glam::DVec3;

use super::SurfaceTopology;
use crate::geometry::rounding::tie_stable_key;
use crate::scene::Scene;

/// Largest angle between a triangle's normal and its cluster's axis, degrees. Plain choice; no
/// measurement was kept.
pub(crate) const MAX_NORMAL_DEVIATION_DEGREES: f64 = 35.0;

/// Binary trees over the triangles of a scene. Cluster `t` is triangle `t` alone, for all
/// triangles; the clusters of two parts follow.
#[derive(Clone, Debug)]
pub(crate) struct Clusters {
    /// Number of triangles.
    triangles: usize,
    /// The two parts of each cluster that is not a triangle.
    parts: Vec<[u32; 2]>,
    /// Clusters without a parent, ascending.
    roots: Vec<u32>,
}

/// Properties of a set of triangles that merging uses.
#[derive(Clone, Copy, Debug)]
struct Cluster {
    area: f64,
    centroid: DVec3,
    /// Integral over the area of the squared distance from the centroid, length unit⁴.
    second_moment: f64,
    /// Area-weighted mean normal, of unit length.
    axis: DVec3,
    /// Integral over the area of the unit normal, length unit².
    area_vector: DVec3,
    /// Bound of the angle between the axis and any normal, radians.
    max_deviation: f64,
}

impl Clusters {
    /// The clusters of `scene`, in time that is linear in its triangles but for the sorting.
    pub fn new(scene: &Scene) -> Clusters {
        Clusters::with_properties(scene).0
    }

    /// The same, and the properties of each cluster, which only merging uses.
    fn with_properties(scene: &Scene) -> (Clusters, Vec<Cluster>) {
        let count = scene.triangles().len();
        let mut beside = neighbours(&SurfaceTopology::ignoring_smoothing_groups(scene));
        let mut clusters: Vec<Cluster> = (0..count).map(|t| Cluster::of(scene, t)).collect();
        let (mut parts, mut is_root) = (vec![], vec![true; count]);
        let mut queue = BinaryHeap::new();
        for (a, others) in (0u32..).zip(&beside) {
            for &b in others.range(a + 1..) {
                queue.extend(candidate(&clusters, a, b));
            }
        }
        while let Some(Reverse((_, a, b))) = queue.pop() {
            if !(is_root[a as usize] && is_root[b as usize]) {
                continue;
            }
            let merged = clusters.len() as u32;
            clusters.push(clusters[a as usize].merged(&clusters[b as usize]));
            parts.push([a, b]);
            is_root.push(true);
            let mut others = BTreeSet::new();
            for part in [a, b] {
                is_root[part as usize] = false;
                others.append(&mut beside[part as usize]);
            }
            others.retain(|&o| o != a && o != b);
            for &o in &others {
                let neighbours = &mut beside[o as usize];
                neighbours.remove(&a);
                neighbours.remove(&b);
                neighbours.insert(merged);
                queue.extend(candidate(&clusters, o, merged));
            }
            beside.push(others);
        }
        let roots = (0..clusters.len() as u32).filter(|&c| is_root[c as usize]).collect();
        parts.shrink_to_fit();
        (Clusters { triangles: count, parts, roots }, clusters)
    }

    /// Clusters that together cover every triangle once and are part of no other.
    pub fn roots(&self) -> &[u32] {
        &self.roots
    }

    /// Number of clusters, single triangles included.
    pub fn count(&self) -> usize {
        self.triangles + self.parts.len()
    }

    /// All parts, in the order of the clusters.
    pub fn tree(&self) -> impl Iterator<Item = [u32; 2]> {
        self.parts.iter().copied()
    }

    /// The two parts of `cluster`, or `None` for a triangle.
    pub fn parts(&self, cluster: u32) -> Option<[u32; 2]> {
        (cluster as usize).checked_sub(self.triangles).map(|k| self.parts[k])
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
        // Quadrature of degree two over the three corners and the centroid.
        let square: f64 = [a, b, c].iter().map(|p| p.distance_squared(centroid)).sum();
        let second_moment = area * square / 12.0;
        let area_vector = axis * area;
        Cluster { area, centroid, second_moment, axis, area_vector, max_deviation: 0.0 }
    }

    /// Both as one.
    fn merged(&self, other: &Cluster) -> Cluster {
        let area = self.area + other.area;
        let share = other.area / area;
        let centroid = self.centroid + (other.centroid - self.centroid) * share;
        // The parallel axis theorem for two parts.
        let distance_squared = self.centroid.distance_squared(other.centroid);
        let second_moment =
            self.second_moment + other.second_moment + self.area * share * distance_squared;
        let area_vector = self.area_vector + other.area_vector;
        let axis = area_vector.normalize_or_zero();
        let deviation =
            |part: &Cluster| libm::acos(axis.dot(part.axis).clamp(-1.0, 1.0)) + part.max_deviation;
        let max_deviation = deviation(self).max(deviation(other));
        Cluster { area, centroid, second_moment, axis, area_vector, max_deviation }
    }
}

/// A pair of clusters that may merge, with its cost as the key of the queue: small and compact
/// clusters come first, and flat before bent. `None` if normals would deviate too much.
///
/// The cost is the second moment ∫|x − c|² dA plus A² (1 − |n̄|²), both length unit⁴, where n̄ is
/// the mean of the unit normals: 1 − |n̄|² is their variance.
fn candidate(clusters: &[Cluster], a: u32, b: u32) -> Option<Reverse<(u64, u32, u32)>> {
    let merged = clusters[a as usize].merged(&clusters[b as usize]);
    if merged.max_deviation > MAX_NORMAL_DEVIATION_DEGREES.to_radians() {
        return None;
    }
    let mean_normal = merged.area_vector.length() / merged.area;
    let normal_variance = (1.0 - mean_normal * mean_normal).max(0.0);
    let cost = merged.second_moment + merged.area * merged.area * normal_variance;
    Some(Reverse((tie_stable_key(cost), a, b)))
}

/// For each triangle its neighbours across sides that are not creases.
fn neighbours(topology: &SurfaceTopology) -> Vec<BTreeSet<u32>> {
    let mut beside = vec![BTreeSet::new(); topology.sides.len()];
    for [(s, _), (t, _)] in topology.shared_edges() {
        beside[s].insert(t as u32);
        beside[t].insert(s as u32);
    }
    beside
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, Triangle};

    /// A surface over a grid of `n` × `m` quads, each two triangles; group and material by row.
    fn grid(
        n: u32,
        m: u32,
        at: impl Fn(f64, f64) -> DVec3,
        kind: impl Fn(u32) -> [u32; 2],
    ) -> Scene {
        let point = |k: u32| {
            at(f64::from(k % (n + 1)) / f64::from(n), f64::from(k / (n + 1)) / f64::from(m))
        };
        let mut triangles = vec![];
        for j in 0..m {
            for i in 0..n {
                let (a, b) = (j * (n + 1) + i, (j + 1) * (n + 1) + i);
                let [group, material] = kind(j);
                for corners in [[a, a + 1, b + 1], [a, b + 1, b]] {
                    triangles.push(Triangle { corners, group, material, smoothing: None });
                }
            }
        }
        let names = ["g", "h"].map(String::from).to_vec();
        let materials = ["m", "n"].map(|name| Material::grey(name, 0.5)).to_vec();
        Scene::new((0..(n + 1) * (m + 1)).map(point).collect(), triangles, names, materials)
            .unwrap()
    }

    fn turned(u: f64) -> (f64, f64) {
        // Exactly closed: the last column is the first.
        (u.fract() * std::f64::consts::TAU).sin_cos()
    }

    fn cylinder() -> Scene {
        let at = |u: f64, v: f64| DVec3::new(turned(u).1, turned(u).0, 3.0 * v);
        grid(48, 24, at, |_| [0, 0])
    }

    fn sphere() -> Scene {
        let at = |u: f64, v: f64| {
            // Bit-identical positions at the poles.
            let (sin, cos) = (std::f64::consts::PI * v).sin_cos();
            let r = if v == 0.0 || v == 1.0 { 0.0 } else { sin };
            DVec3::new(r * turned(u).1, r * turned(u).0, -cos)
        };
        grid(64, 32, at, |_| [0, 0])
    }

    fn disc() -> Scene {
        let at = |u: f64, v: f64| DVec3::new(v * turned(u).0, v * turned(u).1, 0.0);
        grid(90, 1, at, |_| [0, 0])
    }

    fn striped() -> Scene {
        let at = |u: f64, v: f64| DVec3::new(u, v, 0.0);
        grid(8, 16, at, |j| [j / 4 % 2, j / 8 % 2])
    }

    #[test]
    fn clusters_partition_the_triangles() {
        for scene in [cylinder(), sphere(), disc(), striped()] {
            let (clusters, properties) = Clusters::with_properties(&scene);
            let mut all: Vec<u32> =
                clusters.roots().iter().flat_map(|&c| clusters.triangles(c)).collect();
            all.sort();
            assert_eq!(all, (0..scene.triangles().len() as u32).collect::<Vec<_>>());
            for c in 0..clusters.count() as u32 {
                let Some(parts) = clusters.parts(c) else {
                    assert_eq!(clusters.triangles(c), [c]);
                    continue;
                };
                let mut both = parts.map(|p| clusters.triangles(p)).concat();
                both.sort();
                assert_eq!(both, clusters.triangles(c));
                let area: f64 = both.iter().map(|&t| scene.area(t as usize)).sum();
                assert!((properties[c as usize].area / area - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn normals_stay_within_maximum_deviation() {
        for scene in [cylinder(), sphere()] {
            let (clusters, properties) = Clusters::with_properties(&scene);
            let mut widest = 0.0_f64;
            for c in 0..clusters.count() as u32 {
                let axis = properties[c as usize].axis;
                for t in clusters.triangles(c) {
                    widest = widest.max(axis.angle_between(scene.normal(t as usize)));
                }
            }
            // An angle from an arc cosine of 1 − ε is off by √(2ε).
            let widest = widest.to_degrees();
            assert!(
                widest <= MAX_NORMAL_DEVIATION_DEGREES + 1e-5
                    && widest > MAX_NORMAL_DEVIATION_DEGREES / 3.0,
                "{widest}"
            );
        }
    }

    #[test]
    fn smooth_surfaces_merge_until_no_pair_may() {
        let roots = |scene: &Scene| {
            let (clusters, properties) = Clusters::with_properties(scene);
            let mut root_of = vec![0; scene.triangles().len()];
            for &root in clusters.roots() {
                for t in clusters.triangles(root) {
                    root_of[t as usize] = root;
                }
            }
            // Merging continues until no two neighbours may merge.
            let topology = SurfaceTopology::ignoring_smoothing_groups(scene);
            for (a, others) in neighbours(&topology).iter().enumerate() {
                for &b in others {
                    let [a, b] = [root_of[a], root_of[b as usize]];
                    assert!(a == b || candidate(&properties, a, b).is_none(), "{a} {b}");
                }
            }
            clusters.roots().len()
        };
        assert_eq!(roots(&disc()), 1);
        // The number of roots depends on the order of merging; these are bounds. Bands of 70° at
        // most: six are needed around a cylinder, and greedy bands half as wide as possible give
        // twice that. Their height is free, but compact clusters formed first may block one
        // another: another factor of two.
        let (around, ball) = (roots(&cylinder()), roots(&sphere()));
        println!("cylinder {around}, sphere {ball}");
        assert!((6..=24).contains(&around), "{around}");
        // Caps of 35° hold 1.14 of 12.57 sr: twelve at least. Of half that angle 43, or 52
        // hexagons, which fill 83 % of their caps.
        assert!((12..=52).contains(&ball), "{ball}");
    }

    #[test]
    fn cluster_has_one_group_and_material() {
        let scene = striped();
        let clusters = Clusters::new(&scene);
        // Four stripes, each with its own group and material.
        assert_eq!(clusters.roots().len(), 4);
        for &c in clusters.roots() {
            let kind = |t: u32| {
                let t = scene.triangles()[t as usize];
                (t.group, t.material)
            };
            let triangles = clusters.triangles(c);
            assert!(triangles.iter().all(|&t| kind(t) == kind(triangles[0])));
        }
    }

    #[test]
    fn facets_are_merged_like_a_smooth_surface() {
        let ball = sphere();
        let facet = |&t: &Triangle| Triangle { smoothing: Some(0), ..t };
        let facets = ball.triangles().iter().map(facet).collect();
        let names = ball.groups().to_vec();
        let faceted =
            Scene::new(ball.positions().to_vec(), facets, names, ball.materials().to_vec());
        let [one, two] = [ball, faceted.unwrap()].map(|scene| Clusters::new(&scene));
        assert_eq!((one.parts, one.roots), (two.parts, two.roots));
    }

    #[test]
    fn clusters_are_deterministic() {
        let [one, two] = [0, 1].map(|_| Clusters::new(&sphere()));
        assert_eq!((one.parts, one.roots), (two.parts, two.roots));
    }
}
