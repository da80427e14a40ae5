//! How often the parts of a run speak, and every limit on age and silence that follows from it.
//!
//! All processes of a run are given the same [`Periods`]; nothing else in this crate knows how long is too long.

use navigator::GuardConfig;
use serde::{Deserialize, Serialize};

use crate::clock;

/// Time between two messages, part by part.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Periods {
    /// Between two decisions [s].
    pub control_s: f64,
    /// Between two odometry messages [s].
    pub odometry_s: f64,
    /// Between two scans, and so between two maps [s].
    pub scan_s: f64,
    /// Between two repetitions of the mission [s].
    pub mission_s: f64,
}

impl Default for Periods {
    fn default() -> Self {
        Self { control_s: 0.1, odometry_s: 0.02, scan_s: 0.2, mission_s: 1.0 }
    }
}

/// What a message takes on its way, and a process to wake up on a machine that is busy [s].
const DELAY_S: f64 = 0.08;
/// Limits below which nothing goes however often the parts speak, because what they do takes time, too [s].
const COMMAND_S: f64 = 0.3;
const LEARNED_S: f64 = 0.6;
const LEARNING_SILENCE_S: f64 = 0.4;
/// Whoever says something expects it to happen now, not after a pause that nobody knows of [s].
const ORDER_S: f64 = 1.0;

impl Periods {
    /// What a guard lets pass at these periods: two odometry messages may be lost and four scans, and a map may have been
    /// made of the scan before the last and be driven on for two periods of control. A scan waits until the odometry after
    /// it must have come, and where it has not, is placed by the one before it.
    pub fn guard(&self) -> GuardConfig {
        let usual = GuardConfig::default();
        let scan_age_max_s = (5.0 * self.scan_s).max(2.0 * (self.scan_s + self.control_s));
        GuardConfig {
            odometry_age_max_s: usual.odometry_age_max_s.max(3.0 * self.odometry_s),
            frozen_max_s: usual.frozen_max_s.max(5.0 * self.odometry_s),
            scan_age_max_s: usual.scan_age_max_s.max(scan_age_max_s),
            odometry_wait_max_s: usual.odometry_wait_max_s.max(self.odometry_s + DELAY_S),
            extrapolation_max_s: usual.extrapolation_max_s.max(self.odometry_s),
            ..usual
        }
    }

    /// Age up to which the vehicle follows a command: one more of control's deadlines may be missed [s].
    fn command_s(&self) -> f64 {
        COMMAND_S.max(self.odometry_s + 2.0 * self.control_s + DELAY_S)
    }

    fn learning_silence_s(&self) -> f64 {
        LEARNING_SILENCE_S.max(2.0 * self.scan_s)
    }
}

/// How old what is driven on may be [ns]. Every age counts from when something was true, not from when it was sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AgeLimits {
    /// Odometry of a command that the vehicle follows.
    pub command_ns: u64,
    /// Scan of a command that the vehicle follows.
    pub scan_ns: u64,
    /// Scan of a learned map from which on physics' younger map is preferred.
    pub learned_ns: u64,
    /// Silence of learning after which physics speaks.
    pub learning_silence_ns: u64,
    /// Mission that has not been repeated.
    pub mission_ns: u64,
    /// Order of somebody who directs the vehicle.
    pub order_ns: u64,
}

/// Settings that cannot be together.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{setting}: expected more than {least_s:.3} s with {because}, found {found_s} s")]
pub struct AgeLimitError {
    /// Name of the setting.
    pub setting: &'static str,
    /// What it must be above [s].
    pub least_s: f64,
    /// The periods that it follows from.
    pub because: String,
    /// The value that was given [s].
    pub found_s: f64,
}

