//! Which models are driven against each other.

use kinodynamics::{Answer, Architecture, History, LabelConfig, Sensing, Settings};
use serde::Serialize;

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
    /// Learned without the unit from all that was driven, oversteer and large differences too.
    UnfilteredAblation,
    /// Learned with the unit from all that was driven.
    Unfiltered,
    /// The oracle, learned from all that was driven.
    UnfilteredOracle,
}

impl Row {
    /// All, in the order of the tables.
    pub const ALL: [Self; 11] = [
        Self::Baseline,
        Self::Ablation,
        Self::Learned,
        Self::Oracle,
        Self::Shuffled,
        Self::Constant,
        Self::Wide,
        Self::WithSpeed,
        Self::UnfilteredAblation,
        Self::Unfiltered,
        Self::UnfilteredOracle,
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
            Self::UnfilteredAblation => "ablation, unfiltered",
            Self::Unfiltered => "learned, unfiltered",
            Self::UnfilteredOracle => "oracle, unfiltered",
        }
    }

    /// Whether it is told the truth about the ground.
    pub fn is_oracle(self) -> bool {
        matches!(self, Self::Oracle | Self::UnfilteredOracle)
    }

    /// How its model is trained; none of the baseline.
    pub fn settings(self, seed: u64) -> Option<Settings> {
        let paper = Settings::paper(Architecture::PAPER, seed);
        let labels = LabelConfig::unfiltered(0.0);
        let sensing = Sensing::Told { numbers: COEFFICIENTS };
        let oracle =
            Settings { architecture: Architecture { sensing, ..Architecture::PAPER }, ..paper.clone() };
        Some(match self {
            Self::Baseline => return None,
            Self::Ablation => Settings::paper(Architecture::ABLATION, seed),
            Self::Learned => paper,
            Self::Oracle => oracle,
            Self::UnfilteredOracle => Settings { labels, ..oracle },
            Self::Shuffled => Settings { history: History::Shuffled, ..paper },
            Self::Constant => Settings { history: History::Constant, ..paper },
            Self::Wide => {
                let sensing = Sensing::Imu { embedding: 16 };
                Settings { architecture: Architecture { sensing, ..Architecture::PAPER }, ..paper }
            }
            Self::WithSpeed => {
                let answer = Answer::SpeedAndCurvature;
                Settings { architecture: Architecture { answer, ..Architecture::PAPER }, ..paper }
            }
            Self::UnfilteredAblation => Settings { labels, ..Settings::paper(Architecture::ABLATION, seed) },
            Self::Unfiltered => Settings { labels, ..paper },
        })
    }
}
