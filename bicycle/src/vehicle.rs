//! Description of a machine. Geometry and limits serve planner and plant alike; the rest describes the machine
//! to whoever simulates it.

use serde::{Deserialize, Serialize};
use std::borrow::Cow;

use crate::effect::STANDARD_GRAVITY_MPS2;

/// A four-wheeled vehicle with front steering.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Vehicle {
    /// Name, for reports.
    pub name: String,
    /// Lengths that planner and plant share.
    pub geometry: Geometry,
    /// What the vehicle can or may do.
    pub limits: Limits,
    /// Sprung body.
    pub body: Body,
    /// One wheel; all four are alike.
    pub wheel: Wheel,
    /// Front suspension.
    pub front: Axle,
    /// Rear suspension.
    pub rear: Axle,
    /// Motor, transmission and brakes.
    pub drivetrain: Drivetrain,
    /// Steering servo.
    pub servo: Servo,
    /// Tyre properties that do not depend on the ground.
    pub tyre: Tyre,
}

/// Lengths. The body frame sits at the rear axle's centre.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Geometry {
    /// Between the axles [m].
    pub wheelbase_m: f64,
    /// Between the wheels' middle planes on an axle [m].
    pub track_m: f64,
    /// Overall length [m].
    pub length_m: f64,
    /// Overall width [m].
    pub width_m: f64,
    /// From the rear axle to the rearmost point [m].
    pub rear_overhang_m: f64,
    /// From the ground to the belly at rest [m].
    pub ground_clearance_m: f64,
    /// Radius of an unloaded wheel [m].
    pub wheel_radius_m: f64,
}

/// Limits of commands and of attitude.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// Fastest forward command [m/s].
    pub speed_max_mps: f64,
    /// Fastest reverse command, as a positive number [m/s]; 0 = no reverse gear.
    pub reverse_speed_max_mps: f64,
    /// Largest steering angle [rad].
    pub steering_max_rad: f64,
    /// Fastest change of the steering angle [rad/s].
    pub steering_rate_max_radps: f64,
    /// Largest acceleration and deceleration [m/s2].
    pub acceleration_max_mps2: f64,
    /// Largest lateral acceleration, against rolling over at speed [m/s2].
    pub lateral_acceleration_max_mps2: f64,
    /// Largest |roll| that counts as safe [rad].
    pub roll_max_rad: f64,
    /// Largest |pitch| that counts as safe [rad].
    pub pitch_max_rad: f64,
}

/// The sprung body.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// Mass without wheels [kg].
    pub mass_kg: f64,
    /// Principal moments of inertia about x, y, z through the centre of gravity [kg m2].
    pub inertia_kgm2: [f64; 3],
    /// Centre of gravity ahead of the rear axle [m].
    pub cog_ahead_m: f64,
    /// Centre of gravity above the ground at rest [m].
    pub cog_height_m: f64,
}

/// A wheel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wheel {
    /// Mass [kg].
    pub mass_kg: f64,
    /// Moment of inertia about the axle [kg m2].
    pub spin_inertia_kgm2: f64,
    /// Width of the tread [m].
    pub width_m: f64,
}

/// Suspension of one axle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Axle {
    /// Spring and damper of each wheel.
    pub suspension: Suspension,
    /// Extra roll stiffness of the anti-roll bar [N m/rad].
    pub anti_roll_nm_per_rad: f64,
}

/// Spring and damper of one wheel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Suspension {
    /// Spring rate at the wheel [N/m].
    pub stiffness_n_per_m: f64,
    /// Damping at the wheel [N s/m].
    pub damping_ns_per_m: f64,
    /// Travel up and down from the static position [m].
    pub travel_m: f64,
}

