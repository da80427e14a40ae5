//! How a vehicle stands: equilibrium of the sprung body on four wheels, and on its belly where it hangs up.

use bicycle::{Axle, Vehicle};
use nalgebra::{Matrix3, Vector3};

use super::forces::{Forces, WheelSpring};
use super::ground::Ground;

/// Acceleration of gravity [m/s2].
pub(super) const GRAVITY_MPS2: f64 = 9.81;

/// Places along a wheel where the ground is taken, over its radius.
const STATIONS: [f64; 9] = [-0.96, -0.72, -0.48, -0.24, 0.0, 0.24, 0.48, 0.72, 0.96];
/// Between two of them.
const STATION_STEP: f64 = 0.24;
/// Depth of the rim below the hub at these places, over the radius: sqrt(1 - station^2).
const RIM: [f64; 9] = [0.28, 0.694, 0.8773, 0.9708, 1.0, 0.9708, 0.8773, 0.694, 0.28];
/// Where the body's underside is compared with the ground: over the wheelbase, and over the width.
const BELLY_ALONG: [f64; 5] = [0.1, 0.3, 0.5, 0.7, 0.9];
const BELLY_ACROSS: [f64; N_ACROSS] = [-0.45, -0.225, 0.0, 0.225, 0.45];
const N_ACROSS: usize = 5;
/// How far ahead of the bumper ground counts as touched: whoever drives on meets it at once. Over the length.
const BUMPER_AHEAD: f64 = 0.03;
const N_UNDERSIDE: usize = (BELLY_ALONG.len() + 2) * N_ACROSS;
/// Stiffness of each point of the underside over that of a wheel [-].
const BELLY_RATIO: f64 = 10.0;
/// Ground within this share of the clearance may touch the belly once the springs have given way [-].
const NEAR_SHARE: f64 = 0.6;
/// The contacts are taken anew for an attitude that differs by more than this from the one they were taken for [-].
const TURN_MIN: f64 = 0.05;
const PASSES: usize = 3;
/// Largest sine of roll or pitch: whoever stands steeper has fallen over [-].
const SINE_MAX: f64 = 0.9;

/// A vehicle reduced to what statics need. Wheels in the order front left, front right, rear left, rear right.
#[derive(Clone, Debug)]
pub(super) struct Statics {
    pub(super) vehicle: Vehicle,
    pub(super) weight_n: f64,
    /// Wheels ahead of the rear axle and left of the middle [m].
    pub(super) wheel_m: [[f64; 2]; 4],
    springs: [WheelSpring; 4],
    /// Anti-roll force per difference of the ground's height between left and right [N/m], front and rear.
    anti_roll_n_per_m: [f64; 2],
    cog_ahead_m: f64,
    cog_height_m: f64,
    /// Hub above the ground under the static load [m].
    hub_height_m: f64,
    underside: [Underside; N_UNDERSIDE],
}

/// The vehicle at rest at a pose.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stand {
    /// Height of the rear axle's centre [m].
    pub axle_m: f64,
    /// Sine of the pitch.
    pub pitch_sine: f64,
    /// Rise of the body's left axis: sin(roll) cos(pitch).
    pub left_rise: f64,
    /// Vertical load of each wheel [N].
    pub load_n: [f64; 4],
    /// Rise of the ground under each wheel along the heading [-].
    pub slope: [f64; 4],
    /// Where each wheel touches, in the map [m].
    pub contact_m: [[f64; 2]; 4],
    /// Load on the belly [N], and the ground's rise there along the heading [-].
    pub belly_n: f64,
    pub belly_slope: f64,
}

impl Stand {
    pub(super) fn pitch_rad(&self) -> f64 {
        self.pitch_sine.asin()
    }

    pub(super) fn roll_rad(&self) -> f64 {
        (self.left_rise / self.pitch_cosine()).clamp(-1.0, 1.0).asin()
    }

    pub(super) fn pitch_cosine(&self) -> f64 {
        (1.0 - self.pitch_sine * self.pitch_sine).sqrt()
    }

    /// Upward share of the body's upward axis: cos(roll) cos(pitch).
    fn upright(&self) -> f64 {
        (1.0 - self.pitch_sine * self.pitch_sine - self.left_rise * self.left_rise).max(0.05).sqrt()
    }
}

