//! Rollouts of the skid-steered vehicle against its reference.

use super::*;
use bicycle::{MotionModel, MotionState, MotionStepper, SkidSteer, SkidSteerLimits};

fn model(lag_s: f64) -> SkidSteer {
    let limits = SkidSteerLimits {
        speed_max_mps: 3.0,
        reverse_speed_max_mps: 1.0,
        yaw_rate_max_radps: 1.0,
        acceleration_max_mps2: 2.0,
        yaw_acceleration_max_radps2: 4.0,
        lateral_acceleration_max_mps2: 1.0,
        roll_max_rad: 0.5,
        pitch_max_rad: 0.5,
    };
    SkidSteer { limits, speed_lag_s: lag_s, yaw_rate_lag_s: 0.5 * lag_s, turning_point_ahead_m: 0.0 }
}

/// Where one vehicle in f64 ends, and how near it came to a place where rounding decides.
fn journey(map: &RiskMap, model: &SkidSteer, lane: usize) -> ([f64; 2], f64) {
    let (view, stepper) = (map.view(), model.stepper(STEP_S, 1.0));
    let [x_m, y_m, yaw_rad] = START;
    let mut state = MotionState { x_m, y_m, yaw_rad, speed_mps: 0.8, turn: 0.1 };
    let mut margin = f64::INFINITY;
    for t in 0..N_STEPS {
        for place in [state.x_m / 0.5, state.y_m / 0.5, state.yaw_rad / std::f64::consts::TAU * 13.0] {
            margin = margin.min((place - place.round()).abs());
        }
        let risk = view.risk_at(state.x_m, state.y_m, state.yaw_rad);
        let sample = GroundSample {
            linear_traction: f64::from(risk.linear_traction),
            angular_traction: f64::from(risk.angular_traction),
            ..GroundSample::FIRM
        };
        state = stepper.step_one(&state, control(lane, t).map(|value| value as f32), &sample, &mut [], t);
    }
    ([state.x_m, state.y_m], margin)
}

/// With limits and with lags, every lane of every instruction set goes where one vehicle goes.
#[test]
fn rollouts_of_a_skid_steered_vehicle_go_where_one_vehicle_goes() {
    let map = map();
    let corner_m = map.geometry().south_west_m();
    for lag_s in [0.0, 0.3] {
        let model = model(lag_s);
        let stepper = model.stepper(STEP_S, 0.5);
        for goal_m in [[START[0] + 20.0, START[1]], [START[0], START[1] + 20.0]] {
            let [x_cells, y_cells] = [0, 1].map(|axis| Constant::new((goal_m[axis] - corner_m[axis]) / 0.5));
            let task = Task::Goal(GoalTask { x_cells, y_cells, ..goal(&map, 0.0, Rest::Straight) });
            let start = Start {
                x_cells: (START[0] - corner_m[0]) / 0.5,
                y_cells: (START[1] - corner_m[1]) / 0.5,
                turns: START[2] / std::f64::consts::TAU,
                speed_mps: 0.8,
                turn: 0.1,
            };
            let scene = Scene {
                stepper: &stepper,
                grid: grid(&map),
                start,
                leaning_start_rad: None,
                slots: &[],
                prices: PRICES,
                task,
                cost: &(),
                frame: Frame { corner_m, cell_m: 0.5 },
                keeps_ends: false,
            };
            for machine in machines() {
                let mut chunk = chunk();
                kernel::run(machine, RollOut { scene: &scene, chunk: &mut chunk });
                let mut n_compared = 0;
                for lane in 0..CHUNK {
                    let ([x_m, y_m], margin) = journey(&map, &model, lane);
                    if margin < 1e-4 {
                        continue;
                    }
                    n_compared += 1;
                    let expected_m = libm::hypot(x_m - goal_m[0], y_m - goal_m[1]);
                    // The cost at the end is the time for the rest of the way, at 2 m/s.
                    let found_m = 2.0 * f64::from(chunk.terms[CostTerm::Terminal as usize].0[lane]);
                    assert!((found_m - expected_m).abs() < OFF_M, "{machine:?} lane {lane}: {found_m}");
                }
                assert!(n_compared > 30, "{n_compared} compared");
            }
        }
    }
}
