//! `surefoot bench route-speed`: what a route takes, as text and JSON.

use ::bench::Spread;
use ::bench::route::timing::{FarTiming, Timing, TimingError, measure_far, measure_timing};
use anyhow::Context as _;
use serde::Serialize;

use crate::UsageError;
use crate::arguments::BenchRouteSpeedArguments;
use crate::output::WithRevision;

#[derive(Serialize)]
struct Results {
    timing: Timing,
    far: Option<FarTiming>,
    /// Most memory that the process has taken, after the map in tiles [bytes].
    peak_bytes: Option<u64>,
}

pub(crate) fn run_route_speed(arguments: &BenchRouteSpeedArguments) -> anyhow::Result<()> {
    let vehicle = formats::read_vehicle(&arguments.vehicle).map_err(UsageError::from_input)?;
    let results = &arguments.results;
    results.prepare()?;
    // First, so that its peak is not that of the search on one grid.
    let far = match arguments.far_km {
        0 => None,
        side_km => {
            let folder = tempfile::tempdir_in(&results.out).context("a folder for tiles")?;
            let cell_m = f64::from(arguments.far_cell_cm) / 100.0;
            Some(measure_far(&vehicle, folder.path(), 1e3 * f64::from(side_km), cell_m)?)
        }
    };
    let peak_bytes = far.as_ref().and_then(|_| peak_bytes());
    let timing = measure_timing(&vehicle, arguments.seed, arguments.tasks as usize).map_err(told)?;
    let found = Results { timing, far, peak_bytes };
    print!("{}", text(&found));
    results.write_json("route_speed.json", &WithRevision::of(&found))?;
    println!("  route_speed.json in {}", results.out.display());
    Ok(())
}

/// The most memory that this process has had, as Linux counts it.
fn peak_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kilobytes| 1024 * kilobytes)
}

fn text(Results { timing, far, peak_bytes }: &Results) -> String {
    let spread = |Spread { min, median, p99 }: &Spread| {
        format!("{min:>9.1} ms at least, {median:>9.1} in the middle, {p99:>9.1} for 99 %")
    };
    let [middle, most] = timing.n_expanded;
    let mut text = format!(
        "  island of {} cells, {} tasks with a route\n  search          {}, {:.1} at most\n  \
         expanded        {middle} states in the middle, {most} at most\n  whole route     {}\n  \
         500 checkpoints {}\n  change          {}\n  and on          {}\n",
        timing.n_cells,
        timing.n_tasks,
        spread(&timing.search_ms),
        timing.search_most_ms,
        spread(&timing.route_ms),
        spread(&timing.profile_ms),
        spread(&timing.change_ms),
        spread(&timing.again_ms),
    );
    if let Some(far) = far {
        let FarTiming { side_m, cell_m, length_m, duration_s, written_s, first_s, again_s, n_expanded } = far;
        text += &format!(
            "  {side_m:.0} m in tiles of {cell_m} m: written in {written_s:.1} s; a route of {length_m:.0} m \
             ({duration_s:.0} s to drive) in {again_s:.1} s, {first_s:.1} s the first time; {n_expanded} states\n"
        );
    }
    if let Some(bytes) = peak_bytes {
        text += &format!("  most memory     {:.0} MB\n", *bytes as f64 / 1e6);
    }
    text
}

/// More tasks than the island has, or a vehicle for which there is no way, is the user's choice.
fn told(error: TimingError) -> anyhow::Error {
    match error {
        TimingError::Landscape(_) | TimingError::Planner(_) => UsageError::from_input(error).into(),
        other => other.into(),
    }
}
