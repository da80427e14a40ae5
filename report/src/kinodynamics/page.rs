//! The report as one page that needs nothing else: the pictures are in it.

use bench::kinodynamics::{Report, RowReport, TrackReport};

use super::text::published;
use crate::{Picture, html, verdict};

/// The page; the pictures are those of the outdoor and of the indoor track.
pub fn page(report: &Report, pictures: &[Picture; 2], revision: &str) -> String {
    let line = format!(
        "{} minutes of random driving, seed {}, {} laps at every speed, walls {} m from the nominal line, revision \
         {revision}.",
        report.minutes, report.seed, report.laps, report.half_width_m
    );
    let mut body = html::heading("Inverse kinodynamics", &line);
    for (place, track) in [&report.outdoor, &report.indoor].into_iter().enumerate() {
        let content = table(track, place) + &html::figure(&pictures[place]);
        body += &html::section(&format!("The {} track", track.track), &content);
    }
    body += &verdict::section(&report.verdicts);
    html::page("Inverse kinodynamics", &body)
}

fn table(track: &TrackReport, place: usize) -> String {
    let row = |row: &RowReport| {
        let [low, high] = row.success_interval.map(|share| 100.0 * share);
        html::row(&[
            row.row.name().to_owned(),
            format!("{:.1} %", 100.0 * row.success),
            format!("{low:.1} to {high:.1}"),
            format!("{} of {}", row.failures, row.n),
            published(row.row)[place].map_or(String::new(), |percent| format!("{percent:.1} %")),
        ])
    };
    let rows: String = track.rows.iter().map(row).collect();
    html::table(&["model", "success", "95 % interval", "failed turns", "paper"], &rows)
}
