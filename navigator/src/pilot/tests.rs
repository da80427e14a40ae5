//! What the controller knows of a drive that others had a hand in.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use super::*;
use crate::{GuardConfig, MessageId, MovingConfig, RiskMapConfig};
use bicycle::{Command, Geometry, Limits, State};
use mppi::{CostToGo, CostToGoConfig};
use physics_prior::PriorConfig;
use terrain::ElevationConfig;
use traversability::{GridGeometry, Risk, RiskMap};

const CYCLE_NS: u64 = 100_000_000;
const CYCLE_S: f64 = 0.1;
const DELAY_S: f64 = 0.3;
/// Speed of the drive before the stop, and what the brakes do [m/s, m/s2].
const SPEED_MPS: f64 = 2.0;
const BRAKES_MPS2: f64 = 2.0;

fn limits() -> Limits {
    Limits {
        speed_max_mps: SPEED_MPS,
        reverse_speed_max_mps: 0.0,
        steering_max_rad: 0.5,
        steering_rate_max_radps: 1.0,
        acceleration_max_mps2: BRAKES_MPS2,
        lateral_acceleration_max_mps2: 3.0,
        roll_max_rad: 0.5,
        pitch_max_rad: 0.5,
    }
}

fn config() -> Config {
    let geometry = Geometry {
        wheelbase_m: 2.0,
        track_m: 1.2,
        length_m: 3.0,
        width_m: 1.5,
        rear_overhang_m: 0.5,
        ground_clearance_m: 0.3,
        wheel_radius_m: 0.3,
    };
    Config {
        elevation: ElevationConfig::scaled_to(geometry.length_m),
        risk_map: RiskMapConfig { elevation_cells: 1, n_rows: 64, n_cols: 64, n_yaws: 8, recentre_m: 1.0 },
        prior: PriorConfig::for_vehicle(&geometry),
        cost_to_go: CostToGoConfig::default(),
        controller: mppi::Config { delay_s: DELAY_S, n_rollouts: 256, ..mppi::Config::default() },
        guard: GuardConfig::default(),
        attitude_share: 0.9,
        areas: crate::Areas::default(),
        sensors: Vec::new(),
        moving: None,
        friction: None,
        speed: crate::SpeedConfig::default(),
        correction: kinodynamics::CorrectionConfig::default(),
    }
}

struct Drive {
    pilot: Pilot,
    map: RiskMap,
    field: CostToGo,
    goal_m: [f64; 2],
    state: State,
    /// What it says that it was told last.
    applied: Applied,
    cycle: u64,
}

impl Drive {
    /// On level ground to a goal 18 m ahead, with a vehicle that follows its commands 0.3 s late.
    fn new() -> Self {
        Self::with(&config())
    }

    fn with(config: &Config) -> Self {
        let model = Model { wheelbase_m: 2.0, limits: limits(), effects: Vec::new() };
        let map = RiskMap::constant(GridGeometry::centred(0.25, 160, 160, 0.0, 0.0), 8, Risk::NONE);
        let mut field = CostToGo::new(CostToGoConfig::default(), &limits(), 160, 160).unwrap();
        let goal_m = [18.0, 0.0];
        field.update(map.view(), goal_m, 0.0).unwrap();
        let state = State { x_m: -15.0, speed_mps: SPEED_MPS, ..State::default() };
        let applied = Applied { command: Command::default(), since_ns: 0, by: AppliedBy::Command };
        Self { pilot: Pilot::new(model, config, 1).unwrap(), map, field, goal_m, state, applied, cycle: 0 }
    }

    fn measure(&mut self) {
        let odometry = Odometry {
            valid_at_ns: self.cycle * CYCLE_NS,
            position_m: [self.state.x_m, self.state.y_m, 0.0],
            velocity_mps: [self.state.speed_mps, 0.0],
            wheel_speed_mps: self.state.speed_mps,
            ..Odometry::default()
        };
        let id = MessageId { epoch_ns: 1, sequence: self.cycle + 1 };
        self.pilot.hear_odometry(&OdometryMessage { id, odometry, applied: self.applied });
        self.pilot.note_scan(self.cycle * CYCLE_NS);
    }

    fn decide(&mut self) -> Decision {
        self.decide_on_map_of(u64::MAX)
    }

    fn decide_on_map_of(&mut self, odometry_at_ns: u64) -> Decision {
        let (map, time_to_goal) = (self.map.view(), self.field.view());
        let risk = RiskInput { map, time_to_goal, goal_m: self.goal_m, odometry_at_ns };
        let destination = Destination { goal_m: self.goal_m, tolerance_m: 0.5 };
        let instruction = Instruction::Drive(Target::Goal(destination));
        let decision = self.pilot.decide(self.cycle * CYCLE_NS, Some(risk), &instruction);
        self.carry_out(&decision);
        self.cycle += 1;
        decision
    }

