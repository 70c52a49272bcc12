//! PLY output with a property for each band.

use std::io::Write;
use std::path::Path;

use super::ply::{Width, write_faces, write_header};
use super::write_file;
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
pub fn write_ply_bands(
    path: impl AsRef<Path>,
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
    let place = Width::of_positions(surface);
    write_file(path.as_ref(), |out| {
        write_header(out, surface, place, "radiosity in W/m2, or W/(m2 nm), by band")?;
        for band in bands {
            for (name, _) in columns {
                writeln!(out, "property {width} {name}_{}", band.name)?;
            }
        }
        for name in ["red", "green", "blue"].iter().filter(|_| colours.is_some()) {
            writeln!(out, "property uchar {name}")?;
        }
        writeln!(out, "element face {}", surface.faces.len())?;
        writeln!(out, "property list uchar int vertex_indices\nend_header")?;
        for (v, (position, normal)) in surface.positions.iter().zip(&surface.normals).enumerate() {
            for (width, vector) in [(place, position), (Width::Float, normal)] {
                vector.to_array().into_iter().try_for_each(|x| width.write(out, x))?;
            }
            for b in 0..bands.len() {
                for (_, values) in columns {
                    width.write(out, values[v * bands.len() + b])?;
                }
            }
            if let Some(colours) = &colours {
                out.write_all(&tone.display(colours[v]))?;
            }
        }
        write_faces(out, surface)
    })
}
