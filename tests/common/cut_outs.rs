//! Quadrilaterals with masks, and the same with holes that are there.

use std::fmt::Write as _;

use glam::DVec3;
use radiosity::{Scene, SceneSettings};

use super::scenes::Quad;
use super::textured::tga;

/// A square of cells, rows from the top, solid where this says so of column and row.
pub struct Lattice {
    pub side: usize,
    pub is_solid: fn(usize, usize) -> bool,
}

impl Lattice {
    /// An image of it, a texel a cell: white is solid, black is a hole.
    pub fn image(&self) -> Vec<u8> {
        let cells = (0..self.side).flat_map(|y| (0..self.side).map(move |x| (x, y)));
        let texel = |(x, y)| if (self.is_solid)(x, y) { [255; 3] } else { [0; 3] };
        tga(self.side as u16, &cells.map(texel).collect::<Vec<_>>())
    }

    /// What is solid of a rectangle that the image lies on once, u along its first side, as
    /// rectangles.
    pub fn cells(&self, quad: Quad) -> Vec<Quad> {
        let [a, b, _, d] = quad.map(DVec3::from_array);
        let at = |x: usize, y: usize| {
            let [u, v] = [x, self.side - y].map(|k| k as f64 / self.side as f64);
            (a + u * (b - a) + v * (d - a)).to_array()
        };
        let cells = (0..self.side).flat_map(|y| (0..self.side).map(move |x| (x, y)));
        let solid = cells.filter(|&(x, y)| (self.is_solid)(x, y));
        solid.map(|(x, y)| [at(x, y + 1), at(x + 1, y + 1), at(x + 1, y), at(x, y)]).collect()
    }

    /// The share of its cells that is solid.
    pub fn share(&self) -> f64 {
        let cells = (0..self.side).flat_map(|y| (0..self.side).map(move |x| (x, y)));
        let solid = cells.filter(|&(x, y)| (self.is_solid)(x, y)).count();
        solid as f64 / (self.side * self.side) as f64
    }
}

/// Squares of a board in turns.
pub fn board(x: usize, y: usize) -> bool {
    (x + y).is_multiple_of(2)
}

/// A quadrilateral and the name of its material.
pub type Part<'a> = (Quad, &'a str);

/// A scene of quadrilaterals, each a group of its own, q0, q1 and so on, with (0, 0), (1, 0),
/// (1, 1) and (0, 1) for the texture coordinates of their corners; of `library`, which may name
/// `images`. A material called `back…` is that of backs, whose corners run the other way round and
/// have the coordinates of the first corners' places: those of a front `[a, b, c, d]` are
/// `[d, c, b, a]`.
pub fn read(
    parts: &[Part],
    library: &str,
    images: &[(&str, &[u8])],
    settings: &SceneSettings,
) -> Scene {
    let mut text = "mtllib a.mtl\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n".to_string();
    for (k, (corners, material)) in parts.iter().enumerate() {
        for [x, y, z] in corners {
            writeln!(text, "v {x:.17e} {y:.17e} {z:.17e}").unwrap();
        }
        let first = 4 * k + 1;
        let places = if material.starts_with("back") { [4, 3, 2, 1] } else { [1, 2, 3, 4] };
        let corners = (0..4).map(|c| format!("{}/{}", first + c, places[c]));
        let corners = corners.collect::<Vec<_>>().join(" ");
        writeln!(text, "g q{k}\nusemtl {material}\nf {corners}").unwrap();
    }
    let mut files = vec![("a.mtl", library.as_bytes())];
    files.extend_from_slice(images);
    settings.read("a.obj", text.as_bytes(), &files).unwrap()
}
