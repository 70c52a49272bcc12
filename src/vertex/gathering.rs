//! Vertices that gather: each looks at the settled light for itself, and elements are split where
//! what lies between their corners is not what the corners say.

use super::VertexRadiosity;
use super::refined::Refined;
use crate::error::{Error, ErrorKind};
use crate::gather::{Gather, Sources};
use crate::mesh::Mesh;
use crate::scene::Rgb;
use crate::solve::{Go, Stop};

/// Settings of gathering at vertices.
#[derive(Clone, Debug, PartialEq)]
pub struct Gathering {
    /// An element is split where the middle of a side is off the mean of the side's ends by more
    /// than this share of its radiosity, in (0, 1]. What is left then is about a quarter of it.
    /// Smaller elements are allowed more: 1.7 times as much for every halving below the largest.
    pub tolerance: f64,
    /// Elements whose longest edge is no longer than this, in the scene's unit, are not split.
    pub smallest: f64,
    /// How many elements there may be. The worst are split first.
    pub elements: usize,
    /// Levels that every element is split before the light has a say.
    pub everywhere: u32,
}

/// How far gathering is, told after every batch of vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GatherProgress {
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
pub struct GatheredRadiosity {
    /// The mesh given, split further.
    pub mesh: Mesh,
    /// Radiosity at its vertices.
    pub surface: VertexRadiosity,
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
    pub stop: Stop,
}

impl GatheredRadiosity {
    /// The light of the elements of `mesh` as it is: one value an element, W/m², no vertex gathers.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when `radiosity` has not one value an element.
    pub fn from_elements(mesh: &Mesh, radiosity: &[Rgb]) -> Result<GatheredRadiosity, Error> {
        check_count(mesh, radiosity)?;
        let surface = VertexRadiosity::new(mesh, radiosity);
        Ok(GatheredRadiosity { surface, ..Refined::new(mesh.clone(), radiosity).finish() })
    }

    /// The light, for whoever gathers it elsewhere.
    pub fn sources(&self) -> Sources<'_> {
        Sources { mesh: &self.mesh, corners: &self.corners, reflected: &self.reflected }
    }
}

/// Vertices that the elements had wrong by more than this share gather twice to begin with.
const WRONG: f64 = 0.1;

impl Gathering {
    /// Splits to elements of `smallest` (scene unit) where sides bend by 2 %, 2¹⁹ elements at
    /// most.
    pub fn new(smallest: f64) -> Gathering {
        Gathering { tolerance: 0.02, smallest, elements: 1 << 19, everywhere: 0 }
    }

    /// Lets the vertices of `mesh` gather, given the radiosity of its elements (W/m², one value an
    /// element), splits elements, lets the new vertices gather, and so on: B = E + ρ Σ F_vj B_j, with
    /// B_j as known so far. No light is shot again.
    ///
    /// The estimate is the hierarchical surplus (Yserentant 1986): how far a new vertex is from the
    /// mean of the two that it lies between. Vertices under something that touches their surface
    /// see no light; they get what those around them have, so that no darkness leaks out.
    /// `progress` is told of every batch of vertices and may stop it; what was reached is returned.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when a setting is out of range or `radiosity` has not one value an
    /// element; whatever `gather` fails with.
    pub fn gather(
        &self,
        mesh: &Mesh,
        radiosity: &[Rgb],
        gather: &mut dyn Gather,
        mut progress: impl FnMut(&GatherProgress) -> Go,
    ) -> Result<GatheredRadiosity, Error> {
        self.check()?;
        check_count(mesh, radiosity)?;
        let mut state = Refined::new(mesh.clone(), radiosity);
        let before = state.reflected().to_vec();
        let mut change = None;
        let mut fresh: Vec<u32> = (0..before.len() as u32).collect();
        let mut young: Vec<usize> = (0..mesh.element_count()).collect();
        let (mut level, mut crowded) = (0, false);
        let stop = loop {
            let elements = state.mesh().element_count();
            let mut told =
                |gathered, of| progress(&GatherProgress { level, elements, gathered, of });
            if state.gather(&fresh, gather, &mut told)?.is_break() {
                break Stop::Cancelled;
            }
            if change.is_none() {
                change = Some(state.change(&before));
                // What the elements got badly wrong was seen by its neighbours as wrong.
                let wrong = state.off(&before, WRONG);
                if state.gather(&wrong, gather, &mut told)?.is_break() {
                    break Stop::Cancelled;
                }
            }
            let room = self.elements.saturating_sub(elements) / 3;
            let mut bent: Vec<(f64, usize)> = if level < self.everywhere {
                young.iter().map(|&e| (1.0, e)).filter(|b| state.splits(b.1)).collect()
            } else {
                young.iter().map(|&e| (state.bend(e, self), e)).filter(|b| b.0 > 1.0).collect()
            };
            if bent.is_empty() {
                break if crowded { Stop::Elements } else { Stop::Converged };
            }
            if bent.len() > room {
                crowded = true;
                bent.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
                bent.truncate(room);
            }
            if bent.is_empty() {
                break Stop::Elements;
            }
            let mut split: Vec<usize> = bent.into_iter().map(|b| b.1).collect();
            split.sort_unstable();
            (fresh, young) = state.split(&split)?;
            level += 1;
        };
        Ok(GatheredRadiosity { change: change.unwrap_or(0.0), stop, ..state.finish() })
    }

    /// Whether [`Gathering::gather`] would take these settings: worth asking before a long solve.
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
