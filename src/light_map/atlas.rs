//! Texture coordinates of the surfaces of a scene in a light map.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::given_coordinates::{self, Unusable};
use super::layout::{
    Coordinates, Layout, LayoutSettings, MAX_SIDE, Resolution, bad_size, in_texels,
};
use super::pages::{Maps, Page, arranged};
use super::unwrapping;
use crate::error::{Error, ErrorKind};
use crate::mesh::SurfaceTopology;
use crate::scene::Scene;
use crate::visibility::lit_sides;

/// Texture coordinates of all triangles of a scene, without overlap: in one texture, in which its
/// [pages](Atlas::pages) lie side by side if there are several maps.
#[derive(Clone, Debug)]
pub struct Atlas {
    scene: Arc<Scene>,
    pub(super) size: [u32; 2],
    pub(super) coordinates: Vec<[DVec2; 3]>,
    pages: Vec<Page>,
    /// The page of each triangle.
    page_of: Vec<u32>,
    padding: u32,
    charts: Option<usize>,
    unusable: Option<Unusable>,
}

impl Atlas {
    /// Lays out all triangles of `scene` in one map: [`Atlas::with_settings`].
    ///
    /// # Errors
    /// Those of [`Atlas::with_settings`].
    pub fn new(
        scene: impl Into<Arc<Scene>>,
        resolution: Resolution,
        coordinates: Coordinates,
    ) -> Result<Atlas, Error> {
        let settings = LayoutSettings { coordinates, ..LayoutSettings::new(resolution) };
        Atlas::with_settings(scene, &settings)
    }

