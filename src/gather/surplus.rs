//! Hierarchical surplus: how far the gathered light is from linear over an element.
//!
//! The parent of an element is a six-node triangle: values at its corners, and at its midsides,
//! where splitting it put vertices. The surplus of a midside is how far its value is from the mean
//! of its side's ends, which is what linear interpolation had there before (the coefficient in the
//! hierarchical basis, Yserentant, "On the multi-level splitting of finite element spaces", Numer.
//! Math. 49, 1986).
//!
//! ```text
//!           c                  surplus of midside k:  s_k = m_k − (c_k + c_k+1) / 2
//!          ╱ ╲                 quadratic interpolant: linear through a, b, c
//!        m2───m1                                      + Σ_k s_k 4 λ_k λ_k+1
//!        ╱ ╲ ╱ ╲               (λ: barycentric coordinates)
//!       a───m0──b
//! ```
//!
//! Three numbers follow, all exact where the light is quadratic:
//!
//! - *Surplus of the children: ¼.* Along a side of length h, s = −f″ h²/8 with f″ constant. Each
//!   side of a child is parallel to one of the parent and half as long, so its surplus is s/4.
//! - *Mean over a child: Σ s_k / 12 above the linear one.* The mean of λ_i λ_j over a triangle is
//!   1/12, so that of 4 λ_i λ_j is 1/3: over the parent the interpolant's mean is Σ s_k / 3 above
//!   the linear one. A child has a quarter of each surplus.
//! - *Mean square distance from the linear one: 4/45 (Σ |s_k|² + |Σ s_k|²).* The mean of
//!   (4 λ_i λ_j)² is 8/45, that of the product of two of these 4/45.

use rayon::prelude::*;

use super::sampled_mesh::SampledMesh;
use crate::scene::Rgb;

/// Surplus of a child's side over that of the parent's side it is parallel to, for quadratic light.
const CHILD_SURPLUS: f64 = 0.25;

/// Surplus over the darkest of the six nodes, above which most of an element's error may be at a
/// jump of the light. No other value was tried.
const MAX_CERTAIN_SURPLUS: f64 = 0.3;

/// Mean over a triangle of 16 λ_i² λ_j λ_k.
const MEAN_BUBBLE_PRODUCT: f64 = 4.0 / 45.0;

/// Standard errors beyond which a difference is none of noise: of normal errors one in 400 is
/// larger, and rays know theirs roughly.
pub(super) const CERTAIN_ERRORS: f64 = 3.0;

/// A value at a vertex.
#[derive(Clone, Copy, Debug)]
pub(super) struct NodeValue {
    /// Reflected radiosity, W/m² per channel.
    pub value: Rgb,
    /// Standard error of the value, W/m²: a length over the channels.
    pub noise: f64,
    /// Whether the vertex is buried, so that the value is no sample of the light.
    pub buried: bool,
}

impl NodeValue {
    /// That of vertex `v`.
    pub fn of(samples: &SampledMesh, v: u32) -> NodeValue {
        let v = v as usize;
        NodeValue {
            value: samples.reflected[v],
            noise: samples.noise[v],
            buried: samples.buried[v],
        }
    }
}

/// Reflected radiosity over the parent of an element: a six-node triangle.
pub(super) struct HierarchicalSurplus {
    pub corners: [NodeValue; 3],
    /// Midside k lies between the corners k and k + 1 (mod 3).
    pub midsides: [NodeValue; 3],
}

impl HierarchicalSurplus {
    /// The six nodes of the parent of element `e`; `None` for an element without a parent.
    pub fn of_parent(samples: &SampledMesh, e: usize) -> Option<HierarchicalSurplus> {
        let mesh = &samples.mesh;
        let parts = mesh.siblings(mesh.element(e))?;
        let node_value = |part: usize, corner: usize| {
            let element = mesh.element_at_corner(parts[part], corner);
            NodeValue::of(samples, samples.corners()[element][corner])
        };
        Some(HierarchicalSurplus {
            corners: [0, 1, 2].map(|k| node_value(k, k)),
            // Corners of the middle part are the middles of the sides opposite.
            midsides: [2, 0, 1].map(|corner| node_value(3, corner)),
        })
    }

    /// Surplus of each midside, W/m² per channel.
    pub fn midside_surplus(&self) -> [Rgb; 3] {
        let (c, m) = (&self.corners, &self.midsides);
        [0, 1, 2].map(|k| m[k].value - (c[k].value + c[(k + 1) % 3].value) / 2.0)
    }

    /// Standard error of the surplus of midside `k`, W/m²: a length over the channels.
    fn surplus_noise(&self, k: usize) -> f64 {
        let ends = libm::hypot(self.corners[k].noise, self.corners[(k + 1) % 3].noise) / 2.0;
        libm::hypot(self.midsides[k].noise, ends)
    }

