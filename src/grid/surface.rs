//! The surfaces below grids: floors, and flat groups.

use glam::{DVec2, DVec3};
use rustc_hash::FxHashMap;

use super::measuring_grid::MeasuringGrid;
use super::plane::GridPlane;
use super::rooms::MIN_AREA;
use super::settings::GridSettings;
use crate::error::{Error, ErrorKind, quoted};
use crate::geometry::rectangle::Rectangle;
use crate::geometry::union_find::UnionFind;
use crate::geometry::weld::position_key;
use crate::scene::Scene;
use crate::visibility::ray_scene::RayScene;

/// Cosine of the angle up to which a surface counts as level: 5 degrees. Plain choice.
const LEVEL_COSINE: f64 = 0.996;

/// Triangles with similar normals, in about one plane.
pub(super) struct LevelSurface {
    pub name: String,
    triangles: Vec<usize>,
    /// Unit length.
    pub normal: DVec3,
    /// Height of the highest corner along the normal, scene unit.
    level: f64,
}

impl LevelSurface {
    /// Of triangles of `scene`, at least one.
    fn new(scene: &Scene, triangles: Vec<usize>, normal: DVec3) -> LevelSurface {
        let level =
            triangles.iter().map(|&t| level(scene, t, normal)).fold(f64::NEG_INFINITY, f64::max);
        let area = |t: &&usize| scene.area(**t);
        let largest = triangles.iter().max_by(|a, b| area(a).total_cmp(&area(b)));
        let group = largest.map(|&t| scene.triangles()[t].group as usize);
        let name = group.and_then(|g| scene.groups().get(g)).cloned().unwrap_or_default();
        LevelSurface { name, triangles, normal, level }
    }

    /// The floors of `scene`, the lowest first: large surfaces that face unit `up`, connected by
    /// shared corners. A metre has `metre` scene units.
    pub fn floors(scene: &Scene, up: DVec3, metre: f64) -> Vec<LevelSurface> {
        let all = 0..scene.triangles().len();
        let facing: Vec<usize> =
            all.filter(|&t| !scene.is_clear(t) && scene.normal(t).dot(up) > LEVEL_COSINE).collect();
        let mut joined = UnionFind::new(facing.len());
        let mut first: FxHashMap<[u64; 3], usize> = FxHashMap::default();
        for (k, &t) in facing.iter().enumerate() {
            for corner in scene.corners(t) {
                joined.join(k, *first.entry(position_key(corner)).or_insert(k));
            }
        }
        let mut parts: Vec<Vec<usize>> = vec![vec![]; facing.len()];
        for (k, &t) in facing.iter().enumerate() {
            parts[joined.find(k)].push(t);
        }
        let is_large = |part: &Vec<usize>| {
            part.iter().map(|&t| scene.area(t)).sum::<f64>() >= MIN_AREA * metre * metre
        };
        let large = parts.into_iter().filter(is_large);
        let mut floors: Vec<LevelSurface> =
            large.map(|part| LevelSurface::new(scene, part, up)).collect();
        floors.sort_by(|a, b| a.level.total_cmp(&b.level));
        floors
    }

    /// The highest side of a group that faces unit `up` or, if none does, the side that faces along
    /// its mean normal, weighted by area.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when there is no such group, or no side faces that way.
    pub fn of_group(
        scene: &Scene,
        group: &str,
        up: DVec3,
        metre: f64,
    ) -> Result<LevelSurface, Error> {
        let wrong = |found: String, remedy| {
            Err(Error::new(ErrorKind::Setting, format!("group '{group}'"), found, remedy))
        };
        let Some(number) = scene.groups().iter().position(|name| name == group) else {
            let found = format!("not among {}", quoted(scene.groups()));
            return wrong(found, "name a group of the scene");
        };
        let triangles = scene.triangles().iter().enumerate();
        let of_group = triangles.filter(|(_, triangle)| triangle.group as usize == number);
        let of_group: Vec<usize> = of_group.map(|(t, _)| t).collect();
        let facing = |normal: DVec3| -> Vec<usize> {
            let faces = |t: &&usize| scene.normal(**t).dot(normal) > LEVEL_COSINE;
            of_group.iter().filter(faces).copied().collect()
        };
        let mut normal = up;
        let mut side = facing(normal);
        if side.is_empty() {
            let sum: DVec3 = of_group.iter().map(|&t| scene.area(t) * scene.normal(t)).sum();
            normal = sum.normalize_or_zero();
            side = facing(normal);
        }
        if side.is_empty() {
            return wrong("no flat side".into(), "name one that is flat, or give a plane");
        }
        let top = LevelSurface::new(scene, side, normal);
        // 1 cm.
        let is_top = |&t: &usize| level(scene, t, normal) > top.level - 0.01 * metre;
        let triangles = top.triangles.into_iter().filter(is_top).collect();
        Ok(LevelSurface { triangles, name: group.into(), ..top })
    }

