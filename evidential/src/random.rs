//! Random streams keyed by a seed and by what they are for, so that no stream depends on how much another was used.

use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

/// The generator that belongs to `seed` and `key`.
pub(crate) fn stream(seed: u64, key: &[u64]) -> Xoshiro256PlusPlus {
    Xoshiro256PlusPlus::seed_from_u64(key.iter().fold(mixed(seed), |state, word| mixed(state ^ mixed(*word))))
}

/// The finaliser of SplitMix64: every input bit flips half of the output bits.
fn mixed(word: u64) -> u64 {
    let word = word.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let word = (word ^ (word >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let word = (word ^ (word >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    word ^ (word >> 31)
}
