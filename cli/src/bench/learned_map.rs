//! `surefoot bench learned-map`: sizes and points handed to the benchmark, one report of both.

use ::bench::learned_map::{Report, Request, ScanDrive, ScanDriveReport, measure, measure_scan_drive};
use serde::Serialize;

use super::{show, told};
use crate::UsageError;
use crate::arguments::BenchLearnedMapArguments;

/// Scans along the way past what the real one has seen.
const N_SCANS: usize = 60;

/// What is printed and written.
#[derive(Serialize)]
struct Written {
    #[serde(flatten)]
    maps: Report,
    #[serde(skip_serializing_if = "Option::is_none")]
    scan: Option<ScanDriveReport>,
}

pub(crate) fn run_learned_map(arguments: &BenchLearnedMapArguments) -> anyhow::Result<()> {
    arguments.copy.prepare()?;
    let points = arguments.scan.as_deref().map(formats::read_scan_points).transpose();
    let points_m = points.map_err(UsageError::from_input)?;
    let (n_threads, isa) = (arguments.kernels.threads.count(), arguments.kernels.isa.into());
    let sizes: Vec<_> = arguments.networks.iter().map(|network| network.0.clone()).collect();
    let scan = match (points_m, sizes.last().cloned()) {
        (Some(points_m), Some(sizes)) => {
            let drive = ScanDrive { points_m, n_scans: N_SCANS, n_threads, sizes, isa };
            Some(measure_scan_drive(&drive).map_err(told)?)
        }
        _ => None,
    };
    let maps = measure(&Request { n_threads, n_updates: arguments.updates, sizes, isa }).map_err(told)?;
    show(&Written { maps, scan }, &arguments.copy)
}
