//! Panes, blocks and balls of glass, against rays that are refracted by hand.

use glam::DVec3;
use radiosity::gather::{GatherPoint, IrradianceSample, RadiosityField};
use radiosity::{Camera, Error, Gather, Material, Rgb, Scene, Triangle};

use super::{
    LEFT_OUT, SIZE, block_of, directions, draw, glass, leaves, lit_walls, scene, tinted_glass,
    wall_radiance,
};
use crate::common::keep_counting;
use crate::common::scenes::{Quad, grey, walls};

const ROOM: [f64; 2] = [-3.0, 3.0];

const CAMERA: Camera = Camera {
    eye: DVec3::new(-2.3, 0.9, 0.7),
    target: DVec3::new(0.0, 0.1, 0.0),
    up: DVec3::Y,
    vertical_fov: 45.0,
};

fn room() -> Vec<(Quad, Material)> {
    walls([ROOM[0]; 3], [ROOM[1]; 3]).map(|quad| (quad, grey())).to_vec()
}

/// Radiance of the wall that a ray within the room meets.
fn of_wall(from: DVec3, direction: DVec3) -> Rgb {
    wall_radiance(leaves(DVec3::splat(ROOM[0]), DVec3::splat(ROOM[1]), from, direction))
}

/// Most radiance of the walls in any channel.
const BRIGHTEST: f64 = 7.0;

/// Reflectance of a boundary, by the angles on both sides (Fresnel 1823).
fn reflectance(sine: f64, ratio: f64) -> f64 {
    if sine < 1e-9 {
        return ((ratio - 1.0) / (ratio + 1.0)).powi(2);
    }
    if sine >= ratio {
        return 1.0;
    }
    let (a, b) = (sine.asin(), (sine / ratio).asin());
    let perpendicular = ((a - b).sin() / (a + b).sin()).powi(2);
    let parallel = ((a - b).tan() / (a + b).tan()).powi(2);
    (perpendicular + parallel) / 2.0
}

/// Faces with the corners the other way round.
pub fn turned_inside_out(faces: &[(Quad, Material)]) -> Vec<(Quad, Material)> {
    faces.iter().map(|([a, b, c, d], material)| ([*a, *d, *c, *b], material.clone())).collect()
}

/// Triangles of a ball of radius 1, seen from outside: an icosahedron, each in four, `levels`
/// times.
fn ball(levels: u32) -> Vec<[DVec3; 3]> {
    let g = (1.0 + 5f64.sqrt()) / 2.0;
    let axes =
        |[x, y, z]: [f64; 3]| [DVec3::new(x, y, z), DVec3::new(z, x, y), DVec3::new(y, z, x)];
    let rims = [[0.0, 1.0, g], [0.0, -1.0, g], [0.0, 1.0, -g], [0.0, -1.0, -g]];
    let corners: Vec<DVec3> = rims.into_iter().flat_map(axes).map(DVec3::normalize).collect();
    let mut faces = vec![];
    for (i, &a) in corners.iter().enumerate() {
        for (j, &b) in corners.iter().enumerate().skip(i + 1) {
            for &c in &corners[j + 1..] {
                if [(a, b), (b, c), (c, a)].iter().all(|(p, q)| p.distance(*q) < 1.2) {
                    let outwards = (b - a).cross(c - a).dot(a) > 0.0;
                    faces.push(if outwards { [a, b, c] } else { [a, c, b] });
                }
            }
        }
    }
    for _ in 0..levels {
        let parts = |[a, b, c]: [DVec3; 3]| {
            let [d, e, f] = [(b + c), (c + a), (a + b)].map(DVec3::normalize);
            [[a, f, e], [f, b, d], [e, d, c], [d, e, f]]
        };
        faces = faces.into_iter().flat_map(parts).collect();
    }
    faces
}

/// A scene of quadrilaterals and a ball.
pub fn with_ball(
    quads: &[(Quad, Material)],
    material: &Material,
    middle: DVec3,
    radius: f64,
    levels: u32,
) -> Scene {
    let quads = scene(quads);
    let (mut positions, mut triangles) = (quads.positions().to_vec(), quads.triangles().to_vec());
    let mut materials = quads.materials().to_vec();
    materials.push(material.clone());
    let mut groups = quads.groups().to_vec();
    groups.push("ball".into());
    for corners in ball(levels) {
        let first = positions.len() as u32;
        positions.extend(corners.map(|p| middle + radius * p));
        let (group, material) = (groups.len() as u32 - 1, materials.len() as u32 - 1);
        let corners = [first, first + 1, first + 2];
        triangles.push(Triangle { corners, group, material, smoothing: None });
    }
    Scene::new(positions, triangles, groups, materials).unwrap()
}

