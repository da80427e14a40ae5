//! What is said of a real car's recorded drives.

use bench::kinodynamics::{LogReport, OverRuns};

/// For a terminal.
pub fn text(report: &LogReport) -> String {
    let mut told = format!(
        "  {} runs, each foretold by what was fitted to the others\n  {:<24}{:>32}{:>32}\n",
        report.runs.len(),
        "",
        "yaw rate off by [rad/s]",
        "command off by [1/m]"
    );
    for row in &report.rows {
        let yaw = row.yaw_rate_radps.map_or(String::new(), spread);
        told += &format!("  {:<24}{yaw:>32}{:>32}\n", row.model, spread(row.curvature_per_m));
    }
    told += &format!(
        "\n  {:<24}{:>9}{:>12}{:>12}{:>12}   gain, understeer [s2/m2], most lateral [m/s2]\n",
        "run", "instants", "identity", "bicycle", "network"
    );
    for (k, run) in report.runs.iter().enumerate() {
        let errors: String =
            report.rows.iter().map(|row| format!("{:>12.3}", row.curvature_of_runs_per_m[k])).collect();
        let [gain, understeer, most] = report.effects[k];
        told += &format!("  {run:<24}{:>9}{errors}   {gain:.2}, {understeer:.3}, {most:.1}\n", report.n[k]);
    }
    told
}

fn spread(over_runs: OverRuns) -> String {
    let OverRuns { mean, low, high } = over_runs;
    format!("{mean:.3} [{low:.3}, {high:.3}]")
}
