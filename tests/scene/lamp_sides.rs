//! Which sides of lamps emit, and the warning where the other would light something.

use std::f64::consts::PI;

use radiosity::scene::{Sides, WarningKind};
use radiosity::{Backend, BakeTarget, Material, Rgb, Scene, SceneSettings, VertexMesh};

use crate::common::keep_going;
use crate::common::scenes::{Quad, block, facing_down, facing_up, paint, quads, walls};

fn auto(reflectance: f64, exitance: f64) -> Material {
    Material { sides: Sides::Auto, ..paint(reflectance, exitance) }
}

/// A room of 3 × 3 × 3 with these lamps of exitance 1, and these things.
fn room(lamps: &[Quad], things: &[Quad]) -> Scene {
    let mut parts: Vec<_> =
        walls([0.0; 3], [3.0; 3]).into_iter().map(|quad| (quad, auto(0.5, 0.0))).collect();
    parts.extend(lamps.iter().map(|&quad| (quad, auto(0.1, 1.0))));
    parts.extend(things.iter().map(|&quad| (quad, auto(0.5, 0.0))));
    quads(&parts)
}

/// A panel of 0.6 × 0.6 that faces down, so far below the ceiling.
fn panel(gap: f64) -> Quad {
    facing_down([1.2, 1.8], [1.2, 1.8], 3.0 - gap)
}

/// Triangles of lamps that are said to be dark where they would light something.
fn dark_backs(scene: &Scene) -> usize {
    let of_kind = scene.warnings().iter().filter(|w| w.kind == WarningKind::DarkBack);
    of_kind.map(|w| w.count).sum()
}

#[test]
fn lamps_whose_backs_see_a_room_are_said() {
    let upright = [[0.5, 1.0, 1.0], [0.5, 2.0, 1.0], [0.5, 2.0, 2.0], [0.5, 1.0, 2.0]];
    for (lamp, what) in
        [(panel(0.1), "below a ceiling"), (panel(1.5), "hanging"), (upright, "sign")]
    {
        let found = room(&[lamp], &[]).resolve_sides();
        assert_eq!(dark_backs(&found), 2, "{what}: {:?}", found.warnings());
        let said = found.warnings().iter().find(|w| w.kind == WarningKind::DarkBack).unwrap();
        assert!(said.to_string().contains("--emit-sides both") && said.names == ["q6"], "{said}");
    }
    // Between two plates in the open, one of which it does not light.
    let plates = [facing_up([0.0, 1.0], [0.0, 1.0], 0.0), facing_down([0.0, 1.0], [0.0, 1.0], 2.0)];
    let between = facing_down([0.0, 1.0], [0.0, 1.0], 1.0);
    let open = quads(&[
        (plates[0], auto(0.5, 0.0)),
        (plates[1], auto(0.5, 0.0)),
        (between, auto(0.0, 1.0)),
    ]);
    assert_eq!(dark_backs(&open.resolve_sides()), 2);
}

#[test]
fn lamps_whose_backs_see_nothing_are_not_said() {
    // Right below the ceiling; a bulb; a box of which one side shines, deeper than wide; a panel
    // below a sky alone, and one above a street in the night.
    let bulb = block([1.0; 3], [1.5; 3]);
    let [shining, others @ ..] = block([1.0, 1.0, 1.0], [2.5, 1.3, 1.3]);
    for (lamps, things) in [(&[panel(1e-3)][..], &[][..]), (&bulb, &[]), (&[shining], &others)] {
        let found = room(lamps, things).resolve_sides();
        assert_eq!(dark_backs(&found), 0, "{:?}", found.warnings());
    }
    let street = facing_up([-9.0, 9.0], [-9.0, 9.0], 0.0);
    let open = quads(&[(street, auto(0.2, 0.0)), (panel(0.0), auto(0.1, 1.0))]);
    assert_eq!(dark_backs(&open.resolve_sides()), 0);
    assert_eq!(dark_backs(&open.with_sky(Rgb::ONE).unwrap().resolve_sides()), 0);
}