#[test]
fn panes_let_through_what_they_do_not_reflect() {
    let (n, tint) = (1.5, Rgb::new(1.0, 0.6, 0.0));
    let sheet = [[0., -1., -1.], [0., 1., -1.], [0., 1., 1.], [0., -1., 1.]];
    let material = tinted_glass(n, tint);
    // From its front, from its back, and as a file has it that shows it from both sides.
    let [front, back] = [
        vec![(sheet, material.clone())],
        vec![([sheet[0], sheet[3], sheet[2], sheet[1]], material)],
    ];
    for sheets in [front.clone(), back.clone(), [front, back].concat()] {
        let image = draw(&CAMERA, &lit_walls(scene(&[room(), sheets].concat())), 1);
        let mut seen = 0;
        for (&pixel, direction) in image.pixels.iter().zip(directions(&CAMERA)) {
            let at = CAMERA.eye - direction * (CAMERA.eye.x / direction.x);
            let straight = of_wall(CAMERA.eye, direction);
            let want = if direction.x > 0.0 && at.y.abs() < 1.0 && at.z.abs() < 1.0 {
                seen += 1;
                let face = reflectance((1.0 - direction.x * direction.x).sqrt(), n);
                let mirrored = of_wall(at, direction * DVec3::new(-1.0, 1.0, 1.0));
                // All ways that come out, by the number of times that they cross the pane.
                let (mut sum, mut inside) = (face * mirrored, Rgb::splat(1.0 - face));
                for crossing in 0..60 {
                    inside *= tint;
                    let out = if crossing % 2 == 0 { straight } else { mirrored };
                    sum += (1.0 - face) * inside * out;
                    inside *= face;
                }
                sum
            } else {
                straight
            };
            assert!((pixel - want).length() < 1e-9, "{pixel} {want}");
        }
        assert!(seen > 100, "{seen}");
    }
}

/// A block of glass, and rays through it.
struct Block {
    low: DVec3,
    high: DVec3,
    n: f64,
    /// Radiance of what lies against its underside, if anything does.
    floor: Option<fn(DVec3) -> Rgb>,
}

impl Block {
    /// Where a ray from outside enters, and the axis of the face.
    fn enters(&self, from: DVec3, direction: DVec3) -> Option<(DVec3, usize)> {
        let near = DVec3::select(direction.cmpgt(DVec3::ZERO), self.low, self.high);
        let ways = (near - from) / direction;
        let axis = (0..3).fold(0, |a, b| if ways[b] > ways[a] { b } else { a });
        let at = from + direction * ways[axis];
        let within = (0..3).all(|k| k == axis || (self.low[k]..self.high[k]).contains(&at[k]));
        (ways[axis] > 0.0 && within).then_some((at, axis))
    }

    fn radiance_outside(&self, from: DVec3, direction: DVec3, weight: f64) -> Rgb {
        let Some((at, axis)) = self.enters(from, direction) else {
            return weight * of_wall(from, direction);
        };
        let cosine = direction[axis].abs();
        let share = reflectance((1.0 - cosine * cosine).max(0.0).sqrt(), self.n);
        let mut mirrored = direction;
        mirrored[axis] *= -1.0;
        let mut bent = direction / self.n;
        bent[axis] = 0.0;
        bent[axis] = (1.0 - bent.length_squared()).sqrt() * direction[axis].signum();
        weight * share * of_wall(at, mirrored)
            + self.radiance_inside(at, bent, weight * (1.0 - share))
    }

    fn radiance_inside(&self, from: DVec3, direction: DVec3, weight: f64) -> Rgb {
        if weight < 1e-9 {
            return Rgb::ZERO;
        }
        let far = DVec3::select(direction.cmpgt(DVec3::ZERO), self.high, self.low);
        let ways = (far - from) / direction;
        let axis = (0..3).fold(0, |a, b| if ways[b] < ways[a] { b } else { a });
        let at = from + direction * ways[axis];
        if let Some(floor) = self.floor.filter(|_| axis == 1 && direction.y < 0.0) {
            return weight * floor(at);
        }
        let cosine = direction[axis].abs();
        let share = reflectance((1.0 - cosine * cosine).max(0.0).sqrt(), 1.0 / self.n);
        let mut mirrored = direction;
        mirrored[axis] *= -1.0;
        let back = self.radiance_inside(at, mirrored, weight * share);
        if share == 1.0 {
            return back;
        }
        let mut bent = direction * self.n;
        bent[axis] = 0.0;
        bent[axis] = (1.0 - bent.length_squared()).sqrt() * direction[axis].signum();
        // What leaves a block does not meet it again.
        back + weight * (1.0 - share) * of_wall(at, bent)
    }
}

