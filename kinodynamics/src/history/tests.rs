use super::*;

const AGE_MAX_NS: u64 = 50_000_000;

/// Sample `k` of a vehicle on level ground that shakes a little.
fn sample(k: u64) -> ImuSample {
    let shake = if k.is_multiple_of(2) { 0.3 } else { -0.3 };
    ImuSample {
        valid_at_ns: 1_000_000_000 + k * PERIOD_NS,
        acceleration_mps2: [0.1, shake, 9.81 + shake],
        angular_rate_radps: [0.0, shake, 0.001 * k as f32],
    }
}

fn filled(ks: impl IntoIterator<Item = u64>, change: impl Fn(u64, &mut ImuSample)) -> ImuHistory {
    let mut history = ImuHistory::new(ImuRange::default());
    for k in ks {
        let mut sample = sample(k);
        change(k, &mut sample);
        history.push(&sample);
    }
    history
}

fn fault(history: &ImuHistory, last: u64) -> Option<ImuFault> {
    history.window(sample(last).valid_at_ns, AGE_MAX_NS).err()
}

#[test]
fn window_holds_the_newest_samples_from_old_to_new() {
    let history = filled(0..137, |_, _| {});
    let window: Vec<f32> =
        history.window(sample(136).valid_at_ns, 0).unwrap().map(|sample| sample[2]).collect();
    let expected: Vec<f32> = (37..137).map(|k| 0.001 * k as f32).collect();
    assert_eq!(window, expected);
}

#[test]
fn history_is_short_until_half_a_second_is_there_and_again_after_a_gap() {
    assert_eq!(fault(&filled(0..99, |_, _| {}), 98), Some(ImuFault::Short { found: 99 }));
    assert_eq!(fault(&filled(0..100, |_, _| {}), 99), None);
    // Samples 100 to 103 are missing: one more than may be made up.
    let history = filled((0..100).chain(104..120), |_, _| {});
    assert_eq!(fault(&history, 119), Some(ImuFault::Short { found: 16 }));
    assert_eq!(history.counts().gaps, 1);
}

#[test]
fn few_missing_samples_are_the_last_before_them() {
    let history = filled((0..100).chain(103..110), |_, _| {});
    assert_eq!(fault(&history, 109), None);
    let window: Vec<f32> = history.window(sample(109).valid_at_ns, 0).unwrap().map(|s| s[2]).collect();
    // 10 to 99, then 99 twice for 100, 101 and 102 without themselves, then 103 to 109.
    let mut expected: Vec<f32> = (10..100).map(|k| 0.001 * k as f32).collect();
    expected.extend([0.001 * 99.0; 3]);
    expected.extend((103..110).map(|k| 0.001 * k as f32));
    assert_eq!(window, expected);
    assert_eq!(history.counts().made_up, 3);
}

#[test]
fn other_rates_are_told() {
    let history = filled((0..300).step_by(2), |_, _| {});
    let told = fault(&history, 298).unwrap().to_string();
    assert!(told == "expected 200 Hz, found 100 Hz" || told == "expected 200 Hz, found 99 Hz", "{told}");
    // Twice as fast: a hundred samples are a quarter of a second.
    let history = filled(0..300, |k, sample| sample.valid_at_ns = 1_000_000_000 + k * PERIOD_NS / 2);
    let told = history.window(1_000_000_000 + 150 * PERIOD_NS, AGE_MAX_NS).err().unwrap().to_string();
    assert_eq!(told, "expected 200 Hz, found 400 Hz");
}

#[test]
fn clocks_that_are_ahead_or_set_back_are_noticed() {
    let history = filled(0..100, |_, _| {});
    let now_ns = sample(99).valid_at_ns - AGE_MAX_NS - 1;
    let found = history.window(now_ns, AGE_MAX_NS).err();
    assert_eq!(found, Some(ImuFault::FromFuture { ahead_ns: AGE_MAX_NS + 1 }));
    // A second ahead for a while, then right again: it starts anew, and is whole after half a second.
    let ahead = |k: u64, sample: &mut ImuSample| {
        if k < 300 {
            sample.valid_at_ns += 1_000_000_000;
        }
    };
    assert_eq!(fault(&filled(0..350, ahead), 349), Some(ImuFault::Short { found: 50 }));
    assert_eq!(fault(&filled(0..400, ahead), 399), None);
}

#[test]
fn silence_is_late() {
    let history = filled(0..100, |_, _| {});
    let late_ns = sample(99).valid_at_ns + AGE_MAX_NS;
    assert!(history.window(late_ns, AGE_MAX_NS).is_ok());
    let found = history.window(late_ns + 1, AGE_MAX_NS).err();
    assert_eq!(found, Some(ImuFault::Late { allowed_ns: AGE_MAX_NS, found_ns: AGE_MAX_NS + 1 }));
}

#[test]
fn broken_numbers_start_it_anew_and_old_samples_are_left_out() {
    let history = filled(0..150, |k, sample| {
        if k == 120 {
            sample.angular_rate_radps[1] = f32::NAN;
        }
    });
    assert_eq!(fault(&history, 149), Some(ImuFault::Short { found: 29 }));
    assert_eq!(history.counts().non_finite, 1);
    let history = filled((0..100).chain([99, 50]).chain(100..110), |_, _| {});
    assert_eq!((fault(&history, 109), history.counts().disordered), (None, 2));
}

#[test]
fn saturation_is_told_when_more_than_a_twentieth_reaches_the_range() {
    let clipped = |n: u64| {
        filled(0..100, move |k, sample| {
            if k < n {
                sample.acceleration_mps2[0] = -156.9;
            }
        })
    };
    assert_eq!(fault(&clipped(5), 99), None);
    assert_eq!(fault(&clipped(6), 99), Some(ImuFault::Saturated { found: 6 }));
}

#[test]
fn axes_in_another_order_and_other_units_are_told_by_gravity() {
    let swapped = filled(0..100, |_, sample| sample.acceleration_mps2.rotate_right(1));
    let told = fault(&swapped, 99).unwrap().to_string();
    assert!(told.contains("found a mean of 9.8, 0.1, 0.0 m/s2"), "{told}");
    let in_g =
        filled(0..100, |_, sample| sample.acceleration_mps2 = sample.acceleration_mps2.map(|a| a / 9.81));
    assert!(matches!(fault(&in_g, 99), Some(ImuFault::Gravity { .. })));
    let upside_down = filled(0..100, |_, sample| sample.acceleration_mps2[2] *= -1.0);
    assert!(matches!(fault(&upside_down, 99), Some(ImuFault::Gravity { .. })));
}

#[test]
fn readings_that_never_change_are_told() {
    let frozen = filled(0..100, |_, sample| {
        (sample.acceleration_mps2, sample.angular_rate_radps) = ([0.0, 0.0, 9.81], [0.0; 3]);
    });
    assert_eq!(fault(&frozen, 99), Some(ImuFault::Frozen));
}
