//! Change without starting over: other lamps, other materials, objects that have moved.
//!
//! The unshot flux is the residual r = e − s + Ms of what was sent, s. When e or the reflectances in M
//! change, the residual is known at once from what came to each element, and shooting goes on from
//! there; light that is no longer there is shot as negative light (Chen 1990; George, Sillion and
//! Greenberg 1990). When objects move, so do the form factors in M: what went along a row that sees
//! them is taken back along that row and sent along a new one. Most rows see little of an object:
//! what they are wrong about is at most what they send to where it was and is, and those with most
//! are drawn again until the rest is below the residual that is asked for.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::time::Instant;

use glam::DVec3;
use rayon::prelude::*;

use super::Progress;
use super::flux_state::{Flux, FluxState};
use super::ledger::largest_share;
use super::session::{MethodState, SolveSession};
use crate::error::{Error, ErrorKind};
use crate::form_factor::closed_form::point_to_polygon;
use crate::form_factor::{FormFactors, Row};
use crate::geometry::aabb::Aabb;
use crate::mesh::{Mesh, NodeId};
use crate::progress::StopReason;
use crate::scene::Rgb;
use crate::visibility::ray_scene::{Hit, RayScene};
use crate::visibility::{buried, offset};

impl<'m> SolveSession<'m> {
    /// Goes over to `mesh`, in which materials have changed: exitances, reflectances, or both. Nothing
    /// is lost of what was solved, and kept rows stay; what has changed is unshot. Lamps that are
    /// dimmed alike take no work at all; where most of the light is from other lamps than it was,
    /// light starts anew, with the rows that there are.
    ///
    /// `mesh` is made of the present one by [`Mesh::with_scene`].
    ///
    /// # Errors
    /// [`ErrorKind::Scene`] when elements are others or have moved, or the emitted flux is not finite.
    /// Nothing has changed then.
    pub fn update_materials(&mut self, mesh: &'m Mesh) -> Result<(), Error> {
        if !GeometryDelta::between(self.mesh(), mesh)?.groups.is_empty() {
            let remedy = "use SolveSession::rearrange, which takes makers of rows as well";
            return Err(Error::new(ErrorKind::Scene, "changed scene", "moved triangles", remedy));
        }
        self.take_on(mesh)
    }

