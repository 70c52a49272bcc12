//! Where vertices, and whoever else gathers, stand.

use glam::DVec3;

use super::keys::Vertices;
use crate::gather::{GatherPoint, IrradianceSample};
use crate::mesh::Mesh;
use crate::scene::{Rgb, Scene};
use crate::visibility::{buried, offset};

/// The elements around every vertex, and what they say of it.
pub(super) struct VertexGatherPoints<'a> {
    mesh: &'a Mesh,
    vertices: &'a Vertices,
    /// Elements with each vertex on their rim: from `first[v]` to `first[v + 1]`.
    around: Vec<u32>,
    first: Vec<u32>,
    normals: Vec<DVec3>,
    /// Square root of the smallest element's area around each vertex, scene unit.
    sizes: Vec<f64>,
    above: SurfaceOffset,
}

/// Where places are: above the surfaces of one scene.
pub(crate) struct SurfaceOffset {
    /// No place is nearer to its surface than this, scene unit: many steps of its coordinates.
    least: f64,
}

/// How far into an element a vertex steps, of the way to its centroid: off the seams where surfaces
/// meet, whose two sides see different things.
const INWARDS: f64 = 0.02;

/// Elements around a vertex that it tries to stand in, at most.
const ATTEMPTS: usize = 6;

impl<'a> VertexGatherPoints<'a> {
    pub fn new(mesh: &'a Mesh, vertices: &'a Vertices) -> VertexGatherPoints<'a> {
        let count = vertices.positions.len();
        let mut first = vec![0u32; count + 1];
        let rims = || vertices.rims.iter();
        rims().for_each(|(_, rim)| rim.iter().for_each(|&v| first[v as usize + 1] += 1));
        (0..count).for_each(|v| first[v + 1] += first[v]);
        let mut next = first.clone();
        let mut around = vec![0; first[count] as usize];
        let mut normals = vec![DVec3::ZERO; count];
        let mut sizes = vec![f64::INFINITY; count];
        for (e, rim) in rims() {
            let node = mesh.element(e);
            let area = mesh.area(node);
            for v in rim.iter().map(|&v| v as usize) {
                around[next[v] as usize] = e as u32;
                next[v] += 1;
                normals[v] += mesh.normal(node) * area;
                sizes[v] = sizes[v].min(area.sqrt());
            }
        }
        normals.iter_mut().for_each(|n| *n = n.normalize_or(DVec3::Z));
        let above = SurfaceOffset::new(mesh.scene());
        VertexGatherPoints { mesh, vertices, around, first, normals, sizes, above }
    }

    fn around(&self, v: u32) -> &[u32] {
        let v = v as usize;
        &self.around[self.first[v] as usize..self.first[v + 1] as usize]
    }

    /// Reflectance of the surface that vertex `v` is on.
    pub fn reflectance(&self, v: u32) -> Rgb {
        self.mesh.material(self.mesh.element(self.around(v)[0] as usize)).reflectance
    }

    /// Where vertex `v` stands at its `attempt`: in another element around it each time.
    pub fn place(&self, v: u32, attempt: usize) -> GatherPoint {
        let around = self.around(v);
        let step = around.len().div_ceil(ATTEMPTS);
        let element = self.mesh.element(around[attempt * step % around.len()] as usize);
        let (position, normal) = (self.vertices.positions[v as usize], self.normals[v as usize]);
        let inwards = (self.mesh.centroid(element) - position) * INWARDS;
        self.above.place(position + inwards, normal, self.sizes[v as usize])
    }

    /// Whether there is another element to stand in after `attempt`.
    pub fn has_more(&self, v: u32, attempt: usize) -> bool {
        let around = self.around(v).len();
        attempt + 1 < around.div_ceil(around.div_ceil(ATTEMPTS))
    }

    /// Whether vertex `v` found that it is covered.
    pub fn is_covered(&self, v: u32, found: &IrradianceSample) -> bool {
        is_covered(found, self.sizes[v as usize])
    }
}

impl SurfaceOffset {
    pub fn new(scene: &Scene) -> SurfaceOffset {
        SurfaceOffset { least: offset::MIN_LIFT_ULPS * scene.coordinate_ulp() }
    }

    /// The place above `position`, where elements are of `size`: the square root of their area, scene
    /// unit.
    pub fn place(&self, position: DVec3, normal: DVec3, size: f64) -> GatherPoint {
        let lift = (offset::SURFACE_LIFT * size).max(self.least);
        GatherPoint {
            position: position + normal * lift,
            normal,
            near: lift * offset::NEAR_OF_LIFT,
        }
    }
}

/// Whether what was found is the inside of something that touches the surface: backs almost
/// everywhere, nearer than the elements are large (the square root of their area is `size`), or
/// nothing else at all.
pub(crate) fn is_covered(found: &IrradianceSample, size: f64) -> bool {
    found.backface > buried::BURIED
        && (found.inverse_distance * size > 1.0 || found.backface > buried::INSIDE)
}
