//! Cases 5.6 to 5.8 of CIE 171:2006, "Test Cases to Assess the Accuracy of Lighting Computer
//! Programs", by their closed forms. Its tables, as far as they are public, are held against these
//! too: table 19, which is wrong, as corrected by I. Ashdown ("CIE 171:2006 – Errata", 2016).
//! `--nocapture` prints what `docs/luminaires.md` tells.

use std::f64::consts::PI;

use glam::DVec3;
use radiosity::form_factor::closed_form::point_to_polygon;
use radiosity::gather::{Gather, GatherPoint};
use radiosity::scene::{IntensityDistribution, Luminaire};
use radiosity::{Backend, BakeSettings, BakeTarget, GatheredMesh, Material, Rgb, Scene, Sky, Sun};

use crate::common::keep_going;
use crate::common::scenes::{Quad, block, facing_down, facing_up, paint, quads, walls};

/// How far values may be off.
const WITHIN: f64 = 0.002;

/// Half a unit of the last digit of a table in percent, and a little for a closed form's own.
const TABLE: f64 = 0.0051;

/// A point at which light is measured: its name, where it lies, and what the table has, percent.
type Place = (char, [f64; 3], f64);

/// `surface`, which reflects the share ρ and is lit by a sun in this `direction` alone, among
/// `others`, which are black; the sun is such that E ρ = 1 on it.
fn sunlit(surface: Quad, rho: f64, others: &[Quad], direction: DVec3, cosine: f64) -> Scene {
    let black = others.iter().map(|&quad| (quad, paint(0.0, 0.0)));
    let all: Vec<_> = std::iter::once((surface, paint(rho, 0.0))).chain(black).collect();
    let irradiance = Rgb::splat(1.0 / (rho * cosine));
    let sky = Sky::default().with_sun(Sun { direction, irradiance }).unwrap();
    quads(&all).with_sky(sky).unwrap()
}

/// The settled light of `scene`.
fn settled(scene: Scene) -> GatheredMesh {
    BakeTarget::Error(0.01).bake(scene, &Backend::Cpu, keep_going).unwrap().light
}

/// Holds what `settled` light brings to `places` with this `normal`, without what
/// comes straight from the sun, against the form factor to what is seen of the surface that
/// reflects, and that against the table.
fn check(settled: &GatheredMesh, normal: DVec3, places: &[Place], seen: impl Fn(DVec3) -> Quad) {
    let field = settled.radiosity_field();
    let at = |place: &Place| DVec3::from_array(place.1);
    let point =
        |place: &Place| GatherPoint { position: at(place) + 1e-6 * normal, normal, near: 1e-7 };
    let points: Vec<GatherPoint> = places.iter().map(point).collect();
    let mut rays = Backend::Cpu.gather(&settled.mesh, 1 << 18).unwrap();
    let samples = rays.gather(&field, &points).unwrap();
    for (place, sample) in places.iter().zip(samples) {
        let seen = seen(at(place)).map(DVec3::from_array);
        let truth = point_to_polygon(at(place), normal, &seen);
        let found = (sample.irradiance - sample.direct).x;
        println!("{} {:.3} % {:.3} % {} %", place.0, 100.0 * found, 100.0 * truth, place.2);
        assert!((100.0 * truth - place.2).abs() < TABLE, "{place:?}: {truth}");
        assert!((found - truth).abs() <= WITHIN * truth, "{place:?}: {found} {truth}");
    }
}

#[test]
fn case_5_6_reflection_by_a_diffuse_surface() {
    // A floor of 4 m × 4 m that reflects 30 % under a sun at 35°; above it a wall from 0.5 m on,
    // and a ceiling at 3 m. Table 17.
    let floor = facing_up([0.0, 4.0], [0.0, 4.0], 0.0);
    let (wall, ceiling) =
        (walls([0.0, 0.0, 0.5], [4.0, 4.0, 3.0])[2], facing_down([0.0, 4.0], [0.0, 4.0], 3.0));
    let (sine, cosine) = 35f64.to_radians().sin_cos();
    let light = settled(sunlit(floor, 0.3, &[wall, ceiling], DVec3::new(0.0, cosine, sine), sine));
    let on_wall = [('B', 35.901), ('C', 27.992), ('D', 21.639), ('E', 16.716), ('F', 12.967)];
    let heights = (0..).map(|k| 0.75 + 0.5 * f64::from(k));
    let on_wall: Vec<Place> =
        on_wall.iter().zip(heights).map(|(&(n, table), z)| (n, [2.0, 0.0, z], table)).collect();
    check(&light, DVec3::Y, &on_wall, |_| floor);
    let on_ceiling = [
        ('G', 26.80),
        ('H', 30.94),
        ('I', 33.98),
        ('J', 35.57),
        ('K', 35.57),
        ('L', 33.98),
        ('M', 30.94),
        ('N', 26.80),
    ];
    let depths = (0..).map(|k| 0.25 + 0.5 * f64::from(k));
    let on_ceiling: Vec<Place> =
        on_ceiling.iter().zip(depths).map(|(&(n, table), y)| (n, [2.0, y, 3.0], table)).collect();
    check(&light, DVec3::NEG_Z, &on_ceiling, |_| floor);
}

