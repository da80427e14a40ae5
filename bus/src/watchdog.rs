//! The last word before the actuators: a command counts for as long as what it was decided on, and then the vehicle
//! stops.

use bicycle::{Applied, AppliedBy, Command, Decision, HoldReason, Limits, StopReason};

use crate::ages::AgeLimits;
use crate::message::CommandRecord;

/// Keeps the last command and knows when it is too old.
#[derive(Clone, Debug)]
pub struct Watchdog {
    limits: Limits,
    ages: AgeLimits,
    last: Option<Held>,
    /// Whether a command has come since that the vehicle could not carry out.
    has_refused: bool,
    n_refused: u64,
    applied: Applied,
}

/// A command that is followed for now.
#[derive(Clone, Copy, Debug)]
struct Held {
    decision: Decision,
    /// When what it says was true [ns].
    of_ns: u64,
    /// Last moment at which it counts [ns].
    until_ns: u64,
}

impl Watchdog {
    /// A watchdog of a vehicle, for commands that were decided on nothing older.
    pub fn new(limits: Limits, ages: AgeLimits) -> Self {
        let applied = Applied { command: Command::default(), since_ns: 0, by: AppliedBy::Vehicle };
        Self { limits, ages, last: None, has_refused: false, n_refused: 0, applied }
    }

    /// Takes over a command that was sent at this time; one that the vehicle cannot carry out counts as none.
    ///
    /// A command to drive is as old as the odometry and the scan that it was decided on, however late it comes: whoever
    /// paused between deciding and sending revives nothing. To stand is never wrong, and is as old as its message.
    pub fn admit(&mut self, command: &CommandRecord, sent_at_ns: u64) {
        let Some(decision) = command.decision().filter(|decision| is_possible(&self.limits, decision)) else {
            self.n_refused += 1;
            self.has_refused = true;
            return;
        };
        self.has_refused = false;
        let AgeLimits { command_ns, scan_ns, .. } = self.ages;
        let CommandRecord { odometry_at_ns, scan_at_ns, .. } = *command;
        let held = |of_ns: u64, until_ns: u64| Held { decision, of_ns, until_ns };
        self.last = Some(match decision {
            Decision::Drive(_) => held(
                odometry_at_ns,
                odometry_at_ns.saturating_add(command_ns).min(scan_at_ns.saturating_add(scan_ns)),
            ),
            Decision::Hold(_) | Decision::Stop(_) => held(sent_at_ns, sent_at_ns.saturating_add(command_ns)),
        });
    }

    /// What the vehicle is to do now.
    pub fn decision(&self, now_ns: u64) -> Decision {
        match self.last {
            None => Decision::Hold(HoldReason::NoMap),
            Some(held) if now_ns > held.until_ns => Decision::Stop(StopReason::StaleCommand),
            Some(held) => held.decision,
        }
    }

    /// The same, for whoever hands it to the actuators: from now on [`Watchdog::applied`] tells of it.
    pub fn carry_out(&mut self, now_ns: u64) -> Decision {
        let decision = self.decision(now_ns);
        let command = decision.command(self.applied.command);
        let follows = self.last.is_some_and(|held| now_ns <= held.until_ns) && !self.has_refused;
        let by = if follows { AppliedBy::Command } else { AppliedBy::Vehicle };
        if (command, by) != (self.applied.command, self.applied.by) {
            self.applied = Applied { command, since_ns: now_ns, by };
        }
        decision
    }

    /// What the actuators were told last, to be said with what is measured next.
    pub fn applied(&self) -> &Applied {
        &self.applied
    }

    /// Age of what the last command was decided on [ns]; `None` before the first.
    pub fn age_ns(&self, now_ns: u64) -> Option<u64> {
        self.last.map(|held| now_ns.saturating_sub(held.of_ns))
    }

    /// Commands that the vehicle could not have carried out.
    pub fn n_refused(&self) -> u64 {
        self.n_refused
    }
}

/// Whether a vehicle of these limits can carry out a decision. To stand it always can.
pub fn is_possible(limits: &Limits, decision: &Decision) -> bool {
    let Decision::Drive(command) = decision else { return true };
    let (speed_mps, steering_rad) = (f64::from(command.speed_mps), f64::from(command.steering_rad));
    // Single precision may round a command at the limit just beyond it; what is no number is never within.
    let slack = 1.0 + 1e-6;
    speed_mps <= slack * limits.speed_max_mps
        && speed_mps >= -slack * limits.reverse_speed_max_mps
        && steering_rad.abs() <= slack * limits.steering_max_rad
}

#[cfg(test)]
mod tests {
    use super::*;
    use AppliedBy::{Command as Commanded, Vehicle};

    const COMMAND_NS: u64 = 300;
    const SCAN_NS: u64 = 1000;

    fn watchdog() -> Watchdog {
        let limits = Limits {
            speed_max_mps: 2.0,
            reverse_speed_max_mps: 0.5,
            steering_max_rad: 0.4,
            steering_rate_max_radps: 1.0,
            acceleration_max_mps2: 2.0,
            lateral_acceleration_max_mps2: 3.0,
            roll_max_rad: 0.5,
            pitch_max_rad: 0.5,
        };
        let ages = AgeLimits {
            command_ns: COMMAND_NS,
            scan_ns: SCAN_NS,
            learned_ns: 0,
            learning_silence_ns: 0,
            mission_ns: 0,
            order_ns: 0,
        };
        Watchdog::new(limits, ages)
    }

