//! The score as one page that needs nothing else.

use bench::gap_score::{Hit, Score, Share};

use super::text;
use crate::Picture;
use crate::html::{self, section};

/// The page; `program` names what made it.
pub fn page(score: &Score, title: &str, pictures: &[Picture], program: &str) -> String {
    let body = [
        html::heading(title, &format!("{} cases", score.n_cases)),
        section("Shares", &shares("of the whole set, 95 % Wilson intervals", &score.shares)),
        section("Numbers", &numbers(score)),
        pictures.iter().map(html::figure).collect(),
        section(
            "Single effects, first name right",
            &shares("by size, style, plant and effect", &score.first_names_by),
        ),
        section("Parameters", &parameters(score)),
        section("Cases", &cases(&score.cases)),
        html::soft(program),
    ];
    html::page(title, &body.concat())
}

fn table(header: &[&str], rows: impl Iterator<Item = Vec<String>>) -> String {
    html::table(header, &rows.map(|row| html::row(&row)).collect::<String>())
}

fn shares(what: &str, shares: &[Share]) -> String {
    let row = |share: &Share| {
        vec![share.name.clone(), format!("{} of {}", share.n_hit, share.n), text::percent(share)]
    };
    table(&[what, "cases", "share"], shares.iter().map(row))
}

fn numbers(score: &Score) -> String {
    let rows = text::numbers(score).into_iter().map(|(name, quantiles)| quantile_row(name, &quantiles));
    table(&["", "n", "mean", "p10", "median", "p90"], rows)
}

fn quantile_row(name: &str, quantiles: &bench::gap_score::Quantiles) -> Vec<String> {
    let numbers = [quantiles.mean, quantiles.p10, quantiles.median, quantiles.p90].map(text::number);
    [vec![name.to_owned(), quantiles.n.to_string()], numbers.to_vec()].concat()
}

fn parameters(score: &Score) -> String {
    let rows =
        score.parameter_error_by_effect.iter().map(|(effect, quantiles)| quantile_row(effect, quantiles));
    table(&["relative error", "n", "mean", "p10", "median", "p90"], rows)
}

fn cases(hits: &[Hit]) -> String {
    let header = [
        "case",
        "vehicle",
        "style",
        "added",
        "verdict",
        "announced",
        "first, score",
        "credible set",
        "closed",
        "predicted",
    ];
    html::table(&header, &hits.iter().map(case).collect::<String>())
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
        text::number(hit.closed),
        text::number(hit.predicted_closed),
    ];
    let class = if hit.is_right() { "" } else { " class=\"wrong\"" };
    format!("<tr{class}>{}</tr>\n", html::cells("td", &cells))
}
