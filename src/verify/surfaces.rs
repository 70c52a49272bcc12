//! Random points of the surfaces that reflect, group by group.

use fastrand::Rng;
use glam::DVec3;

use super::path_tracer::{SurfacePoint, random_point};
use crate::error::{Error, ErrorKind};
use crate::scene::Scene;

/// The part of a group that reflects.
pub(super) struct ReflectingGroup {
    /// Index of the group in the scene.
    pub group: usize,
    /// Area that reflects, as a share of that of the scene.
    pub share: f64,
    /// Triangles, and the area of each with those before it.
    areas: Vec<(usize, f64)>,
}

impl ReflectingGroup {
    /// Those of `scene` that reflect anything.
    pub fn all(scene: &Scene) -> Result<Vec<ReflectingGroup>, Error> {
        let mut areas: Vec<Vec<(usize, f64)>> = vec![vec![]; scene.groups().len()];
        for (t, triangle) in scene.triangles().iter().enumerate() {
            if scene.material(t).scatters() && scene.solid_area(t) > 0.0 {
                let list = &mut areas[triangle.group as usize];
                let before = list.last().map_or(0.0, |&(_, sum)| sum);
                list.push((t, before + scene.solid_area(t)));
            }
        }
        let whole = |areas: &[(usize, f64)]| areas.last().map_or(0.0, |&(_, sum)| sum);
        let total: f64 = areas.iter().map(|areas| whole(areas)).sum();
        let wrong = |found, remedy| Err(Error::new(ErrorKind::Scene, "materials", found, remedy));
        if total == 0.0 {
            return wrong("none that is used reflects", "give one a reflectance above 0");
        }
        if !scene.has_emitter() && !scene.has_light_of_no_surface() {
            return wrong("none that is used emits", "give one an exitance above 0, or a sky");
        }
        let group = |(group, areas): (usize, Vec<(usize, f64)>)| {
            let share = whole(&areas) / total;
            (share > 0.0).then_some(ReflectingGroup { group, share, areas })
        };
        Ok(areas.into_iter().enumerate().filter_map(group).collect())
    }

    /// A point at random, uniform over the area that reflects.
    pub fn point(&self, scene: &Scene, rng: &mut Rng) -> SurfacePoint {
        let (last, whole) = self.areas[self.areas.len() - 1];
        let at = rng.f64() * whole;
        let k = self.areas.partition_point(|&(_, sum)| sum <= at);
        let triangle = self.areas.get(k).map_or(last, |&(t, _)| t);
        let position: DVec3 = random_point(scene, triangle, rng);
        SurfacePoint { triangle, position }
    }
}
