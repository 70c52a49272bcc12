//! Floors: level surfaces with their rooms.

use super::measuring_grid::MeasuringGrid;
use super::plane::GridPlane;
use super::rooms::FloorRaster;
use super::settings::GridSettings;
use super::surface::{Footprint, LevelSurface};
use crate::error::Error;
use crate::scene::Scene;
use crate::visibility::ray_scene::RayScene;

/// A level surface, where it is from above, and its rooms.
pub(super) struct Floor<'a> {
    surface: LevelSurface,
    footprint: Footprint,
    /// None over a surface that is too large.
    raster: Option<FloorRaster<'a>>,
}

impl<'a> Floor<'a> {
    /// Of `scene`, whose triangles are in `rays`; a metre has `metre` scene units.
    pub fn new(surface: LevelSurface, scene: &Scene, rays: &'a RayScene, metre: f64) -> Floor<'a> {
        let footprint = Footprint::new(&surface, scene);
        let plane = surface.plane(scene, 0.0);
        let raster =
            plane.and_then(|plane| FloorRaster::new(rays, plane, metre, |p| footprint.has(p)));
        Floor { surface, footprint, raster }
    }

    /// Those of `floors`, the lowest first, that are no roofs; all where there would be none.
    pub fn without_roofs(floors: Vec<Floor<'a>>) -> Vec<Floor<'a>> {
        let is_roof = |k: usize| {
            let is_below = |p| floors[..k].iter().any(|below| below.footprint.has(p));
            floors[k].raster.as_ref().is_some_and(|raster| raster.is_roof(is_below))
        };
        let roofs: Vec<bool> = (0..floors.len()).map(is_roof).collect();
        let has_floor = roofs.contains(&false);
        let kept = floors.into_iter().zip(roofs).filter(|(_, is_roof)| !(*is_roof && has_floor));
        kept.map(|(floor, _)| floor).collect()
    }

    /// The grids `height` above each of its rooms, scene unit; numbered where there are several.
    pub fn grids(
        &self,
        scene: &Scene,
        height: f64,
        settings: &GridSettings,
    ) -> Result<Vec<MeasuringGrid>, Error> {
        let Floor { surface, footprint, raster } = self;
        let Some(raster) = raster else {
            return Ok(surface.grid(scene, height, settings)?.into_iter().collect());
        };
        let lift = surface.normal * height;
        let mut grids = vec![];
        for room in 0..raster.room_count() {
            let name = match raster.room_count() {
                1 => surface.name.clone(),
                _ => format!("{} {}", surface.name, room + 1),
            };
            let plane = raster.rectangle(room);
            let plane = GridPlane { origin: plane.origin + lift, ..plane };
            let is_in_room = |p| footprint.has(p) && raster.room_at(p - lift) == Some(room);
            grids.extend(surface.filled(name, plane, settings, is_in_room)?);
        }
        Ok(grids)
    }
}
