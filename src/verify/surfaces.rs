//! Random points of the surfaces that reflect, group by group.
//!
//! Points are spread evenly over the area of a group. Where it is far larger than the place that
//! most of the scene is in, as a ground of a kilometre with a room on it, half of them are spread
//! over octaves of the distance from there: the light of the ground is all next to the room, where
//! an even spread has no point. Each then stands for the area over which it was spread.

use fastrand::Rng;
use glam::DVec3;

use super::path_tracer::{SurfacePoint, random_point};
use crate::error::{Error, ErrorKind};
use crate::scene::{Aabb, Scene, longest_edge};

/// The part of a group that reflects.
pub(super) struct ReflectingGroup {
    /// Index of the group in the scene.
    pub group: usize,
    /// Area that reflects, as a share of that of the scene.
    pub share: f64,
    cells: Vec<Cell>,
}

/// A part of a triangle.
struct Cell {
    triangle: usize,
    /// Weights of the triangle's second and third corner at its own.
    corners: [[f64; 2]; 3],
    /// Chance of a point to lie in it or in one before it.
    up_to: f64,
    /// Area that such a point stands for, over that of all points spread evenly.
    weight: f64,
}

/// A triangle from corner to corner, by weights of its second and third.
const WHOLE: [[f64; 2]; 3] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];

/// Share of the triangles that may lie outside of the place that most are in, at either end of each
/// axis.
const TRIMMED_SHARE: f64 = 0.1;

/// That place has to be this many times smaller than all of the scene,
const MIN_CONCENTRATION: f64 = 4.0;

/// but no more than so many: parts that are smaller are lost in the rounding of coordinates.
const MAX_CONCENTRATION: f64 = 1e9;

impl ReflectingGroup {
    /// Those of `scene` that reflect anything.
    pub fn all(scene: &Scene) -> Result<Vec<ReflectingGroup>, Error> {
        let mut groups: Vec<Vec<usize>> = vec![vec![]; scene.groups().len()];
        for (t, triangle) in scene.triangles().iter().enumerate() {
            if scene.material(t).scatters() && scene.solid_area(t) > 0.0 {
                groups[triangle.group as usize].push(t);
            }
        }
        let area = |group: &[usize]| group.iter().map(|&t| scene.solid_area(t)).sum::<f64>();
        let total: f64 = groups.iter().map(|group| area(group)).sum();
        let wrong = |found, remedy| Err(Error::new(ErrorKind::Scene, "materials", found, remedy));
        if total == 0.0 {
            return wrong("none that is used reflects", "give one a reflectance above 0");
        }
        if !scene.has_emitter() && !scene.has_light_of_no_surface() {
            return wrong("none that is used emits", "give one an exitance above 0, or a sky");
        }
        let centre = centre(scene, &groups.concat());
        let group = |(group, triangles): (usize, Vec<usize>)| {
            let share = area(&triangles) / total;
            let cells = cells(scene, &triangles, centre.as_ref());
            (share > 0.0).then_some(ReflectingGroup { group, share, cells })
        };
        Ok(groups.into_iter().enumerate().filter_map(group).collect())
    }

    /// A point at random, and the area that it stands for over that of points spread evenly.
    pub fn point(&self, scene: &Scene, rng: &mut Rng) -> (SurfacePoint, f64) {
        let at = rng.f64() * self.cells[self.cells.len() - 1].up_to;
        let k = self.cells.partition_point(|cell| cell.up_to <= at);
        let Cell { triangle, corners, weight, .. } = self.cells[k.min(self.cells.len() - 1)];
        let position = random_point(scene, triangle, corners, rng);
        (SurfacePoint { triangle, position }, weight)
    }
}

/// The place that most of `triangles` are in, if it is far smaller than the scene.
fn centre(scene: &Scene, triangles: &[usize]) -> Option<Aabb> {
    let middle = |&t: &usize| (scene.corners(t).iter().sum::<DVec3>() / 3.0, 1.0);
    let middles: Vec<(DVec3, f64)> = triangles.iter().map(middle).collect();
    let centre = Aabb::around_most(&middles, TRIMMED_SHARE)?;
    let concentration = scene.reflecting_bounds().diagonal() / centre.diagonal();
    (MIN_CONCENTRATION..MAX_CONCENTRATION).contains(&concentration).then_some(centre)
}

