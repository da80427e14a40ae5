//! The shipping controller along a planned line.

use bicycle::{Command, Model, Vehicle};
use mppi::{Config, ConfigError, Controller, Input, Isa, Objective, ReferencePath};
use scenarios::{Landscape, Motion};
use terrain::Cell;
use traversability::{Risk, RiskMap};

use super::track::{CONTROL_HZ, Follower, Foot};
use crate::closed_loop::slopes;

/// Decides at every so many cycles of the tracking: ten times a second.
const EVERY: u64 = 2;
/// The line is handed on so far ahead, and its end counts as reached so near [m].
const AHEAD_M: f64 = 60.0;
const TOLERANCE_M: f64 = 1.0;
/// The speed to hold is the plan's so far ahead in time [s].
const SPEED_AHEAD_S: f64 = 0.8;
const CREEPING_MPS: f64 = 2.0;
/// The rear axle's centre keeps farther from trees and water than half the vehicle's width, by this [m].
const CLEARANCE_M: f64 = 0.3;

/// Knows the slopes, trees and water of the whole ground and follows the plan's line at the plan's speeds.
pub(super) struct MppiFollower {
    controller: Controller,
    map: RiskMap,
    cycle: u64,
    command: Command,
}

impl MppiFollower {
    pub fn new(landscape: &Landscape, vehicle: &Vehicle, seed: u64) -> Result<Self, ConfigError> {
        let config = Config { n_threads: 1, isa: Isa::Auto, ..Config::default() };
        let controller = Controller::new(config, Model::of(vehicle), seed)?;
        let map = known(landscape, 0.5 * vehicle.geometry.width_m + CLEARANCE_M);
        Ok(Self { controller, map, cycle: 0, command: Command::default() })
    }
}

/// Slopes, and no pose nearer to a tree or to water than `clear_m`.
fn known(landscape: &Landscape, clear_m: f64) -> RiskMap {
    let world = &landscape.world;
    let geometry = *world.geometry();
    let mut map = slopes(world);
    let is_closed = |index: usize| {
        let [x_m, y_m] = geometry.centre_m(geometry.cell(index));
        let patch = world.patch(x_m, y_m);
        patch.obstacle_height_m > 0.0 || patch.is_water()
    };
    let n_cells = (clear_m / geometry.resolution_m).ceil() as usize;
    map.fill(|risks, _| {
        for index in (0..geometry.n_rows * geometry.n_cols).filter(|index| is_closed(*index)) {
            let Cell { row, col } = geometry.cell(index);
            let near = |at: usize, n: usize| at.saturating_sub(n_cells)..(at + n_cells + 1).min(n);
            for row_near in near(row, geometry.n_rows) {
                for col_near in near(col, geometry.n_cols) {
                    let apart = row_near.abs_diff(row).pow(2) + col_near.abs_diff(col).pow(2);
                    if (apart as f64).sqrt() * geometry.resolution_m <= clear_m {
                        risks[row_near * geometry.n_cols + col_near] = Risk::NONE.blocked();
                    }
                }
            }
        }
    });
    map
}

impl Follower for MppiFollower {
    fn command(&mut self, motion: &Motion, foot: &Foot<'_>, _off_m: f64) -> Command {
        let cycle = self.cycle;
        self.cycle += 1;
        if !cycle.is_multiple_of(EVERY) {
            return self.command;
        }
        let n_ahead = (AHEAD_M / foot.spacing_m).round() as usize;
        let end = foot.points.len().min(foot.index + n_ahead + 2);
        let points_m: Vec<[f64; 2]> =
            foot.points[foot.index.min(end - 2)..end].iter().map(|point| point.at_m).collect();
        let ahead_m = motion.velocity_mps[0].max(0.0) * SPEED_AHEAD_S;
        let decision = self.controller.decide(&Input {
            state: state(motion),
            elapsed_s: if cycle == 0 { 0.0 } else { EVERY as f64 / CONTROL_HZ },
            map: self.map.view(),
            objective: Objective::Path(ReferencePath {
                points_m: &points_m,
                speed_mps: foot.ahead(ahead_m).speed_mps.max(CREEPING_MPS),
                tolerance_m: TOLERANCE_M,
            }),
            cycle: cycle / EVERY,
        });
        self.command = decision.command(self.command);
        self.command
    }
}

/// What the controller is told of the vehicle: the truth, as the other follower.
fn state(motion: &Motion) -> bicycle::State {
    bicycle::State {
        x_m: motion.pose.x_m,
        y_m: motion.pose.y_m,
        yaw_rad: motion.pose.yaw_rad,
        speed_mps: motion.velocity_mps[0],
        steering_rad: motion.steering_rad,
    }
}
