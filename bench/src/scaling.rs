//! How the cost of one controller update and of one learned risk map grows with each of the things that it depends on.
//!
//! One thing is varied at a time; all others are those of [`crate::control`] and [`crate::learned_map`].

mod controller;
mod map;

use bicycle::lanes::{Instructions, Isa};
use serde::Serialize;

use crate::{BenchError, Spread};

/// What is varied.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Over {
    /// Sampled futures of a controller update.
    Rollouts,
    /// Steps of the horizon of a controller update.
    Steps,
    /// Threads that share a controller update.
    ControllerThreads,
    /// Cells of a whole map.
    Cells,
    /// Yaw bins of a whole map.
    Yaws,
    /// Share of the cells that changed in one square block since the last update of a map.
    ChangedBlock,
    /// Share of the cells that changed here and there since the last update of a map.
    ChangedScattered,
    /// Threads that share a whole map.
    MapThreads,
}

impl Over {
    /// All, those of the controller first.
    pub const ALL: [Self; 8] = [
        Self::Rollouts,
        Self::Steps,
        Self::ControllerThreads,
        Self::Cells,
        Self::Yaws,
        Self::ChangedBlock,
        Self::ChangedScattered,
        Self::MapThreads,
    ];

    /// Name in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Rollouts => "rollouts",
            Self::Steps => "steps",
            Self::ControllerThreads => "controller_threads",
            Self::Cells => "cells",
            Self::Yaws => "yaws",
            Self::ChangedBlock => "changed_block",
            Self::ChangedScattered => "changed_scattered",
            Self::MapThreads => "map_threads",
        }
    }
}

/// How to measure.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// What to vary, one after the other.
    pub over: Vec<Over>,
    /// Threads that share the work; where these are varied, the most.
    pub n_threads: usize,
    /// Controller updates to measure at every place.
    pub n_updates: usize,
    /// Maps to make at every place.
    pub n_maps: usize,
    /// Instruction set.
    pub isa: Isa,
}

/// What was measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Instruction set that was used.
    pub isa: Isa,
    /// Threads that shared the work; where these were varied, the most.
    pub threads: usize,
    /// Controller updates measured at every place.
    pub updates: usize,
    /// Maps made at every place.
    pub maps: usize,
    /// One for each thing that was varied, in the order asked for.
    pub curves: Vec<Curve>,
}

/// Cost over one thing.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Curve {
    /// What was varied.
    pub over: Over,
    /// From the least value to the largest.
    pub points: Vec<Point>,
}

/// Cost at one place of a curve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Point {
    /// What was varied: a number, or a share from 0 to 1.
    pub value: f64,
    /// Share of the poses that the map judged anew, mean; of a controller, none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub judged_share: Option<f64>,
    /// Times of an update or a map [ms].
    pub ms: Spread,
}

/// Varies one thing after the other.
///
/// # Errors
/// Nothing asked for, or an instruction set or threads that are not to be had.
pub fn measure(request: &Request) -> Result<Report, BenchError> {
    if request.n_updates == 0 || request.n_maps == 0 || request.over.is_empty() {
        return Err(BenchError::NoUpdates);
    }
    let instructions = Instructions::find(request.isa).map_err(mppi::ConfigError::from)?;
    let curve = |&over: &Over| {
        let points = match over {
            Over::Rollouts | Over::Steps | Over::ControllerThreads => controller::points(over, request)?,
            _ => map::points(over, request, instructions)?,
        };
        Ok(Curve { over, points })
    };
    Ok(Report {
        isa: instructions.isa(),
        threads: request.n_threads,
        updates: request.n_updates,
        maps: request.n_maps,
        curves: request.over.iter().map(curve).collect::<Result<_, BenchError>>()?,
    })
}

/// One, powers of two below the most, the most.
fn thread_counts(most: usize) -> Vec<usize> {
    let below = std::iter::successors(Some(1), |n| Some(2 * n)).take_while(|n| *n < most);
    below.chain([most]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_thing_is_varied_from_little_to_much() {
        let request =
            Request { over: Over::ALL.to_vec(), n_threads: 1, n_updates: 1, n_maps: 1, isa: Isa::Auto };
        let report = measure(&request).unwrap();
        assert_eq!(report.curves.iter().map(|curve| curve.over).collect::<Vec<_>>(), Over::ALL);
        for Curve { over, points } in &report.curves {
            assert!(points.windows(2).all(|pair| pair[0].value < pair[1].value), "{over:?}");
            assert!(
                points.iter().all(|point| point.ms.min > 0.0 && point.ms.min <= point.ms.p99),
                "{over:?}"
            );
            assert_eq!(serde_json::to_value(over).unwrap(), over.name());
        }
        let shares = |over: Over| -> Vec<[f64; 2]> {
            let points = &report.curves.iter().find(|curve| curve.over == over).unwrap().points;
            points.iter().map(|point| [point.value, point.judged_share.unwrap()]).collect()
        };
        for [_, judged] in shares(Over::Cells).into_iter().chain(shares(Over::Yaws)) {
            assert_eq!(judged, 1.0, "a whole map");
        }
        for over in [Over::ChangedBlock, Over::ChangedScattered] {
            let shares = shares(over);
            assert_eq!(shares.first(), Some(&[0.0, 0.0]));
            assert_eq!(shares.last(), Some(&[1.0, 1.0]));
            assert!(shares.iter().all(|[changed, judged]| judged >= changed), "{shares:?}");
        }
        // 2 % of the cells in one block are felt by few poses, and here and there by most.
        let at = |over: Over| shares(over).into_iter().find(|[changed, _]| *changed == 0.02).unwrap()[1];
        assert!(at(Over::ChangedBlock) < 0.15 && at(Over::ChangedScattered) > 0.3);
    }

    #[test]
    fn nothing_to_measure_is_refused() {
        let request =
            Request { over: vec![Over::Steps], n_threads: 1, n_updates: 1, n_maps: 1, isa: Isa::Auto };
        for none in [
            Request { n_updates: 0, ..request.clone() },
            Request { n_maps: 0, ..request.clone() },
            Request { over: Vec::new(), ..request.clone() },
        ] {
            assert!(matches!(measure(&none), Err(BenchError::NoUpdates)));
        }
    }

    #[test]
    fn threads_double_up_to_the_most() {
        assert_eq!(thread_counts(1), [1]);
        assert_eq!(thread_counts(4), [1, 2, 4]);
        assert_eq!(thread_counts(6), [1, 2, 4, 6]);
    }
}
