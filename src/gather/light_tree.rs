//! Many lights at the price of few: the irradiance of all of them at a point, by a cut through a
//! tree.
//!
//! ```text
//!            ●            A node stands for the lights below it by their intensity towards the
//!          ╱   ╲          point and one distance. How wrong that may be is bounded: by its size
//!        ●       ●        over its distance, by how much its normals differ, and by the table of
//!       ╱ ╲     ╱ ╲       its intensity. The node with the largest bound is opened until none is
//!      ●   ○   ○   ●      above a share of the irradiance of all (lightcuts: Walter et al. 2005);
//!     ╱ ╲   the cut       a leaf that is opened gives its irradiance exactly. So near lights are
//!    ■   ■                exact, and far ones cost what they contribute.
//! ```
//!
//! Nothing hides anything here: [`light_samples`](super::light_samples) casts shadow rays to the
//! nodes of a cut, in proportion to what they contribute (Estevez and Kulla 2018).

pub(super) mod cone;
mod far_field;
pub(crate) mod patch;
pub(super) mod profile;

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::f64::consts::{FRAC_PI_2, PI};
use std::ops::Range;

use glam::{DMat3, DVec3};

use super::GatherPoint;
use crate::geometry::aabb::Aabb;
use crate::scene::Rgb;
use cone::Cone;
use far_field::FarField;
use profile::Profile;

/// Nodes that are opened in any case: so few lights are exact, at a price that nobody notices.
const OPENED: usize = 16;

/// Irradiance over the mean of the scene's surfaces below which errors are not told from those of
/// this irradiance: as dark as what [`Measure`](crate::accuracy::Measure) counts as dark.
const FLOOR: f64 = 0.05;

/// Lights below an inner node from which on it has a table of its intensity: a table takes as much
/// memory as two leaves of eight triangles.
const LEAVES_OF_TABLE: usize = 4;

/// A light that is a leaf of a tree: a patch of emitting triangles, or a luminaire.
pub(crate) trait Leaf: Sync {
    /// A box around all that emits.
    fn bounds(&self) -> Aabb;

    /// The mean of what emits, scene unit, and the mean of squares about it.
    fn middle(&self) -> (DVec3, DMat3);

    /// Directions of its normals: it sends nothing to where the angle to all of them is 90° or
    /// more.
    fn cone(&self) -> Option<Cone>;

    /// Times a direction in front of all normals: the intensity there, W/sr per channel; none where
    /// that is not Lambert's.
    fn facing(&self) -> Option<DMat3>;

    /// Whether a table with this largest value, W/sr, resolves its intensity.
    fn is_resolved(&self, largest: f64) -> bool;

    /// Radiant intensity towards a unit `direction` from far away, W/sr per channel.
    fn intensity(&self, direction: DVec3) -> Rgb;

    /// Upper bound of that over all directions, summed over the channels.
    fn peak(&self) -> f64;

    /// Upper bounds by direction, where a cone of normals does not tell them.
    fn profile(&self) -> Option<Profile>;

    /// Irradiance at `point` if nothing is in the way, W/m² per channel.
    fn irradiance(&self, point: &GatherPoint) -> Rgb;
}

/// The lights of a scene in a binary tree.
#[derive(Debug)]
pub(crate) struct LightTree<L> {
    /// In the order of the tree: those below a node are neighbours.
    leaves: Vec<L>,
    /// The root first; the left child of a node follows it.
    nodes: Vec<Node>,
    /// Sums of peaks of all leaves before each, and of all.
    peaks: Vec<f64>,
    /// Irradiance below which bounds of errors are shares of this value instead, summed over the
    /// channels, W/m².
    floor: f64,
}

/// Lights that lie together.
#[derive(Clone, Debug)]
struct Node {
    /// Around all that emits.
    bounds: Aabb,
    /// Mean of what emits, by its peak: where the far field comes from.
    middle: DVec3,
    /// Mean of the squares of what emits about the middle, by its peak, scene unit squared.
    covariance: DMat3,
    /// Of all normals; none if some have none.
    cone: Option<Cone>,
    /// Of all lights below, where these are Lambert's.
    facing: Option<DMat3>,
    /// Whether tables resolve the intensity; else lights are opened until they contribute nothing
    /// that counts.
    is_resolved: bool,
    /// Sum of the leaves' peaks, W/sr.
    peak: f64,
    profile: Option<Box<Profile>>,
    far_field: Option<Box<FarField>>,
    leaves: Range<u32>,
    right: u32,
}

