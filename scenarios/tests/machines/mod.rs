//! The shipped machines.
#![allow(clippy::unwrap_used, reason = "helpers of tests fail the test")]

use bicycle::Vehicle;

/// PIETRA's vehicle of 3.4 x 1.8 m.
#[allow(dead_code, reason = "not every test drives every machine")]
pub fn full_size() -> Vehicle {
    toml::from_str(include_str!("../../vehicles/pietra_full_size.toml")).unwrap()
}

/// PIETRA's car of 0.33 x 0.25 m.
#[allow(dead_code, reason = "not every test drives every machine")]
pub fn rc_car() -> Vehicle {
    toml::from_str(include_str!("../../vehicles/rc_car.toml")).unwrap()
}
