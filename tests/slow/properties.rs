//! Random scenes: what must hold whatever is in them. A case that fails is shrunk and printed.
//!
//! `PROPTEST_CASES=10000 cargo test --release --test slow properties -- --ignored` tries more of
//! them than the 200 a property that are tried else, `PROPTEST_RNG_SEED=7` others.

use std::collections::BTreeMap;

use glam::{DQuat, DVec3};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use radiosity::backend::cpu::RayRows;
use radiosity::form_factor::Row;
use radiosity::solver::Method;
use radiosity::{Material, Mesh, Rgb, Scene, Solution, Solver, Triangle};

use crate::common::closed_forms::exact;
use crate::common::fakes::StoredRows;
use crate::common::keep_going;

/// The same cases on every run, unless a seed is given.
fn config() -> ProptestConfig {
    let default = ProptestConfig::default();
    let given = |name: &str| std::env::var_os(name).is_some();
    ProptestConfig {
        cases: if given("PROPTEST_CASES") { default.cases } else { 200 },
        rng_seed: if given("PROPTEST_RNG_SEED") { default.rng_seed } else { RngSeed::Fixed(1) },
        failure_persistence: None,
        ..default
    }
}

/// Reflectance and exitance, W/m².
type Paint = ([f64; 3], [f64; 3]);

/// A closed box of unit size or so, its walls each cut in two by a line from a side to the other
/// side. All convex: every element sees all of every other wall. With polygons inside, it is not.
#[derive(Clone, Debug)]
struct Room {
    size: [f64; 3],
    /// Of each wall, where the cut begins and ends, as shares of the two sides it crosses.
    cuts: [[f64; 2]; 6],
    /// Of each half of a wall.
    halves: [[Paint; 2]; 6],
    /// Triangles that hang inside, corners as shares of the box.
    inside: Vec<([[f64; 3]; 3], Paint)>,
}

fn material() -> impl Strategy<Value = Paint> {
    let reflectance = prop::array::uniform3(prop_oneof![Just(0.0), 0.0..0.95]);
    let exitance = prop_oneof![3 => Just([0.0; 3]), 1 => prop::array::uniform3(0.0..10.0)];
    (reflectance, exitance)
}

/// Rooms with so many polygons inside.
fn rooms(inside: std::ops::Range<usize>) -> impl Strategy<Value = Room> {
    let half = || prop::array::uniform2(material());
    let halves = [half(), half(), half(), half(), half(), half()];
    let corner = || prop::array::uniform3(0.05..0.95);
    let triangle = (prop::array::uniform3(corner()), material());
    let triangle = triangle.prop_filter("no sliver", |(p, _)| {
        let [a, b, c] = p.map(DVec3::from_array);
        (b - a).cross(c - a).length() > 0.02
    });
    (
        prop::array::uniform3(0.5..2.0),
        prop::array::uniform6(prop::array::uniform2(0.2..0.8)),
        halves,
        prop::collection::vec(triangle, inside),
    )
        .prop_map(|(size, cuts, halves, inside)| Room { size, cuts, halves, inside })
}

/// A triangle of a room: its corners and what it is made of, an index.
type Face = ([DVec3; 3], usize);

impl Room {
    fn materials(&self) -> Vec<Material> {
        let inside = self.inside.iter().map(|p| p.1);
        let all = self.halves.iter().flatten().copied().chain(inside);
        all.map(|(rho, e)| Material {
            reflectance: rho.into(),
            exitance: e.into(),
            ..Material::grey("m", 0.0)
        })
        .collect()
    }

