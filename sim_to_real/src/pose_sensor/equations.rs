//! What a pose says of two seconds against what speed and yaw rate say of them.

use super::{PoseSensorError, Poses};
use crate::screening::quantile;
use bicycle::{Column, Readings, Run};
use nalgebra::{Matrix2x5, Vector2};

/// Length of what is compared [s].
const WINDOW_S: f64 = 2.0;
/// From one to the next [s].
const STRIDE_S: f64 = 0.2;
/// Largest time offset [s].
pub(super) const FARTHEST_S: f64 = 0.5;
/// Length of a stretch that the jackknife leaves out [s].
const STRETCH_S: f64 = 10.0;

/// One run: its poses, and the way that speed and yaw rate alone add up to.
pub(super) struct Way {
    poses: Poses,
    time_s: Vec<f64>,
    /// From the run's beginning: turn [rad], east and north [m] by a frame that heads east then, and the same two of a
    /// lateral velocity of -v^2 times the yaw rate.
    sums: [Vec<f64>; 5],
}

/// What is compared from an instant on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    /// Which stretch of ten seconds it lies in.
    pub stretch: usize,
    /// Turn by the pose less that by the yaw rate [rad].
    pub turn_rad: f64,
    /// Displacement by the pose, as seen from its beginning [m].
    pub moved_m: Vector2<f64>,
    /// What that is linear in: the way by speed and yaw rate, the same turned to the left, the slip, and one metre of
    /// lever arm ahead and to the left.
    pub regressors: Matrix2x5<f64>,
}

impl Window {
    /// By how much a lever arm of one metre moves to its side: the sine of the turn.
    pub(super) fn moves_of_a_lever(&self) -> f64 {
        self.regressors[(1, 3)]
    }
}

impl Way {
    pub(super) fn of(drive: &str, run: Run<'_>) -> Result<Self, PoseSensorError> {
        let missing =
            |column: Column| PoseSensorError::Missing { drive: drive.to_owned(), column: column.name() };
        let readings = |column| Readings::of(run, column);
        let speed = readings(Column::Vx).or_else(|| readings(Column::WheelSpeed));
        let speed = speed.ok_or_else(|| missing(Column::Vx))?;
        let yaw_rate = readings(Column::Wz).ok_or_else(|| missing(Column::Wz))?;
        let first_missing =
            [Column::X, Column::Y, Column::Yaw].into_iter().find(|column| readings(*column).is_none());
        let poses = Poses::of(run).ok_or_else(|| missing(first_missing.unwrap_or(Column::X)))?;
        let time_s = run.time_s().to_vec();
        let rates: Vec<_> = time_s.iter().map(|now_s| [speed.at(*now_s), yaw_rate.at(*now_s)]).collect();
        let mut way = Self { poses, sums: sums(&time_s, rates.iter().copied()), time_s };
        // A yaw rate that is off bends the way, which would stand for a lever arm.
        let turns = way.windows(0.0, 0).into_iter().flatten().map(|window| window.turn_rad);
        let off_radps = quantile(turns.collect(), 0.5) / WINDOW_S;
        way.sums = sums(&way.time_s, rates.iter().map(|[speed, yaw_rate]| [*speed, yaw_rate + off_radps]));
        Ok(way)
    }

    pub(super) fn duration_s(&self) -> f64 {
        self.time_s[self.time_s.len() - 1] - self.time_s[0]
    }

    /// All windows for a pose that is so late; those with a hole are left out where they lie. The first stretch has the
    /// number `stretch`.
    pub(super) fn windows(&self, offset_s: f64, stretch: usize) -> Vec<Option<Window>> {
        let room_s = self.duration_s() - WINDOW_S - 2.0 * FARTHEST_S;
        let n = (room_s / STRIDE_S).max(0.0) as usize;
        let start_s = |place: usize| FARTHEST_S + place as f64 * STRIDE_S;
        let window = |place: usize| {
            let stretch = stretch + (start_s(place) / STRETCH_S) as usize;
            self.window(self.time_s[0] + start_s(place), offset_s).map(|window| Window { stretch, ..window })
        };
        (0..n).map(window).collect()
    }

