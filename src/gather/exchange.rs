//! Light that vertices reflect to each other.
//!
//! ```text
//!   x_k = c_k + ρ_k Σ_j w_kj x_j    c: reflected light from elsewhere    w: rays from k to near j
//! ```
//!
//! Rays are cast once; all bounces are arithmetic then. Light that enters a gap goes to and fro a
//! hundred times between its walls.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::linear::gauss_seidel::{self, BLOCK, Equations};
use crate::scene::Rgb;
use crate::work;

/// Maximum share of its light that a vertex misses for bounces that are omitted: far below all
/// requested errors, so that results hardly depend on it.
const PRECISION: f64 = 1e-3;

/// The equation of a vertex.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Equation {
    pub albedo: Rgb,
    /// Reflected light from elsewhere, W/m²; or the change of it.
    pub constant: Rgb,
    /// The vertices that it receives light from.
    pub terms: Vec<Term>,
}

/// A vertex that another receives light from. In 32 bits, since there may be millions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Term {
    pub vertex: u32,
    /// Share of the hemisphere, per channel.
    share: [f32; 3],
}

impl Term {
    /// Sums the shares of each vertex; in the order of their numbers.
    pub fn merged(mut shares: Vec<(u32, Rgb)>) -> Vec<Term> {
        shares.sort_by_key(|&(vertex, _)| vertex);
        shares.dedup_by(|next, first| {
            let is_same = next.0 == first.0;
            if is_same {
                first.1 += next.1;
            }
            is_same
        });
        let term = |(vertex, share): (u32, Rgb)| Term { vertex, share: share.as_vec3().into() };
        shares.into_iter().map(term).collect()
    }

    /// Share of the hemisphere, per channel.
    fn share(&self) -> Rgb {
        Rgb::from(self.share.map(f64::from))
    }
}

impl Equations for [Equation] {
    fn evaluate<'x>(&self, k: usize, x: impl Fn(usize) -> &'x [f64], value: &mut [f64]) {
        let Equation { albedo, constant, terms } = &self[k];
        let light = |term: &Term| term.share() * Rgb::from_slice(x(term.vertex as usize));
        let received = terms.iter().map(light).sum::<Rgb>();
        (constant + albedo * received).write_to_slice(value);
    }
}

/// Whether this process evaluates equation `k`: others need not have its terms.
pub(crate) fn is_own(k: usize) -> bool {
    work::is_own(k / BLOCK)
}

