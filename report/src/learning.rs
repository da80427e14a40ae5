//! The learning benchmark: errors over unevenness, what the evidence weighs, and calibration, as text, picture and page.

mod calibration;
mod curves;
mod page;
mod tables;
mod text;
mod weights;

use bench::learning::{Report, Row};

use crate::canvas::EncodeError;
use crate::canvas::{Anchor, Canvas, Rect, Stroke, TextStyle};
use crate::colour::Rgb;

pub use page::page;
pub use text::{duration, text};

const LEFT: f64 = 110.0;
const CURVES_TOP: f64 = 190.0;
const CURVES_HEIGHT: f64 = 480.0;
const WEIGHTS_TOP: f64 = 850.0;
const WEIGHTS_HEIGHT: f64 = 360.0;
const CALIBRATION_TOP: f64 = 1450.0;
const PAGE_HEIGHT: f64 = 2060.0;

/// Draws the benchmark as a PNG of 1600 px width.
///
/// # Errors
/// The encoder refuses.
pub fn picture(report: &Report) -> Result<Vec<u8>, EncodeError> {
    drawn(report).png()
}

fn drawn(report: &Report) -> Canvas {
    let mut canvas = Canvas::titled(PAGE_HEIGHT, "Learning benchmark", &[&subtitle(report)]);
    let frame = Rect { x: LEFT, y: CURVES_TOP, width: 1080.0, height: CURVES_HEIGHT };
    curves::draw(report, frame, &mut canvas);
    let frame = Rect { x: LEFT, y: WEIGHTS_TOP, width: 680.0, height: WEIGHTS_HEIGHT };
    weights::draw_over_unevenness(report, frame, &mut canvas);
    let frame = Rect { x: 900.0, width: 660.0, ..frame };
    weights::draw_by_ground(report, frame, &mut canvas);
    calibration::draw(report, (LEFT, CALIBRATION_TOP), &mut canvas);
    canvas
}

fn subtitle(report: &Report) -> String {
    let testbed = &report.testbed;
    format!(
        "{} · testbed of seed {}, {} test maps at height scale {:.2}, {:.1} % of {} footprints out of distribution · {} \
         seeds",
        testbed.vehicle,
        testbed.seed,
        testbed.n_maps,
        testbed.test_height_scale,
        100.0 * testbed.share_out_of_distribution,
        testbed.n_test,
        report.n_seeds
    )
}

/// Colour and dash pattern of a row, the same in all panels.
fn look(row: Row) -> (Rgb, &'static str) {
    match row {
        Row::Pietra => (Rgb::FAILURE, ""),
        Row::EvoraPhysicsPrior => (Rgb::PITCH, ""),
        Row::Switch => (Rgb(0xb0, 0x8a, 0x00), "10 5"),
        Row::PhysicsInformed => (Rgb(0x1a, 0x8f, 0x6a), ""),
        Row::Vanilla => (Rgb::ROLL, ""),
        Row::PhysicsPrior => (Rgb::INK, "4 5"),
        Row::EvoraPhysicsLoss => (Rgb(0xc4, 0x66, 0xb4), "10 5"),
        Row::Evora => (Rgb::UNFAMILIAR, ""),
        Row::UniformPrior => (Rgb::INK_SOFT, "2 4"),
    }
}

fn stroke(row: Row) -> Stroke {
    let (colour, dash) = look(row);
    Stroke { colour, width: if row == Row::Pietra { 4.0 } else { 2.5 }, dash }
}

/// Lines and names, one below the other.
fn draw_legend(rows: &[Row], (x, y): (f64, f64), canvas: &mut Canvas) {
    for (place, &row) in rows.iter().enumerate() {
        let y = y + 30.0 * place as f64;
        canvas.line((x, y - 6.0), (x + 44.0, y - 6.0), stroke(row));
        canvas.text((x + 56.0, y), row.name(), TextStyle::new(17, Anchor::Start));
    }
}

/// Title of a panel, above what labels its axis.
fn draw_title(title: &str, frame: Rect, canvas: &mut Canvas) {
    canvas.text((frame.x - 62.0, frame.y - 46.0), title, TextStyle::new(20, Anchor::Start).bold());
}
