//! Where a belief about the ground and what was met part, for a terminal, as a picture and as a page.

mod picture;

use sim_to_real::{BlockMean, Calibration, GroundChange, GroundReport, LayerErrors, Parting, PlaceTable};

use crate::Picture;
use crate::html;
use crate::table::Table;

pub use picture::picture;

/// Conditions that are told in full.
const PLACES_TOLD: usize = 3;

/// The report for a terminal.
pub fn text(report: &GroundReport) -> String {
    let mut told = verdict(report).iter().map(|line| format!("  {line}\n")).collect::<String>();
    for table in tables(report) {
        told += &format!("\n{}", table.text());
    }
    told
}

/// The report as a page that needs nothing else; `drives` says whose it is.
pub fn page(report: &GroundReport, drives: &str, picture: &Picture) -> String {
    let verdict: String = verdict(report).iter().map(|line| html::paragraph(line)).collect();
    let tables: String = tables(report).iter().map(Table::html).collect();
    let body = [
        html::heading("The belief about the ground", drives),
        verdict,
        html::figure(picture),
        tables,
        html::section("How to read this", READING),
    ];
    html::page("The belief about the ground", &body.concat())
}

const READING: &str = "\
<p>Before a footprint was driven over, its traction and attitude were foretold as distributions from the newest map. \
Afterwards they were measured. The bias is what was met less the mean of what was foretold. If a belief is calibrated, \
nine of ten measurements lie in the central 90 % of what was foretold, and the histogram of the probability integral \
transform is level: a heap in the middle is a belief that is not sure enough, heaps at both ends one that is too sure, a \
slope one that is biased. Intervals hold 90 %, from stretches of three seconds. A parting is told from three standard \
errors and half a bin on.</p>";

/// What there is to say in sentences, what matters most first.
fn verdict(report: &GroundReport) -> Vec<String> {
    let mut told: Vec<String> = report.change.iter().map(change).collect();
    if report.change.is_none() && report.n_reference > 0 {
        told.push(
            "Too little is common to these drives and those of reference to say what has changed.".to_owned(),
        );
    }
    told.extend(
        report
            .calibration
            .iter()
            .map(|parameter| format!("{}: {}", parameter.parameter, parting(parameter.parting))),
    );
    told
}

fn change(change: &GroundChange) -> String {
    let per_number = change.chi_squared / change.n_traits as f64;
    let difference =
        format!("the mean square of {} differences is {per_number:.1} times chance's", change.n_traits);
    let others = |named| {
        let others = change.credible.iter().filter(|cause| **cause != named);
        others.map(|cause| cause.name()).collect::<Vec<_>>().join("; ")
    };
    match (change.named, change.is_unknown) {
        (Some(named), _) => {
            let means = change.ranking.first().map_or("", |first| first.means.as_str());
            let others = Some(others(named)).filter(|others| !others.is_empty());
            let others = others.map_or(String::new(), |others| format!(". It could also be: {others}"));
            format!("Since the reference drives: {} ({means}){others}. {difference}.", named.name())
        }
        (None, true) => {
            format!(
                "Something has changed since the reference drives that no known cause explains: {difference}."
            )
        }
        (None, false) => format!("Nothing has changed since the reference drives: {difference}."),
    }
}

fn parting(parting: Parting) -> &'static str {
    match parting {
        Parting::None => "as foretold",
        Parting::TooOptimistic => "worse than foretold",
        Parting::TooPessimistic => "better than foretold",
        Parting::OverConfident => "right in the mean, and foretold too surely",
        Parting::UnderConfident => "right in the mean, and foretold too vaguely",
        Parting::Unknown => "too little was met to say",
    }
}

fn tables(report: &GroundReport) -> Vec<Table> {
    let mut tables = vec![calibration(&report.calibration), layers(&report.layers)];
    tables.extend(heights(report));
    tables.extend(report.places.iter().take(PLACES_TOLD).map(place));
    tables.extend(report.change.as_ref().map(causes));
    tables
}

fn calibration(parameters: &[Calibration]) -> Table {
    let row = |parameter: &Calibration| {
        vec![
            parameter.parameter.to_owned(),
            parameter.met.map_or(0, |met| met.n).to_string(),
            mean(parameter.met.as_ref()),
            mean(parameter.bias.as_ref()),
            mean(parameter.coverage.as_ref()),
            parting(parameter.parting).to_owned(),
        ]
    };
    Table {
        title: "Foretold and met".to_owned(),
        note: "traction [-], angles [rad]".to_owned(),
        header: words(&["", "n", "met", "met less foretold", "inside 90 %", ""]),
        rows: parameters.iter().map(row).collect(),
    }
}

fn layers(layers: &[LayerErrors]) -> Table {
    let row = |layer: &LayerErrors| {
        vec![
            layer.parameter.to_owned(),
            mean(layer.prior.as_ref()),
            mean(layer.networks.as_ref()),
            mean(layer.posterior.as_ref()),
            mean(layer.uniform.as_ref()),
        ]
    };
    Table {
        title: "Error of every layer (EMD2, squared bins)".to_owned(),
        note: String::new(),
        header: words(&["", "prior", "networks", "driven on", "knowing nothing"]),
        rows: layers.iter().map(row).collect(),
    }
}

fn heights(report: &GroundReport) -> Option<Table> {
    let all = report.heights.all.as_ref()?;
    let classes = report.heights.by_class.iter().map(|(class, error)| (*class, error));
    let rows = std::iter::once(("all ground", all)).chain(classes);
    Some(Table {
        title: "Height of the map less that of the wheels [m]".to_owned(),
        note: String::new(),
        header: words(&["", "n", "error"]),
        rows: rows
            .map(|(name, error)| vec![name.to_owned(), error.n.to_string(), mean(Some(error))])
            .collect(),
    })
}

fn place(table: &PlaceTable) -> Table {
    let row =
        |bin: &sim_to_real::PlaceBin| vec![bin.label.clone(), bin.bias.n.to_string(), mean(Some(&bin.bias))];
    Table {
        title: format!(
            "{} by {}: {:.0} % of the squared residual",
            table.parameter,
            table.condition.name(),
            100.0 * table.share
        ),
        note: String::new(),
        header: words(&["", "n", "met less foretold"]),
        rows: table.bins.iter().map(row).collect(),
    }
}

fn causes(change: &GroundChange) -> Table {
    let row = |ranked: &sim_to_real::RankedGroundCause| {
        vec![
            ranked.cause.name(),
            format!("{:.2}", ranked.score),
            format!("{:.0} %", 100.0 * ranked.explained),
            ranked.means.clone(),
        ]
    };
    Table {
        title: "What could have changed".to_owned(),
        note: String::new(),
        header: words(&["", "probability", "explained", "meaning"]),
        rows: change.ranking.iter().map(row).collect(),
    }
}

fn words(words: &[&str]) -> Vec<String> {
    words.iter().map(|word| (*word).to_owned()).collect()
}

fn mean(mean: Option<&BlockMean>) -> String {
    mean.map_or("-".to_owned(), |mean| {
        let half = 0.5 * (mean.interval[1] - mean.interval[0]);
        format!("{:.3} ± {half:.3}", mean.value)
    })
}