/// A node of a cut.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CutNode {
    node: u32,
    /// W/m² per channel, if nothing is in the way.
    pub irradiance: Rgb,
    /// The maximum error of that, summed over the channels; 0 if it is exact.
    bound: f64,
}

/// Nodes that stand for all lights at a point, in the order of the tree.
#[derive(Debug, Default)]
pub(crate) struct Cut {
    pub nodes: Vec<CutNode>,
    /// Root of the sum of squares of their bounds, W/m².
    pub error: f64,
}

impl<L: Leaf> LightTree<L> {
    /// A tree of `leaves`, which light the surfaces of a scene by `mean` on average, W/m² summed
    /// over the channels.
    pub fn new(leaves: Vec<L>, mean: f64) -> LightTree<L> {
        let mut nodes = vec![Node::EMPTY; (2 * leaves.len()).saturating_sub(1)];
        let mut order: Vec<u32> = (0..leaves.len() as u32).collect();
        if !leaves.is_empty() {
            let centres: Vec<DVec3> = leaves.iter().map(|leaf| leaf.bounds().centre()).collect();
            Builder { leaves: &leaves, centres }.build(&mut order, &mut nodes, [0, 0]);
        }
        let mut unordered: Vec<Option<L>> = leaves.into_iter().map(Some).collect();
        let leaves: Vec<L> = order.iter().filter_map(|&k| unordered[k as usize].take()).collect();
        let mut sum = 0.0;
        let sums = leaves.iter().map(|leaf| {
            sum += leaf.peak();
            sum
        });
        let peaks = std::iter::once(0.0).chain(sums).collect();
        LightTree { leaves, nodes, peaks, floor: FLOOR * mean }
    }

    /// The only light of a node of a cut whose irradiance is exact.
    pub fn exact_leaf(&self, node: &CutNode) -> Option<&L> {
        let leaves = &self.nodes[node.node as usize].leaves;
        (node.bound == 0.0 && leaves.len() == 1).then(|| &self.leaves[leaves.start as usize])
    }

    /// One of the lights of a node for a number in [0, 1), in proportion to their peaks: the number
    /// left over, in [0, 1), and the probability.
    pub fn choose(&self, node: &CutNode, x: f64) -> (&L, f64, f64) {
        let Range { start, end } = self.nodes[node.node as usize].leaves.clone();
        let (start, end) = (start as usize, end as usize);
        let all = self.peaks[end] - self.peaks[start];
        let at = self.peaks[start] + x * all;
        let after = self.peaks[start + 1..end].partition_point(|&sum| sum <= at);
        let k = start + after;
        let own = self.peaks[k + 1] - self.peaks[k];
        let left = ((at - self.peaks[k]) / own).clamp(0.0, 1.0 - f64::EPSILON);
        (&self.leaves[k], left, own / all)
    }

    /// Nodes whose irradiance at `point` is off by at most the share `max_bound` of that of all
    /// each.
    pub fn cut(&self, point: &GatherPoint, max_bound: f64) -> Cut {
        let (mut open, mut nodes) = (BinaryHeap::new(), vec![]);
        open.extend(self.estimate(0, point));
        let mut total: f64 = open.iter().map(CutNode::brightness).sum();
        for opened in 0.. {
            let Some(node) = open.pop() else { break };
            let is_enough = node.bound <= max_bound * total.max(self.floor);
            if node.bound == 0.0 || is_enough && opened >= OPENED {
                open.push(node);
                break;
            }
            total -= node.brightness();
            let Node { leaves, right, .. } = &self.nodes[node.node as usize];
            if leaves.len() == 1 {
                let irradiance = self.leaves[leaves.start as usize].irradiance(point);
                total += irradiance.element_sum();
                nodes.push(CutNode { irradiance, bound: 0.0, ..node });
                continue;
            }
            for child in [node.node + 1, *right].into_iter().filter_map(|k| self.estimate(k, point))
            {
                total += child.brightness();
                open.push(child);
            }
        }
        let error = open.iter().map(|node| node.bound * node.bound).sum::<f64>().sqrt();
        nodes.extend(open);
        nodes.retain(|node| node.irradiance != Rgb::ZERO);
        nodes.sort_unstable_by_key(|node| node.node);
        Cut { nodes, error }
    }

