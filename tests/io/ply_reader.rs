//! PLY files read: those the crate writes, those of others, and those that nobody should.

use radiosity::{ErrorKind, Rgb, VertexMesh, load_scene, read_ply, write_ply};
use tempfile::TempDir;

use crate::common::framed::{self, Frame};

fn read(bytes: &[u8]) -> Result<VertexMesh, radiosity::Error> {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("it.ply");
    std::fs::write(&path, bytes).unwrap();
    read_ply(path)
}

/// The file is refused with all of `words`.
fn refused(bytes: &[u8], words: &[&str]) {
    let error = read(bytes).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Scene, "{error}");
    let text = error.to_string();
    assert!(text.contains("it.ply") && !text.contains('\n'), "{text}");
    assert!(words.iter().all(|word| text.contains(word)), "{words:?}: {text}");
}

#[test]
fn what_is_written_reads_back() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("it.ply");
    // Floats; doubles for places far away; doubles for tiny light.
    for (frame, radiosity) in
        [(framed::HERE, 1.0), (Frame::shifted(1e6), 1.0), (framed::HERE, 1e-40)]
    {
        let mut written = framed::even_surface(frame, radiosity);
        written.error = written.radiosity.iter().map(|b| b.x / 8.0).collect();
        written.irradiance = written.radiosity.iter().map(|b| 3.0 * b).collect();
        written.comments = vec!["a comment".into()];
        write_ply(&path, &written).unwrap();
        let read = read_ply(&path).unwrap();
        let doubles = |double: bool, x: f64| if double { x } else { f64::from(x as f32) };
        let far = frame.shift > 16.0;
        let places = written.positions.iter().map(|p| p.map(|x| doubles(far, x)));
        assert_eq!(read.positions, places.collect::<Vec<_>>());
        let dim = radiosity < 1e-30;
        let light = written.radiosity.iter().map(|b| b.map(|x| doubles(dim, x)));
        assert_eq!(read.radiosity, light.collect::<Vec<Rgb>>());
        let irradiance = written.irradiance.iter().map(|e| e.map(|x| doubles(dim, x)));
        assert_eq!(read.irradiance, irradiance.collect::<Vec<Rgb>>());
        let errors = written.error.iter().map(|&x| doubles(dim, x));
        assert_eq!(read.error, errors.collect::<Vec<_>>());
        let normals = written.normals.iter().map(|n| n.as_vec3().as_dvec3());
        assert_eq!(read.normals, normals.collect::<Vec<_>>());
        assert_eq!(read.faces, written.faces);
        assert!(read.comments.contains(&"a comment".to_string()));
    }
}

const HEADER: &str = "element vertex 4\nproperty double x\nproperty float y\nproperty int z\n\
                      property uchar radiosity_r\nproperty short radiosity_g\n\
                      property float radiosity_b\nproperty list uchar int others\n";

#[test]
fn polygons_of_others_become_fans() {
    let faces = "element face 2\nproperty list uchar uint vertex_index\nproperty int flags\n";
    let text = format!(
        "ply\r\nformat ascii 1.0\r\ncomment by hand\n{HEADER}element edge 1\nproperty int v\n\
         {faces}end_header\n0 0 0 1 2 3.5 0\n1 0 0 1 2 3.5 2 7 7\n1 1 0 1 -2 3.5 0\n\
         0 1.5e0 0 255 2 3.5 0\n9\n4 0 1 2 3 5\n3 2 1 0 5\n"
    );
    let mesh = read(text.as_bytes()).unwrap();
    assert_eq!(mesh.faces, [[0, 1, 2], [0, 2, 3], [2, 1, 0]]);
    assert_eq!(mesh.positions[3].to_array(), [0.0, 1.5, 0.0]);
    assert_eq!(mesh.radiosity[2], Rgb::new(1.0, -2.0, 3.5));
    assert_eq!((mesh.radiosity[3].x, mesh.error.len(), mesh.elements.len()), (255.0, 0, 3));
    // The same, binary, the large end first.
    let header = format!("ply\nformat binary_big_endian 1.0\n{HEADER}{faces}end_header\n");
    let mut bytes = header.into_bytes();
    for y in [0f32, 0.0, 1.0, 1.5] {
        bytes.extend(0f64.to_be_bytes());
        bytes.extend(y.to_be_bytes());
        bytes.extend(7i32.to_be_bytes());
        bytes.push(200);
        bytes.extend((-300i16).to_be_bytes());
        bytes.extend(3.5f32.to_be_bytes());
        bytes.extend([1, 0, 0, 0, 9]);
    }
    for face in [&[0u32, 1, 2, 3][..], &[2, 1, 0]] {
        bytes.push(face.len() as u8);
        face.iter().for_each(|v| bytes.extend(v.to_be_bytes()));
        bytes.extend(5i32.to_be_bytes());
    }
    let big = read(&bytes).unwrap();
    assert_eq!(big.faces, mesh.faces);
    assert_eq!(big.positions[3].to_array(), [0.0, 1.5, 7.0]);
    assert_eq!(big.radiosity[0], Rgb::new(200.0, -300.0, 3.5));
    // Cut anywhere it is refused, and nothing panics.
    for end in 0..bytes.len() {
        assert!(read(&bytes[..end]).is_err(), "{end}");
    }
}

