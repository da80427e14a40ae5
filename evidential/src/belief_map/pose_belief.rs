//! What is believed of one pose.

use bicycle::lanes::Block;
use physics_prior::PriorBelief;
use traversability::Pmf;

use super::extraction::{Extract, Grounding, Line};
use super::patch_stencil::PatchStencil;
use super::{BeliefLayers, BeliefMap};
use crate::predictor::{Prediction, PredictorError};
use crate::{FeatureLayout, Prior};

/// Prior, prediction and posterior of one pose, before any CVaR; obstacles play no part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseBelief {
    /// What physics says.
    pub prior: PriorBelief,
    /// What the networks say; `None` on unknown ground, which they cannot judge.
    pub prediction: Option<Prediction>,
    /// Share of the networks in the posterior of linear traction, angular traction, |roll| and |pitch|, in [0, 1].
    pub learned_share: [f32; 4],
    /// Mean of the posterior in the same order (PIETRA, equation 11).
    pub posterior: [Pmf; 4],
}

impl BeliefMap {
    /// What is believed of any pose of the body frame, whose footprint must lie over the ground of the risk map; `None`
    /// elsewhere.
    pub fn belief(&self, x_m: f64, y_m: f64, yaw_rad: f64) -> Option<PoseBelief> {
        let layers = &self.layers;
        let prior = layers.field.belief(x_m, y_m, yaw_rad)?;
        let pose = layers.features([x_m, y_m, yaw_rad])?;
        let is_known = !pose.is_partly_unknown;
        let prediction = match pose.features.filter(|_| !prior.is_unknown) {
            Some(features) => Some(layers.predict(features).ok()?),
            None => None,
        };
        let physics = [prior.linear, prior.angular, prior.roll, prior.pitch];
        let learned_share = prediction.map_or([0.0; 4], |prediction| layers.learned_share(&prediction));
        let against = match layers.fusion.prior {
            Prior::Uniform if is_known => [Pmf::UNIFORM; 4],
            _ => physics,
        };
        let posterior = std::array::from_fn(|parameter| match &prediction {
            Some(learned) => {
                against[parameter].mixed_with(&learned.pmfs[parameter], learned_share[parameter])
            }
            None => physics[parameter],
        });
        Some(PoseBelief { prior, prediction, learned_share, posterior })
    }
}

/// What the networks see of a pose.
struct PoseFeatures {
    /// `None` where nothing stands on known ground.
    features: Option<Vec<f32>>,
    is_partly_unknown: bool,
}

impl BeliefLayers {
    /// `None` beyond the ground.
    fn features(&self, [x_m, y_m, yaw_rad]: [f64; 3]) -> Option<PoseFeatures> {
        let window = *self.ground.window();
        let place = [x_m, y_m].map(|v| v / window.resolution_m);
        let base = place.map(|v| v.floor() as i64);
        let phase = place.map(|v| v - v.floor());
        let layout: &FeatureLayout = &self.layout;
        let mut stencil = PatchStencil::new(layout, window.resolution_m, phase, yaw_rad);
        let [least, most] = stencil.reach();
        let n = [window.n_cols, window.n_rows];
        let is_inside = (0..2).all(|axis| {
            let start = base[axis] - window.origin[axis];
            start + least[axis] >= 0 && start + most[axis] < n[axis] as i64
        });
        is_inside.then_some(())?;
        stencil.lay_on(self.ground.planes(), base);
        let mut features = vec![Block::ZERO; layout.n_features()];
        let mut grounding = Grounding::default();
        self.instructions.run_on_lanes(Extract {
            ground: &self.ground,
            line: Line { stencil: &stencil, reach: stencil.reach(), base, n_lanes: 1 },
            first_lane: 0,
            features: &mut features,
            grounding: &mut grounding,
        });
        let is_grounded = grounding.ungrounded.0[0] == 0.0;
        let values = features.iter().map(|feature| feature.0[0]).collect();
        let is_partly_unknown = grounding.partly_unknown.0[0] > 0.0;
        Some(PoseFeatures { features: is_grounded.then_some(values), is_partly_unknown })
    }

    fn predict(&self, features: Vec<f32>) -> Result<Prediction, PredictorError> {
        Ok(self.predictor.predict(&[features])?.remove(0))
    }

    fn learned_share(&self, prediction: &Prediction) -> [f32; 4] {
        prediction.learned_share(self.fusion.prior, self.fusion.prior_evidence)
    }
}
