//! A model as the control process asks it: flat weights, no Candle, no allocation.

use bicycle::lanes::Instructions;

use crate::CheckpointError;
use crate::architecture::{AXES, Answer, CURVATURE_MAX_PER_M, SPEED_MAX_MPS, WINDOW};
use crate::checkpoint::Checkpoint;
use crate::dense::Dense;
use crate::familiarity::Familiarity;

/// What a model says should be commanded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Commanded {
    /// Curvature, left positive [1/m].
    pub curvature_per_m: f32,
    /// Speed, the desired one unless the model answers speeds [m/s].
    pub speed_mps: f32,
}

/// What is wanted of the vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Desired {
    /// Speed [m/s].
    pub speed_mps: f32,
    /// Curvature, left positive [1/m].
    pub curvature_per_m: f32,
}

/// An inverse model and the room that it computes in.
#[derive(Clone, Debug)]
pub struct InverseModel {
    instructions: Instructions,
    answer: Answer,
    answer_scales: &'static [f32],
    n_embedding: usize,
    means: [f32; AXES],
    scales: [f32; AXES],
    encoder: Vec<Dense>,
    command: Vec<Dense>,
    familiarity: Familiarity,
    /// A column of [`WINDOW`] samples for each component, standardised.
    window: Vec<f32>,
    embedding: Vec<f32>,
    buffers: [Vec<f32>; 2],
}

impl InverseModel {
    /// The model of a checkpoint, on these instructions.
    ///
    /// # Errors
    /// A checkpoint whose weights do not fit its architecture.
    pub fn new(checkpoint: &Checkpoint, instructions: Instructions) -> Result<Self, CheckpointError> {
        let architecture = checkpoint.sidecar().architecture;
        let layers = |shapes: Vec<_>| -> Result<Vec<Dense>, CheckpointError> {
            shapes.iter().map(|shape| checkpoint.layer(shape)).collect()
        };
        let (encoder, command) = (layers(architecture.encoder())?, layers(architecture.command())?);
        let widest = encoder.iter().chain(&command).map(Dense::n_padded).max().unwrap_or(0);
        let standardisation = &checkpoint.sidecar().standardisation;
        let buffer = || vec![0.0; widest.max(2 + architecture.n_embedding())];
        Ok(Self {
            instructions,
            answer: architecture.answer,
            answer_scales: architecture.answer_scales(),
            n_embedding: architecture.n_embedding(),
            means: standardisation.mean,
            scales: standardisation.deviation.map(|deviation| 1.0 / deviation),
            encoder,
            command,
            familiarity: checkpoint.familiarity()?,
            window: vec![0.0; WINDOW * AXES],
            embedding: vec![0.0; architecture.n_embedding()],
            buffers: [buffer(), buffer()],
        })
    }

    /// Whether it wants to be told what the unit measured.
    pub fn senses(&self) -> bool {
        !self.encoder.is_empty()
    }

    /// Takes in what somebody knows of the ground, where a model was trained to be told.
    pub fn tell(&mut self, numbers: &[f32]) {
        for (place, number) in self.embedding.iter_mut().zip(numbers) {
            *place = *number;
        }
    }

    /// Takes in [`WINDOW`] samples from old to new: angular rate x, y, z and specific force x, y, z each. A blind model only
    /// tells by them how familiar they are.
    pub fn sense<'a>(&mut self, samples: impl Iterator<Item = &'a [f32; AXES]>) {
        for (k, sample) in samples.take(WINDOW).enumerate() {
            for (axis, value) in sample.iter().enumerate() {
                self.window[axis * WINDOW + k] = (value - self.means[axis]) * self.scales[axis];
            }
        }
        self.encode();
    }

    /// The same of columns: [`WINDOW`] values of each component, not standardised.
    pub fn sense_columns(&mut self, columns: &[f32]) {
        for (k, (place, value)) in self.window.iter_mut().zip(columns).enumerate() {
            *place = (value - self.means[k / WINDOW]) * self.scales[k / WINDOW];
        }
        self.encode();
    }

    fn encode(&mut self) {
        if !self.senses() {
            return;
        }
        let [front, back] = &mut self.buffers;
        let mut is_first = true;
        for layer in &self.encoder {
            let inputs = if is_first { &self.window } else { &*back };
            layer.apply(self.instructions, inputs, front);
            std::mem::swap(front, back);
            is_first = false;
        }
        self.embedding.copy_from_slice(&back[..self.n_embedding]);
    }

    /// What the history was made of; empty of a blind model.
    pub fn embedding(&self) -> &[f32] {
        &self.embedding
    }

    /// The command that makes the vehicle do what is wanted, on the ground that was last sensed.
    pub fn command(&mut self, desired: Desired) -> Commanded {
        let [front, back] = &mut self.buffers;
        back[..2].copy_from_slice(&inputs(desired));
        back[2..2 + self.n_embedding].copy_from_slice(&self.embedding);
        for layer in &self.command {
            layer.apply(self.instructions, back, front);
            std::mem::swap(front, back);
        }
        let answer = |k: usize| back[k] * self.answer_scales[k];
        Commanded {
            curvature_per_m: answer(0),
            speed_mps: match self.answer {
                Answer::Curvature => desired.speed_mps,
                Answer::SpeedAndCurvature => answer(1),
            },
        }
    }

    /// How much a wish and the sensed history are like what was learned from: 1 like nearly all of it, 0 unlike any.
    pub fn familiarity(&mut self, desired: Desired) -> f32 {
        self.familiarity.share(&self.window, inputs(desired))
    }
}

/// Speed and curvature as the networks see them, -1 to 1.
pub(crate) fn inputs(desired: Desired) -> [f32; 2] {
    [
        desired.speed_mps.clamp(0.0, SPEED_MAX_MPS) / SPEED_MAX_MPS,
        desired.curvature_per_m.clamp(-CURVATURE_MAX_PER_M, CURVATURE_MAX_PER_M) / CURVATURE_MAX_PER_M,
    ]
}
