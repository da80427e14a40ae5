//! The vehicle as one rigid body on four wheels: masses, inertia, and how its weight stands on the wheels.

use bicycle::{Differential, Vehicle};
use nalgebra::{Matrix3, Vector3};

use crate::dual::Dual;

/// Acceleration of gravity [m/s2].
pub const GRAVITY_MPS2: f64 = 9.81;
/// A wheel under a large load keeps this share of its friction at least [-].
const LOAD_FACTOR_MIN: f64 = 0.4;

/// Mass, centre of mass and inertia tensor about it, of mass points (AnyNav, equations 2 to 4).
///
/// `points`: place [m] and mass [kg] of each. Shapes: kg, m, kg m2. `None` without mass.
pub fn mass_properties(points: &[([f64; 3], f64)]) -> Option<(f64, Vector3<f64>, Matrix3<f64>)> {
    let mass_kg: f64 = points.iter().map(|(_, mass_kg)| mass_kg).sum();
    if !(mass_kg.is_finite() && mass_kg > 0.0) {
        return None;
    }
    let moment: Vector3<f64> = points.iter().map(|(at_m, mass_kg)| Vector3::from(*at_m) * *mass_kg).sum();
    let centre_m = moment / mass_kg;
    let inertia = points.iter().map(|(at_m, mass_kg)| {
        let off_m = Vector3::from(*at_m) - centre_m;
        (Matrix3::identity() * off_m.norm_squared() - off_m * off_m.transpose()) * *mass_kg
    });
    Some((mass_kg, centre_m, inertia.sum()))
}

/// What of a vehicle matters to its motion in the plane of the ground. Wheels in the order front left, front right, rear
/// left, rear right.
#[derive(Clone, Debug, PartialEq)]
pub struct Chassis {
    /// With wheels [kg].
    pub mass_kg: f64,
    /// About the vertical through the centre of mass, with wheels [kg m2].
    pub yaw_inertia_kgm2: f64,
    /// Centre of mass ahead of the rear axle [m].
    pub cog_ahead_m: f64,
    /// Centre of mass above the ground [m].
    pub cog_height_m: f64,
    /// Between the axles [m].
    pub wheelbase_m: f64,
    /// Between the wheels of an axle [m].
    pub track_m: f64,
    /// Force over load and slip of front and rear tyres for little slip [-].
    pub slip_stiffness: [f64; 2],
    /// Relative loss of friction under twice the mean load [-].
    pub load_sensitivity: f64,
    /// Whether front and rear wheels are driven.
    pub driven: [bool; 2],
    /// Whether all driven wheels turn alike.
    pub is_locked: bool,
    /// Roll and pitch of the body over those of the ground [-].
    pub lean: [f64; 2],
}

impl Chassis {
    /// Of a description.
    pub fn of(vehicle: &Vehicle) -> Self {
        let (geometry, body, wheel) = (&vehicle.geometry, &vehicle.body, &vehicle.wheel);
        let (wheelbase_m, half_track_m) = (geometry.wheelbase_m, 0.5 * geometry.track_m);
        let axles_m = [wheelbase_m, 0.0];
        let wheels = axles_m.into_iter().flat_map(|x_m| {
            [half_track_m, -half_track_m].map(|y_m| ([x_m, y_m, geometry.wheel_radius_m], wheel.mass_kg))
        });
        let body_at_m = [body.cog_ahead_m, 0.0, body.cog_height_m];
        let points: Vec<_> = wheels.chain([(body_at_m, body.mass_kg)]).collect();
        // A description that was validated has masses.
        let (mass_kg, centre_m, inertia) = mass_properties(&points).unwrap_or_default();
        Self {
            mass_kg,
            yaw_inertia_kgm2: inertia[(2, 2)] + body.inertia_kgm2[2],
            cog_ahead_m: centre_m.x,
            cog_height_m: centre_m.z,
            wheelbase_m,
            track_m: geometry.track_m,
            slip_stiffness: [vehicle.tyre.slip_stiffness; 2],
            load_sensitivity: vehicle.tyre.load_sensitivity,
            driven: [vehicle.drivetrain.rear_share < 1.0, vehicle.drivetrain.rear_share > 0.0],
            is_locked: vehicle.drivetrain.differential == Differential::Locked,
            lean: vehicle.lean(),
        }
    }

    /// Mean of the driven wheels' circumferential speeds [m/s].
    pub fn driven_mps(&self, edge_mps: &[f64; 4]) -> f64 {
        let driven: Vec<f64> = (0..4).filter(|i| self.driven[i / 2]).map(|i| edge_mps[i]).collect();
        driven.iter().sum::<f64>() / driven.len().max(1) as f64
    }

    /// Contacts from the centre of mass, ahead and left [m].
    pub fn contacts_m(&self) -> [[f64; 2]; 4] {
        let (ahead_m, behind_m, left_m) =
            (self.wheelbase_m - self.cog_ahead_m, -self.cog_ahead_m, 0.5 * self.track_m);
        [[ahead_m, left_m], [ahead_m, -left_m], [behind_m, left_m], [behind_m, -left_m]]
    }

    /// Normal forces [N] under a specific force in the plane of the ground, ahead and left, and across it [m/s2] (AnyNav,
    /// equations 5 to 8 with the ratio of 7 turned over): acceleration and slope both move weight, to the rear when
    /// the specific force points ahead, to the right when it points left. The rear axle is split as the front one.
    pub fn loads_n(&self, specific_mps2: [f64; 2], across_mps2: f64) -> [f64; 4] {
        self.loads(specific_mps2.map(Dual::<0>::from), across_mps2).map(|load_n| load_n.value)
    }

    /// The same with derivatives [N].
    pub fn loads<const N: usize>(&self, specific_mps2: [Dual<N>; 2], across_mps2: f64) -> [Dual<N>; 4] {
        let one = Dual::from(1.0);
        let lever = self.cog_height_m / across_mps2;
        let at_rest = Dual::from(self.cog_ahead_m / self.wheelbase_m);
        let front = (at_rest - specific_mps2[0] * (lever / self.wheelbase_m)).clamp(0.0, 1.0);
        let left = (Dual::from(0.5) - specific_mps2[1] * (lever / self.track_m)).clamp(0.0, 1.0);
        let all_n = self.mass_kg * across_mps2;
        [front * left, front * (one - left), (one - front) * left, (one - front) * (one - left)]
            .map(|share| share * all_n)
    }

    /// Friction under a load over that under the mean one [-].
    pub fn load_factor<const N: usize>(&self, load_n: Dual<N>) -> Dual<N> {
        let over = load_n * (4.0 / (self.mass_kg * GRAVITY_MPS2)) - Dual::from(1.0);
        (Dual::from(1.0) - over * self.load_sensitivity).clamp(LOAD_FACTOR_MIN, f64::INFINITY)
    }
}
