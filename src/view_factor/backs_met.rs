//! Whose backs a group sees, by rays: for messages.

use super::ray_rows::{Half, RayCaster};
use super::scene_polygons::ScenePolygons;
use crate::error::{Error, ErrorKind};
use crate::scene::Scene;

/// Rays from all polygons of a group together: one in a thousand is 65 of them. Plain choice.
const RAYS: usize = 1 << 16;

/// Fewest rays from a polygon. Plain choice.
const MIN_RAYS: usize = 16;

/// A group whose back is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BackMet {
    /// Index of the group.
    pub group: usize,
    /// Share of the flux of the other that arrives at its back.
    pub share: f64,
}

/// The groups at whose backs flux of row `from` arrives, the largest share first; in a matrix with
/// these `two_sided` groups.
///
/// # Errors
/// [`ErrorKind::Setting`] when a group or the row does not exist.
pub fn backs_met(scene: &Scene, two_sided: &[usize], from: usize) -> Result<Vec<BackMet>, Error> {
    super::check_two_sided(scene, two_sided)?;
    let ScenePolygons { unit, fronts, blocker_of_triangle, .. } =
        ScenePolygons::new(scene, two_sided);
    if from >= fronts.rows.count() {
        let remedy = format!("the matrix has {} rows", fronts.rows.count());
        return Err(Error::new(ErrorKind::Setting, "row", from.to_string(), remedy));
    }
    let caster = RayCaster::new(scene, unit, &fronts, blocker_of_triangle);
    let polygons: Vec<u32> =
        (0..fronts.polygons.len() as u32).filter(|&s| fronts.group(s) == from).collect();
    let rays = (RAYS / polygons.len().max(1)).max(MIN_RAYS) as u32;
    let mut areas = vec![0.0; scene.groups().len()];
    for s in polygons {
        let per_ray = fronts.polygons[s as usize].area / f64::from(rays);
        caster.cast(s, Half::First, rays, |_, _, hit| {
            if fronts.met(hit.triangle, hit.front).is_none() {
                areas[scene.triangles()[hit.triangle].group as usize] += per_ray;
            }
        });
    }
    let share = |(group, area)| BackMet { group, share: area / fronts.areas[from] };
    let mut met: Vec<BackMet> =
        areas.into_iter().enumerate().filter(|(_, area)| *area > 0.0).map(share).collect();
    met.sort_by(|a, b| b.share.total_cmp(&a.share).then(a.group.cmp(&b.group)));
    Ok(met)
}