    /// The midsides that are not buried, by number.
    fn sampled_midsides(&self) -> impl Iterator<Item = usize> {
        (0..3).filter(|&k| !self.midsides[k].buried)
    }

    /// Whether all six nodes are samples of the light.
    pub fn is_sampled(&self) -> bool {
        self.corners.iter().chain(&self.midsides).all(|node| !node.buried)
    }

    /// Whether the quadratic interpolant describes the light: all six nodes are samples of it, and
    /// there is no jump (an edge of a shadow), of which the sum of surpluses is at least 0.2 of the
    /// sum of midside values.
    pub fn is_smooth(&self) -> bool {
        let surplus = self.midside_surplus().iter().sum::<Rgb>();
        let midsides = self.midsides.iter().map(|m| m.value).sum::<Rgb>();
        self.is_sampled() && surplus.length() < 0.2 * midsides.length()
    }

    /// Whether it may jump next to its darkest node, or to `floor` (W/m²) where this is more.
    pub fn may_jump(&self, floor: f64) -> bool {
        let nodes = self.corners.iter().chain(&self.midsides).filter(|n| !n.buried);
        let darkest = nodes.map(|n| n.value.length()).fold(f64::INFINITY, f64::min).max(floor);
        let surplus = self.midside_surplus();
        let noise = |k: usize| CERTAIN_ERRORS * self.surplus_noise(k);
        let certain = |k: usize| beyond_noise(surplus[k].length(), noise(k));
        let largest = [0, 1, 2].map(certain).into_iter().fold(0.0, f64::max);
        largest > MAX_CERTAIN_SURPLUS * darkest
    }

    /// Root mean square over a child of how far the quadratic interpolant is from the linear one,
    /// without what noise adds to its square on average, W/m²: a length over the channels. Sides
    /// whose midside is buried count as straight.
    pub fn child_rms(&self) -> f64 {
        let surplus = self.midside_surplus();
        let (mut sum, mut squares, mut noise) = (Rgb::ZERO, 0.0, 0.0);
        for k in self.sampled_midsides() {
            sum += surplus[k];
            squares += surplus[k].length_squared();
            // Of the square, and of that of the sum: each end counts a half in two sides.
            noise += self.surplus_noise(k).powi(2);
            noise += self.midsides[k].noise.powi(2) + self.corners[k].noise.powi(2);
        }
        let square = squares + sum.length_squared() - noise;
        CHILD_SURPLUS * (MEAN_BUBBLE_PRODUCT * square.max(0.0)).sqrt()
    }

    /// Mean of the corners' values, W/m² per channel.
    pub fn corner_mean(&self) -> Rgb {
        self.corners.iter().map(|c| c.value).sum::<Rgb>() / 3.0
    }

    /// Largest surplus of a child's sides that is to be expected, W/m²: a length over the channels.
    pub fn predicted_child_surplus(&self) -> f64 {
        self.midside_surplus().iter().map(|s| s.length()).fold(0.0, f64::max) * CHILD_SURPLUS
    }

    /// The same from the midsides that are not buried: 0 where all are.
    pub fn predicted_sampled_child_surplus(&self) -> f64 {
        let surplus = self.midside_surplus();
        self.sampled_midsides().map(|k| surplus[k].length()).fold(0.0, f64::max) * CHILD_SURPLUS
    }

    /// Mean of the quadratic interpolant over a child less that of the linear one through the
    /// child's corners, W/m² per channel; the same for all four children.
    pub fn child_mean_shift(&self) -> Rgb {
        self.midside_surplus().iter().sum::<Rgb>() / 12.0
    }

    /// Values of the quadratic interpolant at the midsides of child `k`, W/m² per channel. In a
    /// channel with a surplus of more than [`MAX_CERTAIN_SURPLUS`] of its darkest node they are
    /// kept within the six nodes: beside the edge of a shadow the interpolant leaves them, down to
    /// where no light is. With less it leaves them by a fraction of that share.
    pub fn child_midsides(&self, k: usize) -> [Rgb; 3] {
        let nodes = || self.corners.iter().chain(&self.midsides).map(|node| node.value);
        let least = nodes().fold(Rgb::INFINITY, Rgb::min);
        let most = nodes().fold(Rgb::NEG_INFINITY, Rgb::max);
        let surplus = self.midside_surplus().map(Rgb::abs).into_iter().fold(Rgb::ZERO, Rgb::max);
        let is_smooth = surplus.cmple(MAX_CERTAIN_SURPLUS * least);
        let within = |value: Rgb| Rgb::select(is_smooth, value, value.clamp(least, most));
        self.quadratic_at_child_midsides(k).map(within)
    }

