//! A triangle of a surface, and where on it a point lies.

use glam::DVec3;
use radiosity::{Rgb, VertexMesh};

/// Cosine of the largest angle between a point's normal and that of a face it may lie on: 37°, as
/// far as normals are smoothed.
const SAME_SIDE: f64 = 0.8;

/// A triangle with the radiosity of its corners.
pub struct Face {
    pub corners: [DVec3; 3],
    radiosity: [Rgb; 3],
    /// As long as twice the area.
    normal: DVec3,
}

/// Where a point lies on a face.
pub struct Location {
    /// How far off the face the point is, scene unit.
    pub distance: f64,
    pub radiosity: Rgb,
}

impl Face {
    pub fn new(surface: &VertexMesh, face: &[u32; 3]) -> Face {
        let corners = face.map(|v| surface.positions[v as usize]);
        let radiosity = face.map(|v| surface.radiosity[v as usize]);
        let [a, b, c] = corners;
        Face { corners, radiosity, normal: (b - a).cross(c - a) }
    }

    pub fn area(&self) -> f64 {
        self.normal.length() / 2.0
    }

    pub fn unit_normal(&self) -> DVec3 {
        self.normal.normalize_or_zero()
    }

    pub fn position(&self, u: f64, v: f64) -> DVec3 {
        interpolate(self.corners, u, v)
    }

    pub fn radiosity(&self, u: f64, v: f64) -> Rgb {
        interpolate(self.radiosity, u, v)
    }

    /// Where `point` lies on the face; none if `normal` points elsewhere than the face does.
    pub fn locate(&self, point: DVec3, normal: DVec3) -> Option<Location> {
        let (unit, twice_area) = (self.unit_normal(), self.normal.length());
        if unit.dot(normal) < SAME_SIDE {
            return None;
        }
        let [a, b, c] = self.corners;
        let d = point - a;
        let u = d.cross(c - a).dot(unit) / twice_area;
        let v = (b - a).cross(d).dot(unit) / twice_area;
        let beyond = (-u).max(-v).max(u + v - 1.0).max(0.0);
        let distance = beyond * twice_area.sqrt() + d.dot(unit).abs();
        Some(Location { distance, radiosity: self.radiosity(u, v) })
    }
}

fn interpolate([a, b, c]: [DVec3; 3], u: f64, v: f64) -> DVec3 {
    a * (1.0 - u - v) + b * u + c * v
}
