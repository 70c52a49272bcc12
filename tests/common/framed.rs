//! The scenes that are swept: any size, anywhere, as bright and as bright beside others as asked.

use glam::{DQuat, DVec3};
use radiosity::{Material, Mesh, Rgb, Scene, Triangle, VertexMesh};

use super::scenes::{block, quads, walls};

/// Where a scene stands and how large it is. It stands askew, so that no wall is along an axis.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// Length of what is one long in the scene's own measure.
    pub scale: f64,
    /// Distance from the origin along the longest axis, in units of `scale`.
    pub shift: f64,
}

pub const HERE: Frame = Frame { scale: 1.0, shift: 0.0 };

impl Frame {
    pub fn scaled(scale: f64) -> Frame {
        Frame { scale, ..HERE }
    }

    pub fn shifted(shift: f64) -> Frame {
        Frame { shift, ..HERE }
    }

    /// Where a point of the scene's own measure is.
    pub fn place(&self, p: [f64; 3]) -> [f64; 3] {
        let turn = DQuat::from_axis_angle(DVec3::new(2.0, 3.0, 6.0) / 7.0, 0.7);
        let away = DVec3::new(1.0, -0.618, 0.414) * self.shift;
        ((turn * DVec3::from_array(p) + away) * self.scale).to_array()
    }

    fn quads(&self, all: &[([[f64; 3]; 4], Material)]) -> Scene {
        let placed = |(corners, material): &([[f64; 3]; 4], Material)| {
            (corners.map(|p| self.place(p)), material.clone())
        };
        quads(&all.iter().map(placed).collect::<Vec<_>>())
    }
}

pub fn grey(reflectance: f64, exitance: f64) -> Material {
    Material { exitance: Rgb::splat(exitance), ..Material::grey("grey", reflectance) }
}

/// A unit cube, all walls alike.
pub fn furnace(frame: Frame, reflectance: f64, exitance: f64) -> Scene {
    let wall = grey(reflectance, exitance);
    frame.quads(&walls([0.0; 3], [1.0; 3]).map(|w| (w, wall.clone())))
}

/// Two unit squares that face each other at distance one.
pub fn plates(frame: Frame) -> Scene {
    let [.., floor, ceiling] = walls([0.0; 3], [1.0; 3]);
    frame.quads(&[(floor, grey(0.0, 0.0)), (ceiling, grey(0.0, 0.0))])
}

/// The same two, of `side` and as far apart, groups 0 and 1, in a scene that is as large as ever
/// for a unit square some way off.
pub fn small_plates(frame: Frame, side: f64) -> Scene {
    let [.., floor, ceiling] = walls([0.0; 3], [1.0; 3]);
    let small = |p: [f64; 3]| (DVec3::new(0.3, 0.2, 0.1) + side * DVec3::from_array(p)).to_array();
    let [a, b] = [floor, ceiling].map(|q| (q.map(small), grey(0.0, 0.0)));
    let far = floor.map(|[x, y, _]| [x, y, -1.0]);
    frame.quads(&[a, b, (far, grey(0.0, 0.0))])
}

/// Howell, configuration C-11: unit squares at distance one.
pub const PLATES: f64 = 0.199_824_895_698_387_46;

/// A closed unit room with a lamp under its ceiling, another, `second` W/m², on a wall, and a
/// block.
pub fn room(frame: Frame, first: f64, second: f64) -> Scene {
    let reflectances = [0.8, 0.3, 0.6, 0.6, 0.4, 0.9];
    let surfaces = walls([0.0; 3], [1.0; 3]).into_iter().zip(reflectances);
    let mut all: Vec<_> = surfaces.map(|(w, rho)| (w, grey(rho, 0.0))).collect();
    let lamp = [[0.4, 0.4, 0.95], [0.4, 0.6, 0.95], [0.6, 0.6, 0.95], [0.6, 0.4, 0.95]];
    all.push((lamp, grey(0.5, first)));
    let bracket = [[0.05, 0.7, 0.6], [0.05, 0.8, 0.6], [0.05, 0.8, 0.7], [0.05, 0.7, 0.7]];
    all.push((bracket, grey(0.2, second)));
    let sides = block([0.2, 0.3, 0.01], [0.5, 0.6, 0.4]);
    all.extend(sides.map(|side| (side, grey(0.6, 0.0))));
    frame.quads(&all)
}

