//! Knowledge of the ground behind the controller and inside it: how far from the line each drove.

use bench::kinodynamics::{Method, MixedGroundReport, MixedRow, Paired, SpeedReport};
use bench::statistics::Mean;

use crate::axes::{Axes, Range};
use crate::canvas::{Anchor, Canvas, EncodeError, MARGIN, PAGE_WIDTH, Point, Rect, Stroke, TextStyle};
use crate::colour::Rgb;
use crate::table::{Table, probability};

const TOP: f64 = 190.0;
const LEFT: f64 = 100.0;
const GAP: f64 = 80.0;
const RUNS_HEIGHT: f64 = 420.0;
const SURFACES_HEIGHT: f64 = 300.0;
const BETWEEN: f64 = 140.0;
const BELOW: f64 = 90.0;
/// Runs of a method lie so far to both sides of its place, and marks on one surface so far apart.
const SPREAD: f64 = 0.25;
const TEXT: TextStyle = TextStyle::new(18, Anchor::Start);
const NOTE: &str = "\
distance: root mean square to the line, of runs that came around, mean and 95 % bootstrap [cm]
- neither: the same grounds with the method less without; walls: only with the method / only without, p (McNemar)";

fn colour(method: Method) -> Rgb {
    match method {
        Method::Plain => Rgb::INK_SOFT,
        Method::CorrectedBlind => Rgb::ROLL,
        Method::Corrected => Rgb::VEGETATION,
        Method::Adapted => Rgb::PITCH,
    }
}

/// The tables: all ground, then surface by surface.
pub fn text(report: &MixedGroundReport) -> String {
    let header = [
        "m/s",
        "method",
        "around",
        "within walls",
        "distance",
        "- neither",
        "walls",
        "time [s]",
        "- neither",
    ];
    let row = |speed: &SpeedReport| {
        speed.rows.iter().map(|row| cells(speed.speed_mps, row)).collect::<Vec<Vec<String>>>()
    };
    let all = Table {
        title: format!(
            "{} runs of a method and speed, seed {}, walls {} m from the line",
            report.runs, report.seed, report.half_width_m
        ),
        note: NOTE.to_owned(),
        header: header.map(str::to_owned).to_vec(),
        rows: report.speeds.iter().flat_map(row).collect(),
    };
    let surfaces = Table {
        title: "Distance to the line on each surface, with the method less without [cm]".to_owned(),
        note: String::new(),
        header: ["m/s", "method"].into_iter().chain(report.surfaces).map(str::to_owned).collect(),
        rows: report.speeds.iter().flat_map(surface_rows).collect(),
    };
    all.text() + "\n" + &surfaces.text()
}

fn cells(speed_mps: f64, row: &MixedRow) -> Vec<String> {
    let [share, low, high] = row.within_walls.map(|share| 100.0 * share);
    let paired = row.less_plain.as_ref();
    let walls = |paired: &Paired| {
        format!("{}/{}, {}", paired.n_only_method, paired.n_only_plain, probability(paired.p_value))
    };
    vec![
        format!("{speed_mps}"),
        row.method.name().to_owned(),
        format!("{} of {}", row.n_finished, row.n),
        format!("{share:.0} % [{low:.0}, {high:.0}]"),
        told(row.distance_m, 100.0, 1),
        told(paired.and_then(|paired| paired.distance_m), 100.0, 1),
        paired.map_or("-".to_owned(), walls),
        told(row.time_s, 1.0, 2),
        told(paired.and_then(|paired| paired.time_s), 1.0, 2),
    ]
}

fn surface_rows(speed: &SpeedReport) -> Vec<Vec<String>> {
    let row = |row: &MixedRow| {
        let paired = row.less_plain.as_ref()?;
        let named = [format!("{}", speed.speed_mps), row.method.name().to_owned()];
        let surfaces = paired.surface_distance_m.iter().map(|mean| told(*mean, 100.0, 1));
        Some(named.into_iter().chain(surfaces).collect())
    };
    speed.rows.iter().filter_map(row).collect()
}

fn told(mean: Option<Mean>, scale: f64, decimals: usize) -> String {
    let Some(Mean { value, low, high }) = mean else { return "-".to_owned() };
    let [value, low, high] = [value, low, high].map(|value| crate::axes::number(scale * value, decimals));
    format!("{value} [{low}, {high}]")
}

/// Draws every run's distance to the line, a panel for each speed, and below what each surface adds to it, as a PNG 1600 px
/// wide.
///
/// # Errors
/// The encoder refuses.
pub fn picture(report: &MixedGroundReport) -> Result<Vec<u8>, EncodeError> {
    let told = format!(
        "{} runs of a method and speed, seed {}; a dot is a run, with a red rim one that did not come around; bars are 95 % intervals of means; walls at {:.0} cm",
        report.runs,
        report.seed,
        100.0 * report.half_width_m
    );
    let height = TOP + RUNS_HEIGHT + BETWEEN + SURFACES_HEIGHT + BELOW;
    let mut canvas =
        Canvas::titled(height, "Mixed ground: correction behind the controller, or inside it", &[&told]);
    draw_legend(report, &mut canvas);
    let n = report.speeds.len() as f64;
    let width = (PAGE_WIDTH - LEFT - MARGIN - GAP * (n - 1.0)) / n;
    let [most_cm, least_gain_cm, most_gain_cm] = extents_cm(report);
    for (place, speed) in report.speeds.iter().enumerate() {
        let x = LEFT + (width + GAP) * place as f64;
        let frame = Rect { x, y: TOP, width, height: RUNS_HEIGHT };
        let methods = Range { low: -0.5, high: speed.rows.len() as f64 - 0.5 };
        draw_runs(speed, &Axes { frame, x: methods, y: Range { low: 0.0, high: most_cm } }, &mut canvas);
        let frame = Rect { x, y: TOP + RUNS_HEIGHT + BETWEEN, width, height: SURFACES_HEIGHT };
        let surfaces = Range { low: -0.5, high: report.surfaces.len() as f64 - 0.5 };
        let axes = Axes { frame, x: surfaces, y: Range { low: least_gain_cm, high: most_gain_cm } };
        draw_surfaces(report, speed, &axes, &mut canvas);
    }
    canvas.png()
}

