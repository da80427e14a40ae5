//! The column beside the map: what colours and marks mean.

use super::relief::hatch;
use super::{DrivePicture, map};
use crate::canvas::{Anchor, Canvas, Image, Point, Rect, Stroke, TextStyle};
use crate::colour::{Ramp, Rgb};
use crate::colour_bar::{self, ColourBar};

/// Height of the whole column [px].
pub(super) const HEIGHT: f64 = 560.0;

const ROW: f64 = 34.0;
const TEXT: TextStyle = TextStyle::new(17, Anchor::Start);

pub(super) fn draw(picture: &DrivePicture<'_>, (x, y): Point, canvas: &mut Canvas) {
    let mut bar_x = x;
    if !picture.driven.is_empty() {
        let scale_mps = map::speed_scale_mps(picture);
        let bar = ColourBar { title: ["speed", "[m/s]"], low: 0.0, high: scale_mps, ramp: Ramp::SPEED };
        bar.draw((bar_x, y), canvas);
        bar_x += 130.0;
    }
    if let Some(risk) = &picture.risk {
        let bar = ColourBar {
            title: split_label(risk.label),
            low: f64::from(risk.harmless),
            high: f64::from(risk.worst),
            ramp: Ramp::RISK,
        };
        bar.draw((bar_x, y), canvas);
    }
    let bars_height = if bar_x > x || picture.risk.is_some() { colour_bar::HEIGHT + 76.0 } else { 0.0 };
    for (row, entry) in entries(picture).into_iter().enumerate() {
        let centre = (x + 14.0, y + bars_height + 10.0 + ROW * row as f64);
        entry.draw(centre, canvas);
    }
}

/// "name [unit]" as two lines.
fn split_label(label: &str) -> [&str; 2] {
    match label.rfind('[') {
        Some(at) => [label[..at].trim_end(), &label[at..]],
        None => [label, ""],
    }
}

/// One mark and its meaning.
struct Entry {
    mark: Mark,
    meaning: &'static str,
}

enum Mark {
    Swatch(Rgb),
    Hatch(Rgb),
    KeepOut,
    Geofence,
    Driven,
    Walked,
    Planned,
    Footprint,
    Start,
    Goal,
    Failure,
}

fn entries(picture: &DrivePicture<'_>) -> Vec<Entry> {
    let patches = picture.world.patches.values();
    let vegetation = patches.iter().any(|patch| patch.vegetation_height_m > 0.0);
    let obstacles = patches.iter().any(|patch| patch.class == terrain::TerrainClass::Obstacle);
    let driven = !picture.driven.is_empty();
    let unfamiliar = picture.unfamiliar.is_some_and(|cells| cells.values().contains(&true));
    let keeps_out = picture.areas.is_some_and(|areas| !areas.keep_out_m.is_empty());
    let is_fenced = picture.areas.is_some_and(|areas| !areas.geofence_m.is_empty());
    let soft = Ramp::GROUND.at(0.5).blend(Rgb::VEGETATION, 0.6);
    let unseen = Ramp::GROUND.at(0.5).blend(Rgb::UNSEEN, 0.62);
    [
        (vegetation, Mark::Swatch(soft), "plants, denser = higher"),
        (obstacles, Mark::Swatch(Rgb::OBSTACLE), "obstacle"),
        (picture.known.is_some(), Mark::Swatch(unseen), "never seen"),
        (unfamiliar, Mark::Hatch(Ramp::GROUND.at(0.5)), "unlike the training"),
        (keeps_out, Mark::KeepOut, "area to keep out of"),
        (is_fenced, Mark::Geofence, "geofence"),
        (driven, Mark::Driven, "driven, by speed"),
        (!picture.walked.is_empty(), Mark::Walked, "people who walked about"),
        (!picture.planned.is_empty(), Mark::Planned, "planned"),
        (driven, Mark::Footprint, "vehicle"),
        (true, Mark::Start, "start"),
        (true, Mark::Goal, "goal and tolerance"),
        (driven && picture.failure.is_some(), Mark::Failure, "end of the drive"),
    ]
    .into_iter()
    .filter_map(|(shown, mark, meaning)| shown.then_some(Entry { mark, meaning }))
    .collect()
}

impl Entry {
    fn draw(&self, centre: Point, canvas: &mut Canvas) {
        let (x, y) = centre;
        let ends = [(x - 15.0, y), (x + 15.0, y)];
        let plate = Rect { x: x - 14.0, y: y - 9.0, width: 28.0, height: 18.0 };
        let (left, top, right, bottom) = (plate.x, plate.y, plate.right(), plate.bottom());
        let corners = [(left, bottom), (right, bottom), (right, top), (left, top), (left, bottom)];
        match self.mark {
            Mark::Swatch(colour) => {
                canvas.rect(plate, colour, 1.0);
                canvas.frame(plate, Stroke::solid(Rgb::INK_SOFT, 1.0));
            }
            Mark::Hatch(colour) => {
                let width = plate.width as usize;
                let pixel = |i: usize| hatch([i % width, i / width], colour);
                let pixels = (0..width * plate.height as usize).map(pixel).collect();
                canvas.image(plate.x, plate.y, &Image { width, pixels });
                canvas.frame(plate, Stroke::solid(Rgb::INK_SOFT, 1.0));
            }
            Mark::Driven => draw_driven_sample(ends, canvas),
            Mark::Walked => map::walker_line(&ends, canvas),
            Mark::Planned => map::planned_line(&ends, canvas),
            Mark::KeepOut => map::keep_out_mark(&corners, canvas),
            Mark::Geofence => map::geofence_line(&ends, canvas),
            Mark::Footprint => map::footprint_mark(&corners, canvas),
            Mark::Start => map::start_marker(centre, canvas),
            Mark::Goal => map::goal_marker(centre, canvas),
            Mark::Failure => map::failure_marker(centre, canvas),
        }
        canvas.text((x + 32.0, y + 6.0), self.meaning, TEXT);
    }
}

fn draw_driven_sample([from, to]: [Point; 2], canvas: &mut Canvas) {
    canvas.line(from, to, Stroke::solid(Rgb::INK, 9.0));
    for step in 0..10 {
        let at = |i: u32| from.0 + (to.0 - from.0) * f64::from(i) / 10.0;
        let colour = Ramp::SPEED.at(step as f32 / 9.0);
        canvas.line((at(step), from.1), (at(step + 1), from.1), Stroke::solid(colour, 5.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unit_goes_to_the_second_line() {
        assert_eq!(split_label("worst traction [-]"), ["worst traction", "[-]"]);
        assert_eq!(split_label("risk"), ["risk", ""]);
    }
}
