//! The score as one page that needs nothing else.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use bench::gap_score::{Hit, Score, Share};

use super::told;
use crate::picture::GapPicture;

const STYLE: &str = "\
body{font:16px/1.5 system-ui,sans-serif;color:#1b2230;max-width:1200px;margin:2em auto;padding:0 1em}\
h1{margin-bottom:.1em}h2{margin:2em 0 .3em;font-size:20px;border-top:1px solid #d9dee5;padding-top:.8em}\
p{margin:.3em 0}.soft{color:#5a6474}\
table{border-collapse:collapse;font-size:15px;font-variant-numeric:tabular-nums;margin:.6em 0}\
th,td{padding:3px 14px 3px 0;text-align:left;border-bottom:1px solid #d9dee5;vertical-align:top}\
th{color:#5a6474;font-weight:600}img{width:100%;height:auto;margin:.6em 0}.wrong{color:#b01030}";

pub(super) fn page(score: &Score, title: &str, pictures: &[GapPicture], program: &str) -> String {
    let body = [
        format!("<h1>{}</h1>\n<p class=\"soft\">{} cases</p>\n", escaped(title), score.n_cases),
        section("Shares", &shares("of the whole set, 95 % Wilson intervals", &score.shares)),
        section("Numbers", &numbers(score)),
        pictures.iter().map(figure).collect(),
        section(
            "Single effects, first name right",
            &shares("by size, style, plant and effect", &score.first_names_by),
        ),
        section("Parameters", &parameters(score)),
        section("Cases", &cases(&score.cases)),
        format!("<p class=\"soft\">{}</p>\n", escaped(program)),
    ];
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>{}</title>\n\
         <style>{STYLE}</style>\n</head>\n<body>\n{}</body>\n</html>\n",
        escaped(title),
        body.concat()
    )
}

fn section(title: &str, content: &str) -> String {
    format!("<h2>{title}</h2>\n{content}")
}

fn table(head: &[&str], rows: impl Iterator<Item = Vec<String>>) -> String {
    let cells = |tag: &str, cells: &[String]| -> String {
        cells.iter().map(|cell| format!("<{tag}>{}</{tag}>", escaped(cell))).collect()
    };
    let head: Vec<String> = head.iter().map(|name| (*name).to_owned()).collect();
    let rows: String = rows.map(|row| format!("<tr>{}</tr>\n", cells("td", &row))).collect();
    format!("<table>\n<tr>{}</tr>\n{rows}</table>\n", cells("th", &head))
}

fn shares(what: &str, shares: &[Share]) -> String {
    let row = |share: &Share| {
        vec![share.name.clone(), format!("{} of {}", share.n_hit, share.n), told::percent(share)]
    };
    table(&[what, "cases", "share"], shares.iter().map(row))
}

fn numbers(score: &Score) -> String {
    let rows = told::numbers(score).into_iter().map(|(name, quantiles)| quantile_row(name, &quantiles));
    table(&["", "n", "mean", "p10", "median", "p90"], rows)
}

fn quantile_row(name: &str, quantiles: &bench::gap_score::Quantiles) -> Vec<String> {
    let numbers = [quantiles.mean, quantiles.p10, quantiles.median, quantiles.p90].map(told::number);
    [vec![name.to_owned(), quantiles.n.to_string()], numbers.to_vec()].concat()
}

fn parameters(score: &Score) -> String {
    let rows =
        score.parameter_error_by_effect.iter().map(|(effect, quantiles)| quantile_row(effect, quantiles));
    table(&["relative error", "n", "mean", "p10", "median", "p90"], rows)
}

fn cases(hits: &[Hit]) -> String {
    let rows: String = hits.iter().map(case).collect();
    format!(
        "<table>\n<tr><th>case</th><th>vehicle</th><th>style</th><th>added</th><th>verdict</th><th>announced</th>\
         <th>first, score</th><th>credible set</th><th>closed</th><th>predicted</th></tr>\n{rows}</table>\n"
    )
}

fn case(hit: &Hit) -> String {
    let none = |names: &[String]| if names.is_empty() { "-".to_owned() } else { names.join(" + ") };
    let added = format!("{} {}", none(&hit.truth), hit.magnitude);
    let first = hit.first.as_ref().map_or("-".to_owned(), |(id, score)| format!("{id} {score:.2}"));
    let cells = [
        hit.case.clone(),
        hit.vehicle.clone(),
        hit.style.clone(),
        added,
        format!("{:?}", hit.verdict),
        none(&hit.announced),
        first,
        hit.credible_set.join(", "),
        told::number(hit.closed),
        told::number(hit.predicted_closed),
    ];
    let class = if hit.is_right() { "" } else { " class=\"wrong\"" };
    let cells: String = cells.iter().map(|cell| format!("<td>{}</td>", escaped(cell))).collect();
    format!("<tr{class}>{cells}</tr>\n")
}

fn figure(picture: &GapPicture) -> String {
    let (caption, data) = (escaped(&picture.caption), BASE64_STANDARD.encode(&picture.png));
    format!("<h2>{caption}</h2>\n<img src=\"data:image/png;base64,{data}\" alt=\"{caption}\">\n")
}

/// Text that cannot be taken for markup.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