    /// The grid `height` above it, scene unit: over the smallest rectangle around it, where the
    /// surface reaches beyond the strip in all directions. None if no point is left.
    pub fn grid(
        &self,
        scene: &Scene,
        height: f64,
        settings: &GridSettings,
    ) -> Result<Option<MeasuringGrid>, Error> {
        let footprint = Footprint::new(self, scene);
        match self.plane(scene, height) {
            Some(plane) => self.filled(self.name.clone(), plane, settings, |p| footprint.has(p)),
            None => Ok(None),
        }
    }

    /// The grid in `plane` less the strip, of points from which all around, as far as the strip is
    /// wide, `has` is true. None if no point is left.
    pub fn filled(
        &self,
        name: String,
        plane: GridPlane,
        settings: &GridSettings,
        has: impl Fn(DVec3) -> bool,
    ) -> Result<Option<MeasuringGrid>, Error> {
        let strip = settings.strip_in_scene()?;
        let Some(inner) = plane.without(strip) else { return Ok(None) };
        let axes = self.axes(&inner);
        let around = |k: usize| {
            let (sin, cos) = libm::sincos(std::f64::consts::TAU * k as f64 / 8.0);
            strip * (cos * axes[0] + sin * axes[1])
        };
        let inside = |p: DVec3| has(p) && (0..8).all(|k| has(p + around(k)));
        let grid = MeasuringGrid::filling(name, inner, settings, inside)?;
        Ok(grid.points.iter().any(Option::is_some).then_some(grid))
    }

    /// Unit vectors along the first edge of `plane`, and across it.
    fn axes(&self, plane: &GridPlane) -> [DVec3; 2] {
        let along = plane.edges[0].normalize_or_zero();
        [along, self.normal.cross(along)]
    }

    /// The smallest rectangle around it, `height` above: its longer edge is the first, in the
    /// positive direction of an axis of the scene.
    pub fn plane(&self, scene: &Scene, height: f64) -> Option<GridPlane> {
        let (x, y) = self.normal.any_orthonormal_pair();
        let corners = self.triangles.iter().flat_map(|&t| scene.corners(t));
        let flat: Vec<DVec2> = corners.map(|p| DVec2::new(p.dot(x), p.dot(y))).collect();
        let Rectangle { corner, axis, size } = Rectangle::around(&flat)?;
        let in_space = |p: DVec2| x * p.x + y * p.y;
        let mut edges = [in_space(axis * size.x), in_space(axis.perp() * size.y)];
        let mut origin = in_space(corner) + self.normal * (self.level + height);
        // Turned by right angles until it fits; a turn moves the origin to the next corner.
        let is_wrong = |[u, v]: [DVec3; 2]| {
            let largest = u.to_array().into_iter().max_by(|a, b| a.abs().total_cmp(&b.abs()));
            u.length() < v.length() * (1.0 - 1e-9) || largest < Some(0.0)
        };
        for _ in 0..3 {
            if is_wrong(edges) {
                origin += edges[0];
                edges = [edges[1], -edges[0]];
            }
        }
        Some(GridPlane { origin, edges })
    }
}

/// Where a level surface is, from above.
pub(super) struct Footprint {
    triangles: RayScene,
    normal: DVec3,
    /// A distance beyond all of the scene.
    size: f64,
}

impl Footprint {
    pub fn new(surface: &LevelSurface, scene: &Scene) -> Footprint {
        let triangles = RayScene::new(surface.triangles.iter().map(|&t| scene.corners(t)));
        let size = 2.0 * scene.bounds().longest_side();
        Footprint { triangles, normal: surface.normal, size }
    }

    /// Whether it is above or below `p`.
    pub fn has(&self, p: DVec3) -> bool {
        let (above, reach) = (p + self.normal * self.size, 0.0..2.0 * self.size);
        self.triangles.occluded(above, -self.normal, reach, |_| true)
    }
}

/// Height of the highest corner of triangle `t` along unit `normal`, scene unit.
fn level(scene: &Scene, t: usize, normal: DVec3) -> f64 {
    scene.corners(t).map(|p| p.dot(normal)).into_iter().fold(f64::NEG_INFINITY, f64::max)
}
