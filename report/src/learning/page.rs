//! The report as a page that needs nothing else.

use bench::learning::Report;

use super::{drawn, tables, text};
use crate::table::Table;
use crate::{html, verdict};

/// The page; `took` says how long everything took.
pub fn page(report: &Report, took: &str) -> String {
    let [one, two] = tables::paper_tables(report);
    let mut others = vec![one, two, tables::heads(report), tables::excess(report), tables::curve(report)];
    others.extend(report.evidence.iter().map(|evidence| tables::evidence(report, evidence)));
    others.extend([tables::calibration(report), tables::settings(report)]);
    let driven = text::testbed(report) + took;
    let mut body = "<h1>Learning benchmark</h1>\n".to_owned();
    body.extend(driven.lines().map(|line| html::soft(line.trim())));
    body += &verdict::section(&report.verdicts);
    body += inline(&drawn(report).svg());
    body.extend(others.iter().map(Table::html));
    html::page("Learning benchmark", &body)
}

/// SVG without what only a file of its own may begin with.
fn inline(picture: &str) -> &str {
    picture.find("<svg").map_or("", |start| &picture[start..])
}
