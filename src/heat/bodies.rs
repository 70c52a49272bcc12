//! Bodies: what has one temperature. A group with one side, or a sheet with two.

use arrayvec::ArrayVec;

use super::surface::{Boundary, Surface, of_group};
use crate::error::Error;
use crate::view_factor::ViewFactors;

/// A side of a body: a row of the matrix.
#[derive(Clone, Copy)]
pub(super) struct Side {
    pub row: usize,
    /// Its share of the body's area.
    pub share: f64,
}

/// One or two sides with one temperature.
pub(super) struct Body {
    pub sides: ArrayVec<Side, 2>,
    pub boundary: Boundary,
    /// In each band, the mean over the sides by area: the body emits that of a black body.
    pub emissivity: Vec<f64>,
}

/// The bodies that the rows of `factors` are sides of, in the order of fronts.
pub(super) fn bodies(factors: &ViewFactors, surfaces: &[Surface]) -> Vec<Body> {
    let mut rows_of: Vec<ArrayVec<usize, 2>> = vec![ArrayVec::new(); surfaces.len()];
    for (row, front) in factors.back_of.iter().enumerate() {
        rows_of[front.map_or(row, |front| front as usize)].push(row);
    }
    let with_rows = rows_of.into_iter().filter(|rows| !rows.is_empty());
    with_rows.map(|rows| Body::new(&rows, factors, surfaces)).collect()
}

/// Per row, the index of its body.
pub(super) fn body_of_rows(bodies: &[Body], rows: usize) -> Vec<usize> {
    let mut of_rows = vec![0; rows];
    for (index, body) in bodies.iter().enumerate() {
        body.sides.iter().for_each(|side| of_rows[side.row] = index);
    }
    of_rows
}

impl Body {
    fn new(rows: &[usize], factors: &ViewFactors, surfaces: &[Surface]) -> Body {
        let area: f64 = rows.iter().map(|&row| factors.areas[row]).sum();
        // A group without area exchanges nothing.
        let share = |row: usize| match area > 0.0 {
            true => factors.areas[row] / area,
            false => 1.0 / rows.len() as f64,
        };
        let sides: ArrayVec<Side, 2> =
            rows.iter().map(|&row| Side { row, share: share(row) }).collect();
        let front = &surfaces[rows[0]];
        let mean = |band: usize| {
            sides.iter().map(|side| side.share * surfaces[side.row].emissivity[band]).sum()
        };
        let emissivity = (0..front.emissivity.len()).map(mean).collect();
        Body { sides, boundary: front.boundary, emissivity }
    }

    /// Whether its sides can exchange the flux that is given; `names` are those of the rows.
    pub fn check(&self, names: &[String]) -> Result<(), Error> {
        match self.boundary {
            Boundary::NetFlux(q) if q != 0.0 && self.emissivity.iter().all(|&e| e == 0.0) => {
                let found = format!("net flux {q} with emissivity 0");
                let remedy = "what neither emits nor absorbs has none: give it an emissivity";
                Err(of_group(&names[self.sides[0].row], found, remedy))
            }
            _ => Ok(()),
        }
    }

    /// Σ over its sides and the bands of share · emissivity · `flux`, by row and band.
    pub fn absorbed(&self, surfaces: &[Surface], flux: impl Fn(usize, usize) -> f64) -> f64 {
        let of_side = |side: &Side| {
            let emissivity = surfaces[side.row].emissivity.iter().enumerate();
            side.share * emissivity.map(|(band, e)| e * flux(side.row, band)).sum::<f64>()
        };
        self.sides.iter().map(of_side).sum()
    }
}
