//! What a solver gives back and tells on its way: solution, energy ledger, progress.

mod kept_rows;
mod shooters;
mod shooting;

use std::fmt;
use std::ops::{ControlFlow, Range};
use std::time::Duration;

use crate::mesh::Mesh;
use crate::scene::Rgb;
pub use shooting::Shooting;

/// Radiosity of every element, and how the solver got there.
#[derive(Clone, Debug)]
pub struct Solution {
    /// Radiosity B of each element: emitted plus reflected, W/m² per channel.
    pub radiosity: Vec<Rgb>,
    /// Where all emitted light has gone.
    pub ledger: Ledger,
    /// Patches shot.
    pub shots: u64,
    /// Rows that had to be made; fewer than shots where rows were kept.
    pub rows_made: u64,
    /// Why the solver stopped.
    pub stop: Stop,
}

/// Where all emitted flux has gone, W per channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ledger {
    /// Exitance times area, over all elements.
    pub emitted: Rgb,
    /// Not reflected at the fronts of elements.
    pub absorbed: Rgb,
    /// Met no surface.
    pub left: Rgb,
    /// Met the back of a surface and was lost there.
    pub back: Rgb,
    /// Received or emitted, not yet passed on.
    pub unshot: Rgb,
}

impl Ledger {
    /// Emitted minus all else, relative to emitted: the worst channel. 0 when nothing is emitted.
    pub fn imbalance(&self) -> f64 {
        let accounted = self.absorbed + self.left + self.back + self.unshot;
        largest_share((self.emitted - accounted).abs(), self.emitted)
    }

    /// Adds the light that is unshot to `radiosity` (W/m², one value an element of `mesh`) as if it
    /// fell evenly on all surfaces, again and again: the ambient term of Cohen, Chen, Wallace and
    /// Greenberg (1988). For early pictures, or to correct for what was not shot; it knows nothing of
    /// where that would have gone. Gives the ambient radiosity, per unit of reflectance.
    pub fn add_ambient(&self, mesh: &Mesh, radiosity: &mut [Rgb]) -> Rgb {
        let (mut area, mut reflects) = (0.0, Rgb::ZERO);
        for e in 0..mesh.element_count() {
            let node = mesh.element(e);
            area += mesh.area(node);
            reflects += mesh.material(node).reflectance * mesh.area(node);
        }
        let ambient = self.unshot / area / (Rgb::ONE - reflects / area);
        for (e, b) in radiosity.iter_mut().enumerate() {
            *b += mesh.material(mesh.element(e)).reflectance * ambient;
        }
        ambient
    }

    /// Share of the emitted flux that is unshot: the worst channel. 0 when nothing is emitted.
    pub fn unshot_share(&self) -> f64 {
        largest_share(self.unshot, self.emitted)
    }
}

/// Flux of the elements, W per channel.
struct Flux {
    /// Emitted by all.
    emitted: Rgb,
    /// Received or emitted by each and not yet passed on.
    unshot: Vec<Rgb>,
    /// Emitted or reflected by each, shot or not.
    leaving: Vec<Rgb>,
}

impl Flux {
    /// What is unshot in `elements`, as a share of the emitted: the worst channel.
    fn unshot_share(&self, elements: &[Range<usize>]) -> f64 {
        largest_share(sum(&self.unshot, elements), self.emitted)
    }

    /// What leaves `elements`, as a share of the emitted: the worst channel.
    fn leaving_share(&self, elements: &[Range<usize>]) -> f64 {
        largest_share(sum(&self.leaving, elements), self.emitted)
    }
}

fn sum(flux: &[Rgb], elements: &[Range<usize>]) -> Rgb {
    elements.iter().map(|run| flux[run.clone()].iter().sum::<Rgb>()).sum()
}

/// Largest ratio part/whole over the channels in which the whole is above zero.
fn largest_share(part: Rgb, whole: Rgb) -> f64 {
    let share = |(p, w): (f64, f64)| if w > 0.0 { p / w } else { 0.0 };
    part.to_array().into_iter().zip(whole.to_array()).map(share).fold(0.0, f64::max)
}

/// Why a solver stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The unshot share is as low as was asked for.
    Converged,
    /// The number of shots asked for is done.
    Shots,
    /// There are as many elements as there may be.
    Elements,
    /// The progress callback said so; the solution is what was reached.
    Cancelled,
}

impl fmt::Display for Stop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Stop::Converged => "converged",
            Stop::Shots => "shots",
            Stop::Elements => "elements",
            Stop::Cancelled => "cancelled",
        })
    }
}

/// How far a solver is, told after every shot or row.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Patches shot so far.
    pub shots: u64,
    /// Rows made so far.
    pub rows_made: u64,
    /// Share of the emitted flux that is unshot, in the worst channel.
    pub unshot_share: f64,
    /// Time since the solver started.
    pub elapsed: Duration,
}

/// What a progress callback answers: go on, or stop with what there is.
pub type Go = ControlFlow<()>;
