//! What a run tells: which of its columns drive the model, which are compared, and which effects they can judge.

use crate::machine::Machine;
use bicycle::{Column, Run};

/// What drives the model's speed, best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum SpeedInput {
    /// `cmd_speed`.
    Commanded,
    /// `cmd_accel`.
    CommandedAcceleration,
    /// The measured speed itself.
    Measured,
}

/// What drives the model's yaw rate, best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum TurnInput {
    /// `cmd_steer`.
    CommandedAngle,
    /// `steer_meas`.
    MeasuredAngle,
    /// `cmd_wz` of a skid-steered machine.
    CommandedYawRate,
    /// `wheel_wz` of a skid-steered machine.
    WheelYawRate,
}

/// Where the speed comes from that rollouts start with and are compared to, best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum SpeedSource {
    /// `vx`.
    Body,
    /// `wheel_speed`.
    Wheels,
    /// Derived from the pose: starts rollouts, and is compared through the pose alone.
    Path,
    /// Nothing was measured: the model's own response to the commands.
    Command,
}

/// The inputs and measurements of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Evidence {
    pub(crate) speed_input: SpeedInput,
    pub(crate) turn_input: TurnInput,
    pub(crate) speed_source: SpeedSource,
    /// Position and yaw together.
    pub(crate) pose: bool,
    pub(crate) yaw: bool,
    pub(crate) yaw_rate: bool,
    pub(crate) side_speed: bool,
    /// Slopes of the ground, from a map or the attitude.
    pub(crate) slopes: bool,
    /// Classes of the ground.
    pub(crate) classes: bool,
}