/// A place to ask the ground from: position and heading.
#[derive(Clone, Copy)]
struct Place {
    x_m: f64,
    y_m: f64,
    cos: f64,
    sin: f64,
}

impl Place {
    fn at(&self, ahead_m: f64, left_m: f64) -> [f64; 2] {
        [self.x_m + self.cos * ahead_m - self.sin * left_m, self.y_m + self.sin * ahead_m + self.cos * left_m]
    }
}

/// Height at which the hubs' plane would just touch, for each point of the underside [m].
type Touches = [f64; N_UNDERSIDE];

/// A point of the body's underside.
#[derive(Clone, Copy, Debug)]
struct Underside {
    /// Ahead of the rear axle and left of the middle [m].
    at_m: [f64; 2],
    /// Below the hubs' plane [m].
    below_m: f64,
}

/// The belly between the axles; what hangs over front and rear ends at hub height, out of the ground's way.
fn underside(vehicle: &Vehicle, hub_height_m: f64) -> [Underside; N_UNDERSIDE] {
    let geometry = &vehicle.geometry;
    let belly_m = hub_height_m - geometry.ground_clearance_m;
    let front_m = (1.0 + BUMPER_AHEAD) * geometry.length_m - geometry.rear_overhang_m;
    let ends_m = [-geometry.rear_overhang_m, front_m];
    std::array::from_fn(|index| {
        let (place, across) = (index / N_ACROSS, BELLY_ACROSS[index % N_ACROSS]);
        let (ahead_m, below_m) = match BELLY_ALONG.get(place) {
            Some(along) => (along * geometry.wheelbase_m, belly_m),
            None => (ends_m[place - BELLY_ALONG.len()], belly_m.min(0.0)),
        };
        Underside { at_m: [ahead_m, across * geometry.width_m], below_m }
    })
}

impl Statics {
    pub(super) fn new(vehicle: &Vehicle) -> Self {
        let (geometry, body, wheel) = (&vehicle.geometry, &vehicle.body, &vehicle.wheel);
        let wheels_kg = 4.0 * wheel.mass_kg;
        let mass_kg = body.mass_kg + wheels_kg;
        let mean = |of_body: f64, of_wheels: f64| (body.mass_kg * of_body + wheels_kg * of_wheels) / mass_kg;
        let cog_ahead_m = mean(body.cog_ahead_m, 0.5 * geometry.wheelbase_m);
        let weight_n = mass_kg * GRAVITY_MPS2;
        let front_n = 0.5 * weight_n * cog_ahead_m / geometry.wheelbase_m;
        let rear_n = 0.5 * weight_n - front_n;
        let tyre_n_per_m = vehicle.tyre.radial_stiffness_n_per_m;
        let front = WheelSpring::new(&vehicle.front, tyre_n_per_m, front_n);
        let rear = WheelSpring::new(&vehicle.rear, tyre_n_per_m, rear_n);
        let half_m = 0.5 * geometry.track_m;
        let hub_height_m = geometry.wheel_radius_m - 0.25 * weight_n / tyre_n_per_m;
        let anti_roll = |axle: &Axle| axle.anti_roll_nm_per_rad / (geometry.track_m * geometry.track_m);
        Self {
            weight_n,
            wheel_m: [
                [geometry.wheelbase_m, half_m],
                [geometry.wheelbase_m, -half_m],
                [0.0, half_m],
                [0.0, -half_m],
            ],
            springs: [front, front, rear, rear],
            anti_roll_n_per_m: [anti_roll(&vehicle.front), anti_roll(&vehicle.rear)],
            cog_ahead_m,
            cog_height_m: mean(body.cog_height_m, geometry.wheel_radius_m),
            hub_height_m,
            underside: underside(vehicle, hub_height_m),
            vehicle: vehicle.clone(),
        }
    }

    /// Static load of the front axle [N].
    pub(super) fn front_rest_n(&self) -> f64 {
        2.0 * self.springs[0].rest_n
    }