/// The scene as its sides are given by a file, with light from `emit_both_sides`.
fn from_file(text: &str, both: bool) -> Scene {
    let mut settings = SceneSettings::default();
    settings.emit_both_sides = both;
    let library: &[u8] = b"newmtl lamp\nKd 0.1\nKe 1 2 3\nnewmtl grey\nKd 0.5\n";
    settings.read("a.obj", text.as_bytes(), &[("a.mtl", library)]).unwrap().resolve_sides()
}

fn obj(parts: &[(&[Quad], &str)]) -> String {
    let mut text = String::from("mtllib a.mtl\n");
    for (k, (all, material)) in parts.iter().enumerate() {
        text += &format!("g {material}{k}\nusemtl {material}\n");
        for quad in *all {
            quad.iter().for_each(|[x, y, z]| text += &format!("v {x} {y} {z}\n"));
            text += "f -4 -3 -2 -1\n";
        }
    }
    text
}

/// Flux that leaves lamps, W per channel.
fn power(scene: &Scene) -> Rgb {
    (0..scene.triangles().len()).map(|t| scene.area(t) * scene.exitance(t)).sum()
}

#[test]
fn both_sides_emit_where_that_is_asked_for() {
    let walls = walls([0.0; 3], [3.0; 3]);
    let of_area = |area: f64| PI * area * Rgb::new(1.0, 2.0, 3.0);
    let far = facing_up([0.2, 0.7], [0.2, 1.2], 1.0);
    for (lamps, front, both) in [
        (vec![panel(0.1)], 0.36, 0.72),
        (vec![panel(1.5), far], 0.36 + 0.5, 0.72 + 1.0),
        // From the inside of a bulb light gets nowhere.
        (block([1.0; 3], [1.5; 3]).to_vec(), 1.5, 1.5),
        // Given for both sides by the file.
        (vec![panel(1.0), facing_up([1.2, 1.8], [1.2, 1.8], 2.0)], 0.72, 0.72),
    ] {
        let text = obj(&[(&walls, "grey"), (&lamps, "lamp")]);
        for (wanted, emits_both) in [(front, false), (both, true)] {
            let scene = from_file(&text, emits_both);
            let found = power(&scene);
            // Rounding of sums.
            assert!(found.abs_diff_eq(of_area(wanted), 1e-12), "{found}: {emits_both} {lamps:?}");
            assert!(!emits_both || dark_backs(&scene) == 0);
        }
    }
}

/// Mean irradiance at a height, over the faces there.
fn irradiance(surface: &VertexMesh, height: f64) -> f64 {
    let (mut flux, mut area) = (0.0, 0.0);
    for face in &surface.faces {
        let [a, b, c] = face.map(|v| surface.positions[v as usize]);
        if [a, b, c].iter().all(|p| (p.z - height).abs() < 1e-9) {
            let size = (b - a).cross(c - a).length() / 2.0;
            let sum: f64 = face.iter().map(|&v| surface.irradiance[v as usize].x).sum();
            (flux, area) = (flux + size * sum / 3.0, area + size);
        }
    }
    assert!((area - 9.0).abs() < 1e-9, "{area}");
    flux / area
}

/// A sheet in the middle of a cube lights ceiling and floor alike.
#[test]
fn light_of_both_sides_is_the_same_above_and_below() {
    let text = obj(&[(&walls([0.0; 3], [3.0; 3]), "grey"), (&[panel(1.5)], "lamp")]);
    let baked = |both: bool| {
        let scene = from_file(&text, both);
        BakeTarget::Error(0.05).bake(scene, &Backend::Cpu, keep_going).unwrap().light.surface
    };
    let above_and_below =
        |surface: &VertexMesh| [3.0, 0.0].map(|height| irradiance(surface, height));
    let [above, below] = above_and_below(&baked(true));
    // Each is off by 5 % at most, in root mean square.
    assert!((above / below - 1.0).abs() < 0.1, "{above} {below}");
    // Of the front alone there is reflected light alone above. The lamp's 0.36 pi W are reflected
    // by 54 m² of walls, 0.36 pi × 0.5 / (1 - 0.5) / 54 = 0.02 W/m² on average; half of them or
    // more fall on the 9 m² below, 0.06 W/m², beside as much reflected light.
    let [above, below] = above_and_below(&baked(false));
    assert!(above < 0.5 * below, "{above} {below}");
}
