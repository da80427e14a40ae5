//! Every departure of the machine, held against what physics says it does.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

#[allow(dead_code, reason = "each test file takes what it needs")]
mod plant_machines;

use std::sync::Arc;

use bicycle::{Command, Differential, Vehicle};
use plant_machines::*;
use scenarios::{Deviation, OdometryConfig, OdometrySensor, Patch, Plant, PlantError, Stribeck, World};
use terrain::GridGeometry;

/// Time constant of the speed servo without its integral: the motor's 0.15 s and 0.08 s of its own.
const DROOP_S: f64 = 0.23;
const MASS_KG: f64 = 1500.0;
/// The wheels' inertia as mass: 4 x 5 kg m2 over 0.44 m squared.
const SPINNING_KG: f64 = 4.0 * 5.0 / (0.44 * 0.44);
/// Of the tyres: force over load and slip.
const STIFFNESS: f64 = 12.0;

/// Speed lost per deceleration that the tyres have to overcome: the servo's droop and the slip [s].
fn lost_s(speed_mps: f64) -> f64 {
    DROOP_S + speed_mps / (STIFFNESS * G)
}

/// Friction of wheels over their difference of speed: differentials of 0.25 s/m in series with the tyres [s/m].
fn coupling_s_per_m(speed_mps: f64) -> f64 {
    1.0 / (1.0 / 0.25 + speed_mps / STIFFNESS)
}

/// Friction of 0.9 at every slip speed.
fn firm() -> Stribeck {
    coulomb(0.9)
}

fn machine() -> Vehicle {
    let mut vehicle = full_size();
    vehicle.tyre.load_sensitivity = 0.0;
    vehicle.limits.acceleration_max_mps2 = 50.0;
    vehicle
}

fn on(world: Arc<World>, vehicle: &Vehicle, deviations: &[Deviation]) -> Plant {
    Plant::deviating(vehicle, deviations, world, [0.0; 3]).unwrap()
}

fn on_level(deviations: &[Deviation]) -> Plant {
    on(level(firm()), &machine(), deviations)
}

fn forward_mps(plant: &Plant) -> f64 {
    plant.motion().velocity_mps[0]
}

/// Curvature in a steady bend [1/m].
fn curvature(vehicle: &Vehicle, deviations: &[Deviation], speed_mps: f32, steering_rad: f32) -> f64 {
    let mut plant = on(level(firm()), vehicle, deviations);
    drive(&mut plant, speed_mps, steering_rad, 8.0);
    let motion = plant.motion();
    motion.angular_rate_radps[2] / motion.velocity_mps[0]
}

/// Steady speed without the integral of the speed servo [m/s].
fn drooping_mps(world: Arc<World>, deviation: Option<Deviation>, speed_mps: f32) -> f64 {
    let deviations: Vec<_> = [Deviation::MotorDroop].into_iter().chain(deviation).collect();
    let mut plant = on(world, &machine(), &deviations);
    drive(&mut plant, speed_mps, 0.0, 8.0);
    forward_mps(&plant)
}

#[track_caller]
fn near(found: f64, expected: f64, share: f64) {
    assert!((found / expected - 1.0).abs() < share, "found {found}, expected {expected}");
}

#[test]
fn a_slower_servo_reaches_1_minus_1_over_e_after_its_response() {
    let mut vehicle = prompt(machine());
    vehicle.limits.steering_rate_max_radps = 100.0;
    let mut plant = on(level(firm()), &vehicle, &[Deviation::SteeringResponse { added_s: 0.295 }]);
    drive(&mut plant, 0.0, 0.2, 0.3);
    near(plant.motion().steering_rad, 0.2 * (1.0 - (-1.0f64).exp()), 0.01);
}

#[test]
fn a_rate_limited_servo_turns_at_its_rate() {
    let mut plant = on(level(firm()), &prompt(machine()), &[Deviation::SteeringRate { rate_radps: 0.2 }]);
    drive(&mut plant, 0.0, 0.5, 1.0);
    near(plant.motion().steering_rad, 0.2, 0.01);
}

