//! What known friction brings the local planner: the table, and one course as each drove it.

use bench::slippery::{Course, Report, Row, Run, Told};
use bench::statistics::Mean;

use crate::axes::{Axes, Range, number};
use crate::canvas::{Anchor, Canvas, EncodeError, MARGIN, PAGE_WIDTH, Rect, Stroke, TextStyle};
use crate::colour::{Ramp, Rgb};
use crate::table::{Table, probability};
use crate::verdict;

const TOP: f64 = 130.0;
const BARS_HEIGHT: f64 = 260.0;
const BETWEEN: f64 = 120.0;
const GAP: f64 = 60.0;
const BELOW: f64 = 110.0;
const LEFT: f64 = 100.0;
/// Around what is shown of a course [m].
const AROUND_M: f64 = 12.0;
const TEXT: TextStyle = TextStyle::new(18, Anchor::Start);
const SLICK: Rgb = Rgb(0xb9, 0xd7, 0xee);
const NOTE: &str = "\
slid: drives with the rear axle going 10 degrees or more from where it points for 0.3 s or more, at 1 m/s or more
time: of drives through all goals; means with 95 % bootstrap over courses";

/// The table, the rows beside each other, the rules, and how a drive that did not arrive ended.
pub fn text(report: &Report) -> String {
    let header = ["told", "arrived", "slid", "beyond limits", "collision", "sliding [s]", "time [s]"];
    let table = Table {
        title: format!(
            "{} courses of {} at up to {} m/s, seed {}",
            report.n_courses, report.vehicle, report.speed_mps, report.seed
        ),
        note: NOTE.to_owned(),
        header: header.map(str::to_owned).to_vec(),
        rows: report.rows.iter().map(cells).collect(),
    };
    let beside = Table {
        title: "Told cells, on the same courses as".to_owned(),
        note: String::new(),
        header: ["told", "slid only with cells / only with it", "p", "time less [s]"]
            .map(str::to_owned)
            .to_vec(),
        rows: report
            .comparisons
            .iter()
            .map(|beside| {
                vec![
                    beside.other.name().to_owned(),
                    format!("{} / {}", beside.n_only_cells, beside.n_only_other),
                    probability(beside.p_value),
                    told(beside.time_difference_s),
                ]
            })
            .collect(),
    };
    let failed = report.runs.iter().filter(|run| !run.arrived());
    let failed: String = failed.map(|run| format!("  {}\n", run_text(run))).collect();
    format!("{}\n{}\n{}{failed}", table.text(), beside.text(), verdict::text(&report.verdicts))
}

fn cells(row: &Row) -> Vec<String> {
    let share = |n: usize, [_, low, high]: [f64; 3]| {
        format!("{n} of {} [{:.0}, {:.0} %]", row.n, 100.0 * low, 100.0 * high)
    };
    vec![
        row.told.name().to_owned(),
        share(row.n_goal, row.goal),
        share(row.n_slid, row.slid),
        row.n_attitude.to_string(),
        row.n_collision.to_string(),
        told(row.slid_s),
        told(row.time_s),
    ]
}

fn told(mean: Option<Mean>) -> String {
    let Some(Mean { value, low, high }) = mean else { return "-".to_owned() };
    let [value, low, high] = [value, low, high].map(|value| number(value, 2));
    format!("{value} [{low}, {high}]")
}

/// How one drive ended, in a line.
pub fn run_text(run: &Run) -> String {
    format!(
        "told {:<8}course {:<4} {} after {:.1} s, slid for {:.1} s",
        run.told.name(),
        run.course,
        run.outcome,
        run.time_s,
        run.slid_s
    )
}

/// Draws the shares of drives that slid and their times, and the course on which knowing made the most of a difference, as a
/// PNG 1600 px wide.
///
/// # Errors
/// The encoder refuses.
pub fn picture(report: &Report) -> Result<Vec<u8>, EncodeError> {
    let plans = report.rows.len() as f64;
    let side = (PAGE_WIDTH - LEFT - MARGIN - GAP * (plans - 1.0)) / plans;
    let plan_top = TOP + BARS_HEIGHT + BETWEEN;
    let subtitle = format!(
        "{} courses of {} at up to {} m/s, seed {}; bars and whiskers are 95 % intervals",
        report.n_courses, report.vehicle, report.speed_mps, report.seed
    );
    let height = plan_top + side + BELOW;
    let mut canvas =
        Canvas::titled(height, "What the controller is told of the ground's friction", &[&subtitle]);
    let half = 0.5 * (PAGE_WIDTH - LEFT - MARGIN - 2.0 * GAP);
    let frame = |x: f64| Rect { x, y: TOP, width: half, height: BARS_HEIGHT };
    draw_slides(report, frame(LEFT), &mut canvas);
    draw_times(report, frame(LEFT + half + 2.0 * GAP), &mut canvas);
    if let Some((number, course)) = shown(report) {
        let runs = report.runs.iter().filter(|run| run.course == number);
        for (place, run) in runs.enumerate() {
            let x = LEFT + (side + GAP) * place as f64;
            let frame = Rect { x, y: plan_top, width: side, height: side };
            draw_plan(course, run, (frame, report.speed_mps), &mut canvas);
        }
    }
    canvas.png()
}

/// The course on which whoever was told nothing slid longest.
fn shown(report: &Report) -> Option<(u64, &Course)> {
    let of_nothing = report.runs.iter().filter(|run| run.told == Told::Nothing);
    let worst = of_nothing.max_by(|a, b| a.slid_s.total_cmp(&b.slid_s))?;
    Some((worst.course, report.courses.get(worst.course as usize)?))
}

