//! The camera image of a surface.

use glam::DVec3;
use radiosity::backend::cpu::RayRows;
use radiosity::{Camera, ErrorKind, Material, Mesh, Rgb, Solver, VertexMesh};

use crate::common::{keep_going, quads};

#[test]
fn image_shows_fronts_and_black_backs() {
    // A glowing square left of a dark one, seen from its front; nothing around.
    let glow = Material { exitance: Rgb::splat(std::f64::consts::PI), ..Material::grey("g", 0.0) };
    let left = [[-1., -1., 0.], [0., -1., 0.], [0., 1., 0.], [-1., 1., 0.]];
    let right = [[0., -1., 0.], [1., -1., 0.], [1., 1., 0.], [0., 1., 0.]];
    let mesh = Mesh::new(quads(&[(left, glow), (right, Material::grey("d", 0.0))]), 9.0).unwrap();
    let solution =
        Solver::default().solve(&mesh, &mut RayRows::new(&mesh, 16).unwrap(), keep_going).unwrap();
    let surface = VertexMesh::new(&mesh, &solution.radiosity);
    let camera = Camera {
        eye: DVec3::new(0., 0., 2.),
        target: DVec3::ZERO,
        up: DVec3::Y,
        vertical_fov: 90.0,
    };
    // 8 pixels span 4 at distance 2: half a unit each. Radiance of the glow is 1.
    let image = camera.image(&surface, 8, 8, 2).unwrap();
    let row = |y: usize| image.pixels[8 * y..8 * y + 8].iter().map(|c| c.x).collect::<Vec<_>>();
    assert_eq!(row(0), [0.0; 8]);
    for (x, radiance) in row(3).into_iter().enumerate() {
        let want = if (2..4).contains(&x) { 1.0 } else { 0.0 };
        assert!((radiance - want).abs() < 1e-12, "{x}: {radiance}");
    }
    // From behind, backs are black.
    let behind = Camera { eye: DVec3::new(0., 0., -2.), ..camera };
    assert!(behind.image(&surface, 8, 8, 1).unwrap().pixels.iter().all(|&c| c == Rgb::ZERO));
    // Straight up, and bad settings.
    let up = Camera { eye: DVec3::ZERO, target: DVec3::Y, up: DVec3::Y, vertical_fov: 40.0 };
    assert!(up.image(&surface, 2, 2, 1).is_ok());
    for bad in [
        Camera { vertical_fov: 0.0, ..camera },
        Camera { vertical_fov: 180.0, ..camera },
        Camera { target: camera.eye, ..camera },
        Camera { eye: DVec3::NAN, ..camera },
        Camera { up: DVec3::ZERO, ..camera },
        Camera { up: DVec3::INFINITY, ..camera },
    ] {
        assert_eq!(bad.image(&surface, 8, 8, 1).unwrap_err().kind(), ErrorKind::Setting);
    }
    for (width, height, samples) in [(0, 8, 1), (8, 0, 1), (1 << 20, 8, 1), (8, 8, 0)] {
        assert!(camera.image(&surface, width, height, samples).is_err());
    }
}

/// A sheet that glows on both sides, each cut into triangles and elements its own way, as those of
/// a light map are: no ray takes the back of one for what it sees.
#[test]
fn image_shows_the_front_of_a_sheet_with_two_sides() {
    let front = [[-1., -1., 0.3], [1., -1., 0.1], [1., 1., 0.4], [-1., 1., 0.6]];
    let back = [front[1], front[0], front[3], front[2]];
    let mesh = Mesh::new(quads(&[(front, Material::grey("a", 0.0))]), 0.13).unwrap();
    let other = Mesh::new(quads(&[(back, Material::grey("b", 0.0))]), 0.31).unwrap();
    let mut surface = VertexMesh::new(&other, &vec![Rgb::ONE; other.element_count()]);
    let more = VertexMesh::new(&mesh, &vec![Rgb::ONE; mesh.element_count()]);
    let first = surface.positions.len() as u32;
    surface.faces.extend(more.faces.iter().map(|face| face.map(|v| first + v)));
    surface.positions.extend(more.positions);
    surface.radiosity.extend(more.radiosity);
    for z in [-2.0, 3.0] {
        let eye = DVec3::new(0.1, 0.2, z);
        let camera = Camera { eye, target: DVec3::ZERO, up: DVec3::Y, vertical_fov: 20.0 };
        let image = camera.image(&surface, 64, 64, 1).unwrap();
        let dark = image.pixels.iter().filter(|pixel| **pixel == Rgb::ZERO).count();
        assert_eq!(dark, 0, "from {z}");
    }
}

/// What lies on the left of an image with +y up is above with −x up.
#[test]
fn image_turns_with_its_up_direction() {
    let glow = Material { exitance: Rgb::splat(1.0), ..Material::grey("g", 0.0) };
    let left = [[-1., -1., 0.], [0., -1., 0.], [0., 1., 0.], [-1., 1., 0.]];
    let mesh = Mesh::new(quads(&[(left, glow)]), 9.0).unwrap();
    let surface = VertexMesh::new(&mesh, &vec![Rgb::ONE; mesh.element_count()]);
    // The glow spans the half of the image on the side of −x, of any length.
    for (up, lit) in [
        (DVec3::Y, [true, false, true, false]),
        (DVec3::NEG_Y, [false, true, false, true]),
        (DVec3::X * 7.0, [false, false, true, true]),
        (DVec3::NEG_X + DVec3::Z * 0.5, [true, true, false, false]),
    ] {
        let eye = DVec3::new(0., 0., 2.);
        let camera = Camera { eye, target: DVec3::ZERO, up, vertical_fov: 40.0 };
        let image = camera.image(&surface, 2, 2, 1).unwrap();
        assert_eq!(image.pixels.iter().map(|c| c.x > 0.0).collect::<Vec<_>>(), lit, "{up}");
    }
}
