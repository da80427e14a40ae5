//! What follows a diagnosis: the manoeuvre that separates what is left open, driven on a plant of its own, and the
//! bound that a learned model sets.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod plant;

use bicycle::{Column, DriveLog};
use plant::{NOTHING, Wrong, drive, dull, lively};
use sim_to_real::{Baseline, Machine, Verdict, design_manoeuvre, diagnose, learned_bound, unseen_effects};
use std::sync::LazyLock;

fn machine() -> Machine {
    Machine {
        name: "test".to_owned(),
        wheelbase_m: plant::WHEELBASE_M,
        steering_max_rad: 0.45,
        speed_max_mps: 4.0,
        noise: None,
        ground: None,
    }
}

static NOMINAL: LazyLock<Vec<DriveLog>> =
    LazyLock::new(|| (0..3).map(|seed| drive(&lively(24.0, seed), NOTHING, seed)).collect());
static BASELINE: LazyLock<Baseline> =
    LazyLock::new(|| Baseline::calibrate(&machine(), &NOMINAL, &|_| ()).unwrap());

/// Dull drives leave several names open; the designed manoeuvre, driven on the same plant, leaves the true one.
fn designed_drive_separates(wrong: Wrong, truth: &str) {
    let mut real: Vec<DriveLog> =
        [0.0, 2.0].iter().zip(10..).map(|(phase, seed)| drive(&dull(24.0, *phase), wrong, seed)).collect();
    let open = diagnose(&BASELINE, &machine(), &real).unwrap();
    let names = open.answer("dull").credible_set;
    assert!(names.len() > 1 && names.iter().any(|name| name == truth), "{names:?}");
    let manoeuvre = design_manoeuvre(&BASELINE, &machine(), &open, (&NOMINAL, &real)).unwrap().unwrap();
    assert!(manoeuvre.odds > 10.0 * manoeuvre.odds_so_far);
    real.push(drive(&manoeuvre.commands, wrong, 20));
    let settled = diagnose(&BASELINE, &machine(), &real).unwrap().answer("settled");
    assert_eq!(settled.credible_set, [truth], "{settled:?}");
    assert_eq!(settled.verdict, Verdict::Effects);
}

#[test]
fn the_designed_drive_tells_a_steering_ratio_from_what_looks_like_it() {
    designed_drive_separates(Wrong { ratio: [0.8; 2], ..NOTHING }, "steer_gain");
}

#[test]
fn the_designed_drive_tells_a_late_steering_command_from_what_looks_like_it() {
    designed_drive_separates(Wrong { queue: 12, ..NOTHING }, "steer_delay");
}

#[test]
fn what_dull_drives_cannot_show_is_told_and_brought_out() {
    let real = [drive(&dull(24.0, 0.0), NOTHING, 30), drive(&dull(24.0, 1.0), NOTHING, 31)];
    let nothing = diagnose(&BASELINE, &machine(), &real).unwrap();
    assert_eq!(nothing.answer("").verdict, Verdict::None);
    let told = unseen_effects(&BASELINE, &machine(), &nothing, &real).unwrap().join("\n");
    assert!(
        told.contains("speed_lag") && told.contains("friction") && told.contains("2.5 to 2.5 m/s"),
        "{told}"
    );
    let manoeuvre = design_manoeuvre(&BASELINE, &machine(), &nothing, (&NOMINAL, &real)).unwrap().unwrap();
    assert_eq!(manoeuvre.separates[0], "none");
    assert!(manoeuvre.duration_s() < 35.0);
    let log = manoeuvre.commands_log();
    assert_eq!(log.n_rows(), manoeuvre.commands.len());
}

#[test]
fn lively_drives_leave_little_unseen() {
    let real = [drive(&lively(24.0, 40), NOTHING, 40)];
    let nothing = diagnose(&BASELINE, &machine(), &real).unwrap();
    let told = unseen_effects(&BASELINE, &machine(), &nothing, &real).unwrap().join("\n");
    assert!(!told.contains("steer_gain") && !told.contains("speed_lag"), "{told}");
}

/// A linkage that gives less to the left is in no catalogue, yet it depends on what the network sees.
#[test]
fn what_depends_on_the_state_can_be_learned() {
    let wrong = Wrong { ratio: [0.6, 1.1], ..NOTHING };
    let real = [50, 51].map(|seed| drive(&lively(30.0, seed), wrong, seed));
    let heldout = [drive(&lively(30.0, 52), wrong, 52)];
    let diagnosis = diagnose(&BASELINE, &machine(), &real).unwrap();
    let bound = learned_bound(&BASELINE, &machine(), &diagnosis, (&real, &heldout)).unwrap();
    assert!(bound.closed.unwrap() > 0.8, "{bound:?}");
    let again = learned_bound(&BASELINE, &machine(), &diagnosis, (&real, &heldout)).unwrap();
    assert_eq!(bound.error.to_bits(), again.error.to_bits());
}

#[test]
fn from_nothing_nothing_is_learned() {
    let real = [60, 61].map(|seed| drive(&lively(30.0, seed), NOTHING, seed));
    let heldout = [drive(&lively(30.0, 62), NOTHING, 62)];
    let diagnosis = diagnose(&BASELINE, &machine(), &real).unwrap();
    let bound = learned_bound(&BASELINE, &machine(), &diagnosis, (&real, &heldout)).unwrap();
    let unlearned = sim_to_real::verify(&BASELINE, &machine(), &diagnosis, &heldout).unwrap().errors[1];
    assert_eq!(bound.closed, None);
    assert!(bound.error < 1.1 * unlearned, "{bound:?} {unlearned}");
}

/// Drives without a commanded speed, whose speed sensor reads too much by a factor.
fn misread(logs: &[DriveLog], factor: f64) -> Vec<DriveLog> {
    let rebuilt = |log: &DriveLog| {
        let mut without = DriveLog::default();
        for row in log.runs().next().unwrap().drive_rows() {
            let speed = factor * row.value(Column::Vx);
            let row = row.with(Column::CmdSpeed, f64::NAN).with(Column::Vx, speed);
            without.push("", &row).unwrap();
        }
        without
    };
    logs.iter().map(rebuilt).collect()
}

/// Where the measured speed drives the model, a sensor that misreads it looks like wheels of another size: of the two
/// the drives judge the sensor alone, and nothing else may be named.
#[test]
fn what_the_columns_cannot_judge_is_not_named() {
    let nominal = misread(&NOMINAL, 1.0);
    let baseline = Baseline::calibrate(&machine(), &nominal, &|_| ()).unwrap();
    let real: Vec<DriveLog> = [70, 71].map(|seed| drive(&lively(24.0, seed), NOTHING, seed)).to_vec();
    let found = diagnose(&baseline, &machine(), &misread(&real, 1.08)).unwrap().answer("misread");
    assert_eq!(found.credible_set, ["odom_scale"], "{:?}", found.effects);
    assert_eq!(found.effects[0].id, "odom_scale");
    assert!(found.ranking.iter().all(|ranked| ranked.id != "speed_scale" || ranked.score == 0.0));
}
