//! What the commands ask of the actuators at every row of drives, and what the effects then hold.

use super::pack::{Pack, packed};
use super::{Simulator, ground};
use crate::drive::{Drive, N_STEPS, VX, YAW};
use crate::evidence::SpeedInput;
use bicycle::{Asked, LaneState};
use std::f64::consts::TAU;

/// What every row of a drive gives to a rollout that starts there.
pub(super) struct Rows {
    /// Speed and steering angle, or what stands for them, and acceleration, row by row.
    pub(super) asked: [Vec<f32>; 3],
    /// Row by row for each that is held [m/s2].
    pub(super) held: Vec<Vec<f32>>,
}

impl Simulator {
    /// Of as many drives as there are lanes at most, which are driven by the same columns; as far as their rollouts go.
    #[inline(always)]
    pub(super) fn rows<L: Pack>(&self, lanes: L, drives: &[&Drive]) -> Vec<Rows> {
        let end = |drive: &&Drive| drive.starts.last().map_or(0, |last| last + N_STEPS);
        let n_rows = drives.iter().map(end).max().unwrap_or(0);
        let n_held = self.stepper.n_held();
        let empty = |_: &&Drive| Rows {
            asked: std::array::from_fn(|_| Vec::with_capacity(n_rows)),
            held: vec![Vec::with_capacity(n_rows); n_held],
        };
        let mut rows: Vec<Rows> = drives.iter().map(empty).collect();
        let mut memory = self.settled(lanes, drives);
        for row in 0..n_rows {
            let asked = self.asked(lanes, (drives, row), &mut memory);
            for (place, value) in [asked.speed, asked.steering, asked.acceleration].into_iter().enumerate() {
                let values = L::unpack(value.1);
                rows.iter_mut().zip(values).for_each(|(own, value)| own.asked[place].push(value));
            }
            for (place, held) in self.stepper.held(&mut memory).iter().enumerate() {
                let values = L::unpack(*held);
                rows.iter_mut().zip(values).for_each(|(own, value)| own.held[place].push(value));
            }
            if n_held > 0 && row + 1 < n_rows {
                self.observe(lanes, (drives, row), asked, &mut memory);
            }
        }
        rows
    }

    /// The memory of vehicles that followed their first commands for long.
    #[inline(always)]
    fn settled<L: Pack>(&self, lanes: L, drives: &[&Drive]) -> Vec<L::Value> {
        let settled = |drive: &&Drive| {
            let mut memory = vec![0.0; self.stepper.n_slots()];
            self.stepper.fill_steady_state(drive.commands[0], &mut memory);
            memory
        };
        let settled: Vec<Vec<f64>> = drives.iter().map(settled).collect();
        let mut memory = vec![lanes.real(0.0).1; self.stepper.n_slots()];
        for (slot, value) in memory.iter_mut().enumerate() {
            *value = packed(lanes, |lane| settled[lane.min(settled.len() - 1)][slot] as f32).1;
        }
        memory
    }

    #[inline(always)]
    fn asked<L: Pack>(
        &self,
        lanes: L,
        (drives, row): (&[&Drive], usize),
        memory: &mut [L::Value],
    ) -> Asked<L> {
        // A speed that was measured is what the sensor made of it.
        let per_reading = match drives[0].evidence.speed_input {
            SpeedInput::Measured => 1.0 / self.sensors.velocity_ratio,
            SpeedInput::Commanded | SpeedInput::CommandedAcceleration => 1.0,
        };
        let command = |lane: usize| of_lane(drives, lane, |drive| &drive.commands, row);
        let speed = packed(lanes, |lane| command(lane).speed_mps) * lanes.real(per_reading);
        let steering = packed(lanes, |lane| command(lane).steering_rad);
        let reached = packed(lanes, |lane| *of_lane(drives, lane, |drive| &drive.smooth[VX], row) as f32);
        self.stepper.asked([speed, steering], reached, memory, row)
    }

    /// Goes the step that was driven, so that what is held follows it.
    #[inline(always)]
    fn observe<L: Pack>(
        &self,
        lanes: L,
        (drives, row): (&[&Drive], usize),
        asked: Asked<L>,
        memory: &mut [L::Value],
    ) {
        let zero = lanes.real(0.0);
        let per_reading = lanes.real(1.0 / self.sensors.velocity_ratio);
        let driven = |row: usize, lane: usize| *of_lane(drives, lane, |drive| &drive.smooth[VX], row) as f32;
        let before = packed(lanes, |lane| driven(row, lane)) * per_reading;
        let after = packed(lanes, |lane| driven(row + 1, lane)) * per_reading;
        let turns = packed(lanes, |lane| {
            let yaw_rad = of_lane(drives, lane, |drive| &drive.smooth[YAW], row);
            let turns = (yaw_rad - self.sensors.yaw_offset_rad) / TAU;
            (turns - turns.round_ties_even()) as f32
        });
        let east = packed(lanes, |lane| *of_lane(drives, lane, |drive| &drive.gradient[0], row));
        let north = packed(lanes, |lane| *of_lane(drives, lane, |drive| &drive.gradient[1], row));
        let class = packed(lanes, |lane| *of_lane(drives, lane, |drive| &drive.class, row));
        let mut state = LaneState { x: zero, y: zero, turns, speed: before, steering: zero };
        let ground = ground(lanes, [east, north], class);
        self.follow(drives[0].evidence, &mut state, asked, &ground, memory);
        self.stepper.correct_held(memory, after - state.speed);
    }
}

/// What a lane's drive tells of a row, or of its last one; spare lanes repeat the last drive.
#[inline(always)]
fn of_lane<'a, T>(
    drives: &[&'a Drive],
    lane: usize,
    told: impl Fn(&'a Drive) -> &'a Vec<T>,
    row: usize,
) -> &'a T {
    let told = told(drives[lane.min(drives.len() - 1)]);
    &told[row.min(told.len() - 1)]
}
