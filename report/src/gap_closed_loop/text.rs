//! The closed-loop table for a terminal.

use bench::gap_closed_loop::{Belief, DriveResult, Found, Report, Row};
use bench::statistics::Mean;
use sim_to_real::Verdict;
use std::collections::BTreeMap;

/// A drive in a line.
pub fn drive_text(drive: &DriveResult) -> String {
    let job = &drive.job;
    let (ground, gap, belief) = (job.ground.name(), job.gap.name(), job.belief.name());
    format!("{ground}, {gap}, {belief}, seed {}: {:?} after {:.1} s", job.seed, drive.end, drive.time_s)
}

/// What was found in the recorded drives, and the table.
pub fn text(report: &Report) -> String {
    let mut told = String::from("  found in the recorded drives\n");
    told.extend(report.diagnoses.chunk_by(|a, b| a.gap == b.gap).map(found_text));
    told += &format!(
        "\n  {:<7}{:<14}{:<10}{:>8}  {:<22}{:<22}{:<22}{:<22}\n",
        "", "gap", "model", "goal", "time [s]", "off course RMS [m]", "speed RMS [m/s]", "plan RMS [m]"
    );
    told.extend(report.rows.iter().map(row_text));
    told += &format!(
        "\n  less those of the nominal model's drives, seed by seed\n  {:<7}{:<14}{:<10}{:<24}{:<24}{:<24}\n",
        "", "gap", "model", "off course RMS [m]", "speed RMS [m/s]", "plan RMS [m]"
    );
    let others = report.rows.iter().filter(|row| row.belief > Belief::Nominal);
    told.extend(others.map(difference_text));
    told
}

/// What the diagnoses of one gap announce, and how often.
fn found_text(found: &[Found]) -> String {
    let names = |found: &Found| {
        let mut ids: Vec<&str> = found.found.iter().map(|effect| effect.description().id).collect();
        ids.sort_unstable();
        match found.verdict {
            Verdict::None => "nothing".to_owned(),
            Verdict::Unknown => "unknown".to_owned(),
            Verdict::Effects | Verdict::EffectsAndUnknown => ids.join(" + "),
        }
    };
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    found.iter().for_each(|found| *counts.entry(names(found)).or_default() += 1);
    let counts: Vec<String> = counts.iter().map(|(names, n)| format!("{names} ({n})")).collect();
    let truth = found[0].truth.as_ref().map_or("nothing".to_owned(), effect_text);
    format!("    {:<14} {}; true: {truth}\n", found[0].gap.name(), counts.join(", "))
}

fn difference_text(row: &Row) -> String {
    let Row { ground, gap, belief, less_nominal, .. } = row;
    let mean = |mean: Option<Mean>| {
        mean.map_or("-".to_owned(), |mean| {
            format!("{:+.3} [{:+.3}, {:+.3}]", mean.value, mean.low, mean.high)
        })
    };
    format!(
        "  {:<7}{:<14}{:<10}{:<24}{:<24}{:<24}\n",
        ground.name(),
        gap.name(),
        belief.name(),
        mean(less_nominal.across_rms_m),
        mean(less_nominal.speed_rms_mps),
        mean(less_nominal.plan_rms_m)
    )
}

/// Id and parameters.
fn effect_text(effect: &bicycle::Effect) -> String {
    let description = effect.description();
    let numbers = description.parameters.iter().zip(effect.values());
    let numbers: Vec<String> =
        numbers.map(|(parameter, value)| format!("{} {value:.3}", parameter.name)).collect();
    format!("{} ({})", description.id, numbers.join(", "))
}

fn row_text(row: &Row) -> String {
    let mean = |mean: Option<Mean>| {
        mean.map_or("-".to_owned(), |mean| format!("{:.2} [{:.2}, {:.2}]", mean.value, mean.low, mean.high))
    };
    format!(
        "  {:<7}{:<14}{:<10}{:>8}  {:<22}{:<22}{:<22}{:<22}\n",
        row.ground.name(),
        row.gap.name(),
        row.belief.name(),
        format!("{} of {}", row.n_goal, row.n),
        mean(row.time_s),
        mean(row.across_rms_m),
        mean(row.speed_rms_mps),
        mean(row.plan_rms_m)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use bench::gap_closed_loop::{Differences, Gap, Ground};

    #[test]
    fn a_row_tells_counts_and_intervals_and_leaves_out_what_there_is_not() {
        let mean = Some(Mean { value: 0.284, low: 0.2, high: 0.3333 });
        let nothing =
            Differences { across_rms_m: None, across_max_m: None, speed_rms_mps: None, plan_rms_m: None };
        let row = Row {
            ground: Ground::Course,
            gap: Gap::SteerLag,
            belief: Belief::Repaired,
            n: 10,
            n_goal: 7,
            wilson: [0.4, 0.9],
            time_s: None,
            across_rms_m: mean,
            across_max_m: None,
            speed_rms_mps: None,
            plan_rms_m: None,
            less_nominal: nothing,
        };
        let told = row_text(&row);
        for part in ["course", "steer_lag", "repaired", "7 of 10", "0.28 [0.20, 0.33]", "-"] {
            assert!(told.contains(part), "{part} in {told}");
        }
    }
}
