//! The scene: triangles and materials as given, checked once.
//!
//! [`Scene::new`] validates its input. It rejects invalid values (numbers that are not finite,
//! indices out of range, reflectances of 1 or more) and drops triangles without area. Later code
//! relies on that and does not check again.
//!
//! A scene is immutable: changed materials or moved groups make another scene
//! ([`Scene::with_materials`], [`Scene::with_transformed_group`]), with which a solve can continue.

mod clear_panes;
mod covered_backs;
mod covers;
mod cut;
mod cut_outs;
mod derived;
pub(crate) mod fingerprint;
pub(crate) mod glass_bodies;
mod half_edge;
mod intensity;
mod luminaire;
mod material;
mod rgb;
mod scene_textures;
mod sides;
mod sky;
mod sky_distribution;
mod sky_map;
mod solar_irradiance;
mod specular;
pub mod texture;
mod textured;
mod up_axis;
mod warning;

use std::any::Any;
use std::collections::HashMap;
use std::sync::{Arc, OnceLock};

use glam::{DAffine3, DVec3};

use crate::error::{Error, ErrorKind, quoted};
pub use crate::geometry::aabb::Aabb;
pub(crate) use crate::geometry::polygon::longest_edge;
use crate::geometry::weld::Weld;
use clear_panes::ClearPanes;
use covers::Covers;
pub(crate) use cut::Piece;
use derived::Derived;
pub(crate) use half_edge::HalfEdge;
pub use intensity::{IntensityDistribution, Pole};
pub use luminaire::{Luminaire, Opening};
pub use material::Material;
pub use rgb::Rgb;
pub(crate) use rgb::luminance;
pub(crate) use scene_textures::SceneTextures;
pub use sides::Sides;
pub(crate) use sides::Treatment;
pub use sky::{Sky, Sun};
pub use sky_distribution::SkyDistribution;
#[cfg(feature = "gpu")]
pub(crate) use sky_map::SkyMap;
pub use solar_irradiance::{LuminousEfficacy, SolarIrradiance};
pub use specular::Specular;
pub use up_axis::UpAxis;
pub use warning::{Warning, WarningKind};

/// A face of the scene: counter-clockwise corners seen from its front.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Triangle {
    /// Indices into the positions.
    pub corners: [u32; 3],
    /// Index into the groups.
    pub group: u32,
    /// Index into the materials.
    pub material: u32,
    /// Smoothing group: determines with angles where a surface has creases
    /// ([`crate::Mesh::CREASE_DEGREES`]). `Some(0)` is in none; `None` means unknown.
    pub smoothing: Option<u32>,
}

/// A checked scene: every index in range, every number finite, every triangle with area.
///
/// Lengths are in the unit of the positions; radiosity does not depend on it.
#[derive(Clone, Debug)]
pub struct Scene {
    positions: Vec<DVec3>,
    triangles: Vec<Triangle>,
    groups: Vec<String>,
    materials: Vec<Material>,
    degenerate: usize,
    /// See [`Scene::coordinate_ulp`].
    coordinate_ulp: f64,
    warnings: Vec<Warning>,
    /// See [`Scene::comments`].
    comments: Arc<[String]>,
    /// See [`Scene::up`].
    up: Option<DVec3>,
    /// See [`Scene::sky`].
    sky: Sky,
    /// See [`Scene::luminaires`].
    luminaires: Arc<[Luminaire]>,
    /// Textures of materials, and texture coordinates of triangles.
    textures: Arc<SceneTextures>,
    /// Per triangle, the sides across which its surface does not continue; empty for none.
    cut_sides: Vec<[bool; 3]>,
    /// See [`Scene::crease_degrees`].
    crease_degrees: Option<f64>,
    /// What follows from the shape; scenes of one shape share it.
    shape: Arc<Shape>,
    /// See [`Scene::derived`].
    derived: Derived,
}

/// What follows from the corners and holes of triangles and from which materials are clear,
/// whatever else a scene has; computed on first use.
#[derive(Debug, Default)]
struct Shape {
    /// See [`Scene::is_back_covered`].
    covered_backs: OnceLock<Covers>,
    /// See [`Scene::clear_panes`].
    clear_panes: OnceLock<Option<ClearPanes>>,
    /// See [`Scene::derived_from_shape`].
    derived: Derived,
}