impl Evidence {
    /// Errors: the column that would serve best where nothing tells the speed or the turning.
    pub(crate) fn of(run: &Run<'_>, machine: &Machine) -> Result<Self, &'static str> {
        let has = |column: Column| {
            run.column(column).is_some_and(|values| values.iter().any(|value| !value.is_nan()))
        };
        let yaw = has(Column::Yaw);
        let pose = yaw && has(Column::X) && has(Column::Y);
        let sources = [(SpeedSource::Body, has(Column::Vx)), (SpeedSource::Wheels, has(Column::WheelSpeed))];
        let speed_source =
            first(&sources).unwrap_or(if pose { SpeedSource::Path } else { SpeedSource::Command });
        let speed_input = first(&[
            (SpeedInput::Commanded, has(Column::CmdSpeed)),
            // An acceleration alone leads nowhere without a speed to start from.
            (
                SpeedInput::CommandedAcceleration,
                has(Column::CmdAccel) && speed_source != SpeedSource::Command,
            ),
            (SpeedInput::Measured, speed_source != SpeedSource::Command),
        ]);
        let turn_input = first(&[
            (TurnInput::CommandedAngle, has(Column::CmdSteer)),
            (TurnInput::MeasuredAngle, has(Column::SteerMeas)),
            (TurnInput::CommandedYawRate, has(Column::CmdWz)),
            (TurnInput::WheelYawRate, has(Column::WheelWz)),
        ]);
        Ok(Self {
            speed_input: speed_input.ok_or(Column::CmdSpeed.name())?,
            turn_input: turn_input.ok_or(Column::CmdSteer.name())?,
            speed_source,
            pose,
            yaw,
            yaw_rate: has(Column::Wz),
            side_speed: run.column(Column::Vy).is_some_and(changes),
            slopes: machine.ground.is_some() || (has(Column::Roll) && has(Column::Pitch)),
            classes: machine.ground.is_some(),
        })
    }

    /// Whether the second input is a yaw rate and no angle.
    pub(crate) fn is_skid_steered(&self) -> bool {
        matches!(self.turn_input, TurnInput::CommandedYawRate | TurnInput::WheelYawRate)
    }

    fn measures_speed(&self) -> bool {
        matches!(self.speed_source, SpeedSource::Body | SpeedSource::Wheels)
    }

    /// Whether anything was measured that tells how the speed answers its input.
    fn judges_speed(&self) -> bool {
        self.speed_input != SpeedInput::Measured && self.speed_source != SpeedSource::Command
    }

    /// Whether an effect changes a prediction that can be compared, and differently from every input itself.
    pub(crate) fn judges(&self, id: &str) -> bool {
        let by_angle = !self.is_skid_steered();
        let is_commanded = matches!(self.turn_input, TurnInput::CommandedAngle | TurnInput::CommandedYawRate);
        match id {
            "motor_deadband" | "accel_limit" | "drive_force_limit" | "speed_loop" | "feed_forward"
            | "speed_integral" | "drive_lag" | "speed_ramp" | "wheel_slip" => {
                self.judges_speed() && self.speed_input == SpeedInput::Commanded
            }
            "speed_delay" | "speed_scale" | "speed_lag" | "speed_lag_chain" | "drive_limit"
            | "drive_power" | "mass" | "rolling_drag" | "quad_drag" | "wind" => self.judges_speed(),
            "cornering_drag" => self.judges_speed() && by_angle,
            "slope_gravity" | "hill_compensation" | "felt_slope" | "compensation_loss" => {
                self.judges_speed() && self.slopes
            }
            "veg_drag" | "loose_drag" => self.judges_speed() && self.classes,
            "cross_slope" => self.slopes,
            "steer_rate" | "backlash" => is_commanded,
            "friction" | "tyre_slide" => by_angle,
            "tyre_slip" => by_angle && (self.pose || self.side_speed),
            "rear_slip" | "rear_steer" => self.pose || self.side_speed,
            "yaw_misalign" => self.pose,
            "pose_latency" => self.pose && (self.measures_speed() || self.yaw_rate),
            "odom_scale" => self.pose && self.measures_speed(),
            "gyro_bias" => self.yaw_rate,
            _ => self.yaw || self.yaw_rate,
        }
    }

    /// What is missing and what that means, in sentences; none for a drive that has everything.
    pub(crate) fn notes(&self) -> Vec<&'static str> {
        let speed = match self.speed_input {
            SpeedInput::Commanded => None,
            SpeedInput::CommandedAcceleration => Some(
                "cmd_speed is missing: cmd_accel drives the speed; effects on the speed command (speed_delay, \
                 speed_lag, speed_scale) mean the commanded acceleration, and effects of a speed controller cannot \
                 be judged",
            ),
            SpeedInput::Measured => Some(
                "cmd_speed and cmd_accel are missing: the measured speed drives the model, and no effect on the speed \
                 can be judged",
            ),
        };
        let source = match self.speed_source {
            SpeedSource::Body => None,
            SpeedSource::Wheels => {
                Some("vx is missing: wheel_speed stands for it, slip of the wheels included")
            }
            SpeedSource::Path => Some("vx and wheel_speed are missing: the speed comes from the path"),
            SpeedSource::Command => Some(
                "no speed was measured: the commanded one is taken for granted, and no effect on the speed can be \
                 judged",
            ),
        };
        let turn = match self.turn_input {
            TurnInput::CommandedAngle => None,
            TurnInput::MeasuredAngle => Some(
                "cmd_steer is missing: steer_meas is the input, so that the steering actuator is measured and not \
                 judged; a delay or lag is that of the body behind its wheels",
            ),
            TurnInput::CommandedYawRate => Some(
                "skid-steered: cmd_wz is the input, and effects on the steering mean that yaw rate (a steer_gain is \
                 achieved over commanded yaw rate, angles are yaw rates in rad/s)",
            ),
            TurnInput::WheelYawRate => Some(
                "skid-steered without cmd_wz: wheel_wz is the input, so that the drive of the wheels is measured and \
                 not judged; effects on the steering mean that yaw rate, angles are yaw rates in rad/s",
            ),
        };
        let pose = (!self.pose).then_some(
            "the pose is missing: displacements are not compared, and effects on path and pose cannot be judged",
        );
        let yaw_rate =
            (!self.yaw_rate).then_some("wz is missing: the turn is compared through the yaw alone");
        let slopes = (!self.slopes).then_some(
            "neither a map nor roll and pitch are known: effects of the ground's slope cannot be judged",
        );
        [speed, source, turn, pose, yaw_rate, slopes].into_iter().flatten().collect()
    }
}

