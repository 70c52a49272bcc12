//! Boxes with textured walls, and images for them.

use radiosity::{Mesh, Rgb, Scene, SceneSettings};

/// An uncompressed TGA image: rows from the top of texels of red, green and blue.
pub fn tga(width: u16, texels: &[[u8; 3]]) -> Vec<u8> {
    let height = (texels.len() / usize::from(width)) as u16;
    let mut bytes = vec![0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0];
    bytes.extend(width.to_le_bytes());
    bytes.extend(height.to_le_bytes());
    bytes.extend([24, 0x20]);
    bytes.extend(texels.iter().flat_map(|&[r, g, b]| [b, g, r]));
    bytes
}

pub const RED: [u8; 3] = [255, 0, 0];
pub const GREEN: [u8; 3] = [0, 255, 0];

/// A library: a lamp, grey walls, and what `more` defines.
fn library(more: &str) -> String {
    format!("newmtl lamp\nKd 0.5\nKe 1\nnewmtl grey\nKd 0.5\n{more}\n")
}

/// Positions of a unit box and those in the middle of the edges of its wall x = 0, with texture
/// coordinates for this wall and for the floor z = 0.
const BOX: &str = "mtllib box.mtl\n\
    v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nv 0 0.5 0\nv 0 0.5 1\n\
    vt 0 0\nvt 0.5 0\nvt 1 0\nvt 0 1\nvt 0.5 1\nvt 1 1\n\
    g ceiling\nusemtl lamp\nf 5 8 7 6\n\
    g sides\nusemtl grey\nf 2 6 7 3\nf 1 5 6 2\nf 4 3 7 8\n";

fn read(text: &str, library: &str, image: &[u8]) -> Scene {
    let files: [(&str, &[u8]); 2] = [("box.mtl", library.as_bytes()), ("a.tga", image)];
    SceneSettings::default().read("box.obj", text.as_bytes(), &files).unwrap()
}

/// A box under a ceiling that is its lamp. Of the wall x = 0 the half at y < ½ is of
/// `materials[0]`, the other of `materials[1]`: those of `more`, with the texture `a.tga` once
/// across the wall.
pub fn box_with_halves(materials: [&str; 2], more: &str, image: &[u8]) -> Scene {
    let [first, second] = materials;
    let text = format!(
        "{BOX}g floor\nusemtl grey\nf 1 2 3 4\n\
         g first\nusemtl {first}\nf 1/1 9/2 10/5 5/4\n\
         g second\nusemtl {second}\nf 9/2 4/3 8/6 10/5\n"
    );
    read(&text, &library(more), image)
}

/// The same box with one wall x = 0 of material `wall`, a single polygon.
pub fn box_with_wall(more: &str, image: &[u8]) -> Scene {
    let text =
        format!("{BOX}g floor\nusemtl grey\nf 1 2 3 4\ng wall\nusemtl wall\nf 1/1 4/3 8/6 5/4\n");
    read(&text, &library(more), image)
}

/// The same box with a floor of material `floor`.
pub fn box_with_floor(more: &str, image: &[u8]) -> Scene {
    let text =
        format!("{BOX}g wall\nusemtl grey\nf 1 4 8 5\ng floor\nusemtl floor\nf 1/1 2/3 3/6 4/4\n");
    read(&text, &library(more), image)
}

/// Texels of noise, all channels alike.
pub fn noise(side: u16) -> Vec<u8> {
    let mut state = 7u64;
    let texel = |_| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        [(state >> 56) as u8; 3]
    };
    tga(side, &(0..usize::from(side) * usize::from(side)).map(texel).collect::<Vec<_>>())
}

/// A black and white board of so many squares along a side.
pub fn checkerboard(squares: u16) -> Vec<u8> {
    let texel = |k: u16| if (k % squares + k / squares) & 1 == 0 { [255; 3] } else { [0; 3] };
    tga(squares, &(0..squares * squares).map(texel).collect::<Vec<_>>())
}

/// Elements of the group of this name.
pub fn elements_of(mesh: &Mesh, group: &str) -> Vec<usize> {
    let scene = mesh.scene();
    let group_of = |e: &usize| scene.triangles()[mesh.triangle(mesh.element(*e))].group;
    let wanted = scene.groups().iter().position(|name| name == group).unwrap() as u32;
    (0..mesh.element_count()).filter(|e| group_of(e) == wanted).collect()
}

/// Mean over area of what each of `elements` has.
pub fn mean_of(mesh: &Mesh, elements: &[usize], values: &[Rgb]) -> Rgb {
    let area = |e: usize| mesh.area(mesh.element(e));
    let sum: Rgb = elements.iter().map(|&e| values[e] * area(e)).sum();
    sum / elements.iter().map(|&e| area(e)).sum::<f64>()
}

/// The same with an open wall across the floor, from one side to the other.
pub fn box_with_divided_floor(more: &str, image: &[u8]) -> Scene {
    let text = format!(
        "{BOX}g wall\nusemtl grey\nf 1 4 8 5\ng floor\nusemtl floor\nf 1/1 2/3 3/6 4/4\n\
         v 0 0.3 0\nv 1 0.4 0\nv 1 0.4 0.5\nv 0 0.3 0.5\ng divider\nusemtl grey\n\
         f 11 12 13 14\nf 14 13 12 11\n"
    );
    read(&text, &library(more), image)
}
