//! The camera image: radiance interpolated over the mesh, antialiased.

use glam::DVec3;
use rayon::prelude::*;

use crate::error::{Error, ErrorKind};
use crate::rays::Rays;
use crate::scene::Rgb;
use crate::vertex::VertexRadiosity;

/// A pinhole camera. Up in the image is +y, or −z where the camera looks along y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Where the camera stands.
    pub eye: DVec3,
    /// A point in the middle of the image.
    pub target: DVec3,
    /// Angle between the lowest and the highest line of sight, degrees, in (0, 180).
    pub vertical_fov: f64,
}

/// An image of linear radiance, W/(m² sr) per channel, row by row from the top.
#[derive(Clone, Debug)]
pub struct RadianceImage {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width` × `height` pixels.
    pub pixels: Vec<Rgb>,
}

/// Largest image side in pixels.
const MAX_SIDE: u32 = 1 << 15;

impl Camera {
    /// Draws `surface` with `width` × `height` pixels, each the mean of `samples` × `samples`
    /// lines of sight on a grid (box filter).
    ///
    /// Radiance is radiosity over π. Backs of faces and the void are black.
    ///
    /// # Errors
    /// Those of [`Camera::check`].
    pub fn image(
        &self,
        surface: &VertexRadiosity,
        width: u32,
        height: u32,
        samples: u32,
    ) -> Result<RadianceImage, Error> {
        self.check(width, height, samples)?;
        let [right, up, forward] = self.frame();
        let corner = |f: &[u32; 3]| f.map(|v| surface.positions[v as usize]);
        let rays = Rays::new(surface.faces.iter().map(corner));
        let tangent = (self.vertical_fov.to_radians() / 2.0).tan();
        let step = 2.0 * tangent / f64::from(height);
        let radiance = |x: f64, y: f64| {
            let h = (x - f64::from(width) / 2.0) * step;
            let v = (f64::from(height) / 2.0 - y) * step;
            let hit = rays.nearest(self.eye, right * h + up * v + forward, 0.0, None);
            let Some(hit) = hit.filter(|h| h.front) else { return Rgb::ZERO };
            let [a, b, c] = surface.faces[hit.triangle].map(|v| surface.radiosity[v as usize]);
            (a * (1.0 - hit.u - hit.v) + b * hit.u + c * hit.v) / std::f64::consts::PI
        };
        let pixel = |k: u32| {
            let (x, y) = (f64::from(k % width), f64::from(k / width));
            let at = |s: u32| (f64::from(s) + 0.5) / f64::from(samples);
            let grid = (0..samples * samples).map(|s| (at(s % samples), at(s / samples)));
            let sum: Rgb = grid.map(|(dx, dy)| radiance(x + dx, y + dy)).sum();
            sum / f64::from(samples * samples)
        };
        let pixels = (0..width * height).into_par_iter().map(pixel).collect();
        Ok(RadianceImage { width, height, pixels })
    }

    /// Right, up and forward of the view, unit length.
    fn frame(&self) -> [DVec3; 3] {
        let forward = (self.target - self.eye).normalize();
        let vertical = if forward.y.abs() > 0.9999 { DVec3::NEG_Z } else { DVec3::Y };
        let right = forward.cross(vertical).normalize();
        [right, right.cross(forward), forward]
    }

    /// Whether [`Camera::image`] would take these settings: worth asking before a long solve.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] for a size of 0 or above 32768, no samples, a field of view outside
    /// (0, 180), or an eye that is not finite or is the target itself.
    pub fn check(&self, width: u32, height: u32, samples: u32) -> Result<(), Error> {
        let bad = |found: String, remedy: &str| {
            Err(Error::new(ErrorKind::Setting, "camera", found, remedy))
        };
        if !(1..=MAX_SIDE).contains(&width) || !(1..=MAX_SIDE).contains(&height) {
            return bad(format!("an image of {width} × {height}"), "use 1 to 32768 pixels a side");
        }
        if !(1..=256).contains(&samples) {
            return bad(format!("{samples} samples"), "use 1 to 256 along a pixel's side");
        }
        if !(self.vertical_fov > 0.0 && self.vertical_fov < 180.0) {
            let found = format!("a vertical field of view of {}", self.vertical_fov);
            return bad(found, "use an angle above 0 and below 180 degrees");
        }
        let finite = self.eye.is_finite() && self.target.is_finite();
        if !finite || (self.target - self.eye).try_normalize().is_none() {
            let found = format!("eye {} and target {}", self.eye, self.target);
            return bad(found, "both must be finite, and apart");
        }
        Ok(())
    }
}
