//! PLY output with a property for each band.

use super::Output;
use super::ply::{self, Property, Width, write_mesh};
use crate::bands::BandLight;
use crate::error::Error;
use crate::io::tone::ToneCurve;

/// Writes the light of bands as binary little-endian PLY.
///
/// Vertices: `x y z nx ny nz` (float, the scene's unit) and, for each band by its name,
/// `radiosity_NAME`, `irradiance_NAME` and `error_NAME`, the standard error of the radiosity by
/// noise (float, W/m² or W/(m² nm)); if all bands have wavelengths also `red green blue` (uchar,
/// the colours of the spectrum, for viewers, by `tone` of radiosity or one that fits). Faces:
/// `vertex_indices`, triangles, counter-clockwise from the front. If 32 bits do not suffice,
/// numbers are double, as in [`write_ply`](crate::write_ply).
///
/// # Errors
/// [`crate::ErrorKind::File`] when the file cannot be written.
pub fn write_ply_bands<'o>(
    out: impl Into<Output<'o>>,
    light: &BandLight,
    tone: Option<&ToneCurve>,
) -> Result<(), Error> {
    let BandLight { bands, surface, radiosity, irradiance, noise, .. } = light;
    // Bands without wavelengths have no colours.
    let colours = light.colours().ok().map(|colours| colours.radiosity);
    let fitted = ToneCurve::fit(colours.as_deref().unwrap_or_default());
    let tone = tone.unwrap_or(&fitted);
    let columns = [("radiosity", radiosity), ("irradiance", irradiance), ("error", noise)];
    let brightest = columns.iter().flat_map(|(_, values)| values.iter().copied());
    let width = Width::of(brightest.fold(0.0, f64::max), true);
    let names = bands.iter().flat_map(|b| columns.map(|(name, _)| format!("{name}_{}", b.name)));
    let mut properties: Vec<Property> = names.map(|name| (width.to_string(), name)).collect();
    if colours.is_some() {
        properties.extend(ply::colours());
    }
    let units = "radiosity in W/m2, or W/(m2 nm), by band";
    write_mesh(out.into(), surface, units, &properties, |out, v| {
        for b in v * bands.len()..(v + 1) * bands.len() {
            columns.iter().try_for_each(|(_, values)| width.write(out, values[b]))?;
        }
        match &colours {
            Some(colours) => out.write_all(&tone.display(colours[v])),
            None => Ok(()),
        }
    })
}
