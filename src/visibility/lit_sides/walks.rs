//! Random walks from sides of triangles to the light.

use std::f64::consts::PI;
use std::iter::{once, repeat_with};
use std::sync::Arc;

use fastrand::Rng;
use glam::DVec3;
use rustc_hash::FxHashMap;

use super::repeated::lamps_of_other_sides;
use super::sheets::{Sheets, SideIndex};
use crate::geometry::FILE_TOLERANCE;
use crate::sampling::hemisphere::cosine_direction;
use crate::sampling::low_discrepancy::fold_to_triangle;
use crate::sampling::surface::AreaSampler;
use crate::scene::{Facets, Rgb, Scene, Sides};
use crate::visibility::offset;
use crate::visibility::panes::Panes;
use crate::visibility::ray_scene::{Hit, RayScene};

/// The scene that walks traverse.
pub struct Walks<'a> {
    scene: &'a Scene,
    /// One per material.
    sides: &'a [Sides],
    rays: Arc<RayScene>,
    panes: Panes,
    facets: Arc<Facets>,
    /// Triangles that emit.
    lamps: Vec<usize>,
    /// Whether they emit from their backs.
    shining_backs: FxHashMap<usize, bool>,
    /// Of lamps that the file has once for each side, the other triangle.
    other_sides: FxHashMap<usize, usize>,
    /// Power of each lamp, in units of `brightest` times area.
    powers: AreaSampler,
    /// Exitance of the brightest lamp, W/m² summed over the channels.
    brightest: f64,
    /// Flux of each luminaire, W summed over the channels.
    fluxes: AreaSampler,
    /// Surfaces within this distance of each other coincide, scene unit.
    contact: f64,
}