#[test]
fn delays_hold_back_their_own_actuator_only() {
    let vehicle = prompt(machine());
    let moved = |deviation: Deviation, after_s: f64| {
        let mut plant = on(level(firm()), &vehicle, &[deviation]);
        drive(&mut plant, 3.0, 0.2, after_s);
        [plant.motion().steering_rad > 0.01, plant.motion().wheel_speed_mps > 0.05]
    };
    assert_eq!(moved(Deviation::SteeringDelay { added_s: 0.25 }, 0.249), [false, true]);
    assert_eq!(moved(Deviation::MotorDelay { added_s: 0.25 }, 0.249), [true, false]);
    for deviation in [Deviation::SteeringDelay { added_s: 0.25 }, Deviation::MotorDelay { added_s: 0.25 }] {
        assert_eq!(moved(deviation, 0.4), [true, true]);
    }
}

#[test]
fn trim_and_ratio_bend_the_path_as_the_angle_they_add() {
    near(
        curvature(&machine(), &[Deviation::SteeringTrim { angle_rad: 0.05 }], 2.0, 0.0),
        0.05f64.tan() / 2.5,
        0.03,
    );
    let straight = curvature(&machine(), &[], 2.0, 0.0);
    assert!(straight.abs() < 1e-4, "{straight}");
    let bent = Deviation::SteeringRatio { left: 0.8, right: 1.2 };
    near(curvature(&machine(), &[bent], 2.0, 0.3), 0.24f64.tan() / 2.5, 0.03);
    near(curvature(&machine(), &[bent], 2.0, -0.3), -0.36f64.tan() / 2.5, 0.03);
}

#[test]
fn play_keeps_the_wheels_where_they_were_pushed_to() {
    let mut plant = on_level(&[Deviation::SteeringPlay { half_width_rad: 0.04 }]);
    drive(&mut plant, 1.0, 0.2, 3.0);
    near(plant.motion().steering_rad, 0.16, 0.01);
    drive(&mut plant, 1.0, 0.0, 3.0);
    near(plant.motion().steering_rad, 0.04, 0.01);
}

#[test]
fn a_front_axle_that_gives_way_understeers_with_the_square_of_the_speed() {
    // Half of the mass on the front axle: 750 kg. Beside 750 v^2 kappa it holds the moment of the differentials, which
    // is the weight times the coupling times the wheels' difference of speed, half the track times v kappa, on half the
    // track; and against that moment alone the steering asks for 1.384 of the way to locked wheels already.
    let soft = Deviation::SteeringCompliance { rad_per_n: 1e-5 };
    for speed_mps in [4.0f32, 8.0] {
        let ratio =
            curvature(&machine(), &[], speed_mps, 0.04) / curvature(&machine(), &[soft], speed_mps, 0.04);
        let speed_mps = f64::from(speed_mps);
        let coupling_n =
            MASS_KG * G * coupling_s_per_m(speed_mps) * speed_mps * (0.5 * 1.55f64).powi(2) / 2.5;
        let locked = coupling_s_per_m(speed_mps) * speed_mps / STIFFNESS;
        let wider = 1.0 + (1.55f64 / 2.5).powi(2) * locked;
        // 1e-5 rad per newton out of kappa L.
        near(ratio - 1.0, 1e-5 * (750.0 * speed_mps.powi(2) + coupling_n) / (2.5 * wider), 0.04);
    }
}

#[test]
fn soft_front_tyres_understeer() {
    // Slip angle = (v^2 kappa / g) / C on each axle: steering = kappa (L + v^2 / g (1 / Cf - 1 / Cr)).
    let soft = Deviation::TyreStiffness { front: 0.25, rear: 1.0 };
    let mut vehicle = machine();
    vehicle.drivetrain.differential = Differential::Open;
    let [found, sound] = [&[soft][..], &[]].map(|deviations| curvature(&vehicle, deviations, 8.0, 0.02));
    let more_m = 8.0 * 8.0 / G * (1.0 / 0.25 - 1.0) / STIFFNESS;
    near(sound / found, (2.5 + more_m) / 2.5, 0.03);
}

