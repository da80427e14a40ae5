//! The machines and grounds that the plant is validated with.
#![allow(clippy::unwrap_used)]

use std::sync::Arc;

use bicycle::{
    Axle, Body, Command, Differential, Drivetrain, Geometry, Limits, Servo, Suspension, Tyre, Vehicle, Wheel,
};
use scenarios::{Patch, Plant, Stribeck, World};
use terrain::GridGeometry;

/// m/s2, the plant's.
pub const G: f64 = 9.81;

/// Friction that does not depend on the sliding speed above 0.05 m/s: mu tanh(14.1 v / 0.25).
pub fn coulomb(mu: f32) -> Stribeck {
    Stribeck { static_friction: mu, dynamic_friction: mu, viscous_friction: 0.0, stribeck_speed_mps: 0.25 }
}

/// A square world of `side_m` around the origin with cells of `cell_m`.
pub fn world_of(
    side_m: f64,
    cell_m: f64,
    friction: Stribeck,
    height_m: impl Fn(f64, f64) -> f64,
) -> Arc<World> {
    let n = (side_m / cell_m).round() as usize;
    let geometry = GridGeometry::centred(cell_m, n, n, 0.0, 0.0);
    Arc::new(World::from_fn("test", geometry, height_m, |_, _| Patch::open(friction)).unwrap())
}

/// A plane that rises eastward at `slope_rad`.
pub fn incline(slope_rad: f64, friction: Stribeck) -> Arc<World> {
    world_of(200.0, 0.5, friction, move |x_m, _| x_m * slope_rad.tan())
}

/// Level ground, 400 m square.
pub fn level(friction: Stribeck) -> Arc<World> {
    world_of(400.0, 1.0, friction, |_, _| 0.0)
}

pub fn drive(plant: &mut Plant, speed_mps: f32, steering_rad: f32, duration_s: f64) {
    plant.set_command(Command { speed_mps, steering_rad }).unwrap();
    plant.advance(duration_s);
}

/// The same vehicle with servos and brakes that act at once, so that arithmetic need not follow their lags.
pub fn prompt(mut vehicle: Vehicle) -> Vehicle {
    vehicle.limits.acceleration_max_mps2 = 50.0;
    vehicle.drivetrain.response_s = 0.005;
    vehicle.servo = Servo { response_s: 0.005, delay_s: 0.0 };
    vehicle
}

/// The same vehicle with neither motor nor brakes.
pub fn powerless(mut vehicle: Vehicle) -> Vehicle {
    vehicle.drivetrain.drive_torque_max_nm = 1e-9;
    vehicle.drivetrain.brake_torque_max_nm = 1e-9;
    vehicle
}

/// 3.4 x 1.8 m, 1500 kg: m g = 14 715 N.
pub fn full_size() -> Vehicle {
    let axle = |anti_roll_nm_per_rad| Axle {
        suspension: Suspension { stiffness_n_per_m: 30_200.0, damping_ns_per_m: 2560.0, travel_m: 0.15 },
        anti_roll_nm_per_rad,
    };
    Vehicle {
        name: "full_size".into(),
        geometry: Geometry {
            wheelbase_m: 2.5,
            track_m: 1.55,
            length_m: 3.4,
            width_m: 1.8,
            rear_overhang_m: 0.45,
            ground_clearance_m: 0.35,
            wheel_radius_m: 0.45,
        },
        limits: Limits {
            speed_max_mps: 30.0,
            reverse_speed_max_mps: 3.0,
            steering_max_rad: 30f64.to_radians(),
            steering_rate_max_radps: 0.6,
            acceleration_max_mps2: 1.5,
            lateral_acceleration_max_mps2: 3.0,
            roll_max_rad: 30f64.to_radians(),
            pitch_max_rad: 30f64.to_radians(),
        },
        body: Body {
            mass_kg: 1360.0,
            inertia_kgm2: [370.0, 1270.0, 1420.0],
            cog_ahead_m: 1.25,
            cog_height_m: 0.75,
        },
        wheel: Wheel { mass_kg: 35.0, spin_inertia_kgm2: 5.0, width_m: 0.25 },
        front: axle(6000.0),
        rear: axle(3000.0),
        drivetrain: Drivetrain {
            drive_torque_max_nm: 6000.0,
            brake_torque_max_nm: 8000.0,
            power_max_w: 60_000.0,
            rear_share: 0.5,
            response_s: 0.15,
            differential: Differential::LimitedSlip,
        },
        servo: Servo { response_s: 0.15, delay_s: 0.05 },
        tyre: Tyre {
            rolling_resistance: 0.02,
            relaxation_length_m: 0.3,
            slip_stiffness: 12.0,
            load_sensitivity: 0.1,
            radial_stiffness_n_per_m: 150_000.0,
        },
    }
}

/// 0.33 x 0.25 m, 3 kg, wheels of 0.15 m.
pub fn rc_car() -> Vehicle {
    let axle = Axle {
        suspension: Suspension { stiffness_n_per_m: 379.0, damping_ns_per_m: 12.1, travel_m: 0.02 },
        anti_roll_nm_per_rad: 0.0,
    };
    Vehicle {
        name: "rc_car".into(),
        geometry: Geometry {
            wheelbase_m: 0.18,
            track_m: 0.19,
            length_m: 0.33,
            width_m: 0.25,
            rear_overhang_m: 0.075,
            ground_clearance_m: 0.05,
            wheel_radius_m: 0.075,
        },
        limits: Limits {
            speed_max_mps: 5.0,
            reverse_speed_max_mps: 0.75,
            steering_max_rad: 30f64.to_radians(),
            steering_rate_max_radps: 4.0,
            acceleration_max_mps2: 2.5,
            lateral_acceleration_max_mps2: 4.0,
            roll_max_rad: 30f64.to_radians(),
            pitch_max_rad: 45f64.to_radians(),
        },
        body: Body {
            mass_kg: 2.4,
            inertia_kgm2: [0.010, 0.020, 0.026],
            cog_ahead_m: 0.09,
            cog_height_m: 0.075,
        },
        wheel: Wheel { mass_kg: 0.15, spin_inertia_kgm2: 0.00068, width_m: 0.06 },
        front: axle,
        rear: axle,
        drivetrain: Drivetrain {
            drive_torque_max_nm: 2.5,
            brake_torque_max_nm: 3.0,
            power_max_w: 60.0,
            rear_share: 0.5,
            response_s: 0.05,
            differential: Differential::LimitedSlip,
        },
        servo: Servo { response_s: 0.06, delay_s: 0.02 },
        tyre: Tyre {
            rolling_resistance: 0.03,
            relaxation_length_m: 0.03,
            slip_stiffness: 12.0,
            load_sensitivity: 0.05,
            radial_stiffness_n_per_m: 3000.0,
        },
    }
}
