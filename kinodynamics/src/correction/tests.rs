use std::ops::ControlFlow;

use super::*;
use crate::architecture::{Architecture, WINDOW};
use crate::history::PERIOD_NS;
use crate::training::tests::two_grounds;
use crate::{Recording, Settings, train};

/// Half a second of tick `k` of a recording.
fn samples(recording: &Recording, tick: usize) -> (&[ImuSample], u64) {
    let run = &recording.runs[0];
    let time_ns = run.ticks[tick].time_ns;
    let end = run.imu.partition_point(|sample| sample.valid_at_ns <= time_ns);
    (&run.imu[end - WINDOW..end], time_ns)
}

fn checkpoint(recording: &Recording) -> Checkpoint {
    let settings = Settings { epochs: 4, ..Settings::paper(Architecture::PAPER, 1) };
    train(recording, &settings, "test", &mut |_| ControlFlow::Continue(())).unwrap().checkpoint
}

/// Of a vehicle that drives straight on: nothing to hold the unit's axes against.
fn straight_on(now_ns: u64) -> Odometry {
    Odometry { valid_at_ns: now_ns, velocity_mps: [1.5, 0.0], ..Odometry::default() }
}

/// What the localisation says at tick `k`.
fn odometry(recording: &Recording, tick: usize) -> Odometry {
    let now = recording.runs[0].ticks[tick];
    Odometry {
        yaw_rate_radps: f64::from(now.yaw_rate_radps),
        velocity_mps: [f64::from(now.wheel_speed_mps), 0.0],
        valid_at_ns: now.time_ns,
        ..Odometry::default()
    }
}

fn planned(speed_mps: f32, curvature_per_m: f32) -> Command {
    Command { speed_mps, steering_rad: (0.3 * curvature_per_m).atan() }
}

/// One training for all that is asked of a corrector.
#[test]
fn correction_is_bounded_fades_and_is_counted() {
    let recording = two_grounds(3);
    let checkpoint = checkpoint(&recording);
    let corrector =
        |config: CorrectionConfig| Corrector::new(&checkpoint, config, Instructions::widest()).unwrap();
    changes_no_more_than_is_stated(&recording, &corrector);
    comes_and_goes_in_steps_and_ends_with_silence(&recording, &corrector);
    leaves_alone_what_it_does_not_know(&recording, &corrector);
    hears_a_turned_unit_by_the_odometry(&recording, &corrector);
    does_not_allocate_and_repeats_itself(&recording, &corrector);
    let config = CorrectionConfig { curvature_change_max_per_m: f32::NAN, ..CorrectionConfig::default() };
    let told = Corrector::new(&checkpoint, config, Instructions::widest()).unwrap_err().to_string();
    assert!(told.contains("curvature_change_max_per_m: expected from 0 to 2 1/m, found NaN"), "{told}");
}

fn changes_no_more_than_is_stated(recording: &Recording, corrector: &dyn Fn(CorrectionConfig) -> Corrector) {
    for most in [0.0, 0.01, 0.25] {
        let config =
            CorrectionConfig { curvature_change_max_per_m: most, share_step_max: 1.0, ..Default::default() };
        let mut corrector = corrector(config);
        let mut largest: f32 = 0.0;
        for tick in (20..1200).step_by(7) {
            let (samples, now_ns) = samples(recording, tick);
            corrector.sense(samples);
            let before = planned(1.5, 0.01 * (tick % 90) as f32);
            let after = corrector.correct(before, &straight_on(now_ns), now_ns);
            let curvature = |command: Command| command.steering_rad.tan() / 0.3;
            let change = curvature(after.command) - curvature(before);
            assert!(change.abs() <= most + 1e-5, "{change} {most}");
            assert!((change - after.curvature_change_per_m).abs() < 1e-4);
            assert_eq!(after.command.speed_mps, before.speed_mps);
            largest = largest.max(change.abs());
        }
        assert!(most == 0.0 || largest > 0.5 * most, "{largest} of {most}: the bound was never near");
        assert!(corrector.counts().bounded > 0 || most > 0.1);
    }
}

fn comes_and_goes_in_steps_and_ends_with_silence(
    recording: &Recording,
    corrector: &dyn Fn(CorrectionConfig) -> Corrector,
) {
    // A moment that is trusted whole, as nineteen of twenty are.
    let share = |tick: usize| {
        let mut corrector = corrector(CorrectionConfig { share_step_max: 1.0, ..Default::default() });
        let (heard, now_ns) = samples(recording, tick);
        corrector.sense(heard);
        corrector.correct(planned(1.5, 0.5), &straight_on(now_ns), now_ns).share
    };
    let familiar = (100..1000).step_by(10).find(|tick| share(*tick) == 1.0).unwrap();
    let mut corrector = corrector(CorrectionConfig { share_step_max: 0.25, ..Default::default() });
    let (heard, now_ns) = samples(recording, familiar);
    corrector.sense(heard);
    let shares: Vec<f32> =
        (0..6).map(|_| corrector.correct(planned(1.5, 0.5), &straight_on(now_ns), now_ns).share).collect();
    assert_eq!(shares[..4], [0.25, 0.5, 0.75, 1.0], "{shares:?}");
    // The unit falls silent.
    let late = corrector.correct(planned(1.5, 0.5), &straight_on(now_ns), now_ns + 51_000_000);
    assert_eq!(late.command, planned(1.5, 0.5));
    assert!(matches!(late.uncorrected, Some(Uncorrected::Imu(ImuFault::Late { .. }))), "{late:?}");
    let counts = corrector.counts();
    let bounded = counts.bounded;
    assert_eq!((counts.commands, counts.corrected + bounded, counts.as_planned(Reason::ImuLate)), (7, 6, 1));
}

