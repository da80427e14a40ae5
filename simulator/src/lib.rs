//! The simulated vehicle as a process: it measures, carries out the last command, and stops when commands end. A part of
//! [Surefoot](../cli/index.html).
//!
//! It is a driver like that of any vehicle: what it knows of the processes that command it is in [`bus`].
//! `examples/command_the_plant.rs` commands it from outside. In [`LockStep`] it waits for whoever commands it.

mod lock_step;
mod sensors;

use bicycle::{Decision, Vehicle};
use scenarios::{Episode, EpisodeConfig, Outcome, Task};

use bus::ages::{AgeLimits, Periods};
use bus::channel::{Bus, COMMAND, Inlet, MISSION};
use bus::clock::{self, Cycle, SECOND_NS};
use bus::message::mission::REACHED;
use bus::message::{CommandRecord, MissionRecord, Stamp, StatusRecord};
use bus::status::{Health, Meter, Role};
use bus::watchdog::Watchdog;
pub use lock_step::{Answer, LockStep, LockStepError, Patience};
pub use sensors::POINTS_MAX;
use sensors::Sensors;

/// The world does not wait: a plant that is late catches up, from no further back than this [ns].
const BEHIND_MAX_NS: u64 = SECOND_NS / 4;

/// Why the simulated vehicle cannot begin or go on. Every message is one line.
#[derive(Debug, thiserror::Error)]
pub enum SimulatorError {
    /// The channels.
    #[error(transparent)]
    Channel(#[from] bus::channel::ChannelError),
    /// The vehicle or its world.
    #[error(transparent)]
    Episode(#[from] scenarios::EpisodeError),
    /// It cannot speak so often.
    #[error(
        "periods: expected a whole number of odometry messages between two scans, found odometry every {odometry_s} s \
         and scans every {scan_s} s"
    )]
    Periods {
        /// Between two odometry messages [s].
        odometry_s: f64,
        /// Between two scans [s].
        scan_s: f64,
    },
}

/// What is simulated.
pub struct PlantSetup<'a> {
    /// Where, from where, where to.
    pub task: Task,
    /// The machine.
    pub vehicle: &'a Vehicle,
    /// Sensors and rules; the rates are those of `periods`.
    pub episode: EpisodeConfig,
    /// Whether it ends where the mission does.
    pub ending: Ending,
    /// Decides the sensors' noise.
    pub seed: u64,
    /// How often it measures.
    pub periods: Periods,
    /// How old what is followed may be.
    pub ages: AgeLimits,
}

/// When a drive ends that nothing else ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// At the last goal of a mission.
    AtGoal,
    /// Not at all: after a mission there may be another.
    Never,
}

/// Speed below which the vehicle stands [m/s].
const STANDING_MPS: f64 = 0.05;
/// Scans are of whole cycles to this, so that periods may be rounded numbers.
const ROUNDING: f64 = 1e-6;

/// Odometry messages from one scan to the next, if that is a whole number.
pub fn cycles_per_scan(periods: &Periods) -> Result<u64, SimulatorError> {
    let Periods { odometry_s, scan_s, .. } = *periods;
    let n = scan_s / odometry_s;
    let is_whole = n >= 1.0 - ROUNDING && (n - n.round()).abs() < ROUNDING * n;
    is_whole.then_some(n.round() as u64).ok_or(SimulatorError::Periods { odometry_s, scan_s })
}

/// How a drive ended, and what the watchdog saw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlantReport {
    /// How it ended; `None` when the process was told to end before.
    pub outcome: Option<Outcome>,
    /// Time since it began [s].
    pub time_s: f64,
    /// Way driven [m].
    pub path_length_m: f64,
    /// Distance left to the goal [m].
    pub distance_to_goal_m: f64,
    /// Cycles in which the watchdog stopped the vehicle.
    pub n_stopped_by_watchdog: u64,
    /// Jumps of the localisation that mapping told of.
    pub n_jumps: u64,
}

