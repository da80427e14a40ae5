//! What has no name of its own in the catalogue.

use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::Made;
use super::fleet::TestMachine;
use crate::Deviation;
use crate::friction::brush_friction;
use crate::plant::GRAVITY_MPS2;

/// Their names.
pub const UNKNOWNS: [&str; 7] = [
    "unk_trailer",
    "unk_flat_tyre",
    "unk_yaw_moment",
    "unk_command_dropout",
    "unk_battery_sag",
    "unk_periodic",
    "unk_asymmetric_gain",
];

/// Numbers and departures of one of them on a machine.
pub(super) fn make(id: &str, machine: &TestMachine, rng: &mut Xoshiro256PlusPlus) -> Made {
    let wheelbase_m = machine.vehicle.geometry.wheelbase_m;
    match id {
        "unk_trailer" => {
            let mass_kg = rng.random_range(0.3..0.5) * machine.mass_kg();
            let drawbar_m = rng.random_range(0.9..1.3) * wheelbase_m;
            let resistance = rng.random_range(0.08..0.15);
            let trailer = Deviation::Trailer { mass_kg, drawbar_m, resistance };
            Made::new("trailer_mass", mass_kg, trailer).with("trailer_length", drawbar_m)
        }
        "unk_flat_tyre" => {
            let wheel = rng.random_range(0..4);
            let [radius, stiffness] = [rng.random_range(0.8..0.88), rng.random_range(0.3..0.5)];
            let flat =
                Deviation::FlatTyre { wheel, radius, stiffness, resistance: rng.random_range(0.1..0.2) };
            Made::new("flat_wheel", wheel as f64, flat).with("flat_radius", radius)
        }
        "unk_yaw_moment" => {
            let sign = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
            let torque_nm = sign * turning_nm(rng.random_range(0.2..0.35), machine);
            Made::new("yaw_moment", torque_nm, Deviation::YawMoment { torque_nm })
        }
        "unk_command_dropout" => {
            let [period_s, length_s] = [rng.random_range(2.6..3.6), rng.random_range(0.7..1.0)];
            let lost = Deviation::CommandDropOut { period_s, length_s };
            Made::new("drop_period", period_s, lost).with("drop_len", length_s)
        }
        "unk_battery_sag" => {
            let per_s = rng.random_range(0.004..0.007);
            Made::new("v_sag", per_s, Deviation::BatterySag { per_s })
        }
        "unk_periodic" => {
            let [share, period_s] = [rng.random_range(0.4..0.7), rng.random_range(0.9..1.8)];
            let torque_nm = turning_nm(share, machine);
            Made::new("yaw_shake", torque_nm, Deviation::Sway { torque_nm, period_s })
                .with("shake_period", period_s)
        }
        _ => {
            let left = rng.random_range(0.65..0.8);
            Made::new("st_gain_left", left, Deviation::SteeringRatio { left, right: 1.0 })
        }
    }
}

/// The moment under which a drive would turn as under `share` of the largest steering angle: axles half a wheelbase
/// from the middle hold half of the weight each, times the friction of their tyres at the slip that turning gives them.
fn turning_nm(share: f64, machine: &TestMachine) -> f64 {
    let vehicle = &machine.vehicle;
    let slip = 0.5 * share * machine.steering_max_rad.tan();
    let held = brush_friction(machine.friction(), vehicle.tyre.slip_stiffness, slip);
    0.5 * machine.mass_kg() * GRAVITY_MPS2 * held * vehicle.geometry.wheelbase_m
}
