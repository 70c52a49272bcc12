//! Geometry as it comes: what is odd about it must not cost light, nor time, nor a panic.
//!
//! Most scenes are furnaces: the unit cube from inside, every wall of exitance 1 and reflectance ½.
//! All light then meets fronts, so the flux of all surfaces together is that emitted / (1 − ½), by
//! energy alone, whatever the noise of the rays.

use glam::DVec3;
use radiosity::backend::cpu::RayRows;
use radiosity::solver::Ledger;
use radiosity::*;

use crate::common::scenes::{block, halves, paint};
use crate::common::{cube, keep_going, quads};

const UNSHOT: f64 = 1e-4;

/// Triangles of a block, seen from outside.
fn block_triangles(low: [f64; 3], high: [f64; 3]) -> Vec<[[f64; 3]; 3]> {
    block(low, high).into_iter().flat_map(halves).collect()
}

fn glowing() -> Material {
    paint(0.5, 1.0)
}

/// `scene` with triangles of other corners added, in a group of their own.
fn with(scene: Scene, name: &str, material: Material, triangles: &[[[f64; 3]; 3]]) -> Scene {
    let (mut positions, mut all) = (scene.positions().to_vec(), scene.triangles().to_vec());
    let (mut groups, mut materials) = (scene.groups().to_vec(), scene.materials().to_vec());
    let (group, material_index) = (groups.len() as u32, materials.len() as u32);
    for corners in triangles {
        let k = positions.len() as u32;
        positions.extend(corners.map(DVec3::from_array));
        all.push(Triangle {
            corners: [k, k + 1, k + 2],
            group,
            material: material_index,
            smoothing: None,
        });
    }
    groups.push(name.into());
    materials.push(material);
    Scene::new(positions, all, groups, materials).unwrap()
}

/// The unit cube from inside without wall `without` (x0, x1, y0, y1, z0, z1).
fn open_cube(without: usize) -> Scene {
    let unit = cube(&glowing());
    let kept = unit.triangles().iter().filter(|t| t.group as usize != without).copied();
    let (groups, materials) = (unit.groups().to_vec(), unit.materials().to_vec());
    Scene::new(unit.positions().to_vec(), kept.collect(), groups, materials).unwrap()
}

/// Shoots all but [`UNSHOT`] of the light with 1024 rays a row, and checks what must hold anywhere.
fn settle(scene: Scene, size: f64) -> (Mesh, Solution) {
    let mesh = Mesh::new(scene, size).unwrap();
    let mut rays = RayRows::new(&mesh, 1024).unwrap();
    let solver = Solver { unshot: UNSHOT, ..Default::default() };
    let solution = solver.solve(&mesh, &mut rays, keep_going).unwrap();
    check(&solution.radiosity);
    check(&VertexMesh::new(&mesh, &solution.radiosity).radiosity);
    // Sums of some 1e5 terms, each rounded by 1e-16 of the whole at most.
    assert!(solution.ledger.imbalance() <= 1e-9, "{}", solution.ledger.imbalance());
    assert!(solution.ledger.unshot_share() <= UNSHOT);
    (mesh, solution)
}

fn check(radiosity: &[Rgb]) {
    assert!(radiosity.iter().all(|b| b.is_finite() && b.min_element() >= 0.0));
}

/// Flux of the elements of group `group`, or of all, W in the first channel.
fn flux(mesh: &Mesh, solution: &Solution, group: Option<u32>) -> f64 {
    let of = |e: usize| mesh.scene().triangles()[mesh.triangle(mesh.element(e))].group;
    let elements = (0..mesh.element_count()).filter(|&e| group.is_none_or(|g| of(e) == g));
    elements.map(|e| solution.radiosity[e].x * mesh.area(mesh.element(e))).sum()
}

/// Nothing of a furnace is lost: `lost` of the flux at most, and no flux is missing.
fn furnace(scene: Scene, size: f64, lost: f64) -> (Mesh, Solution) {
    let (mesh, solution) = settle(scene, size);
    let Ledger { emitted, escaped: left, backface_loss: back, .. } = solution.ledger;
    let away = (left.x + back.x) / emitted.x;
    let settled = flux(&mesh, &solution, None) / (2.0 * emitted.x);
    println!("{} elements: away {away:.1e}, flux {settled:.6}", mesh.element_count());
    assert!(away <= lost, "{away}");
    // What is unshot, and what is lost, would have been reflected again and again: twice itself.
    assert!((settled - 1.0).abs() <= 2.0 * (UNSHOT + away), "{settled}");
    (mesh, solution)
}

