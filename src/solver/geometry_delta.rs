//! Differences between two scenes of the same triangles, and the part of a row that they affect.
//!
//! Each group of moved triangles is enclosed in two boxes: the old and the new position. The error
//! of a row whose own patch did not move is bounded by the sum of
//!
//! - the light sent to the old position: the row's own entries on the moved triangles, or the form
//!   factor of the old boxes, whichever is less;
//! - the light sent to the new position: the form factor of each new box × the fraction of it that
//!   is visible from the patch, estimated with a few rays.

use std::sync::Arc;

use glam::DVec3;

use crate::error::{Error, ErrorKind};
use crate::form_factor::Row;
use crate::form_factor::closed_form::point_to_polygon;
use crate::geometry::aabb::Aabb;
use crate::geometry::barycentric::WHOLE;
use crate::mesh::{Mesh, NodeId};
use crate::scene::{Rgb, Scene};
use crate::visibility::offset;
use crate::visibility::ray_scene::{Hit, RayScene};

/// Differences between two meshes.
pub(super) struct GeometryDelta {
    /// Whether each triangle has moved, or has another transmittance.
    has_moved: Vec<bool>,
    /// Whether any moved triangle is a clear pane; rows have no entries on panes.
    has_moved_panes: bool,
    /// Boxes about the moved triangles of each group that has any.
    groups: Vec<MovedBox>,
    /// The new scene; `None` where nothing has moved.
    rays: Option<Arc<RayScene>>,
}

/// Old and new bounding box of moved triangles.
struct MovedBox {
    before: Aabb,
    after: Aabb,
}

impl GeometryDelta {
    /// The differences between `old` and `new`.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`] when the elements of the two are not the same.
    pub fn between(old: &Mesh, new: &Mesh) -> Result<GeometryDelta, Error> {
        if !old.has_elements_of(new) {
            let found = format!("{} elements, for {}", new.element_count(), old.element_count());
            let remedy = "make it of the mesh before by Mesh::with_scene";
            return Err(Error::new(ErrorKind::Scene, "changed mesh", found, remedy));
        }
        let (before, after) = (old.scene(), new.scene());
        let count = before.triangles().len();
        let has_moved: Vec<bool> = (0..count)
            .map(|t| {
                before.corners(t) != after.corners(t)
                    || share_passing(before, t) != share_passing(after, t)
                    || !before.has_no_other_holes(t, (after, t), WHOLE)
                    || !after.has_no_other_holes(t, (before, t), WHOLE)
            })
            .collect();
        let is_pane = |t: usize| before.is_clear(t) || after.is_clear(t);
        let has_moved_panes = (0..count).any(|t| has_moved[t] && is_pane(t));
        let mut groups: Vec<MovedBox> = (0..before.groups().len())
            .map(|_| MovedBox { before: Aabb::EMPTY, after: Aabb::EMPTY })
            .collect();
        for t in (0..count).filter(|&t| has_moved[t]) {
            let group = &mut groups[before.triangles()[t].group as usize];
            group.before = group.before.union(Aabb::from_points(before.corners(t)));
            group.after = group.after.union(Aabb::from_points(after.corners(t)));
        }
        groups.retain(|group| group.before.low.is_finite());
        let rays = (!groups.is_empty()).then(|| RayScene::of_scene(after));
        Ok(GeometryDelta { has_moved, has_moved_panes, groups, rays })
    }

    /// Whether nothing has moved.
    pub fn is_empty(&self) -> bool {
        self.groups.is_empty()
    }

    /// Upper bound of the share of the light of `patch` that no longer goes along its old `row`,
    /// which need not be known; `mesh` is the old one.
    pub fn affected_fraction(&self, mesh: &Mesh, patch: NodeId, row: Option<&Row>) -> f64 {
        if self.has_moved[mesh.triangle(patch)] {
            return 1.0;
        }
        let (eye, normal) = (mesh.centroid(patch), mesh.normal(patch));
        let row = row.filter(|_| !self.has_moved_panes);
        let sent_before = row.map_or(1.0, |row| self.share_on_moved(mesh, row));
        let boxes_before: f64 =
            self.groups.iter().map(|g| form_factor_to(&g.before, eye, normal)).sum();
        let boxes_after: f64 = self
            .groups
            .iter()
            .map(|group| match form_factor_to(&group.after, eye, normal) {
                0.0 => 0.0,
                factor => factor * self.visible_fraction(eye, group.after),
            })
            .sum();
        (sent_before.min(boxes_before) + boxes_after).min(1.0)
    }

    /// Share of `row` on the fronts of moved triangles, and on any back faces, which may be theirs.
    fn share_on_moved(&self, mesh: &Mesh, row: &Row) -> f64 {
        let is_moved = |e: u32| self.has_moved[mesh.triangle(mesh.element(e as usize))];
        let entries = row.entries.iter().filter(|entry| is_moved(entry.element));
        entries.map(|entry| Row::form_factor(entry.share)).sum::<f64>()
            + Row::form_factor(row.backface)
    }

    /// Fraction of `bounds` that unmoved geometry leaves visible from `eye`, by rays to the middle
    /// and half-way to the corners: (open + 1)/(rays + 1), never 0, since rays may miss a gap.
    fn visible_fraction(&self, eye: DVec3, bounds: Aabb) -> f64 {
        let Some(rays) = &self.rays else { return 1.0 };
        let middle = bounds.centre();
        let corners = bounds.corners().map(|corner| middle + (corner - middle) / 2.0);
        let targets = || corners.iter().chain([&middle]);
        let blocks = |hit: &Hit| !self.has_moved[hit.triangle];
        let is_open =
            |target: &&DVec3| !rays.occluded(eye, **target - eye, offset::RAY_START..1.0, blocks);
        (targets().filter(is_open).count() + 1) as f64 / (targets().count() + 1) as f64
    }
}

/// Transmittance of triangle `t` of `scene` if it is a clear pane.
fn share_passing(scene: &Scene, t: usize) -> Option<Rgb> {
    scene.clear_panes()?.transmittance(t)
}

/// Unoccluded form factor from a point `eye` with that `normal` to `bounds`; 1 from inside.
fn form_factor_to(bounds: &Aabb, eye: DVec3, normal: DVec3) -> f64 {
    if bounds.contains(eye) {
        return 1.0;
    }
    let corners = bounds.corners();
    let to_face = |face: &[usize; 4]| point_to_polygon(eye, normal, &face.map(|k| corners[k]));
    // Faces that are turned away contribute 0.
    Aabb::FACES.iter().map(to_face).sum::<f64>().min(1.0)
}
