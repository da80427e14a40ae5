//! The vehicle and the ground as MuJoCo's modelling language has them.

use std::fmt::Write;

use bicycle::{Axle, Differential, Vehicle};
use mujoco_rs::prelude::MjModel;
use nalgebra::{Isometry3, Vector3};

use crate::plant::chassis::{PANEL_FRICTION, boxes};
use crate::plant::drivetrain::LIMITED_SLIP_S_PER_M;
use crate::plant::ground::Ground;
use crate::plant::rest::{Rest, Stance};
use crate::plant::{GRAVITY_MPS2, PlantError};

/// Wheels by the names of their joints, bodies and geoms.
pub(super) const WHEELS: [&str; 4] = ["front_left", "front_right", "rear_left", "rear_right"];
/// Share of a wheel's mass in what carries its hub and does not turn [-].
const CARRIER_SHARE: f64 = 0.1;
/// The tyre is an ellipsoid this much wider than the tread: with a cylinder's edges and flat tread, contact on a height
/// field breaks up into dozens of points, whose loads chatter [-].
const CROWN_RATIO: f64 = 2.0;
/// Natural frequency of a steered wheel on its actuator [rad/s].
const STEERING_RADPS: f64 = 100.0;
/// Friction of contacts is this much stiffer than their normal direction, so that braked wheels hardly creep [-].
const FRICTION_STIFFNESS_RATIO: f64 = 50.0;
/// Least extent of a height field upwards, and how far its base lies below [m].
const FIELD_RISE_MIN_M: f64 = 1e-3;

/// Hubs at the height of the wheel's radius, which MuJoCo's contacts all but keep.
pub(super) fn stance(vehicle: &Vehicle) -> Stance {
    let geometry = &vehicle.geometry;
    let hub = |i: usize| {
        let ahead_m = if i < 2 { geometry.wheelbase_m } else { 0.0 };
        let left_m = if i.is_multiple_of(2) { 0.5 } else { -0.5 } * geometry.track_m;
        Vector3::new(ahead_m, left_m, 0.0)
    };
    Stance {
        hub_m: std::array::from_fn(hub),
        axle_height_m: geometry.wheel_radius_m,
        rolling_radius_m: geometry.wheel_radius_m,
        cog_m: Vector3::new(
            vehicle.body.cog_ahead_m,
            0.0,
            vehicle.body.cog_height_m - geometry.wheel_radius_m,
        ),
    }
}

/// The model of a vehicle that stands like this on this ground.
pub(super) fn model(
    vehicle: &Vehicle,
    rest: &Rest,
    stance: &Stance,
    ground: &Ground,
    step_s: f64,
) -> Result<MjModel, PlantError> {
    let text = [
        head(step_s),
        field(ground),
        body(vehicle, rest, stance),
        couplings(vehicle, rest),
        "</mujoco>".to_owned(),
    ]
    .concat();
    let mut model = MjModel::from_xml_string(&text).map_err(|error| told(&error))?;
    raise(model.hfield_data_mut(), ground);
    Ok(model)
}

/// What MuJoCo says against something.
pub(super) fn told(error: &dyn std::error::Error) -> PlantError {
    PlantError::Mujoco { told: error.to_string() }
}

/// A state that is no number is told, not set back.
fn head(step_s: f64) -> String {
    format!(
        r#"<mujoco><compiler angle="radian" inertiafromgeom="false"/><size memory="16M"/>
        <option timestep="{step_s}" gravity="0 0 -{GRAVITY_MPS2}" cone="elliptic" integrator="implicitfast"
            impratio="{FRICTION_STIFFNESS_RATIO}"><flag autoreset="disable"/></option>
        <default><geom contype="1" conaffinity="2" solref="0.02 1" solimp="0.9 0.9 0.001 0.5 2"/></default>"#
    )
}

/// Lowest height of the ground and its rise [m].
fn range_m(ground: &Ground) -> [f64; 2] {
    let heights_m = || ground.surface_m().iter().map(|height_m| f64::from(*height_m));
    let lowest_m = heights_m().fold(f64::INFINITY, f64::min);
    [lowest_m, (heights_m().fold(f64::NEG_INFINITY, f64::max) - lowest_m).max(FIELD_RISE_MIN_M)]
}