    fn carry_out(&mut self, decision: &Decision) {
        let command = decision.command(self.applied.command);
        if (command, AppliedBy::Command) != (self.applied.command, self.applied.by) {
            self.applied = Applied { command, since_ns: self.cycle * CYCLE_NS, by: AppliedBy::Command };
        }
    }

    /// A vehicle without slip or lag drives where it is told to, for so many cycles.
    fn follow(&mut self, instruction: &Instruction<'_>, n_cycles: usize) {
        for _ in 0..n_cycles {
            self.measure();
            let risk = RiskInput {
                map: self.map.view(),
                time_to_goal: self.field.view(),
                goal_m: self.goal_m,
                odometry_at_ns: u64::MAX,
            };
            let decided = self.pilot.decide(self.cycle * CYCLE_NS, Some(risk), instruction);
            self.carry_out(&decided);
            let command = decided.command(Command::default());
            let (speed_mps, steering_rad) = (f64::from(command.speed_mps), f64::from(command.steering_rad));
            self.state.x_m += CYCLE_S * speed_mps * self.state.yaw_rad.cos();
            self.state.y_m += CYCLE_S * speed_mps * self.state.yaw_rad.sin();
            self.state.yaw_rad += CYCLE_S * speed_mps * steering_rad.tan() / 2.0;
            (self.state.speed_mps, self.state.steering_rad) = (speed_mps, steering_rad);
            self.cycle += 1;
        }
    }

    /// Where the controller's plan of the last decision starts.
    fn planned_from(&self) -> State {
        self.pilot.controller().nominal_trajectory(self.map.view())[0]
    }
}

/// The vehicle drives at 2 m/s; its odometry fails for a second, in which it stands after it braked. Once odometry is
/// back, what is on its way for the next 0.3 s is that it stands: the plan starts where it stands, at rest. The
/// commands of before the stop are none of that.
#[test]
fn after_a_stop_of_the_guard_the_plan_starts_from_what_was_really_sent() {
    let mut drive = Drive::new();
    for _ in 0..10 {
        drive.measure();
        let Decision::Drive(command) = drive.decide() else { panic!("level ground") };
        assert!(command.speed_mps > 1.0, "{command:?}");
        drive.state.x_m += SPEED_MPS * CYCLE_S;
    }
    let mut n_stops = 0;
    for _ in 0..14 {
        n_stops += usize::from(matches!(drive.decide(), Decision::Stop(StopReason::StaleOdometry)));
    }
    assert!(n_stops >= 10, "{n_stops}");
    drive.state = State { x_m: drive.state.x_m + 1.0, ..State::default() };
    drive.measure();
    let Decision::Drive(command) = drive.decide() else { panic!("it sees again") };
    let start = drive.planned_from();
    assert!((start.x_m - drive.state.x_m).abs() < 1e-9 && start.speed_mps.abs() < 1e-9, "{start:?}");
    // From rest, as far as it may run ahead of it: no more than a step beyond what the tracking allows.
    assert!((0.0..=0.2 + 1e-6).contains(&f64::from(command.speed_mps)), "{command:?}");
}

/// Somebody between controller and vehicle lets nothing through: the vehicle is told to stand whatever is decided.
#[test]
fn what_was_applied_instead_of_a_decision_is_what_the_next_plan_starts_from() {
    let mut drive = Drive::new();
    drive.state.speed_mps = 0.0;
    let standing = Applied { command: Command::default(), since_ns: 0, by: AppliedBy::Vehicle };
    for _ in 0..40 {
        drive.applied = standing;
        drive.measure();
        let Decision::Drive(command) = drive.decide() else { panic!("level ground") };
        let start = drive.planned_from();
        assert!((start.x_m - drive.state.x_m).abs() < 1e-9 && start.speed_mps.abs() < 1e-9, "{start:?}");
        // From rest in one step, whatever was decided before; and who is held is not stuck.
        assert!((0.0..=BRAKES_MPS2 * CYCLE_S + 1e-6).contains(&f64::from(command.speed_mps)), "{command:?}");
        assert!(!drive.pilot.controller().diagnostics().is_recovering);
    }
    assert!(drive.pilot.stuck.is_none());
}

