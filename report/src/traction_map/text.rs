//! A judged traction map for a terminal.

use bench::traction_map::{Head, Interval, Source, TractionMapReport};

/// The errors of every source, for a terminal; `name` is the map's.
pub fn text(name: &str, report: &TractionMapReport) -> String {
    let percent = |n: usize| 100.0 * n as f64 / report.n_cells as f64;
    let mut told = format!(
        "  {name}: {} cells with measured traction, {:.0} % out of distribution, {:.0} % with something above the \
         ground\n\n  {:<20}{:<24}{:<24}\n",
        report.n_cells,
        percent(report.n_out_of_distribution),
        percent(report.n_obstructed),
        "EMD2 [bins]",
        "linear [95 %]",
        "angular [95 %]",
    );
    for source in Source::ALL {
        let [linear, angular] =
            [&report.linear, &report.angular].map(|head| interval_text(head.score(source).emd2));
        told += &format!("  {:<20}{linear:<24}{angular:<24}\n", source.name());
    }
    let row = |name: &str, of: &dyn Fn(&Head) -> Interval| {
        let [linear, angular] = [&report.linear, &report.angular].map(|head| interval_text(of(head)));
        format!("  {name:<20}{linear:<24}{angular:<24}\n")
    };
    told += "\n  fused with physics\n";
    told += &row("- less prediction", &|head| head.score(Source::FusedWithPhysics).less_prediction);
    told += &row("- less prior alone", &|head| head.score(Source::FusedWithPhysics).less_prior);
    told += &row("- over uniform", &|head| head.score(Source::FusedWithPhysics).over_uniform);
    told += &row("density AUROC", &|head| head.density_auroc);
    told
}

fn interval_text(interval: Interval) -> String {
    format!("{:.2} [{:.2}, {:.2}]", interval.value, interval.low, interval.high)
}