/// What the plane of each triangle is.
#[derive(Debug)]
pub(crate) struct Facets {
    /// [`Scene::normal`]
    pub normals: Vec<DVec3>,
    /// [`Scene::area`]
    pub areas: Vec<f64>,
}

/// Corners of all triangles by position numbers, equal positions having one number.
#[derive(Debug)]
pub(crate) struct WeldedCorners {
    pub corners: Vec<[u32; 3]>,
    /// How many positions there are.
    pub positions: usize,
}

impl Scene {
    /// Checks its input and makes a scene: `positions` in any length unit, `groups` by name.
    ///
    /// ```
    /// use radiosity::glam::DVec3;
    /// use radiosity::{Material, Rgb, Scene, Triangle};
    ///
    /// # fn main() -> Result<(), radiosity::Error> {
    /// let positions = vec![DVec3::ZERO, DVec3::X, DVec3::Y]; // counter-clockwise: the front is +z
    /// let triangle = Triangle { corners: [0, 1, 2], group: 0, material: 0, smoothing: None };
    /// let lamp = Material { exitance: Rgb::splat(100.0), ..Material::grey("lamp", 0.2) };
    /// let scene = Scene::new(positions, vec![triangle], vec!["panel".into()], vec![lamp])?;
    /// assert_eq!(scene.triangles().len(), 1);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// Triangles without area are dropped and counted ([`Scene::degenerate`]). A triangle has no
    /// area when the cross product of two edges is lost in rounding: below 4 ε times its longest
    /// edge, times that edge again or the largest coordinate of its corners, if that is more; or
    /// when its square underflows.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`] for a reflectance, alone or with a transmittance, outside [0, 1), a
    /// negative exitance, a number that is not finite, a mirror or glass that returns more light
    /// than it gets, an index out of range, or when no triangle with area is left.
    pub fn new(
        positions: Vec<DVec3>,
        triangles: Vec<Triangle>,
        groups: Vec<String>,
        materials: Vec<Material>,
    ) -> Result<Scene, Error> {
        Scene::with_textures(positions, triangles, groups, materials, SceneTextures::default())
    }

    /// The same with textures for materials. Reflectance and exitance of those become the means of
    /// their textures over their triangles.
    pub(crate) fn with_textures(
        positions: Vec<DVec3>,
        mut triangles: Vec<Triangle>,
        groups: Vec<String>,
        materials: Vec<Material>,
        mut textures: SceneTextures,
    ) -> Result<Scene, Error> {
        check(&positions, &triangles, &groups, &materials)?;
        let given = triangles.len();
        let has_area = |t: &Triangle| has_area(&positions, t);
        if !triangles.iter().all(has_area) {
            textures.keep(|t| has_area(&triangles[t]));
            triangles.retain(has_area);
        }
        if triangles.is_empty() {
            return Err(none_with_area(given));
        }
        let degenerate = given - triangles.len();
        let corners = triangles.iter().flat_map(|t| t.corners).map(|k| positions[k as usize]);
        let largest = corners.map(|p| p.abs().max_element()).fold(0.0, f64::max);
        let mut scene = Scene {
            positions,
            triangles,
            groups,
            materials,
            degenerate,
            coordinate_ulp: f64::EPSILON * largest,
            warnings: vec![],
            comments: Arc::default(),
            up: None,
            sky: Sky::default(),
            luminaires: Arc::default(),
            textures: Arc::default(),
            cut_sides: vec![],
            crease_degrees: None,
            shape: Arc::default(),
            derived: Derived::default(),
        };
        let has_textures = !textures.of_materials.is_empty();
        scene.textures = textures.into();
        if has_textures {
            scene.lay_textures();
            scene.materials.iter().try_for_each(Material::check)?;
        }
        if degenerate > 0 {
            scene.warn(Warning::new(WarningKind::Degenerate, degenerate, "dropped"));
        }
        Ok(scene)
    }

    /// Vertex positions in the scene's length unit.
    pub fn positions(&self) -> &[DVec3] {
        &self.positions
    }

    /// The triangles that have area, in the order given.
    pub fn triangles(&self) -> &[Triangle] {
        &self.triangles
    }

    /// Names of the groups (or objects).
    pub fn groups(&self) -> &[String] {
        &self.groups
    }

    /// The materials.
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// Whether any surface emits light.
    pub fn has_emitter(&self) -> bool {
        (0..self.triangles.len()).any(|t| self.exitance(t) != Rgb::ZERO)
    }

