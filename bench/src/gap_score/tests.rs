use std::collections::BTreeMap;

use formats::GapKind;
use serde_json::json;
use sim_to_real::{Condition, Estimate, NamedEffect, Place, Ranked, Shrink, Steering, Verdict};

use super::*;

fn label(kind: GapKind, effects: &[&str], injection: serde_json::Value) -> GapLabel {
    GapLabel {
        vehicle: "v".to_owned(),
        plant: "p".to_owned(),
        kind,
        effects: effects.iter().map(|id| (*id).to_owned()).collect(),
        magnitude: "m".to_owned(),
        style: "rich".to_owned(),
        injection: serde_json::from_value(injection).unwrap(),
    }
}

fn answer(verdict: Verdict, announced: &[&str], ranking: &[(&str, f64)]) -> Answer {
    let named = |id: &&str| NamedEffect { id: (*id).to_owned(), form: None, parameters: BTreeMap::new() };
    Answer {
        schema_version: sim_to_real::SCHEMA_VERSION,
        case: "c".to_owned(),
        steering: Steering::Angle,
        verdict,
        effects: announced.iter().map(named).collect(),
        by_part: Vec::new(),
        left: Vec::new(),
        swing: None,
        leaning: None,
        ranking: ranking
            .iter()
            .map(|(id, score)| Ranked { id: (*id).to_owned(), score: *score, support: None })
            .collect(),
        credible_set: announced.iter().map(|id| (*id).to_owned()).collect(),
        places: vec![Place { condition: Condition::SteeringChange, share: 0.5 }],
        shrink: Shrink {
            metric: String::new(),
            before: None,
            after: None,
            floor: 1.0,
            closed: None,
            closed_low: None,
            closed_high: None,
            predicted_closed: None,
            learned_bound_closed: None,
            position_error_2s_m: None,
        },
        errors_by_quantity: Vec::new(),
        pose_sensor: None,
        controller_model: None,
        in_simulator: None,
        advice: Vec::new(),
    }
}

fn case(label: GapLabel, answer: Answer) -> DiagnosedCase {
    DiagnosedCase { name: "c".to_owned(), label, answer, naming_s: None }
}

fn single(truth: &str, announced: &str, ranking: &[(&str, f64)]) -> DiagnosedCase {
    case(label(GapKind::Single, &[truth], json!({})), answer(Verdict::Effects, &[announced], ranking))
}

fn share(score: &Score, start: &str) -> (usize, usize) {
    let found = score.shares.iter().find(|share| share.name.starts_with(start)).unwrap();
    (found.n_hit, found.n)
}

#[test]
fn first_names_first_two_and_credible_sets_are_counted_for_single_effects() {
    let ranking = [("steer_lag", 0.7), ("steer_delay", 0.2), ("mass", 0.1)];
    let mut cases = vec![
        single("steer_lag", "steer_lag", &ranking),
        single("steer_delay", "steer_lag", &ranking),
        single("mass", "steer_lag", &ranking),
        case(label(GapKind::None, &[], json!({})), answer(Verdict::None, &[], &ranking)),
    ];
    cases[2].answer.credible_set = vec!["steer_lag".to_owned(), "mass".to_owned()];
    let score = score(&cases);
    assert_eq!(share(&score, "single effect, first name"), (1, 3));
    assert_eq!(share(&score, "single effect made by physics"), (0, 1));
    assert_eq!(share(&score, "single effect, among the first two"), (2, 3));
    assert_eq!(share(&score, "single effect, in the credible set"), (2, 3));
    assert_eq!(share(&score, "single or pair, exactly"), (1, 3));
    // Steering changes are the place of lag and delay, not of a mass.
    assert_eq!(share(&score, "single or pair, first place"), (2, 3));
    // Sets of 1, 1 and 2.
    assert_eq!(score.credible_set_size.mean, Some(4.0 / 3.0));
    assert_eq!(score.first_names_by[0].name, "size m");
    assert_eq!((score.first_names_by[0].n_hit, score.first_names_by[0].n), (1, 3));
}

