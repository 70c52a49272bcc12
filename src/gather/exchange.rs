//! Light that goes to and fro between places that see each other.
//!
//! ```text
//!   x_k = c_k + ρ_k Σ_j w_kj x_j      c: what comes from elsewhere    w: rays from k that meet j
//! ```
//!
//! Rays are cast once; all bounces are arithmetic then. Light that seeps into a slot from wall to
//! wall makes a hundred of them.

use rayon::prelude::*;

use crate::scene::Rgb;

/// Share of its light that a place may miss for bounces that were not made: far below all errors
/// that are asked for.
const PRECISION: f64 = 1e-3;

/// Sweeps over the places, at most, each a bounce or more: where nothing escapes, an albedo of 0.99
/// leaves 4e-5 after so many.
const MAX_SWEEPS: u32 = 1000;

/// Places of a block. A block is swept by one thread, in the order of its places: light from the
/// same block is of this sweep, light from others of the sweep before. The size is the same on any
/// number of cores, and so are the bits of the result.
///
/// Large blocks take fewer sweeps; small ones give more cores work, of which there are as many as
/// blocks. Sweeps over 40 000 places that see 30 others each, with an albedo of 0.95:
///
/// ```text
/// places of a block    others anywhere    others within 50 numbers
///            40 000                 77                          88
///             4 096                132                          90
///                 1                138                         155
/// ```
///
/// Chosen by hand between these: ten blocks for every 40 000 places.
const BLOCK: usize = 4096;

/// A place that exchanges light with others.
#[derive(Clone, Debug, Default)]
pub(crate) struct Place {
    pub albedo: Rgb,
    /// What it reflects of light from elsewhere, W/m²; or the change of it.
    pub constant: Rgb,
    /// Places that it sees, by their numbers, each with its share of the hemisphere.
    pub seen: Vec<SeenPlace>,
}

/// A place that is seen from another. In 32 bits, since there may be millions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SeenPlace {
    pub place: u32,
    pub share: [f32; 3],
}

impl SeenPlace {
    /// Each of `seen`, places and shares, once; in the order of their numbers.
    pub fn merged(mut seen: Vec<(u32, Rgb)>) -> Vec<SeenPlace> {
        seen.sort_by_key(|&(place, _)| place);
        seen.dedup_by(|next, first| {
            let same = next.0 == first.0;
            if same {
                first.1 += next.1;
            }
            same
        });
        let entry = |(place, share): (u32, Rgb)| SeenPlace { place, share: share.as_vec3().into() };
        seen.into_iter().map(entry).collect()
    }

    /// Its share of the hemisphere, per channel.
    pub fn share(&self) -> Rgb {
        Rgb::from(self.share.map(f64::from))
    }
}

