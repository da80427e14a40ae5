//! Networks that correct commands, fitted to a drive of the plant with commands that sway.

use std::ops::ControlFlow;
use std::sync::{Arc, LazyLock};

use bicycle::{Command, Decision, Vehicle};
use kinodynamics::{Architecture, Checkpoint, LabelConfig, RecordedRun, Recording, Settings, Tick, train};
use scenarios::{Episode, EpisodeConfig, Task};

use crate::fixture::{SEED, machine, task};

/// Fitted once for all tests.
pub static CORRECTOR: LazyLock<Arc<Checkpoint>> = LazyLock::new(|| {
    let paper = Settings::paper(Architecture::PAPER, SEED);
    let settings = Settings { epochs: 3, labels: LabelConfig::unfiltered(0.0), ..paper };
    let trained = train(&swaying_drives(), &settings, "test", &mut |_| ControlFlow::Continue(())).unwrap();
    Arc::new(trained.checkpoint)
});

/// Drives to the left and right at changing speeds from all over the rocks, each until twelve seconds or something end it.
fn swaying_drives() -> Recording {
    let (vehicle, _) = machine();
    let starts = (0..5)
        .flat_map(|row| (0..5).map(move |col| [5.0 + 10.0 * f64::from(row), 5.0 + 10.0 * f64::from(col)]));
    let runs = starts.map(|[x_m, y_m]| swaying_drive(&vehicle, [x_m, y_m, 0.1 * x_m * y_m]));
    Recording { vehicle: (&vehicle).into(), tick_s: 0.05, grounds: Vec::new(), runs: runs.collect() }
}

fn swaying_drive(vehicle: &Vehicle, start: [f64; 3]) -> RecordedRun {
    let mut config = EpisodeConfig::for_vehicle(vehicle);
    (config.control_hz, config.range_sensor) = (20.0, None);
    config.rules.time_limit_s = 12.0;
    let task = Task { start, ..task() };
    let mut run = RecordedRun::default();
    let Ok(mut episode) = Episode::new(task, vehicle, config, SEED) else { return run };
    while episode.outcome().is_none() {
        let time_s = episode.time_s() + start[0];
        let (sway, pace) = ((1.1 * time_s).sin() + 0.3 * (2.9 * time_s).sin(), (0.37 * time_s).sin());
        let command = Command { speed_mps: (1.2 + 0.6 * pace) as f32, steering_rad: (0.35 * sway) as f32 };
        let observation = episode.observe();
        run.imu.extend_from_slice(&observation.imu);
        run.ticks.push(Tick {
            time_ns: observation.valid_at_ns,
            speed_mps: command.speed_mps,
            curvature_per_m: command.steering_rad.tan() / vehicle.geometry.wheelbase_m as f32,
            wheel_speed_mps: observation.odometry.wheel_speed_mps as f32,
            yaw_rate_radps: observation.odometry.yaw_rate_radps as f32,
            ground: None,
        });
        episode.apply(&Decision::Drive(command)).unwrap();
    }
    run
}
