//! Who shoots: large patches where light is dim and even, small ones elsewhere. No GPU needed.

use std::collections::HashSet;

use glam::DVec3;
use radiosity::backend::cpu::RayRows;
use radiosity::form_factor::{Entry, Row};
use radiosity::mesh::NodeId;
use radiosity::solver::StopReason;
use radiosity::{
    Error, ErrorKind, FormFactors, Material, Mesh, Rgb, Scene, Solution, Solver, Triangle,
};

use crate::common::scenes::lamp;
use crate::common::{keep_going, quads};

/// Exitance of all lamps, W/m².
const LAMP: [f64; 3] = [9.0, 6.0, 3.0];

/// A closed room of two units, its walls of `n` × `n` quads each, with a lamp at the middle of its
/// ceiling.
fn room(n: u32) -> Scene {
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    let (mut positions, mut triangles) = (vec![], vec![]);
    let mut wall = |origin: DVec3, u: DVec3, v: DVec3, n: u32, group: u32, material: u32| {
        let first = positions.len() as u32;
        let at = |k: u32| f64::from(k) / f64::from(n);
        for j in 0..=n {
            positions.extend((0..=n).map(|i| origin + u * at(i) + v * at(j)));
        }
        for j in 0..n {
            for i in 0..n {
                let (a, b) = (first + j * (n + 1) + i, first + (j + 1) * (n + 1) + i);
                for corners in [[a, a + 1, b + 1], [a, b + 1, b]] {
                    triangles.push(Triangle { corners, group, material, smoothing: None });
                }
            }
        }
    };
    for k in 0..3 {
        let (x, y, z) = (axes[k], axes[(k + 1) % 3] * 2.0, axes[(k + 2) % 3] * 2.0);
        wall(DVec3::ZERO, y, z, n, 2 * k as u32, 0);
        wall(x * 2.0, z, y, n, 2 * k as u32 + 1, 0);
    }
    wall(DVec3::new(0.8, 0.8, 1.99), DVec3::Y * 0.4, DVec3::X * 0.4, 1, 6, 1);
    let names = (0..7).map(|g| format!("g{g}")).collect();
    let materials = vec![Material::grey("wall", 0.6), lamp(LAMP)];
    Scene::new(positions, triangles, names, materials).unwrap()
}

fn solve(mesh: &Mesh, settings: Solver) -> Solution {
    settings.solve(mesh, &mut RayRows::new(mesh, 4096).unwrap(), keep_going).unwrap()
}

#[test]
fn clusters_need_no_more_rows_than_quadtrees() {
    // Walls of 2 triangles of 256 elements, and of 512 triangles.
    let (plain, cut) = (room(1), room(16));
    let plain = Mesh::new(plain, 2.0 * 2f64.sqrt() / 16.0).unwrap();
    let cut = Mesh::new(cut, f64::INFINITY).unwrap();
    // The lamp of the other is cut as well.
    let lamp = |mesh: &Mesh| {
        let emits = |&e: &usize| mesh.material(mesh.element(e)).exitance != Rgb::ZERO;
        (0..mesh.element_count()).filter(emits).count() as u64
    };
    assert_eq!(plain.element_count() as u64 - lamp(&plain), 6 * 512);
    assert_eq!(cut.element_count() as u64 - lamp(&cut), 6 * 512);
    let settings = Solver { patch_tolerance: 8e-3, ..Default::default() };
    let rows = |mesh: &Mesh| solve(mesh, settings).rows_made - lamp(mesh);
    let (few, many) = (rows(&plain), rows(&cut));
    println!("{few} rows for large triangles, {many} for small ones, of {}", 6 * 512);
    // Clusters halve where quadtrees quarter, so they stop up to a halving earlier or go one
    // further: twice as many at most. A row a triangle would be 3072.
    assert!(many <= 2 * few && many < 6 * 512 / 2, "{few} {many}");
}

/// Sends the light of the lamp to some elements, evenly, and of all else to the last ones, which
/// are black; notes who was asked for.
struct Sent {
    lit: Vec<u32>,
    black: Vec<u32>,
    asked: HashSet<NodeId>,
}

impl FormFactors for Sent {
    fn rows(&mut self, mesh: &Mesh, patches: &[NodeId], _: f64) -> Result<Vec<Row>, Error> {
        let row = |&patch: &NodeId| {
            let emits = mesh.material(patch).exitance != Rgb::ZERO;
            let to = if emits { &self.lit } else { &self.black };
            let share = Row::TOTAL / to.len() as u32;
            let entries: Vec<Entry> = to.iter().map(|&element| Entry { element, share }).collect();
            Row { entries, escaped: Row::TOTAL - share * to.len() as u32, ..Row::default() }
        };
        let rows = patches.iter().map(row).collect();
        self.asked.extend(patches.iter().filter(|&&p| mesh.material(p).exitance == Rgb::ZERO));
        Ok(rows)
    }
}

