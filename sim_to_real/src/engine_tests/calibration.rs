//! Calibration on drives of a made-up speed controller, in hills.

use super::normal;
use crate::calibration::calibrated;
use crate::drive::testing::{log, machine};
use crate::drive::{Drive, STEP_S};
use bicycle::{Column, Effect};

const GRAVITY_MPS2: f64 = 9.80665;

/// A controller that asks for (command - speed) / T + J times the integral of that distance, of which it gets what the drive
/// can give; the integral waits meanwhile.
#[derive(Clone, Copy)]
struct Controller {
    time_constant_s: f64,
    integral_per_s2: f64,
    /// Share of gravity that the world lets act along the slope.
    gravity: f64,
    /// Most that the drive gives, forwards and backwards.
    limit_mps2: f64,
    /// How fast the reference grows and falls.
    ramps_mps2: [f64; 2],
    /// By what share of the speed the wheels that are read slip for each acceleration of the drive.
    slip_s2_per_m: f64,
}

const STRONG: Controller = Controller {
    time_constant_s: 0.5,
    integral_per_s2: 0.0,
    gravity: 1.0,
    limit_mps2: f64::INFINITY,
    ramps_mps2: [f64::INFINITY; 2],
    slip_s2_per_m: 0.0,
};

/// Drives of 40 s over hills of 10 %: new speeds every three seconds, a slow weave, small steps of Euler's.
fn drive(controller: Controller, seed: u64) -> Drive {
    const SUBSTEPS: usize = 10;
    let mut noise = normal(seed);
    let [mut x, mut y, mut yaw, mut speed, mut integral] = [0.0, 0.0, 0.0, 2.0, 0.0];
    let n = (40.0 / STEP_S) as usize;
    let mut rows = Vec::with_capacity(n);
    let mut asked = 2.0;
    let [mut reference, mut given] = [asked, 0.0];
    let [up, down] = controller.ramps_mps2;
    for row in 0..n {
        if row % 150 == 0 {
            asked = 2.0 + 0.8 * noise().clamp(-1.5, 1.5);
        }
        let angle = 0.1 * (0.6 * row as f64 * STEP_S).sin();
        let slope = 0.1 * (0.8 * x + seed as f64).sin();
        rows.push([
            x + 0.01 * noise(),
            y + 0.01 * noise(),
            yaw + 0.003 * noise(),
            speed + 0.02 * noise(),
            speed * angle.tan() + 0.005 * noise(),
            asked,
            angle,
            0.0,
            -slope * yaw.cos(),
        ]);
        for _ in 0..SUBSTEPS {
            let step_s = STEP_S / SUBSTEPS as f64;
            reference += (asked - reference).clamp(-down * step_s, up * step_s);
            let distance = reference - speed * (1.0 + controller.slip_s2_per_m * given);
            let wanted = distance / controller.time_constant_s + integral;
            given = wanted.clamp(-controller.limit_mps2, controller.limit_mps2);
            if (wanted - given) * distance <= 0.0 {
                integral += controller.integral_per_s2 * distance * step_s;
            }
            let pull = controller.gravity * GRAVITY_MPS2 * slope * yaw.cos();
            speed += (given - pull) * step_s;
            yaw += speed * angle.tan() * step_s;
            x += speed * yaw.cos() * step_s;
            y += speed * yaw.sin() * step_s;
        }
    }
    let columns = [
        Column::X,
        Column::Y,
        Column::Yaw,
        Column::Vx,
        Column::Wz,
        Column::CmdSpeed,
        Column::CmdSteer,
        Column::Roll,
        Column::Pitch,
    ];
    let of = |column: Column, t: f64| {
        let place = columns.iter().position(|own| *own == column).unwrap();
        rows[(t / STEP_S).round() as usize][place]
    };
    Drive::of(&log(&columns, n, STEP_S, of).runs().next().unwrap(), &machine()).unwrap()
}

