//! Hidden points, at which no error is counted: inside solids, under what stands on them, in
//! cracks, or in the open.
//!
//! | condition | threshold | reason |
//! |---|---|---|
//! | share of backs | 0.95 | inside a solid: a twentieth for rays through seams |
//! | share of backs, no light arrives | 0.05 | enclosed: no lit point sees it either |
//! | share of backs nearer than [`NEAR`] | 0.4 | covered by what stands on it |
//! | mean of 1/distance | 10⁴ | in a crack |
//! | share of surfaces, and of lamps in the light | 0.01 | in the open: sky and sun are exact |
//! | the same, of any lamps, outside the region of the light | 0.01 | their light is faint there |
//!
//! At the foot of an inverted wall the share of backs is 0.5; 0.4 is two standard deviations of 128
//! rays less. Between parallel plates the mean of 1/distance is 2/3 over their distance: in a room
//! of 5 m, cracks of up to a third of a millimetre count.
//!
//! Shares are weighted by the cosine; distances are shares of the diagonal of the region that has
//! the light. A bake extrapolates into hidden points what they would receive if they were exposed,
//! so that they have no error that could be measured.

use glam::DVec3;

use serde::{Deserialize, Serialize};

use crate::geometry::aabb::Aabb;

/// Paths without light from which on a point counts as dark: a gap under a roof's boards had a
/// thousandth of the light outside, which 64 paths miss.
pub(crate) const PATHS_IN_THE_DARK: usize = 4096;

/// Distance up to which surfaces touch, share of the diagonal. Plain choice.
pub(crate) const NEAR: f64 = 0.002;

/// Where the light of a scene is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LitRegion {
    /// The box that nearly all light falls in, where it is much smaller than the scene.
    pub bounds: Option<Aabb>,
    /// Diagonal of that box or, without, of all surfaces that reflect; scene unit.
    pub diagonal: f64,
}

impl LitRegion {
    /// These `bounds`, or `all` that reflects.
    pub fn new(bounds: Option<Aabb>, all: impl FnOnce() -> Aabb) -> LitRegion {
        LitRegion { bounds, diagonal: bounds.unwrap_or_else(all).diagonal() }
    }

    fn contains(&self, position: DVec3) -> bool {
        let is_within = |bounds: Aabb| bounds.expanded(NEAR * self.diagonal).contains(position);
        self.bounds.is_none_or(is_within)
    }
}

/// What a point sees, by any number of rays.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Outlook {
    /// Share of the hemisphere in which there is a surface.
    pub covered: f64,
    /// Share of its light that lamps and luminaires send it directly.
    pub lamps: f64,
    /// Share in which there is a back.
    pub backs: f64,
    /// Mean of 1/distance over the hemisphere, per scene unit.
    pub inverse_distance: f64,
    /// Whether no light arrives by at least [`PATHS_IN_THE_DARK`] paths.
    pub dark: bool,
}

impl Outlook {
    /// Whether it sees almost no surface.
    pub fn is_open(&self) -> bool {
        self.covered < 0.01
    }

    /// Whether the point, at `position`, is hidden where the light is in `region`.
    pub fn is_hidden(&self, region: &LitRegion, position: DVec3) -> bool {
        let diagonal = region.diagonal;
        // Backs at one distance in a share of the hemisphere make its mean of 1/distance at least
        // that share over the distance.
        let covers = 0.4;
        self.is_open() && (self.lamps < 0.01 || !region.contains(position))
            || self.backs > if self.dark { 0.05 } else { 0.95 }
            || self.backs > covers && self.inverse_distance > covers / (NEAR * diagonal)
            || self.inverse_distance * 1e-4 * diagonal > 1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_condition_hides_by_itself() {
        let room = Outlook { covered: 1.0, inverse_distance: 2.0, ..Outlook::default() };
        let chamber = Outlook { backs: 0.3, ..room };
        let foot = Outlook { backs: 0.5, ..room };
        for (outlook, hidden) in [
            (room, false),
            (Outlook { dark: true, ..room }, false),
            (chamber, false),
            (Outlook { dark: true, ..chamber }, true),
            (Outlook { backs: 0.96, ..room }, true),
            (Outlook { covered: 0.009, ..room }, true),
            (Outlook { covered: 0.009, lamps: 0.011, ..room }, false),
            (foot, false),
            // 0.4 / 0.002 = 200, with half of the hemisphere in backs only.
            (Outlook { inverse_distance: 210.0, ..foot }, true),
            (Outlook { inverse_distance: 210.0, ..room }, false),
            (Outlook { inverse_distance: 1.1e4, ..room }, true),
        ] {
            let everywhere = |diagonal| LitRegion { bounds: None, diagonal };
            let is_hidden = outlook.is_hidden(&everywhere(1.0), DVec3::ZERO);
            assert_eq!(is_hidden, hidden, "{outlook:?}");
            // Lengths are shares of the diagonal.
            let scaled = Outlook { inverse_distance: outlook.inverse_distance / 7.0, ..outlook };
            let is_hidden = scaled.is_hidden(&everywhere(7.0), DVec3::ZERO);
            assert_eq!(is_hidden, hidden, "{outlook:?}");
        }
        // Far from the light a lamp is too faint to count.
        let bounds = Some(Aabb { low: DVec3::ZERO, high: DVec3::ONE });
        let region = LitRegion { bounds, diagonal: 3f64.sqrt() };
        let lit = Outlook { lamps: 1.0, ..Outlook::default() };
        assert!(!lit.is_hidden(&region, DVec3::ONE) && lit.is_hidden(&region, 2.0 * DVec3::ONE));
    }
}
