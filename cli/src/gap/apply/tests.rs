use std::path::PathBuf;

use bicycle::Effect;
use sim_to_real::{ControllerModel, Estimate, NamedEffect, Shrink, Steering};

use super::*;

fn named(id: &str, parameters: &[(&str, f64)]) -> NamedEffect {
    let estimate = |value: f64| Estimate { value, low: value, high: value };
    let parameters = parameters.iter().map(|(name, value)| ((*name).to_owned(), estimate(*value))).collect();
    NamedEffect { id: id.to_owned(), form: None, parameters }
}

fn answer(verdict: Verdict, effects: Vec<NamedEffect>) -> Answer {
    Answer {
        schema_version: sim_to_real::SCHEMA_VERSION,
        case: "c".to_owned(),
        steering: Steering::Angle,
        verdict,
        effects,
        by_part: Vec::new(),
        left: Vec::new(),
        swing: None,
        leaning: None,
        ranking: Vec::new(),
        credible_set: Vec::new(),
        places: Vec::new(),
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

#[test]
fn announced_effects_follow_those_of_the_model_with_their_values() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let lag = named("steer_lag", &[("time_constant_s", 0.25)]);
    formats::write_json_atomic(&file("a.json"), &answer(Verdict::Effects, vec![lag])).unwrap();
    let mut model = Model::of(&formats::read_vehicle("rc_car").unwrap());
    model.effects = vec![Effect::from_values("steer_lag", [0.5, 0.0, 0.0, 0.0]).unwrap()];
    std::fs::write(file("in.toml"), formats::model_text(&model).unwrap()).unwrap();
    let arguments = |force| GapApplyArguments {
        diagnosis: file("a.json"),
        model: file("in.toml"),
        out: file("out.toml"),
        force,
    };
    run(&arguments(false)).unwrap();
    let repaired = formats::read_model(&file("out.toml")).unwrap();
    assert_eq!(repaired.effects.len(), 2);
    assert_eq!(repaired.effects[0].values()[0], 0.5);
    assert_eq!((repaired.effects[1].description().id, repaired.effects[1].values()[0]), ("steer_lag", 0.25));
    assert_eq!((repaired.wheelbase_m, repaired.limits), (model.wheelbase_m, model.limits));
    let text = std::fs::read_to_string(file("out.toml")).unwrap();
    assert!(
        text.starts_with("# ") && text.contains("in.toml with steer_lag added, as diagnosed in case c\n"),
        "{text}"
    );
}

/// What is left unknown may be what is named, so that somebody has to take it on himself.
#[test]
fn a_part_that_is_unknown_is_applied_only_when_forced() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let lag = named("steer_lag", &[("time_constant_s", 0.25)]);
    formats::write_json_atomic(&file("a.json"), &answer(Verdict::EffectsAndUnknown, vec![lag])).unwrap();
    let arguments = |force| GapApplyArguments {
        diagnosis: file("a.json"),
        model: PathBuf::from("rc_car"),
        out: file("out.toml"),
        force,
    };
    let told = run(&arguments(false)).unwrap_err().to_string();
    assert!(told.contains("a.json: verdict: expected 'effects', or --force"), "{told}");
    assert!(!file("out.toml").exists());
    run(&arguments(true)).unwrap();
    assert_eq!(formats::read_model(&file("out.toml")).unwrap().effects.len(), 1);
}

/// What was measured takes the place of what the model had: the diagnosis was not made with that.
#[test]
fn the_model_that_was_measured_takes_the_place_of_the_old_effects() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let effect = |id: &str, value: f64| Effect::from_values(id, [value, 0.0, 0.0, 0.0]).unwrap();
    let measured = ControllerModel {
        nominal: vec![effect("speed_scale", 0.98)],
        causes: vec![effect("steer_lag", 0.21)],
        foretold_losses: Some([3.0, 1.0]),
    };
    let announced = answer(Verdict::Effects, vec![named("steer_lag", &[("time_constant_s", 0.25)])]);
    let answer = Answer { controller_model: Some(measured.clone()), ..announced };
    formats::write_json_atomic(&file("a.json"), &answer).unwrap();
    let mut model = Model::of(&formats::read_vehicle("rc_car").unwrap());
    model.effects = vec![effect("speed_scale", 0.5)];
    std::fs::write(file("in.toml"), formats::model_text(&model).unwrap()).unwrap();
    let arguments = GapApplyArguments {
        diagnosis: file("a.json"),
        model: file("in.toml"),
        out: file("out.toml"),
        force: false,
    };
    run(&arguments).unwrap();
    let repaired = formats::read_model(&file("out.toml")).unwrap();
    assert_eq!(repaired.effects, measured.effects());
    // What nobody could have measured is refused, and the file of before stays.
    let text = std::fs::read_to_string(file("a.json")).unwrap();
    std::fs::write(file("a.json"), text.replace("0.21", "-3.0")).unwrap();
    let told = run(&arguments).unwrap_err().to_string();
    assert!(told.contains("a.json: ") && told.contains("time_constant_s: expected "), "{told}");
    assert_eq!(formats::read_model(&file("out.toml")).unwrap(), repaired);
    assert_eq!((repaired.wheelbase_m, repaired.limits), (model.wheelbase_m, model.limits));
}
