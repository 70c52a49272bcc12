//! Random scenes that are open to random skies and suns, of surfaces with one side or two, opaque,
//! translucent or clear: what must hold whatever is in them. See `properties.rs` for how to try
//! more of them.

use glam::DVec3;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use radiosity::gather::{GatherPoint, RadiosityField};
use radiosity::scene::{Sides, SkyDistribution, Specular};
use radiosity::solver::Method;
use radiosity::{Backend, BakeSettings, Material, Mesh, Rgb, Scene, Sky, Solver, Sun, Triangle};

use crate::common::changes::{by_elements, flux_difference, painted, same_rays};
use crate::common::keep_going;

fn config(cases: u32) -> ProptestConfig {
    let default = ProptestConfig::default();
    let given = |name: &str| std::env::var_os(name).is_some();
    ProptestConfig {
        cases: if given("PROPTEST_CASES") { default.cases } else { cases },
        rng_seed: if given("PROPTEST_RNG_SEED") { default.rng_seed } else { RngSeed::Fixed(1) },
        failure_persistence: None,
        ..default
    }
}

fn direction() -> impl Strategy<Value = DVec3> {
    let corner = prop::array::uniform3(-1.0..1.0).prop_map(DVec3::from_array);
    corner.prop_filter("has a length", |d| d.length() > 0.1)
}

fn light() -> impl Strategy<Value = Rgb> {
    prop::array::uniform3(0.0..10.0).prop_map(Rgb::from_array)
}

/// Skies of every kind, without a sun.
fn skies() -> impl Strategy<Value = Sky> {
    let graded = (1..16u32, light(), direction(), direction()).prop_map(|(k, zenith, up, sun)| {
        Sky::new(SkyDistribution::cie(k).unwrap(), zenith, up, sun).unwrap()
    });
    let overcast = (light(), direction())
        .prop_map(|(zenith, up)| Sky::new(SkyDistribution::OVERCAST, zenith, up, up).unwrap());
    let picture = (prop::collection::vec(light(), 8), direction())
        .prop_map(|(pixels, up)| Sky::picture(4, &pixels, up).unwrap());
    prop_oneof![light().prop_map(Sky::uniform), graded, overcast, picture]
}

fn suns() -> impl Strategy<Value = Sun> {
    (direction(), light()).prop_map(|(direction, irradiance)| Sun { direction, irradiance })
}

/// A triangle in a unit box, what it reflects and lets through, what it does on its sides, and
/// what passes it straight on if it is a pane instead.
type Sheet = ([DVec3; 3], [f64; 2], Sides, Option<Rgb>);

fn sheets() -> impl Strategy<Value = Vec<Sheet>> {
    let corner = || prop::array::uniform3(0.0..1.0).prop_map(DVec3::from_array);
    let sides = prop_oneof![Just(Sides::Front), Just(Sides::Both), Just(Sides::Auto)];
    let paint = (0.0..0.9, prop_oneof![Just(0.0), 0.0..0.9])
        .prop_map(|(albedo, through)| [albedo * (1.0 - through), albedo * through]);
    let pane = prop::array::uniform3(0.1..=1.0).prop_map(Rgb::from_array);
    let pane = prop_oneof![3 => Just(None), 1 => pane.prop_map(Some)];
    let sheet = (prop::array::uniform3(corner()), paint, sides, pane)
        .prop_filter("no sliver", |([a, b, c], ..)| (*b - *a).cross(*c - *a).length() > 0.05);
    prop::collection::vec(sheet, 1..8)
}

fn scene(sheets: &[Sheet], sky: Sky) -> Scene {
    let material = |&(_, [rho, tau], sides, pane): &Sheet| match pane {
        None => Material { sides, transmittance: Rgb::splat(tau), ..Material::grey("m", rho) },
        Some(transmittance) => {
            let specular = Some(Specular::Glass { refractive_index: 1.5, transmittance });
            Material { sides, specular, ..Material::grey("glass", 0.0) }
        }
    };
    let triangle = |k: u32| Triangle {
        corners: [3 * k, 3 * k + 1, 3 * k + 2],
        group: 0,
        material: k,
        smoothing: None,
    };
    let positions = sheets.iter().flat_map(|sheet| sheet.0).collect();
    let triangles = (0..sheets.len() as u32).map(triangle).collect();
    let materials = sheets.iter().map(material).collect();
    Scene::new(positions, triangles, vec!["g".into()], materials).unwrap().with_sky(sky).unwrap()
}