    /// Number of triangles dropped for having no area.
    pub fn degenerate(&self) -> usize {
        self.degenerate
    }

    /// Accepted defects, one warning per kind.
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }

    /// Corners of triangle `t`, counter-clockwise from the front.
    pub fn corners(&self, t: usize) -> [DVec3; 3] {
        self.triangles[t].corners.map(|k| self.positions[k as usize])
    }

    /// Corners of all triangles by position numbers; computed once.
    pub(crate) fn welded_corners(&self) -> Arc<WeldedCorners> {
        self.derived_from_shape(|scene| {
            let mut weld = Weld::default();
            let mut numbers = vec![None; scene.positions.len()];
            let mut number = |corner: u32| {
                let k = corner as usize;
                *numbers[k].get_or_insert_with(|| weld.number(scene.positions[k]))
            };
            let corners = scene.triangles.iter().map(|t| t.corners.map(&mut number)).collect();
            WeldedCorners { corners, positions: weld.positions.len() }
        })
    }

    /// Unit normal of triangle `t`, on its front.
    pub fn normal(&self, t: usize) -> DVec3 {
        let [a, b, c] = self.corners(t);
        // Scaled by the longest edge first, so that tiny triangles do not underflow.
        let (e1, e2) = (b - a, c - a);
        let scale = 1.0 / e1.abs().max(e2.abs()).max_element();
        (e1 * scale).cross(e2 * scale).normalize()
    }

    /// Area of triangle `t`, holes included, length unit squared.
    pub fn area(&self, t: usize) -> f64 {
        let [a, b, c] = self.corners(t);
        0.5 * (b - a).cross(c - a).length()
    }

    /// Normals and areas of all triangles; computed once.
    pub(crate) fn facets(&self) -> Arc<Facets> {
        self.derived_from_shape(|scene| {
            let all = 0..scene.triangles.len();
            let normals = all.clone().map(|t| scene.normal(t)).collect();
            Facets { normals, areas: all.map(|t| scene.area(t)).collect() }
        })
    }

    /// Area of all triangles, scene unit squared.
    pub(crate) fn total_area(&self) -> f64 {
        (0..self.triangles.len()).map(|t| self.area(t)).sum()
    }

    /// Whether the whole back of triangle `t` coincides with fronts of others: no ray hits it, and
    /// rays from that side hit those fronts.
    pub(crate) fn is_back_covered(&self, t: usize) -> bool {
        self.covered_backs().is_covered(t)
    }

    /// Triangles whose fronts coincide with the back of triangle `t` and cover all of it; none if
    /// some of it is open.
    pub(crate) fn back_covers(&self, t: usize) -> &[u32] {
        self.covered_backs().of(t)
    }

    /// Of triangles that cover one another's backs, those that come after one of theirs; and those
    /// whose back others cover, but not they theirs.
    #[cfg(feature = "glb")]
    pub(crate) fn second_sides(&self) -> Vec<usize> {
        self.covered_backs().seconds()
    }

    /// Of a translucent triangle `t`, the translucent ones whose fronts cover its back, from which
    /// its transmitted light leaves. None for others.
    pub(crate) fn other_side(&self, t: usize) -> impl Iterator<Item = usize> {
        let is_translucent = |t: usize| self.material(t).is_translucent();
        let covers = if is_translucent(t) { self.back_covers(t) } else { &[] };
        covers.iter().map(|&s| s as usize).filter(move |&s| is_translucent(s))
    }

    fn covered_backs(&self) -> &Covers {
        self.shape.covered_backs.get_or_init(|| covered_backs::covered_backs(self))
    }

    /// The panes that light passes; none in a scene without them.
    pub(crate) fn clear_panes(&self) -> Option<&ClearPanes> {
        self.shape.clear_panes.get_or_init(|| glass_bodies::clear_panes(self)).as_ref()
    }

    /// Whether there are panes that light passes.
    pub(crate) fn has_clear_panes(&self) -> bool {
        self.clear_panes().is_some()
    }

    /// Parts of the scene that hemicubes do not see, in words; none if they see all.
    #[cfg_attr(not(feature = "gpu"), allow(dead_code, reason = "hemicubes are drawn on a GPU"))]
    pub(crate) fn hidden_from_hemicubes(&self) -> Option<&'static str> {
        match (self.has_clear_panes(), self.has_cut_outs()) {
            (true, true) => Some("clear panes and cut-outs"),
            (true, false) => Some("clear panes"),
            (false, true) => Some("cut-outs"),
            (false, false) => None,
        }
    }

    /// Whether light passes triangle `t` straight on: rays do not hit it.
    pub(crate) fn is_clear(&self, t: usize) -> bool {
        self.clear_panes().is_some_and(|panes| panes.transmittance(t).is_some())
    }

    /// The axis-aligned box around all triangles.
    pub fn bounds(&self) -> Aabb {
        Aabb::from_points((0..self.triangles.len()).flat_map(|t| self.corners(t)))
    }

    /// The axis-aligned box around all triangles that reflect; around all, if none does.
    pub(crate) fn reflecting_bounds(&self) -> Aabb {
        let reflecting = (0..self.triangles.len()).filter(|&t| self.material(t).scatters());
        let mut corners = reflecting.flat_map(|t| self.corners(t)).peekable();
        if corners.peek().is_some() { Aabb::from_points(corners) } else { self.bounds() }
    }

    /// The step between 64-bit coordinates of the scene's largest size, scene unit: coplanar points
    /// may deviate by a few of these.
    pub(crate) fn coordinate_ulp(&self) -> f64 {
        self.coordinate_ulp
    }

    /// Material of triangle `t`.
    pub fn material(&self, t: usize) -> &Material {
        &self.materials[self.triangles[t].material as usize]
    }

    /// The same scene with its materials replaced by `materials`, one for one. Textures stay: if a
    /// material has one, its reflectance or exitance is the mean that the texture is scaled to.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`] when their number differs, or one is out of range.
    pub fn with_materials(&self, materials: Vec<Material>) -> Result<Scene, Error> {
        let (count, wanted) = (materials.len(), self.materials.len());
        if count != wanted {
            let found = format!("{count} for {wanted}");
            return Err(bad("materials", found, "give one for each that the scene has"));
        }
        materials.iter().try_for_each(Material::check)?;
        let mut scene = Scene { materials, ..self.clone() };
        let mut both = scene.materials.iter().zip(&self.materials);
        if both.any(|(new, old)| new.clear_transmittance() != old.clear_transmittance()) {
            scene.shape = Arc::default();
        }
        Ok(scene)
    }

    /// The same scene with all triangles of `group` transformed by `transform`. Vertices shared
    /// with other groups are copied, so that those do not move.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`] when there is no such group, or when a triangle no longer has area or
    /// finite coordinates.
    pub fn with_transformed_group(&self, group: &str, transform: DAffine3) -> Result<Scene, Error> {
        let Some(moved_group) = self.groups.iter().position(|name| name == group) else {
            let known = self.groups.join(", ");
            return Err(bad(
                format!("group '{group}'"),
                "not in the scene",
                format!("use {known}"),
            ));
        };
        let (mut positions, mut triangles) = (self.positions.clone(), self.triangles.clone());
        let mut copies = HashMap::new();
        for t in triangles.iter_mut().filter(|t| t.group as usize == moved_group) {
            t.corners = t.corners.map(|corner| {
                *copies.entry(corner).or_insert_with(|| {
                    positions.push(transform.transform_point3(self.positions[corner as usize]));
                    positions.len() as u32 - 1
                })
            });
        }
        let (groups, materials) = (self.groups.clone(), self.materials.clone());
        let scene = Scene::new(positions, triangles, groups, materials)?;
        let (textures, cut_sides) = (self.textures.clone(), self.cut_sides.clone());
        let (crease_degrees, up) = (self.crease_degrees, self.up);
        let (sky, luminaires) = (self.sky.clone(), self.luminaires.clone());
        let scene = Scene { up, sky, luminaires, textures, cut_sides, crease_degrees, ..scene };
        let scene = scene.with_comments(self.comments.to_vec());
        if scene.degenerate > 0 {
            let found = format!("{} triangles without area when moved", scene.degenerate);
            return Err(bad(format!("group '{group}'"), found, "scale it by less"));
        }
        Ok(scene)
    }

    /// Angle between normals, degrees, above which neighbouring triangles without a known smoothing
    /// group meet in a crease; none if unset.
    pub(crate) fn crease_degrees(&self) -> Option<f64> {
        self.crease_degrees
    }

    /// The same scene with [`Scene::crease_degrees`].
    pub(crate) fn with_crease_degrees(&self, degrees: f64) -> Scene {
        Scene { crease_degrees: Some(degrees), ..self.clone() }
    }

    /// The result of `make` for the scene, computed once for each type: smooth surfaces, lights and
    /// other data that this module does not define.
    pub(crate) fn derived<T: Any + Send + Sync>(&self, make: impl FnOnce(&Scene) -> T) -> Arc<T> {
        self.derived.get(|| make(self))
    }

    /// The same of what follows from the shape alone, as the ray hierarchy does: scenes with other
    /// skies, creases or materials share it, unless other materials are clear.
    pub(crate) fn derived_from_shape<T: Any + Send + Sync>(
        &self,
        make: impl FnOnce(&Scene) -> T,
    ) -> Arc<T> {
        self.shape.derived.get(|| make(self))
    }

    /// The comments before the geometry of its file, without `#`: often the program that wrote it.
    pub(crate) fn comments(&self) -> &[String] {
        &self.comments
    }

    /// The same scene with these comments.
    pub(crate) fn with_comments(self, comments: Vec<String>) -> Scene {
        Scene { comments: comments.into(), ..self }
    }

    pub(crate) fn warn(&mut self, warning: Warning) {
        self.warnings.push(warning);
    }
}