impl<'a> Walks<'a> {
    /// Prepares walks in `scene`, whose materials have these `sides`.
    pub fn new(scene: &'a Scene, sides: &'a [Sides], sheets: &Sheets) -> Walks<'a> {
        let count = scene.triangles().len();
        let exitance = |&t: &usize| scene.exitance(t).element_sum();
        let lamps: Vec<usize> = (0..count).filter(|t| exitance(t) > 0.0).collect();
        let brightest = lamps.iter().map(exitance).fold(0.0, f64::max);
        let power = |t: &usize| exitance(t) / brightest * scene.area(*t);
        let mut walks = Walks {
            scene,
            sides,
            rays: RayScene::of_scene(scene),
            panes: Panes::of_scene(scene),
            facets: scene.facets(),
            shining_backs: FxHashMap::default(),
            other_sides: lamps_of_other_sides(scene, &lamps),
            powers: AreaSampler::new(lamps.iter().map(power)),
            brightest,
            fluxes: AreaSampler::new(scene.luminaires().iter().map(|l| l.flux().element_sum())),
            lamps,
            contact: offset::path_contact(scene),
        };
        walks.shining_backs = walks.find_shining_backs(sheets);
        walks
    }

    /// Whether the scene has any light.
    pub fn has_light(&self) -> bool {
        !self.lamps.is_empty() || self.scene.has_light_of_no_surface()
    }

    /// The [`Sides`] of the surface of triangle `t`.
    pub fn sides_of(&self, t: usize) -> Sides {
        // Where the file has one surface per side, each has its own front.
        if self.scene.is_back_covered(t) {
            return Sides::Front;
        }
        self.sides_of_material(t)
    }

    /// The [`Sides`] of the material of triangle `t`, regardless of its position.
    fn sides_of_material(&self, t: usize) -> Sides {
        match self.sides[self.scene.triangles()[t].material as usize] {
            // A black piece of its texture.
            Sides::Emitting if self.scene.exitance(t) == Rgb::ZERO => Sides::Auto,
            sides => sides,
        }
    }

    /// Whether lamp `t` emits from its back; `None` if it is no lamp.
    pub fn shines_from_back(&self, t: usize) -> Option<bool> {
        self.shining_backs.get(&t).copied()
    }

    /// Whether `side` emits.
    fn emits(&self, side: SideIndex) -> bool {
        let (t, is_back) = (side / 2, side % 2 == 1);
        self.shines_from_back(t).is_some_and(|back| back == is_back || self.shines_on_both(t))
    }

    /// Whether lamp `t` emits on both of its sides.
    fn shines_on_both(&self, t: usize) -> bool {
        self.sides_of(t) == Sides::Emitting
    }

    /// Whether lamp `t` is one of a pair of opposite sides of which the other suffices: light from
    /// there reaches much further.
    pub fn is_inner_side_of_lamp(&self, t: usize) -> bool {
        self.other_sides.contains_key(&t) && self.shines_from_back(t) == Some(true)
    }

    fn find_shining_backs(&self, sheets: &Sheets) -> FxHashMap<usize, bool> {
        let sides: Vec<SideIndex> = self.lamps.iter().flat_map(|t| [2 * t, 2 * t + 1]).collect();
        let free = sheets.sample(&sides, |side, rng| {
            let start = self.random_start(side, rng)?;
            let direction = self.random_direction(side, rng);
            let (at, hit_side) = self.next(start, side, direction)?;
            (self.scene.exitance(hit_side / 2) == Rgb::ZERO).then(|| start.distance(at))
        });
        let shines_from_back = |&t: &usize| {
            let other = self.other_sides.get(&t);
            let both = [2 * t, other.map_or(2 * t + 1, |other| 2 * other)];
            let [front, back] = both.map(|side| free.of_sheet(side).mean());
            // The back of the lamp is covered by the other one.
            let given = if other.is_some() { self.sides_of_material(t) } else { self.sides_of(t) };
            // Mean free paths. Lamps right below a ceiling and bulbs wound inside out are far above
            // this ratio; a lamp that lights a ceiling, with the room below it ten times as high as
            // the gap, is not. Rays that hit a lamp do not count, such as those within a body that
            // emits all around.
            (t, given == Sides::Auto && back > 16.0 * front)
        };
        self.lamps.iter().map(shines_from_back).collect()
    }

    /// Estimated irradiance at a point on a side, W/m² summed over the channels, from the first
    /// light that a walk from there reaches; `None` if it reaches none.
    pub fn walk_to_light(&self, mut at: DVec3, mut side: SideIndex, rng: &mut Rng) -> Option<f64> {
        let mut throughput = 1.0;
        // Through a door of a thirtieth of a room's area 40 % of the walks get out. Plain choice.
        for _ in 0..16 {
            let direct = self.irradiance_of_lamp(at, side, rng);
            let direct = direct.or_else(|| self.irradiance_of_luminaire(at, side, rng));
            if let Some(irradiance) = direct.or_else(|| self.irradiance_of_sun(at, side, rng)) {
                return Some(throughput * irradiance);
            }
            let direction = self.random_direction(side, rng);
            let Some(next) = self.next(at, side, direction) else {
                throughput *= self.passed(at, direction, f64::INFINITY);
                let sky = throughput * PI * self.scene.sky().radiance(direction).element_sum();
                return (sky > 0.0).then_some(sky);
            };
            throughput *= self.passed(at, direction, at.distance(next.0));
            (at, side) = next;
            let (t, is_back) = (side / 2, side % 2 == 1);
            if self.emits(side) {
                return Some(throughput * self.scene.exitance(t).element_sum());
            }
            let material = self.scene.material(t);
            let is_dark = is_back && self.sides_of(t) == Sides::Front;
            if is_dark && !material.is_translucent() || !material.scatters() {
                return None;
            }
            throughput *= material.albedo().max_element();
            if material.is_translucent() {
                let through = material.transmittance.element_sum();
                if rng.f64() * material.albedo().element_sum() < through {
                    side ^= 1;
                }
            }
        }
        None
    }

    /// A random point on `side`; `None` at a back covered by a front.
    pub fn random_start(&self, side: SideIndex, rng: &mut Rng) -> Option<DVec3> {
        let at = self.random_point(side / 2, rng);
        let hidden = side % 2 == 1 && self.front_before(at, side).is_some();
        (!hidden).then_some(at)
    }

    /// The triangle whose front coincides with a back, `side`, and faces the same way: light hits
    /// that one.
    pub fn front_before(&self, at: DVec3, side: SideIndex) -> Option<usize> {
        let (t, normal) = (side / 2, self.normal(side));
        let reach = (FILE_TOLERANCE * self.scene.area(t).sqrt()).max(self.contact);
        let mut covering = None;
        self.rays.occluded(at + reach * normal, -normal, 0.0..2.0 * reach, |hit| {
            let alike = self.facets.normals[hit.triangle].dot(normal) > 0.999;
            let counts = hit.front && hit.triangle != t && alike;
            if counts {
                covering = Some(hit.triangle);
            }
            counts
        });
        covering
    }

    /// Unit normal on a side.
    fn normal(&self, side: SideIndex) -> DVec3 {
        let front = self.facets.normals[side / 2];
        if side.is_multiple_of(2) { front } else { -front }
    }

    /// A cosine-distributed direction from a side.
    pub fn random_direction(&self, side: SideIndex, rng: &mut Rng) -> DVec3 {
        let turn = rng.f64();
        cosine_direction(self.normal(side), [rng.f64(), turn])
    }

    /// The hit of a ray from a point on a side, and the side that it hits.
    pub fn next(&self, at: DVec3, side: SideIndex, direction: DVec3) -> Option<(DVec3, SideIndex)> {
        let hit = self.rays.closest_hit(at, direction, self.contact, Some(side / 2))?;
        Some((at + hit.distance * direction, 2 * hit.triangle + usize::from(!hit.front)))
    }

    /// Irradiance at a point on a side from the sun; `None` if it is not visible.
    fn irradiance_of_sun(&self, at: DVec3, side: SideIndex, rng: &mut Rng) -> Option<f64> {
        let sun = self.scene.sky().sun()?;
        let direction = sun.towards([rng.f64(), rng.f64()]);
        let cosine = self.normal(side).dot(direction);
        let hides = |hit: &Hit| hit.triangle != side / 2;
        let is_seen =
            cosine > 0.0 && !self.rays.occluded(at, direction, self.contact..f64::INFINITY, hides);
        let irradiance = || sun.irradiance.element_sum() * cosine;
        is_seen.then(|| irradiance() * self.passed(at, direction, f64::INFINITY))
    }

    /// Irradiance at a point on a side from a luminaire, sampled by flux; `None` if it is not
    /// visible.
    fn irradiance_of_luminaire(&self, at: DVec3, side: SideIndex, rng: &mut Rng) -> Option<f64> {
        let total = self.fluxes.total_area();
        if total == 0.0 {
            return None;
        }
        let luminaire = &self.scene.luminaires()[self.fluxes.locate(rng.f64()).0];
        let point = luminaire.point([rng.f64(), rng.f64(), rng.f64()]);
        let irradiance = luminaire.irradiance(point, at, self.normal(side));
        let (direction, distance) = (point - at).normalize_and_length();
        let between = self.contact..distance - self.contact;
        let hides = |hit: &Hit| hit.triangle != side / 2;
        if irradiance == 0.0 || self.rays.occluded(at, direction, between, hides) {
            return None;
        }
        // As if all of the flux came from there.
        let share = luminaire.scale.element_sum() * total / luminaire.flux().element_sum();
        Some(irradiance * share * self.passed(at, direction, distance))
    }

    /// Transmittance of clear panes on the way, mean over the channels.
    fn passed(&self, at: DVec3, direction: DVec3, distance: f64) -> f64 {
        let reach = self.contact..distance - self.contact;
        self.panes.transmittance(at, direction, reach).element_sum() / 3.0
    }

    /// Irradiance at a point on a side from a lamp, sampled by power; `None` if it is not visible.
    fn irradiance_of_lamp(&self, at: DVec3, side: SideIndex, rng: &mut Rng) -> Option<f64> {
        if self.lamps.is_empty() {
            return None;
        }
        let lamp = self.lamps[self.powers.locate(rng.f64()).0];
        let to = self.random_point(lamp, rng) - at;
        let (direction, distance) = to.normalize_and_length();
        let cosine = self.normal(side).dot(direction);
        let facing = -self.normal(2 * lamp + usize::from(self.shining_backs[&lamp])).dot(direction);
        let facing = if self.shines_on_both(lamp) { facing.abs() } else { facing };
        // Below 1e-10 rounding decides whether a lamp in the point's own plane is visible. Negated,
        // so that NaN, for a point on the lamp, counts as not visible.
        if !(cosine > 1e-10 && facing > 1e-10) {
            return None;
        }
        let between = self.contact..distance - self.contact;
        let blocked = self.rays.occluded(at, direction, between, |hit| {
            hit.triangle != side / 2 && hit.triangle != lamp
        });
        // The power of all lamps as seen from there, but not more than the lamp sends to near
        // points.
        let power = self.powers.total_area() * self.brightest;
        let far = power * cosine * facing / (PI * distance * distance);
        let near = power / self.scene.area(lamp);
        (!blocked).then(|| far.min(near) * self.passed(at, direction, distance))
    }

    /// A random point of a triangle, uniform over its solid area; possibly in a hole where almost
    /// nothing is solid.
    pub fn random_point(&self, t: usize, rng: &mut Rng) -> DVec3 {
        let [a, b, c] = self.scene.corners(t);
        let position = fold_to_triangle([rng.f64(), rng.f64()]);
        let others = repeat_with(|| fold_to_triangle([rng.f64(), rng.f64()])).take(1000);
        let [u, v] = self.scene.first_solid(t, once(position).chain(others)).unwrap_or(position);
        a + u * (b - a) + v * (c - a)
    }
}
