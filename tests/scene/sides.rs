//! Which sides of triangles reflect: as a material says, or those that light can reach.

use std::f64::consts::PI;

use glam::DVec3;
use radiosity::scene::{Sides, WarningKind};
use radiosity::{
    Backend, BakeTarget, Material, Rgb, Scene, SceneSettings, Sky, Sun, Triangle, VertexMesh,
    load_scene,
};

use crate::common::keep_going;
use crate::common::scenes::{Quad, block, facing_down, facing_up, paint, quads, walls};

fn auto(reflectance: f64, exitance: f64) -> Material {
    Material { sides: Sides::Auto, ..paint(reflectance, exitance) }
}

/// Quads that all find their sides, each with its reflectance and exitance.
fn scene(parts: &[(&[Quad], f64, f64)]) -> Scene {
    let mut painted = vec![];
    for (all, rho, e) in parts {
        painted.extend(all.iter().map(|&quad| (quad, auto(*rho, *e))));
    }
    quads(&painted)
}

const ROOM: ([f64; 3], [f64; 3]) = ([0.0; 3], [1.0; 3]);

fn room() -> [Quad; 6] {
    walls(ROOM.0, ROOM.1)
}

/// A lamp of 0.4 × 0.4 so far below the ceiling.
fn lamp(gap: f64) -> Quad {
    facing_down([0.3, 0.7], [0.3, 0.7], 1.0 - gap)
}

/// The same scene with some triangles the other way round: of every three all but one, and so on.
fn flipped(scene: &Scene, seed: u64) -> (Scene, usize) {
    let mut rng = fastrand::Rng::with_seed(seed);
    let mut count = 0;
    let turn = |t: &Triangle| {
        let [a, b, c] = t.corners;
        let turns = rng.bool();
        count += usize::from(turns);
        Triangle { corners: if turns { [a, c, b] } else { [a, b, c] }, ..*t }
    };
    let triangles = scene.triangles().iter().map(turn).collect();
    let (groups, materials) = (scene.groups().to_vec(), scene.materials().to_vec());
    let turned = Scene::new(scene.positions().to_vec(), triangles, groups, materials).unwrap();
    (turned.with_sky(scene.sky().clone()).unwrap(), count)
}

/// How many triangles were dropped, turned and doubled, by the warnings.
fn done(scene: &Scene) -> [usize; 3] {
    let kinds = [WarningKind::RepeatedTriangle, WarningKind::Winding, WarningKind::BothSides];
    kinds.map(|kind| {
        let of_kind: Vec<_> = scene.warnings().iter().filter(|w| w.kind == kind).collect();
        assert!(of_kind.len() < 2);
        of_kind.first().map_or(0, |w| w.count)
    })
}

fn triangles(scene: &Scene) -> Vec<[u32; 3]> {
    scene.triangles().iter().map(|t| t.corners).collect()
}

#[test]
fn triangles_wound_at_random_are_turned_to_the_light() {
    let (boxed, gap) = (block([0.3, 0.3, 0.0], [0.6, 0.6, 0.4]), lamp(1e-3));
    let furnished = scene(&[(&room(), 0.5, 0.0), (&boxed, 0.7, 0.0), (&[gap], 0.2, 1.0)]);
    let given = furnished.resolve_sides();
    assert_eq!((triangles(&given), done(&given)), (triangles(&furnished), [0; 3]));
    for seed in 0..5 {
        let (turned, count) = flipped(&furnished, seed);
        let found = turned.resolve_sides();
        // The bottom of the box lies on the floor: neither of its sides is lit, and it stays.
        let bottom = 20..22;
        let facing = |s: &Scene, t: usize| s.normal(t).dot(furnished.normal(t)) > 0.0;
        let wrong = (0..26).filter(|t| !bottom.contains(t) && !facing(&found, *t)).count();
        let left = bottom.clone().filter(|&t| !facing(&turned, t)).count();
        assert_eq!((wrong, done(&found)), (0, [0, count - left, 0]), "{seed}");
        assert_eq!(found.triangles().len(), 26);
    }
}

