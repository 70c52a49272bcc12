//! Radiative exchange. Right values are closed forms that are derived here: a surface has the
//! resistance (1 − ε)/(A ε), a pair of them 1/(A F) (Oppenheim's network).

use std::f64::consts::PI;
use std::ops::ControlFlow;

use radiosity::heat::{Boundary, HeatBalance, HeatSettings, STEFAN_BOLTZMANN, Surface};
use radiosity::{Scene, ViewFactors, load_scene};

use crate::case::{Case, Section};
use crate::scenes::{Quad, block, cube, facing_down, facing_up, grey, quads, walls};
use crate::{Result, file, go_on, points, view_factors};

/// Plates of the shields, K.
const HOT: f64 = 773.15;
const COLD: f64 = 293.15;

const FLUX: &str = "net flux of the hot side, W/m²";

pub fn section() -> Result<Section> {
    let mut cases = vec![];
    for (count, emissivity) in [(1, 0.48), (1, 0.05), (1, 1.0), (2, 1.0), (5, 1.0), (10, 1.0)] {
        cases.extend(shields(count, emissivity)?);
    }
    cases.extend(grey_cavity()?);
    cases.push(adiabatic_cube()?);
    cases.push(concentric_spheres()?);
    cases.push(body_in_a_room()?);
    cases.push(fin()?);
    cases.extend(points::flux_from_a_square(black(1273.15))?);
    let bands = "Shields: 4e-6 of the hot plate's emission for each gap, which leaves at the edges \
        of plates 10⁶ times as wide as a gap. Cavity, cube and fin: factors are closed \
        forms, exact to 1e-12 of the area, and emissivities amplify it less than 100 \
        times. Spheres: four standard errors, as stated. Body in a room: the error of \
        factors that is asked for, 1e-5. Points: rounding of the closed form.";
    Ok(Section { title: "Heat exchange", bands, cases })
}

/// σ T⁴.
fn black(temperature: f64) -> f64 {
    STEFAN_BOLTZMANN * temperature.powi(4)
}

fn at(temperature: f64, emissivity: f64) -> Surface {
    Surface { boundary: Boundary::Temperature(temperature), emissivity: vec![emissivity] }
}

fn adiabatic(emissivity: f64) -> Surface {
    Surface { boundary: Boundary::NetFlux(0.0), emissivity: vec![emissivity] }
}

fn exact(scene: &Scene, error: f64, two_sided: &[usize]) -> Result<ViewFactors> {
    Ok(ViewFactors::exact(scene, error, two_sided, go_on)?.ok_or("stopped")?)
}

fn balance(factors: &ViewFactors, surfaces: &[Surface], surroundings: f64) -> Result<HeatBalance> {
    let settings = HeatSettings { surroundings, ..HeatSettings::default() };
    Ok(HeatBalance::of(factors, surfaces, &settings, |_| ControlFlow::Continue(()))?
        .ok_or("stopped")?)
}

fn temperature(found: &HeatBalance, group: usize) -> Result<f64> {
    Ok(found.groups[group].temperature.ok_or("no temperature")?)
}

/// Two black plates and `count` sheets between them: a gap is 1/ε + 1/ε' − 1, the gaps beside
/// the plates 1/ε each. With black sheets the flux is 1/(count + 1) of that without.
fn shields(count: usize, emissivity: f64) -> Result<Vec<Case>> {
    let side = [0.0, 1e6];
    let top = (count + 1) as f64;
    let mut all = vec![facing_down(side, side, top), facing_up(side, side, 0.0)];
    all.extend((0..count).map(|k| facing_up(side, side, (count - k) as f64)));
    let scene = quads(&all.into_iter().map(|quad| (quad, grey())).collect::<Vec<_>>());
    let factors = exact(&scene, 1e-6, &(2..2 + count).collect::<Vec<_>>())?;
    let mut surfaces = vec![at(HOT, 1.0), at(COLD, 1.0)];
    surfaces.extend(vec![adiabatic(emissivity); 2 * count]);
    let found = balance(&factors, &surfaces, COLD)?;
    let gaps = 2.0 / emissivity + (count - 1) as f64 * (2.0 / emissivity - 1.0);
    let right = (black(HOT) - black(COLD)) / gaps;
    let band = 4e-6 * top * black(HOT);
    let plural = if count == 1 { "" } else { "s" };
    let name = format!("{count} shield{plural} of ε = {emissivity} between black plates");
    let source = "closed form, Modest, section 5.4; as FDS radiation_shield";
    let case = |quantity: &str, right, here, band| Case {
        name: name.clone(),
        source: source.into(),
        quantity: quantity.into(),
        right,
        here,
        band,
    };
    let mut cases = vec![case(FLUX, right, found.groups[0].net_flux.value, band)];
    if count == 1 {
        // A sheet between two alike: T⁴ is the mean. dT = T/4 · dM/M.
        let mean = (black(HOT) + black(COLD)) / 2.0;
        let right = (mean / STEFAN_BOLTZMANN).powf(0.25);
        let here = temperature(&found, 2)?;
        cases.push(case("temperature of the shield, K", right, here, right / 4.0 * band / mean));
    }
    Ok(cases)
}

