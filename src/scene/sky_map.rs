//! A piecewise constant sky: the radiance of small parts of the sphere, in two squares.
//!
//! ```text
//!        y                   u = (x + y) / (|x| + |y| + |z|)     A hemisphere fills a square, its
//!      ╱ │ ╲                 v = (x − y) / (|x| + |y| + |z|)     horizon is the square's rim: no
//!    ╱   │   ╲                                                   piece lies on both sides of it
//!   ─────z─────x             z ≥ 0: the first square             (the octahedron of Praun and
//!    ╲   │   ╱               z < 0: the second                   Hoppe, 2003, by halves)
//! ```
//!
//! Shaders use the same mapping: `shaders/sky.wgsl`.

use glam::{DQuat, DVec3};
use serde::Serialize;

use super::Rgb;

/// The radiance of a sky, piece by piece.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct SkyMap {
    /// Rotation from the scene's axes to the map's, whose zenith is +z.
    turn: DQuat,
    /// Pieces along the edge of a square.
    side: usize,
    /// W/(m² sr) per channel: the square above the horizon line by line, then that below.
    pieces: Vec<[f32; 3]>,
    brightest: f64,
}

/// Pieces along the edge of a square for a sky by a formula, each with the radiance at its centre:
/// a function smooth over 20° varies by about 1e-4 within a piece of at most 0.3°.
const SIDE: usize = 512;

impl SkyMap {
    /// Of `radiance` by directions (unit length, in the scene's axes) above the horizon; black
    /// below. `turn` is the rotation from the scene's axes to the map's.
    pub fn of_upper_hemisphere(turn: DQuat, radiance: impl Fn(DVec3) -> Rgb) -> SkyMap {
        let back = turn.inverse();
        let middle = |cell: usize| 2.0 * (cell as f64 + 0.5) / SIDE as f64 - 1.0;
        let piece = |k: usize| radiance(back * direction(middle(k % SIDE), middle(k / SIDE)));
        let mut pieces: Vec<Rgb> = (0..SIDE * SIDE).map(piece).collect();
        pieces.resize(2 * SIDE * SIDE, Rgb::ZERO);
        SkyMap::new(turn, SIDE, &pieces)
    }

    /// Of a picture in lines of `width`, from the zenith down, each a full turn with its middle
    /// towards +y of the map's axes. `turn` is the rotation from the scene's axes to those.
    pub fn of_picture(turn: DQuat, width: usize, pixels: &[Rgb]) -> SkyMap {
        use std::f64::consts::{PI, TAU};
        let height = pixels.len() / width;
        // 1024 pieces of about 0.1° at most: 24 MB.
        let side = (width / 4).max(height / 2).next_power_of_two().clamp(64, 1024);
        let (mut sums, mut weights) =
            (vec![Rgb::ZERO; 2 * side * side], vec![0.0; 2 * side * side]);
        // Parts of a pixel, enough for each piece to contain one: a piece is no narrower than
        // 1.2/side radians.
        let parts = |angle: f64| (angle * side as f64 * 2.0).ceil().max(2.0) as usize;
        let across = parts(TAU / width as f64);
        let down = parts(PI / height as f64);
        for y in 0..height * down {
            let (sine, cosine) = libm::sincos((y as f64 + 0.5) / (height * down) as f64 * PI);
            for x in 0..width * across {
                let turned = (x as f64 + 0.5) / (width * across) as f64 * TAU - PI;
                let (s, c) = libm::sincos(turned);
                let k = index(DVec3::new(sine * s, sine * c, cosine), side);
                sums[k] += pixels[y / down * width + x / across] * sine;
                weights[k] += sine;
            }
        }
        let pieces = sums.iter().zip(&weights);
        let pieces: Vec<Rgb> = pieces.map(|(&s, &w)| if w > 0.0 { s / w } else { s }).collect();
        SkyMap::new(turn, side, &pieces)
    }

    fn new(turn: DQuat, side: usize, pieces: &[Rgb]) -> SkyMap {
        let brightest = pieces.iter().map(|piece| piece.max_element()).fold(0.0, f64::max);
        let pieces = pieces.iter().map(|piece| piece.as_vec3().to_array()).collect();
        SkyMap { turn, side, pieces, brightest }
    }

    /// Radiance from `direction`, unit length, W/(m² sr).
    pub fn radiance(&self, direction: DVec3) -> Rgb {
        let piece = self.pieces[index(self.turn * direction, self.side)];
        DVec3::from_array(piece.map(f64::from))
    }

    /// The radiance of the brightest piece, in its brightest channel, W/(m² sr).
    pub fn brightest(&self) -> f64 {
        self.brightest
    }

    /// Rotation from the scene's axes to the map's.
    pub fn turn(&self) -> DQuat {
        self.turn
    }

    /// Pieces along the edge of a square.
    pub fn side(&self) -> usize {
        self.side
    }

    /// W/(m² sr) per channel, the first square line by line, then the second.
    pub fn pieces(&self) -> &[[f32; 3]] {
        &self.pieces
    }
}

/// The direction of a point of the first square, unit length.
fn direction(u: f64, v: f64) -> DVec3 {
    let (x, y) = ((u + v) / 2.0, (u - v) / 2.0);
    DVec3::new(x, y, 1.0 - x.abs() - y.abs()).normalize()
}

/// The index of the piece that contains `direction`, in the map's axes.
fn index(direction: DVec3, side: usize) -> usize {
    let DVec3 { x, y, z } = direction / direction.abs().element_sum();
    let cell = |t: f64| (((t + 1.0) / 2.0 * side as f64) as usize).min(side - 1);
    let below = if z < 0.0 { side } else { 0 };
    (below + cell(x - y)) * side + cell(x + y)
}
