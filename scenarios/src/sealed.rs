//! Cases of simulator against robot, drawn at random: a machine on its hills, drives that excite it, and what is wrong
//! with the robot. The plant makes both sides; only the robot's departs from its description.

mod driver;
mod drives;
mod effects;
mod fleet;
mod hills;
mod unknowns;

pub use driver::Style;
pub use drives::{LOG_HZ, LOG_S, TestDriveError, test_drive};
pub use effects::EFFECTS;
pub use fleet::TestMachine;
pub use unknowns::UNKNOWNS;

use std::collections::BTreeMap;

use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::Deviation;
use crate::random::stream;

/// How large an effect is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Magnitude {
    /// Can just be seen.
    Small,
    /// Cannot be missed by who looks for it.
    Medium,
    /// Spoils the simulator.
    Large,
}

impl Magnitude {
    const ALL: [Self; 3] = [Self::Small, Self::Medium, Self::Large];

    /// One letter, as labels have it.
    pub fn letter(self) -> &'static str {
        ["s", "m", "l"][self as usize]
    }
}

/// How much is wrong with the robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Amount {
    /// Nothing.
    None,
    /// One effect that has a name.
    Single,
    /// Two of them.
    Pair,
    /// Something without a name.
    Unknown,
}

/// What is wrong with the robot of one case, and how it is driven.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnCase {
    /// How much.
    pub amount: Amount,
    /// Ids, see [`EFFECTS`] and [`UNKNOWNS`].
    pub effects: Vec<&'static str>,
    /// How large; none where nothing is wrong.
    pub magnitude: Option<Magnitude>,
    /// Who drives where the cause is sought.
    pub style: Style,
    /// Who drives where it is verified.
    pub heldout_style: Style,
    /// Numbers by key, in the units of the catalogue where it has such a parameter.
    pub injection: BTreeMap<&'static str, f64>,
    /// The plant's departures.
    pub deviations: Vec<Deviation>,
}

/// One way to make something wrong: numbers for the label, departures for the plant.
#[derive(Clone, Debug, Default, PartialEq)]
struct Made {
    injection: Vec<(&'static str, f64)>,
    deviations: Vec<Deviation>,
}

impl Made {
    fn new(key: &'static str, value: f64, deviation: Deviation) -> Self {
        Self { injection: vec![(key, value)], deviations: vec![deviation] }
    }

    fn with(mut self, key: &'static str, value: f64) -> Self {
        self.injection.push((key, value));
        self
    }
}

/// Shares of cases: nothing wrong, one effect, two, something without a name.
const SHARES: [(Amount, f64); 4] =
    [(Amount::None, 0.16), (Amount::Single, 0.60), (Amount::Pair, 0.12), (Amount::Unknown, 0.12)];
/// Shares of drivers that excite little.
const POOR_SHARE: f64 = 0.06;
const TRACK_SHARE: f64 = 0.06;
/// Share of verifications with another driver.
const OTHER_DRIVER_SHARE: f64 = 0.4;

impl DrawnCase {
    /// The case that belongs to a seed on a machine.
    pub fn draw(machine: &TestMachine, seed: u64) -> Self {
        let mut rng = stream(seed, &[0xCA5E]);
        let amount = drawn(&SHARES, &mut rng);
        let size = Magnitude::ALL[rng.random_range(0..3)];
        let (effects, magnitude, made) = match amount {
            Amount::None => (Vec::new(), None, Made::default()),
            Amount::Single => {
                let id = EFFECTS[rng.random_range(0..EFFECTS.len())];
                (vec![id], Some(size), effects::make(id, size, machine, &mut rng))
            }
            Amount::Pair => {
                let ids = pair(&mut rng);
                let [mut made, other] = ids.map(|id| effects::make(id, Magnitude::Medium, machine, &mut rng));
                made.injection.extend(other.injection);
                made.deviations.extend(other.deviations);
                (ids.to_vec(), Some(Magnitude::Medium), made)
            }
            Amount::Unknown => {
                let id = UNKNOWNS[rng.random_range(0..UNKNOWNS.len())];
                (vec![id], Some(Magnitude::Medium), unknowns::make(id, machine, &mut rng))
            }
        };
        let style = style(&effects, &mut rng);
        let is_other = style == Style::Rich && rng.random_bool(OTHER_DRIVER_SHARE);
        let heldout_style = if is_other && !effects.contains(&"friction") { Style::Track } else { style };
        let injection = made.injection.into_iter().collect();
        Self { amount, effects, magnitude, style, heldout_style, injection, deviations: made.deviations }
    }
}

fn drawn<T: Copy>(shares: &[(T, f64)], rng: &mut Xoshiro256PlusPlus) -> T {
    let mut left = rng.random_range(0.0..1.0);
    for (value, share) in shares {
        left -= share;
        if left < 0.0 {
            return *value;
        }
    }
    shares[shares.len() - 1].0
}

/// Two effects of different parts of the machine.
fn pair(rng: &mut Xoshiro256PlusPlus) -> [&'static str; 2] {
    loop {
        let ids = [(); 2].map(|()| EFFECTS[rng.random_range(0..EFFECTS.len())]);
        if effects::group(ids[0]) != effects::group(ids[1]) {
            return ids;
        }
    }
}

/// Grip shows at its limit only, where no careful driver goes; and one speed alone is all or nothing to a dead band.
fn style(effects: &[&str], rng: &mut Xoshiro256PlusPlus) -> Style {
    if effects.iter().any(|id| ["friction", "motor_deadband"].contains(id)) {
        return Style::Rich;
    }
    let rich = 1.0 - POOR_SHARE - TRACK_SHARE;
    drawn(&[(Style::Poor, POOR_SHARE), (Style::Track, TRACK_SHARE), (Style::Rich, rich)], rng)
}

#[cfg(test)]
mod tests;