    /// Finds the equilibrium with the rear axle's centre above a point of the map.
    pub(super) fn stand(&self, ground: &Ground, x_m: f64, y_m: f64, yaw_rad: f64) -> Stand {
        let (sin, cos) = yaw_rad.sin_cos();
        let place = Place { x_m, y_m, cos, sin };
        let mut stand = self.first_guess(ground, &place);
        // Where the wheels touch depends on the attitude, and the attitude on where they touch.
        let touches = self.touches(ground, &place, &stand);
        for pass in 1..=PASSES {
            let guess = stand;
            let ground_m = self.wheels_on_ground(ground, &place, &mut stand);
            self.balance(&ground_m, touches.as_ref(), &mut stand);
            let turn = [stand.pitch_sine - guess.pitch_sine, stand.left_rise - guess.left_rise];
            if pass == PASSES || turn[0].abs().max(turn[1].abs()) < TURN_MIN {
                break;
            }
            // Half way: on a steep slope contacts and attitude drive each other too far in turn.
            stand.pitch_sine -= 0.5 * turn[0];
            stand.left_rise -= 0.5 * turn[1];
        }
        let deepest = touches.and_then(|touches| self.deepest(&touches, &stand));
        stand.belly_slope = deepest.map_or(0.0, |at_m| self.belly_slope(ground, &place, at_m));
        stand
    }

    /// The plane through the ground's heights below the wheels.
    fn first_guess(&self, ground: &Ground, place: &Place) -> Stand {
        let height_m = self.wheel_m.map(|[ahead_m, left_m]| ground.height_m(place.at(ahead_m, left_m)));
        let geometry = &self.vehicle.geometry;
        let [front_left, front_right, rear_left, rear_right] = height_m;
        let pitch = 0.5 * (rear_left + rear_right - front_left - front_right) / geometry.wheelbase_m;
        let roll = 0.5 * (front_left + rear_left - front_right - rear_right) / geometry.track_m;
        Stand {
            axle_m: 0.5 * (rear_left + rear_right) + self.hub_height_m,
            pitch_sine: pitch / pitch.hypot(1.0),
            left_rise: roll / roll.hypot(1.0),
            load_n: self.springs.map(|spring| spring.rest_n),
            slope: [0.0; 4],
            contact_m: [[0.0; 2]; 4],
            belly_n: 0.0,
            belly_slope: 0.0,
        }
    }

    /// Height of each hub on its ground, unloaded tyre less static deflection, for wheels tilted as `stand` is [m].
    fn wheels_on_ground(&self, ground: &Ground, place: &Place, stand: &mut Stand) -> [f64; 4] {
        let upright = stand.upright();
        let (pitch_cosine, radius_m) = (stand.pitch_cosine(), self.vehicle.geometry.wheel_radius_m);
        let roll_cosine = upright / pitch_cosine;
        let roll_sine = stand.left_rise / pitch_cosine;
        let sunk_m = (radius_m - self.hub_height_m) * upright;
        std::array::from_fn(|i| {
            let [ahead_m, left_m] = self.wheel_m[i];
            // The hub's place, and the foot of a wheel that leans out of the vertical by the roll.
            let hub_ahead_m = pitch_cosine * ahead_m + roll_sine * stand.pitch_sine * left_m;
            let foot_left_m = roll_cosine * left_m + roll_sine * radius_m;
            let contact = self.rim_contact(ground, place, [hub_ahead_m, foot_left_m], roll_cosine);
            stand.slope[i] = contact[1];
            stand.contact_m[i] = place.at(hub_ahead_m + contact[2], foot_left_m);
            contact[0] - sunk_m
        })
    }

