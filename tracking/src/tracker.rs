//! The tracks, from scan to scan.

use terrain::{BodyBox, GridMap, Pose, Scan, SurfaceCell};

use crate::assignment::assign;
use crate::cluster::{Cluster, clusters};
use crate::filter::Estimate;
use crate::{Track, TrackingConfig, TrackingConfigError};

/// Moving things that are told of at the most, the nearest first.
pub const TRACKS_MAX: usize = 16;
/// Things that are followed at the most, whether they move or not.
const FOLLOWED_MAX: usize = 64;
/// Nearer to the vehicle's body than this a thing may be there unseen [m].
const BESIDE_M: f64 = 0.8;
/// Whoever vanished beside the vehicle while walking may be on his way to it for so long [s]; then he stands.
const NEARING_S: f64 = 3.0;
/// Where a thing stood for so long is where it may later be seen to have left [s].
const SETTLED_S: f64 = 3.0;
/// Things up to this radius, as people are, have no side that comes into view unseen so far [m].
const COMPACT_M: f64 = 0.5;
/// What has stood for a while sets off where two scans in a row show it farther from there than this, each by so much more
/// than the one before [m]. What jumps once, because it is seen together with what is beside it, does not.
const SETTING_OFF_M: f64 = 0.1;
/// What appears closer than this to something that moves was one with it in the scans before, and moves, too [m].
const PARTING_M: f64 = 0.5;
/// A scan that shows a point within this distance of a place has looked at it, however slim what stood there [m].
const LOOKED_AT_M: f64 = 0.3;
/// Shares by which a radius follows a larger and a smaller one: a scan may see one side of a thing only, or take it
/// together with what it passes.
const GROW_GAIN: f64 = 0.5;
const SHRINK_GAIN: f64 = 0.1;

/// Follows what stands above the ground from scan to scan.
///
/// Deterministic: a function of the scans, poses and surfaces since it was new.
#[derive(Clone, Debug)]
pub struct Tracker {
    config: TrackingConfig,
    own_body: BodyBox,
    followed: Vec<Followed>,
    n_seen: u64,
    scanned_at_ns: Option<u64>,
    moving: Vec<Track>,
}

/// A thing that was seen, whether it moves or not.
#[derive(Clone, Copy, Debug)]
struct Followed {
    number: u64,
    estimate: Estimate,
    radius_m: f64,
    /// Where it was first seen, or stood for a while [m].
    anchor_m: [f64; 2],
    /// Whether it was ever seen to move. Who did may set off again at any moment.
    has_moved: bool,
    n_scans: u32,
    /// Since a scan showed it.
    unseen_s: f64,
    /// Of that, while its place could be looked at.
    absent_s: f64,
    /// How fast it was when it vanished beside the vehicle [m/s]; else 0.
    vanished_mps: f64,
    standing_s: f64,
    /// Whether it has stood at its anchor for a while.
    has_settled: bool,
    /// Where the last scan that showed it did so [m].
    shown_m: [f64; 2],
}

impl Tracker {
    /// Nothing has been seen. What a scan shows inside `own_body`, of the body frame, is the vehicle itself.
    ///
    /// # Errors
    /// A setting that nothing can be tracked by.
    pub fn new(config: TrackingConfig, own_body: BodyBox) -> Result<Self, TrackingConfigError> {
        config.validate()?;
        Ok(Self {
            config,
            own_body,
            followed: Vec::new(),
            n_seen: 0,
            scanned_at_ns: None,
            moving: Vec::with_capacity(TRACKS_MAX),
        })
    }

