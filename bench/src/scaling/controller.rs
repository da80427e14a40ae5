//! The controller of the default drive with more or less to do.

use mppi::Config;

use super::{Over, Point, Request, thread_counts};
use crate::BenchError;
use crate::control::{Work, config, measure_config};

const ROLLOUTS: [usize; 6] = [128, 256, 512, 1024, 2048, 4096];
const STEPS: [usize; 6] = [10, 25, 50, 75, 100, 150];

pub(super) fn points(over: Over, request: &Request) -> Result<Vec<Point>, BenchError> {
    let drive = config(Work::Drive, request.n_threads, request.isa);
    let configs: Vec<(usize, Config)> = match over {
        Over::Rollouts => ROLLOUTS.map(|n| (n, Config { n_rollouts: n, ..drive.clone() })).to_vec(),
        Over::Steps => STEPS.map(|n| (n, Config { n_steps: n, ..drive.clone() })).to_vec(),
        _ => {
            let counts = thread_counts(request.n_threads).into_iter();
            counts.map(|n| (n, Config { n_threads: n, ..drive.clone() })).collect()
        }
    };
    let point = |(value, config): (usize, Config)| {
        let ms = measure_config(config, Work::Drive, request.n_updates)?.ms;
        Ok(Point { value: value as f64, judged_share: None, ms })
    };
    configs.into_iter().map(point).collect()
}
