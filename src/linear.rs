//! Linear systems: GMRES, block Gauss–Seidel and Gaussian elimination, for numbers or for several
//! channels at once.

pub mod elimination;
pub mod gauss_seidel;
pub mod gmres;

use std::iter::Sum;
use std::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

use glam::DVec3;

/// A number, or one per channel: arithmetic is by channel.
pub trait Value:
    Copy
    + Default
    + Send
    + Sync
    + Sum
    + AddAssign
    + SubAssign
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Neg<Output = Self>
{
    /// `f` of every channel of both.
    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self;

    /// `f` of every channel.
    fn each(self, f: impl Fn(f64) -> f64) -> Self {
        self.zip(self, |a, _| f(a))
    }

    /// `self` over `divisor`, and 0 where that is 0.
    fn ratio(self, divisor: Self) -> Self {
        self.zip(divisor, |a, b| if b == 0.0 { 0.0 } else { a / b })
    }
}

impl Value for f64 {
    fn zip(self, other: f64, f: impl Fn(f64, f64) -> f64) -> f64 {
        f(self, other)
    }
}

impl Value for DVec3 {
    fn zip(self, other: DVec3, f: impl Fn(f64, f64) -> f64) -> DVec3 {
        DVec3::new(f(self.x, other.x), f(self.y, other.y), f(self.z, other.z))
    }
}
