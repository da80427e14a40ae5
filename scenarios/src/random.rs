//! Random streams keyed by a seed and by what they are for, so that no stream depends on how much another was used.

use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;

/// The generator that belongs to `seed` and `key`, whatever else was drawn.
pub fn stream(seed: u64, key: &[u64]) -> Xoshiro256PlusPlus {
    Xoshiro256PlusPlus::seed_from_u64(seed_of(seed, key))
}

/// The seed that belongs to `seed` and `key`.
pub fn seed_of(seed: u64, key: &[u64]) -> u64 {
    key.iter().fold(mixed(seed), |state, word| mixed(state ^ mixed(*word)))
}

/// A standard normal number.
pub(crate) fn normal(rng: &mut Xoshiro256PlusPlus) -> f64 {
    rng.sample(StandardNormal)
}

/// The finaliser of SplitMix64: every input bit flips half of the output bits.
pub(crate) fn mixed(word: u64) -> u64 {
    let word = word.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let word = (word ^ (word >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let word = (word ^ (word >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    word ^ (word >> 31)
}

/// The random numbers of one ray of one scan: independent of the order in which rays are cast.
pub(crate) struct RayNoise {
    state: u64,
}

impl RayNoise {
    pub(crate) fn new(seed: u64, scan: u64, ray: u64) -> Self {
        Self { state: mixed(mixed(seed ^ mixed(scan)) ^ ray) }
    }

    /// Uniform in (0, 1].
    pub(crate) fn uniform(&mut self) -> f64 {
        self.state = self.state.wrapping_add(1);
        ((mixed(self.state) >> 11) + 1) as f64 / (1_u64 << 53) as f64
    }

    /// Standard normal (Box and Muller).
    pub(crate) fn normal(&mut self) -> f64 {
        let radius = (-2.0 * self.uniform().ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }
}