#[test]
fn the_end_of_a_tunnel_faces_as_its_walls_do() {
    // Up to the lamp at 40 there is light; at the end, at 100, after more bounces than walks have.
    let tunnel = walls([0.0; 3], [1.0, 1.0, 100.0]);
    let parts = scene(&[(&tunnel, 0.99, 0.0), (&[lamp(-39.0)], 0.0, 1.0)]);
    // The walls are one group, and so one sheet.
    let triangles = parts.triangles().iter().map(|t| Triangle { group: t.group / 6, ..*t });
    let (groups, materials) = (parts.groups().to_vec(), parts.materials().to_vec());
    let lit = Scene::new(parts.positions().to_vec(), triangles.collect(), groups, materials);
    let lit = lit.unwrap();
    for seed in 0..5 {
        let found = flipped(&lit, seed).0.resolve_sides();
        let outwards = |&t: &usize| found.normal(t).dot(lit.normal(t)) < 0.0;
        assert_eq!((0..12).filter(outwards).count(), 0, "{seed}");
    }
}

#[test]
fn scenes_wound_right_stay_as_they_are() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj");
    let given = load_scene(path).unwrap();
    assert!(given.materials().iter().all(|m| m.sides == Sides::Auto));
    let found = given.resolve_sides();
    assert_eq!(found.triangles(), given.triangles());
    assert!(found.warnings().is_empty() && found.materials().len() == given.materials().len());
    assert!(found.materials().iter().all(|m| m.sides == Sides::Front));
    let mut front = SceneSettings::default();
    front.sides = Sides::Front;
    assert!(front.load(path).unwrap().materials().iter().all(|m| m.sides == Sides::Front));
}

#[test]
fn sheets_that_are_lit_from_both_sides_get_a_second_triangle() {
    let screen: Quad = [[0.5, 0.2, 0.2], [0.5, 0.8, 0.2], [0.5, 0.8, 0.8], [0.5, 0.2, 0.8]];
    let found = scene(&[(&room(), 0.5, 0.0), (&[screen], 0.3, 0.0), (&[lamp(0.01)], 0.0, 1.0)])
        .resolve_sides();
    assert_eq!((done(&found), found.triangles().len()), ([0, 0, 2], 18));
    for (twin, t) in [(16, 12), (17, 13)] {
        let [of_twin, of_t] = [twin, t].map(|t| found.triangles()[t]);
        let [a, b, c] = of_t.corners;
        assert_eq!(of_twin, Triangle { corners: [a, c, b], ..of_t });
    }
    // A surface that reflects nothing needs none.
    let black = scene(&[(&room(), 0.5, 0.0), (&[screen], 0.0, 0.0), (&[lamp(0.01)], 0.0, 1.0)]);
    assert_eq!(done(&black.resolve_sides()), [0; 3]);
}

#[test]
fn light_decides_and_not_what_is_around() {
    // A sheet under a lamp, in the night: from below it sees nothing. Under a sky it does.
    let sheet = facing_down([0.0, 1.0], [0.0, 1.0], 0.0);
    let night = scene(&[(&[sheet], 0.5, 0.0), (&[lamp(0.2)], 0.5, 1.0)]);
    let found = night.resolve_sides();
    assert_eq!(done(&found), [0, 2, 0]);
    assert_eq!(found.normal(0), DVec3::Z);
    let day = night.with_sky(Rgb::ONE).unwrap().resolve_sides();
    assert_eq!(done(&day), [0, 0, 4]);
    // No light at all, and light that cannot get in.
    for dark in [scene(&[(&[sheet], 0.5, 0.0)]), scene(&[(&room(), 0.5, 0.0)])] {
        assert_eq!(done(&flipped(&dark, 1).0.resolve_sides()), [0; 3]);
    }
    let outside = scene(&[(&room(), 0.5, 0.0)]).with_sky(Rgb::ONE).unwrap().resolve_sides();
    assert_eq!((done(&outside), outside.triangles().len()), ([0; 3], 12));
    // A body that is inside out and not all of the scene, or open, or wound in all ways.
    let body = walls([0.0; 3], [1.0; 3]);
    let far = facing_up([2.0, 3.0], [0.0, 1.0], 0.0);
    let beside = scene(&[(&body, 0.5, 0.0), (&[far], 0.5, 0.0)]).with_sky(Rgb::ONE).unwrap();
    assert_eq!(done(&beside.resolve_sides()), [0, 12, 2]);
    let (mixed, _) = flipped(&scene(&[(&body, 0.5, 0.0)]).with_sky(Rgb::ONE).unwrap(), 3);
    let found = mixed.resolve_sides();
    let outwards = |t: usize| found.normal(t).dot(found.corners(t)[0] - DVec3::splat(0.5)) > 0.0;
    assert!((0..12).all(outwards) && done(&found)[1] > 0);
}

