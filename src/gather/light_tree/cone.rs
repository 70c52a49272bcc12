//! Cones of directions.

use std::f64::consts::PI;

use glam::DVec3;

/// All directions within an angle of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cone {
    /// Unit length.
    axis: DVec3,
    /// Radians, below π.
    half_angle: f64,
}

impl Cone {
    /// The unit direction `axis` alone.
    pub fn of(axis: DVec3) -> Cone {
        Cone { axis, half_angle: 0.0 }
    }

    /// The cone around unit `directions` about their mean; none if they have none, or there is
    /// none.
    pub fn around(directions: impl Iterator<Item = DVec3> + Clone) -> Option<Cone> {
        let axis = directions.clone().sum::<DVec3>().try_normalize()?;
        let half_angle = directions.map(|d| angle(axis, d)).fold(0.0, f64::max);
        Some(Cone { axis, half_angle })
    }

    /// The smallest cone around both; none if that is all directions.
    pub fn joined(&self, other: &Cone) -> Option<Cone> {
        let (wide, narrow) =
            if self.half_angle >= other.half_angle { (self, other) } else { (other, self) };
        let apart = angle(wide.axis, narrow.axis);
        if apart + narrow.half_angle <= wide.half_angle {
            return Some(*wide);
        }
        let half_angle = 0.5 * (apart + wide.half_angle + narrow.half_angle);
        if half_angle >= PI {
            return None;
        }
        let across = narrow.axis.reject_from_normalized(wide.axis).try_normalize()?;
        let (sine, cosine) = libm::sincos(half_angle - wide.half_angle);
        Some(Cone { axis: cosine * wide.axis + sine * across, half_angle })
    }

    /// The smallest and the largest angle between directions of the cone and such as are within
    /// `view` of a unit `direction`, radians in [0, π].
    pub fn angles(&self, direction: DVec3, view: f64) -> [f64; 2] {
        let (between, around) = (angle(self.axis, direction), self.half_angle + view);
        [(between - around).max(0.0), (between + around).min(PI)]
    }

    /// Sine of the half-angle, or 1 beyond a right angle.
    pub fn sine(&self) -> f64 {
        libm::sin(self.half_angle.min(0.5 * PI))
    }
}

/// Angle between unit vectors, radians.
pub(super) fn angle(a: DVec3, b: DVec3) -> f64 {
    libm::acos(a.dot(b).clamp(-1.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_joined_cone_is_the_smallest_around_both() {
        let cone = |axis: DVec3, half_angle: f64| Cone { axis, half_angle };
        let (x, y) = (cone(DVec3::X, 0.2), cone(DVec3::Y, 0.1));
        let both = x.joined(&y).unwrap();
        // From 0.2 beyond x to 0.1 beyond y; rounding of an angle by its cosine is √ε = 1.5e-8.
        assert!((both.half_angle - 0.5 * (0.3 + PI / 2.0)).abs() < 1e-7);
        assert!((angle(both.axis, DVec3::X) - (both.half_angle - 0.2)).abs() < 1e-7);
        assert!((angle(both.axis, DVec3::Y) - (both.half_angle - 0.1)).abs() < 1e-7);
        assert_eq!(x.joined(&cone(DVec3::X, 0.1)), Some(x));
        assert_eq!(cone(DVec3::X, 2.0).joined(&cone(-DVec3::X, 2.0)), None);
        let [least, most] = x.angles(DVec3::Y, 0.3);
        assert!((least - (PI / 2.0 - 0.5)).abs() < 1e-7 && (most - (PI / 2.0 + 0.5)).abs() < 1e-7);
    }
}
