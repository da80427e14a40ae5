//! The report as one page that needs nothing else: the pictures are in it.

use ::bench::kinodynamics::{Report, TrackReport};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;

use super::told::published;

const STYLE: &str = "\
body{font:16px/1.5 system-ui,sans-serif;color:#1b2230;max-width:1200px;margin:2em auto;padding:0 1em}\
h2{margin:2em 0 .3em;font-size:20px}table{border-collapse:collapse;font-variant-numeric:tabular-nums;margin:.6em 0}\
th,td{padding:4px 14px 4px 0;text-align:left;border-bottom:1px solid #d9dee5}th{color:#5a6474;font-weight:600}\
img{width:100%;height:auto;margin:.6em 0}.soft{color:#5a6474}.fails{color:#d61f3a;font-weight:600}";

pub(super) fn page(report: &Report, pictures: &[Vec<u8>], revision: &str) -> String {
    let mut body = format!(
        "<h1>Inverse kinodynamics</h1>\n<p class=\"soft\">{} minutes of random driving, seed {}, {} laps at every speed, walls \
         {} m from the nominal line, revision {revision}.</p>\n",
        report.minutes, report.seed, report.laps, report.half_width_m
    );
    for (place, track) in [&report.outdoor, &report.indoor].into_iter().enumerate() {
        body += &format!("<h2>The {} track</h2>\n{}", track.track, table(track, place));
        if let Some(png) = pictures.get(place) {
            let data = BASE64_STANDARD.encode(png);
            body += &format!(
                "<img alt=\"laps on the {} track\" src=\"data:image/png;base64,{data}\">\n",
                track.track
            );
        }
    }
    body += "<h2>Rules</h2>\n<table>\n<tr><th>rule</th><th>found</th><th></th></tr>\n";
    for verdict in &report.verdicts {
        let mark = if verdict.holds { "holds" } else { "<span class=\"fails\">fails</span>" };
        body += &format!(
            "<tr><td>{}</td><td>{}</td><td>{mark}</td></tr>\n",
            escaped(&verdict.rule),
            escaped(&verdict.found)
        );
    }
    body += "</table>\n";
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>Inverse kinodynamics</title>\n\
         <style>{STYLE}</style>\n</head>\n<body>\n{body}</body>\n</html>\n"
    )
}

fn table(track: &TrackReport, place: usize) -> String {
    let mut rows = String::from(
        "<table>\n<tr><th>model</th><th>success</th><th>95 % interval</th><th>failed turns</th><th>paper</th></tr>\n",
    );
    for row in &track.rows {
        let [low, high] = row.success_interval.map(|share| 100.0 * share);
        let paper = published(row.row)[place].map_or(String::new(), |percent| format!("{percent:.1} %"));
        rows += &format!(
            "<tr><td>{}</td><td>{:.1} %</td><td>{low:.1} to {high:.1}</td><td>{} of {}</td><td>{paper}</td></tr>\n",
            row.row.name(),
            100.0 * row.success,
            row.failures,
            row.n
        );
    }
    rows + "</table>\n"
}

/// Text that cannot be taken for markup.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
