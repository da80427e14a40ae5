use super::*;
use crate::recording::{Tick, VehicleSummary};
use bicycle::ImuSample;

const SPEED_MPS: f32 = 1.5;

/// Twenty seconds at 20 Hz whose commanded curvature changes at every tick, and a vehicle that drives `factor` of it 80 ms
/// later.
fn recording(factor: f32) -> Recording {
    let command = |k: usize| 0.2 + 0.01 * (k % 40) as f32;
    let ticks = (0..400).map(|k| Tick {
        time_ns: k as u64 * 50_000_000,
        speed_mps: SPEED_MPS,
        curvature_per_m: command(k),
        wheel_speed_mps: 1.2,
        yaw_rate_radps: 0.0,
        ground: Some(k as u32 % 2),
    });
    let imu = (0..4000usize).map(|k| ImuSample {
        valid_at_ns: k as u64 * PERIOD_NS,
        acceleration_mps2: [k as f32, 0.0, 9.81],
        angular_rate_radps: [0.0, 0.0, factor * SPEED_MPS * command(k.saturating_sub(16) / 10)],
    });
    Recording {
        vehicle: VehicleSummary { name: "car".into(), wheelbase_m: 0.3, steering_max_rad: 0.5 },
        tick_s: 0.05,
        grounds: vec!["a".into(), "b".into()],
        runs: vec![RecordedRun { ticks: ticks.collect(), imu: imu.collect() }],
    }
}

#[test]
fn driven_curvature_is_the_mean_yaw_rate_of_the_shifted_interval_over_the_commanded_speed() {
    let (examples, counts) = label(&recording(0.9), &LabelConfig::paper(0.08));
    for example in &examples {
        let expected = 0.9 * example.commanded[0];
        assert!((example.driven[1] - expected).abs() < 1e-5, "{:?}", example.driven);
        assert_eq!((example.driven[0], example.commanded[1]), (SPEED_MPS, SPEED_MPS));
    }
    // The first 100 samples end at 0.495 s, the window of the tick at 0.5 s is the first whole one; the effect of the
    // last two ticks lies behind the last sample but for less than half of an interval.
    assert_eq!((counts.kept, counts.no_samples, counts.ticks), (examples.len(), 12, 400));
}

#[test]
fn examples_begin_where_the_part_of_the_effect_does() {
    let latency = Latency { seconds: 0.14, dead_time_s: 0.08, correlation: 1.0 };
    let beginning = LabelConfig { effect: EffectPart::Beginning, ..LabelConfig::unfiltered(0.0) };
    assert_eq!(LabelConfig::paper(0.0).after(&latency).latency_s, 0.14);
    assert_eq!(beginning.after(&latency).latency_s, 0.08);
}

/// A vehicle without dead time and with a lag T of 0.1 s. In the first 50 ms of a command c its curvature comes from k nearer
/// to c by s = 1 - T / 0.05 s (1 - exp(-0.05 s / T)) = 0.213 in the mean: from the beginning of the effect on the answer is
/// k + (driven - k) / s, which leads, and k is in the window.
#[test]
fn answer_from_the_beginning_leads_the_lag_by_what_the_window_holds() {
    let mut lagging = recording(1.0);
    let run = &mut lagging.runs[0];
    let (ticks, mut turning) = (run.ticks.clone(), 0.0);
    for (k, sample) in run.imu.iter_mut().enumerate() {
        sample.angular_rate_radps[2] = turning;
        let wished = SPEED_MPS * ticks[(k / 10).min(399)].curvature_per_m;
        turning += (1.0 - (-0.05_f32).exp()) * (wished - turning);
    }
    let (examples, _) = label(&lagging, &LabelConfig::unfiltered(0.0));
    let share = 1.0 - 2.0 * (1.0 - (-0.5_f32).exp());
    let mut leads = 0;
    for example in &examples {
        let turns = example.window[3 * WINDOW - 1] / SPEED_MPS;
        let driven = turns + share * (example.commanded[0] - turns);
        // Samples stand for the 5 ms after them: half a sample of 0.1 s.
        assert!((example.driven[1] - driven).abs() < 0.03 * (example.commanded[0] - turns).abs() + 1e-5);
        leads += usize::from((example.commanded[0] - example.driven[1]).abs() > 0.05);
    }
    assert!(leads > 20 && examples.len() > 300, "{leads} of {}", examples.len());
}

#[test]
fn window_ends_with_the_sample_at_the_command_and_holds_columns() {
    let (examples, _) = label(&recording(1.0), &LabelConfig::paper(0.08));
    let example = &examples[30];
    let last = (example.time_s / 0.005).round() as f32;
    // Columns of rates first: the fourth is the forward force, which counts the samples.
    let forward: Vec<f32> = example.window[3 * WINDOW..4 * WINDOW].to_vec();
    let expected: Vec<f32> = (0..100).map(|k| last - 99.0 + k as f32).collect();
    assert_eq!(forward, expected);
}

#[test]
fn each_filter_takes_what_it_says() {
    let count = |factor: f32, change: &dyn Fn(&mut LabelConfig)| {
        let mut config = LabelConfig::paper(0.08);
        change(&mut config);
        label(&recording(factor), &config).1
    };
    let kept = count(0.9, &|_| {}).kept;
    let over = count(1.1, &|_| {});
    assert_eq!((over.oversteer, over.kept), (kept, 0));
    assert_eq!(count(1.1, &|config| config.understeer_only = false).kept, kept);
    let other = count(-0.9, &|_| {});
    assert_eq!((other.other_sign, other.kept), (kept, 0));
    let slow = count(0.9, &|config| config.speed_min_mps = 1.6);
    assert_eq!((slow.slow, slow.kept), (kept, 0));
    // At a factor of 0.6 commands above 0.5 1/m differ by more than 0.2: 0.51 to 0.59 of 0.20 to 0.59.
    let different = count(0.6, &|_| {});
    let share = different.different as f64 / (different.different + different.kept) as f64;
    assert!((share - 9.0 / 40.0).abs() < 0.03, "{share}");
    assert_eq!(count(0.6, &|config| config.difference_max_per_m = None).kept, kept);
}

#[test]
fn wheels_may_tell_the_speed() {
    let config = LabelConfig { speed_source: SpeedSource::Wheels, ..LabelConfig::unfiltered(0.08) };
    let (examples, _) = label(&recording(0.8), &config);
    // 0.8 x 1.5 / 1.2 = 1: the wheels tell that nothing is lost.
    assert!(examples.iter().all(|example| (example.driven[1] - example.commanded[0]).abs() < 1e-5));
}
