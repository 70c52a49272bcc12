//! The light that a vertex gathers in every band, and its standard error.

use serde::{Deserialize, Serialize};

use super::lookup::Lookup;
use super::spectra::Bands;
use crate::gather::vertex_rows::VertexRow;

/// Reflected light of one vertex, W/m² by band.
#[derive(Serialize, Deserialize)]
pub(super) struct GatheredVertex {
    pub reflected: Vec<f64>,
    /// Its standard error due to the rays: half the difference between two halves of them.
    pub noise: Vec<f64>,
}

impl GatheredVertex {
    /// A vertex of `material` with a row from two halves of the rays; `reflected` is the reflected
    /// light of all vertices, W/m², bands side by side.
    pub fn new(
        lookup: &Lookup,
        material: u32,
        row: &VertexRow,
        reflected: &[f64],
    ) -> GatheredVertex {
        let bands = lookup.bands;
        let (material, count) = (&bands.materials[material as usize], bands.bands.len());
        let halves = [0, 1].map(|half| {
            let mut leaving = vec![0.0; count];
            for (rows, albedo) in
                [(&row.front, &material.reflectance), (&row.behind, &material.transmittance)]
            {
                let Some(row) = rows.get(half) else { continue };
                let mut irradiance = vec![0.0; count];
                lookup.add_emitted(row, &mut irradiance);
                lookup.add_reflected(row, reflected, &mut irradiance);
                for (leaving, (albedo, irradiance)) in
                    leaving.iter_mut().zip(albedo.iter().zip(&irradiance))
                {
                    *leaving += albedo * irradiance;
                }
            }
            leaving
        });
        let both = || halves[0].iter().zip(&halves[1]);
        GatheredVertex {
            reflected: both().map(|(a, b)| (a + b) / 2.0).collect(),
            noise: both().map(|(a, b)| (a - b).abs() / 2.0).collect(),
        }
    }

    /// A vertex that reflects nothing.
    pub fn dark(bands: &Bands) -> GatheredVertex {
        let nothing = vec![0.0; bands.bands.len()];
        GatheredVertex { reflected: nothing.clone(), noise: nothing }
    }
}
