//! What an interrupted `surefoot gap score` leaves behind, so that the next one goes on where it stopped.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::UNIX_EPOCH;

use serde::{Deserialize, Serialize};
use sim_to_real::Answer;

use crate::WorkFailed;
use crate::arguments::GapScoreArguments;

/// Name of the file beside the answers that is there as long as cases are missing.
const FILE: &str = "unfinished.json";

/// What was asked, and by which program: answers of another are no answers to this.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Asked {
    set: PathBuf,
    labels_sha256: String,
    /// Length and time of change of the program [bytes], [ns].
    program: (u64, u128),
}

/// The content of the file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Kept {
    asked: Asked,
    /// Seconds that naming the cause took, by case; each has its answer in a file.
    naming_s: BTreeMap<String, f64>,
}

/// Answers as they come.
pub(super) struct Unfinished {
    folder: PathBuf,
    kept: Mutex<Kept>,
}

impl Unfinished {
    /// Goes on with what an interrupted run of the same question left in the folder of answers, else from nothing.
    ///
    /// Errors: labels or program that cannot be read.
    pub fn resume(arguments: &GapScoreArguments, folder: PathBuf) -> anyhow::Result<Self> {
        let program = std::fs::metadata(crate::Program::current()?.file())?;
        let changed = program.modified()?.duration_since(UNIX_EPOCH).unwrap_or_default();
        let labels_sha256 = formats::config_hash(&std::fs::read_to_string(&arguments.labels)?)?;
        let asked = Asked {
            set: arguments.set.canonicalize()?,
            labels_sha256,
            program: (program.len(), changed.as_nanos()),
        };
        Ok(Self::of(asked, folder))
    }

    fn of(asked: Asked, folder: PathBuf) -> Self {
        let read = |path: &Path| serde_json::from_slice::<Kept>(&std::fs::read(path).ok()?).ok();
        let before = read(&folder.join(FILE)).filter(|kept| kept.asked == asked);
        let kept = before.unwrap_or(Kept { asked, naming_s: BTreeMap::new() });
        Self { folder, kept: Mutex::new(kept) }
    }

    /// The answer that an interrupted run gave to a case, and how long naming took it [s].
    pub fn answer(&self, name: &str) -> Option<(Answer, f64)> {
        let naming_s = *self.kept.lock().ok()?.naming_s.get(name)?;
        let text = std::fs::read(self.path(name)).ok()?;
        Some((serde_json::from_slice(&text).ok()?, naming_s))
    }

    /// Writes an answer and notes that it is there.
    pub fn keep(&self, name: &str, (answer, naming_s): (&Answer, f64)) -> anyhow::Result<()> {
        formats::write_json_atomic(&self.path(name), answer)?;
        let mut kept = self.kept.lock().map_err(|_| WorkFailed("another case has failed".to_owned()))?;
        kept.naming_s.insert(name.to_owned(), naming_s);
        Ok(formats::write_json_atomic(&self.folder.join(FILE), &*kept)?)
    }

    /// Every case was tried: the next run begins anew.
    pub fn finish(self) -> anyhow::Result<()> {
        match std::fs::remove_file(self.folder.join(FILE)) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(error.into()),
            _ => Ok(()),
        }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.join(format!("{name}.json"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sim_to_real::{Shrink, Verdict};

    fn answer() -> Answer {
        let shrink = Shrink {
            metric: "normalised held-out rollout error".to_owned(),
            before: Some(2.1),
            after: Some(0.4),
            floor: 0.35,
            closed: Some(0.97),
            closed_low: None,
            closed_high: None,
            predicted_closed: Some(0.95),
            learned_bound_closed: None,
            position_error_2s_m: None,
        };
        Answer {
            schema_version: sim_to_real::SCHEMA_VERSION,
            case: "case".to_owned(),
            steering: sim_to_real::Steering::Angle,
            verdict: Verdict::None,
            effects: Vec::new(),
            by_part: Vec::new(),
            left: Vec::new(),
            swing: None,
            leaning: None,
            ranking: Vec::new(),
            credible_set: Vec::new(),
            places: Vec::new(),
            shrink,
            errors_by_quantity: Vec::new(),
            pose_sensor: None,
            controller_model: None,
            in_simulator: None,
            advice: Vec::new(),
        }
    }

    fn asked(program: u64) -> Asked {
        Asked { set: "/set".into(), labels_sha256: "0".to_owned(), program: (program, 7) }
    }

    #[test]
    fn an_interrupted_run_goes_on_and_a_finished_one_begins_anew() {
        let folder = tempfile::tempdir().unwrap();
        let open = |program: u64| Unfinished::of(asked(program), folder.path().to_owned());
        let first = open(1);
        assert_eq!(first.answer("case_001"), None);
        first.keep("case_001", (&answer(), 0.5)).unwrap();
        drop(first);

        let second = open(1);
        assert_eq!(second.answer("case_001"), Some((answer(), 0.5)));
        assert_eq!(second.answer("case_002"), None);
        second.keep("case_002", (&answer(), 0.25)).unwrap();
        let third = open(1);
        assert_eq!(third.answer("case_001").map(|kept| kept.1), Some(0.5), "both are noted");
        assert_eq!(third.answer("case_002").map(|kept| kept.1), Some(0.25));
        third.finish().unwrap();
        assert_eq!(open(1).answer("case_001"), None);
        assert!(folder.path().join("case_001.json").is_file(), "the answers stay");
        open(1).finish().unwrap();
    }

    #[test]
    fn answers_of_another_program_or_half_a_file_are_none() {
        let folder = tempfile::tempdir().unwrap();
        let open = |program: u64| Unfinished::of(asked(program), folder.path().to_owned());
        open(1).keep("case_001", (&answer(), 0.5)).unwrap();
        assert_eq!(open(2).answer("case_001"), None);
        assert!(open(1).answer("case_001").is_some());
        std::fs::write(folder.path().join("case_001.json"), "{\"case\":").unwrap();
        assert_eq!(open(1).answer("case_001"), None);
        std::fs::write(folder.path().join(FILE), "{").unwrap();
        open(1).keep("case_002", (&answer(), 0.5)).unwrap();
        assert!(open(1).answer("case_002").is_some());
    }
}
