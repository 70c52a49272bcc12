//! What arrives straight from luminaires: by rays to points of their openings.
//!
//! ```text
//!   one that is a point       E = I cos θ / d²             one ray: exact
//!   one with an opening       E = ∫ I cos θ / d² dA / A · visible share
//!                                 by Gauss points           by rays, until they agree
//! ```
//!
//! So where nothing hides an opening there is no noise. A hemicube with the intensity in the place
//! of the cosine, as seen from the lamp, would have the pixels of its shadows fall on the floor.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::GatherPoint;
use super::light_samples::{LightSample, LightSamples, SampledLeaf};
use super::light_tree::cone::Cone;
use super::light_tree::profile::Profile;
use super::light_tree::{Cut, Leaf, LightTree};
use crate::geometry::COINCIDENCE_TOLERANCE;
use crate::geometry::aabb::Aabb;
use crate::geometry::quadrature::{GAUSS_LEGENDRE_2, GAUSS_LEGENDRE_3, Node};
use crate::sampling::low_discrepancy::{r2_point, sobol_02_point};
use crate::sampling::rotation::{CellRotation, second_rotation};
use crate::scene::{Luminaire, Rgb, Scene};
use crate::visibility::panes::Panes;
use crate::visibility::ray_scene::RayScene;

/// The luminaires of a scene, and what rays to them meet.
pub(crate) struct LuminaireLight<'a> {
    pub luminaires: &'a [Luminaire],
    pub tree: &'a LightTree<Luminaire>,
    pub rays: &'a RayScene,
    pub panes: &'a Panes,
    pub rotations: &'a CellRotation,
}

/// What arrives from all luminaires.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LuminaireIrradiance {
    /// W/m² per channel.
    pub irradiance: Rgb,
    /// Error of that where nothing is in the way, W/m²: of the least of many luminaires.
    pub error: f64,
}

/// An opening this many times smaller than it is far away is a point: the second moment of what it
/// sends is then 1e-7 of it at most.
const POINT_DISTANCE: f64 = 1e3;

/// Distance of an opening in units of its size from which a rule of degree 3 will do: of a disc
/// that faces the point, and has the radius a at the distance d, its error is (a/d)⁴/4 = 4e-6.
const FAR: f64 = 8.0;

/// Rays to an opening: initially, and in total where some of them are occluded. A penumbra then has
/// about forty steps, and noise below its change between vertices.
const RAYS: [u32; 2] = [16, 256];

/// Luminaires that have that many rays on average; more share the rays of these.
const LUMINAIRES_OF_RAYS: u32 = 4;

/// Bound of the error of luminaires as a share of the irradiance of all, where shadows are looked
/// for by what arrives: differences of a hundred errors are below 0.2 % then.
pub(super) const SMALL_BOUND: f64 = 1e-3;

/// Bound of the error of luminaires as a share of the irradiance of all at one of many points: ten
/// nodes of the largest error and of random signs are off by 3 %, as the middle of a part of an
/// element may be from its mean.
const COARSE_BOUND: f64 = 1e-2;

/// Rays to luminaires that share rays, over those cast initially, where some of them are hidden: at
/// most 256, which are off by 3 % where half of the light arrives.
const POOL_RAYS: u32 = 4;

impl LightTree<Luminaire> {
    /// The luminaires of `scene`, made once a scene.
    pub fn of_luminaires(scene: &Scene) -> Arc<LightTree<Luminaire>> {
        scene.derived(|scene| {
            let luminaires = scene.luminaires().to_vec();
            let flux: f64 = luminaires.iter().map(|l| l.flux().element_sum()).sum();
            LightTree::new(luminaires, flux / scene.total_area())
        })
    }
}

impl Leaf for Luminaire {
    fn bounds(&self) -> Aabb {
        self.bounds()
    }

    fn middle(&self) -> (DVec3, DMat3) {
        (self.position, DMat3::ZERO)
    }

    fn cone(&self) -> Option<Cone> {
        (self.intensity.is_dark_behind()).then(|| Cone::of(self.aim))
    }

    fn facing(&self) -> Option<DMat3> {
        None
    }

    fn is_resolved(&self, largest: f64) -> bool {
        // Beams that are narrower than the cells of a table fall between its directions.
        largest >= 0.8 * self.peak()
    }

    fn intensity(&self, direction: DVec3) -> Rgb {
        self.scale * self.intensity_along(direction)
    }