    /// Lays out all triangles of `scene`, one for each side that reflects
    /// ([`Scene::resolve_sides`]): [`Atlas::scene`] has them, and is the scene to bake.
    ///
    /// Coordinates of the file ([`SceneSettings::texture_coordinates`]) are usable if all triangles
    /// have them, within [0, 1], and none of one map overlap by more than a quarter of a texel. New
    /// ones have one or several charts for each smooth surface: none crosses a crease. Charts lie
    /// twice the padding apart.
    ///
    /// [`SceneSettings::texture_coordinates`]: crate::SceneSettings::texture_coordinates
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] for a resolution that is not above 0, or that makes more than 8192
    /// texels along a side of a map, or as many in all maps as that map has, and for a padding
    /// below 3; [`ErrorKind::Scene`] for [`Coordinates::Given`] that cannot be used.
    pub fn with_settings(
        scene: impl Into<Arc<Scene>>,
        settings: &LayoutSettings,
    ) -> Result<Atlas, Error> {
        settings.check()?;
        let scene = lit_sides::resolved(scene.into());
        let LayoutOfMaps { layout, groups, unusable } = layout_by_maps(&scene, settings)?;
        let Layout { sizes, maps: page_of, mut coordinates, charts } = layout;
        let (pages, size) = arranged(&sizes, &groups);
        if u64::from(size[0]) * u64::from(size[1]) > u64::from(MAX_SIDE).pow(2) {
            let found = format!("{} × {} texels in all {} maps", size[0], size[1], pages.len());
            return Err(bad_size(settings.resolution, found));
        }
        for (corners, &page) in coordinates.iter_mut().zip(&page_of) {
            let Page { origin, size: of_page, .. } = pages[page as usize];
            if of_page != size {
                let [origin, of_page, size] =
                    [origin, of_page, size].map(|x| DVec2::from(x.map(f64::from)));
                *corners = corners.map(|p| (origin + p * of_page) / size);
            }
        }
        let padding = settings.padding;
        Ok(Atlas { scene, size, coordinates, pages, page_of, padding, charts, unusable })
    }

    /// The same in the fewest texels along a side, of 64, 128, … 2048, that surfaces have room in;
    /// the resolution of `settings` is not used.
    ///
    /// # Errors
    /// Those of [`Atlas::with_settings`].
    pub fn in_fewest_texels(
        scene: impl Into<Arc<Scene>>,
        settings: &LayoutSettings,
    ) -> Result<Atlas, Error> {
        // Once for all sizes.
        let scene = lit_sides::resolved(scene.into());
        let of = |pixels: u32| {
            let resolution = Resolution::Pixels(pixels);
            Atlas::with_settings(scene.clone(), &LayoutSettings { resolution, ..*settings })
        };
        let mut sizes = (6..11).map(|doublings| of(1 << doublings));
        let has_no_room = |e: &Error| e.kind() == ErrorKind::Setting;
        let fits = |atlas: &Result<Atlas, Error>| !atlas.as_ref().is_err_and(has_no_room);
        sizes.find(fits).unwrap_or_else(|| of(2048))
    }

    /// The maps, side by side in the one of the atlas: one unless the settings ask for more.
    pub fn pages(&self) -> &[Page] {
        &self.pages
    }

    /// The index of the page of triangle `t`, and the coordinates of its corners in that.
    pub fn page_coordinates(&self, t: usize) -> (usize, [DVec2; 3]) {
        let page = self.page_of[t] as usize;
        let Page { origin, size, .. } = self.pages[page];
        if size == self.size {
            return (page, self.coordinates[t]);
        }
        let [origin, size, all] = [origin, size, self.size].map(|x| DVec2::from(x.map(f64::from)));
        (page, self.coordinates[t].map(|p| (p * all - origin) / size))
    }

    /// Texels around charts that are filled from them, beyond one that points on the outline use.
    pub(super) fn filled_texels(&self) -> u32 {
        self.padding - 1
    }

    /// Number of smaller images (mipmaps) that the texels around charts suffice for.
    pub fn smaller_images(&self) -> u32 {
        self.padding.ilog2()
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

/// The layout of all triangles of a scene.
struct LayoutOfMaps {
    layout: Layout,
    /// The group of each map, where each has one.
    groups: Vec<Option<u32>>,
    /// Why the coordinates of the file are not used, if they were to be.
    unusable: Option<Unusable>,
}

/// The layout of the triangles of `scene`, in as many maps as `settings` ask for.
fn layout_by_maps(scene: &Scene, settings: &LayoutSettings) -> Result<LayoutOfMaps, Error> {
    let count = scene.triangles().len();
    let surfaces = SurfaceTopology::of_scene(scene).surfaces();
    if settings.maps != Maps::EachGroup {
        let all: Vec<u32> = (0..count as u32).collect();
        let (layout, unusable) = layout_of(scene, &all, &surfaces, settings)?;
        let groups = vec![None; layout.sizes.len()];
        return Ok(LayoutOfMaps { layout, groups, unusable });
    }
    let mut by_group: Vec<Vec<u32>> = vec![vec![]; scene.groups().len()];
    for (t, triangle) in (0..).zip(scene.triangles()) {
        by_group[triangle.group as usize].push(t);
    }
    let mut all = Layout {
        sizes: vec![],
        maps: vec![0; count],
        coordinates: vec![[DVec2::ZERO; 3]; count],
        charts: None,
    };
    let (mut groups, mut first_unusable) = (vec![], None);
    for (group, triangles) in (0..).zip(&by_group).filter(|(_, triangles)| !triangles.is_empty()) {
        let (layout, unusable) = layout_of(scene, triangles, &surfaces, settings)?;
        let Layout { sizes, coordinates, charts, .. } = layout;
        for (&t, corners) in triangles.iter().zip(coordinates) {
            (all.maps[t as usize], all.coordinates[t as usize]) = (all.sizes.len() as u32, corners);
        }
        all.sizes.extend(sizes);
        all.charts = charts.map_or(all.charts, |charts| Some(charts + all.charts.unwrap_or(0)));
        groups.push(Some(group));
        first_unusable = first_unusable.or(unusable);
    }
    Ok(LayoutOfMaps { layout: all, groups, unusable: first_unusable })
}

/// The layout of `triangles` of `scene`, which have these smooth `surfaces`.
fn layout_of(
    scene: &Scene,
    triangles: &[u32],
    surfaces: &[u32],
    settings: &LayoutSettings,
) -> Result<(Layout, Option<Unusable>), Error> {
    let given = match (settings.coordinates, settings.maps) {
        // The coordinates of a file are those of one map.
        (Coordinates::Unwrapped, _) | (Coordinates::Auto, Maps::Pages(_)) => None,
        _ => Some(given_coordinates::layout(scene, triangles, settings.resolution)?),
    };
    match given {
        Some(Ok(layout)) => Ok((layout, None)),
        Some(Err(unusable)) if settings.coordinates == Coordinates::Given => {
            let remedy = "give each triangle a place of its own in the texture, or lay surfaces \
                          out anew (`Coordinates::Unwrapped`; `--coordinates new`)";
            let found = unusable.to_string();
            Err(Error::new(ErrorKind::Scene, "texture coordinates", found, remedy))
        }
        given => {
            let unusable = given.and_then(Result::err);
            Ok((unwrapping::layout(scene, triangles, surfaces, settings)?, unusable))
        }
    }
}
