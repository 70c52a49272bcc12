//! A scene by way of an OBJ file, and radiosity back from a PLY file.

use std::f64::consts::PI;
use std::fmt::Write;
use std::path::Path;

use radiosity::Scene;

/// `scene`, written to `folder` and loaded from there.
pub fn through_obj(scene: &Scene, folder: &Path) -> Result<Scene, radiosity::Error> {
    let (mut obj, mut mtl) = (String::from("mtllib scene.mtl\n"), String::new());
    for (k, m) in scene.materials().iter().enumerate() {
        let ([r, g, b], [x, y, z]) = (m.reflectance.to_array(), (m.exitance / PI).to_array());
        let _ = write!(mtl, "newmtl m{k}\nKd {r:e} {g:e} {b:e}\nKe {x:e} {y:e} {z:e}\n");
    }
    for p in scene.positions() {
        let _ = writeln!(obj, "v {:e} {:e} {:e}", p.x, p.y, p.z);
    }
    for t in scene.triangles() {
        let [a, b, c] = t.corners.map(|k| k + 1);
        let _ = write!(obj, "g {}\nusemtl m{}\n", scene.groups()[t.group as usize], t.material);
        let _ = writeln!(obj, "f {a} {b} {c}");
    }
    let path = folder.join("scene.obj");
    std::fs::write(folder.join("scene.mtl"), mtl).expect("a scratch file");
    std::fs::write(&path, obj).expect("a scratch file");
    radiosity::load_scene(path)
}

/// The radiosity of every vertex of a PLY file as the crate writes it, channel after channel.
pub fn radiosity_of_ply(path: &Path) -> Vec<f64> {
    let bytes = std::fs::read(path).expect("a PLY file");
    let mark = b"end_header\n";
    let end = bytes.windows(mark.len()).position(|w| w == mark).expect("a header") + mark.len();
    let header = String::from_utf8_lossy(&bytes[..end]);
    let (mut count, mut at, mut fields) = (0, 0, vec![]);
    for line in header.lines() {
        match line.split(' ').collect::<Vec<_>>()[..] {
            ["element", "vertex", n] => count = n.parse().expect("a number of vertices"),
            ["property", kind, name] => {
                let size = match kind {
                    "double" => 8,
                    "float" => 4,
                    _ => 1,
                };
                fields.extend(name.starts_with("radiosity").then_some((at, size)));
                at += size;
            }
            _ => {}
        }
    }
    let number = |start: usize, size: usize| match size {
        8 => f64::from_le_bytes(bytes[start..start + 8].try_into().expect("8 bytes")),
        _ => f64::from(f32::from_le_bytes(bytes[start..start + 4].try_into().expect("4 bytes"))),
    };
    let vertex = |v: usize| fields.iter().map(move |&(k, size)| number(end + v * at + k, size));
    (0..count).flat_map(vertex).collect()
}
