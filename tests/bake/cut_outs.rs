//! Bakes of surfaces with holes, against paths, and against holes that are there.

use radiosity::bake::Outcome;
use radiosity::verify::{Settings, verify};
use radiosity::{Backend, BakeResult, BakeTarget, Rgb, Scene, SceneSettings};

use crate::common::cut_outs::{Lattice, Part, board, read};
use crate::common::keep_going;
use crate::common::scenes::{Quad, facing_down, facing_up, walls};
use crate::common::textured::tga;

const SKY: Rgb = Rgb::new(1.0, 2.0, 0.5);

/// Bakes `scene` to an error, which path tracing `truth` finds too: the same scene, or one with
/// holes that are there.
fn checked(scene: &Scene, truth: &Scene, error: f64) -> BakeResult {
    let baked = BakeTarget::Error(error).bake(scene.clone(), &Backend::Cpu, keep_going).unwrap();
    assert_eq!(baked.outcome, Outcome::Reached, "{:?}", baked.estimate);
    assert!(baked.solution.ledger.imbalance() < 1e-9);
    let mut settings = Settings::default();
    settings.precision = 0.3;
    let found = verify(truth, &baked.light.surface, &settings, keep_going).unwrap();
    let measured = found.error.unwrap();
    println!("asked {error}, estimated {}, {measured:?}", baked.estimate.total);
    assert!(measured.value - 2.0 * measured.standard_error < error, "{measured:?}");
    baked
}

/// The flux that elements of group 0 reflect, W.
fn flux_of_first(baked: &BakeResult) -> f64 {
    let (mesh, light) = (&baked.light.mesh, &baked.light);
    let of_element = |e: usize| {
        let node = mesh.element(e);
        let is_first = mesh.scene().triangles()[mesh.triangle(node)].group == 0;
        let reflected = light.corners[e].iter().map(|&v| light.reflected[v as usize]).sum::<Rgb>();
        if is_first { reflected.element_sum() / 3.0 * mesh.solid_area(node) } else { 0.0 }
    };
    (0..mesh.element_count()).map(of_element).sum()
}

#[test]
fn a_floor_under_a_grille_is_as_under_one_that_is_there() {
    let mask = Lattice { side: 8, is_solid: board };
    let grille = facing_up([-1.0, 1.0], [-1.0, 1.0], 0.5);
    let floor: Part = (facing_up([-1.0, 1.0], [-1.0, 1.0], 0.0), "grey");
    let library = "newmtl grey\nKd 0.5\nnewmtl grille\nKd 0.5\nmap_d mask.tga\n";
    let mut settings = SceneSettings::default();
    settings.sky = Some(SKY.into());
    let scene = |grille: Vec<Part>| {
        let parts = [vec![floor], grille].concat();
        read(&parts, library, &[("mask.tga", &mask.image())], &settings)
    };
    let masked = scene(vec![(grille, "grille")]);
    let cut = scene(mask.cells(grille).into_iter().map(|cell| (cell, "grey")).collect());
    let open = scene(vec![]);
    let found = flux_of_first(&checked(&masked, &cut, 0.03));
    let [truth, open] = [cut, open].map(|scene| {
        let baked = BakeTarget::Error(0.03).bake(scene, &Backend::Cpu, keep_going).unwrap();
        flux_of_first(&baked)
    });
    println!("{found} {truth} {open}");
    // Each is off by 3 % of its root mean square at most.
    assert!((found / truth - 1.0).abs() < 0.06, "{found} {truth}");
    assert!(found < 0.92 * open, "{found} {open}");
}

