//! Every limit on age and silence that follows from how often the parts of a run speak.

use std::cmp::Ordering;

use bus::ages::{AgeLimits, Periods};
use bus::clock;
use navigator::GuardConfig;

/// What a message takes on its way, and a process to wake up on a machine that is busy [s].
const DELAY_S: f64 = 0.08;
/// Limits below which nothing goes however often the parts speak, because what they do takes time, too [s].
const COMMAND_S: f64 = 0.3;
const LEARNED_S: f64 = 0.6;
const LEARNING_SILENCE_S: f64 = 0.4;
/// Whoever says something expects it to happen now, not after a pause that nobody knows of [s].
const ORDER_S: f64 = 1.0;

/// What a guard lets pass at these periods: two odometry messages may be lost and four scans, and a map may have been
/// made of the scan before the last and be driven on for two periods of control. A scan waits until the odometry after
/// it must have come, and where it has not, is placed by the one before it.
pub fn guard(periods: &Periods) -> GuardConfig {
    let usual = GuardConfig::default();
    let Periods { control_s, odometry_s, scan_s, .. } = *periods;
    let scan_age_max_s = (5.0 * scan_s).max(2.0 * (scan_s + control_s));
    GuardConfig {
        odometry_age_max_s: usual.odometry_age_max_s.max(3.0 * odometry_s),
        frozen_max_s: usual.frozen_max_s.max(5.0 * odometry_s),
        scan_age_max_s: usual.scan_age_max_s.max(scan_age_max_s),
        odometry_wait_max_s: usual.odometry_wait_max_s.max(odometry_s + DELAY_S),
        extrapolation_max_s: usual.extrapolation_max_s.max(odometry_s),
        ..usual
    }
}

/// Ages that take the place of those that follow from the periods [s].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AskedAges {
    /// Odometry of a command that the vehicle follows.
    pub command_s: Option<f64>,
    /// Scan of a learned map from which on physics' younger map is preferred.
    pub learned_s: Option<f64>,
    /// Silence of learning after which physics speaks.
    pub learning_silence_s: Option<f64>,
    /// Mission that has not been repeated.
    pub mission_s: Option<f64>,
    /// Order of somebody who directs the vehicle.
    pub order_s: Option<f64>,
}

impl AskedAges {
    /// Only a command's.
    pub fn of_command(command_s: Option<f64>) -> Self {
        Self { command_s, ..Self::default() }
    }
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

/// The limits that follow from periods, with the guard that control has and the ages that are asked for.
///
/// # Errors
/// A limit that what is regular would exceed, with both numbers.
pub fn limits(periods: &Periods, guard: &GuardConfig, asked: &AskedAges) -> Result<AgeLimits, AgeLimitError> {
    let Periods { control_s, odometry_s, scan_s, mission_s } = *periods;
    // One more of control's deadlines may be missed.
    let command_s = asked.command_s.unwrap_or(COMMAND_S.max(odometry_s + 2.0 * control_s + DELAY_S));
    let silence_s = asked.learning_silence_s.unwrap_or(LEARNING_SILENCE_S.max(2.0 * scan_s));
    let learned_s = asked.learned_s.unwrap_or(LEARNED_S.max(3.0 * scan_s));
    let mission_age_s = asked.mission_s.unwrap_or(2.5 * mission_s);
    let order_s = asked.order_s.unwrap_or(ORDER_S);
    let odometry = format!("odometry every {odometry_s} s");
    let scans = format!("scans every {scan_s} s");
    let maps = format!("{scans} and decisions every {control_s} s");
    let commands = format!("decisions every {control_s} s and {odometry}");
    let missions = format!("missions every {mission_s} s");
    // Physics speaks after the silence of learning, of the next scan, and must have been heard by then.
    let heard_s = (silence_s + scan_s).max(scan_s + control_s);
    let checks = [
        ("guard.odometry_age_max_s", guard.odometry_age_max_s, 2.0 * odometry_s, &odometry),
        ("guard.frozen_max_s", guard.frozen_max_s, 2.0 * odometry_s, &odometry),
        ("guard.odometry_wait_max_s", guard.odometry_wait_max_s, odometry_s, &odometry),
        ("guard.scan_age_max_s", guard.scan_age_max_s, heard_s, &maps),
        ("ages.command_s (--command-age)", command_s, odometry_s + control_s, &commands),
        ("ages.learned_s", learned_s, scan_s, &scans),
        ("ages.learning_silence_s", silence_s, scan_s, &scans),
        ("ages.mission_s", mission_age_s, mission_s, &missions),
        ("ages.order_s", order_s, DELAY_S, &"messages on their way".to_owned()),
    ];
    // What is no number is above nothing.
    let refused = checks
        .into_iter()
        .find(|(_, found_s, least_s, _)| found_s.partial_cmp(least_s) != Some(Ordering::Greater));
    if let Some((setting, found_s, least_s, because)) = refused {
        return Err(AgeLimitError { setting, least_s, because: because.clone(), found_s });
    }
    Ok(AgeLimits {
        command_ns: clock::nanoseconds(command_s),
        scan_ns: clock::nanoseconds(guard.scan_age_max_s),
        learned_ns: clock::nanoseconds(learned_s),
        learning_silence_ns: clock::nanoseconds(silence_s),
        mission_ns: clock::nanoseconds(mission_age_s),
        order_ns: clock::nanoseconds(order_s),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use bicycle::Odometry;
    use navigator::{Config, Surface, Surveyor, Whereabouts};

    fn limits(periods: &Periods, command_age_max_s: Option<f64>) -> Result<AgeLimits, AgeLimitError> {
        super::limits(periods, &guard(periods), &AskedAges::of_command(command_age_max_s))
    }

    #[test]
    fn limits_of_the_usual_periods_are_those_of_the_documentation() {
        let periods = Periods::default();
        assert_eq!(guard(&periods), GuardConfig::default());
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
                    let guard = guard(&periods);
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
        let guard = guard(&Periods { odometry_s: 0.2, scan_s: 0.4, ..Periods::default() });
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
            "ages.command_s (--command-age): expected more than 1.020 s with decisions every 1 s and odometry every 0.02 s, found 0.3 s"
        );
        let rare = Periods { scan_s: 0.5, ..Periods::default() };
        let told =
            super::limits(&rare, &GuardConfig::default(), &AskedAges::default()).unwrap_err().to_string();
        assert_eq!(
            told,
            "guard.scan_age_max_s: expected more than 1.500 s with scans every 0.5 s and decisions every 0.1 s, found 1 s"
        );
        let seldom = Periods { odometry_s: 0.2, ..Periods::default() };
        let told = super::limits(&seldom, &GuardConfig::default(), &AskedAges::default()).unwrap_err();
        assert_eq!((told.setting, told.least_s), ("guard.odometry_age_max_s", 0.4));
        assert!(limits(&Periods::default(), Some(f64::NAN)).is_err());
    }
}
