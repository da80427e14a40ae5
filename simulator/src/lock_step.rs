//! The simulated vehicle in lock-step with whoever commands it: a cycle is a cycle of simulated time, however long the
//! command takes.

use std::time::Duration;

use bicycle::{Applied, AppliedBy, Command, Decision, Limits};
use bus::channel::{Bus, COMMAND, ChannelError, Counts, Inlet, MISSION, Outlet, Refusal};
use bus::clock::{self, SECOND_NS};
use bus::message::{CommandRecord, MissionRecord, Stamp};
use bus::watchdog;
use scenarios::{Episode, EpisodeError};

use crate::sensors::Sensors;

/// Time between two looks for a command [ns].
const LOOK_NS: u64 = SECOND_NS / 10_000;

/// What a planner decided in a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// The decision, which the vehicle followed.
    pub decision: Decision,
    /// From the end of what it was told to the command, by the machine's clock.
    pub took: Duration,
}

/// How long a planner is waited for.
pub struct Patience<'a> {
    /// For each command, by the machine's clock.
    pub limit: Duration,
    /// Whether nobody is there any more who could answer.
    pub is_gone: &'a dyn Fn() -> bool,
}

/// Why a drive in lock-step cannot begin or go on. Every message is one line.
#[derive(Debug, thiserror::Error)]
pub enum LockStepError {
    /// The channels.
    #[error(transparent)]
    Channel(#[from] ChannelError),
    /// The vehicle or its world.
    #[error(transparent)]
    Episode(#[from] EpisodeError),
    /// No command came in time.
    #[error("at {time_s:.1} s: expected a command within {limit_s} s, found {found}")]
    Silent {
        /// Simulated time of the drive [s].
        time_s: f64,
        /// How long it was waited for [s].
        limit_s: f64,
        /// What came instead.
        found: &'static str,
    },
    /// Nobody is there any more.
    #[error("at {time_s:.1} s: expected a command, found that the planner ended")]
    Gone {
        /// Simulated time of the drive [s].
        time_s: f64,
    },
    /// The message was none.
    #[error("at {time_s:.1} s: expected a command, found a message {found}")]
    Refused {
        /// Simulated time of the drive [s].
        time_s: f64,
        /// What was wrong with it.
        found: &'static str,
    },
    /// The vehicle cannot do that.
    #[error(
        "at {time_s:.1} s: expected {}, found {} m/s and {} rad", within(.limits), .command.speed_mps, .command.steering_rad
    )]
    Impossible {
        /// Simulated time of the drive [s].
        time_s: f64,
        /// What was asked for.
        command: Command,
        /// What the vehicle can do.
        limits: Limits,
    },
}

/// The vehicle's side of a run in lock-step, drive after drive.
///
/// Each cycle says inertial samples, a scan where one was finished, the mission, and last the odometry; then it waits for
/// the command that names this odometry's time. Stamps are of simulated time, which goes on from drive to drive and began
/// with the machine's clock, so that it stays in the past of that clock. A drive has a mission number of its own.
pub struct LockStep {
    sensors: Sensors,
    missions: Outlet<Stamp, MissionRecord>,
    commands: Inlet<Stamp, CommandRecord>,
    limits: Limits,
    n_drives: u64,
    next_ns: u64,
}

impl LockStep {
    /// The vehicle of a run, with limits that no command may exceed.
    ///
    /// # Errors
    /// Another process has the vehicle.
    pub fn new(bus: &Bus, limits: Limits) -> Result<Self, ChannelError> {
        let (commands, missions) = (bus.inlet(&COMMAND)?, bus.outlet(&MISSION, 1)?);
        // Time 0 is that of no message.
        Ok(Self { sensors: Sensors::open(bus)?, missions, commands, limits, n_drives: 0, next_ns: SECOND_NS })
    }

    /// Whether somebody is there to command: who is opens the channel of commands after those that it listens to.
    pub fn has_planner(&self) -> bool {
        self.commands.has_publisher()
    }

    /// Drives an episode to its end.
    ///
    /// # Errors
    /// The planner does not answer in time, or what it answers cannot be; the plant left the numbers.
    pub fn drive(
        &mut self,
        episode: &mut Episode,
        patience: &Patience<'_>,
    ) -> Result<Vec<Answer>, LockStepError> {
        let (mut answers, began_ns) = (Vec::new(), self.next_ns);
        let mut applied = Applied { command: Command::default(), since_ns: began_ns, by: AppliedBy::Vehicle };
        self.n_drives += 1;
        while episode.outcome().is_none() {
            let at_ns = began_ns + episode.observe().valid_at_ns;
            self.next_ns = at_ns + SECOND_NS;
            self.tell(episode, began_ns, &applied)?;
            let answer = self.answer(at_ns, episode.time_s(), patience)?;
            let command = answer.decision.command(applied.command);
            if (command, AppliedBy::Command) != (applied.command, applied.by) {
                applied = Applied { command, since_ns: at_ns, by: AppliedBy::Command };
            }
            episode.apply(&answer.decision)?;
            answers.push(answer);
        }
        Ok(answers)
    }

