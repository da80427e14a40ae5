//! How far locked wheels slide on three grounds, beside v² / (2 mu g).
//!
//! `cargo run -p friction --example braking_distance`

use friction::{Chassis, Controls, FrictionCurve, GRAVITY_MPS2, Plane, State};

const STEP_S: f64 = 1e-3;
const SPEEDS_MPS: [f64; 2] = [12.0, 2.0];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Without load sensitivity, for the closed form has none.
    let chassis =
        Chassis { load_sensitivity: 0.0, ..Chassis::of(&formats::read_vehicle("pietra_full_size")?) };
    let locked = Controls { edge_mps: [0.0; 4], steering_rad: 0.0 };
    let grounds =
        [("asphalt", FrictionCurve::ASPHALT), ("grass", FrictionCurve::GRASS), ("ice", FrictionCurve::ICE)];
    for (name, curve) in grounds {
        let plane = Plane { friction: curve, slope_rad: 0.0 };
        let velocity = [SPEEDS_MPS[0], 0.0, 0.0];
        let mut state = State { at_m: [0.0; 2], heading_rad: 0.0, velocity, specific_mps2: [0.0; 2] };
        while state.velocity[0] > SPEEDS_MPS[1] {
            state = chassis.step(&state, &locked, &plane, STEP_S);
        }
        let [static_friction, sliding, viscous] =
            [curve.static_friction, curve.sliding_friction, curve.viscous_friction].map(f64::from);
        let slid_m =
            |friction: f64| (SPEEDS_MPS[0].powi(2) - SPEEDS_MPS[1].powi(2)) / (2.0 * friction * GRAVITY_MPS2);
        let least_m = slid_m(static_friction.max(sliding) + viscous * SPEEDS_MPS[0]);
        let most_m = slid_m(static_friction.min(sliding));
        println!("{name:8}{:6.1} m; between {least_m:.1} and {most_m:.1} m", state.at_m[0]);
        assert!((least_m - 0.1..most_m + 0.1).contains(&state.at_m[0]));
    }
    Ok(())
}