    /// Node `k` at `point`, as from afar; none where nothing of it arrives.
    fn estimate(&self, k: u32, point: &GatherPoint) -> Option<CutNode> {
        let node = self.nodes.get(k as usize)?;
        let half = 0.5 * node.bounds.size();
        let to = node.bounds.centre() - point.position;
        // Of the centre above the point's plane, and how much that of the box may differ.
        let (height, above) = (point.normal.dot(to), point.normal.abs().dot(half));
        if height <= -above {
            return None;
        }
        let nearest = (to.abs() - half).max(DVec3::ZERO).length();
        if nearest <= 0.0 {
            return Some(CutNode { node: k, irradiance: Rgb::ZERO, bound: f64::INFINITY });
        }
        // The half-angle of the node as seen from the point.
        let (distance, radius) = (to.length(), half.length());
        let view = if radius < distance { libm::asin(radius / distance) } else { PI };
        let from_centre = -to / distance;
        let to = node.middle - point.position;
        let distance = to.length();
        let towards = -to / distance;
        let facing = node.cone.as_ref().map_or([0.0, PI], |cone| cone.angles(towards, view));
        if facing[0] >= FRAC_PI_2 {
            return None;
        }
        let of_profile = node.profile.as_ref().map(|profile| profile.peak(from_centre, view));
        let lambert = node.facing.filter(|_| facing[1] <= FRAC_PI_2);
        let intensity = match (&lambert, &node.far_field) {
            (Some(facing), _) => *facing * towards,
            (_, Some(far_field)) => far_field.intensity(towards),
            _ => {
                let leaves = &self.leaves[node.leaves.start as usize..node.leaves.end as usize];
                leaves.iter().map(|leaf| leaf.intensity(towards)).sum()
            }
        };
        // A table is wide where a lamp is sharp.
        let intensity = match of_profile {
            Some(peak) if intensity.element_sum() > peak => {
                intensity * (peak / intensity.element_sum())
            }
            _ => intensity,
        };
        let highest = ((height + above) / nearest).min(1.0);
        let cosine = if node.facing.is_some() { libm::cos(facing[0]) } else { 1.0 };
        let peak = of_profile.unwrap_or(node.peak * cosine);
        let limit = peak * highest / (nearest * nearest);
        let square = distance * distance;
        let cosine = point.normal.dot(to).max(0.0) / distance;
        let irradiance = match &lambert {
            Some(facing) if height >= above => node.lambert(facing, to, point.normal),
            _ => intensity.max(Rgb::ZERO) * cosine / square,
        };
        let bound = match height >= above && node.is_resolved {
            true => {
                limit.min(node.error(radius / distance, lambert.is_some(), of_profile) / square)
            }
            false => limit,
        };
        Some(CutNode { node: k, irradiance, bound })
    }
}

impl Node {
    /// Irradiance of surfaces whose intensity is `facing` times the direction, at a point with this
    /// unit `normal` from which their middle lies `to`: the Taylor series of cos θ cos θ′ / d² to
    /// the second order, whose mean over the node is known by its covariance.
    fn lambert(&self, facing: &DMat3, to: DVec3, normal: DVec3) -> Rgb {
        let square = to.length_squared();
        let spread = self.covariance * to;
        let (height, along) = (normal.dot(to), normal.dot(spread));
        let radial = 12.0 * to.dot(spread) / square
            - 2.0
                * (self.covariance.x_axis.x + self.covariance.y_axis.y + self.covariance.z_axis.z);
        // Per channel: −E · to, where E is the sum of exitance × area × normal.
        let (facing_to, facing_spread) = (-(*facing * to), -(*facing * spread));
        let facing_normal = -(*facing * (self.covariance * normal));
        let second = facing_normal - 4.0 / square * (facing_to * along + height * facing_spread)
            + facing_to * (height * radial / square);
        ((height * facing_to + second) / (square * square)).max(Rgb::ZERO)
    }