impl AgeLimits {
    /// The limits that follow from periods, with the guard that control has. `command_age_max_s` takes the place of the
    /// age that follows for commands.
    ///
    /// # Errors
    /// A limit that what is regular would exceed, with both numbers.
    pub fn new(
        periods: &Periods,
        guard: &GuardConfig,
        command_age_max_s: Option<f64>,
    ) -> Result<Self, AgeLimitError> {
        let Periods { control_s, odometry_s, scan_s, mission_s } = *periods;
        let command_s = command_age_max_s.unwrap_or_else(|| periods.command_s());
        let silence_s = periods.learning_silence_s();
        let require = |setting, found_s: f64, least_s: f64, because: String| match found_s > least_s {
            true => Ok(()),
            false => Err(AgeLimitError { setting, least_s, because, found_s }),
        };
        let odometry = || format!("odometry every {odometry_s} s");
        require("guard.odometry_age_max_s", guard.odometry_age_max_s, 2.0 * odometry_s, odometry())?;
        require("guard.frozen_max_s", guard.frozen_max_s, 2.0 * odometry_s, odometry())?;
        require("guard.odometry_wait_max_s", guard.odometry_wait_max_s, odometry_s, odometry())?;
        let scans = || format!("scans every {scan_s} s and decisions every {control_s} s");
        // Physics speaks after the silence of learning, of the next scan, and must have been heard by then.
        let least_s = (silence_s + scan_s).max(scan_s + control_s);
        require("guard.scan_age_max_s", guard.scan_age_max_s, least_s, scans())?;
        let commands = format!("decisions every {control_s} s and {}", odometry());
        require("--command-age", command_s, odometry_s + control_s, commands)?;
        Ok(Self {
            command_ns: clock::nanoseconds(command_s),
            scan_ns: clock::nanoseconds(guard.scan_age_max_s),
            learned_ns: clock::nanoseconds(LEARNED_S.max(3.0 * scan_s)),
            learning_silence_ns: clock::nanoseconds(silence_s),
            mission_ns: clock::nanoseconds(2.5 * mission_s),
            order_ns: clock::nanoseconds(ORDER_S),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bicycle::Odometry;
    use navigator::{Config, Surface, Surveyor, Whereabouts};

    fn limits(periods: &Periods, command_age_max_s: Option<f64>) -> Result<AgeLimits, AgeLimitError> {
        AgeLimits::new(periods, &periods.guard(), command_age_max_s)
    }

    #[test]
    fn limits_of_the_usual_periods_are_those_of_the_documentation() {
        let periods = Periods::default();
        assert_eq!(periods.guard(), GuardConfig::default());
        let ms = |ms: u64| 1_000_000 * ms;
        let expected = AgeLimits {
            command_ns: ms(300),
            scan_ns: ms(1000),
            learned_ns: ms(600),
            learning_silence_ns: ms(400),
            mission_ns: ms(2500),
            order_ns: ms(1000),
        };
        assert_eq!(limits(&periods, None), Ok(expected));
    }

    /// What is regular, and one message lost on the way, is within every limit, at whatever rates.
    #[test]
    fn what_comes_in_time_is_never_too_old() {
        for control_s in [0.02, 0.1, 0.4, 1.0] {
            for odometry_s in [0.005, 0.02, 0.2] {
                for scan_s in [0.05, 0.2, 0.5, 1.0] {
                    let periods = Periods { control_s, odometry_s, scan_s, mission_s: 1.0 };
                    let found = limits(&periods, None).unwrap();
                    let guard = periods.guard();
                    let holds = |limit_ns: u64, regular_s: f64| {
                        assert!(limit_ns as f64 * 1e-9 > regular_s, "{periods:?} {found:?} {regular_s}");
                    };
                    // A command of before the last deadline, of the odometry before the last.
                    holds(found.command_ns, odometry_s + 2.0 * control_s);
                    holds(clock::nanoseconds(guard.odometry_age_max_s), 2.0 * odometry_s);
                    // A scan from just after the last odometry, with what the next one takes on its way.
                    holds(clock::nanoseconds(guard.odometry_wait_max_s), odometry_s + 0.9 * DELAY_S);
                    // A command of before the last deadline, of the scan before the last.
                    holds(found.scan_ns, 2.0 * scan_s + control_s);
                    holds(found.learned_ns, 2.0 * scan_s);
                    holds(found.learning_silence_ns, scan_s);
                    // Physics has spoken before control gives up.
                    holds(found.scan_ns, found.learning_silence_ns as f64 * 1e-9 + scan_s);
                    holds(found.mission_ns, 2.0);
                }
            }
        }
    }

    /// Odometry five times a second: a scan is placed wherever it falls, by the odometry after it, or where that one is
    /// lost, by the one before.
    #[test]
    fn scans_are_placed_at_low_rates() {
        let guard = Periods { odometry_s: 0.2, scan_s: 0.4, ..Periods::default() }.guard();
        let vehicle = formats::read_vehicle("rc_car").unwrap();
        let elevation = Config::for_vehicle(&vehicle).elevation;
        let mut surveyor = Surveyor::new(&vehicle, elevation, guard, Surface::Sensed).unwrap();
        let ns = |at_ms: u64| 1_000_000 * at_ms;
        // 1 m/s eastwards.
        let measured = |at_ms: u64| Odometry {
            valid_at_ns: ns(at_ms),
            position_m: [1e-3 * at_ms as f64, 0.0, 0.0],
            velocity_mps: [1.0, 0.0],
            ..Odometry::default()
        };
        let is_there =
            |there: &Odometry, at_ms: u64| (there.position_m[0] - 1e-3 * at_ms as f64).abs() < 1e-9;
        for at_ms in [1000, 1200] {
            assert_eq!(surveyor.admit(&measured(at_ms)), Ok(None));
        }
        for at_ms in [1201, 1399] {
            let ahead = surveyor.place(ns(at_ms));
            assert!(
                matches!(&ahead, Ok(Whereabouts::Ahead(Some(there))) if is_there(there, at_ms)),
                "{ahead:?}"
            );
        }
        assert_eq!(surveyor.admit(&measured(1400)), Ok(None));
        let between = surveyor.place(ns(1399));
        assert!(matches!(&between, Ok(Whereabouts::Between(there)) if is_there(there, 1399)), "{between:?}");
    }

    #[test]
    fn settings_that_contradict_each_other_are_refused_with_the_numbers() {
        let slow = Periods { control_s: 1.0, ..Periods::default() };
        let told = limits(&slow, Some(0.3)).unwrap_err().to_string();
        assert_eq!(
            told,
            "--command-age: expected more than 1.020 s with decisions every 1 s and odometry every 0.02 s, found 0.3 s"
        );
        let rare = Periods { scan_s: 0.5, ..Periods::default() };
        let told = AgeLimits::new(&rare, &GuardConfig::default(), None).unwrap_err().to_string();
        assert_eq!(
            told,
            "guard.scan_age_max_s: expected more than 1.500 s with scans every 0.5 s and decisions every 0.1 s, found 1 s"
        );
        let seldom = Periods { odometry_s: 0.2, ..Periods::default() };
        let told = AgeLimits::new(&seldom, &GuardConfig::default(), None).unwrap_err();
        assert_eq!((told.setting, told.least_s), ("guard.odometry_age_max_s", 0.4));
        assert!(limits(&Periods::default(), Some(f64::NAN)).is_err());
    }
}
