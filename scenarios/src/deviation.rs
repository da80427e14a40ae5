//! Ways in which a machine departs from its description: worn, loaded, badly trimmed, or wired with delays.
//!
//! Each is made by the part of the plant in which it would arise, and by no formula of a model: servo, linkage,
//! receiver, motor, tyre, load on the body, sensor. They combine freely.

use bicycle::Vehicle;

/// One departure. Wheels in the order front left, front right, rear left, rear right.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Deviation {
    /// The steering servo answers later: its response time grows.
    SteeringResponse {
        /// By this [s].
        added_s: f64,
    },
    /// The steering servo turns no faster than this.
    SteeringRate {
        /// Rate [rad/s].
        rate_radps: f64,
    },
    /// Steering commands wait longer on their way.
    SteeringDelay {
        /// By this [s].
        added_s: f64,
    },
    /// The linkage is mounted off the middle, left positive.
    SteeringTrim {
        /// Angle [rad].
        angle_rad: f64,
    },
    /// The linkage turns the wheels by a multiple of the servo's angle; the two differ for a bent one.
    SteeringRatio {
        /// To the left [-].
        left: f64,
        /// To the right [-].
        right: f64,
    },
    /// The linkage has play.
    SteeringPlay {
        /// Half of it [rad].
        half_width_rad: f64,
    },
    /// The front axle gives way under lateral force, which turns its wheels out of the bend.
    SteeringCompliance {
        /// Angle per lateral force of the axle [rad/N].
        rad_per_n: f64,
    },
    /// Tyres of harder or softer rubber: friction on every ground is multiplied, and small slip answers as before.
    TyreGrip {
        /// Factor [-].
        factor: f64,
    },
    /// Tyres that answer small slip more or less stiffly and slide with the same friction.
    TyreStiffness {
        /// Factor of the front tyres [-].
        front: f64,
        /// Factor of the rear tyres [-].
        rear: f64,
    },
    /// The motor answers later, and its controller is tuned to that.
    MotorResponse {
        /// By this [s].
        added_s: f64,
    },
    /// The motor controller smooths the speed command.
    ThrottleSmoothing {
        /// Time constant [s].
        time_s: f64,
    },
    /// Speed commands wait longer on their way.
    MotorDelay {
        /// By this [s].
        added_s: f64,
    },
    /// The motor controller ramps the speed no faster than this.
    MotorRamp {
        /// Acceleration and deceleration [m/s2].
        acceleration_mps2: f64,
    },
    /// The motor pulls and brakes no harder than this.
    MotorTorque {
        /// All driven wheels together [N m].
        limit_nm: f64,
    },
    /// The motor controller takes small commands for none.
    MotorDeadBand {
        /// Commands below this [m/s].
        speed_mps: f64,
    },
    /// The motor controller has no integral: under load the speed falls short.
    MotorDroop,
    /// Wheels of another size than the one the motor controller is calibrated for.
    WheelRadius {
        /// Factor [-].
        factor: f64,
    },
    /// Soft tyres or tight bearings.
    RollingResistance {
        /// Added resistance over load [-].
        added: f64,
    },
    /// A sail, a banner, a roof load: drag of the air.
    DragArea {
        /// Drag coefficient times area [m2].
        area_m2: f64,
    },
    /// Plants with more or stiffer stems than the map knows.
    DenseVegetation {
        /// Factor on their resistance [-].
        factor: f64,
    },
    /// A load that pulls along the body as it tilts, as one on rollers does, in shares of the vehicle's own weight.
    SlopePull {
        /// Along the body's x axis [-].
        along: f64,
        /// Along the body's y axis [-].
        across: f64,
    },
    /// A steady wind on the whole vehicle.
    Wind {
        /// Force east and north [N].
        force_n: [f64; 2],
    },
    /// A load that is spread like the vehicle's own mass and that the motor controller does not know of.
    Mass {
        /// Mass and inertia over those of the description [-].
        factor: f64,
    },
    /// Localisation tells an old pose.
    PoseLatency {
        /// Age [s].
        delay_s: f64,
    },
    /// The speed sensor is badly calibrated.
    OdometryScale {
        /// Factor [-].
        factor: f64,
    },
    /// The gyroscope is off by a constant.
    GyroBias {
        /// Rate [rad/s].
        rate_radps: f64,
    },
    /// The heading sensor is mounted askew.
    YawMisalignment {
        /// Angle [rad].
        angle_rad: f64,
    },
    /// A cart of one axle, coupled at the rear axle.
    Trailer {
        /// Mass [kg].
        mass_kg: f64,
        /// From the coupling to its axle [m].
        drawbar_m: f64,
        /// Rolling resistance over its weight [-].
        resistance: f64,
    },
    /// A tyre that has lost air.
    FlatTyre {
        /// Which wheel, 0 to 3.
        wheel: usize,
        /// Factor on its radius [-].
        radius: f64,
        /// Factor on its stiffness, radial and against slip [-].
        stiffness: f64,
        /// Added rolling resistance over load [-].
        resistance: f64,
    },
    /// A steady moment about the vertical, left positive.
    YawMoment {
        /// Moment [N m].
        torque_nm: f64,
    },
    /// A swinging load: a moment about the vertical that comes and goes.
    Sway {
        /// Largest moment [N m].
        torque_nm: f64,
        /// Period [s].
        period_s: f64,
    },
    /// The receiver loses the link now and then and holds the last command.
    CommandDropOut {
        /// From one loss to the next [s].
        period_s: f64,
        /// How long it lasts [s].
        length_s: f64,
    },
    /// The battery's voltage falls while driving, and every speed with it.
    BatterySag {
        /// Share of the speed per time [1/s].
        per_s: f64,
    },
}

