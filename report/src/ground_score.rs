//! How often the diagnosis of beliefs about the ground is right, for a terminal and as a picture.

use bench::ground_score::{Report, ScoredCase};

use crate::canvas::{Canvas, EncodeError};
use crate::gap_score::confusion_page;

/// What was named for what had been changed, and every case that was named otherwise.
pub fn text(report: &Report) -> String {
    let of = |is_meant: &dyn Fn(&ScoredCase) -> bool, is_counted: &dyn Fn(&ScoredCase) -> bool| {
        let meant = report.cases.iter().filter(|case| is_meant(case));
        let counted = report.cases.iter().filter(|case| is_meant(case) && is_counted(case));
        format!("{} of {}", counted.count(), meant.count())
    };
    let is_changed = |case: &ScoredCase| case.truth != "none";
    let is_held = |case: &ScoredCase| case.credible.contains(&case.truth);
    let rows = [
        ("named right, of what was changed", of(&is_changed, &ScoredCase::is_right)),
        ("among what could be meant", of(&is_changed, &is_held)),
        (
            "something named where nothing was changed",
            of(&|case| !is_changed(case), &|case| !case.is_right()),
        ),
    ];
    let mut told: String = rows.map(|(what, n)| format!("  {what:<45}{n:>12}\n")).concat();
    told += "\n  named otherwise\n";
    let wrong = report.cases.iter().filter(|case| !case.is_right());
    told.extend(wrong.map(|case| format!("  {}\n", case_text(case))));
    told
}

/// A case in a line.
pub fn case_text(case: &ScoredCase) -> String {
    format!(
        "{:<18}{:>4}  {:<28}-> {:<24}{:>8.1}",
        case.vehicle, case.number, case.fault, case.answer, case.difference
    )
}

/// What was taken for what, as a PNG 1600 px wide.
///
/// # Errors
/// The encoder refuses.
pub fn picture(report: &Report) -> Result<Vec<u8>, EncodeError> {
    let page = confusion_page(&report.confusion, "What has changed on the ground");
    page.unwrap_or_else(|| Canvas::titled(200.0, "No case", &[])).png()
}