/// MuJoCo splits its squares from south-west to north-east as the world does.
fn field(ground: &Ground) -> String {
    let [n_rows, n_cols] = ground.size();
    let [low_m, high_m] = ground.extent_m();
    let half_m = [0.5 * (high_m[0] - low_m[0]), 0.5 * (high_m[1] - low_m[1])];
    let [lowest_m, rise_m] = range_m(ground);
    format!(
        r#"<asset><hfield name="ground" nrow="{n_rows}" ncol="{n_cols}" size="{} {} {rise_m} {rise_m}"/></asset>
        <worldbody><geom name="ground" type="hfield" hfield="ground" pos="{} {} {lowest_m}"
            contype="2" conaffinity="1" friction="0"/>"#,
        half_m[0],
        half_m[1],
        low_m[0] + half_m[0],
        low_m[1] + half_m[1],
    )
}

/// Fills in the heights as shares of the rise.
fn raise(shares: &mut [f32], ground: &Ground) {
    let [lowest_m, rise_m] = range_m(ground);
    for (share, height_m) in shares.iter_mut().zip(ground.surface_m()) {
        *share = ((f64::from(*height_m) - lowest_m) / rise_m) as f32;
    }
}

fn body(vehicle: &Vehicle, rest: &Rest, stance: &Stance) -> String {
    let vehicle_body = &vehicle.body;
    let mut text = format!(
        r#"<body name="chassis"><freejoint/><inertial pos="{}" mass="{}" diaginertia="{}"/>"#,
        triple(&stance.cog_m),
        vehicle_body.mass_kg,
        triple(&Vector3::from(vehicle_body.inertia_kgm2)),
    );
    for [low_m, high_m] in boxes(vehicle, stance) {
        let (middle_m, half_m) = ((low_m + high_m) * 0.5, (high_m - low_m) * 0.5);
        // A box may be flat where the wheels stand flush with an end of the vehicle.
        let half_m = half_m.map(|half_m| half_m.max(1e-4));
        push(
            &mut text,
            format_args!(
                r#"<geom type="box" pos="{}" size="{}" friction="{PANEL_FRICTION}"/>"#,
                triple(&middle_m),
                triple(&half_m),
            ),
        );
    }
    for (i, hub_m) in stance.hub_m.iter().enumerate() {
        text += &wheel(vehicle, rest.load_n[i], i, hub_m);
    }
    text + "</body></worldbody>"
}

/// Moments of inertia of a wheel about its axle and across it [kg m2].
fn wheel_inertia_kgm2(vehicle: &Vehicle) -> [f64; 2] {
    let wheel = &vehicle.wheel;
    let across = 0.5 * wheel.spin_inertia_kgm2 + wheel.mass_kg * wheel.width_m * wheel.width_m / 12.0;
    [wheel.spin_inertia_kgm2, across]
}

