//! What the fuzz target `ply` does with an input, and the replay of its corpus.

use radiosity::io::Input;
use radiosity::{ErrorKind, VertexMesh, read_ply, write_ply};

/// Reads the PLY file, and if it is one, writes it and reads that. Answers whether it was taken;
/// panics where a mesh or an error breaks its promises.
pub fn try_ply(input: &[u8]) -> bool {
    match read_ply(Input::bytes("it.ply", input)) {
        Ok(mesh) => {
            check(&mesh, input.len());
            let mut bytes = vec![];
            write_ply(&mut bytes, &mesh).unwrap();
            let again = read_ply(Input::bytes("it.ply", &bytes));
            let again = again.expect("what is written can be read");
            assert_eq!((again.faces, again.positions.len()), (mesh.faces, mesh.positions.len()));
            true
        }
        Err(e) => {
            assert_eq!(e.kind(), ErrorKind::Scene, "{e}");
            let message = e.to_string();
            assert!(message.contains("; ") && !message.contains(char::is_control), "{message:?}");
            assert!(message.len() < 4000, "{message}");
            false
        }
    }
}

/// Every number is finite, every corner is there, and there is no more of anything than bytes.
fn check(mesh: &VertexMesh, bytes: usize) {
    let vertices = mesh.positions.len();
    assert!(vertices <= bytes && mesh.faces.len() <= bytes);
    assert!(
        mesh.positions.iter().chain(&mesh.normals).chain(&mesh.radiosity).all(|p| p.is_finite())
    );
    assert_eq!([mesh.radiosity.len(), mesh.normals.len()], [vertices; 2]);
    assert!(mesh.error.is_empty() || mesh.error.len() == vertices);
    assert!(mesh.irradiance.is_empty() || mesh.irradiance.len() == vertices);
    assert!(mesh.irradiance.iter().all(|e| e.is_finite()));
    assert!(mesh.faces.iter().flatten().all(|&v| (v as usize) < vertices));
}