/// A departure that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("deviation {part}.{parameter}: expected {low} to {high}, found {found}")]
pub struct DeviationError {
    /// Which departure.
    pub part: &'static str,
    /// Which of its numbers.
    pub parameter: &'static str,
    /// Smallest allowed value.
    pub low: f64,
    /// Largest allowed value.
    pub high: f64,
    /// What was given.
    pub found: f64,
}

/// A number with its name and bounds.
type Checked = (&'static str, f64, f64, f64);

impl Deviation {
    /// Refuses numbers that no part can have. Errors: [`DeviationError`].
    pub fn validate(&self) -> Result<(), DeviationError> {
        let (part, numbers) = self.numbers();
        match numbers.into_iter().find(|(_, found, low, high)| !(low..=high).contains(&found)) {
            Some((parameter, found, low, high)) => Err(DeviationError { part, parameter, low, high, found }),
            None => Ok(()),
        }
    }

    /// Name and bounded numbers.
    fn numbers(&self) -> (&'static str, Vec<Checked>) {
        const FORCE_N: f64 = 1e6;
        match *self {
            Self::SteeringResponse { added_s } => ("steering_response", vec![("added_s", added_s, 0.0, 5.0)]),
            Self::SteeringRate { rate_radps } => {
                ("steering_rate", vec![("rate_radps", rate_radps, 1e-3, 100.0)])
            }
            Self::SteeringDelay { added_s } => ("steering_delay", vec![("added_s", added_s, 0.0, 5.0)]),
            Self::SteeringTrim { angle_rad } => ("steering_trim", vec![("angle_rad", angle_rad, -0.5, 0.5)]),
            Self::SteeringRatio { left, right } => {
                ("steering_ratio", vec![("left", left, 0.1, 3.0), ("right", right, 0.1, 3.0)])
            }
            Self::SteeringPlay { half_width_rad } => {
                ("steering_play", vec![("half_width_rad", half_width_rad, 0.0, 0.5)])
            }
            Self::SteeringCompliance { rad_per_n } => {
                ("steering_compliance", vec![("rad_per_n", rad_per_n, 0.0, 1.0)])
            }
            Self::TyreGrip { factor } => ("tyre_grip", vec![("factor", factor, 0.05, 5.0)]),
            Self::TyreStiffness { front, rear } => {
                ("tyre_stiffness", vec![("front", front, 0.05, 5.0), ("rear", rear, 0.05, 5.0)])
            }
            Self::MotorResponse { added_s } => ("motor_response", vec![("added_s", added_s, 0.0, 5.0)]),
            Self::ThrottleSmoothing { time_s } => ("throttle_smoothing", vec![("time_s", time_s, 0.0, 5.0)]),
            Self::MotorDelay { added_s } => ("motor_delay", vec![("added_s", added_s, 0.0, 5.0)]),
            Self::MotorRamp { acceleration_mps2 } => {
                ("motor_ramp", vec![("acceleration_mps2", acceleration_mps2, 1e-3, 1e3)])
            }
            Self::MotorTorque { limit_nm } => ("motor_torque", vec![("limit_nm", limit_nm, 0.0, FORCE_N)]),
            Self::MotorDeadBand { speed_mps } => {
                ("motor_dead_band", vec![("speed_mps", speed_mps, 0.0, 100.0)])
            }
            Self::MotorDroop => ("motor_droop", vec![]),
            Self::WheelRadius { factor } => ("wheel_radius", vec![("factor", factor, 0.5, 2.0)]),
            Self::RollingResistance { added } => ("rolling_resistance", vec![("added", added, 0.0, 1.0)]),
            Self::DragArea { area_m2 } => ("drag_area", vec![("area_m2", area_m2, 0.0, 1e3)]),
            Self::DenseVegetation { factor } => ("dense_vegetation", vec![("factor", factor, 0.0, 1e3)]),
            Self::SlopePull { along, across } => {
                ("slope_pull", vec![("along", along, -2.0, 2.0), ("across", across, -2.0, 2.0)])
            }
            Self::Wind { force_n: [east_n, north_n] } => {
                ("wind", vec![("east_n", east_n, -FORCE_N, FORCE_N), ("north_n", north_n, -FORCE_N, FORCE_N)])
            }
            Self::Mass { factor } => ("mass", vec![("factor", factor, 0.3, 3.0)]),
            _ => self.more_numbers(),
        }
    }

    /// The same of sensors and of what breaks.
    fn more_numbers(&self) -> (&'static str, Vec<Checked>) {
        match *self {
            Self::PoseLatency { delay_s } => ("pose_latency", vec![("delay_s", delay_s, 0.0, 5.0)]),
            Self::OdometryScale { factor } => ("odometry_scale", vec![("factor", factor, 0.1, 3.0)]),
            Self::GyroBias { rate_radps } => ("gyro_bias", vec![("rate_radps", rate_radps, -1.0, 1.0)]),
            Self::YawMisalignment { angle_rad } => {
                ("yaw_misalignment", vec![("angle_rad", angle_rad, -1.0, 1.0)])
            }
            Self::Trailer { mass_kg, drawbar_m, resistance } => (
                "trailer",
                vec![
                    ("mass_kg", mass_kg, 1e-3, 1e5),
                    ("drawbar_m", drawbar_m, 0.05, 20.0),
                    ("resistance", resistance, 0.0, 1.0),
                ],
            ),
            Self::FlatTyre { wheel, radius, stiffness, resistance } => (
                "flat_tyre",
                vec![
                    ("wheel", wheel as f64, 0.0, 3.0),
                    ("radius", radius, 0.6, 1.0),
                    ("stiffness", stiffness, 0.1, 1.0),
                    ("resistance", resistance, 0.0, 1.0),
                ],
            ),
            Self::YawMoment { torque_nm } => ("yaw_moment", vec![("torque_nm", torque_nm, -1e6, 1e6)]),
            Self::Sway { torque_nm, period_s } => {
                ("sway", vec![("torque_nm", torque_nm, 0.0, 1e6), ("period_s", period_s, 0.05, 1e3)])
            }
            Self::CommandDropOut { period_s, length_s } => (
                "command_drop_out",
                vec![("period_s", period_s, 0.05, 1e3), ("length_s", length_s, 0.0, period_s)],
            ),
            Self::BatterySag { per_s } => ("battery_sag", vec![("per_s", per_s, 0.0, 0.02)]),
            _ => ("deviation", vec![]),
        }
    }
}

/// What the body and its wheels are like under these departures.
pub(crate) fn altered_body(vehicle: &Vehicle, deviations: &[Deviation]) -> Vehicle {
    let mut altered = vehicle.clone();
    for deviation in deviations {
        match *deviation {
            Deviation::Mass { factor } => {
                // All of it sits in the body, the wheels' share too.
                let wheels_kg = 4.0 * vehicle.wheel.mass_kg;
                altered.body.mass_kg += (factor - 1.0) * (vehicle.body.mass_kg + wheels_kg);
                altered.body.inertia_kgm2 = vehicle.body.inertia_kgm2.map(|inertia| factor * inertia);
            }
            Deviation::WheelRadius { factor } => altered.geometry.wheel_radius_m *= factor,
            Deviation::RollingResistance { added } => altered.tyre.rolling_resistance += added,
            _ => {}
        }
    }
    altered
}

/// What motor, servo and their controllers are like: built for the vehicle as described, each with its own departures.
pub(crate) fn altered_actuators(vehicle: &Vehicle, deviations: &[Deviation]) -> Vehicle {
    let mut altered = vehicle.clone();
    for deviation in deviations {
        match *deviation {
            Deviation::SteeringResponse { added_s } => altered.servo.response_s += added_s,
            Deviation::SteeringRate { rate_radps } => {
                let limits = &mut altered.limits;
                limits.steering_rate_max_radps = limits.steering_rate_max_radps.min(rate_radps);
            }
            Deviation::MotorResponse { added_s } => altered.drivetrain.response_s += added_s,
            Deviation::MotorRamp { acceleration_mps2 } => {
                let limits = &mut altered.limits;
                limits.acceleration_max_mps2 = limits.acceleration_max_mps2.min(acceleration_mps2);
            }
            Deviation::MotorTorque { limit_nm } => {
                let motor = &mut altered.drivetrain;
                motor.drive_torque_max_nm = motor.drive_torque_max_nm.min(limit_nm);
                motor.brake_torque_max_nm = motor.brake_torque_max_nm.min(limit_nm);
            }
            _ => {}
        }
    }
    altered
}

/// The vehicle as one of its wheels meets it.
pub(crate) fn altered_wheel(vehicle: &Vehicle, deviations: &[Deviation], index: usize) -> Vehicle {
    let mut altered = vehicle.clone();
    for deviation in deviations {
        if let Deviation::FlatTyre { wheel, radius, stiffness, resistance } = *deviation
            && wheel == index
        {
            altered.geometry.wheel_radius_m *= radius;
            altered.tyre.radial_stiffness_n_per_m *= stiffness;
            altered.tyre.rolling_resistance += resistance;
        }
    }
    altered
}