/// Whether a column tells anything: one value throughout is what a log holds that had nothing to put there.
fn changes(values: &[f64]) -> bool {
    let mut told = values.iter().filter(|value| !value.is_nan());
    told.next().is_some_and(|first| told.any(|value| value != first))
}

/// The first that there is.
fn first<T: Copy>(candidates: &[(T, bool)]) -> Option<T> {
    candidates.iter().find(|(_, is_there)| *is_there).map(|(candidate, _)| *candidate)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

    use super::*;
    use crate::drive::testing::{log, machine};

    fn evidence(columns: &[Column]) -> Result<Evidence, &'static str> {
        let drive = log(columns, 2, 0.1, |_, _| 1.0);
        Evidence::of(&drive.runs().next().unwrap(), &machine())
    }

    #[test]
    fn the_best_column_that_is_there_serves() {
        use Column::{
            CmdAccel, CmdSpeed, CmdSteer, CmdWz, SteerMeas, Vx, WheelSpeed, WheelWz, Wz, X, Y, Yaw,
        };
        let all = evidence(&[CmdSpeed, CmdAccel, CmdSteer, SteerMeas, CmdWz, Vx, WheelSpeed, Wz]).unwrap();
        assert_eq!(
            (all.speed_input, all.turn_input, all.speed_source),
            (SpeedInput::Commanded, TurnInput::CommandedAngle, SpeedSource::Body)
        );
        let sedan = evidence(&[SteerMeas, X, Y, Yaw, Vx, Wz]).unwrap();
        assert_eq!((sedan.speed_input, sedan.turn_input), (SpeedInput::Measured, TurnInput::MeasuredAngle));
        assert!(sedan.judges("understeer") && !sedan.judges("speed_lag") && !sedan.judges("slope_gravity"));
        let skid = evidence(&[CmdSpeed, CmdWz, WheelWz, WheelSpeed, Wz]).unwrap();
        assert_eq!((skid.turn_input, skid.speed_source), (TurnInput::CommandedYawRate, SpeedSource::Wheels));
        let yaw_rate_only = evidence(&[CmdSpeed, CmdSteer, Wz]).unwrap();
        assert_eq!(yaw_rate_only.speed_source, SpeedSource::Command);
        assert!(yaw_rate_only.judges("steer_gain") && !yaw_rate_only.judges("speed_scale"));
        assert!(!yaw_rate_only.judges("odom_scale") && yaw_rate_only.judges("gyro_bias"));
        let accelerated = evidence(&[CmdAccel, WheelWz, X, Y, Yaw]).unwrap();
        assert_eq!(
            (accelerated.speed_input, accelerated.turn_input, accelerated.speed_source),
            (SpeedInput::CommandedAcceleration, TurnInput::WheelYawRate, SpeedSource::Path)
        );
    }

    #[test]
    fn a_drive_without_an_input_is_refused_by_the_column_that_would_serve() {
        assert_eq!(evidence(&[Column::CmdSpeed, Column::Wz]), Err("cmd_steer"));
        assert_eq!(evidence(&[Column::CmdAccel, Column::CmdSteer, Column::Wz]), Err("cmd_speed"));
    }

    #[test]
    fn a_full_drive_lacks_nothing_and_judges_all_but_the_ground() {
        let columns = [
            Column::CmdSpeed,
            Column::CmdSteer,
            Column::X,
            Column::Y,
            Column::Yaw,
            Column::Vx,
            Column::Wz,
            Column::Roll,
            Column::Pitch,
        ];
        let full = evidence(&columns).unwrap();
        assert!(full.notes().is_empty());
        let unjudged = bicycle::effect::CATALOGUE.iter().map(|description| description.id);
        assert_eq!(unjudged.filter(|id| !full.judges(id)).collect::<Vec<_>>(), ["veg_drag", "loose_drag"]);
    }
}
