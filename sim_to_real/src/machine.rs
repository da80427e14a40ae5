//! The machine whose simulator is on trial: what is known of it before any drive.

use bicycle::{Column, DriveLog, Vehicle};
use formats::{DescribedVehicle, GapNoise, GapVehicle};
use serde::{Deserialize, Serialize};

/// Standard deviations of the measurements' noise.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensorNoise {
    /// Position east and north [m].
    pub position_m: f64,
    /// Yaw [rad].
    pub yaw_rad: f64,
    /// Forward velocity [m/s].
    pub speed_mps: f64,
    /// Yaw rate [rad/s].
    pub yaw_rate_radps: f64,
}

/// Heights and classes of the ground at nodes of a grid.
#[derive(Clone, Debug, PartialEq)]
pub struct GroundMap {
    /// Position of node (0, 0): east, north [m].
    pub origin_m: [f64; 2],
    /// Between nodes [m].
    pub resolution_m: f64,
    /// Number of nodes east and north.
    pub n_nodes: [usize; 2],
    /// Heights, north index fastest: node (i east, j north) at `i * n_nodes[1] + j` [m].
    pub height_m: Vec<f32>,
    /// Classes in the same order: 0 open, 1 loose, 2 vegetation.
    pub class: Vec<u8>,
}

/// A vehicle as its simulator's owner describes it.
#[derive(Clone, Debug, PartialEq)]
pub struct Machine {
    /// Name, for reports.
    pub name: String,
    /// Between the axles [m].
    pub wheelbase_m: f64,
    /// Largest steering angle that is ever commanded [rad].
    pub steering_max_rad: f64,
    /// Fastest speed that is ever commanded [m/s].
    pub speed_max_mps: f64,
    /// Noise of its measurements, where known.
    pub noise: Option<SensorNoise>,
    /// The ground that it drives on, where known.
    pub ground: Option<GroundMap>,
}

impl Machine {
    /// Whichever vehicle was described.
    pub fn described(vehicle: DescribedVehicle, drives: &[DriveLog]) -> Self {
        match vehicle {
            DescribedVehicle::Planned(vehicle) => Self::of_vehicle(&vehicle),
            DescribedVehicle::Case(vehicle) => Self::of_case(vehicle, drives),
        }
    }

    /// A vehicle of the planner's; nothing is known of its noise and its ground.
    pub fn of_vehicle(vehicle: &Vehicle) -> Self {
        Self {
            name: vehicle.name.clone(),
            wheelbase_m: vehicle.geometry.wheelbase_m,
            steering_max_rad: vehicle.limits.steering_max_rad,
            speed_max_mps: vehicle.limits.speed_max_mps,
            noise: None,
            ground: None,
        }
    }

    /// A vehicle as a case describes it, with the limits that its drives show where none are stated.
    pub fn of_case(vehicle: GapVehicle, drives: &[DriveLog]) -> Self {
        let ground = vehicle.ground.map(|ground| GroundMap {
            origin_m: ground.origin_m,
            resolution_m: ground.resolution_m,
            n_nodes: ground.n_nodes,
            height_m: ground.height_m,
            class: ground.class,
        });
        let steering = || largest(drives, &[Column::CmdSteer, Column::SteerMeas]);
        let speed = || largest(drives, &[Column::CmdSpeed, Column::Vx, Column::WheelSpeed]);
        Self {
            name: vehicle.name,
            wheelbase_m: vehicle.wheelbase_m,
            steering_max_rad: vehicle.steering_max_rad.unwrap_or_else(steering),
            speed_max_mps: vehicle.speed_max_mps.unwrap_or_else(speed),
            noise: noise(&vehicle.noise),
            ground,
        }
    }
}

/// The noise, if all of it is stated.
fn noise(noise: &GapNoise) -> Option<SensorNoise> {
    Some(SensorNoise {
        position_m: (0.5 * (noise.x?.powi(2) + noise.y?.powi(2))).sqrt(),
        yaw_rad: noise.yaw?,
        speed_mps: noise.vx?,
        yaw_rate_radps: noise.wz?,
    })
}

/// The largest size of the first of these columns that a drive has.
fn largest(drives: &[DriveLog], columns: &[Column]) -> f64 {
    let runs = drives.iter().flat_map(DriveLog::runs);
    let values = runs.filter_map(|run| columns.iter().find_map(|column| run.column(*column)));
    values.flatten().fold(0.0, |largest: f64, value| largest.max(value.abs()))
}