/// Drives until the episode ends or `is_over` says so.
pub fn run(
    bus: &Bus,
    setup: PlantSetup<'_>,
    is_over: &dyn Fn() -> bool,
) -> Result<PlantReport, SimulatorError> {
    let mut plant = Plant::new(bus, setup)?;
    while plant.episode.outcome().is_none() && !is_over() {
        plant.cycle()?;
    }
    Ok(plant.report())
}

struct Plant {
    episode: Episode,
    began_ns: u64,
    cycle: Cycle,
    watchdog: Watchdog,
    n_stopped_by_watchdog: u64,
    ending: Ending,
    /// The mission says to drive.
    is_driving: bool,
    /// The mission says that its last goal is reached.
    has_arrived: bool,
    commands: Inlet<Stamp, CommandRecord>,
    sensors: Sensors,
    missions: Inlet<Stamp, MissionRecord>,
    mapping: Inlet<Stamp, StatusRecord>,
    jumps: Jumps,
    meter: Meter,
}

impl Plant {
    fn new(bus: &Bus, setup: PlantSetup<'_>) -> Result<Self, SimulatorError> {
        let PlantSetup { mut task, vehicle, mut episode, ending, seed, periods, ages } = setup;
        // Until the mission says which goal is the last one, none is.
        task.goal_tolerance_m = 0.0;
        episode.control_hz = 1.0 / periods.odometry_s;
        episode.cycles_per_scan = cycles_per_scan(&periods)?;
        let episode = Episode::new(task, vehicle, episode, seed)?;
        let cycle_ns = clock::nanoseconds(episode.cycle_s());
        let (commands, meter) = (bus.inlet(&COMMAND)?, Meter::new(bus, Role::Plant)?);
        let sensors = Sensors::open(bus)?;
        let began_ns = clock::now_ns();
        Ok(Self {
            episode,
            began_ns,
            cycle: Cycle::new(began_ns, cycle_ns),
            watchdog: Watchdog::new(vehicle.limits, ages),
            n_stopped_by_watchdog: 0,
            ending,
            is_driving: false,
            has_arrived: false,
            commands,
            sensors,
            missions: bus.inlet(&MISSION)?,
            mapping: bus.inlet(&Role::Mapping.status())?,
            jumps: Jumps::default(),
            meter,
        })
    }

    /// Measures at the cycle's time, then drives on to the next.
    fn cycle(&mut self) -> Result<(), SimulatorError> {
        let due_ns = self.cycle.deadline_ns();
        let now_ns = clock::sleep_until(due_ns);
        self.meter.count(now_ns - due_ns);
        self.measure()?;
        let watchdog = &mut self.watchdog;
        self.commands.poll(|stamp, commands| {
            commands.iter().for_each(|command| watchdog.admit(command, stamp.published_at_ns));
        });
        let jumps = &mut self.jumps;
        self.mapping.poll(|stamp, told| told.iter().for_each(|status| jumps.note(stamp, status)));
        self.follow_mission();
        let decision = self.watchdog.carry_out(clock::now_ns());
        if decision == Decision::Stop(bicycle::StopReason::StaleCommand) {
            self.n_stopped_by_watchdog += 1;
        }
        self.episode.apply(&decision)?;
        self.keep_pace();
        let age_s = self.watchdog.age_ns(now_ns).map_or(-1.0, |age_ns| age_ns as f64 * 1e-9);
        let n_missed = self.cycle.n_missed();
        let unable = [0, self.watchdog.n_refused(), 0];
        let health =
            Health { age_s: [age_s, -1.0, -1.0, -1.0], n_missed, messages: unable, ..Health::default() };
        let speed_mps = self.episode.motion().velocity_mps[0];
        let counts = self.commands.counts();
        Ok(self.meter.report(now_ns, || Health { figure: speed_mps, ..health }.with(counts))?)
    }

    /// Time of the next cycle. Simulated time keeps to the clock; only what is too far behind is given up, and then
    /// simulated time is moved, so that what is measured stays of the time that it says.
    fn keep_pace(&mut self) {
        let now_ns = clock::now_ns();
        let next_ns = self.at_ns();
        if now_ns.saturating_sub(next_ns) > BEHIND_MAX_NS {
            self.began_ns += now_ns - next_ns;
            self.cycle.advance(now_ns);
        }
        self.cycle.aim_at(self.at_ns());
    }

