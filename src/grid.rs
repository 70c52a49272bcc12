//! Measuring grids: irradiance or illuminance at the points of a plane, and their statistics.
//!
//! ```text
//!   plane given, above a group, or above each floor
//!    ┌───────────────────────────┐  strip along the walls, left out
//!    │  ┌───┬───┬───┬───┬───┐    │
//!    │  │ · │ · │ · │ · │ · │    │  points in the middles of cells no longer than p
//!    │  ├───┼───┼───┼───┼───┤    │
//!    │  │ · │ · │ · │ · │ · │    │  mean, minimum, maximum, uniformity U_0 = minimum / mean
//!    │  └───┴───┴───┴───┴───┘    │
//!    └───────────────────────────┘
//! ```
//!
//! [`MeasuringGrid`] has the positions: geometry of the scene alone. It is
//! [measured](MeasuringGrid::measure) in the light of a bake. Strip and spacing are those of EN
//! 12464-1 unless [`GridSettings`] say otherwise.

mod floor;
mod measuring_grid;
mod plane;
mod quantity;
mod rooms;
mod settings;
mod statistics;
mod surface;

use std::ops::ControlFlow;

use glam::DVec3;

use crate::error::{Error, ErrorKind};
use crate::gather::{Gather, GatherPoint, GatheredMesh, PointIrradiance, irradiance_at};
use crate::path_correction::{PathCorrection, correct_by_paths};
use crate::scene::{Rgb, Scene};
use crate::visibility::ray_scene::RayScene;
use floor::Floor;
pub use measuring_grid::MeasuringGrid;
pub use plane::GridPlane;
pub use quantity::Quantity;
pub use settings::GridSettings;
pub use statistics::GridStatistics;
use surface::LevelSurface;

/// A grid with the values measured at its points.
#[derive(Clone, Debug)]
pub struct MeasuredGrid {
    /// Positions.
    pub grid: MeasuringGrid,
    /// Irradiance, in the order of [`MeasuringGrid::points`]; `None` where there is no point.
    pub values: Vec<Option<PointIrradiance>>,
    /// Standard error of the mean of the values outside of solids, W/m² per channel.
    pub mean_error: Rgb,
}

impl MeasuringGrid {
    /// The grid of a plane anywhere, less the strip along its edges.
    ///
    /// # Errors
    /// Those of [`GridPlane::normal`] and [`GridSettings::counts`]; [`ErrorKind::Setting`] where
    /// the strip leaves nothing.
    pub fn on_plane(
        name: impl Into<String>,
        plane: GridPlane,
        settings: &GridSettings,
    ) -> Result<MeasuringGrid, Error> {
        plane.normal()?;
        let name = name.into();
        let inner = plane.without(settings.strip_in_scene()?).ok_or_else(|| {
            let found = format!("a strip of {} m leaves nothing", settings.strip);
            Error::new(ErrorKind::Setting, format!("grid '{name}'"), found, "give a narrower one")
        })?;
        MeasuringGrid::filling(name, inner, settings, |_| true)
    }

    /// Grids `height` metres above the floor of each room of `scene`, the lowest first. A floor
    /// faces `up`, is connected, has at least four square metres and is wider than both strips;
    /// walls part it into rooms. Roofs, in the open above another floor, are not floors.
    ///
    /// # Errors
    /// Those of [`GridSettings::counts`].
    pub fn above_floors(
        scene: &Scene,
        up: DVec3,
        height: f64,
        settings: &GridSettings,
    ) -> Result<Vec<MeasuringGrid>, Error> {
        let metre = settings.checked()?.metre;
        let rays = RayScene::of_scene(scene);
        let surfaces = LevelSurface::floors(scene, up.normalize_or_zero(), metre).into_iter();
        let floors = surfaces.map(|surface| Floor::new(surface, scene, &rays, metre)).collect();
        let mut grids = vec![];
        for floor in Floor::without_roofs(floors) {
            grids.extend(floor.grids(scene, height * metre, settings)?);
        }
        Ok(grids)
    }

    /// The grid `height` metres above the group of this name: above its highest side that faces
    /// `up` or, if none does, in front of the side that faces along its mean normal.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when there is no such group, or it is not flat, or too small for the
    /// strip; those of [`GridSettings::counts`].
    pub fn above_group(
        scene: &Scene,
        group: &str,
        up: DVec3,
        height: f64,
        settings: &GridSettings,
    ) -> Result<MeasuringGrid, Error> {
        let metre = settings.checked()?.metre;
        let surface = LevelSurface::of_group(scene, group, up.normalize_or_zero(), metre)?;
        surface.grid(scene, height * metre, settings)?.ok_or_else(|| {
            let found = format!("a strip of {} m leaves nothing", settings.strip);
            let place = format!("grid above group '{group}'");
            Error::new(ErrorKind::Setting, place, found, "give a narrower strip, or 0")
        })
    }

    /// Edges of a cell, scene unit.
    pub fn cell(&self) -> [f64; 2] {
        [0, 1].map(|axis| self.plane.edges[axis].length() / self.counts[axis] as f64)
    }