    /// Takes in a scan that was taken at `pose` over ground that is known as `surface`. A scan that is not later than the
    /// last tells nothing of motion and is left out.
    pub fn observe(&mut self, scan: &Scan, pose: &Pose, surface: &GridMap<SurfaceCell>) {
        let elapsed_ns = match self.scanned_at_ns {
            Some(then_ns) if scan.valid_at_ns <= then_ns => return,
            then_ns => scan.valid_at_ns - then_ns.unwrap_or(scan.valid_at_ns),
        };
        self.scanned_at_ns = Some(scan.valid_at_ns);
        let elapsed_s = elapsed_ns as f64 * 1e-9;
        let is_beside = |followed: &Followed| is_beside(&self.own_body, pose, followed.estimate.position_m);
        for followed in &mut self.followed {
            if followed.unseen_s > 0.0 && is_beside(followed) {
                // Who vanishes there has not walked through the vehicle.
                followed.vanished_mps = followed.vanished_mps.max(followed.estimate.speed_mps());
                followed.estimate.velocity_mps = [0.0; 2];
            }
            followed.estimate.predict(elapsed_s, self.config.acceleration_density_m2ps3);
        }
        let seen = clusters(scan, pose, surface, &self.own_body, &self.config, FOLLOWED_MAX);
        let is_new = self.follow(&seen, elapsed_s);
        self.look_for_unseen(scan, pose, elapsed_s);
        self.give_up();
        for cluster in seen.iter().zip(is_new).filter_map(|(cluster, is_new)| is_new.then_some(cluster)) {
            self.begin(cluster);
        }
        self.tell([pose.x_m, pose.y_m]);
    }

    /// What moves, has moved and stands, or stands and is no larger than people, at the time of the last scan; the nearest
    /// to the vehicle first, at most [`TRACKS_MAX`].
    pub fn moving(&self) -> &[Track] {
        &self.moving
    }

    /// The frame moved: a pose of before, east, north [m] and yaw [rad], lies where `carry` takes it.
    pub fn carry(&mut self, carry: impl Fn([f64; 3]) -> [f64; 3]) {
        let place_m = |[x_m, y_m]: [f64; 2]| {
            let [x_m, y_m, _] = carry([x_m, y_m, 0.0]);
            [x_m, y_m]
        };
        let from_m = place_m([0.0; 2]);
        let turned = |vector: [f64; 2]| {
            let to_m = place_m(vector);
            [to_m[0] - from_m[0], to_m[1] - from_m[1]]
        };
        for followed in &mut self.followed {
            followed.anchor_m = place_m(followed.anchor_m);
            followed.shown_m = place_m(followed.shown_m);
            followed.estimate.position_m = place_m(followed.estimate.position_m);
            followed.estimate.velocity_mps = turned(followed.estimate.velocity_mps);
        }
        for track in &mut self.moving {
            track.position_m = place_m(track.position_m);
            track.velocity_mps = turned(track.velocity_mps);
        }
    }

    /// Forgets all: the clock was set, and nobody knows how far things have moved since.
    pub fn forget(&mut self) {
        self.followed.clear();
        self.moving.clear();
        self.scanned_at_ns = None;
    }

    /// Lets the tracks follow the clusters that are theirs; returns of each cluster whether it is nobody's.
    fn follow(&mut self, seen: &[Cluster], elapsed_s: f64) -> Vec<bool> {
        let config = self.config;
        let gate = config.gate_std * config.gate_std;
        let costs: Vec<f64> = self
            .followed
            .iter()
            .flat_map(|followed| seen.iter().map(|cluster| followed.cost(cluster, elapsed_s, &config)))
            .collect();
        let mut is_new = vec![true; seen.len()];
        let pairs = assign(&costs, seen.len(), gate).into_iter().chain(std::iter::repeat(None));
        for (followed, pair) in self.followed.iter_mut().zip(pairs) {
            match pair {
                Some(place) => {
                    is_new[place] = false;
                    followed.see(&seen[place], elapsed_s, &config);
                }
                None => followed.unseen_s += elapsed_s,
            }
        }
        is_new
    }

    /// Counts how long things have been gone from where they were last seen. Beside the vehicle a place from which nothing
    /// comes back was not looked at, and whoever stood there still does.
    fn look_for_unseen(&mut self, scan: &Scan, pose: &Pose, elapsed_s: f64) {
        for followed in self.followed.iter_mut().filter(|followed| followed.unseen_s > 0.0) {
            let place_m = followed.estimate.position_m;
            let is_hidden = is_beside(&self.own_body, pose, place_m)
                && !is_looked_at(scan, pose, place_m, followed.radius_m.max(LOOKED_AT_M), &self.own_body);
            followed.absent_s += if is_hidden { 0.0 } else { elapsed_s };
        }
    }

