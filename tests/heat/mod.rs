mod black_body;
mod bounds;
mod closed_forms;
mod louvre;
mod sheets;

use std::ops::ControlFlow;

use radiosity::heat::{Boundary, HeatBalance, HeatSettings, Surface};
use radiosity::view_factor::{Estimate, Factor, Missing};
use radiosity::{Error, ViewFactors};

/// A matrix of these areas and factors, which are exact; what rows lack is open.
fn matrix(areas: &[f64], factors: &[&[f64]]) -> ViewFactors {
    let row = |row: &&[f64]| {
        let nonzeros = row.iter().enumerate().filter(|(_, value)| **value != 0.0);
        nonzeros.map(|(to, &value)| Factor { to: to as u32, value, error: 0.0 }).collect()
    };
    let open = |row: &&[f64]| Estimate { value: 1.0 - row.iter().sum::<f64>(), error: 1e-15 };
    ViewFactors {
        names: (0..areas.len()).map(|i| format!("group {i}")).collect(),
        back_of: vec![None; areas.len()],
        areas: areas.to_vec(),
        factors: factors.iter().map(row).collect(),
        open: factors.iter().map(open).collect(),
        back: vec![Estimate::default(); areas.len()],
        absent: Missing::Zero,
    }
}

/// Plates 0 and 1, and `count` sheets in a row between them, fronts towards plate 0: their fronts
/// are groups 2 and on, their backs come after those.
fn sheets_between_plates(count: usize) -> ViewFactors {
    let rows = 2 + 2 * count;
    // Plate 0 sees the first front, each back the next front, the last back plate 1.
    let (front, back) = (|k: usize| 2 + k, |k: usize| 2 + count + k);
    let mut pairs = vec![(0, front(0)), (back(count - 1), 1)];
    pairs.extend((1..count).map(|k| (back(k - 1), front(k))));
    let mut factors = vec![vec![0.0; rows]; rows];
    for (i, j) in pairs {
        (factors[i][j], factors[j][i]) = (1.0, 1.0);
    }
    let factors: Vec<&[f64]> = factors.iter().map(Vec::as_slice).collect();
    let mut matrix = matrix(&vec![1.0; rows], &factors);
    (0..count).for_each(|k| matrix.back_of[back(k)] = Some(front(k) as u32));
    matrix
}

fn at(temperature: f64, emissivity: &[f64]) -> Surface {
    let emissivity = emissivity.to_vec();
    Surface { boundary: Boundary::Temperature(temperature), emissivity }
}

fn with_flux(flux: f64, emissivity: &[f64]) -> Surface {
    Surface { boundary: Boundary::NetFlux(flux), emissivity: emissivity.to_vec() }
}

fn balance(
    factors: &ViewFactors,
    surfaces: &[Surface],
    settings: &HeatSettings,
) -> Result<HeatBalance, Error> {
    let balance = HeatBalance::of(factors, surfaces, settings, |_| ControlFlow::Continue(()));
    balance.map(|balance| balance.expect("nobody stopped it"))
}

/// Asserts that both are the same to `relative`.
#[track_caller]
fn assert_near(found: f64, expected: f64, relative: f64) {
    let off = (found - expected).abs();
    assert!(off <= relative * expected.abs(), "{found:e}, expected {expected:e}");
}
