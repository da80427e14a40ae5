//! The ground around a pose as numbers.

use serde::{Deserialize, Serialize};
use terrain::{GridMap, PatchSample, PatchShape, SurfaceCell, TerrainClass, WheelLayout};

/// Where a footprint is sampled and how samples become numbers, turned with the vehicle.
///
/// Order of the features: heights of the fine patch, row-major, over [`FeatureLayout::height_scale_m`], relative to the
/// mean height under the wheels, 0 where unknown; then for each sample of the cover patch, row-major: height of
/// vegetation over the same scale, probability of loose ground, probability of an obstacle, 1 if the height is unknown.
/// Heights are divided by a fixed length and never by the patch's own spread, which would hide what is unusual.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FeatureLayout {
    /// Places of the wheels, whose mean height is the reference.
    pub wheels: WheelLayout,
    /// Where heights are sampled.
    pub height_patch: PatchShape,
    /// Where cover is sampled.
    pub cover_patch: PatchShape,
    /// Divides heights [m].
    pub height_scale_m: f64,
}

/// Patches with more rows or columns than this are no patches of a footprint.
const PATCH_SIDE_MAX: usize = 1024;
/// Features per sample of the cover patch.
const N_COVER: usize = 4;
/// Samples across the vehicle of the fine and of the cover patch.
const COLS: [usize; 2] = [7, 3];
/// Samples along the vehicle of the fine and of the cover patch.
const ROWS: [usize; 2] = [12, 5];

impl FeatureLayout {
    /// Patches of square cells that cover the body of a vehicle and are centred on it; heights count in wheel radii.
    /// All vehicles have the same number of features: a wide one sees a little beyond its bumpers, a long one a little
    /// beyond its sides.
    pub fn for_vehicle(geometry: &bicycle::Geometry) -> Self {
        let middle_m = 0.5 * geometry.length_m - geometry.rear_overhang_m;
        let patch = |n_rows: usize, n_cols: usize| {
            let spacing_m = (geometry.length_m / n_rows as f64).max(geometry.width_m / n_cols as f64);
            let rear_m = 0.5 * (n_rows as f64 - 1.0) * spacing_m - middle_m;
            PatchShape { n_rows, n_cols, spacing_m, rear_m }
        };
        Self {
            wheels: WheelLayout { wheelbase_m: geometry.wheelbase_m, track_m: geometry.track_m },
            height_patch: patch(ROWS[0], COLS[0]),
            cover_patch: patch(ROWS[1], COLS[1]),
            height_scale_m: geometry.wheel_radius_m,
        }
    }

    /// The first patch that is none of a footprint: its name, what would do, its size.
    pub(crate) fn first_huge_patch(&self) -> Option<(&'static str, String, String)> {
        let patches = [("height", self.height_patch), ("cover", self.cover_patch)];
        let (name, patch) =
            patches.into_iter().find(|(_, patch)| patch.n_rows.max(patch.n_cols) > PATCH_SIDE_MAX)?;
        let expected = format!("at most {PATCH_SIDE_MAX} rows and columns");
        Some((name, expected, format!("{} x {}", patch.n_rows, patch.n_cols)))
    }

    /// Number of features.
    pub fn n_features(&self) -> usize {
        self.height_patch.n_samples() + N_COVER * self.cover_patch.n_samples()
    }

    /// Features of the vehicle at (x [m], y [m], yaw [rad]); `None` when no wheel stands on known ground.
    pub fn features(&self, surface: &GridMap<SurfaceCell>, pose: [f64; 3]) -> Option<Vec<f32>> {
        let heights = self.sampled(surface, &self.height_patch, pose);
        let cover = self.sampled(surface, &self.cover_patch, pose);
        let per_m = (1.0 / self.height_scale_m) as f32;
        let known = |height_m: f32| if height_m.is_nan() { 0.0 } else { height_m * per_m };
        let mut features: Vec<f32> = heights.iter().map(|sample| known(sample.relative_height_m)).collect();
        for sample in &cover {
            features.extend([
                sample.vegetation_height_m * per_m,
                sample.class_probability[TerrainClass::Loose as usize],
                sample.class_probability[TerrainClass::Obstacle as usize],
                f32::from(u8::from(sample.relative_height_m.is_nan())),
            ]);
        }
        let is_grounded = heights.iter().chain(&cover).any(|sample| !sample.relative_height_m.is_nan());
        is_grounded.then_some(features)
    }

    /// Features of the same footprint seen in a mirror that swaps left and right. A vehicle that is the same on both
    /// sides has the same tractions, |roll| and |pitch| there.
    pub fn mirrored(&self, features: &[f32]) -> Vec<f32> {
        let (heights, cover) = features.split_at(self.height_patch.n_samples());
        let mut mirrored = Vec::with_capacity(features.len());
        for row in heights.chunks_exact(self.height_patch.n_cols) {
            mirrored.extend(row.iter().rev());
        }
        for row in cover.chunks_exact(N_COVER * self.cover_patch.n_cols) {
            mirrored.extend(row.chunks_exact(N_COVER).rev().flatten());
        }
        mirrored
    }

    fn sampled(
        &self,
        surface: &GridMap<SurfaceCell>,
        shape: &PatchShape,
        pose: [f64; 3],
    ) -> Vec<PatchSample> {
        let mut samples = vec![PatchSample::UNKNOWN; shape.n_samples()];
        shape.sample(surface, &self.wheels, pose, &mut samples);
        samples
    }
}

/// What makes every feature of the training data zero-mean and of unit spread; part of the checkpoint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Standardisation {
    /// Subtracted from each feature.
    pub mean: Vec<f32>,
    /// Divides each feature; a floor keeps features that never varied from being divided by zero.
    pub deviation: Vec<f32>,
}
