//! The two tracks of the paper: nodes of their global paths, as the published code has them, and where their turns lie.

/// A closed path through nodes, with its turns.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// Name.
    pub name: &'static str,
    /// Corners of the path in the order of driving [m].
    pub nodes_m: Vec<[f64; 2]>,
    /// Way to each node from the first, and once around [m].
    way_m: Vec<f64>,
    /// Way at which the stretch of each turn ends [m].
    turn_ends_m: Vec<f64>,
}

/// Which nodes make a turn; those from `nodes_m.len()` on are of the next lap.
type Turn = &'static [usize];

/// From `generate_figures.m` of the repository ut-amrl/ikd.
const OUTDOOR_M: [[f64; 2]; 17] = [
    [-0.299711, 0.045118],
    [1.743479, 0.741220],
    [2.995085, -0.281547],
    [4.612898, 0.675799],
    [6.215074, 0.045560],
    [6.936432, 1.146581],
    [6.553924, 4.049590],
    [5.478966, 4.884508],
    [4.247462, 4.018281],
    [4.122225, 2.588483],
    [2.792493, 2.379026],
    [1.270844, 2.680651],
    [1.369393, 4.540771],
    [0.014339, 5.329165],
    [-0.934198, 4.602364],
    [-0.960339, 1.565709],
    [-0.991648, 0.636863],
];
const OUTDOOR_TURNS: [Turn; 8] =
    [&[1], &[2], &[3], &[4, 5], &[6, 7, 8], &[9, 10, 11], &[12, 13, 14], &[16, 17]];

/// From `generate_generalizability_figures.m` of the same.
const INDOOR_M: [[f64; 2]; 8] = [
    [-0.465615, 0.007219],
    [1.707256, 0.014438],
    [2.486891, 0.880699],
    [2.548595, 3.047370],
    [1.219384, 4.216158],
    [-0.400114, 4.666868],
    [-1.171667, 3.650862],
    [-1.018884, 0.816740],
];
const INDOOR_TURNS: [Turn; 4] = [&[1, 2], &[3, 4], &[5, 6], &[7, 8]];

impl Track {
    /// Eight turns, 28 m.
    pub fn outdoor() -> Self {
        Self::new("outdoor", &OUTDOOR_M, &OUTDOOR_TURNS)
    }

    /// Four turns, 14 m.
    pub fn indoor() -> Self {
        Self::new("indoor", &INDOOR_M, &INDOOR_TURNS)
    }

    /// A closed line without turns.
    pub(super) fn closed(name: &'static str, nodes_m: Vec<[f64; 2]>) -> Self {
        let n = nodes_m.len();
        let mut way_m = vec![0.0];
        for k in 0..n {
            way_m.push(way_m[k] + distance_m(nodes_m[k], nodes_m[(k + 1) % n]));
        }
        Self { name, nodes_m, way_m, turn_ends_m: Vec::new() }
    }

    fn new(name: &'static str, nodes_m: &[[f64; 2]], turns: &[Turn]) -> Self {
        let line = Self::closed(name, nodes_m.to_vec());
        let (n, way_m, length_m) = (nodes_m.len(), &line.way_m, line.length_m());
        let at = |node: usize| way_m[node % n] + (node / n) as f64 * length_m;
        // Half-way between the last node of a turn and the first of the next.
        let ends = (0..turns.len()).map(|turn| {
            let last = turns[turn][turns[turn].len() - 1];
            let next = turns.get(turn + 1).map_or(n + turns[0][0], |next| next[0]);
            0.5 * (at(last) + at(next))
        });
        Self { turn_ends_m: ends.collect(), ..line.clone() }
    }

    /// Number of turns.
    pub fn n_turns(&self) -> usize {
        self.turn_ends_m.len()
    }

    /// Once around [m].
    pub fn length_m(&self) -> f64 {
        self.way_m[self.nodes_m.len()]
    }

    /// Way at which a lap ends: behind the last turn [m].
    pub fn lap_m(&self) -> f64 {
        self.turn_ends_m[self.n_turns() - 1]
    }

    /// Way at which a turn begins [m].
    pub fn turn_begin_m(&self, turn: usize) -> f64 {
        if turn == 0 { 0.0 } else { self.turn_ends_m[turn - 1] }
    }

    /// The turn whose stretch holds a way.
    pub fn turn_at(&self, way_m: f64) -> usize {
        self.turn_ends_m.partition_point(|end_m| *end_m <= way_m).min(self.n_turns() - 1)
    }

