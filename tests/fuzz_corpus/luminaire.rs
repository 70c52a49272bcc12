//! What the fuzz target `luminaire` does with an input, and the replay of its corpus.

use glam::DVec3;
use radiosity::ErrorKind;
use radiosity::io::{Input, read_photometry};

/// Reads a photometric file. Answers whether it was taken; panics where what it holds or an error
/// breaks its promises.
pub fn try_luminaire(input: &[u8]) -> bool {
    let lamp = match read_photometry(Input::bytes("it.ies", input)) {
        Ok(lamp) => lamp,
        Err(e) => {
            assert_eq!(e.kind(), ErrorKind::Scene, "{e}");
            let message = e.to_string();
            assert!(message.contains("; ") && !message.contains(char::is_control), "{message:?}");
            assert!(message.len() < 4000, "{message}");
            return false;
        }
    };
    assert!(lamp.opening.size.is_finite() && lamp.opening.size.min_element() >= 0.0);
    assert!(lamp.name.chars().count() <= 100 && lamp.power >= 0.0);
    // What is between measured values is no more than they are.
    let (flux, peak) = (lamp.intensity.flux(), lamp.intensity.peak());
    assert!(flux >= 0.0 && flux <= peak * 12.6, "{flux} {peak}");
    for k in 0..64 {
        let (z, turn) = (f64::from(k % 8) / 3.5 - 1.0, f64::from(k) * 2.4);
        let across = f64::max(1.0 - z * z, 0.0).sqrt();
        let direction = DVec3::new(across * turn.cos(), across * turn.sin(), z);
        let found = lamp.intensity.along(direction);
        assert!(found >= 0.0 && found <= peak * (1.0 + 1e-12), "{found} {peak}");
    }
    true
}
