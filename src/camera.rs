//! Images of a solution: a pinhole camera, with the radiance of diffuse surfaces, B/π.
//!
//! ```text
//!   pixel ── n × n primary rays ── nearest face ── radiosity interpolated from its vertices
//!                                    │           └─ or gathered there: camera/gathered.rs
//!                                    └─ at mirrors and glass on to others: camera/second_pass.rs
//! ```
//!
//! Rays lie on a grid sheared by one sub-pixel per row and column (n-rooks): an edge along the
//! pixels then crosses the rays one by one, which gives n² levels of antialiasing instead of n.

mod framing;
mod gathered;
mod interpolated;
mod optics;
mod second_pass;
mod textured;

use std::f64::consts::PI;
use std::ops::Range;
use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use crate::error::{Error, ErrorKind};
use crate::geometry::COINCIDENCE_TOLERANCE;
use crate::mesh::Mesh;
use crate::scene::Rgb;
use crate::vertex::{FacePlace, VertexMesh};
use crate::visibility::ray_scene::{Hit, RayScene};

/// A pinhole camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Position of the pinhole, scene unit.
    pub eye: DVec3,
    /// A point in the middle of the image, scene unit.
    pub target: DVec3,
    /// Up direction of the image, of any length; only its component across the view counts. If the
    /// camera looks along it, −z is used instead, or +y if it is not ±y.
    pub up: DVec3,
    /// Vertical field of view, from the image's lower to its upper edge: degrees, in (0, 180).
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
    /// Of each pixel, whether all of its rays see the sky.
    pub sky: Vec<bool>,
}

/// Largest image side, pixels. Plain choice: memory for the pixels is 24 GiB there.
const MAX_SIDE: u32 = 1 << 15;

impl Camera {
    /// Draws `surface` with `width` × `height` pixels, each the mean (box filter) of `samples` ×
    /// `samples` primary rays on an n-rooks grid: no two in one row or column.
    ///
    /// Radiance is the interpolated radiosity over π. Backs of faces are black, and rays that miss
    /// see the sky, [`VertexMesh::sky`]. A mesh of vertices has no mirrors and no glass:
    /// [`Camera::interpolated_image`] draws these.
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
        let rays = PrimaryRays::new(self, surface, None, width, height, samples)?;
        let radiosity = |hit: &Hit| rays.interpolate(hit, &surface.radiosity);
        let (pixels, sky) = rays.pixels(0..width * height, &radiosity).unzip();
        Ok(RadianceImage { width, height, pixels, sky })
    }

    /// Right, up and forward of the view, unit length.
    fn frame(&self) -> [DVec3; 3] {
        let forward = (self.target - self.eye).normalize();
        let up = self.up.normalize();
        // Another direction than up where the view is along it. Plain choice.
        let is_along = |cosine: f64| cosine.abs() > 0.9999;
        let vertical = if !is_along(forward.dot(up)) {
            up
        } else if is_along(up.y) {
            DVec3::NEG_Z
        } else {
            DVec3::Y
        };
        let right = forward.cross(vertical).normalize();
        [right, right.cross(forward), forward]
    }

    /// Whether [`Camera::image`] would accept these settings, to be checked before a long solve.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] for a size of 0 or above 32768, no samples, a field of view outside
    /// (0, 180), an eye that is not finite or is the target itself, or no direction up.
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
        if !self.up.is_finite() || self.up.try_normalize().is_none() {
            return bad(format!("up {}", self.up), "give a direction that is not zero");
        }
        Ok(())
    }
}

/// The first surface or sky along a ray.
enum Seen {
    Front(Hit),
    /// In this direction, unit length.
    Sky(DVec3),
}

/// The primary rays through the pixels of an image, and the surface that they hit.
struct PrimaryRays<'a> {
    surface: &'a VertexMesh,
    /// The mesh whose elements its faces are, if given: hits are on triangles of its scene then,
    /// otherwise on faces.
    mesh: Option<&'a Mesh>,
    met: Arc<RayScene>,
    eye: DVec3,
    /// Direction to the upper left corner of the image, at distance 1 along the view's axis.
    corner: DVec3,
    /// Unit direction of the view's axis.
    forward: DVec3,
    /// Steps of one sub-pixel to the right and downwards, at distance 1.
    right: DVec3,
    down: DVec3,
    /// Pixels in a row.
    width: u32,
    /// Rays along a pixel's side.
    samples: u32,
    /// Weight of each ray in its pixel: 1 / samples².
    weight: f64,
}

