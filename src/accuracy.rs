//! The measure of error: one definition for bakes, [`verify`](mod@crate::verify) and light maps.
//!
//! At a point x of the surfaces that reflect (reflectance above 0),
//!
//! ```text
//! e(x) = |B(x) − B_true(x)| / max(|B_true(x)|, F m)
//! ```
//!
//! where B is the *reflected* radiosity, that is radiosity minus the material's exitance, W/m²;
//! lengths |·| are Euclidean over the three channels; m is the mean of |B_true| over the area that
//! counts; and F is the *floor*, 5 % unless given. At a textured point both are taken with the mean
//! reflectance of the material: this compares the light and not the detail of the texture.
//!
//! **The error of a solution is the root mean square of e over the share 1 − T of the area where e
//! is smallest.** T is the *tail*, 1 % unless given; its own root mean square is reported beside
//! the error, with the groups that hold most of it. Without this, strips of a thousandth of the
//! area, as at the foot of a box, hold nearly all of the squares (the trimmed mean: Tukey 1962;
//! Stigler 1973). T = 0 gives the plain root mean square. The error of a group is the same over its
//! own area, with the m of the scene.
//!
//! Points that are hidden do not count, neither in the error nor in the tail nor in m: see the
//! table of conditions in `accuracy/hidden.rs`.

pub(crate) mod hidden;
pub(crate) mod largest_first;
pub(crate) mod mean_square;
pub(crate) mod tail;

pub use mean_square::Estimate;

use crate::error::{Error, ErrorKind};

/// Which errors count: see the [module](self).
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Measure {
    /// F: points darker than this share of the mean reflected radiosity count as that bright, in
    /// (0, 1].
    pub floor: f64,
    /// T: share of the area, where the error is largest, that does not count, in [0, 0.5].
    pub tail: f64,
}

impl Default for Measure {
    /// A floor of 5 % and a tail of 1 %. Both are plain choices.
    fn default() -> Measure {
        Measure { floor: 0.05, tail: 0.01 }
    }
}

impl Measure {
    /// # Errors
    /// [`ErrorKind::Setting`] for a value out of range.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let wrong = |name: &str, value: f64, remedy| {
            let place = format!("{name} {value}");
            Err(Error::new(ErrorKind::Setting, place, "out of range", remedy))
        };
        if !(self.floor > 0.0 && self.floor <= 1.0) {
            return wrong("floor", self.floor, "give a share above 0 and up to 1, such as 0.05");
        }
        if !(0.0..=0.5).contains(&self.tail) {
            return wrong("tail", self.tail, "give a share from 0 to 0.5, such as 0.01");
        }
        Ok(())
    }
}
