//! The answer of a diagnosis, as it stands in files.

use crate::controller_model::ControllerModel;
use crate::findings::{Leaning, LeftOver, QuantityError, Swing};
use crate::in_simulator::InSimulator;
use crate::pose_sensor::PoseSensor;
use crate::steering::Steering;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What a diagnosis concludes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Nothing beyond what separates one nominal drive from another.
    None,
    /// The announced effects explain the gap.
    Effects,
    /// The announced effects explain a part; the rest is none of the catalogue.
    EffectsAndUnknown,
    /// There is a gap and nothing of the catalogue explains it.
    Unknown,
}

impl Verdict {
    /// Whether a part of the gap is none of the catalogue's.
    pub(crate) fn holds_unknown(self) -> bool {
        matches!(self, Self::Unknown | Self::EffectsAndUnknown)
    }

    /// With something more that is none of the catalogue.
    pub(crate) fn with_unknown(self) -> Self {
        match self {
            Self::None | Self::Unknown => Self::Unknown,
            Self::Effects | Self::EffectsAndUnknown => Self::EffectsAndUnknown,
        }
    }
}

/// A value with its 90 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Best value, in the unit that the parameter's name ends in.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// An announced effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NamedEffect {
    /// Name of the cause.
    pub id: String,
    /// Id of the catalogue's effect that fits best, where the cause has several forms and it is not the first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub form: Option<String>,
    /// Parameters by name.
    pub parameters: BTreeMap<String, Estimate>,
}

/// What drives are divided by, to ask whether an effect is the same throughout.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Division {
    /// Share of the drive that was driven before, in [0, 1].
    Time,
    /// Number of the drive, from 1.
    Drive,
    /// Commanded steering, to the left above 0 [rad].
    Steering,
    /// Forward speed [m/s].
    Speed,
    /// Number of the terrain's class.
    TerrainClass,
}

/// What a parameter would be in a part of the real drives alone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PartEstimate {
    /// Name of the cause.
    pub effect: String,
    /// Name of its parameter.
    pub parameter: String,
    /// What the drives are divided by.
    pub division: Division,
    /// Where the part begins; absent where nothing bounds it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<f64>,
    /// Where it ends.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to: Option<f64>,
    /// Rollouts in it.
    pub n_rollouts: usize,
    /// The parameter, with an interval that holds what differs from part to part by chance, and no error that all parts
    /// share.
    pub estimate: Estimate,
}

/// An effect with the probability that it is the cause.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ranked {
    /// Id of the catalogue.
    pub id: String,
    /// Probability in [0, 1].
    pub score: f64,
    /// What this effect alone has for it; absent for one that the drives cannot judge.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub support: Option<Support>,
}

/// What a single effect has for it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Support {
    /// Logarithm of what it divides the loss by, half as fitted and half as foretold.
    pub gain: f64,
    /// How strongly the robot's drives ask for it, in standard deviations of chance [-].
    pub strength: f64,
    /// The same of the drive that asks for it least.
    pub least_strength: f64,
    /// How much of it the simulator's own drives ask for, which do not have it: in [-1, 1].
    pub nominal: f64,
    /// Logarithm of how many times as probable it makes how the body leans; 0 where roll and pitch say nothing of it.
    #[serde(default)]
    pub attitude: f64,
}

/// A condition under which a residual may stand out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Condition {
    /// Forward speed.
    Speed,
    /// Commanded steering angle.
    Steering,
    /// How fast the commanded steering changed of late.
    SteeringChange,
    /// How fast the commanded speed changed of late.
    SpeedChange,
    /// Speed times yaw rate.
    LateralAcceleration,
    /// Pitch of the ground.
    Pitch,
    /// Roll of the ground.
    Roll,
    /// Class of the terrain.
    TerrainClass,
    /// Yaw.
    Heading,
    /// The same everywhere.
    Constant,
    /// Share of the drive that was driven before. Told of what is left alone: drives of two kinds may be of two lengths.
    Time,
}

/// How much of the residual a condition explains.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// Condition.
    pub condition: Condition,
    /// Share of the squared normalised residual's variance that bins of this condition explain, less what they
    /// explain in the null [-].
    pub share: f64,
}

/// Before and after.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BeforeAfter {
    /// Under the calibrated nominal model.
    pub before: f64,
    /// With the announced effects.
    pub after: f64,
}

