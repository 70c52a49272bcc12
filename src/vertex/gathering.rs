//! Vertices that gather: each looks at the settled light for itself, and elements are split where
//! what lies between their corners is not what the corners say.

use super::VertexMesh;
use super::adaptive::AdaptiveGather;
use crate::error::{Error, ErrorKind};
use crate::gather::{Gather, RadiosityField};
use crate::mesh::Mesh;
use crate::progress::StopReason;
use crate::scene::Rgb;
use std::ops::ControlFlow;

/// Settings of gathering at vertices.
#[derive(Clone, Debug, PartialEq)]
pub struct RefinementSettings {
    /// An element is split where the middle of a side is off the mean of the side's ends by more
    /// than this share of its radiosity, in (0, 1]. What is left then is about a quarter of it.
    /// Smaller elements are allowed more: 1.7 times as much for every halving below the largest.
    pub tolerance: f64,
    /// Elements whose longest edge is no longer than this, in the scene's unit, are not split.
    pub smallest: f64,
    /// Where the parabola through what was gathered leaves an element by more than this share of its
    /// radiosity in the end, the element is split once more, its new vertices are put on the parabola,
    /// and none of them gathers. SurfaceOffset 0; infinity for nowhere.
    pub curve: f64,
    /// How many elements there may be. The worst are split first.
    pub elements: usize,
    /// Levels that every element is split before the light has a say.
    pub everywhere: u32,
    /// How often all vertices gather: first the light given, then what they gathered themselves.
    pub sweeps: u32,
}

/// How far gathering is, told after every batch of vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GatherProgress {
    /// Times that all vertices have gathered.
    pub sweep: u32,
    /// Times that elements have been split.
    pub level: u32,
    /// Elements so far.
    pub elements: usize,
    /// Vertices that have gathered since they were split last.
    pub gathered: usize,
    /// Vertices that are to gather before they are split again.
    pub of: usize,
}

/// A scene cut where the light asks for it, and the radiosity that its vertices gathered.
#[derive(Clone, Debug)]
pub struct GatheredMesh {
    /// The mesh given, split further.
    pub mesh: Mesh,
    /// Radiosity at its vertices.
    pub surface: VertexMesh,
    /// Per element, where its three corners' values are in `reflected`.
    pub corners: Vec<[u32; 3]>,
    /// Reflected radiosity B − E of the vertices as others are to see it, W/m² per channel: its mean
    /// over an element allows for the bend of the light in between, which `surface` cannot.
    pub reflected: Vec<Rgb>,
    /// Places at which light was gathered.
    pub gathers: u64,
    /// Area-weighted mean of what gathering changed of the radiosity that vertices of the mesh given
    /// had from its elements: its root mean square over that radiosity.
    pub change: f64,
    /// Whether more elements were to be split than there may be.
    pub stop: StopReason,
}

impl GatheredMesh {
    /// The light of the elements of `mesh` as it is: one value an element, W/m², no vertex gathers.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when `radiosity` has not one value an element.
    pub fn from_elements(mesh: &Mesh, radiosity: &[Rgb]) -> Result<GatheredMesh, Error> {
        check_count(mesh, radiosity)?;
        let (surface, corners) = VertexMesh::with_corners(mesh, radiosity);
        let mut reflected = surface.radiosity.clone();
        for (e, corners) in corners.iter().enumerate() {
            let emitted = mesh.material(mesh.element(e)).exitance;
            for v in corners.map(|v| v as usize) {
                reflected[v] = (surface.radiosity[v] - emitted).max(Rgb::ZERO);
            }
        }
        let mesh = mesh.clone();
        let (gathers, change, stop) = (0, 0.0, StopReason::Converged);
        Ok(GatheredMesh { mesh, surface, corners, reflected, gathers, change, stop })
    }

    /// Whether this is light of the scene of `mesh`.
    pub(crate) fn check_scene(&self, mesh: &Mesh) -> Result<(), Error> {
        let (own, other) = (self.mesh.scene(), mesh.scene());
        let same = std::ptr::eq(own, other)
            || own.positions() == other.positions() && own.triangles() == other.triangles();
        if same {
            return Ok(());
        }
        let remedy = "give light that was found on a mesh of the same scene";
        let found = "light of another scene than the mesh's";
        Err(Error::new(ErrorKind::Setting, "light to gather", found, remedy))
    }

    /// The light, for whoever gathers it elsewhere.
    pub fn sources(&self) -> RadiosityField<'_> {
        RadiosityField { mesh: &self.mesh, corners: &self.corners, reflected: &self.reflected }
    }
}