fn found(controller: Controller) -> Vec<Effect> {
    let drives = [1, 2, 3].map(|seed| drive(controller, seed));
    calibrated(machine().wheelbase_m, &drives.each_ref()).0
}

fn value(effects: &[Effect], id: &str) -> Option<f64> {
    effects.iter().find(|effect| effect.description().id == id).map(|effect| effect.values()[0])
}

#[test]
fn a_proportional_controller_is_taken_for_no_more() {
    let effects = found(STRONG);
    assert!((value(&effects, "speed_loop").unwrap() - 0.5).abs() < 0.03, "{effects:?}");
    assert_eq!(value(&effects, "slope_gravity"), Some(1.0));
    assert_eq!(value(&effects, "speed_integral"), None, "{effects:?}");
}

#[test]
fn an_integral_is_found_by_what_it_does_on_slopes() {
    let effects = found(Controller { integral_per_s2: 3.0, ..STRONG });
    assert!((value(&effects, "speed_integral").unwrap() - 3.0).abs() < 0.6, "{effects:?}");
    assert!((value(&effects, "speed_loop").unwrap() - 0.5).abs() < 0.1, "{effects:?}");
    assert_eq!(value(&effects, "slope_gravity"), Some(1.0));
}

/// A weak drive that hills of 10 % nearly ask all of. The fit ends first at a loop without any time constant behind limits,
/// which no force has power over.
#[test]
fn a_controller_is_found_behind_the_limits_of_its_drive() {
    let weak = Controller { time_constant_s: 0.2, integral_per_s2: 5.0, limit_mps2: 1.3, ..STRONG };
    let effects = found(weak);
    assert!((value(&effects, "speed_loop").unwrap() - 0.2).abs() < 0.05, "{effects:?}");
    assert!((value(&effects, "speed_integral").unwrap() - 5.0).abs() < 1.0, "{effects:?}");
    assert_eq!(value(&effects, "slope_gravity"), Some(1.0));
}

#[test]
fn in_a_world_without_gravity_none_is_calibrated() {
    let effects = found(Controller { gravity: 0.0, ..STRONG });
    assert_eq!(value(&effects, "slope_gravity"), Some(0.0));
    assert!((value(&effects, "speed_loop").unwrap() - 0.5).abs() < 0.03, "{effects:?}");
}

/// A proportional controller on a plant that feels two fifths of gravity: what is missing is compensated.
#[test]
fn a_controller_that_pushes_against_slopes_is_found() {
    let effects = found(Controller { gravity: 0.4, ..STRONG });
    assert_eq!(value(&effects, "slope_gravity"), Some(1.0));
    assert!((value(&effects, "felt_slope").unwrap() - 0.6).abs() < 0.05, "{effects:?}");
    assert!((value(&effects, "speed_loop").unwrap() - 0.5).abs() < 0.03, "{effects:?}");
}

/// A reference that grows by 0.7 m/s and falls by 1.1 m/s in a second.
#[test]
fn ramps_are_not_taken_for_limits_of_the_drive() {
    let effects = found(Controller { time_constant_s: 0.2, ramps_mps2: [0.7, 1.1], ..STRONG });
    let ramps = effects.iter().find(|effect| effect.description().id == "speed_ramp").map(Effect::values);
    let [up, down, ..] = ramps.unwrap();
    assert!((up - 0.7).abs() < 0.07 && (down - 1.1).abs() < 0.11, "{effects:?}");
    assert!((value(&effects, "speed_loop").unwrap() - 0.2).abs() < 0.05, "{effects:?}");
}

/// Wheels that slip by 0.06 for each m/s2: braked by 1 m/s2 at 2 m/s they turn 0.12 m/s too slowly.
#[test]
fn slip_of_the_wheels_that_are_read_is_found() {
    let effects = found(Controller { slip_s2_per_m: 0.06, ..STRONG });
    assert!((value(&effects, "wheel_slip").unwrap() - 0.06).abs() < 0.02, "{effects:?}");
    assert!((value(&effects, "speed_loop").unwrap() - 0.5).abs() < 0.05, "{effects:?}");
}
