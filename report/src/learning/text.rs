//! The report for a terminal.

use bench::learning::{Report, Row};

use super::tables;
use crate::verdict;

/// What was driven, in lines.
pub(super) fn testbed(report: &Report) -> String {
    let testbed = &report.testbed;
    format!(
        "  {}, testbed of seed {}: {} maps, {} trials each, for training, validation and test\n  \
         {} training and {} validation footprints, unevenness up to {:.4} m (median of the training drives)\n  \
         {} test footprints at height scale {:.3}, {:.1} % out of distribution\n",
        testbed.vehicle,
        testbed.seed,
        testbed.n_maps,
        testbed.n_trials,
        testbed.n_training,
        testbed.n_validation,
        testbed.unevenness_max_m,
        testbed.n_test,
        testbed.test_height_scale,
        100.0 * testbed.share_out_of_distribution
    )
}

/// Everything, within 110 columns.
pub fn text(report: &Report) -> String {
    let [one, two] = tables::paper_tables(report);
    let mut tables = vec![tables::settings(report), one, two, tables::heads(report), tables::excess(report)];
    tables.push(tables::curve(report));
    tables.extend(report.evidence_of(Row::Pietra).map(|evidence| tables::evidence(report, evidence)));
    tables.push(tables::calibration(report));
    let tables: Vec<String> = tables.iter().map(|table| table.text()).collect();
    format!("\n{}\n{}\n{}", testbed(report), tables.join("\n"), verdict::text(&report.verdicts))
}

/// A duration for people.
pub fn duration(seconds: f64) -> String {
    if seconds < 90.0 { format!("{seconds:.1} s") } else { format!("{:.1} min", seconds / 60.0) }
}
