//! The hemicube: its faces, their frames and the weight of every pixel. Pure geometry, no device.
//!
//! A hemicube of resolution N (even) over a point has a top face of N × N pixels and four side
//! faces of N × N/2. Its pixels are kept as one image, N wide and 3N high: the top face first, then
//! the sides in the order +t, −t, +b, −b. The *item buffer* of a hemicube has this layout, and so
//! has the image of its weights.

use std::f64::consts::PI;
use std::ops::Range;

use glam::DVec3;

use crate::error::{Error, ErrorKind};
use crate::form_factor::Row;
use crate::geometry::rounding::Apportion;

/// Smallest and largest resolution of a hemicube's top face, in pixels along an edge.
pub const RESOLUTIONS: std::ops::RangeInclusive<u32> = 2..=4096;

/// Checks a hemicube resolution: even and within [`RESOLUTIONS`].
///
/// # Errors
/// [`ErrorKind::Setting`] otherwise.
pub fn check_resolution(n: u32) -> Result<(), Error> {
    if RESOLUTIONS.contains(&n) && n.is_multiple_of(2) {
        return Ok(());
    }
    let remedy = format!(
        "must be an even number of pixels from {} to {}",
        RESOLUTIONS.start(),
        RESOLUTIONS.end()
    );
    Err(Error::new(ErrorKind::Setting, format!("hemicube resolution {n}"), "not usable", remedy))
}

/// An orthonormal, right-handed frame over a surface: tangent t, bitangent b, normal n.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    pub tangent: DVec3,
    pub bitangent: DVec3,
    pub normal: DVec3,
}

impl Frame {
    /// The frame of unit `normal`, turned about it by `angle` (radians) from a fixed start.
    pub fn new(normal: DVec3, angle: f64) -> Frame {
        let (x, y) = normal.any_orthonormal_pair();
        let (sin, cos) = libm::sincos(angle);
        // any_orthonormal_pair gives x × y = normal.
        Frame { tangent: x * cos + y * sin, bitangent: y * cos - x * sin, normal }
    }
}

/// View of one face of the hemicube: a pinhole camera at the patch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Face {
    pub right: DVec3,
    pub up: DVec3,
    pub forward: DVec3,
    /// Lowest image row, as the tangent of its elevation: −1 for the top face, 0 for the sides,
    /// which end at the horizon. The highest is 1, and left and right are −1 and 1.
    pub bottom: f64,
}

impl Face {
    /// The five faces over `frame`, in image order. `right` × `up` = −`forward`, so that a face of
    /// the scene seen from its front stays counter-clockwise.
    pub fn all(frame: &Frame) -> [Face; 5] {
        let Frame { tangent: t, bitangent: b, normal: n } = *frame;
        let side = |forward: DVec3| Face { right: forward.cross(n), up: n, forward, bottom: 0.0 };
        let top = Face { right: t, up: -b, forward: n, bottom: -1.0 };
        [top, side(t), side(-t), side(b), side(-b)]
    }

    /// Rows of the hemicube image that face `k` of resolution `n` covers.
    pub fn rows(k: usize, n: u32) -> Range<u32> {
        match k {
            0 => 0..n,
            k => n + (k as u32 - 1) * (n / 2)..n + k as u32 * (n / 2),
        }
    }

    /// Direction (not of unit length) through the centre of pixel `x`, `y` of this face: `x` from
    /// the left, `y` from the top, both from 0.
    #[cfg(test)]
    pub fn direction(&self, n: u32, x: u32, y: u32) -> DVec3 {
        let step = 2.0 / f64::from(n);
        let (h, v) = (-1.0 + (f64::from(x) + 0.5) * step, 1.0 - (f64::from(y) + 0.5) * step);
        self.right * h + self.up * v + self.forward
    }
}

/// Form factor from the hemicube's centre to the part of the top face between its centre and the
/// corner (x, y), at distance 1 (Howell, catalogue configuration B-3; Cohen and Greenberg 1985 give
/// its density, 1/(π(x²+y²+1)²)).
fn top_corner(x: f64, y: f64) -> f64 {
    let (a, b) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
    (x / a * libm::atan(y / a) + y / b * libm::atan(x / b)) / (2.0 * PI)
}

