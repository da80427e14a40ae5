//! Rules that were fixed beforehand, and whether they hold, for a terminal and for a page.

use bench::Verdict;

use crate::html;

/// "Rules: 3 of 5 hold".
pub(crate) fn sum(verdicts: &[Verdict]) -> String {
    let n_passed = verdicts.iter().filter(|verdict| verdict.is_passed).count();
    format!("Rules: {n_passed} of {} hold", verdicts.len())
}

/// A line of sum and one of each rule.
pub(crate) fn text(verdicts: &[Verdict]) -> String {
    let line = |verdict: &Verdict| {
        let mark = if verdict.is_passed { "holds" } else { "FAILS" };
        format!("  {mark}  {}: {}\n", verdict.rule, verdict.found)
    };
    let lines: String = verdicts.iter().map(line).collect();
    format!("  {}\n{lines}", sum(verdicts))
}

/// A section of a page.
pub(crate) fn section(verdicts: &[Verdict]) -> String {
    let row = |verdict: &Verdict| html::verdict(&verdict.rule, verdict.is_passed, &verdict.found);
    let rows: String = verdicts.iter().map(row).collect();
    html::section(&sum(verdicts), &html::table(&["rule", "", "found"], &rows))
}
