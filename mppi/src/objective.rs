//! What the controller is asked to do and what it is told.

use crate::cost_to_go::{CostToGoView, N_HEADINGS};
use crate::kernel::Kernel;
use bicycle::lanes::{Constant, Lanes, Real};
use bicycle::{MotionState, State};
use std::f64::consts::FRAC_PI_2;
use traversability::{GridGeometry, RiskMapView};

/// Changes of the time to go per cell that are less than this lead nowhere [s].
const SMALLEST_SLOPE_S: f64 = 1e-6;

/// One cycle's input.
#[derive(Clone, Copy, Debug)]
pub struct Input<'a, S = State> {
    /// Measured state, in the terms of the controller's model.
    pub state: S,
    /// Time since the previous decision; 0 on the first [s].
    pub elapsed_s: f64,
    /// Risk and ground around the vehicle.
    pub map: RiskMapView<'a>,
    /// What to do.
    pub objective: Objective<'a>,
    /// Number of the cycle; together with the seed it keys the noise.
    pub cycle: u64,
}

impl<'a, S: Copy + Into<MotionState>> Input<'a, S> {
    /// The same with the state in the terms of all models.
    pub(crate) fn in_shared_terms(&self) -> Input<'a, MotionState> {
        let Self { state, elapsed_s, map, objective, cycle } = *self;
        Input { state: state.into(), elapsed_s, map, objective, cycle }
    }
}

/// What to do.
#[derive(Clone, Copy, Debug)]
pub enum Objective<'a> {
    /// Reach a point.
    Goal {
        /// The point in the map frame [m].
        goal_m: [f64; 2],
        /// Distance at which it counts as reached [m].
        tolerance_m: f64,
        /// How the rest of the way is valued at the end of the horizon.
        terminal: Terminal<'a>,
    },
    /// Follow a path.
    Path(ReferencePath<'a>),
}

/// How the rest of the way is valued at the end of the horizon.
#[derive(Clone, Copy, Debug)]
pub enum Terminal<'a> {
    /// The straight line at the configured rest speed.
    StraightLine,
    /// The time over the known map.
    CostToGo(CostToGoView<'a>),
}

/// A polyline to follow.
#[derive(Clone, Copy, Debug)]
pub struct ReferencePath<'a> {
    /// Corners in the map frame [m]; at least two.
    pub points_m: &'a [[f64; 2]],
    /// Speed along it [m/s].
    pub speed_mps: f64,
    /// Distance from the last corner at which the end counts as reached [m].
    pub tolerance_m: f64,
}

impl Objective<'_> {
    /// The point to reach in the end and how near counts; `None` for numbers or a path that make no objective.
    pub(crate) fn end(&self) -> Option<([f64; 2], f64)> {
        let (end_m, tolerance_m) = match *self {
            Self::Goal { goal_m, tolerance_m, .. } => (goal_m, tolerance_m),
            Self::Path(path) if path.is_usable() => (*path.points_m.last()?, path.tolerance_m),
            Self::Path(_) => return None,
        };
        let finite = end_m[0].is_finite() && end_m[1].is_finite() && tolerance_m.is_finite();
        finite.then_some((end_m, tolerance_m))
    }
}

/// Where the reference is at the end of one step, in cells, and what the distance from it costs.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ReferenceStep {
    pub(crate) x_cells: Constant,
    pub(crate) y_cells: Constant,
    pub(crate) tangent: [Constant; 2],
    /// Of a cell along the path, squared [s].
    pub(crate) along_s: Constant,
    /// Of a cell across the path, squared [s].
    pub(crate) across_s: Constant,
}