#[test]
fn hard_rubber_lengthens_the_way_to_a_stop() {
    let mut vehicle = prompt(machine());
    vehicle.drivetrain.brake_torque_max_nm = 20_000.0;
    let mut plant = on(level(coulomb(0.8)), &vehicle, &[Deviation::TyreGrip { factor: 0.5 }]);
    drive(&mut plant, 8.0, 0.0, 8.0);
    let [x_m, speed_mps] = [plant.pose().x_m, forward_mps(&plant)];
    drive(&mut plant, 0.0, 0.0, 8.0);
    near(plant.pose().x_m - x_m, speed_mps * speed_mps / (2.0 * 0.4 * G), 0.04);
}

#[test]
fn a_slower_motor_follows_the_ramp_by_its_response() {
    let mut vehicle = prompt(machine());
    vehicle.limits.acceleration_max_mps2 = 1.5;
    vehicle.tyre.rolling_resistance = 0.0;
    vehicle.wheel.spin_inertia_kgm2 = 0.1;
    let mut plant = on(level(firm()), &vehicle, &[Deviation::MotorResponse { added_s: 0.595 }]);
    drive(&mut plant, 1.0, 0.0, 1.5);
    // A ramp of T = 2/3 s through a first-order response of tau: 1 - tau / T (exp(T / tau) - 1) exp(-t / tau).
    let (tau, ramp_s) = (0.6f64, 2.0 / 3.0);
    let rest = tau / ramp_s * ((ramp_s / tau).exp() - 1.0) * (-1.5 / tau).exp();
    near(forward_mps(&plant), 1.0 - rest, 0.03);
}

#[test]
fn a_smoothed_throttle_reaches_1_minus_1_over_e_after_its_time_and_keeps_its_force() {
    let mut vehicle = prompt(machine());
    vehicle.tyre.rolling_resistance = 0.0;
    vehicle.wheel.spin_inertia_kgm2 = 0.1;
    let deviations = [Deviation::MotorDroop, Deviation::ThrottleSmoothing { time_s: 0.6 }];
    let mut plant = on(level(firm()), &vehicle, &deviations);
    drive(&mut plant, 1.0, 0.0, 0.6);
    near(forward_mps(&plant), 1.0 - (-1.0f64).exp(), 0.03);
    // A slope costs what it costs without the smoothing.
    let smooth = Some(Deviation::ThrottleSmoothing { time_s: 0.6 });
    let [sound, smooth] = [None, smooth].map(|smooth| drooping_mps(incline(0.1, firm()), smooth, 3.0));
    near(smooth, sound, 1e-3);
}

#[test]
fn ramp_and_torque_limit_the_acceleration() {
    let mut plant = on_level(&[Deviation::MotorRamp { acceleration_mps2: 0.5 }]);
    drive(&mut plant, 4.0, 0.0, 2.0);
    let before_mps = forward_mps(&plant);
    plant.advance(2.0);
    near(forward_mps(&plant) - before_mps, 1.0, 0.02);
    let pulled_n = 800.0 / 0.44;
    let resisted_n = 0.02 * MASS_KG * G;
    near(pulling_mps2(&[]), (pulled_n - resisted_n) / (MASS_KG + SPINNING_KG), 0.02);
}

/// Acceleration under 800 N m at the wheels [m/s2].
fn pulling_mps2(deviations: &[Deviation]) -> f64 {
    let limited = [&[Deviation::MotorTorque { limit_nm: 800.0 }], deviations].concat();
    let mut plant = on_level(&limited);
    drive(&mut plant, 30.0, 0.0, 2.0);
    let before_mps = forward_mps(&plant);
    plant.advance(2.0);
    0.5 * (forward_mps(&plant) - before_mps)
}

#[test]
fn a_load_and_a_trailer_take_their_share_of_the_pull() {
    let pulled_n = 800.0 / 0.44;
    let expected = (pulled_n - 0.02 * 1.4 * MASS_KG * G) / (1.4 * MASS_KG + SPINNING_KG);
    near(pulling_mps2(&[Deviation::Mass { factor: 1.4 }]), expected, 0.03);
    let trailer = Deviation::Trailer { mass_kg: 500.0, drawbar_m: 3.0, resistance: 0.03 };
    let expected = (pulled_n - (0.02 * MASS_KG + 0.03 * 500.0) * G) / (MASS_KG + SPINNING_KG + 500.0);
    near(pulling_mps2(&[trailer]), expected, 0.03);
}

