//! What the map remembers of one cell, and how one scan's points change it.

use super::ElevationConfig;
use crate::TerrainClass;

/// A point in the map frame, sorted into its cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CellPoint {
    /// Columns, rows from the window's south-west corner [cells].
    pub place: [f32; 2],
    pub height_m: f32,
    pub variance_m2: f32,
    pub class: TerrainClass,
}

impl CellPoint {
    fn is_rigid(&self) -> bool {
        matches!(self.class, TerrainClass::Open | TerrainClass::Loose)
    }
}

/// How the ground's height in a cell came about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ground {
    /// No point of the ground itself.
    Unseen,
    /// Taken for granted under the vehicle at the start.
    Assumed,
    /// Fused from points.
    Seen,
}

/// What the map remembers of one cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CellState {
    /// Mean height of the ground [m].
    pub ground_m: f32,
    /// Variance of that mean [m2].
    pub variance_m2: f32,
    /// Variance of heights within the cell beyond sensor noise: slopes, edges of rocks [m2].
    pub spread_m2: f32,
    /// Lowest plant or obstacle point: the ground cannot be higher [m].
    pub lowest_m: f32,
    /// Top of the vegetation [m]; -inf while none was seen.
    pub vegetation_top_m: f32,
    /// Highest obstacle point [m]; -inf while none was seen.
    pub obstacle_top_m: f32,
    /// Lowest height at which a ray went through while the ground was unseen [m].
    pub ceiling_m: f32,
    /// Points of each class, capped.
    pub evidence: [f32; TerrainClass::COUNT],
    pub ground: Ground,
    /// Scans in a row whose rays passed below what is stored.
    pub contradictions: u8,
}

/// Share of an innovation that a cell's spread and its variance take over when it is far outside both.
const SURPRISE_GAIN: f32 = 0.3;
/// Squared number of standard deviations beyond which a height surprises.
const SURPRISE_GATE: f32 = 16.0;
/// Share by which spread and top of plants follow smaller values: a scan may see one side of a cell only, and
/// rays also hit plants below their top.
const SINK_GAIN: f32 = 0.05;

impl CellState {
    pub const NEW: Self = Self {
        ground_m: f32::NAN,
        variance_m2: f32::INFINITY,
        spread_m2: 0.0,
        lowest_m: f32::INFINITY,
        vegetation_top_m: f32::NEG_INFINITY,
        obstacle_top_m: f32::NEG_INFINITY,
        ceiling_m: f32::INFINITY,
        evidence: [0.0; TerrainClass::COUNT],
        ground: Ground::Unseen,
        contradictions: 0,
    };

    /// The same cell `by_m` higher.
    pub fn lifted(&self, by_m: f32) -> Self {
        Self {
            ground_m: self.ground_m + by_m,
            lowest_m: self.lowest_m + by_m,
            vegetation_top_m: self.vegetation_top_m + by_m,
            obstacle_top_m: self.obstacle_top_m + by_m,
            ceiling_m: self.ceiling_m + by_m,
            ..*self
        }
    }

    /// Whether any point ever fell into the cell.
    pub fn was_hit(&self) -> bool {
        self.evidence.iter().any(|&n| n > 0.0)
    }

    /// Probability of each class; zeros where nothing was seen.
    pub fn class_probability(&self) -> [f32; TerrainClass::COUNT] {
        let total: f32 = self.evidence.iter().sum();
        if total > 0.0 { self.evidence.map(|n| n / total) } else { [0.0; TerrainClass::COUNT] }
    }

    /// Takes in the points that one scan left in this cell. `reference_m` is the height of the ground here
    /// as it is known or guessed, NaN when nothing is.
    pub fn fuse(&mut self, points: &[CellPoint], reference_m: f32, config: &ElevationConfig) {
        let lowest_m = points.iter().fold(f32::INFINITY, |low, p| low.min(p.height_m));
        let above = if reference_m.is_nan() { lowest_m } else { reference_m };
        let touching = |p: &&CellPoint| p.height_m <= above + config.clearance_m;
        let touching = points.iter().filter(touching);
        let highest_m = touching.clone().fold(f32::NEG_INFINITY, |high, p| high.max(p.height_m));
        self.fade_obstacle(highest_m, config);
        let rigid = RigidStatistics::of(touching.clone().filter(|p| p.is_rigid()));
        let is_wall = rigid.span_m() > config.wall_span_m;
        for point in touching {
            self.take_evidence(point, is_wall);
        }
        self.cap_evidence(config.evidence_cap);
        if !is_wall && rigid.n > 0.0 {
            self.fuse_ground(&rigid, config);
        }
    }

    /// Takes in that a ray went through the cell at `height_m` and no point of the scan fell into it.
    pub fn pass(&mut self, height_m: f32, config: &ElevationConfig) {
        if self.ground == Ground::Unseen {
            self.ceiling_m = self.ceiling_m.min(height_m);
        } else if height_m < self.ground_m - self.margin_m(config) {
            self.contradictions += 1;
            if self.contradictions >= config.ghost_scans {
                *self = Self { ceiling_m: height_m, ..Self::NEW };
            }
            return;
        }
        self.fade_obstacle(height_m, config);
    }

    /// Halves the evidence of an obstacle when scan after scan shows nothing above `highest_m`. Not at once:
    /// sparse rays miss a thin trunk in one scan and hit it in the next.
    fn fade_obstacle(&mut self, highest_m: f32, config: &ElevationConfig) {
        if highest_m >= self.obstacle_top_m - config.visibility_margin_m {
            self.contradictions = 0;
            return;
        }
        self.contradictions = self.contradictions.saturating_add(1);
        let evidence = &mut self.evidence[TerrainClass::Obstacle as usize];
        if self.contradictions >= config.ghost_scans {
            *evidence *= 0.5;
        }
        if *evidence < 1.0 {
            *evidence = 0.0;
            self.obstacle_top_m = f32::NEG_INFINITY;
        }
    }