#[test]
fn a_room_with_a_lamp_behind_a_screen_is_as_path_traced() {
    // Larger holes on one side, some of which swallow whole elements.
    let mask = Lattice { side: 8, is_solid: |x, y| x < 4 && (x + y) % 2 == 0 || x >= 4 && y < 5 };
    let screen: Quad = [[1.4, 0.2, 0.1], [1.4, 1.8, 0.1], [1.4, 1.8, 1.7], [1.4, 0.2, 1.7]];
    let mut parts: Vec<Part> = walls([0.0; 3], [2.0; 3]).map(|wall| (wall, "wall")).into();
    parts.push((facing_down([1.55, 1.75], [0.6, 1.4], 1.99), "lamp"));
    let library = "newmtl wall\nKd 0.6\nnewmtl screen\nKd 0.7 0.3 0.2\nmap_d mask.tga\n\
        newmtl cell\nKd 0.7 0.3 0.2\nnewmtl lamp\nKd 0\nKe 9 8 6\n";
    let images = [("mask.tga", &mask.image()[..])];
    let scene = |screen: Vec<Part>| {
        read(&[&parts[..], &screen].concat(), library, &images, &SceneSettings::default())
    };
    let cells = mask.cells(screen).into_iter().map(|cell| (cell, "cell"));
    checked(&scene(vec![(screen, "screen")]), &scene(cells.collect()), 0.05);
}

#[test]
fn a_textured_leaf_with_holes_lets_light_through() {
    // Crossed cards of leaves that colour, let through and are cut out at once, above ground.
    let mask = Lattice { side: 16, is_solid: |x, y| (x / 3 + y / 5) % 2 == 0 };
    let colours = tga(2, &[[90, 200, 60], [200, 180, 40], [60, 120, 30], [120, 220, 90]]);
    let parts = [
        (facing_up([-1.0, 1.0], [-1.0, 1.0], 0.0), "ground"),
        ([[-0.7, -0.5, 0.1], [0.7, 0.5, 0.1], [0.7, 0.5, 1.1], [-0.7, -0.5, 1.1]], "leaf"),
        ([[-0.6, 0.6, 0.2], [0.6, -0.6, 0.3], [0.5, -0.4, 1.3], [-0.6, 0.6, 1.2]], "leaf"),
    ];
    let library = "newmtl ground\nKd 0.4\nnewmtl leaf\nKd 0.9\nmap_Kd colours.tga\n\
        map_d -s 2 1 -o 0.25 0 mask.tga\n";
    let images = [("mask.tga", &mask.image()[..]), ("colours.tga", &colours[..])];
    let mut settings = SceneSettings::default();
    settings.transmit.push(("leaf".into(), Rgb::new(0.1, 0.3, 0.05)));
    settings.sky = Some(SKY.into());
    let scene = read(&parts, library, &images, &settings);
    checked(&scene, &scene, 0.05);
}

#[test]
fn a_sheet_that_is_all_hole_is_not_there() {
    let none = Lattice { side: 4, is_solid: |_, _| false };
    let library = "newmtl wall\nKd 0.6\nnewmtl sheet\nKd 0.9\nKe 5\nmap_d mask.tga\n\
        newmtl lamp\nKd 0\nKe 9 8 6\n";
    let images = [("mask.tga", &none.image()[..])];
    let bake = |sheets: &[Part]| {
        let mut parts: Vec<Part> = walls([0.0; 3], [2.0; 3]).map(|wall| (wall, "wall")).into();
        parts.push((facing_down([0.5, 1.2], [0.5, 1.5], 1.9), "lamp"));
        parts.extend_from_slice(sheets);
        let scene = read(&parts, library, &images, &SceneSettings::default());
        BakeTarget::Error(0.05).bake(scene, &Backend::Cpu, keep_going).unwrap()
    };
    let with = bake(&[(facing_up([0.2, 1.8], [0.3, 1.7], 1.0), "sheet")]);
    let without = bake(&[]);
    assert_eq!(with.solution.ledger.emitted, without.solution.ledger.emitted);
    assert!(with.outcome == Outcome::Reached && with.estimate.total < 0.05);
    // Of a hole nothing is gathered.
    let holes = (0..with.light.mesh.element_count())
        .filter(|&e| with.light.mesh.solid_area(with.light.mesh.element(e)) == 0.0);
    for e in holes {
        for v in with.light.corners[e] {
            // Rounding of what is emitted.
            assert!(with.light.reflected[v as usize].abs_diff_eq(Rgb::ZERO, 1e-12));
        }
    }
    assert!((flux_of_first(&with) / flux_of_first(&without) - 1.0).abs() < 0.05);
}
