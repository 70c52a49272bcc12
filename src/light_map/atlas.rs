//! Texture coordinates of the surfaces of a scene in a light map.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::given_coordinates::{self, Unusable};
use super::layout::{Layout, Resolution, in_texels};
use super::unwrapping;
use crate::error::{Error, ErrorKind};
use crate::mesh::SurfaceTopology;
use crate::scene::Scene;
use crate::visibility::lit_sides;

/// Source of the texture coordinates of a light map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Coordinates {
    /// Those of the scene's file if they are usable for a light map, else new ones.
    #[default]
    Auto,
    /// Those of the scene's file.
    Given,
    /// New ones.
    Unwrapped,
}

/// Texture coordinates of all triangles of a scene, in one texture and without overlap.
#[derive(Clone, Debug)]
pub struct Atlas {
    scene: Arc<Scene>,
    pub(super) size: [u32; 2],
    pub(super) coordinates: Vec<[DVec2; 3]>,
    charts: Option<usize>,
    unusable: Option<Unusable>,
}

impl Atlas {
    /// Lays out all triangles of `scene`, one for each side that reflects
    /// ([`Scene::resolve_sides`]): [`Atlas::scene`] has them, and is the scene to bake.
    ///
    /// Coordinates of the file ([`SceneSettings::texture_coordinates`]) are usable if all triangles
    /// have them, within [0, 1], and none overlap by more than a quarter of a texel. New ones have
    /// one or several charts for each smooth surface: none crosses a crease. Charts lie six texels
    /// apart: on either side one that points on the outline use, and two of dilation.
    ///
    /// [`SceneSettings::texture_coordinates`]: crate::SceneSettings::texture_coordinates
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] for a resolution that is not above 0, or that makes more than 8192
    /// texels along a side; [`ErrorKind::Scene`] for [`Coordinates::Given`] that cannot be used.
    pub fn new(
        scene: impl Into<Arc<Scene>>,
        resolution: Resolution,
        coordinates: Coordinates,
    ) -> Result<Atlas, Error> {
        resolution.check()?;
        let scene = lit_sides::resolved(scene.into());
        let given = match coordinates {
            Coordinates::Unwrapped => None,
            _ => Some(given_coordinates::layout(&scene, resolution)?),
        };
        let (layout, unusable) = match given {
            Some(Ok(layout)) => (layout, None),
            Some(Err(unusable)) if coordinates == Coordinates::Given => {
                let remedy = "give each triangle a place of its own in the texture, or lay \
                              surfaces out anew (`Coordinates::Unwrapped`; `--coordinates new`)";
                let found = unusable.to_string();
                return Err(Error::new(ErrorKind::Scene, "texture coordinates", found, remedy));
            }
            given => {
                let unusable = given.and_then(Result::err);
                (unwrapping::layout(&scene, resolution)?, unusable)
            }
        };
        let Layout { size, coordinates, charts } = layout;
        Ok(Atlas { scene, size, coordinates, charts, unusable })
    }

    /// The scene of the triangles laid out.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// Texels in a row.
    pub fn width(&self) -> u32 {
        self.size[0]
    }

    /// Rows of texels.
    pub fn height(&self) -> u32 {
        self.size[1]
    }

    /// Texture coordinates of the corners of triangle `t`: (0, 0) is the upper left corner of the
    /// map, (1, 1) the lower right one, as in glTF. Triangles too thin for 32-bit coordinates lie
    /// on one point.
    pub fn coordinates(&self, t: usize) -> [DVec2; 3] {
        self.coordinates[t]
    }

    /// Edge of a texel on the surfaces, scene unit: the mean over all.
    pub fn texel_size(&self) -> f64 {
        let triangles = 0..self.coordinates.len();
        let on_surfaces: f64 = triangles.clone().map(|t| self.scene.area(t)).sum();
        let area = |[a, b, c]: [DVec2; 3]| (b - a).perp_dot(c - a).abs() / 2.0;
        let texels: f64 = triangles.map(|t| area(self.corners(t))).sum();
        (on_surfaces / texels).sqrt()
    }

    /// Number of charts laid out; none if the coordinates are those of the file.
    pub fn charts(&self) -> Option<usize> {
        self.charts
    }

    /// Why the coordinates of the file are not used, if they were to be.
    pub fn unusable(&self) -> Option<&Unusable> {
        self.unusable.as_ref()
    }

    /// Unit normals at the corners of each triangle: of the smooth surface that it is a part of,
    /// the mean around a corner, weighted by area.
    pub(crate) fn corner_normals(&self) -> Vec<[DVec3; 3]> {
        let (scene, topology) = (&self.scene, SurfaceTopology::of_scene(&self.scene));
        let mut sums = vec![DVec3::ZERO; 3 * topology.corners.len()];
        for (t, corners) in topology.corners.iter().enumerate() {
            corners.iter().for_each(|&k| sums[k as usize] += scene.normal(t) * scene.area(t));
        }
        let of_triangle = |(t, corners): (usize, &[u32; 3])| {
            corners.map(|k| sums[k as usize].normalize_or(scene.normal(t)))
        };
        topology.corners.iter().enumerate().map(of_triangle).collect()
    }

    /// Corners of triangle `t` in units of texels, the centre of the upper left one being (0, 0).
    pub(super) fn corners(&self, t: usize) -> [DVec2; 3] {
        in_texels(self.coordinates[t], self.size)
    }

    /// The same for the point with these weights of the second and third corner.
    pub(super) fn texel_position(&self, t: usize, [u, v]: [f64; 2]) -> DVec2 {
        let [a, b, c] = self.corners(t);
        a * (1.0 - u - v) + b * u + c * v
    }
}
