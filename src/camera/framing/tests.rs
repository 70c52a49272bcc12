use super::*;
use crate::mesh::Mesh;
use crate::scene::{Material, Rgb, Scene, Triangle};

/// Boxes from `low` to `high` in (x, depth, height), `inward` where the front is within, each a
/// group; height goes along `up`.
fn light_of(boxes: &[([f64; 3], [f64; 3], bool)], up: DVec3) -> GatheredMesh {
    let (mut positions, mut triangles) = (vec![], vec![]);
    for (group, &(low, high, inward)) in boxes.iter().enumerate() {
        let bounds = Aabb { low: low.into(), high: high.into() };
        for face in Aabb::FACES {
            let first = positions.len() as u32;
            for corner in face.map(|k| bounds.corners()[k]) {
                // A turn about x takes z to y, if y is up.
                let turned = DVec3::new(corner.x, corner.z, -corner.y);
                positions.push(if up == DVec3::Y { turned } else { corner });
            }
            for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
                let corners = if inward { [a, c, b] } else { [a, b, c] };
                let corners = corners.map(|k| first + k);
                let group = group as u32;
                triangles.push(Triangle { corners, group, material: 0, smoothing: None });
            }
        }
    }
    let names = (0..boxes.len()).map(|k| k.to_string()).collect();
    let materials = vec![Material::grey("grey", 0.5)];
    let scene = Scene::new(positions, triangles, names, materials).unwrap();
    let size = (scene.bounds().diagonal() / 50.0).max(10.0);
    let mesh = Mesh::new(scene, size).unwrap();
    GatheredMesh::from_elements(&mesh, &vec![Rgb::ONE; mesh.element_count()]).unwrap()
}

/// A tunnel whose last twentieth alone is lit, as 1; the rest as 1e-9.
#[test]
fn what_is_lit_is_seen_in_a_dark_tunnel() {
    let mut light = light_of(&[([0.0; 3], [100.0, 3.0, 3.0], true)], DVec3::Z);
    let lit = |p: &DVec3| if p.x > 95.0 { 1.0 } else { 1e-9 };
    light.surface.radiosity = light.surface.positions.iter().map(|p| Rgb::splat(lit(p))).collect();
    let camera = Camera::framing(&light, 1.0);
    assert!(camera.eye.x > 90.0, "{camera:?}");
}

/// A face as far away as 1e18 leaves no room for unit lengths beside coordinates.
#[test]
fn what_is_far_away_breaks_no_view() {
    let light = light_of(&[([0.0; 3], [1.0; 3], false), ([1e18; 3], [2e18; 3], false)], DVec3::Z);
    let camera = Camera::framing(&light, 1.0);
    assert!(camera.check(4, 4, 1).is_ok(), "{camera:?}");
}

fn bounds(light: &GatheredMesh) -> Aabb {
    light.mesh.scene().bounds()
}

#[test]
fn eye_is_inside_a_room_and_outside_an_object() {
    let furniture = ([1.0, 1.0, 0.0], [2.0, 2.0, 1.0], false);
    for up in [DVec3::Y, DVec3::Z] {
        let room = light_of(&[([0.0; 3], [5.0, 4.0, 2.5], true), furniture], up);
        let camera = Camera::framing(&room, 1.0);
        assert!(bounds(&room).contains(camera.eye), "{camera:?}");
        let object = light_of(&[furniture], up);
        let camera = Camera::framing(&object, 1.0);
        assert!(!bounds(&object).contains(camera.eye), "{camera:?}");
    }
}

/// All of an object is in the picture, whatever its width over height, and fills it: a corner of
/// its box reaches the margin.
#[test]
fn object_fills_the_picture() {
    let table = ([3.0, 1.0, 0.0], [5.0, 2.0, 0.8], false);
    for aspect in [0.5, 1.0, 3.0] {
        let light = light_of(&[table], DVec3::Z);
        let camera = Camera::framing(&light, aspect);
        let [right, up, forward] = camera.frame();
        let tangent = (camera.vertical_fov.to_radians() / 2.0).tan();
        let point = |p: DVec3| {
            let to = p - camera.eye;
            let scale = to.dot(forward) * tangent;
            [to.dot(right) / scale / aspect, to.dot(up) / scale]
        };
        let corners = bounds(&light).corners().map(point);
        let reach = |k: usize, sign: f64| {
            corners.iter().map(|c| sign * c[k]).fold(f64::NEG_INFINITY, f64::max)
        };
        let reaches = [reach(0, 1.0), reach(0, -1.0), reach(1, 1.0), reach(1, -1.0)];
        // The camera is rounded to 1e-4 of the scene.
        let most = reaches.into_iter().fold(0.0, f64::max);
        assert!((most - (1.0 - 2.0 * 0.04)).abs() < 1e-3, "{aspect}: {reaches:?}");
    }
}