    /// Height of the hub of an unloaded wheel on the ground, the ground's rise at the contact, and how far the contact
    /// is ahead of the hub.
    fn rim_contact(
        &self,
        ground: &Ground,
        place: &Place,
        [ahead_m, left_m]: [f64; 2],
        lean: f64,
    ) -> [f64; 3] {
        let radius_m = self.vehicle.geometry.wheel_radius_m;
        let side_m = 0.3 * self.vehicle.wheel.width_m;
        let step_m = STATION_STEP * radius_m;
        let [left_m, right_m] = [left_m + side_m, left_m - side_m].map(|left_m| {
            let first_m = place.at(ahead_m + STATIONS[0] * radius_m, left_m);
            ground.run_m::<9>(first_m, [place.cos * step_m, place.sin * step_m])
        });
        // A tread half on a step is two springs of half the stiffness side by side: it sinks half way to the lower side,
        // or, where that bears nothing, by the static deflection once more.
        let sunk_m = radius_m - self.hub_height_m;
        let hub_m: [f64; 9] = std::array::from_fn(|k| {
            let [high_m, low_m] = [left_m[k].max(right_m[k]), left_m[k].min(right_m[k])];
            high_m - (0.5 * (high_m - low_m)).min(sunk_m) + RIM[k] * radius_m * lean
        });
        let best = (0..9).fold(4, |best, k| if hub_m[k] > hub_m[best] { k } else { best });
        let slope = slope_at_contact(&hub_m.map(|hub_m| hub_m / radius_m), best, lean);
        [hub_m[best], slope, slope / slope.hypot(1.0) * radius_m]
    }

    /// Newton's iteration on heave, pitch and roll until springs and gravity balance; a step that overshoots a wheel's
    /// lift-off or the belly's touch is halved.
    fn balance(&self, ground_m: &[f64; 4], touches: Option<&Touches>, stand: &mut Stand) {
        let wheelbase_m = self.vehicle.geometry.wheelbase_m;
        let excess = |forces: &Forces| forces.excess(self.weight_n, wheelbase_m);
        let mut forces = self.forces(ground_m, touches, stand);
        for _ in 0..16 {
            if excess(&forces) < 1e-3 {
                break;
            }
            let Some(step) = forces.stiffness.lu().solve(&forces.balance) else { break };
            let mut share = 1.0;
            loop {
                let mut trial = *stand;
                trial.axle_m -= share * step[0];
                trial.pitch_sine = (trial.pitch_sine - share * step[1]).clamp(-SINE_MAX, SINE_MAX);
                trial.left_rise = (trial.left_rise - share * step[2]).clamp(-SINE_MAX, SINE_MAX);
                let after = self.forces(ground_m, touches, &trial);
                share *= 0.5;
                if excess(&after) < excess(&forces) || share < 0.05 {
                    (*stand, forces) = (trial, after);
                    break;
                }
            }
        }
        stand.load_n = forces.load_n;
        stand.belly_n = forces.belly_n;
    }

    /// What the ground and gravity do to a body that stands so.
    fn forces(&self, ground_m: &[f64; 4], touches: Option<&Touches>, stand: &Stand) -> Forces {
        let upright = stand.upright();
        let mut forces = self.gravity(stand);
        let rises_m: [f64; 4] =
            std::array::from_fn(|i| (ground_m[i] - self.plane_m(stand, self.wheel_m[i])) * upright);
        let laws = [0, 1, 2, 3].map(|i: usize| self.springs[i].at(rises_m[i]));
        for i in 0..4 {
            let (left, right) = (i & !1, i | 1);
            let sign = if i == left { 1.0 } else { -1.0 };
            let bar_n = sign * self.anti_roll_n_per_m[i / 2] * (rises_m[left] - rises_m[right]);
            let carries = laws[left][0] > 0.0 && laws[right][0] > 0.0;
            let force_n = if carries { (laws[i][0] + bar_n).max(0.0) } else { laws[i][0] };
            forces.load_n[i] = force_n;
            forces.push(self.wheel_m[i], force_n, laws[i][1] * upright);
        }
        let n_per_m = BELLY_RATIO * self.springs[0].stiffness_n_per_m;
        for (point, touch_m) in self.underside.iter().zip(touches.into_iter().flatten()) {
            let depth_m = (touch_m - self.plane_m(stand, point.at_m)) * upright;
            if depth_m > 0.0 {
                forces.belly_n += n_per_m * depth_m;
                forces.push(point.at_m, n_per_m * depth_m, n_per_m * upright);
            }
        }
        forces
    }

