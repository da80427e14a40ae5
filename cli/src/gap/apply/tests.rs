use std::collections::BTreeMap;
use std::path::PathBuf;

use sim_to_real::{Estimate, Shrink, Steering};

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

#[test]
fn none_leaves_the_model_and_unknown_is_refused() {
    assert_eq!(effects(&answer(Verdict::None, Vec::new())), Ok(Vec::new()));
    assert!(effects(&answer(Verdict::Unknown, Vec::new())).unwrap_err().contains("found 'unknown'"));
}

#[test]
fn effects_that_no_model_can_hold_are_refused_by_name() {
    let refused = |named: NamedEffect| effects(&answer(Verdict::Effects, vec![named])).unwrap_err();
    let told = refused(named("steer_magic", &[]));
    assert!(told.contains("expected one of ") && told.contains("found 'steer_magic'"), "{told}");
    let told = refused(NamedEffect { id: "steer_lag".to_owned(), form: None, parameters: BTreeMap::new() });
    assert_eq!(told, "effects: steer_lag: expected parameter time_constant_s, found none");
    let told = refused(named("steer_lag", &[("time_constant_s", 1e6)]));
    assert!(told.starts_with("effect steer_lag: time_constant_s: expected "), "{told}");
}

#[test]
fn a_vehicle_stands_for_its_model() {
    let shipped = read_model(Path::new("sedan")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine.toml");
    std::fs::write(&path, formats::shipped_vehicle_text("sedan").unwrap()).unwrap();
    assert_eq!(read_model(&path).unwrap(), shipped);
    assert!(shipped.effects.is_empty());
    assert!(
        read_model(&folder.path().join("none.toml"))
            .unwrap_err()
            .0
            .contains("none.toml: expected a readable")
    );
}

/// Its steering effects mean yaw rates, which no angle can follow.
#[test]
fn a_skid_steered_machine_is_not_for_a_controller_that_steers_by_an_angle() {
    let gain = named("steer_gain", &[("ratio", 0.38)]);
    let skid = Answer { steering: Steering::YawRate, ..answer(Verdict::Effects, vec![gain.clone()]) };
    let told = effects(&skid).unwrap_err();
    assert!(told.contains("found one that is skid-steered"), "{told}");
    assert_eq!(effects(&answer(Verdict::Effects, vec![gain])).unwrap().len(), 1);
    // Where the file does not say, it is an angle; what a skid-steered diagnosis writes, it reads again.
    let text = serde_json::to_string(&skid).unwrap();
    assert_eq!(serde_json::from_str::<Answer>(&text).unwrap().steering, Steering::YawRate);
    let text = serde_json::to_string(&answer(Verdict::None, Vec::new())).unwrap();
    assert!(!text.contains("steering") && serde_json::from_str::<Answer>(&text).is_ok(), "{text}");
}

#[test]
fn a_motors_lag_needs_a_speed_loop_to_act_in() {
    let lag = Effect::from_values("drive_lag", [0.3, 0.0, 0.0, 0.0]).unwrap();
    let mut model = Model::of(&formats::read_vehicle("rc_car").unwrap());
    assert_eq!(fitting(lag, &model), Effect::from_values("speed_lag", [0.3, 0.0, 0.0, 0.0]).unwrap());
    model.effects.push(Effect::from_values("speed_loop", [0.4, 0.0, 0.0, 0.0]).unwrap());
    assert_eq!(fitting(lag, &model), lag);
}