/// Checks what a scene is made of: numbers are finite and indices in range.
fn check(
    positions: &[DVec3],
    triangles: &[Triangle],
    groups: &[String],
    materials: &[Material],
) -> Result<(), Error> {
    for (i, p) in positions.iter().enumerate() {
        if !p.is_finite() {
            let place = format!("vertex {}", i + 1);
            return Err(bad(place, format!("coordinates {p}"), "all three must be finite"));
        }
    }
    materials.iter().try_for_each(Material::check)?;
    for (i, t) in triangles.iter().enumerate() {
        let [a, b, c] = t.corners.map(|corner| ("vertex", corner, positions.len()));
        let indices =
            [("group", t.group, groups.len()), ("material", t.material, materials.len()), a, b, c];
        for (what, index, count) in indices {
            if index as usize >= count {
                return Err(bad(
                    format!("triangle {}", i + 1),
                    format!("{what} index {index}"),
                    format!("must be below {count}"),
                ));
            }
        }
        let (longest, cross) = longest_edge_and_cross(positions, t);
        if !(cross * cross).is_finite() || !(longest * longest).is_finite() {
            return Err(bad(
                format!("triangle {} of group {}", i + 1, quoted(&[&groups[t.group as usize]])),
                format!("an extent of {longest:e}"),
                "scale the scene down: areas must stay finite in 64-bit floats",
            ));
        }
    }
    Ok(())
}