    /// Gravity, and the friction at the contacts that holds the body on the slope.
    fn gravity(&self, stand: &Stand) -> Forces {
        let weight_n = self.weight_n * stand.upright();
        let tipping_nm = self.weight_n * self.cog_height_m;
        Forces {
            balance: -Vector3::new(
                weight_n,
                weight_n * self.cog_ahead_m + tipping_nm * stand.pitch_sine,
                -tipping_nm * stand.left_rise,
            ),
            stiffness: Matrix3::from_diagonal(&Vector3::new(0.0, -tipping_nm, tipping_nm)),
            load_n: [0.0; 4],
            belly_n: 0.0,
        }
    }

    /// Height of the hubs' plane above a point of the body [m].
    #[inline]
    fn plane_m(&self, stand: &Stand, [ahead_m, left_m]: [f64; 2]) -> f64 {
        stand.axle_m - ahead_m * stand.pitch_sine + left_m * stand.left_rise
    }

    /// Rise of the ground at a point of the underside along the heading. A bumper is stopped by the face it has reached,
    /// however flat the top behind that is.
    fn belly_slope(&self, ground: &Ground, place: &Place, [ahead_m, left_m]: [f64; 2]) -> f64 {
        let geometry = &self.vehicle.geometry;
        let run_m = 2.0 * BUMPER_AHEAD * geometry.length_m;
        let before_m = if ahead_m > geometry.wheelbase_m { run_m } else { 0.5 * run_m };
        let [from_m, to_m] = [ahead_m - before_m, ahead_m - before_m + run_m]
            .map(|ahead_m| ground.height_m(place.at(ahead_m, left_m)));
        (to_m - from_m) / run_m
    }

    /// Where the underside would touch; nothing when the ground is far below all of it.
    fn touches(&self, ground: &Ground, place: &Place, stand: &Stand) -> Option<Touches> {
        let (upright, pitch_cosine) = (stand.upright(), stand.pitch_cosine());
        let (along, across) = (pitch_cosine, upright / pitch_cosine);
        let mut touches = [0.0; N_UNDERSIDE];
        let rows = self.underside.as_chunks::<N_ACROSS>().0;
        for (row, touches) in rows.iter().zip(touches.as_chunks_mut::<N_ACROSS>().0) {
            let [first_m, next_m] =
                [row[0], row[1]].map(|point| place.at(point.at_m[0] * along, point.at_m[1] * across));
            let step_m = [next_m[0] - first_m[0], next_m[1] - first_m[1]];
            *touches =
                ground.run_m::<N_ACROSS>(first_m, step_m).map(|height_m| height_m + row[0].below_m * upright);
        }
        let near_m = NEAR_SHARE * self.vehicle.geometry.ground_clearance_m;
        let mut places = self.underside.iter().zip(&touches);
        let is_near = places.any(|(point, touch_m)| touch_m - self.plane_m(stand, point.at_m) > -near_m);
        is_near.then_some(touches)
    }

    /// Where the ground reaches deepest into the body, if it does.
    fn deepest(&self, touches: &Touches, stand: &Stand) -> Option<[f64; 2]> {
        let depths_m = self
            .underside
            .iter()
            .zip(touches)
            .map(|(point, touch_m)| (point.at_m, touch_m - self.plane_m(stand, point.at_m)));
        depths_m
            .filter(|(_, depth_m)| *depth_m > 0.0)
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(at_m, _)| at_m)
    }
}

/// Rise of the ground where a wheel touches it, from the hub's heights over the radius at all stations, the highest
/// one known: the ground is a chain of straight pieces, and the rim lies on a piece where it has the piece's slope,
/// or else on the kink between two.
fn slope_at_contact(hub: &[f64; 9], best: usize, lean: f64) -> f64 {
    let ground_rise = |from: usize, to: usize| {
        let ground = |k: usize| hub[k] - RIM[k] * lean;
        (ground(to) - ground(from)) / STATION_STEP
    };
    let rim_rise = STATIONS[best] / RIM[best] * lean;
    let behind = if best > 0 { ground_rise(best - 1, best) } else { rim_rise };
    let ahead = if best < 8 { ground_rise(best, best + 1) } else { rim_rise };
    if behind < rim_rise {
        behind
    } else if ahead > rim_rise {
        ahead
    } else {
        rim_rise
    }
}