/// The light that each vertex reflects after all bounces, W/m². Sweeps begin with darkness, and end
/// when no vertex misses more than [`PRECISION`] of its light, or of `floor` (W/m²) where it is
/// darker; or after 1000
/// sweeps: with an albedo of 0.99, 4e-5 of the light is missing then.
pub(crate) fn converge(equations: &[Equation], floor: f64) -> Vec<Rgb> {
    // All changes that follow one are at most this over one minus the largest albedo.
    let albedo = equations.iter().map(|k| k.albedo.max_element()).fold(0.0, f64::max);
    let allowed = PRECISION * (1.0 - albedo).max(PRECISION);
    let mut reflected = vec![0.0; 3 * equations.len()];
    for _ in 0..1000 {
        let swept = |block: usize| {
            let first = block * BLOCK;
            let end = equations.len().min(first + BLOCK);
            let mut values = reflected[3 * first..3 * end].to_vec();
            gauss_seidel::sweep_block(equations, &reflected, 3, first, &mut values);
            values
        };
        let next = work::map_blocks(equations.len().div_ceil(BLOCK), swept).concat();
        let pairs = reflected.par_chunks(3).zip(next.par_chunks(3));
        let is_converged = pairs
            .map(|pair| (Rgb::from_slice(pair.0), Rgb::from_slice(pair.1)))
            .all(|(before, after)| after.distance(before) <= allowed * after.length().max(floor));
        reflected = next;
        if is_converged {
            break;
        }
    }
    reflected.chunks(3).map(Rgb::from_slice).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::hash::{split_mix64_nth, unit_interval};

    /// Vertices in a ring, each of which receives a `share` from both neighbours.
    fn ring(count: u32, albedo: f64, share: f64) -> Vec<Equation> {
        let equation = |k: u32| {
            let neighbours = [(k + 1) % count, (k + count - 1) % count];
            Equation {
                albedo: Rgb::splat(albedo),
                constant: if k == 0 { Rgb::ONE } else { Rgb::ZERO },
                terms: Term::merged(neighbours.map(|j| (j, Rgb::splat(share))).to_vec()),
            }
        };
        (0..count).map(equation).collect()
    }

    #[test]
    fn light_falls_off_along_a_slot_as_it_should() {
        // x_k = c_k + a (x_(k−1) + x_(k+1)) on a line is r^|k| / (1 − 2 a r), with r the smaller
        // root of a r² − r + a = 0. Beyond 200 vertices of a ring nothing of it is left. The first
        // vertex is in the first block and the last in the third: the test fails if light from
        // other blocks counts 0, or if `converge` ends as soon as one block has converged.
        let (albedo, share): (f64, f64) = (0.98, 0.49);
        let a = albedo * share;
        let r = (1.0 - f64::sqrt(1.0 - 4.0 * a * a)) / (2.0 * a);
        let count = 2 * BLOCK + 100;
        let reflected = converge(&ring(count as u32, albedo, share), 0.0);
        for k in [0, 1, 10, 30] {
            let expected = r.powi(k as i32) / (1.0 - 2.0 * a * r);
            for value in [reflected[k], reflected[(count - k) % count]] {
                // PRECISION, and 32 bits a share, of which a hundred bounces are made.
                let off = (value.x - expected).abs() / expected;
                assert!(off < PRECISION + 1e-5, "{k}: {} for {expected}", value.x);
                assert_eq!(value, Rgb::splat(value.x));
            }
        }
    }

    /// A vertex reflects the light of all its terms, in whichever blocks these are.
    ///
    /// The test fails if light from other blocks counts 0; if the third block, a short one, begins
    /// at its number times its own length; and if `converge` ends when the first block has
    /// converged, or the last, or any: the second alone has light at first, and the others are dark
    /// for a sweep.
    #[test]
    fn vertices_receive_light_from_other_blocks() {
        let (albedo, count) = (0.8, 2 * BLOCK + 1000);
        let equation = |k: usize| {
            let random = |n: usize| split_mix64_nth((3 * k + n) as u64);
            let shares = [0, 1, 2].map(|n| ((random(n) % count as u64) as u32, Rgb::splat(0.3)));
            let is_in_second = k / BLOCK == 1;
            let constant = if is_in_second { unit_interval(random(0)) } else { 0.0 };
            Equation {
                albedo: Rgb::splat(albedo),
                constant: Rgb::splat(constant),
                terms: Term::merged(shares.to_vec()),
            }
        };
        let equations: Vec<Equation> = (0..count).map(equation).collect();
        let reflected = converge(&equations, 0.0);
        let largest = reflected.iter().map(|value| value.length()).fold(0.0, f64::max);
        for (k, equation) in equations.iter().enumerate() {
            let light = |term: &Term| term.share() * reflected[term.vertex as usize];
            let light = equation.terms.iter().map(light).sum::<Rgb>();
            let off = reflected[k].distance(equation.constant + equation.albedo * light);
            // The light that it got was that of the sweep before at the earliest. Since then no
            // vertex changed by more than this share of itself.
            assert!(off < PRECISION * (1.0 - albedo) * largest, "{k}: off by {off}");
        }
    }

    #[test]
    fn what_no_light_reaches_is_dark() {
        let mut equations = ring(8, 0.999, 0.5);
        equations[0].constant = Rgb::ZERO;
        assert_eq!(converge(&equations, 0.0), vec![Rgb::ZERO; 8]);
    }

    #[test]
    fn shares_of_a_vertex_add_up() {
        let shares = [(7, 0.25), (3, 0.5), (7, 0.125)].map(|(k, share)| (k, Rgb::splat(share)));
        let term = |vertex, share| Term { vertex, share: [share; 3] };
        assert_eq!(Term::merged(shares.to_vec()), [term(3, 0.5), term(7, 0.375)]);
    }
}