    /// Point and heading of the path at a way [m, rad].
    pub fn place(&self, way_m: f64) -> ([f64; 2], f64) {
        let way_m = way_m.rem_euclid(self.length_m());
        let k = (self.way_m.partition_point(|start_m| *start_m <= way_m) - 1).min(self.nodes_m.len() - 1);
        let [from, to] = self.leg(k);
        let length_m = distance_m(from, to);
        let share = (way_m - self.way_m[k]) / length_m;
        let point = [0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis]));
        (point, (to[1] - from[1]).atan2(to[0] - from[0]))
    }

    /// The nearest point of the path among those whose way is not farther than `reach_m` from `near_m`: its way and the
    /// distance to it [m].
    pub fn project(&self, point_m: [f64; 2], near_m: f64, reach_m: f64) -> (f64, f64) {
        let length_m = self.length_m();
        let mut best = (near_m, f64::INFINITY);
        for k in 0..self.nodes_m.len() {
            let [from, to] = self.leg(k);
            let leg_m = distance_m(from, to);
            let along = [0, 1].map(|axis| (to[axis] - from[axis]) / leg_m);
            let ahead_m = (0..2).map(|axis| along[axis] * (point_m[axis] - from[axis])).sum::<f64>();
            // The lap in which this leg lies nearest.
            let lap = ((near_m - self.way_m[k] - 0.5 * leg_m) / length_m).round();
            let start_m = self.way_m[k] + lap * length_m;
            let (low_m, high_m) =
                ((near_m - reach_m - start_m).max(0.0), (near_m + reach_m - start_m).min(leg_m));
            if low_m > high_m {
                continue;
            }
            let ahead_m = ahead_m.clamp(low_m, high_m);
            let foot = [0, 1].map(|axis| from[axis] + ahead_m * along[axis]);
            let off_m = distance_m(point_m, foot);
            if off_m < best.1 {
                best = (start_m + ahead_m, off_m);
            }
        }
        best
    }

    /// The point of the path ahead of `way_m` that is `lookahead_m` away from a vehicle: line of sight.
    pub fn carrot(&self, from_m: [f64; 2], way_m: f64, lookahead_m: f64) -> [f64; 2] {
        const STEP_M: f64 = 0.02;
        let mut ahead_m = 0.0;
        loop {
            let (point, _) = self.place(way_m + ahead_m);
            if distance_m(point, from_m) >= lookahead_m || ahead_m > 2.0 * lookahead_m {
                return point;
            }
            ahead_m += STEP_M;
        }
    }

    fn leg(&self, k: usize) -> [[f64; 2]; 2] {
        [self.nodes_m[k], self.nodes_m[(k + 1) % self.nodes_m.len()]]
    }
}

fn distance_m(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_and_turns_are_those_of_the_nodes() {
        let (outdoor, indoor) = (Track::outdoor(), Track::indoor());
        assert!((outdoor.length_m() - 28.322).abs() < 1e-3 && (indoor.length_m() - 14.051).abs() < 1e-3);
        assert_eq!((outdoor.n_turns(), indoor.n_turns()), (8, 4));
        // The lap begins at the first node and ends half-way to the second.
        assert!((outdoor.lap_m() - outdoor.length_m() - 0.5 * 2.158_54).abs() < 1e-3);
        assert_eq!([0.0, 2.0, 4.0, 28.0, 29.0].map(|way_m| outdoor.turn_at(way_m)), [0, 0, 1, 7, 7]);
    }

    #[test]
    fn points_beside_the_path_are_projected_onto_it() {
        let track = Track::outdoor();
        for way_m in [0.5, 3.0, 9.9, 20.0, 27.5, 28.8] {
            let (point, heading_rad) = track.place(way_m);
            let beside = [point[0] - 0.1 * heading_rad.sin(), point[1] + 0.1 * heading_rad.cos()];
            let (found_m, off_m) = track.project(beside, way_m + 0.2, 1.0);
            assert!(
                (found_m - way_m).abs() < 1e-9 && (off_m - 0.1).abs() < 1e-9,
                "{way_m} {found_m} {off_m}"
            );
        }
    }

    #[test]
    fn carrot_is_as_far_away_as_asked() {
        let track = Track::indoor();
        let (point, _) = track.place(5.0);
        let carrot = track.carrot(point, 5.0, 1.0);
        assert!((distance_m(point, carrot) - 1.0).abs() < 0.03);
    }
}
