//! Twin of `shaders/hemisphere_sum.wgsl`: the image of a point to what it receives.

use std::f32::consts::PI;

use glam::{Vec2, Vec3, Vec4};

use crate::backend::gpu::layout::{LANES, Summation, TILE, Tile};

/// Numbers that a point receives.
pub const WORDS: usize = 24;

/// Partial sums of each number, one a lane.
pub type Columns = [[f32; LANES as usize]; WORDS];

/// The image of a point, and what its pixels count for.
#[derive(Clone, Copy, Debug)]
pub struct PointImage<'a> {
    pub width: u32,
    pub pixels: &'a [Vec4],
    /// Form factor of each pixel of the hemicube, and that times axial distance over distance.
    pub weights: &'a [[f32; 2]],
    /// Tiles of this point.
    pub tiles: &'a [Tile],
}

impl PointImage<'_> {
    fn pixel(&self, x: u32, y: u32) -> Vec4 {
        self.pixels[(y * self.width + x) as usize]
    }
}

/// What each lane adds up of an image.
pub fn add_columns(image: &PointImage, summation: Summation) -> Columns {
    let mut columns = [[0.0; LANES as usize]; WORDS];
    for lane in 0..LANES {
        let (radiosity, shares) = add_hemicube(image, summation.resolution, lane);
        for k in 0..3 {
            columns[k][lane as usize] = radiosity[k];
            columns[3 + k][lane as usize] = shares[k];
        }
        for (index, tile) in image.tiles.iter().enumerate().filter(|(_, t)| t.scale != 0.0) {
            let seen = add_tile(image, summation.resolution, index as u32, tile, lane);
            columns[8 + 2 * index][lane as usize] = seen.x;
            columns[9 + 2 * index][lane as usize] = seen.y;
        }
    }
    columns
}

/// A lane's radiosity, and its shares: open, back, nearness.
fn add_hemicube(image: &PointImage, n: u32, lane: u32) -> (Vec3, Vec3) {
    let (mut radiosity, mut shares) = (Vec3::ZERO, Vec3::ZERO);
    for y in (lane / 8..3 * n).step_by(LANES as usize / 8) {
        let (mut radiosity_here, mut shares_here) = (Vec3::ZERO, Vec3::ZERO);
        for x in (lane % 8..n).step_by(8) {
            let pixel = image.pixel(x, y);
            let [weight, axial] = image.weights[(y * n + x) as usize];
            radiosity_here += pixel.truncate() * weight;
            let open = if pixel.w == 0.0 { weight } else { 0.0 };
            let back = if pixel.w < 0.0 { weight } else { 0.0 };
            shares_here += Vec3::new(open, back, pixel.w.abs() * axial);
        }
        radiosity += radiosity_here;
        shares += shares_here;
    }
    (radiosity, shares)
}

/// A lane's form factors of a light, or of the sun: of what is seen, and of all of it.
fn add_tile(image: &PointImage, n: u32, index: u32, tile: &Tile, lane: u32) -> Vec2 {
    let tiles_per_line = n.max(TILE) / TILE;
    let left = index % tiles_per_line * TILE;
    let top = index / tiles_per_line * TILE + 3 * n;
    let mut seen = Vec2::ZERO;
    for i in (lane..TILE * TILE).step_by(LANES as usize) {
        let (x, y) = (i % TILE, i / TILE);
        let pixel = image.pixel(left + x, top + y);
        let p = (Vec2::new(x as f32, y as f32) + 0.5) * (2.0 / TILE as f32) - 1.0;
        let off = p.x * Vec3::from(tile.right) - p.y * Vec3::from(tile.up);
        let d = Vec3::from(tile.middle) + off;
        let r2 = d.dot(d);
        let weight = d.z.max(0.0) * tile.scale / (PI * r2 * r2);
        if tile.disc == 0.0 {
            seen += Vec2::new(pixel.x, pixel.w) * weight;
        } else if off.dot(off) <= tile.disc {
            seen += Vec2::new(1.0 - pixel.x, 1.0) * weight;
        }
    }
    seen
}

/// The sum over the lanes of each number.
pub fn add_up(columns: &Columns) -> [f32; WORDS] {
    columns.map(|column| column.into_iter().fold(0.0, |sum, lane| sum + lane))
}
