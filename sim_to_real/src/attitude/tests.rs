//! Bodies on springs, in steps of a millisecond: their equations of motion and none of the module's.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use super::*;
use crate::drive::testing::{log, machine};
use crate::engine_tests::{effect, normal};
use crate::machine::{GroundMap, Machine};
use bicycle::{Column, Effect};

/// Between rows [s].
const ROW_S: f64 = 0.02;
/// Steps of the body from row to row.
const STEPS: usize = 20;
/// Angular frequency of the body on its springs [1/s] and damping ratio.
const SPRING_RADPS: f64 = 9.0;
const DAMPING: f64 = 0.3;
const GRAVITY: f64 = 9.80665;

/// A body, and what pushes it besides its tyres.
#[derive(Clone, Copy)]
struct Body {
    /// Angle that the springs give per acceleration of the tyres, in pitch and roll [rad s2/m].
    softness: [f64; 2],
    mass_ratio: f64,
    drag_mps2: f64,
    /// Angles at which it stands [rad]: nose down, left side up.
    stands: [f64; 2],
    gyro_bias_radps: f64,
    /// Measured over true speed.
    odom_scale: f64,
    /// Of a measured angle.
    noise_rad: f64,
}

const SIMULATED: Body = Body {
    softness: [0.012, 0.02],
    mass_ratio: 1.0,
    drag_mps2: 0.0,
    stands: [0.003, 0.0],
    gyro_bias_radps: 0.0,
    odom_scale: 1.0,
    noise_rad: 0.004,
};

/// Height of hills [m].
fn height([east, north]: [f64; 2]) -> f64 {
    0.5 * (east / 7.0).sin() + 0.4 * (north / 9.0).cos()
}

fn hills() -> Machine {
    let n = 241;
    let at = |place: usize| height([place / n, place % n].map(|node| 0.5 * node as f64 - 60.0)) as f32;
    let ground = GroundMap {
        origin_m: [-60.0; 2],
        resolution_m: 0.5,
        n_nodes: [n; 2],
        height_m: (0..n * n).map(at).collect(),
        class: vec![0; n * n],
    };
    Machine { ground: Some(ground), ..machine() }
}

/// Slope under wheels a metre apart ahead of a point, and half of one to either side of their middle.
fn slope([x, y]: [f64; 2], yaw: f64) -> [f64; 2] {
    let at = |ahead: f64, left: f64| {
        height([x + ahead * yaw.cos() - left * yaw.sin(), y + ahead * yaw.sin() + left * yaw.cos()])
    };
    [at(1.0, 0.0) - at(0.0, 0.0), at(0.5, 0.5) - at(0.5, -0.5)]
}

/// A drive of 40 s in curves and with changes of speed, another for every seed.
fn drive(body: Body, machine: &Machine, seed: u64) -> Drive {
    let mut noise = normal(seed);
    let phase = [noise(), noise(), noise()];
    let [mut x, mut y, mut yaw] = [0.0, 0.0, phase[2]];
    let (mut angles, mut rates) = (body.stands, [0.0; 2]);
    let mut rows = Vec::new();
    for step in 0..(40.0 / ROW_S) as usize * STEPS {
        let (t, dt) = (step as f64 * ROW_S / STEPS as f64, ROW_S / STEPS as f64);
        let speed = 2.0 + 0.8 * (0.5 * t + phase[0]).sin();
        let faster = 0.4 * (0.5 * t + phase[0]).cos();
        let turning = 0.2 + 0.5 * (0.7 * t + phase[1]).sin();
        let [ahead, left] = slope([x, y], yaw);
        // What the tyres have to give: acceleration, gravity along the slope, and what drags.
        let tyres = [faster + GRAVITY * ahead + body.drag_mps2, speed * turning + GRAVITY * left];
        for axis in 0..2 {
            let [ground, against] = [[-ahead, left][axis], [-1.0, 1.0][axis]];
            let rests =
                ground + body.stands[axis] + against * body.softness[axis] * body.mass_ratio * tyres[axis];
            let pulled = SPRING_RADPS * SPRING_RADPS * (rests - angles[axis]);
            rates[axis] += dt * (pulled - 2.0 * DAMPING * SPRING_RADPS * rates[axis]);
            angles[axis] += dt * rates[axis];
        }
        if step % STEPS == 0 {
            rows.push([
                x,
                y,
                yaw,
                body.odom_scale * speed + 0.02 * noise(),
                turning + body.gyro_bias_radps + 0.005 * noise(),
                angles[1] + body.noise_rad * noise(),
                angles[0] + body.noise_rad * noise(),
                speed,
                turning / speed,
            ]);
        }
        x += dt * speed * yaw.cos();
        y += dt * speed * yaw.sin();
        yaw += dt * turning;
    }
    use Column::{CmdSpeed, CmdSteer, Pitch, Roll, Vx, Wz, X, Y, Yaw};
    let columns = [X, Y, Yaw, Vx, Wz, Roll, Pitch, CmdSpeed, CmdSteer];
    let of = |column: Column, t: f64| {
        rows[(t / ROW_S).round() as usize][columns.iter().position(|own| *own == column).unwrap()]
    };
    Drive::of(&log(&columns, rows.len(), ROW_S, of).runs().next().unwrap(), machine).unwrap()
}

