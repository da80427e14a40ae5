//! What moves: how it is tracked, what its nearness costs, and how near a plan may come.

use bicycle::MotionState;
use mppi::{Disc, DiscPrices, MovingDiscs, Outline};
use serde::{Deserialize, Serialize};
use terrain::BodyBox;
use tracking::{TRACKS_MAX, Track, TrackingConfig};

use crate::{Jump, TracksMessage};

/// Who leaves somebody who stands closer than he should may come closer by half of what is left, within these [m]: no way out
/// of a narrow place leads straight away.
const LEAVING_SLACK_M: [f64; 2] = [0.01, 0.05];
/// Who stands nearer to the body than this may touch it, whatever is measured: the vehicle stays where it is until he has
/// gone [m].
const TOUCHING_M: f64 = 0.1;

/// How moving obstacles are dealt with.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MovingConfig {
    /// How they are tracked.
    pub tracking: TrackingConfig,
    /// What the body keeps from them, beside their radius and their uncertainty [m], >= 0.
    pub clearance_m: f64,
    /// Standard deviations of where they will be that count as theirs, >= 0.
    pub place_std: f64,
    /// That uncertainty counts up to this [m], >= 0: whoever allowed for everything would never drive.
    pub uncertainty_max_m: f64,
    /// How much farther nearness begins to cost [m], > 0.
    pub margin_m: f64,
    /// Of a step that comes nearer than it may [s], >= 0.
    pub touch_s: f64,
    /// Of a step that comes close at 1 m/s or more, falling to nothing over the margin and towards standstill [s], >= 0.
    pub near_s: f64,
    /// How long beyond the time that it takes to stop a plan must keep away from them [s], >= 0.
    pub foresight_s: f64,
}

impl Default for MovingConfig {
    fn default() -> Self {
        Self {
            tracking: TrackingConfig::default(),
            clearance_m: 0.35,
            place_std: 1.0,
            uncertainty_max_m: 0.6,
            margin_m: 2.0,
            touch_s: 2.0,
            near_s: 1.0,
            foresight_s: 1.0,
        }
    }
}

impl MovingConfig {
    /// The first setting of its own that cannot be, with what would do.
    pub(crate) fn first_invalid(&self) -> Option<(&'static str, &'static str, f64)> {
        let not_negative = [
            ("moving.clearance_m", self.clearance_m),
            ("moving.place_std", self.place_std),
            ("moving.uncertainty_max_m", self.uncertainty_max_m),
            ("moving.touch_s", self.touch_s),
            ("moving.near_s", self.near_s),
            ("moving.foresight_s", self.foresight_s),
        ];
        let margin = ("moving.margin_m", "a finite number > 0", self.margin_m, self.margin_m > 0.0);
        let checked =
            |(field, found): (&'static str, f64)| (field, "a finite number >= 0", found, found >= 0.0);
        let mut all = not_negative.into_iter().map(checked).chain([margin]);
        all.find(|(.., found, allowed)| !(found.is_finite() && *allowed))
            .map(|(field, expected, found, _)| (field, expected, found))
    }

    /// Room for the discs of all tracks over a horizon.
    pub(crate) fn discs(&self, own_body: &BodyBox, n_steps: usize) -> MovingDiscs {
        // A body that nobody has described is a point.
        let outline = Outline {
            front_m: own_body.max_m[0].max(0.0),
            rear_m: (-own_body.min_m[0]).max(0.0),
            half_width_m: own_body.max_m[1].max(-own_body.min_m[1]).max(0.0),
        };
        let prices = DiscPrices { touch_s: self.touch_s, near_s: self.near_s, foresight_s: self.foresight_s };
        MovingDiscs::new(outline, prices, TRACKS_MAX, n_steps)
    }
}

/// When the steps of a plan are, in which frame it is made, and from where.
pub(crate) struct Horizon<'a> {
    /// Where the vehicle is, in the frame of the plan.
    pub vehicle: MotionState,
    /// From the scan that the tracks are of to the start of the first step [s].
    pub begins_s: f64,
    /// Of a step [s].
    pub step_s: f64,
    /// How the frame of the tracks lies in that of the plan; `None` where both are the same.
    pub shift: Option<&'a Jump>,
}

