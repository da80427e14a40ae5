//! A robot's own driver that can be told to misbehave: measurements and time stamps that no vehicle should be driven by.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

use bicycle::{Applied, AppliedBy};
use bicycle::{Command, Decision, Odometry};
use bus::channel::{Bus, COMMAND, Inlet, MISSION, ODOMETRY, Outlet, RunName, SCAN};
use bus::clock::{nanoseconds, now_ns, sleep_until};
use bus::message::{CommandRecord, MissionRecord, OdometryRecord, PointRecord, ScanHeader, Stamp};
use bus::watchdog::Watchdog;
use navigator::Jump;
use scenarios::Episode;
use simulator::POINTS_MAX;
use terrain::Scan;

use crate::fixture::{ages, episode_config, machine, task};

/// What is wrong with what it sends.
#[derive(Clone, Copy, Debug, Default)]
pub struct Misbehaviour {
    /// The localisation has corrected itself by so much, east and north [m].
    pub offset_m: [f64; 2],
    /// And its heading by so much, about the map's origin [rad].
    pub turn_rad: f64,
    /// Odometry comes ten times a second, in cycles in which no scan does.
    pub is_sparse: bool,
    /// Its clock is ahead by so much [ns].
    pub ahead_ns: i64,
    /// The localisation repeats its last word.
    pub is_frozen: bool,
    /// The yaw rate is no number.
    pub is_not_a_number: bool,
    /// An operator holds it where it is, whatever is commanded.
    pub is_held: bool,
    /// What becomes of the mission.
    pub mission: MissionFate,
}

/// What becomes of a mission.
#[derive(Clone, Copy, Debug, Default)]
pub enum MissionFate {
    /// It is said again once a second.
    #[default]
    UnderWay,
    /// Nobody says anything more.
    Lost,
    /// It is said to be over.
    Over,
}

/// The driver, on a thread of its own; it ends with this.
pub struct Driver {
    behaviour: Arc<Mutex<Misbehaviour>>,
    is_over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Driver {
    /// Drives the vehicle of the fixture.
    pub fn start(run: &RunName) -> Self {
        let behaviour = Arc::new(Mutex::new(Misbehaviour::default()));
        let is_over = Arc::new(AtomicBool::new(false));
        let (run, told, ends) = (run.clone(), Arc::clone(&behaviour), Arc::clone(&is_over));
        let thread = std::thread::spawn(move || {
            let mut robot = Robot::new(&run);
            while !ends.load(Ordering::Relaxed) {
                let behaviour = *told.lock().unwrap();
                robot.cycle(&behaviour);
            }
        });
        Self { behaviour, is_over, thread: Some(thread) }
    }

    /// Behaves like this from the next cycle on.
    pub fn behave(&self, behaviour: Misbehaviour) {
        *self.behaviour.lock().unwrap() = behaviour;
    }
}

impl Drop for Driver {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            drop(thread.join());
        }
    }
}

struct Robot {
    episode: Episode,
    began_ns: u64,
    watchdog: Watchdog,
    applied: Applied,
    told: Odometry,
    commands: Inlet<Stamp, CommandRecord>,
    odometry: Outlet<Stamp, OdometryRecord>,
    scans: Outlet<ScanHeader, PointRecord>,
    missions: Outlet<Stamp, MissionRecord>,
    _bus: Bus,
}

impl Robot {
    fn new(run: &RunName) -> Self {
        let bus = Bus::join(run).unwrap();
        let (vehicle, _) = machine();
        let mut config = episode_config(&vehicle);
        (config.control_hz, config.cycles_per_scan) = (50.0, 10);
        let episode = Episode::new(task(), &vehicle, config, 1).unwrap();
        let watchdog = Watchdog::new(vehicle.limits, ages());
        Self {
            episode,
            began_ns: now_ns(),
            applied: *watchdog.applied(),
            watchdog,
            told: Odometry::default(),
            commands: bus.inlet(&COMMAND).unwrap(),
            odometry: bus.outlet(&ODOMETRY, 1).unwrap(),
            scans: bus.outlet(&SCAN, POINTS_MAX).unwrap(),
            missions: bus.outlet(&MISSION, 1).unwrap(),
            _bus: bus,
        }
    }

    fn cycle(&mut self, behaviour: &Misbehaviour) {
        let at_ns = self.began_ns + nanoseconds(self.episode.time_s());
        let now_ns = sleep_until(at_ns);
        // What it is late by beyond this is lost time: a measurement says when it was true.
        self.began_ns += now_ns.saturating_sub(at_ns + 50_000_000);
        let stamped_ns = now_ns.min(at_ns + 50_000_000).saturating_add_signed(behaviour.ahead_ns);
        let observation = self.episode.observe().clone();
        if !behaviour.is_frozen {
            self.told = observation.odometry;
            let [east_m, north_m] = behaviour.offset_m;
            let correction = Jump { step_m: [east_m, north_m, 0.0], yaw_rad: behaviour.turn_rad };
            self.told = correction.odometry(&self.told);
        }
        let mut record = OdometryRecord::from(&self.told).with_applied(&self.applied);
        if behaviour.is_not_a_number {
            record.yaw_rate_radps = f64::NAN;
        }
        if !behaviour.is_sparse || self.episode.n_cycles() % 5 == 3 {
            self.odometry.send_one(Stamp::default(), record, stamped_ns).unwrap();
        }
        if let Some(scan) = &observation.scan {
            self.send_scan(scan, stamped_ns);
        }
        if self.episode.n_cycles().is_multiple_of(50) {
            self.send_mission(now_ns, behaviour.mission);
        }
        self.follow_commands(behaviour.is_held);
    }

    fn send_scan(&mut self, scan: &Scan, at_ns: u64) {
        let element = |place: usize| PointRecord::from(&scan.points[place]);
        let mut loan = self.scans.write(scan.points.len(), element).unwrap();
        loan.header_mut().origin_m = scan.origin_m;
        self.scans.send(loan, at_ns).unwrap();
    }

    fn send_mission(&mut self, at_ns: u64, fate: MissionFate) {
        let outcome = match fate {
            MissionFate::UnderWay => 0,
            MissionFate::Over => 7,
            MissionFate::Lost => return,
        };
        let goal_m = self.episode.task().goal_m;
        let mission = MissionRecord { goal_m, tolerance_m: 1.0, outcome, ..MissionRecord::default() };
        self.missions.send_one(Stamp::default(), mission, at_ns).unwrap();
    }

    fn follow_commands(&mut self, is_held: bool) {
        let watchdog = &mut self.watchdog;
        self.commands.poll(|stamp, commands| watchdog.admit(&commands[0], stamp.published_at_ns));
        let commanded = self.watchdog.carry_out(now_ns());
        let held = Applied { since_ns: now_ns(), by: AppliedBy::Vehicle, command: Command::default() };
        let (decision, applied) = match is_held {
            true => (Decision::Drive(held.command), held),
            false => (commanded, *self.watchdog.applied()),
        };
        if (applied.command, applied.by) != (self.applied.command, self.applied.by) {
            self.applied = applied;
        }
        self.episode.apply(&decision).unwrap();
    }
}