#[test]
fn hostile_files_are_refused_at_once() {
    let ply = |format: &str, rest: &str| format!("ply\nformat {format} 1.0\n{rest}").into_bytes();
    let xyz = "property float x\nproperty float y\nproperty float z\n";
    let rgb =
        "property float radiosity_r\nproperty float radiosity_g\nproperty float radiosity_b\n";
    let binary = "binary_little_endian";
    // More than the file can hold, or a machine.
    for count in ["1000000000000000000", "18446744073709551615", "5"] {
        for format in ["ascii", binary, "binary_big_endian"] {
            let header = format!("element vertex {count}\n{xyz}{rgb}end_header\n");
            let words: &[&str] = if count == "5" { &[] } else { &["'vertex'", count] };
            refused(&ply(format, &header), words);
            let faces = format!("element face {count}\nproperty list uchar int vertex_indices\n");
            refused(&ply(format, &format!("{faces}end_header\n")), &[]);
            // Without properties, elements take no room at all.
            refused(&ply(format, &format!("element x {count}\nend_header\n")), &["'x'", count]);
        }
    }
    refused(&ply("ascii", "element vertex 99999999999999999999\nend_header\n"), &["line 3"]);
    // A list that claims more than there is.
    let list = "element face 1\nproperty list uint int vertex_indices\nend_header\n";
    refused(&[ply(binary, list), vec![255; 4]].concat(), &[]);
    refused(&ply("ascii", &format!("{list}4000000000 1 2\n")), &["line"]);
    refused(&ply("ascii", &format!("{list}-1\n")), &["line"]);
    // What is no solution.
    let vertex = format!("element vertex 1\n{xyz}end_header\n1 2 3\n");
    refused(&ply("ascii", &vertex), &["'radiosity_r'", "bake"]);
    let vertex = format!("element vertex 1\n{xyz}{rgb}");
    let nan = [ply(binary, &format!("{vertex}end_header\n")), f32::NAN.to_le_bytes().repeat(6)];
    refused(&nan.concat(), &["vertex 1", "x NaN"]);
    let face = |face: &str| {
        let list = "element face 1\nproperty list char int vertex_indices\nend_header\n";
        ply("ascii", &format!("{vertex}{list}0 0 0 1 1 1\n{face}\n"))
    };
    assert_eq!(read(&face("3 0 0 0")).unwrap().faces, [[0, 0, 0]]);
    refused(&face("3 0 0 1"), &["triangle 1", "of 1"]);
    refused(&face("3 0 0 -1"), &["face 1", "-1"]);
    refused(&face("2 0 0"), &["face 1", "2 vertices"]);
    refused(&face("0"), &["face 1", "no vertices"]);
    refused(&face("3 0 0 x"), &["line"]);
    refused(&ply("ascii", "property float x\nend_header\n"), &["line"]);
    refused(&ply("ebcdic", "end_header\n"), &["line 2"]);
    refused(b"", &[]);
    refused(b"ply", &[]);
    refused(b"PNG\n\xff\xfe", &[]);
    refused(&[0xff; 5000], &[]);
    let error = read_ply("no/such.ply").unwrap_err();
    assert_eq!((error.kind(), error.place()), (ErrorKind::File, "no/such.ply"));
    assert!(load_scene("no/such.ply").is_err() && read_ply("/").is_err());
}
