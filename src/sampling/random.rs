//! Random number generators seeded by words.

use fastrand::Rng;
use xxhash_rust::xxh3::xxh3_64_with_seed;

/// A random number generator seeded by the hash of `words`.
pub(crate) fn random_numbers(words: &[u64]) -> Rng {
    let hash = |seed, word: &u64| xxh3_64_with_seed(&word.to_le_bytes(), seed);
    Rng::with_seed(words.iter().fold(0, hash))
}

/// A normal deviate by Box and Muller (1958).
#[cfg(test)]
pub(crate) fn normal_deviate(rng: &mut Rng) -> f64 {
    (-2.0 * libm::log(1.0 - rng.f64())).sqrt() * libm::cos(std::f64::consts::TAU * rng.f64())
}