#[test]
fn unevenly_lit_wall_shoots_in_parts() {
    let square = |z: f64| [[0., 0., z], [1., 0., z], [1., 1., z], [0., 1., z]];
    let mut down = square(4.0);
    down.reverse();
    let mut ceiling = square(5.0);
    ceiling.reverse();
    let scene = quads(&[
        (down, lamp(LAMP)),
        (square(0.0), Material::grey("floor", 0.5)),
        (ceiling, Material::grey("black", 0.0)),
    ]);
    let mesh = Mesh::new(scene, 0.2).unwrap();
    let of = |triangles: [usize; 2]| -> Vec<u32> {
        triangles.iter().flat_map(|&t| mesh.elements_of(mesh.root(t))).map(|e| e as u32).collect()
    };
    let rows = |lit: Vec<u32>| {
        let mut maker = Sent { lit, black: of([4, 5]), asked: HashSet::new() };
        // Half of the emitted light is at stake. Lit evenly it lies √(1/6) from the middle, RMS,
        // and goes a distance of 5: (1/6)/25 √½ = 0.005, or seen from a cube of area 3 (before
        // there is a row) (1/6)·2 √½ = 0.24. Uneven light is off by the angle, 0.5, times its share
        // and more.
        let settings = Solver { patch_tolerance: 0.3, ..Default::default() };
        let s = settings.solve(&mesh, &mut maker, keep_going).unwrap();
        assert_eq!(s.stop, StopReason::Converged);
        maker.asked.len()
    };
    let floor = of([2, 3]);
    let middle = |e: &u32| mesh.centroid(mesh.element(*e as usize));
    let half: Vec<u32> = floor.iter().copied().filter(|e| middle(e).x < 0.5).collect();
    assert_eq!(half.len() * 2, floor.len());
    assert_eq!(rows(floor), 1, "one row for an even floor");
    assert!(rows(half) > 1);
}

/// A large patch is seen from one place. Where something stands on that place, another is taken;
/// where something stands on many of its places, it is split.
#[test]
fn viewpoints_under_blocks_are_avoided() {
    no_light_is_lost_under_blocks(1.0, 2);
    no_light_is_lost_under_blocks(0.25, 12);
}

/// With elements of this `size`, and blocks on so many of them in the middle of a floor.
fn no_light_is_lost_under_blocks(size: f64, blocks: usize) {
    let mut walls: Vec<_> = (0..3)
        .flat_map(|k| {
            let axes = [DVec3::X, DVec3::Y, DVec3::Z];
            let (x, y, z) = (axes[k] * 2.0, axes[(k + 1) % 3] * 2.0, axes[(k + 2) % 3] * 2.0);
            [[DVec3::ZERO, y, y + z, z], [x, x + z, x + y + z, x + y]]
        })
        .map(|corners| (corners.map(|p| p.to_array()), Material::grey("wall", 0.6)))
        .collect();
    // The last wall is the ceiling: all of it shines.
    walls[5].1 = lamp(LAMP);
    let empty = quads(&walls);
    // Blocks without a bottom on the elements nearest to the middle of the floor, the fifth wall:
    // each hides its element's centroid and a tenth of its area.
    let mesh = Mesh::new(empty.clone(), size).unwrap();
    let floor = [8, 9].into_iter().flat_map(|t| mesh.elements_of(mesh.root(t)));
    let mut middles: Vec<DVec3> = floor.map(|e| mesh.centroid(mesh.element(e))).collect();
    let off = |p: &DVec3| p.distance(DVec3::new(1.0, 1.0, 0.0));
    middles.sort_by(|p, q| off(p).total_cmp(&off(q)));
    for p in &middles[..blocks] {
        let corner = |k: usize, z: f64| {
            let (dx, dy) = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)][k % 4];
            [p.x + 0.08 * size * dx, p.y + 0.08 * size * dy, z]
        };
        for k in 0..4 {
            let side = [corner(k, 0.0), corner(k + 1, 0.0), corner(k + 1, 0.2), corner(k, 0.2)];
            walls.push((side, Material::grey("block", 0.6)));
        }
        walls.push(([0, 1, 2, 3].map(|k| corner(k, 0.2)), Material::grey("block", 0.6)));
    }
    for scene in [empty, quads(&walls)] {
        let mesh = Mesh::new(scene, size).unwrap();
        let s = solve(&mesh, Solver { patch_tolerance: 5.0, ..Default::default() });
        let back = s.ledger.backface_loss.x / s.ledger.emitted.x;
        println!("{back} of the light met backs, {} rows", s.rows_made);
        // The room is closed: backs are only seen from inside a block, where nobody is to shoot
        // from.
        assert_eq!(back, 0.0);
    }
}

#[test]
fn clusters_conserve_energy_and_bits() {
    let mesh = Mesh::new(room(8), f64::INFINITY).unwrap();
    let [one, two] = [0, 1].map(|_| solve(&mesh, Solver::default()));
    assert!(one.ledger.imbalance() <= 1e-9, "{}", one.ledger.imbalance());
    assert!(one.radiosity == two.radiosity && one.ledger == two.ledger);
    assert_eq!((one.shots, one.rows_made), (two.shots, two.rows_made));
    // Without room for rows the order may differ, the light may not: within what is unshot, and
    // what patches of another size put elsewhere.
    let none = solve(&mesh, Solver { row_memory: 0, ..Default::default() });
    assert!(none.rows_made >= none.shots && none.ledger.imbalance() <= 1e-9);
    let absorbed = |s: &Solution| s.ledger.absorbed.x / s.ledger.emitted.x;
    assert!((absorbed(&one) / absorbed(&none) - 1.0).abs() < 2e-3);
}

#[test]
fn zero_tolerance_shoots_by_elements() {
    let mesh = Mesh::new(room(2), 0.8).unwrap();
    let all = solve(&mesh, Solver { patch_tolerance: 0.0, ..Default::default() });
    assert_eq!(all.rows_made as usize, mesh.element_count());
    let four =
        solve(&mesh, Solver { patch_tolerance: 0.0, min_patch_level: 1, ..Default::default() });
    assert!(four.rows_made < all.rows_made / 2);
    for tolerance in [-1.0, f64::NAN] {
        let settings = Solver { patch_tolerance: tolerance, ..Default::default() };
        let error =
            settings.solve(&mesh, &mut RayRows::new(&mesh, 16).unwrap(), keep_going).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Setting);
    }
}