/// Strut, steering and axle of a wheel. An unloaded spring is loose, so that the wheel hangs no lower than that.
fn wheel(vehicle: &Vehicle, load_n: f64, i: usize, hub_m: &Vector3<f64>) -> String {
    let (name, wheel, radius_m) = (WHEELS[i], &vehicle.wheel, vehicle.geometry.wheel_radius_m);
    let spring = [vehicle.front, vehicle.rear][i / 2].suspension;
    let loose_m = -(load_n - wheel.mass_kg * GRAVITY_MPS2).max(0.0) / spring.stiffness_n_per_m;
    let [spin, across] = wheel_inertia_kgm2(vehicle);
    let steering = if i < 2 {
        format!(r#"<joint name="steering_{name}" type="hinge" axis="0 0 1"/>"#)
    } else {
        String::new()
    };
    let (carrier_kg, turning_kg) = (CARRIER_SHARE * wheel.mass_kg, (1.0 - CARRIER_SHARE) * wheel.mass_kg);
    format!(
        r#"<body pos="{hub}"><joint name="strut_{name}" type="slide" axis="0 0 1" limited="true"
            range="{low_m} {most_m}" stiffness="{stiffness}" damping="{damping}" springref="{loose_m}"/>{steering}
        <inertial pos="0 0 0" mass="{carrier_kg}" diaginertia="{carrier} {carrier} {carrier}"/>
        <body name="{name}"><joint name="axle_{name}" type="hinge" axis="0 1 0" solimpfriction="0.9999 0.9999 0.001 0.5 2"/>
        <inertial pos="0 0 0" mass="{turning_kg}" diaginertia="{across} {spin} {across}"/>
        <geom name="{name}" type="ellipsoid" size="{radius_m} {half_width_m} {radius_m}" priority="1"/></body></body>"#,
        hub = triple(hub_m),
        low_m = loose_m.max(-spring.travel_m).min(-1e-3 * spring.travel_m),
        most_m = spring.travel_m,
        stiffness = spring.stiffness_n_per_m,
        damping = spring.damping_ns_per_m,
        carrier = CARRIER_SHARE * across,
        half_width_m = 0.5 * CROWN_RATIO * wheel.width_m,
    )
}

/// Anti-roll bars, differential and steering actuators.
fn couplings(vehicle: &Vehicle, rest: &Rest) -> String {
    let track_m = vehicle.geometry.track_m;
    let bar = |axle: &Axle, [left, right]: [&str; 2]| {
        let stiffness = axle.anti_roll_nm_per_rad / (track_m * track_m);
        format!(
            r#"<fixed stiffness="{stiffness}"><joint joint="strut_{left}" coef="1"/><joint joint="strut_{right}"
                coef="-1"/></fixed>"#
        )
    };
    let bars = bar(&vehicle.front, [WHEELS[0], WHEELS[1]]) + &bar(&vehicle.rear, [WHEELS[2], WHEELS[3]]);
    let [tendons, equalities] = differential(vehicle, rest);
    let [_, across] = wheel_inertia_kgm2(vehicle);
    let gain = (1.0 + CARRIER_SHARE) * across * STEERING_RADPS * STEERING_RADPS;
    let actuator = |name| format!(r#"<position joint="steering_{name}" kp="{gain}" dampratio="1"/>"#);
    format!(
        "<tendon>{bars}{tendons}</tendon><equality>{equalities}</equality><actuator>{}{}</actuator>",
        actuator(WHEELS[0]),
        actuator(WHEELS[1])
    )
}

/// Viscous tendons between the driven wheels, which together pull each towards the mean, or axles that turn as one.
fn differential(vehicle: &Vehicle, rest: &Rest) -> [String; 2] {
    let rear = vehicle.drivetrain.rear_share;
    let driven: Vec<&str> =
        (0..4).filter(|i| if *i < 2 { rear < 1.0 } else { rear > 0.0 }).map(|i| WHEELS[i]).collect();
    let pairs = (0..driven.len()).flat_map(|i| (i + 1..driven.len()).map(move |j| [i, j]));
    let pairs = pairs.map(|pair| pair.map(|i| driven[i]));
    let mean_load_n = 0.25 * rest.mass_kg * GRAVITY_MPS2;
    let damping_nms =
        LIMITED_SLIP_S_PER_M * mean_load_n * vehicle.geometry.wheel_radius_m.powi(2) / driven.len() as f64;
    let mut texts = [String::new(), String::new()];
    match vehicle.drivetrain.differential {
        Differential::Open => {}
        Differential::LimitedSlip => pairs.for_each(|[one, other]| {
            push(&mut texts[0], format_args!(
                r#"<fixed damping="{damping_nms}"><joint joint="axle_{one}" coef="1"/><joint joint="axle_{other}"
                    coef="-1"/></fixed>"#
            ));
        }),
        Differential::Locked => driven[1..].iter().for_each(|other| {
            let one = driven[0];
            push(&mut texts[1], format_args!(r#"<joint joint1="axle_{other}" joint2="axle_{one}"/>"#));
        }),
    }
    texts
}

/// Where a wheel's foot is wanted above the ground for the vehicle to be set down without touching it.
pub(super) fn depth_m(
    ground: &Ground,
    radius_m: f64,
    width_m: f64,
    hub_m: Vector3<f64>,
    left: Vector3<f64>,
) -> f64 {
    const STEPS: i32 = 8;
    let ahead = Vector3::new(left.y, -left.x, 0.0).normalize();
    let places =
        (-STEPS..=STEPS).flat_map(|i| [-0.5, 0.0, 0.5].map(|side| (f64::from(i) / f64::from(STEPS), side)));
    let above_m = places.map(|(share, side)| {
        let place_m = hub_m + ahead * (share * radius_m) + left * (side * width_m);
        let rim_m = radius_m * (1.0 - share * share).max(0.0).sqrt();
        ground.height_m(place_m.x, place_m.y) - (place_m.z - rim_m)
    });
    above_m.fold(f64::NEG_INFINITY, f64::max)
}

fn triple(vector: &Vector3<f64>) -> String {
    format!("{} {} {}", vector.x, vector.y, vector.z)
}

fn push(text: &mut String, more: std::fmt::Arguments<'_>) {
    // A string takes whatever it is given.
    text.write_fmt(more).unwrap_or_default();
}

/// The pose as MuJoCo's free joint holds it: position [m] and unit quaternion, scalar first.
pub(super) fn free_joint(pose: &Isometry3<f64>) -> [f64; 7] {
    let (at_m, turn) = (pose.translation.vector, pose.rotation.coords);
    [at_m.x, at_m.y, at_m.z, turn.w, turn.x, turn.y, turn.z]
}
