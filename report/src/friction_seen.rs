//! Friction seen from above: the paper's Tables 1, 2, 4 and 5 as text, and what was seen beside what is, as a picture.

use bench::friction::seen::{Picture, Report, Row};

use crate::axes::{Axes, Range};
use crate::canvas::{Anchor, Canvas, EncodeError, Image, MARGIN, PAGE_WIDTH, Rect, Stroke, TextStyle};
use crate::colour::{Ramp, Rgb};
use crate::table::Table;
use crate::verdict;

/// The paper's row that stands beside each of ours: ATE [m], RRE [deg], RTE [m].
type Published = (&'static str, &'static str, [f64; 3]);
const PAPER: [Published; 5] = [
    ("particle filter", "PF", [1.633, 21.064, 3.306]),
    ("residual network", "TartanDrive", [1.833, 27.490, 3.752]),
    ("seen, both losses", "AnyNav", [0.583, 11.420, 1.216]),
    ("seen, motion loss", "L_d only", [0.685, 15.558, 1.394]),
    ("seen, prior loss", "L_p only", [0.658, 14.839, 1.405]),
];
/// The same on the biased domain, of the paper's drives in the real world (TartanDrive).
const PAPER_REAL: [Published; 6] = [
    ("particle filter", "PF", [0.649, 7.320, 1.232]),
    ("residual network", "TartanDrive", [0.754, 5.234, 0.771]),
    ("not fine-tuned", "without", [0.68, 4.45, 1.21]),
    ("fine-tuned, wheel speed held", "fixed wheel speed", [0.66, 3.99, 1.18]),
    ("fine-tuned, inertia held", "fixed inertia", [0.37, 3.48, 0.64]),
    ("fine-tuned", "AnyNav", [0.310, 2.349, 0.543]),
];

/// All tables, for a terminal.
pub fn text(report: &Report) -> String {
    let by_ground = Table {
        title: "absolute trajectory error by the ground that most of the way lies on [m]".to_owned(),
        header: std::iter::once("")
            .chain(report.grounds.iter().map(|ground| ground.ground))
            .map(str::to_owned)
            .collect(),
        rows: report.rows.iter().map(by_ground).collect(),
        ..Table::default()
    };
    let seen = Table {
        title: "seen by the network of both losses, and the plant's (same law)".to_owned(),
        header: ["", "friction at 1 m/s", "plant's", "viscous [s/m]", "plant's"].map(str::to_owned).to_vec(),
        rows: report
            .grounds
            .iter()
            .map(|ground| {
                let [seen, own] = ground.friction.map(|friction| format!("{friction:.2}"));
                let [viscous, own_viscous] = ground.viscous.map(|viscous| format!("{viscous:.4}"));
                vec![ground.ground.to_owned(), seen, own, viscous, own_viscous]
            })
            .collect(),
        ..Table::default()
    };
    overall(report).text()
        + "\n"
        + &by_ground.text()
        + "\n"
        + &tuned(report).text()
        + "\n"
        + &vehicles(report).text()
        + "\n"
        + &seen.text()
        + "\n"
        + &verdict::text(&report.verdicts)
        + &format!(
            "\n  seeing takes {:.2} s for 200 x 200 m in pixels of 0.2 m, {:.2} s for 40 x 40 m of it\n",
            report.seeing.whole_s, report.seeing.part_s
        )
}

fn overall(report: &Report) -> Table {
    let header = ["", "windows", "ATE [m]", "RRE [deg]", "RTE [m]", "the paper's ATE, RRE, RTE"];
    Table {
        title: "motion over 2 s on ground of unknown looks, mean [95 % over drives]".to_owned(),
        note: format!(
            "{} drives of {} windows to learn from, {} batches each; tests from seed {} on",
            report.n_drives[0], report.n_windows, report.batches, report.first_seed
        ),
        header: header.map(str::to_owned).to_vec(),
        rows: report.rows.iter().map(|of| row(of, &PAPER)).collect(),
    }
}

fn tuned(report: &Report) -> Table {
    let header = ["", "windows", "ATE [m]", "RRE [deg]", "RTE [m]", "the paper's ATE, RRE, RTE"];
    Table {
        title: "the same with biased sensors, inertia off by 30 % and no labels, mean [95 % over drives]"
            .to_owned(),
        note: format!("{} drives to tune on", report.n_drives[1]),
        header: header.map(str::to_owned).to_vec(),
        rows: report.tuned_rows.iter().map(|of| row(of, &PAPER_REAL)).collect(),
    }
}

fn vehicles(report: &Report) -> Table {
    let header = ["", "inertia", "true", "wheel speed", "true"];
    let vehicle = |found: &bench::friction::seen::FoundVehicle| {
        let told = |values: [f64; 2]| values.map(|value| format!("{value:.3}"));
        let ([inertia, true_inertia], [wheel, true_wheel]) =
            (told(found.inertia_factor), told(found.wheel_scale));
        vec![found.vehicle.clone(), inertia, true_inertia, wheel, true_wheel]
    };
    Table {
        title: "found along with the ground's coefficients, over what is described or measured [-]"
            .to_owned(),
        header: header.map(str::to_owned).to_vec(),
        rows: report.vehicles.iter().map(vehicle).collect(),
        ..Table::default()
    }
}

