//! PLY output: the mesh with radiosity, for other programs.

use std::fmt;
use std::io::Write;

use glam::DVec3;

use super::Output;
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
pub fn write_ply<'o>(out: impl Into<Output<'o>>, surface: &VertexMesh) -> Result<(), Error> {
    write_ply_with_tone(out, surface, &ToneCurve::fit(&surface.radiosity))
}

/// [`write_ply`] with a tone curve of radiosity for `red green blue`, such as that of a picture:
/// [`ToneCurve::of_radiosity`].
///
/// # Errors
/// Those of [`write_ply`].
pub fn write_ply_with_tone<'o>(
    out: impl Into<Output<'o>>,
    surface: &VertexMesh,
    tone: &ToneCurve,
) -> Result<(), Error> {
    let irradiances = surface.irradiance.len() == surface.positions.len();
    // One error per vertex, or none at all.
    let errors = surface.error.len() == surface.positions.len() && !surface.error.is_empty();
    let light = Width::of_light(surface, errors);
    let mut properties = rgb("radiosity").map(|name| (light.to_string(), name)).to_vec();
    if irradiances {
        properties.extend(rgb("irradiance").map(|name| (light.to_string(), name)));
    }
    properties.extend(colours());
    properties.extend(errors.then(|| (light.to_string(), "error".into())));
    let units = "radiosity in W/m2 per channel, linear BT.709";
    write_mesh(out.into(), surface, units, &properties, |out, v| {
        light.write_vector(out, surface.radiosity[v])?;
        if irradiances {
            // A reflectance close to 0 makes it larger than any float.
            light.write_vector(out, surface.irradiance[v].min(Rgb::splat(light.most())))?;
        }
        out.write_all(&tone.display(surface.radiosity[v]))?;
        if errors { light.write(out, surface.error[v]) } else { Ok(()) }
    })
}

/// Names of the channels of a quantity.
fn rgb(quantity: &str) -> [String; 3] {
    ["r", "g", "b"].map(|channel| format!("{quantity}_{channel}"))
}

/// The properties of colours for viewers.
pub(super) fn colours() -> [Property; 3] {
    ["red", "green", "blue"].map(|name| ("uchar".into(), name.into()))
}

/// Type and name of a property of vertices.
pub(super) type Property = (String, String);

/// Writes `surface`: its comments after that of the `units`, its vertices with positions, normals
/// and these `properties`, which `vertex` writes, and its faces.
pub(super) fn write_mesh(
    out: Output<'_>,
    surface: &VertexMesh,
    units: &str,
    properties: &[Property],
    vertex: impl Fn(&mut dyn Write, usize) -> std::io::Result<()>,
) -> Result<(), Error> {
    let place = Width::of_positions(surface);
    out.write(|out| {
        writeln!(out, "ply\nformat binary_little_endian 1.0")?;
        writeln!(out, "comment {units}")?;
        for comment in &surface.comments {
            // A header is ASCII, one line per entry.
            let plain = |c: char| if c.is_ascii() && !c.is_ascii_control() { c } else { ' ' };
            writeln!(out, "comment {}", comment.chars().map(plain).collect::<String>())?;
        }
        writeln!(out, "element vertex {}", surface.positions.len())?;
        for (width, names) in [(place, ["x", "y", "z"]), (Width::Float, ["nx", "ny", "nz"])] {
            names.iter().try_for_each(|name| writeln!(out, "property {width} {name}"))?;
        }
        for (kind, name) in properties {
            writeln!(out, "property {kind} {name}")?;
        }
        writeln!(out, "element face {}", surface.faces.len())?;
        writeln!(out, "property list uchar int vertex_indices\nend_header")?;
        for (v, (position, normal)) in surface.positions.iter().zip(&surface.normals).enumerate() {
            place.write_vector(out, *position)?;
            Width::Float.write_vector(out, *normal)?;
            vertex(out, v)?;
        }
        for face in &surface.faces {
            out.write_all(&[3])?;
            face.iter().try_for_each(|v| out.write_all(&v.to_le_bytes()))?;
        }
        Ok(())
    })
}

/// Numbers of 32 or 64 bits.
#[derive(Clone, Copy)]
pub(super) enum Width {
    Float,
    Double,
}

impl Width {
    /// Floats, if their steps are below a millionth of the mesh's size.
    fn of_positions(surface: &VertexMesh) -> Width {
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

    fn write_vector(self, out: &mut dyn Write, vector: DVec3) -> std::io::Result<()> {
        vector.to_array().into_iter().try_for_each(|x| self.write(out, x))
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
