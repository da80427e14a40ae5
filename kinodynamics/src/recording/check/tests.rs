use bicycle::ImuSample;

use super::*;
use crate::recording::{RecordedRun, Tick, VehicleSummary};

/// Twenty seconds of turns to the left and right on level ground, and what the unit tells of it.
fn recording(change: impl Fn(&mut ImuSample)) -> Recording {
    let yaw_rate = |t_s: f64| (0.8 * t_s).sin();
    let imu = (0..4000u64).map(|k| {
        let mut sample = ImuSample {
            valid_at_ns: k * PERIOD_NS,
            acceleration_mps2: [0.2, yaw_rate(k as f64 * 0.005) as f32, 9.81],
            angular_rate_radps: [0.01, -0.02, yaw_rate(k as f64 * 0.005) as f32],
        };
        change(&mut sample);
        sample
    });
    let tick = |k: u64| Tick {
        time_ns: k * 50_000_000,
        speed_mps: 1.0,
        curvature_per_m: 1.0,
        wheel_speed_mps: 1.0,
        yaw_rate_radps: yaw_rate(k as f64 * 0.05) as f32,
        ground: None,
    };
    Recording {
        vehicle: VehicleSummary { name: "car".into(), wheelbase_m: 0.3, steering_max_rad: 0.5 },
        tick_s: 0.05,
        grounds: Vec::new(),
        runs: vec![RecordedRun { ticks: (0..400).map(tick).collect(), imu: imu.collect() }],
    }
}

fn told(change: impl Fn(&mut ImuSample)) -> String {
    check_imu(&recording(change)).unwrap_err().to_string()
}

#[test]
fn sound_unit_passes() {
    assert_eq!(check_imu(&recording(|_| {})), Ok(()));
}

#[test]
fn other_axes_signs_and_units_are_told_by_what_they_look_like() {
    let message = told(|sample| {
        sample.acceleration_mps2.rotate_right(1);
        sample.angular_rate_radps.rotate_right(1);
    });
    assert!(
        message.contains("9.81 forward, 0.20 left") && message.ends_with("the axis called forward points up"),
        "{message}"
    );
    let message = told(|sample| sample.acceleration_mps2[2] *= -1.0);
    assert!(message.ends_with("the upward axis points down"), "{message}");
    let message = told(|sample| sample.acceleration_mps2 = sample.acceleration_mps2.map(|a| a / 9.81));
    assert!(message.ends_with("is it in units of g?"), "{message}");
    let message = told(|sample| sample.angular_rate_radps[2] *= -1.0);
    assert!(message.ends_with("its sign is turned"), "{message}");
    let message = told(|sample| sample.angular_rate_radps.swap(1, 2));
    assert!(message.ends_with("the axis called left is the upward one"), "{message}");
    let message = told(|sample| sample.angular_rate_radps[2] *= 57.3);
    assert!(message.ends_with("is it in degrees per second?"), "{message}");
    let message = told(|sample| sample.acceleration_mps2.swap(0, 1));
    assert!(message.ends_with("forward and left are swapped"), "{message}");
    let message = told(|sample| sample.acceleration_mps2[1] *= -1.0);
    assert!(message.ends_with("the axis called left points right"), "{message}");
}

#[test]
fn another_rate_and_broken_numbers_are_told() {
    assert_eq!(told(|sample| sample.valid_at_ns *= 2), "IMU: expected 200 Hz, found 100.0 Hz");
    let message = told(|sample| {
        if sample.valid_at_ns == 70 * PERIOD_NS {
            sample.acceleration_mps2[1] = f32::NAN;
        }
    });
    assert_eq!(message, "IMU: expected finite numbers, found NaN in sample 70 of run 0");
}

#[test]
fn drive_without_turns_tells_nothing() {
    let mut straight = recording(|_| {});
    for tick in &mut straight.runs[0].ticks {
        tick.yaw_rate_radps = 0.0;
    }
    assert!(matches!(check_imu(&straight), Err(ImuCheckError::Nothing { .. })));
}