#[test]
fn slivers_and_needles() {
    // A floor in slices that halve up to the last, a billionth wide, and are cut across as well.
    let cut = |k: i32| if k > 30 { 1.0 } else { 1.0 - 0.5f64.powi(k) };
    let slices: Vec<_> = (0..=30)
        .flat_map(|k| {
            let (x, y) = (cut(k), cut(k + 1));
            halves([[x, 0., 0.], [y, 0., 0.], [y, 1., 0.], [x, 1., 0.]])
        })
        .collect();
    // A row of a sliver is of any light: none of a ray may slip between two.
    furnace(with(open_cube(4), "floor", glowing(), &slices), 0.5, 0.0);
    // A fan of needles from one corner, the narrowest 1e-9 rad.
    let rim = |k: i32| [1.0, cut(k), 0.0];
    let mut needles: Vec<_> = (0..=30).map(|k| [[0.; 3], rim(k), rim(k + 1)]).collect();
    needles.push([[0.; 3], [1., 1., 0.], [0., 1., 0.]]);
    furnace(with(open_cube(4), "floor", glowing(), &needles), 0.5, 0.0);
}

#[test]
fn coincident_faces() {
    // The floor once more, dark: of two faces at one place light meets the first.
    let clean = settle(cube(&glowing()), 0.25);
    let floor = halves([[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]]);
    let (mesh, solution) =
        furnace(with(cube(&glowing()), "twin", paint(0.5, 0.0), &floor), 0.25, 0.0);
    assert_eq!(flux(&mesh, &solution, Some(6)), 0.0);
    for group in 0..6 {
        let (a, b) = (flux(&clean.0, &clean.1, Some(group)), flux(&mesh, &solution, Some(group)));
        println!("{group}: {a} {b}");
        assert!((a / b - 1.0).abs() < 4.0 * UNSHOT, "{a} {b}");
    }
}

#[test]
fn overlapping_faces() {
    // A plate in the plane of the floor, of which it hides as much as it adds.
    let clean = settle(cube(&glowing()), 0.25);
    let plate = halves([[0.3, 0.2, 0.], [0.9, 0.2, 0.], [0.9, 0.8, 0.], [0.3, 0.8, 0.]]);
    let scene = with(cube(&glowing()), "plate", paint(0.5, 0.0), &plate);
    let (mesh, solution) = furnace(scene, 0.25, 0.0);
    let both = flux(&mesh, &solution, Some(4)) + flux(&mesh, &solution, Some(6));
    let alone = flux(&clean.0, &clean.1, Some(4));
    println!("{both} {alone}");
    assert!((both / alone - 1.0).abs() < 4.0 * UNSHOT, "{both} {alone}");
}

#[test]
fn touching_and_intersecting_walls() {
    // A block that stands on the floor, and one that comes through it, with sides on the sides of
    // elements: what the floor emits within is lost there, and nothing else.
    for bottom in [0.0, -0.5] {
        let pillar = block_triangles([0.25, 0.25, bottom], [0.5; 3]);
        let scene = with(cube(&glowing()), "pillar", paint(0.5, 0.0), &pillar);
        let (_, solution) = settle(scene, 0.36);
        let Ledger { emitted, escaped: left, backface_loss: back, .. } = solution.ledger;
        println!("left {left}, back {back}");
        let lost = 1.0 / 16.0;
        assert!(left.x == 0.0 && (back.x - lost).abs() <= UNSHOT * emitted.x, "{left} {back}");
    }
}

#[test]
fn t_junctions() {
    // Each row of tiles is shifted by another third, so that no corner meets a corner.
    let tiles: Vec<_> = (0..5)
        .flat_map(|row| {
            let y = [row, row + 1].map(|r| f64::from(r) / 5.0);
            let cut = move |k: i32| ((f64::from(k) - f64::from(row) / 3.0) / 4.0).clamp(0.0, 1.0);
            (0..6).filter(move |&k| cut(k + 1) > cut(k)).flat_map(move |k| {
                let x = [cut(k), cut(k + 1)];
                halves([[x[0], y[0], 0.], [x[1], y[0], 0.], [x[1], y[1], 0.], [x[0], y[1], 0.]])
            })
        })
        .collect();
    furnace(with(open_cube(4), "tiles", glowing(), &tiles), 0.25, 0.0);
}