#[test]
fn the_inside_of_bodies_that_interpenetrate_is_dark() {
    let cross = [
        block([0.2, 0.4, 0.3], [0.8, 0.6, 0.5]),
        block([0.4, 0.2, 0.35], [0.6, 0.8, 0.45]),
        block([0.45, 0.45, -0.2], [0.55, 0.55, 0.4]),
    ]
    .concat();
    let found =
        scene(&[(&room(), 0.5, 0.0), (&cross, 0.5, 0.0), (&[lamp(0.1)], 0.0, 1.0)]).resolve_sides();
    assert_eq!(done(&found), [0; 3], "{:?}", found.warnings());
}

#[test]
fn a_part_of_a_sheet_that_is_inside_of_a_body_is_dark() {
    // A screen in two parts, of one group: the lower one is in a block.
    let part = |z0: f64, z1: f64| [[0.5, 0.4, z0], [0.5, 0.6, z0], [0.5, 0.6, z1], [0.5, 0.4, z1]];
    let solid = block([0.3, 0.3, 0.1], [0.7, 0.7, 0.6]);
    let parts = scene(&[
        (&room(), 0.5, 0.0),
        (&solid, 0.5, 0.0),
        (&[lamp(0.1)], 0.0, 1.0),
        (&[part(0.2, 0.55), part(0.55, 0.65), part(0.65, 0.85)], 0.5, 0.0),
    ]);
    let triangles = parts.triangles().iter().map(|t| Triangle { group: t.group.min(13), ..*t });
    let (groups, materials) = (parts.groups().to_vec(), parts.materials().to_vec());
    let one = Scene::new(parts.positions().to_vec(), triangles.collect(), groups, materials);
    let found = one.unwrap().resolve_sides();
    // Nothing of the lowest, all of the highest; of the middle one half is outside.
    assert_eq!(done(&found), [0, 0, 4]);
    assert!(
        found.triangles()[32..]
            .iter()
            .all(|t| t.corners.iter().all(|&k| { found.positions()[k as usize].z >= 0.55 }))
    );
}

#[test]
fn lamps_shine_where_their_light_gets_further() {
    // Right below the ceiling, wound up; a bulb inside out; a window whose light would leave.
    let up = facing_up([0.3, 0.7], [0.3, 0.7], 0.99);
    let bulb = walls([0.5; 3], [0.52; 3]);
    let [mut west, rest @ ..] = room();
    west.reverse();
    let window = west.map(|[x, y, z]| [x, 0.4 + 0.2 * y, 0.4 + 0.2 * z]);
    for (lamp, count) in [(&[up][..], 2), (&bulb, 12)] {
        let found = scene(&[(&room(), 0.5, 0.0), (lamp, 0.0, 1.0)]).resolve_sides();
        assert_eq!(done(&found), [0, count, 0], "{:?}", found.warnings());
    }
    let found = scene(&[(&rest, 0.5, 0.0), (&[window], 0.0, 1.0)]).resolve_sides();
    assert_eq!(done(&found), [0, 2, 0]);
    assert_eq!(found.normal(10), DVec3::X);
    // A body that shines all around stays, alone in the open too, where no ray meets anything.
    let body = block([0.2; 3], [0.8; 3]);
    let found = scene(&[(&body, 0.5, 1.0)]).resolve_sides();
    assert_eq!(done(&found), [0; 3]);
    // One that lights the ceiling, and reflects below, stays; what it has below emits nothing.
    let uplight = facing_up([0.3, 0.7], [0.3, 0.7], 0.9);
    let found = scene(&[(&room(), 0.5, 0.0), (&[uplight], 0.4, 1.0)]).resolve_sides();
    assert_eq!((done(&found), found.normal(12)), ([0, 0, 2], DVec3::Z));
    assert_eq!(found.exitance(12), Rgb::ONE);
    for twin in [14, 15] {
        assert_eq!((found.normal(twin), found.exitance(twin)), (-DVec3::Z, Rgb::ZERO));
        assert_eq!(found.material(twin).reflectance, Rgb::splat(0.4));
    }
    assert_eq!(found.materials().len(), 8 /* one a quad of the seven, and the dark one */);
}

