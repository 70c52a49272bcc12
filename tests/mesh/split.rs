//! Meshes of unequal depths: split by hand, split where surfaces touch, shot from; and the ambient
//! term, which knows their areas. No GPU needed.

use glam::{DQuat, DVec3};
use radiosity::backend::cpu::RayRows;
use radiosity::mesh::NodeId;
use radiosity::solver::StopReason;
use radiosity::{ErrorKind, Material, Mesh, Rgb, Scene, Solver, Triangle, VertexMesh};

use crate::common::closed_forms::exact;
use crate::common::scenes::{grey, standing_block};
use crate::common::surface::assert_whole;
use crate::common::{cube, keep_going, quads};

/// Splits a pseudo-random quarter of the elements, `times` times.
fn split_at_random(mut mesh: Mesh, times: u32) -> Mesh {
    for turn in 0..times {
        let chosen = |e: &usize| (*e as u32 ^ turn << 9).wrapping_mul(0x9e37_79b9) >> 30 == 0;
        mesh = mesh.split(&(0..mesh.element_count()).filter(chosen).collect::<Vec<_>>()).unwrap();
    }
    mesh
}

/// How many splits made element `e`: each quarters the area, exactly.
fn level(mesh: &Mesh, e: usize) -> u32 {
    let node = mesh.element(e);
    ((mesh.scene().area(mesh.triangle(node)) / mesh.area(node)).log2() / 2.0).round() as u32
}

/// The element under `p`, a point of triangle `t`, and the least barycentric weight of `p` in it.
fn under(mesh: &Mesh, t: usize, p: DVec3) -> (usize, f64) {
    let weights = |[a, b, c]: [DVec3; 3]| {
        let (n, d) = ((b - a).cross(c - a), p - a);
        let [u, v] = [d.cross(c - a), (b - a).cross(d)].map(|x| x.dot(n) / n.length_squared());
        [1.0 - u - v, u, v]
    };
    let [_, u, v] = weights(mesh.scene().corners(t));
    let (e, [u, v]) = mesh.element_at(t, u, v);
    let own = weights(mesh.corners(mesh.element(e)));
    // Twelve levels multiply the rounding of the first weights by 4096.
    assert!((own[1] - u).abs() < 1e-11 && (own[2] - v).abs() < 1e-11, "{own:?} {u} {v}");
    (e, own.into_iter().fold(1.0, f64::min))
}

#[test]
fn split_tiles_and_renumbers_in_order() {
    let mesh = split_at_random(Mesh::new(cube(&grey()), 0.8).unwrap(), 4);
    let levels: Vec<u32> = (0..mesh.element_count()).map(|e| level(&mesh, e)).collect();
    assert!(levels.iter().max().unwrap() >= &(levels.iter().min().unwrap() + 3));
    // Every node's elements are one range: its parts', in order, from the first to the last.
    fn check(mesh: &Mesh, node: NodeId) {
        let range = mesh.elements_of(node);
        let Some(parts) = mesh.children(node) else {
            assert_eq!((range.len(), mesh.element(range.start)), (1, node));
            return;
        };
        let mut next = range.start;
        for part in parts {
            assert_eq!(mesh.elements_of(part).start, next);
            next = mesh.elements_of(part).end;
            assert_eq!(mesh.area(part) * 4.0, mesh.area(node), "quarters are exact");
            assert_eq!(mesh.triangle(part), mesh.triangle(node));
            check(mesh, part);
        }
        assert_eq!(next, range.end);
        // Three at the corners of their parent, the fourth between the middles of its sides.
        let [a, b, c] = mesh.corners(node);
        let wanted = [[a, (a + b) / 2.0, (a + c) / 2.0], [(a + b) / 2.0, b, (b + c) / 2.0]];
        for (part, wanted) in parts.into_iter().zip(wanted) {
            let pairs = mesh.corners(part).into_iter().zip(wanted);
            assert!(pairs.into_iter().all(|(p, q)| p.distance(q) < 1e-15));
        }
        let middle = mesh.corners(parts[3]).into_iter().sum::<DVec3>() / 3.0;
        assert!(middle.distance(mesh.centroid(node)) < 1e-15);
    }
    let count = mesh.scene().triangles().len();
    (0..count).for_each(|t| check(&mesh, mesh.root(t)));
    assert_eq!(mesh.elements_of(mesh.root(count - 1)).end, mesh.element_count());
    let area: f64 = (0..mesh.element_count()).map(|e| mesh.area(mesh.element(e))).sum();
    assert!((area - 6.0).abs() < 1e-12);
    let values: Vec<Rgb> = (0..mesh.element_count()).map(|e| Rgb::splat(e as f64)).collect();
    assert_whole(&mesh, &VertexMesh::new(&mesh, &values));
    // Looked up by its middle, each element finds itself.
    for e in 0..mesh.element_count() {
        let node = mesh.element(e);
        assert_eq!(under(&mesh, mesh.triangle(node), mesh.centroid(node)).0, e);
    }
}