    const EMPTY: Node = Node {
        bounds: Aabb::EMPTY,
        middle: DVec3::ZERO,
        covariance: DMat3::ZERO,
        cone: None,
        facing: None,
        is_resolved: true,
        peak: 0.0,
        profile: None,
        far_field: None,
        leaves: 0..0,
        right: 0,
    };

    /// Error of intensity times cosine, W/sr, of a node that is `size` times its distance in
    /// radius, whether or not all of its normals are `facing` the point, with the peak of its
    /// profile towards it, W/sr, if it has one. In the Taylor series of cos θ cos θ′ / d² about the
    /// middle, terms of the first order in `size` come from normals that differ along the node, by
    /// the sine of their half-angle at most. Of nodes of closed, open, stretched and hollow shapes,
    /// at distances of 1.5 to 60 radii, 99 % are off by less.
    fn error(&self, size: f64, is_facing: bool, of_profile: Option<f64>) -> f64 {
        let [spread, strength, of_table] = match (&self.far_field, &self.cone) {
            (_, Some(cone)) if is_facing => [cone.sine(), self.peak, 0.0],
            (Some(table), _) => [1.0, of_profile.unwrap_or(table.largest), table.error],
            _ => [1.0, of_profile.unwrap_or(self.peak), 0.0],
        };
        strength * size * (0.5 * size + 0.3 * spread) + of_table
    }
}

impl CutNode {
    /// Irradiance summed over the channels, W/m².
    pub fn brightness(&self) -> f64 {
        self.irradiance.element_sum()
    }
}

impl Ord for CutNode {
    fn cmp(&self, other: &CutNode) -> Ordering {
        self.bound.total_cmp(&other.bound).then(self.node.cmp(&other.node))
    }
}

impl PartialOrd for CutNode {
    fn partial_cmp(&self, other: &CutNode) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for CutNode {
    fn eq(&self, other: &CutNode) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for CutNode {}

/// v vᵀ.
fn outer(v: DVec3) -> DMat3 {
    DMat3::from_cols(v.x * v, v.y * v, v.z * v)
}

/// Builds the nodes of a tree.
struct Builder<'a, L> {
    leaves: &'a [L],
    centres: Vec<DVec3>,
}

impl<L: Leaf> Builder<'_, L> {
    /// Puts the leaves of `order` into the order of the tree, the first of which is number
    /// `first_leaf`, and fills `nodes`, the first of which is number `first_node`: their intensity
    /// in the directions of [`far_field::samples`].
    fn build(
        &self,
        order: &mut [u32],
        nodes: &mut [Node],
        [first_leaf, first_node]: [u32; 2],
    ) -> Vec<Rgb> {
        let leaves = first_leaf..first_leaf + order.len() as u32;
        if let [k] = *order {
            let leaf = &self.leaves[k as usize];
            let samples: Vec<Rgb> = far_field::directions().map(|d| leaf.intensity(d)).collect();
            let largest = samples.iter().map(|value| value.element_sum()).fold(0.0, f64::max);
            let (middle, covariance) = leaf.middle();
            nodes[0] = Node {
                bounds: leaf.bounds(),
                middle,
                covariance,
                cone: leaf.cone(),
                facing: leaf.facing(),
                is_resolved: leaf.is_resolved(largest),
                peak: leaf.peak(),
                profile: leaf.profile().map(Box::new),
                leaves,
                ..Node::EMPTY
            };
            return samples;
        }
        let middle = self.split(order);
        let (low, high) = order.split_at_mut(middle);
        let (node, below) = nodes.split_first_mut().expect("a node above several leaves");
        let (left, right) = below.split_at_mut(2 * low.len() - 1);
        let number = first_node + 2 * low.len() as u32;
        let starts = [[first_leaf, first_node + 1], [first_leaf + low.len() as u32, number]];
        let (mut samples, of_right) =
            rayon::join(|| self.build(low, left, starts[0]), || self.build(high, right, starts[1]));
        samples.iter_mut().zip(of_right).for_each(|(sum, term)| *sum += term);
        *node = left[0].joined(&right[0]);
        (node.leaves, node.right) = (leaves.clone(), number);
        if leaves.len() >= LEAVES_OF_TABLE {
            node.far_field = Some(Box::new(FarField::new(&samples)));
        }
        samples
    }

