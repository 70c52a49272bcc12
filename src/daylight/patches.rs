//! The patches of the sky: Tregenza's 145, each divided by two both ways but for the zenith, 577.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::DVec3;

/// Patches in each of Tregenza's rows of 12° from the horizon up; above them there is one of 6°
/// around the zenith (Tregenza 1987).
const ROWS: [usize; 7] = [30, 30, 24, 24, 18, 12, 6];

/// Height of half a row, radians.
const BAND: f64 = 6.0 * std::f64::consts::PI / 180.0;

/// Half patches.
pub(super) const PATCHES: usize = 577;

/// Whole patches.
pub(super) const WHOLE: usize = 145;

/// A direction of an even set over a patch, with the solid angle that it stands for.
pub(super) struct SkyDirection {
    pub patch: usize,
    pub direction: DVec3,
    pub solid_angle: f64,
}

/// The sky around `up`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Patches {
    up: DVec3,
    axes: [DVec3; 2],
}

impl Patches {
    /// With unit `up`.
    pub fn new(up: DVec3) -> Patches {
        let (x, y) = up.any_orthonormal_pair();
        Patches { up, axes: [x, y] }
    }

    /// The patch of a unit direction; none below the horizon.
    pub fn of(&self, direction: DVec3) -> Option<usize> {
        let height = direction.dot(self.up);
        if height < 0.0 {
            return None;
        }
        let band = (libm::asin(height.min(1.0)) / BAND) as usize;
        if band >= 2 * ROWS.len() {
            return Some(PATCHES - 1);
        }
        let [x, y] = self.axes.map(|axis| axis.dot(direction));
        let turn = (libm::atan2(y, x) / TAU).rem_euclid(1.0);
        let across = 2 * ROWS[band / 2];
        Some(first(band) + ((turn * across as f64) as usize).min(across - 1))
    }

    /// Directions over all of the sky: four in each patch.
    pub fn directions(&self) -> Vec<SkyDirection> {
        let mut all = vec![];
        let mut add = |patch, [low, high]: [f64; 2], across: usize, k: usize| {
            // The middle of the ring by area.
            let sine = (libm::sin(low) + libm::sin(high)) / 2.0;
            let turn = TAU * (k as f64 + 0.5) / across as f64;
            let level = libm::cos(turn) * self.axes[0] + libm::sin(turn) * self.axes[1];
            let direction = (1.0 - sine * sine).sqrt() * level + sine * self.up;
            let solid_angle = TAU / across as f64 * (libm::sin(high) - libm::sin(low));
            all.push(SkyDirection { patch, direction, solid_angle });
        };
        for half in 0..4 * ROWS.len() {
            let (band, across) = (half / 2, 4 * ROWS[half / 4]);
            let edges = [half, half + 1].map(|edge| edge as f64 * BAND / 2.0);
            (0..across).for_each(|k| add(first(band) + k / 2, edges, across, k));
        }
        let edges = [2.0 * ROWS.len() as f64 * BAND, FRAC_PI_2];
        (0..4).for_each(|k| add(PATCHES - 1, edges, 4, k));
        all
    }
}

/// The first patch of a band.
fn first(band: usize) -> usize {
    (0..band).map(|band| 2 * ROWS[band / 2]).sum()
}

/// For each half patch the whole one that it is part of.
pub(super) fn wholes() -> Vec<usize> {
    let rows = ROWS.iter().scan(0, |before, &count| {
        *before += count;
        Some((*before - count, count))
    });
    let rows = rows.flat_map(|(before, count)| {
        let band = move || (0..2 * count).map(move |k| before + k / 2);
        band().chain(band())
    });
    rows.chain([WHOLE - 1]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patches_fill_the_sky() {
        let patches = Patches::new(DVec3::new(1.0, 2.0, 3.0).normalize());
        let directions = patches.directions();
        let whole = wholes();
        assert_eq!((whole.len(), whole[PATCHES - 1], whole[0], whole[60]), (PATCHES, 144, 0, 0));
        let mut solid_angles = vec![0.0; PATCHES];
        for SkyDirection { patch, direction, solid_angle } in &directions {
            assert_eq!(patches.of(*direction), Some(*patch));
            solid_angles[*patch] += solid_angle;
        }
        let sum: f64 = solid_angles.iter().sum();
        assert!((sum / TAU - 1.0).abs() < 1e-12, "{sum}");
        // Four directions each; those of a row are alike, and of all rows within a factor of 1.7.
        assert_eq!(directions.len(), 4 * PATCHES);
        let [low, high] = [f64::min, f64::max]
            .map(|of| solid_angles[..PATCHES - 1].iter().copied().reduce(of).unwrap());
        assert!(high / low < 1.7 && solid_angles[0] == solid_angles[59], "{low} {high}");
        assert_eq!(patches.of(-DVec3::new(1.0, 2.0, 3.0).normalize()), None);
    }
}
