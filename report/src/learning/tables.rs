//! What the report says, as tables.

use bench::learning::{
    Chosen, EvidenceReport, Ground, GroundEvidence, MeanDeviation, Report, Row, RowReport, WeightPercentiles,
};

use crate::table::Table;

/// Words of a row.
fn words<const N: usize>(words: [&str; N]) -> Vec<String> {
    words.map(str::to_owned).to_vec()
}

/// Three decimals; a dash where nothing was measured.
fn number(value: f64) -> String {
    if value.is_nan() { "-".to_owned() } else { format!("{value:.3}") }
}

/// Mean and deviation; a prior has none.
fn spread(row: Row, of: MeanDeviation) -> String {
    match (of.mean.is_nan(), row.method()) {
        (true, _) => "-".to_owned(),
        (false, None) => number(of.mean),
        (false, Some(_)) => format!("{:.3}±{:.3}", of.mean, of.deviation),
    }
}

/// Names of the parameters in both domains.
fn header_of_domains() -> Vec<String> {
    let heads = ["linear", "angular", "roll", "pitch"];
    let of = |domain: &'static str| heads.map(|head| format!("{domain} {head}"));
    [vec!["method".to_owned()], of("ID").into(), of("OOD").into()].concat()
}

/// Tables I and II of the paper.
pub(super) fn paper_tables(report: &Report) -> [Table; 2] {
    let table = |title: &str, rows: &[Row]| {
        Table {
        title: format!(
            "{title}: EMD2, sum of four parameters [squared bins], mean ± deviation of {} seeds",
            report.n_seeds
        ),
        note: "PP: physics prior in the posterior; UPI: physics-informed loss; PIETRA: both added to EVORA\n\
               ratios to the uniform prior, overall and OOD, compare with the paper's; its EMD2 has another unit"
            .to_owned(),
        header: words([
            "method", "overall", "ID", "OOD", "ratio", "OOD", "paper", "ID", "OOD", "ratio", "OOD",
        ]),
        rows: rows.iter().map(|&row| paper_row(report.row(row))).collect(),
    }
    };
    [table("Table I", &Row::TABLE_ONE), table("Table II", &Row::TABLE_TWO)]
}

fn paper_row(row: &RowReport) -> Vec<String> {
    let domains = [&row.overall, &row.in_distribution, &row.out_of_distribution];
    let mut cells = vec![row.row.name().to_owned()];
    cells.extend(domains.map(|domain| spread(row.row, domain.total)));
    cells.extend([domains[0], domains[2]].map(|domain| number(domain.ratio_to_uniform)));
    cells.extend(row.published.map(|value| format!("{value:.2}")));
    cells.extend([row.published_ratios[0], row.published_ratios[2]].map(number));
    cells
}

/// Errors per parameter.
pub(super) fn heads(report: &Report) -> Table {
    let row = |row: &RowReport| {
        let mut cells = vec![row.row.name().to_owned()];
        for domain in [&row.in_distribution, &row.out_of_distribution] {
            cells.extend(domain.heads.map(|head| number(head.mean)));
        }
        cells
    };
    let mut achievable = vec!["best achievable".to_owned()];
    achievable.extend([report.achievable[1], report.achievable[2]].concat().into_iter().map(number));
    Table {
        title: "EMD2 per parameter [squared bins]".to_owned(),
        note: "best achievable: vanilla networks trained on all ground of other maps like those of the test; an upper\n\
               bound of the irreducible error"
            .to_owned(),
        header: header_of_domains(),
        rows: report.rows.iter().map(row).chain([achievable]).collect(),
    }
}

/// Errors per parameter that could have been avoided.
pub(super) fn excess(report: &Report) -> Table {
    let row = |row: &RowReport| {
        let mut cells = vec![row.row.name().to_owned()];
        for domain in [&row.in_distribution, &row.out_of_distribution] {
            cells.extend(domain.excess.map(number));
        }
        cells
    };
    Table {
        title: "EMD2 per parameter in excess of the best achievable [squared bins]".to_owned(),
        note: "the true excess is at least this much".to_owned(),
        header: header_of_domains(),
        rows: report.rows.iter().map(row).collect(),
    }
}