/// Elements of one sweep may bend so many times as much as those of the next.
const COARSER: f64 = 3.0;

impl RefinementSettings {
    /// Splits to elements of `smallest` (scene unit) where sides bend by 2 %, and where parabolas do
    /// by 0.25 %, 2¹⁹ elements at most.
    pub fn new(smallest: f64) -> RefinementSettings {
        let (tolerance, curve, elements) = (0.02, 0.0025, 1 << 19);
        RefinementSettings { tolerance, smallest, curve, elements, everywhere: 0, sweeps: 1 }
    }

    /// Lets the vertices of `mesh` gather `light`, splits elements, lets the new vertices gather, and
    /// so on: B = E + ρ Σ F_vj B_j. No light is shot again. `light` is of the same scene, on any mesh:
    /// what was shot on fine elements, where hemicubes see most at no cost, is gathered at the corners
    /// of coarse ones.
    ///
    /// The estimate is the hierarchical surplus (Yserentant 1986): how far a new vertex is from the
    /// mean of the two that it lies between. Vertices under something that touches their surface
    /// see no light; they get what those around them have, so that no darkness leaks out.
    /// `progress` is told of every batch of vertices and may stop it; what was reached is returned.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when a setting is out of range or `light` is of another scene; whatever
    /// `gather` fails with.
    pub fn gather(
        &self,
        light: &GatheredMesh,
        mesh: &Mesh,
        gather: &mut dyn Gather,
        mut progress: impl FnMut(&GatherProgress) -> ControlFlow<()>,
    ) -> Result<GatheredMesh, Error> {
        self.check()?;
        light.check_scene(mesh)?;
        let mut state = AdaptiveGather::new(mesh.clone(), light);
        let stop = self.settle(&mut state, gather, None, &mut progress)?;
        let reached =
            if stop == StopReason::Cancelled { state.reached() } else { state.curved(self)?.0 };
        Ok(GatheredMesh { stop, ..reached })
    }

    /// All sweeps: the first ones over coarser elements and, if there is one, by a rough gatherer,
    /// since they only light the last.
    pub(crate) fn settle(
        &self,
        state: &mut AdaptiveGather,
        gather: &mut dyn Gather,
        mut rough: Option<&mut dyn Gather>,
        progress: &mut dyn FnMut(&GatherProgress) -> ControlFlow<()>,
    ) -> Result<StopReason, Error> {
        for left in (1..self.sweeps).rev() {
            let coarser = COARSER.powi(left as i32);
            let tolerance = (self.tolerance * coarser).min(1.0);
            let smallest = self.smallest * coarser;
            let coarse = RefinementSettings { tolerance, smallest, ..self.clone() };
            let stop = match &mut rough {
                Some(rough) => state.sweep(&coarse, *rough, progress)?,
                None => state.sweep(&coarse, gather, progress)?,
            };
            if stop == StopReason::Cancelled {
                return Ok(stop);
            }
            state.shine();
        }
        state.sweep(self, gather, progress)
    }

    /// Whether [`RefinementSettings::gather`] would take these settings: worth asking before a long solve.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] for a tolerance outside (0, 1] or a smallest edge that is not above 0.
    pub fn check(&self) -> Result<(), Error> {
        let bad = |place: String, found: &str, remedy: &str| {
            Err(Error::new(ErrorKind::Setting, place, found, remedy))
        };
        if !(self.tolerance > 0.0 && self.tolerance <= 1.0) {
            let place = format!("tolerance {}", self.tolerance);
            return bad(place, "out of range", "use a share above 0 and up to 1");
        }
        if self.smallest.is_nan() || self.smallest <= 0.0 {
            let place = format!("smallest element {}", self.smallest);
            return bad(place, "not above 0", "use a length in the scene's unit");
        }
        if self.curve.is_nan() || self.curve <= 0.0 {
            let place = format!("curve {}", self.curve);
            return bad(place, "not above 0", "use a share above 0, or infinity for none");
        }
        Ok(())
    }
}

fn check_count(mesh: &Mesh, radiosity: &[Rgb]) -> Result<(), Error> {
    if radiosity.len() == mesh.element_count() {
        return Ok(());
    }
    let place = format!("{} values of radiosity", radiosity.len());
    let remedy = format!("give one for each of the {} elements", mesh.element_count());
    Err(Error::new(ErrorKind::Setting, place, "not one an element", remedy))
}