    fn faces(&self) -> Vec<Face> {
        let high = DVec3::from_array(self.size);
        let mut faces = vec![];
        for (wall, [from, to]) in self.cuts.iter().enumerate() {
            let (axis, at) = (wall / 2, if wall % 2 == 0 { 0.0 } else { 1.0 });
            let point = |u: f64, v: f64| {
                let mut p = [0.0; 3];
                (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (at, u, v);
                DVec3::from_array(p) * high
            };
            let (a, b) = (point(*from, 0.0), point(*to, 1.0));
            let [o, x, xy, y] = [(0., 0.), (1., 0.), (1., 1.), (0., 1.)].map(|(u, v)| point(u, v));
            let parts = [[o, a, b], [o, b, y], [a, x, xy], [a, xy, b]];
            for (k, [a, b, c]) in parts.into_iter().enumerate() {
                // Counter-clockwise seen along the axis; the far wall is seen from the other side.
                let corners = if at == 0.0 { [a, b, c] } else { [a, c, b] };
                faces.push((corners, 2 * wall + k / 2));
            }
        }
        for (k, (corners, _)) in self.inside.iter().enumerate() {
            faces.push((corners.map(|p| DVec3::from_array(p) * high), 12 + k));
        }
        faces
    }

    fn mesh(&self) -> Mesh {
        mesh_of(&self.faces(), self.materials())
    }
}

/// Elements are the faces themselves, in their order.
fn mesh_of(faces: &[Face], materials: Vec<Material>) -> Mesh {
    let triangle = |(k, &(_, material)): (u32, &Face)| {
        let corners = [3 * k, 3 * k + 1, 3 * k + 2];
        Triangle { corners, group: 0, material: material as u32, smoothing: None }
    };
    let triangles = (0..).zip(faces).map(triangle).collect();
    let positions = faces.iter().flat_map(|f| f.0).collect();
    let scene = Scene::new(positions, triangles, vec!["room".into()], materials).unwrap();
    assert_eq!(scene.degenerate(), 0);
    Mesh::new(scene, f64::INFINITY).unwrap()
}

fn exact_rows(mesh: &Mesh) -> StoredRows {
    StoredRows::of(mesh, &mut exact())
}

fn ray_rows(mesh: &Mesh) -> StoredRows {
    StoredRows::of(mesh, &mut RayRows::new(mesh, RAYS).unwrap().with_full_share(0.0))
}

fn row<'r>(rows: &'r StoredRows, mesh: &Mesh, e: usize) -> &'r Row {
    &rows.0[&mesh.element(e)]
}

/// Form factor from element `i` to element `j`.
fn factor(rows: &StoredRows, mesh: &Mesh, i: usize, j: usize) -> f64 {
    let entries = &row(rows, mesh, i).entries;
    let found = entries.binary_search_by_key(&(j as u32), |e| e.element);
    found.map_or(0.0, |k| Row::form_factor(entries[k].share))
}

const RAYS: u32 = 256;

/// A share of a row, and what closed forms are off by (see `polygon_to_polygon`), rounded up.
const SHARE: f64 = 3e-10;

fn solve(mesh: &Mesh, rows: &mut StoredRows) -> Solution {
    Solver::new(Method::Direct).solve(mesh, rows, keep_going).unwrap()
}

fn areas(mesh: &Mesh) -> Vec<f64> {
    (0..mesh.element_count()).map(|e| mesh.area(mesh.element(e))).collect()
}

/// Highest reflectance and exitance of all channels.
fn highest(materials: &[Material]) -> (f64, f64) {
    let most = |of: &dyn Fn(&Material) -> f64| materials.iter().map(of).fold(0.0, f64::max);
    (most(&|m| m.reflectance.max_element()), most(&|m| m.exitance.max_element()))
}

/// How far exact rows that are off by rounding may move a radiosity, W/m². Element j gets A_i F_ij
/// / A_j of B_i, off by a share times A_i / A_j; no B is above E/(1−ρ), all A_i make up the room,
/// and what is more or less is reflected again, 1/(1−ρ) times in all.
fn rounding(mesh: &Mesh, materials: &[Material]) -> f64 {
    let (rho, e) = highest(materials);
    let areas = areas(mesh);
    let (small, all) =
        (areas.iter().copied().fold(f64::INFINITY, f64::min), areas.iter().sum::<f64>());
    SHARE * all / small * e / (1.0 - rho).powi(2)
}

/// The largest difference of a channel.
fn apart(a: &[Rgb], b: &[Rgb]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (*a - *b).abs().max_element()).fold(0.0, f64::max)
}