/// What two drives of a body say, by three drives of the simulated one with the same springs.
fn evidence(body: Body, machine: &Machine) -> AttitudeEvidence {
    let simulated = Body { softness: body.softness, ..SIMULATED };
    let nominal = [1, 2, 3].map(|seed| drive(simulated, machine, seed));
    let real = [4, 5].map(|seed| drive(body, machine, seed));
    AttitudeModel::of(&nominal.iter().collect::<Vec<_>>())
        .map_or_else(AttitudeEvidence::default, |model| model.evidence(&real.iter().collect::<Vec<_>>()))
}

fn causes() -> Vec<Effect> {
    let single =
        [("rolling_drag", 0.3), ("quad_drag", 0.1), ("mass", 1.3), ("gyro_bias", 0.05), ("speed_scale", 0.9)];
    single.map(|(id, value)| effect(id, value)).to_vec()
}

fn support(evidence: &AttitudeEvidence, id: &str) -> f64 {
    causes()
        .iter()
        .filter(|cause| cause.description().id == id)
        .map(|cause| evidence.support(&[*cause]))
        .sum()
}

/// The springs' angles are those of the equations at rest: 1 + 9.80665 * 0.006 per slope, -0.006 per acceleration, and -9.80665
/// less: of a slope of a tenth, 0.006 * 9.80665 / 10 = 0.0059 rad.
#[test]
fn the_model_is_that_of_the_springs() {
    let machine = hills();
    let nominal = [1, 2, 3].map(|seed| drive(SIMULATED, &machine, seed));
    let model = AttitudeModel::of(&nominal.iter().collect::<Vec<_>>()).unwrap();
    let [pitch, roll] = model.axes.map(|axis| axis.coefficients);
    let per_slope = [0.012, 0.02].map(|softness| 1.0 + GRAVITY * softness);
    assert!((pitch[0] - 0.003).abs() < 5e-4 && (roll[0]).abs() < 5e-4, "{pitch:?} {roll:?}");
    assert!(
        (pitch[1] - per_slope[0]).abs() < 0.03 && (roll[1] - per_slope[1]).abs() < 0.03,
        "{pitch:?} {roll:?}"
    );
    assert!((pitch[2] + 0.012).abs() < 6e-4 && (roll[2] - 0.02).abs() < 6e-4, "{pitch:?} {roll:?}");
}

#[test]
fn a_body_that_nothing_else_pushes_says_nothing() {
    let evidence = evidence(SIMULATED, &hills());
    assert!(causes().iter().all(|cause| evidence.support(&[*cause]) < 1.5));
    assert_eq!(evidence.leaning(&[]), None);
}

/// 0.3 m/s2 tilt it by 0.0018 rad: noise of 0.004 rad averages to 0.0006 in a second and 0.00006 in 76.
#[test]
fn a_drag_tilts_it_and_a_scale_of_the_speed_does_not() {
    let dragged = evidence(Body { drag_mps2: 0.4, ..SIMULATED }, &hills());
    assert!(support(&dragged, "rolling_drag") > 4.0 && support(&dragged, "speed_scale") == 0.0);
    assert!(support(&dragged, "rolling_drag") > support(&dragged, "quad_drag"));
    // One that pushes is no drag, whatever the rollouts make of it.
    let pushed = evidence(Body { drag_mps2: -0.4, ..SIMULATED }, &hills());
    assert_eq!(support(&pushed, "rolling_drag"), 0.0);
    assert!(dragged.leaning(&causes()[..1]).is_none() && dragged.leaning(&[]).is_some());
}

#[test]
fn a_load_is_told_by_how_it_leans() {
    let loaded = evidence(Body { mass_ratio: 1.3, ..SIMULATED }, &hills());
    assert!(support(&loaded, "mass") > 4.0 && support(&loaded, "rolling_drag") < 1.5);
    assert_eq!(loaded.support(&[effect("mass", 0.8)]), 0.0);
}

/// A gyro that says 0.1 rad/s more has the body foretold from 0.2 m/s2 that are none at 2 m/s: 0.004 rad, for which no force
/// is to blame.
#[test]
fn a_gyro_says_why_a_body_seems_to_lean() {
    let biased = evidence(Body { gyro_bias_radps: 0.1, ..SIMULATED }, &hills());
    let leaning = biased.leaning(&[]).unwrap();
    assert!((leaning.roll_rad + 0.004).abs() < 0.001, "{leaning:?}");
    let of = |bias: f64| [effect("gyro_bias", bias)];
    assert_eq!(biased.leaning(&of(0.1)), None);
    assert!(biased.leaning(&of(-0.1)).is_some());
    assert!(biased.support(&of(0.1)) > 4.0 && biased.support(&of(-0.1)) == 0.0);
    let forces = causes().into_iter().filter(|cause| cause.description().id != "gyro_bias");
    assert!(forces.into_iter().all(|cause| biased.support(&[cause]) < 1.5));
}

