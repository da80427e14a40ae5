//! Smooth noise on a lattice, the same for the same seed and place.

use crate::random::mixed;

/// A number for a place on a lattice.
pub(super) fn hash(seed: u64, [x, y]: [u64; 2]) -> u64 {
    mixed(mixed(seed ^ mixed(x)) ^ y.rotate_left(32))
}

/// The same in [0, 1).
pub(super) fn unit(hash: u64) -> f32 {
    (hash >> 40) as f32 / (1 << 24) as f32
}

/// Smooth noise within -1 and 1 whose bumps lie `reach_m` apart.
pub(super) fn noise(seed: u64, at_m: [f64; 2], reach_m: f64) -> f64 {
    let place = at_m.map(|value_m| value_m / reach_m);
    let corner = place.map(f64::floor);
    let share: [f64; 2] = std::array::from_fn(|i| {
        let x = place[i] - corner[i];
        x * x * (3.0 - 2.0 * x)
    });
    let at = |i: i64, j: i64| {
        let lattice = [(corner[0] as i64 + i) as u64, (corner[1] as i64 + j) as u64];
        2.0 * f64::from(unit(hash(seed, lattice))) - 1.0
    };
    let row = |j: i64| at(0, j) + share[0] * (at(1, j) - at(0, j));
    row(0) + share[1] * (row(1) - row(0))
}