/// Irradiance above the middles of all triangles, and the share that is open there.
fn irradiance(sheets: &[Sheet], sky: Sky) -> Vec<(Rgb, f64)> {
    let mesh = Mesh::new(scene(sheets, sky), f64::INFINITY).unwrap();
    let corners = vec![[0; 3]; mesh.element_count()];
    let field = RadiosityField { mesh: &mesh, corners: &corners, reflected: &[Rgb::ZERO] };
    let point = |t: usize| {
        let [a, b, c] = mesh.scene().corners(t);
        let normal = mesh.scene().normal(t);
        GatherPoint { position: (a + b + c) / 3.0 + 1e-6 * normal, normal, near: 1e-7 }
    };
    let points: Vec<_> = (0..sheets.len()).map(point).collect();
    let samples = Backend::Cpu.gather(&mesh, 256).unwrap().gather(&field, &points).unwrap();
    samples.iter().map(|sample| (sample.irradiance, sample.escaped)).collect()
}

/// Of some hundred sums, relative to all of the light.
const ROUNDING: f64 = 1e-12;

proptest! {
    #![proptest_config(config(100))]

    /// A sky and a sun light as each does alone, twice the light twice as much, and no place gets
    /// more than the brightest direction gives from all around.
    #[test]
    #[ignore = "slow"]
    fn light_from_outside_adds_up(sheets in sheets(), sky in skies(), sun in suns()) {
        let alone = irradiance(&sheets, sky.clone());
        let of_sun = irradiance(&sheets, Sky::default().with_sun(sun).unwrap());
        let both = irradiance(&sheets, sky.clone().with_sun(sun).unwrap());
        let twice = Sun { irradiance: 2.0 * sun.irradiance, ..sun };
        let twice = irradiance(&sheets, Sky::default().with_sun(twice).unwrap());
        for k in 0..sheets.len() {
            let all = both[k].0.length() + f64::MIN_POSITIVE;
            let off = (both[k].0 - alone[k].0 - of_sun[k].0).length();
            prop_assert!(off <= ROUNDING * all, "{off:e} of {all}");
            prop_assert!((twice[k].0 - 2.0 * of_sun[k].0).length() <= ROUNDING * all.max(1.0));
            prop_assert!(of_sun[k].0.cmple(sun.irradiance * (1.0 + ROUNDING)).all());
            if let Some(radiance) = sky.uniform_radiance() {
                let open = std::f64::consts::PI * radiance * alone[k].1;
                let has_panes = sheets.iter().any(|sheet| sheet.3.is_some());
                let off = alone[k].0 - open;
                let off = if has_panes { off.max_element() } else { off.length() };
                prop_assert!(off <= ROUNDING * all.max(1.0), "{off:e}");
            }
        }
    }
}

proptest! {
    #![proptest_config(config(40))]

    /// A bake under any of it keeps its ledger, gives the same bits again, and no more light than
    /// came in: B ≤ a H / (1 − a) of the brightest H, with a = ρ + τ.
    #[test]
    #[ignore = "slow"]
    fn bakes_in_the_open_keep_their_ledger(sheets in sheets(), sky in skies(), sun in suns()) {
        let brightest = (0..400).map(|k| {
            // Directions all around (Marsaglia's golden spiral): the brightest piece is among the
            // neighbours of one but for a tenth of it.
            let (height, turn) = ((f64::from(k) + 0.5) / 200.0 - 1.0, 2.4 * f64::from(k));
            let (sine, cosine) = turn.sin_cos();
            let level = (1.0 - height * height).sqrt();
            sky.radiance(DVec3::new(level * cosine, level * sine, height)).max_element()
        });
        let most = 2.0 * std::f64::consts::PI * brightest.fold(0.0, f64::max);
        let scene = scene(&sheets, sky.with_sun(sun).unwrap());
        let settings = BakeSettings::for_error(0.3, &scene);
        let bake = || settings.bake(scene.clone(), &Backend::Cpu, keep_going).unwrap();
        let (one, two) = (bake(), bake());
        prop_assert!(one.solution.ledger.imbalance() < 1e-9, "{:?}", one.solution.ledger);
        prop_assert!(one.light.surface.radiosity == two.light.surface.radiosity);
        let albedo = sheets.iter().map(|sheet| sheet.1.iter().sum()).fold(0.0, f64::max);
        let bound = albedo / (1.0 - albedo) * (most + sun.irradiance.max_element());
        for b in &one.light.surface.radiosity {
            prop_assert!(b.is_finite() && b.min_element() >= 0.0);
            prop_assert!(b.max_element() <= 1.1 * bound, "{b} {bound}");
        }
    }
}