/// Motor, transmission and brakes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Drivetrain {
    /// Largest total drive torque at the wheels [N m].
    pub drive_torque_max_nm: f64,
    /// Largest total brake torque at the wheels [N m].
    pub brake_torque_max_nm: f64,
    /// Largest drive power [W].
    pub power_max_w: f64,
    /// Share of the drive torque on the rear axle; 1 = rear drive, 0.5 = four-wheel drive.
    pub rear_share: f64,
    /// First-order response time of the torque [s].
    pub response_s: f64,
    /// How the driven wheels share their speeds; limited slip where nothing is said.
    #[serde(default)]
    pub differential: Differential,
}

/// What stands between the driven wheels, within the axles and between them alike.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Differential {
    /// Wheels turn as they like under equal torques left and right.
    Open,
    /// Torque goes from faster to slower wheels in proportion to their difference of speed.
    #[default]
    LimitedSlip,
    /// All driven wheels turn alike.
    Locked,
}

/// Steering servo.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Servo {
    /// First-order response time [s].
    pub response_s: f64,
    /// Transport delay of commands [s].
    pub delay_s: f64,
}

/// Tyre properties that do not depend on the ground.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tyre {
    /// Rolling resistance over load on hard ground [-].
    pub rolling_resistance: f64,
    /// Way that the tyre rolls until its force has followed a step of slip to 63 % [m].
    pub relaxation_length_m: f64,
    /// Force over load and slip for little slip, along and across alike [-]: across, the cornering stiffness per radian
    /// over load. [`Tyre::CAR_SLIP_STIFFNESS`] where nothing is said.
    #[serde(default = "car_slip_stiffness")]
    pub slip_stiffness: f64,
    /// Relative loss of friction for a load twice the static one [-].
    pub load_sensitivity: f64,
    /// Radial stiffness [N/m].
    pub radial_stiffness_n_per_m: f64,
}

impl Tyre {
    /// Slip stiffness of a car-like tyre of no special make. Real ones lie around 10 to 15, low and
    /// wide ones above 20: that of CommonRoad's vehicle models has 22 (Althoff and Wuersching 2020, table 7).
    pub const CAR_SLIP_STIFFNESS: f64 = 12.0;
}

fn car_slip_stiffness() -> f64 {
    Tyre::CAR_SLIP_STIFFNESS
}

/// A vehicle description that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{field}: expected {expected}, found {found}")]
pub struct VehicleError {
    /// Dotted path of the field, e.g. `geometry.wheelbase_m`.
    pub field: &'static str,
    /// The range that would do.
    pub expected: Cow<'static, str>,
    /// The value that was given.
    pub found: f64,
}