#[test]
fn split_replaces_element_up_to_maximum_depth() {
    let mesh = Mesh::new(cube(&grey()), 0.8).unwrap();
    let split = mesh.split(&[3, 7]).unwrap();
    assert_eq!(split.element_count(), mesh.element_count() + 6);
    let corners = |m: &Mesh, e: usize| m.corners(m.element(e));
    assert_eq!(corners(&mesh, 2), corners(&split, 2));
    assert_eq!(corners(&mesh, 4), corners(&split, 7));
    assert_eq!(corners(&mesh, 8), corners(&split, 14));
    assert_eq!(mesh.split(&[]).unwrap().element_count(), mesh.element_count());
    let mut deep = Mesh::new(cube(&grey()), 9.0).unwrap();
    for _ in 0..Mesh::MAX_DEPTH {
        deep = deep.split(&[0]).unwrap();
    }
    assert_eq!((level(&deep, 0), level(&deep, 4)), (Mesh::MAX_DEPTH, Mesh::MAX_DEPTH - 1));
    assert_eq!(deep.split(&[0]).unwrap_err().kind(), ErrorKind::Setting);
    assert!(deep.split(&[4]).is_ok());
}

#[test]
fn unequal_depths_shoot_like_equal_ones() {
    let glow = Material { exitance: Rgb::ONE, ..grey() };
    let uneven = |mesh: &Mesh| {
        let settings = Solver { unshot: 1e-6, ..Default::default() };
        let mut rows = RayRows::new(mesh, 1024).unwrap();
        let s = settings.solve(mesh, &mut rows, keep_going).unwrap();
        assert!(s.ledger.imbalance() <= 1e-9, "{}", s.ledger.imbalance());
        let mean = |elements: &mut dyn Iterator<Item = usize>| {
            let area = |e: usize| mesh.area(mesh.element(e));
            let sums = elements.map(|e| (s.radiosity[e].x * area(e), area(e)));
            let (flux, area) = sums.fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
            flux / area
        };
        // No light is lost in a closed cube: the mean is 1 + ½ + ¼ + … but for what is unshot.
        let whole = mean(&mut (0..mesh.element_count()));
        assert!((whole / 2.0 - 1.0).abs() <= 1e-6 + 1e-9, "{whole}");
        let of = |t: usize| mesh.elements_of(mesh.root(t));
        let wall = |w: usize| mean(&mut of(2 * w).chain(of(2 * w + 1)));
        (0..6).map(|w| (wall(w) / 2.0 - 1.0).abs()).fold(0.0, f64::max)
    };
    let even = Mesh::new(cube(&glow), 0.4).unwrap();
    let unequal = split_at_random(Mesh::new(cube(&glow), 0.8).unwrap(), 3);
    let (a, b) = (uneven(&even), uneven(&unequal));
    println!("walls differ by {a:.4} and {b:.4}");
    // Walls are alike. What is counted by n = 1024 rays of a row is off by √(F(1−F)/n) = 0.0125 for
    // F = 0.2, of which half is reflected; 0.006 even if all rows were wrong alike.
    assert!(a < 0.006 && b < 0.006, "{a} {b}");
}

const FLOOR: [[f64; 3]; 4] = [[-2., -2., 0.], [2., -2., 0.], [2., 2., 0.], [-2., 2., 0.]];

/// Ends of a square's sides from `x0` to `x1` in both directions, at height `z`.
fn ring(x0: f64, x1: f64, z: f64) -> [[f64; 3]; 4] {
    [[x0, x0, z], [x1, x0, z], [x1, x1, z], [x0, x1, z]]
}

/// Points along a square's sides, `keep` away from its corners.
fn along(ring: [[f64; 3]; 4], keep: f64) -> Vec<DVec3> {
    let corners = ring.map(DVec3::from_array);
    let side = |k: usize| (corners[k], corners[(k + 1) % 4]);
    let steps = |(a, b): (DVec3, DVec3)| {
        let margin = keep / a.distance(b);
        (0..=999).map(move |i| a.lerp(b, margin + (1.0 - 2.0 * margin) * f64::from(i) / 999.0))
    };
    (0..4).flat_map(|k| steps(side(k)).collect::<Vec<_>>()).collect()
}