    /// Measures the irradiance that `light` causes at the points: see [`irradiance_at`] for
    /// `gatherer`, `progress` and `None`.
    ///
    /// # Errors
    /// Those of [`GridPlane::normal`] and [`irradiance_at`].
    pub fn measure(
        &self,
        light: &GatheredMesh,
        gatherer: &mut dyn Gather,
        progress: impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<Option<MeasuredGrid>, Error> {
        let points = self.gather_points(light.mesh.scene())?;
        let Some(found) = irradiance_at(light, &points, gatherer, progress)? else {
            return Ok(None);
        };
        let mut found = found.into_iter();
        let values: Vec<Option<PointIrradiance>> =
            self.points.iter().map(|p| p.and_then(|_| found.next())).collect();
        let open = values.iter().flatten().filter(|value| !value.is_buried());
        let (count, squares) = open.fold((0.0, Rgb::ZERO), |(count, sum), value| {
            (count + 1.0, sum + value.standard_error * value.standard_error)
        });
        let mean_error = squares.map(f64::sqrt) / f64::max(count, 1.0);
        Ok(Some(MeasuredGrid { grid: self.clone(), values, mean_error }))
    }

    /// Measures all `grids` until gathering alone leaves less than a quarter of the share `error`
    /// of their values, so that [`MeasuredGrid::correct`] has most of it: `gatherers` make one of a
    /// noise, such as [`Backend::gather_to_noise`](crate::Backend::gather_to_noise). `progress` and
    /// `None` are those of [`MeasuringGrid::measure`].
    ///
    /// # Errors
    /// Those of [`MeasuringGrid::measure`], and of `gatherers`.
    pub fn measure_to(
        grids: &[MeasuringGrid],
        light: &GatheredMesh,
        gatherers: &mut dyn FnMut(f64) -> Result<Box<dyn Gather>, Error>,
        error: f64,
        mut progress: impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<Option<Vec<MeasuredGrid>>, Error> {
        let mut all: Vec<Option<MeasuredGrid>> = vec![None; grids.len()];
        // Half the noise four times: with more rays where gathering would take most of the error.
        for share in [0.25, 0.125, 0.0625, 0.03125] {
            let is_noisy = |measured: &MeasuredGrid| measured.relative_error() >= 0.25 * error;
            let open: Vec<usize> =
                (0..grids.len()).filter(|&k| all[k].as_ref().is_none_or(is_noisy)).collect();
            if open.is_empty() {
                break;
            }
            let mut gatherer = gatherers((share * error).min(1.0))?;
            for k in open {
                let measured = grids[k].measure(light, &mut *gatherer, &mut progress)?;
                let Some(measured) = measured else { return Ok(None) };
                all[k] = Some(measured);
            }
        }
        Ok(Some(all.into_iter().flatten().collect()))
    }

    /// The points as they gather.
    ///
    /// # Errors
    /// Those of [`GridPlane::normal`].
    pub fn gather_points(&self, scene: &Scene) -> Result<Vec<GatherPoint>, Error> {
        let normal = self.plane.normal()?;
        let [a, b] = self.cell();
        let above = |&p: &DVec3| GatherPoint::above(scene, p, normal, a.min(b));
        Ok(self.points.iter().flatten().map(above).collect())
    }
}

impl MeasuredGrid {
    /// Corrects the values, which are those of `light`, by paths until 95 % of them are estimated
    /// to be off by less than the share `error`: see [`correct_by_paths`] for `progress` and
    /// `None`. Standard errors are those against the true light then.
    ///
    /// # Errors
    /// Those of [`correct_by_paths`].
    pub fn correct(
        &mut self,
        light: &GatheredMesh,
        error: f64,
        progress: impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<Option<PathCorrection>, Error> {
        let points = self.grid.gather_points(light.mesh.scene())?;
        let mut values: Vec<PointIrradiance> = self.values.iter().flatten().copied().collect();
        let correction = correct_by_paths(light, &points, &mut values, error, progress)?;
        if let Some(correction) = &correction {
            self.values.iter_mut().flatten().zip(values).for_each(|(old, new)| *old = new);
            self.mean_error = correction.mean_error;
        }
        Ok(correction)
    }

    /// Root mean square of the standard errors over the values, lengths over the channels, of the
    /// points outside of solids; 0 if there are none.
    pub fn relative_error(&self) -> f64 {
        let values = self.values.iter().flatten().filter(|value| !value.is_buried());
        let squares = values.filter_map(|value| {
            let size = value.irradiance.length_squared();
            (size > 0.0).then(|| value.standard_error.length_squared() / size)
        });
        let (count, sum) = squares.fold((0, 0.0), |(count, sum), square| (count + 1, sum + square));
        if count > 0 { (sum / f64::from(count)).sqrt() } else { 0.0 }
    }

    /// Values of `quantity` at the points outside of solids, in their order, with standard errors.
    pub fn measured(&self, quantity: Quantity) -> impl Iterator<Item = Option<[f64; 2]>> {
        self.values.iter().map(move |value| {
            let value = value.filter(|value| !value.is_buried())?;
            Some([value.irradiance, value.standard_error].map(|rgb: Rgb| quantity.of(rgb)))
        })
    }

    /// Statistics of `quantity`; `None` if no point is outside of solids.
    pub fn statistics(&self, quantity: Quantity) -> Option<GridStatistics> {
        let values = self.measured(quantity).flatten().map(|[value, _]| value);
        GridStatistics::of(values, quantity.of(self.mean_error))
    }
}