proptest! {
    #![proptest_config(config())]

    /// What holds of one solution by exact rows in a convex room.
    #[test]
    #[ignore = "slow"]
    fn exact_rows_are_reciprocal_and_light_bounded(room in rooms(0..1)) {
        let (mesh, materials) = (room.mesh(), room.materials());
        let (mut rows, areas) = (exact_rows(&mesh), areas(&mesh));
        for i in 0..areas.len() {
            // Closed but for the rounding of each entry; nothing sees a back.
            let escaped = Row::form_factor(row(&rows, &mesh, i).escaped);
            prop_assert!(escaped <= SHARE * areas.len() as f64);
            prop_assert_eq!(row(&rows, &mesh, i).backface, 0);
            for j in 0..i {
                let exchange = |a: usize, b: usize| areas[a] * factor(&rows, &mesh, a, b);
                let both = [exchange(i, j), exchange(j, i)];
                prop_assert!((both[0] - both[1]).abs() <= SHARE * (areas[i] + areas[j]));
            }
        }
        let s = solve(&mesh, &mut rows);
        prop_assert!(s.radiosity.iter().all(|b| b.is_finite() && b.min_element() >= 0.0));
        // Sums of some thousand terms.
        prop_assert!(s.ledger.imbalance() <= 1e-13);
        let (rho, e) = highest(&materials);
        let slack = rounding(&mesh, &materials);
        prop_assert!(s.radiosity.iter().all(|b| b.max_element() <= e / (1.0 - rho) + slack));
    }

    /// Twice one light and half another give twice and half of what each gives; what reflects more
    /// makes all brighter. By the same rows, so that rounding of sums is all that there is.
    #[test]
    #[ignore = "slow"]
    fn light_is_linear_and_monotone_in_reflectance(
        room in rooms(0..4), other in prop::array::uniform12(0.0..10.0f64), which in 0..12usize,
    ) {
        let (mesh, materials) = (room.mesh(), room.materials());
        let mut rows = if room.inside.is_empty() { exact_rows(&mesh) } else { ray_rows(&mesh) };
        let mut painted = |change: &dyn Fn(usize, &mut Material)| {
            let mut materials = materials.clone();
            materials.iter_mut().enumerate().for_each(|(k, m)| change(k, m));
            let repainted = mesh_of(&room.faces(), materials);
            solve(&repainted, &mut rows).radiosity
        };
        let one = painted(&|_, _| {});
        let light = |k: usize| Rgb::splat(*other.get(k).unwrap_or(&0.0));
        let two = painted(&|k, m| m.exitance = light(k));
        let sum = painted(&|k, m| m.exitance = 2.0 * m.exitance + 0.5 * light(k));
        let known: Vec<Rgb> = one.iter().zip(&two).map(|(a, b)| 2.0 * *a + 0.5 * *b).collect();
        let brightest = known.iter().map(|b| b.max_element()).fold(0.0, f64::max);
        prop_assert!(apart(&sum, &known) <= 1e-12 * brightest);
        let raised = painted(&|k, m| {
            if k == which {
                m.reflectance += 0.5 * (Rgb::ONE - m.reflectance);
            }
        });
        for (e, (more, less)) in raised.iter().zip(&one).enumerate() {
            prop_assert!(more.cmpge(*less * (1.0 - 1e-13)).all(), "element {e}: {more} {less}");
        }
        // That wall itself, if light comes to it.
        for (face, (more, less)) in room.faces().iter().zip(raised.iter().zip(&one)) {
            let lit = less.cmpgt(materials[face.1].exitance);
            prop_assert!(face.1 != which || !lit.any() || (*more - *less).max_element() > 0.0);
        }
    }

    /// Exact rows know nothing of where a scene is, how it is turned, how large it is or in which
    /// order its faces are.
    #[test]
    #[ignore = "slow"]
    fn light_is_invariant_under_motion_and_order(
        room in rooms(0..1), axis in prop::array::uniform3(-1.0..1.0f64), angle in 0.0..6.3,
        away in prop::array::uniform3(-1e3..1e3f64), decades in -9.0..9.0f64,
        shuffle in any::<u64>(),
    ) {
        let (faces, materials) = (room.faces(), room.materials());
        let here = room.mesh();
        let known = solve(&here, &mut exact_rows(&here)).radiosity;
        let turn = DQuat::from_axis_angle(DVec3::from_array(axis).normalize_or(DVec3::X), angle);
        let scale = 10f64.powf(decades);
        let mut order: Vec<usize> = (0..faces.len()).collect();
        order.sort_by_key(|&k| (k as u64 ^ shuffle).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let moved = |k: &usize| {
            let (corners, material) = faces[*k];
            (corners.map(|p| (turn * p + DVec3::from_array(away)) * scale), material)
        };
        let there = mesh_of(&order.iter().map(moved).collect::<Vec<_>>(), materials.clone());
        let found = solve(&there, &mut exact_rows(&there)).radiosity;
        let mut back = vec![Rgb::ZERO; found.len()];
        order.iter().zip(&found).for_each(|(&k, b)| back[k] = *b);
        // A thousand sizes away coordinates are off by 1e-13, far less than a share.
        prop_assert!(apart(&back, &known) <= 2.0 * rounding(&here, &materials));
    }

    /// A power of two times the size gives the same bits, by exact rows and by rays, past whatever
    /// hangs inside.
    #[test]
    #[ignore = "slow"]
    fn scaling_by_power_of_two_changes_no_bit(room in rooms(0..4), power in -30..=30i32) {
        let here = room.mesh();
        let larger = |(corners, material): &Face| {
            (corners.map(|p| p * 2f64.powi(power)), *material)
        };
        let faces: Vec<Face> = room.faces().iter().map(larger).collect();
        let there = mesh_of(&faces, room.materials());
        let rays = [&here, &there].map(ray_rows);
        prop_assert_eq!(&rays[0].0, &rays[1].0);
        if room.inside.is_empty() {
            let exact = [&here, &there].map(exact_rows);
            prop_assert_eq!(&exact[0].0, &exact[1].0);
        }
        for method in Method::ALL {
            let solver = Solver { unshot: 1e-4, ..Solver::new(method) };
            let [a, b] = [(&here, 0), (&there, 1)].map(|(mesh, k)| {
                solver.solve(mesh, &mut rays[k].clone(), keep_going).unwrap().radiosity
            });
            prop_assert_eq!(a, b, "{}", method);
        }
    }

    /// Rays past anything: all that is emitted is accounted for, and no more than E/(1−ρ) is about.
    #[test]
    #[ignore = "slow"]
    fn occluded_light_is_conserved(room in rooms(1..6)) {
        let (mesh, materials) = (room.mesh(), room.materials());
        let s = solve(&mesh, &mut ray_rows(&mesh));
        prop_assert!(s.radiosity.iter().all(|b| b.is_finite() && b.min_element() >= 0.0));
        prop_assert!(s.ledger.imbalance() <= 1e-13);
        // The room is closed. What leaves in all is bounded whatever the rays: a row adds up to
        // one.
        prop_assert_eq!(s.ledger.escaped, Rgb::ZERO);
        let (rho, _) = highest(&materials);
        let leaving: Rgb = s.radiosity.iter().zip(areas(&mesh)).map(|(b, a)| *b * a).sum();
        let most = s.ledger.emitted / (1.0 - rho) * (1.0 + 1e-13);
        prop_assert!(leaving.cmple(most).all());
    }

    /// A polygon in two parts is the same polygon. The last one is split, so that all other rows
    /// are by the same rays: what they have sent to it they send to its parts.
    #[test]
    #[ignore = "slow"]
    fn split_polygon_receives_the_same_rows(
        room in rooms(1..4), side in 0..3usize, at in 0.1..0.9f64,
    ) {
        let (mut faces, materials) = (room.faces(), room.materials());
        let whole = room.mesh();
        let last = faces.len() - 1;
        split(&mut faces, last, side, at);
        let parts = mesh_of(&faces, materials.clone());
        let (one, two) = (ray_rows(&whole), ray_rows(&parts));
        for e in 0..last {
            let (a, b) = (row(&one, &whole, e), row(&two, &parts, e));
            let mut sums = BTreeMap::new();
            for entry in &b.entries {
                *sums.entry(entry.element.min(last as u32)).or_insert(0u32) += entry.share;
            }
            let known: BTreeMap<u32, u32> =
                a.entries.iter().map(|e| (e.element, e.share)).collect();
            // Ray k owns the shares from k·TOTAL/n on: the same rays in another order round
            // otherwise.
            let off = known
                .iter()
                .map(|(e, &share)| sums.get(e).map_or(share, |s| s.abs_diff(share)));
            prop_assert!(off.max().unwrap_or(0) <= 1 && known.len() == sums.len());
            prop_assert_eq!((a.escaped, a.backface.abs_diff(b.backface) <= 1), (b.escaped, true));
        }
    }

    /// By exact rows: one bounce gives the parts of a polygon, in the mean over their area, what it
    /// gives the whole, and all others the same; and if it reflects nothing, all bounces do.
    #[test]
    #[ignore = "slow"]
    fn split_wall_exchanges_the_same_light(
        room in rooms(0..1), which in 0..24usize, side in 0..3usize, at in 0.1..0.9f64, black: bool,
    ) {
        let (mut faces, mut materials) = (room.faces(), room.materials());
        if black {
            materials[faces[which].1].reflectance = Rgb::ZERO;
        }
        let whole = mesh_of(&faces, materials.clone());
        split(&mut faces, which, side, at);
        let parts = mesh_of(&faces, materials.clone());
        let steps = if black { None } else { Some(1) };
        let solver = Solver { unshot: 1e-13, max_steps: steps, ..Solver::new(Method::Jacobi) };
        let [one, two] = [&whole, &parts].map(|mesh| {
            solver.solve(mesh, &mut exact_rows(mesh), keep_going).unwrap().radiosity
        });
        let areas = areas(&parts);
        let last = areas.len() - 1;
        let mut joined = two[..last].to_vec();
        let (a, b) = (areas[which], areas[last]);
        joined[which] = (two[which] * a + two[last] * b) / (a + b);
        // The parts' rows are rounded for themselves: twice the shares.
        let slack = 2.0 * rounding(&parts, &materials);
        prop_assert!(apart(&joined, &one) <= slack, "{:e} {slack:e}", apart(&joined, &one));
    }
}

/// Cuts face `k` from a point on its `side` to the corner opposite; its second part comes last.
fn split(faces: &mut Vec<Face>, k: usize, side: usize, at: f64) {
    let (corners, material) = faces[k];
    let [a, b, c] = [0, 1, 2].map(|i| corners[(i + side) % 3]);
    let middle = a.lerp(b, at);
    faces[k].0 = [a, middle, c];
    faces.push(([middle, b, c], material));
}
