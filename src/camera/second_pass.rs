//! The second pass: camera rays go on at mirrors and glass until they hit a diffuse surface.
//!
//! ```text
//!   eye ──► mirror ──► one ray                       weight × reflectance
//!       ──► glass  ──► one reflected, one refracted  weight × R,  weight × (1 − R) τ
//!       ──► pane   ──► one reflected, one straight   the sums over both of its faces
//!
//!   at each of them, and in the end, a diffuse part: weight × its fraction × B/π
//! ```
//!
//! These are the paths from the light by diffuse reflections to a diffuse surface, and from there
//! by specular ones to the eye: L D* S* E (Heckbert 1990; Wallace, Cohen and Greenberg 1987). Light
//! from mirrors and glass onto diffuse surfaces, such as caustics, is not included.
//!
//! Both branches are followed, the heaviest first, until all pending ones weigh less than
//! [`LEFT_OUT`] together. These count as the mean of the radiance that the ray saw: the error is at
//! most [`LEFT_OUT`] times the highest radiance of the scene. More is left out only for rays that
//! are trapped, between mirrors or at the rim of a ball of triangles, where all angles are close to
//! the critical one.

use glam::DVec3;

use super::Seen;
use super::optics::{fresnel, pane, refracted, schlick};
use super::textured::{LitSurface, Sight};
use crate::mesh::SurfaceTopology;
use crate::sampling::hash::split_mix64;
use crate::scene::glass_bodies::{GlassBodies, GlassFace, Medium};
use crate::scene::{Rgb, Specular};
use crate::visibility::offset;
use crate::visibility::ray_scene::Hit;

/// Total weight of pending branches, in the channel where it is largest, below which they are
/// dropped. Plain choice: below one step of 8 bits at white.
const LEFT_OUT: f64 = 1.0 / 1024.0;

/// A surface or sky seen along a camera ray or a branch of it.
pub(super) struct Sighting {
    pub seen: Seen,
    /// Fraction of its radiance that reaches the camera, per channel, in [0, 1].
    pub weight: Rgb,
    pub sight: Sight,
    /// Hash of the sequence of mirrors and glass on the path, 0 for none.
    pub history: u64,
}

/// The mirrors and the glass of a scene.
pub(super) struct SecondPass {
    glass: GlassBodies,
    /// Bodies that the camera is in, the innermost last.
    media: Vec<Medium>,
    /// Per triangle of the scene, the smooth surface that it is a part of.
    surfaces: Vec<u32>,
    /// Surfaces within this distance of each other coincide, scene unit.
    contact: f64,
}

/// A pending branch of a ray.
struct Branch {
    from: DVec3,
    /// Unit length.
    direction: DVec3,
    /// Path length from the camera, scene unit.
    length: f64,
    weight: Rgb,
    /// Bodies that it is in, the innermost last.
    media: Vec<Medium>,
    history: u64,
}

/// What becomes of a branch at a boundary, in shares of its weight.
struct Split {
    reflected: Rgb,
    /// Direction, share and bodies of the branch that goes on through it, if one does.
    through: Option<(DVec3, Rgb, Vec<Medium>)>,
    /// Weight of the diffuse part.
    diffuse: Rgb,
}

/// A hit of a branch on a mirror or glass.
struct Boundary {
    triangle: usize,
    position: DVec3,
    /// Unit normals on the side that is hit, of the triangle and of the smooth surface.
    plane: DVec3,
    normal: DVec3,
    front: bool,
    /// Of the angle to the normal.
    cosine: f64,
}

impl Branch {
    /// The eye for a hit, or its mirror image behind mirrors and glass; `axial` is the cosine of
    /// the camera's ray to the axis of its view.
    fn sight(&self, lit: &LitSurface, axial: f64, hit: Option<&Hit>) -> Sight {
        let Some(hit) = hit.filter(|_| self.history != 0) else { return lit.direct_sight() };
        let way = (self.length + hit.distance) * self.direction;
        let at = self.from + hit.distance * self.direction;
        Sight { eye: at - way, forward: axial * self.direction }
    }
}

/// Takes the heaviest of the `pending` branches, the first of equals; none if all together weigh no
/// more than [`LEFT_OUT`].
fn take_heaviest(pending: &mut Vec<Branch>) -> Option<Branch> {
    let heaviness = |branch: &Branch| branch.weight.max_element();
    if pending.iter().map(heaviness).sum::<f64>() <= LEFT_OUT {
        return None;
    }
    let heavier = |best: usize, k: usize| {
        if heaviness(&pending[k]) > heaviness(&pending[best]) { k } else { best }
    };
    let heaviest = (0..pending.len()).fold(0, heavier);
    Some(pending.swap_remove(heaviest))
}