    fn peak(&self) -> f64 {
        self.scale.element_sum() * self.intensity.peak()
    }

    fn profile(&self) -> Option<Profile> {
        let peak = |angles| self.scale.element_sum() * self.intensity.peak_between(angles);
        Some(Profile::new(self.pole(), peak))
    }

    fn irradiance(&self, point: &GatherPoint) -> Rgb {
        self.scale * unoccluded(self, point.position, point.normal)
    }
}

impl SampledLeaf for Luminaire {
    fn sample(&self, at: [f64; 3], point: &GatherPoint) -> LightSample {
        let position = self.point(at);
        let of_one = Luminaire::irradiance(self, position, point.position, point.normal);
        LightSample { position, irradiance: self.scale * of_one, surface: None }
    }

    fn is_point(&self, point: &GatherPoint) -> bool {
        is_point_from(self, point.position)
    }
}

impl LuminaireLight<'_> {
    /// Irradiance at `point`; that of no luminaire is off by more than the share `max_bound` of
    /// that of all.
    pub fn irradiance(&self, point: &GatherPoint, max_bound: f64) -> LuminaireIrradiance {
        let Cut { nodes, error } = self.tree.cut(point, max_bound);
        if nodes.is_empty() {
            return LuminaireIrradiance { error, ..Default::default() };
        }
        let rotation = self.rotations.at(point.position, point.near);
        let all = RAYS[0] * LUMINAIRES_OF_RAYS;
        let lights = LightSamples::new(self.tree, nodes, point, rotation, all / 2);
        let counted = (lights.strata() as u32).clamp(1, LUMINAIRES_OF_RAYS);
        let [first, last] = RAYS.map(|rays| rays * counted);
        let passed = |sample: &LightSample| self.passed(point, sample.position);
        let mut sums = lights.cast(0..first, |_| true, passed);
        let own = lights.strata();
        let more =
            lights.cast(first..last, |stratum| stratum < own && sums.is_partial(stratum), passed);
        let of_pool = lights.cast(
            first..first * POOL_RAYS,
            |stratum| stratum == own && sums.is_partial(stratum),
            passed,
        );
        sums.add(&more);
        sums.add(&of_pool);
        LuminaireIrradiance { irradiance: lights.irradiance(&sums), error }
    }

    /// Irradiance at one of many points whose mean is wanted, W/m² per channel: by few rays, and
    /// nodes that are off by a few percent of the irradiance of all together.
    pub fn coarse_irradiance(&self, point: &GatherPoint) -> Rgb {
        let nodes = self.tree.cut(point, COARSE_BOUND).nodes;
        if nodes.is_empty() {
            return Rgb::ZERO;
        }
        let rotation = self.rotations.at(point.position, point.near);
        let lights = LightSamples::new(self.tree, nodes, point, rotation, RAYS[0] / 2);
        let passed = |sample: &LightSample| self.passed(point, sample.position);
        lights.irradiance(&lights.cast(0..RAYS[0], |_| true, passed))
    }

    /// Irradiance where nothing hides them, W/m² per channel.
    pub fn unoccluded(&self, point: &GatherPoint) -> Rgb {
        self.tree.cut(point, SMALL_BOUND).nodes.iter().map(|node| node.irradiance).sum()
    }

    /// The luminaires that `point` sees, by their indices, and what they light it with in units of
    /// their scales, W/m²: a mean of the channels where panes let through less of one.
    pub fn unscaled(&self, point: &GatherPoint) -> Vec<(u32, f64)> {
        let of = |luminaire| self.of(luminaire, point).element_sum() / 3.0;
        let all = (0..).zip(self.luminaires.iter().map(of));
        all.filter(|&(_, irradiance)| irradiance > 0.0).collect()
    }

    /// Irradiance at `point` in units of the scale, W/m² per channel.
    fn of(&self, luminaire: &Luminaire, point: &GatherPoint) -> Rgb {
        let GatherPoint { position, normal, .. } = *point;
        let unoccluded = unoccluded(luminaire, position, normal);
        if unoccluded == 0.0 {
            return Rgb::ZERO;
        }
        let seen = match is_point_from(luminaire, position) {
            true => self.passed(point, luminaire.position),
            false => self.seen_share(luminaire, point),
        };
        unoccluded * seen
    }

    /// The share of the light of an opening that arrives at `point`, per channel.
    fn seen_share(&self, luminaire: &Luminaire, point: &GatherPoint) -> Rgb {
        let rotation = self.rotations.at(point.position, point.near);
        let second_rotation = second_rotation(rotation);
        let (mut seen, mut all) = (Rgb::ZERO, 0.0);
        for (start, end) in [(0, RAYS[0]), (RAYS[0], RAYS[1])] {
            for k in start..end {
                let [x, y] = sobol_02_point(k);
                let [z, _] = r2_point(k as usize, rotation);
                let (x, y) = ((x + second_rotation).fract(), (y + rotation).fract());
                let target = luminaire.point([x, y, z]);
                let irradiance =
                    Luminaire::irradiance(luminaire, target, point.position, point.normal);
                all += irradiance;
                if irradiance > 0.0 {
                    seen += irradiance * self.passed(point, target);
                }
            }
            if seen == Rgb::ZERO || seen == Rgb::splat(all) {
                break;
            }
        }
        seen / f64::max(all, f64::MIN_POSITIVE)
    }

    /// The share per channel of light that arrives at `point` from `target`.
    fn passed(&self, point: &GatherPoint, target: DVec3) -> Rgb {
        let to = target - point.position;
        let reach = point.near / to.length()..1.0 - COINCIDENCE_TOLERANCE;
        if self.rays.occluded(point.position, to, reach.clone(), |_| true) {
            return Rgb::ZERO;
        }
        self.panes.transmittance(point.position, to, reach)
    }
}

