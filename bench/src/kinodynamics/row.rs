//! Which models are driven against each other.

use kinodynamics::{Answer, Architecture, History, Sensing, Settings};
use serde::Serialize;

use super::Request;
use super::surfaces::COEFFICIENTS;

/// A model, or none.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Row {
    /// The nominal model.
    Baseline,
    /// Learned without the unit.
    Ablation,
    /// Learned with it: the paper's model.
    Learned,
    /// Learned and driven with the true coefficients of the ground under the wheels, instead of the unit: the most that
    /// knowledge of it can bring to this network.
    Oracle,
    /// Learned and driven with the histories of other moments.
    Shuffled,
    /// Learned and driven with one history for all moments.
    Constant,
    /// Learned with an embedding of 16 numbers, as the paper's successor (VI-IKD).
    Wide,
    /// Learned to answer speeds too, as the paper's text has it.
    WithSpeed,
}

impl Row {
    /// All, in the order of the tables.
    pub const ALL: [Self; 8] = [
        Self::Baseline,
        Self::Ablation,
        Self::Learned,
        Self::Oracle,
        Self::Shuffled,
        Self::Constant,
        Self::Wide,
        Self::WithSpeed,
    ];
    /// Those of the paper.
    pub const PAPER: [Self; 3] = [Self::Baseline, Self::Ablation, Self::Learned];
    /// These, with what bounds them and what must not do better: the oracle and the controls.
    pub const CONTROLS: [Self; 7] = [
        Self::Baseline,
        Self::Ablation,
        Self::Learned,
        Self::Oracle,
        Self::Shuffled,
        Self::Constant,
        Self::Wide,
    ];

    /// Name, for reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Baseline => "baseline",
            Self::Ablation => "ablation",
            Self::Learned => "learned",
            Self::Oracle => "oracle",
            Self::Shuffled => "shuffled IMU",
            Self::Constant => "constant IMU",
            Self::Wide => "embedding of 16",
            Self::WithSpeed => "answers speed too",
        }
    }

    /// Whether it is told the truth about the ground.
    pub fn is_oracle(self) -> bool {
        self == Self::Oracle
    }

    /// How its model is trained; none of the baseline.
    pub fn settings(self, request: &Request) -> Option<Settings> {
        let &Request { seed, epochs, labels, teacher, .. } = request;
        let of = |architecture| Settings { epochs, labels, teacher, ..Settings::paper(architecture, seed) };
        let sensing = |sensing| of(Architecture { sensing, ..Architecture::PAPER });
        let paper = of(Architecture::PAPER);
        Some(match self {
            Self::Baseline => return None,
            Self::Ablation => of(Architecture::ABLATION),
            Self::Learned => paper,
            Self::Oracle => sensing(Sensing::Told { numbers: COEFFICIENTS }),
            Self::Shuffled => Settings { history: History::Shuffled, ..paper },
            Self::Constant => Settings { history: History::Constant, ..paper },
            Self::Wide => sensing(Sensing::Imu { embedding: 16 }),
            Self::WithSpeed => of(Architecture { answer: Answer::SpeedAndCurvature, ..Architecture::PAPER }),
        })
    }
}