impl ReferencePath<'_> {
    /// Length along the path of its point nearest to `at_m` [m].
    pub(crate) fn project(&self, at_m: [f64; 2]) -> f64 {
        let mut best = (f64::INFINITY, 0.0);
        let mut passed_m = 0.0;
        for ends in self.points_m.windows(2) {
            let (along, length_m) = direction(ends[0], ends[1]);
            let from = [at_m[0] - ends[0][0], at_m[1] - ends[0][1]];
            let foot_m = (from[0] * along[0] + from[1] * along[1]).clamp(0.0, length_m);
            let distance_m = libm::hypot(from[0] - foot_m * along[0], from[1] - foot_m * along[1]);
            if distance_m < best.0 {
                best = (distance_m, passed_m + foot_m);
            }
            passed_m += length_m;
        }
        best.1
    }

    /// Point and direction at a length along the path; beyond its end, the end.
    pub(crate) fn at(&self, length_m: f64) -> ([f64; 2], [f64; 2]) {
        let mut left_m = length_m.max(0.0);
        let mut end = (self.points_m[0], [1.0, 0.0]);
        for ends in self.points_m.windows(2) {
            let (along, segment_m) = direction(ends[0], ends[1]);
            let step_m = left_m.min(segment_m);
            end = ([ends[0][0] + step_m * along[0], ends[0][1] + step_m * along[1]], along);
            if left_m <= segment_m {
                return end;
            }
            left_m -= segment_m;
        }
        end
    }

    pub(crate) fn is_usable(&self) -> bool {
        let finite = self.points_m.iter().flatten().all(|value| value.is_finite());
        self.points_m.len() >= 2 && finite && self.speed_mps.is_finite() && self.tolerance_m.is_finite()
    }
}

/// Unit vector and length from one point to another.
fn direction(from_m: [f64; 2], to_m: [f64; 2]) -> ([f64; 2], f64) {
    let (dx, dy) = (to_m[0] - from_m[0], to_m[1] - from_m[1]);
    let length_m = libm::hypot(dx, dy);
    if length_m > 0.0 { ([dx / length_m, dy / length_m], length_m) } else { ([1.0, 0.0], 0.0) }
}

/// A cost-to-go field seen from another grid's cells.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TerminalField<'a> {
    seconds: &'a [f32],
    /// What the turning circle adds, shape [heading, row, col]; empty where that is told as on open ground.
    turning_s: &'a [f32],
    n_rows: usize,
    n_cols: usize,
    /// Cells of the field per cell of the map.
    scale: f64,
    /// Of the field's first cell centre, in cells of the field.
    offset: [f64; 2],
    /// Of a radian of the vehicle's tightest turn [s].
    turning_s_per_rad: f64,
}

impl<'a> TerminalField<'a> {
    /// `None` when the field has less than two rows or columns, or not the lengths that its geometry says.
    pub(crate) fn new(view: CostToGoView<'a>, map: &GridGeometry, turning_s_per_rad: f64) -> Option<Self> {
        let GridGeometry { n_rows, n_cols, resolution_m, .. } = view.geometry;
        let (map_corner, corner) = (map.south_west_m(), view.geometry.south_west_m());
        let offset = [0, 1].map(|axis| (map_corner[axis] - corner[axis]) / resolution_m - 0.5);
        let CostToGoView { seconds, turning_s, .. } = view;
        let n_turning = if turning_s.is_empty() { 0 } else { N_HEADINGS * n_rows * n_cols };
        let fits = seconds.len() == n_rows * n_cols && turning_s.len() == n_turning;
        let usable = n_rows >= 2 && n_cols >= 2 && fits;
        let scale = map.resolution_m / resolution_m;
        usable.then_some(Self { seconds, turning_s, n_rows, n_cols, scale, offset, turning_s_per_rad })
    }

    /// Time to go from a pose [s]: that of its place, interpolated between cell centres, beyond the field that of its
    /// rim; and what it takes to turn.
    #[inline(always)]
    pub(crate) fn time_to_go<K: Kernel>(
        &self,
        x_cells: Real<K>,
        y_cells: Real<K>,
        turns: Real<K>,
    ) -> Real<K> {
        let spot = self.spot(x_cells, y_cells);
        let (seconds, gradient) = self.seconds(&spot);
        seconds + self.turning_s(&spot, gradient, turns)
    }

