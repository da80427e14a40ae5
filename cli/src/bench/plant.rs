//! `surefoot bench plant`: what was measured as text, JSON and picture.

use ::bench::plant::{COLLECTION_MPS, Labels, Published, Report, measure};
use serde::Serialize;

use crate::arguments::BenchPlantArguments;
use crate::picture::draw_plant;
use crate::{UsageError, output, summary};

/// Room that must be free beforehand: JSON and picture take less [bytes].
const ROOM_BYTES: u64 = 4 << 20;

/// The content of `plant.json`.
#[derive(Serialize)]
struct Written<'a> {
    revision: &'static str,
    #[serde(flatten)]
    report: &'a Report,
}

pub(crate) fn run_plant(arguments: &BenchPlantArguments) -> anyhow::Result<()> {
    let vehicle = formats::read_vehicle(&arguments.vehicle).map_err(UsageError::from_input)?;
    formats::prepare_out_dir(&arguments.out, ROOM_BYTES)
        .map_err(|error| UsageError(format!("--out: {}", UsageError::from_input(error))))?;
    arguments.json.as_deref().map_or(Ok(()), output::prepare_json)?;
    let report = measure(&vehicle)?;
    print!("{}", told(&report));
    write(&report, arguments)
}

fn write(report: &Report, arguments: &BenchPlantArguments) -> anyhow::Result<()> {
    let written = Written { revision: summary::revision(), report };
    let file = |name: &str| arguments.out.join(name);
    for path in [Some(file("plant.json")), arguments.json.clone()].iter().flatten() {
        formats::write_json_atomic(path, &written)?;
    }
    draw_plant(report, &file("plant.png"))?;
    println!("\n  plant.json and plant.png in {}", arguments.out.display());
    Ok(())
}

fn told(report: &Report) -> String {
    let stiffness = report
        .cornering
        .get(1)
        .map_or([0.0; 3], |row| row.plant.map(|friction| friction / row.angle_deg.to_radians().tan()));
    let mut told = format!(
        "  {}\n  cornering force over load and slip at 0.5 degrees: {:.2}, {:.2}, {:.2} at 1, 5, 15 m/s\n",
        report.vehicle, stiffness[0], stiffness[1], stiffness[2]
    );
    told += &format!(
        "  largest distance to the published tyre, friction over load: {:.3} across, {:.3} along\n\n",
        farthest(&report.published_across),
        farthest(&report.published_along)
    );
    told += &format!("  {:<18}", "linear traction at");
    told.extend(COLLECTION_MPS.map(|speed_mps| format!("{speed_mps:>8} m/s")));
    told.push('\n');
    told.extend(report.labels.iter().map(told_labels));
    told + &format!("\n  {:.0} times real time on one core, over rocks\n", report.times_real_time)
}

fn told_labels(labels: &Labels) -> String {
    let numbers: String = labels.traction.iter().map(|traction| format!("{traction:>12.4}")).collect();
    format!("  {:<18}{numbers}\n", labels.ground)
}

fn farthest(rows: &[Published]) -> f64 {
    rows.iter().map(|row| (row.plant - row.published).abs()).fold(0.0, f64::max)
}
