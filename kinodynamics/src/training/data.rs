//! What is learned from and chosen by, as tensors.

use candle_core::{Device, Tensor};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::{History, Settings, Teacher};
use crate::architecture::{AXES, PIECES, WINDOW};
use crate::checkpoint::Standardisation;
use crate::label::Example;
use crate::model::{Desired, inputs};
use crate::split::Split;

/// Half of the examples as tensors.
pub(super) struct Half {
    /// [examples, 600], standardised; [examples, 0] of a blind model, and what one is told.
    pub(super) windows: Tensor,
    /// What a model is asked [examples, 2]: speeds and curvatures that were driven, or commanded where a forward model learns.
    pub(super) desired: Tensor,
    /// The other one [examples, answers], over their scales.
    pub(super) targets: Tensor,
    pub(super) n: usize,
}

/// Both halves.
pub(super) struct Data {
    pub(super) training: Half,
    pub(super) validation: Half,
}

impl Data {
    pub(super) fn new(
        examples: &[Example],
        split: &Split,
        standardisation: &Standardisation,
        settings: &Settings,
    ) -> candle_core::Result<Self> {
        let half = |places: &[usize], key: u64| Half::new(examples, places, standardisation, settings, key);
        Ok(Self { training: half(&split.training, 1)?, validation: half(&split.validation, 2)? })
    }

    /// The same as a forward model sees them.
    pub(super) fn of_forward_model(&self) -> candle_core::Result<Self> {
        let Self { training, validation } = self;
        Ok(Self { training: training.of_forward_model()?, validation: validation.of_forward_model()? })
    }
}

impl Half {
    pub(super) fn new(
        examples: &[Example],
        places: &[usize],
        standardisation: &Standardisation,
        settings: &Settings,
        key: u64,
    ) -> candle_core::Result<Self> {
        let n = places.len();
        let architecture = &settings.architecture;
        let mut sources = places.to_vec();
        if settings.history == History::Shuffled {
            sources.shuffle(&mut Xoshiro256PlusPlus::seed_from_u64(settings.seed ^ (key << 32)));
        }
        let n_window = architecture.n_window();
        let mut windows = Vec::with_capacity(n * n_window);
        for place in &sources {
            for k in 0..n_window {
                let value = examples[*place].window[k];
                windows.push(match settings.history {
                    _ if !architecture.senses() => value,
                    History::Constant => 0.0,
                    _ => (value - standardisation.mean[k / WINDOW]) / standardisation.deviation[k / WINDOW],
                });
            }
        }
        let example = |place: &usize| &examples[*place];
        let asked = |place: &usize| {
            let Example { driven, commanded, .. } = example(place);
            let [speed_mps, curvature_per_m] = match settings.teacher {
                Teacher::Examples => *driven,
                Teacher::ForwardModel => [driven[0], commanded[0]],
            };
            inputs(Desired { speed_mps, curvature_per_m })
        };
        let scales = architecture.answer_scales();
        let target = |place: &usize| {
            let Example { driven, commanded, .. } = example(place);
            let values = match settings.teacher {
                Teacher::Examples => *commanded,
                Teacher::ForwardModel => [driven[1], driven[0]],
            };
            scales.iter().zip(values).map(|(scale, value)| value / scale)
        };
        Ok(Self {
            windows: Tensor::from_vec(windows, (n, n_window), &Device::Cpu)?,
            desired: Tensor::from_vec(places.iter().flat_map(asked).collect(), (n, 2), &Device::Cpu)?,
            targets: Tensor::from_vec(
                places.iter().flat_map(target).collect(),
                (n, architecture.n_answers()),
                &Device::Cpu,
            )?,
            n,
        })
    }

    /// Histories in pieces, and yaw rates instead of curvatures: they are as noisy at every speed.
    fn of_forward_model(&self) -> candle_core::Result<Self> {
        let speed = self.desired.narrow(1, 0, 1)?;
        let commanded = (&speed * self.desired.narrow(1, 1, 1)?)?;
        Ok(Self {
            windows: in_pieces(&self.windows)?,
            desired: Tensor::cat(&[&speed, &commanded], 1)?,
            targets: (&speed * &self.targets)?,
            n: self.n,
        })
    }

    pub(super) fn rows(&self, rows: &Tensor) -> candle_core::Result<[Tensor; 3]> {
        Ok([
            self.windows.index_select(rows, 0)?,
            self.desired.index_select(rows, 0)?,
            self.targets.index_select(rows, 0)?,
        ])
    }
}

/// Means and deviations of every component in [`PIECES`] pieces [rows, 120] of windows [rows, 600]; other windows as they are.
pub(super) fn in_pieces(windows: &Tensor) -> candle_core::Result<Tensor> {
    let (rows, n) = windows.dims2()?;
    if n != WINDOW * AXES {
        return Ok(windows.clone());
    }
    let pieces = windows.reshape((rows, AXES * PIECES, WINDOW / PIECES))?;
    let means = pieces.mean_keepdim(2)?;
    let deviations = pieces.broadcast_sub(&means)?.sqr()?.mean(2)?.sqrt()?;
    Tensor::cat(&[&means.squeeze(2)?, &deviations], 1)
}
