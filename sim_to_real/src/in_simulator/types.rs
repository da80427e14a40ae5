//! What goes into a simulator, what comes out, and the answer that is made of it. The field names are those of the
//! protocol, `docs/simulator_protocol.md`.

use crate::answer::{Estimate, Shrink, Verdict};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// A parameter that a simulator lets others set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Knob {
    /// Name.
    pub name: String,
    /// Unit, `-` for a ratio.
    pub unit: String,
    /// Smallest value that the simulator takes.
    pub low: f64,
    /// Largest value that it takes.
    pub high: f64,
    /// Value that it has unless told otherwise.
    pub default: f64,
}

/// A knob that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum KnobError {
    /// Bounds and default are no range with a value in it.
    #[error(
        "knob '{name}': expected finite low < high with default between them, found {low}, {high} and {default}"
    )]
    Range {
        /// Name.
        name: String,
        /// Lower bound.
        low: f64,
        /// Upper bound.
        high: f64,
        /// Default.
        default: f64,
    },
    /// Two of one name, or none.
    #[error("knobs: expected each to have a name of its own, found '{name}' twice or empty")]
    Name {
        /// Name.
        name: String,
    },
}

/// What a simulator says of itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SimulatorDescription {
    /// Name.
    pub name: String,
    /// Whether the same run with another seed may move otherwise.
    #[serde(default)]
    pub stochastic: bool,
    /// What may be set.
    #[serde(default)]
    pub knobs: Vec<Knob>,
}

impl SimulatorDescription {
    /// Refuses knobs without a range of their own or a name of their own.
    ///
    /// # Errors
    /// The first such knob.
    pub fn validate(&self) -> Result<(), KnobError> {
        let mut names = BTreeSet::new();
        for Knob { name, low, high, default, .. } in &self.knobs {
            if name.is_empty() || !names.insert(name) {
                return Err(KnobError::Name { name: name.clone() });
            }
            let is_finite = low.is_finite() && high.is_finite();
            if !(is_finite && low < high && (low..=high).contains(&default)) {
                let (name, low, high, default) = (name.clone(), *low, *high, *default);
                return Err(KnobError::Range { name, low, high, default });
            }
        }
        Ok(())
    }
}

/// The vehicle as it was measured in the first row of a drive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StartState {
    /// East [m].
    pub x_m: f64,
    /// North [m].
    pub y_m: f64,
    /// Counter-clockwise from east [rad].
    pub yaw_rad: f64,
    /// Forward velocity [m/s].
    pub speed_mps: f64,
    /// Yaw rate [rad/s].
    pub yaw_rate_radps: f64,
}

/// One drive for a simulator. Row k holds for the time from k to k + 1 steps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SimulatorRun {
    /// Where it begins.
    pub start: StartState,
    /// Between rows [s].
    pub step_s: f64,
    /// Commanded speed [m/s].
    pub command_speed_mps: Vec<f64>,
    /// Commanded angle of the front wheels, left positive [rad].
    pub command_steering_rad: Vec<f64>,
    /// Rise of the ground per metre ahead, where the robot was [-].
    pub slope_ahead: Vec<f64>,
    /// Rise of the ground per metre to the left, where the robot was [-].
    pub slope_left: Vec<f64>,
    /// Class of the ground where the robot was: 0 open, 1 loose, 2 vegetation.
    pub terrain_class: Vec<u8>,
    /// Of the simulator's noise, where it has any.
    pub seed: u64,
    /// Values of all knobs by name.
    pub knobs: BTreeMap<String, f64>,
}

impl SimulatorRun {
    /// Number of rows, of what is asked as of what is answered.
    pub fn n_rows(&self) -> usize {
        self.command_speed_mps.len()
    }
}

/// What a simulator answers: row k is the vehicle after k steps, row 0 the start. The reference point is the centre of
/// the rear axle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// East [m].
    pub x_m: Vec<f64>,
    /// North [m].
    pub y_m: Vec<f64>,
    /// Counter-clockwise from east, with or without jumps [rad].
    pub yaw_rad: Vec<f64>,
    /// Forward velocity [m/s].
    pub speed_mps: Vec<f64>,
    /// Yaw rate [rad/s].
    pub yaw_rate_radps: Vec<f64>,
    /// Velocity to the left [m/s]; not compared where a simulator does not tell it.
    #[serde(default)]
    pub side_speed_mps: Option<Vec<f64>>,
}

impl Motion {
    /// The motion of a run of so many rows.
    ///
    /// # Errors
    /// What was expected and found: another number of rows, or a number that is not finite.
    pub fn checked(self, n_rows: usize) -> Result<Self, String> {
        for (name, values) in self.quantities() {
            if values.len() != n_rows {
                return Err(format!("{name}: expected {n_rows} values, found {}", values.len()));
            }
            if let Some(other) = values.iter().find(|value| !value.is_finite()) {
                return Err(format!("{name}: expected finite numbers, found {other}"));
            }
        }
        Ok(self)
    }

    /// The quantities that are told, with their names.
    pub fn quantities(&self) -> impl Iterator<Item = (&'static str, &[f64])> {
        let always: [(&str, &[f64]); 5] = [
            ("x_m", &self.x_m),
            ("y_m", &self.y_m),
            ("yaw_rad", &self.yaw_rad),
            ("speed_mps", &self.speed_mps),
            ("yaw_rate_radps", &self.yaw_rate_radps),
        ];
        let side_speed = self.side_speed_mps.as_deref().map(|values| ("side_speed_mps", values));
        always.into_iter().chain(side_speed)
    }
}

/// Runs a simulator on many drives, one motion for each in their order.
pub type RunSimulator<'a, E> = dyn Fn(&[SimulatorRun]) -> Result<Vec<Motion>, E> + 'a;

/// What a cause is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CauseKind {
    /// An effect of the catalogue, wrapped around the simulator.
    Effect,
    /// A parameter of the simulator.
    Knob,
}

/// A cause that the simulator lacks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SimulatorCause {
    /// Id of the effect, or name of the knob.
    pub name: String,
    /// Which of the two.
    pub kind: CauseKind,
    /// Name of the parameter: the effect's, or the knob itself.
    pub parameter: String,
    /// Its unit.
    pub unit: String,
    /// What the simulator has: no effect, or the knob's default.
    pub nominal: f64,
    /// What the robot has.
    pub found: Estimate,
}

/// What was tried in the simulator.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SimulatorCandidate {
    /// Id of the effect, or name of the knob.
    pub name: String,
    /// Which of the two.
    pub kind: CauseKind,
    /// Best value, in the parameter's unit.
    pub value: f64,
    /// Share of the loss that it takes off drives it was not fitted to [-].
    pub gain: f64,
    /// Standard error of what would be chance, over stretches of five seconds, from those that it makes worse [-].
    pub gain_standard_error: f64,
}

/// What the user's own simulator says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InSimulator {
    /// Its name.
    pub simulator: String,
    /// Conclusion.
    pub verdict: Verdict,
    /// What it lacks, strongest first.
    pub causes: Vec<SimulatorCause>,
    /// Causes that do as well as the strongest alone.
    pub not_told_apart: Vec<String>,
    /// All that was tried, alone, best first.
    pub candidates: Vec<SimulatorCandidate>,
    /// The gap with and without the causes, in the simulator itself.
    pub shrink: Shrink,
    /// Error of the simulator on its own recorded drives, in their measurements' noise [-].
    pub own_drives_error: f64,
}
