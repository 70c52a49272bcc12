//! Maps by numbers of our own making.

use std::collections::{HashMap, HashSet};
use std::hash::{BuildHasherDefault, Hasher};

/// Keys are numbers that the crate gave out: a file cannot choose those that meet, so that the
/// standard hash, which is safe from that and slower, is not needed.
pub(crate) type Map<K, V> = HashMap<K, V, BuildHasherDefault<Mix>>;

/// See [`Map`].
pub(crate) type Set<K> = HashSet<K, BuildHasherDefault<Mix>>;

/// Mixes numbers by the two halves of a product.
#[derive(Clone, Copy, Default)]
pub(crate) struct Mix(u64);

impl Hasher for Mix {
    fn write_u64(&mut self, number: u64) {
        // Odd, with its bits spread evenly: 2⁶⁴ over the golden ratio.
        let product = u128::from(self.0 ^ number ^ 0x2545_f491_4f6c_dd1d) * 0x9e37_79b9_7f4a_7c15;
        self.0 = product as u64 ^ (product >> 64) as u64;
    }

    fn write_u32(&mut self, number: u32) {
        self.write_u64(number.into());
    }

    fn write_usize(&mut self, number: usize) {
        self.write_u64(number as u64);
    }

    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|&b| self.write_u64(b.into()));
    }

    fn finish(&self) -> u64 {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use std::hash::Hash;

    use super::*;

    #[test]
    fn neighbouring_keys_spread() {
        // A map takes the low bits for a place and the high seven to tell keys apart there. Of n
        // keys on n places a random hash leaves n/e free, with a variance of n (1/e − 2/e²): 0.097 n.
        const N: u32 = 1 << 16;
        let expected = f64::from(N) * (-1f64).exp();
        let six_sigma = 6.0 * (0.097 * f64::from(N)).sqrt();
        for (step, across) in [(1, 256), (64, 256), (4096, 16), (1, 1)] {
            let hashes = (0..N).map(|k| {
                let mut hasher = Mix::default();
                (2u32, step * (k / across), step * (k % across)).hash(&mut hasher);
                hasher.finish()
            });
            let hashes: Vec<u64> = hashes.collect();
            for shift in [0, 64 - 16] {
                let mut taken = vec![false; N as usize];
                hashes.iter().for_each(|h| taken[(h >> shift) as usize % N as usize] = true);
                let free = taken.iter().filter(|t| !**t).count() as f64;
                assert!((free - expected).abs() < six_sigma, "{step} {across} {shift}: {free}");
            }
        }
    }
}