    /// Gives up what is gone for long: sooner what is not known to move.
    fn give_up(&mut self) {
        let TrackingConfig { unseen_max_s, hidden_max_s, radius_max_m, .. } = self.config;
        self.followed.retain(|followed| {
            let most_s = if followed.has_moved { unseen_max_s } else { 0.5 * unseen_max_s };
            followed.absent_s <= most_s
                && followed.unseen_s <= hidden_max_s
                && followed.radius_m <= radius_max_m
        });
    }

    fn begin(&mut self, cluster: &Cluster) {
        if self.followed.len() == FOLLOWED_MAX {
            return;
        }
        self.n_seen += 1;
        let speed_mps = 0.5 * self.config.speed_max_mps;
        let noise_m2 = noise_m2(cluster, &self.config);
        let has_moved = self.followed.iter().any(|other| other.has_moved && other.parts_with(cluster));
        self.followed.push(Followed {
            number: self.n_seen,
            estimate: Estimate::new(cluster.centre_m, noise_m2, speed_mps * speed_mps),
            radius_m: cluster.radius_m,
            anchor_m: cluster.centre_m,
            has_moved,
            n_scans: 1,
            unseen_s: 0.0,
            vanished_mps: 0.0,
            absent_s: 0.0,
            standing_s: 0.0,
            has_settled: false,
            shown_m: cluster.centre_m,
        });
    }

    fn tell(&mut self, from_m: [f64; 2]) {
        self.moving.clear();
        let config = &self.config;
        let is_told = |followed: &&Followed| followed.may_move(config);
        let mut moving: Vec<Track> = self.followed.iter().filter(is_told).map(Followed::track).collect();
        let distance_m =
            |track: &Track| libm::hypot(track.position_m[0] - from_m[0], track.position_m[1] - from_m[1]);
        moving.sort_by(|a, b| distance_m(a).total_cmp(&distance_m(b)));
        self.moving.extend(moving.iter().take(TRACKS_MAX));
    }
}

impl Followed {
    /// How little a cluster looks like this thing: squared standard deviations; beyond all measure where it would have
    /// been faster than anything is.
    fn cost(&self, cluster: &Cluster, elapsed_s: f64, config: &TrackingConfig) -> f64 {
        let noise_m2 = noise_m2(cluster, config);
        let [east_m, north_m] = [0, 1].map(|axis| cluster.centre_m[axis] - self.estimate.position_m[axis]);
        let reach_m = config.speed_max_mps * (elapsed_s + self.unseen_s) + config.gate_std * noise_m2.sqrt();
        if libm::hypot(east_m, north_m) > reach_m {
            return f64::MAX;
        }
        self.estimate.squared_distance(cluster.centre_m, noise_m2)
    }

    /// Whether a cluster that is nobody's may be somebody who went together with this thing.
    fn parts_with(&self, cluster: &Cluster) -> bool {
        let [east_m, north_m] = [0, 1].map(|axis| cluster.centre_m[axis] - self.estimate.position_m[axis]);
        libm::hypot(east_m, north_m) <= self.radius_m + cluster.radius_m + PARTING_M
    }

    fn see(&mut self, cluster: &Cluster, elapsed_s: f64, config: &TrackingConfig) {
        let noise_m2 = noise_m2(cluster, config);
        if self.sets_off(cluster, config) {
            self.has_moved = true;
            // What the filter learned is of something that stands.
            self.estimate = Estimate::of_two([self.shown_m, cluster.centre_m], elapsed_s, noise_m2);
        } else {
            self.estimate.update(cluster.centre_m, noise_m2);
        }
        self.shown_m = cluster.centre_m;
        let growth_m = cluster.radius_m - self.radius_m;
        self.radius_m += growth_m * if growth_m > 0.0 { GROW_GAIN } else { SHRINK_GAIN };
        self.n_scans += 1;
        (self.unseen_s, self.absent_s, self.vanished_mps) = (0.0, 0.0, 0.0);
        self.judge_motion(elapsed_s, config);
    }