#[test]
fn a_trailer_on_a_hill_pulls_with_its_weight() {
    let slope_rad = 0.1f64;
    let trailer = Deviation::Trailer { mass_kg: 600.0, drawbar_m: 3.0, resistance: 0.0 };
    let [alone, towing] =
        [None, Some(trailer)].map(|trailer| drooping_mps(incline(slope_rad, firm()), trailer, 3.0));
    near(alone - towing, 600.0 * G * slope_rad.sin() / MASS_KG * lost_s(3.0), 0.05);
}

#[test]
fn small_commands_do_not_reach_the_motor_through_its_dead_band() {
    let band = Deviation::MotorDeadBand { speed_mps: 0.6 };
    for (commanded_mps, expected_mps) in [(0.55f32, 0.0), (0.65, 0.65)] {
        let mut plant = on_level(&[band]);
        drive(&mut plant, commanded_mps, 0.0, 6.0);
        assert!((forward_mps(&plant) - expected_mps).abs() < 0.02, "{}", forward_mps(&plant));
    }
}

#[test]
fn larger_wheels_roll_further_per_turn() {
    let mut plant = on_level(&[Deviation::WheelRadius { factor: 1.1 }]);
    drive(&mut plant, 2.0, 0.0, 8.0);
    // The tyres' deflection of 20 mm, a third of which counts, stays: (0.495 - 0.007) / (0.45 - 0.007).
    near(forward_mps(&plant), 2.0 * 0.488 / 0.443, 0.005);
}

#[test]
fn resistance_costs_a_drooping_motor_speed() {
    let short_mps = |deviation: Deviation, speed_mps: f32| {
        drooping_mps(level(firm()), None, speed_mps) - drooping_mps(level(firm()), Some(deviation), speed_mps)
    };
    near(short_mps(Deviation::RollingResistance { added: 0.1 }, 3.0), 0.1 * G * DROOP_S, 0.05);
    // 0.6 kg/m3 times 50 m2 times v^2 over the mass; v itself is what remains.
    let drag = Deviation::DragArea { area_m2: 50.0 };
    let v = drooping_mps(level(firm()), Some(drag), 8.0);
    near(short_mps(drag, 8.0), 0.6 * 50.0 * v * v / MASS_KG * lost_s(8.0), 0.05);
    let against = Deviation::Wind { force_n: [-1500.0, 0.0] };
    near(short_mps(against, 3.0), lost_s(3.0), 0.05);
}

#[test]
fn the_wind_does_not_turn_with_the_vehicle() {
    let wind = [Deviation::MotorDroop, Deviation::Wind { force_n: [-1500.0, 0.0] }];
    let speed_mps = |yaw_rad: f64| {
        let mut plant = Plant::deviating(&machine(), &wind, level(firm()), [0.0, 0.0, yaw_rad]).unwrap();
        drive(&mut plant, 3.0, 0.0, 8.0);
        forward_mps(&plant)
    };
    near(speed_mps(std::f64::consts::PI) - speed_mps(0.0), 2.0 * lost_s(3.0), 0.05);
}

#[test]
fn dense_plants_resist_by_their_factor() {
    let geometry = GridGeometry::centred(0.5, 400, 400, 0.0, 0.0);
    let meadow =
        World::from_fn("meadow", geometry, |_, _| 0.0, |_, _| Patch::open(firm()).overgrown(0.2)).unwrap();
    let meadow = Arc::new(meadow);
    let [light, dense] = [None, Some(Deviation::DenseVegetation { factor: 10.0 })]
        .map(|deviation| drooping_mps(Arc::clone(&meadow), deviation, 3.0));
    // 0.4 (0.2 / 0.9)^2 of the weight, nine times more.
    near(light - dense, 9.0 * 0.4 * (0.2f64 / 0.9).powi(2) * G * lost_s(3.0), 0.05);
}