    fn drive(speed_mps: f32, steering_rad: f32) -> Decision {
        Decision::Drive(Command { speed_mps, steering_rad })
    }

    fn command(decision: Decision, [odometry_at_ns, scan_at_ns]: [u64; 2]) -> CommandRecord {
        CommandRecord::from(&decision).decided_on(odometry_at_ns, scan_at_ns)
    }

    const STALE: Decision = Decision::Stop(StopReason::StaleCommand);

    #[test]
    fn a_command_is_as_old_as_the_odometry_that_it_was_decided_on() {
        let mut watchdog = watchdog();
        assert_eq!(watchdog.decision(9), Decision::Hold(HoldReason::NoMap));
        watchdog.admit(&command(drive(1.0, 0.1), [1000, 1000]), 1010);
        assert_eq!(watchdog.decision(1000 + COMMAND_NS), drive(1.0, 0.1));
        assert_eq!(watchdog.decision(1001 + COMMAND_NS), STALE);
        watchdog.admit(&command(drive(0.5, 0.0), [2000, 1900]), 2010);
        assert_eq!(watchdog.decision(2011), drive(0.5, 0.0), "a new command drives on");
    }

    #[test]
    fn whoever_pauses_between_deciding_and_sending_revives_nothing() {
        let mut watchdog = watchdog();
        watchdog.admit(&command(drive(1.0, 0.0), [1000, 900]), 5000);
        assert_eq!((watchdog.decision(5000), watchdog.age_ns(5000)), (STALE, Some(4000)));
        // Half of its time has passed before it was sent: the other half is left.
        watchdog.admit(&command(drive(1.0, 0.0), [6000, 5900]), 6150);
        assert_eq!(watchdog.decision(6300), drive(1.0, 0.0));
        assert_eq!(watchdog.decision(6301), STALE);
    }

    #[test]
    fn a_command_is_no_younger_than_its_scan() {
        let mut watchdog = watchdog();
        watchdog.admit(&command(drive(1.0, 0.0), [2000, 1100]), 2010);
        assert_eq!(watchdog.decision(1100 + SCAN_NS), drive(1.0, 0.0));
        assert_eq!(watchdog.decision(1101 + SCAN_NS), STALE);
        // Decided on nothing at all.
        watchdog.admit(&command(drive(1.0, 0.0), [0, 0]), 3000);
        assert_eq!(watchdog.decision(3000), STALE);
    }

    #[test]
    fn to_stand_needs_nothing_to_be_decided_on() {
        let mut watchdog = watchdog();
        let hold = Decision::Hold(HoldReason::NoMap);
        watchdog.admit(&command(hold, [0, 0]), 1000);
        assert_eq!(watchdog.decision(1000 + COMMAND_NS), hold);
        assert_eq!(watchdog.decision(1001 + COMMAND_NS), STALE, "nobody is in control any more");
    }

    #[test]
    fn what_is_applied_is_told_with_who_decided_it_and_since_when() {
        let mut watchdog = watchdog();
        let mut applied = |now_ns: u64, commands: &[(Decision, u64)]| {
            commands.iter().for_each(|(decision, at_ns)| {
                watchdog.admit(&command(*decision, [*at_ns, *at_ns]), *at_ns);
            });
            watchdog.carry_out(now_ns);
            let Applied { command: Command { speed_mps, steering_rad }, since_ns, by } = *watchdog.applied();
            (speed_mps, steering_rad, since_ns, by)
        };
        assert_eq!(applied(990, &[]), (0.0, 0.0, 0, Vehicle), "nobody has commanded anything");
        assert_eq!(applied(1010, &[(drive(1.0, 0.1), 1000)]), (1.0, 0.1, 1010, Commanded));
        assert_eq!(applied(1110, &[(drive(1.0, 0.1), 1100)]), (1.0, 0.1, 1010, Commanded), "the same again");
        assert_eq!(applied(1390, &[]), (1.0, 0.1, 1010, Commanded));
        assert_eq!(applied(1410, &[]), (0.0, 0.1, 1410, Vehicle), "nobody goes on commanding");
        assert_eq!(applied(1430, &[]), (0.0, 0.1, 1410, Vehicle));
        let stop = Decision::Stop(StopReason::StaleScan);
        assert_eq!(applied(1510, &[(stop, 1500)]), (0.0, 0.1, 1510, Commanded), "to stop is a command, too");
        assert_eq!(applied(1610, &[(drive(0.5, 0.0), 1600)]), (0.5, 0.0, 1610, Commanded));
        let wild = drive(9.0, 0.0);
        assert_eq!(applied(1710, &[(wild, 1700)]), (0.5, 0.0, 1710, Vehicle), "not what came last");
        assert_eq!(applied(1810, &[(drive(0.5, 0.0), 1800)]), (0.5, 0.0, 1810, Commanded));
    }

    #[test]
    fn what_the_vehicle_cannot_do_keeps_nothing_alive() {
        let mut watchdog = watchdog();
        watchdog.admit(&command(drive(2.0, -0.4), [1000, 1000]), 1000);
        for wild in [drive(2.1, 0.0), drive(-0.6, 0.0), drive(1.0, 0.5), drive(f32::NAN, 0.0)] {
            watchdog.admit(&command(wild, [1200, 1200]), 1200);
        }
        assert_eq!((watchdog.n_refused(), watchdog.decision(1200)), (4, drive(2.0, -0.4)));
        assert_eq!(watchdog.decision(1301), STALE);
    }
}