/// F between opposite rectangles of a × b at the distance c (Howell, C-11).
fn opposite(a: f64, b: f64, c: f64) -> f64 {
    let (x, y) = (a / c, b / c);
    let (p, q) = (1.0 + x * x, 1.0 + y * y);
    let arcs = x * q.sqrt() * (x / q.sqrt()).atan() + y * p.sqrt() * (y / p.sqrt()).atan()
        - x * x.atan()
        - y * y.atan();
    2.0 / (PI * x * y) * (0.5 * (p * q / (p + q - 1.0)).ln() + arcs)
}

/// Flux of the hot end of a prism, whose sides are adiabatic, and temperature of its sides: ends of
/// area 1 see each other by f, and the sides by 1 − f, which add two resistances in a row.
fn between_ends(f: f64, [hot, cold]: [f64; 2], [e1, e2]: [f64; 2]) -> [f64; 2] {
    let across = 1.0 / (f + (1.0 - f) / 2.0);
    let flux = (black(hot) - black(cold)) / (1.0 / e1 - 1.0 + across + 1.0 / e2 - 1.0);
    let (b1, b2) = (black(hot) - flux * (1.0 / e1 - 1.0), black(cold) + flux * (1.0 / e2 - 1.0));
    [flux, ((b1 + b2) / 2.0 / STEFAN_BOLTZMANN).powf(0.25)]
}

/// A box of 1 × 3 × 2 with a black bottom, a grey top and adiabatic walls.
fn grey_cavity() -> Result<[Case; 2]> {
    let factors = exact(&load_scene(file("tests/data/cases/cavity.obj"))?, 1e-6, &[])?;
    let mut surfaces = vec![adiabatic(0.75); 6];
    surfaces[0] = at(550.0, 1.0);
    surfaces[1] = at(300.0, 0.75);
    let found = balance(&factors.enforced().0, &surfaces, 0.0)?;
    let [flux, sides] = between_ends(opposite(1.0, 3.0, 2.0), [550.0, 300.0], [1.0, 0.75]);
    let case = |quantity: &str, right: f64, here: f64| Case {
        name: "grey cavity of 1 × 3 × 2, adiabatic walls".into(),
        source: "closed form, Howell C-11 and network; MOOSE's grey cavity".into(),
        quantity: quantity.into(),
        right,
        here,
        band: 1e-10 * right,
    };
    let wall = temperature(&found, 5)?;
    Ok([
        case(FLUX, flux, found.groups[0].net_flux.value),
        case("temperature of the walls, K", sides, wall),
    ])
}

fn adiabatic_cube() -> Result<Case> {
    let factors = exact(&cube(&grey()), 1e-6, &[])?;
    let mut surfaces = vec![adiabatic(0.5); 6];
    (surfaces[4], surfaces[5]) = (at(900.0, 0.8), at(350.0, 0.25));
    let found = balance(&factors, &surfaces, 0.0)?;
    let [right, _] = between_ends(opposite(1.0, 1.0, 1.0), [900.0, 350.0], [0.8, 0.25]);
    Ok(Case {
        name: "cube, hot floor, cold ceiling, adiabatic walls".into(),
        source: "closed form, Howell C-11 and network".into(),
        quantity: FLUX.into(),
        right,
        here: found.groups[4].net_flux.value,
        band: 1e-10 * right,
    })
}

