//! PLY input: a mesh with radiosity, written by the crate or another program.

use glam::DVec3;
use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{
    ElementDef, Encoding, Property, PropertyAccess, PropertyAccessResult, PropertyType, ScalarType,
};

use super::Input;
use crate::error::{Error, ErrorKind, quoted, shortened};
use crate::scene::Rgb;
use crate::vertex::VertexMesh;

/// Properties of a vertex, the required ones first.
const NAMES: [&str; 13] = [
    "x",
    "y",
    "z",
    "radiosity_r",
    "radiosity_g",
    "radiosity_b",
    "nx",
    "ny",
    "nz",
    "irradiance_r",
    "irradiance_g",
    "irradiance_b",
    "error",
];

/// Reads a mesh as [`write_ply`](super::write_ply) writes it, in ASCII or binary of either order.
///
/// Vertices have `x y z radiosity_r radiosity_g radiosity_b`, and may have `nx ny nz`,
/// `irradiance_r irradiance_g irradiance_b` and `error`, numbers of any type; faces have a list
/// `vertex_indices` or `vertex_index`, and become fans of triangles. Other properties and elements
/// are skipped. The file may come from anywhere: memory stays within a multiple of its length,
/// whatever its header claims.
///
/// # Errors
/// - [`ErrorKind::File`] when the file cannot be read, or has more than 4 GiB.
/// - [`ErrorKind::Scene`] when it is malformed, a property is missing, a number is not finite, or
///   a face has fewer than three vertices or one that does not exist.
pub fn read_ply<'i>(file: impl Into<Input<'i>>) -> Result<VertexMesh, Error> {
    let file = file.into();
    let bytes = file.read(1 << 32, "give a PLY file that can be read")?;
    parse(&bytes).map_err(|e| e.inside(file.path()))
}

fn parse(bytes: &[u8]) -> Result<VertexMesh, Error> {
    let mut reader = Reader::new(bytes);
    let header = Parser::<Skipped>::new().read_header(&mut reader).map_err(malformed)?;
    let mut mesh = VertexMesh { comments: header.comments.clone(), ..Default::default() };
    for element in header.elements.values() {
        check(element, header.encoding, bytes.len() as u64)?;
        match element.name.as_str() {
            "vertex" => {
                let vertices = Parser::new();
                let vertices = vertices.read_payload_for_element(&mut reader, element, &header);
                add_vertices(&mut mesh, element, &vertices.map_err(malformed)?)?;
            }
            "face" => {
                let faces = Parser::new().read_payload_for_element(&mut reader, element, &header);
                add_faces(&mut mesh, &faces.map_err(malformed)?)?;
            }
            _ => {
                let skipped = Parser::<Skipped>::new();
                let skipped = skipped.read_payload_for_element(&mut reader, element, &header);
                skipped.map_err(malformed)?;
            }
        }
    }
    let vertices = mesh.positions.len();
    let outside = |face: &[u32; 3]| face.iter().any(|&v| v as usize >= vertices);
    if let Some(f) = mesh.faces.iter().position(outside) {
        let found = format!("vertices {:?} of {vertices}", mesh.faces[f]);
        return Err(wrong(format!("triangle {}", f + 1), found, "count vertices from 0"));
    }
    mesh.elements = (0..mesh.faces.len() as u32).collect();
    Ok(mesh)
}

/// Checks whether the number of `element` in the header fits a file of `bytes`.
fn check(element: &ElementDef, encoding: Encoding, bytes: u64) -> Result<(), Error> {
    let ElementDef { name, count, properties } = element;
    let size = |scalar: &ScalarType| match (encoding, scalar) {
        // A digit and a separator.
        (Encoding::Ascii, _) => 2,
        (_, ScalarType::Char | ScalarType::UChar) => 1,
        (_, ScalarType::Short | ScalarType::UShort) => 2,
        (_, ScalarType::Int | ScalarType::UInt | ScalarType::Float) => 4,
        (_, ScalarType::Double) => 8,
    };
    let least = properties.values().map(|property| match &property.data_type {
        PropertyType::Scalar(scalar) | PropertyType::List(scalar, _) => size(scalar),
    });
    let least: u64 = least.sum();
    if *count > 0 && (least == 0 || (*count as u64).saturating_mul(least) > bytes + 1) {
        let found = format!("{count} of {least} bytes or more, in a file of {bytes}");
        let place = format!("element {}", quoted(&[name]));
        return Err(wrong(place, found, "give the whole file, with a header that is true"));
    }
    Ok(())
}