    /// Says what the vehicle measures and where to go; the odometry last, so that all of it has come with that.
    fn tell(&mut self, episode: &Episode, began_ns: u64, applied: &Applied) -> Result<(), ChannelError> {
        let (observation, task) = (episode.observe(), episode.task());
        let at_ns = began_ns + observation.valid_at_ns;
        // No reader takes what is of the future: a machine that has hardly been up is waited for.
        clock::sleep_until(at_ns);
        self.sensors.tell_surroundings(observation, began_ns, at_ns)?;
        let mission = MissionRecord {
            goal_m: task.goal_m,
            tolerance_m: task.goal_tolerance_m,
            time_s: episode.time_s(),
            number: self.n_drives,
            n_legs: 1,
            ..MissionRecord::default()
        };
        self.missions.send_one(Stamp::default(), mission, at_ns)?;
        self.sensors.tell_odometry(observation, applied, at_ns)
    }

    /// Waits for the command that was decided on the odometry of this time.
    fn answer(&mut self, at_ns: u64, time_s: f64, patience: &Patience<'_>) -> Result<Answer, LockStepError> {
        let (told_ns, mut found) = (clock::now_ns(), "none");
        loop {
            let heard = self.hear(at_ns, time_s)?;
            let took = Duration::from_nanos(clock::now_ns() - told_ns);
            match heard {
                Heard::Command(decision) => {
                    return Ok(Answer { decision: self.possible(decision, time_s)?, took });
                }
                Heard::Other => found = "only such as were decided on the odometry of another time",
                Heard::Nothing => {}
            }
            if (patience.is_gone)() {
                return Err(LockStepError::Gone { time_s });
            }
            if took > patience.limit {
                return Err(LockStepError::Silent { time_s, limit_s: patience.limit.as_secs_f64(), found });
            }
            clock::sleep_until(clock::now_ns() + LOOK_NS);
        }
    }

    /// What has been commanded since the last look.
    fn hear(&mut self, at_ns: u64, time_s: f64) -> Result<Heard, LockStepError> {
        let (before, mut heard) = (*self.commands.counts(), Heard::Nothing);
        self.commands.poll(|_, records| {
            // The channel has checked that there is one, and that it is a decision.
            let Some(record) = records.first() else { return };
            heard = match (heard, record.decision()) {
                (Heard::Command(first), _) => Heard::Command(first),
                (_, Some(decision)) if record.odometry_at_ns == at_ns => Heard::Command(decision),
                _ => Heard::Other,
            };
        });
        match why_refused(&before, self.commands.counts()) {
            Some(found) => Err(LockStepError::Refused { time_s, found }),
            None => Ok(heard),
        }
    }

    fn possible(&self, decision: Decision, time_s: f64) -> Result<Decision, LockStepError> {
        match decision {
            Decision::Drive(command) if !watchdog::is_possible(&self.limits, &decision) => {
                Err(LockStepError::Impossible { time_s, command, limits: self.limits })
            }
            decision => Ok(decision),
        }
    }
}

/// What a command may be, in words.
fn within(limits: &Limits) -> String {
    let Limits { speed_max_mps, reverse_speed_max_mps, steering_max_rad, .. } = limits;
    format!(
        "a speed from -{reverse_speed_max_mps} to {speed_max_mps} m/s and a steering angle within {steering_max_rad} rad"
    )
}

/// What a look at the channel of commands found.
#[derive(Clone, Copy)]
enum Heard {
    Nothing,
    /// A command that was decided on the odometry of another time.
    Other,
    Command(Decision),
}

/// In words, for what a message was refused between two looks, if any was.
fn why_refused(before: &Counts, after: &Counts) -> Option<&'static str> {
    let refusal = Refusal::ALL.into_iter().find(|refusal| after.of(*refusal) > before.of(*refusal))?;
    Some(match refusal {
        Refusal::LayoutVersion => "of another version of the layouts",
        Refusal::Malformed => "of sizes or numbers that cannot be",
        Refusal::NonFinite => "with a number that is not finite",
        Refusal::FromFuture => "from the future",
        Refusal::OutOfOrder => "out of order",
        Refusal::OtherPublisher => "of a publisher that another one has replaced",
    })
}
