//! Daylight of a year at points, from an hourly weather file, by daylight coefficients.
//!
//! ```text
//!            sky: 577 patches                 E_h = Σ_p L_h,p C_p  +  S_h (V_h cos θ_h + R_p(h))
//!     ╭──┬──┬──┬──╮   ☼ S_h                         sky                sun: direct    reflected
//!    ╱   │  │  │   ╲ ╱
//!   ───┐ path ▲  ┌──                C_p, R_p: by paths from the point, once for all hours
//!      │    ╲╱   │                  V_h: by rays to the disc of the sun, each hour its own
//!      └─────●───┘
//! ```
//!
//! Light is linear: paths from a point that end on the sky give its illuminance by unit radiance of
//! each patch (Tregenza and Waters 1983), and rays to the sun from where they reflect give what
//! reflects it. The sun itself is not smeared: each hour has its own rays. A patch is half a patch
//! of Tregenza's each way (Reinhart and Walkenhorst 2001), 6°; what its width costs is estimated
//! from how much the results of whole patches, 12°, differ.
//!
//! Standard errors are those of a jackknife over batches of paths; the difference by the width of
//! patches is added to them in quadrature.

mod annual;
mod coefficients;
mod patches;
mod year;

pub use annual::{AnnualDaylight, AnnualSettings, Estimate, annual_daylight};
pub use year::{DaylightHour, DaylightYear};
