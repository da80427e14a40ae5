//! Four-wheel reasoning beside closed forms and limits.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use friction::{
    Chassis, Coefficients, Controls, Dual, GRAVITY_MPS2, Plane, State, WheelInput, mass_properties, push,
    wheel_force,
};
use route::FrictionCurve;

const STEP_S: f64 = 1e-3;
const PARKED: Controls = Controls { edge_mps: [0.0; 4], steering_rad: 0.0 };

fn chassis() -> Chassis {
    Chassis::of(&formats::read_vehicle("pietra_full_size").unwrap())
}

/// The paper's tyre without load sensitivity on a chassis whose weight lies in the middle.
fn plain() -> Chassis {
    let chassis = chassis();
    Chassis {
        cog_ahead_m: 0.5 * chassis.wheelbase_m,
        slip_stiffness: [f64::INFINITY; 2],
        load_sensitivity: 0.0,
        ..chassis
    }
}

fn level(friction: FrictionCurve) -> Plane {
    Plane { friction, slope_rad: 0.0 }
}

/// The same friction at every speed of sliding but the slowest.
fn coulomb(friction: f32) -> FrictionCurve {
    FrictionCurve {
        static_friction: friction,
        sliding_friction: friction,
        viscous_friction: 0.0,
        stribeck_speed_mps: 0.1,
    }
}

fn moving(velocity: [f64; 3]) -> State {
    State { at_m: [0.0; 2], heading_rad: 0.0, velocity, specific_mps2: [0.0; 2] }
}

fn kinetic_j(chassis: &Chassis, state: &State) -> f64 {
    let [ahead, left, yaw] = state.velocity;
    0.5 * chassis.mass_kg * (ahead * ahead + left * left) + 0.5 * chassis.yaw_inertia_kgm2 * yaw * yaw
}

/// Four points at the corners of a rectangle of 2a x 2b: I_zz = m (a^2 + b^2), I_xx = m b^2, about the middle wherever it lies.
#[test]
fn mass_points_make_mass_centre_and_inertia() {
    let (a_m, b_m) = (1.2, 0.7);
    let corners = [[a_m, b_m], [a_m, -b_m], [-a_m, b_m], [-a_m, -b_m]];
    let points: Vec<_> = corners.iter().map(|[x, y]| ([x + 3.0, y - 1.0, 0.5], 250.0)).collect();
    let (mass_kg, centre_m, inertia) = mass_properties(&points).unwrap();
    assert_eq!(mass_kg, 1000.0);
    assert!((centre_m - nalgebra::Vector3::new(3.0, -1.0, 0.5)).norm() < 1e-12);
    assert!((inertia[(2, 2)] - 1000.0 * (a_m * a_m + b_m * b_m)).abs() < 1e-9);
    assert!((inertia[(0, 0)] - 1000.0 * b_m * b_m).abs() < 1e-9);
    assert!(inertia[(0, 1)].abs() < 1e-9);
    assert_eq!(mass_properties(&[]), None);
    assert_eq!(mass_properties(&[([0.0; 3], f64::NAN)]), None);
}

#[test]
fn weight_is_symmetric_at_rest_and_moves_against_the_force() {
    let chassis = plain();
    let weight_n = chassis.mass_kg * GRAVITY_MPS2;
    for load_n in chassis.loads_n([0.0; 2], GRAVITY_MPS2) {
        assert!((load_n - 0.25 * weight_n).abs() < 1e-9 * weight_n);
    }
    // Uphill at 15 degrees and 1.2 m/s2: moments about both axles' contacts (equations 5 and 6).
    let (slope_rad, accelerating_mps2) = (15.0_f64.to_radians(), 1.2);
    let along_mps2 = GRAVITY_MPS2 * slope_rad.sin() + accelerating_mps2;
    let across_mps2 = GRAVITY_MPS2 * slope_rad.cos();
    let loads_n = chassis.loads_n([along_mps2, 0.0], across_mps2);
    let Chassis { mass_kg, cog_height_m, cog_ahead_m, wheelbase_m, track_m, .. } = chassis;
    let front_n = mass_kg * (cog_ahead_m * across_mps2 - cog_height_m * along_mps2) / wheelbase_m;
    assert!((loads_n[0] + loads_n[1] - front_n).abs() < 1e-6 * front_n && front_n < 0.5 * weight_n);
    // A left bend loads the right wheels by h a / track of the weight over g.
    let loads_n = chassis.loads_n([0.0, 2.0], GRAVITY_MPS2);
    let moved_n = mass_kg * cog_height_m * 2.0 / track_m;
    let right_n = loads_n[1] + loads_n[3];
    assert!((right_n - 0.5 * weight_n - moved_n).abs() < 1e-6 * weight_n);
    // However hard, no wheel pulls the ground.
    assert!(chassis.loads_n([90.0, -90.0], GRAVITY_MPS2).iter().all(|load_n| *load_n >= 0.0));
    assert!((chassis.loads_n([90.0, -90.0], GRAVITY_MPS2).iter().sum::<f64>() - weight_n).abs() < 1e-6);
}

