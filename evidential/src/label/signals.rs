//! The columns of a run that labels are made from.

use std::ops::Range;

use bicycle::{Column, Geometry, Run};

use super::{LabelError, Response, Responses};

/// One run: what was commanded and what happened, one value per row.
pub(super) struct Signals {
    pub time_s: Vec<f64>,
    x_m: Vec<f64>,
    y_m: Vec<f64>,
    yaw_rad: Vec<f64>,
    pub roll_rad: Option<Vec<f64>>,
    pub pitch_rad: Option<Vec<f64>>,
    /// Forward speed over ground, seen from above [m/s].
    pub speed_mps: Vec<f64>,
    pub yaw_rate_radps: Vec<f64>,
    pub commanded_mps: Vec<f64>,
    /// What both commands amount to at once.
    pub commanded_radps: Vec<f64>,
    commanded_turn: TurnCommand,
}

/// How a machine is told to turn.
enum TurnCommand {
    /// By the angle of the front wheels: its tangent over the wheelbase [1/m].
    Curvature(Vec<f64>),
    /// By the yaw rate itself [rad/s].
    YawRate(Vec<f64>),
}

/// Commands as far as they have arrived.
pub(super) struct Aligned {
    pub speed_mps: Vec<f64>,
    pub yaw_rate_radps: Vec<f64>,
}

impl Signals {
    pub fn of(run: &Run<'_>, geometry: &Geometry) -> Result<Self, LabelError> {
        check_columns(run)?;
        let values = |column| run.column(column).map(<[f64]>::to_vec);
        let needed = |column| values(column).unwrap_or_default();
        let pitch_rad = values(Column::Pitch);
        let mut speed_mps = needed(Column::Vx);
        if let Some(pitch_rad) = &pitch_rad {
            // Poses and commands of the planner lie in the plane; a body that climbs moves less far in it.
            for (speed_mps, pitch_rad) in speed_mps.iter_mut().zip(pitch_rad) {
                *speed_mps *= pitch_rad.cos();
            }
        }
        let (commanded_mps, commanded_turn) = commands(run, geometry);
        let commanded_radps = commanded_turn.yaw_rate_radps(commanded_turn.values(), &commanded_mps);
        Ok(Self {
            time_s: run.time_s().to_vec(),
            x_m: needed(Column::X),
            y_m: needed(Column::Y),
            yaw_rad: needed(Column::Yaw),
            roll_rad: values(Column::Roll),
            pitch_rad,
            speed_mps,
            yaw_rate_radps: needed(Column::Wz),
            commanded_mps,
            commanded_radps,
            commanded_turn,
        })
    }

    pub fn pose(&self, row: usize) -> [f64; 3] {
        [self.x_m[row], self.y_m[row], self.yaw_rad[row]]
    }

    /// The rows at most half a window's length away, the row itself among them.
    pub fn window(&self, row: usize, window_s: f64) -> Range<usize> {
        // A nanosecond against the rounding of decimal times.
        let half_s = 0.5 * window_s + 1e-9;
        let now_s = self.time_s[row];
        let start = self.time_s.partition_point(|&time_s| time_s < now_s - half_s);
        let end = self.time_s.partition_point(|&time_s| time_s <= now_s + half_s);
        start..end.max(row + 1)
    }

    /// The commands passed through their responses.
    pub fn aligned(&self, responses: &Responses) -> Aligned {
        let speed_mps = self.arrived_speed(&responses.speed);
        let yaw_rate_radps = self.arrived_yaw_rate(&responses.turn, &speed_mps);
        Aligned { speed_mps, yaw_rate_radps }
    }

    /// Commanded speed passed through its response, from the speed at which the run begins.
    pub fn arrived_speed(&self, response: &Response) -> Vec<f64> {
        response.follow(&self.time_s, &self.commanded_mps, first_finite(&self.speed_mps))
    }

    /// Commanded yaw rate, where the turning command has passed through its response and `speed_mps` of the speed has
    /// arrived. What was commanded before the run is taken as its first command.
    pub fn arrived_yaw_rate(&self, response: &Response, speed_mps: &[f64]) -> Vec<f64> {
        let commanded = self.commanded_turn.values();
        let turn = response.follow(&self.time_s, commanded, first_finite(commanded));
        self.commanded_turn.yaw_rate_radps(&turn, speed_mps)
    }
}

impl TurnCommand {
    fn values(&self) -> &[f64] {
        match self {
            Self::Curvature(values) | Self::YawRate(values) => values,
        }
    }

    /// Yaw rate of a turning command of this kind at a speed.
    fn yaw_rate_radps(&self, turn: &[f64], speed_mps: &[f64]) -> Vec<f64> {
        match self {
            Self::Curvature(_) => turn.iter().zip(speed_mps).map(|(turn, speed)| turn * speed).collect(),
            Self::YawRate(_) => turn.to_vec(),
        }
    }
}

fn first_finite(values: &[f64]) -> f64 {
    values.iter().copied().find(|value| value.is_finite()).unwrap_or(0.0)
}

const NEEDED: [Column; 5] = [Column::X, Column::Y, Column::Yaw, Column::Vx, Column::Wz];

fn check_columns(run: &Run<'_>) -> Result<(), LabelError> {
    let has = |column| run.column(column).is_some();
    let mut missing: Vec<&str> =
        NEEDED.into_iter().filter(|column| !has(*column)).map(Column::name).collect();
    if !(has(Column::CmdLeft) && has(Column::CmdRight)) {
        if !has(Column::CmdSpeed) {
            missing.push("cmd_speed");
        }
        if !(has(Column::CmdSteer) || has(Column::CmdWz)) {
            missing.push("cmd_steer or cmd_wz");
        }
    }
    if missing.is_empty() {
        return Ok(());
    }
    let found: Vec<&str> = Column::ALL.into_iter().filter(|column| has(*column)).map(Column::name).collect();
    Err(LabelError::MissingColumns {
        run: run.name().to_owned(),
        missing: missing.join(", "),
        found: found.join(", "),
    })
}

/// Commanded speed and turn.
fn commands(run: &Run<'_>, geometry: &Geometry) -> (Vec<f64>, TurnCommand) {
    let values = |column| run.column(column).map(<[f64]>::to_vec);
    let sides = values(Column::CmdLeft).zip(values(Column::CmdRight));
    let mixed = |mix: &dyn Fn(f64, f64) -> f64| -> Vec<f64> {
        let sides = sides.iter().flat_map(|(left, right)| left.iter().zip(right));
        sides.map(|(left, right)| mix(*left, *right)).collect()
    };
    let speed_mps = values(Column::CmdSpeed)
        .unwrap_or_else(|| mixed(&|left_mps, right_mps| 0.5 * (left_mps + right_mps)));
    let turn = if let Some(steering_rad) = values(Column::CmdSteer) {
        let curvature = steering_rad.iter().map(|angle_rad| angle_rad.tan() / geometry.wheelbase_m);
        TurnCommand::Curvature(curvature.collect())
    } else {
        let of_sides = || mixed(&|left_mps, right_mps| (right_mps - left_mps) / geometry.track_m);
        TurnCommand::YawRate(values(Column::CmdWz).unwrap_or_else(of_sides))
    };
    (speed_mps, turn)
}
