//! The skid-steered model against a recorded Clearpath Warthog on uneven ground (norlab-ulaval/DRIVE): commands of 6 s,
//! drawn at random; where is it after 1, 2 and 5 s?
//!
//! Every other command fits what the model holds: the shares of what is asked for that the vehicle achieves once it has
//! settled, which is what traction is, and how fast it follows. The commands between tell how far the model is off.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use bicycle::{GroundSample, MotionModel, MotionState, MotionStepper, SkidSteer, SkidSteerLimits};
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

const STEP_S: f64 = 0.05;
/// A command is recorded as three windows of this many rows.
const WINDOW: usize = 40;

/// What was recorded at one time. Pairs are speed along the body [m/s] and yaw rate [rad/s].
#[derive(Clone, Copy)]
struct Instant {
    /// East, north [m], yaw [rad], from the start of the command.
    pose: [f64; 3],
    asked: [f64; 2],
    body: [f64; 2],
    /// To the left [m/s].
    sideways_mps: f64,
}

fn moved([x, y, yaw]: [f64; 3], [ahead, left, turned]: [f64; 3]) -> [f64; 3] {
    let (sine, cosine) = yaw.sin_cos();
    [x + ahead * cosine - left * sine, y + ahead * sine + left * cosine, yaw + turned]
}

/// A window goes on where the one before ended, one row later.
fn join(command: &mut Vec<Instant>, window: Vec<Instant>) {
    let start = command.last().map_or([0.0; 3], |last| {
        let [ahead_mps, turned_radps] = last.body;
        moved(last.pose, [ahead_mps, last.sideways_mps, turned_radps].map(|rate| rate * STEP_S))
    });
    command.extend(window.into_iter().map(|now| Instant { pose: moved(start, now.pose), ..now }));
}

/// The commands that were recorded without a gap.
fn commands() -> Vec<Vec<Instant>> {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data/logs/drive_warthog.csv"));
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let mut windows: BTreeMap<(usize, usize), Vec<Instant>> = BTreeMap::new();
    for line in lines {
        let row: HashMap<&str, f64> =
            names.iter().copied().zip(line.split(',').map(|cell| cell.parse().unwrap())).collect();
        windows.entry((row["calib_step"] as usize, row["run"] as usize)).or_default().push(Instant {
            pose: [row["x"], row["y"], row["yaw"]],
            asked: [row["cmd_speed"], row["cmd_wz"]],
            body: [row["vx"], row["wz"]],
            sideways_mps: row["vy"],
        });
    }
    let mut commands: BTreeMap<usize, (Vec<usize>, Vec<Instant>)> = BTreeMap::new();
    for ((command, run), window) in windows {
        let (runs, instants) = commands.entry(command).or_default();
        runs.push(run);
        join(instants, window);
    }
    let whole = |(runs, instants): &(Vec<usize>, Vec<Instant>)| {
        instants.len() == 3 * WINDOW && runs.windows(2).all(|two| two[1] == two[0] + 1)
    };
    commands.into_values().filter(whole).map(|(_, instants)| instants).collect()
}

fn model([acceleration_max_mps2, yaw_acceleration_max_radps2]: [f64; 2], lags_s: [f64; 2]) -> SkidSteer {
    let limits = SkidSteerLimits {
        speed_max_mps: 5.0,
        reverse_speed_max_mps: 5.0,
        yaw_rate_max_radps: 10.0,
        acceleration_max_mps2,
        yaw_acceleration_max_radps2,
        lateral_acceleration_max_mps2: 10.0,
        roll_max_rad: 0.5,
        pitch_max_rad: 0.5,
    };
    let model =
        SkidSteer { limits, speed_lag_s: lags_s[0], yaw_rate_lag_s: lags_s[1], turning_point_ahead_m: 0.0 };
    model.validate().unwrap();
    model
}

/// The states of a model that starts as the vehicle at row `from` and is told what the vehicle was told.
fn foretold(
    model: &SkidSteer,
    ground: &GroundSample,
    drive: &[Instant],
    (from, n_steps): (usize, usize),
) -> Vec<MotionState> {
    let stepper = model.stepper(STEP_S, 1.0);
    let Instant { pose: [x_m, y_m, yaw_rad], body, .. } = drive[from];
    let (speed_mps, turn) = (body[0] / ground.linear_traction, body[1] / ground.angular_traction);
    let mut states = vec![MotionState { x_m, y_m, yaw_rad, speed_mps, turn }];
    for (t, now) in drive[from..from + n_steps].iter().enumerate() {
        states.push(stepper.step_one(&states[t], now.asked.map(|asked| asked as f32), ground, &mut [], t));
    }
    states
}

/// Change and lag that tell the body's motion best, one channel after the other.
fn fitted_drives(drives: &[&Vec<Instant>], ground: &GroundSample) -> ([f64; 2], [f64; 2]) {
    let shares = [ground.linear_traction, ground.angular_traction];
    let off = |channel: usize, change: f64, lag_s: f64| -> f64 {
        let model = model([change; 2], [lag_s; 2]);
        let of_drive = |drive: &&Vec<Instant>| -> f64 {
            let states = foretold(&model, ground, drive, (0, drive.len()));
            let rate = |state: &MotionState| shares[channel] * [state.speed_mps, state.turn][channel];
            drive.iter().zip(&states).map(|(now, state)| (rate(state) - now.body[channel]).powi(2)).sum()
        };
        drives.iter().map(of_drive).sum()
    };
    let best = |channel: usize| {
        let changes = [1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0];
        let tried =
            changes.into_iter().flat_map(|change| (0..16).map(move |k| (change, 0.05 * f64::from(k))));
        tried.min_by(|a, b| off(channel, a.0, a.1).total_cmp(&off(channel, b.0, b.1))).unwrap()
    };
    let (speed, yaw_rate) = (best(0), best(1));
    ([speed.0, yaw_rate.0], [speed.1, yaw_rate.1])
}