/// Integral of the side-face density z/(π(y²+z²+1)²) (Cohen and Greenberg 1985) over the part
/// of the face between its base line's middle and (y, z), up to a function of y alone.
fn side_corner(y: f64, z: f64) -> f64 {
    let r = (1.0 + z * z).sqrt();
    -libm::atan(y / r) / (2.0 * PI * r)
}

/// Exact delta form factor of every pixel of a hemicube of resolution `n`: the integral of the
/// density over the pixel, not its midpoint value. Image layout of this module; dimensionless.
///
/// Their sum is 1 up to rounding; they are not normalised.
///
/// # Errors
/// [`ErrorKind::Setting`] for an unusable resolution, see [`check_resolution`].
pub fn delta_form_factors(n: u32) -> Result<Vec<f64>, Error> {
    check_resolution(n)?;
    let line = |k: u32| -1.0 + 2.0 * f64::from(k) / f64::from(n);
    let integral = |corner: fn(f64, f64) -> f64, x: u32, z0: f64, z1: f64| {
        let (x0, x1) = (line(x), line(x + 1));
        (corner(x1, z1) - corner(x0, z1)) - (corner(x1, z0) - corner(x0, z0))
    };
    let mut image = Vec::with_capacity(3 * n as usize * n as usize);
    for y in 0..n {
        image.extend((0..n).map(|x| integral(top_corner, x, line(y), line(y + 1))));
    }
    for _ in 0..4 {
        for y in 0..n / 2 {
            let (z0, z1) = (-line(y + 1), -line(y));
            image.extend((0..n).map(|x| integral(side_corner, x, z0, z1)));
        }
    }
    Ok(image)
}

/// The delta form factors in units of 1/[`Row::TOTAL`], image layout of this module.
///
/// Rounded by their running sum: any run of consecutive pixels of a face, such as an image line, is
/// off by less than one unit, and the whole hemicube is [`Row::TOTAL`] exactly.
pub(crate) fn weights(n: u32) -> Result<Vec<u32>, Error> {
    let exact = delta_form_factors(n)?;
    let (n, total) = (n as usize, f64::from(Row::TOTAL));
    let (top, side) = (&exact[..n * n], &exact[n * n..n * n + n * n / 2]);
    let side_total = (side.iter().sum::<f64>() * total).round() as u32;
    let mut image = rounded(top, Row::TOTAL - 4 * side_total);
    let side = rounded(side, side_total);
    for _ in 0..4 {
        image.extend_from_slice(&side);
    }
    Ok(image)
}

