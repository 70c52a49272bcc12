//! Measuring grids: where points are, and rooms that were path traced.

use glam::DVec3;
use radiosity::grid::{GridSettings, MeasuredGrid, MeasuringGrid, Quantity};
use radiosity::io::SceneSettings;
use radiosity::scene::SkyDistribution;
use radiosity::{Backend, BakeTarget, GatheredMesh, Rgb, Scene, Sky};

use crate::case::{Case, Section};
use crate::{Result, file, go, go_on};

/// Error that grids are asked for; bakes have three times as much, as the program has.
const ASKED: f64 = 0.02;

const ZENITH: f64 = 4092.6;

/// By path tracing, lx, and by how much it may be off.
struct Truth {
    value: f64,
    error: f64,
}

pub fn section() -> Result<Section> {
    let mut cases = counts()?;
    cases.extend(side_lit_room()?);
    cases.extend(room_behind_a_door()?);
    let bands = "Numbers of points: none. Rooms: four standard errors of the mean as stated, and \
        those of the path-traced value (half a digit where it has none).";
    Ok(Section { title: "Measuring grids", bands, cases })
}

/// EN 12464-1: p = 0.2 · 5^log₁₀ d, and the odd number of points next to d/p.
fn counts() -> Result<Vec<Case>> {
    let mut cases = vec![];
    for (edges, counts) in [
        ([1.0, 1.0], [5, 5]),
        ([10.0, 10.0], [11, 11]),
        ([100.0, 100.0], [21, 21]),
        ([5.0, 4.0], [9, 7]),
        ([20.0, 5.0], [33, 9]),
    ] {
        let found = GridSettings::default().counts(edges)?;
        let [a, b] = edges;
        let of_points = |[a, b]: [usize; 2]| (a * b) as f64;
        cases.push(Case {
            name: format!("area of {a} m × {b} m, {} × {} points", counts[0], counts[1]),
            source: "EN 12464-1, table and formula; even numbers become odd".into(),
            quantity: "points".into(),
            right: of_points(counts),
            here: of_points(found),
            band: 0.0,
        });
    }
    Ok(cases)
}

fn data(name: &str) -> std::path::PathBuf {
    file("examples/verification/data").join(name)
}

fn light(scene: Scene) -> Result<GatheredMesh> {
    Ok(BakeTarget::Error(3.0 * ASKED).bake(scene, &Backend::Cpu, go)?.light)
}

/// The mean illuminance 0.8 m above a group, and its standard error, lx.
fn mean(light: &GatheredMesh, group: &str) -> Result<[f64; 2]> {
    let settings = GridSettings { strip: 0.5, ..GridSettings::default() };
    let grid = MeasuringGrid::above_group(light.mesh.scene(), group, DVec3::Z, 0.8, &settings)?;
    let mut gatherer = Backend::Cpu.gather_to_noise(light, 0.25 * ASKED)?;
    let found = grid.measure(light, &mut *gatherer, go_on)?;
    let mut found: MeasuredGrid = found.ok_or("stopped")?;
    found.correct(light, ASKED, go_on)?;
    let statistics = found.statistics(Quantity::Illuminance).ok_or("no points")?;
    Ok([statistics.mean, statistics.mean_error])
}

fn case(name: &str, [here, error]: [f64; 2], truth: &Truth) -> Case {
    Case {
        name: name.into(),
        source: "path traced".into(),
        quantity: "mean illuminance, lx".into(),
        right: truth.value,
        here,
        band: 4.0 * error.hypot(truth.error),
    }
}

/// A room of 6 m × 4 m × 3 m with a window under an overcast sky; its daylight factor is its mean
/// over 7π/9 of the zenith.
fn side_lit_room() -> Result<[Case; 2]> {
    let mut settings = SceneSettings::default();
    settings.sky = Some(Rgb::ONE.into());
    let zenith = Rgb::splat(ZENITH);
    let sky = Sky::new(SkyDistribution::OVERCAST, zenith, DVec3::Z, DVec3::Z)?;
    let scene = settings.load(data("side_lit_room.obj"))?.with_sky(sky)?;
    let outdoors = scene.sky().irradiance(DVec3::Z).x;
    let found = mean(&light(scene)?, "Floor")?;
    let name = "room with a window, overcast sky of 10 000 lx";
    let truth = Truth { value: 729.8, error: 0.05 };
    let factor = Truth { value: 7.30, error: 0.005 };
    let share = found.map(|lux| 100.0 * lux / outdoors);
    let factor = case(name, share, &factor);
    let quantity = "daylight factor, %".into();
    Ok([case(name, found, &truth), Case { quantity, ..factor }])
}

/// Two rooms joined by a door, the lamp in the first.
fn room_behind_a_door() -> Result<[Case; 2]> {
    let light = light(radiosity::load_scene(data("rooms.obj"))?)?;
    let [lit, behind] = [Truth { value: 202.95, error: 0.04 }, Truth { value: 5.30, error: 0.03 }];
    Ok([
        case("two rooms joined by a door, the lit one", mean(&light, "A_floor")?, &lit),
        case("two rooms joined by a door, the one behind", mean(&light, "B_floor")?, &behind),
    ])
}
