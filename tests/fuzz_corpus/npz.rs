//! What the fuzz target `npz` does with an input, and the replay of its corpus.

use std::ops::ControlFlow;

use radiosity::ErrorKind;
use radiosity::heat::{Boundary, HeatBalance, HeatSettings, Surface};
use radiosity::io::{Input, read_npz, write_npz};

/// Reads a matrix of view factors, and if it is one, writes and reads it again, measures and
/// enforces it, and lets heat flow. Answers whether it was taken; panics where a matrix or an error
/// breaks its promises.
pub fn try_npz(input: &[u8]) -> bool {
    let matrix = match read_npz(Input::bytes("it.npz", input)) {
        Ok(matrix) => matrix,
        Err(e) => {
            assert_eq!(e.kind(), ErrorKind::File, "{e}");
            let message = e.to_string();
            assert!(message.contains("; ") && message.len() < 4000, "{message:?}");
            return false;
        }
    };
    let groups = matrix.names.len();
    assert!(groups <= input.len() && matrix.factors.len() == matrix.areas.len());
    if groups > 64 {
        return true;
    }
    let mut bytes = vec![];
    write_npz(&mut bytes, &matrix).unwrap();
    let again = read_npz(Input::bytes("it.npz", &bytes)).expect("what is written can be read");
    assert_eq!(again, matrix);
    let _ = matrix.checks();
    let _ = matrix.enforced();
    let surface = |i| match i % 3 {
        0 => Boundary::NetFlux(0.0),
        _ => Boundary::Temperature(100.0 * i as f64),
    };
    let surface = |i| Surface { boundary: surface(i), emissivity: vec![0.5] };
    let surfaces: Vec<Surface> = (0..groups).map(surface).collect();
    let go = |_| ControlFlow::Continue(());
    let _ = HeatBalance::of(&matrix, &surfaces, &HeatSettings::default(), go);
    true
}