    /// Goes over to `mesh`, in which triangles have moved; materials may have changed as well. RowCache
    /// that see where they were or are get drawn again, those first that most light went along, until
    /// what the others may be wrong about, [`SolveSession::doubt`], is at most twice the unshot share that is
    /// asked for; [`SolveSession::run`] then goes down to half of that share. A vase and a chair that were
    /// moved in a furnished room made a sixth to a half of the doubt wrong in fact.
    ///
    /// `before` makes rows of the present mesh, as far as they are not kept, and `after` those of
    /// `mesh`, which is made of the present one by [`Mesh::with_scene`]. What a row may be wrong about is
    /// what it sees of the triangles that have moved, and of a box about those of each group where
    /// they are now, as far as a few rays tell that this is open to it.
    ///
    /// When it is stopped, or a device fails, rows that have not been drawn again are taken as they
    /// are: [`SolveSession::doubt`] tells how much light that may concern.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`] when elements are others, or the emitted flux is not finite; nothing has
    /// changed then. Those of [`SolveSession::advance`].
    pub fn update_geometry(
        &mut self,
        mesh: &'m Mesh,
        before: &mut dyn FormFactors,
        after: &mut dyn FormFactors,
        mut progress: impl FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<StopReason, Error> {
        let start = Instant::now();
        let old = self.mesh();
        let moved = GeometryDelta::between(old, mesh)?;
        self.take_on(mesh)?;
        let mut wrong: Vec<(f64, NodeId)> = vec![];
        // In doubt since earlier moves, along rows that cannot be had again to take it back.
        let mut lost: BTreeMap<NodeId, f64> = BTreeMap::new();
        let patches: Vec<NodeId> = self.rows.trails.keys().copied().collect();
        let share = |&patch: &NodeId| moved.share(old, patch, self.rows.get(patch).map(|r| &**r));
        let shares: Vec<f64> = patches.par_iter().map(share).collect();
        for (patch, share) in patches.into_iter().zip(shares) {
            let trail = self.rows.trails.entry(patch).or_default();
            if trail.doubt > KEPT_DOUBT || !trail.kept {
                lost.insert(patch, trail.doubt);
            }
            trail.doubt = (trail.doubt + share).min(1.0);
            if trail.doubt > 0.0 {
                let share = largest_share(trail.sent.abs(), self.state.ledger.emitted);
                wrong.push((share * trail.doubt, patch));
            }
        }
        wrong.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut stop = Ok(StopReason::Converged);
        let mut rest = &wrong[..];
        while self.stale_flux_bound() > ALLOWED_DOUBT * self.solver.unshot && !rest.is_empty() {
            let (batch, others) = rest.split_at(after.preferred_batch_len().clamp(1, rest.len()));
            rest = others;
            let patches: Vec<NodeId> = batch.iter().map(|(_, patch)| *patch).collect();
            if let Err(error) = self.redirect(old, &patches, &lost, before, after) {
                stop = Err(error);
                break;
            }
            let unshot_share = self.state.ledger.unshot_share() + self.stale_flux_bound();
            let told = self.done.progress(self.rows.made, unshot_share, start);
            if progress(&told).is_break() {
                stop = Ok(StopReason::Cancelled);
                break;
            }
        }
        // What is sent from now on must not go astray by more than this.
        let astray = |&(_, patch): &(f64, NodeId)| self.rows.trails[&patch].doubt > KEPT_DOUBT;
        let astray: Vec<NodeId> = wrong.iter().filter(|w| astray(w)).map(|w| w.1).collect();
        astray.into_iter().for_each(|patch| self.rows.forget(patch));
        self.state.settle()?;
        stop
    }

    /// The most that may be wrong about where light has gone, since objects were moved: a share of
    /// the emitted flux, of the worst channel.
    pub fn stale_flux_bound(&self) -> f64 {
        self.rows.doubt(self.state.ledger.emitted)
    }

    /// Other materials and places of the same elements, in all that knows of them.
    fn take_on(&mut self, mesh: &'m Mesh) -> Result<(), Error> {
        let changed = Flux::emitted_by(mesh)?;
        self.finish()?;
        let kept = self.state.change(mesh, changed);
        self.rows.trails.values_mut().for_each(|trail| trail.sent *= kept);
        self.stop = None;
        if let MethodState::Shooting(shooters) = &mut self.course {
            shooters.change(mesh);
        }
        self.state.settle()
    }

    /// Takes the light that went along the rows of `patches` back, and sends it along new ones. What
    /// stays in doubt all the same is in `doubts`.
    fn redirect(
        &mut self,
        old: &Mesh,
        patches: &[NodeId],
        doubts: &BTreeMap<NodeId, f64>,
        before: &mut dyn FormFactors,
        after: &mut dyn FormFactors,
    ) -> Result<(), Error> {
        let SolveSession { state, rows, course, .. } = self;
        let mesh = state.mesh;
        let share = patches.iter().map(|p| rows.trails[p].share).fold(0.0, f64::max);
        rows.recall(old, before, patches.iter().copied())?;
        let lost: Vec<NodeId> = patches.iter().copied().filter(|&p| !rows.keeps(p)).collect();
        let mut lost_rows = match lost.is_empty() {
            true => vec![],
            false => rows.make(old, before, &lost, share)?,
        }
        .into_iter();
        let new_rows = rows.make(mesh, after, patches, share)?;
        for (&patch, new) in patches.iter().zip(new_rows) {
            let old = match rows.get(patch) {
                Some(row) => row.clone(),
                None => lost_rows.next().unwrap_or_default().into(),
            };
            let sent = rows.trails[&patch].sent;
            state.pass_on(-sent, &old);
            rows.forget(patch);
            let blinded = Row::form_factor(new.backface) > buried::VIEWPOINT
                && Row::form_factor(old.backface) <= buried::VIEWPOINT;
            let shooter = match course {
                MethodState::Shooting(shooters) if blinded => shooters.blinded(patch),
                _ => None,
            };
            let trail = rows.trails.entry(patch).or_default();
            trail.doubt = doubts.get(&patch).copied().unwrap_or(0.0);
            if let Some(elements) = shooter {
                // They shoot it again, from elsewhere.
                trail.sent = Rgb::ZERO;
                state.give_back(&elements, sent);
            } else {
                state.pass_on(sent, &new);
                rows.keep(patch, new, share);
            }
        }
        Ok(())
    }
}

/// In terms of the unshot share that is asked for.
const ALLOWED_DOUBT: f64 = 2.0;

/// A row that is wrong about no more than this share of its light is kept when objects have moved.
const KEPT_DOUBT: f64 = 0.1;

impl<'m> FluxState<'m> {
    /// Goes over to `mesh` with the flux that it emits. What has become of light is kept in that
    /// proportion which makes the least of it wrong, and this is returned.
    fn change(&mut self, mesh: &'m Mesh, new: Flux) -> Rgb {
        let FluxState { flux, ledger, .. } = self;
        let kept = proportion(&flux.emitted, &new.emitted);
        for scaled in [&mut ledger.absorbed, &mut ledger.escaped, &mut ledger.backface_loss] {
            *scaled *= kept;
        }
        for e in 0..new.emitted.len() {
            flux.incident[e] *= kept;
            flux.unshot[e] = flux.unshot[e] * kept + (new.emitted[e] - flux.emitted[e] * kept);
            let brighter = (new.reflectance[e] - flux.reflectance[e]) * flux.incident[e];
            flux.unshot[e] += brighter;
            ledger.absorbed -= brighter;
        }
        self.mesh = mesh;
        ledger.emitted = new.total();
        let Flux { incident, unshot, .. } = std::mem::replace(flux, new);
        (flux.incident, flux.unshot) = (incident, unshot);
        kept
    }