impl SecondPass {
    /// None for a scene without mirrors and glass.
    pub fn new(lit: &LitSurface) -> Option<SecondPass> {
        let scene = lit.scene();
        if scene.materials().iter().all(|material| material.specular.is_none()) {
            return None;
        }
        let glass = GlassBodies::new(scene);
        let contact = offset::path_contact(scene);
        Some(SecondPass {
            media: glass.around(scene, lit.rays.eye),
            glass,
            surfaces: SurfaceTopology::of_scene(scene).surfaces(),
            contact,
        })
    }

    /// Passes all sightings of the rays of pixel `k` to `found`, with the second pass if there is
    /// one.
    pub fn sightings(
        second_pass: Option<&SecondPass>,
        lit: &LitSurface,
        k: u32,
        mut found: impl FnMut(Sighting),
    ) {
        let (sight, weight, history) = (lit.direct_sight(), Rgb::ONE, 0);
        for direction in lit.rays.directions(k) {
            if let Some(second_pass) = second_pass {
                second_pass.follow(lit, direction.normalize(), &mut found);
            } else if let Some(seen) = lit.rays.hit(direction) {
                found(Sighting { seen, weight, sight, history });
            }
        }
    }

    /// Follows a ray from the camera along `direction`, of unit length.
    fn follow(&self, lit: &LitSurface, direction: DVec3, found: &mut impl FnMut(Sighting)) {
        let axial = direction.dot(lit.rays.forward);
        let mut pending = vec![Branch {
            from: lit.rays.eye,
            direction,
            length: 0.0,
            weight: Rgb::ONE,
            media: self.media.clone(),
            history: 0,
        }];
        let (mut all, mut seen_weight) = (vec![], Rgb::ZERO);
        // Plain choice: between two mirrors of reflectance 0.98 a ray is down to a weight of
        // `LEFT_OUT` after 343.
        for _ in 0..=512 {
            let Some(branch) = take_heaviest(&mut pending) else { break };
            let hit = self.next_hit(lit, &branch);
            let sight = branch.sight(lit, axial, hit.as_ref());
            let (weight, history) = (branch.weight, branch.history);
            let Some(hit) = hit else {
                seen_weight += weight;
                all.push(Sighting { seen: Seen::Sky(branch.direction), weight, sight, history });
                continue;
            };
            let material = lit.scene().material(hit.triangle);
            let Some(specular) = material.specular else {
                // A back is black, and counts as seen.
                seen_weight += weight;
                if hit.front {
                    all.push(Sighting { seen: Seen::Front(hit), weight, sight, history });
                }
                continue;
            };
            let boundary = self.boundary(lit, &branch, &hit);
            let diffuse = self.branch_out(&branch, &boundary, &hit, specular, &mut pending);
            let shines = material.scatters() || material.exitance != Rgb::ZERO;
            if hit.front && shines && diffuse != Rgb::ZERO {
                let weight = weight * diffuse;
                seen_weight += weight;
                all.push(Sighting { seen: Seen::Front(hit), weight, sight, history });
            }
        }
        let left_out: Rgb = pending.iter().map(|branch| branch.weight).sum();
        // With nothing seen there is no mean to use for the rest.
        let rise = left_out / seen_weight.max(Rgb::splat(f64::MIN_POSITIVE));
        let rise = Rgb::select(seen_weight.cmpgt(Rgb::ZERO), rise, Rgb::ZERO);
        for sighting in all {
            found(Sighting { weight: sighting.weight * (Rgb::ONE + rise), ..sighting });
        }
    }

    /// The next hit of `branch`. Mirrors and glass that coincide with its start are passed, other
    /// fronts there are hit; so is a front that coincides with glass: it lies against it.
    fn next_hit(&self, lit: &LitSurface, branch: &Branch) -> Option<Hit> {
        let Branch { from, direction, history, .. } = *branch;
        let specular = |hit: &Hit| lit.scene().material(hit.triangle).specular;
        let rays = &lit.rays.met;
        let hit = if history == 0 {
            rays.closest_hit(from, direction, 0.0, None)?
        } else {
            let counts =
                |hit: &Hit| hit.distance > self.contact || hit.front && specular(hit).is_none();
            rays.closest_hit_of(from, direction, -self.contact, None, counts)?
        };
        if !specular(&hit).is_some_and(|specular| specular.is_glass()) {
            return Some(hit);
        }
        let start = hit.distance - self.contact;
        let against = rays.closest_hit_of(from, direction, start, None, |other| {
            other.front && other.distance < hit.distance + self.contact && specular(other).is_none()
        });
        Some(against.unwrap_or(hit))
    }