/// The shares of what is asked for that the body achieves, by least squares over all but a command's first window.
fn fitted_ground(drives: &[&Vec<Instant>]) -> GroundSample {
    let share = |channel: usize| {
        let settled = drives.iter().flat_map(|drive| &drive[WINDOW..]);
        let sums = settled.fold([0.0; 2], |sums, now| {
            let (asked, body) = (now.asked[channel], now.body[channel]);
            [sums[0] + asked * body, sums[1] + asked * asked]
        });
        sums[0] / sums[1]
    };
    GroundSample { linear_traction: share(0), angular_traction: share(1), ..GroundSample::FIRM }
}

/// Root mean squares of how far a forecast is off in place [m] and yaw [rad], over all starts half a second apart.
fn errors(
    drives: &[&Vec<Instant>],
    horizon: usize,
    foretell: impl Fn(&[Instant], usize) -> [f64; 3],
) -> [f64; 2] {
    let mut squares = [0.0; 2];
    let mut n = 0.0;
    for drive in drives {
        for from in (0..drive.len() - horizon).step_by(10) {
            let (found, [x, y, yaw]) = (foretell(drive, from), drive[from + horizon].pose);
            squares[0] += (found[0] - x).powi(2) + (found[1] - y).powi(2);
            squares[1] += (found[2] - yaw).powi(2);
            n += 1.0;
        }
    }
    squares.map(|sum: f64| (sum / n).sqrt())
}

fn pose(states: &[MotionState], horizon: usize, from_yaw_rad: f64) -> [f64; 3] {
    // The model's yaw comes back within a turn: it is followed from step to step.
    let steps = states[..=horizon].windows(2).map(|two| {
        let turned = two[1].yaw_rad - two[0].yaw_rad;
        turned - std::f64::consts::TAU * (turned / std::f64::consts::TAU).round()
    });
    [states[horizon].x_m, states[horizon].y_m, from_yaw_rad + steps.sum::<f64>()]
}

/// Root mean squares over the commands that nothing was fitted to, against two forecasts: what was asked for is done at
/// once and in full; and the body goes on as it moves at the start. The shares alone, without any lag, come in between.
/// Over a second the body's own yaw rate tells its yaw better than the model does: by 0.20 rad against 0.28.
#[test]
#[ignore = "needs the shared data"]
fn it_foretells_a_real_vehicle_better_than_its_commands_and_than_its_motion() {
    let commands = commands();
    assert!(commands.len() > 80, "{} commands", commands.len());
    let half = |odd: usize| commands.iter().skip(odd).step_by(2).collect::<Vec<_>>();
    let (known, held_out) = (half(0), half(1));
    let ground = fitted_ground(&known);
    let (changes, lags_s) = fitted_drives(&known, &ground);
    let (lagging, instant) = (model(changes, lags_s), model([1e6; 2], [0.0; 2]));
    println!("changes {changes:?}, lags {lags_s:.2?} s");
    println!("traction {:.3} along, {:.3} turning", ground.linear_traction, ground.angular_traction);
    for (horizon_s, of_motion) in [(1.0, [0.8, 1.5]), (2.0, [0.6, 0.7]), (5.0, [0.45, 0.25])] {
        let horizon = (horizon_s / STEP_S) as usize;
        let of = |model: &SkidSteer| {
            errors(&held_out, horizon, |drive, from| {
                pose(&foretold(model, &ground, drive, (from, horizon)), horizon, drive[from].pose[2])
            })
        };
        let carried_on = |rates: &dyn Fn(&Instant, &Instant) -> [f64; 2]| {
            errors(&held_out, horizon, |drive, from| {
                (from..from + horizon).fold(drive[from].pose, |pose, t| {
                    let [ahead_mps, turned_radps] = rates(&drive[from], &drive[t]);
                    moved(pose, [ahead_mps * STEP_S, 0.0, turned_radps * STEP_S])
                })
            })
        };
        let (ours, shares) = (of(&lagging), of(&instant));
        let asked = carried_on(&|_, now| now.asked);
        let goes_on = carried_on(&|start, _| start.body);
        println!(
            "{horizon_s} s: model {ours:.2?}, without lag {shares:.2?}, as asked {asked:.2?}, as it moves {goes_on:.2?} [m, rad]"
        );
        for axis in [0, 1] {
            assert!(ours[axis] < 0.5 * asked[axis], "{horizon_s} s: {ours:?} {asked:?}");
            assert!(ours[axis] < of_motion[axis] * goes_on[axis], "{horizon_s} s: {ours:?} {goes_on:?}");
            assert!(ours[axis] < 0.9 * shares[axis], "{horizon_s} s: {ours:?} {shares:?}");
        }
    }
}