/// v^2 = v0^2 - 2 mu g s, and dv/dt = -mu(v) g for the full law.
#[test]
fn locked_wheels_slow_the_vehicle_as_their_friction_says() {
    let (chassis, start_mps) = (plain(), 10.0);
    let mut state = moving([start_mps, 0.0, 0.0]);
    while state.velocity[0] > 2.0 {
        state = chassis.step(&state, &PARKED, &level(coulomb(0.5)), STEP_S);
    }
    let expected_m = (start_mps * start_mps - state.velocity[0].powi(2)) / (2.0 * 0.5 * GRAVITY_MPS2);
    assert!((state.at_m[0] - expected_m).abs() < 2e-3 * expected_m, "{state:?}");
    assert!(state.at_m[1].abs() < 1e-9 && state.velocity[2].abs() < 1e-12);

    let next = chassis.step(&moving([3.0, 0.0, 0.0]), &PARKED, &level(FrictionCurve::ASPHALT), STEP_S);
    let found = (3.0 - next.velocity[0]) / STEP_S / GRAVITY_MPS2;
    assert!((found - f64::from(FrictionCurve::ASPHALT.at(3.0))).abs() < 1e-5, "{found}");
}

/// However much the tyres slip across, the centre of mass accelerates by mu g at most, and by that where all slide: the
/// fastest bend of radius r is sqrt(mu g r).
#[test]
fn a_bend_asks_for_no_more_than_the_ground_holds() {
    let (chassis, friction) = (plain(), 0.6_f32);
    let most_mps2 = f64::from(friction) * GRAVITY_MPS2;
    let (radius_m, mut largest_mps2) = (20.0, 0.0_f64);
    for speed_mps in [2.0, 5.0, 10.0, 20.0] {
        for drift in [0.0, 0.02, 0.1, 0.4] {
            let edge_mps = [speed_mps; 4];
            let state = moving([speed_mps, -drift * speed_mps, speed_mps / radius_m]);
            let controls = Controls { edge_mps, steering_rad: 0.1 };
            let next = chassis.step(&state, &controls, &level(coulomb(friction)), STEP_S);
            let [x, y] = next.specific_mps2;
            assert!(x.hypot(y) <= most_mps2 * (1.0 + 1e-9), "{speed_mps} {drift}");
            largest_mps2 = largest_mps2.max(x.hypot(y));
        }
    }
    assert!(largest_mps2 > 0.99 * most_mps2, "{largest_mps2}");

    // Held on the circle by its own slip: the drift at which friction turns the velocity as fast as the circle does.
    let holds = |speed_mps: f64| {
        (1..4000).any(|step| {
            let drift = 1e-3 * f64::from(step);
            let state = moving([speed_mps, -drift, 0.0]);
            let controls = Controls { edge_mps: [speed_mps; 4], steering_rad: 0.0 };
            let next = chassis.step(&state, &controls, &level(coulomb(friction)), STEP_S);
            next.specific_mps2[1] >= speed_mps * speed_mps / radius_m
        })
    };
    let fastest_mps = (most_mps2 * radius_m).sqrt();
    assert!(holds(0.99 * fastest_mps) && !holds(1.01 * fastest_mps));
}

/// Below the angle whose tangent is mu locked wheels hold but for the creep at which the law balances the slope; above it
/// they slide by g (sin - mu cos).
#[test]
fn a_hill_holds_up_to_the_angle_of_friction() {
    let (chassis, friction) = (plain(), 0.5_f64);
    let after = |slope_rad: f64, duration_s: f64| {
        let plane = Plane { friction: coulomb(friction as f32), slope_rad };
        (0..(duration_s / STEP_S) as usize)
            .fold(moving([0.0; 3]), |state, _| chassis.step(&state, &PARKED, &plane, STEP_S))
    };
    let angle_rad = friction.atan();
    let held = after(0.9 * angle_rad, 3.0);
    let creep_mps = -held.velocity[0];
    let balance = f64::from(coulomb(0.5).at(creep_mps as f32)) - (0.9 * angle_rad).tan();
    assert!((0.0..0.02).contains(&creep_mps) && balance.abs() < 1e-3, "{creep_mps} {balance}");
    let slope_rad = 1.3 * angle_rad;
    let expected_mps = 2.0 * GRAVITY_MPS2 * (slope_rad.sin() - friction * slope_rad.cos());
    let slid_mps = -after(slope_rad, 2.0).velocity[0];
    assert!((slid_mps - expected_mps).abs() < 0.02 * expected_mps, "{slid_mps} {expected_mps}");
}