#[test]
fn lamps_given_for_both_sides_shine_on_both() {
    // A room whose triangles from the thirteenth on are there again, the other way round.
    let given_for_both = |lamps: &[Quad]| {
        let once = scene(&[(&room(), 0.5, 0.0), (lamps, 0.4, 1.0)]);
        let (mut triangles, groups) = (once.triangles().to_vec(), once.groups().to_vec());
        for t in &once.triangles()[12..] {
            let [a, b, c] = t.corners;
            // And a third time, which is left out.
            triangles.extend([[b, a, c], [c, b, a]].map(|corners| Triangle { corners, ..*t }));
        }
        let materials = once.materials().to_vec();
        Scene::new(once.positions().to_vec(), triangles, groups, materials).unwrap().resolve_sides()
    };
    let fluxes = |scene: &Scene| {
        let towards = |direction: DVec3| {
            let lamps = (0..scene.triangles().len()).filter(|&t| scene.exitance(t) == Rgb::ONE);
            lamps.map(|t| scene.area(t) * scene.normal(t).dot(direction).max(0.0)).sum::<f64>()
        };
        [DVec3::Z, -DVec3::Z].map(towards)
    };
    let sheet = facing_up([0.3, 0.7], [0.3, 0.7], 0.6);
    let found = given_for_both(&[sheet]);
    assert_eq!((done(&found), found.triangles().len()), ([2, 0, 0], 16));
    let off = fluxes(&found).map(|flux| (flux - 0.4 * 0.4).abs());
    assert!(off[0] < 1e-12 && off[1] < 1e-12, "{off:?}");
    // Inside of a small body there is nothing to light, whichever way round comes first.
    for bulb in [block([0.5; 3], [0.52; 3]), walls([0.5; 3], [0.52; 3])] {
        let found = given_for_both(&bulb);
        assert_eq!((done(&found), found.triangles().len()), ([24, 0, 0], 24));
        for t in 12..24 {
            let outwards = found.corners(t)[0] - DVec3::splat(0.51);
            assert!(found.normal(t).dot(outwards) > 0.0 && found.exitance(t) == Rgb::ONE);
        }
    }
}

#[test]
fn triangles_given_again_are_dropped() {
    let sheet = facing_up([0.2, 0.8], [0.2, 0.8], 0.5);
    let lit = |second: Material, group: u32| {
        let base = scene(&[(&room(), 0.5, 0.0), (&[lamp(0.1)], 0.0, 1.0), (&[sheet], 0.5, 0.0)]);
        let mut triangles = base.triangles().to_vec();
        let mut materials = base.materials().to_vec();
        let again = base.triangles()[14..].iter().map(|t| {
            let [a, b, c] = t.corners;
            Triangle {
                corners: [c, b, a],
                group: t.group - group,
                material: materials.len() as u32,
                ..*t
            }
        });
        let own = second == materials[7];
        let again: Vec<Triangle> =
            again.map(|t| Triangle { material: if own { 7 } else { t.material }, ..t }).collect();
        triangles.extend(again);
        materials.push(second);
        Scene::new(base.positions().to_vec(), triangles, base.groups().to_vec(), materials)
            .unwrap()
            .resolve_sides()
    };
    // The same material: one sheet, lit from both sides.
    let once = lit(auto(0.5, 0.0), 0);
    assert_eq!((done(&once), once.triangles().len()), ([2, 0, 2], 18));
    // Another: two that cover each other's backs, each with its side. So in another group.
    for (material, group) in [(auto(0.3, 0.0), 0), (auto(0.5, 0.0), 1)] {
        let both = lit(material, group);
        assert_eq!((done(&both), both.triangles().len()), ([0; 3], 18));
    }
}

