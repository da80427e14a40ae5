//! What is remembered of a drive: bounded, the newest of every place, and split so that no footprint that networks are
//! judged on overlaps one that they learn from.

use std::collections::BTreeMap;

use bicycle::Geometry;
use evidential::Example;

/// Examples to learn from.
const LEARNED_MAX: usize = 2048;
/// Examples to judge by.
const HELD_OUT_MAX: usize = 1024;
/// Lengths of way, in lengths of the vehicle, that are learned from and held out in turns.
const TURNS: [f64; 2] = [3.0, 2.0];
/// Places are this share of the vehicle's length wide and long.
const PLACE: f64 = 0.05;
/// Headings of a place.
const N_YAWS: f64 = 16.0;

/// What an example is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// To learn from.
    Learned,
    /// To judge by; never learned from.
    HeldOut,
}

/// The examples of a drive.
#[derive(Clone, Debug)]
pub struct Memory {
    learned: Ring,
    held_out: Ring,
    length_m: f64,
    /// From the rear axle's centre to the middle of the body [m].
    middle_m: f64,
    /// Footprints whose middles are farther apart than this do not overlap [m].
    apart_m: f64,
    way_m: f64,
    last_m: Option<[f64; 2]>,
}

/// The newest examples, one for each place.
#[derive(Clone, Debug)]
struct Ring {
    n_max: usize,
    n_taken: u64,
    by_place: BTreeMap<[i64; 3], u64>,
    examples: BTreeMap<u64, ([i64; 3], Example)>,
}

impl Memory {
    /// Bytes that an example takes: features, prior, measurements, places and what trees need.
    pub const EXAMPLE_BYTES: usize = 1100;
    /// Most examples that are kept.
    pub const N_MAX: usize = LEARNED_MAX + HELD_OUT_MAX;

    /// Nothing, of a vehicle of this geometry.
    pub fn new(geometry: &Geometry) -> Self {
        Self {
            learned: Ring::new(LEARNED_MAX),
            held_out: Ring::new(HELD_OUT_MAX),
            length_m: geometry.length_m,
            middle_m: 0.5 * geometry.length_m - geometry.rear_overhang_m,
            apart_m: geometry.length_m.hypot(geometry.width_m),
            way_m: 0.0,
            last_m: None,
        }
    }

    /// Takes in an example, whose pose is in a frame that does not jump, and says what it is for; `None` when its
    /// footprint overlaps one of the other part. Its drive becomes the turn of the way that it lies on.
    pub fn take(&mut self, mut example: Example) -> Option<Part> {
        let [x_m, y_m, yaw_rad] = example.pose;
        let at_m = [x_m + self.middle_m * yaw_rad.cos(), y_m + self.middle_m * yaw_rad.sin()];
        // A step longer than the vehicle is a gap in what was measured, and no way.
        let step_m = self.last_m.map_or(0.0, |last_m| distance_m(last_m, at_m));
        self.way_m += if step_m > self.length_m { 0.0 } else { step_m };
        self.last_m = Some(at_m);
        let (turn, part) = self.turn();
        example.drive = turn;
        let (own, other) = match part {
            Part::Learned => (&mut self.learned, &self.held_out),
            Part::HeldOut => (&mut self.held_out, &self.learned),
        };
        let middle_m = self.middle_m;
        let is_near = |other: &Example| {
            let [x_m, y_m, yaw_rad] = other.pose;
            let there_m = [x_m + middle_m * yaw_rad.cos(), y_m + middle_m * yaw_rad.sin()];
            distance_m(there_m, at_m) <= self.apart_m
        };
        if other.examples.values().any(|(_, other)| is_near(other)) {
            return None;
        }
        let edge_m = PLACE * self.length_m;
        let heading = (yaw_rad.rem_euclid(std::f64::consts::TAU) / std::f64::consts::TAU * N_YAWS) as i64;
        own.put([(x_m / edge_m).floor() as i64, (y_m / edge_m).floor() as i64, heading], example);
        Some(part)
    }

    /// Examples of a part, the oldest first.
    pub fn examples(&self, part: Part) -> Vec<Example> {
        let ring = self.ring(part);
        ring.examples.values().map(|(_, example)| example.clone()).collect()
    }

    /// Number of examples of a part.
    pub fn n(&self, part: Part) -> usize {
        self.ring(part).examples.len()
    }

