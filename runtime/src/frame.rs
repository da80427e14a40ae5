//! Maps of before a jump of the localisation: the ground moves with the frame, the vehicle stays where it is on it.

use std::collections::VecDeque;

use navigator::{Chart, Jump};
use terrain::GridGeometry;

/// Jumps that are remembered: more than fall into the age of any map that is driven on.
const JUMPS_KEPT: usize = 64;

/// The jumps of late, by which older maps are still to be moved.
#[derive(Clone, Debug)]
pub struct Frame {
    jumps: VecDeque<(u64, [f64; 2])>,
}

impl Default for Frame {
    /// With room for all jumps that are ever kept: a jump in the control cycle takes no memory.
    fn default() -> Self {
        Self { jumps: VecDeque::with_capacity(JUMPS_KEPT) }
    }
}

impl Frame {
    /// Notes a jump that the odometry of this time showed.
    pub fn note(&mut self, at_ns: u64, jump: &Jump) {
        if self.jumps.len() == JUMPS_KEPT {
            self.jumps.pop_front();
        }
        let [east_m, north_m, _] = jump.step_m;
        self.jumps.push_back((at_ns, [east_m, north_m]));
    }

    /// A chart of the frame of this time, laid where it belongs now, to the nearest cell. Its times to the goal lead to
    /// where the goal was until the next map comes.
    pub fn place<'a>(&self, chart: Chart<'a>, of_ns: u64) -> Chart<'a> {
        let Chart { mut map, mut time_to_goal } = chart;
        for (_, step_m) in self.jumps.iter().filter(|(at_ns, _)| *at_ns > of_ns) {
            shift(&mut map.geometry, *step_m);
            shift(&mut time_to_goal.geometry, *step_m);
        }
        Chart { map, time_to_goal }
    }
}

fn shift(geometry: &mut GridGeometry, step_m: [f64; 2]) {
    for (origin, step_m) in geometry.origin.iter_mut().zip(step_m) {
        *origin = origin.saturating_add((step_m / geometry.resolution_m).round() as i64);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mppi::CostToGoView;
    use traversability::{Risk, RiskMap};

    #[test]
    fn maps_of_before_a_jump_move_by_it_and_later_ones_do_not() {
        let geometry = GridGeometry { resolution_m: 0.5, origin: [10, -4], n_rows: 3, n_cols: 3 };
        let map = RiskMap::constant(geometry, 4, Risk::NONE);
        let chart = Chart { map: map.view(), time_to_goal: CostToGoView { geometry, seconds: &[0.0; 9] } };
        let mut frame = Frame::default();
        frame.note(100, &Jump { step_m: [3.1, -1.4, 0.2] });
        frame.note(200, &Jump { step_m: [-0.5, 0.0, 0.0] });
        let origin = |of_ns: u64| {
            let placed = frame.place(chart, of_ns);
            assert_eq!(placed.map.geometry, placed.time_to_goal.geometry);
            placed.map.geometry.origin
        };
        // 3.1 m are 6 cells of 0.5 m, 1.4 m are 3.
        assert_eq!(origin(99), [15, -7], "before both");
        assert_eq!(origin(100), [9, -4], "in the frame of the first");
        assert_eq!(origin(200), [10, -4], "in the frame of now");
    }

    #[test]
    fn a_jump_beyond_all_lattices_does_not_wrap() {
        let geometry = GridGeometry { resolution_m: 1e-3, origin: [i64::MAX - 1, 0], n_rows: 1, n_cols: 1 };
        let map = RiskMap::constant(geometry, 1, Risk::NONE);
        let chart = Chart { map: map.view(), time_to_goal: CostToGoView { geometry, seconds: &[0.0] } };
        let mut frame = Frame::default();
        frame.note(1, &Jump { step_m: [1e300, 0.0, 0.0] });
        assert_eq!(frame.place(chart, 0).map.geometry.origin, [i64::MAX, 0]);
    }
}
