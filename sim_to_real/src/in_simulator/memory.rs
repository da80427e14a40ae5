//! Runs that were made once are not made again.

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};

use super::types::{Motion, SimulatorRun};

/// The motions of runs that a simulator has made.
#[derive(Clone, Debug, Default)]
pub struct RunMemory(HashMap<u64, Motion>);

impl RunMemory {
    /// The motion of every run in their order; `make` is asked for those that are not known, each once, and answers in their
    /// order.
    ///
    /// # Errors
    /// Those of `make`.
    pub fn recall<E>(
        &mut self,
        runs: &[SimulatorRun],
        make: impl FnOnce(&[&SimulatorRun]) -> Result<Vec<Motion>, E>,
    ) -> Result<Vec<Motion>, E> {
        let keys: Vec<u64> = runs.iter().map(key).collect();
        let is_first = |run: usize| !keys[..run].contains(&keys[run]);
        let missing: Vec<usize> =
            (0..runs.len()).filter(|&run| is_first(run) && !self.0.contains_key(&keys[run])).collect();
        let made = make(&missing.iter().map(|&run| &runs[run]).collect::<Vec<_>>())?;
        self.0.extend(missing.iter().map(|&run| keys[run]).zip(made));
        Ok(keys.iter().filter_map(|key| self.0.get(key).cloned()).collect())
    }
}

/// Numbers as they are told differ when they do.
fn key(run: &SimulatorRun) -> u64 {
    let mut hasher = DefaultHasher::new();
    format!("{run:?}").hash(&mut hasher);
    hasher.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::in_simulator::StartState;

    fn run(seed: u64) -> SimulatorRun {
        let start = StartState { x_m: 0.0, y_m: 0.0, yaw_rad: 0.0, speed_mps: 0.0, yaw_rate_radps: 0.0 };
        SimulatorRun {
            start,
            step_s: 0.02,
            command_speed_mps: vec![1.0],
            command_steering_rad: vec![0.0],
            slope_ahead: vec![0.0],
            slope_left: vec![0.0],
            terrain_class: vec![0],
            seed,
            knobs: [].into(),
        }
    }

    fn motion(run: &SimulatorRun) -> Motion {
        let values = vec![run.seed as f64];
        Motion {
            x_m: values.clone(),
            y_m: values.clone(),
            yaw_rad: values.clone(),
            speed_mps: values.clone(),
            yaw_rate_radps: values,
            side_speed_mps: None,
        }
    }

    #[test]
    fn every_run_is_made_once_and_answered_in_its_place() {
        let mut memory = RunMemory::default();
        let mut n_made = 0;
        for seeds in [&[3, 1, 3][..], &[1, 2, 3]] {
            let runs: Vec<SimulatorRun> = seeds.iter().map(|seed| run(*seed)).collect();
            let motions = memory.recall::<()>(&runs, |missing| {
                n_made += missing.len();
                Ok(missing.iter().map(|run| motion(run)).collect())
            });
            let found: Vec<f64> = motions.unwrap().iter().map(|motion| motion.x_m[0]).collect();
            assert_eq!(found, seeds.iter().map(|seed| *seed as f64).collect::<Vec<_>>());
        }
        assert_eq!(n_made, 3);
    }
}