    /// Whether it leaves the place where it stood for a while, which two scans show sooner than the filter believes it.
    fn sets_off(&self, cluster: &Cluster, config: &TrackingConfig) -> bool {
        let away_m = |[x_m, y_m]: [f64; 2]| libm::hypot(x_m - self.anchor_m[0], y_m - self.anchor_m[1]);
        let [before_m, now_m] = [self.shown_m, cluster.centre_m].map(away_m);
        let goes_on = before_m > SETTING_OFF_M && now_m > before_m + SETTING_OFF_M;
        let is_news = self.has_settled && !self.has_moved && self.unseen_s == 0.0;
        is_news && self.radius_m <= COMPACT_M && goes_on && now_m > config.moved_min_m + SETTING_OFF_M
    }

    /// Whether it moves, has moved and may do so again, or stands and is no larger than people are.
    fn may_move(&self, config: &TrackingConfig) -> bool {
        let is_like_people = self.radius_m <= COMPACT_M && self.n_scans >= config.scans_min;
        self.has_moved && self.standing_s <= config.standing_max_s || is_like_people && self.unseen_s == 0.0
    }

    /// Whether it moves. What does has left the place where it was first seen, which neither a side that comes into view
    /// nor noise makes of what stands.
    fn judge_motion(&mut self, elapsed_s: f64, config: &TrackingConfig) {
        let (position_m, speed_mps) = (self.estimate.position_m, self.estimate.speed_mps());
        let is_fast = speed_mps > config.speed_min_mps;
        let away_m = libm::hypot(position_m[0] - self.anchor_m[0], position_m[1] - self.anchor_m[1]);
        let has_left = away_m > self.radius_m + config.moved_min_m;
        self.has_moved |= is_fast && has_left && self.n_scans >= config.scans_min;
        self.standing_s = if is_fast { 0.0 } else { self.standing_s + elapsed_s };
        if !self.has_moved && self.standing_s > SETTLED_S {
            // Its centre wanders slowly as other sides of it come into view.
            (self.anchor_m, self.has_settled) = (position_m, true);
        }
    }

    /// What is told of it. Who vanished beside the vehicle may be anywhere that he could have reached since.
    fn track(&self) -> Track {
        let Estimate { position_m, velocity_mps, variance } = self.estimate;
        let nearing_s = if self.unseen_s <= NEARING_S { self.unseen_s } else { 0.0 };
        let radius_m = self.radius_m + (self.vanished_mps * nearing_s).min(BESIDE_M);
        // Of what has never been seen to move the filter knows noise.
        let velocity_mps = if self.has_moved { velocity_mps } else { [0.0; 2] };
        Track { number: self.number, position_m, velocity_mps, variance, radius_m }
    }
}

/// Whether a place lies so near the vehicle that its own body, or what it does not see around it, hides what stands there.
fn is_beside(own_body: &BodyBox, pose: &Pose, [x_m, y_m]: [f64; 2]) -> bool {
    let (sin, cos) = libm::sincos(pose.yaw_rad);
    let [east_m, north_m] = [x_m - pose.x_m, y_m - pose.y_m];
    let place_m = [cos * east_m + sin * north_m, cos * north_m - sin * east_m];
    (0..2).all(|axis| {
        (own_body.min_m[axis] - BESIDE_M..=own_body.max_m[axis] + BESIDE_M).contains(&place_m[axis])
    })
}

/// Whether anything within a distance of a place, but the vehicle itself, sent a ray back.
fn is_looked_at(scan: &Scan, pose: &Pose, [x_m, y_m]: [f64; 2], within_m: f64, own_body: &BodyBox) -> bool {
    let motion = pose.isometry();
    scan.points.iter().any(|point| {
        let body_m = point.position_m.map(f64::from);
        let place = motion * nalgebra::Point3::from(body_m);
        // No comparison with what is no number holds.
        libm::hypot(place.x - x_m, place.y - y_m) <= within_m && !own_body.contains(body_m)
    })
}

/// Variance of a cluster's centre along each axis [m2].
fn noise_m2(cluster: &Cluster, config: &TrackingConfig) -> f64 {
    let std_m = config.position_noise_m + config.position_noise_per_range * cluster.range_m;
    std_m * std_m
}
