//! The report as text.

use bench::kinodynamics::{DataPoint, Report, Row, RowReport, Teacher, TrackReport, TrainingReport};

use crate::verdict;

/// What the paper's tables and its published counts give: success outdoors and indoors [%].
pub(super) fn published(row: Row) -> [Option<f64>; 2] {
    match row {
        Row::Baseline => [Some(52.4), Some(49.5)],
        Row::Ablation => [Some(82.9), None],
        Row::Learned => [Some(86.9), Some(87.0)],
        _ => [None, None],
    }
}

/// Everything.
pub fn text(report: &Report) -> String {
    let mut told = format!(
        "  {} minutes of random driving, latency {:.3} s, dead time {:.3} s; examples from {:.3} s on{}; walls {} m from the nominal line; {} laps at every speed\n  the ground \
         is named rightly in {:.2} of the cases from the unit, {:.2} from speed and curvature, {:.2} by chance\n\n",
        report.minutes,
        report.latency.seconds,
        report.latency.dead_time_s,
        report.labels.latency_s,
        match report.teacher {
            Teacher::Examples => "",
            Teacher::ForwardModel => ", learned through a forward model",
        },
        report.half_width_m,
        report.laps,
        report.probe.from_imu,
        report.probe.from_wish,
        report.probe.chance
    );
    told += "  driven over commanded curvature   1.2 to 1.8 m/s   2.0 to 2.6 m/s\n";
    for ground in &report.grounds {
        let [slow, fast] = ground
            .driven_over_commanded
            .map(|ratio| ratio.map_or("-".to_owned(), |ratio| format!("{ratio:.3}")));
        told += &format!("  {:<32}{slow:>16}{fast:>17}\n", ground.name);
    }
    told.push('\n');
    if let Some(spread) = report.answer_us {
        told += &format!(
            "  one answer of the learned model takes {:.0} us (median; least {:.0}, 99th percentile {:.0})\n\n",
            spread.median, spread.min, spread.p99
        );
    }
    told += "  training                 examples   curvature off by [1/m]   the wish itself\n";
    told.extend(report.trainings.iter().map(training));
    for (place, track) in [&report.outdoor, &report.indoor].into_iter().enumerate() {
        told += &format!("\n  {:<24} success   95 % interval    failures   paper\n", track.track);
        told.extend(track.rows.iter().map(|found| row(found, place)));
        told += &per_speed(track);
    }
    if let Some(ratio) = report.oracle_over_ablation {
        told +=
            &format!("\n  outdoors who is told the ground fails {ratio} times as often as the ablation\n");
    }
    told += &format!("\n{}", verdict::text(&report.verdicts));
    told
}

/// Errors over minutes of own data.
pub fn data_curve_text(points: &[DataPoint]) -> String {
    let mut told = format!(
        "  {:>8}  {:<12}{:>24}{:>18}{:>10}\n",
        "minutes", "model", "command off by [1/m]", "the wish itself", "examples"
    );
    for point in points {
        told += &format!(
            "  {:>8}  {:<12}{:>24.4}{:>18.4}{:>10}\n",
            point.minutes,
            point.row.name(),
            point.rmse_per_m,
            point.identity_rmse_per_m,
            point.n
        );
    }
    told
}

fn training(training: &TrainingReport) -> String {
    format!(
        "  {:<24}{:>9}{:>25.4}{:>18.4}\n",
        training.row.name(),
        training.n_examples[0],
        training.validation_rmse_per_m,
        training.identity_rmse_per_m
    )
}

fn row(found: &RowReport, place: usize) -> String {
    let [low, high] = found.success_interval.map(|share| 100.0 * share);
    let paper = published(found.row)[place].map_or(String::new(), |percent| format!("{percent:.1} %"));
    format!(
        "  {:<24}{:>6.1} %{low:>9.1} to {high:<5.1}{:>6} of {:<5}{paper:>7}\n",
        found.row.name(),
        100.0 * found.success,
        found.failures,
        found.n
    )
}

fn per_speed(track: &TrackReport) -> String {
    let mut told = format!("\n  {:<24}", "failed turns [%] at m/s");
    told.extend(track.speeds_mps.iter().map(|speed_mps| format!("{speed_mps:>6.1}")));
    told.push('\n');
    for row in &track.rows {
        told += &format!("  {:<24}", row.row.name());
        told.extend(row.failed_per_speed.iter().map(|share| format!("{:>6.1}", 100.0 * share)));
        told.push('\n');
    }
    told += &format!("  {:<24}", "failed turns [%] at turn");
    told.extend(
        (1..=track.rows.first().map_or(0, |row| row.failed_per_turn.len())).map(|turn| format!("{turn:>6}")),
    );
    told.push('\n');
    for row in &track.rows {
        told += &format!("  {:<24}", row.row.name());
        told.extend(row.failed_per_turn.iter().map(|share| format!("{:>6.1}", 100.0 * share)));
        told.push('\n');
    }
    told
}