/// The inner one sees the outer alone: (M₁ − M₂)/(1/ε₁ + A₁/A₂ (1/ε₂ − 1)).
fn concentric_spheres() -> Result<Case> {
    let scene = view_factors::spheres();
    let factors = ViewFactors::sparse(&scene, 1e-4, &[], go_on)?.ok_or("stopped")?;
    let found = balance(&factors, &[at(1000.0, 0.8), at(500.0, 0.3)], 0.0)?;
    let flux = found.groups[0].net_flux;
    Ok(Case {
        name: "grey concentric spheres, A₁/A₂ = 1/4".into(),
        source: "closed form, Modest, chapter 5".into(),
        quantity: FLUX.into(),
        right: (black(1000.0) - black(500.0)) / (1.0 / 0.8 + 0.25 * (1.0 / 0.3 - 1.0)),
        here: flux.value,
        band: 4.0 * flux.error + 1e-9 * flux.value,
    })
}

/// A cube in the middle of a black cubic room with one hot wall sees each wall by 1/6.
fn body_in_a_room() -> Result<Case> {
    let (hot, cold, asked) = (500.0, 300.0, 1e-5);
    let room = walls([0.0; 3], [1.0; 3]).map(|wall| vec![wall]);
    let body = block([0.4; 3], [0.6; 3]).to_vec();
    let factors = exact(&grouped(&[&room[..], &[body]].concat()), asked, &[])?;
    let mut surfaces = vec![at(cold, 1.0); 6];
    surfaces[0] = at(hot, 1.0);
    surfaces.push(adiabatic(0.5));
    let found = balance(&factors, &surfaces, 0.0)?;
    let emission = (black(hot) + 5.0 * black(cold)) / 6.0;
    let right = (emission / STEFAN_BOLTZMANN).powf(0.25);
    Ok(Case {
        name: "thermocouple: cube in the middle of a room, one hot wall".into(),
        source: "closed form, by symmetry; as FDS TC_view_factor".into(),
        quantity: "temperature of the cube, K".into(),
        right,
        here: temperature(&found, 6)?,
        band: right / 4.0 * asked * (black(hot) - black(cold)) / emission,
    })
}

/// A scene whose groups have several quadrilaterals.
fn grouped(groups: &[Vec<Quad>]) -> Scene {
    let all: Vec<_> = groups.iter().flatten().map(|&quad| (quad, grey())).collect();
    let scene = quads(&all);
    let group_of = |quad: usize| {
        let ends = groups.iter().scan(0, |end, group| {
            *end += group.len();
            Some(*end)
        });
        ends.take_while(|&end| end <= quad).count() as u32
    };
    let mut triangles = scene.triangles().to_vec();
    triangles.iter_mut().for_each(|t| t.group = group_of(t.group as usize));
    let names = (0..groups.len()).map(|k| format!("g{k}")).collect();
    let (positions, materials) = (scene.positions().to_vec(), scene.materials().to_vec());
    Scene::new(positions, triangles, names, materials).expect("a scene")
}

/// A black base at 900 K, on whose edge an adiabatic fin stands, which emits by both sides what it
/// absorbs by one: T⁴ = F T_base⁴ / 2, F of squares that share an edge.
fn fin() -> Result<Case> {
    let base = facing_up([0.0, 1.0], [0.0, 1.0], 0.0);
    let fin = [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]];
    let factors = exact(&quads(&[(base, grey()), (fin, grey())]), 1e-6, &[1])?;
    let found = balance(&factors, &[at(900.0, 1.0), adiabatic(0.4), adiabatic(0.4)], 0.0)?;
    // Howell C-14 with H = W = 1.
    let root = 2f64.sqrt();
    let f = (PI / 2.0 - root * (1.0 / root).atan() + 0.25 * 0.75f64.ln()) / PI;
    let right = 900.0 * (f / 2.0).powf(0.25);
    Ok(Case {
        name: "adiabatic fin on a black base".into(),
        source: "closed form, Howell C-14".into(),
        quantity: "temperature of the fin, K".into(),
        right,
        here: temperature(&found, 1)?,
        band: 1e-10 * right,
    })
}
