//! All methods behind one interface: the same answers, ledgers, stop rules. No GPU needed.

use std::ops::ControlFlow;

use radiosity::backend::cpu::RayRows;
use radiosity::form_factor::{Entry, Row};
use radiosity::solver::{Method, StopReason};
use radiosity::{ErrorKind, FormFactors, Material, Mesh, Rgb, Scene, Solution, Solver};

use crate::common::changes::by_elements;
use crate::common::closed_forms::exact;
use crate::common::fakes::{GivenRows, StoredRows};
use crate::common::scenes::{self, walls};
use crate::common::{cornell_box, cube, keep_going, quads};

fn material(reflectance: [f64; 3], exitance: [f64; 3]) -> Material {
    let (reflectance, exitance) = (reflectance.into(), exitance.into());
    Material { reflectance, exitance, ..Material::grey("m", 0.0) }
}

fn grey(reflectance: f64, exitance: f64) -> Material {
    material([reflectance; 3], [exitance; 3])
}

/// Rays, as many for each row.
fn rays(mesh: &Mesh) -> RayRows {
    RayRows::new(mesh, 1024).unwrap().with_full_share(0.0)
}

/// Rows of all elements by rays.
fn stored(mesh: &Mesh) -> StoredRows {
    StoredRows::of(mesh, &mut rays(mesh))
}

/// A unit room with a lamp under its ceiling and a block on its floor.
fn room(surfaces: [Material; 6], lamp: Material, block: Material) -> Scene {
    let lamp_quad = [[0.4, 0.4, 0.95], [0.4, 0.6, 0.95], [0.6, 0.6, 0.95], [0.6, 0.4, 0.95]];
    let mut all: Vec<_> = walls([0.0; 3], [1.0; 3]).into_iter().zip(surfaces).collect();
    all.push((lamp_quad, lamp));
    all.extend(scenes::block([0.2, 0.3, 0.01], [0.5, 0.6, 0.4]).map(|side| (side, block.clone())));
    quads(&all)
}

fn plates() -> Scene {
    let low = [[0., 0., 0.], [2., 0., 0.], [2., 2., 0.], [0., 2., 0.]];
    let high = [[0.7, 0.7, 0.4], [0.7, 1., 0.4], [1., 1., 0.4], [1., 0.7, 0.4]];
    quads(&[(low, grey(0.7, 0.0)), (high, grey(0.3, 5.0))])
}

/// Red, green and blue walls that know nothing of the other channels, and a lamp without blue.
fn colours() -> Scene {
    let wall = |rgb: [f64; 3]| material(rgb, [0.0; 3]);
    let [red, green, blue] = [wall([0.9, 0., 0.]), wall([0., 0.8, 0.]), wall([0., 0., 0.7])];
    let surfaces = [red, green, blue, wall([0.; 3]), wall([0.5, 0.6, 0.7]), wall([0.95, 0.1, 0.])];
    room(surfaces, material([0.0, 0.3, 0.6], [9.0, 1e-3, 0.0]), wall([0.4, 0.99, 0.2]))
}