#[test]
fn a_load_on_rollers_pulls_with_the_slope_and_not_on_the_level() {
    let pull = Deviation::SlopePull { along: 0.5, across: 0.0 };
    let alone = drooping_mps(incline(0.1, firm()), None, 3.0);
    let mut plant = on(incline(0.1, firm()), &machine(), &[Deviation::MotorDroop, pull]);
    drive(&mut plant, 3.0, 0.0, 8.0);
    // The body squats a little under it and stands steeper than the ground.
    let sine = -plant.pose().pitch_rad.sin();
    assert!((0.1..0.12).contains(&sine), "{sine}");
    near(alone - forward_mps(&plant), 0.5 * G * sine * lost_s(3.0), 0.05);
    let [alone, pulled] = [None, Some(pull)].map(|pull| drooping_mps(level(firm()), pull, 3.0));
    assert!((alone - pulled).abs() < 2e-3, "{alone} {pulled}");
}

#[test]
fn a_load_on_rollers_pushes_down_a_cross_slope() {
    // Along the contour with the right side down; the body leans a little more than the ground.
    let drifting = |across: f64| {
        let pull = [Deviation::SlopePull { along: 0.0, across }];
        let start = [0.0, 0.0, std::f64::consts::FRAC_PI_2];
        let mut plant = Plant::deviating(&machine(), &pull, incline(-0.1, firm()), start).unwrap();
        drive(&mut plant, 3.0, 0.0, 3.0);
        (plant.motion().velocity_mps[1], plant.pose().roll_rad)
    };
    let ((alone_mps, _), (pushed_mps, roll_rad)) = (drifting(0.0), drifting(1.0));
    assert!((0.1..0.15).contains(&roll_rad), "{roll_rad}");
    // The brush's slip at a friction f of 0.9: 3 0.9 / 12 (1 - cbrt(1 - f / 0.9)).
    let slip = |friction: f64| 3.0 * 0.9 / STIFFNESS * (1.0 - (1.0 - friction / 0.9).cbrt());
    let alone = 0.1f64.sin();
    near(pushed_mps - alone_mps, 3.0 * (slip(alone) - slip(alone + roll_rad.sin())), 0.1);
}

#[test]
fn a_yaw_moment_turns_until_the_tyres_hold_it() {
    // Axles L/2 from the centre, each with half of the weight W times C per slip angle r L / (2 v), and wheels half a
    // track t from the middle, coupled: M = W (C L^2 / (4 v) + coupling t^2 / 4) r.
    let torque_nm = 1000.0;
    let mut plant = on_level(&[Deviation::YawMoment { torque_nm }]);
    drive(&mut plant, 4.0, 0.0, 8.0);
    let held_m2 = STIFFNESS * 2.5f64.powi(2) / 16.0 + coupling_s_per_m(4.0) * 1.55f64.powi(2) / 4.0;
    near(plant.motion().angular_rate_radps[2], torque_nm / (MASS_KG * G * held_m2), 0.06);
}

#[test]
fn a_swinging_load_turns_to_and_fro_in_its_period() {
    let mut plant = on_level(&[Deviation::Sway { torque_nm: 5000.0, period_s: 0.8 }]);
    drive(&mut plant, 4.0, 0.0, 4.0);
    let mut signs = Vec::new();
    for _ in 0..800 {
        plant.advance(0.01);
        signs.push(plant.motion().angular_rate_radps[2] > 0.0);
    }
    // Ten periods of 0.8 s.
    let n_changes = signs.windows(2).filter(|pair| pair[0] != pair[1]).count();
    assert!((19..=21).contains(&n_changes), "{n_changes}");
}

#[test]
fn a_flat_tyre_pulls_to_its_side() {
    let turned = |wheel: usize| {
        let flat = Deviation::FlatTyre { wheel, radius: 0.85, stiffness: 0.4, resistance: 0.05 };
        curvature(&machine(), &[flat], 3.0, 0.0)
    };
    for [left, right] in [[0, 1], [2, 3]] {
        let [left, right] = [turned(left), turned(right)];
        assert!(left > 1e-3, "{left}");
        near(-right, left, 0.05);
    }
}

