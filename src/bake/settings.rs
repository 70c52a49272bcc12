//! What a bake spends: all its settings, and which of them an accuracy asks for.

use std::num::NonZeroU32;
use std::path::PathBuf;

use crate::error::Error;
use crate::mesh::Mesh;
use crate::scene::Scene;
use crate::solver::{Method, Solver};
use crate::vertex::gathering::RefinementSettings;

/// All settings of a bake. [`BakeSettings::for_error`] chooses them; each can be changed by hand.
#[derive(Clone, Debug, PartialEq)]
pub struct BakeSettings {
    /// Longest edge of the elements that light is shot on, scene unit.
    pub element_size: f64,
    /// Levels that those elements are split which other surfaces touch.
    pub contacts: u32,
    /// Pixels along an edge of the top face of the hemicubes that shoot much, even; a half or a quarter
    /// of them for dim patches.
    pub hemicube: u32,
    /// The share of the emitted light from which on a patch shoots much; with none, the device's own.
    pub full_share: Option<f64>,
    /// HemicubeRows a viewpoint, each turned further.
    pub rotations: NonZeroU32,
    /// Receivers within this many patch diameters get closed forms; below 0 none.
    pub near: f64,
    /// Patches whose parts disagree by more than this share of light are seen from finer parts; with
    /// none, each only from its centroid.
    pub viewpoints: Option<f64>,
    /// How light is spread, how far, and from how large patches.
    pub solver: Solver,
    /// Whether GMRES takes the place of `solver.method` in scenes for which [`Solver::for_mesh`]
    /// chooses it.
    pub gmres_if_bright: bool,
    /// A file that the state of the solve is written to, every few batches and at its end; if it is
    /// there, the solve goes on from it: see [`Solver::resume`]. The last batches at most are lost
    /// when a bake is killed: as many as take ten times what writing takes.
    pub state: Option<PathBuf>,
    /// Whether the light not yet shot is added, spread evenly.
    pub ambient: bool,
    /// How vertices gather; with none, they get what the elements around them have.
    pub gather: Option<GatherSettings>,
}

/// Settings of vertices that gather.
#[derive(Clone, Debug, PartialEq)]
pub struct GatherSettings {
    /// Longest edge of the elements whose corners gather first, scene unit.
    pub element_size: f64,
    /// Levels that those elements are split which other surfaces touch.
    pub contacts: u32,
    /// Looks that a vertex takes: rays, or pixels of a hemicube that are worth as much.
    pub rays: u32,
    /// RayScene find on the CPU that half of them are off by more than this share of the irradiance: then
    /// there are more, up to 16 times as many. Infinity for never.
    pub noise: f64,
    /// Where elements are split, and how often all vertices gather.
    pub gathering: RefinementSettings,
}

impl BakeSettings {
    /// Whether a bake would take these settings of gathering: worth asking before a long solve. What
    /// comes before that is checked where it is used.
    pub(crate) fn check(&self) -> Result<(), Error> {
        self.gather.as_ref().map_or(Ok(()), |gather| gather.gathering.check())
    }

    /// The solver for `mesh`.
    pub(crate) fn solver_for(&self, mesh: &Mesh) -> Solver {
        match Solver::for_mesh(mesh).method {
            method @ Method::Gmres { .. } if self.gmres_if_bright => {
                Solver { method, ..self.solver }
            }
            _ => self.solver,
        }
    }

    /// What it takes, by experience, for vertices to be off by `error`: a share of their radiosity,
    /// root mean square over the area of `scene`.
    pub fn for_error(error: f64, scene: &Scene) -> BakeSettings {
        let (low, high) = scene.bounds();
        let diagonal = (high - low).length();
        let e = error.clamp(1e-4, 0.3);
        let hemicube = match e {
            e if e > 0.03 => 32,
            e if e > 0.006 => 64,
            e if e > 0.003 => 128,
            _ => 256,
        };
        let contacts = if e < 0.009 { 3 } else { 2 };
        let gathering = RefinementSettings {
            tolerance: (2.5 * e).min(0.1),
            curve: e / 4.0,
            sweeps: if e > 0.03 { 1 } else { 2 },
            ..RefinementSettings::new(0.1 * diagonal * e.powf(0.85))
        };
        BakeSettings {
            element_size: diagonal * (0.105 * e.powf(0.4)).max(0.6 * e),
            contacts,
            hemicube,
            full_share: None,
            rotations: NonZeroU32::MIN,
            near: 1.0,
            viewpoints: None,
            solver: Solver {
                unshot: e / 40.0,
                patch_tolerance: e.min(0.02 + 0.4 * e),
                ..Solver::default()
            },
            gmres_if_bright: true,
            state: None,
            ambient: false,
            gather: Some(GatherSettings {
                element_size: 0.3 * diagonal * e.powf(0.3),
                contacts: if e > 0.07 { 1 } else { contacts },
                rays: (20.0 / e).ceil() as u32,
                noise: e,
                gathering,
            }),
        }
    }
}
