//! Incremental solving: changed lamps and materials and moved objects, without starting over.
//!
//! The unshot flux is the residual r = e − s + Ms of the flux sent, s. When e or the reflectances
//! in M change, the residual follows at once from the flux that each element has received, and the
//! solve continues from there; light that is no longer there is shot as negative light (Chen 1990;
//! George, Sillion and Greenberg 1990).
//!
//! When objects move, so do the form factors in M: the flux that went along a row that sees them is
//! taken back along that row and sent along a new one. Most rows see little of an object: their
//! error is at most the flux that they send to its old and new positions
//! ([`geometry_delta`](super::geometry_delta)). Rows with most misplaced flux are recomputed, and
//! the others stay as stale rows, within the limits of [`staleness`](super::staleness).

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use rayon::prelude::*;

use super::flux_state::{Flux, FluxState};
use super::geometry_delta::GeometryDelta;
use super::ledger::{Ledger, largest_share};
use super::method_state::MethodState;
use super::staleness::{is_usable, max_stale_flux_bound};
use super::{Progress, SolveSession};
use crate::error::{Error, ErrorKind};
use crate::form_factor::{FormFactors, Row};
use crate::mesh::{Mesh, NodeId};
use crate::progress::{Instant, StopReason};
use crate::scene::Rgb;
use crate::visibility::buried;

impl<'m> SolveSession<'m> {
    /// Switches to `mesh`, in which materials have changed: exitances, reflectances, or both. The
    /// solution and the cached rows are kept; the difference becomes unshot. Lamps that are all
    /// dimmed by the same factor need no new shots. Where most of the light comes from other lamps
    /// than before, the distribution starts anew, with the cached rows.
    ///
    /// `mesh` is made of the present one by [`Mesh::with_scene`].
    ///
    /// [`ErrorKind::Scene`] when the elements differ or have moved, the transmittance of clear
    /// panes has changed, or the emitted flux is not finite. The session is then unchanged.
    pub fn update_materials(&mut self, mesh: &'m Mesh) -> Result<(), Error> {
        if !GeometryDelta::between(self.mesh(), mesh)?.is_empty() {
            let remedy = "use SolveSession::update_geometry, which takes sources of rows as well";
            return Err(Error::new(
                ErrorKind::Scene,
                "changed scene",
                "moved triangles, or other panes",
                remedy,
            ));
        }
        self.adopt_mesh(mesh)
    }