    /// `flux` is unshot again, on `elements` as far as light leaves them.
    fn give_back(&mut self, elements: &[usize], flux: Rgb) {
        let leaving = |e: usize| self.flux.leaving(e).abs();
        let whole: Rgb = elements.iter().map(|&e| leaving(e)).sum();
        let even = 1.0 / elements.len() as f64;
        let part = |e: usize| {
            let part = leaving(e) / whole;
            flux * Rgb::select(whole.cmpgt(Rgb::ZERO), part, Rgb::splat(even))
        };
        let parts: Vec<Rgb> = elements.iter().map(|&e| part(e)).collect();
        elements.iter().zip(parts).for_each(|(&e, part)| self.flux.unshot[e] += part);
    }
}

/// The c for which the sum of |new − c old| is least: the weighted median of the ratios, by channel.
fn proportion(old: &[Rgb], new: &[Rgb]) -> Rgb {
    let channel = |k: usize| {
        let lit = old.iter().zip(new).map(|(o, n)| (o[k], n[k])).filter(|(o, _)| *o > 0.0);
        let mut ratios: Vec<(f64, f64)> = lit.map(|(o, n)| (n / o, o)).collect();
        ratios.sort_by(|a, b| b.0.total_cmp(&a.0));
        let whole: f64 = ratios.iter().map(|(_, weight)| weight).sum();
        let mut sum = 0.0;
        let median = ratios.iter().find(|(_, weight)| {
            sum += weight;
            2.0 * sum >= whole
        });
        // Nothing of it was lit: there is nothing to keep or to scale.
        median.map_or(1.0, |(ratio, _)| *ratio)
    };
    Rgb::new(channel(0), channel(1), channel(2))
}

/// What has moved from one mesh to another.
struct GeometryDelta {
    /// Whether each triangle has.
    triangles: Vec<bool>,
    /// About those of each group, where they were and where they are.
    groups: Vec<[Aabb; 2]>,
    /// What hides them.
    rays: Option<RayScene>,
}

impl GeometryDelta {
    fn between(old: &Mesh, new: &Mesh) -> Result<GeometryDelta, Error> {
        if !old.has_elements_of(new) {
            let found = format!("{} elements, for {}", new.element_count(), old.element_count());
            let remedy = "make it of the mesh before by Mesh::with_scene";
            return Err(Error::new(ErrorKind::Scene, "changed mesh", found, remedy));
        }
        let (before, after) = (old.scene(), new.scene());
        let count = before.triangles().len();
        let triangles: Vec<bool> =
            (0..count).map(|t| before.corners(t) != after.corners(t)).collect();
        let mut groups = vec![[Aabb::EMPTY; 2]; before.groups().len()];
        for t in (0..count).filter(|&t| triangles[t]) {
            let [was, is] = &mut groups[before.triangles()[t].group as usize];
            before.corners(t).into_iter().for_each(|p| was.include(p));
            after.corners(t).into_iter().for_each(|p| is.include(p));
        }
        groups.retain(|[was, _]| was.low.is_finite());
        let rays = (!groups.is_empty()).then(|| RayScene::of_scene(after));
        Ok(GeometryDelta { triangles, groups, rays })
    }