#[test]
fn friction_never_gives_energy() {
    for chassis in [plain(), chassis()] {
        for friction in [FrictionCurve::ASPHALT, FrictionCurve::ICE, FrictionCurve::DIRT] {
            let mut state = moving([6.0, -3.0, 1.5]);
            let mut energy_j = kinetic_j(&chassis, &state);
            // Until it stands, within rounding.
            while energy_j > 1.0 {
                state = chassis.step(&state, &PARKED, &level(friction), STEP_S);
                let after_j = kinetic_j(&chassis, &state);
                assert!(after_j <= energy_j + 1e-6, "{friction:?}: {energy_j} J to {after_j} J");
                energy_j = after_j;
            }
        }
    }
}

fn wheel<const N: usize>(edge_mps: Dual<N>, slip_stiffness: Dual<N>) -> WheelInput<N> {
    WheelInput {
        edge_mps,
        steering_rad: Dual::from(0.2),
        slip_stiffness,
        grip: 0.9.into(),
        load_n: 3000.0.into(),
    }
}

#[test]
fn a_tyre_is_linear_for_little_slip_and_the_ground_s_for_much() {
    let ground = Coefficients::<0>::constant(&coulomb(0.7));
    let along = |slip: f64, stiffness: f64| {
        let rolling_mps = 10.0;
        let input = WheelInput {
            steering_rad: 0.0.into(),
            grip: 1.0.into(),
            ..wheel(Dual::from(rolling_mps), Dual::from(stiffness))
        };
        let velocity = [Dual::from(rolling_mps * (1.0 - slip)), 0.0.into(), 0.0.into()];
        wheel_force(&velocity, [0.0; 2], &input, &ground).0[0].value / input.load_n.value
    };
    assert!((along(0.02, 5.0) - 0.1).abs() < 2e-3);
    assert!((along(0.5, 12.0) - 0.7).abs() < 1e-5);
    // Infinitely stiff: the paper's law, which is what a very stiff one tends to.
    assert!((along(0.05, 1e9) - along(0.05, f64::INFINITY)).abs() < 1e-9);
}

/// The sign of equation 13 that drives: a wheel that turns faster than it rolls pushes ahead, and friction opposes sliding.
#[test]
fn spinning_wheels_push_and_sliding_ones_are_held() {
    let ground = Coefficients::<0>::constant(&FrictionCurve::DIRT);
    let force = |velocity: [f64; 3], edge_mps: f64| {
        let input = WheelInput { steering_rad: 0.0.into(), ..wheel(edge_mps.into(), 12.0.into()) };
        wheel_force(&velocity.map(Dual::from), [1.0, 0.5], &input, &ground).0.map(|force| force.value)
    };
    assert!(force([5.0, 0.0, 0.0], 6.0)[0] > 0.0 && force([5.0, 0.0, 0.0], 4.0)[0] < 0.0);
    assert!(force([5.0, 1.0, 0.0], 5.0)[1] < 0.0 && force([5.0, 0.0, -0.5], 5.0)[1] > 0.0);
}

/// With respect to all coefficients, the stiffness and all that moves.
#[test]
fn derivatives_are_those_of_central_differences() {
    let chassis = chassis();
    let at = [0.9, 0.6, 0.01, 3.0, 12.0, 6.0, 5.0, -0.6, 0.5];
    fn pushed<const N: usize>(chassis: &Chassis, all: [Dual<N>; 9]) -> [Dual<N>; 3] {
        let [statics, sliding, viscous, speed, stiffness, edge, ahead, left, yaw] = all;
        let ground = Coefficients([statics, sliding, viscous, speed]);
        let pushed = push(chassis, &[ahead, left, yaw], &[wheel(edge, stiffness); 4], &[ground; 4]);
        [pushed.specific_mps2[0], pushed.specific_mps2[1], pushed.moment_nm * 1e-3]
    }
    let found = pushed::<9>(&chassis, std::array::from_fn(|i| Dual::variable(at[i], i)));
    for i in 0..9 {
        let plain = |off: f64| {
            let moved: [Dual<0>; 9] =
                std::array::from_fn(|j| Dual::from(at[j] + if i == j { off } else { 0.0 }));
            pushed(&chassis, moved).map(|value| value.value)
        };
        let (above, below) = (plain(1e-6), plain(-1e-6));
        for ((above, below), found) in above.into_iter().zip(below).zip(found) {
            let (difference, slope) = ((above - below) / 2e-6, found.slope[i]);
            assert!(
                (slope - difference).abs() < 1e-6 * (1.0 + difference.abs()),
                "{i}: {slope} {difference}"
            );
        }
    }
}
