//! The episode: a vehicle, a task and whoever decides, until something ends it.

mod crossing;
mod fault;
mod referee;
mod trace;

use std::ops::ControlFlow;
use std::sync::Arc;

use bicycle::{Command, Decision, ImuSample, Odometry, Vehicle};
use terrain::{Scan, SettingError};

use crate::{
    Collision, CommandError, Deviation, Engine, IMU_PERIOD_NS, Imu, ImuConfig, Motion, OdometryConfig,
    OdometrySensor, Plant, PlantError, RangeSensor, RangeSensorConfig, Task, Walker,
};
pub use crossing::Strike;
pub use fault::{Fault, SensorFault};
pub use referee::{Outcome, Rules};
pub use trace::{TraceRow, drive_log};

use crossing::Crossing;
use referee::{Referee, STANDING_MPS};

/// What the vehicle measures in one control cycle.
#[derive(Clone, Debug, Default)]
pub struct Observation {
    /// When the cycle began, since the start of the episode [ns].
    pub valid_at_ns: u64,
    /// Localisation at that time.
    pub odometry: Odometry,
    /// Inertial samples since the last cycle.
    pub imu: Vec<ImuSample>,
    /// A sweep, when one was finished.
    pub scan: Option<Arc<Scan>>,
}

/// How an episode is run.
#[derive(Clone, Debug)]
pub struct EpisodeConfig {
    /// Control cycles per second [Hz]; the period is rounded to whole inertial samples.
    pub control_hz: f64,
    /// Control cycles per sweep of the range sensor, > 0.
    pub cycles_per_scan: u64,
    /// The range sensor; without one there are no scans.
    pub range_sensor: Option<RangeSensorConfig>,
    /// The localisation.
    pub odometry: OdometryConfig,
    /// The inertial unit.
    pub imu: ImuConfig,
    /// When the episode ends.
    pub rules: Rules,
    /// What goes wrong with the sensors.
    pub faults: Vec<Fault>,
    /// How the machine departs from its description all along.
    pub deviations: Vec<Deviation>,
    /// Who walks about.
    pub walkers: Vec<Walker>,
    /// What simulates the machine.
    pub engine: Engine,
}

impl EpisodeConfig {
    /// 10 Hz control, 5 Hz scans, sensors that fit the machine, the rules of the rock field, no faults, nobody about.
    pub fn for_vehicle(vehicle: &Vehicle) -> Self {
        Self {
            control_hz: 10.0,
            cycles_per_scan: 2,
            range_sensor: Some(RangeSensorConfig::for_vehicle(vehicle)),
            odometry: OdometryConfig::for_length(vehicle.geometry.length_m),
            imu: ImuConfig::for_length(vehicle.geometry.length_m),
            rules: Rules::default(),
            faults: Vec::new(),
            deviations: Vec::new(),
            walkers: Vec::new(),
            engine: Engine::default(),
        }
    }
}

