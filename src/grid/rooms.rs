//! The rooms of a floor: its parts between walls, each with the rectangle around it.
//!
//! ```text
//!   a slab under two rooms, from above        a raster over it; two cells are in one room if no
//!   ┌─────────────┬─────────┐                 wall is between them at [`HEAD_HEIGHT`], or just
//!   │ 1 1 1 1 1 1 │ 2 2 2 2 │                 below the ceiling where that is lower
//!   │ 1 1 1 1 1 1   2 2 2 2 │
//!   └─────────────┴─────────┘
//! ```

use glam::{DVec2, DVec3};

use super::plane::GridPlane;
use crate::geometry::union_find::UnionFind;
use crate::visibility::ray_scene::RayScene;

/// Height at which walls part rooms, m: above doors (2.0 to 2.15 m), below beams and lintels of
/// galleries. Plain choice.
const HEAD_HEIGHT: f64 = 2.2;

/// Edge of a cell of the raster, m: rooms are wider than two, walls may be thinner than one.
const CELL: f64 = 0.25;

/// Maximum number of cells along a side: no raster over more than 256 m.
const MAX_CELLS: f64 = 1024.0;

/// Area below which a part of a floor is no room, m²: more than tables and cupboards have.
pub(super) const MIN_AREA: f64 = 4.0;

/// A raster over a floor.
pub(super) struct FloorRaster<'a> {
    rays: &'a RayScene,
    /// The rectangle around the floor, at its level.
    plane: GridPlane,
    normal: DVec3,
    /// Scene units in a metre.
    metre: f64,
    counts: [usize; 2],
    /// Of each cell the height above it that is free, scene unit; none where there is no floor, or
    /// the inside of a solid.
    free: Vec<Option<f64>>,
    /// The number of each cell's room.
    rooms: Vec<Option<usize>>,
    /// Number of rooms.
    room_count: usize,
}