proptest! {
    #![proptest_config(config(100))]

    /// Other materials, or a stop and a saved state, lead to the light of a solve from the start;
    /// what lets as much through as it reflects is as bright on both sides.
    #[test]
    #[ignore = "slow"]
    fn solves_go_on_to_the_same_light(
        sheets in sheets(), emits in 0..8usize, paints in prop::array::uniform8(0.0..0.9f64),
        even: bool,
    ) {
        let mut sheets = sheets;
        for sheet in sheets.iter_mut().filter(|_| even) {
            sheet.1 = [sheet.1.iter().sum::<f64>() / 2.0; 2];
        }
        let lamp = emits % sheets.len();
        let resolved = scene(&sheets, Sky::default());
        let mut materials = resolved.materials().to_vec();
        materials[lamp].exitance = Rgb::new(1.0, 2.0, 0.5);
        let resolved = resolved.with_materials(materials).unwrap().resolve_sides();
        let size = resolved.bounds().diagonal() / 4.0;
        let mesh = Mesh::new(resolved, size).unwrap();
        let repainted = painted(&mesh, |m| {
            let share = paints[(m.reflectance.x * 1e6) as usize % 8];
            m.transmittance *= share;
            m.reflectance *= 1.0 - share;
        });
        for method in Method::ALL {
            let solver = Solver { unshot: 1e-12, ..by_elements(method) };
            let mut rows = same_rays(&mesh);
            let mut first = solver.begin(&mesh).unwrap();
            first.advance(&mut rows, keep_going).unwrap();
            let mut session = solver.resume_bytes(&mesh, &rows, &first.to_bytes()).unwrap();
            for solve in [&mut first, &mut session] {
                solve.run(&mut rows, keep_going).unwrap();
            }
            let here = session.solution().unwrap();
            prop_assert_eq!(&here.radiosity, &first.solution().unwrap().radiosity);
            prop_assert!(here.ledger.imbalance() <= 1e-9);
            if even {
                prop_assert!(are_bright_alike(&mesh, &here.radiosity, lamp));
            }
            session.update_materials(&repainted).unwrap();
            session.run(&mut rows, keep_going).unwrap();
            let (on, over) = (
                session.into_solution().unwrap(),
                solver.solve(&repainted, &mut rows, keep_going).unwrap(),
            );
            // What is unshot in either, at most ten times reflected, and rounding.
            let off = flux_difference(&repainted, &on, &over);
            prop_assert!(off <= 1e-10 && on.ledger.imbalance() <= 1e-9, "{}: {:e}", method, off);
        }
    }
}

/// Whether elements in one place, back to back, have the same radiosity: none that is cut
/// otherwise behind, and none of the lamp.
fn are_bright_alike(mesh: &Mesh, radiosity: &[Rgb], lamp: usize) -> bool {
    let place = |e: usize| {
        let node = mesh.element(e);
        (mesh.centroid(node), mesh.normal(node), mesh.material(node))
    };
    let scale = radiosity.iter().map(|b| b.max_element()).fold(0.0, f64::max);
    let of_lamp = mesh.scene().materials()[lamp].reflectance;
    (0..radiosity.len()).all(|e| {
        let (at, normal, material) = place(e);
        let is_behind = |f: &usize| {
            let (there, facing, _) = place(*f);
            at.distance(there) < 1e-9 && normal.dot(facing) < 0.0
        };
        let behind = (0..radiosity.len()).find(is_behind);
        let concerned = material.transmittance != Rgb::ZERO && material.reflectance != of_lamp;
        behind.filter(|_| concerned).is_none_or(|f| {
            // Of some thousand sums.
            (radiosity[e] - radiosity[f]).length() <= 1e-9 * scale
        })
    })
}