/// Whether the opening is a point as seen from `at`.
fn is_point_from(luminaire: &Luminaire, at: DVec3) -> bool {
    luminaire.extent() * POINT_DISTANCE <= luminaire.position.distance(at)
}

/// Irradiance at `at` with this unit `normal` where nothing hides the opening, in units of the
/// scale.
///
/// From [`FAR`] sizes on a rule of degree 3 is enough: two Gauss points a side, and around a disc
/// four points that have half of its area inside. Nearer, each side of the opening is cut into
/// panels that are half as long as the opening is far, or as 16, with three Gauss points each:
/// where intensity is smooth the error is about 8⁻⁶ = 4e-6 (see [`crate::geometry::quadrature`]).
fn unoccluded(luminaire: &Luminaire, at: DVec3, normal: DVec3) -> f64 {
    if is_point_from(luminaire, at) {
        return Luminaire::irradiance(luminaire, luminaire.position, at, normal);
    }
    let distance = luminaire.distance_to_box(at);
    let (size, is_round) = (luminaire.opening.size, luminaire.opening.is_round);
    let diameter = size.x.max(size.y);
    let gauss = |side: f64| if side > 0.0 { &GAUSS_LEGENDRE_2[..] } else { &MIDDLE };
    let [x, y, z] = match (distance >= FAR * luminaire.extent(), is_round) {
        (true, true) => [nodes(1, &MIDDLE), nodes(4, &MIDDLE), nodes(1, gauss(size.z))],
        (true, false) => size.to_array().map(|size| nodes(1, gauss(size))),
        (false, _) => {
            // Around a round one the second coordinate is an angle, of four panels at least.
            let [x, y] = if is_round { [diameter, PI * diameter] } else { [size.x, size.y] };
            let panels = |side: f64| (2.0 * side / distance).ceil().min(16.0) as u32;
            let nodes = |side: f64, fewest: u32| match panels(side).max(fewest) {
                0 => nodes(1, &MIDDLE),
                panels => nodes(panels, &GAUSS_LEGENDRE_3),
            };
            [nodes(x, 0), nodes(y, if is_round { 4 } else { 0 }), nodes(size.z, 0)]
        }
    };
    let mut sum = 0.0;
    for x in x {
        for y in y.clone() {
            for z in z.clone() {
                let point = luminaire.point([x.x, y.x, z.x]);
                let weight = x.weight * y.weight * z.weight;
                sum += weight * Luminaire::irradiance(luminaire, point, at, normal);
            }
        }
    }
    sum
}

/// The middle of an interval.
const MIDDLE: [Node; 1] = [Node { x: 0.5, weight: 1.0 }];

/// The nodes of `rule` in each of `panels` parts of [0, 1].
fn nodes(panels: u32, rule: &'static [Node]) -> impl Iterator<Item = Node> + Clone + use<> {
    let width = 1.0 / f64::from(panels);
    (0..panels).flat_map(move |k| {
        let in_panel = move |node: &Node| Node {
            x: (f64::from(k) + node.x) * width,
            weight: node.weight * width,
        };
        rule.iter().map(in_panel)
    })
}