/// The watchdog stops it for half a second in which nothing is decided, and follows again what comes then.
#[test]
fn a_stop_of_the_vehicles_own_is_known_with_its_time() {
    let mut drive = Drive::new();
    let mut last = Command::default();
    for _ in 0..10 {
        drive.measure();
        let Decision::Drive(command) = drive.decide() else { panic!("level ground") };
        (drive.state.x_m, last) = (drive.state.x_m + SPEED_MPS * CYCLE_S, command);
    }
    drive.cycle += 5;
    // It has been told to stop for 0.2 s: for the first tenth of what is on its way the last command is, then rest.
    let stop = Command { speed_mps: 0.0, ..last };
    let stopped_ns = drive.cycle * CYCLE_NS - 200_000_000;
    drive.applied = Applied { command: stop, since_ns: stopped_ns, by: AppliedBy::Vehicle };
    drive.measure();
    drive.decide();
    let start = drive.planned_from();
    // At 2 m/s2: a tenth towards the command, two to rest.
    let step_mps = BRAKES_MPS2 * CYCLE_S;
    let towards_mps = (f64::from(last.speed_mps) - SPEED_MPS).clamp(-step_mps, step_mps);
    let expected_mps = SPEED_MPS + towards_mps - 2.0 * step_mps;
    assert!((start.speed_mps - expected_mps).abs() < 1e-6, "{start:?} {last:?}");
}

/// The vehicle stands, however it is told to drive, and is found to be stuck: it backs up. Meanwhile the localisation
/// corrects itself by 3 m, and the next map lies in the new frame. It goes on backing up, to behind where it stands.
#[test]
fn backing_up_goes_on_after_a_jump_of_the_localisation() {
    let mut drive = Drive::new();
    drive.state.speed_mps = 0.0;
    let decide = |drive: &mut Drive, map_frame_at_ns: u64| {
        // As sensors see it: never twice at the same place.
        drive.state.y_m += if drive.cycle.is_multiple_of(2) { 1e-3 } else { -1e-3 };
        drive.measure();
        drive.decide_on_map_of(map_frame_at_ns);
        drive.pilot.controller().diagnostics().is_recovering
    };
    let n_cycles = (0..100).find(|_| decide(&mut drive, 0)).unwrap();
    assert!(n_cycles > 10, "{n_cycles}");
    drive.state.x_m += 3.0;
    assert!(decide(&mut drive, 0), "on the map of before it stands where it stood");
    let new_ns = drive.cycle * CYCLE_NS;
    assert!((0..5).all(|_| decide(&mut drive, new_ns)), "on the map of after it does, too");
}

/// The straight line to the goal lies 6 m north of the path, and the time to the goal leads there.
#[test]
fn a_path_is_followed_and_not_the_time_to_a_goal() {
    let mut drive = Drive::new();
    drive.state.y_m = -6.0;
    drive.goal_m = [15.0, 6.0];
    let points_m = [[-16.0, -6.0], [16.0, -6.0]];
    let path = ReferencePath { points_m: &points_m, speed_mps: 1.0, tolerance_m: 0.5 };
    drive.follow(&Instruction::Drive(Target::Path(path)), 100);
    assert!((drive.state.y_m + 6.0).abs() < 0.3, "{:?}", drive.state);
    // It came with twice the path's speed, and has none of its own.
    assert!((drive.state.speed_mps - 1.0).abs() < 0.2, "{:?}", drive.state);
    assert!(drive.state.x_m > -5.5, "{:?}", drive.state);
}

/// The field leads to a goal in the east; the vehicle is told to go to another, behind it to the north-west.
#[test]
fn a_field_that_leads_to_another_goal_is_not_followed() {
    let target = Destination { goal_m: [0.0, 14.0], tolerance_m: 0.5 };
    let mut drive = Drive::new();
    (drive.state.x_m, drive.state.speed_mps) = (0.0, 0.0);
    drive.follow(&Instruction::Drive(Target::Goal(target)), 80);
    let left_m = (drive.state.x_m - 0.0).hypot(drive.state.y_m - 14.0);
    assert!(left_m < 8.0, "{:?}", drive.state);
}

#[test]
fn what_is_wrong_with_the_measurements_is_said_first_and_a_map_that_is_missing_last() {
    let mut drive = Drive::new();
    let lost = Instruction::Stand(Decision::Stop(StopReason::StaleMission));
    let there = Instruction::Drive(Target::Goal(Destination { goal_m: drive.goal_m, tolerance_m: 1.0 }));
    assert_eq!(drive.pilot.decide(0, None, &lost), Decision::Stop(StopReason::StaleOdometry));
    drive.measure();
    assert_eq!(drive.pilot.decide(1, None, &lost), Decision::Stop(StopReason::StaleMission));
    assert_eq!(drive.pilot.decide(2, None, &there), Decision::Hold(HoldReason::NoMap));
}

