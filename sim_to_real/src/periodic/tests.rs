//! Machines that swing by a known amount.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use super::*;
use crate::drive::testing::{log, machine};
use crate::engine_tests::normal;
use bicycle::Column;
use std::f64::consts::TAU;

const ROW_S: f64 = 0.02;

/// A drive of 40 s of a machine that turns late, with what its yaw rate does besides, of time and way.
fn drive(seed: u64, swing: impl Fn(f64, f64) -> f64) -> Drive {
    let mut noise = normal(seed);
    let (mut way, mut turning, mut speed, mut angle) = (0.0, 0.0, 2.0, 0.0_f64);
    let mut rows = Vec::new();
    for row in 0..2000 {
        if row % 75 == 0 {
            speed = 2.0 + 0.7 * noise().clamp(-1.5, 1.5);
            angle = (0.12 * noise()).clamp(-0.3, 0.3);
        }
        turning += ROW_S / 0.15 * (speed * angle.tan() - turning);
        let measured = turning + swing(row as f64 * ROW_S, way) + 0.01 * noise();
        rows.push([speed, measured, speed, angle]);
        way += speed * ROW_S;
    }
    let columns = [Column::Vx, Column::Wz, Column::CmdSpeed, Column::CmdSteer];
    let of = |column: Column, t: f64| {
        rows[(t / ROW_S).round() as usize][columns.iter().position(|own| *own == column).unwrap()]
    };
    Drive::of(&log(&columns, rows.len(), ROW_S, of).runs().next().unwrap(), &machine()).unwrap()
}

/// What two drives of a machine swing by, besides three nominal ones.
fn swing(nominal: &dyn Fn(f64, f64) -> f64, real: [&dyn Fn(f64, f64) -> f64; 2]) -> Option<Swing> {
    let nominal = [1, 2, 3].map(|seed| drive(seed, nominal));
    let real = [4, 5].map(|seed| drive(seed, real[seed as usize - 4]));
    let response = YawResponse::of(1.0, &nominal.iter().collect::<Vec<_>>()).unwrap();
    response.swing(&real.iter().collect::<Vec<_>>()).map(|(swing, _)| swing)
}

fn nothing(_: f64, _: f64) -> f64 {
    0.0
}

/// Half of the noise of a single row.
const AMPLITUDE_RADPS: f64 = 0.005;

fn shimmy(t: f64, _: f64) -> f64 {
    AMPLITUDE_RADPS * (TAU * 1.3 * t).sin()
}

/// Of a wheel with a radius of 0.2 m.
fn wobble(_: f64, way: f64) -> f64 {
    AMPLITUDE_RADPS * (way / 0.2 + 0.7).sin()
}

#[test]
fn a_swing_is_told_by_how_often_and_by_how_much() {
    let told = swing(&nothing, [&shimmy, &shimmy]).unwrap();
    assert_eq!(told.over, SwingOver::Time);
    assert!(
        (told.frequency - 1.3).abs() < 0.02 && (told.amplitude_radps - AMPLITUDE_RADPS).abs() < 0.001,
        "{told:?}"
    );
    let told = swing(&nothing, [&wobble, &wobble]).unwrap();
    assert_eq!(told.over, SwingOver::Way);
    assert!((told.frequency - 1.0 / (TAU * 0.2)).abs() < 0.01, "{told:?}");
    assert!((told.amplitude_radps - AMPLITUDE_RADPS).abs() < 0.001, "{told:?}");
}

#[test]
fn what_no_drive_or_not_every_one_holds_is_none() {
    assert_eq!(swing(&nothing, [&nothing, &nothing]), None);
    assert_eq!(swing(&nothing, [&shimmy, &nothing]), None);
    assert_eq!(swing(&nothing, [&shimmy, &wobble]), None);
}

#[test]
fn what_the_simulator_swings_by_as_well_is_none() {
    assert_eq!(swing(&shimmy, [&shimmy, &shimmy]), None);
    assert_eq!(swing(&wobble, [&wobble, &wobble]), None);
}

/// 0.3 cos and 0.4 sin are 0.5 together, over whole periods; what is missing and what lies far off count for little.
#[test]
fn an_amplitude_is_that_of_the_swing() {
    let value = |k: usize| {
        let (sine, cosine) = (TAU * 2.0 * 0.02 * k as f64).sin_cos();
        0.3 * cosine + 0.4 * sine
    };
    let amplitude = |spoiled: &dyn Fn(usize) -> f64| {
        Series::of((0..1000).map(|k| (0.0, spoiled(k))), 0.02).amplitude(SwingOver::Time, 2.0)
    };
    // The mean of two rows takes (1 - cos(pi 2 0.02)) = 0.8 % off.
    assert!((amplitude(&value) - 0.5).abs() < 0.005, "{}", amplitude(&value));
    let spoiled = |k: usize| {
        if k == 100 {
            f64::NAN
        } else if k == 200 {
            1e6
        } else {
            value(k)
        }
    };
    assert!((amplitude(&spoiled) - 0.5).abs() < 0.02, "{}", amplitude(&spoiled));
}