impl Vehicle {
    /// Refuses values that no vehicle can have.
    pub fn validate(&self) -> Result<(), VehicleError> {
        self.geometry.validate()?;
        let positive = [
            ("limits.speed_max_mps", self.limits.speed_max_mps),
            ("limits.steering_max_rad", self.limits.steering_max_rad),
            ("limits.steering_rate_max_radps", self.limits.steering_rate_max_radps),
            ("limits.acceleration_max_mps2", self.limits.acceleration_max_mps2),
            ("limits.lateral_acceleration_max_mps2", self.limits.lateral_acceleration_max_mps2),
            ("limits.roll_max_rad", self.limits.roll_max_rad),
            ("limits.pitch_max_rad", self.limits.pitch_max_rad),
            ("body.mass_kg", self.body.mass_kg),
            ("body.inertia_kgm2[0]", self.body.inertia_kgm2[0]),
            ("body.inertia_kgm2[1]", self.body.inertia_kgm2[1]),
            ("body.inertia_kgm2[2]", self.body.inertia_kgm2[2]),
            ("body.cog_height_m", self.body.cog_height_m),
            ("wheel.mass_kg", self.wheel.mass_kg),
            ("wheel.spin_inertia_kgm2", self.wheel.spin_inertia_kgm2),
            ("wheel.width_m", self.wheel.width_m),
            ("front.suspension.stiffness_n_per_m", self.front.suspension.stiffness_n_per_m),
            ("rear.suspension.stiffness_n_per_m", self.rear.suspension.stiffness_n_per_m),
            ("front.suspension.travel_m", self.front.suspension.travel_m),
            ("rear.suspension.travel_m", self.rear.suspension.travel_m),
            ("drivetrain.drive_torque_max_nm", self.drivetrain.drive_torque_max_nm),
            ("drivetrain.brake_torque_max_nm", self.drivetrain.brake_torque_max_nm),
            ("drivetrain.power_max_w", self.drivetrain.power_max_w),
            ("tyre.relaxation_length_m", self.tyre.relaxation_length_m),
            ("tyre.slip_stiffness", self.tyre.slip_stiffness),
            ("tyre.radial_stiffness_n_per_m", self.tyre.radial_stiffness_n_per_m),
        ];
        let not_negative = [
            ("limits.reverse_speed_max_mps", self.limits.reverse_speed_max_mps),
            ("body.cog_ahead_m", self.body.cog_ahead_m),
            ("front.suspension.damping_ns_per_m", self.front.suspension.damping_ns_per_m),
            ("rear.suspension.damping_ns_per_m", self.rear.suspension.damping_ns_per_m),
            ("front.anti_roll_nm_per_rad", self.front.anti_roll_nm_per_rad),
            ("rear.anti_roll_nm_per_rad", self.rear.anti_roll_nm_per_rad),
            ("drivetrain.response_s", self.drivetrain.response_s),
            ("servo.response_s", self.servo.response_s),
            ("servo.delay_s", self.servo.delay_s),
            ("tyre.rolling_resistance", self.tyre.rolling_resistance),
        ];
        check(&positive, "a finite number > 0", |v| v > 0.0)?;
        check(&not_negative, "a finite number >= 0", |v| v >= 0.0)?;
        let shares = [
            ("drivetrain.rear_share", self.drivetrain.rear_share),
            ("tyre.load_sensitivity", self.tyre.load_sensitivity),
        ];
        check(&shares, "a number from 0 to 1", |v| (0.0..=1.0).contains(&v))?;
        let angles = [
            ("limits.steering_max_rad", self.limits.steering_max_rad),
            ("limits.roll_max_rad", self.limits.roll_max_rad),
            ("limits.pitch_max_rad", self.limits.pitch_max_rad),
        ];
        check(&angles, "an angle in radians below pi/2", |v| v < std::f64::consts::FRAC_PI_2)
    }
}

impl AsRef<Geometry> for Vehicle {
    fn as_ref(&self) -> &Geometry {
        &self.geometry
    }
}

impl AsRef<Self> for Geometry {
    fn as_ref(&self) -> &Self {
        self
    }
}

/// Roll and pitch of a body over those of the ground are told up to this; beyond, hardly anything keeps it upright.
const LEAN_MOST: f64 = 3.0;

impl Vehicle {
    /// Roll and pitch of the body over those of the ground that it stands on, 1 on stiff springs [-].
    ///
    /// On a slope of angle t the weight overturns the body, which leans by L t, with the moment m g h L t, and springs
    /// and tyres of the angular stiffness K hold it with K (L - 1) t: L = K / (K - m g h) (Gillespie, Fundamentals of
    /// Vehicle Dynamics, chapter 6, with the roll axis on the ground).
    pub fn lean(&self) -> [f64; 2] {
        let track_m = self.geometry.track_m;
        let tyre_n_per_m = self.tyre.radial_stiffness_n_per_m;
        let in_series = |strut_n_per_m: f64| strut_n_per_m * tyre_n_per_m / (strut_n_per_m + tyre_n_per_m);
        let ahead_m = [self.geometry.wheelbase_m - self.body.cog_ahead_m, -self.body.cog_ahead_m];
        let mut stiffness_nm_per_rad = [0.0; 2];
        for (axle, ahead_m) in [&self.front, &self.rear].into_iter().zip(ahead_m) {
            let spring_n_per_m = axle.suspension.stiffness_n_per_m;
            let bar_n_per_m = 2.0 * axle.anti_roll_nm_per_rad / (track_m * track_m);
            let roll_n_per_m = in_series(spring_n_per_m + bar_n_per_m);
            stiffness_nm_per_rad[0] += 0.5 * track_m * track_m * roll_n_per_m;
            stiffness_nm_per_rad[1] += 2.0 * ahead_m * ahead_m * in_series(spring_n_per_m);
        }
        let overturning_nm_per_rad = self.body.mass_kg * STANDARD_GRAVITY_MPS2 * self.body.cog_height_m;
        stiffness_nm_per_rad.map(|stiffness| {
            let left = stiffness - overturning_nm_per_rad;
            if left * LEAN_MOST < stiffness { LEAN_MOST } else { stiffness / left }
        })
    }