#[test]
fn open_scenes() {
    // A box without a lid: what its opening sees of a furnace is as if from a black lid. By energy
    // all that is emitted is absorbed within or leaves.
    let (mesh, solution) = settle(open_cube(5), 0.25);
    let lid = quads(&[([[0., 0., 1.], [0., 1., 1.], [1., 1., 1.], [1., 0., 1.]], paint(0.0, 0.0))]);
    let black: Vec<_> = (0..2).map(|t| lid.corners(t).map(|p| p.to_array())).collect();
    let closed = settle(with(open_cube(5), "lid", paint(0.0, 0.0), &black), 0.25);
    let (open, shut) = (solution.ledger, closed.1.ledger);
    assert_eq!((open.backface_loss.x, shut.escaped.x), (0.0, 0.0));
    let walls = |g: u32| flux(&mesh, &solution, Some(g)) / flux(&closed.0, &closed.1, Some(g));
    for group in 0..5 {
        println!("{group} {}", walls(group));
        assert!((walls(group) - 1.0).abs() < 4.0 * UNSHOT, "{}", walls(group));
    }
    let through = shut.absorbed.x - open.absorbed.x;
    assert!((open.escaped.x / through - 1.0).abs() < 4.0 * UNSHOT, "{} {through}", open.escaped.x);
}

#[test]
fn one_triangle() {
    let scene = Scene::new(
        vec![DVec3::ZERO, DVec3::X, DVec3::Y],
        vec![Triangle { corners: [0, 1, 2], ..Default::default() }],
        vec!["it".into()],
        vec![glowing()],
    );
    let (mesh, solution) = settle(scene.unwrap(), 0.25);
    assert!(mesh.element_count() > 1 && solution.radiosity.iter().all(|&b| b == Rgb::ONE));
    // A row's shares are whole, and all of them are open.
    assert!((solution.ledger.escaped.x - 0.5).abs() < 1e-4 * 0.5, "{}", solution.ledger.escaped);
}

#[test]
fn lamp_flush_in_the_ceiling() {
    let (low, high) = (0.375, 0.625);
    let room = || {
        let walls = open_cube(5);
        let (positions, triangles) = (walls.positions().to_vec(), walls.triangles().to_vec());
        let materials = vec![paint(0.5, 0.0); 6];
        Scene::new(positions, triangles, walls.groups().to_vec(), materials).unwrap()
    };
    let tile = |x: [f64; 2], y: [f64; 2]| {
        halves([[x[0], y[0], 1.], [x[0], y[1], 1.], [x[1], y[1], 1.], [x[1], y[0], 1.]])
    };
    let lamp = tile([low, high], [low, high]);
    let whole = tile([0., 1.], [0., 1.]);
    let cut = [
        tile([0., low], [0., 1.]),
        tile([high, 1.], [0., 1.]),
        tile([low, high], [0., low]),
        tile([low, high], [high, 1.]),
    ]
    .concat();
    let (ceiling, shine) = (paint(0.5, 0.0), paint(0.5, 100.0));
    let scenes = [
        with(with(room(), "lamp", shine.clone(), &lamp), "ceiling", ceiling.clone(), &cut),
        with(with(room(), "lamp", shine.clone(), &lamp), "ceiling", ceiling.clone(), &whole),
        with(with(room(), "ceiling", ceiling, &whole), "lamp", shine, &lamp),
    ];
    let [hole, first, last] = scenes.map(|scene| {
        assert!(scene.warnings().is_empty(), "{:?}", scene.warnings());
        let (mesh, solution) = settle(scene, 0.125);
        assert_eq!((solution.ledger.escaped.x, solution.ledger.backface_loss.x), (0.0, 0.0));
        [0, 1, 2, 3, 4].map(|g| flux(&mesh, &solution, Some(g)))
    });
    println!("{hole:?} {first:?} {last:?}");
    for g in 0..5 {
        for flush in [first[g], last[g]] {
            // From the lamp a side wall gets some F = 0.16, the floor 0.25 of 32 patches of 1024
            // rays: √(0.84 / 0.16 / 32768) = 1.3 %, in each of two scenes; four of both.
            assert!((flush / hole[g] - 1.0).abs() < 0.07, "{g}: {flush} {}", hole[g]);
        }
    }
}

#[test]
fn duplicated_vertices() {
    let shared =
        with(cube(&glowing()), "block", paint(0.3, 0.0), &block_triangles([0.2; 3], [0.6; 3]));
    // Every triangle with three of its own.
    let corners = (0..shared.triangles().len()).flat_map(|t| shared.corners(t));
    let own = (0u32..)
        .zip(shared.triangles())
        .map(|(k, t)| Triangle { corners: [3 * k, 3 * k + 1, 3 * k + 2], ..*t });
    let (groups, materials) = (shared.groups().to_vec(), shared.materials().to_vec());
    let own = Scene::new(corners.collect(), own.collect(), groups, materials).unwrap();
    let (mesh, a) = settle(shared, 0.3);
    let (doubled, b) = settle(own, 0.3);
    assert_eq!(a.radiosity, b.radiosity);
    let [a, b] = [(&mesh, &a), (&doubled, &b)].map(|(m, s)| VertexMesh::new(m, &s.radiosity));
    assert_eq!((a.positions, a.radiosity), (b.positions, b.radiosity));
}
