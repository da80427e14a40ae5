//! The drives of a case under the names that people know them by: screened, split where they break, held against one
//! another.

use bicycle::DriveLog;

use crate::machine::Machine;
use crate::screening::{Gravity, Suspicion, screen, screen_sets, split_at_breaks};
use crate::steering::Steering;

/// Drives, each with what it is called: its file, or its place in a list.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drives {
    /// What they are called, one for each.
    pub names: Vec<String>,
    /// The drives.
    pub logs: Vec<DriveLog>,
}

/// Drives that would be misread.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DrivesError {
    /// One of them.
    #[error("{drive}: {problem}")]
    Drive {
        /// What it is called.
        drive: String,
        /// What gave it away.
        problem: String,
    },
    /// All together.
    #[error("{problem}")]
    Together {
        /// What gave them away.
        problem: String,
    },
    /// An effect on the steering means an angle or a yaw rate: drives of both cannot be held against one another.
    #[error("{drive}: expected a machine that {expected} as in {first}, found one that {found}")]
    MixedSteering {
        /// What it is called.
        drive: String,
        /// How the first one steers.
        expected: &'static str,
        /// What the first one is called.
        first: String,
        /// How it steers.
        found: &'static str,
    },
    /// A held-out drive is one of those that the answer was made from.
    #[error("{drive}: expected a drive not used before, found the drive of {same}")]
    Seen {
        /// What it is called.
        drive: String,
        /// What the same one was called before.
        same: String,
    },
}

impl Drives {
    /// The drives without their breaks, columns of slow sensors filled in; what is doubtful is told in `doubts`.
    ///
    /// # Errors
    /// A drive that would be misread.
    pub fn screened(self, machine: &Machine, doubts: &mut Vec<String>) -> Result<Self, DrivesError> {
        let mut screened_one = |(name, log): (&String, DriveLog)| {
            let refused = |problem: String| DrivesError::Drive { drive: name.clone(), problem };
            let log = DriveLog::joined(&[log]).map_err(|error| refused(error.to_string()))?;
            let found = screen(machine, &log);
            if let Some(grave) = grave(&found) {
                return Err(refused(grave.to_string()));
            }
            doubts.extend(found.iter().map(|suspicion| format!("{name}: {suspicion}")));
            let is_broken = found.iter().any(is_break);
            let split = if is_broken { split_at_breaks(machine, &log) } else { Ok(log) };
            split.map_err(|error| refused(error.to_string()))
        };
        let logs = self.names.iter().zip(self.logs).map(&mut screened_one).collect::<Result<_, _>>()?;
        Ok(Self { names: self.names, logs })
    }

    fn named(&self) -> impl Iterator<Item = (&String, &DriveLog)> {
        self.names.iter().zip(&self.logs)
    }

    fn find(&self, log: &DriveLog) -> Option<&String> {
        self.named().find_map(|(name, own)| (own == log).then_some(name))
    }
}

fn grave(found: &[Suspicion]) -> Option<&Suspicion> {
    found.iter().find(|suspicion| suspicion.gravity() == Gravity::Refused)
}

fn is_break(suspicion: &Suspicion) -> bool {
    use Suspicion::{Gap, Leap, Reset, YawLeap};
    matches!(suspicion, Gap { .. } | Leap { .. } | Reset { .. } | YawLeap { .. })
}

/// A machine with the drives of its simulator and its own, ready to be diagnosed.
#[derive(Clone, Debug)]
pub struct Case {
    /// What is known of the machine.
    pub machine: Machine,
    /// Nominal drives; may be none.
    pub sim: Drives,
    /// Drives to find the cause in.
    pub real: Drives,
}

impl Case {
    /// Screens drives alone and together; what is doubtful is told in `doubts`.
    ///
    /// # Errors
    /// Drives that would be misread, or that no cause can be found in.
    pub fn screened(
        machine: Machine,
        sim: Drives,
        real: Drives,
        doubts: &mut Vec<String>,
    ) -> Result<Self, DrivesError> {
        let (sim, real) = (sim.screened(&machine, doubts)?, real.screened(&machine, doubts)?);
        refuse_mixed_steering(&machine, [&sim, &real])?;
        let found = screen_sets(&sim.logs, &real.logs);
        if let Some(grave) = grave(&found) {
            return Err(DrivesError::Together { problem: grave.to_string() });
        }
        doubts.extend(found.iter().map(ToString::to_string));
        Ok(Self { machine, sim, real })
    }

    /// Screens drives to verify the answer on.
    ///
    /// # Errors
    /// Drives that would be misread, or that the answer was made from.
    pub fn heldout(&self, heldout: Drives, doubts: &mut Vec<String>) -> Result<Drives, DrivesError> {
        let heldout = heldout.screened(&self.machine, doubts)?;
        refuse_mixed_steering(&self.machine, [&self.real, &heldout])?;
        let seen = heldout.named().find_map(|(name, log)| {
            let same = self.sim.find(log).or_else(|| self.real.find(log))?;
            Some(DrivesError::Seen { drive: name.clone(), same: same.clone() })
        });
        seen.map_or(Ok(heldout), Err)
    }
}

fn refuse_mixed_steering(machine: &Machine, sets: [&Drives; 2]) -> Result<(), DrivesError> {
    let all = sets.into_iter().flat_map(Drives::named);
    let told = all.filter_map(|(name, log)| Some((Steering::of(machine, log)?, name)));
    let told: Vec<(Steering, &String)> = told.collect();
    let Some(&(first, first_name)) = told.first() else { return Ok(()) };
    let word = |steering: Steering| match steering {
        Steering::Angle => "steers by an angle (cmd_steer, steer_meas)",
        Steering::YawRate => "is skid-steered (cmd_wz, wheel_wz)",
    };
    match told.iter().find(|(steering, _)| *steering != first) {
        None => Ok(()),
        Some((other, name)) => Err(DrivesError::MixedSteering {
            drive: (*name).clone(),
            expected: word(first),
            first: first_name.clone(),
            found: word(*other),
        }),
    }
}