    /// Angular acceleration with which weight alone turns the vehicle back when the wheels of one side, or of one end, have
    /// left the ground: about those that stay, the body and the wheels in the air as one [rad/s2]. Of the ends that of the
    /// slower.
    pub fn righting_radps2(&self) -> [f64; 2] {
        let Geometry { wheelbase_m, track_m, .. } = self.geometry;
        let Body { mass_kg, inertia_kgm2, cog_ahead_m, cog_height_m } = self.body;
        let lifted_kg = 2.0 * self.wheel.mass_kg;
        let turned_back = |inertia_kgm2: f64, arm_m: f64, lifted_m: f64| {
            let moment_nm = STANDARD_GRAVITY_MPS2 * (mass_kg * arm_m + lifted_kg * lifted_m);
            let body_kgm2 = inertia_kgm2 + mass_kg * (arm_m * arm_m + cog_height_m * cog_height_m);
            moment_nm / (body_kgm2 + lifted_kg * lifted_m * lifted_m)
        };
        let over_end = |arm_m: f64| turned_back(inertia_kgm2[1], arm_m, wheelbase_m);
        let over_side = turned_back(inertia_kgm2[0], 0.5 * track_m, track_m);
        [over_side, over_end(cog_ahead_m).min(over_end(wheelbase_m - cog_ahead_m))]
    }
}

impl Geometry {
    /// Refuses lengths that no vehicle can have, and a body that does not reach over its own wheels.
    pub fn validate(&self) -> Result<(), VehicleError> {
        let Self { wheelbase_m, track_m, length_m, width_m, rear_overhang_m, .. } = *self;
        let positive = [
            ("geometry.wheelbase_m", wheelbase_m),
            ("geometry.track_m", track_m),
            ("geometry.length_m", length_m),
            ("geometry.width_m", width_m),
            ("geometry.wheel_radius_m", self.wheel_radius_m),
        ];
        check(&positive, "a finite number > 0", |v| v > 0.0)?;
        let not_negative = [
            ("geometry.rear_overhang_m", rear_overhang_m),
            ("geometry.ground_clearance_m", self.ground_clearance_m),
        ];
        check(&not_negative, "a finite number >= 0", |v| v >= 0.0)?;
        let refuse = |field, expected: String, found| {
            Err(VehicleError { field, expected: Cow::Owned(expected), found })
        };
        let least_m = wheelbase_m + rear_overhang_m;
        if length_m < least_m {
            let expected = format!(
                "at least {least_m:.3}, the wheelbase of {wheelbase_m} and {rear_overhang_m} behind it"
            );
            return refuse("geometry.length_m", expected, length_m);
        }
        if width_m < track_m {
            return refuse("geometry.width_m", format!("at least the track of {track_m}"), width_m);
        }
        Ok(())
    }
}

fn check(
    fields: &[(&'static str, f64)],
    expected: &'static str,
    allowed: impl Fn(f64) -> bool,
) -> Result<(), VehicleError> {
    match fields.iter().find(|(_, value)| !(value.is_finite() && allowed(*value))) {
        Some(&(field, found)) => Err(VehicleError { field, expected: Cow::Borrowed(expected), found }),
        None => Ok(()),
    }
}