/// Speeds that are told 1.3 times as large have the body foretold from accelerations that were not: as under a load of 1 / 1.3,
/// and better by what they are.
#[test]
fn speeds_that_are_told_too_large_are_no_load() {
    let scaled = evidence(Body { odom_scale: 1.3, ..SIMULATED }, &hills());
    let [load, scale] =
        [("mass", 0.8), ("odom_scale", 1.3)].map(|(id, value)| scaled.support(&[effect(id, value)]));
    assert!(scale > 4.0 && scale > load, "{load} {scale}");
    assert_eq!(scaled.support(&[effect("odom_scale", 0.8)]), 0.0);
}

/// A spring that gives way by 0.02 rad is no drag, and no gyro, and is told with its size.
#[test]
fn a_body_that_leans_for_no_cause_is_told_so() {
    let sagging = evidence(Body { stands: [0.003, -0.02], ..SIMULATED }, &hills());
    let leaning = sagging.leaning(&[]).unwrap();
    assert!(leaning.pitch_rad == 0.0 && (leaning.roll_rad + 0.02).abs() < 0.001, "{leaning:?}");
    assert!(causes().iter().all(|cause| sagging.support(&[*cause]) < 3.0));
    assert!(sagging.leaning(&causes()).is_some());
    let alone = [drive(Body { stands: [0.003, -0.02], ..SIMULATED }, &hills(), 4)];
    let nominal = [1, 2, 3].map(|seed| drive(SIMULATED, &hills(), seed));
    let model = AttitudeModel::of(&nominal.iter().collect::<Vec<_>>()).unwrap();
    assert_eq!(model.evidence(&alone.iter().collect::<Vec<_>>()).leaning(&[]), None);
}

#[test]
fn a_body_without_springs_or_on_unknown_ground_says_nothing() {
    let rigid = evidence(Body { softness: [0.0; 2], drag_mps2: 1.0, ..SIMULATED }, &hills());
    assert!(support(&rigid, "rolling_drag") < 1.5 && rigid.leaning(&[]).is_none());
    let nowhere = evidence(Body { drag_mps2: 1.0, stands: [0.05; 2], ..SIMULATED }, &machine());
    assert!(support(&nowhere, "rolling_drag") == 0.0 && nowhere.leaning(&[]).is_none());
}

/// A simulator without noise is no measure of a robot's: with four times as much, nothing is told that is not there.
#[test]
fn a_sensor_that_scatters_more_than_the_simulators_tells_less() {
    let machine = hills();
    let nominal = [1, 2, 3].map(|seed| drive(Body { noise_rad: 1e-5, ..SIMULATED }, &machine, seed));
    let model = AttitudeModel::of(&nominal.iter().collect::<Vec<_>>()).unwrap();
    let real = [4, 5].map(|seed| drive(Body { noise_rad: 0.016, ..SIMULATED }, &machine, seed));
    let evidence = model.evidence(&real.iter().collect::<Vec<_>>());
    assert!(
        causes().iter().all(|cause| evidence.support(&[*cause]) < 1.5) && evidence.leaning(&[]).is_none()
    );
}

/// A drive that asks for a rolling drag by so many standard deviations, and for nothing else.
pub(crate) fn dragged(strength: f64) -> AttitudeEvidence {
    let mut gram = Gram::zeros();
    let drag = 3;
    (gram[(0, 0)], gram[(drag, drag)]) = (strength * strength, 1.0);
    (gram[(0, drag)], gram[(drag, 0)]) = (strength, strength);
    AttitudeEvidence::of(vec![gram])
}

/// Of 36 = 6^2 that one size takes off whole, with 8 degrees of freedom: 9 / 2 ln(44 / 8) less 1.
#[test]
fn the_odds_are_students() {
    let found = dragged(6.0).support(&[effect("rolling_drag", 0.3)]);
    assert!((found - (4.5 * 5.5_f64.ln() - 1.0)).abs() < 1e-9, "{found}");
}

/// A second with a hole in it does not count: of 37 whole ones, 36 are left.
#[test]
fn a_hole_takes_its_second_out() {
    let whole = drive(SIMULATED, &hills(), 1);
    let n = whole.measured[0].len();
    let mut attitude = [vec![0.0; n], vec![0.0; n]];
    attitude[0][200] = f64::NAN;
    let (measured, smooth, gradient) = (&whole.measured, &whole.smooth, &whole.gradient);
    let rows = Rows { attitude: &attitude, measured, smooth, gradient, class: &whole.class };
    let left = blocks(&rows, 75).len();
    attitude[0][200] = 0.0;
    let rows = Rows { attitude: &attitude, measured, smooth, gradient, class: &whole.class };
    assert_eq!(blocks(&rows, 75).len() - left, 1);
}
