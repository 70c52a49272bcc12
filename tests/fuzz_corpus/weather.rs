//! What the fuzz target `weather` does with an input, and the replay of its corpus.

use radiosity::ErrorKind;
use radiosity::io::{Input, read_epw};

/// Reads a weather file. Answers whether it was taken; panics where what it holds or an error
/// breaks its promises.
pub fn try_weather(input: &[u8]) -> bool {
    let weather = match read_epw(Input::bytes("it.epw", input)) {
        Ok(weather) => weather,
        Err(e) => {
            assert_eq!(e.kind(), ErrorKind::Scene, "{e}");
            let message = e.to_string();
            assert!(message.contains("; ") && !message.contains(char::is_control), "{message:?}");
            assert!(message.len() < 4000, "{message}");
            return false;
        }
    };
    assert!(weather.latitude.abs() <= 90.0 && weather.longitude.abs() <= 180.0);
    for record in &weather.records {
        assert!((1..=12).contains(&record.month) && (1..=31).contains(&record.day), "{record:?}");
        assert!(record.duration > 0.0 && record.duration <= 1.0, "{record:?}");
        assert!(record.middle > 0.0 && record.middle < 24.0, "{record:?}");
        for irradiance in [record.direct_normal, record.diffuse_horizontal] {
            assert!((0.0..9999.0).contains(&irradiance), "{record:?}");
        }
        assert!(record.dew_point.is_none_or(f64::is_finite), "{record:?}");
    }
    true
}
