//! What a patch sees: item buffers, hemicubes, and rows of form factors from them.

use std::f64::consts::PI;

use glam::DVec3;
use radiosity::hemicube::delta_form_factors;
use radiosity::mesh::NodeId;
use radiosity::{Camera, Mesh, Rgb, VertexMesh};

use crate::Result;

/// Number of the element that a pixel sees; none for the back of one, or nothing.
pub type Item = Option<usize>;

/// The item buffer of a square view: what each pixel sees first, through its middle, row by row
/// from the top.
pub fn item_buffer(camera: &Camera, mesh: &Mesh, side: u32) -> Result<Vec<Item>> {
    // The picture of a mesh whose elements shine by their numbers.
    let numbers = (1..=mesh.element_count()).map(|number| Rgb::splat(number as f64));
    let surface = VertexMesh::per_element(mesh, &numbers.collect::<Vec<_>>());
    let image = camera.image(&surface, side, side, 1)?;
    let item = |radiance: &Rgb| ((PI * radiance.x).round() as usize).checked_sub(1);
    Ok(image.pixels.iter().map(item).collect())
}

/// The item buffer of a hemicube (Cohen and Greenberg 1985), unfolded: its top in the middle, its
/// sides around that, down to the horizon. Nothing is in the four corners.
pub struct Hemicube {
    /// Pixels along an edge of the top; twice as many along one of all.
    pub resolution: u32,
    pub items: Vec<Item>,
}

impl Hemicube {
    /// Over the centroid of `patch`, a part of a wall: up in the room is up in the picture.
    pub fn new(mesh: &Mesh, patch: NodeId, resolution: u32) -> Result<Hemicube> {
        let normal = mesh.normal(patch);
        let up = DVec3::Y.reject_from(normal).normalize();
        let right = normal.cross(up);
        // Each face is what a camera sees that looks through it and is held so that its picture
        // joins that of the top.
        let faces = [
            (normal, up, [0, 0]),
            (right, up, [1, 0]),
            (-right, up, [-1, 0]),
            (up, -normal, [0, -1]),
            (-up, normal, [0, 1]),
        ];
        // So little off the patch that it does not get in the way.
        let eye = mesh.centroid(patch) + 1e-6 * mesh.longest_edge(patch) * normal;
        let n = resolution as i32;
        let mut items = vec![None; 4 * (n * n) as usize];
        for (forward, up, [column, row]) in faces {
            let camera = Camera { eye, target: eye + forward, up, vertical_fov: 90.0 };
            for (k, item) in (0..).zip(item_buffer(&camera, mesh, resolution)?) {
                let (x, y) = (n / 2 + column * n + k % n, n / 2 + row * n + k / n);
                // What is left out is below the horizon.
                if (0..2 * n).contains(&x) && (0..2 * n).contains(&y) {
                    items[(y * 2 * n + x) as usize] = item;
                }
            }
        }
        Ok(Hemicube { resolution, items })
    }

    /// Index of pixel `k`'s delta form factor, as the library lists them: those of the top, then
    /// those of a side from the top down. None in the corners.
    pub fn delta_index(&self, k: usize) -> Option<usize> {
        let n = self.resolution as usize;
        let (x, y) = (k % (2 * n), k / (2 * n));
        // Pixels from the top face to the horizon side of it, if outside.
        let outside = |at: usize| (n / 2).saturating_sub(at) + (at + 1).saturating_sub(n + n / 2);
        match (outside(x), outside(y)) {
            (0, 0) => Some((y - n / 2) * n + x - n / 2),
            (0, down) => Some((n + down - 1) * n + x - n / 2),
            (down, 0) => Some((n + down - 1) * n + y - n / 2),
            _ => None,
        }
    }

    /// The row of form factors from the patch to all elements: of each the sum of the delta form
    /// factors of the pixels that see it.
    pub fn row(&self, mesh: &Mesh) -> Result<Vec<f64>> {
        let deltas = delta_form_factors(self.resolution)?;
        let mut row = vec![0.0; mesh.element_count()];
        for (k, item) in self.items.iter().enumerate() {
            if let (Some(element), Some(delta)) = (item, self.delta_index(k)) {
                row[*element] += deltas[delta];
            }
        }
        Ok(row)
    }
}