/// Largest distance, least and largest difference on a surface, with some room [cm].
fn extents_cm(report: &MixedGroundReport) -> [f64; 3] {
    let rows = || report.speeds.iter().flat_map(|speed| &speed.rows);
    let distances = rows().flat_map(|row| &row.runs).map(|run| 100.0 * run.distance_m);
    let paired = rows().filter_map(|row| row.less_plain.as_ref());
    let means: Vec<Mean> = paired.flat_map(|paired| paired.surface_distance_m).flatten().collect();
    let least = means.iter().map(|mean| 100.0 * mean.low).fold(-1.0, f64::min);
    let most = means.iter().map(|mean| 100.0 * mean.high).fold(1.0, f64::max);
    [1.05 * distances.fold(1.0, f64::max), least - 0.5, most + 0.5]
}

fn draw_legend(report: &MixedGroundReport, canvas: &mut Canvas) {
    let mut x = LEFT;
    for row in report.speeds.iter().take(1).flat_map(|speed| &speed.rows) {
        canvas.circle((x, 122.0), 7.0, colour(row.method), Stroke::solid(Rgb::WHITE, 1.5));
        canvas.text((x + 16.0, 128.0), row.method.name(), TEXT);
        x += 60.0 + 10.0 * row.method.name().len() as f64;
    }
}

fn draw_frame(axes: &Axes, heading: &str, canvas: &mut Canvas) {
    axes.draw_rules(canvas);
    axes.draw_frame(canvas);
    axes.draw_y_ticks(canvas);
    canvas.text((axes.frame.x, axes.frame.y - 14.0), heading, TEXT.bold());
}

fn draw_runs(speed: &SpeedReport, axes: &Axes, canvas: &mut Canvas) {
    draw_frame(axes, &format!("{} m/s: distance to the line [cm]", speed.speed_mps), canvas);
    for (place, row) in speed.rows.iter().enumerate() {
        let n = row.runs.len().max(2) - 1;
        for (number, run) in row.runs.iter().enumerate() {
            let aside = SPREAD * (2.0 * number as f64 / n as f64 - 1.0);
            let at = axes.place(place as f64 + aside, 100.0 * run.distance_m);
            let rim = if run.failure.is_some() { Rgb::FAILURE } else { Rgb::WHITE };
            canvas.circle(at, 4.0, colour(row.method).blend(Rgb::WHITE, 0.45), Stroke::solid(rim, 1.5));
        }
        if let Some(mean) = row.distance_m {
            draw_mean(mean, place as f64, colour(row.method), axes, canvas);
        }
        let (x, _) = axes.place(place as f64, 0.0);
        let within = format!("{} of {}", row.n_within_walls, row.n);
        let style = TextStyle::new(16, Anchor::Middle);
        canvas.text((x, axes.frame.bottom() + 24.0), &within, style.coloured(Rgb::INK_SOFT));
        let time = row.time_s.map_or("-".to_owned(), |mean| format!("{:.1} s", mean.value));
        canvas.text((x, axes.frame.bottom() + 46.0), &time, style.coloured(Rgb::INK_SOFT));
    }
    let style = TextStyle::new(16, Anchor::Middle);
    let middle = axes.frame.x + 0.5 * axes.frame.width;
    canvas.text(
        (middle, axes.frame.bottom() + 70.0),
        "runs between the walls all the way; mean time around",
        style,
    );
}

fn draw_surfaces(report: &MixedGroundReport, speed: &SpeedReport, axes: &Axes, canvas: &mut Canvas) {
    draw_frame(axes, "less that without, by surface [cm]", canvas);
    let [from, to]: [Point; 2] = [axes.x.low, axes.x.high].map(|x| axes.place(x, 0.0));
    canvas.line(from, to, Stroke::solid(Rgb::INK, 1.5));
    let compared: Vec<(&MixedRow, &Paired)> =
        speed.rows.iter().filter_map(|row| Some((row, row.less_plain.as_ref()?))).collect();
    for (place, (row, paired)) in compared.iter().enumerate() {
        let aside = SPREAD * (place as f64 - 0.5 * (compared.len() as f64 - 1.0));
        for (surface, mean) in paired.surface_distance_m.iter().enumerate() {
            let Some(mean) = *mean else { continue };
            draw_mean(mean, surface as f64 + aside, colour(row.method), axes, canvas);
        }
    }
    let style = TextStyle::new(16, Anchor::Middle).coloured(Rgb::INK_SOFT);
    for (surface, name) in report.surfaces.iter().enumerate() {
        let (x, _) = axes.place(surface as f64, 0.0);
        canvas.text((x, axes.frame.bottom() + 24.0), name, style);
    }
}

fn draw_mean(Mean { value, low, high }: Mean, x: f64, colour: Rgb, axes: &Axes, canvas: &mut Canvas) {
    let at = |value_m: f64| axes.place(x, 100.0 * value_m);
    canvas.line(at(low), at(high), Stroke::solid(colour, 3.0));
    canvas.circle(at(value), 7.0, colour, Stroke::solid(Rgb::WHITE, 1.5));
}