fn add_vertices(
    mesh: &mut VertexMesh,
    element: &ElementDef,
    vertices: &[Vertex],
) -> Result<(), Error> {
    let has = |name: &&str| element.properties.contains_key(*name);
    if let Some(missing) = NAMES[..6].iter().find(|name| !has(name)) {
        let names: Vec<&String> = element.properties.keys().collect();
        let found = format!("no property '{missing}' among {}", quoted(&names));
        let remedy = "give radiosity_r, radiosity_g and radiosity_b in W/m², as `bake` writes them";
        return Err(wrong("element 'vertex'".into(), found, remedy));
    }
    let (irradiance, error) = (NAMES[9..12].iter().all(has), has(&NAMES[12]));
    for (v, Vertex(numbers)) in vertices.iter().enumerate() {
        if let Some(k) = numbers.iter().position(|x| !x.is_finite()) {
            let found = format!("{} {}", NAMES[k], numbers[k]);
            return Err(wrong(format!("vertex {}", v + 1), found, "all must be finite"));
        }
        let three = |k: usize| DVec3::new(numbers[k], numbers[k + 1], numbers[k + 2]);
        mesh.positions.push(three(0));
        mesh.radiosity.push(three(3) as Rgb);
        mesh.normals.push(three(6));
        mesh.irradiance.extend(irradiance.then(|| three(9)));
        mesh.error.extend(error.then_some(numbers[12]));
    }
    Ok(())
}

fn add_faces(mesh: &mut VertexMesh, faces: &[Face]) -> Result<(), Error> {
    for (f, Face(corners)) in faces.iter().enumerate() {
        let wrong = |found: String| {
            let remedy = "give three or more indices of vertices, counted from 0";
            wrong(format!("face {}", f + 1), found, remedy)
        };
        let index = |&v: &i64| u32::try_from(v).map_err(|_| wrong(format!("vertex {v}")));
        let corners = corners.iter().map(index).collect::<Result<Vec<u32>, Error>>()?;
        let [first, rest @ ..] = &corners[..] else { return Err(wrong("no vertices".into())) };
        if rest.len() < 2 {
            return Err(wrong(format!("{} vertices", corners.len())));
        }
        mesh.faces.extend(rest.windows(2).map(|pair| [*first, pair[0], pair[1]]));
    }
    Ok(())
}

fn wrong(place: String, found: String, remedy: &str) -> Error {
    Error::new(ErrorKind::Scene, place, found, remedy)
}

/// The parser reports the line, and the cause in the first line of its message.
fn malformed(e: ParseError) -> Error {
    let text = e.to_string();
    let (what, _) = text.split_once('\n').unwrap_or((&text, ""));
    let place = e.line().map_or("PLY".into(), |line| format!("line {line}"));
    let what = what.strip_prefix("Line ").and_then(|w| w.split_once(": ")).map_or(what, |w| w.1);
    let found = shortened(what).escape_debug().to_string();
    wrong(place, found, "give a PLY file, ASCII or binary, that is whole").with_source(e)
}

/// The numbers of a vertex, in the order of [`NAMES`].
struct Vertex([f64; NAMES.len()]);

impl PropertyAccess for Vertex {
    fn new() -> Vertex {
        Vertex([0.0; NAMES.len()])
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let Some(k) = NAMES.iter().position(|known| *known == name) else {
            return PropertyAccessResult::Ignored;
        };
        self.0[k] = match property {
            Property::Char(x) => x.into(),
            Property::UChar(x) => x.into(),
            Property::Short(x) => x.into(),
            Property::UShort(x) => x.into(),
            Property::Int(x) => x.into(),
            Property::UInt(x) => x.into(),
            Property::Float(x) => x.into(),
            Property::Double(x) => x,
            _ => return PropertyAccessResult::UnsupportedType,
        };
        PropertyAccessResult::Set
    }
}

/// The indices of a face's vertices.
struct Face(Vec<i64>);

impl PropertyAccess for Face {
    fn new() -> Face {
        Face(vec![])
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        fn wide<T: Into<i64>>(list: Vec<T>) -> Vec<i64> {
            list.into_iter().map(Into::into).collect()
        }
        if !matches!(name, "vertex_indices" | "vertex_index") {
            return PropertyAccessResult::Ignored;
        }
        self.0 = match property {
            Property::ListChar(list) => wide(list),
            Property::ListUChar(list) => wide(list),
            Property::ListShort(list) => wide(list),
            Property::ListUShort(list) => wide(list),
            Property::ListInt(list) => wide(list),
            Property::ListUInt(list) => wide(list),
            _ => return PropertyAccessResult::UnsupportedType,
        };
        PropertyAccessResult::Set
    }
}

/// Unused elements.
struct Skipped;

impl PropertyAccess for Skipped {
    fn new() -> Skipped {
        Skipped
    }
}