    /// Switches to `mesh`, in which triangles have moved; materials may have changed as well.
    ///
    /// Rows that see the old or new positions of moved triangles are recomputed, those that carried
    /// most light first, until the flux that the others may have misplaced, at most
    /// [`SolveSession::stale_flux_bound`], is no more than twice the requested unshot share;
    /// [`SolveSession::run`] then solves down to half of that share. A vase and a chair moved in a
    /// furnished room misplaced a sixth to a half of the bound.
    ///
    /// `before` makes rows of the present mesh where they are not cached, and `after` those of
    /// `mesh`, which is made of the present one by [`Mesh::with_scene`]. The bound of a row is the
    /// share that it sends to moved triangles, and to a box about the new position of each group
    /// times the fraction of the box that a few rays show to be visible.
    ///
    /// When `progress` stops it, or a device fails, rows that have not been recomputed stay in use:
    /// [`SolveSession::stale_flux_bound`] bounds the light that this may misplace.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`] when elements differ, or the emitted flux is not finite; the session is
    /// then unchanged. Those of [`SolveSession::advance`].
    pub fn update_geometry(
        &mut self,
        mesh: &'m Mesh,
        before: &mut dyn FormFactors,
        after: &mut dyn FormFactors,
        mut progress: impl FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<StopReason, Error> {
        let start = Instant::now();
        let old = self.mesh();
        let delta = GeometryDelta::between(old, mesh)?;
        self.adopt_mesh(mesh)?;
        let irreparable = self.mark_stale(old, &delta);
        let stale = self.patches_by_misplaced_flux();
        let mut stop = Ok(StopReason::Converged);
        let mut remaining = &stale[..];
        let max_bound = max_stale_flux_bound(self.solver.unshot);
        while self.stale_flux_bound() > max_bound && !remaining.is_empty() {
            let batch_len = after.preferred_batch_len().clamp(1, remaining.len());
            let (batch, others) = remaining.split_at(batch_len);
            remaining = others;
            if let Err(error) = self.replace_rows(old, batch, &irreparable, before, after) {
                stop = Err(error);
                break;
            }
            let unshot_share = self.state.ledger.unshot_share() + self.stale_flux_bound();
            let report = self.counters.progress(self.rows.rows_made, unshot_share, start);
            if progress(&report).is_break() {
                stop = Ok(StopReason::Cancelled);
                break;
            }
        }
        for patch in stale {
            if !is_usable(self.rows.histories[&patch].stale_fraction) {
                self.rows.evict(patch);
            }
        }
        self.state.recompute_and_verify_energy()?;
        stop
    }

    /// Switches to the materials and positions of `mesh`, whose elements are the same.
    fn adopt_mesh(&mut self, mesh: &'m Mesh) -> Result<(), Error> {
        let emitted = Flux::emitted_by(mesh)?;
        self.finish()?;
        let kept = self.state.adopt_mesh(mesh, emitted);
        for history in self.rows.histories.values_mut() {
            history.sent *= kept;
        }
        self.stop = None;
        if let MethodState::Shooting(shooting) = &mut self.method {
            shooting.cut.set_mesh(mesh);
        }
        self.state.recompute_and_verify_energy()
    }

    /// Adds the error due to `delta` to the stale fraction of every row. Returns the fractions of
    /// earlier moves that cannot be removed, since the rows that they concern no longer exist to
    /// take the light back.
    fn mark_stale(&mut self, old: &Mesh, delta: &GeometryDelta) -> BTreeMap<NodeId, f64> {
        let mut irreparable = BTreeMap::new();
        let patches: Vec<NodeId> = self.rows.histories.keys().copied().collect();
        let affected_fraction = |&patch: &NodeId| {
            let row = self.rows.get(patch).map(|row| &**row);
            delta.affected_fraction(old, patch, row)
        };
        let fractions: Vec<f64> = patches.par_iter().map(affected_fraction).collect();
        for (patch, fraction) in patches.into_iter().zip(fractions) {
            let history = self.rows.histories.entry(patch).or_default();
            if !is_usable(history.stale_fraction) || !history.cached {
                irreparable.insert(patch, history.stale_fraction);
            }
            history.stale_fraction = (history.stale_fraction + fraction).min(1.0);
        }
        irreparable
    }

    /// Patches with stale rows, by descending flux that they may have misplaced; ties in mesh
    /// order.
    fn patches_by_misplaced_flux(&self) -> Vec<NodeId> {
        let stale = self.rows.histories.iter().filter(|(_, history)| history.stale_fraction > 0.0);
        let mut patches: Vec<(f64, NodeId)> = stale
            .map(|(&patch, history)| {
                let share = largest_share(history.sent.abs(), self.state.ledger.emitted);
                (share * history.stale_fraction, patch)
            })
            .collect();
        patches.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        patches.into_iter().map(|(_, patch)| patch).collect()
    }

    /// Takes back the light that went along the rows of `patches`, and sends it along new ones.
    fn replace_rows(
        &mut self,
        old: &Mesh,
        patches: &[NodeId],
        irreparable: &BTreeMap<NodeId, f64>,
        before: &mut dyn FormFactors,
        after: &mut dyn FormFactors,
    ) -> Result<(), Error> {
        let SolveSession { state, rows, method, .. } = self;
        let mesh = state.mesh;
        let importance = patches.iter().map(|p| rows.histories[p].importance).fold(0.0, f64::max);
        rows.rebuild_missing(old, before, patches.iter().copied())?;
        let uncached: Vec<NodeId> =
            patches.iter().copied().filter(|&p| !rows.contains(p)).collect();
        let mut uncached_rows = rows.make(old, before, &uncached, importance)?.into_iter();
        let new_rows = rows.make(mesh, after, patches, importance)?;
        for (&patch, new_row) in patches.iter().zip(new_rows) {
            let old_row = match rows.get(patch) {
                Some(row) => row.clone(),
                None => uncached_rows.next().unwrap_or_default().into(),
            };
            let sent = rows.histories[&patch].sent;
            state.distribute(-sent, &old_row);
            rows.evict(patch);
            let is_inside = |row: &Row| Row::form_factor(row.backface) > buried::VIEWPOINT;
            let rejected = match method {
                MethodState::Shooting(shooting) if is_inside(&new_row) && !is_inside(&old_row) => {
                    shooting.cut.reject_viewpoint(patch)
                }
                _ => None,
            };
            let history = rows.histories.entry(patch).or_default();
            history.stale_fraction = irreparable.get(&patch).copied().unwrap_or(0.0);
            if let Some(elements) = rejected {
                // They shoot it again from another viewpoint.
                history.sent = Rgb::ZERO;
                state.return_to_unshot(&elements, sent);
            } else {
                state.distribute(sent, &new_row);
                rows.insert(patch, new_row, importance);
            }
        }
        Ok(())
    }
}

impl<'m> FluxState<'m> {
    /// Switches to `mesh` with its emitted flux `new`. The distributed light is scaled by the
    /// factor that minimizes the unshot flux; returns the factor, by channel.
    fn adopt_mesh(&mut self, mesh: &'m Mesh, new: Flux) -> Rgb {
        let FluxState { flux, ledger, .. } = self;
        let kept = weighted_median_ratio(&flux.emitted, &new.emitted);
        let Ledger { absorbed, escaped, backface_loss, pane_loss, .. } = ledger;
        for scaled in [absorbed, escaped, backface_loss, pane_loss] {
            *scaled *= kept;
        }
        flux.incident.iter_mut().for_each(|incident| *incident *= kept);
        for e in 0..new.emitted.len() {
            flux.unshot[e] = flux.unshot[e] * kept + (new.emitted[e] - flux.emitted[e] * kept);
            let brighter = (new.reflectance[e] - flux.reflectance[e]) * flux.incident[e]
                + (new.transmitted(e, &flux.incident) - flux.transmitted(e, &flux.incident));
            flux.unshot[e] += brighter;
            ledger.absorbed -= brighter;
        }
        self.mesh = mesh;
        ledger.emitted = new.total();
        let Flux { incident, unshot, .. } = std::mem::replace(flux, new);
        flux.incident = incident;
        flux.unshot = unshot;
        kept
    }

