//! The vehicle at rest on level ground: what it weighs and how it stands.

use bicycle::Vehicle;
use nalgebra::Vector3;

use super::GRAVITY_MPS2;
use super::envelope::Envelope;

/// Mass, balance and stance. Wheels in the order front left, front right, rear left, rear right.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rest {
    /// Mass with wheels [kg].
    pub mass_kg: f64,
    /// Load of each wheel [N].
    pub load_n: [f64; 4],
    /// Centre of gravity ahead of the rear axle [m].
    cog_ahead_m: f64,
    /// Centre of gravity above the ground [m].
    cog_height_m: f64,
    /// Principal moments of inertia with wheels [kg m2].
    pub inertia_kgm2: Vector3<f64>,
}

/// Heights that follow from the tyres' deflection.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stance {
    /// Hubs in the body frame [m].
    pub hub_m: [Vector3<f64>; 4],
    /// Rear axle above the ground [m].
    pub axle_height_m: f64,
    /// Distance rolled per turn, over two pi, of the mean wheel [m].
    pub rolling_radius_m: f64,
    /// Centre of gravity in the body frame [m].
    pub cog_m: Vector3<f64>,
}

impl Rest {
    pub(crate) fn new(vehicle: &Vehicle) -> Self {
        let (body, wheel, geometry) = (&vehicle.body, &vehicle.wheel, &vehicle.geometry);
        let wheels_kg = 4.0 * wheel.mass_kg;
        let mass_kg = body.mass_kg + wheels_kg;
        let mean = |of_body: f64, of_wheels: f64| (body.mass_kg * of_body + wheels_kg * of_wheels) / mass_kg;
        let cog_ahead_m = mean(body.cog_ahead_m, 0.5 * geometry.wheelbase_m);
        let cog_height_m = mean(body.cog_height_m, geometry.wheel_radius_m);

        let body_off = Vector3::new(body.cog_ahead_m - cog_ahead_m, 0.0, body.cog_height_m - cog_height_m);
        let mut inertia_kgm2 = Vector3::from(body.inertia_kgm2) + parallel_axis(body.mass_kg, &body_off);
        for ahead_m in [0.0, geometry.wheelbase_m] {
            let height_m = geometry.wheel_radius_m - cog_height_m;
            let off = Vector3::new(ahead_m - cog_ahead_m, 0.5 * geometry.track_m, height_m);
            inertia_kgm2 += 2.0 * parallel_axis(wheel.mass_kg, &off);
        }
        let front_n = 0.5 * mass_kg * GRAVITY_MPS2 * cog_ahead_m / geometry.wheelbase_m;
        let rear_n = 0.5 * mass_kg * GRAVITY_MPS2 - front_n;
        Self { mass_kg, load_n: [front_n, front_n, rear_n, rear_n], cog_ahead_m, cog_height_m, inertia_kgm2 }
    }

    pub(crate) fn stance(&self, vehicle: &Vehicle, envelope: &Envelope) -> Stance {
        let geometry = &vehicle.geometry;
        let deflection_m = self.load_n.map(|load_n| envelope.deflection_m(load_n));
        let axle_height_m = geometry.wheel_radius_m - deflection_m[2];
        let hub = |i: usize| {
            let ahead_m = if i < 2 { geometry.wheelbase_m } else { 0.0 };
            let left_m = if i.is_multiple_of(2) { 0.5 } else { -0.5 } * geometry.track_m;
            Vector3::new(ahead_m, left_m, deflection_m[2] - deflection_m[i])
        };
        Stance {
            hub_m: std::array::from_fn(hub),
            axle_height_m,
            rolling_radius_m: envelope
                .rolling_radius_m(geometry.wheel_radius_m - 0.25 * deflection_m.iter().sum::<f64>()),
            cog_m: Vector3::new(self.cog_ahead_m, 0.0, self.cog_height_m - axle_height_m),
        }
    }
}

/// Moments of inertia about x, y, z of a point mass.
fn parallel_axis(mass_kg: f64, off: &Vector3<f64>) -> Vector3<f64> {
    let squares = off.component_mul(off);
    mass_kg * Vector3::new(squares.y + squares.z, squares.x + squares.z, squares.x + squares.y)
}