#[test]
fn houses_stand_upright() {
    // A tower on a ground, and a lower house that is turned: two boxes as one.
    for up in [DVec3::Y, DVec3::Z] {
        let ground = ([-9.0, -9.0, -0.1], [9.0, 9.0, 0.0], false);
        let tower = ([0.0, 0.0, 0.0], [2.0, 2.0, 9.0], false);
        let light = light_of(&[ground, tower], up);
        let camera = Camera::framing(&light, 1.0);
        assert_eq!(camera.up, up);
        assert!((camera.eye - bounds(&light).centre()).dot(up) > 0.0, "{camera:?}");
    }
}

/// What is given as up is: the view is from 25 degrees above.
#[test]
fn view_is_upright_where_up_is_given() {
    let table = [([0.0, 0.0, 0.0], [2.0, 1.0, 0.1], false)];
    let scene = light_of(&table, DVec3::Z).mesh.scene().clone();
    let view = |scene: Scene| {
        let mesh = Mesh::new(scene, 10.0).unwrap();
        let radiosity = vec![Rgb::ONE; mesh.element_count()];
        Camera::framing(&GatheredMesh::from_elements(&mesh, &radiosity).unwrap(), 1.0)
    };
    for up in [DVec3::Y, DVec3::Z, DVec3::NEG_Y, DVec3::X, DVec3::new(0.0, 3.0, 3.0)] {
        let camera = view(scene.clone().with_up(up));
        assert_eq!(camera.up, up.normalize());
        // Rounded to 1e-4 of the scene.
        let down = (camera.target - camera.eye).normalize().dot(camera.up);
        assert!((down + 25f64.to_radians().sin()).abs() < 1e-3, "{up}: {camera:?}");
        assert!(camera.check(4, 4, 1).is_ok());
    }
    // By default it is the axis of the scene, and no direction is as none given.
    let found = scene.up();
    assert_eq!(view(scene.clone()), view(scene.clone().with_up(found)));
    assert_eq!(view(scene.clone()), view(scene.with_up(DVec3::ZERO)));
}

/// A small object on a ground a hundred times its size is framed, not the ground.
#[test]
fn ground_does_not_make_the_object_small() {
    let parts: Vec<_> = (0..40)
        .map(|k| ([f64::from(k % 5), f64::from(k / 5 % 2), 0.0], f64::from(k / 10 + 1)))
        .map(|(low, height)| (low, [low[0] + 0.8, low[1] + 0.8, height], false))
        .chain([([-300.0, -300.0, -0.1], [300.0, 300.0, 0.0], false)])
        .collect();
    let camera = Camera::framing(&light_of(&parts, DVec3::Z), 1.0);
    assert!(camera.eye.length() < 50.0, "{camera:?}");
}

#[test]
fn views_are_rounded_to_what_shows_no_difference() {
    let light = light_of(&[([1.0 / 3.0; 3], [5.0 / 3.0; 3], false)], DVec3::Y);
    let camera = Camera::framing(&light, 1.0);
    assert!(camera.eye.to_array().iter().all(|x| format!("{x}").len() <= 7), "{camera:?}");
    assert_eq!(camera, Camera::framing(&light, 1.0));
}

/// A room that lacks the wall at x = 5 is seen from there, level.
#[test]
fn room_that_lacks_a_wall_is_seen_through_the_opening() {
    let room = light_of(&[([0.0; 3], [5.0, 4.0, 2.5], true)], DVec3::Y);
    let scene = room.mesh.scene();
    let is_left = |t: &&Triangle| t.corners.iter().any(|&c| scene.positions()[c as usize].x < 5.0);
    let triangles = scene.triangles().iter().filter(is_left).cloned().collect();
    let (groups, materials) = (scene.groups().to_vec(), scene.materials().to_vec());
    let scene = Scene::new(scene.positions().to_vec(), triangles, groups, materials).unwrap();
    let mesh = Mesh::new(scene, 10.0).unwrap();
    let light = GatheredMesh::from_elements(&mesh, &vec![Rgb::ONE; mesh.element_count()]).unwrap();
    let camera = Camera::framing(&light, 1.0);
    assert!(camera.eye.x > 5.0 && camera.eye.y == camera.target.y, "{camera:?}");
}
