//! What is meant to be driven, what else was tried, and what moves, as markers.

use bus::message::{FutureRecord, PlanRecord, TrackRecord};

use crate::message::{ColorRgba, Duration, Header, Marker, MarkerArray, Point, Pose, Vector3};

/// How long a marker is shown after nobody tells of it any more [s].
const LIFETIME_S: i32 = 1;
/// Width of a line [m].
const LINE_M: f64 = 0.05;
/// Height of what moves, which nobody has measured [m].
const HEIGHT_M: f64 = 1.5;
/// Colours of places that are passed slowly and at full speed.
const SLOW: ColorRgba = ColorRgba { r: 0.9, g: 0.2, b: 0.1, a: 1.0 };
const FAST: ColorRgba = ColorRgba { r: 0.1, g: 0.8, b: 0.2, a: 1.0 };
/// Of futures that were tried: there are many, and the plan lies above them.
const FUTURES_OPACITY: f32 = 0.35;
const FUTURES_LINE_M: f64 = 0.02;
/// The colour of what moves.
const MOVING: ColorRgba = ColorRgba { r: 0.2, g: 0.4, b: 1.0, a: 0.7 };

/// The way that is meant to be driven as a line, red where it is slow and green at `speed_max_mps`.
pub fn plan(header: Header, places: &[PlanRecord], speed_max_mps: f64) -> MarkerArray {
    let point = |place: &PlanRecord| Point { x: place.position_m[0], y: place.position_m[1], z: 0.0 };
    let color = |place: &PlanRecord| between((place.speed_mps.abs() / speed_max_mps).clamp(0.0, 1.0) as f32);
    let line = Marker {
        points: places.iter().map(point).collect(),
        colors: places.iter().map(color).collect(),
        ..marker(header, "plan", Marker::LINE_STRIP)
    };
    MarkerArray { markers: vec![line] }
}

/// Futures that were tried, each a line, from green for the cheapest to red for the dearest of those that are told.
pub fn futures(header: &Header, places: &[FutureRecord]) -> MarkerArray {
    let futures: Vec<_> = places.chunk_by(|one, next| one.number == next.number).collect();
    let n_others = futures.len().saturating_sub(1).max(1);
    // By their order: what breaks a limit costs so much more that all others would look alike.
    let rank = |cost_s: f64| futures.iter().filter(|other| other[0].cost_s < cost_s).count();
    let line = |(id, future): (usize, &&[FutureRecord])| {
        let share = 1.0 - rank(future[0].cost_s) as f32 / n_others as f32;
        let point = |place: &FutureRecord| Point { x: place.position_m[0], y: place.position_m[1], z: 0.0 };
        Marker {
            id: id as i32,
            points: future.iter().map(point).collect(),
            scale: Vector3 { x: FUTURES_LINE_M, ..Vector3::default() },
            color: ColorRgba { a: FUTURES_OPACITY, ..between(share) },
            ..marker(header.clone(), "futures", Marker::LINE_STRIP)
        }
    };
    MarkerArray { markers: futures.iter().enumerate().map(line).collect() }
}

/// What moves: a cylinder as wide as it is, and an arrow to where it will be in a second.
pub fn moving(header: &Header, tracks: &[TrackRecord]) -> MarkerArray {
    let of_track = |track: &TrackRecord| {
        let [x, y] = track.position_m;
        let [dx, dy] = track.velocity_mps;
        let id = (track.number & i32::MAX as u64) as i32;
        let body = Marker {
            id,
            pose: Pose { position: Point { x, y, z: 0.5 * HEIGHT_M }, ..Pose::default() },
            scale: Vector3 { x: 2.0 * track.radius_m, y: 2.0 * track.radius_m, z: HEIGHT_M },
            color: MOVING,
            ..marker(header.clone(), "moving", Marker::CYLINDER)
        };
        let arrow = Marker {
            id,
            points: vec![Point { x, y, z: 0.0 }, Point { x: x + dx, y: y + dy, z: 0.0 }],
            scale: Vector3 { x: LINE_M, y: 2.0 * LINE_M, z: 0.0 },
            color: MOVING,
            ..marker(header.clone(), "velocity", Marker::ARROW)
        };
        [body, arrow]
    };
    MarkerArray { markers: tracks.iter().flat_map(of_track).collect() }
}

fn marker(header: Header, ns: &str, shape: i32) -> Marker {
    Marker {
        header,
        ns: ns.to_owned(),
        r#type: shape,
        scale: Vector3 { x: LINE_M, ..Vector3::default() },
        color: SLOW,
        lifetime: Duration { sec: LIFETIME_S, nanosec: 0 },
        ..Marker::default()
    }
}

fn between(share: f32) -> ColorRgba {
    let mix = |slow: f32, fast: f32| (1.0 - share) * slow + share * fast;
    ColorRgba { r: mix(SLOW.r, FAST.r), g: mix(SLOW.g, FAST.g), b: mix(SLOW.b, FAST.b), a: 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plan_is_a_line_whose_colours_tell_speeds() {
        let place =
            |x_m, speed_mps| PlanRecord { position_m: [x_m, 2.0], speed_mps, ..PlanRecord::default() };
        let told = plan(Header::default(), &[place(1.0, 0.0), place(2.0, -3.0)], 2.0);
        let [line] = &told.markers[..] else { panic!("one line: {told:?}") };
        assert_eq!((line.r#type, line.lifetime.sec), (Marker::LINE_STRIP, 1));
        assert_eq!(line.points[1], Point { x: 2.0, y: 2.0, z: 0.0 });
        assert_eq!(line.colors, [SLOW, FAST]);
    }

    #[test]
    fn futures_are_lines_from_green_for_the_cheapest_to_red_for_the_dearest() {
        let place = |number, x_m, cost_s| FutureRecord { position_m: [x_m, 0.5], cost_s, number };
        let places = [
            place(3, 0.0, 7.0),
            place(3, 1.0, 7.0),
            place(4, 0.0, f64::from(f32::MAX)),
            place(9, 0.0, 2.0),
            place(9, 1.0, 2.0),
            place(9, 2.0, 2.0),
        ];
        let told = futures(&Header::default(), &places);
        let lengths: Vec<_> = told.markers.iter().map(|line| line.points.len()).collect();
        assert_eq!(lengths, [2, 1, 3]);
        let colors: Vec<_> = told.markers.iter().map(|line| ColorRgba { a: 1.0, ..line.color }).collect();
        assert_eq!(colors, [between(0.5), SLOW, FAST]);
        let ids: Vec<_> = told.markers.iter().map(|line| line.id).collect();
        assert_eq!(ids, [0, 1, 2], "of one name in one space, a marker would replace the others");
        assert_eq!(told.markers[2].points[2], Point { x: 2.0, y: 0.5, z: 0.0 });
        assert!(futures(&Header::default(), &[]).markers.is_empty());
    }

    #[test]
    fn what_moves_is_as_wide_as_it_is_and_points_to_where_it_will_be() {
        let track = TrackRecord {
            number: 7,
            position_m: [1.0, 2.0],
            velocity_mps: [0.5, -1.0],
            radius_m: 0.4,
            ..TrackRecord::default()
        };
        let told = moving(&Header::default(), &[track]);
        let [body, arrow] = &told.markers[..] else { panic!("a body and an arrow: {told:?}") };
        assert_eq!((body.id, arrow.id, body.scale.x), (7, 7, 0.8));
        assert_eq!(arrow.points[1], Point { x: 1.5, y: 1.0, z: 0.0 });
        assert_ne!(body.ns, arrow.ns, "two markers, not one that replaces the other");
    }
}