    /// Sorts `order` into two parts, at the middle of the longest side of the centres' box: the
    /// number of those in the first. Where one would have less than a sixteenth, halves: trees stay
    /// shallow.
    fn split(&self, order: &mut [u32]) -> usize {
        let bounds = Aabb::from_points(order.iter().map(|&k| self.centres[k as usize]));
        let axis = bounds.longest_axis();
        let along = |k: u32| self.centres[k as usize][axis];
        order.sort_unstable_by(|&a, &b| along(a).total_cmp(&along(b)).then(a.cmp(&b)));
        let middle = order.partition_point(|&k| along(k) < bounds.centre()[axis]);
        match middle.min(order.len() - middle) < order.len().div_ceil(16) {
            true => order.len() / 2,
            false => middle,
        }
    }
}

impl Node {
    /// The node above two.
    fn joined(&self, other: &Node) -> Node {
        let peak = self.peak + other.peak;
        let (share, between) = (other.peak / peak, other.middle - self.middle);
        let covariance = self.covariance * (1.0 - share)
            + other.covariance * share
            + outer(between) * (share * (1.0 - share));
        let profiles = self.profile.as_ref().zip(other.profile.as_ref());
        Node {
            bounds: self.bounds.union(other.bounds),
            middle: self.middle + share * between,
            covariance,
            cone: self.cone.zip(other.cone).and_then(|(a, b)| a.joined(&b)),
            facing: self.facing.zip(other.facing).map(|(a, b)| a + b),
            is_resolved: self.is_resolved && other.is_resolved,
            peak,
            profile: profiles.map(|(a, b)| Box::new(a.joined(b))),
            ..Node::EMPTY
        }
    }
}

#[cfg(test)]
mod tests {
    use super::patch::Patch;
    use super::*;
    use crate::sampling::low_discrepancy::{r2_point, radical_inverse};
    use crate::scene::{Material, Scene, Triangle};

    /// Spheres and boxes of several sizes and proportions, an open half of a sphere, and a flat
    /// panel, all in fine triangles, by a function of the two angles.
    fn shapes() -> Vec<Vec<[DVec3; 3]>> {
        let grid = |n: usize, open: f64, f: &dyn Fn(f64, f64) -> DVec3| {
            let at = |i: usize, j: usize| {
                f(open * PI * i as f64 / n as f64, 2.0 * PI * (j % (2 * n)) as f64 / (2 * n) as f64)
            };
            let cell = |k: usize| {
                let (i, j) = (k / (2 * n), k % (2 * n));
                let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
                [[a, b, c], [a, c, d]]
            };
            let all = (0..2 * n * n).flat_map(cell);
            let solid = |t: &[DVec3; 3]| (t[1] - t[0]).cross(t[2] - t[0]).length() > 1e-12;
            all.filter(solid).collect::<Vec<_>>()
        };
        let unit = |t: f64, p: f64| DVec3::new(t.sin() * p.cos(), t.cos(), t.sin() * p.sin());
        let cube = |t: f64, p: f64| unit(t, p) / unit(t, p).abs().max_element();
        let blob = |t: f64, p: f64| unit(t, p) * (1.0 + 0.4 * (3.0 * p).sin() * t.sin().powi(2));
        let stretched = |t: f64, p: f64| unit(t, p) * DVec3::new(1.0, 0.2, 3.0);
        let flat = |t: f64, p: f64| DVec3::new(t * p.cos(), 0.0, t * p.sin());
        vec![
            grid(12, 1.0, &unit),
            grid(8, 1.0, &cube),
            grid(12, 1.0, &blob),
            grid(8, 1.0, &stretched),
            grid(12, 0.5, &unit),
            grid(12, 0.3, &flat),
        ]
    }

