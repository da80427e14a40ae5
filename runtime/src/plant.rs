//! The simulated vehicle as a process: it measures, carries out the last command, and stops when commands end.

use bicycle::{Decision, Vehicle};
use scenarios::{Episode, EpisodeConfig, Observation, Outcome, Task};

use crate::RuntimeError;
use crate::channel::{Bus, COMMAND, Inlet, MISSION, ODOMETRY, Outlet, SCAN};
use crate::clock::{self, Cycle, SECOND_NS};
use crate::message::{CommandRecord, MissionRecord, OdometryRecord, PointRecord, ScanHeader, Stamp};
use crate::status::{Health, Jumps, Meter, Role};
use crate::watchdog::Watchdog;

/// Returns of a sweep at the most.
pub const POINTS_MAX: usize = 1 << 16;
/// Odometry and commands per second [Hz].
const RATE_HZ: f64 = 50.0;
/// Sweeps of the range sensor per second [Hz].
const SCAN_HZ: f64 = 5.0;
/// The world does not wait: a plant that is late catches up, from no further back than this [ns].
const BEHIND_MAX_NS: u64 = SECOND_NS / 4;

/// What is simulated.
pub struct PlantSetup<'a> {
    /// Where, from where, where to.
    pub task: Task,
    /// The machine.
    pub vehicle: &'a Vehicle,
    /// Sensors and rules; the rates are the plant's own.
    pub episode: EpisodeConfig,
    /// Decides the sensors' noise.
    pub seed: u64,
    /// Age up to which a command counts [s].
    pub command_age_max_s: f64,
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
    /// How often mapping made out a jump of the localisation.
    pub n_jumps: u64,
}

/// Drives until the episode ends or `is_over` says so.
pub fn run(
    bus: &Bus,
    setup: PlantSetup<'_>,
    is_over: &dyn Fn() -> bool,
) -> Result<PlantReport, RuntimeError> {
    let mut plant = Plant::new(bus, setup)?;
    while plant.episode.outcome().is_none() && !is_over() {
        plant.cycle()?;
    }
    plant.tell_mission()?;
    Ok(plant.report())
}

struct Plant {
    episode: Episode,
    began_ns: u64,
    cycle: Cycle,
    watchdog: Watchdog,
    n_stopped_by_watchdog: u64,
    jumps: Jumps,
    told_mission_at_ns: Option<u64>,
    commands: Inlet<Stamp, CommandRecord>,
    odometry: Outlet<Stamp, OdometryRecord>,
    scans: Outlet<ScanHeader, PointRecord>,
    missions: Outlet<Stamp, MissionRecord>,
    meter: Meter,
}

impl Plant {
    fn new(bus: &Bus, setup: PlantSetup<'_>) -> Result<Self, RuntimeError> {
        let PlantSetup { task, vehicle, mut episode, seed, command_age_max_s } = setup;
        episode.control_hz = RATE_HZ;
        episode.cycles_per_scan = (RATE_HZ / SCAN_HZ) as u64;
        let episode = Episode::new(task, vehicle, episode, seed)?;
        let cycle_ns = clock::nanoseconds(episode.cycle_s());
        let (commands, meter) = (bus.inlet(&COMMAND)?, Meter::new(bus, Role::Plant)?);
        let (odometry, scans, missions) =
            (bus.outlet(&ODOMETRY, 1)?, bus.outlet(&SCAN, POINTS_MAX)?, bus.outlet(&MISSION, 1)?);
        let began_ns = clock::now_ns();
        Ok(Self {
            episode,
            began_ns,
            cycle: Cycle::new(began_ns, cycle_ns),
            watchdog: Watchdog::new(vehicle.limits, clock::nanoseconds(command_age_max_s)),
            n_stopped_by_watchdog: 0,
            jumps: Jumps::new(bus)?,
            told_mission_at_ns: None,
            commands,
            odometry,
            scans,
            missions,
            meter,
        })
    }

    /// Measures at the cycle's time, then drives on to the next.
    fn cycle(&mut self) -> Result<(), RuntimeError> {
        let due_ns = self.cycle.deadline_ns();
        let now_ns = clock::sleep_until(due_ns);
        self.meter.count(now_ns - due_ns);
        self.measure()?;
        self.commands.poll(|header, commands| {
            if let Some(decision) = commands.first().and_then(CommandRecord::decision) {
                self.watchdog.admit(decision, header.published_at_ns);
            }
        });
        self.jumps.listen();
        let decision = self.watchdog.decision(clock::now_ns());
        if decision == Decision::Stop(bicycle::StopReason::StaleCommand) {
            self.n_stopped_by_watchdog += 1;
        }
        self.episode.apply(&decision)?;
        if self.told_mission_at_ns.is_none_or(|at_ns| now_ns.saturating_sub(at_ns) >= SECOND_NS) {
            self.told_mission_at_ns = Some(now_ns);
            self.tell_mission()?;
        }
        self.keep_pace();
        let age_s = self.watchdog.age_ns(now_ns).map_or(-1.0, |age_ns| age_ns as f64 * 1e-9);
        let n_missed = self.cycle.n_missed();
        let health = Health { age_s: [age_s, -1.0, -1.0], n_missed, ..Health::default() };
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

    fn measure(&mut self) -> Result<(), RuntimeError> {
        let at_ns = self.at_ns();
        let Observation { odometry, scan, .. } = self.episode.observe();
        self.odometry.send_one(Stamp::default(), OdometryRecord::from(odometry), at_ns)?;
        let Some(scan) = scan else { return Ok(()) };
        let n_points = scan.points.len().min(self.scans.n_max());
        let mut loan = self.scans.write(n_points, |place| PointRecord::from(&scan.points[place]))?;
        loan.header_mut().origin_m = scan.origin_m;
        self.scans.send(loan, at_ns)?;
        Ok(())
    }

    fn tell_mission(&mut self) -> Result<(), RuntimeError> {
        let task = self.episode.task();
        let record = MissionRecord {
            goal_m: task.goal_m,
            tolerance_m: task.goal_tolerance_m,
            time_s: self.episode.time_s(),
            outcome: self.episode.outcome().map_or(0, |outcome| outcome as u64 + 1),
        };
        self.missions.send_one(Stamp::default(), record, clock::now_ns())?;
        Ok(())
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
