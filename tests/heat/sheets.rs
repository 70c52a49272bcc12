//! Sheets: two radiosities and one temperature (M. F. Modest, "Radiative Heat Transfer", 3rd
//! edition, section 5.4, radiation shields).

use std::ops::ControlFlow;

use radiosity::heat::{Boundary, HeatSettings, STEFAN_BOLTZMANN, Surface};
use radiosity::{ErrorKind, ViewFactors};

use super::{assert_near, at, balance, sheets_between_plates, with_flux};
use crate::common::scenes::{facing_down, facing_up, grey, quads};

fn black(t: f64) -> f64 {
    STEFAN_BOLTZMANN * t.powi(4)
}

/// Plates at 773.15 and 293.15 K of these emissivities, and sheets between them that are adiabatic.
fn surfaces(plates: [f64; 2], front: f64, back: f64, count: usize) -> Vec<Surface> {
    let mut all = vec![at(773.15, &[plates[0]]), at(293.15, &[plates[1]])];
    all.extend(vec![with_flux(0.0, &[front]); count]);
    all.extend(vec![with_flux(0.0, &[back]); count]);
    all
}

#[test]
fn shields_in_a_row_are_resistances_in_series() {
    let drop = black(773.15) - black(293.15);
    for count in [1, 2, 5, 10] {
        let factors = sheets_between_plates(count);
        for (plates, front, back) in [
            ([1.0, 1.0], 1.0, 1.0),
            ([1.0, 1.0], 0.48, 0.48),
            ([0.8, 0.3], 0.05, 0.05),
            ([1.0, 0.5], 0.1, 0.9),
        ] {
            let all = surfaces(plates, front, back, count);
            let found = balance(&factors, &all, &HeatSettings::default()).unwrap();
            // A gap is 1/ε + 1/ε' − 1: that after the hot plate, those between sheets, the last.
            let gap = |e1: f64, e2: f64| 1.0 / e1 + 1.0 / e2 - 1.0;
            let between = (count - 1) as f64 * gap(back, front);
            let resistance = gap(plates[0], front) + between + gap(back, plates[1]);
            let flux = drop / resistance;
            if front == 1.0 {
                assert_near(flux, drop / (count + 1) as f64, 1e-15);
            }
            // GMRES leaves some 1e-15 of the emission, which what passes eleven gaps of up to 39
            // is a share of.
            assert_near(found.groups[0].net_flux.value, flux, 1e-11);
            assert_near(found.groups[1].net_flux.value, -flux, 1e-11);
            // Each side passes the flux on, and the sheet keeps nothing.
            for k in 0..count {
                let sides = [2 + k, 2 + count + k].map(|row| found.groups[row]);
                assert_near(sides[0].net_flux.value, -flux, 1e-10);
                assert_near(sides[1].net_flux.value, flux, 1e-10);
                assert_eq!(sides[0].temperature, sides[1].temperature);
            }
            // The first sheet's emission is that of the hot plate less the first drop.
            let first = found.groups[2].temperature.unwrap();
            assert_near(black(first), black(773.15) - flux * gap(plates[0], front), 1e-11);
            // All that is supplied comes from the hot plate.
            assert_near(found.supplied, flux, 1e-11);
        }
    }
}

#[test]
fn shields_by_factors_from_their_geometry() {
    // Plates of 1e5 × 1e5 one apart: of what leaves a face, 2e-5 gets out at the edges of a gap.
    for (count, emissivity) in [(1, 0.48), (1, 0.05), (3, 0.3)] {
        let side = [0.0, 1e5];
        let top = (count + 1) as f64;
        let mut all = vec![facing_down(side, side, top), facing_up(side, side, 0.0)];
        all.extend((0..count).map(|k| facing_up(side, side, (count - k) as f64)));
        let scene = quads(&all.into_iter().map(|quad| (quad, grey())).collect::<Vec<_>>());
        let sheets: Vec<usize> = (2..2 + count).collect();
        let go = |_, _| ControlFlow::Continue(());
        let factors = ViewFactors::exact(&scene, 1e-6, &sheets, go).unwrap().unwrap();
        let all = surfaces([1.0, 1.0], emissivity, emissivity, count);
        let settings = HeatSettings { surroundings: 293.15, ..HeatSettings::default() };
        let found = balance(&factors, &all, &settings).unwrap();
        let n = count as f64;
        let flux = (black(773.15) - black(293.15)) / (1.0 + n * (2.0 / emissivity - 1.0));
        let of_plates = [found.groups[0], found.groups[1]].map(|group| group.net_flux.value);
        // Both faces of each gap, none of which emits more than the hot plate.
        let edges = 4e-5 * top * black(773.15);
        assert!((of_plates[0] - flux).abs() < edges, "{count}: {of_plates:?} {flux}");
        assert!((of_plates[1] + flux).abs() < edges, "{count}: {of_plates:?} {flux}");
    }
}

/// F of two unit squares that share an edge at right angles: J. R. Howell's C-14 with H = W = 1.
fn beside() -> f64 {
    let root = 2f64.sqrt();
    let angles = 2.0 * 1f64.atan() - root * (1.0 / root).atan();
    // (4/3) · (3/4)² = 3/4 in the logarithm: [(1 + W²)(1 + H²)/(1 + W² + H²)] · [3/(2·2)]².
    (angles + 0.25 * (0.75f64).ln()) / std::f64::consts::PI
}

