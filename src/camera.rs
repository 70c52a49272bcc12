//! The camera image: radiance interpolated over the mesh, antialiased.

mod gathered;

use glam::DVec3;
use rayon::prelude::*;

use crate::error::{Error, ErrorKind};
use crate::scene::Rgb;
use crate::vertex::VertexMesh;
use crate::visibility::ray_scene::{Hit, RayScene};

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
    /// lines of sight (box filter) on a grid that is turned a little, so that an edge along pixels
    /// does not meet a whole row of them at once: none has another beside or below it.
    ///
    /// Radiance is radiosity over π. Backs of faces and the void are black.
    ///
    /// # Errors
    /// Those of [`Camera::check`].
    pub fn image(
        &self,
        surface: &VertexMesh,
        width: u32,
        height: u32,
        samples: u32,
    ) -> Result<RadianceImage, Error> {
        let sight = PrimaryRays::new(self, surface, width, height, samples)?;
        let pixel = |k: u32| {
            let sum: Rgb = sight.hits(k).map(|hit| sight.at(&hit, &surface.radiosity)).sum();
            sum * sight.share / std::f64::consts::PI
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

/// The lines of sight through the pixels of an image, and what they meet.
struct PrimaryRays<'a> {
    surface: &'a VertexMesh,
    rays: RayScene,
    eye: DVec3,
    /// A line of sight at the image's top left corner, and from there to the right and downwards by
    /// a sample each.
    corner: DVec3,
    right: DVec3,
    down: DVec3,
    width: u32,
    samples: u32,
    /// Of each line in its pixel.
    share: f64,
}

impl PrimaryRays<'_> {
    fn new<'a>(
        camera: &Camera,
        surface: &'a VertexMesh,
        width: u32,
        height: u32,
        samples: u32,
    ) -> Result<PrimaryRays<'a>, Error> {
        camera.check(width, height, samples)?;
        let [right, up, forward] = camera.frame();
        let corner = |f: &[u32; 3]| f.map(|v| surface.positions[v as usize]);
        let rays = RayScene::new(surface.faces.iter().map(corner));
        let tangent = (camera.vertical_fov.to_radians() / 2.0).tan();
        let step = 2.0 * tangent / f64::from(height) / f64::from(samples);
        let (right, down) = (right * step, -up * step);
        let half = |pixels: u32| f64::from(pixels) * f64::from(samples) / 2.0;
        let corner = forward - right * half(width) - down * half(height);
        let share = 1.0 / f64::from(samples * samples);
        Ok(PrimaryRays {
            surface,
            rays,
            eye: camera.eye,
            corner,
            right,
            down,
            width,
            samples,
            share,
        })
    }

    /// The fronts that the lines of sight of pixel `k` meet. The other lines meet backs or nothing.
    fn hits(&self, k: u32) -> impl Iterator<Item = Hit> {
        let n = self.samples;
        let share = move |k: u32| (f64::from(k) + 0.5) / f64::from(n);
        (0..n * n).filter_map(move |s| {
            let (i, j) = (s % n, s / n);
            let x = f64::from(k % self.width * n + i) + share(j);
            let y = f64::from(k / self.width * n + j) + share(n - 1 - i);
            self.hit(self.corner + self.right * x + self.down * y)
        })
    }

    /// The front that is met along `direction` from the eye, if that comes first.
    fn hit(&self, direction: DVec3) -> Option<Hit> {
        self.rays.closest_hit(self.eye, direction, 0.0, None).filter(|hit| hit.front)
    }

    /// What is interpolated where a line meets the surface from values at its vertices.
    fn at(&self, hit: &Hit, values: &[DVec3]) -> DVec3 {
        let [a, b, c] = self.surface.faces[hit.triangle].map(|v| values[v as usize]);
        a * (1.0 - hit.u - hit.v) + b * hit.u + c * hit.v
    }
}
