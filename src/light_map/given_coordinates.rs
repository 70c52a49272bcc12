//! Texture coordinates of a file, and their check for use in a light map.

use std::fmt;

use glam::DVec2;

use super::coverage::{NO_TRIANGLE, depth_inside, for_each_texel_around};
use super::layout::{Layout, MAX_SIDE, Resolution, bad_size, in_texels};
use crate::error::Error;
use crate::scene::Scene;

/// Why the texture coordinates of a file are not usable for a light map.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Unusable {
    /// This number of triangles have none.
    Missing(usize),
    /// This number of triangles reach out of [0, 1], where textures repeat.
    Outside(usize),
    /// This number of triangles are degenerate, to a point or a line.
    Collapsed(usize),
    /// These two triangles overlap.
    Overlapping([usize; 2]),
}

/// Layout of `triangles` of `scene` in one map by the coordinates of its file, unless these are
/// unusable.
///
/// # Errors
/// [`ErrorKind::Setting`](crate::ErrorKind::Setting) for more than [`MAX_SIDE`] texels.
pub(super) fn layout(
    scene: &Scene,
    triangles: &[u32],
    resolution: Resolution,
) -> Result<Result<Layout, Unusable>, Error> {
    let downwards = |corners: [DVec2; 3]| corners.map(|p| DVec2::new(p.x, 1.0 - p.y));
    let of_file =
        |&t: &u32| downwards(scene.texture_coordinates(t as usize).unwrap_or([DVec2::NAN; 3]));
    let coordinates: Vec<[DVec2; 3]> = triangles.iter().map(of_file).collect();
    let count = |is: fn(&[DVec2; 3]) -> bool| coordinates.iter().filter(|c| is(c)).count();
    for (count, unusable) in [
        (count(|c| !c.iter().all(|p| p.is_finite())), Unusable::Missing as fn(usize) -> Unusable),
        (count(|c| !c.iter().all(is_inside)), Unusable::Outside),
        (count(|c| area(c) < f64::EPSILON), Unusable::Collapsed),
    ] {
        if count > 0 {
            return Ok(Err(unusable(count)));
        }
    }
    let side = match resolution {
        Resolution::Pixels(side) => side,
        Resolution::TexelSize(size) => {
            let on_surfaces: f64 = triangles.iter().map(|&t| scene.area(t as usize)).sum();
            let side = (on_surfaces / coordinates.iter().map(area).sum::<f64>()).sqrt() / size;
            if side > f64::from(MAX_SIDE) {
                return Err(bad_size(resolution, format!("{} along a side", side.ceil())));
            }
            side.ceil() as u32
        }
    };
    let size = [side; 2];
    Ok(match overlapping(&coordinates, size) {
        Some(pair) => Err(Unusable::Overlapping(pair.map(|k| triangles[k] as usize))),
        None => {
            let maps = vec![0; coordinates.len()];
            Ok(Layout { sizes: vec![size], maps, coordinates, charts: None })
        }
    })
}

fn is_inside(p: &DVec2) -> bool {
    // The precision of 32-bit numbers.
    p.cmpge(DVec2::splat(-1e-6)).all() && p.cmple(DVec2::splat(1.0 + 1e-6)).all()
}

fn area([a, b, c]: &[DVec2; 3]) -> f64 {
    (b - a).perp_dot(c - a).abs() / 2.0
}

/// The first two triangles that contain the centre of one texel. It ends with the first such pair,
/// so that its time is bounded by the number of texels, however many triangles overlap.
fn overlapping(coordinates: &[[DVec2; 3]], size: [u32; 2]) -> Option<[usize; 2]> {
    let mut owners = vec![NO_TRIANGLE; size[0] as usize * size[1] as usize];
    let mut overlap = None;
    for (t, &corners) in coordinates.iter().enumerate() {
        let corners = in_texels(corners, size);
        for_each_texel_around(corners, 0.0, size, |texel, centre| {
            // Files have few digits, whose rounding makes neighbours overlap by less than that.
            if depth_inside(corners, centre) > 0.25 {
                let owner = std::mem::replace(&mut owners[texel], t as u32);
                if owner != NO_TRIANGLE {
                    overlap = Some([owner as usize, t]);
                }
            }
            overlap.is_none()
        });
        if overlap.is_some() {
            break;
        }
    }
    overlap
}

impl fmt::Display for Unusable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let triangles = |count: &usize| match count {
            1 => "1 triangle".to_string(),
            count => format!("{count} triangles"),
        };
        match self {
            Unusable::Missing(count) => write!(f, "missing for {}", triangles(count)),
            Unusable::Outside(count) => {
                write!(f, "out of [0, 1] for {}, where textures repeat", triangles(count))
            }
            Unusable::Collapsed(count) => write!(f, "on a point or line for {}", triangles(count)),
            Unusable::Overlapping([a, b]) => {
                write!(f, "overlapping for triangles {} and {}", a + 1, b + 1)
            }
        }
    }
}
