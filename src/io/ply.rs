//! PLY out: the mesh with radiosity, for other programs.

use std::io::Write;
use std::path::Path;

use super::write_file;
use crate::error::Error;
use crate::tone::ToneCurve;
use crate::vertex::VertexRadiosity;

/// Writes `surface` as binary little-endian PLY.
///
/// Vertices: `x y z nx ny nz` (float, the scene's unit), `radiosity_r radiosity_g radiosity_b`
/// (float, W/m² per channel, linear), `red green blue` (uchar, tone-mapped for viewers), and, where
/// it is known, `error` (float, W/m²: how far the radiosity may be off, a length over the channels). Faces:
/// `vertex_indices`, triangles, counter-clockwise from the front. The surface's comments are in the
/// header.
///
/// # Errors
/// [`crate::ErrorKind::File`] when the file cannot be written.
pub fn write_ply(path: impl AsRef<Path>, surface: &VertexRadiosity) -> Result<(), Error> {
    let tone = ToneCurve::fit(&surface.radiosity);
    write_file(path.as_ref(), |out| {
        writeln!(out, "ply\nformat binary_little_endian 1.0")?;
        writeln!(out, "comment radiosity in W/m2 per channel, linear BT.709")?;
        for comment in &surface.comments {
            // A header is ASCII, a line an entry.
            let plain = |c: char| if c.is_ascii() && !c.is_ascii_control() { c } else { ' ' };
            writeln!(out, "comment {}", comment.chars().map(plain).collect::<String>())?;
        }
        writeln!(out, "element vertex {}", surface.positions.len())?;
        for name in ["x", "y", "z", "nx", "ny", "nz"] {
            writeln!(out, "property float {name}")?;
        }
        for name in ["radiosity_r", "radiosity_g", "radiosity_b"] {
            writeln!(out, "property float {name}")?;
        }
        for name in ["red", "green", "blue"] {
            writeln!(out, "property uchar {name}")?;
        }
        // An error a vertex, or none at all.
        let errors = surface.error.len() == surface.positions.len() && !surface.error.is_empty();
        if errors {
            writeln!(out, "property float error")?;
        }
        writeln!(out, "element face {}", surface.faces.len())?;
        writeln!(out, "property list uchar int vertex_indices\nend_header")?;
        let vertices = surface.positions.iter().zip(&surface.normals).zip(&surface.radiosity);
        for (v, ((position, normal), radiosity)) in vertices.enumerate() {
            for vector in [position, normal, radiosity] {
                for x in vector.as_vec3().to_array() {
                    out.write_all(&x.to_le_bytes())?;
                }
            }
            out.write_all(&tone.display(*radiosity))?;
            if errors {
                out.write_all(&(surface.error[v] as f32).to_le_bytes())?;
            }
        }
        for face in &surface.faces {
            out.write_all(&[3])?;
            for v in face {
                out.write_all(&v.to_le_bytes())?;
            }
        }
        Ok(())
    })
}