#[test]
fn case_5_7_reflection_past_an_obstruction() {
    // A wall of 4 m × 3 m that reflects 60 % under a sun at 60°, behind a block 1 m high; another
    // wall 4 m before it, and a floor up to the block. Table 19, corrected.
    let sunny = walls([0.0, 0.0, 0.0], [4.0, 4.0, 3.0])[3];
    let wall = walls([0.0, 0.0, 0.0], [4.0, 4.0, 3.0])[2];
    let floor = facing_up([0.0, 4.0], [0.0, 2.5], 0.0);
    let others: Vec<Quad> =
        block([0.0, 2.5, 0.0], [4.0, 2.7, 1.0]).into_iter().chain([wall, floor]).collect();
    let (sine, cosine) = 60f64.to_radians().sin_cos();
    let light = settled(sunlit(sunny, 0.6, &others, DVec3::new(0.0, -cosine, sine), cosine));
    // What is seen of the wall past the nearer and the further edge of the block's top.
    let seen = |from: DVec3| {
        let past = |edge: f64| from.z + (1.0 - from.z) * (4.0 - from.y) / (edge - from.y);
        let low = past(2.5).max(past(2.7)).clamp(0.0, 3.0);
        [[0.0, 4.0, low], [4.0, 4.0, low], [4.0, 4.0, 3.0], [0.0, 4.0, 3.0]]
    };
    let on_wall =
        [('A', 16.07), ('B', 16.33), ('C', 15.40), ('D', 13.32), ('E', 10.32), ('F', 7.08)];
    let heights = (0..).map(|k| 2.75 - 0.5 * f64::from(k));
    let on_wall: Vec<Place> =
        on_wall.iter().zip(heights).map(|(&(n, table), z)| (n, [2.0, 0.0, z], table)).collect();
    check(&light, DVec3::Y, &on_wall, seen);
    let on_floor = [('G', 3.38), ('H', 3.63), ('I', 3.01), ('J', 0.0), ('K', 0.0)];
    let depths = (0..).map(|k| 0.25 + 0.5 * f64::from(k));
    let on_floor: Vec<Place> =
        on_floor.iter().zip(depths).map(|(&(n, table), y)| (n, [2.0, y, 0.0], table)).collect();
    check(&light, DVec3::Z, &on_floor, seen);
}

#[test]
fn case_5_8_reflected_light_in_a_room() {
    // A point of 10 000 lm in the middle of a cube of 4 m. What all surfaces absorb is what it
    // sends, whatever the room's shape: in the mean E = Φ / (A (1 − ρ)), of which Φ ρ / (A (1 − ρ))
    // was reflected before. Table 20 has that.
    const FLUX: f64 = 10_000.0;
    const AREA: f64 = 96.0;
    let room = |rho: f64| {
        let walls = walls([0.0; 3], [4.0; 3]);
        let room = quads(&walls.map(|wall| (wall, Material::grey("wall", rho))));
        let even = IntensityDistribution::isotropic(FLUX / (4.0 * PI)).unwrap();
        let lamp = Luminaire::new(even, DVec3::splat(2.0), DVec3::NEG_Z);
        room.with_luminaires(vec![lamp]).unwrap()
    };
    let reflectances = [0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95];
    let table = [5.48, 11.6, 26.0, 44.6, 69.4, 104.0, 156.0, 243.0, 417.0, 937.0, 1979.0];
    for (rho, table) in reflectances.into_iter().zip(table) {
        let scene = room(rho);
        let mut settings = BakeSettings::elements_only(&scene);
        settings.solve.element_size = 0.5;
        // Light that is reflected is summed here, whichever wall it falls on.
        settings.solve.hemicube_resolution = 32;
        let baked = settings.bake(scene, &Backend::Cpu, keep_going).unwrap();
        let truth = FLUX * rho / (AREA * (1.0 - rho));
        // All that elements send, without what they send of what they received first.
        let mesh = &baked.mesh;
        let sent: f64 = (0..mesh.element_count())
            .map(|e| baked.solution.radiosity[e].x * mesh.area(mesh.element(e)))
            .sum();
        let found = (sent / rho - baked.solution.ledger.emitted.x) / AREA;
        println!("{rho} {found:.2} {truth:.2} {table}");
        // Three digits, cut off or rounded.
        assert!((truth / table - 1.0).abs() < 0.005, "{truth} {table}");
        assert!((found / truth - 1.0).abs() < WITHIN, "{rho}: {found} {truth}");
    }
    // What vertices gathered, to the error asked for.
    let baked = BakeTarget::Error(0.02).bake(room(0.5), &Backend::Cpu, keep_going).unwrap();
    let surface = &baked.light.surface;
    let of_face = |face: &[u32; 3]| {
        let [a, b, c] = face.map(|v| surface.positions[v as usize]);
        let sum: f64 = face.iter().map(|&v| surface.radiosity[v as usize].x).sum();
        (b - a).cross(c - a).length() / 6.0 * sum
    };
    let found = surface.faces.iter().map(of_face).sum::<f64>() / (0.5 * AREA);
    let truth = FLUX / (AREA * 0.5);
    println!("vertices {found:.2} {truth:.2}");
    assert!((found / truth - 1.0).abs() < 0.01, "{found} {truth}");
}
