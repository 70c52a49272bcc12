//! Gather points of vertices, and of other points on surfaces.
//!
//! A vertex lies where elements meet, often in an edge or corner of the scene, where what is seen
//! is undefined. So it gathers from a point next to it: a small step towards the centroid of one of
//! its elements, and a smaller one along the normal.
//!
//! ```text
//!       ●  gather point: SURFACE_LIFT · size above the element
//!       │
//!   v───┼────── element ──────      │v → ·│ = 0.02 · distance to the centroid
//! ```

use glam::DVec3;

use super::two_sided::TwoSidedPoint;
use super::{GatherPoint, IrradianceSample};
use crate::accuracy::hidden::Outlook;
use crate::geometry::incidence::Incidence;
use crate::mesh::{Mesh, NodeId};
use crate::scene::{Material, Rgb, Scene, Sky};
use crate::vertex::keys::Vertices;
use crate::visibility::{buried, offset};

/// The elements around every vertex, and the gather points that follow from them.
pub(super) struct VertexGatherPoints<'a> {
    mesh: &'a Mesh,
    vertices: &'a Vertices,
    /// Elements with each vertex on their outline.
    around: Incidence,
    offset: SurfaceOffset,
    touching: f64,
}

/// How far gather points of a scene lie above its surfaces.
pub(crate) struct SurfaceOffset {
    /// Least distance, scene unit: far above the rounding of coordinates.
    min_offset: f64,
}

/// Maximum number of elements around a vertex in which a gather point is tried.
const MAX_ATTEMPTS: usize = 6;

impl<'a> VertexGatherPoints<'a> {
    /// For the `vertices` of `mesh`; surfaces nearer than `touching` (scene unit) touch.
    pub fn new(mesh: &'a Mesh, vertices: &'a Vertices, touching: f64) -> VertexGatherPoints<'a> {
        let count = vertices.positions.len();
        let around = Incidence::new(count, || vertices.outlines.iter());
        let offset = SurfaceOffset::new(mesh.scene());
        VertexGatherPoints { mesh, vertices, around, offset, touching }
    }

    fn around(&self, v: u32) -> &[u32] {
        self.around.at(v)
    }

    fn nodes_around(&self, v: u32) -> impl Iterator<Item = NodeId> + '_ {
        self.around(v).iter().map(|&e| self.mesh.element(e as usize))
    }

    /// Unit normal at vertex `v`, weighted by area over the elements around it.
    fn normal(&self, v: u32) -> DVec3 {
        let weighted = |node| self.mesh.normal(node) * self.mesh.area(node);
        self.nodes_around(v).map(weighted).sum::<DVec3>().normalize_or(DVec3::Z)
    }

    /// Square root of the smallest element's area around vertex `v`, scene unit.
    fn size(&self, v: u32) -> f64 {
        self.nodes_around(v).map(|node| self.mesh.area(node).sqrt()).fold(f64::INFINITY, f64::min)
    }

    /// Albedo of the surface that vertex `v` is on; 0 where holes are all around it.
    pub fn albedo(&self, v: u32) -> Rgb {
        if self.is_solid(v) { self.material(v).albedo() } else { Rgb::ZERO }
    }

    /// Index of the material of the surface that vertex `v` is on; none where holes are all around.
    pub fn material_index(&self, v: u32) -> Option<u32> {
        let element = self.mesh.element(self.around(v)[0] as usize);
        let material = self.mesh.scene().triangles()[self.mesh.triangle(element)].material;
        self.is_solid(v).then_some(material)
    }

    /// Whether light comes through the surface that vertex `v` is on.
    pub fn is_translucent(&self, v: u32) -> bool {
        self.material(v).is_translucent()
    }

    fn is_solid(&self, v: u32) -> bool {
        self.nodes_around(v).any(|node| self.mesh.solid_share(node) > 0.0)
    }

    fn material(&self, v: u32) -> &Material {
        self.mesh.material(self.mesh.element(self.around(v)[0] as usize))
    }

    /// The gather point of vertex `v` at its `attempt`: in another element around it each time.
    pub fn point(&self, v: u32, attempt: usize) -> TwoSidedPoint {
        self.point_beside(v, 0.02 * self.to_centroid(v, attempt))
    }

    /// The same as near to the vertex as where light is the same, ten times as far from what else
    /// meets there as from the surface: for elements that are large beside changes of light.
    pub fn nearest_point(&self, v: u32, attempt: usize) -> TwoSidedPoint {
        let (inward, least) = (self.to_centroid(v, attempt), 10.0 * self.offset.min_offset);
        let inset = (10.0 * offset::SURFACE_LIFT * self.size(v)).max(least);
        self.point_beside(v, inward.clamp_length_max(inset))
    }

    /// From vertex `v` to the centroid of the element of `attempt`.
    fn to_centroid(&self, v: u32, attempt: usize) -> DVec3 {
        let around = self.around(v);
        let step = around.len().div_ceil(MAX_ATTEMPTS);
        let element = self.mesh.element(around[attempt * step % around.len()] as usize);
        self.mesh.centroid(element) - self.position(v)
    }

    fn point_beside(&self, v: u32, inset: DVec3) -> TwoSidedPoint {
        let (normal, size) = (self.normal(v), self.size(v));
        let point = self.offset.gather_point(self.position(v) + inset, normal, size);
        TwoSidedPoint::new(point, self.material(v))
    }

    /// Whether vertex `v` has another gather point after that of `attempt`.
    pub fn has_more(&self, v: u32, attempt: usize) -> bool {
        let around = self.around(v).len();
        attempt + 1 < around.div_ceil(around.div_ceil(MAX_ATTEMPTS))
    }

    /// Position of vertex `v`.
    pub fn position(&self, v: u32) -> DVec3 {
        self.vertices.positions[v as usize]
    }

    /// What vertex `v` sees by `sample`.
    pub fn outlook(&self, v: u32, sample: &IrradianceSample) -> Outlook {
        outlook([sample; 2], self.normal(v), self.mesh.scene().sky())
    }

    /// Whether `sample`, gathered for vertex `v`, is that of a buried point.
    pub fn is_buried(&self, v: u32, sample: &IrradianceSample) -> bool {
        self.sees_inside(v, sample.backface, sample.inverse_distance)
    }

    /// The same by the form factor of the backs that were seen, and the mean of 1/distance.
    pub fn sees_inside(&self, v: u32, backface: f64, inverse_distance: f64) -> bool {
        let sample = IrradianceSample { backface, inverse_distance, ..Default::default() };
        is_buried(&sample, self.size(v).min(self.touching))
    }
}