/// Somebody who stands at a place, as of a time [ms], in the frame of that time.
fn somebody_at(at_ms: u64, position_m: [f64; 2]) -> TracksMessage {
    somebody_in_frame([at_ms, at_ms], position_m)
}

/// The same in the frame of another time.
fn somebody_in_frame([at_ms, frame_at_ms]: [u64; 2], position_m: [f64; 2]) -> TracksMessage {
    let track = tracking::Track { number: 1, position_m, radius_m: 0.3, ..tracking::Track::default() };
    let id = MessageId { epoch_ns: 2, sequence: at_ms + 1 };
    let scan = (MessageId::default(), at_ms * 1_000_000);
    TracksMessage::new(id, scan, frame_at_ms * 1_000_000, &[track])
}

/// Measured a cycle's way on: odometry that stands still would be taken for frozen.
fn onwards(drive: &mut Drive) {
    drive.state.x_m += SPEED_MPS * CYCLE_S;
    drive.measure();
}

#[test]
fn nobody_drives_among_people_of_whom_nothing_is_known_or_nothing_any_more() {
    let mut drive = Drive::with(&Config { moving: Some(MovingConfig::default()), ..config() });
    onwards(&mut drive);
    assert_eq!(drive.decide(), Decision::Hold(HoldReason::NoMap), "nothing is known");
    drive.pilot.hear_tracks(&somebody_at(100, [100.0, 100.0]));
    for _ in 1..=11 {
        onwards(&mut drive);
        assert!(matches!(drive.decide(), Decision::Drive(_)), "cycle {}", drive.cycle);
    }
    // Map and odometry go on, and 1.1 s ago somebody knew last who moves.
    onwards(&mut drive);
    assert_eq!(drive.decide(), Decision::Stop(StopReason::StaleScan));
    drive.pilot.hear_tracks(&somebody_at(50, [100.0, 100.0]));
    onwards(&mut drive);
    assert_eq!(drive.decide(), Decision::Stop(StopReason::StaleScan), "what is older is no news");
    drive.pilot.hear_tracks(&somebody_at(1400, [100.0, 100.0]));
    onwards(&mut drive);
    assert!(matches!(drive.decide(), Decision::Drive(_)));
}

#[test]
fn who_stands_before_the_bumper_is_stopped_for_until_he_has_gone() {
    let mut drive = Drive::with(&Config { moving: Some(MovingConfig::default()), ..config() });
    let bumper_m = drive.state.x_m;
    drive.pilot.hear_tracks(&somebody_at(0, [bumper_m + 1.2, 0.0]));
    drive.measure();
    let answer = |drive: &mut Drive| drive.decide();
    assert_eq!(answer(&mut drive), Decision::Stop(StopReason::MovingObstacle));
    drive.pilot.hear_tracks(&somebody_at(100, [bumper_m, 20.0]));
    drive.measure();
    assert!(matches!(answer(&mut drive), Decision::Drive(_)));
    let without = Config { moving: None, ..config() };
    let mut drive = Drive::with(&without);
    drive.pilot.hear_tracks(&somebody_at(0, [bumper_m + 1.2, 0.0]));
    drive.measure();
    assert!(matches!(drive.decide(), Decision::Drive(_)), "where nobody has said that anything moves");
}

/// The localisation jumps 6 m to the north after the scan: so does he, and is no longer taken to be in the way.
#[test]
fn a_jump_takes_people_along() {
    let mut drive = Drive::with(&Config { moving: Some(MovingConfig::default()), ..config() });
    let ahead_m = [drive.state.x_m + 1.4, 0.0];
    drive.measure();
    drive.pilot.hear_tracks(&somebody_at(0, [ahead_m[0], -6.0]));
    assert!(matches!(drive.decide(), Decision::Drive(_)), "6 m beside the way");
    drive.state.x_m += 0.2;
    drive.state.y_m += 6.0;
    drive.measure();
    drive.pilot.hear_tracks(&somebody_at(50, [ahead_m[0] + 0.2, -6.0]));
    assert!(matches!(drive.decide(), Decision::Drive(_)), "and still, both moved");
    drive.measure();
    let seen_before_the_jump = somebody_in_frame([60, 50], [ahead_m[0] + 0.2, 0.0]);
    drive.pilot.hear_tracks(&seen_before_the_jump);
    assert_eq!(
        drive.decide(),
        Decision::Stop(StopReason::MovingObstacle),
        "he was before the bumper all along"
    );
}