impl<'a> FloorRaster<'a> {
    /// Over the rectangle `plane`, in which `is_floor` says where the floor is; none if it is too
    /// large.
    pub fn new(
        rays: &'a RayScene,
        plane: GridPlane,
        metre: f64,
        is_floor: impl Fn(DVec3) -> bool,
    ) -> Option<FloorRaster<'a>> {
        let [u, v] = plane.edges;
        let normal = u.cross(v).normalize_or_zero();
        let counts = plane.edges.map(|edge| (edge.length() / (CELL * metre)).ceil().max(1.0));
        if !counts.iter().all(|&count| count <= MAX_CELLS) {
            return None;
        }
        let counts = counts.map(|count| count as usize);
        let mut raster = FloorRaster {
            rays,
            plane,
            normal,
            metre,
            counts,
            free: vec![],
            rooms: vec![],
            room_count: 0,
        };
        let free = |k: usize| {
            Some(raster.middle(k)).filter(|&p| is_floor(p)).and_then(|p| raster.free_above(p))
        };
        raster.free = (0..counts[0] * counts[1]).map(free).collect();
        raster.part_rooms();
        Some(raster)
    }

    /// The middle of cell `k`.
    fn middle(&self, k: usize) -> DVec3 {
        let at = [k % self.counts[0], k / self.counts[0]];
        self.plane.at([0, 1].map(|axis| (at[axis] as f64 + 0.5) / self.counts[axis] as f64))
    }

    /// Height of the ceiling above `p`, infinite in the open; none where it is inside a solid as
    /// high as where rooms are parted. Lower solids, such as tables, do not matter.
    fn free_above(&self, p: DVec3) -> Option<f64> {
        let (up, start) = (self.normal, 1e-3 * self.metre);
        let ceiling = self.rays.closest_hit_of(p, up, start, None, |hit| hit.front);
        let free = ceiling.map_or(f64::INFINITY, |hit| hit.distance);
        let above = self.rays.closest_hit(p + up * self.height(free), up, 0.0, None);
        above.is_none_or(|hit| hit.front).then_some(free)
    }

    /// Height at which walls are looked for below a ceiling that is `free` high.
    fn height(&self, free: f64) -> f64 {
        (HEAD_HEIGHT * self.metre).min(0.95 * free)
    }

    /// Whether a wall is between points `a` and `b` of the floor with these free heights.
    fn is_wall_between(&self, a: DVec3, b: DVec3, free: f64) -> bool {
        self.rays.occluded(a + self.normal * self.height(free), b - a, 0.0..1.0, |_| true)
    }

    fn part_rooms(&mut self) {
        let mut joined = UnionFind::new(self.free.len());
        let columns = self.counts[0];
        for k in 0..self.free.len() {
            let Some(free) = self.free[k] else { continue };
            let right = (k % columns + 1 < columns).then_some(k + 1);
            for neighbour in right.into_iter().chain([k + columns]) {
                if let Some(&Some(other)) = self.free.get(neighbour)
                    && !self.is_wall_between(
                        self.middle(k),
                        self.middle(neighbour),
                        free.min(other),
                    )
                {
                    joined.join(k, neighbour);
                }
            }
        }
        let cell_area =
            self.plane.edges[0].cross(self.plane.edges[1]).length() / self.free.len() as f64;
        let mut area = vec![0.0; self.free.len()];
        for k in (0..self.free.len()).filter(|&k| self.free[k].is_some()) {
            area[joined.find(k)] += cell_area;
        }
        let mut numbers = vec![None; self.free.len()];
        self.rooms = vec![None; self.free.len()];
        for k in (0..self.free.len()).filter(|&k| self.free[k].is_some()) {
            let root = joined.find(k);
            if area[root] >= MIN_AREA * self.metre * self.metre {
                let number = *numbers[root].get_or_insert_with(|| {
                    self.room_count += 1;
                    self.room_count - 1
                });
                self.rooms[k] = Some(number);
            }
        }
    }

    /// Number of rooms.
    pub fn room_count(&self) -> usize {
        self.room_count
    }

    /// The room of point `p` of the floor: that of the nearest cell without a wall between.
    pub fn room_at(&self, p: DVec3) -> Option<usize> {
        let from = p - self.plane.origin;
        let at: [f64; 2] = std::array::from_fn(|axis| {
            let edge = self.plane.edges[axis];
            from.dot(edge) / edge.length_squared() * self.counts[axis] as f64
        });
        let around = (-1..=1).flat_map(|i| (-1..=1).map(move |j| [i, j]));
        let cells = around.filter_map(|step: [i64; 2]| {
            let cell: [i64; 2] = std::array::from_fn(|axis| at[axis].floor() as i64 + step[axis]);
            let is_inside = |axis: usize| (0..self.counts[axis] as i64).contains(&cell[axis]);
            let off = |axis: usize| at[axis] - (cell[axis] as f64 + 0.5);
            (is_inside(0) && is_inside(1)).then(|| {
                (libm::hypot(off(0), off(1)), cell[1] as usize * self.counts[0] + cell[0] as usize)
            })
        });
        let visible = cells.filter(|&(_, k)| {
            self.free[k].is_some_and(|free| !self.is_wall_between(self.middle(k), p, free))
        });
        visible.min_by(|a, b| a.0.total_cmp(&b.0)).and_then(|(_, k)| self.rooms[k])
    }

    /// The part of the rectangle around `room`: as far as walls and the floor reach from its cells;
    /// all of it where there is no other.
    pub fn rectangle(&self, room: usize) -> GridPlane {
        if self.room_count == 1 {
            return self.plane;
        }
        let (mut low, mut high) = (DVec2::ONE, DVec2::ZERO);
        for k in (0..self.rooms.len()).filter(|&k| self.rooms[k] == Some(room)) {
            let at =
                DVec2::new((k % self.counts[0]) as f64 + 0.5, (k / self.counts[0]) as f64 + 0.5);
            let at = at / DVec2::new(self.counts[0] as f64, self.counts[1] as f64);
            let reach = |edge: DVec3, rest: f64| rest * self.free_along(k, edge * rest);
            let [u, v] = self.plane.edges;
            high = high.max(at + DVec2::new(reach(u, 1.0 - at.x), reach(v, 1.0 - at.y)));
            low = low.min(at - DVec2::new(reach(-u, at.x), reach(-v, at.y)));
        }
        let edges =
            [self.plane.edges[0] * (high.x - low.x), self.plane.edges[1] * (high.y - low.y)];
        GridPlane { origin: self.plane.at(low.to_array()), edges }
    }

    /// Share of `way` from the middle of cell `k` that is free of walls, at most 1.
    fn free_along(&self, k: usize, way: DVec3) -> f64 {
        let from = self.middle(k) + self.normal * self.height(self.free[k].unwrap_or(0.0));
        self.rays.closest_hit(from, way, 0.0, None).map_or(1.0, |hit| hit.distance.min(1.0))
    }

    /// Whether it is a roof: in the open, without walls around, and above another floor.
    pub fn is_roof(&self, is_floor_below: impl Fn(DVec3) -> bool) -> bool {
        let cells: Vec<usize> = (0..self.free.len()).filter(|&k| self.free[k].is_some()).collect();
        let share = |has: &dyn Fn(usize) -> bool| {
            cells.iter().filter(|&&k| has(k)).count() as f64 / cells.len().max(1) as f64
        };
        let [u, v] = self.plane.edges;
        let is_walled = |k: usize| [u, v, -u, -v].iter().all(|&way| self.free_along(k, way) < 1.0);
        share(&|k| self.free[k] == Some(f64::INFINITY)) > 0.5
            && share(&is_walled) < 0.5
            && share(&|k| is_floor_below(self.middle(k))) > 0.5
    }
}