    fn tree_of(triangles: &[[DVec3; 3]]) -> LightTree<Patch> {
        let positions = triangles.iter().flatten().copied().collect();
        let material =
            Material { exitance: Rgb::new(3.0, 2.0, 1.0), ..Material::grey("light", 0.0) };
        let corner = |t: usize| [3 * t, 3 * t + 1, 3 * t + 2].map(|k| k as u32);
        let triangles = (0..triangles.len())
            .map(|t| Triangle { corners: corner(t), material: 0, group: 0, smoothing: None })
            .collect();
        let scene = Scene::new(positions, triangles, vec!["light".into()], vec![material]).unwrap();
        LightTree::new(patch::patches(&scene), 0.0)
    }

    fn direction(k: usize) -> DVec3 {
        let [x, y] = r2_point(k, 0.5);
        let z = 2.0 * x - 1.0;
        let (sine, cosine) = (2.0 * PI * y).sin_cos();
        DVec3::new((1.0 - z * z).sqrt() * cosine, z, (1.0 - z * z).sqrt() * sine)
    }

    fn exact(tree: &LightTree<Patch>, node: &Node, point: &GatherPoint) -> f64 {
        let leaves = &tree.leaves[node.leaves.start as usize..node.leaves.end as usize];
        leaves.iter().map(|leaf| leaf.irradiance(point).element_sum()).sum()
    }

    #[test]
    fn nodes_are_off_by_less_than_their_bound() {
        for (s, shape) in shapes().iter().enumerate() {
            let tree = tree_of(shape);
            let (mut above, mut all) = (0, 0);
            for k in 0..20_000 {
                let number = (k * 7919) % tree.nodes.len();
                let node = &tree.nodes[number];
                let distance =
                    0.5 * node.bounds.diagonal() * (1.5 * 40f64.powf(radical_inverse(k as u32)));
                let position = node.bounds.centre() + distance * direction(k);
                let point = GatherPoint { position, normal: direction(k * 31 + 7), near: 0.0 };
                let estimate = tree.estimate(number as u32, &point);
                let estimated = estimate.map_or([0.0; 2], |node| [node.brightness(), node.bound]);
                let off = (estimated[0] - exact(&tree, node, &point)).abs();
                // Closed forms of far triangles are exact to 1e-9 (`closed_form`).
                above += usize::from(off > estimated[1] + 1e-9 * node.peak / distance.powi(2));
                all += 1;
            }
            println!("shape {s}: {above} of {all}");
            assert!(above * 100 < all, "shape {s}: {above} of {all} above their bound");
        }
    }

    #[test]
    fn cuts_are_as_exact_as_their_bound() {
        let (mut triangles, mut shift) = (vec![], 0.0);
        for shape in shapes() {
            triangles.extend(shape.iter().map(|t| t.map(|p| 0.3 * p + DVec3::X * shift)));
            shift += 1.5;
        }
        let tree = tree_of(&triangles);
        for max_bound in [1e-3, 1e-5] {
            let (mut squares, mut nodes) = (0.0, 0);
            for k in 0..200 {
                let position = DVec3::new(6.0 * radical_inverse(k) + 1.0, -2.0, 0.0);
                let point = GatherPoint { position, normal: direction(k as usize), near: 0.0 };
                let cut = tree.cut(&point, max_bound);
                let value: f64 = cut.nodes.iter().map(CutNode::brightness).sum();
                let truth = exact(&tree, &tree.nodes[0], &point);
                if truth > 0.0 {
                    squares += ((value - truth) / truth).powi(2);
                    nodes += cut.nodes.len();
                }
            }
            let off = (squares / 200.0).sqrt();
            println!("{max_bound}: off by {off:.1e}, {} nodes a point", nodes / 200);
            // Up to a hundred bounds of random signs.
            assert!(off < 10.0 * max_bound, "{max_bound}: {off}");
        }
    }
}
