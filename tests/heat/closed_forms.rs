//! Exchange that is known in closed form: Modest, "Radiative Heat Transfer", 3rd edition,
//! chapter 5.

use radiosity::ViewFactors;
use radiosity::heat::{HeatSettings, STEFAN_BOLTZMANN, share_below};

use super::{assert_near, at, balance, matrix, sheets_between_plates, with_flux};
use crate::common::scenes;

/// What GMRES leaves is told in `residual`, some 1e-16; emissivities of 0.1 amplify it ten times.
const ROUNDING: f64 = 1e-13;

/// σ T⁴.
fn black(t: f64) -> f64 {
    STEFAN_BOLTZMANN * t.powi(4)
}

#[test]
fn two_plates() {
    let factors = matrix(&[1.0, 1.0], &[&[0.0, 1.0], &[1.0, 0.0]]);
    for (e1, e2) in [(1.0, 1.0), (0.8, 0.3), (0.1, 0.1)] {
        let found =
            balance(&factors, &[at(1000.0, &[e1]), at(300.0, &[e2])], &HeatSettings::default());
        let found = found.unwrap();
        let expected = (black(1000.0) - black(300.0)) / (1.0 / e1 + 1.0 / e2 - 1.0);
        assert_near(found.groups[0].net_flux.value, expected, ROUNDING);
        assert_near(found.groups[1].net_flux.value, -expected, ROUNDING);
        assert!(found.imbalance.abs() < ROUNDING * expected && found.residual < 1e-14);
    }
}

#[test]
fn concentric_spheres() {
    // Radii 1 and 3: the outer one sees the inner with A₁/A₂ and itself with the rest.
    let ratio = 1.0 / 9.0;
    let areas = [4.0 * std::f64::consts::PI, 36.0 * std::f64::consts::PI];
    let factors = matrix(&areas, &[&[0.0, 1.0], &[ratio, 1.0 - ratio]]);
    let (e1, e2) = (0.6, 0.05);
    let surfaces = [at(77.0, &[e1]), at(293.0, &[e2])];
    let found = balance(&factors, &surfaces, &HeatSettings::default()).unwrap();
    let expected = (black(77.0) - black(293.0)) / (1.0 / e1 + ratio * (1.0 / e2 - 1.0));
    assert_near(found.groups[0].net_flux.value, expected, ROUNDING);
    assert_near(found.groups[1].net_flux.value, -ratio * expected, 1e-12);
}

/// Net flux out of 1, and temperature of the adiabatic 3, by the network of resistances.
fn network(a: [f64; 3], f: [f64; 3], e: [f64; 2], t: [f64; 2]) -> (f64, f64) {
    let [f12, f13, f23] = f;
    let surface = |k: usize| (1.0 - e[k]) / (a[k] * e[k]);
    let across = 1.0 / (a[0] * f12 + 1.0 / (1.0 / (a[0] * f13) + 1.0 / (a[1] * f23)));
    let power = (black(t[0]) - black(t[1])) / (surface(0) + across + surface(1));
    let (b1, b2) = (black(t[0]) - power * surface(0), black(t[1]) + power * surface(1));
    let (g1, g2) = (a[0] * f13, a[1] * f23);
    let b3 = (g1 * b1 + g2 * b2) / (g1 + g2);
    (power / a[0], (b3 / STEFAN_BOLTZMANN).powf(0.25))
}

#[test]
fn three_sides_one_adiabatic() {
    // A long triangle of sides 3, 4 and 5: F_ij = (L_i + L_j − L_k) / 2 L_i, crossed strings.
    let sides = [3.0, 4.0, 5.0];
    let f = |i: usize, j: usize| {
        let k = 3 - i - j;
        (sides[i] + sides[j] - sides[k]) / (2.0 * sides[i])
    };
    let rows = [[0.0, f(0, 1), f(0, 2)], [f(1, 0), 0.0, f(1, 2)], [f(2, 0), f(2, 1), 0.0]];
    let factors = matrix(&sides, &[&rows[0], &rows[1], &rows[2]]);
    let (flux, temperature) =
        network(sides, [f(0, 1), f(0, 2), f(1, 2)], [0.7, 0.2], [1200.0, 400.0]);
    // The emissivity of what is adiabatic does not matter.
    for emissivity in [1.0, 0.4, 1e-9] {
        let surfaces = [at(1200.0, &[0.7]), at(400.0, &[0.2]), with_flux(0.0, &[emissivity])];
        let found = balance(&factors, &surfaces, &HeatSettings::default()).unwrap();
        assert_near(found.groups[0].net_flux.value, flux, ROUNDING);
        assert_near(found.groups[2].temperature.unwrap(), temperature, ROUNDING);
    }
    // Nor whether it emits at all; then it has no temperature.
    let surfaces = [at(1200.0, &[0.7]), at(400.0, &[0.2]), with_flux(0.0, &[0.0])];
    let found = balance(&factors, &surfaces, &HeatSettings::default()).unwrap();
    assert_near(found.groups[0].net_flux.value, flux, ROUNDING);
    assert_eq!(found.groups[2].temperature, None);
}

