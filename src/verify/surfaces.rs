//! Random points of the surfaces that reflect, group by group.
//!
//! Half of the points are spread evenly over the area of a group, the others over octaves of the
//! distance from the place that most of the scene is in ([`octaves`](crate::sampling::octaves)):
//! where all is near, that is evenly too. Each stands for the area over which it was spread.

use std::sync::Arc;

use fastrand::Rng;
use glam::DVec3;

use crate::error::{Error, ErrorKind};
use crate::light::{SurfacePoint, random_point};
use crate::sampling::octaves::{Octaves, Part};
use crate::scene::Scene;

/// The part of a group that reflects.
#[derive(Debug)]
pub(super) struct ReflectingGroup {
    /// Index of the group in the scene.
    pub group: usize,
    /// Area that reflects, as a share of that of the scene.
    pub share: f64,
    cells: Vec<Cell>,
}

/// A part of a triangle.
#[derive(Debug)]
struct Cell {
    triangle: usize,
    part: Part,
    /// Chance of a point to lie in it or in one before it.
    up_to: f64,
    /// Area that such a point stands for, over that of all points spread evenly.
    weight: f64,
}

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
        let octaves = octaves_of(scene);
        let group = |(group, triangles): (usize, Vec<usize>)| {
            let share = area(&triangles) / total;
            let cells = cells(scene, &triangles, &octaves);
            (share > 0.0).then_some(ReflectingGroup { group, share, cells })
        };
        Ok(groups.into_iter().enumerate().filter_map(group).collect())
    }

    /// A point at random, and the area that it stands for over that of points spread evenly.
    pub fn point(&self, scene: &Scene, rng: &mut Rng) -> (SurfacePoint, f64) {
        let at = rng.f64() * self.cells[self.cells.len() - 1].up_to;
        let k = self.cells.partition_point(|cell| cell.up_to <= at);
        let Cell { triangle, part, weight, .. } = &self.cells[k.min(self.cells.len() - 1)];
        let position = random_point(scene, *triangle, part, rng);
        (SurfacePoint { triangle: *triangle, position }, *weight)
    }
}

/// The octaves of distance over which points of `scene` are spread; computed once.
pub(crate) fn octaves_of(scene: &Scene) -> Arc<Octaves> {
    scene.derived(|scene| {
        let reflecting = (0..scene.triangles().len()).filter(|&t| scene.material(t).scatters());
        let middle = |t: usize| scene.corners(t).iter().sum::<DVec3>() / 3.0;
        Octaves::new(reflecting.map(middle), scene.reflecting_bounds().diagonal())
    })
}

/// The parts of a group's `triangles` that points are spread over.
fn cells(scene: &Scene, triangles: &[usize], octaves: &Octaves) -> Vec<Cell> {
    let mut parts: Vec<(usize, Part)> = vec![];
    for &t in triangles {
        let (area, solid) = (scene.area(t), scene.solid_area(t));
        let mut take = |part| parts.push((t, part));
        octaves.for_each_part(scene.corners(t), solid, solid != area, &mut take);
    }
    let area: f64 = parts.iter().map(|(_, part)| part.area).sum();
    let angular: f64 = parts.iter().map(|(_, part)| part.angular).sum();
    let mut up_to = 0.0;
    let cell = |(triangle, part): (usize, Part)| {
        let even = part.area / area;
        let chance = (even + part.angular / angular) / 2.0;
        up_to += chance;
        Cell { triangle, part, up_to, weight: even / chance }
    };
    parts.into_iter().map(cell).collect()
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
        // Of 1.49 in all, a tenth at either end are no more than 0.2 off: 1 to 1/1.13² in density.
        assert!(draw(&groups[1]).iter().all(|&(_, weight)| (0.87..1.14).contains(&weight)));
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
