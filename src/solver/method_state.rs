//! The intermediate state of each method between steps, and the dispatch to it.

use super::direct::solve_directly;
use serde::{Deserialize, Serialize};

use super::flux_state::FluxState;
use super::gmres::Gmres;
use super::patch_cut::CutSnapshot;
use super::relaxation::Relaxation;
use super::row_cache::RowCache;
use super::shooting::Shooting;
use super::step::StepContext;
use super::{Method, Solver};
use crate::error::Error;
use crate::mesh::Mesh;
use crate::progress::StopReason;

/// Intermediate state of a method between steps: `S` is [`Shooting`], or [`CutSnapshot`] in files.
#[derive(Clone, Serialize, Deserialize)]
pub(super) enum MethodState<S> {
    Shooting(S),
    Relaxation(Relaxation),
    Gmres(Gmres),
    /// A direct solve is one step without intermediate state.
    Direct,
}

impl<'m> MethodState<Shooting<'m>> {
    /// The state before the first step.
    pub fn new(solver: &Solver, mesh: &'m Mesh) -> MethodState<Shooting<'m>> {
        match solver.method {
            Method::Shooting { overshoot } => {
                MethodState::Shooting(Shooting::new(solver, overshoot, mesh))
            }
            Method::Jacobi => MethodState::Relaxation(Relaxation::jacobi(mesh.element_count())),
            Method::GaussSeidel => MethodState::Relaxation(Relaxation::gauss_seidel()),
            Method::Gmres { restart } => MethodState::Gmres(Gmres::new(restart)),
            Method::Direct => MethodState::Direct,
        }
    }

    /// Advances by one batch of rows; returns the reason if it stops.
    pub fn advance(&mut self, step: &mut StepContext) -> Result<Option<StopReason>, Error> {
        match self {
            MethodState::Shooting(shooting) => shooting.advance(step),
            MethodState::Relaxation(relaxation) => relaxation.advance(step),
            MethodState::Gmres(gmres) => gmres.advance(step),
            MethodState::Direct => solve_directly(step).map(Some),
        }
    }

    /// Returns flux held by the method to `state`, so that all light is accounted for. The method
    /// can continue afterwards.
    pub fn finish(&mut self, state: &mut FluxState, rows: &mut RowCache) {
        match self {
            MethodState::Relaxation(relaxation) => relaxation.finish(state),
            MethodState::Gmres(gmres) => gmres.finish(state, rows),
            MethodState::Shooting(_) | MethodState::Direct => {}
        }
    }

    /// The saved form.
    pub fn saved(&self) -> MethodState<CutSnapshot> {
        match self {
            MethodState::Shooting(shooting) => MethodState::Shooting(shooting.cut.snapshot()),
            MethodState::Relaxation(relaxation) => MethodState::Relaxation(relaxation.clone()),
            MethodState::Gmres(gmres) => MethodState::Gmres(gmres.clone()),
            MethodState::Direct => MethodState::Direct,
        }
    }
}

impl MethodState<CutSnapshot> {
    /// The state that was saved, if it is valid for the method of `solver` over `mesh`.
    pub fn restored<'m>(
        self,
        solver: &Solver,
        mesh: &'m Mesh,
    ) -> Option<MethodState<Shooting<'m>>> {
        let (count, is_jacobi) = (mesh.element_count(), solver.method == Method::Jacobi);
        match (self, solver.method) {
            (MethodState::Shooting(cut), Method::Shooting { overshoot }) => {
                Shooting::from_snapshot(solver, overshoot, mesh, cut).map(MethodState::Shooting)
            }
            (MethodState::Relaxation(relaxation), Method::Jacobi | Method::GaussSeidel)
                if relaxation.is_consistent(count, is_jacobi) =>
            {
                Some(MethodState::Relaxation(relaxation))
            }
            (MethodState::Gmres(gmres), Method::Gmres { .. }) if gmres.is_consistent(count) => {
                Some(MethodState::Gmres(gmres))
            }
            (MethodState::Direct, Method::Direct) => Some(MethodState::Direct),
            _ => None,
        }
    }
}