    /// How far below the ground's height something must be to contradict it.
    fn margin_m(&self, config: &ElevationConfig) -> f32 {
        config.visibility_margin_m + 3.0 * (self.variance_m2 + self.spread_m2).sqrt()
    }

    fn take_evidence(&mut self, point: &CellPoint, is_wall: bool) {
        let class = if is_wall && point.is_rigid() { TerrainClass::Obstacle } else { point.class };
        self.evidence[class as usize] += 1.0;
        match class {
            TerrainClass::Vegetation => {
                self.lowest_m = self.lowest_m.min(point.height_m);
                let rise_m = point.height_m - self.vegetation_top_m;
                let gain = if rise_m > 0.0 { 1.0 } else { SINK_GAIN };
                self.vegetation_top_m = if rise_m == f32::INFINITY {
                    point.height_m
                } else {
                    self.vegetation_top_m + gain * rise_m
                };
            }
            TerrainClass::Obstacle => {
                self.lowest_m = self.lowest_m.min(point.height_m);
                self.obstacle_top_m = self.obstacle_top_m.max(point.height_m);
            }
            TerrainClass::Open | TerrainClass::Loose => {}
        }
    }

    fn cap_evidence(&mut self, cap: f32) {
        let total: f32 = self.evidence.iter().sum();
        if total > cap {
            self.evidence = self.evidence.map(|n| n * (cap / total));
        }
    }

    /// Follows the variance between a scan's points: up at once, down slowly, since a scan may see one side only.
    fn learn_spread(&mut self, rigid: &RigidStatistics) {
        let change_m2 = rigid.excess_m2() - self.spread_m2;
        self.spread_m2 += change_m2 * if change_m2 > 0.0 { SURPRISE_GAIN } else { SINK_GAIN };
    }

    /// Kalman update with the mean of a scan's ground points.
    fn fuse_ground(&mut self, rigid: &RigidStatistics, config: &ElevationConfig) {
        let shared_m2 = (config.scan_noise_m * config.scan_noise_m) as f32;
        if self.ground != Ground::Seen {
            self.ground = Ground::Seen;
            self.ground_m = rigid.mean_m();
            self.spread_m2 = rigid.excess_m2();
            self.variance_m2 = (rigid.noise_m2() + self.spread_m2) / rigid.n + shared_m2;
            self.ceiling_m = f32::INFINITY;
            return;
        }
        self.learn_spread(rigid);
        let innovation_m = rigid.mean_m() - self.ground_m;
        let mut noise_m2 = (rigid.noise_m2() + self.spread_m2) / rigid.n + shared_m2;
        let surprise_m2 = innovation_m * innovation_m - SURPRISE_GATE * (self.variance_m2 + noise_m2);
        if surprise_m2 > 0.0 {
            // Either the cell holds several heights, or the ground is not where it was: take half of each.
            self.spread_m2 += SURPRISE_GAIN * surprise_m2;
            self.variance_m2 += SURPRISE_GAIN * surprise_m2;
            noise_m2 += SURPRISE_GAIN * surprise_m2;
        }
        let gain = self.variance_m2 / (self.variance_m2 + noise_m2);
        self.ground_m += gain * innovation_m;
        self.variance_m2 *= 1.0 - gain;
    }
}

/// Sums over the ground points of one cell and scan.
struct RigidStatistics {
    n: f32,
    first_m: f32,
    sum_m: f32,
    sum_m2: f32,
    variance_sum_m2: f32,
    lowest_m: f32,
    highest_m: f32,
}

impl RigidStatistics {
    fn of<'a>(points: impl Iterator<Item = &'a CellPoint>) -> Self {
        let mut all = Self {
            n: 0.0,
            first_m: f32::NAN,
            sum_m: 0.0,
            sum_m2: 0.0,
            variance_sum_m2: 0.0,
            lowest_m: f32::INFINITY,
            highest_m: f32::NEG_INFINITY,
        };
        for point in points {
            if all.n == 0.0 {
                all.first_m = point.height_m;
            }
            // Relative to the first point, so that the squares keep their digits.
            let relative_m = point.height_m - all.first_m;
            all.n += 1.0;
            all.sum_m += relative_m;
            all.sum_m2 += relative_m * relative_m;
            all.variance_sum_m2 += point.variance_m2;
            all.lowest_m = all.lowest_m.min(point.height_m);
            all.highest_m = all.highest_m.max(point.height_m);
        }
        all
    }

    fn mean_m(&self) -> f32 {
        self.first_m + self.sum_m / self.n
    }

    fn span_m(&self) -> f32 {
        if self.n > 0.0 { self.highest_m - self.lowest_m } else { 0.0 }
    }

    /// Mean sensor variance of one point.
    fn noise_m2(&self) -> f32 {
        self.variance_sum_m2 / self.n
    }

    /// Variance between the points beyond what sensor noise explains (two standard errors of a sample variance).
    fn excess_m2(&self) -> f32 {
        if self.n < 2.0 {
            return 0.0;
        }
        let sample_m2 = (self.sum_m2 - self.sum_m * self.sum_m / self.n).max(0.0) / (self.n - 1.0);
        let explained_m2 = self.noise_m2() * (1.0 + 2.0 * (2.0 / (self.n - 1.0)).sqrt());
        (sample_m2 - explained_m2).max(0.0)
    }
}