#[test]
fn a_link_that_is_lost_keeps_the_steering_where_it_was() {
    let lost = Deviation::CommandDropOut { period_s: 3.5, length_s: 1.0 };
    let mut plant = on(level(firm()), &prompt(machine()), &[lost]);
    // 1.5 s of sinking in, then 1 s until the link is lost for the first time.
    drive(&mut plant, 1.0, 0.2, 1.1);
    drive(&mut plant, 1.0, -0.2, 0.8);
    near(plant.motion().steering_rad, 0.2, 0.01);
    drive(&mut plant, 1.0, -0.2, 1.0);
    near(plant.motion().steering_rad, -0.2, 0.01);
}

#[test]
fn a_sagging_battery_slows_the_drive_down() {
    let mut plant = on_level(&[Deviation::BatterySag { per_s: 0.01 }]);
    drive(&mut plant, 3.0, 0.0, 20.0);
    near(forward_mps(&plant), 3.0 * (1.0 - 0.2), 0.01);
}

#[test]
fn departures_combine() {
    let both = [Deviation::SteeringTrim { angle_rad: 0.05 }, Deviation::WheelRadius { factor: 1.1 }];
    let mut plant = on_level(&both);
    drive(&mut plant, 2.0, 0.0, 8.0);
    let motion = plant.motion();
    near(motion.velocity_mps[0], 2.0 * 0.488 / 0.443, 0.01);
    near(motion.angular_rate_radps[2] / motion.velocity_mps[0], 0.05f64.tan() / 2.5, 0.03);
}

#[test]
fn sensors_depart_each_in_its_own_measurement() {
    let deviations = [
        Deviation::PoseLatency { delay_s: 0.05 },
        Deviation::OdometryScale { factor: 0.9 },
        Deviation::GyroBias { rate_radps: 0.02 },
        Deviation::YawMisalignment { angle_rad: 0.03 },
    ];
    let mut sensor = OdometrySensor::deviating(OdometryConfig::PERFECT, &deviations, 1);
    let mut plant = on_level(&[]);
    plant.set_command(Command { speed_mps: 2.0, steering_rad: 0.2 }).unwrap();
    plant.advance(5.0);
    let mut poses = Vec::new();
    for cycle in 0..20u64 {
        let (motion, told) = (plant.motion(), sensor.measure(&plant.motion(), cycle * 20_000_000));
        poses.push(motion.pose);
        near(told.velocity_mps[0], 0.9 * motion.velocity_mps[0], 1e-9);
        near(told.yaw_rate_radps, motion.angular_rate_radps[2] + 0.02, 1e-9);
        if let Some(age) = poses.len().checked_sub(4) {
            // 50 ms ago: halfway between the third and the second pose before this one.
            let (older, newer) = (poses[age], poses[age + 1]);
            near(told.position_m[0], 0.5 * (older.x_m + newer.x_m), 1e-9);
            near(told.attitude_rad[2], 0.5 * (older.yaw_rad + newer.yaw_rad) + 0.03, 1e-9);
        }
        plant.advance(0.02);
    }
}

#[test]
fn what_no_part_can_be_is_refused_by_name() {
    for (deviation, told) in [
        (
            Deviation::SteeringDelay { added_s: -0.1 },
            "deviation steering_delay.added_s: expected 0 to 5, found -0.1",
        ),
        (
            Deviation::Wind { force_n: [0.0, f64::NAN] },
            "deviation wind.north_n: expected -1000000 to 1000000, found NaN",
        ),
        (
            Deviation::CommandDropOut { period_s: 2.0, length_s: 3.0 },
            "deviation command_drop_out.length_s: expected 0 to 2, found 3",
        ),
        (
            Deviation::FlatTyre { wheel: 4, radius: 0.9, stiffness: 0.5, resistance: 0.0 },
            "deviation flat_tyre.wheel: expected 0 to 3, found 4",
        ),
    ] {
        match Plant::deviating(&machine(), &[deviation], level(firm()), [0.0; 3]) {
            Err(PlantError::Deviation(error)) => assert_eq!(error.to_string(), told),
            other => panic!("{deviation:?}: {:?}", other.err()),
        }
    }
}
