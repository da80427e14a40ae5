//! The report as a page that needs nothing else.

use ::bench::learning::{Report, Verdict};

use super::table::{Table, escaped};
use super::{tables, told};

const STYLE: &str = "\
body{font:16px/1.45 system-ui,sans-serif;color:#1b2230;max-width:1200px;margin:2em auto;padding:0 1em}\
table{border-collapse:collapse;font-size:14px;font-variant-numeric:tabular-nums}\
th,td{padding:3px 10px;text-align:right;border-bottom:1px solid #d9dee5;white-space:nowrap}\
th:first-child,td:first-child{text-align:left}th{color:#5a6474;font-weight:600}\
h2{margin:1.8em 0 .2em;font-size:18px}p{color:#5a6474;margin:.2em 0 .6em}\
svg{width:100%;height:auto;margin-top:1em}\
.failed{color:#d61f3a;font-weight:600}.passed{color:#0d533b;font-weight:600}";

/// The page; `took` says how long everything took, `picture` is SVG.
pub(super) fn page(report: &Report, took: &str, picture: &str) -> String {
    let [one, two] = tables::paper_tables(report);
    let mut others = vec![one, two, tables::heads(report), tables::excess(report), tables::curve(report)];
    others.extend(report.evidence.iter().map(|evidence| tables::evidence(report, evidence)));
    others.extend([tables::calibration(report), tables::settings(report)]);
    let others: String = others.iter().map(Table::html).collect();
    let driven = told::testbed(report) + took;
    let driven: String = driven.lines().map(|line| format!("<p>{}</p>\n", escaped(line.trim()))).collect();
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>Learning benchmark</title>\n\
         <style>{STYLE}</style>\n</head>\n<body>\n<h1>Learning benchmark</h1>\n{driven}{}{}\n{others}</body>\n</html>\n",
        verdicts(report),
        inline(picture)
    )
}

fn verdicts(report: &Report) -> String {
    let row = |verdict: &Verdict| {
        let passed = if verdict.is_passed { "passed" } else { "failed" };
        format!(
            "<tr><td>{}</td><td class=\"{passed}\">{passed}</td><td>{}</td></tr>\n",
            escaped(&verdict.rule),
            escaped(&verdict.found)
        )
    };
    let rows: String = report.verdicts.iter().map(row).collect();
    format!("<h2>{}</h2>\n<table>\n<tbody>\n{rows}</tbody>\n</table>\n", escaped(&told::rules(report)))
}

/// SVG without what only a file of its own may begin with.
fn inline(picture: &str) -> &str {
    picture.find("<svg").map_or("", |start| &picture[start..])
}
