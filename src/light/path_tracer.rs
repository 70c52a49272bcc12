//! Reflected radiosity at points, by path tracing: unbiased, and independent of the solver.
//!
//! ```text
//!      light ●                    B(x) − E(x) = ρ(x) · ∫ L(x, ω) cos θ dω        (Kajiya 1986)
//!            ┊╲
//!    next    ┊ ╲  a light that     At every vertex light is asked for twice: at a point of an
//!    event   ┊  ╲ the path meets   emitter, and where the path goes on. Each counts with its
//!            ┊   ╲                 share of both densities, the balance heuristic (Veach and
//!   ─────────x────╲──────          Guibas 1995). Paths end by Russian roulette (Arvo and Kirk
//!             ╲    y               1990), never at a depth.
//! ```
//!
//! With the balance heuristic a light adds at most E times the path's throughput at a vertex: as
//! good for a lamp of a millimetre as for a sky all around.

use std::cmp::Ordering;
use std::f64::consts::{PI, TAU};
use std::ops::{ControlFlow, Deref};
use std::sync::Arc;

use fastrand::Rng;
use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::emitters::{Emitters, Weights};
use super::luminaires::Luminaires;
use crate::sampling::octaves::Part;
use crate::sampling::random::random_numbers;
use crate::scene::{Facets, Material, Rgb, Scene, Sun};
use crate::visibility::offset;
use crate::visibility::panes::Panes;
use crate::visibility::ray_scene::{Hit, RayScene};
use crate::work::{Batches, agree};

/// Maximum probability that a path continues: paths end in a room of albedo 1, too, and the weights
/// keep the result unbiased.
const MAX_SURVIVAL: f64 = 0.999;

/// A scene, owned or not.
#[derive(Debug)]
enum SceneRef<'a> {
    Borrowed(&'a Scene),
    Shared(Arc<Scene>),
}

impl Deref for SceneRef<'_> {
    type Target = Scene;

    fn deref(&self) -> &Scene {
        match self {
            SceneRef::Borrowed(scene) => scene,
            SceneRef::Shared(scene) => scene,
        }
    }
}

/// Path traces the light of a scene.
#[derive(Debug)]
pub struct PathTracer<'a> {
    scene: SceneRef<'a>,
    rays: Arc<RayScene>,
    panes: Panes,
    facets: Arc<Facets>,
    emitters: Arc<Emitters>,
    luminaires: Arc<Luminaires>,
    /// Surfaces within this distance of each other are in one place, scene unit.
    contact: f64,
    diagonal: f64,
}

/// A point on the front of a triangle of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SurfacePoint {
    /// Index of the triangle.
    pub triangle: usize,
    /// Where on it, scene unit.
    pub position: DVec3,
}

/// What a path meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Visit {
    /// The sky, and the share of its radiosity, π times its radiance, that arrives.
    Sky { direction: DVec3, share: Rgb },
    /// A surface, and the share of its irradiance that arrives.
    Surface { at: SurfacePoint, share: Rgb },
    /// A back: nothing arrives.
    Back { is_first: bool },
}

/// What a point reflects, estimated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Reflected {
    /// Reflected radiosity: radiosity without the material's exitance, W/m² per channel. The point
    /// itself has the reflectance of its material, also where that has a texture: it is the light
    /// that is told. Whatever lights it has its textures.
    pub radiosity: Rgb,
    /// Its standard error per channel, W/m².
    pub standard_error: Rgb,
}

impl<'a> PathTracer<'a> {
    /// For the light of `scene`.
    pub fn new(scene: &'a Scene) -> PathTracer<'a> {
        PathTracer::of(SceneRef::Borrowed(scene))
    }

    /// For the light of `scene`, which it keeps.
    pub(crate) fn of_shared(scene: Arc<Scene>) -> PathTracer<'static> {
        PathTracer::of(SceneRef::Shared(scene))
    }