/// Lays the places where tracked things will be over the steps of a plan. Who stands closer than the clearance may be left,
/// but not come closer to, and who may touch the vehicle keeps it where it is.
pub(crate) fn lay_out(
    discs: &mut MovingDiscs,
    tracks: &TracksMessage,
    config: &MovingConfig,
    horizon: &Horizon<'_>,
) {
    discs.clear();
    let density_m2ps3 = config.tracking.acceleration_density_m2ps3;
    for track in tracks.tracks() {
        let track = horizon.shift.map_or(*track, |jump| carried(track, jump));
        let [east_mps, north_mps] = track.velocity_mps;
        let stands = libm::hypot(east_mps, north_mps) < config.tracking.speed_min_mps;
        let gap_m = discs.distance_m(&horizon.vehicle, track.position_m) - track.radius_m;
        let [least_m, most_m] = LEAVING_SLACK_M;
        let slack_m = (0.5 * gap_m).clamp(least_m, most_m);
        let may_be_left = stands && gap_m > TOUCHING_M;
        let clearance_max_m = if may_be_left { gap_m - slack_m } else { f64::INFINITY };
        discs.add(|t| {
            let place = track.predicted(horizon.begins_s + horizon.step_s * (t + 1) as f64, density_m2ps3);
            let uncertain_m = (config.place_std * place.std_m).min(config.uncertainty_max_m);
            Disc {
                centre_m: if stands { track.position_m } else { place.position_m },
                radius_m: place.radius_m + (config.clearance_m + uncertain_m).min(clearance_max_m),
                margin_m: config.margin_m,
            }
        });
    }
}