impl GatherPoint {
    /// The gather point at `position`, on a surface of `scene` or in the air, that sees what is
    /// above unit `normal`. It is raised a little, by 1e-4 of `size`: the length across what it
    /// stands for, as an edge of a texel or the distance between points (scene unit).
    pub fn above(scene: &Scene, position: DVec3, normal: DVec3, size: f64) -> GatherPoint {
        SurfaceOffset::new(scene).gather_point(position, normal, size)
    }
}

impl SurfaceOffset {
    pub fn new(scene: &Scene) -> SurfaceOffset {
        SurfaceOffset { min_offset: offset::min_lift(scene) }
    }

    /// The gather point above the viewpoint of `node`.
    pub fn above_element(&self, mesh: &Mesh, node: NodeId) -> GatherPoint {
        self.gather_point(mesh.viewpoint(node), mesh.normal(node), mesh.area(node).sqrt())
    }

    /// The gather point above `position` on a surface with elements of `size`: the square root of
    /// their area, scene unit.
    pub fn gather_point(&self, position: DVec3, normal: DVec3, size: f64) -> GatherPoint {
        let height = (offset::SURFACE_LIFT * size).max(self.min_offset);
        GatherPoint {
            position: position + normal * height,
            normal,
            near: height * offset::NEAR_OF_LIFT,
        }
    }
}

/// What a point on a surface of `normal` sees under `sky`, by two gathers.
pub(crate) fn outlook(gathers: [&IrradianceSample; 2], normal: DVec3, sky: &Sky) -> Outlook {
    let mean = |of: &dyn Fn(&IrradianceSample) -> f64| gathers.map(of).iter().sum::<f64>() / 2.0;
    // Of either side: through a translucent surface, too.
    let sun = sky.sun().and_then(|sun| sun.unoccluded(sun.direction.normalize().dot(normal).abs()));
    let of_lamps = |gathered: &IrradianceSample| {
        let lamps = (gathered.direct - sun.unwrap_or_default()).max(Rgb::ZERO).length();
        if lamps > 0.0 { lamps / gathered.irradiance.length() } else { 0.0 }
    };
    Outlook {
        covered: 1.0 - mean(&|gathered| gathered.escaped),
        lamps: mean(&of_lamps),
        backs: mean(&|gathered| gathered.backface),
        inverse_distance: mean(&|gathered| gathered.inverse_distance),
        dark: false,
    }
}

/// Whether a point lies inside something that touches its surface: it sees almost nothing but
/// backs, and those nearer than `touching` (scene unit); or nothing else at all.
pub(crate) fn is_buried(sample: &IrradianceSample, touching: f64) -> bool {
    let is_near = sample.inverse_distance * touching > 1.0;
    sample.backface > buried::BURIED && (is_near || sample.backface > buried::INSIDE)
}