/// Whether a triangle has an area: see [`Scene::new`].
fn has_area(positions: &[DVec3], t: &Triangle) -> bool {
    let (longest, cross) = longest_edge_and_cross(positions, t);
    let corners = t.corners.map(|k| positions[k as usize].abs().max_element());
    let reach = corners.into_iter().fold(longest, f64::max);
    cross > 4.0 * f64::EPSILON * longest * reach && cross * cross >= f64::MIN_POSITIVE
}

/// Length of the longest edge of `t`, and of the cross product of two edges: twice its area.
fn longest_edge_and_cross(positions: &[DVec3], t: &Triangle) -> (f64, f64) {
    let [a, b, c] = t.corners.map(|k| positions[k as usize]);
    (longest_edge([a, b, c]), (b - a).cross(c - a).length())
}

fn none_with_area(given: usize) -> Error {
    let found = match given {
        0 => "no triangle".to_string(),
        n => format!("{n} triangles, none with area"),
    };
    bad("scene", found, "give at least one triangle with area")
}

fn bad(place: impl Into<String>, found: impl Into<String>, remedy: impl Into<String>) -> Error {
    Error::new(ErrorKind::Scene, place, found, remedy)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(corners: [[f64; 3]; 3], material: Material) -> Result<Scene, Error> {
        let positions = corners.map(DVec3::from_array).to_vec();
        let t = Triangle { corners: [0, 1, 2], ..Default::default() };
        Scene::new(positions, vec![t], vec!["it".into()], vec![material])
    }
    const RIGHT: [[f64; 3]; 3] = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]];

    #[test]
    fn triangle_has_its_normal_and_area() {
        let s = one(RIGHT, Material::grey("m", 0.5)).unwrap();
        assert_eq!(s.normal(0), DVec3::Z);
        assert_eq!(s.area(0), 0.5);
        assert_eq!((s.degenerate(), s.warnings().len()), (0, 0));
    }

    #[test]
    fn reflectance_at_its_ends() {
        assert!(one(RIGHT, Material::grey("m", 0.0)).is_ok());
        assert!(one(RIGHT, Material::grey("m", 1.0 - 1e-15)).is_ok());
        for rho in [1.0, 1.5, -1e-9, f64::NAN, f64::INFINITY] {
            let e = one(RIGHT, Material::grey("chalk", rho)).unwrap_err();
            assert_eq!(e.kind(), ErrorKind::Scene);
            assert!(e.to_string().contains("chalk"), "{e}");
        }
    }

    #[test]
    fn specular_materials_return_no_more_than_they_get() {
        let with = |specular| {
            let material = Material { specular: Some(specular), ..Material::grey("plate", 0.25) };
            one(RIGHT, material)
        };
        let glass = |refractive_index, transmittance| {
            let transmittance = Rgb::new(0.5, transmittance, 0.5);
            with(Specular::Glass { refractive_index, transmittance })
        };
        let mirror = |reflectance| with(Specular::Mirror { reflectance: Rgb::splat(reflectance) });
        let polished =
            |reflectance| with(Specular::Polished { reflectance: Rgb::splat(reflectance) });
        for good in [mirror(0.0), mirror(0.75), polished(0.75), glass(1.0, 0.0), glass(5.0, 0.75)] {
            assert!(good.unwrap().material(0).specular.is_some());
        }
        for (bad, parts) in [
            (mirror(0.76), ["specular reflectance 0.76 and reflectance 0.25", "their sum"]),
            (polished(-0.1), ["specular reflectance -0.1", "from 0 to 1"]),
            (polished(f64::NAN), ["specular reflectance NaN", "from 0 to 1"]),
            (glass(0.9, 0.5), ["a refractive index of 0.9", "from 1 to 5"]),
            (glass(f64::NAN, 0.5), ["a refractive index of NaN", "from 1 to 5"]),
            (glass(1.5, 1.1), ["transmittance 1.1 in channel g", "from 0 to 1"]),
        ] {
            let e = bad.unwrap_err();
            assert_eq!(e.kind(), ErrorKind::Scene);
            for part in ["material 'plate'", parts[0], parts[1]] {
                assert!(e.to_string().contains(part), "{e}");
            }
        }
    }

    #[test]
    fn rejects_bad_numbers_and_indices() {
        let m = || Material::grey("m", 0.5);
        assert!(one([[f64::NAN, 0., 0.], RIGHT[1], RIGHT[2]], m()).is_err());
        assert!(one([[0., 0., f64::INFINITY], RIGHT[1], RIGHT[2]], m()).is_err());
        assert!(one([[0.; 3], [1e200, 0., 0.], [0., 1e200, 0.]], m()).is_err());
        let dark = Material { exitance: Rgb::new(0., -1., 0.), ..m() };
        assert!(one(RIGHT, dark).is_err());
        for (corners, group, material) in [([0, 1, 3], 0, 0), ([0, 1, 2], 1, 0), ([0, 1, 2], 0, 1)]
        {
            let t = Triangle { corners, group, material, smoothing: None };
            let p = RIGHT.map(DVec3::from_array).to_vec();
            assert!(Scene::new(p, vec![t], vec!["g".into()], vec![m()]).is_err());
        }
    }

    #[test]
    fn degenerate_triangles_are_dropped_and_counted() {
        let line = [[0., 0., 0.], [1., 0., 0.], [2., 0., 0.]];
        assert!(one(line, Material::grey("m", 0.5)).is_err());
        assert!(Scene::new(vec![], vec![], vec![], vec![]).is_err());
        let mut p = RIGHT.map(DVec3::from_array).to_vec();
        p.push(DVec3::new(2., 0., 0.));
        let t = |corners| Triangle { corners, ..Default::default() };
        let all = vec![t([0, 1, 2]), t([0, 1, 3])];
        let s = Scene::new(p, all, vec!["g".into()], vec![Material::grey("m", 0.1)]).unwrap();
        assert_eq!((s.triangles().len(), s.degenerate(), s.warnings().len()), (1, 1, 1));
        // A needle a million times longer than wide is still a triangle.
        let needle = [[0., 0., 0.], [1., 0., 0.], [0., 1e-6, 0.]];
        assert_eq!(one(needle, Material::grey("m", 0.5)).unwrap().area(0), 5e-7);
    }
}