/// Integers in proportion to `shares` with the given sum: differences of the rounded running sum.
fn rounded(shares: &[f64], sum: u32) -> Vec<u32> {
    let scale = f64::from(sum) / shares.iter().sum::<f64>();
    let (mut running, mut parts) = (0.0, Apportion::default());
    let mut units: Vec<u32> = shares
        .iter()
        .map(|share| {
            running += share;
            parts.part_up_to(((running * scale).round() as u32).min(sum))
        })
        .collect();
    if let Some(last) = units.last_mut() {
        *last += parts.remainder(sum);
    }
    units
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn raw_delta_form_factors_sum_to_one() {
        // Each pixel is a difference of four corner values below 0.25, rounded to 2^-55 each;
        // 3 n² of them with random signs stay below 1e-12 even at n = 1024.
        for n in (16..=1024).step_by(2).filter(|n| n % 16 == 0 || *n < 64) {
            let sum: f64 = delta_form_factors(n).unwrap().iter().sum();
            assert!((sum - 1.0).abs() < 1e-12, "{n}: {sum}");
        }
    }

    #[test]
    fn delta_form_factors_approach_the_density() {
        // Midpoint rule against exact integral: relative error (h²/24)·max|f''/f| summed over both
        // axes. At n = 512, h = 1/256 and |f''| ≤ 24 f over the hemicube: below 3.1e-5.
        let n = 512u32;
        let exact = delta_form_factors(n).unwrap();
        let area = (2.0 / f64::from(n)).powi(2);
        for (x, y) in [(0, 0), (255, 256), (100, 300), (511, 200)] {
            let (u, v) = ((x as f64 + 0.5) / 256.0 - 1.0, (y as f64 + 0.5) / 256.0 - 1.0);
            let top = area / (PI * (u * u + v * v + 1.0).powi(2));
            let got = exact[y * 512 + x];
            assert!((got / top - 1.0).abs() < 3.1e-5, "top {x} {y}: {got} {top}");
        }
        for (x, y) in [(0usize, 0usize), (255, 128), (100, 20), (511, 200)] {
            let (u, z) = ((x as f64 + 0.5) / 256.0 - 1.0, 1.0 - (y as f64 + 0.5) / 256.0);
            let side = z * area / (PI * (u * u + z * z + 1.0).powi(2));
            for face in 1..5 {
                let row = Face::rows(face, n).start as usize + y;
                let got = exact[row * 512 + x];
                assert!((got / side - 1.0).abs() < 3.1e-5, "side {x} {y}: {got} {side}");
            }
        }
    }

    #[test]
    fn fixed_point_weights_keep_totals() {
        for n in [2, 16, 30, 128, 256, 1024] {
            let (exact, units) = (delta_form_factors(n).unwrap(), weights(n).unwrap());
            let sum: u64 = units.iter().map(|&w| u64::from(w)).sum();
            assert_eq!(sum, u64::from(Row::TOTAL), "{n}");
            // A line is a difference of two running sums, each rounded by at most half a unit; the
            // scale of a face is off by at most 2 units of its sum: 3 units at most.
            for (line, units) in exact.chunks(n as usize).zip(units.chunks(n as usize)) {
                let want = line.iter().sum::<f64>() * f64::from(Row::TOTAL);
                let got: u64 = units.iter().map(|&w| u64::from(w)).sum();
                assert!((got as f64 - want).abs() <= 3.0, "{n}: {got} {want}");
            }
        }
    }

    #[test]
    fn faces_look_where_the_layout_says() {
        let f = Frame { tangent: DVec3::X, bitangent: DVec3::Y, normal: DVec3::Z };
        let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
        // Forward, right, up; seen from above, the sides' right is to the clockwise.
        let want = [(z, x, -y), (x, -y, z), (-x, y, z), (y, x, z), (-y, -x, z)];
        let got = Face::all(&f).map(|face| (face.forward, face.right, face.up));
        assert_eq!(got, want);
        assert_eq!(Face::all(&f).map(|face| face.bottom), [-1.0, 0.0, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn faces_cover_the_hemisphere_once() {
        // Every direction above the horizon falls on exactly one face, and the pixel that it falls
        // on looks back along it within a pixel's diagonal.
        let frame = Frame::new(DVec3::new(0.48, -0.6, 0.64), 0.7);
        assert!(frame.tangent.cross(frame.bitangent).distance(frame.normal) < 1e-15);
        let (n, faces) = (64, Face::all(&frame));
        for face in &faces {
            assert!(face.right.cross(face.up).distance(-face.forward) < 1e-15);
        }
        for k in 0..5000 {
            let (z, phi) = ((k as f64 + 0.5) / 5000.0, k as f64 * 2.399963229728653);
            let r = (1.0f64 - z * z).sqrt();
            let d = frame.tangent * (r * phi.cos())
                + frame.bitangent * (r * phi.sin())
                + frame.normal * z;
            let mut hits = 0;
            for (index, face) in faces.iter().enumerate() {
                let w = d.dot(face.forward);
                let (h, v) = (d.dot(face.right) / w, d.dot(face.up) / w);
                if w <= 0.0 || h.abs() >= 1.0 || v >= 1.0 || v <= face.bottom {
                    continue;
                }
                hits += 1;
                let half = f64::from(n) / 2.0;
                let (x, y) = (((h + 1.0) * half) as u32, ((1.0 - v) * half) as u32);
                assert!(y < Face::rows(index, n).len() as u32);
                let back = face.direction(n, x, y).normalize();
                assert!(back.distance(d) < 2f64.sqrt() / half, "face {index}");
            }
            assert_eq!(hits, 1, "direction {d}");
        }
    }

    #[test]
    fn unusable_resolutions_are_refused() {
        for n in [0, 1, 3, 127, 4098, u32::MAX] {
            assert_eq!(delta_form_factors(n).unwrap_err().kind(), ErrorKind::Setting);
        }
        assert!(check_resolution(16).is_ok());
    }
}
