//! Ground that no training has seen: familiar footprints with something put into them that is not.

use std::f32::consts::TAU;

use evidential::{Dataset, FeatureLayout};
use rand::{Rng, RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::Serialize;

/// What is put into a footprint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Absurd {
    /// A step of four wheel radii between one half of the footprint and the other.
    Wall,
    /// One height that stands out by five wheel radii.
    Spike,
    /// Noise of one wheel radius on every height.
    Noise,
    /// Vegetation of half a wheel radius everywhere, a class that was never seen.
    Vegetation,
    /// Loose ground everywhere, a class that was never seen.
    Loose,
    /// An obstacle everywhere, a class that was never seen.
    Obstacle,
}

/// Numbers per sample of the cover patch: height of vegetation, loose ground, obstacle, unknown.
const N_COVER: usize = 4;
/// Footprints that are changed at most.
const N_FOOTPRINTS_MAX: usize = 1000;
const SEED: u64 = 0xAB5;

/// Heights of wall, spike, noise and vegetation in wheel radii, the unit of the features.
const WALL: f32 = 4.0;
const SPIKE: f32 = 5.0;
const NOISE: f32 = 1.0;
const VEGETATION: f32 = 0.5;

impl Absurd {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::Wall, Self::Spike, Self::Noise, Self::Vegetation, Self::Loose, Self::Obstacle];

    /// What it is, for people.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Wall => "walls",
            Self::Spike => "spikes",
            Self::Noise => "noise",
            Self::Vegetation => "unseen: vegetation",
            Self::Loose => "unseen: loose ground",
            Self::Obstacle => "unseen: obstacle",
        }
    }

    /// Features of the familiar footprints of a dataset, evenly chosen, with this put into them.
    pub(super) fn footprints(self, test: &Dataset, unevenness_max_m: f32) -> Vec<Vec<f32>> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(SEED + self as u64);
        let even: Vec<_> = test.examples.iter().filter(|e| e.unevenness_m <= unevenness_max_m).collect();
        let every = even.len().div_ceil(N_FOOTPRINTS_MAX).max(1);
        let changed = even.into_iter().step_by(every).map(|example| {
            let mut features = example.features.clone();
            self.put_into(&mut features, &test.origin.layout, &mut rng);
            features
        });
        changed.collect()
    }

    fn put_into(self, features: &mut [f32], layout: &FeatureLayout, rng: &mut impl Rng) {
        let n_heights = layout.height_patch.n_samples();
        let (heights, cover) = features.split_at_mut(n_heights);
        match self {
            Self::Wall => raise_wall(heights, layout, rng.random_range(0..4)),
            Self::Spike => heights[rng.random_range(0..n_heights)] += SPIKE,
            Self::Noise => heights.iter_mut().for_each(|height| *height += NOISE * normal(rng)),
            Self::Vegetation => cover.chunks_exact_mut(N_COVER).for_each(|sample| sample[0] = VEGETATION),
            Self::Loose => cover.chunks_exact_mut(N_COVER).for_each(|sample| sample[1] = 1.0),
            Self::Obstacle => cover.chunks_exact_mut(N_COVER).for_each(|sample| sample[2] = 1.0),
        }
    }
}

/// Raises front, rear, left or right half. Heights are relative to the mean under the wheels, of which two stand on
/// either half: one half rises by half the step, the other falls.
fn raise_wall(heights: &mut [f32], layout: &FeatureLayout, quarter: usize) {
    let (n_rows, n_cols) = (layout.height_patch.n_rows, layout.height_patch.n_cols);
    for (index, height) in heights.iter_mut().enumerate() {
        let (row, col) = (index / n_cols, index % n_cols);
        let is_upper = match quarter {
            0 => 2 * row >= n_rows,
            1 => 2 * row < n_rows,
            2 => 2 * col >= n_cols,
            _ => 2 * col < n_cols,
        };
        *height += if is_upper { 0.5 * WALL } else { -0.5 * WALL };
    }
}

/// Of zero mean and unit variance (Box and Muller).
fn normal(rng: &mut impl Rng) -> f32 {
    let (radius, turn): (f32, f32) = (1.0 - rng.random::<f32>(), rng.random());
    (-2.0 * radius.ln()).sqrt() * (TAU * turn).cos()
}

#[cfg(test)]
mod tests {
    use bicycle::Geometry;
    use evidential::{DatasetOrigin, Example};

    use super::*;

    const GEOMETRY: Geometry = Geometry {
        wheelbase_m: 2.0,
        track_m: 1.2,
        length_m: 3.0,
        width_m: 1.5,
        rear_overhang_m: 0.5,
        ground_clearance_m: 0.3,
        wheel_radius_m: 0.4,
    };

    /// Level footprints, the second more uneven than 1 m.
    fn level() -> Dataset {
        let layout = FeatureLayout::for_vehicle(&GEOMETRY);
        let example = |unevenness_m: f32| Example {
            features: vec![0.0; layout.n_features()],
            measured: [0.5; 4],
            prior: [[1.0 / 12.0; 12]; 4],
            unevenness_m,
            drive: 0,
            pose: [0.0; 3],
        };
        let origin = DatasetOrigin {
            vehicle: "test".to_owned(),
            layout,
            prior: physics_prior::PriorConfig::default(),
            drives: vec!["made".to_owned()],
            provenance: String::new(),
        };
        let mut examples = vec![example(0.5); 40];
        examples.push(example(2.0));
        Dataset { origin, examples }
    }

    #[test]
    fn each_kind_changes_what_it_says() {
        let test = level();
        let n_heights = test.origin.layout.height_patch.n_samples();
        let of = |absurd: Absurd| {
            let footprints = absurd.footprints(&test, 1.0);
            assert_eq!(footprints.len(), 40, "the uneven one stays away");
            footprints
        };
        for wall in of(Absurd::Wall) {
            assert!(wall[..n_heights].iter().all(|height| height.abs() == 2.0));
            let n_upper = wall[..n_heights].iter().filter(|height| **height > 0.0).count();
            assert!(n_upper > n_heights / 3 && n_upper < 2 * n_heights / 3, "{n_upper}");
        }
        for spike in of(Absurd::Spike) {
            assert_eq!(spike.iter().filter(|value| **value != 0.0).collect::<Vec<_>>(), [&5.0]);
        }
        let noise = of(Absurd::Noise);
        let n = (40 * n_heights) as f32;
        let sum_of = |power: i32| -> f32 {
            noise.iter().flat_map(|f| &f[..n_heights]).map(|height| height.powi(power)).sum()
        };
        // Five standard errors of mean and variance.
        assert!((sum_of(1) / n).abs() < 5.0 / n.sqrt(), "{}", sum_of(1) / n);
        assert!((sum_of(2) / n - 1.0).abs() < 5.0 * (2.0 / n).sqrt(), "{}", sum_of(2) / n);
        for (absurd, value) in [(Absurd::Vegetation, 0.5), (Absurd::Loose, 1.0), (Absurd::Obstacle, 1.0)] {
            for footprint in of(absurd) {
                let changed: Vec<_> = footprint.iter().filter(|v| **v != 0.0).collect();
                assert!(changed.len() == (footprint.len() - n_heights) / N_COVER && *changed[0] == value);
            }
        }
    }
}