    /// Makes `flux` unshot again, on `elements` in proportion to the light that leaves them.
    fn return_to_unshot(&mut self, elements: &[usize], flux: Rgb) {
        let leaving = |e: usize| self.flux.leaving(e).abs();
        let total: Rgb = elements.iter().map(|&e| leaving(e)).sum();
        let even = 1.0 / elements.len() as f64;
        let part = |e: usize| {
            let part = leaving(e) / total;
            flux * Rgb::select(total.cmpgt(Rgb::ZERO), part, Rgb::splat(even))
        };
        let parts: Vec<Rgb> = elements.iter().map(|&e| part(e)).collect();
        for (&e, part) in elements.iter().zip(parts) {
            self.flux.unshot[e] += part;
        }
    }
}

/// The c that minimizes Σ |new − c old|: the weighted median of the ratios, by channel.
fn weighted_median_ratio(old: &[Rgb], new: &[Rgb]) -> Rgb {
    let channel = |k: usize| {
        let emitters = old.iter().zip(new).map(|(o, n)| (o[k], n[k])).filter(|(o, _)| *o > 0.0);
        let mut ratios: Vec<(f64, f64)> = emitters.map(|(o, n)| (n / o, o)).collect();
        ratios.sort_by(|a, b| b.0.total_cmp(&a.0));
        let total: f64 = ratios.iter().map(|(_, weight)| weight).sum();
        let mut sum = 0.0;
        let median = ratios.iter().find(|(_, weight)| {
            sum += weight;
            2.0 * sum >= total
        });
        // Nothing was emitted: nothing to keep or to scale.
        median.map_or(1.0, |(ratio, _)| *ratio)
    };
    Rgb::new(channel(0), channel(1), channel(2))
}