    fn window(&self, start_s: f64, offset_s: f64) -> Option<Window> {
        let [x0, y0, yaw0] = self.poses.at(start_s);
        let [x1, y1, yaw1] = self.poses.at(start_s + WINDOW_S);
        let [before, after] = [start_s, start_s + WINDOW_S].map(|now_s| self.summed(now_s - offset_s));
        let [turn, east, north, slip_east, slip_north] = std::array::from_fn(|sum| after[sum] - before[sum]);
        let turn_rad = (yaw1 - yaw0 - turn + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU)
            - std::f64::consts::PI;
        let moved_m = seen_from(yaw0, x1 - x0, y1 - y0);
        let [way, slip] = [[east, north], [slip_east, slip_north]].map(|[e, n]| seen_from(before[0], e, n));
        // The yaw's own noise turns what it moved as well, and would stand for a lever arm of half the way.
        let (sine, cosine) = turn.sin_cos();
        let regressors = Matrix2x5::from_columns(&[
            way,
            Vector2::new(-way.y, way.x),
            slip,
            Vector2::new(cosine - 1.0, sine),
            Vector2::new(-sine, cosine - 1.0),
        ]);
        let window = Window { stretch: 0, turn_rad, moved_m, regressors };
        (turn_rad + moved_m.sum() + regressors.sum()).is_finite().then_some(window)
    }

    /// The sums at an instant, in a straight line between rows; NaN outside of the run.
    fn summed(&self, now_s: f64) -> [f64; 5] {
        let next = self.time_s.partition_point(|t| *t <= now_s);
        let (Some(before), Some(next_s)) = (next.checked_sub(1), self.time_s.get(next)) else {
            return [f64::NAN; 5];
        };
        let share = (now_s - self.time_s[before]) / (next_s - self.time_s[before]);
        self.sums.each_ref().map(|sum| sum[before] + share * (sum[next] - sum[before]))
    }
}

fn seen_from(yaw_rad: f64, east_m: f64, north_m: f64) -> Vector2<f64> {
    let (sine, cosine) = yaw_rad.sin_cos();
    Vector2::new(cosine * east_m + sine * north_m, cosine * north_m - sine * east_m)
}

/// [`Way::sums`] by the trapezoidal rule; where speed or yaw rate is missing, what was measured last goes on.
fn sums(time_s: &[f64], rates: impl Iterator<Item = [f64; 2]>) -> [Vec<f64>; 5] {
    let mut sums: [Vec<f64>; 5] = Default::default();
    let (mut now, mut held, mut before) = ([0.0; 5], [0.0; 2], None);
    for (&row_s, rates) in time_s.iter().zip(rates) {
        for (held, rate) in held.iter_mut().zip(rates) {
            *held = if rate.is_nan() { *held } else { rate };
        }
        let [speed, yaw_rate] = held;
        let step_s = before.map_or(0.0, |(before_s, ..): (f64, f64, f64)| row_s - before_s);
        let (_, speed_before, yaw_rate_before) = before.unwrap_or((row_s, speed, yaw_rate));
        let turn = 0.5 * step_s * (yaw_rate_before + yaw_rate);
        let (sine, cosine) = (now[0] + 0.5 * turn).sin_cos();
        let way = 0.5 * step_s * (speed_before + speed);
        let slip = -0.5 * way * (speed_before * yaw_rate_before + speed * yaw_rate);
        let change = [turn, cosine * way, sine * way, -sine * slip, cosine * slip];
        now.iter_mut().zip(change).for_each(|(sum, change)| *sum += change);
        sums.iter_mut().zip(now).for_each(|(sum, now)| sum.push(now));
        before = Some((row_s, speed, yaw_rate));
    }
    sums
}
