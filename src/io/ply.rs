//! PLY output: the mesh with radiosity, for other programs.

use std::fmt;
use std::io::Write;
use std::path::Path;

use super::write_file;
use crate::error::Error;
use crate::geometry::aabb::Aabb;
use crate::io::tone::ToneCurve;
use crate::scene::Rgb;
use crate::vertex::VertexMesh;

/// Writes `surface` as binary little-endian PLY.
///
/// Vertices: `x y z nx ny nz` (float, the scene's unit), `radiosity_r radiosity_g radiosity_b`
/// (float, W/m² per channel, linear), `irradiance_r irradiance_g irradiance_b` (the same; for
/// multiplication by textures; 0 in channels that a material does not reflect), `red green blue`
/// (uchar, the radiosity tone-mapped for viewers), and, if estimated, `error` (float, W/m²: the
/// error of the radiosity, a length over the channels). Faces: `vertex_indices`, triangles,
/// counter-clockwise from the front. The surface's comments are in the header.
///
/// If 32 bits do not suffice, numbers are double: `x y z` of a mesh more than 16 of its sizes from
/// the origin, and the radiosity and its error if the largest is above 3.4e38 or below 1e-30 W/m².
///
/// # Errors
/// [`crate::ErrorKind::File`] when the file cannot be written.
pub fn write_ply(path: impl AsRef<Path>, surface: &VertexMesh) -> Result<(), Error> {
    write_ply_with_tone(path, surface, &ToneCurve::fit(&surface.radiosity))
}

/// [`write_ply`] with a tone curve of radiosity for `red green blue`, such as that of a picture:
/// [`ToneCurve::of_radiosity`].
///
/// # Errors
/// Those of [`write_ply`].
pub fn write_ply_with_tone(
    path: impl AsRef<Path>,
    surface: &VertexMesh,
    tone: &ToneCurve,
) -> Result<(), Error> {
    write_file(path.as_ref(), |out| {
        let irradiances = surface.irradiance.len() == surface.positions.len();
        let errors = surface.error.len() == surface.positions.len() && !surface.error.is_empty();
        let (place, light) = (Width::of_positions(surface), Width::of_light(surface, errors));
        write_header(out, surface, place, "radiosity in W/m2 per channel, linear BT.709")?;
        for (width, names, known) in [
            (light, ["radiosity_r", "radiosity_g", "radiosity_b"], true),
            (light, ["irradiance_r", "irradiance_g", "irradiance_b"], irradiances),
        ] {
            for name in names.into_iter().filter(|_| known) {
                writeln!(out, "property {width} {name}")?;
            }
        }
        for name in ["red", "green", "blue"] {
            writeln!(out, "property uchar {name}")?;
        }
        // One error per vertex, or none at all.
        if errors {
            writeln!(out, "property {light} error")?;
        }
        writeln!(out, "element face {}", surface.faces.len())?;
        writeln!(out, "property list uchar int vertex_indices\nend_header")?;
        let vertices = surface.positions.iter().zip(&surface.normals).zip(&surface.radiosity);
        for (v, ((position, normal), radiosity)) in vertices.enumerate() {
            for (width, vector) in [(place, position), (Width::Float, normal), (light, radiosity)] {
                vector.to_array().into_iter().try_for_each(|x| width.write(out, x))?;
            }
            if irradiances {
                // A reflectance close to 0 makes it larger than any float.
                let irradiance = surface.irradiance[v].min(Rgb::splat(light.most()));
                irradiance.to_array().into_iter().try_for_each(|x| light.write(out, x))?;
            }
            out.write_all(&tone.display(*radiosity))?;
            if errors {
                light.write(out, surface.error[v])?;
            }
        }
        write_faces(out, surface)
    })
}

/// Begins a file of `surface`: its comments after that of the `units`, and the properties of
/// positions, of this width, and normals.
pub(super) fn write_header(
    out: &mut dyn Write,
    surface: &VertexMesh,
    place: Width,
    units: &str,
) -> std::io::Result<()> {
    writeln!(out, "ply\nformat binary_little_endian 1.0")?;
    writeln!(out, "comment {units}")?;
    for comment in &surface.comments {
        // A header is ASCII, one line per entry.
        let plain = |c: char| if c.is_ascii() && !c.is_ascii_control() { c } else { ' ' };
        writeln!(out, "comment {}", comment.chars().map(plain).collect::<String>())?;
    }
    writeln!(out, "element vertex {}", surface.positions.len())?;
    for (width, names) in [(place, ["x", "y", "z"]), (Width::Float, ["nx", "ny", "nz"])] {
        for name in names {
            writeln!(out, "property {width} {name}")?;
        }
    }
    Ok(())
}

pub(super) fn write_faces(out: &mut dyn Write, surface: &VertexMesh) -> std::io::Result<()> {
    for face in &surface.faces {
        out.write_all(&[3])?;
        for v in face {
            out.write_all(&v.to_le_bytes())?;
        }
    }
    Ok(())
}

/// Numbers of 32 or 64 bits.
#[derive(Clone, Copy)]
pub(super) enum Width {
    Float,
    Double,
}

impl Width {
    /// Floats, if their steps are below a millionth of the mesh's size.
    pub fn of_positions(surface: &VertexMesh) -> Width {
        let bounds = Aabb::from_points(surface.positions.iter().copied());
        let largest = bounds.low.abs().max(bounds.high.abs()).max_element();
        Width::of(largest, largest <= 16.0 * bounds.longest_side())
    }

    /// Floats, if they represent the largest value and one of 1e-8 times that.
    fn of_light(surface: &VertexMesh, errors: bool) -> Width {
        let brightest = surface.radiosity.iter().map(|b| b.max_element());
        let told = surface.error.iter().copied().filter(|_| errors);
        Width::of(brightest.chain(told).fold(0.0, f64::max), true)
    }

    pub fn of(largest: f64, fine: bool) -> Width {
        let holds = largest == 0.0 || (1e-30..=f64::from(f32::MAX)).contains(&largest);
        if fine && holds { Width::Float } else { Width::Double }
    }

    /// The largest finite number.
    fn most(self) -> f64 {
        match self {
            Width::Float => f64::from(f32::MAX),
            Width::Double => f64::MAX,
        }
    }

    pub fn write(self, out: &mut dyn Write, x: f64) -> std::io::Result<()> {
        match self {
            Width::Float => out.write_all(&(x as f32).to_le_bytes()),
            Width::Double => out.write_all(&x.to_le_bytes()),
        }
    }
}

impl fmt::Display for Width {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Width::Float => "float",
            Width::Double => "double",
        })
    }
}