#[test]
fn blocks_refract_and_reflect_totally_as_by_hand() {
    let (low, high) = ([-0.7, -0.6, -0.8], [0.6, 0.5, 0.4]);
    let faces = block_of(low, high, &glass(1.5));
    let block = Block { low: low.into(), high: high.into(), n: 1.5, floor: None };
    // However it is wound.
    for faces in [faces.clone(), turned_inside_out(&faces)] {
        let image = draw(&CAMERA, &lit_walls(scene(&[room(), faces].concat())), 1);
        let mut seen = 0;
        for (&pixel, direction) in image.pixels.iter().zip(directions(&CAMERA)) {
            seen += usize::from(block.enters(CAMERA.eye, direction).is_some());
            let want = block.radiance_outside(CAMERA.eye, direction, 1.0);
            let off = (want - pixel).abs().max_element();
            assert!(off <= LEFT_OUT * BRIGHTEST + 1e-9, "{pixel} {want}");
        }
        assert!(seen > 100, "{seen}");
    }
}

#[test]
fn what_lies_against_glass_is_seen_through_it() {
    let (low, high) = ([-0.7, -0.6, -0.8], [0.6, 0.5, 0.4]);
    let floor =
        ([[-2.0, -0.6, -2.0], [-2.0, -0.6, 2.0], [2.0, -0.6, 2.0], [2.0, -0.6, -2.0]], grey());
    let faces = block_of(low, high, &glass(1.5));
    let block = Block { low: low.into(), high: high.into(), n: 1.5, floor: Some(wall_radiance) };
    let camera = Camera { eye: DVec3::new(-0.9, 2.3, 0.7), vertical_fov: 20.0, ..CAMERA };
    // Whichever comes first in the file.
    for (first, second) in [(vec![floor.clone()], faces.clone()), (faces, vec![floor])] {
        let light = lit_walls(scene(&[room(), first, second].concat()));
        let image = draw(&camera, &light, 1);
        let mut seen = 0;
        for (&pixel, direction) in image.pixels.iter().zip(directions(&camera)) {
            // Those that go from the top to the floor, and not by a side.
            let Some((at, 1)) = block.enters(camera.eye, direction) else { continue };
            let bent = (direction / block.n).with_y(0.0);
            let down = at + bent / (1.0 - bent.length_squared()).sqrt() * (high[1] - low[1]);
            let within = |k: usize| (low[k]..high[k]).contains(&down[k]);
            if !(within(0) && within(2)) {
                continue;
            }
            seen += 1;
            let want = block.radiance_outside(camera.eye, direction, 1.0);
            let off = (want - pixel).abs().max_element();
            assert!(off <= LEFT_OUT * BRIGHTEST, "{pixel} {want}");
        }
        assert!(seen > 100, "{seen}");
    }
}

#[test]
fn ball_refracts_as_a_sphere() {
    let (n, radius, middle) = (1.5, 0.8, DVec3::new(0.1, 0.0, -0.2));
    let light = lit_walls(with_ball(&room(), &glass(n), middle, radius, 5));
    let camera = Camera { target: middle, vertical_fov: 40.0, ..CAMERA };
    let image = draw(&camera, &light, 1);
    let mut seen = 0;
    for (&pixel, direction) in image.pixels.iter().zip(directions(&camera)) {
        let to = middle - camera.eye;
        let along = to.dot(direction);
        let square = radius * radius - (to.length_squared() - along * along);
        // At the rim what is refracted turns by any angle within a facet.
        if square < 0.1 * radius * radius {
            continue;
        }
        seen += 1;
        let enters = camera.eye + direction * (along - square.sqrt());
        let normal = (enters - middle) / radius;
        let cosine = -normal.dot(direction);
        let sine = (1.0 - cosine * cosine).sqrt();
        let face = reflectance(sine, n);
        let mut want = face * of_wall(enters, direction + 2.0 * cosine * normal);
        // In the plane of incidence all chords are alike: from one end to the other the radius
        // turns by π − 2 θ' around the middle, and what leaves is at θ to it.
        let tangent = (direction + cosine * normal).normalize_or_zero();
        let chord = std::f64::consts::PI - 2.0 * (sine / n).asin();
        let mut weight = 1.0 - face;
        for k in 1..30 {
            let (sin, cos) = (f64::from(k) * chord).sin_cos();
            let (out, along) = (cos * normal + sin * tangent, cos * tangent - sin * normal);
            let leaving = cosine * out + sine * along;
            want += weight * (1.0 - face) * of_wall(middle + radius * out, leaving);
            weight *= face;
        }
        // The triangles are off the sphere by (edge / radius)² / 8 = 1.7e-4 radii, their smooth
        // normals by as much; lines of sight turn by some ten times that, to walls that are four
        // radii away and change by 0.4 a unit.
        let off = (want - pixel).abs().max_element();
        assert!(off <= LEFT_OUT * BRIGHTEST + 0.01, "{pixel} {want}");
    }
    assert!(seen > 200, "{seen}");
}