fn row(row: &Row, paper: &[Published]) -> Vec<String> {
    let errors = &row.overall;
    let told = |mean: bench::statistics::Mean, digits: usize| {
        format!("{:.digits$} [{:.digits$}, {:.digits$}]", mean.value, mean.low, mean.high)
    };
    let paper = paper.iter().find(|(method, ..)| *method == row.method);
    let paper =
        paper.map_or(String::new(), |(_, name, [ate, rre, rte])| format!("{name}: {ate}, {rre}, {rte}"));
    vec![
        row.method.to_owned(),
        errors.n.to_string(),
        told(errors.ate_m, 2),
        told(errors.rre_deg, 1),
        told(errors.rte_m, 2),
        paper,
    ]
}

fn by_ground(row: &Row) -> Vec<String> {
    let ground = |errors: &Option<bench::friction::seen::Errors>| {
        errors.map_or("-".to_owned(), |errors| format!("{:.2}", errors.ate_m.value))
    };
    std::iter::once(row.method.to_owned()).chain(row.grounds.iter().map(ground)).collect()
}

/// Width of each of the three maps [px], and of what lies between.
const MAP: f64 = 490.0;
const GAP: f64 = 35.0;
const TOP: f64 = 130.0;
const BARS: f64 = 420.0;
/// Friction that the ramp's ends stand for [-].
const MOST_FRICTION: f32 = 1.0;

/// Draws a test world, its friction as seen and as it is, and every method's error, as a PNG of 1600 px width.
///
/// # Errors
/// The encoder refuses.
pub fn picture(report: &Report) -> Result<Vec<u8>, EncodeError> {
    let mut canvas = Canvas::titled(
        TOP + MAP + 100.0 + BARS + 70.0,
        "Friction seen from above, on ground of unknown looks",
        &["Friction at a sliding speed of 1 m/s: dark holds little, bright holds 1 and more"],
    );
    let picture = &report.picture;
    let colour = |of: &[f32], pixel: usize| Ramp::SPEED.at(of[pixel] / MOST_FRICTION);
    let part = |value: f32| (255.0 * value.clamp(0.0, 1.0)) as u8;
    map(picture, 0, "what is seen", &mut canvas, |pixel| {
        let [red, green, blue] = picture.colours[pixel].map(part);
        Rgb(red, green, blue)
    });
    map(picture, 1, "friction as the network sees it", &mut canvas, |pixel| {
        colour(&picture.friction[0], pixel)
    });
    map(picture, 2, "friction of the plant's cells", &mut canvas, |pixel| {
        colour(&picture.friction[1], pixel)
    });
    bars(report, &mut canvas);
    canvas.png()
}

fn map(picture: &Picture, place: usize, title: &str, canvas: &mut Canvas, colour: impl Fn(usize) -> Rgb) {
    let x = MARGIN + place as f64 * (MAP + GAP);
    canvas.text((x, TOP - 8.0), title, TextStyle::new(20, Anchor::Start).bold());
    let (n, n_rows) = (MAP as usize, picture.colours.len() / picture.width);
    let pixels = (0..n * n).map(|index| {
        let (row, col) = (index / n * n_rows / n, index % n * picture.width / n);
        colour(row * picture.width + col)
    });
    canvas.image(x, TOP, &Image { width: n, pixels: pixels.collect() });
}

fn bars(report: &Report, canvas: &mut Canvas) {
    let top = TOP + MAP + 80.0;
    let title = "Absolute trajectory error over 2 s [m], mean and 95 % over drives; hollow: the paper's";
    canvas.text((MARGIN, top - 12.0), title, TextStyle::new(20, Anchor::Start).bold());
    let most = report.rows.iter().map(|row| row.overall.ate_m.high).fold(2.0, f64::max);
    let axes = Axes {
        frame: Rect { x: 260.0, y: top, width: PAGE_WIDTH - 260.0 - MARGIN - 40.0, height: BARS },
        x: Range { low: 0.0, high: most },
        y: Range { low: 0.0, high: report.rows.len() as f64 },
    };
    for (index, row) in report.rows.iter().enumerate() {
        let y = report.rows.len() as f64 - index as f64 - 0.5;
        let at = |value: f64| axes.place(value, y);
        let mean = row.overall.ate_m;
        canvas.text((axes.frame.x - 12.0, at(0.0).1 + 6.0), row.method, TextStyle::new(18, Anchor::End));
        canvas.line(at(0.0), at(mean.value), Stroke::solid(Rgb::GOAL, 16.0));
        canvas.line(at(mean.low), at(mean.high), Stroke::solid(Rgb::INK, 2.0));
        if let Some((.., [ate_m, ..])) = PAPER.iter().find(|(method, ..)| *method == row.method) {
            canvas.circle(at(*ate_m), 6.0, Rgb::WHITE, Stroke::solid(Rgb::INK, 2.0));
        }
    }
    axes.draw_frame(canvas);
    axes.draw_x_ticks(canvas);
}
