//! Sizes of the networks, and what they are asked and answer.

use serde::{Deserialize, Serialize};

/// Samples of the history that a model sees.
pub const WINDOW: usize = 100;
/// Numbers of a sample: angular rate and specific force, x, y, z each.
pub const AXES: usize = 6;
/// Fastest speed that a model tells from others [m/s]; the paper's code divides by it.
pub const SPEED_MAX_MPS: f32 = 3.0;
/// Largest curvature that a model is asked for or answers [1/m]; the same.
pub const CURVATURE_MAX_PER_M: f32 = 2.0;

/// Width of the encoder's two hidden layers.
const ENCODER_HIDDEN: usize = 256;
/// Pieces of the history that a forward model sees the mean and the deviation of: with all samples it learns their noise by
/// heart.
pub(crate) const PIECES: usize = 10;
/// Width of a forward model's hidden layer before its embedding, and of that.
const FORWARD_HIDDEN: usize = 64;
const FORWARD_EMBEDDING: usize = 16;
/// Width of the command network's two hidden layers.
const COMMAND_HIDDEN: usize = 32;

/// What a model knows of the ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Sensing {
    /// Nothing: the ablation.
    Blind,
    /// An embedding of the history of the inertial measurement unit; 2 numbers in the paper, 16 in its successor (VI-IKD).
    Imu {
        /// Numbers of the embedding.
        embedding: usize,
    },
    /// Numbers that somebody else knows of it, instead of an embedding: how far knowledge of the ground can help at all.
    Told {
        /// How many.
        numbers: usize,
    },
}

/// What a model answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Answer {
    /// The curvature to command; the speed stays as desired. So does the paper's code.
    Curvature,
    /// Both, as the paper's text has it.
    SpeedAndCurvature,
}

/// Which networks: `600 -> 256 -> 256 -> embedding` with ReLU behind every layer, and `2 + embedding -> 32 -> 32 -> answer`
/// with ReLU behind the hidden ones and a hyperbolic tangent behind the last (section IV-A.5 and the published code).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Architecture {
    /// What it knows of the ground.
    pub sensing: Sensing,
    /// What it answers.
    pub answer: Answer,
}

/// What follows the sums of a layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Activation {
    Relu,
    Tanh,
}

/// One layer's name, number of inputs and outputs, and what follows its sums.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct LayerShape {
    pub name: String,
    pub n_inputs: usize,
    pub n_outputs: usize,
    pub activation: Activation,
}

impl Architecture {
    /// The model that the paper's code trains.
    pub const PAPER: Self = Self { sensing: Sensing::Imu { embedding: 2 }, answer: Answer::Curvature };
    /// The same without the unit.
    pub const ABLATION: Self = Self { sensing: Sensing::Blind, answer: Answer::Curvature };

    /// Numbers that the command network learns of the ground.
    pub fn n_embedding(&self) -> usize {
        match self.sensing {
            Sensing::Blind => 0,
            Sensing::Imu { embedding } => embedding,
            Sensing::Told { numbers } => numbers,
        }
    }

    /// Numbers of an example's window: the history's, or those that are told.
    pub(crate) fn n_window(&self) -> usize {
        match self.sensing {
            Sensing::Blind => 0,
            Sensing::Imu { .. } => WINDOW * AXES,
            Sensing::Told { numbers } => numbers,
        }
    }

    /// Numbers that it answers.
    pub fn n_answers(&self) -> usize {
        match self.answer {
            Answer::Curvature => 1,
            Answer::SpeedAndCurvature => 2,
        }
    }

    /// Whether it sees the unit's history.
    pub fn senses(&self) -> bool {
        matches!(self.sensing, Sensing::Imu { .. })
    }

    /// Largest value of every answer: the hyperbolic tangents are multiplied by it.
    pub(crate) fn answer_scales(&self) -> &'static [f32] {
        match self.answer {
            Answer::Curvature => &[CURVATURE_MAX_PER_M],
            Answer::SpeedAndCurvature => &[CURVATURE_MAX_PER_M, SPEED_MAX_MPS],
        }
    }

    /// The encoder's layers; none of a model without a history.
    pub(crate) fn encoder(&self) -> Vec<LayerShape> {
        if !self.senses() {
            return Vec::new();
        }
        let widths = [WINDOW * AXES, ENCODER_HIDDEN, ENCODER_HIDDEN, self.n_embedding()];
        layers("encoder", &widths, Activation::Relu)
    }

    /// The command network's layers.
    pub(crate) fn command(&self) -> Vec<LayerShape> {
        let widths = [2 + self.n_embedding(), COMMAND_HIDDEN, COMMAND_HIDDEN, self.n_answers()];
        layers("command", &widths, Activation::Tanh)
    }

    /// The layers of the forward model that teaches it: `120 -> 64 -> 16` of [`PIECES`] pieces of the history instead of all
    /// samples, and `18 -> 32 -> 32 -> 1`. Who is told of the ground, or nothing, teaches the like.
    pub(crate) fn forward(&self) -> [Vec<LayerShape>; 2] {
        let widths = [2 * PIECES * AXES, FORWARD_HIDDEN, FORWARD_EMBEDDING];
        let (encoder, n_embedding) = match self.sensing {
            Sensing::Imu { .. } => (layers("encoder", &widths, Activation::Relu), FORWARD_EMBEDDING),
            Sensing::Blind | Sensing::Told { .. } => (Vec::new(), self.n_embedding()),
        };
        let widths = [2 + n_embedding, COMMAND_HIDDEN, COMMAND_HIDDEN, 1];
        [encoder, layers("command", &widths, Activation::Tanh)]
    }

    /// Multiply-adds of one answer.
    pub fn n_multiply_adds(&self) -> usize {
        self.encoder().iter().chain(&self.command()).map(|layer| layer.n_inputs * layer.n_outputs).sum()
    }
}

fn layers(network: &str, widths: &[usize], last: Activation) -> Vec<LayerShape> {
    let n = widths.len() - 1;
    let layer = |k: usize| LayerShape {
        name: format!("{network}.{k}"),
        n_inputs: widths[k],
        n_outputs: widths[k + 1],
        activation: if k + 1 == n { last } else { Activation::Relu },
    };
    (0..n).map(layer).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn multiply_adds_are_those_of_the_layers() {
        // 600 x 256 + 256 x 256 + 256 x 2 + 4 x 32 + 32 x 32 + 32
        assert_eq!(Architecture::PAPER.n_multiply_adds(), 153_600 + 65_536 + 512 + 128 + 1024 + 32);
        assert_eq!(Architecture::ABLATION.n_multiply_adds(), 64 + 1024 + 32);
        assert!(Architecture::ABLATION.encoder().is_empty());
    }
}