#[test]
fn fin_on_a_plate_has_a_lit_and_a_dark_side() {
    // A black base at 900 K, and on its edge a fin, adiabatic: one side sees the base, the other
    // nothing. Surroundings at 0 K.
    let base = facing_up([0.0, 1.0], [0.0, 1.0], 0.0);
    let fin = [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]];
    let scene = quads(&[(base, grey()), (fin, grey())]);
    let go = |_, _| ControlFlow::Continue(());
    let factors = ViewFactors::exact(&scene, 1e-6, &[1], go).unwrap().unwrap();
    let (f, m) = (beside(), black(900.0));
    for (front, back) in [(0.4, 0.4), (1.0, 1.0), (0.9, 0.2), (0.3, 0.0)] {
        let surfaces = [at(900.0, &[1.0]), with_flux(0.0, &[front]), with_flux(0.0, &[back])];
        let found = balance(&factors, &surfaces, &HeatSettings::default()).unwrap();
        // It absorbs ε_f F M by its front, and emits by both.
        let fin = front * f * m / (front + back);
        // Closed forms are exact to 1e-13 of the area.
        assert_near(black(found.groups[1].temperature.unwrap()), fin, 1e-12);
        let leaving = front * fin + (1.0 - front) * f * m;
        assert_near(found.groups[0].net_flux.value, m - f * leaving, 1e-12);
        assert_near(found.groups[1].radiosity, leaving, 1e-12);
        assert_near(found.groups[2].radiosity, back * fin, 1e-12);
    }
}

#[test]
fn heated_sheet_gives_the_mean_flux_of_its_sides() {
    let factors = sheets_between_plates(1);
    let (front, back) = (0.3, 0.8);
    let heated = |emissivity| with_flux(500.0, &[emissivity]);
    let surfaces = [at(400.0, &[1.0]), at(250.0, &[1.0]), heated(front), heated(back)];
    let found = balance(&factors, &surfaces, &HeatSettings::default()).unwrap();
    // Two black plates around it: 2 · 500 = ε_f (M − M_0) + ε_b (M − M_1).
    let taken = front * black(400.0) + back * black(250.0);
    let emission = (2.0 * 500.0 + taken) / (front + back);
    assert_near(black(found.groups[2].temperature.unwrap()), emission, 1e-12);
    let sides = [found.groups[2], found.groups[3]].map(|side| side.net_flux.value);
    assert_near(sides[0], front * (emission - black(400.0)), 1e-12);
    assert_near(sides[0] + sides[1], 1000.0, 1e-12);
    assert!(found.imbalance.abs() < 1e-11 * 1000.0);
}

#[test]
fn errors_of_a_sheet_come_from_both_its_sides() {
    let mut factors = sheets_between_plates(1);
    factors.factors[2][0].error = 1e-3;
    factors.factors[3][0].error = 2e-3;
    let surfaces = surfaces([1.0, 1.0], 0.5, 0.25, 1);
    let found = balance(&factors, &surfaces, &HeatSettings::default()).unwrap();
    // A side absorbs ε δ more; of the sum the front emits 2/3 of it, the back 1/3.
    let front = 0.5 * 1e-3 * black(773.15);
    let back = 0.25 * 2e-3 * black(293.15);
    let expected = (front / 3.0).hypot(2.0 / 3.0 * back);
    assert_near(found.groups[2].net_flux.error, expected, 1e-12);
    // What one side does not pass on, the other does.
    assert_near(found.groups[3].net_flux.error, expected, 1e-12);
}

#[test]
fn sheets_with_two_conditions_are_refused() {
    let factors = sheets_between_plates(1);
    let refused = |sheet: [Surface; 2], factors: &ViewFactors| {
        let [front, back] = sheet;
        let surfaces = [at(400.0, &[1.0]), at(250.0, &[1.0]), front, back];
        let error = balance(factors, &surfaces, &HeatSettings::default()).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Setting);
        error.to_string()
    };
    for back in [at(301.0, &[0.5]), with_flux(0.0, &[0.5])] {
        let error = refused([at(300.0, &[0.5]), back], &factors);
        assert!(error.contains("group 2") && error.contains("one temperature"), "{error}");
    }
    let dark = || with_flux(7.0, &[0.0]);
    assert!(refused([dark(), dark()], &factors).contains("net flux 7 with emissivity 0"));
    // One side that absorbs is enough.
    let surfaces = [at(400.0, &[1.0]), at(250.0, &[1.0]), with_flux(7.0, &[0.1]), dark()];
    assert!(balance(&factors, &surfaces, &HeatSettings::default()).is_ok());
    assert_eq!(surfaces[3].boundary, Boundary::NetFlux(7.0));
    let grey = || at(300.0, &[0.5]);
    for wrong in
        [vec![None; 3], vec![None, None, None, Some(9)], vec![None, None, Some(3), Some(2)]]
    {
        let wrong = ViewFactors { back_of: wrong, ..factors.clone() };
        assert!(refused([grey(), grey()], &wrong).contains("back_of"));
    }
}

#[test]
fn sheet_takes_its_temperature_from_either_side() {
    // The front sees an adiabatic plate alone, the back one with a temperature.
    let factors = sheets_between_plates(1);
    let surfaces =
        [with_flux(0.0, &[0.5]), at(350.0, &[0.9]), with_flux(0.0, &[0.2]), with_flux(0.0, &[0.4])];
    let found = balance(&factors, &surfaces, &HeatSettings::default()).unwrap();
    for group in found.groups {
        assert_near(group.temperature.unwrap(), 350.0, 1e-13);
    }
}