fn named(report: &Report, axes: &Axes, canvas: &mut Canvas) {
    for (place, row) in report.rows.iter().enumerate() {
        let (x, _) = axes.place(place as f64, axes.y.low);
        let style = TextStyle::new(16, Anchor::Middle).coloured(Rgb::INK_SOFT);
        canvas.text((x, axes.frame.bottom() + 24.0), &format!("told {}", row.told.name()), style);
    }
}

fn draw_panel(heading: &str, axes: &Axes, canvas: &mut Canvas) {
    axes.draw_rules(canvas);
    axes.draw_frame(canvas);
    axes.draw_y_ticks(canvas);
    canvas.text((axes.frame.x, axes.frame.y - 14.0), heading, TEXT.bold());
}

fn draw_slides(report: &Report, frame: Rect, canvas: &mut Canvas) {
    let x = Range { low: -0.5, high: report.rows.len() as f64 - 0.5 };
    let axes = Axes { frame, x, y: Range { low: 0.0, high: 100.0 } };
    draw_panel("drives that slid [%]", &axes, canvas);
    for (place, row) in report.rows.iter().enumerate() {
        let [share, low, high] = row.slid.map(|share| 100.0 * share);
        draw_value(Mean { value: share, low, high }, place, &axes, canvas);
    }
    named(report, &axes, canvas);
}

fn draw_times(report: &Report, frame: Rect, canvas: &mut Canvas) {
    let most_s = report.rows.iter().filter_map(|row| row.time_s).map(|mean| mean.high).fold(1.0, f64::max);
    let x = Range { low: -0.5, high: report.rows.len() as f64 - 0.5 };
    let axes = Axes { frame, x, y: Range { low: 0.0, high: 1.1 * most_s } };
    draw_panel("time of those that arrived [s]", &axes, canvas);
    for (place, row) in report.rows.iter().enumerate() {
        if let Some(mean) = row.time_s {
            draw_value(mean, place, &axes, canvas);
        }
    }
    named(report, &axes, canvas);
}

fn draw_value(Mean { value, low, high }: Mean, place: usize, axes: &Axes, canvas: &mut Canvas) {
    let at = |value: f64| axes.place(place as f64, value);
    let ((x, top), (_, bottom)) = (at(value), at(axes.y.low));
    canvas.rect(Rect { x: x - 40.0, y: top, width: 80.0, height: bottom - top }, Rgb::ROLL, 0.35);
    canvas.line(at(low), at(high), Stroke::solid(Rgb::ROLL, 3.0));
    canvas.circle(at(value), 6.0, Rgb::ROLL, Stroke::solid(Rgb::WHITE, 1.5));
}

fn draw_plan(course: &Course, run: &Run, (frame, most_mps): (Rect, f64), canvas: &mut Canvas) {
    let places = || course.goals_m.iter().copied().chain([[course.start[0], course.start[1]]]);
    let [x, y] = [0, 1].map(|axis| {
        let [low, high] = places().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], place_m| {
            [low.min(place_m[axis]), high.max(place_m[axis])]
        });
        [0.5 * (low + high), 0.5 * (high - low)]
    });
    let half_m = x[1].max(y[1]) + AROUND_M;
    let range = |[middle, _]: [f64; 2]| Range { low: middle - half_m, high: middle + half_m };
    let axes = Axes { frame, x: range(x), y: range(y) };
    let per_m = frame.width / (2.0 * half_m);
    canvas.clipped(frame, |canvas| {
        for slick in &course.slicks {
            let centre = axes.place(slick.centre_m[0], slick.centre_m[1]);
            canvas.circle(centre, per_m * slick.radius_m, SLICK, Stroke::solid(SLICK, 1.0));
            canvas.text(centre, slick.kind, TextStyle::new(15, Anchor::Middle).coloured(Rgb::INK_SOFT));
        }
        for post_m in &course.posts_m {
            canvas.circle(axes.place(post_m[0], post_m[1]), 5.0, Rgb::INK, Stroke::solid(Rgb::INK, 1.0));
        }
        for (number, goal_m) in course.goals_m.iter().enumerate() {
            let at = axes.place(goal_m[0], goal_m[1]);
            canvas.circle(at, per_m * 3.0, Rgb::WHITE, Stroke::solid(Rgb::INK_SOFT, 1.5));
            canvas.text((at.0, at.1 + 5.0), &(number + 1).to_string(), TextStyle::new(15, Anchor::Middle));
        }
        draw_trail(run, &axes, most_mps, canvas);
    });
    axes.draw_frame(canvas);
    axes.draw_x_ticks(canvas);
    axes.draw_y_ticks(canvas);
    axes.draw_x_label(canvas, "east x [m]");
    let told = format!(
        "told {}: {} after {:.1} s, slid {:.1} s",
        run.told.name(),
        run.outcome,
        run.time_s,
        run.slid_s
    );
    canvas.text((frame.x, frame.y - 14.0), &told, TextStyle::new(16, Anchor::Start).bold());
    let meaning = "colour: speed, light is fast; red rims: it slides; dots: posts";
    canvas.text(
        (frame.x, frame.bottom() + 74.0),
        meaning,
        TextStyle::new(15, Anchor::Start).coloured(Rgb::INK_SOFT),
    );
}

fn draw_trail(run: &Run, axes: &Axes, most_mps: f64, canvas: &mut Canvas) {
    for moment in &run.trail {
        let colour = Ramp::SPEED.at((0.15 + 0.85 * moment.speed_mps / most_mps).min(1.0) as f32);
        let rim = if moment.slides { Rgb::FAILURE } else { colour };
        canvas.circle(axes.place(moment.pose[0], moment.pose[1]), 4.0, colour, Stroke::solid(rim, 2.0));
    }
}