fn leaves_alone_what_it_does_not_know(
    recording: &Recording,
    corrector: &dyn Fn(CorrectionConfig) -> Corrector,
) {
    let fresh = || corrector(CorrectionConfig::default());
    let (heard, now_ns) = samples(recording, 200);
    let unchanged = |corrector: &mut Corrector, command: Command, reason: fn(&Uncorrected) -> bool| {
        let after = corrector.correct(command, &straight_on(now_ns), now_ns);
        let same = after.command.steering_rad.to_bits() == command.steering_rad.to_bits();
        assert!(same && after.uncorrected.as_ref().is_some_and(reason), "{after:?}");
    };
    unchanged(&mut fresh(), planned(1.5, 0.5), |reason| {
        matches!(reason, Uncorrected::Imu(ImuFault::Short { .. }))
    });
    let mut corrector = fresh();
    corrector.sense(heard);
    unchanged(&mut corrector, planned(0.1, 0.5), |reason| *reason == Uncorrected::Slow);
    unchanged(&mut corrector, planned(-1.0, 0.5), |reason| *reason == Uncorrected::Slow);
    unchanged(&mut corrector, planned(1.5, f32::NAN), |reason| *reason == Uncorrected::NonFinite);
    // Ground that shakes as none did in training.
    let wild: Vec<ImuSample> = heard
        .iter()
        .map(|sample| {
            let [x, y, z] = sample.acceleration_mps2;
            ImuSample { acceleration_mps2: [20.0 * x, 20.0 * y, 9.81 + 8.0 * (z - 9.81)], ..*sample }
        })
        .collect();
    let mut corrector = fresh();
    corrector.sense(&wild);
    unchanged(&mut corrector, planned(1.5, 0.5), |reason| *reason == Uncorrected::Unfamiliar);
    assert_eq!(corrector.counts().as_planned(Reason::Unfamiliar), 1);
    // Faster than any model was asked for, and tighter.
    let mut corrector = fresh();
    corrector.sense(heard);
    unchanged(&mut corrector, planned(3.1, 0.5), |reason| *reason == Uncorrected::Unfamiliar);
    unchanged(&mut corrector, planned(1.5, 2.1), |reason| *reason == Uncorrected::Unfamiliar);
}

/// A unit that is turned the other way round about the upward axis, so that gravity says nothing.
fn hears_a_turned_unit_by_the_odometry(
    recording: &Recording,
    corrector: &dyn Fn(CorrectionConfig) -> Corrector,
) {
    let last = |sign: f32| {
        let mut corrector = corrector(CorrectionConfig::default());
        let mut last = None;
        for tick in 20..400 {
            let (heard, now_ns) = samples(recording, tick);
            let turned = |sample: &ImuSample| {
                let [x, y, rate] = sample.angular_rate_radps;
                ImuSample { angular_rate_radps: [x, y, sign * rate], ..*sample }
            };
            corrector.sense(&heard[WINDOW - 10..].iter().map(turned).collect::<Vec<_>>());
            last = corrector.correct(planned(1.5, 0.5), &odometry(recording, tick), now_ns).uncorrected;
        }
        last
    };
    let is_yaw_rate = |found: &Option<Uncorrected>| matches!(found, Some(Uncorrected::Imu(ImuFault::YawRate { factor, .. })) if *factor < 0.0);
    assert!(is_yaw_rate(&last(-1.0)), "{:?}", last(-1.0));
    assert!(!is_yaw_rate(&last(1.0)), "{:?}", last(1.0));
}

fn does_not_allocate_and_repeats_itself(
    recording: &Recording,
    corrector: &dyn Fn(CorrectionConfig) -> Corrector,
) {
    let run = |corrector: &mut Corrector| -> Vec<u32> {
        let commands = (20..400).map(|tick| {
            let (samples, now_ns) = samples(recording, tick);
            corrector.sense(&samples[WINDOW - 10..]);
            corrector.correct(planned(1.2, 0.4), &straight_on(now_ns), now_ns).command.steering_rad.to_bits()
        });
        commands.collect()
    };
    let config = CorrectionConfig::default();
    assert_eq!(run(&mut corrector(config)), run(&mut corrector(config)), "the same to the bit");
    let mut corrector = corrector(config);
    let (samples, now_ns) = samples(recording, 300);
    let counted = allocation_counter::measure(|| {
        corrector.sense(samples);
        for k in 0..50 {
            corrector.correct(planned(1.5, 0.5), &straight_on(now_ns), now_ns + k * PERIOD_NS);
        }
    });
    assert_eq!((counted.count_total, corrector.counts().corrected > 5), (0, true));
}