#[test]
fn an_exact_set_has_all_names_no_others_and_nothing_unknown() {
    let pair = |verdict: Verdict, announced: &[&str]| {
        case(label(GapKind::Pair, &["mass", "steer_lag"], json!({})), answer(verdict, announced, &[]))
    };
    let score = score(&[
        pair(Verdict::Effects, &["steer_lag", "mass"]),
        pair(Verdict::Effects, &["steer_lag", "mass", "wind"]),
        pair(Verdict::Effects, &["steer_lag"]),
        pair(Verdict::EffectsAndUnknown, &["steer_lag", "mass"]),
    ]);
    assert_eq!(share(&score, "single or pair, exactly"), (1, 4));
    assert_eq!(share(&score, "pair, both"), (3, 4));
    let right: Vec<bool> = score.cases.iter().map(Hit::is_right).collect();
    assert_eq!(right, [true, false, false, false]);
}

#[test]
fn alarms_and_unknowns_are_counted_by_whether_an_effect_could_stand_for_them() {
    let none = |verdict: Verdict, announced: &[&str]| {
        case(label(GapKind::None, &[], json!({})), answer(verdict, announced, &[]))
    };
    let unknown = |id: &str, verdict: Verdict, announced: &[&str]| {
        case(label(GapKind::Unknown, &[id], json!({})), answer(verdict, announced, &[]))
    };
    let score = score(&[
        none(Verdict::None, &[]),
        none(Verdict::Unknown, &[]),
        none(Verdict::Effects, &["wind"]),
        unknown("unk_battery_sag", Verdict::Unknown, &[]),
        unknown("unk_battery_sag", Verdict::Effects, &["speed_scale"]),
        unknown("unk_command_dropout", Verdict::EffectsAndUnknown, &["steer_delay"]),
        unknown("unk_yaw_moment", Verdict::Effects, &["steer_bias"]),
        unknown("unk_yaw_moment", Verdict::Effects, &["wind"]),
        unknown("unk_trailer", Verdict::Unknown, &[]),
    ]);
    assert_eq!(share(&score, "nothing added"), (1, 3));
    assert_eq!(share(&score, "unknown that no effect"), (2, 3));
    assert_eq!(share(&score, "unknown that an effect"), (2, 3));
    // Wilson's interval of 1 of 3 with z = 1.96: (1/3 + z2/6 -+ z sqrt(2/27 + z2/36)) / (1 + z2/3).
    let z2 = 1.959964f64 * 1.959964;
    let (middle, half) = (1.0 / 3.0 + z2 / 6.0, (z2 * (2.0 / 27.0 + z2 / 36.0)).sqrt());
    let expected = [-1.0, 1.0].map(|side| (middle + side * half) / (1.0 + z2 / 3.0));
    for (found, expected) in score.shares[6].wilson.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-5, "{found} {expected}");
    }
}

fn announced(id: &str, parameters: &[(&str, [f64; 3])]) -> NamedEffect {
    let estimates = parameters.iter().map(|(name, [low, value, high])| {
        ((*name).to_owned(), Estimate { value: *value, low: *low, high: *high })
    });
    NamedEffect { id: id.to_owned(), form: None, parameters: estimates.collect() }
}

#[test]
fn parameters_are_off_relative_to_what_they_do() {
    let mut gain = single("steer_gain", "steer_gain", &[]);
    gain.label.injection = BTreeMap::from([("st_gain".to_owned(), json!(0.8))]);
    gain.answer.effects = vec![announced("steer_gain", &[("ratio", [0.81, 0.82, 0.83])])];
    let mut wind = single("wind", "wind", &[]);
    wind.label.injection = BTreeMap::from([("wind".to_owned(), json!([3.0, -4.0]))]);
    let found = [("east_mps2", [2.0, 3.3, 4.0]), ("north_mps2", [-5.0, -4.4, -3.0])];
    wind.answer.effects = vec![announced("wind", &found)];
    let mut wrong = single("mass", "wind", &[]);
    wrong.label.injection = BTreeMap::from([("mass".to_owned(), json!(1.4))]);
    let score = score(&[gain, wind, wrong]);
    let errors: Vec<&ParameterError> = score.cases.iter().flat_map(|hit| &hit.parameters).collect();
    // 0.02 of the 0.2 that are missing; a vector of length 0.5 beside one of length 5.
    for (error, covered) in errors.iter().zip([false, true]) {
        assert!((error.relative - 0.1).abs() < 1e-12, "{error:?}");
        assert_eq!(error.is_covered, covered);
    }
    assert_eq!(score.parameter_error.n, 2);
    assert_eq!(share(&score, "parameter inside"), (1, 2));
    assert_eq!(score.parameter_error_by_effect.len(), 2);
}

