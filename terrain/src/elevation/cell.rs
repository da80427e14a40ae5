//! What the map remembers of one cell, and how one scan's points change it.

use super::ElevationConfig;
use super::statistics::RigidStatistics;
use crate::TerrainClass;

/// A point in the map frame, sorted into its cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CellPoint {
    /// Columns, rows from the window's south-west corner [cells].
    pub place: [f32; 2],
    pub height_m: f32,
    /// Variance of the error that is the point's own [m2].
    pub variance_m2: f32,
    /// Variance of the error that it shares with the scan's other points [m2].
    pub shared_m2: f32,
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
    /// Scans in a row that contradict the height of the ground.
    pub ground_contradictions: u8,
    /// Scans in a row that show nothing where an obstacle stood.
    pub obstacle_contradictions: u8,
}

/// So many points named as ground tell of ground where plants or obstacles prevail: a camera errs.
const GROUND_POINTS: f32 = 2.0;
/// Share of an innovation that a cell's spread and its variance take over when it is far outside both.
const SURPRISE_GAIN: f32 = 0.3;
/// Squared number of standard deviations beyond which a height surprises.
const SURPRISE_GATE: f32 = 25.0;
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
        ground_contradictions: 0,
        obstacle_contradictions: 0,
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

    /// Probability of each class, each cell having shown `open_prior` points of open ground before the first;
    /// zeros where nothing was seen.
    pub fn class_probability(&self, open_prior: f32) -> [f32; TerrainClass::COUNT] {
        if !self.was_hit() {
            return [0.0; TerrainClass::COUNT];
        }
        let mut evidence = self.evidence;
        evidence[TerrainClass::Open as usize] += open_prior;
        let total: f32 = evidence.iter().sum();
        evidence.map(|n| n / total)
    }

    /// Whether more plants and obstacles than ground were seen.
    fn is_covered(&self) -> bool {
        let [open, loose, vegetation, obstacle] = self.evidence;
        vegetation + obstacle > open + loose
    }

    fn shows_ground(&self) -> bool {
        let [open, loose, ..] = self.evidence;
        open + loose >= GROUND_POINTS
    }

    fn forget_ground(&mut self) {
        (self.ground, self.ground_m) = (Ground::Unseen, f32::NAN);
        (self.variance_m2, self.spread_m2) = (f32::INFINITY, 0.0);
    }

    /// Takes in the points that one scan left in this cell. `reference_m` is the height of the ground here
    /// as it is known or guessed, NaN when nothing is.
    pub fn fuse(&mut self, points: &[CellPoint], reference_m: f32, config: &ElevationConfig) {
        let lowest_m = points.iter().fold(f32::INFINITY, |low, p| low.min(p.height_m));
        let above = if reference_m.is_nan() { lowest_m } else { reference_m };
        let touching = |p: &&CellPoint| p.height_m <= above + config.clearance_m;
        let touching = points.iter().filter(touching);
        if touching.clone().next().is_none() {
            return self.hang(points, config);
        }
        self.ground_contradictions = 0;
        let highest_m = touching.clone().fold(f32::NEG_INFINITY, |high, p| high.max(p.height_m));
        self.fade_obstacle(highest_m, config);
        let rigid = touching.clone().filter(|p| p.is_rigid());
        let statistics = RigidStatistics::of(rigid.clone());
        let is_wall = statistics.span_m() > config.steep_span_m();
        let was_covered = self.is_covered();
        for point in touching {
            self.take_evidence(point, is_wall);
        }
        let shows_ground = self.shows_ground();
        self.cap_evidence(config.evidence_cap);
        if is_wall {
            return;
        }
        if self.is_covered() {
            // Where plants or obstacles prevail, a point named as ground is ground only at their foot.
            let foot_m = self.lowest_m;
            let is_one_leaf = !was_covered && !shows_ground;
            let is_refuted = is_one_leaf || self.ground_m - self.margin_m(config) > foot_m;
            if self.ground == Ground::Seen && is_refuted {
                self.forget_ground();
            }
            let is_ground = shows_ground || self.ground == Ground::Seen;
            let is_foot = |p: &&CellPoint| is_ground && p.height_m <= foot_m + 2.0 * p.variance_m2.sqrt();
            self.fuse_ground(&RigidStatistics::of(rigid.filter(is_foot)));
        } else {
            self.fuse_ground(&statistics);
        }
    }

    /// Takes in that all points of a scan hang high above what passes for ground. Rigid ground does not hang:
    /// when scan after scan says so, the map was wrong.
    fn hang(&mut self, points: &[CellPoint], config: &ElevationConfig) {
        if !points.iter().all(CellPoint::is_rigid) {
            return;
        }
        self.ground_contradictions = self.ground_contradictions.saturating_add(1);
        if self.ground_contradictions >= config.ghost_scans {
            *self = Self::NEW;
            self.fuse(points, f32::NAN, config);
        }
    }

    /// Takes in that a ray went through the cell at `height_m` and no point of the scan fell into it.
    pub fn pass(&mut self, height_m: f32, config: &ElevationConfig) {
        if self.ground == Ground::Unseen {
            self.ceiling_m = self.ceiling_m.min(height_m);
        } else if height_m < self.ground_m - self.margin_m(config) {
            self.ground_contradictions = self.ground_contradictions.saturating_add(1);
            if self.ground_contradictions >= config.ghost_scans {
                *self = Self { ceiling_m: height_m, ..Self::NEW };
            }
            return;
        } else {
            self.ground_contradictions = 0;
        }
        self.fade_obstacle(height_m, config);
    }

    /// Halves the evidence of an obstacle when scan after scan shows nothing above `highest_m`. Not at once:
    /// sparse rays miss a thin trunk in one scan and hit it in the next.
    fn fade_obstacle(&mut self, highest_m: f32, config: &ElevationConfig) {
        if highest_m >= self.obstacle_top_m - config.visibility_margin_m {
            self.obstacle_contradictions = 0;
            return;
        }
        self.obstacle_contradictions = self.obstacle_contradictions.saturating_add(1);
        let evidence = &mut self.evidence[TerrainClass::Obstacle as usize];
        if self.obstacle_contradictions >= config.ghost_scans {
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

    /// Kalman update with the mean of a scan's ground points.
    fn fuse_ground(&mut self, rigid: &RigidStatistics) {
        if rigid.n < 1.0 {
            return;
        }
        let shared_m2 = rigid.shared_m2();
        if self.ground != Ground::Seen {
            self.ground = Ground::Seen;
            self.ground_m = rigid.mean_m();
            self.spread_m2 = rigid.excess_m2();
            self.variance_m2 = (rigid.noise_m2() + self.spread_m2) / rigid.n + shared_m2;
            self.ceiling_m = f32::INFINITY;
            return;
        }
        let innovation_m = rigid.mean_m() - self.ground_m;
        self.learn_spread(innovation_m * innovation_m, rigid);
        let noise_m2 = (rigid.noise_m2() + self.spread_m2) / rigid.n + shared_m2;
        let gain = self.variance_m2 / (self.variance_m2 + noise_m2);
        self.ground_m += gain * innovation_m;
        self.variance_m2 *= 1.0 - gain;
    }

    /// Follows the variance of heights within the cell: between the points of a scan, and between scans once one
    /// surprised. Up fast, down slowly, since a scan may see one side of the cell only. A surprise may also
    /// mean that the ground is not where it was, so the mean becomes uncertain too.
    fn learn_spread(&mut self, squared_innovation_m2: f32, rigid: &RigidStatistics) {
        let sensor_m2 = self.variance_m2 + rigid.noise_m2() / rigid.n + rigid.shared_m2();
        let is_surprise = squared_innovation_m2 > SURPRISE_GATE * (sensor_m2 + self.spread_m2 / rigid.n);
        let between_scans_m2 =
            if is_surprise || self.spread_m2 > 0.0 { squared_innovation_m2 - sensor_m2 } else { 0.0 };
        let seen_m2 = rigid.excess_m2().max(between_scans_m2);
        let is_fast = is_surprise || rigid.excess_m2() > self.spread_m2;
        self.spread_m2 += (seen_m2 - self.spread_m2) * if is_fast { SURPRISE_GAIN } else { SINK_GAIN };
        if is_surprise {
            self.variance_m2 += SURPRISE_GAIN * between_scans_m2;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CONFIG_SCANS: u8 = 2;

    fn config() -> ElevationConfig {
        ElevationConfig { ghost_scans: CONFIG_SCANS, visibility_margin_m: 0.1, ..ElevationConfig::default() }
    }

    fn points(height_m: f32, class: TerrainClass, n: usize) -> Vec<CellPoint> {
        vec![CellPoint { place: [0.5; 2], height_m, variance_m2: 1e-4, shared_m2: 0.0, class }; n]
    }

    /// Ground at zero with eight points of an obstacle of 1.5 m, each seen in two scans.
    fn ground_with_obstacle() -> CellState {
        let mut cell = CellState::NEW;
        let both = [points(0.0, TerrainClass::Open, 9), points(1.5, TerrainClass::Obstacle, 8)].concat();
        cell.fuse(&both, f32::NAN, &config());
        cell.fuse(&both, 0.0, &config());
        assert_eq!((cell.ground, cell.obstacle_top_m), (Ground::Seen, 1.5));
        cell
    }

    #[test]
    fn an_obstacle_that_is_missed_once_is_no_word_against_the_ground() {
        let mut cell = ground_with_obstacle();
        // Nothing at the obstacle's height; then one ray far below the ground.
        cell.fuse(&points(0.0, TerrainClass::Open, 3), 0.0, &config());
        cell.pass(-2.0, &config());
        assert_eq!(cell.ground, Ground::Seen, "one contradiction of {CONFIG_SCANS}");
        cell.pass(-2.0, &config());
        assert_eq!(cell.ground, Ground::Unseen);
    }

    #[test]
    fn ground_that_is_contradicted_once_is_no_word_against_the_obstacle() {
        let mut cell = ground_with_obstacle();
        let before = cell.evidence[TerrainClass::Obstacle as usize];
        cell.pass(-2.0, &config());
        cell.fade_obstacle(0.5, &config());
        assert_eq!(cell.evidence[TerrainClass::Obstacle as usize], before, "one scan of {CONFIG_SCANS}");
        cell.fade_obstacle(0.5, &config());
        assert_eq!(cell.evidence[TerrainClass::Obstacle as usize], 0.5 * before);
    }
}
