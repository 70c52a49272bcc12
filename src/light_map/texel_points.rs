//! The point of a surface at which a texel gathers.

use glam::{DVec2, DVec3};

use super::atlas::Atlas;
use super::coverage::nearest_point;
use crate::gather::gather_points::SurfaceOffset;
use crate::gather::two_sided::TwoSidedPoint;

/// Gather points of the texels of an atlas.
pub(super) struct TexelPoints<'a> {
    atlas: &'a Atlas,
    /// [`Atlas::corner_normals`].
    normals: Vec<[DVec3; 3]>,
    offset: SurfaceOffset,
}

impl<'a> TexelPoints<'a> {
    pub fn new(atlas: &'a Atlas) -> TexelPoints<'a> {
        let offset = SurfaceOffset::new(atlas.scene());
        TexelPoints { atlas, normals: atlas.corner_normals(), offset }
    }

    /// The gather point of texel `texel` on triangle `t`: the point of it nearest to the texel's
    /// centre, moved slightly inside.
    pub fn point(&self, texel: u32, t: usize) -> TwoSidedPoint {
        let (scene, width) = (self.atlas.scene(), self.atlas.width());
        let positions = self.atlas.corners(t);
        let centre = DVec2::new((texel % width).into(), (texel / width).into());
        let ([u, v], _) = nearest_point(positions, centre);
        let corners = scene.corners(t);
        let at = |u: f64, v: f64| corners[0] * (1.0 - u - v) + corners[1] * u + corners[2] * v;
        let size = self.texel_size(t);
        // Moved towards the centroid, by the fraction of the way that keeps the weights of all
        // corners above a third of it.
        let to_centroid = (corners.iter().sum::<DVec3>() / 3.0).distance(at(u, v));
        // On the sides themselves visibility is undefined, as for vertices. Plain choice.
        let share = (0.02 * size / to_centroid).clamp(0.0, 1.0);
        let is_near = 3.0 * u.min(v).min(1.0 - u - v) < share;
        let share = if is_near { share } else { 0.0 };
        let [u, v] = [u, v].map(|weight| weight + (1.0 / 3.0 - weight) * share);
        let [a, b, c] = self.normals[t];
        let normal = (a * (1.0 - u - v) + b * u + c * v).normalize_or(scene.normal(t));
        let point = self.offset.gather_point(at(u, v), normal, size);
        TwoSidedPoint::new(point, scene.material(t))
    }

    /// Edge of a texel on triangle `t`, scene unit: the triangle's own size if that is less.
    pub fn texel_size(&self, t: usize) -> f64 {
        let [a, b, c] = self.atlas.corners(t);
        let texels = (b - a).perp_dot(c - a).abs() / 2.0;
        (self.atlas.scene().area(t) / texels.max(1.0)).sqrt()
    }
}