/// Straight on through the middle of things all reflections are along one line, and boundaries are
/// a stack of plates: m pairs of them let (1 − R) / (1 + (2 m − 1) R) through (Stokes 1862).
#[test]
fn bubbles_and_bodies_within_bodies_are_told_apart() {
    let camera = Camera {
        eye: DVec3::new(-2.5, 0.0, 0.0),
        target: DVec3::ZERO,
        up: DVec3::Y,
        vertical_fov: 1e-6,
    };
    let n: f64 = 1.5;
    let face = ((n - 1.0) / (n + 1.0)).powi(2);
    let outer = || block_of([-1.0; 3], [1.0; 3], &glass(n));
    let inner = || block_of([-0.5; 3], [0.5; 3], &glass(n));
    // The wall ahead shines, and the one behind does not.
    let ahead = [[3., -3., -3.], [3., -3., 3.], [3., 3., 3.], [3., 3., -3.]];
    let through = |glass: Vec<(Quad, Material)>, eye: DVec3| {
        let light = lit_walls(scene(&[vec![(ahead, grey())], glass].concat()));
        let pixel = draw(&Camera { eye, ..camera }, &light, 1).pixels[0];
        pixel.x / wall_radiance(DVec3::new(3.0, 0.0, 0.0)).x
    };
    let stack = |pairs: f64| (1.0 - face) / (1.0 + (2.0 * pairs - 1.0) * face);
    let is = |found: f64, want: f64| assert!((found - want).abs() <= LEFT_OUT, "{found} {want}");
    is(through(outer(), camera.eye), stack(1.0));
    let bubble = turned_inside_out(&inner());
    is(through([outer(), bubble.clone()].concat(), camera.eye), stack(2.0));
    // All of it inside out.
    let inside_out = turned_inside_out(&[outer(), bubble].concat());
    is(through(inside_out, camera.eye), stack(2.0));
    // A body of the same glass in it changes nothing, and from inside neither does it.
    is(through([outer(), inner()].concat(), camera.eye), stack(1.0));
    let between = DVec3::new(-0.75, 0.0, 0.0);
    // One boundary ahead and one behind: (1 − R) (1 + R² + …).
    let from_inside = (1.0 - face) / (1.0 - face * face);
    is(through(outer(), between), from_inside);
    is(through([outer(), inner()].concat(), between), from_inside);
    // An open box is five panes, two of which are in the way.
    is(through(outer()[..5].to_vec(), camera.eye), stack(2.0));
}

#[test]
fn gathered_pixels_gather_where_glass_shows_them() {
    struct Walls;
    impl Gather for Walls {
        fn gather(
            &mut self,
            _: &RadiosityField,
            points: &[GatherPoint],
        ) -> Result<Vec<IrradianceSample>, Error> {
            let irradiance =
                |p: &GatherPoint| 2.0 * std::f64::consts::PI * wall_radiance(p.position);
            let sample = |p| IrradianceSample { irradiance: irradiance(p), ..Default::default() };
            Ok(points.iter().map(sample).collect())
        }
    }
    let sheet = [[0., -1., -1.], [0., 1., -1.], [0., 1., 1.], [0., -1., 1.]];
    let tinted = tinted_glass(1.5, Rgb::new(1.0, 0.6, 0.0));
    let block = block_of([0.5, -0.6, -0.8], [1.1, 0.5, 0.4], &glass(1.4));
    let things = [vec![(sheet, tinted)], block].concat();
    // Grey reflects a half, so that what is gathered is the same as at the vertices.
    let light = lit_walls(scene(&[room(), things].concat()));
    let plain = draw(&CAMERA, &light, 1);
    let gathered = CAMERA.gathered_image(&light, &mut Walls, SIZE.0, SIZE.1, 1, keep_counting);
    let gathered = gathered.unwrap().unwrap();
    for (a, b) in plain.pixels.iter().zip(&gathered.pixels) {
        // Points are lifted off walls of 6 by 6, in halves, by 1e-4 of √18.
        assert!((*a - *b).length() < 1e-3, "{a} {b}");
    }
}