/// How far the gap shrinks.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Shrink {
    /// What is measured.
    pub metric: String,
    /// Calibrated nominal model on the held-out drives; absent until they are opened.
    pub before: Option<f64>,
    /// With the announced effects on the held-out drives.
    pub after: Option<f64>,
    /// Calibrated nominal model on nominal drives it was not calibrated on.
    pub floor: f64,
    /// (before - after) / (before - floor); absent where before < 1.2 floor.
    pub closed: Option<f64>,
    /// Lower end of the 90 % interval of `closed`.
    pub closed_low: Option<f64>,
    /// Upper end of the 90 % interval of `closed`.
    pub closed_high: Option<f64>,
    /// `closed` as cross-validation on the real drives predicts it, before the held-out drives are opened.
    pub predicted_closed: Option<f64>,
    /// What a flexible learned residual would close; the most that any model could.
    pub learned_bound_closed: Option<f64>,
    /// Position error after 2 s [m].
    pub position_error_2s_m: Option<BeforeAfter>,
}

/// Version of the answer's layout. It grows when a key goes, or means something else; a new key does not change it.
pub const SCHEMA_VERSION: u32 = 1;

/// The whole answer; the JSON file of a diagnosis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// [`SCHEMA_VERSION`] of who wrote it; 0 in files from before there were versions.
    #[serde(default)]
    pub schema_version: u32,
    /// Name of the case.
    pub case: String,
    /// What turns the machine; left out of files where it is an angle.
    #[serde(default, skip_serializing_if = "Steering::is_angle")]
    pub steering: Steering,
    /// Conclusion.
    pub verdict: Verdict,
    /// Announced effects, strongest first.
    pub effects: Vec<NamedEffect>,
    /// What their parameters would be in parts of the real drives; empty where nothing is announced.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub by_part: Vec<PartEstimate>,
    /// Every effect with its probability, best first.
    pub ranking: Vec<Ranked>,
    /// Single explanations that the data cannot tell apart.
    pub credible_set: Vec<String>,
    /// Where the residual lies, strongest first.
    #[serde(rename = "where")]
    pub places: Vec<Place>,
    /// What the announced effects leave, quantity by quantity, where a part of the gap is unknown; the largest share first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub left: Vec<LeftOver>,
    /// A yaw rate that swings.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub swing: Option<Swing>,
    /// A body that leans.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub leaning: Option<Leaning>,
    /// How far the gap shrinks.
    pub shrink: Shrink,
    /// Errors on the held-out drives in metres, radians and their rates; empty until they are opened.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub errors_by_quantity: Vec<QuantityError>,
    /// What was estimated of the robot's pose sensor and taken out of its drives, where that was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pose_sensor: Option<PoseSensor>,
    /// What a controller's model is to hold, where that was measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub controller_model: Option<ControllerModel>,
    /// What the user's own simulator says, where it was asked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub in_simulator: Option<InSimulator>,
    /// What to do next, in sentences.
    pub advice: Vec<String>,
}

impl Answer {
    /// How many times the error of its own drives the simulator misses the held-out ones by, as it is: the user's own
    /// simulator where it was asked, else the model that was calibrated on it. `None` until they are opened.
    pub fn gap_ratio(&self) -> Option<f64> {
        let shrink = self.in_simulator.as_ref().map_or(&self.shrink, |own| &own.shrink);
        shrink.before.map(|before| before / shrink.floor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 3.0 of 1.5; a simulator of the user's own comes first: 4.0 of 1.0.
    #[test]
    fn the_gap_is_told_in_errors_of_the_simulators_own_drives() {
        let shrink = |before, floor| Shrink { before, floor, ..Shrink::default() };
        let answer = Answer {
            schema_version: SCHEMA_VERSION,
            case: "c".to_owned(),
            steering: Steering::Angle,
            verdict: Verdict::None,
            effects: Vec::new(),
            by_part: Vec::new(),
            ranking: Vec::new(),
            credible_set: Vec::new(),
            places: Vec::new(),
            left: Vec::new(),
            swing: None,
            leaning: None,
            shrink: shrink(Some(3.0), 1.5),
            errors_by_quantity: Vec::new(),
            pose_sensor: None,
            controller_model: None,
            in_simulator: None,
            advice: Vec::new(),
        };
        assert_eq!(answer.gap_ratio(), Some(2.0));
        let unopened = Answer { shrink: shrink(None, 1.5), ..answer.clone() };
        assert_eq!(unopened.gap_ratio(), None);
        let own = InSimulator {
            simulator: "s".to_owned(),
            verdict: Verdict::None,
            causes: Vec::new(),
            not_told_apart: Vec::new(),
            candidates: Vec::new(),
            shrink: shrink(Some(4.0), 1.0),
            own_drives_error: 1.0,
        };
        assert_eq!(Answer { in_simulator: Some(own), ..answer }.gap_ratio(), Some(4.0));
    }
}
