//! The navigation benchmark as a page that needs nothing else.

use bench::navigation::Report;

use super::tables;
use crate::{Picture, html, verdict};

/// The page, with its pictures in their order.
pub fn page(report: &Report, pictures: &[Picture], revision: &str) -> String {
    let plan = &report.plan;
    let settings: Vec<&str> = plan.settings.split_whitespace().collect();
    let settings = if settings.is_empty() { "its own".to_owned() } else { settings.join(" ") };
    let line = format!(
        "{}, maps of seed {}: {}, starts and goals on each, 40 m apart: {}, time limit {} s, plant {}, {:?}, settings {settings}, revision {revision}.",
        plan.vehicle,
        plan.seed,
        plan.n_maps,
        plan.n_pairs,
        plan.time_limit_s,
        plan.plant.name(),
        plan.isa
    );
    let mut body = html::heading("Navigation benchmark", &line);
    if !report.verdicts.is_empty() {
        body += &verdict::section(&report.verdicts);
    }
    body.extend(pictures.iter().map(html::figure));
    body += &tables::rows(report).html();
    if !report.comparisons.is_empty() {
        body += &tables::comparisons(report).html();
    }
    html::page("Navigation benchmark", &body)
}