    /// Number of turns of the way that a part's examples lie on.
    pub fn n_turns(&self, part: Part) -> usize {
        let mut turns: Vec<u32> =
            self.ring(part).examples.values().map(|(_, example)| example.drive).collect();
        turns.sort_unstable();
        turns.dedup();
        turns.len()
    }

    fn ring(&self, part: Part) -> &Ring {
        match part {
            Part::Learned => &self.learned,
            Part::HeldOut => &self.held_out,
        }
    }

    /// Which turn the way has come to, and what it is for.
    fn turn(&self) -> (u32, Part) {
        let lengths = self.way_m / self.length_m;
        let period = TURNS[0] + TURNS[1];
        let part = if lengths % period < TURNS[0] { Part::Learned } else { Part::HeldOut };
        let turn = 2.0 * (lengths / period).floor() + f64::from(u8::from(part == Part::HeldOut));
        (turn as u32, part)
    }
}

impl Ring {
    fn new(n_max: usize) -> Self {
        Self { n_max, n_taken: 0, by_place: BTreeMap::new(), examples: BTreeMap::new() }
    }

    /// Replaces what is known of the place; of too many places, the one that was seen longest ago goes.
    fn put(&mut self, place: [i64; 3], example: Example) {
        if let Some(before) = self.by_place.insert(place, self.n_taken) {
            self.examples.remove(&before);
        }
        self.examples.insert(self.n_taken, (place, example));
        self.n_taken += 1;
        if self.examples.len() > self.n_max
            && let Some((_, (place, _))) = self.examples.pop_first()
        {
            self.by_place.remove(&place);
        }
    }
}

fn distance_m(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn geometry() -> Geometry {
        formats::read_vehicle("pietra_full_size").unwrap().geometry
    }

    fn at(x_m: f64, y_m: f64) -> Example {
        Example {
            features: vec![0.0; 144],
            measured: [0.5; 4],
            prior: [[1.0 / 12.0; 12]; 4],
            unevenness_m: 0.0,
            drive: 0,
            pose: [x_m, y_m, 0.0],
        }
    }

    #[test]
    fn nothing_held_out_overlaps_what_is_learned_even_where_the_way_comes_back() {
        let mut memory = Memory::new(&geometry());
        // Out and back, a little beside, with other turns.
        let out = (0..300).map(|k| [0.2 * f64::from(k), 0.0]);
        let back = (0..300).map(|k| [60.0 - 0.2 * f64::from(k), 0.5]);
        let parts: Vec<_> = out.chain(back).map(|[x_m, y_m]| memory.take(at(x_m, y_m))).collect();
        let [learned, held_out] = [Part::Learned, Part::HeldOut].map(|part| memory.examples(part));
        assert!(learned.len() > 100 && held_out.len() > 30, "{} {}", learned.len(), held_out.len());
        assert!(parts.contains(&None));
        let diagonal_m = geometry().length_m.hypot(geometry().width_m);
        for (a, b) in learned.iter().flat_map(|a| held_out.iter().map(move |b| (a, b))) {
            assert!(distance_m([a.pose[0], a.pose[1]], [b.pose[0], b.pose[1]]) > diagonal_m);
        }
        assert!(memory.n_turns(Part::HeldOut) >= 3);
    }

    #[test]
    fn memory_is_bounded_and_the_newest_of_a_place_counts() {
        let mut memory = Memory::new(&geometry());
        for k in 0..20_000 {
            memory.take(at(0.2 * f64::from(k), 0.0));
        }
        assert_eq!((memory.n(Part::Learned), memory.n(Part::HeldOut)), (LEARNED_MAX, HELD_OUT_MAX));
        let ring = &memory.learned;
        assert_eq!(ring.by_place.len(), ring.examples.len());
        let n = memory.n(Part::Learned) + memory.n(Part::HeldOut);
        for k in 0..1000 {
            let measured = [k as f32, 0.0, 0.0, 0.0];
            memory.take(Example { measured, ..at(4000.0, 0.0) });
        }
        assert!(
            memory.n(Part::Learned) + memory.n(Part::HeldOut) <= n,
            "a vehicle that stands says one thing"
        );
        let all = [Part::Learned, Part::HeldOut].map(|part| memory.examples(part)).concat();
        let there: Vec<f32> = all.iter().filter(|e| e.pose[0] == 4000.0).map(|e| e.measured[0]).collect();
        assert!(there.is_empty() || there == [999.0], "{there:?}");
    }
}