/// What `places` reflect when all bounces between them are made, W/m²: by Gauss–Seidel within
/// blocks of [`BLOCK`] places and Jacobi between these, from darkness on, until no sweep changes
/// one by more than leaves a thousandth of it, or of `floor` where it is darker.
pub(crate) fn settle(places: &[Place], floor: f64) -> Vec<Rgb> {
    let mut reflected = vec![Rgb::ZERO; places.len()];
    // A sweep returns the largest albedo of a change at most: all that follow a change are no more
    // than this one over one minus that.
    let albedo = places.iter().map(|place| place.albedo.max_element()).fold(0.0, f64::max);
    let allowed = PRECISION * (1.0 - albedo).max(PRECISION);
    for _ in 0..MAX_SWEEPS {
        let sweep = |(block, places): (usize, &[Place])| {
            let first = block * BLOCK;
            let mut values = reflected[first..first + places.len()].to_vec();
            let mut is_settled = true;
            for (k, place) in places.iter().enumerate() {
                let light = |seen: &SeenPlace| {
                    let j = seen.place as usize;
                    let in_block = j.checked_sub(first).and_then(|j| values.get(j));
                    seen.share() * *in_block.unwrap_or_else(|| &reflected[j])
                };
                let light = place.seen.iter().map(light).sum::<Rgb>();
                let value = place.constant + place.albedo * light;
                is_settled &= value.distance(values[k]) <= allowed * value.length().max(floor);
                values[k] = value;
            }
            (values, is_settled)
        };
        let blocks = places.par_chunks(BLOCK).enumerate().map(sweep);
        let (blocks, settled): (Vec<Vec<Rgb>>, Vec<bool>) = blocks.unzip();
        reflected = blocks.concat();
        if settled.into_iter().all(|is_settled| is_settled) {
            break;
        }
    }
    reflected
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::hash::{split_mix64_nth, unit_interval};

    /// Places in a ring, each of which sees its two neighbours by a `share` each.
    fn ring(count: u32, albedo: f64, share: f64) -> Vec<Place> {
        let place = |k: u32| {
            let neighbours = [(k + 1) % count, (k + count - 1) % count];
            Place {
                albedo: Rgb::splat(albedo),
                constant: if k == 0 { Rgb::ONE } else { Rgb::ZERO },
                seen: SeenPlace::merged(neighbours.map(|j| (j, Rgb::splat(share))).to_vec()),
            }
        };
        (0..count).map(place).collect()
    }

    #[test]
    fn light_falls_off_along_a_slot_as_it_should() {
        // x_k = c_k + a (x_(k−1) + x_(k+1)) on a line is r^|k| / (1 − 2 a r), with r the smaller
        // root of a r² − r + a = 0. Beyond 200 places of a ring nothing of it is left. The first
        // place is in the first block and the last in the third: the test fails if light from other
        // blocks counts 0, or if `settle` ends as soon as one block is settled.
        let (albedo, share): (f64, f64) = (0.98, 0.49);
        let a = albedo * share;
        let r = (1.0 - f64::sqrt(1.0 - 4.0 * a * a)) / (2.0 * a);
        let count = 2 * BLOCK + 100;
        let found = settle(&ring(count as u32, albedo, share), 0.0);
        for k in [0, 1, 10, 30] {
            let expected = r.powi(k as i32) / (1.0 - 2.0 * a * r);
            for found in [found[k], found[(count - k) % count]] {
                // PRECISION, and 32 bits a share, of which a hundred bounces are made.
                let off = (found.x - expected).abs() / expected;
                assert!(off < PRECISION + 1e-5, "{k}: {} for {expected}", found.x);
                assert_eq!(found, Rgb::splat(found.x));
            }
        }
    }

    /// A place reflects what it gets from all that it sees, in whichever blocks these are.
    ///
    /// The test fails if light from other blocks counts 0; if the third block, a short one, begins
    /// at its number times its own length; and if `settle` ends when the first block is settled, or
    /// the last, or any: the second alone has light at first, and the others are dark for a sweep.
    #[test]
    fn places_see_those_of_other_blocks() {
        let (albedo, count) = (0.8, 2 * BLOCK + 1000);
        let place = |k: usize| {
            let random = |n: usize| split_mix64_nth((3 * k + n) as u64);
            let seen = [0, 1, 2].map(|n| ((random(n) % count as u64) as u32, Rgb::splat(0.3)));
            let is_in_second = k / BLOCK == 1;
            let constant = if is_in_second { unit_interval(random(0)) } else { 0.0 };
            Place {
                albedo: Rgb::splat(albedo),
                constant: Rgb::splat(constant),
                seen: SeenPlace::merged(seen.to_vec()),
            }
        };
        let places: Vec<Place> = (0..count).map(place).collect();
        let found = settle(&places, 0.0);
        let most = found.iter().map(|value| value.length()).fold(0.0, f64::max);
        for (k, place) in places.iter().enumerate() {
            let light = |seen: &SeenPlace| seen.share() * found[seen.place as usize];
            let light = place.seen.iter().map(light).sum::<Rgb>();
            let off = found[k].distance(place.constant + place.albedo * light);
            // The light that it got was that of the sweep before at the earliest. Since then no
            // place changed by more than this share of itself.
            assert!(off < PRECISION * (1.0 - albedo) * most, "{k}: off by {off}");
        }
    }

    #[test]
    fn what_no_light_reaches_is_dark() {
        let mut places = ring(8, 0.999, 0.5);
        places[0].constant = Rgb::ZERO;
        assert_eq!(settle(&places, 0.0), vec![Rgb::ZERO; 8]);
    }

    #[test]
    fn a_place_that_is_met_twice_counts_twice() {
        let seen = [(7, 0.25), (3, 0.5), (7, 0.125)].map(|(k, share)| (k, Rgb::splat(share)));
        let entry = |place, share| SeenPlace { place, share: [share; 3] };
        assert_eq!(SeenPlace::merged(seen.to_vec()), [entry(3, 0.5), entry(7, 0.375)]);
    }
}