/// Two closed unit rooms, groups 0 to 5 and 6 to 11, that know nothing of each other.
pub fn rooms(reflectance: f64, first: f64, second: f64) -> Scene {
    let one = walls([0.0; 3], [1.0; 3]).map(|w| (w, grey(reflectance, first)));
    let two = walls([1.5, 0.0, 0.0], [2.5, 1.0, 1.0]).map(|w| (w, grey(reflectance, second)));
    HERE.quads(&[one, two].concat())
}

/// The unit cube with a square of `side` in the middle of its floor, group 4; the floor around it
/// is groups 0 to 3.
pub fn panelled(frame: Frame, side: f64, walls_of: Material, panel: Material) -> Scene {
    let [x0, x1, y0, y1, floor, ceiling] = walls([0.0; 3], [1.0; 3]);
    let (a, b) = ((1.0 - side) / 2.0, (1.0 + side) / 2.0);
    let inner = [[a, a, 0.0], [b, a, 0.0], [b, b, 0.0], [a, b, 0.0]];
    let around = [0, 1, 2, 3].map(|k| [floor[k], floor[(k + 1) % 4], inner[(k + 1) % 4], inner[k]]);
    let mut all = around.map(|q| (q, walls_of.clone())).to_vec();
    all.push((inner, panel));
    all.extend([x0, x1, y0, y1, ceiling].map(|w| (w, walls_of.clone())));
    frame.quads(&all)
}

/// A sphere of radius one seen from inside: an icosahedron, every triangle in four, `levels` times.
/// What is above z = 0.5, a quarter of it, is group 1 and `cap`; the rest is group 0.
pub fn sphere(frame: Frame, levels: u32, cap: Material, rest: Material) -> Scene {
    let g = (1.0 + 5f64.sqrt()) / 2.0;
    let axes =
        |[x, y, z]: [f64; 3]| [DVec3::new(x, y, z), DVec3::new(z, x, y), DVec3::new(y, z, x)];
    let rims = [[0.0, 1.0, g], [0.0, -1.0, g], [0.0, 1.0, -g], [0.0, -1.0, -g]];
    let corners: Vec<DVec3> = rims.into_iter().flat_map(axes).map(DVec3::normalize).collect();
    let near = |a: DVec3, b: DVec3| a.distance(b) < 1.2;
    let mut faces: Vec<[DVec3; 3]> = vec![];
    for (i, &a) in corners.iter().enumerate() {
        for (j, &b) in corners.iter().enumerate().skip(i + 1) {
            for &c in &corners[j + 1..] {
                if near(a, b) && near(b, c) && near(c, a) {
                    // Seen from inside, its front.
                    let inwards = (b - a).cross(c - a).dot(a) < 0.0;
                    faces.push(if inwards { [a, b, c] } else { [a, c, b] });
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
    let triangle = |(k, [a, b, c]): (u32, &[DVec3; 3])| {
        let above = u32::from((a + b + c).z / 3.0 > 0.5);
        let corners = [3 * k, 3 * k + 1, 3 * k + 2];
        Triangle { corners, group: above, material: above, smoothing: None }
    };
    let triangles = (0..).zip(&faces).map(triangle).collect();
    let place = |p: &DVec3| DVec3::from_array(frame.place(p.to_array()));
    let positions = faces.iter().flatten().map(place).collect();
    let names = ["rest", "cap"].map(String::from).to_vec();
    Scene::new(positions, triangles, names, vec![rest, cap]).expect("a good scene")
}

/// A surface of one radiosity over the room at `frame`.
pub fn even_surface(frame: Frame, radiosity: f64) -> VertexMesh {
    let mesh = Mesh::new(room(frame, 1.0, 1.0), f64::INFINITY).unwrap();
    let values = vec![Rgb::splat(radiosity); mesh.element_count()];
    VertexMesh::per_element(&mesh, &values)
}