impl PrimaryRays<'_> {
    fn new<'a>(
        camera: &Camera,
        surface: &'a VertexMesh,
        mesh: Option<&'a Mesh>,
        width: u32,
        height: u32,
        samples: u32,
    ) -> Result<PrimaryRays<'a>, Error> {
        camera.check(width, height, samples)?;
        let corners = |f: &[u32; 3]| f.map(|v| surface.positions[v as usize]);
        let met = match mesh {
            Some(mesh) => RayScene::with_clear(mesh.scene()),
            None => Arc::new(RayScene::new(surface.faces.iter().map(corners))),
        };
        let [right, up, forward] = camera.frame();
        let tangent = libm::tan(camera.vertical_fov.to_radians() / 2.0);
        let step = 2.0 * tangent / f64::from(height) / f64::from(samples);
        let (right, down) = (right * step, -up * step);
        let half = |pixels: u32| f64::from(pixels) * f64::from(samples) / 2.0;
        let corner = forward - right * half(width) - down * half(height);
        let weight = 1.0 / f64::from(samples * samples);
        Ok(PrimaryRays {
            surface,
            mesh,
            met,
            eye: camera.eye,
            corner,
            forward,
            right,
            down,
            width,
            samples,
            weight,
        })
    }

    /// Ranges of the first `pixels` pixels, in order, with about `rays` primary rays each.
    fn bands(&self, pixels: u32, rays: u32) -> impl Iterator<Item = Range<u32>> + use<> {
        let band = (rays / (self.samples * self.samples)).max(1);
        let end = move |start: u32| start.saturating_add(band).min(pixels);
        (0..pixels).step_by(band as usize).map(move |start| start..end(start))
    }

    /// Radiance of these pixels from the radiosity (W/m²) at their hits, and whether all rays see
    /// the sky.
    fn pixels<'b>(
        &'b self,
        range: Range<u32>,
        radiosity: &'b (impl Fn(&Hit) -> Rgb + Sync),
    ) -> impl IndexedParallelIterator<Item = (Rgb, bool)> + 'b {
        range.into_par_iter().map(move |k| {
            let (mut sum, mut is_sky) = (Rgb::ZERO, true);
            let mut count = 0;
            for seen in self.seen(k) {
                count += 1;
                sum += match seen {
                    Seen::Front(hit) => {
                        is_sky = false;
                        radiosity(&hit) / PI
                    }
                    Seen::Sky(direction) => self.surface.sky.radiance(direction),
                };
            }
            (sum * self.weight, is_sky && count == self.samples * self.samples)
        })
    }

    /// First hits of the rays of pixel `k`, or the sky. Rays that hit backs are left out.
    fn seen(&self, k: u32) -> impl Iterator<Item = Seen> {
        self.directions(k).filter_map(|direction| self.hit(direction))
    }

    /// Directions of the rays of pixel `k`, of any length.
    fn directions(&self, k: u32) -> impl Iterator<Item = DVec3> {
        let n = self.samples;
        // Middle of row or column k of an n × n grid within a sub-pixel.
        let middle = move |k: u32| (f64::from(k) + 0.5) / f64::from(n);
        (0..n * n).map(move |s| {
            let (i, j) = (s % n, s / n);
            let x = f64::from(k % self.width * n + i) + middle(j);
            let y = f64::from(k / self.width * n + j) + middle(n - 1 - i);
            self.corner + self.right * x + self.down * y
        })
    }

    /// The first front hit along `direction`, or the sky; none if a back is hit first and no front
    /// coincides with it.
    fn hit(&self, direction: DVec3) -> Option<Seen> {
        let Some(first) = self.met.closest_hit(self.eye, direction, 0.0, None) else {
            return Some(Seen::Sky(direction.normalize()));
        };
        if first.front {
            return Some(Seen::Front(first));
        }
        let is_front = |hit: &Hit| hit.front;
        let front = self.met.closest_hit_of(self.eye, direction, 0.0, None, is_front)?;
        (front.distance <= first.distance * (1.0 + COINCIDENCE_TOLERANCE))
            .then_some(Seen::Front(front))
    }

    /// Values at the surface's vertices, interpolated linearly to a hit.
    fn interpolate(&self, hit: &Hit, values: &[DVec3]) -> DVec3 {
        let weights = [hit.u, hit.v];
        let place = match self.mesh {
            Some(mesh) => self.surface.face_at(mesh, hit.triangle, weights),
            None => Some(FacePlace { face: hit.triangle, weights }),
        };
        place.map_or(DVec3::ZERO, |place| self.surface.value_at(&place, values))
    }
}