/// The two triangles of the floor, and which of them is under `p`.
fn floor_under(p: DVec3) -> usize {
    usize::from(p.y > p.x)
}

#[test]
fn contact_splits_only_where_box_stands() {
    // Between the lattice lines of all levels here, multiples of 1/8.
    let (x0, x1) = (-0.71, 0.79);
    let walls: Vec<_> =
        [FLOOR].into_iter().chain(standing_block([x0, x1], [x0, x1], 0.0, 1.0)).collect();
    let scene = quads(&walls.into_iter().map(|w| (w, grey())).collect::<Vec<_>>());
    let base = Mesh::new(scene, 0.5 * 2f64.sqrt()).unwrap();
    assert!((0..128).all(|e| level(&base, e) == 3), "legs of ½ on the floor");
    assert_eq!(base.split_at_contacts(0).element_count(), base.element_count());
    let cut = base.split_at_contacts(2);
    let foot = ring(x0, x1, 0.0);
    for p in along(foot, 0.15) {
        let (e, inside) = under(&cut, floor_under(p), p);
        // A line off the lattice goes through all cells it meets by 8 % of their size and more.
        assert!(inside < 0.0 || level(&cut, e) == 5, "{p}: level {}", level(&cut, e));
    }
    // Elements that the foot does not cross are what they were, the box's own too.
    let mut touched = vec![false; base.element_count()];
    for p in along(foot, 0.0) {
        touched[under(&base, floor_under(p), p).0] = true;
    }
    for (e, touched) in touched.iter().enumerate() {
        let node = base.element(e);
        let here = under(&cut, base.triangle(node), base.centroid(node)).0;
        assert!(*touched || cut.corners(cut.element(here)) == base.corners(node), "{e}");
    }
    let crossed = touched[..128].iter().filter(|t| **t).count();
    assert!(crossed > 10 && touched[128..].iter().all(|t| !t));
}

#[test]
fn shared_edges_are_no_contact() {
    let empty = Mesh::new(cube(&grey()), 0.3).unwrap();
    assert_eq!(empty.split_at_contacts(3).element_count(), empty.element_count());
}

#[test]
fn other_side_of_a_sheet_is_no_contact() {
    // Askew, so that the corners of each lie off the plane of the other by rounding.
    let turn = DQuat::from_axis_angle(DVec3::new(2.0, 3.0, 6.0) / 7.0, 0.7);
    let placed = |p: [f64; 3]| (turn * DVec3::from_array(p) / 3.0).to_array();
    for k in 0..50 {
        let shift = f64::from(k) * 0.1;
        let front = FLOOR.map(|[x, y, z]| placed([x + shift, y, z]));
        let mut back = front;
        back.reverse();
        // The same diagonal, the other way round.
        back.rotate_left(1);
        let sheet = Mesh::new(quads(&[(front, grey()), (back, grey())]), 0.2).unwrap();
        let cut = sheet.split_at_contacts(3);
        assert_eq!(cut.element_count(), sheet.element_count(), "shifted by {shift}");
    }
}

#[test]
fn gap_width_decides_contact_depth() {
    // Cells of legs ½, ¼, ⅛ have areas of ⅛, 1/32, 1/128; 15 % of the roots are 0.053, 0.0265,
    // 0.01326. The fourth level is not asked for.
    for (gap, deeper) in [(0.054, 0), (0.052, 1), (0.027, 1), (0.026, 2), (0.0134, 2), (0.0131, 3)]
    {
        let lamp = ring(-0.71, 0.79, gap);
        let mut down = lamp;
        down.reverse();
        let scene = quads(&[(FLOOR, grey()), (down, Material::grey("lamp", 0.0))]);
        let base = Mesh::new(scene, 0.5 * 2f64.sqrt()).unwrap();
        let cut = base.split_at_contacts(3);
        let floor = || (0..2).flat_map(|t| cut.elements_of(cut.root(t)));
        assert_eq!(floor().map(|e| level(&cut, e)).max(), Some(3 + deeper), "gap {gap}");
        for p in along(lamp, 0.15) {
            let (e, _) = under(&cut, floor_under(p), p.with_z(0.0));
            assert_eq!(level(&cut, e), 3 + deeper, "gap {gap} at {p}");
        }
    }
}

