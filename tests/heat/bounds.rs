//! The ends of ranges, and what has no answer.

use std::ops::ControlFlow;

use radiosity::heat::{HeatBalance, HeatSettings, STEFAN_BOLTZMANN, Surface};
use radiosity::view_factor::Estimate;
use radiosity::{ErrorKind, ViewFactors};

use super::{assert_near, at, balance, matrix, with_flux};

/// `n` groups of area 1, each of which sees all others alike.
fn all_alike(n: usize) -> ViewFactors {
    let share = 1.0 / (n - 1) as f64;
    let rows: Vec<Vec<f64>> =
        (0..n).map(|i| (0..n).map(|j| if i == j { 0.0 } else { share }).collect()).collect();
    let rows: Vec<&[f64]> = rows.iter().map(Vec::as_slice).collect();
    matrix(&vec![1.0; n], &rows)
}

#[test]
fn of_one_temperature_nothing_flows() {
    let factors = all_alike(12);
    let settings = HeatSettings { band_edges: vec![8.0, 14.0], surroundings: 0.0 };
    for t in [1e-3, 300.0, 1e6] {
        let mut surfaces: Vec<Surface> =
            (0..12).map(|k| at(t, &[0.08 * f64::from(k), 0.5, 1.0])).collect();
        surfaces[3] = with_flux(0.0, &[0.3, 0.9, 0.2]);
        let found = balance(&factors, &surfaces, &settings).unwrap();
        let emission = STEFAN_BOLTZMANN * t.powi(4);
        for group in &found.groups {
            // Twelve rounded shares of 1/11, summed, and reflected some ten times.
            assert!(group.net_flux.value.abs() < 1e-13 * emission, "{group:?}");
            assert_near(group.radiosity, emission, 1e-13);
            assert_near(group.temperature.unwrap(), t, 1e-13);
        }
    }
}

#[test]
fn one_that_absorbs_a_billionth_sets_the_temperature() {
    let factors = all_alike(50);
    let mut surfaces = vec![with_flux(0.0, &[0.5]); 50];
    surfaces[7] = at(500.0, &[1e-9]);
    surfaces[8] = with_flux(0.0, &[0.0]);
    let found = balance(&factors, &surfaces, &HeatSettings::default()).unwrap();
    for (i, group) in found.groups.iter().enumerate().filter(|(i, _)| *i != 8) {
        // Rows of 49 rounded shares sum to 1 but for some 1e-15: as if that were open. Of what
        // comes in, a billionth of a fiftieth, that is 5e-5, and a fourth of it in temperatures.
        assert_near(group.temperature.unwrap(), 500.0, 1.25e-5);
        assert!(i != 7 || group.net_flux.value.abs() < 1e-9 * STEFAN_BOLTZMANN * 500f64.powi(4));
    }
}

#[test]
fn given_flux_leaves_by_the_others() {
    let factors = matrix(&[2.0, 1.0], &[&[0.5, 0.5], &[1.0, 0.0]]);
    let surfaces = [with_flux(150.0, &[0.6]), at(0.0, &[0.9])];
    let found = balance(&factors, &surfaces, &HeatSettings::default()).unwrap();
    assert_near(found.groups[1].net_flux.value, -300.0, 1e-13);
    // By the network: σT⁴ = Q (1/(A₁F₁₂) + (1 − ε₁)/(A₁ε₁) + (1 − ε₂)/(A₂ε₂)).
    let emission = 300.0 * (1.0 + 0.4 / (2.0 * 0.6) + 0.1 / 0.9);
    assert_near(
        found.groups[0].temperature.unwrap(),
        (emission / STEFAN_BOLTZMANN).powf(0.25),
        1e-13,
    );
}

#[test]
fn open_enclosure_takes_and_gives_to_the_surroundings() {
    // A plate of which 0.7 sees the surroundings, 0.1 a back, and the rest itself.
    let mut factors = matrix(&[3.0], &[&[0.2]]);
    factors.open[0] = Estimate { value: 0.7, error: 1e-9 };
    factors.back[0] = Estimate { value: 0.1, error: 1e-9 };
    let settings = HeatSettings { surroundings: 250.0, ..HeatSettings::default() };
    let found = balance(&factors, &[at(320.0, &[0.4])], &settings).unwrap();
    let (m, outside) = (STEFAN_BOLTZMANN * 320f64.powi(4), STEFAN_BOLTZMANN * 250f64.powi(4));
    let b = (0.4 * m + 0.6 * 0.7 * outside) / (1.0 - 0.6 * 0.2);
    assert_near(found.groups[0].radiosity, b, 1e-13);
    assert_near(found.lost_to_surroundings, 3.0 * 0.7 * (b - outside), 1e-12);
    assert_near(found.lost_to_backs, 3.0 * 0.1 * b, 1e-12);
    // Rows that sum to 1 balance to rounding, whatever is lost.
    assert!(found.imbalance.abs() < 1e-12 * 3.0 * b);
}