fn scenes() -> [(&'static str, Mesh); 5] {
    let white = || [(); 6].map(|_| grey(0.8, 0.0));
    let mesh = |scene, size| Mesh::new(scene, size).unwrap();
    [
        ("furnace", mesh(cube(&grey(0.9, 1.0)), 0.36)),
        ("Cornell box", cornell_box(200.0)),
        ("plates", mesh(plates(), 0.2)),
        ("room with block", mesh(room(white(), grey(0.5, 8.0), grey(0.6, 0.0)), 0.2)),
        ("colours", mesh(colours(), 0.2)),
    ]
}

/// Largest difference of a radiosity from `judge`'s, of an element and channel, relative.
fn off(s: &Solution, judge: &Solution) -> f64 {
    let channels =
        |s: &Solution| s.radiosity.iter().flat_map(glam::DVec3::to_array).collect::<Vec<_>>();
    let off = |(a, b): (f64, f64)| if a == b { 0.0 } else { (a / b - 1.0).abs() };
    let worst = channels(s).into_iter().zip(channels(judge)).map(off);
    worst.fold(0.0, |worst, off| if off.is_nan() { f64::INFINITY } else { off.max(worst) })
}

#[test]
fn all_methods_match_direct_solve() {
    for (name, mesh) in scenes() {
        let mut maker = stored(&mesh);
        let judge = Solver::new(Method::Direct).solve(&mesh, &mut maker, keep_going).unwrap();
        assert_eq!((judge.stop, judge.steps), (StopReason::Converged, 1));
        println!("{name}, {} elements", mesh.element_count());
        for method in Method::ALL {
            // What 1e-11 of the flux can still bring, ten or a hundred times that in all, is less
            // than 1e-6 of an element that leaves as little as 1e-3 of its share among a thousand.
            let solver = Solver { unshot: 1e-11, ..by_elements(method) };
            let s = solver.solve(&mesh, &mut maker, keep_going).unwrap();
            let off = off(&s, &judge);
            let imbalance = s.ledger.imbalance();
            println!(
                "  {method}: {} steps, {} shots, {} rows, off {off:.1e}, imbalance {imbalance:.1e}",
                s.steps, s.shots, s.rows_made
            );
            assert!(off < 1e-6, "{name}, {method}: {off:e}");
            assert!(s.method == method && s.stop == StopReason::Converged);
            assert!(s.ledger.unshot_share() <= 1e-11 || method == Method::Direct);
            assert!(imbalance <= 1e-9 && s.rows_made <= mesh.element_count() as u64);
            // Absorbed, lost: where the light went agrees too.
            for (a, b) in [
                (s.ledger.absorbed, judge.ledger.absorbed),
                (s.ledger.escaped, judge.ledger.escaped),
                (s.ledger.backface_loss, judge.ledger.backface_loss),
            ] {
                assert!((a - b).abs().max_element() <= 1e-9 * s.ledger.emitted.max_element());
            }
        }
    }
}

#[test]
fn white_furnace_holds_up_to_reflectance_one() {
    let reflectances = [
        0.0,
        0.1,
        0.3,
        0.5,
        0.7,
        0.9,
        0.95,
        0.99,
        0.999,
        0.9999,
        1.0 - 1e-5,
        1.0 - 3e-6,
        1.0 - 1e-6,
    ];
    // Rows and columns sum to one, so B = E/(1−ρ) everywhere; walls that differ have it too, with
    // E = C (1−ρ) each. What bounds the error is that of columns, 2⁻³³ a share of 1/192: 2e-8; it
    // moves light from element to element and is not amplified by 1/(1−ρ), since none is lost.
    let mesh = Mesh::new(cube(&grey(0.5, 1.0)), 0.36).unwrap();
    let mut maker = StoredRows::of(&mesh, &mut exact());
    for rho in reflectances {
        let even = [rho; 6];
        let uneven = [rho, 0.5 * rho, rho, 0.9 * rho, 0.0, rho];
        for walls in [even, uneven] {
            let mesh = repainted(&mesh, walls.map(|rho| grey(rho, 3.0 * (1.0 - rho))));
            for method in Method::ALL {
                let bounded = matches!(method, Method::Gmres { .. } | Method::Direct);
                if !bounded && rho > 0.99 {
                    continue;
                }
                let solver = Solver { unshot: 1e-9, ..by_elements(method) };
                let s = solver.solve(&mesh, &mut maker, keep_going).unwrap();
                let worst = s.radiosity.iter().map(|b| (*b / 3.0 - 1.0).abs().max_element());
                let worst = worst.fold(0.0, f64::max);
                if bounded {
                    println!(
                        "1 − ρ {:.0e}, {method}: {} steps, off {worst:.1e}, imbalance {:.1e}",
                        1.0 - rho,
                        s.steps,
                        s.ledger.imbalance()
                    );
                }
                assert!(s.radiosity.iter().all(|b| b.is_finite()));
                assert!(worst < 1e-6, "ρ {rho}, {method}: {worst:e}");
                assert!(s.ledger.imbalance() <= 1e-9 && s.stop == StopReason::Converged);
                assert!(s.steps <= 20 || !bounded, "{} steps at ρ {rho}", s.steps);
            }
        }
    }
}

#[test]
fn gmres_needs_few_steps_in_bright_room() {
    // Rows by rays and one small lamp: no answer by heart, but in a closed room all that is emitted
    // is absorbed, and the direct solve is the judge.
    let rho = 1.0 - 1e-6;
    let scene = room([(); 6].map(|_| grey(rho, 0.0)), grey(rho, 1.0), grey(rho, 0.0));
    let mesh = Mesh::new(scene, 0.3).unwrap();
    let mut maker = stored(&mesh);
    let judge = Solver::new(Method::Direct).solve(&mesh, &mut maker, keep_going).unwrap();
    // From the start again after every 3 products, it would need more if cycles did not grow.
    for (restart, most) in [(50, 50), (3, 200)] {
        let solver = Solver { unshot: 1e-7, ..Solver::new(Method::Gmres { restart }) };
        let s = solver.solve(&mesh, &mut maker, keep_going).unwrap();
        let (off, imbalance) = (off(&s, &judge), s.ledger.imbalance());
        println!(
            "{} elements, restart {restart}: {} steps, off {off:.1e}, imbalance {imbalance:.1e}",
            mesh.element_count(),
            s.steps
        );
        // What is unshot is amplified as all light is: 1e-7 in all, of elements much alike.
        assert!(off < 1e-5 && s.steps <= most && imbalance <= 1e-9);
    }
}

#[test]
fn jacobi_steps_are_bounces() {
    let mesh = Mesh::new(colours(), 0.4).unwrap();
    let mut maker = stored(&mesh);
    let count = mesh.element_count();
    let flux = |e: usize| mesh.material(mesh.element(e)).exitance * mesh.area(mesh.element(e));
    let mut bounce: Vec<Rgb> = (0..count).map(flux).collect();
    let mut leaving = bounce.clone();
    for bounces in 0..5 {
        let solver =
            Solver { unshot: 0.0, max_steps: Some(bounces), ..Solver::new(Method::Jacobi) };
        let s = solver.solve(&mesh, &mut maker, keep_going).unwrap();
        assert_eq!((s.steps, s.stop), (bounces, StopReason::Steps));
        for (e, (&b, &flux)) in s.radiosity.iter().zip(&leaving).enumerate() {
            let known = flux / mesh.area(mesh.element(e));
            // Sums of some hundred terms, in another order.
            assert!((b - known).abs().cmple(1e-12 * known).all(), "{bounces} bounces");
        }
        let mut next = vec![Rgb::ZERO; count];
        for (e, &flux) in bounce.iter().enumerate() {
            for entry in &maker.0[&mesh.element(e)].entries {
                let j = entry.element as usize;
                let reflectance = mesh.material(mesh.element(j)).reflectance;
                next[j] += reflectance * Row::form_factor(entry.share) * flux;
            }
        }
        leaving.iter_mut().zip(&next).for_each(|(x, n)| *x += *n);
        bounce = next;
    }
}

#[test]
fn gauss_seidel_needs_fewer_sweeps_than_jacobi() {
    let (_, mesh) = &scenes()[3];
    let mut maker = stored(mesh);
    let [jacobi, gauss_seidel] = [Method::Jacobi, Method::GaussSeidel].map(|method| {
        let solver = Solver { unshot: 1e-6, ..by_elements(method) };
        solver.solve(mesh, &mut maker, keep_going).unwrap().steps
    });
    println!("{jacobi} bounces, {gauss_seidel} sweeps");
    // Where all eigenvalues are real Gauss–Seidel converges like their squares: half the sweeps,
    // and here some more for light that goes against the order.
    assert!(gauss_seidel < jacobi * 3 / 4);
}

#[test]
fn overshoot_saves_shots_in_bright_room() {
    let scene = room([(); 6].map(|_| grey(0.9, 0.0)), grey(0.5, 8.0), grey(0.9, 0.0));
    let mesh = Mesh::new(scene, 0.2).unwrap();
    let mut maker = stored(&mesh);
    let mut shots = |overshoot, unshot| {
        let method = Method::Shooting { overshoot };
        let s =
            Solver { unshot, ..by_elements(method) }.solve(&mesh, &mut maker, keep_going).unwrap();
        assert!(s.ledger.imbalance() < 1e-12);
        assert!(overshoot || s.ledger.overshot == Rgb::ZERO);
        s.shots
    };
    for unshot in [1e-1, 1e-2, 1e-3, 1e-6] {
        let (plain, ahead) = (shots(false, unshot), shots(true, unshot));
        println!("to {unshot:e} unshot: {plain} shots, {ahead} with overshoot");
        assert!(ahead < plain);
    }
}

#[test]
fn overshoot_works_with_large_patches() {
    let mesh = cornell_box(100.0);
    let [plain, ahead] = [Method::ALL[0], Method::ALL[1]].map(|method| {
        let solver = Solver { unshot: 1e-4, ..Solver::new(method) };
        solver.solve(&mesh, &mut rays(&mesh), keep_going).unwrap()
    });
    println!("{} shots, {} with overshoot", plain.shots, ahead.shots);
    assert!(ahead.stop == StopReason::Converged && ahead.ledger.imbalance() <= 1e-12);
    // Other patches are brightest, seen from other places: a tolerance of 0.4 % for either.
    for (a, b) in [
        (plain.ledger.absorbed, ahead.ledger.absorbed),
        (plain.ledger.escaped, ahead.ledger.escaped),
    ] {
        assert!((a - b).abs().cmple(0.01 * plain.ledger.emitted).all(), "{a} {b}");
    }
}

#[test]
fn energy_balances_wherever_solve_ends() {
    let (_, mesh) = &scenes()[2];
    let mut maker = stored(mesh);
    for method in Method::ALL {
        let solver = Solver { unshot: 1e-9, ..by_elements(method) };
        let mut calls = 0;
        let whole = solver.solve(mesh, &mut maker, |p| {
            calls += 1;
            keep_going(p)
        });
        let whole = whole.unwrap();
        for steps in (0..whole.steps).step_by((whole.steps / 7) as usize + 1) {
            let s = Solver { max_steps: Some(steps), ..solver }
                .solve(mesh, &mut maker, keep_going)
                .unwrap();
            let stop = if matches!(method, Method::Shooting { .. }) {
                StopReason::Shots
            } else {
                StopReason::Steps
            };
            assert_eq!((s.steps, s.stop), (steps, stop), "{method}");
            closes(&s, mesh);
        }
        for last in (1..calls).step_by(calls / 13) {
            let mut call = 0;
            let s = solver.solve(mesh, &mut maker, |_| {
                call += 1;
                if call == last { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            });
            let s = s.unwrap();
            assert_eq!((call, s.stop), (last, StopReason::Cancelled), "{method}");
            assert!(s.steps <= whole.steps);
            closes(&s, mesh);
        }
    }
}

/// Flux is conserved, and what leaves is what was emitted and reflected.
fn closes(s: &Solution, mesh: &Mesh) {
    let l = &s.ledger;
    assert!(l.imbalance() <= 1e-12, "{}: {:e}", s.method, l.imbalance());
    let area = |e: usize| mesh.area(mesh.element(e));
    let leaving: Rgb = s.radiosity.iter().zip(0..).map(|(&b, e)| b * area(e)).sum();
    // What left and is not unshot was absorbed, lost or reflected.
    let sent = leaving - (l.unshot - l.overshot);
    let arrived = l.absorbed + (leaving - l.emitted) + l.escaped + l.backface_loss;
    assert!((sent - arrived).abs().max_element() < 1e-12 * l.emitted.max_element());
}

#[test]
fn dropped_rows_are_made_again_unchanged() {
    let (_, mesh) = &scenes()[4];
    let all: usize = stored(mesh).0.values().map(Row::bytes).sum();
    for method in Method::ALL {
        let solve = |row_memory| {
            let solver = Solver { unshot: 1e-4, row_memory, ..by_elements(method) };
            let mut made = 0;
            let s = solver.solve(mesh, &mut rays(mesh), |p| {
                // Cancelled or not, no more than a batch of rows goes by unheard.
                assert!(p.rows_made - made <= rays(mesh).preferred_batch_len() as u64);
                made = p.rows_made;
                keep_going(p)
            });
            s.unwrap()
        };
        let (kept, half, none) = (solve(all), solve(all / 2), solve(0));
        println!("{method}: {} rows, {}, {}", kept.rows_made, half.rows_made, none.rows_made);
        assert!(kept.rows_made <= mesh.element_count() as u64);
        if method == Method::Direct {
            assert_eq!([half.rows_made, none.rows_made], [kept.rows_made; 2]);
        } else {
            assert!(kept.rows_made < half.rows_made && half.rows_made < none.rows_made);
            assert!(none.rows_made >= none.shots);
        }
        if !matches!(method, Method::Shooting { .. }) {
            assert_eq!(kept.radiosity, half.radiosity);
            assert_eq!(kept.radiosity, none.radiosity);
        }
        // The order of shots may differ: all within what is unshot, of an element that has 1e-3.
        assert!((kept.ledger.absorbed - none.ledger.absorbed).abs().max_element() < 1e-3);
    }
}

#[test]
fn channels_of_any_scale_are_solved_alike() {
    // The same scene in three channels, twenty powers of ten or a channel of nothing apart.
    let e = [1e150, 0.0, 1e-150];
    let scene = room([(); 6].map(|_| grey(0.8, 0.0)), material([0.5; 3], e), grey(0.6, 0.0));
    let mesh = Mesh::new(scene, 0.4).unwrap();
    for method in Method::ALL {
        let solver = Solver { unshot: 1e-12, ..by_elements(method) };
        let s = solver.solve(&mesh, &mut stored(&mesh), keep_going).unwrap();
        for b in &s.radiosity {
            assert!(
                b.y == 0.0 && (b.z * 1e150 / (b.x * 1e-150) - 1.0).abs() < 1e-9,
                "{method} {b}"
            );
        }
    }
}

#[test]
fn dark_scene_is_solved_at_once_by_all() {
    let mesh = Mesh::new(cube(&grey(0.8, 0.0)), 0.36).unwrap();
    for method in Method::ALL {
        let s = by_elements(method).solve(&mesh, &mut exact(), keep_going).unwrap();
        assert_eq!((s.steps, s.rows_made, s.stop), (0, 0, StopReason::Converged));
        assert!(s.radiosity.iter().all(|&b| b == Rgb::ZERO));
    }
}

#[test]
fn rejects_bad_settings_rows_and_sizes() {
    let mesh = Mesh::new(cube(&grey(0.8, 1.0)), 2.0).unwrap();
    let refused = |solver: Solver, mesh: &Mesh, says: &str| {
        let e = solver.solve(mesh, &mut exact(), keep_going).unwrap_err();
        assert!(e.kind() == ErrorKind::Setting && e.to_string().contains(says), "{e}");
    };
    for method in Method::ALL {
        for unshot in [-0.1, 1.1, f64::NAN] {
            refused(Solver { unshot, ..by_elements(method) }, &mesh, "use 0 to 1");
        }
        let bright = Mesh::new(cube(&grey(0.8, 1e308)), 2.0).unwrap();
        let e = by_elements(method).solve(&bright, &mut exact(), keep_going).unwrap_err();
        assert!(e.kind() == ErrorKind::Scene && e.place() == "emitted flux", "{e}");
        let half = Row::TOTAL / 2;
        let entry = |element, share| Entry { element, share };
        let bad = [
            vec![],
            vec![Row { escaped: half, ..Default::default() }],
            vec![Row { entries: vec![entry(12, Row::TOTAL)], ..Default::default() }],
        ];
        for rows in bad {
            let e = by_elements(method).solve(&mesh, &mut GivenRows(rows), keep_going).unwrap_err();
            assert_eq!(e.kind(), ErrorKind::FormFactor, "{e}");
        }
    }
    refused(Solver::new(Method::Gmres { restart: 0 }), &mesh, "1 or more");
    for patch_tolerance in [-1.0, f64::NAN] {
        let method = Method::Shooting { overshoot: true };
        let solver = Solver { patch_tolerance, ..Solver::new(method) };
        refused(solver, &mesh, "use 0 or more");
    }
    let large = Mesh::new(cube(&grey(0.8, 1.0)), 0.07).unwrap();
    assert!(large.element_count() > Solver::DIRECT_MAX_ELEMENTS);
    refused(Solver::new(Method::Direct), &large, "at most 4096");
    let e = "newton".parse::<Method>().unwrap_err();
    assert!(e.to_string().contains("'newton'") && e.to_string().contains("gauss-seidel"), "{e}");
    for method in Method::ALL {
        assert_eq!(method.to_string().parse::<Method>().unwrap(), method);
    }
}

#[test]
fn for_mesh_picks_by_size_and_reflectance() {
    let pick = |scene: Scene, size| {
        let mesh = Mesh::new(scene, size).unwrap();
        let solver = Solver::for_mesh(&mesh);
        println!("{} elements: {}", mesh.element_count(), solver.method);
        solver.method.to_string()
    };
    // 12, 3 072 and 49 152 elements in a cube; all rows of the last would take 19 GB.
    assert_eq!(pick(cube(&grey(0.95, 1.0)), 2.0), "direct");
    assert_eq!(pick(cube(&grey(0.5, 1.0)), 0.09), "shooting");
    assert_eq!(pick(cube(&grey(0.95, 1.0)), 0.09), "gmres");
    assert_eq!(pick(cube(&material([0.1, 0.2, 0.95], [1.0; 3])), 0.09), "gmres");
    assert_eq!(pick(cube(&grey(0.95, 1.0)), 0.023), "shooting");
    assert_eq!(pick(cube(&grey(0.999, 1.0)), 0.023), "gmres");
}

/// The mesh of a cube with other materials on its walls.
fn repainted(mesh: &Mesh, walls: [Material; 6]) -> Mesh {
    let s = mesh.scene();
    let (positions, triangles) = (s.positions().to_vec(), s.triangles().to_vec());
    let scene = Scene::new(positions, triangles, s.groups().to_vec(), walls.to_vec()).unwrap();
    let new = Mesh::new(scene, 0.36).unwrap();
    assert_eq!(new.element_count(), mesh.element_count());
    new
}