    /// What it takes from a pose to turn to the way [s].
    #[inline(always)]
    pub(crate) fn time_to_turn<K: Kernel>(
        &self,
        x_cells: Real<K>,
        y_cells: Real<K>,
        turns: Real<K>,
    ) -> Real<K> {
        let spot = self.spot(x_cells, y_cells);
        let (_, gradient) = self.seconds(&spot);
        self.turning_s(&spot, gradient, turns)
    }

    #[inline(always)]
    fn turning_s<K: Kernel>(&self, spot: &Spot<K>, gradient: [Real<K>; 2], turns: Real<K>) -> Real<K> {
        if self.turning_s.is_empty() {
            self.turning_on_open_ground_s(gradient, turns)
        } else {
            self.turning_among_obstacles_s(spot, turns)
        }
    }

    /// As the search over poses found it, interpolated between cells and headings.
    #[inline(always)]
    fn turning_among_obstacles_s<K: Kernel>(&self, spot: &Spot<K>, turns: Real<K>) -> Real<K> {
        let kernel = turns.0;
        let ([heading, next], share) = headings(turns);
        let n_cells = kernel.word((self.n_rows * self.n_cols) as u32);
        let at = |heading: K::Bits| {
            let corner = kernel.add_bits(kernel.mul_bits(heading, n_cells), spot.corner);
            self.between_cells(self.turning_s, corner, spot).0
        };
        let (from, to) = (at(heading), at(next));
        (to - from).mul_add(share, from)
    }

    /// Who faces away from the way by an angle e and drives the tightest turn of radius R covers R e until it faces it,
    /// and comes R sin e nearer: R (e - sin e) are lost. With that much added, time to go falls by a second per second
    /// in the tightest turn on open ground, whatever the heading (the Dubins vehicle, far from its goal).
    #[inline(always)]
    fn turning_on_open_ground_s<K: Kernel>(&self, [east, north]: [Real<K>; 2], turns: Real<K>) -> Real<K> {
        let kernel = turns.0;
        let (sine, cosine) = turns.sin_cos_turns();
        let slope = east.mul_add(east, north * north).sqrt().max(kernel.real(SMALLEST_SLOPE_S));
        let facing_away = east.mul_add(cosine, north * sine) / slope;
        lost_rad(facing_away) * kernel.real(self.turning_s_per_rad)
    }

    /// Time to go, and its change per cell to the east and to the north [s].
    #[inline(always)]
    fn seconds<K: Kernel>(&self, spot: &Spot<K>) -> (Real<K>, [Real<K>; 2]) {
        self.between_cells(self.seconds, spot.corner, spot)
    }

    /// Where a point lies among the cell centres.
    #[inline(always)]
    fn spot<K: Kernel>(&self, x_cells: Real<K>, y_cells: Real<K>) -> Spot<K> {
        let kernel = x_cells.0;
        let (col, east) = self.place(x_cells, self.offset[0], self.n_cols);
        let (row, north) = self.place(y_cells, self.offset[1], self.n_rows);
        let corner = kernel.add_bits(kernel.mul_bits(row, kernel.word(self.n_cols as u32)), col);
        Spot { corner, east, north }
    }

    /// A table's value between four cells, of which the south-western is at `corner`, and its change per cell to the east
    /// and to the north.
    #[inline(always)]
    fn between_cells<K: Kernel>(
        &self,
        table: &[f32],
        corner: K::Bits,
        spot: &Spot<K>,
    ) -> (Real<K>, [Real<K>; 2]) {
        let kernel = spot.east.0;
        let (south, rise_south) = along_row(table, corner, spot.east);
        let upper_corner = kernel.add_bits(corner, kernel.word(self.n_cols as u32));
        let (upper, rise_upper) = along_row(table, upper_corner, spot.east);
        let eastward = (rise_upper - rise_south).mul_add(spot.north, rise_south);
        ((upper - south).mul_add(spot.north, south), [eastward, upper - south])
    }