/// Why an episode cannot begin or go on.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EpisodeError {
    /// A rate or rule is out of range.
    #[error("episode {field}: expected {expected}, found {found}")]
    Setting {
        /// Name of the setting.
        field: &'static str,
        /// The range that would do.
        expected: &'static str,
        /// The value that was given.
        found: f64,
    },
    /// The vehicle cannot be put there.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// The sensor cannot be.
    #[error("range sensor {0}")]
    RangeSensor(#[from] SettingError),
    /// The command is no number.
    #[error(transparent)]
    Command(#[from] CommandError),
    /// The simulation left the numbers.
    #[error("the plant's state is no longer finite at {time_s:.3} s")]
    Diverged {
        /// Time since the start [s].
        time_s: f64,
    },
}

/// A drive under way.
pub struct Episode {
    task: Task,
    config: EpisodeConfig,
    plant: Plant,
    range_sensor: Option<RangeSensor>,
    odometry: OdometrySensor,
    imu: Imu,
    referee: Referee,
    crossing: Crossing,
    observation: Observation,
    command: Command,
    trace: Vec<TraceRow>,
    n_cycles: u64,
    samples_per_cycle: u64,
    n_samples: u64,
}

impl Episode {
    /// Puts the vehicle at the start, parked; the first observation is ready.
    pub fn new(
        task: Task,
        vehicle: &Vehicle,
        config: EpisodeConfig,
        seed: u64,
    ) -> Result<Self, EpisodeError> {
        let samples_per_cycle = samples_per_cycle(&config)?;
        let world = Arc::clone(&task.world);
        let plant = Plant::in_engine(config.engine, vehicle, &config.deviations, world, task.start)?;
        let range_sensor = match config.range_sensor {
            Some(sensor) => Some(RangeSensor::new(sensor, Arc::clone(&task.world), seed)?),
            None => None,
        };
        let mut episode = Self {
            range_sensor,
            odometry: OdometrySensor::deviating(config.odometry, &config.deviations, seed),
            imu: Imu::new(config.imu, seed),
            referee: Referee::new(config.rules, vehicle.limits),
            crossing: Crossing::new(vehicle, config.walkers.clone()),
            observation: Observation::default(),
            command: Command::default(),
            trace: Vec::new(),
            n_cycles: 0,
            samples_per_cycle,
            n_samples: 0,
            task,
            config,
            plant,
        };
        let motion = episode.plant.motion();
        episode.referee.watch(&episode.task, &motion, &episode.plant, 0.0);
        episode.measure(&motion, Vec::new());
        Ok(episode)
    }

    /// What the vehicle measures now.
    pub fn observe(&self) -> &Observation {
        &self.observation
    }

    /// Follows a decision for one control cycle. A hold or a stop brakes to a standstill with the wheels straight on
    /// as they are. Does nothing once the episode has ended.
    pub fn apply(&mut self, decision: &Decision) -> Result<(), EpisodeError> {
        if self.outcome().is_some() {
            return Ok(());
        }
        self.command = decision.command(self.command);
        self.plant.set_command(self.command)?;
        let mut motion = self.plant.motion();
        self.trace.push(TraceRow {
            time_s: self.time_s(),
            motion,
            command: self.command,
            decision: *decision,
        });
        self.crossing.begin_cycle();
        let mut imu = Vec::with_capacity(self.samples_per_cycle as usize);
        for _ in 0..self.samples_per_cycle {
            motion = self.advance(&mut imu)?;
            if self.outcome().is_some() {
                break;
            }
        }
        self.n_cycles += 1;
        self.referee.judge_cycle(decision, &motion, self.time_s(), self.cycle_s());
        match self.outcome() {
            Some(Outcome::AttitudeLimit) => self.see_what_becomes_of_it()?,
            Some(Outcome::Collision) => self.see_it_stand()?,
            Some(Outcome::WalkerStruck) => self.crossing.judge(&self.task, &self.config, &self.trace)?,
            _ => {}
        }
        self.measure(&motion, imu);
        Ok(())
    }

    /// Runs to the end. `decide` is asked every cycle; `after_cycle` sees the episode after it and may break it off,
    /// which ends it as [`Outcome::Stopped`].
    pub fn run(
        &mut self,
        mut decide: impl FnMut(&Observation) -> Decision,
        mut after_cycle: impl FnMut(&Self) -> ControlFlow<()>,
    ) -> Result<Outcome, EpisodeError> {
        loop {
            if let Some(outcome) = self.outcome() {
                return Ok(outcome);
            }
            let decision = decide(&self.observation);
            self.apply(&decision)?;
            if after_cycle(self).is_break() {
                self.interrupt();
            }
        }
    }

    /// Ends the episode from outside, as [`Outcome::Stopped`]; one that has ended stays as it is.
    pub fn interrupt(&mut self) {
        self.referee.interrupt();
    }

    /// From now on the goal is here [m]; `tolerance_m` counts as there, 0 for a place to be passed through.
    pub fn set_goal(&mut self, goal_m: [f64; 2], tolerance_m: f64) {
        (self.task.goal_m, self.task.goal_tolerance_m) = (goal_m, tolerance_m);
    }

    /// The vehicle is meant to stand just now: it is not stuck, and has not stopped for good.
    pub fn excuse_standing(&mut self) {
        self.referee.excuse_standing();
    }

    /// How the episode ended, if it has.
    pub fn outcome(&self) -> Option<Outcome> {
        self.referee.outcome()
    }

    /// What obstacles did to the vehicle, if it touched one.
    pub fn collision(&self) -> Option<Collision> {
        self.plant.collision()
    }

    /// Whom the vehicle struck, if it did, and whether a stop would have spared him.
    pub fn strike(&self) -> Option<Strike> {
        self.crossing.strike()
    }

    /// How often somebody walked into the standing vehicle.
    pub fn n_walked_into(&self) -> u64 {
        self.crossing.n_walked_into()
    }

    /// Who walks about, as they are now.
    pub fn walkers(&self) -> &[Walker] {
        self.crossing.walkers()
    }

    /// The true motion now.
    pub fn motion(&self) -> Motion {
        self.plant.motion()
    }

    /// The plant itself.
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// What is being driven.
    pub fn task(&self) -> &Task {
        &self.task
    }

    /// Time since the start [s].
    pub fn time_s(&self) -> f64 {
        (self.n_samples * IMU_PERIOD_NS) as f64 * 1e-9
    }

    /// Length of a control cycle [s].
    pub fn cycle_s(&self) -> f64 {
        (self.samples_per_cycle * IMU_PERIOD_NS) as f64 * 1e-9
    }

    /// Number of control cycles so far.
    pub fn n_cycles(&self) -> u64 {
        self.n_cycles
    }

    /// Way of the rear axle's centre so far [m].
    pub fn path_length_m(&self) -> f64 {
        self.referee.path_length_m()
    }

    /// Largest |roll| so far [rad].
    pub fn largest_roll_rad(&self) -> f64 {
        self.referee.largest_roll_rad()
    }

    /// Largest |pitch| so far [rad].
    pub fn largest_pitch_rad(&self) -> f64 {
        self.referee.largest_pitch_rad()
    }

    /// Longest time so far in which no wheel touched the ground [s].
    pub fn longest_flight_s(&self) -> f64 {
        self.referee.longest_flight_s()
    }

    /// True motion and command at the beginning of every cycle so far.
    pub fn trace(&self) -> &[TraceRow] {
        &self.trace
    }

    /// One inertial sample onwards.
    fn advance(&mut self, imu: &mut Vec<ImuSample>) -> Result<Motion, EpisodeError> {
        self.plant.advance(IMU_PERIOD_NS as f64 * 1e-9);
        self.n_samples += 1;
        if !self.plant.is_finite() {
            return Err(EpisodeError::Diverged { time_s: self.time_s() });
        }
        let motion = self.plant.motion();
        imu.push(self.imu.sample(&motion, &self.task.world, self.n_samples * IMU_PERIOD_NS));
        self.referee.watch(&self.task, &motion, &self.plant, self.time_s());
        if self.crossing.advance(&motion, self.time_s()) {
            self.referee.saw_a_strike();
        }
        Ok(motion)
    }

    /// A vehicle beyond its limits may still fall over: it is braked and watched until that is settled.
    fn see_what_becomes_of_it(&mut self) -> Result<(), EpisodeError> {
        self.plant.set_command(Command { speed_mps: 0.0, ..self.command })?;
        let n_samples = (self.config.rules.aftermath_s * 1e9) as u64 / IMU_PERIOD_NS;
        for _ in 0..n_samples {
            self.plant.advance(IMU_PERIOD_NS as f64 * 1e-9);
            if self.plant.rolled_over() {
                self.referee.saw_rolling_over();
                break;
            }
        }
        Ok(())
    }

    /// A vehicle that struck an obstacle is braked and watched until it stands, so that the whole impulse is counted.
    fn see_it_stand(&mut self) -> Result<(), EpisodeError> {
        self.plant.set_command(Command { speed_mps: 0.0, ..self.command })?;
        let n_samples = (self.config.rules.aftermath_s * 1e9) as u64 / IMU_PERIOD_NS;
        for _ in 0..n_samples {
            self.plant.advance(IMU_PERIOD_NS as f64 * 1e-9);
            let [ahead_mps, left_mps, _] = self.plant.motion().velocity_mps;
            if ahead_mps.hypot(left_mps) < STANDING_MPS {
                break;
            }
        }
        Ok(())
    }

    fn measure(&mut self, motion: &Motion, imu: Vec<ImuSample>) {
        let valid_at_ns = self.n_samples * IMU_PERIOD_NS;
        let time_s = self.time_s();
        let last = self.observation.odometry;
        let faults = || self.config.faults.iter().filter(|fault| fault.is_on(time_s));
        let odometry = self.odometry.measure(motion, valid_at_ns);
        let odometry = faults().fold(odometry, |odometry, fault| fault.on_odometry(odometry, &last));
        let number = self.n_cycles / self.config.cycles_per_scan;
        let sensor =
            self.range_sensor.as_ref().filter(|_| self.n_cycles.is_multiple_of(self.config.cycles_per_scan));
        let walkers = self.crossing.walkers();
        let swept = sensor.map(|sensor| sensor.scan_among(walkers, &motion.pose, number, valid_at_ns));
        if let Some((_, n_returns)) = &swept {
            self.crossing.note_sweep(n_returns, motion, self.n_cycles as usize);
        }
        let scan = swept.map(|(scan, _)| scan);
        let scan = faults().fold(scan, |scan, fault| fault.on_scan(scan?));
        self.observation = Observation { valid_at_ns, odometry, imu, scan: scan.map(Arc::new) };
    }
}

fn samples_per_cycle(config: &EpisodeConfig) -> Result<u64, EpisodeError> {
    let refuse = |field, expected, found| Err(EpisodeError::Setting { field, expected, found });
    if !(0.5..=200.0).contains(&config.control_hz) {
        return refuse("control_hz", "from 0.5 to 200 Hz", config.control_hz);
    }
    if config.cycles_per_scan == 0 {
        return refuse("cycles_per_scan", "at least 1", 0.0);
    }
    config.rules.validate()?;
    Ok((1e9 / (config.control_hz * IMU_PERIOD_NS as f64)).round() as u64)
}