/// Figure 6 in numbers.
pub(super) fn curve(report: &Report) -> Table {
    let row = |row: &RowReport| {
        let mut cells = vec![row.row.name().to_owned()];
        cells.extend(row.curve.iter().map(|point| number(point.mean)));
        cells
    };
    let bins = &report.unevenness_bins;
    let mut header = vec!["unevenness up to [m]".to_owned()];
    header.extend(bins.iter().map(|bin| format!("{:.3}", bin.high_m)));
    let mut counts = vec!["footprints".to_owned()];
    counts.extend(bins.iter().map(|bin| bin.n.to_string()));
    Table {
        title: format!(
            "Figure 6: EMD2, sum of four parameters, by unevenness; in distribution up to {:.3} m",
            report.testbed.unevenness_max_m
        ),
        note: "bins of equal width up to where 99 % of the footprints lie below; the last holds the rest too"
            .to_owned(),
        header,
        rows: [counts].into_iter().chain(report.rows.iter().map(row)).collect(),
    }
}

/// How much the evidence of one method weighs.
pub(super) fn evidence(report: &Report, evidence: &EvidenceReport) -> Table {
    let told = |weight: &WeightPercentiles| {
        let at = |value: f64| if value.is_nan() { "-".to_owned() } else { format!("{value:.2}") };
        format!("{} {} {}", at(weight.p05), at(weight.p50), at(weight.p95))
    };
    let row = |ground: &GroundEvidence| {
        let mut cells = vec![ground_name(report, ground.ground), ground.n.to_string(), told(&ground.weight)];
        cells.extend(ground.heads.iter().map(told));
        cells
    };
    Table {
        title: format!("{}: weight of what was learned, 5th, 50th and 95th percentile", evidence.row.name()),
        note: "n/(n + n_prior), and with each parameter's evidence scale s n/(s n + n_prior)".to_owned(),
        header: words(["ground", "n", "n/(n+n_prior)", "linear", "angular", "roll", "pitch"]),
        rows: evidence.grounds.iter().map(row).collect(),
    }
}

fn ground_name(report: &Report, ground: Ground) -> String {
    match ground {
        Ground::Uneven(bin) => {
            let high_m = report.unevenness_bins[bin].high_m;
            let is_last = bin + 1 == report.unevenness_bins.len();
            let low_m = report.unevenness_bins[bin].low_m;
            if is_last { format!("uneven, above {low_m:.3} m") } else { format!("uneven, to {high_m:.3} m") }
        }
        other => other.name(),
    }
}

/// Expected calibration errors.
pub(super) fn calibration(report: &Report) -> Table {
    let row = |row: &RowReport| {
        let mut cells = vec![row.row.name().to_owned()];
        for domain in [&row.in_distribution, &row.out_of_distribution] {
            let heads = domain.calibration.iter().flat_map(|calibration| &calibration.heads);
            cells.extend(heads.map(|head| number(head.expected_error.mean)));
        }
        cells
    };
    Table {
        title: "Expected calibration error of the CDF".to_owned(),
        note: "|predicted - observed| probability of \"bin k or below\", in tenths of predicted probability"
            .to_owned(),
        header: header_of_domains(),
        rows: report.rows.iter().map(row).collect(),
    }
}

/// Parameters of the methods.
pub(super) fn settings(report: &Report) -> Table {
    let row = |settings: &evidential::Settings| {
        let method = settings.method;
        let if_used = |is_used: bool, weight: f64| if is_used { weight.to_string() } else { "-".to_owned() };
        vec![
            method.name().to_owned(),
            settings.learning_rate.to_string(),
            if_used(method.has_physics_loss(), settings.physics_weight),
            if_used(method.is_evidential(), settings.entropy_weight),
            settings.epochs_max.to_string(),
        ]
    };
    Table {
        title: match report.chosen {
            Chosen::SearchHere => "Parameters, chosen by the shipped search on these validation data",
            Chosen::SearchElsewhere => "Parameters, chosen by the shipped search on other validation data",
            Chosen::Defaults => "Parameters: defaults, no search for every method was shipped",
        }
        .to_owned(),
        note: String::new(),
        header: words(["method", "rate", "kappa", "entropy", "passes at most"]),
        rows: report.settings.iter().map(row).collect(),
    }
}
