//! What friction foretells of turns and climbs, for a terminal.

use bench::route::grip::{GripRow, GripScore, Source, Turn};

use crate::table::Table;

/// Rows by where their friction came from, and what they come to.
pub fn grip(rows: &[GripRow]) -> String {
    let titles = [
        (Source::Published, "grounds as published"),
        (Source::Driven, "grounds of unknown friction, found from a drive of two minutes"),
    ];
    titles.into_iter().map(|(source, title)| of_source(rows, source, title)).collect()
}

fn of_source(rows: &[GripRow], source: Source, title: &str) -> String {
    let of_source: Vec<&GripRow> = rows.iter().filter(|row| row.source == source).collect();
    let Some(first) = of_source.first() else { return String::new() };
    let mut header = ["ground", "friction", "v_safe [m/s]"].map(str::to_owned).to_vec();
    header.extend(first.turns.iter().map(|turn| format!("{} v_safe", turn.share)));
    header.extend(["climb [deg]", "climbed [deg]"].map(str::to_owned));
    let table = Table {
        title: format!("turns of 20 m radius and climbs: {title}"),
        note: "off the line [m] and slip of the rear axle [deg]; * holds: below 0.5 m and 10 deg".to_owned(),
        header,
        rows: of_source.iter().map(|row| line(row)).collect(),
    };
    let GripScore { n, n_safe, n_unsafe, held_share, climb_error_deg } = GripScore::of(rows, source);
    let held = if held_share > 0.0 { format!("{held_share} v_safe") } else { "no speed tried".to_owned() };
    table.text()
        + &format!(
            "  v_safe holds on {n_safe} of {n}, 1.15 v_safe does not on {n_unsafe}; {held} holds on all\n"
        )
        + &format!("  climbs: mean absolute error {climb_error_deg:.1} degrees\n\n")
}

fn line(row: &GripRow) -> Vec<String> {
    let turn = |turn: &Turn| {
        let mark = if turn.holds { "*" } else { "" };
        format!("{:.1} {:.0}{mark}", turn.off_m, turn.slip_deg)
    };
    let mut cells =
        vec![row.ground.to_owned(), format!("{:.2}", row.friction), format!("{:.1}", row.safe_mps)];
    cells.extend(row.turns.iter().map(turn));
    cells.extend([row.climb_deg, row.climbed_deg].map(|angle| format!("{angle:.1}")));
    cells
}
