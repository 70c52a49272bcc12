//! How much less a source dazzles away from the line of sight.

use super::Observer;
use glam::DVec3;

/// Position index p of a source in unit `direction` from an observer with unit directions; none
/// where it is 90° or more from the line of sight, out of the field of view.
///
/// Above the line of sight, Guth's index as Levin (1975) fitted it, which CIE 117 tabulates, with τ
/// the angle between the plane of source and line of sight and the vertical one, σ that between
/// source and line of sight, degrees:
///
/// ```text
///   ln p = (35.2 − 0.31889 τ − 1.22 exp(−2τ/9)) 10⁻³ σ + (21 + 0.26667 τ − 0.002963 τ²) 10⁻⁵ σ²
/// ```
///
/// Below it, where Guth has no data, that of Iwata and Tokura (1997): p = 1 + a r, r the tangent of
/// σ, a = 0.8 up to r = 0.6 and 1.2 beyond.
pub fn position_index(observer: &Observer, direction: DVec3) -> Option<f64> {
    let forward = direction.dot(observer.direction);
    if forward <= 1e-9 {
        return None;
    }
    let across = direction - forward * observer.direction;
    let upright = observer.up.reject_from(observer.direction).normalize_or_zero();
    let tangent = across.length() / forward;
    let above = across.dot(upright);
    if above < 0.0 {
        let slope = if tangent < 0.6 { 0.8 } else { 1.2 };
        return Some(1.0 + slope * tangent);
    }
    let sigma = libm::atan(tangent).to_degrees();
    let tau = libm::acos((above / across.length()).clamp(-1.0, 1.0)).to_degrees();
    let tau = if tau.is_nan() { 0.0 } else { tau };
    let first = 35.2 - 0.31889 * tau - 1.22 * libm::exp(-2.0 * tau / 9.0);
    let second = 21.0 + 0.26667 * tau - 0.002963 * tau * tau;
    Some(libm::exp(1e-3 * first * sigma + 1e-5 * second * sigma * sigma))
}