    /// The episode's time on the clock [ns].
    fn at_ns(&self) -> u64 {
        self.began_ns + clock::nanoseconds(self.episode.time_s())
    }

    fn measure(&mut self) -> Result<(), SimulatorError> {
        let at_ns = self.at_ns();
        let observation = self.episode.observe();
        self.sensors.tell_odometry(observation, self.watchdog.applied(), at_ns)?;
        Ok(self.sensors.tell_surroundings(observation, self.began_ns, at_ns)?)
    }

    /// Whoever is meant to stand is not stuck; the last goal is where the drive ends, whatever the vehicle believes.
    fn follow_mission(&mut self) {
        let Self { missions, episode, ending, is_driving, has_arrived, .. } = self;
        missions.poll(|_, records| {
            for record in records {
                *is_driving = record.is_driving();
                *has_arrived = record.outcome == REACHED && *ending == Ending::AtGoal;
                let MissionRecord { goal_m, tolerance_m, .. } = *record;
                match (*is_driving, *ending) {
                    (true, Ending::AtGoal) => episode.set_goal(goal_m, tolerance_m),
                    (true, Ending::Never) => episode.set_goal(goal_m, 0.0),
                    (false, _) => {}
                }
            }
        });
        if !*is_driving {
            episode.excuse_standing();
        }
        if *has_arrived && episode.motion().velocity_mps[0].abs() < STANDING_MPS {
            episode.interrupt();
        }
    }

    fn report(&self) -> PlantReport {
        let pose = self.episode.motion().pose;
        PlantReport {
            outcome: self.episode.outcome(),
            time_s: self.episode.time_s(),
            path_length_m: self.episode.path_length_m(),
            distance_to_goal_m: self.episode.task().distance_to_goal_m(pose.x_m, pose.y_m),
            n_stopped_by_watchdog: self.n_stopped_by_watchdog,
            n_jumps: self.jumps.n(),
        }
    }
}

/// Jumps of the localisation over the lives of mapping, each of which counts its own.
#[derive(Clone, Copy, Debug, Default)]
struct Jumps {
    n_before: u64,
    life: (u64, u64),
}

impl Jumps {
    fn note(&mut self, stamp: &Stamp, status: &StatusRecord) {
        let (epoch_ns, n) = self.life;
        if epoch_ns != stamp.epoch_ns {
            self.n_before += n;
        }
        self.life = (stamp.epoch_ns, status.figure as u64);
    }

    fn n(&self) -> u64 {
        self.n_before + self.life.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jumps_add_up_over_the_lives_of_mapping() {
        let mut jumps = Jumps::default();
        for (epoch_ns, figure, n) in [(5, 0.0, 0), (5, 2.0, 2), (5, 2.0, 2), (9, 0.0, 2), (9, 1.0, 3)] {
            let stamp = Stamp { epoch_ns, ..Stamp::default() };
            jumps.note(&stamp, &StatusRecord { figure, ..StatusRecord::default() });
            assert_eq!(jumps.n(), n, "{epoch_ns} {figure}");
        }
    }

    #[test]
    fn scans_come_with_every_so_many_odometry_messages_or_are_refused() {
        let of = |odometry_hz: f64, scan_hz: f64| {
            let (odometry_s, scan_s) = (odometry_hz.recip(), scan_hz.recip());
            cycles_per_scan(&Periods { odometry_s, scan_s, ..Periods::default() })
        };
        assert_eq!(of(50.0, 5.0).unwrap(), 10);
        assert_eq!(of(30.0, 10.0).unwrap(), 3);
        assert_eq!(of(20.0, 20.0).unwrap(), 1);
        for (odometry_hz, scan_hz) in [(50.0, 4.0), (5.0, 10.0), (10.0, 20.0)] {
            let told = of(odometry_hz, scan_hz).unwrap_err().to_string();
            assert!(told.contains("expected a whole number") && told.contains("found odometry"), "{told}");
        }
    }
}