    fn boundary(&self, lit: &LitSurface, branch: &Branch, hit: &Hit) -> Boundary {
        let triangle = hit.triangle;
        let side = if hit.front { 1.0 } else { -1.0 };
        let plane = side * lit.scene().normal(triangle);
        let smooth = lit.rays.interpolate(hit, &lit.light.surface.normals);
        let smooth = side * smooth.normalize_or_zero();
        // At the rim of a smooth body its normal may point away from the ray.
        let normal = if smooth.dot(branch.direction) < 0.0 { smooth } else { plane };
        Boundary {
            triangle,
            position: branch.from + hit.distance * branch.direction,
            plane,
            normal,
            front: hit.front,
            cosine: (-normal.dot(branch.direction)).clamp(0.0, 1.0),
        }
    }

    /// Adds the branches that go on from a boundary, and returns the weight of its diffuse part.
    fn branch_out(
        &self,
        branch: &Branch,
        boundary: &Boundary,
        hit: &Hit,
        specular: Specular,
        pending: &mut Vec<Branch>,
    ) -> Rgb {
        let Split { reflected, through, diffuse } = self.split(branch, boundary, specular);
        let mirrored = (boundary.mirrored(branch), reflected, branch.media.clone());
        let ways = [Some(mirrored), through].into_iter().flatten();
        for (kind, (direction, share, media)) in (0..).zip(ways) {
            if share != Rgb::ZERO && branch.weight * share != Rgb::ZERO {
                let surface = u64::from(self.surfaces[boundary.triangle]);
                pending.push(Branch {
                    from: boundary.position,
                    direction,
                    length: branch.length + hit.distance,
                    weight: branch.weight * share,
                    media,
                    history: split_mix64(branch.history ^ (2 * surface + kind)).max(1),
                });
            }
        }
        diffuse
    }

    /// What becomes of `branch` at a boundary.
    fn split(&self, branch: &Branch, boundary: &Boundary, specular: Specular) -> Split {
        let from_front = |share| if boundary.front { share } else { Rgb::ZERO };
        match specular {
            Specular::Mirror { reflectance } => {
                Split { reflected: from_front(reflectance), through: None, diffuse: Rgb::ONE }
            }
            Specular::Polished { reflectance } => {
                let rise = schlick(boundary.cosine);
                let reflected = from_front(reflectance + (Rgb::ONE - reflectance) * rise);
                Split { reflected, through: None, diffuse: Rgb::splat(1.0 - rise) }
            }
            Specular::Glass { refractive_index, transmittance } => {
                self.split_at_glass(branch, boundary, refractive_index, transmittance)
            }
        }
    }

    /// The same at the boundary of a body of glass, or at a pane.
    fn split_at_glass(
        &self,
        branch: &Branch,
        boundary: &Boundary,
        refractive_index: f64,
        transmittance: Rgb,
    ) -> Split {
        let index_of = |media: &[Medium]| media.last().map_or(1.0, |m| m.refractive_index);
        let mut media = branch.media.clone();
        let Some(GlassFace::Boundary { body, front_is_outside }) =
            self.glass.faces[boundary.triangle]
        else {
            let face = fresnel(boundary.cosine, refractive_index / index_of(&media));
            let [reflected, through] = pane(face, transmittance);
            let through = Some((branch.direction, through, media));
            return Split { reflected, through, diffuse: Rgb::splat(1.0 - face) };
        };
        let (ratio, share) = if boundary.front == front_is_outside {
            media.push(Medium { body, refractive_index });
            (refractive_index / index_of(&branch.media), transmittance)
        } else {
            let innermost = media.iter().rposition(|m| m.body == body);
            innermost.map(|k| media.remove(k));
            (index_of(&media) / refractive_index, Rgb::ONE)
        };
        let reflected = fresnel(boundary.cosine, ratio);
        let through = (boundary.refracted(branch, ratio), (1.0 - reflected) * share, media);
        let diffuse = Rgb::splat(1.0 - reflected);
        Split { reflected: Rgb::splat(reflected), through: Some(through), diffuse }
    }
}

impl Boundary {
    /// The direction of `branch` reflected, back to the side it comes from.
    fn mirrored(&self, branch: &Branch) -> DVec3 {
        let smooth = branch.direction.reflect(self.normal);
        if smooth.dot(self.plane) > 0.0 { smooth } else { branch.direction.reflect(self.plane) }
    }

    /// The direction of `branch` refracted, to the other side.
    fn refracted(&self, branch: &Branch, ratio: f64) -> DVec3 {
        let by = |normal| refracted(branch.direction, normal, ratio);
        let behind = |direction: &DVec3| direction.dot(self.plane) < 0.0;
        let direction = by(self.normal).filter(behind).or_else(|| by(self.plane));
        direction.unwrap_or(branch.direction)
    }
}
