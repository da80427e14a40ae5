//! The gaps: each made by the plant's own parts, with the effect of the catalogue that it amounts to.

use bicycle::Effect;
use bicycle::effect::CATALOGUE;
use scenarios::{Deviation, TestMachine};
use serde::{Deserialize, Serialize};

/// What the plant does and its simulator does not.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Gap {
    /// Nothing: the plant as its simulator has it.
    None,
    /// Steering commands wait on their way.
    SteerDelay,
    /// The servo is slow.
    SteerLag,
    /// The front axle gives way under lateral force.
    Understeer,
    /// The motor is slow.
    SpeedLag,
    /// Tyres of hard rubber.
    Friction,
    /// A load that pulls downhill.
    SlopeGravity,
}

/// Delay added to the steering [s].
const STEERING_DELAY_S: f64 = 0.22;
/// Response time added to the servo [s].
const STEERING_RESPONSE_S: f64 = 0.35;
/// Yaw rate lost at the machine's fastest command, over what is left [-].
const UNDERSTEER_AT_FAST: f64 = 0.6;
/// Response time added to the motor [s].
const MOTOR_RESPONSE_S: f64 = 0.9;
/// Grip of the hard tyres over that of the described ones [-].
const GRIP: f64 = 0.4;
/// Pull of the load over the vehicle's weight, per sine of the slope [-].
const SLOPE_PULL: f64 = 1.2;

impl Gap {
    /// All gaps; the first is none.
    pub const ALL: [Self; 7] = [
        Self::None,
        Self::SteerDelay,
        Self::SteerLag,
        Self::Understeer,
        Self::SpeedLag,
        Self::Friction,
        Self::SlopeGravity,
    ];

    /// Name on the command line and in files: the effect's id in the catalogue.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::SteerDelay => "steer_delay",
            Self::SteerLag => "steer_lag",
            Self::Understeer => "understeer",
            Self::SpeedLag => "speed_lag",
            Self::Friction => "friction",
            Self::SlopeGravity => "slope_gravity",
        }
    }

    /// What departs in the plant.
    pub fn deviation(self, machine: &TestMachine) -> Option<Deviation> {
        Some(match self {
            Self::None => return None,
            Self::SteerDelay => Deviation::SteeringDelay { added_s: STEERING_DELAY_S },
            Self::SteerLag => Deviation::SteeringResponse { added_s: STEERING_RESPONSE_S },
            Self::Understeer => Deviation::SteeringCompliance {
                rad_per_n: understeer(machine) * machine.vehicle.geometry.wheelbase_m / front_kg(machine),
            },
            Self::SpeedLag => Deviation::MotorResponse { added_s: MOTOR_RESPONSE_S },
            Self::Friction => Deviation::TyreGrip { factor: GRIP },
            Self::SlopeGravity => Deviation::SlopePull { along: SLOPE_PULL, across: 0.0 },
        })
    }

    /// The effect that it amounts to, with the parameters that follow from the part's own numbers.
    pub fn effect(self, machine: &TestMachine) -> Option<Effect> {
        let numbers = match self {
            Self::None => return None,
            Self::SteerDelay => vec![("delay_s", STEERING_DELAY_S)],
            Self::SteerLag => vec![("time_constant_s", STEERING_RESPONSE_S)],
            Self::Understeer => vec![("gradient_s2_per_m2", understeer(machine))],
            Self::SpeedLag => vec![("time_constant_s", MOTOR_RESPONSE_S)],
            Self::Friction => vec![("mu", GRIP * friction(machine)), ("agility", agility(machine))],
            Self::SlopeGravity => vec![("share", SLOPE_PULL)],
        };
        effect(self.name(), &numbers)
    }
}

/// The effect of this id with these parameters; those that are not given stay neutral.
fn effect(id: &str, numbers: &[(&str, f64)]) -> Option<Effect> {
    let description = CATALOGUE.iter().find(|description| description.id == id)?;
    let mut values = [0.0; 4];
    for (value, parameter) in values.iter_mut().zip(description.parameters) {
        let given = numbers.iter().find(|(name, _)| *name == parameter.name);
        *value = given.map_or(parameter.neutral, |(_, value)| *value);
    }
    Effect::from_values(id, values)
}

/// Product of the axles' distances from the centre of gravity over the squared radius of gyration [-].
fn agility(machine: &TestMachine) -> f64 {
    let (body, wheelbase_m) = (&machine.vehicle.body, machine.vehicle.geometry.wheelbase_m);
    body.cog_ahead_m * (wheelbase_m - body.cog_ahead_m) * body.mass_kg / body.inertia_kgm2[2]
}

/// Coefficient K of yaw rate = v tan(steering) / (L (1 + K v^2)) [s2/m2].
fn understeer(machine: &TestMachine) -> f64 {
    UNDERSTEER_AT_FAST / (machine.speeds_mps[1] * machine.speeds_mps[1])
}

/// Mass that the front axle carries [kg]. The axle holds m v^2 kappa sideways; giving way by C of it makes
/// kappa = tan(steering) / (L + C m v^2).
fn front_kg(machine: &TestMachine) -> f64 {
    let vehicle = &machine.vehicle;
    vehicle.body.mass_kg * vehicle.body.cog_ahead_m / vehicle.geometry.wheelbase_m
        + 2.0 * vehicle.wheel.mass_kg
}

/// Friction of the firm ground: the most that the machine's world holds [-].
pub(super) fn friction(machine: &TestMachine) -> f64 {
    let patches = machine.world.patches.values().iter();
    patches.map(|patch| f64::from(patch.friction.static_friction)).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_gap_is_a_part_of_the_plant_and_an_effect_of_its_name() {
        let base = formats::read_vehicle("pietra_full_size").unwrap();
        let machine = TestMachine::draw(&base, "v", 1).unwrap();
        for gap in Gap::ALL {
            let (deviation, effect) = (gap.deviation(&machine), gap.effect(&machine));
            assert_eq!(deviation.is_none(), gap == Gap::None);
            assert!(deviation.is_none_or(|deviation| deviation.validate().is_ok()));
            assert_eq!(effect.map_or("none", |effect| effect.description().id), gap.name());
            assert!(effect.is_none_or(|effect| effect.validate().is_ok()));
        }
    }
}