#[test]
fn a_face_in_one_place_with_a_lit_front_is_dropped() {
    // The bottom of a box lies in the floor, which shines: inside as well. Its top sees only that.
    let floor = room()[4];
    let [.., bottom, top] = block([0.3, 0.3, 0.0], [0.6, 0.6, 0.4]);
    let sides: Vec<Quad> = block([0.3, 0.3, 0.0], [0.6, 0.6, 0.4])[..4].to_vec();
    let parts: [(&[Quad], f64, f64); 4] =
        [(&[floor], 0.5, 1.0), (&sides, 0.5, 0.0), (&[top], 0.5, 0.0), (&[bottom], 0.5, 1.0)];
    let found = scene(&parts).resolve_sides();
    assert_eq!(done(&found), [2, 2, 8], "{:?}", found.warnings());
    assert_eq!(found.triangles().len(), 2 + 8 + 2 + 8);
}

/// Radiosity of all vertices whose normals are `normal`.
fn radiosity_of(surface: &VertexMesh, normal: DVec3) -> Vec<Rgb> {
    let facing = surface.normals.iter().zip(&surface.radiosity);
    facing.filter(|(n, _)| n.distance(normal) < 1e-6).map(|(_, &b)| b).collect()
}

#[test]
fn both_sides_of_a_plate_receive_the_sky() {
    let plate = facing_up([0.0, 1.0], [0.0, 1.0], 0.0);
    for (sides, lit) in
        [(Sides::Front, [true, false]), (Sides::Both, [true, true]), (Sides::Auto, [true, true])]
    {
        let material = Material { sides, ..paint(0.6, 0.0) };
        let scene = quads(&[(plate, material)]).with_sky(Rgb::new(1.0, 2.0, 0.5)).unwrap();
        let baked = BakeTarget::Error(0.05).bake(scene, &Backend::Cpu, keep_going).unwrap();
        for (normal, is_lit) in [(DVec3::Z, lit[0]), (-DVec3::Z, lit[1])] {
            let found = radiosity_of(&baked.light.surface, normal);
            assert_eq!(!found.is_empty(), is_lit);
            // ρ π L, from weights of rays that add up to 1 in 32-bit floats.
            let exact = 0.6 * PI * Rgb::new(1.0, 2.0, 0.5);
            assert!(
                found.iter().all(|b| (*b / exact - 1.0).abs().max_element() < 1e-6),
                "{found:?}"
            );
        }
    }
}

#[test]
fn light_through_a_translucent_lid_reaches_what_is_below() {
    // A well with black walls, whose floor is wound the wrong way; all of the sky is above a lid.
    for transmittance in [0.0, 0.5] {
        let lid = Material { transmittance: Rgb::splat(transmittance), ..paint(0.0, 0.0) };
        let [x0, x1, y0, y1, ..] = room();
        let mut parts = [x0, x1, y0, y1].map(|wall| (wall, paint(0.0, 0.0))).to_vec();
        parts.push((facing_down([0.0, 1.0], [0.0, 1.0], 0.0), auto(0.5, 0.0)));
        parts.push((facing_up([-0.1, 1.1], [-0.1, 1.1], 1.0), lid));
        let below = facing_up([-3.0, 3.0], [-3.0, 3.0], -0.1);
        parts.push((below, paint(0.0, 0.0)));
        let scene = quads(&parts).with_sky(Rgb::ONE).unwrap().resolve_sides();
        let is_turned = scene.normal(8) == DVec3::Z;
        assert_eq!(is_turned, transmittance > 0.0, "{:?}", scene.warnings());
    }
}

#[test]
fn translucent_sheets_stay_as_they_are_wound() {
    // Lit from behind alone: what is opaque is turned, what is translucent has both sides anyway.
    for (transmittance, front) in [(0.0, DVec3::Z), (0.5, -DVec3::Z)] {
        let sheet = Material { transmittance: Rgb::splat(transmittance), ..auto(0.4, 0.0) };
        let sun = Sun { direction: DVec3::Z, irradiance: Rgb::ONE };
        let scene = quads(&[(facing_down([0.0, 1.0], [0.0, 1.0], 0.0), sheet)]);
        let scene = scene.with_sky(Sky::default().with_sun(sun).unwrap()).unwrap().resolve_sides();
        assert_eq!(scene.normal(0), front, "{:?}", scene.warnings());
        assert_eq!(scene.triangles().len(), if transmittance > 0.0 { 4 } else { 2 });
    }
}