    /// Cell and share of the way to the next one, along one axis.
    #[inline(always)]
    fn place<K: Kernel>(&self, cells: Real<K>, offset: f64, n: usize) -> (K::Bits, Real<K>) {
        let kernel = cells.0;
        let place = cells.mul_add(kernel.real(self.scale), kernel.real(offset));
        let place = place.clamp(kernel.real(0.0), kernel.real((n - 1) as f64));
        let whole = kernel.truncate(place.min(kernel.real((n - 2) as f64)).1);
        (whole, place - Real(kernel, kernel.convert(whole)))
    }
}

/// Where a point lies among the cell centres of a field: the cell to the south-west, and the shares of the way to the
/// next ones.
struct Spot<K: Kernel> {
    corner: K::Bits,
    east: Real<K>,
    north: Real<K>,
}

/// Between a cell and its eastern neighbour, and how much more the neighbour's is.
#[inline(always)]
fn along_row<K: Kernel>(table: &[f32], index: K::Bits, share: Real<K>) -> (Real<K>, Real<K>) {
    let kernel = share.0;
    let west = Real(kernel, kernel.gather(table, index));
    let east = Real(kernel, kernel.gather(table, kernel.add_bits(index, kernel.word(1))));
    ((east - west).mul_add(share, west), east - west)
}

/// Share of an octant, counted from an axis, at which the knight's move lies: atan(1/2) of 45 degrees.
const KNIGHT_SHARE: f64 = 0.590_334_470_601_733;

/// The headings of the search on either side of a yaw, and how far it is from the first to the second. Two lie in every
/// octant: its beginning and a knight's move, nearer to its diagonal.
#[inline(always)]
fn headings<K: Kernel>(turns: Real<K>) -> ([K::Bits; 2], Real<K>) {
    let kernel = turns.0;
    let [zero, one] = [0.0, 1.0].map(|value| kernel.real(value));
    let wrapped = turns.wrap_turns();
    let octants = wrapped.add_where(wrapped.less(zero), one) * kernel.real(8.0);
    let octant = kernel.truncate_up_to(octants.1, kernel.real(7.0).1);
    let past = octants - Real(kernel, kernel.convert(octant));
    let begins_at_diagonal = Real(kernel, kernel.convert(kernel.and_bits(octant, kernel.word(1))));
    let knight = begins_at_diagonal.mul_add(kernel.real(1.0 - 2.0 * KNIGHT_SHARE), kernel.real(KNIGHT_SHARE));
    let is_beyond = zero.add_where(past.exceeds(knight), one);
    let length = is_beyond.mul_add(one - knight - knight, knight);
    let share = ((past - is_beyond * knight) / length).clamp(zero, one);
    let heading = kernel.add_bits(kernel.shl::<1>(octant), kernel.truncate(is_beyond.1));
    let next = kernel.and_bits(kernel.add_bits(heading, kernel.word(1)), kernel.word(15));
    ([heading, next], share)
}

/// e - sin e of the angle e in [0, pi] between a heading and the way [rad], by the cosine of the angle between the
/// heading and the way back.
///
/// From the half angle: e = 2 asin(s), sin e = 2 s c; the arc sine by Abramowitz and Stegun 4.4.45, to 7e-5 rad.
#[inline(always)]
fn lost_rad<L: Lanes>(facing_away: Real<L>) -> Real<L> {
    let lanes = facing_away.0;
    let [one, half] = [1.0, 0.5].map(|value| lanes.real(value));
    let away = facing_away.clamp(-one, one);
    let (sine, cosine) = (away.mul_add(half, half).sqrt(), ((one - away) * half).sqrt());
    let [c0, c1, c2, c3] =
        [1.570_728_8, -0.212_114_4, 0.074_261, -0.018_729_3].map(|value| lanes.real(value));
    let complement = (one - sine).sqrt() * c3.mul_add(sine, c2).mul_add(sine, c1).mul_add(sine, c0);
    let angle = lanes.real(FRAC_PI_2) - complement;
    (angle - sine * cosine) * lanes.real(2.0)
}