#[test]
fn errors_of_factors_come_out_as_errors_of_fluxes() {
    let mut factors = matrix(&[1.0, 1.0], &[&[0.0, 1.0], &[1.0, 0.0]]);
    factors.factors[1][0].error = 1e-3;
    let surfaces = [at(400.0, &[1.0]), at(300.0, &[0.5])];
    let found = balance(&factors, &surfaces, &HeatSettings::default()).unwrap();
    assert_eq!(found.groups[0].net_flux.error, 0.0);
    assert_near(found.groups[1].net_flux.error, 0.5e-3 * found.groups[0].radiosity, 1e-13);
}

#[test]
fn what_has_no_answer_is_refused_by_name() {
    let factors = matrix(
        &[1.0; 4],
        &[
            &[0.0, 1.0, 0.0, 0.0],
            &[1.0, 0.0, 0.0, 0.0],
            &[0.0, 0.0, 0.0, 1.0],
            &[0.0, 0.0, 1.0, 0.0],
        ],
    );
    let (grey, settings) = (at(300.0, &[0.5]), HeatSettings::default());
    let of_second = |second: Surface| [grey.clone(), grey.clone(), grey.clone(), second];
    let told = |surfaces: &[Surface], settings: &HeatSettings| {
        let error = balance(&factors, surfaces, settings).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Setting);
        error.to_string()
    };
    for (surface, found) in [
        (at(-1.0, &[0.5]), "temperature -1"),
        (at(f64::NAN, &[0.5]), "temperature NaN"),
        (at(1e300, &[0.5]), "temperature 1"),
        (at(300.0, &[1.5]), "emissivity 1.5"),
        (at(300.0, &[f64::NAN]), "emissivity NaN"),
        (at(300.0, &[0.5, 0.5]), "2 emissivities"),
        (with_flux(f64::INFINITY, &[0.5]), "net flux inf"),
        (with_flux(5.0, &[0.0]), "net flux 5 with emissivity 0"),
        // More than the other's emission, 459 W/m², cannot be taken.
        (with_flux(-460.0, &[1.0]), "net flux -460 where"),
    ] {
        let error = told(&of_second(surface), &settings);
        assert!(error.contains("group 3") && error.contains(found), "{error}");
    }
    // Two that see one another alone: nothing says how warm they are.
    let surfaces = [grey.clone(), grey.clone(), with_flux(0.0, &[0.5]), with_flux(0.0, &[0.9])];
    assert!(told(&surfaces, &settings).contains("nothing in sight that has a temperature"));
    // Nor in another band than the one that absorbs.
    let bands = HeatSettings { band_edges: vec![5.0], surroundings: 0.0 };
    let [hot, short] = [at(300.0, &[0.5, 0.5]), at(300.0, &[0.5, 0.0])];
    let surfaces = [hot.clone(), hot, short, with_flux(0.0, &[0.0, 0.7])];
    assert!(told(&surfaces, &bands).contains("nothing in sight"));
    for edges in [vec![0.0], vec![5.0, 5.0], vec![f64::NAN], vec![f64::INFINITY]] {
        let settings = HeatSettings { band_edges: edges, surroundings: 0.0 };
        assert!(told(&of_second(grey.clone()), &settings).contains("band edges"));
    }
    let cold = HeatSettings { surroundings: -3.0, ..HeatSettings::default() };
    assert!(told(&of_second(grey.clone()), &cold).contains("surroundings"));
    assert!(told(std::slice::from_ref(&grey), &settings).contains("the matrix has 4 groups"));
}

#[test]
fn cancelled_there_is_no_balance() {
    let surfaces = vec![at(300.0, &[0.5]); 4];
    let settings = HeatSettings::default();
    let stopped = HeatBalance::of(&all_alike(4), &surfaces, &settings, |_| ControlFlow::Break(()));
    assert!(stopped.unwrap().is_none());
}
