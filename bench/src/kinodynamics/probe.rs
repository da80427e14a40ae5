//! Whether the ground can be told from what the unit felt, and not from speed and curvature: a linear probe on data that it
//! was not fitted to.

use kinodynamics::{Example, WINDOW, block_split};
use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::KinodynamicsError;

/// Weight of the penalty on the probe's weights, over the number of examples.
const RIDGE: f64 = 1e-3;

/// How often a probe names the ground that the car stood on.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Probe {
    /// From commanded speed and curvature, their squares and magnitudes.
    pub from_wish: f64,
    /// From these and how much the six components of the unit shook in the last half second.
    pub from_imu: f64,
    /// Naming always the most frequent one.
    pub chance: f64,
    /// Examples that it was judged on.
    pub n: usize,
}

/// Fits both probes to nine tenths of the blocks and judges them on the rest.
///
/// # Errors
/// Fewer grounds or examples than there is anything to tell apart of.
pub fn probe(examples: &[Example], n_grounds: usize, seed: u64) -> Result<Probe, KinodynamicsError> {
    let split = block_split(examples, seed);
    let known = |places: &[usize]| -> Vec<usize> {
        places.iter().copied().filter(|place| examples[*place].ground.is_some()).collect()
    };
    let (training, test) = (known(&split.training), known(&split.validation));
    let grounds = |place: &usize| examples[*place].ground.unwrap_or(0) as usize;
    let counts = (0..n_grounds).map(|ground| test.iter().filter(|place| grounds(place) == ground).count());
    let most = counts.max().unwrap_or(0);
    if training.is_empty() || most == 0 {
        return Err(KinodynamicsError::NothingToProbe { n_training: training.len(), n_test: test.len() });
    }
    let accuracy = |features: &dyn Fn(&Example) -> Vec<f64>| -> f64 {
        let weights = fit(examples, &training, n_grounds, features);
        let right = test.iter().filter(|place| {
            let scores = weights.tr_mul(&DVector::from_vec(features(&examples[**place])));
            scores.imax() == grounds(place)
        });
        right.count() as f64 / test.len() as f64
    };
    Ok(Probe {
        from_wish: accuracy(&wish_features),
        from_imu: accuracy(&imu_features),
        chance: most as f64 / test.len() as f64,
        n: test.len(),
    })
}

/// Weights [features, grounds] that explain which ground it was as a sum of features, by least squares.
fn fit(
    examples: &[Example],
    places: &[usize],
    n_grounds: usize,
    features: &dyn Fn(&Example) -> Vec<f64>,
) -> DMatrix<f64> {
    let n_features = features(&examples[places[0]]).len();
    let mut square = DMatrix::<f64>::identity(n_features, n_features) * (RIDGE * places.len() as f64);
    let mut product = DMatrix::<f64>::zeros(n_features, n_grounds);
    for place in places {
        let example = &examples[*place];
        let row = DVector::from_vec(features(example));
        square.ger(1.0, &row, &row, 1.0);
        let ground = example.ground.unwrap_or(0) as usize;
        let mut column = product.column_mut(ground);
        column += row;
    }
    // The penalty makes it positive definite.
    square.cholesky().map_or_else(|| DMatrix::zeros(n_features, n_grounds), |factor| factor.solve(&product))
}

fn wish_features(example: &Example) -> Vec<f64> {
    let [curvature, speed] = example.commanded.map(f64::from);
    vec![
        1.0,
        speed,
        speed * speed,
        curvature,
        curvature.abs(),
        curvature * curvature,
        speed * curvature.abs(),
    ]
}

/// How much each component shakes in each quarter of a second, slowly and from sample to sample, and products of all these.
fn imu_features(example: &Example) -> Vec<f64> {
    let mut shakes = vec![f64::from(example.commanded[1])];
    for column in example.window.chunks_exact(WINDOW) {
        for part in column.chunks_exact(WINDOW / 2) {
            let steps: Vec<f32> = part.windows(2).map(|pair| pair[1] - pair[0]).collect();
            shakes.extend([log_deviation(part), log_deviation(&steps)]);
        }
    }
    let mut features = wish_features(example);
    for (k, shake) in shakes.iter().enumerate() {
        features.push(*shake);
        features.extend(shakes[..=k].iter().map(|other| shake * other));
    }
    features
}

/// Natural logarithm of the standard deviation.
fn log_deviation(values: &[f32]) -> f64 {
    let n = values.len() as f64;
    let mean = values.iter().map(|v| f64::from(*v)).sum::<f64>() / n;
    let square = values.iter().map(|v| (f64::from(*v) - mean).powi(2)).sum::<f64>() / n;
    square.sqrt().max(1e-4).ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probe_finds_what_shaking_tells_and_not_what_nothing_tells() {
        let example = |k: usize| {
            let ground = (k / 60 % 2) as u32;
            let size = if ground == 0 { 0.1 } else { 1.0 };
            Example {
                time_s: 0.05 * k as f64,
                driven: [1.0, 0.5],
                commanded: [0.5 * ((k * k) as f32).sin(), 1.0 + 0.5 * ((3 * k * k) as f32).cos()],
                window: (0..6 * WINDOW).map(|i| size * ((i * 7 + k) as f32).sin()).collect(),
                run: 0,
                ground: Some(ground),
            }
        };
        let examples: Vec<Example> = (0..6000).map(example).collect();
        let found = probe(&examples, 2, 1).unwrap();
        assert!(found.from_imu > 0.99 && found.from_wish < 0.65, "{found:?}");
        assert!((0.5..0.6).contains(&found.chance) && found.n > 400, "{found:?}");
    }
}