    /// The share of the light of `patch` that may go elsewhere than along its old `row`.
    fn share(&self, mesh: &Mesh, patch: NodeId, row: Option<&Row>) -> f64 {
        if self.triangles[mesh.triangle(patch)] {
            return 1.0;
        }
        let (eye, normal) = (mesh.centroid(patch), mesh.normal(patch));
        let seen =
            |k: usize| self.groups.iter().map(|g| form_factor_to(&g[k], eye, normal)).sum::<f64>();
        let was = row.map_or(1.0, |row| {
            let hit = |e: u32| self.triangles[mesh.triangle(mesh.element(e as usize))];
            let hits = row.entries.iter().filter(|entry| hit(entry.element));
            hits.map(|entry| Row::form_factor(entry.share)).sum::<f64>()
                + Row::form_factor(row.backface)
        });
        let is = |bounds: &[Aabb; 2]| match form_factor_to(&bounds[1], eye, normal) {
            0.0 => 0.0,
            share => share * self.open(eye, bounds[1]),
        };
        let is: f64 = self.groups.iter().map(is).sum();
        (was.min(seen(0)) + is).min(1.0)
    }

    /// How much of `bounds` is open to `eye`, by a few places in it, never 0.
    fn open(&self, eye: DVec3, bounds: Aabb) -> f64 {
        let Some(rays) = &self.rays else { return 1.0 };
        let middle = bounds.centre();
        let corners = bounds.corners().map(|corner| middle + (corner - middle) / 2.0);
        let places = || corners.iter().chain([&middle]);
        let hides = |hit: &Hit| !self.triangles[hit.triangle];
        let open = |p: &&DVec3| !rays.occluded(eye, **p - eye, offset::SEGMENT_START..1.0, hides);
        (places().filter(open).count() + 1) as f64 / (places().count() + 1) as f64
    }
}

/// The form factor to `bounds` from a point with that `normal`, as if nothing were in between.
fn form_factor_to(bounds: &Aabb, eye: DVec3, normal: DVec3) -> f64 {
    if bounds.contains(eye) {
        return 1.0;
    }
    let corners = bounds.corners();
    let to_face = |face: &[usize; 4]| point_to_polygon(eye, normal, &face.map(|k| corners[k]));
    // The sides that face away have none.
    Aabb::FACES.iter().map(to_face).sum::<f64>().min(1.0)
}
