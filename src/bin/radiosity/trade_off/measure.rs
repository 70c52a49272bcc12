//! What is measured of a bake.

use radiosity::{BakeResult, BakeSettings};

use super::reference::Reference;

/// What came out of one bake.
pub struct Measured {
    /// All stages of the bake; neither reading the file nor opening the device.
    pub seconds: f64,
    pub errors: Errors,
    /// The error that the bake itself estimates.
    pub estimate: f64,
    pub vertices: usize,
    pub shot_elements: usize,
    pub elements: usize,
    pub hemicubes: u64,
    pub gathers: u64,
    /// The settings used in the end.
    pub settings: BakeSettings,
}

/// Root mean squares of relative errors.
#[derive(Clone, Copy)]
pub struct Errors {
    /// Over the area.
    pub area: f64,
    /// At truth points of all kinds.
    pub all: Option<f64>,
}

impl Measured {
    pub fn new(baked: &BakeResult, reference: &Reference) -> Result<Measured, String> {
        let surface = &baked.light.surface;
        Ok(Measured {
            seconds: baked.timings.total(),
            errors: reference.errors(surface)?,
            estimate: baked.estimate.total,
            vertices: surface.positions.len(),
            shot_elements: baked.mesh.element_count(),
            elements: baked.light.mesh.element_count(),
            hemicubes: baked.hemicubes,
            gathers: baked.light.gather_count,
            settings: baked.settings.clone(),
        })
    }
}
