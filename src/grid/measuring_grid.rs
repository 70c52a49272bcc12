//! The points at which light is measured.

use glam::DVec3;

use super::plane::GridPlane;
use super::settings::GridSettings;
use crate::error::Error;

/// The points of a plane at which light is measured.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuringGrid {
    /// Name: that of the group below it, if any.
    pub name: String,
    /// The area that the cells fill: without the strip along the walls.
    pub plane: GridPlane,
    /// Points along each edge.
    pub counts: [usize; 2],
    /// Positions, scene unit, row by row along the first edge. `None` where the surface below ends,
    /// or is nearer to its end than the width of the strip.
    pub points: Vec<Option<DVec3>>,
}

impl MeasuringGrid {
    /// The grid whose cells fill `plane`, with the points that are `inside`.
    pub(super) fn filling(
        name: String,
        plane: GridPlane,
        settings: &GridSettings,
        inside: impl Fn(DVec3) -> bool,
    ) -> Result<MeasuringGrid, Error> {
        let counts = settings.counts(plane.edges.map(DVec3::length))?;
        let middle = |k: usize, axis: usize| (k as f64 + 0.5) / counts[axis] as f64;
        let cells = (0..counts[1]).flat_map(|row| (0..counts[0]).map(move |column| (row, column)));
        let points = cells
            .map(|(row, column)| plane.at([middle(column, 0), middle(row, 1)]))
            .map(|p| inside(p).then_some(p));
        Ok(MeasuringGrid { name, plane, counts, points: points.collect() })
    }
}