/// The furnace: a cube with a hot floor, a cold ceiling, and walls that are adiabatic.
#[test]
fn cube_with_adiabatic_walls_by_exact_factors() {
    let scene = scenes::cube(&scenes::grey());
    let go = |_, _| std::ops::ControlFlow::Continue(());
    let factors = ViewFactors::exact(&scene, 1e-6, &[], go).unwrap().unwrap();
    let (floor, ceiling) = (4, 5);
    let mut surfaces = vec![with_flux(0.0, &[0.5]); factors.names.len()];
    surfaces[floor] = at(900.0, &[0.8]);
    surfaces[ceiling] = at(350.0, &[0.25]);
    let found = balance(&factors, &surfaces, &HeatSettings::default()).unwrap();
    // Opposite faces of a cube, by the closed form of parallel squares: 0.19982489569838746; walls
    // are alike, so that they count as one group.
    let f12 = 0.199_824_895_698_387_46;
    let (flux, _) =
        network([1.0, 1.0, 4.0], [f12, 1.0 - f12, 1.0 - f12], [0.8, 0.25], [900.0, 350.0]);
    // Factors are exact to 1e-12, and rows not closed by as much.
    assert_near(found.groups[floor].net_flux.value, flux, 1e-11);
    assert!(found.imbalance.abs() < 1e-11 * flux);
}

#[test]
fn two_plates_grey_by_bands() {
    let factors = matrix(&[2.0, 2.0], &[&[0.0, 1.0], &[1.0, 0.0]]);
    let settings = HeatSettings { band_edges: vec![2.0, 6.0], surroundings: 0.0 };
    let (e1, e2) = ([0.9, 0.4, 0.1], [0.2, 0.3, 0.8]);
    let found = balance(&factors, &[at(1500.0, &e1), at(600.0, &e2)], &settings).unwrap();
    let in_band = |band: usize, t: f64| {
        let below = [0.0, share_below(2.0, t), share_below(6.0, t), 1.0];
        (below[band + 1] - below[band]) * black(t)
    };
    let expected: f64 = (0..3)
        .map(|k| (in_band(k, 1500.0) - in_band(k, 600.0)) / (1.0 / e1[k] + 1.0 / e2[k] - 1.0))
        .sum();
    assert_near(found.groups[0].net_flux.value, expected, ROUNDING);
}

#[test]
fn shield_between_plates_by_bands() {
    // Plates at 1000 and 300 K, and between them a sheet, selective and adiabatic.
    let factors = sheets_between_plates(1);
    let settings = HeatSettings { band_edges: vec![4.0], surroundings: 0.0 };
    let (e1, es, e2) = ([0.7, 0.7], [0.9, 0.2], [0.5, 0.5]);
    let surfaces = [at(1000.0, &e1), at(300.0, &e2), with_flux(0.0, &es), with_flux(0.0, &es)];
    let found = balance(&factors, &surfaces, &settings).unwrap();
    let t = found.groups[2].temperature.unwrap();
    let in_band = |band: usize, t: f64| {
        let below = share_below(4.0, t);
        [below, 1.0 - below][band] * black(t)
    };
    // Two plates on either side, band by band.
    let gap = |hot: f64, eh: [f64; 2], cold: f64, ec: [f64; 2]| -> [f64; 2] {
        [0, 1].map(|k| (in_band(k, hot) - in_band(k, cold)) / (1.0 / eh[k] + 1.0 / ec[k] - 1.0))
    };
    let (above, below) = (gap(1000.0, e1, t, es), gap(t, es, 300.0, e2));
    let [above_all, below_all] = [above, below].map(|flux| flux[0] + flux[1]);
    // Newton's method ends at changes of 1e-13 of the shield's emission.
    assert_near(below_all, above_all, 1e-11);
    assert_near(found.groups[0].net_flux.value, above_all, 1e-11);
    assert_near(found.groups[3].net_flux.value, above_all, 1e-11);
    assert!(
        (above[0] - below[0]).abs() > 0.01 * above_all,
        "bands that balance alone show nothing"
    );
}