#[test]
fn crowded_triangles_skip_each_other() {
    let floors = vec![(FLOOR, grey()); 1500];
    let walls =
        standing_block([-0.71, 0.79], [-0.71, 0.79], 0.0, 1.0).into_iter().map(|w| (w, grey()));
    let base = |faces: &[([[f64; 3]; 4], Material)]| Mesh::new(quads(faces), 1.5).unwrap();
    // Each of the 3000 triangles lies in all others: their sides are its own, or its diagonal.
    let pile = base(&floors);
    assert_eq!(pile.split_at_contacts(2).element_count(), pile.element_count());
    // The ten triangles of a box are smaller than they are: it splits the 256 that count.
    let stands = base(&walls.chain(floors).collect::<Vec<_>>());
    let cut = stands.split_at_contacts(2);
    let elements = |mesh: &Mesh, t: usize| mesh.elements_of(mesh.root(t)).len();
    let split = (10..3010).filter(|&t| elements(&cut, t) > elements(&stands, t)).count();
    assert_eq!(split, 256);
}

#[test]
fn crossing_triangles_split_along_the_cut() {
    // The cut runs along y = 1.1, z = 0, from x = 1 to where the first one ends, 2.9: through two
    // of the second one's sides, or one and the corner opposite.
    for z in [0.3, 0.0] {
        let points = [[0., 0., 0.], [4., 0., 0.], [0., 4., 0.]].into_iter();
        let points = points.chain([[1., 1.1, -1.], [1., 1.1, 2.], [9., 1.1, z]]);
        let triangle = |c: u32| Triangle { corners: [c, c + 1, c + 2], ..Default::default() };
        let (triangles, points) =
            ([0, 3].map(triangle).to_vec(), points.map(DVec3::from_array).collect());
        let scene = Scene::new(points, triangles, vec!["g".into()], vec![grey()]).unwrap();
        let cut = Mesh::new(scene, f64::INFINITY).unwrap().split_at_contacts(4);
        for k in 1..100 {
            let p = DVec3::new(1.0 + 1.9 * f64::from(k) / 100.0, 1.1, 0.0);
            for t in 0..2 {
                // The cut goes through all cells on its way by more than 2 % of their size but
                // for where it clips a corner: there the cell's parent, or the one before, is left.
                let (e, inside) = under(&cut, t, p);
                let level = level(&cut, e);
                assert!(inside < 0.1 || level == 4, "triangle {t} at {p}: {level}");
            }
        }
        // 2ˡ along a line, of 4ˡ each: the rest is left.
        assert!(cut.element_count() < 256, "{}", cut.element_count());
    }
}

#[test]
fn ambient_term_is_exact_for_even_light() {
    let glow = Material { exitance: Rgb::new(1.0, 2.0, 0.5), ..grey() };
    let glow = Material { reflectance: Rgb::new(0.5, 0.8, 0.0), ..glow };
    let mesh = split_at_random(Mesh::new(cube(&glow), 0.8).unwrap(), 1);
    let even = glow.exitance / (Rgb::ONE - glow.reflectance);
    let stopped = |mesh: &Mesh, shots| {
        let settings = Solver { max_steps: Some(shots), ..Default::default() };
        let s = settings.solve(mesh, &mut exact(), keep_going).unwrap();
        assert_eq!(s.stop, StopReason::Shots);
        let mut radiosity = s.radiosity.clone();
        let ambient = s.ledger.add_ambient(mesh, &mut radiosity);
        (s, radiosity, ambient)
    };
    // Nothing shot: light from everywhere, as even as it can be, and every element has its answer.
    let (_, radiosity, ambient) = stopped(&mesh, 0);
    assert!(radiosity.iter().all(|b| b.distance(even) < 1e-14 * even.length()));
    assert!(ambient.distance(even) < 1e-14 * even.length(), "{ambient} {even}");
    // Some shot: light is where it is, but a grey cube loses none, so its mean is still right. Rows
    // close to a share, 2⁻³², of what they carry.
    let (s, radiosity, ambient) = stopped(&mesh, 20);
    assert!(ambient.x > 0.1 * even.x && ambient.x < 0.999 * even.x, "{ambient}");
    let flux = |b: &[Rgb]| {
        let areas = (0..mesh.element_count()).map(|e| mesh.area(mesh.element(e)));
        b.iter().zip(areas).map(|(b, a)| *b * a).sum::<Rgb>() / 6.0
    };
    assert!(flux(&radiosity).distance(even) < 1e-9 * even.length());
    assert!(flux(&s.radiosity).x < 0.999 * even.x);
}