#[test]
fn closure_and_its_prediction_are_summed_over_cases_with_names() {
    let closing = |kind: GapKind, closed: Option<f64>| {
        let mut case = case(label(kind, &["mass"], json!({})), answer(Verdict::Effects, &["mass"], &[]));
        case.answer.shrink.closed = closed;
        case.answer.shrink.predicted_closed = Some(0.9);
        case
    };
    let score = score(&[
        closing(GapKind::Single, Some(1.0)),
        closing(GapKind::Single, Some(0.6)),
        closing(GapKind::Single, None),
        closing(GapKind::Unknown, Some(-3.0)),
    ]);
    assert_eq!((score.closed.n, score.closed.median), (2, Some(0.8)));
    assert!((score.closed.p10.unwrap() - 0.64).abs() < 1e-12);
    // 0.1 and 0.3.
    assert!((score.predicted_off.median.unwrap() - 0.2).abs() < 1e-12);
}

#[test]
fn scores_are_held_against_how_often_they_were_right() {
    let ranking = [("mass", 0.75), ("wind", 0.15)];
    let mut cases: Vec<_> = ["mass", "mass", "mass", "wind"].map(|id| single(id, "mass", &ranking)).into();
    cases.push(case(
        label(GapKind::Unknown, &["unk_trailer"], json!({})),
        answer(Verdict::Unknown, &[], &ranking),
    ));
    let found = score(&cases).calibration;
    let told: Vec<_> = found.bins.iter().map(|bin| (bin.low, bin.n, bin.mean_score, bin.share)).collect();
    assert_eq!(told, [(0.1, 4, 0.15, 0.25), (0.7, 4, 0.75, 0.75)]);
    // First names: three times 0.25^2, once 0.75^2. Second ones: three times 0.15^2, once 0.85^2.
    let first = (3.0 * 0.0625 + 0.5625) / 4.0;
    let second = (3.0 * 0.0225 + 0.7225) / 4.0;
    assert!((found.brier_first.unwrap() - first).abs() < 1e-12);
    assert!((found.brier.unwrap() - 0.5 * (first + second)).abs() < 1e-12);
    // Half of the scores are off by 0.1.
    assert!((found.expected_error.unwrap() - 0.05).abs() < 1e-12);
}

#[test]
fn the_confusion_matrix_counts_every_case_but_pairs_once() {
    let score = score(&[
        single("steer_lag", "steer_lag", &[]),
        single("steer_lag", "steer_delay", &[]),
        case(label(GapKind::None, &[], json!({})), answer(Verdict::None, &[], &[])),
        case(label(GapKind::Unknown, &["unk_trailer"], json!({})), answer(Verdict::Unknown, &[], &[])),
        case(label(GapKind::Pair, &["mass", "wind"], json!({})), answer(Verdict::Effects, &["mass"], &[])),
    ]);
    let Confusion { truths, answers, counts } = score.confusion;
    assert_eq!(truths, ["steer_lag", "unk_trailer", "none"]);
    assert_eq!(answers, ["steer_delay", "steer_lag", "none", "unknown"]);
    assert_eq!(counts, [[1, 1, 0, 0], [0, 0, 0, 1], [0, 0, 1, 0]]);
}

#[test]
fn nothing_to_score_is_no_number() {
    let score = score(&[]);
    assert_eq!((score.n_cases, score.closed.median, score.calibration.brier), (0, None, None));
    assert!(score.shares.iter().all(|share| share.share.is_none()));
}