/// The parts of a group's `triangles` that points are spread over.
fn cells(scene: &Scene, triangles: &[usize], centre: Option<&Aabb>) -> Vec<Cell> {
    let mut parts = vec![];
    for &t in triangles {
        match centre {
            // Where holes are is not known part by part.
            Some(centre) if scene.solid_area(t) == scene.area(t) => {
                split(scene, t, centre, WHOLE, scene.area(t), &mut parts);
            }
            _ => parts.push((t, WHOLE, scene.solid_area(t))),
        }
    }
    let area: f64 = parts.iter().map(|&(.., area)| area).sum();
    let count = parts.len() as f64;
    let is_even = parts.len() == triangles.len();
    let mut up_to = 0.0;
    let cell = |(triangle, corners, part)| {
        let even = part / area;
        let chance = if is_even { even } else { (even + 1.0 / count) / 2.0 };
        up_to += chance;
        Cell { triangle, corners, up_to, weight: even / chance }
    };
    parts.into_iter().map(cell).collect()
}

/// Adds the part of triangle `t` with these `corners` and this `area` to `parts`: in four if it is
/// larger than its distance from `centre`, and so on.
fn split(
    scene: &Scene,
    t: usize,
    centre: &Aabb,
    corners: [[f64; 2]; 3],
    area: f64,
    parts: &mut Vec<(usize, [[f64; 2]; 3], f64)>,
) {
    let [a, b, c] = scene.corners(t);
    let places = corners.map(|[u, v]| a * (1.0 - u - v) + b * u + c * v);
    let bounds = Aabb::from_points(places);
    let gap = (centre.low - bounds.high).max(bounds.low - centre.high).max(DVec3::ZERO).length();
    if longest_edge(places) <= centre.diagonal() + gap {
        return parts.push((t, corners, area));
    }
    let middle =
        |k: usize, l: usize| [0, 1].map(|axis| (corners[k][axis] + corners[l][axis]) / 2.0);
    let (p, q, r) = (middle(0, 1), middle(1, 2), middle(2, 0));
    let [a, b, c] = corners;
    for part in [[a, p, r], [p, b, q], [r, q, c], [p, q, r]] {
        split(scene, t, centre, part, area / 4.0, parts);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, Triangle};

    /// A ground from -1000 to 1000 with a cube's side of 24 triangles near the origin, all grey.
    fn scene() -> Scene {
        let quad = |x: f64, half: f64, z: f64| {
            [[x - half, -half, z], [x + half, -half, z], [x + half, half, z], [x - half, half, z]]
        };
        let mut quads = vec![quad(0.0, 1000.0, 0.0)];
        quads.extend((0..12).map(|k| quad(0.1 * f64::from(k), 0.05, 1.0 + 0.1 * f64::from(k))));
        let positions = quads.concat().into_iter().map(DVec3::from_array).collect();
        let pair = |q: u32| {
            [[0, 1, 2], [0, 2, 3]].map(|corners| Triangle {
                corners: corners.map(|c| 4 * q + c),
                group: q.min(1),
                ..Default::default()
            })
        };
        let triangles = (0..13).flat_map(pair).collect();
        let groups = vec!["ground".into(), "room".into()];
        let bright = Material { exitance: crate::scene::Rgb::ONE, ..Material::grey("m", 0.5) };
        Scene::new(positions, triangles, groups, vec![bright]).unwrap()
    }

    #[test]
    fn a_place_of_no_size_is_none() {
        let scene = scene();
        let all: Vec<usize> = (0..scene.triangles().len()).collect();
        assert!(centre(&scene, &all).is_some());
        // Twenty times the same triangle, among others.
        let same: Vec<usize> = std::iter::repeat_n(2, 20).chain([0, 1]).collect();
        assert!(centre(&scene, &same).is_none());
    }

    #[test]
    fn a_wide_ground_has_points_near_the_room_and_each_stands_for_its_area() {
        let scene = scene();
        let groups = ReflectingGroup::all(&scene).unwrap();
        let mut rng = Rng::with_seed(1);
        const POINTS: usize = 100_000;
        let mut draw = |group: &ReflectingGroup| -> Vec<(DVec3, f64)> {
            let mut point = |_| {
                let (point, weight) = group.point(&scene, &mut rng);
                (point.position, weight)
            };
            (0..POINTS).map(&mut point).collect()
        };
        assert!(draw(&groups[1]).iter().all(|&(_, weight)| weight == 1.0));
        let ground = draw(&groups[0]);
        for half in [5.0, 50.0, 500.0, 1000.0f64] {
            let within = |p: &&(DVec3, f64)| p.0.x.abs() <= half && p.0.y.abs() <= half;
            let area: f64 = ground.iter().filter(within).map(|(_, weight)| weight).sum();
            let count = ground.iter().filter(within).count();
            let share = (half / 1000.0).powi(2);
            // Half of the points are in about ten octaves: of 5, 7 % at least.
            assert!(count as f64 > 0.035 * POINTS as f64, "{half}: {count}");
            // Weights of `count` points scatter by no more than twice their mean.
            let allowed = 4.0 * 2.0 / (count as f64).sqrt();
            assert!((area / POINTS as f64 / share - 1.0).abs() < allowed, "{half}: {area}");
        }
    }
}