    /// The quadratic interpolant there: the shape functions λ(2λ − 1) of the corners and 4 λ λ' of
    /// the midsides.
    fn quadratic_at_child_midsides(&self, k: usize) -> [Rgb; 3] {
        let corner = |i: usize| self.corners[i].value;
        let midside =
            |i: usize, j: usize| self.midsides[if (i + 1) % 3 == j { i } else { j }].value;
        [0, 1, 2].map(|side| {
            let (i, j) = (side, (side + 1) % 3);
            if k == i || k == j {
                // On a side of the parent, next to its corner k: λ = (¾, ¼, 0).
                let other = i + j - k;
                return corner(k) * 0.375 + midside(i, j) * 0.75 - corner(other) * 0.125;
            }
            // Half-way between the two midsides next to corner `apex`: λ = (½, ¼, ¼).
            let apex = if k == 3 { 3 - i - j } else { k };
            let (p, q) = ((apex + 1) % 3, (apex + 2) % 3);
            (midside(apex, p) + midside(apex, q)) / 2.0 + midside(p, q) / 4.0
                - (corner(p) + corner(q)) / 8.0
        })
    }
}

/// What is left of a difference of this `length` where its standard error is `noise`: the mean of
/// its square is that of what it is without noise, plus that of the noise. Elements that are split
/// for noise get corners that are as noisy.
pub(super) fn beyond_noise(length: f64, noise: f64) -> f64 {
    (length.powi(2) - noise.powi(2)).max(0.0).sqrt()
}

/// Values at the vertices of which the linear interpolant has, over every element, about the mean
/// of the quadratic one; W/m² per channel.
///
/// Linear interpolation of exact values loses light where it is convex, next to bright spots above
/// all. Every vertex is raised by the mean of its elements' shifts, weighted by area.
pub(super) fn mean_preserving(samples: &SampledMesh) -> Vec<Rgb> {
    let shift = |e: usize| {
        let surplus =
            HierarchicalSurplus::of_parent(samples, e).filter(HierarchicalSurplus::is_smooth);
        surplus.map_or(Rgb::ZERO, |s| s.child_mean_shift())
    };
    let shifts: Vec<Rgb> = (0..samples.mesh.element_count()).into_par_iter().map(shift).collect();
    let mut sums = vec![(Rgb::ZERO, 0.0); samples.reflected.len()];
    for (e, (corners, shift)) in samples.corners().iter().zip(shifts).enumerate() {
        let area = samples.mesh.weight(samples.mesh.element(e));
        for &v in corners {
            sums[v as usize].0 += shift * area;
            sums[v as usize].1 += area;
        }
    }
    let values = samples.reflected.iter().zip(sums);
    values.map(|(&b, (shift, area))| (b + shift / area).max(Rgb::ZERO)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nodes(corners: [f64; 3], midsides: [f64; 3]) -> HierarchicalSurplus {
        let node = |value: f64| NodeValue { value: Rgb::splat(value), noise: 0.0, buried: false };
        HierarchicalSurplus { corners: corners.map(node), midsides: midsides.map(node) }
    }

    #[test]
    fn quadratics_are_followed_between_the_nodes() {
        // 1 + x + x², with x the weight of the second corner.
        let f = |x: f64| 1.0 + x + x * x;
        let nodes = nodes([f(0.0), f(1.0), f(0.0)], [f(0.5), f(0.5), f(0.0)]);
        // The second child: its midsides are at x = ¾, ¾ and ½.
        for (value, x) in nodes.child_midsides(1).into_iter().zip([0.75, 0.75, 0.5]) {
            assert!((value.x - f(x)).abs() < 1e-15, "{value} at {x}");
        }
    }

    #[test]
    fn no_value_is_beyond_the_nodes_at_an_edge_of_light() {
        // Beside the edge of a shadow, where the interpolant goes down to 0.1; and beside that of
        // light, where it goes up to 1.1.
        let dark = ([1.0, 1.0, 0.2], [1.0, 0.2, 0.2]);
        let bright = ([0.2, 0.2, 1.0], [0.2, 1.0, 1.0]);
        for ((corners, midsides), beyond) in [(dark, 0.1), (bright, 1.1)] {
            let nodes = nodes(corners, midsides);
            let raw = |k: usize| nodes.quadratic_at_child_midsides(k).map(|value| value.x);
            assert!((0..4).flat_map(raw).any(|value| (value - beyond).abs() < 1e-12));
            for value in (0..4).flat_map(|k| nodes.child_midsides(k)) {
                assert!((0.2..=1.0).contains(&value.x), "{value}");
            }
        }
    }
}