/// A track of one frame as another tells it.
fn carried(track: &Track, jump: &Jump) -> Track {
    let [[x_m, y_m], [east_mps, north_mps]] = [track.position_m, track.velocity_mps];
    let [x_m, y_m, _] = jump.place_m([x_m, y_m, 0.0]);
    let (sin, cos) = libm::sincos(jump.yaw_rad);
    let velocity_mps = [cos * east_mps - sin * north_mps, sin * east_mps + cos * north_mps];
    Track { position_m: [x_m, y_m], velocity_mps, ..*track }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::MessageId;
    use mppi::StepCost;
    use tracking::Variance;

    fn track(position_m: [f64; 2], velocity_mps: [f64; 2]) -> Track {
        Track { number: 1, position_m, velocity_mps, variance: Variance::default(), radius_m: 0.3 }
    }

    fn message(tracks: &[Track]) -> TracksMessage {
        TracksMessage::new(MessageId::default(), (MessageId::default(), 0), 0, tracks)
    }

    /// A point instead of a body, and exact tracks: what is forbidden is a circle of radius and clearance.
    fn config() -> MovingConfig {
        let exact = TrackingConfig { acceleration_density_m2ps3: 1e-12, ..TrackingConfig::default() };
        MovingConfig { tracking: exact, clearance_m: 0.2, ..MovingConfig::default() }
    }

    /// From a vehicle that is far away.
    fn horizon() -> Horizon<'static> {
        let vehicle = MotionState { x_m: -50.0, ..MotionState::default() };
        Horizon { vehicle, begins_s: 0.0, step_s: 0.1, shift: None }
    }

    fn forbidden(discs: &MovingDiscs, t: usize, [x_m, y_m]: [f64; 2]) -> bool {
        discs.forbids(t, &bicycle::MotionState { x_m, y_m, ..bicycle::MotionState::default() })
    }

    #[test]
    fn places_lie_where_the_tracks_lead_by_the_end_of_each_step() {
        let mut discs = config().discs(&BodyBox::EMPTY, 20);
        let horizon = Horizon { begins_s: 0.3, ..horizon() };
        lay_out(&mut discs, &message(&[track([5.0, 1.0], [-1.0, 0.5])]), &config(), &horizon);
        // Step 6 ends 1 s after the scan: at (4, 1.5) m.
        assert!(forbidden(&discs, 6, [4.0, 1.02]) && !forbidden(&discs, 6, [4.0, 0.98]));
        assert!(!forbidden(&discs, 0, [4.0, 1.5]), "not there yet");
        lay_out(&mut discs, &message(&[]), &config(), &horizon);
        assert!(discs.is_empty(), "what is told anew is all there is");
    }

    /// A quarter turn and a step: what went east goes north.
    #[test]
    fn a_frame_that_moved_takes_places_and_ways_along() {
        let mut discs = config().discs(&BodyBox::EMPTY, 20);
        let jump = Jump { step_m: [10.0, 0.0, 0.0], yaw_rad: std::f64::consts::FRAC_PI_2 };
        let horizon = Horizon { shift: Some(&jump), ..horizon() };
        lay_out(&mut discs, &message(&[track([3.0, 0.0], [1.0, 0.0])]), &config(), &horizon);
        assert!(forbidden(&discs, 9, [10.0, 4.0]) && !forbidden(&discs, 9, [4.0, 0.0]));
    }

    #[test]
    fn what_is_uncertain_is_kept_away_from_farther_but_not_without_end() {
        let variance = Variance { position_m2: 0.16, ..Variance::default() };
        let unsure = Track { variance, ..track([5.0, 0.0], [0.0; 2]) };
        let wild = Track { variance: Variance { position_m2: 1e6, ..variance }, ..unsure };
        let horizon = horizon();
        for (track, radius_m) in [(unsure, 0.9), (wild, 0.5 + MovingConfig::default().uncertainty_max_m)] {
            let mut discs = config().discs(&BodyBox::EMPTY, 5);
            lay_out(&mut discs, &message(&[track]), &config(), &horizon);
            assert!(forbidden(&discs, 0, [5.0 - radius_m + 0.01, 0.0]), "{radius_m}");
            assert!(!forbidden(&discs, 0, [5.0 - radius_m - 0.01, 0.0]), "{radius_m}");
        }
    }

    /// He stands 0.5 m from the vehicle, a point, and 0.2 m of that are between his side and it: it may be left, but not come
    /// closer to. Who walks is kept away from as ever.
    #[test]
    fn who_stands_too_close_may_be_left() {
        let vehicle = MotionState { x_m: 4.5, ..MotionState::default() };
        let variance = Variance { position_m2: 0.04, ..Variance::default() };
        let close = Track { variance, ..track([5.0, 0.0], [0.0; 2]) };
        let mut discs = config().discs(&BodyBox::EMPTY, 5);
        lay_out(&mut discs, &message(&[close]), &config(), &Horizon { vehicle, ..horizon() });
        assert!(forbidden(&discs, 4, [4.56, 0.0]) && !forbidden(&discs, 4, [4.54, 0.0]));
        let walks = Track { velocity_mps: [0.0, 0.3], ..close };
        lay_out(&mut discs, &message(&[walks]), &config(), &Horizon { vehicle, ..horizon() });
        assert!(forbidden(&discs, 0, [4.49, 0.0]), "0.3 m of radius, 0.2 of clearance, 0.2 unsure");
        // 5 cm from his side: neither on nor back.
        let vehicle = MotionState { x_m: 4.65, ..MotionState::default() };
        lay_out(&mut discs, &message(&[close]), &config(), &Horizon { vehicle, ..horizon() });
        assert!(
            [4.4, 4.65, 4.7].iter().all(|x_m| forbidden(&discs, 4, [*x_m, 0.0])),
            "he may touch the vehicle"
        );
    }

    #[test]
    fn tracks_of_no_numbers_are_left_out_and_of_too_many_the_first_are_told() {
        let good = track([1.0, 0.0], [0.0; 2]);
        let broken = Track { velocity_mps: [f64::NAN, 0.0], ..good };
        assert_eq!(message(&[broken, good, broken]).tracks(), [good]);
        assert_eq!(message(&[good; TRACKS_MAX + 3]).tracks().len(), TRACKS_MAX);
    }

    #[test]
    fn settings_that_cannot_be_are_named() {
        assert_eq!(MovingConfig::default().first_invalid(), None);
        for (bad, field) in [
            (MovingConfig { clearance_m: -0.1, ..MovingConfig::default() }, "moving.clearance_m"),
            (MovingConfig { margin_m: 0.0, ..MovingConfig::default() }, "moving.margin_m"),
            (MovingConfig { foresight_s: f64::NAN, ..MovingConfig::default() }, "moving.foresight_s"),
        ] {
            assert_eq!(bad.first_invalid().unwrap().0, field);
        }
    }
}
