//! One run: the controller over the map of what it expects, the plant on the ground as it is.

use bicycle::{SkidSteer, SkidSteerCommand, SkidSteerLimits, SkidSteerState};
use mppi::{
    Actuation, Config, ConfigError, Controller, Costs, Input, Isa, Objective, Recovery, SampleSpace,
    Sampling, Temperature, Terminal,
};
use traversability::CvarLevel;

use super::belief::{Method, risk_map};
use super::world::{GOAL_M, START, World};

/// Length of a step, of the plan as of the plant [s].
pub const STEP_S: f64 = 0.1;
/// Steps after which a run has failed.
pub const MOST_STEPS: u64 = 150;
/// Distance at which the goal counts as reached [m].
pub const TOLERANCE_M: f64 = 0.5;

/// A run to be done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Job {
    pub density: f64,
    pub level: CvarLevel,
    pub method: Method,
    /// Decides the world and the samples.
    pub seed: u64,
}

impl Job {
    /// Time to the goal [s]; `None` if it was not reached.
    pub(super) fn drive(&self, isa: Isa) -> Result<Option<f64>, ConfigError> {
        let world = World::new(self.density, self.seed);
        let map = risk_map(&world, self.method, self.level);
        let mut controller = Controller::new(config(isa), model(), self.seed)?;
        let objective =
            Objective::Goal { goal_m: GOAL_M, tolerance_m: TOLERANCE_M, terminal: Terminal::StraightLine };
        let (mut pose, mut command) = (START, SkidSteerCommand::default());
        for cycle in 0..MOST_STEPS {
            let elapsed_s = if cycle == 0 { 0.0 } else { STEP_S };
            let state = state_of(pose, command);
            let input = Input { state, elapsed_s, map: map.view(), objective, cycle };
            command = controller.decide(&input).command(SkidSteerCommand::default());
            pose = step(pose, command, world.traction_at([pose[0], pose[1]]));
            if (pose[0] - GOAL_M[0]).hypot(pose[1] - GOAL_M[1]) <= TOLERANCE_M {
                return Ok(Some((cycle + 1) as f64 * STEP_S));
            }
        }
        Ok(None)
    }
}

/// A step of the plant: the unicycle whose speed and yaw rate the ground lets through by their shares (Cai et al.,
/// EVORA), by Euler's rule. Pose: east, north [m] and yaw [rad]; traction: linear and angular [-].
pub fn step(
    [x_m, y_m, yaw_rad]: [f64; 3],
    command: SkidSteerCommand,
    [linear, angular]: [f64; 2],
) -> [f64; 3] {
    let advance_m = STEP_S * linear * f64::from(command.speed_mps);
    let turn_rad = STEP_S * angular * f64::from(command.yaw_rate_radps);
    [x_m + advance_m * libm::cos(yaw_rad), y_m + advance_m * libm::sin(yaw_rad), yaw_rad + turn_rad]
}

fn state_of([x_m, y_m, yaw_rad]: [f64; 3], command: SkidSteerCommand) -> SkidSteerState {
    let (speed_mps, yaw_rate_radps) = (command.speed_mps.into(), command.yaw_rate_radps.into());
    SkidSteerState { x_m, y_m, yaw_rad, speed_mps, yaw_rate_radps }
}

/// A unicycle of up to 3 m/s and half a turn a second, whose drives act at once.
fn model() -> SkidSteer {
    /// More than any plan asks for.
    const ENDLESS: f64 = 1e6;
    let limits = SkidSteerLimits {
        speed_max_mps: 3.0,
        reverse_speed_max_mps: 0.0,
        yaw_rate_max_radps: std::f64::consts::PI,
        acceleration_max_mps2: ENDLESS,
        yaw_acceleration_max_radps2: ENDLESS,
        lateral_acceleration_max_mps2: ENDLESS,
        roll_max_rad: 1.0,
        pitch_max_rad: 1.0,
    };
    SkidSteer { limits, speed_lag_s: 0.0, yaw_rate_lag_s: 0.0, turning_point_ahead_m: 0.0 }
}

/// EVORA's planner by the settings of ours: 1024 futures of ten seconds, white noise on the controls, one iteration.
/// A step costs its time and a second per metre of distance to the goal, a metre that is left at the end 100 s.
fn config(isa: Isa) -> Config {
    let defaults = Config::default();
    Config {
        n_rollouts: 1024,
        n_steps: 100,
        step_s: STEP_S,
        n_iterations: 1,
        n_threads: 1,
        isa,
        sampling: Sampling {
            space: SampleSpace::Controls,
            speed_std: 2.0,
            steering_std: 2.0,
            correlation_s: 0.0,
        },
        actuation: Actuation::Instant,
        temperature: Temperature::Fixed { temperature_s: 1.0 },
        control_cost: 1.0,
        costs: Costs {
            distance_s_per_m: 1.0,
            rest_speed_mps: 0.01,
            attitude_s: 0.0,
            lateral_s: 0.0,
            reverse_s: 0.0,
            ..defaults.costs
        },
        tracking_s: 0.0,
        recovery: Recovery { patience_s: f64::INFINITY, ..defaults.recovery },
        ..defaults
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plant_drives_the_polygon_of_a_circle() {
        let command = SkidSteerCommand { speed_mps: 2.0, yaw_rate_radps: 1.5 };
        let (traction, n) = ([0.6, 0.4], 25);
        let end = (0..n).fold(START, |pose, _| step(pose, command, traction));
        // Chords of 0.12 m, each turned by 0.06 rad against the one before: with the half turn h their sum is
        // 0.12 sin(n h) / sin h long and points (n - 1) h away from the first.
        let half_rad = 0.03_f64;
        let length_m = 0.12 * (f64::from(n) * half_rad).sin() / half_rad.sin();
        let away_rad = START[2] + f64::from(n - 1) * half_rad;
        let expected = [
            START[0] + length_m * away_rad.cos(),
            START[1] + length_m * away_rad.sin(),
            START[2] + f64::from(n) * 0.06,
        ];
        for axis in 0..3 {
            assert!((end[axis] - expected[axis]).abs() < 1e-6, "{end:?}, {expected:?}");
        }
        assert_eq!(step(START, command, [0.0; 2]), START);
    }

    #[test]
    fn open_dirt_is_crossed_about_as_fast_as_it_can_be() {
        for (method, seed) in Method::ALL.into_iter().zip([1001, 1002]) {
            let job = Job { density: 0.0, level: CvarLevel::new(0.4).unwrap(), method, seed };
            let time_s = job.drive(Isa::Auto).unwrap().unwrap();
            // 10.8 m at 0.65 of 3 m/s take 5.5 s, more where traction is less than its mean.
            assert!((5.0..9.0).contains(&time_s), "{time_s}");
        }
    }

    #[test]
    fn run_is_its_seed_and_both_methods_drive_the_same_world() {
        let job = Job { density: 0.7, level: CvarLevel::MEAN, method: Method::Exact, seed: 1003 };
        assert_eq!(job.drive(Isa::Portable).unwrap(), job.drive(Isa::Portable).unwrap());
    }
}