    fn of(scene: SceneRef<'_>) -> PathTracer<'_> {
        let diagonal = scene.bounds().diagonal();
        PathTracer {
            rays: RayScene::of_scene(&scene),
            panes: Panes::of_scene(&scene),
            facets: scene.facets(),
            emitters: scene.derived(Emitters::new),
            luminaires: scene.derived(|scene| Luminaires::new(scene.luminaires())),
            contact: offset::path_contact(&scene),
            diagonal,
            scene,
        }
    }

    /// The point of the scene nearest to `position`, along `normal` (unit length), on a triangle
    /// that faces alike; none where there is none within 1e-4 of the scene's diagonal.
    pub fn locate(&self, position: DVec3, normal: DVec3) -> Option<SurfacePoint> {
        let nearest =
            nearest_surfaces(&self.rays, &self.facets.normals, position, normal, self.diagonal);
        let hit = nearest.first()?;
        let [a, b, c] = self.scene.corners(hit.triangle);
        let position = a + hit.u * (b - a) + hit.v * (c - a);
        Some(SurfacePoint { triangle: hit.triangle, position })
    }

    /// The reflected radiosity at `points`, from `paths` paths each. `progress` hears now and then
    /// how many points are done, of how many; with a break the rest are left out.
    ///
    /// The same seed gives the same numbers, whatever the number of threads.
    pub fn reflected(
        &self,
        points: &[SurfacePoint],
        paths: usize,
        seed: u64,
        mut progress: impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Vec<Reflected> {
        let numbered: Vec<(usize, &SurfacePoint)> = points.iter().enumerate().collect();
        let (mut remaining, mut done) = (&numbered[..], vec![]);
        let mut batches = Batches::new(rayon::current_num_threads());
        while !remaining.is_empty() {
            let point = |&(k, point): &(usize, &SurfacePoint)| {
                let mut rng = random_numbers(&[seed, k as u64]);
                self.mean(point, paths, &mut rng)
            };
            let (_, means) = batches
                .next(&mut remaining, |batch| batch.par_iter().map(point).collect::<Vec<_>>());
            done.extend(means);
            if agree(progress(done.len(), points.len())).is_break() {
                break;
            }
        }
        done
    }

    /// The mean of `paths` paths, and its standard error from their spread.
    fn mean(&self, point: &SurfacePoint, paths: usize, rng: &mut Rng) -> Reflected {
        let (mut mean, mut squares) = (Rgb::ZERO, Rgb::ZERO);
        for k in 0..paths {
            // Welford's (1962) sums, which do not cancel.
            let value = self.path(point, rng);
            let off = value - mean;
            mean += off / (k + 1) as f64;
            squares += off * (value - mean);
        }
        let count = paths as f64;
        let variance = squares / (count - 1.0).max(1.0) / count.max(1.0);
        Reflected { radiosity: mean, standard_error: variance.map(f64::sqrt) }
    }

    /// The sum of what `paths` paths find.
    pub(crate) fn sum(&self, point: &SurfacePoint, paths: usize, rng: &mut Rng) -> Rgb {
        (0..paths).map(|_| self.path(point, rng)).sum()
    }

    /// Reflected radiosity at `point` by the light that lamps and luminaires send it directly, by
    /// as many `samples`, W/m². Where a ray can meet a lamp, some of its light is missing.
    pub(crate) fn light_of_lamps(
        &self,
        point: &SurfacePoint,
        samples: usize,
        rng: &mut Rng,
    ) -> Rgb {
        let mut reflected = Rgb::ZERO;
        for _ in 0..samples {
            let (at, throughput) = self.start(point, rng);
            let weights = self.emitters.weights(at.position);
            let mut irradiance = self.next_event(&at, &weights, rng);
            if !self.scene.luminaires().is_empty() {
                irradiance += self.irradiance_of_luminaire(&at, rng);
            }
            reflected += throughput * irradiance;
        }
        reflected / samples as f64
    }

    /// What those of `rays` rays from `point`, dense as the cosine, meet that meet anything.
    pub(crate) fn hits(&self, point: &SurfacePoint, rays: usize, rng: &mut Rng) -> Vec<Hit> {
        let normal = self.facets.normals[point.triangle];
        (0..rays).filter_map(|_| self.next_hit(point, cosine_weighted(normal, rng).0)).collect()
    }

    /// Reflected radiosity at `point` by one path, W/m².
    fn path(&self, point: &SurfacePoint, rng: &mut Rng) -> Rgb {
        let (mut at, mut throughput) = self.start(point, rng);
        let mut reflected = Rgb::ZERO;
        while let Some(hit) = self.advance(&mut at, &mut throughput, true, &mut reflected, rng) {
            match self.scatter_at(&mut at, &hit, rng) {
                Some(share) => throughput *= share,
                None => break,
            }
        }
        reflected
    }

    /// Radiosity that the front at `hit`, at `position`, reflects, by one path that ends at the
    /// first surface that `ends` it: what arrives on the way, W/m², and the end with the share of
    /// the radiosity reflected there that arrives. Emitters are met by the path alone or,
    /// `by_area`, sampled too.
    pub(crate) fn path_to(
        &self,
        hit: &Hit,
        position: DVec3,
        by_area: bool,
        ends: impl Fn(&Hit) -> bool,
        rng: &mut Rng,
    ) -> (Rgb, Option<(Rgb, Hit)>) {
        let mut at = SurfacePoint { triangle: hit.triangle, position };
        let mut throughput = self.scatter_all(&mut at, hit, self.albedo_at(hit), rng);
        let mut reflected = Rgb::ZERO;
        while let Some(hit) = self.advance(&mut at, &mut throughput, by_area, &mut reflected, rng) {
            if ends(&hit) {
                return (reflected, Some((throughput, hit)));
            }
            match self.scatter_at(&mut at, &hit, rng) {
                Some(share) => throughput *= share,
                None => break,
            }
        }
        (reflected, None)
    }

    /// What the surface that is seen from `position` along unit `direction`, further than `near`,
    /// reflects beyond what is `known` of it: radiosity by one path, as it arrives, W/m², unbiased.
    /// Where nothing `is_known` of it, what is missed of the first surface on the path of which
    /// something is. Light that surfaces emit is not in it.
    pub(crate) fn missed(
        &self,
        [position, direction]: [DVec3; 2],
        near: f64,
        is_known: impl Fn(&Hit) -> bool,
        known: impl Fn(&Hit) -> Rgb,
        rng: &mut Rng,
    ) -> Rgb {
        let hit = self.first_hit(position, direction, near, None);
        let Some(hit) = hit.filter(|hit| hit.front) else { return Rgb::ZERO };
        let between = near..hit.distance - self.contact;
        let passed = self.panes.transmittance(position, direction, between);
        let mut at = position + hit.distance * direction;
        let (mut share, mut end) = (passed, hit);
        if !is_known(&hit) {
            let (_, reached) = self.path_to(&hit, at, true, is_known, rng);
            let Some((of_end, hit)) = reached else { return Rgb::ZERO };
            let [a, b, c] = self.scene.corners(hit.triangle);
            at = a + hit.u * (b - a) + hit.v * (c - a);
            (share, end) = (passed * of_end, hit);
        }
        let (reflected, _) = self.path_to(&end, at, true, |_| false, rng);
        share * (reflected - known(&end))
    }

    /// The radiosity of what is seen from `position` along unit `direction` without the light that
    /// surfaces emit themselves, by one path, W/m², unbiased: π times the radiance of the sky, or
    /// what a surface reflects.
    pub(crate) fn reflected_towards(
        &self,
        position: DVec3,
        direction: DVec3,
        rng: &mut Rng,
    ) -> Rgb {
        if self.first_hit(position, direction, self.contact, None).is_some() {
            let all = |_: &Hit| true;
            return self.missed([position, direction], self.contact, all, |_| Rgb::ZERO, rng);
        }
        let reach = self.contact..f64::INFINITY;
        let passed = self.panes.transmittance(position, direction, reach);
        passed * PI * self.scene.sky().radiance(direction)
    }

    /// Follows a path from `position` along unit `direction`, further than `near` at first, and
    /// tells `visit` what it meets; shares are of light that arrives at its start.
    pub(crate) fn walk(
        &self,
        position: DVec3,
        direction: DVec3,
        near: f64,
        rng: &mut Rng,
        visit: &mut impl FnMut(Visit, &mut Rng),
    ) {
        let (mut from, mut direction, mut start, mut ignored) = (position, direction, near, None);
        let mut share = Rgb::ONE;
        loop {
            let hit = self.first_hit(from, direction, start, ignored);
            let end = hit.map_or(f64::INFINITY, |hit| hit.distance - self.contact);
            share *= self.panes.transmittance(from, direction, start..end);
            let Some(hit) = hit else { return visit(Visit::Sky { direction, share }, rng) };
            if !hit.front {
                return visit(Visit::Back { is_first: ignored.is_none() }, rng);
            }
            let position = from + hit.distance * direction;
            let mut at = SurfacePoint { triangle: hit.triangle, position };
            let Some(reflected) = self.scatter_at(&mut at, &hit, rng) else { return };
            share *= reflected;
            visit(Visit::Surface { at, share }, rng);
            direction = cosine_weighted(self.facets.normals[at.triangle], rng).0;
            (from, start, ignored) = (at.position, self.contact, Some(at.triangle));
        }
    }

    /// The share per channel of light from far along unit `direction` that arrives at `from`,
    /// whatever is nearer than `near`.
    pub(crate) fn passed_beyond(&self, from: DVec3, direction: DVec3, near: f64) -> Rgb {
        let reach = near..f64::INFINITY;
        if self.rays.occluded(from, direction, reach.clone(), |_| true) {
            return Rgb::ZERO;
        }
        self.panes.transmittance(from, direction, reach)
    }

    /// The share per channel of light from `to`, a place on triangle `on` if it is on one, that
    /// arrives at `from`.
    pub(crate) fn passed_to(&self, from: DVec3, to: DVec3, on: Option<usize>) -> Rgb {
        let (direction, distance) = (to - from).normalize_and_length();
        let between = self.contact..distance - self.contact;
        if self.rays.occluded(from, direction, between.clone(), |hit| Some(hit.triangle) != on) {
            return Rgb::ZERO;
        }
        self.panes.transmittance(from, direction, between)
    }

    /// Takes a path one surface further from `at`: adds the light that arrives at `at` to what is
    /// `reflected`, W/m², moves `at` to the next hit, and multiplies `throughput` by what panes on
    /// the way let through. None where the path leaves or meets a back.
    fn advance(
        &self,
        at: &mut SurfacePoint,
        throughput: &mut Rgb,
        by_area: bool,
        reflected: &mut Rgb,
        rng: &mut Rng,
    ) -> Option<Hit> {
        let weights = by_area.then(|| self.emitters.weights(at.position));
        if let Some(weights) = &weights {
            *reflected += *throughput * self.next_event(at, weights, rng);
        }
        if let Some(sun) = self.scene.sky().sun() {
            *reflected += *throughput * self.irradiance_of_sun(at, sun, rng);
        }
        if !self.scene.luminaires().is_empty() {
            *reflected += *throughput * self.irradiance_of_luminaire(at, rng);
        }
        let (direction, cosine) = cosine_weighted(self.facets.normals[at.triangle], rng);
        let Some(hit) = self.next_hit(at, direction) else {
            let passed = self.passed(at, direction, f64::INFINITY);
            *reflected += *throughput * passed * PI * self.scene.sky().radiance(direction);
            return None;
        };
        if !hit.front {
            return None;
        }
        *throughput *= self.passed(at, direction, hit.distance);
        let exitance = self.scene.exitance_at(hit.triangle, [hit.u, hit.v]);
        if exitance != Rgb::ZERO {
            let balance = weights.map_or(1.0, |weights| {
                let facing = self.facets.normals[hit.triangle].dot(direction).abs();
                let by_area = self.emitters.density(&weights, hit.triangle);
                let light = by_area * hit.distance * hit.distance / facing;
                cosine / PI / (cosine / PI + light)
            });
            *reflected += *throughput * exitance * balance;
        }
        at.position += hit.distance * direction;
        Some(hit)
    }

    /// What the light that is `emitted` at places causes at `point` after two bounces and more, by
    /// one path: unbiased, W/m². Places are asked where the path meets their fronts.
    pub(crate) fn later_bounces(
        &self,
        emitted: impl Fn(&Hit) -> Rgb,
        point: &SurfacePoint,
        rng: &mut Rng,
    ) -> Rgb {
        let (mut at, mut throughput) = self.start(point, rng);
        let mut reflected = Rgb::ZERO;
        for bounce in 1.. {
            let (direction, _) = cosine_weighted(self.facets.normals[at.triangle], rng);
            let Some(hit) = self.next_hit(&at, direction).filter(|hit| hit.front) else { break };
            throughput *= self.passed(&at, direction, hit.distance);
            if bounce > 1 {
                reflected += throughput * emitted(&hit);
            }
            at.position += hit.distance * direction;
            match self.scatter_at(&mut at, &hit, rng) {
                Some(share) => throughput *= share,
                None => break,
            }
        }
        reflected
    }

    /// Where a path from `point` goes on from, on which side, and by what share of the light.
    fn start(&self, point: &SurfacePoint, rng: &mut Rng) -> (SurfacePoint, Rgb) {
        let mut at = *point;
        let Material { reflectance, transmittance, .. } = *self.scene.material(at.triangle);
        let throughput = self.scatter(&mut at, [reflectance, transmittance], rng);
        (at, throughput)
    }

    /// Moves `at`, already at the place of `hit`, to the triangle and side that a path goes on from
    /// there: by what share of the light, over its chance to go on; none if it ends.
    fn scatter_at(&self, at: &mut SurfacePoint, hit: &Hit, rng: &mut Rng) -> Option<Rgb> {
        let albedo = self.albedo_at(hit);
        let survival = albedo.max_element().min(MAX_SURVIVAL);
        if rng.f64() >= survival {
            return None;
        }
        Some(self.scatter_all(at, hit, albedo, rng) / survival)
    }

    fn albedo_at(&self, hit: &Hit) -> Rgb {
        self.scene.albedo_around(hit.triangle, [hit.u, hit.v], 0.0)
    }

    /// As [`PathTracer::scatter_at`], for a path that goes on from `hit` in any case.
    fn scatter_all(&self, at: &mut SurfacePoint, hit: &Hit, albedo: Rgb, rng: &mut Rng) -> Rgb {
        at.triangle = hit.triangle;
        let reflectance = self.scene.reflectance_at(hit.triangle, [hit.u, hit.v]);
        self.scatter(at, [reflectance, albedo - reflectance], rng)
    }

    /// Chooses the side that a path goes on from: that of `at`, or the one behind it, to which it
    /// is moved. What of the light on that side leaves, over the probability of the choice.
    fn scatter(
        &self,
        at: &mut SurfacePoint,
        [reflectance, transmittance]: [Rgb; 2],
        rng: &mut Rng,
    ) -> Rgb {
        let through = transmittance.element_sum();
        if through == 0.0 {
            return reflectance;
        }
        let through = through / (through + reflectance.element_sum());
        if rng.f64() >= through {
            return reflectance / (1.0 - through);
        }
        // Without one nothing leaves.
        let Some(behind) = self.scene.other_side(at.triangle).next() else { return Rgb::ZERO };
        at.triangle = behind;
        transmittance / through
    }

    /// Irradiance at `at` from one point of an emitter, W/m², with the share that the balance
    /// heuristic leaves to it.
    fn next_event(&self, at: &SurfacePoint, weights: &Weights, rng: &mut Rng) -> Rgb {
        let Some(light) = self.emitters.choose(weights, rng) else { return Rgb::ZERO };
        let place = random_barycentric(rng);
        let to = point_at(self.scene.corners(light), place) - at.position;
        let (direction, distance) = to.normalize_and_length();
        let cosine = self.facets.normals[at.triangle].dot(direction);
        let facing = -self.facets.normals[light].dot(direction);
        // Written so that NaN, of a light that is met, sees nothing.
        if !(cosine > 0.0 && facing > 0.0 && self.scene.is_solid(light, place)) {
            return Rgb::ZERO;
        }
        let between = self.contact..distance - self.contact;
        let blocked = self.rays.occluded(at.position, direction, between, |hit| {
            hit.triangle != at.triangle && hit.triangle != light
        });
        if blocked {
            return Rgb::ZERO;
        }
        let density = self.emitters.density(weights, light) * distance * distance / facing;
        let passed = self.passed(at, direction, distance);
        passed * self.scene.exitance_at(light, place) / PI * cosine / (density + cosine / PI)
    }

    /// Irradiance at `at` from one point of the sun, W/m². No path meets the sun by itself.
    pub(crate) fn irradiance_of_sun(&self, at: &SurfacePoint, sun: &Sun, rng: &mut Rng) -> Rgb {
        let direction = sun.towards([rng.f64(), rng.f64()]);
        let cosine = self.facets.normals[at.triangle].dot(direction);
        let between = self.contact..f64::INFINITY;
        let hides = |hit: &Hit| hit.triangle != at.triangle;
        if cosine <= 0.0 || self.rays.occluded(at.position, direction, between, hides) {
            return Rgb::ZERO;
        }
        self.passed(at, direction, f64::INFINITY) * sun.irradiance * cosine
    }

    /// Irradiance at `at` from one point of a luminaire, W/m². No path meets one by itself.
    fn irradiance_of_luminaire(&self, at: &SurfacePoint, rng: &mut Rng) -> Rgb {
        let normal = self.facets.normals[at.triangle];
        let luminaires = self.scene.luminaires();
        let chosen = self.luminaires.choose(luminaires, at.position, normal, rng);
        let Some((luminaire, probability)) = chosen else { return Rgb::ZERO };
        let point = luminaire.point([rng.f64(), rng.f64(), rng.f64()]);
        let irradiance = luminaire.irradiance(point, at.position, normal);
        let (direction, distance) = (point - at.position).normalize_and_length();
        let between = self.contact..distance - self.contact;
        let hides = |hit: &Hit| hit.triangle != at.triangle;
        if irradiance == 0.0 || self.rays.occluded(at.position, direction, between, hides) {
            return Rgb::ZERO;
        }
        let passed = self.passed(at, direction, distance);
        passed * luminaire.scale * (irradiance / probability)
    }

    /// The share per channel that clear panes let through from `at` along `direction` (unit length)
    /// to a surface at that distance.
    fn passed(&self, at: &SurfacePoint, direction: DVec3, distance: f64) -> Rgb {
        self.panes.transmittance(at.position, direction, self.contact..distance - self.contact)
    }

    /// What a ray along `direction` (unit length) meets first. What lies in one place with the
    /// surface it starts from is passed.
    fn next_hit(&self, at: &SurfacePoint, direction: DVec3) -> Option<Hit> {
        self.first_hit(at.position, direction, self.contact, Some(at.triangle))
    }

    /// The same from anywhere, further than `start`, not on triangle `ignored`.
    fn first_hit(
        &self,
        from: DVec3,
        direction: DVec3,
        start: f64,
        ignored: Option<usize>,
    ) -> Option<Hit> {
        let hit = self.rays.closest_hit(from, direction, start, ignored)?;
        if hit.front {
            return Some(hit);
        }
        // Of two faces back to back in one place the front is met.
        let behind = (hit.distance - self.contact).max(start);
        let twin = self.rays.closest_hit(from, direction, behind, Some(hit.triangle));
        let same_place = |twin: &Hit| twin.front && twin.distance < hit.distance + self.contact;
        Some(twin.filter(same_place).unwrap_or(hit))
    }
}

/// The hits nearest to `position` along the line of `normal` (unit length), before and behind, of
/// triangles with `normals` within 37° of it, the nearest first: up to 1e-4 of `diagonal`, since
/// points of files have 32 bits or six digits, and up to a hundredth of that behind the first.
pub(crate) fn nearest_surfaces(
    rays: &RayScene,
    normals: &[DVec3],
    position: DVec3,
    normal: DVec3,
    diagonal: f64,
) -> Vec<Hit> {
    let reach = 1e-4 * diagonal;
    let mut found = vec![];
    // From before it: what lies in one place with another, back to back, is met on its front only.
    rays.occluded(position + reach * normal, -normal, 0.0..2.0 * reach, |hit| {
        if normals[hit.triangle].dot(normal) > 0.8 {
            found.push(*hit);
        }
        false
    });
    let off = |hit: &Hit| (hit.distance - reach).abs();
    let nearest = found.iter().map(off).fold(f64::INFINITY, f64::min);
    found.retain(|hit| off(hit) <= nearest + 0.01 * reach);
    let key = |hit: &Hit| (off(hit), hit.triangle);
    found.sort_by(|a, b| key(a).partial_cmp(&key(b)).unwrap_or(Ordering::Equal));
    found.dedup_by_key(|hit| hit.triangle);
    found
}

/// A point of a `part` of triangle `t`, uniform over its solid area; where little of it is solid,
/// it may be in a hole.
pub(crate) fn random_point(scene: &Scene, t: usize, part: &Part, rng: &mut Rng) -> DVec3 {
    let mut random_place = || part.place(random_barycentric(rng));
    let place = random_place();
    let others = std::iter::repeat_with(random_place).take(1000);
    let solid = scene.first_solid(t, std::iter::once(place).chain(others));
    point_at(scene.corners(t), solid.unwrap_or(place))
}

/// Weights of the second and third corner of a triangle, uniform over its area (Osada et al. 2002).
fn random_barycentric(rng: &mut Rng) -> [f64; 2] {
    let (root, v) = (rng.f64().sqrt(), rng.f64());
    [root * (1.0 - v), root * v]
}

fn point_at([a, b, c]: [DVec3; 3], [u, v]: [f64; 2]) -> DVec3 {
    a + u * (b - a) + v * (c - a)
}

/// A direction with density cos θ / π about `normal`, and cos θ, above zero.
fn cosine_weighted(normal: DVec3, rng: &mut Rng) -> (DVec3, f64) {
    let (square, turn) = (rng.f64(), TAU * rng.f64());
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    let cosine = (1.0 - square).sqrt();
    let across = libm::cos(turn) * tangent + libm::sin(turn) * bitangent;
    ((square.sqrt() * across + cosine * normal).normalize(), cosine)
}
