//! A dataset as a picture: what was driven over one map, coloured by linear traction, and how often every value of the
//! four parameters was measured.

use bench::collection::Collection;
use bicycle::Vehicle;
use evidential::{Example, PARAMETER_BINS, PARAMETER_NAMES};
use traversability::N_BINS;

use crate::axes::{Axes, Range};
use crate::canvas::{Anchor, Canvas, Point, Rect, Stroke, TextStyle};
use crate::canvas::{EncodeError, MARGIN, PAGE_WIDTH};
use crate::colour::{Ramp, Rgb};
use crate::colour_bar::ColourBar;
use crate::drive::{DrivePicture, relief};
use crate::view::{self, LEFT};

const HEADER: f64 = 110.0;
const MAP_SIDE: f64 = 880.0;
const BAR_X: f64 = LEFT + MAP_SIDE + 20.0;
const HISTOGRAM_X: f64 = 1165.0;
const HISTOGRAM_HEIGHT: f64 = 130.0;
const HISTOGRAM_STEP: f64 = 235.0;
const BELOW: f64 = 90.0;

const TEXT: TextStyle = TextStyle::new(17, Anchor::Start);
const SOFT: TextStyle = TextStyle::new(15, Anchor::Middle).coloured(Rgb::INK_SOFT);

const VALUE: TextStyle = TextStyle::new(12, Anchor::Middle).coloured(Rgb::INK_SOFT);

/// Draws a collection as a PNG of 1600 px width.
///
/// # Errors
/// The encoder refuses.
pub fn picture(collection: &Collection, vehicle: &Vehicle) -> Result<Vec<u8>, EncodeError> {
    page(collection, vehicle).png()
}

fn page(collection: &Collection, vehicle: &Vehicle) -> Canvas {
    let origin = &collection.dataset.origin;
    let n = collection.dataset.examples.len();
    let title = format!("{}: {n} labelled footprints", origin.vehicle);
    let mut canvas = Canvas::titled(HEADER + MAP_SIDE + BELOW, &title, &[&origin.provenance]);
    draw_map(collection, vehicle, &mut canvas);
    let bar = ColourBar { title: ["linear", "traction [-]"], low: 0.0, high: 1.0, ramp: Ramp::SPEED };
    bar.draw((BAR_X, HEADER), &mut canvas);
    draw_keys(&mut canvas);
    for parameter in 0..PARAMETER_NAMES.len() {
        let y = HEADER + 20.0 + HISTOGRAM_STEP * parameter as f64;
        draw_histogram(&collection.dataset.examples, parameter, y, &mut canvas);
    }
    canvas
}

/// What the other colours mean.
fn draw_keys(canvas: &mut Canvas) {
    let keys = [(Rgb::INK_SOFT, "masked"), (Rgb::ROLL, "measured"), (Rgb::PITCH, "prior")];
    for (row, (colour, meaning)) in keys.into_iter().enumerate() {
        let y = HEADER + 300.0 + 30.0 * row as f64;
        canvas.rect(Rect { x: BAR_X, y, width: 24.0, height: 8.0 }, colour, 1.0);
        canvas.text((BAR_X + 32.0, y + 10.0), meaning, TEXT);
    }
}

fn draw_map(collection: &Collection, vehicle: &Vehicle, canvas: &mut Canvas) {
    // The first map, whatever its number.
    let Some((world, first)) = collection.worlds.first().zip(collection.trials.first()) else { return };
    let slot = view::Slot {
        left: LEFT,
        top: HEADER,
        width: MAP_SIDE,
        height_min: 0.5 * MAP_SIDE,
        height_max: MAP_SIDE,
    };
    let axes = view::map_axes(world.bounds(), 0.0, world.bounds(), slot);
    let ground = DrivePicture {
        title: "",
        subtitles: &[],
        world,
        risk: None,
        known: None,
        unfamiliar: None,
        driven: &[],
        planned: &[],
        walked: &[],
        areas: None,
        start_m: [0.0; 2],
        goal_m: [0.0; 2],
        goal_radius_m: 0.0,
        failure: None,
        vehicle,
    };
    canvas.image(axes.frame.x, axes.frame.y, &relief(&ground, &axes));
    canvas.clipped(axes.frame, |canvas| {
        let on_map = |example: &&Example| {
            collection.trials.get(example.drive as usize).is_some_and(|trial| trial.map == first.map)
        };
        let examples: Vec<&Example> = collection.dataset.examples.iter().filter(on_map).collect();
        for drive in examples.chunk_by(|a, b| a.drive == b.drive) {
            draw_path(drive, &axes, canvas);
        }
    });
    axes.draw_labelled(canvas, "east x [m]", "north y [m]");
}

