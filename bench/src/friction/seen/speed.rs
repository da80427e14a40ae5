//! How long it takes to see friction.

use friction::{Network, TrainingError};
use scenarios::{Looks, PaintedConfig, painted_world};
use serde::Serialize;

use super::FrictionBenchError;
use super::drives::view;
use crate::stopwatch::timed_ms;

const SIDE_M: f64 = 200.0;
const PIXEL_M: f64 = 0.2;
/// Side of the part, in pixels: 40 m.
const PART: usize = 200;

/// Wall-clock times, the median of three [s].
#[derive(Clone, Copy, Debug, Serialize)]
pub struct SeeingTimes {
    /// Of 200 x 200 m in pixels of 0.2 m.
    pub whole_s: f64,
    /// Of 40 x 40 m of it.
    pub part_s: f64,
}

/// What a network has learned does not change how long it takes.
pub(super) fn measure() -> Result<SeeingTimes, FrictionBenchError> {
    let config = PaintedConfig { seed: 1, looks: Looks::Known, side_m: SIDE_M, cell_m: PIXEL_M };
    let view = view(&painted_world(&config)?);
    let network = Network::new(PIXEL_M, 1).map_err(TrainingError::from)?;
    let timed = |see: &dyn Fn() -> Result<usize, friction::NetworkError>| {
        let mut times_s = [0.0; 3];
        for time_s in &mut times_s {
            let (time_ms, seen) = timed_ms(see);
            seen.map_err(TrainingError::from)?;
            *time_s = 1e-3 * time_ms;
        }
        times_s.sort_by(f64::total_cmp);
        Ok::<_, FrictionBenchError>(times_s[1])
    };
    Ok(SeeingTimes {
        whole_s: timed(&|| network.see(&view).map(|seen| seen.len()))?,
        part_s: timed(&|| network.see_part(&view, [2 * PART; 2], [PART; 2]).map(|seen| seen.len()))?,
    })
}