/// One drive; a piece of the way has the colour of its first label.
fn draw_path(drive: &[&Example], axes: &Axes, canvas: &mut Canvas) {
    let points: Vec<Point> =
        drive.iter().map(|example| axes.place(example.pose[0], example.pose[1])).collect();
    canvas.polyline(&points, Stroke::solid(Rgb::INK, 7.0));
    for (ends, example) in points.windows(2).zip(drive) {
        let traction = example.measured[0];
        let colour = if traction.is_nan() { Rgb::INK_SOFT } else { Ramp::SPEED.at(traction) };
        canvas.polyline(ends, Stroke::solid(colour, 4.5));
    }
    if let Some(&start) = points.first() {
        canvas.circle(start, 5.0, Rgb::WHITE, Stroke::solid(Rgb::INK, 2.0));
    }
}

/// Shares of the bins as bars; over them, as steps, what the physics prior expects on average.
fn draw_histogram(examples: &[Example], parameter: usize, y: f64, canvas: &mut Canvas) {
    let frame =
        Rect { x: HISTOGRAM_X, y, width: PAGE_WIDTH - MARGIN - HISTOGRAM_X, height: HISTOGRAM_HEIGHT };
    let axes = Axes { frame, x: Range { low: 0.0, high: N_BINS as f64 }, y: Range { low: 0.0, high: 1.0 } };
    let (measured, expected, n_valid) = shares(examples, parameter);
    let name = PARAMETER_NAMES[parameter];
    canvas.text((frame.x, y - 12.0), name, TEXT.bold());
    let told = format!("{:.1} % mean something", 100.0 * n_valid as f64 / examples.len().max(1) as f64);
    canvas.text((frame.right(), y - 12.0), &told, TextStyle::new(15, Anchor::End).coloured(Rgb::INK_SOFT));
    axes.draw_rules(canvas);
    for (bin, share) in measured.into_iter().enumerate() {
        let (x, top) = axes.place(bin as f64, share);
        let width = frame.width / N_BINS as f64;
        canvas.rect(
            Rect { x: x + 2.0, y: top, width: width - 4.0, height: frame.bottom() - top },
            Rgb::ROLL,
            0.8,
        );
        let value = PARAMETER_BINS[parameter].values()[bin];
        let value = if parameter < 2 { format!("{value}") } else { format!("{:.1}", value.to_degrees()) };
        canvas.text((x + 0.5 * width, frame.bottom() + 20.0), &value, VALUE);
    }
    let steps: Vec<Point> = (expected.into_iter().enumerate())
        .flat_map(|(bin, share)| [axes.place(bin as f64, share), axes.place(bin as f64 + 1.0, share)])
        .collect();
    canvas.polyline(&steps, Stroke::solid(Rgb::PITCH, 2.5));
    axes.draw_frame(canvas);
    axes.draw_y_ticks(canvas);
    let unit = if parameter < 2 { "value of the bin [-]" } else { "value of the bin [deg]" };
    canvas.text((frame.x + 0.5 * frame.width, frame.bottom() + 42.0), unit, SOFT);
}

/// Share of each bin among what was measured, the prior's mean over the same examples, and their number.
fn shares(examples: &[Example], parameter: usize) -> ([f64; N_BINS], [f64; N_BINS], usize) {
    let (mut measured, mut expected, mut n) = ([0.0; N_BINS], [0.0; N_BINS], 0);
    for example in examples {
        let Some(bin) = PARAMETER_BINS[parameter].bin_of(example.measured[parameter]) else { continue };
        n += 1;
        measured[bin] += 1.0;
        for (sum, probability) in expected.iter_mut().zip(example.prior[parameter]) {
            *sum += f64::from(probability);
        }
    }
    let over_n = |sums: [f64; N_BINS]| sums.map(|sum| sum / f64::from(n.max(1)));
    (over_n(measured), over_n(expected), n as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_count_what_means_something() {
        let mut prior = [[0.0; N_BINS]; 4];
        prior[0][3] = 1.0;
        let example = |traction: f32| Example {
            features: Vec::new(),
            measured: [traction, f32::NAN, 0.0, 0.0],
            prior,
            unevenness_m: 0.0,
            drive: 0,
            pose: [0.0; 3],
        };
        let examples = [example(0.0), example(1.0), example(1.2), example(f32::NAN), example(0.55)];
        let (measured, expected, n) = shares(&examples, 0);
        assert_eq!(n, 4);
        assert_eq!((measured[0], measured[6], measured[11]), (0.25, 0.25, 0.5));
        assert_eq!(expected[3], 1.0);
        assert_eq!(shares(&examples, 1), ([0.0; N_BINS], [0.0; N_BINS], 0));
    }
}
